//! Effects of known size, put into the columns of a recorded log.

use backseat_core::state::wrap_angle;
use backseat_logs::{Column, Log, LogRow};
use hil_sim::rng::{Source, Stream};
use std::f64::consts::TAU;

/// What is put into a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Injection {
    /// In words.
    pub name: String,
    /// The entry of the catalogue that it is; none: a cause in no entry.
    pub effect: Option<&'static str>,
    /// Its parameters, those that are not zero.
    pub sizes: Vec<(&'static str, f64)>,
    /// Whether it begins in the middle of the log.
    pub from_middle: bool,
    /// After which share of the readings of the speed it begins then.
    pub onset: f64,
}

/// Everything that is put into the logs of a vehicle of this length, with a DVL or a logged speed.
pub fn all(length_m: f64, has_dvl: bool) -> Vec<Injection> {
    let mut all = Vec::new();
    let mut add = |effect: &'static str, sizes: &[(&'static str, f64)], from_middle| {
        let (name, sizes) = (String::new(), sizes.to_vec());
        let mut injection = Injection { name, effect: Some(effect), sizes, from_middle, onset: 0.5 };
        injection.name_it();
        all.push(injection);
    };
    for (name, degrees) in
        [("const_rad", [3.0, -5.0, 7.0, -12.0].as_slice()), ("sin_rad", &[4.0, -6.0, 9.0]), ("cos_rad", &[4.0, -9.0])]
    {
        degrees.iter().for_each(|degrees: &f64| add("heading_bias", &[(name, degrees.to_radians())], false));
    }
    for (name, degrees) in [("sin2_rad", 3.0), ("sin2_rad", 8.0), ("cos2_rad", -5.0)] {
        add("soft_iron", &[(name, f64::to_radians(degrees))], false);
    }
    for ratio in [0.03, 0.05, 0.08, -0.06] {
        add("dvl_scale", &[("ratio", ratio)], false);
    }
    for [north, east] in [[0.10, 0.0], [0.0, -0.10], [0.15, 0.0], [-0.106, -0.106], [0.05, 0.05]] {
        let sizes = [("north_mps", north), ("east_mps", east)];
        add("water_current", &sizes.into_iter().filter(|(_, size)| *size != 0.0).collect::<Vec<_>>(), false);
    }
    for (name, share) in [("x_m", 0.5), ("x_m", -0.8), ("y_m", 0.5), ("y_m", -0.8)] {
        add("gnss_lever_arm", &[(name, share * length_m)], false);
    }
    for delay_s in [0.3, 0.8, 1.5, 4.0] {
        add("gnss_delay", &[("s", delay_s)], false);
        add("heading_lag", &[("s", delay_s)], false);
        add("dvl_delay", &[("s", delay_s)], false);
    }
    if has_dvl {
        for (name, share) in [("x_m", 0.5), ("y_m", -0.4)] {
            add("dvl_lever_arm", &[(name, share * length_m)], false);
        }
        for degrees in [2.0, -5.0] {
            add("dvl_misalignment", &[("yaw_rad", f64::to_radians(degrees))], false);
        }
    }
    for (name, size) in [("north_mps", 0.10), ("east_mps", 0.15), ("north_mps", -0.25)] {
        add("water_current", &[(name, size)], true);
    }
    for degrees in [6.0, -12.0] {
        add("heading_bias", &[("const_rad", f64::to_radians(degrees))], true);
    }
    for size in [0.2, 0.4] {
        let (name, sizes) = (String::new(), vec![(DRIFT, size)]);
        let mut injection = Injection { name, effect: None, sizes, from_middle: false, onset: 0.5 };
        injection.name_it();
        all.push(injection);
    }
    all
}

/// The same kinds with sizes, directions and onsets drawn by a seed: sizes of 0.6 to 1.6 times those listed, harmonics and
/// currents turned by any angle, the other signs by chance (no delay is negative), onsets after 35 to 65 % of the readings.
pub fn drawn(length_m: f64, has_dvl: bool, seed: u64) -> Vec<Injection> {
    const TURNED: [[&str; 2]; 3] = [["sin_rad", "cos_rad"], ["sin2_rad", "cos2_rad"], ["north_mps", "east_mps"]];
    let mut random = Stream::new(seed, Source::Study);
    let mut all = all(length_m, has_dvl);
    for injection in &mut all {
        let (factor, angle) = (0.6 * (1.6_f64 / 0.6).powf(random.uniform()), TAU * random.uniform());
        let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
        injection.onset = 0.35 + 0.3 * random.uniform();
        let pair = TURNED.iter().find(|pair| injection.sizes.iter().any(|(name, _)| pair.contains(name)));
        if let Some(names) = pair {
            let whole = injection.sizes.iter().map(|(_, size)| size * size).sum::<f64>().sqrt() * factor;
            injection.sizes = vec![(names[0], whole * angle.sin()), (names[1], whole * angle.cos())];
        } else {
            let is_delay = injection.sizes.iter().any(|(name, _)| *name == "s");
            let by = if is_delay || injection.effect.is_none() { factor } else { factor * sign };
            injection.sizes.iter_mut().for_each(|(_, size)| *size *= by);
        }
        injection.name_it();
    }
    all
}

