//! The board's inputs layer over a log: raw samples to measurements of the centre of gravity.
//!
//! A vehicle log holds what the sensors said: along their own axes, where they sit, when it arrived. [`at_centre`]
//! applies the `[installation]` of the vehicle file with the board's own code ([`backseat_app::inputs::installation`]):
//! turns, delays, and lever arms with attitude and rates of the log itself. It does so once: a log remembers.
//!
//! Without a DVL a logged speed is as late as the DVL is declared to be. Three columns stand as they are. A fix stands at its own time. A range is one from transducer to transducer, at its
//! time of arrival: who knows the position subtracts the arm along the path ([`range_at_centre_m`]). Commands hold from
//! their row on.

use backseat_app::inputs::installation::{self, arm_along_path_m, mounted};
use backseat_app::inputs::{SensorSample as Sample, Stamp};
use backseat_core::dynamics::Attitude;
use backseat_core::navigation::Measurement;
use backseat_core::parameters::Installation;
use backseat_core::state::{self, P, PHI, VehicleState, wrap_angle};
use backseat_logs::log::{Column, Log, LogRow, Usbl};
use nalgebra::Vector3;
use std::borrow::Cow;

/// Attitude and rates are not interpolated across a longer gap, µs.
const LONGEST_GAP_US: u64 = 1_000_000;

/// The log with every sample in body axes, at its time of validity, at the centre of gravity.
///
/// Without arms, turns and delays, or when it was done before, it is the log itself. Samples whose arm needs attitude
/// or rates that the log does not have at that time are left out, and a note says how many.
#[must_use]
pub fn at_centre<'a>(log: &'a Log, installation: &Installation) -> Cow<'a, Log> {
    if log.at_centre || !moves_samples(installation) {
        return Cow::Borrowed(log);
    }
    let mut samples: Vec<(u64, Sample)> = Vec::new();
    let mut rows = Vec::with_capacity(log.rows.len());
    // Without a DVL its delay is that of the logged speed.
    let speed_late_us = if log.has(Column::DvlU) { 0 } else { (installation.dvl_delay_s * 1e6) as u64 };
    for row in &log.rows {
        let mut rest = row.clone();
        if let Some(speed_mps) = row.get(Column::SpeedLog).filter(|_| speed_late_us > 0) {
            let mut valid = LogRow::new(row.time_us.saturating_sub(speed_late_us));
            valid.set(Column::SpeedLog, speed_mps);
            rows.push(valid);
            rest.set(Column::SpeedLog, f64::NAN);
        }
        for (sample, first, count) in samples_of(row) {
            samples.push(mounted(Stamp::Arrival(row.time_us), sample, installation));
            rest.set_all(first, &[f64::NAN; 3][..count]);
        }
        if let Some(position_m) = row.gnss_m() {
            samples.push((row.time_us, Sample::Fix { position_m }));
            rest.set_all(Column::GpsX, &[f64::NAN; 2]);
        }
        if !rest.is_empty() {
            rows.push(rest);
        }
    }
    samples.sort_by_key(|(time_us, _)| *time_us);
    let motion = Motion::of(&samples);
    let mut left_out = 0;
    for (time_us, sample) in &samples {
        match motion.measurement(*time_us, sample, installation) {
            Some(measurement) => rows.push(row_of(*time_us, &measurement)),
            None => left_out += 1,
        }
    }
    // stable: what a row holds beside samples comes first, as it did
    rows.sort_by_key(|row| row.time_us);
    let mut notes = log.notes.clone();
    notes.push("the [installation] of the vehicle file was applied: arms, turns, delays".to_owned());
    if left_out > 0 {
        notes.push(format!(
            "{left_out} samples left out: their lever arm needs attitude and rates, which the log does not have then"
        ));
    }
    let (start_unix_us, origin_deg, runs) = (log.start_unix_us, log.origin_deg, log.runs.clone());
    let (run_facts, unused_columns) = (log.run_facts.clone(), log.unused_columns.clone());
    Cow::Owned(Log {
        path: log.path.clone(),
        rows,
        notes,
        at_centre: true,
        start_unix_us,
        origin_deg,
        runs,
        run_facts,
        is_motor_rpm: log.is_motor_rpm,
        unused_columns,
        estimated_fixes: log.estimated_fixes.clone(),
        sources: log.sources.clone(),
        time_column: log.time_column.clone(),
        unread_numbers: log.unread_numbers.clone(),
    })
}

