//! A DVL beside a reference velocity: an inertial solution made after the run, or GNSS.
//!
//! At time t the DVL reads (1 + scale) Ry(pitch)ᵀ Rz(yaw)ᵀ (Rᵀ V + ω × (r + arm)) of time t − delay, where V, R and ω
//! are the reference's velocity, attitude and turn. Delay, arm, scale and misalignment are the catalogue's. The delay
//! is that of the DVL against the reference; a negative one means that the reference's time stamps are the late ones.
//! Each run has a delay of its own, because clocks are set at the start of a run; arm, scale and turn belong to the
//! vehicle.

use super::layout::Layout;
use super::model::{Entry, LogModel, Measures, OutsideTerm, Row};
use super::runs::{DELAYS, MOST_RUNS};
use super::selection::{self, LogModelDiagnosis};
use crate::found::ParameterEstimate;
use crate::prepared_log::FORECAST_SHARE;
use crate::samples::ResidualChannel;
use backseat_core::dynamics::Attitude;
use backseat_core::state::wrap_angle;
use backseat_logs::log::Column;
use backseat_logs::{Log, VehicleFile};
use nalgebra::Vector3;

/// Fewest readings that are worth a fit.
const FEWEST: usize = 60;
/// Short blocks: a reading a second, and turns that last some seconds.
const BLOCK_S: f64 = 5.0;
/// Readings nearer to the ends of a run are left out, so that a delay does not reach beyond them, s.
const EDGE_S: f64 = 5.0;
/// A longer gap in the reference ends a run, s.
const LONGEST_GAP_S: f64 = 3.0;

/// Columns: arm; scale; yaw, pitch; then those without a name: roll of the DVL; then one delay a run.
const ARM: usize = 0;
const SCALE: usize = 3;
const YAW: usize = 4;
const ROLL: usize = 6;
const DELAY: usize = 7;
/// Step of the derivatives by differences: m, 1, rad and s alike.
const STEP: f64 = 1e-4;
/// Reference at one time: velocity north, east, down, and Euler angles without jumps.
type Reference = [f64; 6];

/// One run of the reference.
struct ReferenceRun {
    t_s: Vec<f64>,
    reference: Vec<Reference>,
}

impl ReferenceRun {
    /// The reference at a time and its derivative, by cubics through the neighbours with their central slopes.
    fn at(&self, t_s: f64) -> (Reference, Reference) {
        let last = self.t_s.len() - 1;
        let behind = self.t_s.partition_point(|at| *at <= t_s).clamp(1, last);
        let (i, j) = (behind - 1, behind);
        let h = self.t_s[j] - self.t_s[i];
        let s = ((t_s - self.t_s[i]) / h).clamp(0.0, 1.0);
        let slope = |k: usize, of: usize| {
            let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
            (self.reference[to][of] - self.reference[from][of]) / (self.t_s[to] - self.t_s[from])
        };
        let (mut value, mut rate) = ([0.0; 6], [0.0; 6]);
        for of in 0..6 {
            let (a, b) = (self.reference[i][of], self.reference[j][of]);
            let (ma, mb) = (h * slope(i, of), h * slope(j, of));
            let (c2, c3) = (3.0 * (b - a) - 2.0 * ma - mb, 2.0 * (a - b) + ma + mb);
            value[of] = a + s * (ma + s * (c2 + s * c3));
            rate[of] = (ma + s * (2.0 * c2 + 3.0 * s * c3)) / h;
        }
        (value, rate)
    }
}

/// What a term may depend on at one reading.
struct Instant {
    /// Reference velocity in body axes, m/s.
    body: Vector3<f64>,
    /// p, q, r, rad/s.
    rates: Vector3<f64>,
    /// rad.
    roll: f64,
    /// rad.
    pitch: f64,
}

