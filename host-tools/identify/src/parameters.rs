//! What is identified, as one vector: θ (4.37) and the two cross drags (4.21).

use backseat_core::dynamics::{VehicleParameters, cross_drag_limit};
use backseat_core::identification::ParameterBox;
use backseat_core::identification::regressor::{Regressor, cross_drag_columns};
use backseat_core::identification::theta::{self, B1, PARAMETERS, Theta, theta_of, with_theta};
use nalgebra::{SMatrix, SVector, Vector6};

/// Number of parameters with d26 and d35.
pub const EXTENDED: usize = PARAMETERS + 2;
/// d26.
pub const D26: usize = PARAMETERS;
/// d35.
pub const D35: usize = PARAMETERS + 1;

/// [θ d26 d35].
pub type Extended = SVector<f64, EXTENDED>;

/// Y with the columns of d26 and d35, 6 x 23.
pub type ExtendedRegressor = SMatrix<f64, 6, EXTENDED>;

/// Name of a parameter.
#[must_use]
pub fn name(parameter: usize) -> &'static str {
    match parameter {
        D26 => "d26",
        D35 => "d35",
        _ => theta::NAMES.get(parameter).copied().unwrap_or("?"),
    }
}

/// Unit of a parameter.
#[must_use]
pub fn unit(parameter: usize) -> &'static str {
    match parameter {
        0..3 => "kg",
        3..6 => "kg m²",
        6..9 => "N s²/m²",
        9..12 => "N m s²/rad²",
        12 => "N",
        13..=15 => "N m",
        16 => "1",
        17 | 18 => {
            if parameter == 17 {
                "1/rad²"
            } else {
                "1/rad"
            }
        }
        19 => "1/rad³",
        20 | D26 | D35 => "N s²/rad²",
        _ => "1",
    }
}

/// The parameters of a vehicle.
#[must_use]
pub fn of(vehicle: &VehicleParameters) -> Extended {
    let mut all = Extended::zeros();
    all.fixed_rows_mut::<PARAMETERS>(0).copy_from(&theta_of(vehicle));
    (all[D26], all[D35]) = (vehicle.d26, vehicle.d35);
    all
}

/// A vehicle with these parameters; all else is that of `base`.
#[must_use]
pub fn with(base: &VehicleParameters, parameters: &Extended) -> VehicleParameters {
    let theta: Theta = parameters.fixed_rows::<PARAMETERS>(0).into_owned();
    VehicleParameters { d26: parameters[D26], d35: parameters[D35], ..with_theta(base, &theta) }
}

/// Size of a plausible error of each parameter: its own magnitude, for B1 and B2 that of B3, for d26 and d35 a tenth of
/// the drag that couples with them.
#[must_use]
pub fn scale(prior: &VehicleParameters) -> Extended {
    let mut scale = of(prior).abs();
    scale[B1] = scale[B1 + 2];
    scale[B1 + 1] = scale[B1 + 2];
    // The net weight may be declared as zero; half a percent of the displaced weight is not.
    scale[theta::W] = scale[theta::W].max(0.005 * prior.displaced_mass_kg * prior.g_mps2);
    scale[D26] = 0.1 * prior.quadratic_diag[1];
    scale[D35] = 0.1 * prior.quadratic_diag[2];
    scale
}

/// Moves parameters into the core's box around the prior, and the cross drags to where drag takes energy out of every
/// motion.
pub fn project(prior: &VehicleParameters, ratio: [f64; 2], parameters: &mut Extended) {
    let mut theta: Theta = parameters.fixed_rows::<PARAMETERS>(0).into_owned();
    ParameterBox::around(prior, ratio).project(&mut theta);
    parameters.fixed_rows_mut::<PARAMETERS>(0).copy_from(&theta);
    let d = theta::D11;
    for (cross, a, b) in [(D26, 1, 5), (D35, 2, 4)] {
        let limit = 0.9 * cross_drag_limit(theta[d + a], theta[d + b]);
        parameters[cross] = parameters[cross].clamp(-limit, limit);
    }
}

/// Y with the columns of d26 and d35.
#[must_use]
pub fn extended(y: &Regressor, velocity: &Vector6<f64>) -> ExtendedRegressor {
    let mut all = ExtendedRegressor::zeros();
    all.fixed_columns_mut::<PARAMETERS>(0).copy_from(y);
    all.fixed_columns_mut::<2>(PARAMETERS).copy_from(&cross_drag_columns(velocity));
    all
}
