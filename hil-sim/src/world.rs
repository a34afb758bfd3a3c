//! The simulated world: vehicle, ship, water, sensors and sound on one clock.

use crate::acoustics::{Acoustics, HeardSound, Passage, Sender, SoundSource};
use crate::devices::LocalFrame;
use crate::environment::Sea;
use crate::observation::{Observation, ObservationKind, ShipReport};
use crate::scenario::{Exchange, Scenario};
use crate::sensors::Sensors;
use crate::ship::{ShipEstimator, ShipMotion, ShipTruth};
use crate::truth::{Actuators, Vehicle, VehicleTruth, Water};
use std::collections::VecDeque;

/// The simulated world.
#[derive(Clone, Debug)]
pub struct World {
    step_us: u64,
    time_us: u64,
    /// What is to be observed at `time_us` has been handed out.
    observed: bool,
    sea: Sea,
    water: Water,
    vehicle: Vehicle,
    targets: Actuators,
    pending: VecDeque<(u64, Actuators)>,
    ship: ShipMotion,
    estimator: ShipEstimator,
    sensors: Sensors,
    acoustics: Acoustics,
    /// Of the vehicle.
    transducer_arm_m: [f64; 3],
    /// From a command to what the actuators do, µs.
    input_delay_us: u64,
}

impl World {
    /// The world of a scenario at time zero.
    pub fn new(scenario: &Scenario) -> Self {
        let settings = &scenario.settings;
        let ship_sigma = settings.sensors.ship_gnss.sigma_m.unwrap_or(scenario.vehicle.sensors.ship_gnss_m);
        let step_us = settings.plant.step_us;
        let physics = scenario.physics();
        let start = scenario.initial_state();
        let sea = Sea::new(&physics.currents, physics.waves.as_ref(), settings.seed);
        Self {
            step_us,
            time_us: 0,
            observed: false,
            water: sea.at(0.0, start.position_m()),
            sea,
            vehicle: Vehicle::with(&physics.vehicle, &physics.undeclared, start, seconds(step_us), settings.seed),
            targets: Actuators::default(),
            pending: VecDeque::new(),
            ship: ShipMotion::new(&settings.ship, settings.seed),
            estimator: ShipEstimator::new(&settings.ship, ship_sigma),
            sensors: Sensors::new(scenario, &physics.instruments, &physics.installation),
            acoustics: Acoustics::new(scenario, &physics.channel, physics.installation.transducer_delay_s),
            transducer_arm_m: physics.installation.transducer_arm_m,
            input_delay_us: (physics.undeclared.input_delay_s * 1e6).round() as u64,
        }
    }

    /// µs since the start of the scenario.
    pub fn time_us(&self) -> u64 {
        self.time_us
    }

    /// New targets for servos and propeller, from `time_us` on (at once where that is past).
    /// Times must not decrease from call to call.
    pub fn set_actuator_targets(&mut self, time_us: u64, targets: Actuators) {
        self.pending.push_back((time_us + self.input_delay_us, targets));
    }

    /// The vehicle drops a weight of so much in water, kg.
    pub fn drop_weight(&mut self, kg: f64) {
        self.vehicle.drop_weight(kg);
    }

    /// Moves the world to the last integration step not after `to_us` and hands out everything
    /// observed on the way, in order of time (an observation at `to_us` itself included).
    pub fn advance(&mut self, to_us: u64, sink: &mut impl FnMut(&Observation)) {
        loop {
            if !self.observed {
                self.observe(sink);
                self.observed = true;
            }
            if self.time_us + self.step_us > to_us {
                return;
            }
            self.step(sink);
            self.observed = false;
        }
    }

    /// From now on nothing leaves by the schedule: modems at both ends send, by [`Self::transmit`].
    pub fn hand_over_acoustics(&mut self) {
        self.acoustics.hand_over();
    }

    /// A modem sends now; a downlink says what `report` says.
    pub fn transmit(&mut self, exchange: Exchange, report: ShipReport) {
        let sender = self.sender();
        self.acoustics.transmit(exchange, self.time_us, &sender, &self.ship, report);
    }

