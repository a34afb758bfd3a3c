//! A survey without end: the vehicle on a square, the ship on a circle, an acoustic exchange every 30 s.

extern crate std;

use crate::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters};
use crate::navigation::*;
use crate::random::Random;
use crate::state::{P, PHI, PSI, Q, R, THETA, U, VehicleState, X, Y, Z, wrap_angle};
use nalgebra::Vector3;
use std::vec::Vec;

/// The filter's step.
pub const STEP_US: u64 = 100_000;
const STEP_S: f64 = 0.1;
/// Integration steps of the truth in one of the filter's.
const TICKS: u32 = 5;
/// Slots of the acoustic exchange, steps.
const SLOT: u64 = 300;
/// Where the corners of the square are, m.
const CORNERS: [[f64; 2]; 4] = [[300.0, 300.0], [300.0, -300.0], [-300.0, -300.0], [-300.0, 300.0]];
const DEPTH_M: f64 = 20.0;
/// Radius of the ship's circle, m, and its speed, m/s.
const SHIP_RADIUS_M: f64 = 500.0;
const SHIP_SPEED_MPS: f64 = 1.0;
/// The effects' walks forget over this time, s, or they would leave their ranges within the days.
const MEMORY_S: f64 = 1.0e5;

/// Steps between two restarts of the bank, an hour, and within it the start and the end of a silence of ten minutes.
pub const RESTART_EVERY: u64 = 36_000;
const SILENCE: core::ops::Range<u64> = 12_000..18_000;

/// Truth, its sensors, and what the modem does.
pub struct Mission {
    step: u64,
    noise: Random,
    config: NavigationConfig,
    model: VehicleModel,
    x: VehicleState,
    input: ActuatorInput,
    corner: usize,
    /// north_mps, east_mps, surge_ns_per_m, r_radps.
    effects: [f64; 4],
    /// x, y, ẋ, ẏ.
    ship: [f64; 4],
    /// The clones held.
    held: Vec<CloneId>,
    /// The robust bank flies it: restarts, silences, and a vehicle that is not quite as declared.
    robust: bool,
    /// Position and velocity over ground of the vehicle, and the ship, at the acoustic events of this slot.
    vehicle_event: ([f64; 3], [f64; 3]),
    ship_event: [f64; 4],
}

impl Mission {
    /// For the nominal filter, which estimates four effects.
    pub fn new() -> Self {
        let states = EffectStates::water_current(0.1, 1.0e-4)
            .with("linear_drag", "surge_ns_per_m", 0.3, 1.0e-3)
            .and_then(|states| states.with("gyro_bias", "r_radps", 1.0e-3, 1.0e-6))
            .expect("states of the catalogue");
        let config = NavigationConfig { effect_states: states, range_curvature: 1.0e6, ..NavigationConfig::REFERENCE };
        Self::with(config, false)
    }

    /// For the robust bank: its gyro has no bias, which it does not estimate.
    pub fn robust() -> Self {
        let mut config = NavigationConfig { range_curvature: 1.0e6, ..NavigationConfig::REFERENCE };
        config.make_robust();
        let mut mission = Self::with(config, true);
        mission.effects[3] = 0.0;
        mission
    }

    fn with(config: NavigationConfig, robust: bool) -> Self {
        let mut noise = Random(2);
        let initial = initial();
        let mut x = initial.state;
        for i in 0..12 {
            x[i] += initial.sigma[i] * noise.normal();
        }
        let ship = ship();
        let mut event = [0.0; 4];
        for (event, i) in event.iter_mut().zip([0, 1, 3, 4]) {
            *event = ship.state[i] + ship.sigma[i] * noise.normal();
        }
        Self {
            step: 0,
            effects: [0.08, -0.05, 0.2, 5.0e-4],
            noise,
            config,
            model: VehicleModel::new(&VehicleParameters::IVER3).expect("the reference vehicle"),
            x,
            input: ActuatorInput::default(),
            corner: 0,
            ship: event,
            held: Vec::new(),
            robust,
            vehicle_event: ([0.0; 3], [0.0; 3]),
            ship_event: event,
        }
    }

    /// Starts a bank, or starts it again with what it has learnt, where the vehicle and the ship are.
    pub fn start(&mut self, bank: &mut Navigator) {
        let (mut vehicle, mut craft) = (initial(), ship());
        if self.step == 0 {
            bank.configure(&self.config, &VehicleModel::new(&VehicleParameters::IVER3).expect("the reference vehicle"))
                .expect("a valid configuration");
        } else {
            for i in 0..12 {
                vehicle.state[i] = self.x[i] + vehicle.sigma[i] * self.noise.normal();
            }
            for (i, truth) in [0, 1, 3, 4].into_iter().zip(self.ship) {
                craft.state[i] = truth + craft.sigma[i] * self.noise.normal();
            }
        }
        let learnt = (self.step > 0).then(|| bank.main().learnt(1).expect("numbers that make a covariance"));
        bank.initialise(self.step * STEP_US, &vehicle).expect("a valid start");
        if let Some(learnt) = learnt {
            bank.start_from(&learnt);
        }
        bank.initialise_ship(&craft).expect("a valid ship");
    }

