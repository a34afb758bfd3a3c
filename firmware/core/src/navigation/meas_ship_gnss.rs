//! GNSS of the ship: h(x) = [x_s y_s].
//!
//! North and east of the ship's transducer in the local frame, m. Invalid until the ship is known.

use super::FusionOutcome;
use super::estimate::Estimate;
use super::observation::{Observation, Observations, Refused};

pub(super) fn observe(x: &Estimate, position_m: &[f64; 2], sigma_m: f64) -> Result<Observations, Refused> {
    let at = x.layout.ship().ok_or(FusionOutcome::Invalid)?;
    Ok(Observations::new(core::array::from_fn::<_, 2, _>(|i| {
        let (predicted, row) = x.direct(at + i);
        Observation { innovation: position_m[i] - predicted, row, variance: sigma_m * sigma_m }
    })))
}
