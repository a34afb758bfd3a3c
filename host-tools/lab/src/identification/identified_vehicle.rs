//! The vehicle that a study of faults flies with: identified by the board's identifier from a wrong prior.

use anyhow::anyhow;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::EffectSet;
use backseat_core::identification::theta::{B1, M11, theta_of, with_theta};
use backseat_identify::identifier::run_identifier;
use backseat_identify::{IdentificationData, Options};
use backseat_logs::VehicleFile;
use hil_sim::dataset::{Shape, Spec, simulate};
use hil_sim::rng::{Source, Stream};

/// Share by which the prior of the identification is wrong.
const WRONG: f64 = 0.1;
/// Length of the identification, s.
const IDENTIFICATION_S: f64 = 1200.0;
/// Seeds of identification logs are those of the runs plus this.
const OTHER_SEEDS: u64 = 500_000;

/// Every parameter but the scale wrong by the same share, with signs by the seed; B1 and B2 by that share of B3.
fn wrong_prior(seed: u64) -> VehicleParameters {
    let declared = VehicleFile::reference().parameters;
    let mut random = Stream::new(seed, Source::Effects);
    let mut theta = theta_of(&declared);
    let righting = theta[B1 + 2];
    for j in 0..theta.len() {
        let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
        let size = if j == B1 || j == B1 + 1 { righting } else { theta[j] };
        if j != M11 {
            theta[j] += sign * WRONG * size;
        }
    }
    with_theta(&declared, &theta)
}

/// The vehicle as the board's identifier knows it after its own log.
pub(super) fn identified(seed: u64) -> anyhow::Result<VehicleParameters> {
    let spec = Spec {
        shape: Shape::Excite,
        duration_s: IDENTIFICATION_S,
        ranges: false,
        ..Spec::new(VehicleFile::reference())
    };
    let log = simulate(&spec, seed + OTHER_SEEDS).log;
    let data = IdentificationData::from_log(&log, &EffectSet::NONE)?;
    let sensors = VehicleFile::reference().sensors;
    let options = Options::of_noise(sensors.dvl_mps, sensors.rates_radps, sensors.attitude_rad);
    let identifier = run_identifier(&data, &wrong_prior(seed), &options)?;
    identifier.parameters().ok_or_else(|| anyhow!("not configured"))
}
