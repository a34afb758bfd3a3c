//! Body rates (Table 2.1): h(x) = [p q r].
//!
//! Angular velocity of the body over inertial space in body axes, rad/s; the Earth's rate is
//! far below the sensor's noise. Always valid.

use super::estimate::Estimate;
use super::observation::{Observation, Observations};
use crate::state::P;

pub(super) fn observe(x: &Estimate, rates_radps: &[f64; 3], sigma_radps: f64) -> Observations {
    Observations::new(core::array::from_fn::<_, 3, _>(|i| {
        let (predicted, row) = x.direct(P + i);
        Observation { innovation: rates_radps[i] - predicted, row, variance: sigma_radps * sigma_radps }
    }))
}
