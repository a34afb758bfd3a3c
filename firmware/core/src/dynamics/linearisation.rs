//! A process model at one state: f and the blocks of F that can differ from zero.

use crate::state::{P, PHI, U, VehicleState, X};
use nalgebra::{Matrix3, Matrix3x2, Matrix6, Matrix6x2, SMatrix};

/// f and F = ∂f/∂x of a process model at one state, F as its non-zero blocks.
///
/// ```text
///            p    φ θ   ψ    ν     ω
///   ṗ      [ 0     A_φθψ     R     0  ]   position_by_attitude, position_by_velocity
///   φθψ˙   [ 0    E_φθ  0    0     L  ]   euler_by_roll_pitch, euler_by_rates
///   v̇      [ 0    G_φθ  0    ─ V ─    ]   acceleration_by_roll_pitch, acceleration_by_velocity
/// ```
///
/// Structural zeros for every vehicle: the position columns; the heading column but for rows ẋ
/// and ẏ; row ż of the heading column; ṗ by ω; Euler rates by ν. Of the blocks themselves
/// `euler_by_rates` has its first column (1, 0, 0) and entry (1, 0) zero. The kinematic model has
/// both acceleration blocks zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearisation {
    /// ẋ = f(x, ξ) in still water.
    pub f: VehicleState,
    /// ∂(Rν)/∂(φ, θ, ψ), m/s per rad.
    pub position_by_attitude: Matrix3<f64>,
    /// R: body to NED (2.25).
    pub position_by_velocity: Matrix3<f64>,
    /// ∂(Lω)/∂(φ, θ), rad/s per rad.
    pub euler_by_roll_pitch: Matrix3x2<f64>,
    /// L: body rates to Euler rates.
    pub euler_by_rates: Matrix3<f64>,
    /// ∂v̇/∂(φ, θ), m/s² and rad/s² per rad.
    pub acceleration_by_roll_pitch: Matrix6x2<f64>,
    /// ∂v̇/∂v.
    pub acceleration_by_velocity: Matrix6<f64>,
}

impl Linearisation {
    /// The dense 12 x 12 Jacobian F = ∂f/∂x.
    #[must_use]
    #[allow(non_snake_case)]
    pub fn F(&self) -> SMatrix<f64, 12, 12> {
        let mut dense = SMatrix::zeros();
        self.F_to(&mut dense);
        dense
    }

    /// The same, written over `dense`.
    #[allow(non_snake_case)]
    pub fn F_to(&self, dense: &mut SMatrix<f64, 12, 12>) {
        dense.fill(0.0);
        dense.fixed_view_mut::<3, 3>(X, PHI).copy_from(&self.position_by_attitude);
        dense.fixed_view_mut::<3, 3>(X, U).copy_from(&self.position_by_velocity);
        dense.fixed_view_mut::<3, 2>(PHI, PHI).copy_from(&self.euler_by_roll_pitch);
        dense.fixed_view_mut::<3, 3>(PHI, P).copy_from(&self.euler_by_rates);
        dense.fixed_view_mut::<6, 2>(U, PHI).copy_from(&self.acceleration_by_roll_pitch);
        dense.fixed_view_mut::<6, 6>(U, U).copy_from(&self.acceleration_by_velocity);
    }
}
