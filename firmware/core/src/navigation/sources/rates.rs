//! Body rates (Table 2.1): h(x) = [p q r].
//!
//! Angular velocity of the body over inertial space in body axes, rad/s; the Earth's rate is
//! far below the sensor's noise. Always valid.

use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::Observations;
use crate::state::P;

pub(crate) fn observe(x: &Estimate, rates_radps: &[f64; 3], sigma_radps: f64, out: &mut Observations) {
    for (i, rate) in rates_radps.iter().enumerate() {
        out.add_direct(P + i, rate - x.get(P + i), sigma_radps * sigma_radps);
    }
}
