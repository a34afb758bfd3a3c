//! Depth (Table 2.1): h(x) = z.
//!
//! z is the depth of the centre of gravity below the surface, NED down, m. Always valid; a
//! surfaced vehicle measures its draught.

use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::Observations;
use crate::state::Z;

pub(crate) fn observe(x: &Estimate, z_m: f64, sigma_m: f64, out: &mut Observations) {
    out.add_direct(Z, z_m - x.get(Z), sigma_m * sigma_m);
}
