//! GNSS of the vehicle: h(x) = [x y].
//!
//! North and east of the local frame, m, taken as those of the centre of gravity: the antenna of a
//! surfaced torpedo stands less than a metre from it. Invalid below the surface.

use super::estimate::Estimate;
use super::observation::{Observation, Observations};
use crate::state::X;

pub(super) fn observe(x: &Estimate, position_m: &[f64; 2], sigma_m: f64) -> Observations {
    Observations::new(core::array::from_fn::<_, 2, _>(|i| {
        let (predicted, row) = x.direct(X + i);
        Observation { innovation: position_m[i] - predicted, row, variance: sigma_m * sigma_m }
    }))
}
