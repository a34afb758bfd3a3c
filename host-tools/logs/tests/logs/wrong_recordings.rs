//! Logs recorded wrongly in every way that is known: none may pass in silence, and the mend must be the right one.

use backseat_logs::log::plausibility::Examination;
use backseat_logs::{Column, Log, importers};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// A mistake in recording.
pub struct Wrong {
    pub name: String,
    change: Change,
    /// Lines of mappings that undo it; any one is right, for some mistakes are the same to every column of a log.
    pub mends: Vec<String>,
}

type Function = Box<dyn Fn(f64) -> f64>;

enum Change {
    /// Of the values of some columns.
    Values(Vec<(Column, Function)>),
    /// Columns become others: (target, source, factor).
    Places(Vec<(Column, Column, f64)>),
    /// Times become so many times as long.
    Time(f64),
    /// The values of these columns, together, in another order.
    Shuffled(Vec<Column>),
    /// The first value of these columns after so many is held on.
    Held(Vec<Column>, usize),
    /// The column was not recorded under its name.
    Lost(Column, &'static str),
}

impl Wrong {
    /// The columns that it changes; a wrong time changes none alone.
    fn columns(&self) -> Vec<Column> {
        match &self.change {
            Change::Values(changes) => changes.iter().map(|change| change.0).collect(),
            Change::Places(places) => places.iter().map(|place| place.0).collect(),
            Change::Time(_) => Vec::new(),
            Change::Shuffled(columns) | Change::Held(columns, _) => columns.clone(),
            Change::Lost(column, _) => vec![*column],
        }
    }

