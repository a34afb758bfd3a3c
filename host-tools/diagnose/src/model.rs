//! The declared vehicle with a set of effects, as the whitener evaluates it.

use crate::actuators::{Actuators, Slowness};
use crate::lateness::{DelayLine, Lateness};
use crate::log_effects::{Effects, PathAt};
use backseat_core::dynamics::{ActuatorInput, Attitude, Linearisation, VehicleModel, VehicleParameters};
use backseat_core::effects::{
    ActuatorMemory, CATALOGUE, EffectInfo, EffectSet, Moment, ParameterKind, SensorChannel, Step,
};
use backseat_core::navigation::models;
use backseat_core::state::{self, P, U, VehicleState, X, Y};

/// Plant, water and effects between two changes.
#[derive(Clone, Debug)]
struct Stretch {
    plant: VehicleModel,
    board: EffectSet,
    /// Entries of the board's catalogue that are present, by their places: they are asked at every step.
    active: Vec<usize>,
    /// Velocity, north and east, m/s.
    water_mps: [f64; 2],
}

/// Plant, water and actuators under one set of effects.
#[derive(Clone, Debug)]
pub struct Model {
    set: Effects,
    /// Times at which a stretch begins, ascending.
    changes: Vec<f64>,
    /// Before the first of them, between them, after the last.
    stretches: Vec<Stretch>,
    /// Turned travel times into ranges, m/s.
    sound_speed_mps: f64,
    memory: ActuatorMemory,
    /// Whether anything stands between command and actuator.
    has_input: bool,
    late: Lateness,
    inputs: DelayLine,
    actuators: Actuators,
}

impl Stretch {
    /// As it is at `t_s`; `None` where the effects make a parameter impossible.
    fn new(declared: &VehicleParameters, board: &EffectSet, t_s: f64) -> Option<Self> {
        let (mut parameters, mut water_mps) = (*declared, [0.0; 2]);
        for (_, info, values) in board.active() {
            if let Some(hook) = info.hooks.plant {
                hook(values, t_s, &mut parameters);
            }
            if let Some(hook) = info.hooks.water {
                let flow = hook(values);
                water_mps = [water_mps[0] + flow[0], water_mps[1] + flow[1]];
            }
        }
        let active = board.active().map(|(place, _, _)| place).collect();
        Some(Self { plant: VehicleModel::with_effects(&parameters).ok()?, board: *board, active, water_mps })
    }

    /// The entries of the board's catalogue that are present, with their values.
    fn active(&self) -> impl Iterator<Item = (&'static EffectInfo, &[f64])> {
        self.active.iter().map(|place| (&CATALOGUE[*place], self.board.values(*place)))
    }

    /// Whether anything stands between command and actuator.
    fn has_input(&self) -> bool {
        self.active().any(|(info, _)| info.hooks.input.is_some())
    }
}

impl Model {
    /// Builds the plants; `None` where the effects make a parameter impossible (a trial step too far).
    #[must_use]
    pub fn new(declared: &VehicleParameters, sound_speed_mps: f64, set: &Effects) -> Option<Self> {
        let mut changes = set.change_times_s();
        for (_, info, values) in set.board.active() {
            if info.hooks.plant.is_some() {
                let times = info.parameters.iter().zip(values).filter(|(p, time_s)| {
                    p.kind == ParameterKind::Onset || p.kind == ParameterKind::End && **time_s > 0.0
                });
                changes.extend(times.map(|(_, time_s)| *time_s));
            }
        }
        changes.sort_by(f64::total_cmp);
        let starts_s = std::iter::once(f64::NEG_INFINITY).chain(changes.iter().copied());
        let stretches =
            starts_s.map(|t_s| Stretch::new(declared, &set.board_at(t_s), t_s)).collect::<Option<Vec<Stretch>>>()?;
        let has_input = stretches.iter().any(Stretch::has_input);
        Some(Self {
            set: *set,
            changes,
            stretches,
            sound_speed_mps,
            memory: ActuatorMemory::default(),
            has_input,
            late: Lateness::default(),
            inputs: DelayLine::default(),
            actuators: Actuators::default(),
        })
    }

    /// The effects.
    #[must_use]
    pub fn set(&self) -> &Effects {
        &self.set
    }

    /// Velocity of the water [north, east], m/s.
    #[must_use]
    pub fn water_mps(&self, t_s: f64) -> [f64; 2] {
        self.stretch(t_s).water_mps
    }