/// A term in no catalogue: its equation, the axis of the DVL that it adds to, and the monomial.
type Term = (&'static str, usize, fn(&Instant) -> f64);

/// Monomials of velocity, attitude and rates whose factor has a sensible unit.
const TERMS: [Term; 24] = [
    ("dvl_u += k, an offset [m/s]", 0, |_| 1.0),
    ("dvl_v += k, an offset [m/s]", 1, |_| 1.0),
    ("dvl_w += k, an offset [m/s]", 2, |_| 1.0),
    ("dvl_u += k v, beams that are not square [1]", 0, |i| i.body.y),
    ("dvl_u += k w, beams that are not square [1]", 0, |i| i.body.z),
    ("dvl_v += k w, beams that are not square [1]", 1, |i| i.body.z),
    ("dvl_v += k v, a scale of its own [1]", 1, |i| i.body.y),
    ("dvl_w += k w, a scale of its own [1]", 2, |i| i.body.z),
    ("dvl_u += k u u, a scale that grows with speed [s/m]", 0, |i| i.body.x * i.body.x),
    ("dvl_v += k u u [s/m]", 1, |i| i.body.x * i.body.x),
    ("dvl_w += k u u [s/m]", 2, |i| i.body.x * i.body.x),
    ("dvl_v += k u phi, roll of the reference that is not the DVL's [1/rad]", 1, |i| i.body.x * i.roll),
    ("dvl_w += k u theta, a scale of the pitch [1/rad]", 2, |i| i.body.x * i.pitch),
    ("dvl_u += k u theta, a scale that depends on pitch [1/rad]", 0, |i| i.body.x * i.pitch),
    ("dvl_v += k theta [m/(s rad)]", 1, |i| i.pitch),
    ("dvl_w += k phi [m/(s rad)]", 2, |i| i.roll),
    ("dvl_u += k phi [m/(s rad)]", 0, |i| i.roll),
    ("dvl_u += k r r, an arm of the reference's own [m s]", 0, |i| i.rates.z * i.rates.z),
    ("dvl_v += k r r [m s]", 1, |i| i.rates.z * i.rates.z),
    ("dvl_v += k r |r| [m s]", 1, |i| i.rates.z * i.rates.z.abs()),
    ("dvl_w += k r r [m s]", 2, |i| i.rates.z * i.rates.z),
    ("dvl_w += k u r, a roll that turns make [s/rad]", 2, |i| i.body.x * i.rates.z),
    ("dvl_u += k u q [s/rad]", 0, |i| i.body.x * i.rates.y),
    ("dvl_u += k u r [s/rad]", 0, |i| i.body.x * i.rates.z),
];

struct DvlReading {
    run: usize,
    t_s: f64,
    dvl_mps: Vector3<f64>,
}

struct ReferenceVelocity {
    runs: Vec<ReferenceRun>,
    samples: Vec<DvlReading>,
    declared_arm_m: Vector3<f64>,
    declared_delay_s: f64,
}

impl ReferenceVelocity {
    /// First column of the terms in no catalogue.
    fn terms(&self) -> usize {
        DELAY + self.runs.len()
    }

    /// What the DVL reads.
    fn predicted(&self, sample: &DvlReading, theta: &[f64]) -> Vector3<f64> {
        let delay_s = self.declared_delay_s + theta[DELAY + sample.run];
        let ([vn, ve, vd, roll, pitch, heading], [.., p, q, r]) = self.runs[sample.run].at(sample.t_s - delay_s);
        let attitude = Attitude::new(&Vector3::new(roll, pitch, heading));
        let body = attitude.rotation().transpose() * Vector3::new(vn, ve, vd);
        let ((sr, cr), (sp, cp)) = (roll.sin_cos(), pitch.sin_cos());
        let rates = Vector3::new(p - sp * r, cr * q + sr * cp * r, cr * cp * r - sr * q);
        let arm = self.declared_arm_m + Vector3::new(theta[ARM], theta[ARM + 1], theta[ARM + 2]);
        let at_dvl = body + rates.cross(&arm);
        let turn = Attitude::new(&Vector3::new(theta[ROLL], theta[YAW + 1], theta[YAW])).rotation();
        let mut read = (1.0 + theta[SCALE]) * (turn.transpose() * at_dvl);
        for ((_, axis, factor), value) in TERMS.iter().zip(&theta[self.terms()..]).filter(|(_, value)| **value != 0.0) {
            read[*axis] += value * factor(&Instant { body, rates, roll, pitch });
        }
        read
    }
}

impl LogModel for ReferenceVelocity {
    fn columns(&self) -> usize {
        self.terms() + TERMS.len()
    }

    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        let of = |sample: &DvlReading| {
            let predicted = self.predicted(sample, theta);
            let mut slopes = vec![vec![0.0; self.columns()]; 3];
            for column in (0..DELAY).chain([DELAY + sample.run]).chain(self.terms()..self.columns()) {
                let mut moved = theta.to_vec();
                moved[column] += STEP;
                let change = (self.predicted(sample, &moved) - predicted) / STEP;
                for axis in 0..3 {
                    slopes[axis][column] = change[axis];
                }
            }
            let channels = [ResidualChannel::DvlU, ResidualChannel::DvlV, ResidualChannel::DvlW];
            let residual = sample.dvl_mps - predicted;
            let row = |(axis, slopes): (usize, Vec<f64>)| Row {
                t_s: sample.t_s,
                channel: channels[axis],
                sequence: sample.run as u32,
                residual: residual[axis],
                slopes,
            };
            slopes.into_iter().enumerate().map(row).collect::<Vec<_>>()
        };
        self.samples.iter().flat_map(of).collect()
    }

    fn calibrated(&self) -> Vec<usize> {
        Vec::new()
    }

    fn entries(&self) -> Vec<Entry> {
        vec![
            ("dvl_lever_arm", vec![ARM, ARM + 1, ARM + 2]),
            ("dvl_delay", (DELAY..self.terms()).collect()),
            ("dvl_scale", vec![SCALE]),
            ("dvl_misalignment", vec![YAW, YAW + 1]),
        ]
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        let terms = TERMS.iter().enumerate().map(|(k, (name, ..))| (*name, vec![self.terms() + k]));
        [("roll of the DVL in its mount", vec![ROLL])].into_iter().chain(terms).collect()
    }

    /// Nobody can forecast the delay of a run that was not seen.
    fn forecast_share(&self) -> f64 {
        if self.runs.len() > 1 { 0.0 } else { FORECAST_SHARE }
    }

    fn block_s(&self) -> f64 {
        BLOCK_S
    }

    fn measures(&self, rows: &[Row], _layout: &Layout) -> Measures {
        let velocity = rows.iter().map(|row| (row.t_s, row.residual)).collect();
        Measures { velocity, ..Measures::default() }
    }
}

