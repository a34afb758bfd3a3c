//! Two-way travel times between a ship and fixed transponders whose places are not known well.
//!
//! A ping leaves the ship's transducer at one place and comes back to it at another. Half of the travel time times the
//! declared speed of sound is
//!
//! (1 + ratio) (1 + Σ a_k P_k(t)) (|s_tx − p| + |s_rx − p|) / 2,   s = antenna + R(φ, θ, ψ) arm
//!
//! with the ratio of the catalogue's `sound_speed`, the arm of its `transducer_lever_arm` (declared: the difference of
//! the two arms in `[installation]`), the transponder's place p, and the slow change of the mean sound speed as
//! Legendre polynomials P_k over the log. Places and slow change are fitted in any case, because nobody declares them.
//! The ratio is the mean over all paths, by the harmonic mean that a travel time sees; the bending of rays is in it.

use backseat_core::dynamics::Attitude;
use backseat_diagnose::log_models::{self, Entry, Layout, LogModel, LogModelDiagnosis, Measures, OutsideTerm, Row};
use backseat_diagnose::samples::ResidualChannel;
use backseat_logs::log::Column;
use backseat_logs::stats::{Z_95, median};
use backseat_logs::{Log, LogRow, VehicleFile};
use nalgebra::Vector3;

/// Fewest pings that are worth a fit.
const FEWEST: usize = 200;
/// Fewest pings of one transponder.
const FEWEST_EACH: usize = 30;
/// A ping comes every several seconds.
const BLOCK_S: f64 = 60.0;
/// Columns of the arm, and of the ratio behind them.
const ARM: usize = 0;
const RATIO: usize = 3;
const CHANGE: usize = 4;
/// Time for each term of the slow change, and most of them.
const TERM_S: f64 = 5400.0;
const MOST_TERMS: usize = 6;
/// Columns of a delay of the attitude and of a delay of the antenna's position, behind everything else.
const OTHERS: usize = 2;
/// Pings further off than this many times the median deviation are other paths.
const OUTLIER: f64 = 12.0;

struct Ping {
    t_s: f64,
    station: usize,
    /// Half the travel time times the declared speed of sound, m.
    range_m: f64,
    /// Antenna, north-east-down, at transmission and reception, m.
    antenna_m: [Vector3<f64>; 2],
    attitude: [Attitude; 2],
    /// Mean velocity of the antenna, m/s, and mean turn of the ship, rad/s.
    velocity_mps: Vector3<f64>,
    turn_radps: f64,
    /// Legendre polynomials at its time.
    change: Vec<f64>,
}

struct Transponders {
    pings: Vec<Ping>,
    /// Numbers in the labels, and declared places, m.
    stations: Vec<(f64, Vector3<f64>)>,
    declared_arm_m: Vector3<f64>,
    terms: usize,
}

impl Transponders {
    fn place(&self, station: usize) -> usize {
        CHANGE + self.terms + 3 * station
    }

    fn others(&self) -> usize {
        self.place(self.stations.len())
    }

    /// Measured minus predicted, and the slopes of the prediction.
    fn row(&self, ping: &Ping, theta: &[f64]) -> Row {
        let arm = self.declared_arm_m + Vector3::new(theta[ARM], theta[ARM + 1], theta[ARM + 2]);
        let first = self.place(ping.station);
        let place = self.stations[ping.station].1 + Vector3::new(theta[first], theta[first + 1], theta[first + 2]);
        let change = 1.0 + ping.change.iter().zip(&theta[CHANGE..]).map(|(p, a)| p * a).sum::<f64>();
        let scale = (1.0 + theta[RATIO]) * change;
        let mut slopes = vec![0.0; self.columns()];
        let mut way_m = 0.0;
        let others = self.others();
        for (antenna, attitude) in ping.antenna_m.iter().zip(&ping.attitude) {
            let rotation = attitude.rotation();
            let level_arm = rotation * arm;
            let from = antenna + level_arm - place;
            let distance_m = from.norm();
            let along = from / distance_m;
            way_m += 0.5 * distance_m;
            let by_arm = rotation.transpose() * along;
            for axis in 0..3 {
                slopes[ARM + axis] += 0.5 * scale * by_arm[axis];
                slopes[first + axis] -= 0.5 * scale * along[axis];
            }
            // A heading that is late by τ is behind by τ times the turn.
            let turned = Vector3::new(-level_arm[1], level_arm[0], 0.0) * ping.turn_radps;
            slopes[others] -= 0.5 * scale * along.dot(&turned);
            slopes[others + 1] -= 0.5 * scale * along.dot(&ping.velocity_mps);
        }
        slopes[RATIO] = change * way_m;
        for (slope, polynomial) in slopes[CHANGE..].iter_mut().zip(&ping.change) {
            *slope = (1.0 + theta[RATIO]) * polynomial * way_m;
        }
        let late = slopes[others] * theta[others] + slopes[others + 1] * theta[others + 1];
        let residual = ping.range_m - scale * way_m - late;
        Row { t_s: ping.t_s, channel: ResidualChannel::Range, sequence: 0, residual, slopes }
    }
}