/// Range from the ship's transducer to the centre of gravity of a vehicle at `x`, m, of a measured one.
#[must_use]
pub fn range_at_centre_m(
    range_m: f64,
    x: &VehicleState,
    installation: &Installation,
    ship_m: [f64; 2],
    ship_transducer_depth_m: f64,
) -> f64 {
    range_m - arm_along_path_m(x, &installation.transducer_arm_m, ship_m, ship_transducer_depth_m)
}

/// The fix by USBL as it would be of the centre of gravity of a vehicle at `x`: the vehicle's transducer, or its array,
/// sits at the declared arm.
#[must_use]
pub fn usbl_at_centre(usbl: &Usbl, x: &VehicleState, installation: &Installation) -> Usbl {
    let arm = Vector3::from(installation.transducer_arm_m);
    if arm == Vector3::zeros() {
        return *usbl;
    }
    let vector = Vector3::from(usbl.vector_m());
    // from the centre to what the array hears, or from the array to the centre
    let turned = || Attitude::new(&state::attitude(x)).rotation() * arm;
    usbl.with_vector_m(if usbl.on_vehicle { vector + arm } else { vector - turned() }.into())
}

/// Whether an installation changes anything in [`at_centre`].
fn moves_samples(installation: &Installation) -> bool {
    let Installation {
        dvl_arm_m,
        dvl_turn_rad,
        dvl_delay_s,
        ahrs_turn_rad,
        ahrs_delay_s,
        depth_arm_m,
        depth_delay_s,
        gnss_arm_m,
        ..
    } = installation;
    let vectors = [dvl_arm_m, dvl_turn_rad, ahrs_turn_rad, depth_arm_m, gnss_arm_m];
    vectors.into_iter().flatten().chain([dvl_delay_s, ahrs_delay_s, depth_delay_s]).any(|value| *value != 0.0)
}

/// The raw samples of a row, with their columns.
fn samples_of(row: &LogRow) -> impl Iterator<Item = (Sample, Column, usize)> {
    [
        row.get(Column::Depth).map(|depth_m| (Sample::Depth { depth_m }, Column::Depth, 1)),
        row.attitude_rad().map(|euler_rad| (Sample::Attitude { euler_rad }, Column::Roll, 3)),
        row.rates_radps().map(|rates_radps| (Sample::Rates { rates_radps }, Column::P, 3)),
        row.dvl_mps().map(|velocity_mps| (Sample::BottomTrack { velocity_mps }, Column::DvlU, 3)),
    ]
    .into_iter()
    .flatten()
}

fn row_of(time_us: u64, measurement: &Measurement) -> LogRow {
    let mut row = LogRow::new(time_us);
    match measurement {
        Measurement::Depth { z_m } => row.set(Column::Depth, *z_m),
        Measurement::Attitude { euler_rad } => row.set_all(Column::Roll, euler_rad),
        Measurement::Rates { rates_radps } => row.set_all(Column::P, rates_radps),
        Measurement::BottomTrack { velocity_mps } => row.set_all(Column::DvlU, velocity_mps),
        Measurement::VehicleGnss { position_m } => row.set_all(Column::GpsX, position_m),
        _ => &mut row,
    };
    row
}

/// Attitude and rates of a log, in body axes.
struct Motion {
    euler_rad: Vec<(u64, [f64; 3])>,
    rates_radps: Vec<(u64, [f64; 3])>,
}

impl Motion {
    fn of(samples: &[(u64, Sample)]) -> Self {
        let mut motion = Self { euler_rad: Vec::new(), rates_radps: Vec::new() };
        for (time_us, sample) in samples {
            match sample {
                Sample::Attitude { euler_rad } => motion.euler_rad.push((*time_us, *euler_rad)),
                Sample::Rates { rates_radps } => motion.rates_radps.push((*time_us, *rates_radps)),
                _ => {}
            }
        }
        motion
    }

    /// The measurement of a sample; `None` where its arm needs what is not known then.
    fn measurement(&self, time_us: u64, sample: &Sample, installation: &Installation) -> Option<Measurement> {
        let arm_m = match sample {
            Sample::Depth { .. } => installation.depth_arm_m,
            Sample::Fix { .. } => installation.gnss_arm_m,
            Sample::BottomTrack { .. } => installation.dvl_arm_m,
            _ => [0.0; 3],
        };
        let mut x = VehicleState::zeros();
        if arm_m != [0.0; 3] {
            let (series, at, change): (_, _, fn(f64) -> f64) = match sample {
                Sample::BottomTrack { .. } => (&self.rates_radps, P, |change| change),
                _ => (&self.euler_rad, PHI, wrap_angle),
            };
            x.fixed_rows_mut::<3>(at).copy_from_slice(&interpolated(series, time_us, change)?);
        }
        installation::measurement(sample, installation, &x, [0.0; 2], 0.0)
    }
}

