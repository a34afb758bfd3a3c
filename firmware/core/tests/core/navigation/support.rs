//! Seeded noise, a truth to measure, and a filter that starts on it.

use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::navigation::*;
use backseat_core::state::VehicleState;

pub use crate::random::Random as Noise;

impl Noise {
    pub fn normals<const K: usize>(&mut self, mean: [f64; K], sigma: f64) -> [f64; K] {
        mean.map(|mean| mean + sigma * self.normal())
    }
}

pub fn model() -> VehicleModel {
    VehicleModel::new(&VehicleParameters::IVER3).unwrap()
}

pub fn navigator(config: &NavigationConfig) -> Box<Navigator> {
    let mut navigator = Box::new(Navigator::new());
    navigator.configure(config, &model()).unwrap();
    navigator
}

/// A start at 3 m depth with 1 m/s, and honest sigmas.
pub fn initial() -> InitialState {
    InitialState {
        state: VehicleState::from([0.0, 0.0, 3.0, 0.0, -0.036, 0.3, 1.0, 0.0, -0.036, 0.0, 0.0, 0.0]),
        sigma: VehicleState::from([2.0, 2.0, 0.1, 0.02, 0.02, 0.02, 0.05, 0.02, 0.02, 0.01, 0.01, 0.01]),
    }
}

/// The same, started from [`initial`].
pub fn started(config: &NavigationConfig) -> Box<Navigator> {
    let mut navigator = navigator(config);
    navigator.initialise(0, &initial()).unwrap();
    navigator
}

/// A ship that lies still, as its packet says; one sigma per axis of its position, m, and of its velocity, m/s.
pub fn still(position_m: [f64; 2], [position_sigma_m, velocity_sigma_mps]: [f64; 2]) -> ShipReport {
    ShipReport { position_m, velocity_mps: [0.0; 2], position_sigma_m, velocity_sigma_mps }
}

/// From a ship that says where it is to the vehicle as it is now.
pub fn reported(ship: ShipReport) -> AcousticPath {
    AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(ship) }
}

/// Level flight.
pub const CRUISE: ActuatorInput = ActuatorInput { propeller_radps: 106.8, fins_rad: [0.0, 0.0, 0.008, -0.008] };

/// Simulation step, µs.
pub const TICK_US: u64 = 10_000;

/// Vehicle (the filter's own dynamics with white acceleration), current and ship.
pub struct Truth {
    pub x: VehicleState,
    pub current: [f64; 2],
    /// x, y, ẋ, ẏ.
    pub ship: [f64; 4],
    model: VehicleModel,
}

impl Truth {
    pub fn new(x: VehicleState, current: [f64; 2], ship: [f64; 4]) -> Self {
        Self::of(x, current, ship, &VehicleParameters::IVER3)
    }

    pub fn of(x: VehicleState, current: [f64; 2], ship: [f64; 4], vehicle: &VehicleParameters) -> Self {
        Self { x, current, ship, model: VehicleModel::new(vehicle).unwrap() }
    }

    /// One tick: midpoint rule and the accelerations' noise of `config`.
    pub fn tick(&mut self, input: &ActuatorInput, config: &NavigationConfig, noise: &mut Noise) {
        let h = TICK_US as f64 * 1e-6;
        let middle = self.x + self.model.derivative(&self.x, input) * (0.5 * h);
        self.x += self.model.derivative(&middle, input) * h;
        let roots = config.process_noise.linear_mps2_per_sqrt_hz.into_iter();
        for (i, root) in roots.chain(config.process_noise.angular_radps2_per_sqrt_hz).enumerate() {
            self.x[6 + i] += root * h.sqrt() * noise.normal();
        }
        for i in 0..2 {
            self.x[i] += h * self.current[i];
            self.ship[i] += h * self.ship[2 + i];
            self.ship[2 + i] += config.ship_noise.linear_mps2_per_sqrt_hz * h.sqrt() * noise.normal();
        }
    }

    pub fn position(&self) -> [f64; 3] {
        [self.x[0], self.x[1], self.x[2]]
    }

    /// Over ground, NED.
    pub fn velocity(&self) -> [f64; 3] {
        let still = self.model.derivative(&self.x, &CRUISE);
        [still[0] + self.current[0], still[1] + self.current[1], still[2]]
    }
}

/// Distance and opening rate of two ends; the ship at depth 0.
pub fn range_and_rate(p: [f64; 3], v: [f64; 3], ship: [f64; 4]) -> (f64, f64) {
    let dp = [p[0] - ship[0], p[1] - ship[1], p[2]];
    let dv = [v[0] - ship[2], v[1] - ship[3], v[2]];
    let range = dp.iter().map(|a| a * a).sum::<f64>().sqrt();
    (range, dp.iter().zip(dv).map(|(a, b)| a * b).sum::<f64>() / range)
}
