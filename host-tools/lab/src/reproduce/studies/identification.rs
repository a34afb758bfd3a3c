//! Identification and cross-validation over a grid of sensor noise: Tables 4.10 to 4.19.

use super::{Kind, Measured, Study};
use crate::experiment::{Between, Experiment, Motion, Noise, OpenLoop, References, declared, wrong_prior};
use crate::identification::nullspace;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::EffectSet;
use backseat_core::identification::theta::M11;
use backseat_core::state::wrap_angle;
use backseat_identify::validation::COLUMNS;
use backseat_identify::{IdentificationData, Method, Options, identify, parameters};
use backseat_logs::{Truth, TruthRow};

/// NBLS on the references of Table 4.6, Tables 4.10 to 4.12.
pub const NBLS: Study = Study {
    name: "nbls",
    kind: Kind::Identification(NoiseGrid {
        method: By::Nbls,
        motion: NBLS_MOTION,
        duration_s: NBLS_S,
        rates_degps: 0.01,
        velocity_cmps: &[0.0, 0.01, 0.1, 0.2, 0.4, 0.5, 0.6, 0.65, 0.7],
    }),
};
/// The same over cut-offs.
pub const NBLS_CUT_OFFS: Study = Study { name: "nbls cut-offs", kind: Kind::Own(run_cut_offs) };

const NBLS_MOTION: Motion = Motion::References(References::TABLE_4_6);
/// "About 30 minutes", s.
const NBLS_S: f64 = 1800.0;
/// Ours; with 0.5 Hz NBLS fails where the thesis' own does.
const NBLS_CUTOFF_HZ: f64 = 0.2;

/// AID on the inputs of Table 4.14, Tables 4.15 to 4.17 and Figure 4.11.
pub const AID_FINE_RATES: Study = Study {
    name: "aid, 0.01 deg/s",
    kind: Kind::Identification(NoiseGrid {
        rates_degps: 0.01,
        velocity_cmps: &[0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, TABLE_4_13_CMPS, 1.4],
        ..AID
    }),
};
/// The same with ten times the noise of angular rates, Tables 4.18 and 4.19.
pub const AID_COARSE_RATES: Study = Study {
    name: "aid, 0.1 deg/s",
    kind: Kind::Identification(NoiseGrid {
        rates_degps: 0.1,
        velocity_cmps: &[0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4],
        ..AID
    }),
};

const AID: NoiseGrid = NoiseGrid {
    method: By::Aid,
    motion: Motion::OpenLoop(OpenLoop::IDENTIFICATION),
    duration_s: 5000.0,
    rates_degps: 0.01,
    velocity_cmps: &[],
};

/// Noise of linear velocity in Table 4.13, cm/s; Figure 4.11 is taken to be of it.
const TABLE_4_13_CMPS: f64 = 1.3;
/// Noise of roll and pitch in Table 4.13, deg.
const ROLL_PITCH_DEG: f64 = 0.25;
/// Length of the cross-validation, which the thesis does not give, s.
const VALIDATION_S: f64 = 1000.0;
/// Share by which AID's prior is wrong at most; the thesis does not give its own.
const WRONG: f64 = 0.3;
/// Samples between two points of Figure 4.11's curves.
const CURVE: usize = 20;

/// The method of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum By {
    Nbls,
    Aid,
}

/// A grid.
#[derive(Clone, Copy, Debug)]
pub struct NoiseGrid {
    method: By,
    motion: Motion,
    duration_s: f64,
    /// Noise of angular rates, deg/s.
    rates_degps: f64,
    /// Noise of linear velocity, cm/s.
    velocity_cmps: &'static [f64],
}

impl NoiseGrid {
    /// MAE and RMS of every noise.
    pub fn run(&self, seed: u64) -> anyhow::Result<Measured> {
        let mut measured = Measured::default();
        for &cmps in self.velocity_cmps {
            let noise = Noise {
                linear_mps: 0.01 * cmps,
                angular_radps: self.rates_degps.to_radians(),
                roll_pitch_rad: ROLL_PITCH_DEG.to_radians(),
            };
            let case = ExperimentLog::new(seed, self.motion, self.duration_s, noise)?;
            let vehicle = match self.method {
                By::Nbls => case.nbls(NBLS_CUTOFF_HZ)?,
                By::Aid => identify(Method::Aid, &case.data, &case.prior, &case.options, &|_| {})?.vehicle,
            };
            case.keep_errors(&mut measured, &format!("{cmps} cm/s"), &vehicle);
            if self.method == By::Aid && cmps == TABLE_4_13_CMPS {
                case.keep_curves(&mut measured, &vehicle);
            }
        }
        Ok(measured)
    }
}

/// One log and its validation data.
pub struct ExperimentLog {
    pub data: IdentificationData,
    pub prior: VehicleParameters,
    pub options: Options,
    /// The true vehicle's states in the cross-validation.
    unseen: Truth,
}

/// CROSSIM of Table 4.14, exact.
const UNSEEN: Experiment = Experiment {
    motion: Motion::OpenLoop(OpenLoop::VALIDATION),
    duration_s: VALIDATION_S,
    noise: Noise::NONE,
    cross_drag: [0.0; 2],
    between: Between { continuous: false, delay_s: 0.0 },
};

