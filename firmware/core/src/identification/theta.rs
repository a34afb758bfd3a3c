//! θ, the 21 parameters of (4.37), and what they are of a vehicle's declared parameters.

use crate::dynamics::VehicleParameters;
use nalgebra::SVector;

/// Number of parameters.
pub const PARAMETERS: usize = 21;

/// θ = [m11…m66, d11…d66, w, B1…B3, β1…β5].
///
/// M in kg and kg m²; d in N s²/m² and N m s²/rad²; w = (m − ρV) g in N (negative floats); B = ρV g b in N m,
/// b from the centre of buoyancy to the centre of gravity; β1…β4 of the fins, β5 in N s²/rad².
pub type Theta = SVector<f64, PARAMETERS>;

/// m11, first of six.
pub const M11: usize = 0;
/// d11, first of six.
pub const D11: usize = 6;
/// w.
pub const W: usize = 12;
/// B1, first of three.
pub const B1: usize = 13;
/// β1, first of five.
pub const BETA1: usize = 16;
/// β5.
pub const BETA5: usize = 20;

/// Name of every parameter, as in files and reports.
pub const NAMES: [&str; PARAMETERS] = [
    "m11", "m22", "m33", "m44", "m55", "m66", "d11", "d22", "d33", "d44", "d55", "d66", "w", "B1", "B2", "B3", "beta1",
    "beta2", "beta3", "beta4", "beta5",
];

/// θ of a vehicle.
#[must_use]
pub fn theta_of(parameters: &VehicleParameters) -> Theta {
    let (m, d, cd, cl) = (&parameters.m_diag, &parameters.quadratic_diag, &parameters.cd, &parameters.cl);
    let weight = (parameters.mass_kg - parameters.displaced_mass_kg) * parameters.g_mps2;
    let [b1, b2, b3] = parameters.b_cb_to_cg_m.map(|b| parameters.displaced_mass_kg * parameters.g_mps2 * b);
    Theta::from([
        m[0],
        m[1],
        m[2],
        m[3],
        m[4],
        m[5],
        d[0],
        d[1],
        d[2],
        d[3],
        d[4],
        d[5],
        weight,
        b1,
        b2,
        b3,
        cd[0],
        cd[1],
        cl[0],
        cl[1],
        parameters.beta5_n_s2_per_rad2,
    ])
}

/// Multiplies θ_j of a vehicle by a factor; w and B are not factors of anything and stay.
pub fn scale(parameters: &mut VehicleParameters, j: usize, factor: f64) {
    let place = match j {
        M11..D11 => parameters.m_diag.get_mut(j - M11),
        D11..W => parameters.quadratic_diag.get_mut(j - D11),
        BETA1 | 17 => parameters.cd.get_mut(j - BETA1),
        18 | 19 => parameters.cl.get_mut(j - BETA1 - 2),
        BETA5 => Some(&mut parameters.beta5_n_s2_per_rad2),
        _ => None,
    };
    if let Some(value) = place {
        *value *= factor;
    }
}

/// The vehicle whose θ this is.
///
/// θ holds w and B = ρV g b but neither the mass nor the displacement: the displaced mass stays that of `base`
/// (re-ballasting and flooding leave the hull's volume), so the mass becomes ρV + w/g and b becomes B/(ρV g).
/// All else that θ does not hold (fin geometry, cross drag, advance, …) stays that of `base`. θ must have
/// `base`'s scale, which is m11 or β5 at its declared value.
#[must_use]
pub fn with_theta(base: &VehicleParameters, theta: &Theta) -> VehicleParameters {
    let six = |from: usize| core::array::from_fn(|i| theta[from + i]);
    let buoyancy_n = base.displaced_mass_kg * base.g_mps2;
    VehicleParameters {
        mass_kg: base.displaced_mass_kg + theta[W] / base.g_mps2,
        b_cb_to_cg_m: core::array::from_fn(|i| theta[B1 + i] / buoyancy_n),
        m_diag: six(M11),
        quadratic_diag: six(D11),
        cd: [theta[BETA1], theta[BETA1 + 1]],
        cl: [theta[BETA1 + 2], theta[BETA1 + 3]],
        beta5_n_s2_per_rad2: theta[BETA5],
        ..*base
    }
}
