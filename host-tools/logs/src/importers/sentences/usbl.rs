//! Fixes of a ship's USBL, as their makers write them: `$PSIMSSB` of Kongsberg's HiPAP and of those that write the same
//! (NMEA 0183 sentences, 850-160045/E), `USBLLONG` of EvoLogics (S2C guide, standard version 1.7.D1).
//!
//! A log that has them is the ship's: so are its fixes by GNSS and its heading.

use super::content::{BROKEN, Content, Heard, Own};
use crate::importers::messages::Gathering;
use crate::importers::place_between;
use crate::log::Column;
use backseat_wire::Decimal;
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::nmea::Sentence;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

/// What a line of an EvoLogics modem in data mode begins with.
const AT: &str = "+++AT";
/// EvoLogics' fixes: with a range, and without.
const FIXES: [&str; 2] = ["USBLLONG,", "USBLANGLES,"];
/// The ship's heading at a fix is known by one so near in time, µs: it turns by some degrees a second at most.
const SAME_HEADING_US: i64 = 1_000_000;
/// A fix is written within this time, s; and no sound is longer under way.
const LONGEST_S: f64 = 20.0;

/// Where an EvoLogics modem's report begins in a line.
pub(super) fn find(line: &str) -> Option<usize> {
    line.find(AT).or_else(|| FIXES.iter().find_map(|name| line.find(name)))
}

fn number(field: &[u8]) -> Option<f64> {
    Decimal::parse(field).ok().map(Decimal::to_f64)
}

