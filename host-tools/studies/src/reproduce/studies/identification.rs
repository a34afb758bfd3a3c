//! Identification on simulated experiments by every method, at the noises of Table 4.13.

use super::{Measured, Study};
use crate::identification::experiment::{Experiment, declared, wrong_prior};
use anyhow::Context;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::EffectSet;
use backseat_identify::parameters::{self, EXTENDED};
use backseat_identify::validation::COLUMNS;
use backseat_identify::{IdentificationData, IdentifyError, Method, Options, identify, validate};

/// Nullspace methods.
pub const NULLSPACE: Study = Study { name: "nullspace", run: run_nullspace };
/// Adaptive identification.
pub const ADAPTIVE: Study = Study { name: "adaptive", run: run_adaptive };

/// Share by which the prior is wrong, unless a row says otherwise.
const WRONG: f64 = 0.3;
/// Undeclared [d26, d35].
const CROSS_DRAG: [f64; 2] = [8.0, -8.0];
/// Noise of linear velocity, m/s, of the rows that have only one.
const NOISE: f64 = 0.014;
/// Parameters that the NBLS of the thesis does not identify: B1, B2.
const NOT_BY_NBLS: [usize; 2] = [13, 14];

/// One log and its validation data.
pub struct Case {
    pub data: IdentificationData,
    pub prior: VehicleParameters,
    pub options: Options,
    unseen: IdentificationData,
    truth: VehicleParameters,
}

impl Case {
    pub fn new(seed: u64, noise_mps: f64, wrong: f64, cross_drag: [f64; 2]) -> anyhow::Result<Self> {
        let experiment = Experiment { cross_drag, ..Experiment::identification(noise_mps) };
        let data = IdentificationData::from_log(&experiment.run(seed).log, &EffectSet::NONE)?;
        let unseen = Experiment { cross_drag, ..Experiment::cross_validation() }.run(seed);
        let unseen = IdentificationData::from_log(&unseen.exact_log(), &EffectSet::NONE)?;
        let [_, _, _, p, q, r] = Options::DEFAULT.velocity_noise;
        let noise = noise_mps.max(1.0e-4);
        let options = Options { velocity_noise: [noise, noise, noise, p, q, r], ..Options::DEFAULT };
        let [d26, d35] = cross_drag;
        let truth = VehicleParameters { d26, d35, ..declared() };
        Ok(Self { data, prior: wrong_prior(wrong, seed), options, unseen, truth })
    }

    /// Mean absolute errors of a vehicle in cross-validation, in the order of [`COLUMNS`]; NaN where it cannot be run.
    pub fn errors(&self, vehicle: &VehicleParameters) -> [f64; 8] {
        validate(vehicle, &self.unseen).map_or([f64::NAN; 8], |validation| validation.mean_absolute)
    }

    /// [`Self::errors`] as a row.
    pub fn judge(&self, measured: &mut Measured, row: &str, vehicle: &VehicleParameters) {
        for (column, error) in COLUMNS.iter().zip(self.errors(vehicle)) {
            measured.set(row, column, error);
        }
    }

    fn row(&self, measured: &mut Measured, row: &str, method: Method) -> anyhow::Result<()> {
        match identify(method, &self.data, &self.prior, &self.options, &|_| {}) {
            Ok(estimate) => self.judge(measured, row, &estimate.vehicle),
            Err(IdentifyError::Degenerate(_)) => {
                COLUMNS.iter().for_each(|column| measured.set(row, column, f64::NAN));
            }
            Err(error) => return Err(error).context(row.to_owned()),
        }
        Ok(())
    }
}

fn run_nullspace(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for (name, column, noise) in [
        ("0 cm/s", "at_0", 0.0),
        ("0.3 cm/s", "at_03", 0.003),
        ("0.6 cm/s", "at_06", 0.006),
        ("1.4 cm/s", "at_14", NOISE),
    ] {
        let case = Case::new(seed, noise, WRONG, [0.0; 2])?;
        case.row(&mut measured, &format!("GTLS, {name}"), Method::Gtls)?;
        let estimate = identify(Method::Nbls, &case.data, &case.prior, &case.options, &|_| {})?;
        case.judge(&mut measured, &format!("NBLS, {name}"), &estimate.vehicle);
        let (found, truth) = (parameters::of(&estimate.vehicle), parameters::of(&case.truth));
        let left = estimate.notes.iter().any(|note| note.starts_with("left their box"));
        measured.set(&format!("NBLS, {name}"), "inside", f64::from(u8::from(!left)));
        for j in (0..EXTENDED).filter(|j| !NOT_BY_NBLS.contains(j) && truth[*j] != 0.0) {
            measured.set(parameters::name(j), column, 100.0 * (found[j] / truth[j] - 1.0));
        }
    }
    let case = Case::new(seed, 0.0, WRONG, CROSS_DRAG)?;
    case.row(&mut measured, "NBLS, 0 cm/s, d26 = 8, d35 = −8", Method::Nbls)?;
    Ok(measured)
}

fn run_adaptive(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for (name, noise) in [("0 cm/s", 0.0), ("1.2 cm/s", 0.012), ("1.4 cm/s", NOISE)] {
        let case = Case::new(seed, noise, WRONG, [0.0; 2])?;
        case.row(&mut measured, &format!("AID, {name}"), Method::Aid)?;
        case.row(&mut measured, &format!("AID online, {name}"), Method::AidOnline)?;
        if noise == NOISE {
            case.judge(&mut measured, "prior, 30 % wrong", &case.prior);
        }
    }
    Case::new(seed, NOISE, WRONG, CROSS_DRAG)?.row(&mut measured, "AID, undeclared d26, d35", Method::Aid)?;
    Case::new(seed, NOISE, 0.5, [0.0; 2])?.row(&mut measured, "AID, prior 50 % wrong", Method::Aid)?;
    Ok(measured)
}
