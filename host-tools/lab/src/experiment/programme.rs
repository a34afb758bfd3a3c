//! Inputs of the experiments: sums of sines of ours, and what the thesis prints.

use super::vehicle;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::{PSI, Q, R, THETA, U, VehicleState, wrap_angle};
use core::f64::consts::TAU;

/// Periods (s) of propeller (two), rudder (two), elevator (two) and roll.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Programme([f64; 7]);

impl Programme {
    /// Inputs of the identification.
    pub const IDENTIFICATION: Self = Self([97.0, 41.0, 37.0, 13.0, 29.0, 11.0, 5.3]);
    /// Inputs of the validation: other frequencies.
    pub const VALIDATION: Self = Self([71.0, 31.0, 53.0, 17.0, 43.0, 9.0, 6.7]);

    /// Commands at a time, s.
    #[must_use]
    pub fn input(&self, time_s: f64) -> ActuatorInput {
        let [propeller, slow, rudder, fast_rudder, elevator, fast_elevator, roll] =
            self.0.map(|period| libm::sin(TAU * time_s / period));
        let yaw = 0.14 * rudder + 0.08 * fast_rudder;
        let pitch = 0.10 * elevator + 0.06 * fast_elevator;
        let twist = 0.06 * roll;
        ActuatorInput {
            propeller_radps: 110.0 + 40.0 * propeller + 15.0 * slow,
            fins_rad: [twist + yaw, twist - yaw, twist - pitch, twist + pitch],
        }
    }
}

/// offset + amplitude · sin(rate · t).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sine {
    offset: f64,
    amplitude: f64,
    radps: f64,
}

impl Sine {
    const fn new(offset: f64, amplitude: f64, radps: f64) -> Self {
        Self { offset, amplitude, radps }
    }

    fn at(&self, time_s: f64) -> f64 {
        self.offset + self.amplitude * libm::sin(self.radps * time_s)
    }

    fn rate(&self, time_s: f64) -> f64 {
        self.amplitude * self.radps * libm::cos(self.radps * time_s)
    }
}

/// Open-loop inputs of Table 4.14.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLoop {
    /// N.
    thrust: Sine,
    /// Right and left fins, which move alike, degrees; positive is nose down.
    horizontal: Sine,
    /// Top and bottom fins, which move alike, degrees; positive is nose to port.
    vertical: Sine,
}

impl OpenLoop {
    /// IDSIM, 5000 s.
    pub const IDENTIFICATION: Self = Self {
        thrust: Sine::new(8.0, 8.0, 0.7),
        horizontal: Sine::new(5.0, 15.0, 0.4),
        vertical: Sine::new(0.0, 15.0, 0.2),
    };
    /// CROSSIM, of unstated length.
    pub const VALIDATION: Self = Self {
        thrust: Sine::new(5.0, 3.0, 0.5),
        horizontal: Sine::new(7.0, 5.0, 0.2),
        vertical: Sine::new(0.0, 8.0, 0.4),
    };

    fn input(&self, time_s: f64) -> ActuatorInput {
        let [down, port] = [&self.horizontal, &self.vertical].map(|sine| sine.at(time_s).to_radians());
        commanded(self.thrust.at(time_s), [-port, port, -down, down])
    }
}

/// References of Table 4.6, followed by PD on the true state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct References {
    /// m/s.
    surge: Sine,
    /// Degrees.
    pitch: Sine,
    /// Degrees.
    heading: Sine,
}

impl References {
    /// Table 4.6, about 30 minutes.
    pub const TABLE_4_6: Self = Self {
        surge: Sine::new(1.0, 0.2, 0.40),
        pitch: Sine::new(0.0, -30.0, 0.30),
        heading: Sine::new(0.0, 30.0, 0.35),
    };

    /// Gains of ours: the thesis gives none. The fins' angles are for 1 m/s; lift grows with the square of speed.
    fn input(&self, time_s: f64, x: &VehicleState) -> ActuatorInput {
        const SURGE_N_PER_MPS: f64 = 40.0;
        const ANGLE: f64 = 1.5;
        const RATE_S: f64 = 0.8;
        let declared = vehicle::declared();
        let fins_drag = 4.0 * 0.5 * declared.rho_kg_per_m3 * declared.fin_area_m2 * declared.cd[0];
        let drag = (declared.quadratic_diag[0] + fins_drag) * x[U] * x[U].abs();
        let thrust =
            drag + declared.m_diag[0] * self.surge.rate(time_s) + SURGE_N_PER_MPS * (self.surge.at(time_s) - x[U]);
        let soften = 1.0 / (x[U] * x[U]).max(0.25);
        let follow = |sine: &Sine, angle: f64, rate: f64| {
            let error = wrap_angle(sine.at(time_s).to_radians() - angle);
            soften * (ANGLE * error + RATE_S * (sine.rate(time_s).to_radians() - rate))
        };
        // Body rates are those of pitch and heading as long as the vehicle hardly rolls.
        let up = follow(&self.pitch, x[THETA], x[Q]);
        let starboard = follow(&self.heading, x[PSI], x[R] / libm::cos(x[THETA]));
        commanded(thrust, [starboard, -starboard, up, -up])
    }
}

/// Propeller speed for a thrust (N, ahead), fins top, bottom, port, starboard (rad).
fn commanded(thrust_n: f64, fins_rad: [f64; 4]) -> ActuatorInput {
    let thrust_n = thrust_n.max(0.0);
    ActuatorInput { propeller_radps: libm::sqrt(thrust_n / vehicle::declared().beta5_n_s2_per_rad2), fins_rad }
}

/// How the vehicle of an experiment is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Sums of sines of ours.
    Sines(Programme),
    /// The thesis' open-loop inputs.
    OpenLoop(OpenLoop),
    /// The thesis' references in closed loop.
    References(References),
    /// Lines of 1000 s to and fro, 100 s apart, at 1 m/s and level, in closed loop.
    Lines,
}

impl Motion {
    /// Commands at a time, s, in a state.
    #[must_use]
    pub fn input(&self, time_s: f64, x: &VehicleState) -> ActuatorInput {
        match self {
            Self::Sines(programme) => programme.input(time_s),
            Self::OpenLoop(inputs) => inputs.input(time_s),
            Self::References(references) => references.input(time_s, x),
            Self::Lines => {
                const COURSES_DEG: [f64; 4] = [0.0, 90.0, 180.0, 90.0];
                let within = time_s.rem_euclid(2200.0);
                let leg = [1000.0, 1100.0, 2100.0].iter().filter(|end| within >= **end).count();
                let steady = |offset: f64| Sine::new(offset, 0.0, 0.0);
                let heading = steady(COURSES_DEG.get(leg).copied().unwrap_or(0.0));
                References { surge: steady(1.0), pitch: steady(0.0), heading }.input(time_s, x)
            }
        }
    }
}