    /// The log as it would have been recorded; `None` if it has none of the columns.
    pub fn apply(&self, log: &Log) -> Option<Log> {
        let mut log = log.clone();
        let has =
            |log: &Log, mut columns: &mut dyn Iterator<Item = Column>| Iterator::all(&mut columns, |c| log.has(c));
        match &self.change {
            Change::Values(changes) => {
                if !has(&log, &mut changes.iter().map(|change| change.0)) {
                    return None;
                }
                for row in &mut log.rows {
                    for (column, change) in changes {
                        if let Some(value) = row.get(*column) {
                            row.set(*column, change(value));
                        }
                    }
                }
            }
            Change::Places(places) => {
                if !has(&log, &mut places.iter().map(|place| place.1)) {
                    return None;
                }
                for row in &mut log.rows {
                    let old = row.clone();
                    for (target, source, factor) in places {
                        row.set(*target, old.get(*source).map_or(f64::NAN, |value| factor * value));
                    }
                }
            }
            Change::Time(factor) => {
                let first = log.rows.first()?.time_us;
                for row in &mut log.rows {
                    row.time_us = ((row.time_us - first) as f64 * factor) as u64;
                }
            }
            Change::Shuffled(columns) => {
                if !has(&log, &mut columns.iter().copied()) {
                    return None;
                }
                let places: Vec<usize> =
                    (0..log.rows.len()).filter(|&row| log.rows[row].get(columns[0]).is_some()).collect();
                let mut order: Vec<usize> = places.clone();
                let mut random = 1_u64;
                for k in (1..order.len()).rev() {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    order.swap(k, (random >> 33) as usize % (k + 1));
                }
                let old = log.rows.clone();
                for (to, from) in places.into_iter().zip(order) {
                    for column in columns {
                        log.rows[to].set(*column, old[from].get(*column).unwrap_or(f64::NAN));
                    }
                }
            }
            Change::Held(columns, after) => {
                if !has(&log, &mut columns.iter().copied()) {
                    return None;
                }
                let with: Vec<usize> =
                    (0..log.rows.len()).filter(|&row| log.rows[row].get(columns[0]).is_some()).collect();
                let start = with.len() * after / 100;
                let first = log.rows[*with.get(start)?].clone();
                for row in with.into_iter().skip(start) {
                    for column in columns {
                        log.rows[row].set(*column, first.get(*column)?);
                    }
                }
            }
            Change::Lost(column, name) => {
                if !log.has(*column) {
                    return None;
                }
                log.rows.iter_mut().for_each(|row| {
                    row.set(*column, f64::NAN);
                });
                log.unused_columns.push((*name).to_owned());
            }
        }
        Some(log)
    }
}

fn line(column: Column, rest: &str) -> String {
    exchanged(column, column, rest)
}

fn exchanged(target: Column, source: Column, rest: &str) -> String {
    format!("columns.{} = {{ column = \"{}\"{rest} }}", target.name(), source.name())
}

fn values(name: &str, columns: &[Column], change: impl Fn(f64) -> f64 + Copy + 'static, rest: &str) -> Wrong {
    let lines: Vec<String> = columns.iter().map(|column| line(*column, rest)).collect();
    Wrong {
        name: name.to_owned(),
        change: Change::Values(columns.iter().map(|column| (*column, Box::new(change) as Function)).collect()),
        mends: vec![lines.join("\n")],
    }
}

fn negated(columns: &[Column]) -> Wrong {
    let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
    values(&format!("{} negated", names.join(", ")), columns, |x| -x, ", sign = -1")
}

fn swapped(a: Column, b: Column) -> Wrong {
    Wrong {
        name: format!("{} and {} exchanged", a.name(), b.name()),
        change: Change::Places(vec![(a, b, 1.0), (b, a, 1.0)]),
        mends: vec![format!("{}\n{}", exchanged(a, b, ""), exchanged(b, a, ""))],
    }
}

fn scaled(column: Column, unit: &str, factor: f64) -> Wrong {
    values(&format!("{} in {unit}", column.name()), &[column], move |x| x / factor, &format!(", unit = \"{unit}\""))
}

impl Wrong {
    /// Another line that undoes it as well.
    fn or(mut self, lines: impl Into<String>) -> Self {
        self.mends.push(lines.into());
        self
    }
}

/// Every mistake that is tried.
pub fn all() -> Vec<Wrong> {
    use Column::*;
    let dvl = [DvlU, DvlV, DvlW];
    let wrapped = |x: f64| (x + PI).rem_euclid(2.0 * PI) - PI;
    let heading =
        |name: &str, change: fn(f64) -> f64, rest: &str| values(name, &[Heading], move |x| wrapped(change(x)), rest);
    let quarter = ", offset = 1.5707963";
    let mut list = vec![
        heading("heading negated", |x| -x, ", sign = -1"),
        heading("heading from east, counter-clockwise", |x| FRAC_PI_2 - x, ", sign = -1, offset = -1.5707963"),
        heading("heading from east, clockwise", |x| x - FRAC_PI_2, quarter),
        heading("heading of the stern", |x| x + PI, ", offset = 3.1415927"),
        heading("heading from west", |x| x + FRAC_PI_2, ", offset = -1.5707963"),
        heading("heading from south, counter-clockwise", |x| PI - x, ", sign = -1, offset = -3.1415927"),
        heading("heading from west, counter-clockwise", |x| -FRAC_PI_2 - x, ", sign = -1, offset = 1.5707963"),
        values("heading in degrees", &[Heading], |x| x.to_degrees().rem_euclid(360.0), ", unit = \"deg\""),
        values("heading converted twice", &[Heading], |x| x.to_radians(), ", scale = 57.2957795"),
        swapped(GpsX, GpsY),
        negated(&[GpsX]),
        negated(&[GpsY]),
        negated(&[GpsX, GpsY]).or(line(Heading, ", offset = 3.1415927")),
        values("fixes in km", &[GpsX, GpsY], |x| x * 1e-3, ", unit = \"km\""),
        values("fixes in feet", &[GpsX, GpsY], |x| x / 0.3048, ", unit = \"ft\""),
        swapped(FinTop, FinPort), // replaced below by pairs
        negated(&[FinTop, FinBottom]).or(swapped(FinTop, FinBottom).mends[0].clone()),
        negated(&[FinPort, FinStarboard]).or(swapped(FinPort, FinStarboard).mends[0].clone()),
        negated(&[FinTop]),
        negated(&[FinBottom]),
        negated(&[FinPort]),
        negated(&[FinStarboard]),
        negated(&[FinTop, FinBottom, FinPort, FinStarboard]),
        swapped(FinTop, FinBottom).or(negated(&[FinTop, FinBottom]).mends[0].clone()),
        swapped(FinPort, FinStarboard).or(negated(&[FinPort, FinStarboard]).mends[0].clone()),
        values("fins in degrees", &[FinTop, FinBottom, FinPort, FinStarboard], f64::to_degrees, ", unit = \"deg\""),
        negated(&[Rudder]),
        negated(&[P]),
        negated(&[Q]),
        negated(&[R]),
        negated(&[Q, R]),
        negated(&[P, Q, R]),
        swapped(P, Q),
        swapped(Q, R),
        swapped(P, R),
        values("rates in degrees", &[P, Q, R], f64::to_degrees, ", unit = \"deg/s\""),
        scaled(R, "deg/s", PI / 180.0),
        values("yaw rate converted twice", &[R], f64::to_radians, ", scale = 57.2957795"),
        negated(&[Roll]),
        negated(&[Pitch]),
        swapped(Roll, Pitch),
        values("roll in degrees", &[Roll], f64::to_degrees, ", unit = \"deg\""),
        values("pitch in degrees", &[Pitch], f64::to_degrees, ", unit = \"deg\""),
        values("pitch converted twice", &[Pitch], f64::to_radians, ", scale = 57.2957795"),
        negated(&[Depth]),
        scaled(Depth, "ft", 0.3048),
        scaled(Depth, "bar", 1e5 / (1025.0 * 9.81)),
        scaled(Depth, "cm", 0.01),
        negated(&[DvlU]),
        negated(&[DvlV]),
        negated(&[DvlW]),
        negated(&[DvlV, DvlW]),
        negated(&dvl),
        swapped(DvlU, DvlV),
        swapped(DvlV, DvlW),
        swapped(DvlU, DvlW),
        values("DVL in mm/s", &dvl, |x| x * 1e3, ", unit = \"mm/s\""),
        values("DVL in cm/s", &dvl, |x| x * 1e2, ", unit = \"cm/s\""),
        values("DVL in knots", &dvl, |x| x * 3600.0 / 1852.0, ", unit = \"kn\""),
        scaled(SpeedLog, "kn", 1852.0 / 3600.0),
        scaled(SpeedLog, "cm/s", 0.01),
        negated(&[PropRpm]),
        scaled(PropRpm, "rad/s", 30.0 / PI),
        scaled(PropRpm, "1/s", 60.0),
        scaled(Range, "km", 1e3),
        values("two-way range", &[Range], |x| 2.0 * x, ", scale = 0.5000000"),
        negated(&[RangeRate]),
        scaled(RangeRate, "mm/s", 1e-3),
        swapped(ShipX, ShipY),
        negated(&[ShipX]),
        negated(&[ShipY]),
        swapped(ShipGpsX, ShipGpsY),
        negated(&[ShipGpsY]),
    ];
    let pairs = [(FinTop, FinPort), (FinBottom, FinStarboard), (FinPort, FinTop), (FinStarboard, FinBottom)];
    let at = list.iter().position(|wrong| wrong.name.starts_with("fin_top_rad and fin_port")).unwrap_or(0);
    list[at] = Wrong {
        name: "rudder and elevator exchanged".to_owned(),
        change: Change::Places(pairs.iter().map(|(a, b)| (*a, *b, 1.0)).collect()),
        mends: vec![pairs.iter().map(|(a, b)| exchanged(*a, *b, "")).collect::<Vec<_>>().join("\n")],
    };
    let ship = [(ShipX, ShipY), (ShipY, ShipX), (ShipGpsX, ShipGpsY), (ShipGpsY, ShipGpsX)];
    list.push(Wrong {
        name: "all of the ship's places exchanged".to_owned(),
        change: Change::Places(ship.iter().map(|(a, b)| (*a, *b, 1.0)).collect()),
        mends: vec![ship.iter().map(|(a, b)| exchanged(*a, *b, "")).collect::<Vec<_>>().join("\n")],
    });
    let mut other = |name: &str, change: Change, mend: &str| {
        list.push(Wrong { name: name.to_owned(), change, mends: vec![mend.to_owned()] });
    };
    other("time in ms", Change::Time(1e3), "time = { column = \"t_s\", unit = \"ms\" }");
    other("time in min", Change::Time(1.0 / 60.0), "time = { column = \"t_s\", unit = \"min\" }");
    other("time in hours", Change::Time(1.0 / 3600.0), "time = { column = \"t_s\", unit = \"h\" }");
    other("no time", Change::Time(0.0), "");
    other("heading in random order", Change::Shuffled(vec![Heading]), "");
    other("depth in random order", Change::Shuffled(vec![Depth]), "");
    other("fixes in random order", Change::Shuffled(vec![GpsX, GpsY]), "");
    other("heading frozen", Change::Held(vec![Heading], 30), "");
    other("heading frozen from the start", Change::Held(vec![Heading], 0), "");
    other("pitch frozen", Change::Held(vec![Pitch], 30), "");
    other("depth frozen", Change::Held(vec![Depth], 0), "");
    other("fixes held", Change::Held(vec![GpsX, GpsY], 30), "");
    let misspelt = "columns.fin_port_rad = { column = \"fin_prot_rad\" }";
    other("a fin misspelt", Change::Lost(FinPort, "fin_prot_rad"), misspelt);
    other("a fin missing", Change::Lost(FinBottom, "rudder_lower"), "");
    let misspelt = "columns.heading_rad = { column = \"headng_rad\" }";
    other("heading misspelt", Change::Lost(Heading, "headng_rad"), misspelt);
    list
}

/// What became of a mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Named with the line that undoes it, alone or first.
    Named,
    /// Its line is among others that explain the log as well.
    AmongOthers,
    /// Remarked with the line that undoes it.
    Remarked,
    /// Suspicious, but another mend or none is named.
    Suspicious,
    /// A test of a column that it changes is said to be impossible, or the column is remarked upon.
    Told,
    Silent,
}