    /// Whether the water moves as with `other` all the time.
    #[must_use]
    pub fn has_water_of(&self, other: &Self) -> bool {
        let mut times = [f64::NEG_INFINITY].iter().chain(&self.changes).chain(&other.changes);
        times.all(|t_s| self.water_mps(*t_s) == other.water_mps(*t_s))
    }

    /// What the actuators do over a step.
    pub fn actuate(&mut self, step: &Step, commanded: &ActuatorInput) -> ActuatorInput {
        let delay_s = self.set.input_delay_s();
        let mut input = if delay_s > 0.0 { self.inputs.delayed(delay_s, step, commanded) } else { *commanded };
        let slowness = self.set.slowness();
        if slowness != Slowness::default() {
            input = self.actuators.follow(&slowness, step, &input);
        }
        if self.has_input {
            let Self { stretches, changes, memory, .. } = self;
            for (info, values) in stretches[place_of(changes, step.t_s)].active() {
                if let Some(hook) = info.hooks.input {
                    hook(values, step, memory, &mut input);
                }
            }
        }
        input
    }

    fn stretch(&self, t_s: f64) -> &Stretch {
        &self.stretches[place_of(&self.changes, t_s)]
    }

    /// f and F at a state, moving water included.
    #[must_use]
    pub fn linearise(&self, t_s: f64, x: &VehicleState, input: &ActuatorInput) -> Linearisation {
        let Stretch { plant, water_mps, .. } = self.stretch(t_s);
        let mut linearisation = plant.linearise(x, input);
        linearisation.f[X] += water_mps[0];
        linearisation.f[Y] += water_mps[1];
        linearisation.f[P] += self.torque(t_s, x, input);
        linearisation
    }

    /// f at a state, moving water included.
    #[must_use]
    pub fn derivative(&self, t_s: f64, x: &VehicleState, input: &ActuatorInput) -> VehicleState {
        let Stretch { plant, water_mps, .. } = self.stretch(t_s);
        let mut f = plant.derivative(x, input);
        f[X] += water_mps[0];
        f[Y] += water_mps[1];
        f[P] += self.torque(t_s, x, input);
        f
    }

    /// Roll acceleration against the propeller's torque, rad/s².
    fn torque(&self, t_s: f64, x: &VehicleState, input: &ActuatorInput) -> f64 {
        let arm_m = self.set.torque_arm_m();
        if arm_m == 0.0 {
            return 0.0;
        }
        let plant = &self.stretch(t_s).plant;
        -arm_m * plant.propeller().thrust(input.propeller_radps, x[U]) / plant.parameters().m_diag[3]
    }

    /// Lets late sensors follow a step that the vehicle made with the derivative `f` to the state `x`.
    pub fn follow(&mut self, step: &Step, f: &VehicleState, x: &VehicleState) {
        let delays = self.set.delays();
        if delays.are_any() {
            let attitude = Attitude::new(&state::attitude(x));
            let track = models::bottom_track(&attitude, &self.water_mps(step.t_s + step.h_s).into());
            self.late.advance(&delays, step, (f, x), track.current_in_body.into());
        }
    }

    /// What a sensor would read of a true value of a vehicle at `x`, and ∂(read)/∂(true); with it the
    /// acoustic path, if it is one.
    #[must_use]
    pub fn read(
        &self,
        t_s: f64,
        channel: SensorChannel,
        truth: [f64; 3],
        at: (&VehicleState, PathAt),
    ) -> ([f64; 3], [[f64; 3]; 3]) {
        let moment = Moment { t_s, sound_speed_mps: self.sound_speed_mps };
        let mut reading = truth;
        let mut slope = self.set.read(&self.late, channel, at, &mut reading);
        for (info, values) in self.stretch(t_s).active() {
            if let Some(measure) = info.hooks.measure.filter(|measure| measure.channels.contains(&channel)) {
                let by = (measure.apply)(values, &moment, &mut reading).by_reading;
                slope = std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| by[i][k] * slope[k][j]).sum()));
            }
        }
        (reading, slope)
    }

    /// Variance that the effects add to each scalar of a channel; no change under way adds any.
    #[must_use]
    pub fn added_variance(&self, channel: SensorChannel) -> f64 {
        self.stretches[0].active().filter_map(|(info, values)| Some((info.hooks.variance?)(values, channel))).sum()
    }
}

/// Which stretch a time lies in.
fn place_of(changes: &[f64], t_s: f64) -> usize {
    changes.partition_point(|change| *change <= t_s)
}