/// `$PSIMSSB`: the position of a transponder.
pub(super) fn ssb(sentence: &Sentence<'_>) -> Result<(Own, bool, Content), &'static str> {
    let mut fields = sentence.fields();
    let own = TimeOfDay::parse(fields.raw()).map_or(Own::None, Own::OfDay);
    let target = String::from_utf8_lossy(fields.raw()).into_owned();
    let [status, error, system, orientation, filter] = std::array::from_fn(|_| fields.raw());
    let [x, y, depth, accuracy] = std::array::from_fn(|_| number(fields.raw()));
    let (info, value) = (fields.raw(), number(fields.raw()));
    // errors of a second or third pulse, and a depth from elsewhere, leave the position good
    if status != b"A" || !matches!(error, b"" | b"Mi2" | b"Mi3" | b"ExD") || filter == b"P" {
        return Err("no position was measured, or APOS rejected it");
    }
    // what stands behind the numbers is never empty: a line without a checksum was not cut off in them
    let (Some(x), Some(y), Some(depth), false) = (x, y, depth, info.is_empty()) else { return Err(BROKEN) };
    let (vector_m, is_head_up) = match (system, orientation) {
        (b"C", b"N") => ([x, y, depth], false),
        (b"C", b"E") => ([y, x, depth], false),
        (b"C", b"H") => ([y, x, depth], true),
        (b"P", b"H") => {
            let (sin, cos) = y.to_radians().sin_cos();
            ([x * cos, x * sin, depth], true)
        }
        _ => return Err("UTM or radians, no vector from the array: set APOS to Cartesian coordinates"),
    };
    let heard = Heard {
        target,
        vector_m,
        is_head_up,
        // APOS states the root of the sum of the squares of both semi-axes
        across_sigma_m: accuracy.map(|accuracy_m| accuracy_m * FRAC_1_SQRT_2),
        travel_s: value.filter(|_| info == b"T"),
        is_filtered: filter == b"F",
    };
    Ok((own, false, Content::Heard(heard)))
}

/// `$PSIMSNS`: the ship's sensors at a fix, and whether APOS writes local times.
pub(super) fn sns(sentence: &Sentence<'_>) -> Result<(Own, bool, Content), &'static str> {
    let mut fields = sentence.fields();
    let own = TimeOfDay::parse(fields.raw()).map_or(Own::None, Own::OfDay);
    let [.., heading, _, settings] = std::array::from_fn::<_, 9, _>(|_| fields.raw());
    let heading_deg = number(heading).ok_or(BROKEN)?;
    // bit 5 of hexadecimal digits
    let digits = std::str::from_utf8(settings).ok().and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let is_local = digits.is_some_and(|bits| bits & 0x20 == 0);
    Ok((own, false, Content::ShipHeading { heading_rad: heading_deg.to_radians(), is_local }))
}

/// A report of an EvoLogics modem: its name; the modem's time at the report, s, how long before the fix was, and the
/// fix; or why it is left out.
pub(super) fn evologics(text: &str) -> (&str, Result<(&str, Own, Content), &'static str>) {
    let (length, report) = match text.strip_prefix(AT) {
        // an answer to a command names it before the colon
        Some(rest) => match rest.strip_prefix(':').and_then(|rest| rest.split_once(':')) {
            Some((length, report)) => (Some(length), report),
            None => return (AT, Err("not part of a vehicle log")),
        },
        None => (None, text),
    };
    let is_name = |name: &&str| name.len() <= 12 && name.bytes().all(|byte| byte.is_ascii_uppercase());
    let name = report.split(',').next().filter(is_name).unwrap_or(AT);
    let found = match name {
        "USBLLONG" if length.is_some_and(|length| length.parse() != Ok(report.len())) => {
            Err("the length is wrong: the line was cut off")
        }
        "USBLLONG" => fix(report).ok_or(BROKEN).and_then(|fix| fix),
        "USBLANGLES" => Err("a direction without a range"),
        _ => Err("not part of a vehicle log"),
    };
    (name, found)
}

fn fix(report: &str) -> Option<Result<(&str, Own, Content), &'static str>> {
    let fields: Vec<&str> = report.split(',').skip(1).collect();
    let &[now, then, target, _, _, _, east, north, up, roll, pitch, yaw, travel_us, _, _, accuracy] = fields.as_slice()
    else {
        return None;
    };
    let number = |field: &str| number(field.as_bytes());
    number(target)?;
    let ago_s = number(now)? - number(then)?;
    if !(0.0..LONGEST_S).contains(&ago_s) {
        return None;
    }
    if [number(roll)?, number(pitch)?, number(yaw)?] == [0.0; 3] {
        return Some(Err("no attitude of the array is in it: its axes are turned nobody knows how"));
    }
    let heard = Heard {
        target: target.to_owned(),
        vector_m: [number(north)?, number(east)?, -number(up)?],
        is_head_up: false,
        // in m: the guide says radians, but without a direction the modem writes the range
        across_sigma_m: Some(number(accuracy)?),
        travel_s: Some(number(travel_us)? * 1e-6),
        is_filtered: false,
    };
    Some(Ok((now, Own::Before((ago_s * 1e6).round() as i64), Content::Heard(heard))))
}

/// What the ship's log holds, with its times, µs.
#[derive(Default)]
pub(super) struct Ship {
    /// North and east, m.
    pub fixes: Vec<(i64, [f64; 2])>,
    /// rad.
    pub headings: Vec<(i64, f64)>,
    pub heard: Vec<(i64, Heard)>,
    /// The times are local.
    pub is_local: bool,
}

impl Ship {
    /// Puts the fixes into the log; says what was assumed.
    pub fn finish(mut self, gathering: &mut Gathering) -> Option<String> {
        self.fixes.sort_by_key(|(time_us, _)| *time_us);
        self.headings.sort_by_key(|(time_us, _)| *time_us);
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        self.heard.iter().for_each(|(_, heard)| *counts.entry(&heard.target).or_default() += 1);
        let vehicle = counts.into_iter().max_by_key(|(_, count)| *count)?.0.to_owned();
        let (mut used, mut filtered) = (0, 0);
        for (time_us, heard) in &self.heard {
            let Heard { target, vector_m, is_head_up, across_sigma_m, travel_s, is_filtered } = heard;
            if self.is_local {
                gathering.leave_out("fixes by USBL", "APOS wrote local times: set it to UTC");
                continue;
            }
            if *target != vehicle {
                let name = format!("fixes by USBL of {target}");
                gathering.leave_out(&name, "another transponder was heard more often, and is taken for the vehicle's");
                continue;
            }
            let [mut north_m, mut east_m, down_m] = *vector_m;
            if *is_head_up {
                let Some(heading_rad) = self.heading_rad(*time_us) else {
                    gathering.leave_out("fixes by USBL", "head up, and no heading of the ship within a second");
                    continue;
                };
                let (sin, cos) = heading_rad.sin_cos();
                (north_m, east_m) = (north_m * cos - east_m * sin, north_m * sin + east_m * cos);
            }
            let range_m = north_m.hypot(east_m).hypot(down_m);
            let mut samples =
                vec![(Column::UsblNorth, north_m), (Column::UsblEast, east_m), (Column::UsblDown, down_m)];
            samples.extend(across_sigma_m.map(|sigma_m| (Column::UsblAngleSigma, sigma_m / range_m)));
            if let Some([x_m, y_m]) = place_between(&self.fixes, *time_us) {
                samples.extend([(Column::ShipX, x_m), (Column::ShipY, y_m)]);
            }
            match travel_s.filter(|travel_s| (0.0..LONGEST_S).contains(travel_s)) {
                Some(travel_s) => gathering.add_flight([*time_us - (travel_s * 1e6).round() as i64, *time_us], samples),
                None => gathering.add(*time_us, &samples),
            }
            used += 1;
            filtered += usize::from(*is_filtered);
        }
        let of_filter = if filtered > 0 {
            format!(
                "; {filtered} of them from the maker's own filter, whose errors hang together: measured ones are better"
            )
        } else {
            String::new()
        };
        Some(format!(
            "{used} fixes by USBL of {vehicle}, of an array on the ship: fixes by GNSS and headings are the ship's{of_filter}"
        ))
    }

    fn heading_rad(&self, time_us: i64) -> Option<f64> {
        let after = self.headings.partition_point(|(heading_us, _)| *heading_us < time_us);
        let near = self.headings.get(after.saturating_sub(1)..(after + 1).min(self.headings.len()))?;
        let apart_us = |heading: &&(i64, f64)| (heading.0 - time_us).abs();
        let (_, heading_rad) = near.iter().min_by_key(apart_us).filter(|found| apart_us(found) <= SAME_HEADING_US)?;
        Some(*heading_rad)
    }
}