/// Parameter of a current that grows over the log, m/s at its end.
const DRIFT: &str = "end_north_mps";

impl Injection {
    /// Says what it is.
    fn name_it(&mut self) {
        let size = |(name, value): &(&str, f64)| format!("{name} {value:.3}");
        let listed: Vec<String> = self.sizes.iter().map(size).collect();
        let when = match (self.from_middle, self.onset) {
            (true, 0.5) => ", from the middle on".to_owned(),
            (true, onset) => format!(", after {:.0} % of the readings", 100.0 * onset),
            (false, _) => String::new(),
        };
        self.name = match self.effect {
            Some(effect) => format!("{effect}: {}{when}", listed.join(", ")),
            None => format!("a current that grows by {} m/s", (self.size(DRIFT) * 1e3).round() / 1e3),
        };
    }

    /// A parameter; 0 where it is none of those given.
    pub fn size(&self, name: &str) -> f64 {
        self.sizes.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, size)| *size)
    }

    /// The log as it would have been recorded.
    pub fn apply(&self, log: &Log) -> Log {
        let start_us = log.rows.first().map_or(0, |row| row.time_us);
        let end_us = log.rows.last().map_or(0, |row| row.time_us);
        let from_us = if self.from_middle { time_us(log, self.onset) } else { start_us };
        let duration_s = (end_us - start_us) as f64 * 1e-6;
        let heading = Series::of(log, &[Column::Heading], true);
        let fixes = Series::of(log, &[Column::GpsX, Column::GpsY], false);
        let velocity = Series::of(log, &[Column::DvlU, Column::DvlV, Column::DvlW], false);
        let speed = Series::of(log, &[Column::SpeedLog], false);
        let late_s = self.size("s");
        let mut changed = log.clone();
        for row in changed.rows.iter_mut().filter(|row| row.time_us >= from_us) {
            let t_s = row.time_us as f64 * 1e-6;
            let since_s = (row.time_us - from_us) as f64 * 1e-6;
            let psi = heading.at(t_s).map_or(0.0, |[psi, ..]| psi);
            match self.effect {
                Some("heading_bias" | "soft_iron") => {
                    let [s1, c1, s2, c2] = [psi.sin(), psi.cos(), (2.0 * psi).sin(), (2.0 * psi).cos()];
                    let harmonics =
                        [("const_rad", 1.0), ("sin_rad", s1), ("cos_rad", c1), ("sin2_rad", s2), ("cos2_rad", c2)];
                    let error: f64 = harmonics.iter().map(|(name, factor)| self.size(name) * factor).sum();
                    change(row, Column::Heading, |read| wrap_angle(read + error));
                }
                Some("dvl_scale") => {
                    for column in [Column::DvlU, Column::DvlV, Column::DvlW, Column::SpeedLog] {
                        change(row, column, |read| read * (1.0 + self.size("ratio")));
                    }
                }
                Some("water_current") => {
                    change(row, Column::GpsX, |read| read + self.size("north_mps") * since_s);
                    change(row, Column::GpsY, |read| read + self.size("east_mps") * since_s);
                }
                Some("gnss_lever_arm") => {
                    let (sin, cos) = psi.sin_cos();
                    let [x, y] = ["x_m", "y_m"].map(|name| self.size(name));
                    change(row, Column::GpsX, |read| read + cos * x - sin * y);
                    change(row, Column::GpsY, |read| read + sin * x + cos * y);
                }
                Some("gnss_delay") => set(row, [Column::GpsX, Column::GpsY], fixes.at(t_s - late_s)),
                Some("heading_lag") => {
                    let late = heading.at(t_s - late_s).map(|late| late.map(wrap_angle));
                    set(row, [Column::Heading], late);
                }
                Some("dvl_delay") => {
                    set(row, [Column::DvlU, Column::DvlV, Column::DvlW], velocity.at(t_s - late_s));
                    set(row, [Column::SpeedLog], speed.at(t_s - late_s));
                }
                Some("dvl_lever_arm") => {
                    let turn = |at_s: f64| heading.at(at_s).map_or(0.0, |[psi, ..]| psi);
                    let r_radps = turn(t_s + 0.5) - turn(t_s - 0.5);
                    change(row, Column::DvlU, |read| read - r_radps * self.size("y_m"));
                    change(row, Column::DvlV, |read| read + r_radps * self.size("x_m"));
                }
                Some("dvl_misalignment") => {
                    let (sin, cos) = self.size("yaw_rad").sin_cos();
                    if let (Some(u), Some(v)) = (row.get(Column::DvlU), row.get(Column::DvlV)) {
                        row.set(Column::DvlU, u * cos + v * sin).set(Column::DvlV, v * cos - u * sin);
                    }
                }
                _ => {
                    let way_m = 0.5 * self.size(DRIFT) * since_s * since_s / duration_s.max(1.0);
                    change(row, Column::GpsX, |read| read + way_m);
                }
            }
        }
        changed
    }
}