/// Error of a vehicle at a time of the cross-validation, s, in the order and units of [`COLUMNS`].
type ErrorAt = (f64, [f64; 8]);

impl ExperimentLog {
    /// An experiment of this motion.
    pub fn new(seed: u64, motion: Motion, duration_s: f64, noise: Noise) -> anyhow::Result<Self> {
        let experiment = Experiment { motion, duration_s, noise, cross_drag: [0.0; 2], between: Between::default() };
        let data = IdentificationData::from_log(&experiment.run(seed).log, &EffectSet::NONE)?;
        let options = Options::of_noise(noise.linear_mps.max(1.0e-4), noise.angular_radps, noise.roll_pitch_rad);
        Ok(Self { data, prior: wrong_prior(WRONG, seed), options, unseen: UNSEEN.run(seed).truth })
    }

    /// The experiment of Tables 4.13 and 4.14.
    pub fn table_4_13(seed: u64) -> anyhow::Result<Self> {
        Self::new(seed, AID.motion, AID.duration_s, Noise::table_4_13(0.01 * TABLE_4_13_CMPS))
    }

    /// NBLS of the thesis, without bounds.
    fn nbls(&self, cutoff_hz: f64) -> anyhow::Result<VehicleParameters> {
        let values = nullspace::unbounded(&self.data, None, &declared(), M11, cutoff_hz)?;
        Ok(parameters::with(&declared(), &values))
    }

    /// Errors of a vehicle in cross-validation, from the true start; none of a vehicle whose simulation does not stay
    /// finite to the end.
    fn errors(&self, vehicle: &VehicleParameters) -> Option<Vec<ErrorAt>> {
        let simulated = UNSEEN.run_of(vehicle, 0).truth;
        let error = |(a, b): (&TruthRow, &TruthRow)| -> ErrorAt {
            let difference = a.state - b.state;
            let angle = |i: usize| wrap_angle(difference[i]).to_degrees();
            let rate = |i: usize| difference[i].to_degrees();
            let [u, v, w] = [6, 7, 8].map(|i| difference[i]);
            (a.time_us as f64 * 1e-6, [angle(3), angle(4), rate(9), rate(10), rate(11), u, v, w])
        };
        let errors: Vec<ErrorAt> = self.unseen.rows.iter().zip(&simulated.rows).map(error).collect();
        errors.iter().all(|(_, errors)| errors.iter().all(|error| error.is_finite())).then_some(errors)
    }

    /// Errors of a vehicle as the rows `MAE, ...` and `RMS, ...`.
    pub fn keep_errors(&self, measured: &mut Measured, name: &str, vehicle: &VehicleParameters) {
        let errors = self.errors(vehicle);
        let over_time = |part: fn(f64) -> f64, column: usize| -> f64 {
            let Some(errors) = &errors else { return f64::NAN };
            errors.iter().map(|(_, errors)| part(errors[column])).sum::<f64>() / errors.len() as f64
        };
        for (column, name_of_column) in COLUMNS.iter().enumerate() {
            measured.set(&format!("MAE, {name}"), name_of_column, over_time(f64::abs, column));
            measured.set(&format!("RMS, {name}"), name_of_column, over_time(|e| e * e, column).sqrt());
        }
        for statistic in ["MAE", "RMS"] {
            measured.set(&format!("{statistic}, {name}"), "completes", f64::from(u8::from(errors.is_some())));
        }
    }

    /// Figure 4.11: errors of the six velocities over the cross-validation.
    fn keep_curves(&self, measured: &mut Measured, vehicle: &VehicleParameters) {
        let Some(errors) = self.errors(vehicle) else { return };
        let velocities =
            [("u [m/s]", 5), ("v [m/s]", 6), ("w [m/s]", 7), ("p [deg/s]", 2), ("q [deg/s]", 3), ("r [deg/s]", 4)];
        for (row, column) in velocities {
            let errors: Vec<(f64, f64)> = errors.iter().map(|(time_s, e)| (time_s / 3600.0, e[column])).collect();
            let mean = |part: fn(f64) -> f64| errors.iter().map(|(_, e)| part(*e)).sum::<f64>() / errors.len() as f64;
            measured.set(row, "mean_absolute", mean(f64::abs));
            measured.set(row, "root_mean_square", mean(|e| e * e).sqrt());
            measured.set(row, "largest", errors.iter().fold(0.0, |largest, (_, error)| f64::max(largest, error.abs())));
            measured.curve("crossim", row, errors.into_iter().step_by(CURVE));
        }
    }
}

/// Where NBLS fails with each cut-off of the filter, which the thesis does not give.
fn run_cut_offs(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for cmps in [0.2, 0.4, 0.5, 0.6, 0.65, 0.7, 1.0] {
        let noise = Noise::table_4_13(0.01 * cmps);
        let case = ExperimentLog::new(seed, NBLS_MOTION, NBLS_S, noise)?;
        for cutoff_hz in [0.1, 0.15, 0.2, 0.25, 0.3, 0.5] {
            let completes = case.errors(&case.nbls(cutoff_hz)?).is_some();
            measured.set(&format!("{cutoff_hz} Hz"), &format!("at_{cmps}"), f64::from(u8::from(completes)));
        }
    }
    Ok(measured)
}
