//! What a vehicle predicts of a log that it was not fitted to.

use crate::data::IdentificationData;
use crate::simulation::{self, OUTPUTS, Output};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};

/// Names of the columns, as in Table 4.15 and in JSON.
pub const COLUMNS: [&str; OUTPUTS] =
    ["roll_deg", "pitch_deg", "p_degps", "q_degps", "r_degps", "u_mps", "v_mps", "w_mps"];

/// The order of the columns in the outputs.
const ORDER: [usize; OUTPUTS] = [0, 1, 5, 6, 7, 2, 3, 4];

/// Mean absolute errors of the free run against a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validation {
    /// roll, pitch (deg), p, q, r (deg/s), u, v, w (m/s), in the order of [`COLUMNS`].
    pub mean_absolute: [f64; OUTPUTS],
    /// Time predicted, s.
    pub duration_s: f64,
}

/// What is predicted by saying that nothing changes: every output stays as it was first read. A model that does worse says
/// nothing of the vehicle.
#[must_use]
pub fn nothing_changes(data: &IdentificationData) -> Option<Validation> {
    let (mut sum, mut count) = (Output::zeros(), 0);
    for samples in data.stretches() {
        let first = simulation::measured(samples.first()?);
        for sample in samples {
            sum += (simulation::measured(sample) - first).abs();
            count += 1;
        }
    }
    Some(mean(&sum, count, data))
}

impl Validation {
    /// Whether another predicts better, all outputs together: the mean logarithm of the errors' ratios, so that no unit
    /// outweighs another.
    pub fn is_worse_than(&self, other: &Self) -> bool {
        let ratios =
            self.mean_absolute.iter().zip(&other.mean_absolute).filter(|(own, other)| **own > 0.0 && **other > 0.0);
        ratios.map(|(own, other)| (own / other).ln()).sum::<f64>() > 0.0
    }
}

/// Lets the vehicle run free from the first sample of each stretch and compares. Noise of the log counts as error.
/// `None` where the vehicle is unusable.
#[must_use]
pub fn validate(vehicle: &VehicleParameters, data: &IdentificationData) -> Option<Validation> {
    let model = VehicleModel::new(vehicle).ok()?;
    let (mut sum, mut count) = (Output::zeros(), 0);
    for samples in data.stretches() {
        let run = simulation::free_run(&model, &simulation::start(samples.first()?), samples);
        for (sample, x) in samples.iter().zip(run.iter().step_by(2)) {
            sum += simulation::residual(sample, x).abs();
            count += 1;
        }
    }
    Some(mean(&sum, count, data))
}

/// In the order and units of [`COLUMNS`].
fn mean(sum: &Output, count: u32, data: &IdentificationData) -> Validation {
    let mean_absolute = ORDER.map(|output| {
        let mean = sum[output] / f64::from(count.max(1));
        if (2..5).contains(&output) { mean } else { mean.to_degrees() }
    });
    Validation { mean_absolute, duration_s: data.duration_s() }
}