/// Examines a log with a mistake; `None` if the log lacks the columns. The names of tests that a clean log does not
/// allow are those of which the log shows nothing.
pub fn judge(wrong: &Wrong, log: &Log) -> Option<(Verdict, Examination)> {
    let found = Examination::of(&wrong.apply(log)?);
    let is_wanted = |lines: &String| !wrong.mends[0].is_empty() && wrong.mends.contains(lines);
    let wanted = wrong.mends.iter().flat_map(|mend| mend.lines()).collect::<Vec<_>>();
    let mut verdict = if found.is_suspicious() { Verdict::Suspicious } else { Verdict::Silent };
    let lines: Vec<&str> = found.suspicions().filter_map(|f| f.mend.as_deref()).flat_map(str::lines).collect();
    // one finding a column, or one for all
    let is_whole = wrong.mends.iter().any(|mend| !mend.is_empty() && mend.lines().all(|line| lines.contains(&line)));
    if is_whole && lines.iter().all(|line| wanted.contains(line))
        || (wrong.mends[0].is_empty() && found.is_suspicious())
    {
        verdict = Verdict::Named;
    } else if is_whole || found.suspicions().any(|finding| finding.alternatives.iter().any(is_wanted)) {
        verdict = Verdict::AmongOthers;
    } else if found.findings.iter().any(|finding| finding.mend.as_ref().is_some_and(is_wanted)) {
        verdict = Verdict::Remarked;
    } else if verdict == Verdict::Silent
        && wrong.columns().iter().any(|column| {
            let is_untested = found.untested.iter().any(|untested| untested.columns.contains(column));
            is_untested || found.findings.iter().any(|finding| finding.column == Some(*column))
        })
    {
        verdict = Verdict::Told;
    }
    Some((verdict, found))
}