impl LogModel for Transponders {
    fn columns(&self) -> usize {
        self.others() + OTHERS
    }

    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        self.pings.iter().map(|ping| self.row(ping, theta)).collect()
    }

    fn calibrated(&self) -> Vec<usize> {
        (CHANGE..self.others()).collect()
    }

    fn entries(&self) -> Vec<Entry> {
        let others = self.others();
        vec![
            ("transducer_lever_arm", vec![ARM, ARM + 1, ARM + 2]),
            ("sound_speed", vec![RATIO]),
            ("heading_lag", vec![others]),
        ]
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        vec![("radial speed: positions of the antenna that are late", vec![self.others() + 1])]
    }

    /// The sea's warming cannot be forecast, and a polynomial runs away beyond its data.
    fn forecast_share(&self) -> f64 {
        0.0
    }

    fn block_s(&self) -> f64 {
        BLOCK_S
    }

    fn measures(&self, rows: &[Row], _layout: &Layout) -> Measures {
        let position = rows.iter().map(|row| (row.t_s, row.residual)).collect();
        Measures { position, against: Some("range to the transponders"), ..Measures::default() }
    }
}

/// Whether a log is one of two-way travel times.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    log.has(Column::TwoWayTime)
}

/// Diagnoses a log of two-way travel times; `None` if it has too few of them, or no places of the transponders.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let c = vehicle.installation.sound_speed_mps;
    let mut model = model(log, vehicle)?;
    let all = model.pings.len();
    let mut found = log_models::run(&model, log, vehicle)?;
    // An echo of another path would bend every fit: what is far off is left out, and the rest fitted again.
    let residuals: Vec<f64> = model.rows(&found.theta[1]).iter().map(|row| row.residual.abs()).collect();
    let limit = OUTLIER * median(&residuals)?;
    if residuals.iter().any(|residual| *residual > limit) {
        let mut far = residuals.iter().map(|residual| *residual > limit);
        model.pings.retain(|_| !far.next().unwrap_or(false));
        found = log_models::run(&model, log, vehicle)?;
    }
    let (theta, sigmas) = (&found.theta[1], &found.sigmas);
    let mut notes = vec![
        format!(
            "two-way travel times to {} transponders: {} pings, {} left out as other paths. Places of the transponders and \
             the slow change of the sound speed ({} numbers) are always fitted, before and after",
            model.stations.len(),
            model.pings.len(),
            all - model.pings.len(),
            model.terms
        ),
        format!(
            "declared model: sound speed {c} m/s, transducer ({:.2}, {:.2}, {:.2}) m from the antenna",
            model.declared_arm_m[0], model.declared_arm_m[1], model.declared_arm_m[2]
        ),
    ];
    if sigmas[RATIO] > 0.0 {
        notes.push(format!(
            "fitted mean sound speed: {:.2} m/s (±{:.2})",
            c / (1.0 + theta[RATIO]),
            Z_95 * c * sigmas[RATIO]
        ));
    }
    for (index, (number, _)) in model.stations.iter().enumerate() {
        let first = model.place(index);
        let of = |axis: usize| format!("{:.2} (±{:.2})", theta[first + axis], Z_95 * sigmas[first + axis]);
        notes.push(format!("transponder {number}: place moved by {} north, {} east, {} down m", of(0), of(1), of(2)));
    }
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

