//! Every wrong recording that is tried, with the lines of a mapping that undo it.

use super::change::{Change, Function, Wrong};
use backseat_logs::Column;
use std::f64::consts::{FRAC_PI_2, PI};

fn line(column: Column, rest: &str) -> String {
    exchanged(column, column, rest)
}

fn exchanged(target: Column, source: Column, rest: &str) -> String {
    format!("columns.{} = {{ column = \"{}\"{rest} }}", target.name(), source.name())
}

pub fn values(name: &str, columns: &[Column], change: impl Fn(f64) -> f64 + Copy + 'static, rest: &str) -> Wrong {
    let lines: Vec<String> = columns.iter().map(|column| line(*column, rest)).collect();
    Wrong {
        name: name.to_owned(),
        change: Change::Values(columns.iter().map(|column| (*column, Box::new(change) as Function)).collect()),
        mends: vec![lines.join("\n")],
    }
}

pub fn negated(columns: &[Column]) -> Wrong {
    let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
    values(&format!("{} negated", names.join(", ")), columns, |x| -x, ", sign = -1")
}

pub fn swapped(a: Column, b: Column) -> Wrong {
    pairs(&format!("{} and {} exchanged", a.name(), b.name()), &[(a, b)])
}

pub fn other(name: &str, change: Change, mend: &str) -> Wrong {
    Wrong { name: name.to_owned(), change, mends: vec![mend.to_owned()] }
}

/// Columns become others, times a factor; a mapping undoes it by these lines.
pub fn places(name: &str, places: &[(Column, Column, f64)], undone: &[(Column, Column, &str)]) -> Wrong {
    let lines: Vec<String> = undone.iter().map(|(target, source, rest)| exchanged(*target, *source, rest)).collect();
    other(name, Change::Places(places.to_vec()), &lines.join("\n"))
}

/// Pairs of columns that are exchanged, each by itself.
pub fn pairs(name: &str, pairs: &[(Column, Column)]) -> Wrong {
    let both: Vec<(Column, Column)> = pairs.iter().flat_map(|(a, b)| [(*a, *b), (*b, *a)]).collect();
    let lines: Vec<(Column, Column, &str)> = both.iter().map(|(a, b)| (*a, *b, "")).collect();
    places(name, &both.iter().map(|(a, b)| (*a, *b, 1.0)).collect::<Vec<_>>(), &lines)
}

fn scaled(column: Column, unit: &str, factor: f64) -> Wrong {
    values(&format!("{} in {unit}", column.name()), &[column], move |x| x / factor, &format!(", unit = \"{unit}\""))
}

impl Wrong {
    /// Another line that undoes it as well.
    pub fn or(mut self, lines: impl Into<String>) -> Self {
        self.mends.push(lines.into());
        self
    }
}

/// Those that the tests of columns were tried on while they were written.
pub fn known() -> Vec<Wrong> {
    let mut list = first();
    list.extend(looked_at());
    list.extend(later());
    list
}

fn first() -> Vec<Wrong> {
    use Column::*;
    let dvl = [DvlU, DvlV, DvlW];
    let wrapped = |x: f64| (x + PI).rem_euclid(2.0 * PI) - PI;
    let heading =
        |name: &str, change: fn(f64) -> f64, rest: &str| values(name, &[Heading], move |x| wrapped(change(x)), rest);
    let quarter = ", offset = 1.5707963";
    vec![
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
        pairs("rudder and elevator exchanged", &[(FinTop, FinPort), (FinBottom, FinStarboard)]),
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
        pairs("all of the ship's places exchanged", &[(ShipX, ShipY), (ShipGpsX, ShipGpsY)]),
        other("time in ms", Change::Time(1e3), "time = { column = \"t_s\", unit = \"ms\" }"),
        other("time in min", Change::Time(1.0 / 60.0), "time = { column = \"t_s\", unit = \"min\" }"),
        other("time in hours", Change::Time(1.0 / 3600.0), "time = { column = \"t_s\", unit = \"h\" }"),
        other("no time", Change::Time(0.0), ""),
        other("heading in random order", Change::Shuffled(vec![Heading]), ""),
        other("depth in random order", Change::Shuffled(vec![Depth]), ""),
        other("fixes in random order", Change::Shuffled(vec![GpsX, GpsY]), ""),
        other("heading frozen", Change::Held(vec![Heading], 30), ""),
        other("heading frozen from the start", Change::Held(vec![Heading], 0), ""),
        other("pitch frozen", Change::Held(vec![Pitch], 30), ""),
        other("depth frozen", Change::Held(vec![Depth], 0), ""),
        other("fixes held through the dive", Change::Filled(vec![GpsX, GpsY]), ""),
        other("fixes held", Change::Held(vec![GpsX, GpsY], 30), ""),
        other(
            "a fin misspelt",
            Change::Lost(FinPort, "fin_prot_rad"),
            "columns.fin_port_rad = { column = \"fin_prot_rad\" }",
        ),
        other("a fin missing", Change::Lost(FinBottom, "rudder_lower"), ""),
        other(
            "heading misspelt",
            Change::Lost(Heading, "headng_rad"),
            "columns.heading_rad = { column = \"headng_rad\" }",
        ),
    ]
}

