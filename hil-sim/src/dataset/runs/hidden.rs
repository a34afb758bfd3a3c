//! What the vehicle of short runs does that nobody declares.

use super::control::Command;
use crate::rng::{Source, Stream};
use crate::truth::{Fin, Parameters, State, Undeclared};
use serde_json::{Value, json};

/// What is to be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Nothing.
    None,
    /// One or two effects.
    Random,
}

/// One effect: its name in the diagnosis, and its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Name.
    pub name: &'static str,
    /// Name of its number with the unit, and the number.
    pub number: (&'static str, f64),
}

impl Effect {
    /// `{"name", "parameters": {…}}`.
    pub fn json(&self) -> Value {
        json!({ "name": self.name, "parameters": { self.number.0: self.number.1 } })
    }
}

/// The vehicle as it is.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// What was drawn.
    pub effects: Vec<Effect>,
    pub(super) parameters: Parameters,
    propeller_torque_m: f64,
    /// Of the later configuration against the earlier, all four fins alike, rad.
    fin_zero_rad: f64,
    gains: [f64; 4],
    /// From a row's time to when its command acts, s.
    pub(super) command_late_s: f64,
    pub(super) doppler_late_s: f64,
    doppler_scale: f64,
    doppler_yaw_rad: f64,
}

/// How many names there are to draw from.
const NAMES: usize = 8;

impl Hidden {
    /// Of a seed.
    pub(super) fn draw(wanted: Wanted, seed: u64) -> Self {
        let mut random = Stream::new(seed, Source::Effects);
        let mut hidden = Self {
            effects: Vec::new(),
            parameters: torpedo(&mut random),
            propeller_torque_m: 0.0,
            fin_zero_rad: 0.0,
            gains: [1.0; 4],
            command_late_s: 0.0,
            doppler_late_s: 0.0,
            doppler_scale: 0.0,
            doppler_yaw_rad: 0.0,
        };
        if wanted == Wanted::None {
            return hidden;
        }
        let first = (NAMES as f64 * random.uniform()) as usize;
        let other = (first + 1 + ((NAMES - 1) as f64 * random.uniform()) as usize) % NAMES;
        let count = if random.uniform() < 0.5 { 1 } else { 2 };
        for &which in [first, other].iter().take(count) {
            let size = 0.5 + 0.5 * random.uniform();
            let sign = random.sign();
            hidden.add(which, size, sign);
        }
        hidden
    }

    fn add(&mut self, which: usize, size: f64, sign: f64) {
        let (name, unit, number) = match which {
            0 => ("propeller_torque", "torque_arm_m", 0.03 * size * sign),
            1 => ("speed_moment", "fin_zero_rad", 0.05 * size * sign),
            2 => ("fin_gain", "gain_top", 1.0 - 0.8 * size),
            3 => ("input_delay", "fin_delay_s", -0.4 * size),
            4 => ("buoyancy_offset", "buoyancy_kg", 0.5 * size * sign),
            5 => ("dvl_delay", "dvl_delay_s", 0.9 * size),
            6 => ("dvl_scale", "dvl_scale", 0.08 * size * sign),
            _ => ("dvl_misalignment", "dvl yaw_rad", 0.12 * size * sign),
        };
        match which {
            0 => self.propeller_torque_m = number,
            1 => self.fin_zero_rad = number,
            2 => self.gains[0] = number,
            3 => self.command_late_s = number,
            4 => self.parameters.displaced_mass_kg += number,
            5 => self.doppler_late_s = number,
            6 => self.doppler_scale = number,
            _ => self.doppler_yaw_rad = number,
        }
        self.effects.push(Effect { name, number: (unit, number) });
    }

    pub(super) fn undeclared(&self, configuration: usize) -> Undeclared {
        let mut undeclared =
            Undeclared { propeller_torque_m: self.propeller_torque_m, no_surface: true, ..Undeclared::default() };
        if configuration > 0 {
            undeclared.fins.iter_mut().for_each(|fin| fin.bias_rad = self.fin_zero_rad);
        }
        undeclared
    }

    /// Angles of top, bottom, port, starboard in their own frames, rad.
    pub(super) fn fins(&self, command: &Command) -> [f64; 4] {
        let ([upper, lower], [port, starboard]) = (command.rudders_rad, command.elevators_rad);
        let angles = [upper, -lower, port, -starboard];
        core::array::from_fn(|fin| self.gains[fin] * angles[fin])
    }

    /// Roll moment over u² of all four fins at one small angle, N s²/m² per rad: Σ ½ ρ A c_L y.
    pub fn roll_moment_uu_per_rad(&self) -> f64 {
        let Parameters { rho_kg_per_m3, fins, .. } = &self.parameters;
        let moment = |fin: &Fin| {
            let [_, y, z] = fin.cp_m;
            0.5 * rho_kg_per_m3 * fin.area_m2 * fin.cl[0] * y.hypot(z)
        };
        fins.iter().map(moment).sum()
    }

    /// What the Doppler log says of the bottom, m/s.
    pub(super) fn doppler(&self, state: &State, noise: [f64; 3]) -> [f64; 3] {
        let [u, v, w] = state.velocity_mps();
        let (sin, cos) = libm::sincos(self.doppler_yaw_rad);
        let seen = [cos * u + sin * v, -sin * u + cos * v, w];
        core::array::from_fn(|axis| -(1.0 + self.doppler_scale) * seen[axis] - noise[axis])
    }
}

/// A torpedo of 21 kg in fresh water whose coefficients differ from a textbook's.
fn torpedo(random: &mut Stream) -> Parameters {
    let mut about = |value: f64| value * libm::exp(0.1 * random.normal());
    let (x, y) = (-0.6, 0.115);
    let fin = |phi_rad: f64, cp_m: [f64; 3]| Fin {
        phi_rad,
        cp_m,
        gain: 1.0,
        area_m2: 0.0044,
        cd: [0.02, 1.2],
        cl: [3.1, -4.0],
        stall_rad: 0.5,
    };
    let quarter = core::f64::consts::FRAC_PI_2;
    Parameters {
        mass_kg: 21.0,
        displaced_mass_kg: 21.05,
        rho_kg_per_m3: 998.0,
        g_mps2: 9.81,
        length_m: 1.4,
        hull_radius_m: 0.0735,
        cb_to_cg_m: [0.0, 0.0, 0.012],
        inertia: [about(22.0), about(40.0), about(40.0), about(0.1), about(6.0), about(6.0)],
        quadratic_drag: [about(2.4), about(110.0), about(110.0), about(0.1), about(20.0), about(20.0)],
        d26: 0.0,
        d35: 0.0,
        linear_surge_ns_per_m: 0.0,
        moment_uu: [0.0; 3],
        z_uw: 0.0,
        fins: [
            fin(-quarter, [x, 0.0, -y]),
            fin(quarter, [x, 0.0, y]),
            fin(2.0 * quarter, [x, -y, 0.0]),
            fin(0.0, [x, y, 0.0]),
        ],
        fin_max_rad: core::f64::consts::FRAC_PI_6,
        servo_rate_radps: 5.0,
        thrust_n_s2_per_rad2: about(3.2e-4),
        advance_n_s2_per_rad_m: 0.0,
        torque_arm_m: 0.0,
        propeller_max_radps: 400.0,
        propeller_lag_s: 0.1,
        disturbance_per_sqrt_hz: [3e-3, 2e-3, 2e-3, 2e-2, 2e-3, 2e-3],
    }
}
