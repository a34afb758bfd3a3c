//! The vehicle in time: actuators, disturbance and state, one step after the other.

use super::actuators::Drive;
use super::integrator::runge_kutta_4;
use super::mounting;
use super::{Actuators, Faults, Parameters, Plant, State, Undeclared, Water};
use crate::noise::Colouring;
use crate::rng::{Source, Stream};

/// The true state of the vehicle at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleTruth {
    /// µs since the start of the scenario.
    pub time_us: u64,
    /// [x y z | φ θ ψ | u v w | p q r]: NED, Euler angles, velocity through the water, rates; SI.
    pub state: [f64; 12],
    /// Velocity over ground in NED, m/s.
    pub velocity_ned_mps: [f64; 3],
    /// Velocity over ground in body axes, m/s.
    pub velocity_over_ground_mps: [f64; 3],
    /// Current at the vehicle, north and east, m/s.
    pub current_mps: [f64; 2],
    /// What the actuators really do.
    pub actuators: Actuators,
}

impl VehicleTruth {
    /// Position of a point of the vehicle, NED, m; the arm is in body axes.
    pub fn position_at(&self, arm_m: [f64; 3]) -> [f64; 3] {
        let [x, y, z, roll, pitch, heading, ..] = self.state;
        if arm_m == [0.0; 3] {
            return [x, y, z];
        }
        let arm = mounting::times(&mounting::rotation([roll, pitch, heading]), arm_m);
        [x + arm[0], y + arm[1], z + arm[2]]
    }

    /// Velocity over ground of a point of the vehicle, NED, m/s.
    pub fn velocity_at(&self, arm_m: [f64; 3]) -> [f64; 3] {
        let [.., roll, pitch, heading, _, _, _, p, q, r] = self.state;
        if arm_m == [0.0; 3] {
            return self.velocity_ned_mps;
        }
        let swing = mounting::times(&mounting::rotation([roll, pitch, heading]), mounting::swing([p, q, r], arm_m));
        core::array::from_fn(|i| self.velocity_ned_mps[i] + swing[i])
    }
}

/// The simulated vehicle.
#[derive(Clone, Debug)]
pub struct Vehicle {
    /// As it was built.
    parameters: Parameters,
    /// What its faults have made of it.
    worn: [f64; 9],
    plant: Plant,
    drive: Drive,
    step_s: f64,
    /// Standard deviation of the acceleration that is held over one step: √PSD / √step.
    disturbance: [f64; 6],
    random: Stream,
    colouring: Option<Colouring<6>>,
    /// Standard deviation of the coloured process, in units of the white one of a step, for the same power density
    /// at low frequency: √(step / 2τ).
    coloured_sigma: f64,
    undeclared: Undeclared,
    steps: u64,
    state: State,
    actuators: Actuators,
}

impl Vehicle {
    /// A vehicle at rest of its actuators that is nothing but its parameters.
    pub fn new(parameters: &Parameters, state: State, step_s: f64, seed: u64) -> Self {
        Self::with(parameters, &Undeclared::default(), state, step_s, seed)
    }

    /// A vehicle at rest of its actuators.
    #[must_use]
    pub fn with(parameters: &Parameters, undeclared: &Undeclared, state: State, step_s: f64, seed: u64) -> Self {
        let per_step = 1.0 / step_s.sqrt();
        Self {
            parameters: *parameters,
            worn: Faults::default().key(0.0),
            plant: Plant::with(parameters, undeclared),
            drive: Drive::new(parameters, undeclared, step_s),
            step_s,
            disturbance: parameters.disturbance_per_sqrt_hz.map(|density| density * per_step),
            random: Stream::new(seed, Source::Disturbance),
            colouring: undeclared
                .disturbance_colour
                .map(|colour| Colouring::new(colour, seed, Source::DisturbanceColour)),
            coloured_sigma: undeclared.disturbance_colour.map_or(0.0, |colour| (0.5 * step_s / colour.tau_s).sqrt()),
            undeclared: *undeclared,
            steps: 0,
            state,
            actuators: Actuators::default(),
        }
    }

    /// Present state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// What the actuators do now.
    pub fn actuators(&self) -> &Actuators {
        &self.actuators
    }

    /// Drops a weight of so much in water, kg.
    pub fn drop_weight(&mut self, kg: f64) {
        self.undeclared.faults.dropped_kg = kg;
    }

    /// One step: the actuators move, then hold; the disturbance is drawn, then holds.
    pub fn step(&mut self, targets: &Actuators, water: &Water) {
        let time_s = self.steps as f64 * self.step_s;
        self.drive.step(&mut self.actuators, targets, time_s, self.state.0[7]);
        let mut disturbance: [f64; 6] = self.random.normals(1.0);
        if let Some(colouring) = &mut self.colouring {
            disturbance = colouring.mix(disturbance, self.coloured_sigma, (1e6 * time_s).round() as u64);
        }
        for (disturbance, sigma) in disturbance.iter_mut().zip(self.disturbance) {
            *disturbance *= sigma;
        }
        let worn = self.undeclared.faults.key(time_s);
        if worn != self.worn {
            self.worn = worn;
            self.plant = Plant::with(&self.undeclared.faults.applied(&self.parameters, time_s), &self.undeclared);
        }
        let change = &self.undeclared.drag_change;
        self.plant.set_extra_surge_drag(if change.when.holds(time_s) { change.ns_per_m } else { 0.0 });
        let (plant, actuators) = (&self.plant, &self.actuators);
        self.state =
            runge_kutta_4(&self.state, self.step_s, |state| plant.derivative(state, actuators, water, &disturbance));
        self.steps += 1;
    }
}
