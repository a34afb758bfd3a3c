//! A world that behaves as it is declared: prior, process noise, ship, effects, sensors.
//!
//! Sensors sample at whole multiples of 0.1 s, so that the bound needs no finer grid: depth at 5 Hz, attitude and rates
//! at 3.3 Hz, DVL at 5 Hz, the ship's GNSS at 1 Hz, a packet from the ship every 30 s. A range is measured at the
//! instant of its arrival, and belongs to the ship at its launch.

use super::case::{DeclaredCase, DeclaredEffect};
use super::motion::Motion;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::parameters::Installation;
use backseat_core::state::VehicleState;
use backseat_logs::{Column, Log, LogRow};
use hil_sim::dataset::Autopilot;
use hil_sim::observation::{Observation, ObservationKind};
use hil_sim::rng::{Source, Stream};
use hil_sim::truth::{Actuators, State, Water};

/// Integration step, µs; accelerations hold over it.
const STEP_US: u64 = 10_000;
const STEP_S: f64 = 1e-6 * STEP_US as f64;
/// Grid of the bound, steps.
pub(super) const GRID_STEPS: u64 = 10;
/// Sampling of each sensor, steps.
pub(super) const DEPTH_STEPS: u64 = 20;
pub(super) const AHRS_STEPS: u64 = 30;
pub(super) const DVL_STEPS: u64 = 20;
pub(super) const SECOND_STEPS: u64 = 100;
/// The first packet leaves then and one every so many seconds.
const FIRST_PACKET_S: u64 = 20;
pub(super) const PACKET_S: u64 = 30;
/// The autopilot commands every so many steps.
const COMMAND_STEPS: u64 = hil_sim::dataset::COMMAND_US / STEP_US;
const SOUND_SPEED_MPS: f64 = Installation::DEFAULT.sound_speed_mps;

/// Random streams beside the simulator's own.
const PRIOR: Source = Source::Mission;
const EFFECTS: Source = Source::Effects;

/// Ship: north, east, and their velocities.
pub(super) type ShipState = [f64; 4];

/// The true state at one whole second.
#[derive(Clone, Debug)]
pub struct TrueState {
    /// Vehicle.
    pub vehicle: VehicleState,
    /// In the order of the case.
    pub effects: Vec<f64>,
}

/// A packet under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct PacketUnderWay {
    pub launch_us: u64,
    /// At launch.
    pub ship: ShipState,
}

/// A packet arrived, in truth.
#[derive(Clone, Copy, Debug)]
pub(super) struct RangeArrival {
    /// Of the vehicle, at arrival, m.
    pub position_m: [f64; 3],
    /// Over ground, m/s.
    pub velocity_mps: [f64; 3],
    /// At launch.
    pub ship: ShipState,
}

/// The measurements and the truth.
#[derive(Clone, Debug)]
pub struct DeclaredFlight {
    /// Measurements and commands.
    pub log: Log,
    /// At each whole second.
    pub truth: Vec<TrueState>,
}

/// One run of a case, step by step.
#[derive(Clone, Debug)]
pub struct DeclaredWorld<'a> {
    case: &'a DeclaredCase,
    motion: Motion,
    autopilot: Option<Autopilot<'a>>,
    pub(super) steps: u64,
    pub(super) state: State,
    pub(super) ship: ShipState,
    pub(super) effects: Vec<f64>,
    pub(super) actuators: Actuators,
    pub(super) packet: Option<PacketUnderWay>,
    /// Packets that arrived in the last step.
    pub(super) arrival: Option<RangeArrival>,
    random: Random,
    rows: Vec<LogRow>,
}

#[derive(Clone, Debug)]
struct Random {
    disturbance: Stream,
    depth: Stream,
    ahrs: Stream,
    dvl: Stream,
    ship: Stream,
    ship_gnss: Stream,
    acoustics: Stream,
    effects: Stream,
}

impl<'a> DeclaredWorld<'a> {
    /// Drawn from the prior.
    #[must_use]
    pub fn new(case: &'a DeclaredCase, seed: u64) -> Self {
        let mut prior = Stream::new(seed, PRIOR);
        let x = case.vehicle_prior.state + case.vehicle_prior.sigma.map(|sigma| sigma * prior.normal());
        let ship = [0, 1, 3, 4].map(|i| case.ship_prior.state[i] + case.ship_prior.sigma[i] * prior.normal());
        let effects = case.effects.iter().map(|effect| effect.sigma * prior.normal()).collect();
        let part = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let stream = |source| Stream::new(seed, source);
        let mut world = Self {
            case,
            motion: case.motion.clone(),
            autopilot: (!case.legs.is_empty())
                .then(|| Autopilot::new(&case.vehicle.parameters, &case.legs, case.options.use_dvl)),
            steps: 0,
            state: State::new(part(0), part(3), part(6), part(9)),
            ship,
            effects,
            actuators: Actuators::default(),
            packet: None,
            arrival: None,
            random: Random {
                disturbance: stream(Source::Disturbance),
                depth: stream(Source::Depth),
                ahrs: stream(Source::Ahrs),
                dvl: stream(Source::Dvl),
                ship: stream(Source::Ship),
                ship_gnss: stream(Source::ShipGnss),
                acoustics: stream(Source::Acoustics),
                effects: stream(EFFECTS),
            },
            rows: Vec::new(),
        };
        world.observe();
        world
    }

