//! Forces on the submerged vehicle and the derivative of its state.
//!
//! Written component by component from Newton-Euler in the body frame. The state's velocity is
//! relative to the water around the vehicle, so that every hydrodynamic force sees the inflow and a
//! uniform steady current changes nothing but the track. Signs of restoring moment and fins are the
//! physical ones (the thesis' (3.9) and (3.10)-(3.23), corrected).

use super::{Actuators, Parameters, Undeclared};

/// Position, attitude quaternion, velocity through the water, rates:
/// [x y z | q0 q1 q2 q3 | u v w | p q r].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State(pub [f64; 13]);

/// The moving water around the vehicle during one step, north and east.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Water {
    /// Current at the surface, m/s.
    pub surface_mps: [f64; 2],
    /// Change of the current with depth, m/s per m.
    pub shear_mps_per_m: [f64; 2],
    /// Velocity down, m/s.
    pub down_mps: f64,
}

impl Water {
    /// The current at a depth, m/s.
    pub fn at_depth(&self, depth_m: f64) -> [f64; 2] {
        // The water above the surface is the water at the surface.
        let depth = depth_m.max(0.0);
        core::array::from_fn(|i| self.surface_mps[i] + self.shear_mps_per_m[i] * depth)
    }
}

impl State {
    /// At a position, with Euler angles roll, pitch, heading, a velocity through the water and rates.
    pub fn new(position_m: [f64; 3], euler_rad: [f64; 3], velocity_mps: [f64; 3], rates_radps: [f64; 3]) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = euler_rad.map(|angle| libm::sincos(0.5 * angle));
        let [x, y, z] = position_m;
        let [u, v, w] = velocity_mps;
        let [p, q, r] = rates_radps;
        Self([
            x,
            y,
            z,
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            u,
            v,
            w,
            p,
            q,
            r,
        ])
    }

    /// North, east, down, m.
    pub fn position_m(&self) -> [f64; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// Velocity through the water in body axes, m/s.
    pub fn velocity_mps(&self) -> [f64; 3] {
        [self.0[7], self.0[8], self.0[9]]
    }

    /// Body rates, rad/s.
    pub fn rates_radps(&self) -> [f64; 3] {
        [self.0[10], self.0[11], self.0[12]]
    }

    /// Roll, pitch, heading, rad; heading within (−π, π].
    pub fn euler_rad(&self) -> [f64; 3] {
        let m = self.body_to_ned();
        [libm::atan2(m[2][1], m[2][2]), -libm::asin(m[2][0].clamp(-1.0, 1.0)), libm::atan2(m[1][0], m[0][0])]
    }

    /// Rotation from body axes to north-east-down.
    pub fn body_to_ned(&self) -> [[f64; 3]; 3] {
        let [a, b, c, d] = [self.0[3], self.0[4], self.0[5], self.0[6]];
        [
            [1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
            [2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)],
            [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)],
        ]
    }

    /// Velocity over ground, north, east, down, m/s.
    pub fn velocity_ned_mps(&self, water: &Water) -> [f64; 3] {
        let m = self.body_to_ned();
        let [u, v, w] = self.velocity_mps();
        let [north, east] = water.at_depth(self.0[2]);
        let through: [f64; 3] = core::array::from_fn(|i| m[i][0] * u + m[i][1] * v + m[i][2] * w);
        [through[0] + north, through[1] + east, through[2] + water.down_mps]
    }
}

/// One fin, prepared: its frame turned with the fin differs from the hull's by φ only, because the
/// fin's own rotation δ adds to the angle of attack and turns neither lift nor drag, which follow
/// the flow.
#[derive(Clone, Copy, Debug)]
struct Blade {
    /// Normal of the undeflected fin (its z axis), y and z component in body axes.
    normal: [f64; 2],
    gain: f64,
    cp: [f64; 3],
    half_rho_area: f64,
    cd: [f64; 2],
    cl: [f64; 2],
    stall: f64,
}

impl Blade {
    /// Force at the centre of pressure, body axes, N.
    #[inline]
    fn force(&self, velocity: [f64; 3], rates: [f64; 3], delta: f64) -> [f64; 3] {
        let [u, v, w] = velocity;
        let [p, q, r] = rates;
        let [x, y, z] = self.cp;
        let ahead = u + q * z - r * y;
        let sway = v + r * x - p * z;
        let heave = w + p * y - q * x;
        let across = self.normal[0] * sway + self.normal[1] * heave;
        let speed = (ahead * ahead + across * across).sqrt();
        let mut alpha = libm::atan2(across, ahead) + self.gain * delta;
        if alpha > core::f64::consts::PI {
            alpha -= core::f64::consts::TAU;
        } else if alpha < -core::f64::consts::PI {
            alpha += core::f64::consts::TAU;
        }
        // Separated flow: coefficients rise no further.
        let alpha = alpha.clamp(-self.stall, self.stall);
        let squared = alpha * alpha;
        // ½ρAV times (velocity in the plane of the section): drag against it, lift across it.
        let scale = self.half_rho_area * speed;
        let drag = scale * (self.cd[0] + self.cd[1] * squared);
        let lift = scale * alpha * (self.cl[0] + self.cl[1] * squared);
        let along = lift * across - drag * ahead;
        let normal = -lift * ahead - drag * across;
        [along, normal * self.normal[0], normal * self.normal[1]]
    }
}

