//! DVL (Table 2.1): bottom track h(x) = ν + Rᵀ c, water track h(x) = ν.
//!
//! ν is the body velocity through the water, c the current in NED, R turns body axes into NED;
//! m/s, in body axes at the centre of gravity. Without a current bottom track is taken as ν.
//! Invalid out of bottom lock (bottom track) and in a sheared layer (water track); the reader of the
//! DVL has to check both.

use super::models::{BottomTrack, bottom_track};
use crate::dynamics::Attitude;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::Observations;
use crate::state::{self, PHI, U};

pub(crate) fn observe_bottom(x: &Estimate, velocity_mps: &[f64; 3], sigma_mps: f64, out: &mut Observations) {
    observe_water(x, velocity_mps, sigma_mps, out);
    let at = x.layout.current();
    if at.is_none() && x.water_mps == [0.0; 2] {
        return;
    }
    let attitude = Attitude::new(&state::attitude(&x.vehicle));
    let BottomTrack { current_in_body, by_attitude, rotation } = bottom_track(&attitude, &x.current());
    for (i, observation) in out.as_mut_slice().iter_mut().enumerate().take(3) {
        observation.innovation -= current_in_body[i];
        for k in 0..3 {
            observation.row.push(PHI + k, by_attitude[(i, k)]);
        }
        if let Some(at) = at {
            observation.row.push(at, rotation[(0, i)]);
            observation.row.push(at + 1, rotation[(1, i)]);
        }
    }
}

pub(crate) fn observe_water(x: &Estimate, velocity_mps: &[f64; 3], sigma_mps: f64, out: &mut Observations) {
    for (i, velocity) in velocity_mps.iter().enumerate() {
        out.add_direct(U + i, velocity - x.get(U + i), sigma_mps * sigma_mps);
    }
}