/// The time after a share of the readings of the speed; those that are held on are none.
fn time_us(log: &Log, share: f64) -> u64 {
    let column = if log.has(Column::DvlU) { Column::DvlU } else { Column::SpeedLog };
    let mut last = None;
    let is_new = |row: &&LogRow| row.get(column).is_some_and(|speed| last.replace(speed) != Some(speed));
    let times: Vec<u64> = log.rows.iter().filter(is_new).map(|row| row.time_us).collect();
    let after = |count: usize| (count as f64 * share) as usize;
    let whole = log.rows.get(after(log.rows.len())).map_or(0, |row| row.time_us);
    // Of a speed that never changes, of the rows of the log.
    if times.len() < 20 { whole } else { times[after(times.len())] }
}

fn change(row: &mut LogRow, column: Column, of: impl Fn(f64) -> f64) {
    if let Some(value) = row.get(column) {
        row.set(column, of(value));
    }
}

/// Sets columns that the row has.
fn set<const N: usize>(row: &mut LogRow, columns: [Column; N], values: Option<[f64; 3]>) {
    for (place, column) in columns.into_iter().enumerate() {
        if let Some(values) = values.filter(|_| row.get(column).is_some()) {
            row.set(column, values[place]);
        }
    }
}

/// What columns read, by time, with a straight line between readings.
struct Series(Vec<(f64, [f64; 3])>);

impl Series {
    fn of(log: &Log, columns: &[Column], is_angle: bool) -> Self {
        let mut series: Vec<(f64, [f64; 3])> = Vec::new();
        for row in &log.rows {
            let mut values = [0.0; 3];
            let read = columns.iter().enumerate().filter_map(|(place, column)| Some((place, row.get(*column)?)));
            let count = read.map(|(place, value)| values[place] = value).count();
            if count < columns.len() {
                continue;
            }
            if let Some((_, last)) = series.last().filter(|_| is_angle) {
                values[0] = last[0] + wrap_angle(values[0] - last[0]);
            }
            series.push((row.time_us as f64 * 1e-6, values));
        }
        Self(series)
    }

    /// `None` before the first reading and after the last.
    fn at(&self, t_s: f64) -> Option<[f64; 3]> {
        let after = self.0.partition_point(|(at_s, _)| *at_s < t_s);
        let (to_s, to) = self.0.get(after)?;
        if *to_s == t_s {
            return Some(*to);
        }
        let (from_s, from) = self.0.get(after.checked_sub(1)?)?;
        let share = (t_s - from_s) / (to_s - from_s);
        Some(std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle that heads east at 2 m/s, with fixes and headings each second.
    fn log() -> Log {
        let row = |k: u64| {
            let mut row = LogRow::new(k * 1_000_000);
            row.set(Column::Heading, std::f64::consts::FRAC_PI_2).set(Column::SpeedLog, 2.0);
            row.set(Column::GpsX, 0.0).set(Column::GpsY, 2.0 * k as f64);
            row
        };
        Log { rows: (0..100).map(row).collect(), ..Log::default() }
    }

    fn put(effect: &str, nth: usize) -> (Injection, Log) {
        let of: Vec<Injection> = all(2.0, false).into_iter().filter(|i| i.effect == Some(effect)).collect();
        (of[nth].clone(), of[nth].apply(&log()))
    }

    #[test]
    fn val_what_is_put_in_is_what_the_sensor_would_have_read() {
        let at = |log: &Log, row: usize, column| log.rows[row].get(column).unwrap();
        // Late fixes are where the vehicle was.
        let (injection, late) = put("gnss_delay", 2);
        assert!((at(&late, 50, Column::GpsY) - (100.0 - 2.0 * injection.size("s"))).abs() < 1e-9);
        // A logged speed of 2 m/s that never changes is no other late.
        assert_eq!(put("dvl_delay", 3).1.rows, log().rows);
        // An antenna a metre ahead of the centre is a metre east.
        let (_, arm) = put("gnss_lever_arm", 0);
        assert!((at(&arm, 50, Column::GpsY) - 101.0).abs() < 1e-9);
        // The sine of an east heading is one.
        let (injection, iron) = put("heading_bias", 4);
        let error = at(&iron, 50, Column::Heading) - std::f64::consts::FRAC_PI_2;
        assert!((error - injection.size("sin_rad")).abs() < 1e-9, "{error}");
        // From the middle on.
        let (injection, current) = put("water_current", 5);
        assert!(injection.from_middle && at(&current, 40, Column::GpsX) == 0.0);
        assert!((at(&current, 90, Column::GpsX) - 0.10 * 40.0).abs() < 1e-6, "{}", at(&current, 90, Column::GpsX));
    }
}