/// Those that showed, at a first look, what the tests lacked: a third of them was not named.
fn looked_at() -> Vec<Wrong> {
    use Column::*;
    let wrapped = |x: f64| (x + PI).rem_euclid(2.0 * PI) - PI;
    let dvl = [DvlU, DvlV, DvlW];
    let n_per_m3 = 1025.0 * 9.81;
    vec![
        values(
            "heading in degrees, of the stern",
            &[Heading],
            |x| x.to_degrees().rem_euclid(360.0) - 180.0,
            ", unit = \"deg\", offset = 180.0000000",
        ),
        values("heading in gon", &[Heading], |x| x.to_degrees().rem_euclid(360.0) / 0.9, ", scale = 0.0157080"),
        values("heading in steps of half a turn", &[Heading], move |x| wrapped(x) / PI, ", scale = 3.1415927"),
        scaled(Depth, "mbar", 1e2 / n_per_m3),
        scaled(Depth, "mm", 1e-3),
        values("depth in fathoms", &[Depth], |x| x / 1.8288, ", scale = 1.8288000"),
        values("DVL in km/h", &dvl, |x| x * 3.6, ", unit = \"km/h\""),
        values("DVL in feet a second", &dvl, |x| x / 0.3048, ", scale = 0.3048000"),
        scaled(SpeedLog, "km/h", 1.0 / 3.6),
        negated(&[SpeedLog]),
        scaled(Q, "deg/s", PI / 180.0),
        scaled(P, "deg/s", PI / 180.0),
        values("pitch rate converted twice", &[Q], f64::to_radians, ", scale = 57.2957795"),
        values("propeller in degrees a second", &[PropRpm], |x| x * 6.0, ", scale = 0.1666667"),
        scaled(Range, "cm", 0.01),
        scaled(Range, "ft", 0.3048),
        values("half a one-way range", &[Range], |x| 0.5 * x, ", scale = 2.0000000"),
        scaled(RangeRate, "kn", 1852.0 / 3600.0),
        scaled(RangeRate, "cm/s", 0.01),
        negated(&[ShipX, ShipY]),
        negated(&[ShipGpsX, ShipGpsY]),
        negated(&[ShipGpsX]),
        negated(&[Roll, P]),
        negated(&[Pitch, Q]),
        negated(&[DvlU, DvlV]).or(line(Heading, ", offset = 3.1415927")),
        negated(&[DvlU, DvlW]),
        places(
            "own axes turned by a quarter",
            &[(GpsX, GpsY, 1.0), (GpsY, GpsX, -1.0)],
            &[(GpsX, GpsY, ", sign = -1"), (GpsY, GpsX, "")],
        )
        .or(line(Heading, ", offset = -1.5707963")),
        places(
            "DVL turned by a quarter",
            &[(DvlU, DvlV, 1.0), (DvlV, DvlU, -1.0)],
            &[(DvlU, DvlV, ", sign = -1"), (DvlV, DvlU, "")],
        ),
        places(
            "roll and pitch turned by a quarter",
            &[(Roll, Pitch, 1.0), (Pitch, Roll, -1.0)],
            &[(Roll, Pitch, ", sign = -1"), (Pitch, Roll, "")],
        ),
        other("time in us", Change::Time(1e6), "time = { column = \"t_s\", unit = \"us\" }"),
        other("roll frozen", Change::Held(vec![Roll], 50), ""),
        other("DVL frozen", Change::Held(dvl.to_vec(), 50), ""),
        other("pitch in random order", Change::Shuffled(vec![Pitch]), ""),
        other(
            "top fin by another name",
            Change::Lost(FinTop, "upper_rudder_rad"),
            "columns.fin_top_rad = { column = \"upper_rudder_rad\" }",
        )
        .or(""),
    ]
}

