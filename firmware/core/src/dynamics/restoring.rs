//! Weight and buoyancy (3.9), corrected: applied wrench [w s; B x s].

use super::VehicleParameters;
use nalgebra::{Vector3, Vector6};

/// Wet weight and the righting moment's vector, both independent of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restoring {
    /// w = (m − ρV) g, N; negative floats.
    weight_n: f64,
    /// B = ρV g b, N m, b from the centre of buoyancy to the centre of gravity.
    moment_nm: Vector3<f64>,
}

impl Restoring {
    pub(super) fn new(parameters: &VehicleParameters) -> Self {
        let buoyancy_n = parameters.displaced_mass_kg * parameters.g_mps2;
        Self {
            weight_n: (parameters.mass_kg - parameters.displaced_mass_kg) * parameters.g_mps2,
            moment_nm: Vector3::from(parameters.b_cb_to_cg_m) * buoyancy_n,
        }
    }

    /// [w s; B x s] with s = Rᵀ e3 (linear in s, so it also maps derivatives of s). N and N m.
    #[must_use]
    pub fn wrench(&self, s: &Vector3<f64>) -> Vector6<f64> {
        let force = s * self.weight_n;
        let moment = self.moment_nm.cross(s);
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }

    /// Potential energy −w z − B·s of the wrench, J (zero at the surface with s normal to B).
    #[must_use]
    pub fn potential_j(&self, z_m: f64, s: &Vector3<f64>) -> f64 {
        -self.weight_n * z_m - self.moment_nm.dot(s)
    }
}
