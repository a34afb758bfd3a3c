//! A plain autopilot on noisy measurements: heading, depth by pitch, speed.
//!
//! It knows the declared vehicle only, as the autopilot of a real one would, and holds what it measures: what a sensor
//! has wrong, it flies wrong.

use super::Leg;
use crate::observation::{Observation, ObservationKind};
use crate::truth::Actuators;
use backseat_core::dynamics::VehicleParameters;
use std::f64::consts::TAU;

/// Fins are turned this far at most, rad.
const FIN_MAX: f64 = 0.3;
/// Pitch asked for at most, rad.
const PITCH_MAX: f64 = 0.3;
/// Time between two commands, s.
const STEP_S: f64 = super::COMMAND_US as f64 * 1e-6;

/// A first-order estimate that follows measurements, predicted by their rate.
#[derive(Clone, Copy, Debug, Default)]
struct Follower {
    value: f64,
    started: bool,
}

impl Follower {
    fn follow(&mut self, measured: f64, predicted: f64, gain: f64) {
        if self.started {
            self.value += predicted;
            self.value += gain * (measured - self.value);
        } else {
            *self = Self { value: measured, started: true };
        }
    }
}

/// Takes up what is steadily missing. Large errors, of a manoeuvre, count as one of `worth`.
#[derive(Clone, Copy, Debug)]
struct Integral {
    gain: f64,
    worth: f64,
    limit: f64,
    sum: f64,
}

impl Integral {
    const fn new(gain: f64, worth: f64, limit: f64) -> Self {
        Self { gain, worth, limit, sum: 0.0 }
    }

    fn add(&mut self, error: f64) -> f64 {
        let step = self.gain * error.clamp(-self.worth, self.worth) * STEP_S;
        self.sum = (self.sum + step).clamp(-self.limit, self.limit);
        self.sum
    }
}

/// The autopilot, at one moment of its mission.
#[derive(Clone, Debug)]
pub struct Autopilot<'a> {
    legs: &'a [Leg],
    leg: usize,
    /// Squared propeller speed per squared speed ahead, by the declared drag and thrust.
    propeller_per_speed: f64,
    propeller_max: f64,
    holds_speed: bool,
    heading: Follower,
    pitch: Follower,
    rates: [Follower; 2],
    depth: Follower,
    speed: Follower,
    last_ahrs_us: u64,
    rudder: Integral,
    trim: Integral,
    elevator: Integral,
    propeller: Integral,
}

impl<'a> Autopilot<'a> {
    /// For the declared vehicle, before the first of these legs.
    pub fn new(declared: &VehicleParameters, legs: &'a [Leg], holds_speed: bool) -> Self {
        let fins = 4.0 * 0.5 * declared.rho_kg_per_m3 * declared.fin_area_m2 * declared.cd[0];
        let drag = declared.quadratic_diag[0] + fins;
        Self {
            legs,
            leg: 0,
            propeller_per_speed: (drag / declared.beta5_n_s2_per_rad2).sqrt(),
            propeller_max: declared.omega_max_radps,
            holds_speed,
            heading: Follower::default(),
            pitch: Follower::default(),
            rates: [Follower::default(); 2],
            depth: Follower::default(),
            speed: Follower::default(),
            last_ahrs_us: 0,
            rudder: Integral::new(0.02, 0.1, 0.2),
            trim: Integral::new(0.004, 0.5, 0.2),
            elevator: Integral::new(0.05, 0.1, 0.2),
            propeller: Integral::new(2.0, 0.1, 40.0),
        }
    }

    /// Takes in a measurement.
    pub fn observe(&mut self, observation: &Observation) {
        match observation.kind {
            ObservationKind::Ahrs { euler_rad: [_, pitch, heading], rates_radps: [_, q, r] } => {
                let dt_s = (observation.time_us - self.last_ahrs_us) as f64 * 1e-6;
                self.last_ahrs_us = observation.time_us;
                for (rate, measured) in self.rates.iter_mut().zip([q, r]) {
                    rate.follow(measured, 0.0, 0.6);
                }
                let unwrapped = self.heading.value + libm::remainder(heading - self.heading.value, TAU);
                self.heading.follow(unwrapped, r * dt_s, 0.35);
                self.pitch.follow(pitch, q * dt_s, 0.35);
            }
            ObservationKind::Depth { depth_m } => self.depth.follow(depth_m, 0.0, 0.3),
            ObservationKind::Dvl { velocity_mps: Some([u, ..]), .. } => self.speed.follow(u, 0.0, 0.2),
            _ => {}
        }
    }

    /// Commands from a time on, µs, to be asked for every [`COMMAND_US`](super::COMMAND_US); before the first
    /// measurements, nothing but a turning propeller.
    pub fn command(&mut self, time_us: u64) -> Actuators {
        let time_s = time_us as f64 * 1e-6;
        while self.leg + 1 < self.legs.len() && time_s >= self.legs[self.leg].until_s {
            self.leg += 1;
        }
        let leg = self.legs[self.leg];
        let ahead = self.propeller_per_speed * leg.speed_mps;
        let mut propeller_radps = ahead;
        if self.holds_speed && self.speed.started {
            let error = leg.speed_mps - self.speed.value;
            // Within a quarter, so that enough speed through the water is left in any current.
            propeller_radps += (40.0 * error + self.propeller.add(error)).clamp(-0.25 * ahead, 0.25 * ahead);
        }
        let propeller_radps = propeller_radps.clamp(0.0, self.propeller_max);
        if !(self.heading.started && self.depth.started) {
            return Actuators { propeller_radps, fins_rad: [0.0; 4] };
        }
        // Lift grows with the square of speed.
        let soften = (1.0 / (leg.speed_mps * leg.speed_mps)).clamp(0.4, 2.0);
        let [q, r] = self.rates.map(|rate| rate.value);

        let turn = libm::remainder(leg.heading_rad - self.heading.value, TAU);
        let rudder = (soften * (0.4 * turn - 0.4 * r) + self.rudder.add(turn)).clamp(-FIN_MAX, FIN_MAX);

        let deeper = leg.depth_m - self.depth.value;
        let level = if deeper.abs() < 1.5 { self.trim.add(deeper) } else { self.trim.sum };
        let wanted = (-0.12 * deeper - level).clamp(-PITCH_MAX, PITCH_MAX);
        let up = wanted - self.pitch.value;
        let elevator = (soften * (0.5 * up - 0.3 * q) + self.elevator.add(up)).clamp(-FIN_MAX, FIN_MAX);

        // Top and port up the fin's own axis turn the bow to starboard and up.
        Actuators { propeller_radps, fins_rad: [rudder, -rudder, elevator, -elevator] }
    }
}