    /// Flies a case to its end.
    #[must_use]
    pub fn fly(case: &'a DeclaredCase, seed: u64) -> DeclaredFlight {
        let mut world = Self::new(case, seed);
        let mut truth = vec![world.truth()];
        for _ in 0..case.duration_s {
            for _ in 0..SECOND_STEPS {
                world.step();
            }
            truth.push(world.truth());
        }
        DeclaredFlight { log: Log { rows: world.rows, ..Log::default() }, truth }
    }

    fn truth(&self) -> TrueState {
        TrueState { vehicle: self.vehicle(), effects: self.effects.clone() }
    }

    fn vehicle(&self) -> VehicleState {
        let mut x = VehicleState::zeros();
        let parts =
            [self.state.position_m(), self.state.euler_rad(), self.state.velocity_mps(), self.state.rates_radps()];
        for (i, part) in parts.iter().enumerate() {
            x.fixed_rows_mut::<3>(3 * i).copy_from_slice(part);
        }
        x
    }

    pub(super) fn effect(&self, effect: DeclaredEffect) -> f64 {
        let place = self.case.effects.iter().position(|prior| prior.effect == effect);
        place.map_or(0.0, |place| self.effects[place])
    }

    fn water(&self) -> Water {
        let surface_mps = [DeclaredEffect::CurrentNorth, DeclaredEffect::CurrentEast].map(|effect| self.effect(effect));
        Water { surface_mps, ..Water::default() }
    }

    /// Whether a packet leaves now.
    pub(super) fn launches(steps: u64) -> bool {
        let second = steps / SECOND_STEPS;
        steps.is_multiple_of(SECOND_STEPS)
            && second >= FIRST_PACKET_S
            && (second - FIRST_PACKET_S).is_multiple_of(PACKET_S)
    }

    /// To the next step of the integrator, its measurements and its commands.
    pub(super) fn step(&mut self) {
        let before = self.state;
        let per_step = STEP_S.sqrt().recip();
        let noise = self.random.disturbance.normals::<6>(per_step);
        let densities = self.case.densities();
        let noise = core::array::from_fn(|i| densities[i] * noise[i]);
        self.state = self.motion.step(&self.state, &self.actuators, &self.water(), &noise, STEP_S);
        self.move_ship();
        self.move_effects();
        self.steps += 1;
        self.arrival = None;
        self.arrive(&before);
        self.observe();
    }

    /// Constant velocity and white acceleration, exactly.
    fn move_ship(&mut self) {
        let density = self.case.options.navigation.ship_noise.linear_mps2_per_sqrt_hz;
        for axis in 0..2 {
            let [a, b] = self.random.ship.normals::<2>(density * STEP_S.sqrt());
            self.ship[axis] += STEP_S * (self.ship[2 + axis] + 0.5 * a + b / 12.0_f64.sqrt());
            self.ship[2 + axis] += a;
        }
    }

    fn move_effects(&mut self) {
        for (value, prior) in self.effects.iter_mut().zip(&self.case.effects) {
            *value += prior.walk * STEP_S.sqrt() * self.random.effects.normal();
            if prior.effect == DeclaredEffect::LinearDrag {
                self.motion.set_drag(*value);
            }
        }
    }