/// Verdicts by mistake, of the logs that have the columns.
pub fn table(log: &Log) -> BTreeMap<String, (Verdict, Examination)> {
    all().iter().filter_map(|wrong| Some((wrong.name.clone(), judge(wrong, log)?))).collect()
}

pub fn sample(name: &str) -> Log {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guide/samples").join(name);
    importers::read(&path).unwrap().log
}

/// Verdicts of which the log shows something, and of those the ones that name the right mend.
fn counts(table: &BTreeMap<String, (Verdict, Examination)>) -> [usize; 3] {
    let count = |of: &dyn Fn(Verdict) -> bool| table.values().filter(|(verdict, _)| of(*verdict)).count();
    [
        count(&|v| v == Verdict::Silent),
        count(&|v| !matches!(v, Verdict::Silent | Verdict::Told)),
        count(&|v| matches!(v, Verdict::Named | Verdict::AmongOthers | Verdict::Remarked)),
    ]
}

/// The logs show more or fewer of the mistakes: one in which the vehicle never dives shows no sign of a pitch.
#[test]
fn no_wrong_recording_that_a_log_shows_passes_in_silence() {
    for (name, least) in [("dive.csv.gz", 80), ("trial_vehicle.csv.gz", 50), ("iver_survey.csv.gz", 29)] {
        let log = sample(name);
        let table = table(&log);
        let [silent, shown, right] = counts(&table);
        let missed: Vec<&String> =
            table.iter().filter(|(_, found)| found.0 >= Verdict::Suspicious).map(|(n, _)| n).collect();
        assert_eq!(silent, 0, "{name}: {missed:?}");
        assert!(shown >= least, "{name}: {shown} shown, {missed:?}");
        assert!(right * 10 >= shown * 9, "{name}: {right} of {shown}, {missed:?}");
    }
}