/// Value at a time: between two samples, or that of the nearest beyond the ends.
fn interpolated(series: &[(u64, [f64; 3])], time_us: u64, change: fn(f64) -> f64) -> Option<[f64; 3]> {
    let behind = series.partition_point(|(us, _)| *us < time_us);
    let before = behind.checked_sub(1).and_then(|i| series.get(i));
    let near = |(us, value): &(u64, [f64; 3])| (us.abs_diff(time_us) <= LONGEST_GAP_US).then_some(*value);
    match (before, series.get(behind)) {
        (Some((before_us, before)), Some((after_us, after))) => {
            let gap_us = after_us - before_us;
            let share = (time_us - before_us) as f64 / gap_us as f64;
            let between = || std::array::from_fn(|i| before[i] + share * change(after[i] - before[i]));
            (gap_us <= LONGEST_GAP_US).then(between)
        }
        (Some(only), None) | (None, Some(only)) => near(only),
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle that turns at 0.1 rad/s with a DVL 0.5 m ahead: its sway is ω times the arm, and nothing at the
    /// centre.
    #[test]
    fn val_a_log_is_moved_to_the_centre_once() {
        let installation = Installation {
            dvl_arm_m: [0.5, 0.0, 0.0],
            dvl_delay_s: 0.2,
            ahrs_delay_s: 0.1,
            depth_arm_m: [-0.4, 0.0, 0.0],
            ..Installation::DEFAULT
        };
        let mut log = Log::default();
        for k in 0..50_u64 {
            let mut row = LogRow::new(1_000_000 + k * 100_000);
            // pitched up by 0.2 rad: the sensor behind the centre is deeper
            row.set_all(Column::Roll, &[0.0, 0.2, 0.0]).set_all(Column::P, &[0.0, 0.0, 0.1]);
            row.set_all(Column::DvlU, &[1.0, 0.05, 0.0]).set(Column::Depth, 7.0).set(Column::PropRpm, 900.0);
            log.rows.push(row);
        }
        let centred = at_centre(&log, &installation);
        assert!(centred.rows.is_sorted_by_key(|row| row.time_us) && centred.at_centre);
        let at = |column| centred.column(column).collect::<Vec<_>>();
        assert!(at(Column::DvlV).iter().all(|(_, v)| v.abs() < 1e-15));
        assert!(at(Column::Depth).iter().all(|(_, z)| (z - (7.0 - 0.4 * 0.2_f64.sin())).abs() < 1e-12));
        let firsts = [Column::DvlU, Column::Roll, Column::Depth, Column::PropRpm].map(|column| at(column)[0].0);
        assert_eq!(firsts, [800_000, 900_000, 1_000_000, 1_000_000]);
        assert_eq!(at_centre(&centred, &installation).rows, centred.rows, "once");
        assert!(matches!(at_centre(&log, &Installation::DEFAULT), Cow::Borrowed(_)), "nothing to do");
    }

    #[test]
    fn val_a_logged_speed_is_late_as_a_dvl_is() {
        let mut log = Log::default();
        for k in 0..10_u64 {
            let mut row = LogRow::new(k * 1_000_000);
            log.rows.push(row.set(Column::SpeedLog, k as f64).set(Column::Heading, 0.1).clone());
        }
        let installation = Installation { dvl_delay_s: 1.5, ..Installation::DEFAULT };
        let centred = at_centre(&log, &installation);
        let speeds: Vec<_> = centred.column(Column::SpeedLog).collect();
        assert_eq!((speeds.len(), speeds[4]), (10, (2_500_000, 4.0)));
        assert_eq!(centred.column(Column::Heading).nth(4), Some((4_000_000, 0.1)));
    }

    #[test]
    fn samples_whose_arm_cannot_be_corrected_are_left_out_and_counted() {
        let mut log = Log::default();
        log.rows.push(LogRow::new(1_000_000).set_all(Column::DvlU, &[1.0, 0.0, 0.0]).clone());
        let installation = Installation { dvl_arm_m: [0.5, 0.0, 0.0], ..Installation::DEFAULT };
        let centred = at_centre(&log, &installation);
        assert!(centred.rows.is_empty() && centred.notes.iter().any(|note| note.starts_with("1 samples left out")));
    }
}
