//! Fins (3.10)-(3.23), corrected: each with the inflow at its own centre of pressure, in its own frame.
//!
//! In the fin frame F = Rx(φ_i) Ry(δ) the inflow is (u_F, w_F), the incidence
//! α = atan2(w_F, u_F) and the force −D x_W − L z_W with x_W along the inflow. Turning the frame by δ turns
//! α by δ and leaves x_W and z_W where they are, so everything is evaluated in the fixed frame
//! F0 = Rx(φ_i): α = δ + atan2(w, u) and no sine or cosine is needed at run time. δ is the fin's gain times the command.

use super::FinGeometry;
use crate::state::wrap_angle;
use core::f64::consts::PI;
use nalgebra::{Matrix6, SMatrix, Vector6};

/// Lift and drag coefficients with ½ρA, the same for all fins.
///
/// C_D = β1 + β2 α² and C_L = β3 α + β4 α³ hold for the incidence of attached flow. Beyond `stall` they keep
/// their values: left alone, β4 α³ reaches a hundred in reverse flow, and a vehicle at rest, whose incidence is
/// anything, would be shaken by it. Drag opposes the inflow and lift is normal to it for any α, so a fin never
/// creates energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FinSection {
    /// ½ρA, kg/m.
    half_rho_area: f64,
    cd: [f64; 2],
    cl: [f64; 2],
    /// rad.
    stall: f64,
}

/// The angle of a fin that follows its commands.
pub(super) const FREE: f64 = f64::INFINITY;

/// One fin: the rows that map v to its inflow, whose transposes map its force to a wrench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fin {
    /// u = x_row · v, the inflow along body x.
    x_row: [f64; 6],
    /// w = z_row · v, the inflow along z of F0.
    z_row: [f64; 6],
    /// Share of its lift and drag that it still has, 1 for a whole fin.
    pub(super) effectiveness: f64,
    /// The angle at which it stands whatever is commanded, rad; [`FREE`]: it does not. No `Option`: of a model that is not
    /// there the bytes are zero, so that its static takes no flash.
    pub(super) stands_rad: f64,
    /// Its angle over the angle commanded.
    gain: f64,
}

/// Inflow of one fin and what follows from it.
struct Inflow {
    /// Of the fin.
    effectiveness: f64,
    u: f64,
    w: f64,
    speed: f64,
    alpha: f64,
}

/// Force (x, z) in F0 and its derivatives.
struct ForceGradient {
    force: [f64; 2],
    /// ∂force/∂(u, w), row-major.
    by_inflow: [[f64; 2]; 2],
}

impl FinSection {
    pub(super) fn new(parameters: &super::VehicleParameters) -> Self {
        Self {
            half_rho_area: 0.5 * parameters.rho_kg_per_m3 * parameters.fin_area_m2,
            cd: parameters.cd,
            cl: parameters.cl,
            stall: parameters.stall_rad,
        }
    }

    /// What the polynomials are evaluated at.
    fn attached(&self, alpha: f64) -> f64 {
        // No `clamp`: it panics if a limit is NaN, and a NaN of alpha has to stay NaN.
        if alpha > self.stall {
            self.stall
        } else if alpha < -self.stall {
            -self.stall
        } else {
            alpha
        }
    }

    /// [C_D, C_L].
    fn coefficients(&self, alpha: f64) -> [f64; 2] {
        let alpha = self.attached(alpha);
        let square = alpha * alpha;
        [self.cd[0] + self.cd[1] * square, (self.cl[0] + self.cl[1] * square) * alpha]
    }

    /// d[C_D, C_L]/dα.
    fn slopes(&self, alpha: f64) -> [f64; 2] {
        if alpha.abs() > self.stall {
            return [0.0; 2];
        }
        [2.0 * self.cd[1] * alpha, self.cl[0] + 3.0 * self.cl[1] * alpha * alpha]
    }

    /// ½ρA V (−C_D (u, w) + C_L (w, −u)), N: linear in the coefficients, so it maps their slopes too.
    fn force(&self, inflow: &Inflow, [cd, cl]: [f64; 2]) -> [f64; 2] {
        let scale = self.half_rho_area * inflow.effectiveness * inflow.speed;
        [scale * (cl * inflow.w - cd * inflow.u), -scale * (cd * inflow.w + cl * inflow.u)]
    }

    fn gradient(&self, inflow: &Inflow) -> ForceGradient {
        let coefficients = self.coefficients(inflow.alpha);
        let force = self.force(inflow, coefficients);
        if inflow.speed == 0.0 {
            // The force is quadratic in the inflow: its derivative vanishes although α has none.
            return ForceGradient { force, by_inflow: [[0.0; 2]; 2] };
        }
        let [cd, cl] = coefficients;
        let by_alpha = self.force(inflow, self.slopes(inflow.alpha));
        let scale = self.half_rho_area * inflow.effectiveness * inflow.speed;
        // d ln V = (u du + w dw)/V² and dα = (u dw − w du)/V². One V at a time: V² may underflow.
        let inverse = 1.0 / inflow.speed;
        let (u, w) = (inflow.u * inverse, inflow.w * inverse);
        let [x, z] = force.map(|component| component * inverse);
        let [x_alpha, z_alpha] = by_alpha.map(|component| component * inverse);
        ForceGradient {
            force,
            by_inflow: [
                [x * u - scale * cd - x_alpha * w, x * w + scale * cl + x_alpha * u],
                [z * u - scale * cl - z_alpha * w, z * w - scale * cd + z_alpha * u],
            ],
        }
    }
}