/// Whether a log holds a DVL, an attitude and a reference velocity in three axes.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    [Column::RefNorth, Column::RefEast, Column::RefDown, Column::DvlU, Column::DvlW, Column::Heading]
        .into_iter()
        .all(|column| log.has(column))
}

/// Diagnoses a DVL against a reference velocity; `None` if they have too little in common.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let model = model(log, vehicle)?;
    let mut found = selection::run(&model, log, vehicle)?;
    if model.runs.len() > 1 {
        let (theta, sigmas) = (&found.theta[1], &found.sigmas);
        for effect in &mut found.diagnosis.effects {
            if effect.instance.candidate.effect == "dvl_delay" {
                let delays = (DELAY..model.terms()).zip(DELAYS);
                effect.values = delays
                    .map(|(column, name)| ParameterEstimate::size(name, "s", theta[column], sigmas[column]))
                    .collect();
            }
        }
    }
    let runs = model.runs.len();
    let mut notes = vec![format!(
        "declared model: the DVL reads the reference velocity in body axes at ({:.2}, {:.2}, {:.2}) m. {} readings in {runs} \
         run{}; the velocity errors below are those of single readings, in three axes",
        model.declared_arm_m[0],
        model.declared_arm_m[1],
        model.declared_arm_m[2],
        model.samples.len(),
        if runs == 1 { "" } else { "s" }
    )];
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

