//! Logs of a pinger with a clock of its own: times of arrival at a vehicle that knows where it is.
//!
//! Ping k arrives at t_k = t_0 + k T + r_k / c. The plain model knows neither t_0 nor T, which are always fitted (pings are
//! counted by the median of their intervals), and takes the declared speed of sound. As a range, with drift the share by
//! which the period differs from that median: c (t_k − k T) = (1 + ratio) r_k + c (offset + drift t), by the catalogue's
//! definitions.

use backseat_diagnose::log_models::{self, Entry, Layout, LogModel, LogModelDiagnosis, Measures, OutsideTerm, Row};
use backseat_diagnose::samples::ResidualChannel;
use backseat_logs::log::Column;
use backseat_logs::stats::median;
use backseat_logs::{Log, VehicleFile};

/// Fewest pings that are worth a fit.
const FEWEST: usize = 30;
/// Blocks are longer than with other logs: a ping comes every several seconds.
const BLOCK_S: f64 = 40.0;
/// Nearer than this, the direction to the pinger is not known, m.
const NEAR_M: f64 = 5.0;

/// Columns: offset, s; drift, ppm; ratio; those without a name: drift that grows, radial speed, the pinger's place north
/// and east, height over the pinger at short range; the hydrophone ahead of the antenna and to starboard of it, m.
const COLUMNS: usize = 10;
const ARM: [usize; 2] = [8, 9];

struct Ping {
    t_s: f64,
    pseudo_range_m: f64,
    range_m: f64,
    slopes: [f64; COLUMNS],
}

struct Pinger {
    pings: Vec<Ping>,
    has_heading: bool,
}

impl LogModel for Pinger {
    fn columns(&self) -> usize {
        COLUMNS
    }

    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        self.pings
            .iter()
            .map(|ping| {
                let known: f64 = ping.slopes.iter().zip(theta).map(|(slope, value)| slope * value).sum();
                let residual = ping.pseudo_range_m - ping.range_m - known;
                Row {
                    t_s: ping.t_s,
                    channel: ResidualChannel::Range,
                    sequence: 0,
                    residual,
                    slopes: ping.slopes.to_vec(),
                }
            })
            .collect()
    }

    /// Nobody declares when the pinger began, or its period to a millionth: a reading to the millisecond that misses it is no
    /// finding.
    fn calibrated(&self) -> Vec<usize> {
        vec![0, 1]
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries = vec![("sound_speed", vec![2])];
        if self.has_heading {
            entries.push(("transducer_lever_arm", ARM.to_vec()));
        }
        entries
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        vec![
            ("a clock drift that grows with time", vec![3]),
            ("radial speed: positions that are late", vec![4]),
            ("the pinger's place", vec![5, 6]),
            ("height of the vehicle over the pinger", vec![7]),
        ]
    }

    fn block_s(&self) -> f64 {
        BLOCK_S
    }

    fn measures(&self, rows: &[Row], _layout: &Layout) -> Measures {
        let position = rows.iter().map(|row| (row.t_s, row.residual)).collect();
        Measures { position, against: Some("range to the pinger by GNSS"), ..Measures::default() }
    }
}

/// Whether a log is one of pings without times of launch.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    log.has(Column::Toa) && !log.has(Column::Tol) && !log.has(Column::Range)
}

/// Diagnoses a log of arrivals; `None` if it has too few of them with a position.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let c = vehicle.installation.sound_speed_mps;
    let (model, period_s, missed) = pings(log, c)?;
    let mut found = log_models::run(&model, log, vehicle)?;
    let fitted = &found.theta[1];
    let (drift, sigma) = (fitted[1] * 1e-6, found.sigmas[1] * 1e-6);
    let mut notes = vec![
        format!(
            "the log has no times of launch: pseudo-ranges of a pinger with its own clock. {} pings with a position, {missed} missed \
             between them; the clock's offset and period are always fitted",
            model.pings.len()
        ),
        format!("declared model: sound speed {c} m/s; pings are counted by their median interval, {period_s:.3} s"),
    ];
    if sigma > 0.0 {
        notes.push(format!(
            "fitted ping period: {:.6} s, one sigma {:.0e} s",
            period_s * (1.0 + drift),
            period_s * sigma
        ));
    }
    if found.sigmas[2] > 0.0 {
        notes.push(format!(
            "fitted sound speed: {:.0} m/s, one sigma {:.0} m/s",
            c / (1.0 + fitted[2]),
            c * found.sigmas[2]
        ));
    }
    notes.push(
        if model.has_heading {
            "transducer_lever_arm is the hydrophone's place seen from the antenna's, on the level: its height is not seen at \
             the surface"
        } else {
            "transducer_lever_arm was not tested: the log has no heading"
        }
        .to_owned(),
    );
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