    /// Whether the bank starts again before the next step; no clone is held then.
    pub fn restarts(&self) -> bool {
        self.robust && self.step > 0 && self.step.is_multiple_of(RESTART_EVERY)
    }

    /// Moves the truth by one step and says what the actuators did.
    pub fn advance(&mut self) -> ActuatorInput {
        self.step += 1;
        self.steer();
        let mut vehicle = VehicleParameters::IVER3;
        vehicle.linear_surge_ns_per_m += self.effects[2];
        self.model.retune(&vehicle);
        let h = STEP_S / f64::from(TICKS);
        let process = &self.config.process_noise;
        let (linear, angular) = (process.linear_mps2_per_sqrt_hz, process.angular_radps2_per_sqrt_hz);
        for _ in 0..TICKS {
            let middle = self.x + self.model.derivative(&self.x, &self.input) * (0.5 * h);
            self.x += self.model.derivative(&middle, &self.input) * h;
            for (i, density) in linear.into_iter().chain(angular).enumerate() {
                self.x[U + i] += density * h.sqrt() * self.noise.normal();
            }
            self.x[X] += h * self.effects[0];
            self.x[Y] += h * self.effects[1];
            self.x[PSI] = wrap_angle(self.x[PSI]);
            self.sail(h);
        }
        // The bank does not estimate the last two as such: they do not walk there.
        let walks = self.config.effect_states.iter().map(|state| state.random_walk_per_sqrt_s);
        for (k, (effect, walk)) in self.effects.iter_mut().zip(walks).enumerate() {
            let walk = if self.robust && k > 1 { 0.0 } else { walk };
            *effect *= 1.0 - STEP_S / MEMORY_S;
            *effect += walk * STEP_S.sqrt() * self.noise.normal();
        }
        self.input
    }

    /// Heading to the next corner, pitch to the depth.
    fn steer(&mut self) {
        let to = |corner: [f64; 2], x: &VehicleState| [corner[0] - x[X], corner[1] - x[Y]];
        let [mut north, mut east] = to(CORNERS[self.corner], &self.x);
        if north.hypot(east) < 20.0 {
            self.corner = (self.corner + 1) % 4;
            [north, east] = to(CORNERS[self.corner], &self.x);
        }
        let x = &self.x;
        let rudder = (0.4 * wrap_angle(east.atan2(north) - x[PSI]) - 0.8 * x[R]).clamp(-0.15, 0.15);
        let pitch = (0.05 * (x[Z] - DEPTH_M)).clamp(-0.3, 0.3);
        let elevator = (0.4 * (pitch - x[THETA]) - 0.4 * x[Q]).clamp(-0.15, 0.15);
        // Two speeds, so that drag and current are told apart.
        let propeller_radps = if (self.step / 6000).is_multiple_of(2) { 106.8 } else { 130.0 };
        self.input = ActuatorInput { propeller_radps, fins_rad: [rudder, -rudder, elevator, -elevator] };
    }

    /// The ship turns about the origin and keeps to its circle.
    fn sail(&mut self, h: f64) {
        let [x, y, vx, vy] = self.ship;
        let radius = x.hypot(y);
        let (out, along) = ([x / radius, y / radius], [-y / radius, x / radius]);
        let push = 0.002 * (SHIP_RADIUS_M - radius);
        let density = self.config.ship_noise.linear_mps2_per_sqrt_hz;
        for i in 0..2 {
            let wanted = SHIP_SPEED_MPS * along[i] + push * out[i];
            let velocity = [vx, vy][i];
            self.ship[i] += h * velocity;
            self.ship[2 + i] += h * 0.02 * (wanted - velocity) + density * h.sqrt() * self.noise.normal();
        }
    }

    /// What kind of exchange this slot has, and the step within it.
    fn slot(&self) -> (u64, u64) {
        (self.step / SLOT % 5, self.step % SLOT)
    }

    fn vehicle_now(&self) -> ([f64; 3], [f64; 3]) {
        let nu = Vector3::new(self.x[U], self.x[U + 1], self.x[U + 2]);
        let v = Attitude::new(&crate::state::attitude(&self.x)).rotation() * nu;
        ([self.x[X], self.x[Y], self.x[Z]], [v.x + self.effects[0], v.y + self.effects[1], v.z])
    }

    /// Takes the clones that are due by `take`, which says how the vehicle's (true) or the ship's is called.
    pub fn clones(&mut self, mut take: impl FnMut(bool) -> CloneId) {
        match self.slot() {
            (0, 10) => {
                self.held.push(take(false));
                self.ship_event = self.ship;
            }
            (1 | 2, 10) => {
                self.held.push(take(true));
                self.vehicle_event = self.vehicle_now();
            }
            (2, 14) => {
                self.held.push(take(false));
                self.ship_event = self.ship;
            }
            // The sound arrives 0.3 s before the modem says so.
            (3, 10) => {
                self.vehicle_event = self.vehicle_now();
                self.ship_event = self.ship;
            }
            (3, 13) => self.held.push(take(true)),
            _ => {}
        }
    }