/// The log as runs of the reference and readings of the DVL.
fn model(log: &Log, vehicle: &VehicleFile) -> Option<ReferenceVelocity> {
    let installation = &vehicle.installation;
    let declared_turn = Attitude::new(&Vector3::from(installation.dvl_turn_rad)).rotation();
    let start_us = log.rows.first()?.time_us;
    let (mut runs, mut samples): (Vec<ReferenceRun>, Vec<DvlReading>) = (Vec::new(), Vec::new());
    for row in &log.rows {
        let t_s = (row.time_us - start_us) as f64 * 1e-6;
        let velocity = [Column::RefNorth, Column::RefEast, Column::RefDown].map(|column| row.get(column));
        if let ([Some(vn), Some(ve), Some(vd)], Some([roll, pitch, heading])) = (velocity, row.attitude_rad()) {
            let is_new = runs.last().is_none_or(|run| run.t_s.last().is_none_or(|last| t_s - last > LONGEST_GAP_S));
            if is_new {
                runs.push(ReferenceRun { t_s: Vec::new(), reference: Vec::new() });
            }
            let run = runs.last_mut()?;
            if run.t_s.last() == Some(&t_s) {
                continue;
            }
            // Angles without jumps of a turn, so that they can be interpolated.
            let last = run.reference.last().map_or([roll, pitch, heading], |last| [last[3], last[4], last[5]]);
            let follow = |before: f64, angle: f64| before + wrap_angle(angle - before);
            let angles = [follow(last[0], roll), follow(last[1], pitch), follow(last[2], heading)];
            run.t_s.push(t_s);
            run.reference.push([vn, ve, vd, angles[0], angles[1], angles[2]]);
        }
        if let (Some(dvl), false) = (row.dvl_mps(), runs.is_empty()) {
            samples.push(DvlReading { run: runs.len() - 1, t_s, dvl_mps: declared_turn * Vector3::from(dvl) });
        }
    }
    let inside = |sample: &DvlReading| {
        let t_s = &runs[sample.run].t_s;
        t_s.len() > 2 && t_s[0] + EDGE_S <= sample.t_s && sample.t_s + EDGE_S <= t_s[t_s.len() - 1]
    };
    samples.retain(inside);
    // Runs without a reading have no delay.
    let used: Vec<usize> = (0..runs.len()).filter(|run| samples.iter().any(|sample| sample.run == *run)).collect();
    for sample in &mut samples {
        sample.run = used.iter().position(|run| *run == sample.run)?;
    }
    let mut index = 0..;
    runs.retain(|_| index.next().is_some_and(|index| used.contains(&index)));
    let is_usable = samples.len() >= FEWEST && runs.len() <= MOST_RUNS;
    let declared_arm_m = Vector3::from(installation.dvl_arm_m);
    let declared_delay_s = installation.dvl_delay_s;
    is_usable.then_some(ReferenceVelocity { runs, samples, declared_arm_m, declared_delay_s })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::LogRow;
    use backseat_logs::stats::Z_95;
    use hil_sim::rng::{Source, Stream};

    /// Two runs of 200 s with turns to and fro, a DVL 1.8 m astern of the reference, which is 1.4 s late in the first
    /// run and 0.5 s in the second.
    fn log(seed: u64) -> Log {
        let (mut log, mut noise) = (Log::default(), Stream::new(seed, Source::Dvl));
        let heading = |t: f64| 1.2 * (t / 12.0).sin() + 0.8 * (t / 31.0).cos();
        let turn = |t: f64| 0.1 * (t / 12.0).cos() - 0.8 / 31.0 * (t / 31.0).sin();
        let pitch = |t: f64| 0.15 * (t / 9.0).sin();
        let velocity =
            |t: f64| Attitude::new(&Vector3::new(0.0, pitch(t), heading(t))).rotation() * Vector3::new(1.8, 0.05, 0.0);
        for (run, late_s) in [1.4, 0.5].into_iter().enumerate() {
            for k in 0..200_u64 {
                let t = k as f64 + 500.0 * run as f64;
                let mut row = LogRow::new(k * 1_000_000 + 500_000_000 * run as u64);
                row.set_all(Column::RefNorth, velocity(t - late_s).as_slice());
                row.set_all(Column::Roll, &[0.0, pitch(t - late_s), heading(t - late_s)]);
                let (q, r) = (0.15 / 9.0 * (t / 9.0).cos(), turn(t));
                let rates = Vector3::new(-pitch(t).sin() * r, q, pitch(t).cos() * r);
                let at_dvl = Vector3::new(1.8, 0.05, 0.0) + rates.cross(&Vector3::new(-1.8, 0.0, 0.1));
                row.set_all(Column::DvlU, (at_dvl + Vector3::from(noise.normals(0.003))).as_slice());
                log.rows.push(row);
            }
        }
        log
    }

    #[test]
    fn val_one_arm_and_a_delay_for_each_run() {
        for seed in 1..=8 {
            let log = log(seed);
            assert!(is_for(&log));
            let found = run(&log, &VehicleFile::reference()).unwrap();
            let values = |name: &str| {
                let effects = &found.diagnosis.effects;
                effects
                    .iter()
                    .find(|effect| effect.instance.candidate.effect == name)
                    .map(|effect| effect.values.clone())
            };
            let (arm, delays) = (values("dvl_lever_arm").unwrap(), values("dvl_delay").unwrap());
            assert_eq!(delays.iter().map(|delay| delay.name).collect::<Vec<_>>(), ["s (run 1)", "s (run 2)"]);
            // The DVL is early where the reference is late.
            for (value, truth) in arm.iter().chain(&delays).zip([-1.8, 0.0, 0.1, -1.4, -0.5]) {
                // Cubics through a reading a second add half a centimetre.
                let three_sigma = 3.0 * (value.ci95[1] - value.ci95[0]) / (2.0 * Z_95);
                assert!((value.value - truth).abs() < three_sigma + 0.005 && three_sigma < 0.1, "{seed}: {value:?}");
            }
            let [before, after] = found.scores;
            assert!(after.velocity_rmse_mps < Some(0.01) && before.velocity_rmse_mps > Some(0.05));
        }
    }
}