/// Arrivals with positions, the period assumed, and how many pings were missed.
fn pings(log: &Log, c: f64) -> Option<(Pinger, f64, usize)> {
    let start_us = log.rows.first()?.time_us;
    let seconds = |time_us: u64| (time_us - start_us) as f64 * 1e-6;
    let arrivals: Vec<f64> = log.rows.iter().filter_map(|row| row.arrival_us()).map(|us| us as f64 * 1e-6).collect();
    let intervals: Vec<f64> = arrivals.windows(2).map(|w| w[1] - w[0]).collect();
    let period_s = median(&intervals).filter(|period_s| *period_s > 0.0)?;
    let duration_s = log.duration_s().max(1.0);
    let positions: Vec<(f64, [f64; 2])> =
        log.rows.iter().filter_map(|row| Some((seconds(row.time_us), row.gnss_m()?))).collect();
    let (mut index, mut missed, mut last): (f64, f64, Option<f64>) = (0.0, 0.0, None);
    let mut pings = Vec::new();
    let mut has_heading = true;
    for row in &log.rows {
        let Some(arrival_us) = row.arrival_us() else { continue };
        let arrival_s = arrival_us as f64 * 1e-6;
        if let Some(last) = last {
            // From one arrival to the next, so that drift and motion never add up to half a period.
            let steps = ((arrival_s - last) / period_s).round();
            index += steps;
            missed += (steps - 1.0).max(0.0);
        }
        last = Some(arrival_s);
        let (Some([north, east]), Some([ship_north, ship_east])) = (row.gnss_m(), row.ship_at_launch_m()) else {
            continue;
        };
        let t_s = seconds(row.time_us);
        let (dx, dy) = (north - ship_north, east - ship_east);
        let range_m = dx.hypot(dy);
        let [bx, by] = if range_m < NEAR_M { [0.0; 2] } else { [dx / range_m, dy / range_m] };
        let velocity = velocity(&positions, t_s);
        let since_middle = t_s / duration_s - 0.5;
        has_heading &= row.get(Column::Heading).is_some();
        let (sin, cos) = row.get(Column::Heading).unwrap_or(0.0).sin_cos();
        let slopes = [
            c,
            1e-6 * c * t_s,
            range_m,
            since_middle * since_middle,
            bx * velocity[0] + by * velocity[1],
            -bx,
            -by,
            1.0 / range_m.max(NEAR_M),
            bx * cos + by * sin,
            by * cos - bx * sin,
        ];
        pings.push(Ping { t_s, pseudo_range_m: c * (arrival_s - index * period_s), range_m, slopes });
    }
    // The first arrival's time of day is no part of the offset.
    let first = pings.first().map_or(0.0, |ping| ping.pseudo_range_m - ping.range_m);
    for ping in &mut pings {
        ping.pseudo_range_m -= first;
    }
    (pings.len() >= FEWEST).then_some((Pinger { pings, has_heading }, period_s, missed as usize))
}