/// The vehicle's forces, prepared from its parameters.
#[derive(Clone, Debug)]
pub struct Plant {
    inertia: [f64; 6],
    inverse_inertia: [f64; 6],
    drag: [f64; 6],
    d26: f64,
    d35: f64,
    linear_surge: f64,
    moment_uu: [f64; 3],
    z_uw: f64,
    extra_surge: f64,
    sway_asymmetry: f64,
    heave_surge: f64,
    weight_n: f64,
    buoyancy_n: f64,
    /// Buoyancy gained per metre of depth.
    buoyancy_n_per_m: f64,
    cb_to_cg: [f64; 3],
    /// 1 / (2 · hull radius): share of the buoyancy gained per metre of depth at the surface.
    emersion_per_m: f64,
    round_hull: bool,
    /// Deeper than this the surface is not felt at any attitude.
    submerged_m: f64,
    /// Distance of the fore and aft section from the centre of buoyancy.
    section_m: f64,
    blades: [Blade; 4],
    thrust: f64,
    advance: f64,
    propeller_torque: f64,
}

impl Plant {
    /// Prepares the forces of a vehicle that is nothing but its parameters.
    pub fn new(parameters: &Parameters) -> Self {
        Self::with(parameters, &Undeclared::default())
    }

    /// Prepares the forces of a vehicle.
    #[must_use]
    pub fn with(parameters: &Parameters, undeclared: &Undeclared) -> Self {
        let p = parameters;
        Self {
            inertia: p.inertia,
            inverse_inertia: p.inertia.map(f64::recip),
            drag: p.quadratic_drag,
            d26: p.d26,
            d35: p.d35,
            linear_surge: p.linear_surge_ns_per_m,
            moment_uu: p.moment_uu,
            z_uw: p.z_uw,
            extra_surge: 0.0,
            sway_asymmetry: undeclared.sway_drag_asymmetry * p.quadratic_drag[1],
            heave_surge: undeclared.heave_surge_n_s2_per_m2,
            weight_n: p.mass_kg * p.g_mps2,
            buoyancy_n: p.displaced_mass_kg * p.g_mps2,
            buoyancy_n_per_m: undeclared.compressibility_kg_per_m * p.g_mps2,
            cb_to_cg: p.cb_to_cg_m,
            emersion_per_m: 0.5 / p.hull_radius_m,
            round_hull: undeclared.round_hull,
            submerged_m: if undeclared.no_surface { f64::NEG_INFINITY } else { 0.5 * p.length_m + p.hull_radius_m },
            section_m: 0.5 * p.length_m * libm::sqrt(0.6),
            blades: p.fins.map(|fin| {
                let (sin, cos) = libm::sincos(fin.phi_rad);
                Blade {
                    normal: [-sin, cos],
                    gain: fin.gain,
                    cp: fin.cp_m,
                    half_rho_area: 0.5 * p.rho_kg_per_m3 * fin.area_m2,
                    cd: fin.cd,
                    cl: fin.cl,
                    stall: fin.stall_rad,
                }
            }),
            thrust: p.thrust_n_s2_per_rad2,
            advance: p.advance_n_s2_per_rad_m,
            propeller_torque: p.torque_arm_m + undeclared.propeller_torque_m,
        }
    }

    /// Linear surge drag beyond that of the parameters, N s/m.
    pub(super) fn set_extra_surge_drag(&mut self, ns_per_m: f64) {
        self.extra_surge = ns_per_m;
    }

    /// Buoyancy, N, and its first moment ahead of the centre of buoyancy, N m; `depth` is that centre's, where the
    /// force acts: taken elsewhere, heaving and pitching by turns at the surface would create energy.
    ///
    /// Near the surface the hull is taken in three sections, at the Gauss points of its length; each
    /// loses its buoyancy in proportion to how far its diameter is out of the water, or to the area of a round section
    /// that is.
    #[inline]
    fn buoyancy(&self, depth: f64, down_ahead: f64) -> [f64; 2] {
        let full = self.buoyancy_n + self.buoyancy_n_per_m * depth.max(0.0);
        if depth > self.submerged_m {
            return [full, 0.0];
        }
        let mut sum = [0.0; 2];
        for (share, place) in [(5.0 / 18.0, -self.section_m), (8.0 / 18.0, 0.0), (5.0 / 18.0, self.section_m)] {
            let mut wetted = (0.5 + self.emersion_per_m * (depth + down_ahead * place)).clamp(0.0, 1.0);
            if self.round_hull {
                // the segment of a circle below the water, of its area
                let axis = 2.0 * wetted - 1.0;
                let dry = libm::acos(axis) - axis * libm::sqrt(1.0 - axis * axis);
                wetted = 1.0 - dry / core::f64::consts::PI;
            }
            let buoyancy = share * wetted * full;
            sum[0] += buoyancy;
            sum[1] += buoyancy * place;
        }
        sum
    }

