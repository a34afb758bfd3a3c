//! Initialisation (2.3.1.2): from the last fix and the DVL or the commanded speed.

use super::config::NavigationConfig;
use super::fixed_effects::{ideal_reading, water_of};
use crate::dynamics::Attitude;
use crate::effects::SensorChannel;
use crate::state::VehicleState;
use nalgebra::Vector3;

/// Where the first velocity comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InitialSpeed {
    /// DVL velocity in body axes, m/s.
    Dvl([f64; 3]),
    /// Commanded (or model) surge speed, m/s.
    Commanded(f64),
    /// Surge speed of a vehicle that coasts, and its one sigma, m/s.
    Coasting(f64, f64),
}

/// State and one sigma at the start; cross covariances are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialState {
    /// x_v.
    pub state: VehicleState,
    /// One sigma of each vehicle state.
    pub sigma: VehicleState,
}

/// One sigma of a commanded speed as a share of it: error of an Iver's speed loop with an unknown trim.
const COMMANDED_SPEED_PART: f64 = 0.1;
/// Least one sigma of such a speed, and one sigma of sway and heave, which are not commanded, m/s.
const COMMANDED_SIGMA_MPS: f64 = 0.1;

impl InitialState {
    /// From the last fix (north, east, one sigma per axis), present depth, Euler angles, rates and
    /// speed; depth, attitude, rates and a DVL have their sensors' sigma.
    ///
    /// What the sensors say is freed of the effects in `config`. A DVL is taken as bottom track: with current states
    /// its velocity through the water is as uncertain as the current.
    #[must_use]
    pub fn from_fix(
        fix_m: [f64; 2],
        fix_sigma_m: f64,
        depth_m: f64,
        euler_rad: [f64; 3],
        rates_radps: [f64; 3],
        speed: InitialSpeed,
        config: &NavigationConfig,
    ) -> Self {
        let sensors = &config.sensors;
        let current = config.effect_states.current().map_or(0.0, |current| current.initial_sigma);
        let [depth_m, ..] = ideal_reading(config, SensorChannel::Depth, [depth_m, 0.0, 0.0]);
        let euler_rad = ideal_reading(config, SensorChannel::Attitude, euler_rad);
        let rates_radps = ideal_reading(config, SensorChannel::Rates, rates_radps);
        let (velocity, velocity_sigma) = match speed {
            InitialSpeed::Dvl(velocity) => {
                let over_ground = ideal_reading(config, SensorChannel::Dvl, velocity);
                (
                    through_water(over_ground, euler_rad, config),
                    [libm::sqrt(sensors.dvl_mps * sensors.dvl_mps + current * current); 3],
                )
            }
            InitialSpeed::Commanded(surge) => along(surge, COMMANDED_SPEED_PART * surge.abs()),
            InitialSpeed::Coasting(surge, sigma) => along(surge, sigma),
        };
        // The biases of the compass add to the uncertainty of the heading.
        let heading = config.effect_states.heading_sigma_rad();
        let [roll_sigma, pitch_sigma, compass_sigma] = sensors.angles_rad();
        let heading_sigma = libm::sqrt(compass_sigma * compass_sigma + heading * heading);
        let assemble = |position: [f64; 3], euler: [f64; 3], nu: [f64; 3], omega: [f64; 3]| {
            let mut x = VehicleState::zeros();
            for (i, part) in [position, euler, nu, omega].into_iter().enumerate() {
                x.fixed_rows_mut::<3>(3 * i).copy_from_slice(&part);
            }
            x
        };
        Self {
            state: assemble([fix_m[0], fix_m[1], depth_m], euler_rad, velocity, rates_radps),
            sigma: assemble(
                [fix_sigma_m, fix_sigma_m, sensors.depth_m],
                [roll_sigma, pitch_sigma, heading_sigma],
                velocity_sigma,
                [sensors.rates_radps; 3],
            ),
        }
    }
}

/// ν and its one sigma for a surge speed and what is known of it, m/s.
fn along(surge: f64, sigma: f64) -> ([f64; 3], [f64; 3]) {
    ([surge, 0.0, 0.0], [sigma.max(COMMANDED_SIGMA_MPS), COMMANDED_SIGMA_MPS, COMMANDED_SIGMA_MPS])
}

/// ν of a velocity over ground in body axes, in the current that `config` says.
fn through_water(over_ground: [f64; 3], euler_rad: [f64; 3], config: &NavigationConfig) -> [f64; 3] {
    let [north, east] = water_of(&config.effects);
    let attitude = Attitude::new(&Vector3::from(euler_rad));
    (Vector3::from(over_ground) - attitude.rotation().tr_mul(&Vector3::new(north, east, 0.0))).into()
}

/// The ship at the start: [x y ψ ẋ ẏ ψ̇] and one sigma of each; cross covariances are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialShip {
    /// North, east (m), heading (rad), north and east velocity (m/s), turn rate (rad/s).
    pub state: [f64; 6],
    /// One sigma of each.
    pub sigma: [f64; 6],
}

/// One sigma of a ship's velocity of which nothing is known, per axis, m/s.
const SHIP_SPEED_SIGMA_MPS: f64 = 3.0;
/// One sigma of a ship's heading of which nothing is known, rad: uniform over the circle.
const SHIP_HEADING_SIGMA_RAD: f64 = 1.8;
/// One sigma of a ship's turn rate, rad/s.
const SHIP_TURN_RATE_SIGMA_RADPS: f64 = 0.05;

impl InitialShip {
    /// From its first GNSS fix; speed unknown.
    #[must_use]
    pub fn from_fix([north_m, east_m]: [f64; 2], config: &NavigationConfig) -> Self {
        let (fix_m, speed_mps) = (config.sensors.ship_gnss_m, SHIP_SPEED_SIGMA_MPS);
        Self {
            state: [north_m, east_m, 0.0, 0.0, 0.0, 0.0],
            sigma: [fix_m, fix_m, SHIP_HEADING_SIGMA_RAD, speed_mps, speed_mps, SHIP_TURN_RATE_SIGMA_RADPS],
        }
    }
}