    /// How long sound takes between ship and vehicle now, µs.
    pub fn flight_us(&self) -> u64 {
        (1.0e6 * self.acoustics.flight_s(self.time_us, self.transducer_m(), &self.ship)) as u64
    }

    /// This vehicle as another hears it that sends now.
    pub fn source(&self) -> SoundSource {
        self.acoustics.source(self.time_us, self.sender())
    }

    /// How this vehicle hears another, if it does.
    pub fn hear_vehicle(&mut self, source: &SoundSource) -> Option<HeardSound> {
        let listener = self.sender();
        self.acoustics.hear_vehicle(source, &listener)
    }

    /// An uplink's frame with the place that the vehicle states, which may not be the one that its board does.
    pub fn misstated(&self, frame: &[u8], local: LocalFrame) -> Vec<u8> {
        self.acoustics.misstated(frame, local)
    }

    /// The ship of another world is the one of this.
    pub fn share_ship(&mut self, other: &Self) {
        self.ship = other.ship.clone();
    }

    fn step(&mut self, sink: &mut impl FnMut(&Observation)) {
        while let Some(&(_, targets)) = self.pending.front().filter(|(from_us, _)| *from_us <= self.time_us) {
            self.targets = targets;
            self.pending.pop_front();
        }
        let (from_s, from_m) = (seconds(self.time_us), self.transducer_m());
        self.vehicle.step(&self.targets, &self.water);
        self.time_us += self.step_us;
        let to_s = seconds(self.time_us);
        self.water = self.sea.at(to_s, self.vehicle.state().position_m());
        if self.acoustics.busy() {
            let Sender { position_m: to_m, velocity_mps } = self.sender();
            let passage = Passage { from_s, from_m, to_s, to_m, velocity_mps };
            self.acoustics.arrivals(&passage, &self.ship, &self.estimator, sink);
        }
    }

    fn observe(&mut self, sink: &mut impl FnMut(&Observation)) {
        if self.sensors.any_due(self.time_us) {
            let (vehicle, ship) = (self.truth(), self.ship());
            let estimator = &mut self.estimator;
            self.sensors.observe(&vehicle, &ship, &mut |observation| {
                if let ObservationKind::ShipGnss { position_m } = observation.kind {
                    estimator.fix(seconds(observation.time_us), position_m);
                }
                sink(observation);
            });
        }
        if self.acoustics.may_launch(self.time_us) {
            let sender = self.sender();
            self.acoustics.launch(self.time_us, &sender, &self.ship, &self.estimator);
        }
    }

    /// Where the vehicle's transducer is, NED, m.
    fn transducer_m(&self) -> [f64; 3] {
        let at_centre = self.transducer_arm_m == [0.0; 3];
        if at_centre { self.vehicle.state().position_m() } else { self.truth().position_at(self.transducer_arm_m) }
    }

    /// The vehicle's transducer as it sends or hears.
    fn sender(&self) -> Sender {
        let velocity_mps = self.truth().velocity_at(self.transducer_arm_m);
        Sender { position_m: self.transducer_m(), velocity_mps }
    }

    /// The true state of the vehicle now.
    pub fn truth(&self) -> VehicleTruth {
        let state = self.vehicle.state();
        let ([x, y, z], [phi, theta, psi]) = (state.position_m(), state.euler_rad());
        let ([u, v, w], [p, q, r]) = (state.velocity_mps(), state.rates_radps());
        let ned = state.velocity_ned_mps(&self.water);
        let m = state.body_to_ned();
        VehicleTruth {
            time_us: self.time_us,
            state: [x, y, z, phi, theta, psi, u, v, w, p, q, r],
            velocity_ned_mps: ned,
            velocity_over_ground_mps: core::array::from_fn(|i| m[0][i] * ned[0] + m[1][i] * ned[1] + m[2][i] * ned[2]),
            current_mps: self.water.at_depth(z),
            actuators: *self.vehicle.actuators(),
        }
    }

    /// The true state of the ship now.
    pub fn ship(&self) -> ShipTruth {
        self.ship.at(seconds(self.time_us))
    }
}

fn seconds(time_us: u64) -> f64 {
    time_us as f64 * 1.0e-6
}