    /// The packet's sound reaches the vehicle on the way from `before` to now; close to a straight line, within some
    /// micrometres.
    fn arrive(&mut self, before: &State) {
        let Some(packet) = self.packet else { return };
        let now_s = STEP_S * self.steps as f64;
        let launch_s = 1e-6 * packet.launch_us as f64;
        let (p0, p1) = (before.position_m(), self.state.position_m());
        let distance = |p: [f64; 3]| libm::hypot(libm::hypot(p[0] - packet.ship[0], p[1] - packet.ship[1]), p[2]);
        let ahead = |share: f64| {
            let p = core::array::from_fn(|i| p0[i] + share * (p1[i] - p0[i]));
            (p, SOUND_SPEED_MPS * (now_s - (1.0 - share) * STEP_S - launch_s) - distance(p))
        };
        if ahead(1.0).1 < 0.0 {
            return;
        }
        // Sound moves 15 m in a step and the vehicle a centimetre: each round wins two digits.
        let mut share = 1.0;
        for _ in 0..4 {
            share -= ahead(share).1 / (SOUND_SPEED_MPS * STEP_S);
        }
        let share = share.clamp(0.0, 1.0);
        let (position_m, _) = ahead(share);
        let velocity_mps = self.state.velocity_ned_mps(&self.water());
        self.packet = None;
        self.arrival = Some(RangeArrival { position_m, velocity_mps, ship: packet.ship });

        let sensors = self.case.options.navigation.sensors;
        let [range, rate, north, east] = self.random.acoustics.normals::<4>(1.0);
        let range_m = distance(position_m);
        let [x, y, z] = position_m;
        let [s1, s2, v1, v2] = packet.ship;
        let opening =
            ((x - s1) * (velocity_mps[0] - v1) + (y - s2) * (velocity_mps[1] - v2) + z * velocity_mps[2]) / range_m;
        let arrival_us = (1e6 * (now_s - (1.0 - share) * STEP_S)).round() as u64;
        // A packet's position of the ship is a raw fix.
        let fix = [s1 + sensors.ship_gnss_m * north, s2 + sensors.ship_gnss_m * east];
        let late_m = SOUND_SPEED_MPS * self.effect(DeclaredEffect::ClockOffset);
        self.row(arrival_us)
            .set(Column::Range, range_m + late_m + sensors.range_m * range)
            .set(Column::RangeRate, opening + sensors.range_rate_mps * rate)
            .set(Column::Tol, launch_s)
            .set_all(Column::ShipX, &fix);
    }

    fn row(&mut self, time_us: u64) -> &mut LogRow {
        if self.rows.last().is_none_or(|row| row.time_us != time_us) {
            self.rows.push(LogRow::new(time_us));
        }
        let last = self.rows.len() - 1;
        &mut self.rows[last]
    }

    /// Sensors, then what leaves at this time.
    fn observe(&mut self) {
        let (steps, time_us) = (self.steps, STEP_US * self.steps);
        let sensors = self.case.options.navigation.sensors;
        let due = |every: u64| steps > 0 && steps.is_multiple_of(every);
        let x = self.vehicle();
        if due(DEPTH_STEPS) {
            let depth_m = x[2] + sensors.depth_m * self.random.depth.normal();
            self.show(ObservationKind::Depth { depth_m });
            self.row(time_us).set(Column::Depth, depth_m);
        }
        if due(AHRS_STEPS) {
            let angle = self.random.ahrs.normals::<3>(1.0);
            let sigma = sensors.angles_rad();
            let angle: [f64; 3] = core::array::from_fn(|axis| sigma[axis] * angle[axis]);
            let rate = self.random.ahrs.normals::<3>(sensors.rates_radps);
            let euler_rad = core::array::from_fn(|i| libm::remainder(x[3 + i] + angle[i], std::f64::consts::TAU));
            let rates_radps = core::array::from_fn(|i| x[9 + i] + rate[i]);
            self.show(ObservationKind::Ahrs { euler_rad, rates_radps });
            self.row(time_us).set_all(Column::Roll, &euler_rad).set_all(Column::P, &rates_radps);
        }
        if due(DVL_STEPS) && self.case.options.use_dvl {
            let (m, ned) = (self.state.body_to_ned(), self.state.velocity_ned_mps(&self.water()));
            let noise = self.random.dvl.normals::<3>(sensors.dvl_mps);
            let velocity: [f64; 3] = core::array::from_fn(|i| (0..3).map(|j| m[j][i] * ned[j]).sum::<f64>() + noise[i]);
            self.show(ObservationKind::Dvl { velocity_mps: Some(velocity), altitude_m: None });
            self.row(time_us).set_all(Column::DvlU, &velocity);
        }
        if due(SECOND_STEPS) {
            let noise = self.random.ship_gnss.normals::<2>(sensors.ship_gnss_m);
            let fix = [self.ship[0] + noise[0], self.ship[1] + noise[1]];
            self.row(time_us).set_all(Column::ShipGpsX, &fix);
        }
        if Self::launches(steps) {
            self.packet = Some(PacketUnderWay { launch_us: time_us, ship: self.ship });
        }
        if steps.is_multiple_of(COMMAND_STEPS) {
            if let Some(autopilot) = &mut self.autopilot {
                self.actuators = autopilot.command(time_us);
            }
            let Actuators { propeller_radps, fins_rad } = self.actuators;
            self.row(time_us).set_actuators(&ActuatorInput { propeller_radps, fins_rad });
        }
    }

    fn show(&mut self, kind: ObservationKind) {
        if let Some(autopilot) = &mut self.autopilot {
            autopilot.observe(&Observation { time_us: STEP_US * self.steps, kind });
        }
    }
}