/// Those that were tried when the tests of columns stood; two fifths were not named, and the tests were mended for them.
fn later() -> Vec<Wrong> {
    use Column::*;
    let n_per_m3 = 1025.0 * 9.81;
    let wrapped = |x: f64| (x + PI).rem_euclid(2.0 * PI) - PI;
    vec![
        values("heading in degrees, negated", &[Heading], |x| -x.to_degrees(), ", unit = \"deg\", sign = -1"),
        values("heading and yaw rate negated", &[Heading, R], move |x| wrapped(-x), ", sign = -1"),
        scaled(Depth, "in", 0.3048 / 12.0),
        scaled(Depth, "Pa", 1.0 / n_per_m3),
        scaled(Depth, "kPa", 1e3 / n_per_m3),
        values("pitch in degrees, negated", &[Pitch], |x| -x.to_degrees(), ", unit = \"deg\", sign = -1"),
        values("pitch rate in degrees, negated", &[Q], |x| -x.to_degrees(), ", unit = \"deg/s\", sign = -1"),
        values("yaw rate in degrees a minute", &[R], |x| x.to_degrees() * 60.0, ", scale = 0.0002909"),
        scaled(DvlV, "mm/s", 1e-3),
        scaled(DvlW, "cm/s", 1e-2),
        places(
            "DVL axes in a cycle",
            &[(DvlU, DvlV, 1.0), (DvlV, DvlW, 1.0), (DvlW, DvlU, 1.0)],
            &[(DvlU, DvlW, ""), (DvlV, DvlU, ""), (DvlW, DvlV, "")],
        ),
        values("DVL converted from knots twice", &[DvlU, DvlV, DvlW], |x| x * 0.514_444, ", scale = 1.9438445"),
        scaled(SpeedLog, "mm/s", 1e-3),
        values("speed converted from knots twice", &[SpeedLog], |x| x * 0.514_444, ", scale = 1.9438445"),
        values("fixes in cm", &[GpsX, GpsY], |x| x * 100.0, ", unit = \"cm\""),
        values("two-way range rate", &[RangeRate], |x| 2.0 * x, ", scale = 0.5000000"),
        values("range as ms of travel time", &[Range], |x| x / 1.5, ", scale = 1.5000000"),
        scaled(Range, "mm", 1e-3),
        values("ship's places in km", &[ShipX, ShipY], |x| x * 1e-3, ", unit = \"km\""),
        places(
            "ship's places turned by a quarter",
            &[(ShipX, ShipY, 1.0), (ShipY, ShipX, -1.0)],
            &[(ShipX, ShipY, ", sign = -1"), (ShipY, ShipX, "")],
        ),
        other("time in ns", Change::Time(1e9), "time = { column = \"t_s\", unit = \"ns\" }"),
        other("yaw rate in random order", Change::Shuffled(vec![R]), ""),
        other("DVL in random order", Change::Shuffled(vec![DvlU, DvlV, DvlW]), ""),
        other("ranges in random order", Change::Shuffled(vec![Range]), ""),
        other("yaw rate frozen", Change::Held(vec![R], 50), ""),
        other("heading frozen late", Change::Held(vec![Heading], 70), ""),
        other(
            "starboard fin misspelt",
            Change::Lost(FinStarboard, "fin_starbord_rad"),
            "columns.fin_starboard_rad = { column = \"fin_starbord_rad\" }",
        ),
        other("propeller misspelt", Change::Lost(PropRpm, "prop_rmp"), "columns.prop_rpm = { column = \"prop_rmp\" }"),
        other("depth misspelt", Change::Lost(Depth, "detph_m"), "columns.depth_m = { column = \"detph_m\" }"),
    ]
}