    /// Acceleration of velocity through the water and rates in a uniform current, m/s² and rad/s².
    pub fn acceleration(&self, state: &State, actuators: &Actuators) -> [f64; 6] {
        let m = state.body_to_ned();
        self.body_acceleration(state, &m[2], actuators)
    }

    /// `down` is the NED down axis in body axes.
    #[inline]
    fn body_acceleration(&self, state: &State, down: &[f64; 3], actuators: &Actuators) -> [f64; 6] {
        let [_, _, depth, _, _, _, _, u, v, w, p, q, r] = state.0;
        let [m1, m2, m3, i1, i2, i3] = self.inertia;
        let d = &self.drag;

        // Newton-Euler with added mass: momentum turned by the rates, and the Munk moment.
        let mut x = m2 * v * r - m3 * w * q;
        let mut y = m3 * w * p - m1 * u * r;
        let mut z = m1 * u * q - m2 * v * p;
        let mut k = (m2 - m3) * v * w + (i2 - i3) * q * r;
        let mut m = (m3 - m1) * u * w + (i3 - i1) * p * r;
        let mut n = (m1 - m2) * u * v + (i1 - i2) * p * q;

        x -= (d[0] * u.abs() + self.linear_surge + self.extra_surge) * u;
        y -= d[1] * v.abs() * v + self.d26 * r.abs() * r;
        z -= d[2] * w.abs() * w + self.d35 * q.abs() * q;
        k -= d[3] * p.abs() * p;
        m -= d[4] * q.abs() * q + self.d35 * w.abs() * w;
        n -= d[5] * r.abs() * r + self.d26 * v.abs() * v;
        let along = u.abs() * u;
        z += self.z_uw * u.abs() * w;
        k += self.moment_uu[0] * along;
        m += self.moment_uu[1] * along;
        n += self.moment_uu[2] * along;
        x -= self.heave_surge * w * w * u.signum();
        y -= self.sway_asymmetry * v * v;

        // Weight at the centre of gravity; buoyancy at the centre of buoyancy (lever −b), less and
        // further aft or forward as the hull leaves the water.
        let [bx, by, bz] = self.cb_to_cg;
        let centre = depth - (bx * down[0] + by * down[1] + bz * down[2]);
        let [buoyancy, pitching] = self.buoyancy(centre, down[0]);
        let net = self.weight_n - buoyancy;
        x += net * down[0];
        y += net * down[1];
        z += net * down[2];
        k += buoyancy * (by * down[2] - bz * down[1]);
        m += buoyancy * (bz * down[0] - bx * down[2]) + pitching * down[2];
        n += buoyancy * (bx * down[1] - by * down[0]) - pitching * down[1];

        for (blade, delta) in self.blades.iter().zip(actuators.fins_rad) {
            let [fx, fy, fz] = blade.force([u, v, w], [p, q, r], delta);
            let [cx, cy, cz] = blade.cp;
            x += fx;
            y += fy;
            z += fz;
            k += cy * fz - cz * fy;
            m += cz * fx - cx * fz;
            n += cx * fy - cy * fx;
        }

        let omega = actuators.propeller_radps;
        let thrust = self.thrust * omega * omega.abs() - self.advance * omega * u;
        x += thrust;
        k -= self.propeller_torque * thrust;

        let wrench = [x, y, z, k, m, n];
        core::array::from_fn(|i| wrench[i] * self.inverse_inertia[i])
    }

    /// Time derivative of the state.
    ///
    /// In sheared water the vehicle keeps its velocity over ground as it changes depth, so that its
    /// velocity through the water takes up the difference. The inertia of water that accelerates in
    /// time acts on the net weight only and is left out: below 1e-7 m/s² for a tide.
    pub fn derivative(&self, state: &State, actuators: &Actuators, water: &Water, disturbance: &[f64; 6]) -> State {
        let [_, _, depth, a, b, c, d, u, v, w, p, q, r] = state.0;
        let m = state.body_to_ned();
        let through: [f64; 3] = core::array::from_fn(|i| m[i][0] * u + m[i][1] * v + m[i][2] * w);
        let [north, east] = water.at_depth(depth);
        let mut acc = self.body_acceleration(state, &m[2], actuators);
        for (acc, disturbance) in acc.iter_mut().zip(disturbance) {
            *acc += disturbance;
        }
        if depth > 0.0 {
            let entrained = water.shear_mps_per_m.map(|shear| shear * through[2]);
            for i in 0..3 {
                acc[i] -= m[0][i] * entrained[0] + m[1][i] * entrained[1];
            }
        }
        State([
            through[0] + north,
            through[1] + east,
            through[2] + water.down_mps,
            -0.5 * (b * p + c * q + d * r),
            0.5 * (a * p + c * r - d * q),
            0.5 * (a * q + d * p - b * r),
            0.5 * (a * r + b * q - c * p),
            acc[0],
            acc[1],
            acc[2],
            acc[3],
            acc[4],
            acc[5],
        ])
    }
}