    /// Drops all clones at the end of an exchange.
    pub fn drop_clones(&mut self, drop: impl FnMut(CloneId)) {
        if self.slot().1 == 60 {
            self.held.drain(..).rev().for_each(drop);
        }
    }

    /// What is measured at this step.
    pub fn measure(&mut self) -> Vec<Measurement> {
        let sensors = self.config.sensors;
        let x = self.x;
        let mut all = Vec::new();
        all.push(Measurement::Depth { z_m: x[Z] + sensors.depth_m * self.noise.normal() });
        if self.step.is_multiple_of(2) {
            let euler_rad = [PHI, THETA, PSI].map(|i| x[i] + sensors.attitude_rad * self.noise.normal());
            all.push(Measurement::Attitude { euler_rad });
        } else {
            let mut rates_radps = [P, Q, R].map(|i| x[i] + sensors.rates_radps * self.noise.normal());
            rates_radps[2] += self.effects[3];
            all.push(Measurement::Rates { rates_radps });
        }
        if self.step.is_multiple_of(10) {
            let position_m = [0, 1].map(|i| self.ship[i] + sensors.ship_gnss_m * self.noise.normal());
            all.push(Measurement::ShipGnss { position_m });
        }
        if !(self.robust && SILENCE.contains(&(self.step % RESTART_EVERY))) {
            self.exchange(&mut all);
        }
        all
    }

    /// Range and range rate of this slot's exchange, if they are known at this step.
    fn exchange(&mut self, all: &mut Vec<Measurement>) {
        let (here, ship_here) = (self.vehicle_now(), self.ship);
        let (vehicle_event, ship_event) = (self.vehicle_event, self.ship_event);
        let id = |i: usize| self.held[i];
        let (path, vehicle, ship) = match self.slot() {
            (0, 15) => ((VehicleEnd::Now, ShipEnd::Delayed(id(0))), here, ship_event),
            (1, 15) => ((VehicleEnd::Delayed { clone: id(0), bridge_s: 0.0 }, ShipEnd::Now), vehicle_event, ship_here),
            (2, 30) => {
                let ship = ShipEnd::Delayed(id(1));
                let vehicle = VehicleEnd::Delayed { clone: id(0), bridge_s: 0.0 };
                let half = range_and_rate(vehicle_event, ship_event).0 + range_and_rate(here, ship_event).0;
                all.push(Measurement::TwoWayRange {
                    outward: AcousticPath { vehicle, ship },
                    back: AcousticPath { vehicle: VehicleEnd::Now, ship },
                    range_m: 0.5 * half + self.config.sensors.range_m * self.noise.normal(),
                });
                return;
            }
            (3, 50) => {
                let vehicle = VehicleEnd::Delayed { clone: id(0), bridge_s: -0.3 };
                ((vehicle, ShipEnd::Reported(self.report(ship_event))), vehicle_event, ship_event)
            }
            (4, 10) => ((VehicleEnd::Now, ShipEnd::Reported(self.report(ship_here))), here, ship_here),
            _ => return,
        };
        let path = AcousticPath { vehicle: path.0, ship: path.1 };
        let (range, rate) = range_and_rate(vehicle, ship);
        let sensors = self.config.sensors;
        all.push(Measurement::Range { path, range_m: range + sensors.range_m * self.noise.normal() });
        let range_rate_mps = rate + sensors.range_rate_mps * self.noise.normal();
        all.push(Measurement::RangeRate { path, range_rate_mps });
    }

    /// What the ship says of itself.
    fn report(&mut self, ship: [f64; 4]) -> ShipReport {
        ShipReport {
            position_m: [0, 1].map(|i| ship[i] + 0.5 * self.noise.normal()),
            velocity_mps: [2, 3].map(|i| ship[i] + 0.05 * self.noise.normal()),
            position_sigma_m: 0.5,
            velocity_sigma_mps: 0.05,
        }
    }
}

fn initial() -> InitialState {
    InitialState {
        state: VehicleState::from([0.0, 0.0, 18.0, 0.0, -0.036, 0.3, 1.0, 0.0, -0.036, 0.0, 0.0, 0.0]),
        sigma: VehicleState::from([2.0, 2.0, 0.1, 0.02, 0.02, 0.02, 0.05, 0.02, 0.02, 0.01, 0.01, 0.01]),
    }
}

fn ship() -> InitialShip {
    InitialShip { state: [SHIP_RADIUS_M, 0.0, 1.57, 0.0, SHIP_SPEED_MPS, 0.0], sigma: [0.5, 0.5, 0.1, 0.1, 0.1, 0.01] }
}

/// Distance and opening rate of the vehicle and the ship at the surface.
fn range_and_rate((p, v): ([f64; 3], [f64; 3]), ship: [f64; 4]) -> (f64, f64) {
    let dp = Vector3::new(p[0] - ship[0], p[1] - ship[1], p[2]);
    let dv = Vector3::new(v[0] - ship[2], v[1] - ship[3], v[2]);
    (dp.norm(), dp.dot(&dv) / dp.norm())
}