/// The log as pings.
fn model(log: &Log, vehicle: &VehicleFile) -> Option<Transponders> {
    let c = vehicle.installation.sound_speed_mps;
    let start_us = log.rows.first()?.time_us;
    let vector = |row: &LogRow, columns: [Column; 3]| -> Option<Vector3<f64>> {
        Some(Vector3::new(row.get(columns[0])?, row.get(columns[1])?, row.get(columns[2])?))
    };
    let mut stations: Vec<(f64, Vector3<f64>)> = log
        .rows
        .iter()
        .filter_map(|row| {
            let place = vector(row, [Column::StationX, Column::StationY, Column::StationZ])?;
            Some((row.get(Column::Station)?, place))
        })
        .collect();
    let heard = |number: f64| log.column(Column::Station).filter(|(_, of)| *of == number).count();
    stations.retain(|(number, _)| heard(*number) > FEWEST_EACH);
    let duration_s = log.duration_s().max(1.0);
    let terms = ((duration_s / TERM_S) as usize).min(MOST_TERMS);
    let ping = |row: &LogRow| -> Option<Ping> {
        let number = row.get(Column::Station)?;
        let station = stations.iter().position(|(of, _)| *of == number)?;
        let travel_s = row.get(Column::TwoWayTime)?;
        let sent = vector(row, [Column::GpsX, Column::GpsY, Column::GpsZ])?;
        let heard = vector(row, [Column::ReplyGpsX, Column::ReplyGpsY, Column::ReplyGpsZ])?;
        let attitude = |columns| vector(row, columns).map(|at| Attitude::new(&at));
        let [roll, pitch, heading] = row.attitude_rad()?;
        let reply_heading = row.get(Column::ReplyHeading)?;
        let t_s = (row.time_us - start_us) as f64 * 1e-6;
        let from_start = 2.0 * t_s / duration_s - 1.0;
        Some(Ping {
            t_s,
            station,
            range_m: 0.5 * c * travel_s,
            antenna_m: [sent, heard],
            attitude: [
                Attitude::new(&Vector3::new(roll, pitch, heading)),
                attitude([Column::ReplyRoll, Column::ReplyPitch, Column::ReplyHeading])?,
            ],
            velocity_mps: (heard - sent) / travel_s,
            turn_radps: backseat_core::state::wrap_angle(reply_heading - heading) / travel_s,
            change: legendre(from_start, terms),
        })
    };
    let pings: Vec<Ping> = log.rows.iter().filter_map(ping).filter(|ping| ping.range_m > 0.0).collect();
    let arm = |arm: [f64; 3]| Vector3::from(arm);
    let declared_arm_m = arm(vehicle.installation.transducer_arm_m) - arm(vehicle.installation.gnss_arm_m);
    (pings.len() >= FEWEST).then_some(Transponders { pings, stations, declared_arm_m, terms })
}