#[test]
fn what_is_recorded_rightly_is_not_accused() {
    for name in ["dive.csv.gz", "trial_vehicle.csv.gz", "iver_survey.csv.gz", "other_maker.csv.gz"] {
        let Ok(imported) =
            importers::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guide/samples").join(name))
        else {
            continue;
        };
        let found = Examination::of(&imported.log);
        assert!(!found.is_suspicious(), "{name}: {:?}", found.findings);
    }
}

/// A mend is text for a mapping: read by it, the wrong log is the right one.
#[test]
fn a_mapping_with_the_mend_reads_the_right_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.csv");
    let log = sample("dive.csv.gz");
    for name in
        ["heading negated", "heading from east, counter-clockwise", "gps_x_m and gps_y_m exchanged", "depth_m in ft"]
    {
        let wrong = all().into_iter().find(|wrong| wrong.name == name).unwrap();
        let wrong_log = wrong.apply(&log).unwrap();
        let found = Examination::of(&wrong_log);
        let mend = found.suspicions().next().unwrap().mend.clone().unwrap();
        let columns = [Column::Heading, Column::GpsX, Column::GpsY, Column::Depth];
        let mut text = format!("t_s,{}\n", columns.map(Column::name).join(","));
        let cell = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        for row in &wrong_log.rows {
            text +=
                &format!("{},{}\n", row.time_us as f64 * 1e-6, columns.map(|column| cell(row.get(column))).join(","));
        }
        std::fs::write(&path, text).unwrap();
        let mut map = format!("time = {{ column = \"t_s\" }}\n{mend}\n");
        for column in columns.iter().filter(|column| !mend.contains(&format!("columns.{} =", column.name()))) {
            map += &format!("columns.{0} = {{ column = \"{0}\" }}\n", column.name());
        }
        let map = importers::ColumnMap::parse(&map, Path::new("mend.toml")).unwrap();
        let mended = importers::read_mapped(&path, &map).unwrap().log;
        for column in columns {
            for ((_, a), (_, b)) in mended.column(column).zip(log.column(column)) {
                let apart = if column == Column::Heading {
                    (a - b).sin().abs().max(1.0 - (a - b).cos())
                } else {
                    (a - b).abs()
                };
                // digits of the offset in the mend, and of a depth in feet
                assert!(apart < 1e-6, "{name}: {} {a} {b}", column.name());
            }
        }
    }
}
