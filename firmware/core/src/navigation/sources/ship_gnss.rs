//! GNSS of the ship: h(x) = [x_s y_s].
//!
//! North and east of the ship's transducer in the local frame, m. Invalid until the ship is known.

use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::{Observations, Refused};
use crate::navigation::interface::measurement::FusionOutcome;

pub(crate) fn observe(
    x: &Estimate,
    position_m: &[f64; 2],
    sigma_m: f64,
    out: &mut Observations,
) -> Result<(), Refused> {
    let at = x.layout.ship().ok_or(FusionOutcome::Invalid)?;
    for (i, position) in position_m.iter().enumerate() {
        out.add_direct(at + i, position - x.get(at + i), sigma_m * sigma_m);
    }
    Ok(())
}