/// Legendre polynomials of degree 1 to `count` at `x` from −1 to 1.
fn legendre(x: f64, count: usize) -> Vec<f64> {
    let mut all = vec![1.0, x];
    for n in 1..count {
        let n_f = n as f64;
        all.push(((2.0 * n_f + 1.0) * x * all[n] - n_f * all[n - 1]) / (n_f + 1.0));
    }
    all[1..=count].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::stats::rms;
    use hil_sim::rng::{Source, Stream};

    const ARM_M: [f64; 3] = [2.0, -1.5, 12.0];
    const SOUND_MPS: f64 = 1489.0;

    /// Two hours of lines over three transponders 1000 m down, declared up to 2 m off, travel times to the
    /// hundredth of a millisecond; the arm and the speed of sound are not declared.
    fn log() -> Log {
        let places = [[400.0, 0.0, 1000.0], [-300.0, 350.0, 1010.0], [-250.0, -400.0, 990.0]];
        let off = [[1.0, -1.5, 2.0], [-1.0, 0.5, -1.0], [0.3, 1.0, 0.5]];
        let (mut log, mut random) = (Log::default(), Stream::new(3, Source::Study));
        let mut noise = || random.uniform() - 0.5;
        for (station, (place, off)) in places.iter().zip(off).enumerate() {
            let mut row = LogRow::new(0);
            let declared: Vec<f64> = (0..3).map(|axis| place[axis] + off[axis]).collect();
            row.set(Column::Station, station as f64).set_all(Column::StationX, &declared);
            log.rows.push(row);
        }
        // Antenna and attitude at a time: legs of ten minutes on eight headings, rolling.
        let at = |t_s: f64| {
            let leg = (t_s / 600.0).floor();
            let heading = 2.3 * leg + 0.02 * (t_s / 11.0).sin();
            let along = (t_s - 600.0 * leg - 300.0) * 2.5;
            let antenna = Vector3::new(along * heading.cos() + 30.0 * leg, along * heading.sin() - 20.0 * leg, -15.0);
            (antenna, [0.05 * (t_s / 3.0).sin(), 0.02 * (t_s / 5.0).cos(), heading])
        };
        let transducer = |t_s: f64| {
            let (antenna, [roll, pitch, heading]) = at(t_s);
            antenna + Attitude::new(&Vector3::new(roll, pitch, heading)).rotation() * Vector3::from(ARM_M)
        };
        for k in 0..720_usize {
            let (t_s, station) = (10.0 * k as f64, k % 3);
            let place = Vector3::from(places[station]);
            let mut travel_s = 1.5;
            for _ in 0..5 {
                travel_s = ((transducer(t_s) - place).norm() + (transducer(t_s + travel_s) - place).norm()) / SOUND_MPS;
            }
            let ((sent, tilt), (heard, reply_tilt)) = (at(t_s), at(t_s + travel_s));
            let mut row = LogRow::new((t_s * 1e6) as u64);
            row.set(Column::Station, station as f64).set(Column::TwoWayTime, travel_s + 1e-4 * noise());
            row.set_all(Column::GpsX, &[sent[0], sent[1]]).set(Column::GpsZ, sent[2]).set_all(Column::Roll, &tilt);
            row.set_all(Column::ReplyGpsX, heard.as_slice()).set_all(Column::ReplyRoll, &reply_tilt);
            log.rows.push(row);
        }
        log
    }

    #[test]
    fn val_arm_and_sound_speed_of_a_synthetic_survey() {
        let log = log();
        assert!(is_for(&log));
        let found = run(&log, &VehicleFile::reference()).unwrap();
        let effect = |name: &str| {
            found.diagnosis.effects.iter().find(|effect| effect.instance.candidate.effect == name).unwrap_or_else(
                || {
                    panic!("{name}: {:?} {:?}", found.diagnosis.effects, found.diagnosis.notes);
                },
            )
        };
        let arm = effect("transducer_lever_arm");
        for (estimate, truth) in arm.values.iter().zip(ARM_M) {
            assert!((estimate.ci95[0]..=estimate.ci95[1]).contains(&truth), "{estimate:?}");
        }
        // Horizontally the arm is known to a tenth of a metre: 3 cm of noise a range, 700 ranges, eight headings.
        assert!(arm.values[..2].iter().all(|estimate| estimate.ci95[1] - estimate.ci95[0] < 0.1), "{:?}", arm.values);
        let ratio = effect("sound_speed").values[0];
        assert!((1500.0 / (1.0 + ratio.value) - SOUND_MPS).abs() < 0.2, "{ratio:?}");
        let residuals: Vec<f64> = found.scores[1].position_errors.iter().map(|(_, error)| *error).collect();
        assert!(rms(&residuals).unwrap() < 0.03); // 1e-4 s uniform is 0.022 m
        assert!(found.diagnosis.effects.len() == 2 && found.diagnosis.structure.named.is_empty());
    }

    #[test]
    fn without_places_there_is_no_model() {
        let mut log = log();
        log.rows.retain(|row| row.get(Column::StationX).is_none());
        assert!(run(&log, &VehicleFile::reference()).is_none());
    }

    #[test]
    fn val_legendre() {
        assert!(legendre(0.5, 3).iter().zip([0.5, -0.125, -0.4375]).all(|(p, truth)| (p - truth).abs() < 1e-12));
        assert!(legendre(0.5, 0).is_empty());
    }
}
