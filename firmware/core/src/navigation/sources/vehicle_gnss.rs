//! GNSS of the vehicle: h(x) = [x y].
//!
//! North and east of the local frame, m, taken as those of the centre of gravity: the antenna of a
//! surfaced torpedo stands less than a metre from it. Invalid below the surface.

use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::Observations;
use crate::state::X;

pub(crate) fn observe(x: &Estimate, position_m: &[f64; 2], sigma_m: f64, out: &mut Observations) {
    for (i, position) in position_m.iter().enumerate() {
        out.add_direct(X + i, position - x.get(X + i), sigma_m * sigma_m);
    }
}