impl Fin {
    pub(super) fn new(geometry: &FinGeometry) -> Self {
        let (sin_phi, cos_phi) = libm::sincos(geometry.phi_rad);
        let [x, y, z] = geometry.cp_m;
        // Inflow ν + ω x p; z of F0 is (0, −sin φ, cos φ) in body axes.
        Self {
            x_row: [1.0, 0.0, 0.0, 0.0, z, -y],
            z_row: [0.0, -sin_phi, cos_phi, cos_phi * y + sin_phi * z, -cos_phi * x, -sin_phi * x],
            effectiveness: 1.0,
            stands_rad: FREE,
            gain: geometry.gain,
        }
    }

    /// Where it stands under a command.
    fn angle(&self, delta: f64) -> f64 {
        if self.stands_rad == FREE { self.gain * delta } else { self.stands_rad }
    }

    fn inflow(&self, v: &Vector6<f64>, delta: f64) -> Inflow {
        let (x, z) = (&self.x_row, &self.z_row);
        let u = v[0] + x[4] * v[4] + x[5] * v[5];
        let w = z[1] * v[1] + z[2] * v[2] + z[3] * v[3] + z[4] * v[4] + z[5] * v[5];
        let speed = libm::sqrt(u * u + w * w);
        let alpha = self.angle(delta) + libm::atan2(w, u);
        let alpha = if alpha.abs() > PI { wrap_angle(alpha) } else { alpha };
        Inflow { effectiveness: self.effectiveness, u, w, speed, alpha }
    }

    /// Adds the wrench of a force (x, z) in F0 at the centre of pressure.
    fn add_wrench(&self, force: [f64; 2], wrench: &mut Vector6<f64>) {
        for i in 0..6 {
            wrench[i] += self.x_row[i] * force[0] + self.z_row[i] * force[1];
        }
    }

    /// Wrench at the centre of gravity, N and N m.
    pub(super) fn wrench(&self, section: &FinSection, v: &Vector6<f64>, delta: f64) -> Vector6<f64> {
        let inflow = self.inflow(v, delta);
        let mut wrench = Vector6::zeros();
        self.add_wrench(section.force(&inflow, section.coefficients(inflow.alpha)), &mut wrench);
        wrench
    }

    /// ∂wrench/∂δ, N and N m per rad.
    pub(super) fn wrench_by_delta(&self, section: &FinSection, v: &Vector6<f64>, delta: f64) -> Vector6<f64> {
        let inflow = self.inflow(v, delta);
        let mut wrench = Vector6::zeros();
        self.add_wrench(section.force(&inflow, section.slopes(inflow.alpha)), &mut wrench);
        wrench * if self.stands_rad == FREE { self.gain } else { 0.0 }
    }

    /// Adds this fin's columns of G_a: the wrench per unit of β1, β2, β3, β4.
    pub(super) fn add_regressor(
        &self,
        section: &FinSection,
        v: &Vector6<f64>,
        delta: f64,
        columns: &mut SMatrix<f64, 6, 5>,
    ) {
        let inflow = self.inflow(v, delta);
        let alpha = section.attached(inflow.alpha);
        let square = alpha * alpha;
        let units = [[1.0, 0.0], [square, 0.0], [0.0, alpha], [0.0, square * alpha]];
        for (column, unit) in units.into_iter().enumerate() {
            let mut wrench = Vector6::zeros();
            self.add_wrench(section.force(&inflow, unit), &mut wrench);
            for i in 0..6 {
                columns[(i, column)] += wrench[i];
            }
        }
    }

    /// Adds the wrench and its derivative with v.
    pub(super) fn add_linearised(
        &self,
        section: &FinSection,
        v: &Vector6<f64>,
        delta: f64,
        wrench: &mut Vector6<f64>,
        jacobian: &mut Matrix6<f64>,
    ) {
        let ForceGradient { force, by_inflow: [x_by, z_by] } = section.gradient(&self.inflow(v, delta));
        self.add_wrench(force, wrench);
        // ∂force/∂v = by_inflow · (rows of the inflow map), whose zeros are left out; then the map's transpose.
        let (x, z) = (&self.x_row, &self.z_row);
        let by_velocity = |[by_u, by_w]: [f64; 2]| {
            [by_u, by_w * z[1], by_w * z[2], by_w * z[3], by_u * x[4] + by_w * z[4], by_u * x[5] + by_w * z[5]]
        };
        let (x_by, z_by) = (by_velocity(x_by), by_velocity(z_by));
        for column in 0..6 {
            let (force_x, force_z) = (x_by[column], z_by[column]);
            jacobian[(0, column)] += force_x;
            jacobian[(1, column)] += z[1] * force_z;
            jacobian[(2, column)] += z[2] * force_z;
            jacobian[(3, column)] += z[3] * force_z;
            jacobian[(4, column)] += x[4] * force_x + z[4] * force_z;
            jacobian[(5, column)] += x[5] * force_x + z[5] * force_z;
        }
    }
}