/// Velocity by the positions before and after, m/s.
fn velocity(positions: &[(f64, [f64; 2])], t_s: f64) -> [f64; 2] {
    let at = positions.partition_point(|(at_s, _)| *at_s < t_s);
    let (Some(before), Some(after)) =
        (positions.get(at.saturating_sub(1)), positions.get((at + 1).min(positions.len() - 1)))
    else {
        return [0.0; 2];
    };
    let dt = after.0 - before.0;
    if dt > 0.0 { [0, 1].map(|axis| (after.1[axis] - before.1[axis]) / dt) } else { [0.0; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::LogRow;
    use hil_sim::rng::{Source, Stream};

    /// A vehicle to and fro past a pinger whose clock runs as `drift_ppm` says, sound at 1515 m/s.
    fn log(drift_ppm: f64) -> Log {
        let (mut log, mut random) = (Log::default(), Stream::new(7, Source::Study));
        let mut noise = || random.uniform() - 0.5;
        for ping in 0..220_u32 {
            if ping % 17 == 5 {
                continue; // missed
            }
            let launch_s = 8.179 * (1.0 + 1e-6 * drift_ppm) * f64::from(ping) + 3.2;
            let leg = (launch_s / 200.0).fract() * 2.0;
            let north = 150.0 * if leg < 1.0 { leg } else { 2.0 - leg };
            let position = [north, 20.0];
            // Reading to the millisecond, and as much again.
            let arrival_s = launch_s + position[0].hypot(position[1]) / 1515.0 + 1e-3 * noise();
            let arrival_s = (arrival_s * 1e3).round() * 1e-3;
            let mut row = LogRow::new((arrival_s * 1e6) as u64);
            row.set(Column::Toa, arrival_s).set_all(Column::ShipX, &[0.0, 0.0]);
            row.set_all(Column::GpsX, &[position[0] + noise(), position[1] + noise()]);
            log.rows.push(row);
        }
        log
    }

    #[test]
    fn val_sound_speed_and_period() {
        let log = log(6.0);
        assert!(is_for(&log));
        let found = run(&log, &VehicleFile::reference()).unwrap();
        let effects = &found.diagnosis.effects;
        let value = |name: &str| effects.iter().find(|f| f.instance.candidate.effect == name).map(|f| f.values[0]);
        let ratio = value("sound_speed").unwrap_or_else(|| panic!("{effects:?} {:?}", found.diagnosis.notes));
        let truth = 1500.0 / 1515.0 - 1.0;
        assert!((ratio.ci95[0]..=ratio.ci95[1]).contains(&truth), "{ratio:?}");
        assert!(ratio.ci95[1] - ratio.ci95[0] < 0.01, "{ratio:?}");
        // The period is no finding: it is fitted before and after.
        assert!(value("clock_drift").is_none(), "{effects:?}");
        let intervals: Vec<f64> = log.rows.windows(2).map(|w| (w[1].time_us - w[0].time_us) as f64 * 1e-6).collect();
        let fitted = median(&intervals).unwrap() * (1.0 + 1e-6 * found.theta[1][1]);
        assert!((fitted - 8.179 * (1.0 + 6e-6)).abs() < 3e-6, "{fitted}"); // one ms over 220 pings is 4.5 µs a ping
        let [before, after] = found.scores;
        assert!(after.position_rmse_m.unwrap() < before.position_rmse_m.unwrap());
        assert!(found.diagnosis.structure.named.is_empty(), "{:?}", found.diagnosis.structure.named);
    }

    #[test]
    fn val_arm_of_the_hydrophone_on_a_circle() {
        let (mut log, mut random) = (Log::default(), Stream::new(11, Source::Study));
        let mut noise = || random.uniform() - 0.5;
        for ping in 0..220_u32 {
            let launch_s = 8.179 * f64::from(ping) + 3.2;
            // Around a point 40 m from the pinger, so that it bears from all sides.
            let angle = 0.021 * launch_s;
            let (position, heading) =
                ([60.0 * angle.cos() + 40.0, 60.0 * angle.sin()], angle + 0.5 * std::f64::consts::PI);
            let (sin, cos) = heading.sin_cos();
            let hydrophone = [position[0] + 3.0 * cos + 1.0 * sin, position[1] + 3.0 * sin - 1.0 * cos];
            let arrival_s = launch_s + hydrophone[0].hypot(hydrophone[1]) / 1500.0;
            let mut row = LogRow::new((arrival_s * 1e6) as u64);
            row.set(Column::Toa, arrival_s).set_all(Column::ShipX, &[0.0, 0.0]).set(Column::Heading, heading);
            log.rows.push(row.set_all(Column::GpsX, &[position[0] + noise(), position[1] + noise()]).clone());
        }
        let found = run(&log, &VehicleFile::reference()).unwrap().diagnosis;
        let arm = found.effects.iter().find(|f| f.instance.candidate.effect == "transducer_lever_arm").unwrap();
        for (value, truth) in arm.values.iter().zip([3.0, -1.0]) {
            // Fixes of 0.3 m: each of two hundred counts a half.
            assert!((value.value - truth).abs() < 0.15, "{value:?}");
        }
        assert!(found.structure.named.is_empty(), "{:?}", found.structure.named);
    }

    #[test]
    fn too_few_pings_are_no_log() {
        let mut log = log(0.0);
        log.rows.truncate(20);
        assert!(run(&log, &VehicleFile::reference()).is_none());
    }
}
