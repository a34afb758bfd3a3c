//! Effects as the filter applies them: fixed values, overlaid with those that are states.

use crate::dynamics::{ActuatorInput, Attitude, FINS, VehicleModel, VehicleParameters};
use crate::effects::{
    ActuatorMemory, CATALOGUE, Hooks, Moment, Motion, ParameterKind, SensorChannel, Step, parameters,
};
use crate::identification::regressor::{Regressor, regressor};
use crate::identification::theta::{self, PARAMETERS, theta_of};
use crate::navigation::algebra::discretisation::Discretisation;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::layout::EFFECTS;
use crate::navigation::algebra::observation::Observations;
use crate::navigation::algebra::row::Row;
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::effect_states::{LARGEST_LOG_FACTOR, StateParameter};
use crate::navigation::interface::error::ConfigError;
use crate::state;
use nalgebra::Vector6;

/// A bit for each entry of the catalogue.
type Entries = u32;
const _: () = assert!(CATALOGUE.len() <= Entries::BITS as usize);

/// The entries in use, sorted by what they change, and their memory.
#[derive(Clone)]
pub(super) struct Effects {
    /// Time that `t_s` counts from, µs.
    pub(super) epoch_us: u64,
    plant: Entries,
    /// States change the plant.
    retunes: bool,
    /// States change the acceleration.
    accelerates: bool,
    /// States turn the fins.
    trims: bool,
    input: Entries,
    /// Those that change what a channel's sensors read, or its noise.
    measure: [Entries; SensorChannel::COUNT],
    /// Those that narrow a channel's gate.
    gate: [Entries; SensorChannel::COUNT],
    /// The plant changes next, s since the epoch.
    next_change_s: f64,
    memory: ActuatorMemory,
    /// The vehicle without effects, once it was adopted.
    declared: Option<VehicleParameters>,
}

/// The values of one entry.
pub(super) struct Values {
    values: [f64; 4],
    /// Where those that are states stand.
    places: [Option<usize>; 4],
    len: usize,
}

impl Values {
    /// Fixed values of the entry, or its states where it has some.
    pub(super) fn of(index: usize, config: &NavigationConfig, x: &Estimate) -> Self {
        let mut out = Self { values: [0.0; 4], places: [None; 4], len: 0 };
        for (value, fixed) in out.values.iter_mut().zip(config.effects.values(index)) {
            *value = *fixed;
            out.len += 1;
        }
        for (slot, id) in config.effect_states.effects() {
            if id.effect_index() == index
                && let (Some(value), Some(place)) = (out.values.get_mut(id.index()), out.places.get_mut(id.index()))
            {
                *value = x.get(EFFECTS + slot);
                *place = Some(EFFECTS + slot);
            }
        }
        out
    }

    pub(super) fn as_slice(&self) -> &[f64] {
        self.values.get(..self.len).unwrap_or_default()
    }
}

/// Signs by which a trim turns the fins [top, bottom, port, starboard]: nose to starboard (0), nose up (1).
fn trimmed(axis: u8) -> [f64; FINS] {
    if axis == 0 { [1.0, -1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0, -1.0] }
}

/// The entries of a set of bits, in the order of the catalogue.
fn entries(mut bits: Entries) -> impl Iterator<Item = (usize, &'static Hooks)> {
    core::iter::from_fn(move || {
        let index = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        CATALOGUE.get(index).map(|info| (index, &info.hooks))
    })
}

impl Effects {
    pub(super) const fn new() -> Self {
        Self {
            epoch_us: 0,
            plant: 0,
            retunes: false,
            accelerates: false,
            trims: false,
            input: 0,
            measure: [0; SensorChannel::COUNT],
            gate: [0; SensorChannel::COUNT],
            next_change_s: 0.0,
            memory: ActuatorMemory { fins_rad: None, fins_by_lag: [0.0; FINS], mean_by_lag: [0.0; FINS] },
            declared: None,
        }
    }

    /// The vehicle without effects.
    pub(super) fn declared(&self) -> &VehicleParameters {
        self.declared.as_ref().unwrap_or(&VehicleParameters::IVER3)
    }

    /// Reads which entries a configuration has.
    pub(super) fn select(&mut self, config: &NavigationConfig) {
        let mut present: Entries = 0;
        for (index, ..) in config.effects.active() {
            present |= 1 << index;
        }
        let mut states: Entries = 0;
        for (_, id) in config.effect_states.effects() {
            states |= 1 << id.effect_index();
        }
        present |= states;
        let with = |has: fn(&Hooks) -> bool| -> Entries {
            entries(present).filter(|(_, hooks)| has(hooks)).fold(0, |bits, (index, _)| bits | 1 << index)
        };
        self.plant = with(|hooks| hooks.plant.is_some());
        let any = |is: fn(StateParameter) -> bool| config.effect_states.iter().any(|state| is(state.parameter));
        self.trims = any(|parameter| matches!(parameter, StateParameter::FinTrim(_)));
        self.retunes = any(|parameter| match parameter {
            StateParameter::Effect(id) => id.effect().hooks.plant.is_some(),
            StateParameter::LogFactor(_) => true,
            _ => false,
        });
        self.accelerates = any(|parameter| match parameter {
            StateParameter::Effect(id) => id.effect().hooks.accelerates(),
            StateParameter::LogFactor(_) | StateParameter::FinTrim(_) => true,
            StateParameter::CurrentRate(_) => false,
        });
        self.input = with(|hooks| hooks.input.is_some());
        self.measure = [0; SensorChannel::COUNT];
        for (index, hooks) in entries(present) {
            for channel in SensorChannel::ALL {
                let measures = hooks.measure.is_some_and(|measure| measure.channels.contains(&channel));
                if measures || hooks.variance.is_some() {
                    self.measure[channel as usize] |= 1 << index;
                }
            }
        }
        self.gate = [with(|hooks| hooks.gate_sigma.is_some()); SensorChannel::COUNT];
    }

    /// Adopts a vehicle, which the next step retunes.
    ///
    /// # Errors
    /// [`ConfigError::Plant`] if it and its effects do not go together, before, at or after any onset.
    pub(super) fn adopt(&mut self, model: &VehicleModel, config: &NavigationConfig) -> Result<(), ConfigError> {
        let onsets = parameters().filter(|id| id.info().kind == ParameterKind::Onset);
        for t_s in [0.0, f64::INFINITY].into_iter().chain(onsets.map(|id| config.effects.get(id))) {
            let mut plant = *model.parameters();
            for (index, hooks) in entries(self.plant) {
                if let Some(change) = hooks.plant {
                    change(config.effects.values(index), t_s, &mut plant);
                }
            }
            plant.validate_with_effects().map_err(|refused| ConfigError::Plant { key: refused.key })?;
        }
        self.declared = Some(*model.parameters());
        self.restart();
        Ok(())
    }

    /// Call it after time or states were set: the model is out of date, and the actuators stand at their commands.
    pub(super) fn restart(&mut self) {
        self.memory = ActuatorMemory::default();
        self.next_change_s = if self.plant == 0 { f64::INFINITY } else { f64::NEG_INFINITY };
    }

    /// Whether the model is out of date.
    pub(super) fn is_stale(&self, t_s: f64) -> bool {
        self.retunes || t_s >= self.next_change_s
    }

    /// Brings the model to the time `t_s` and the present states.
    pub(super) fn retune(&mut self, model: &mut VehicleModel, t_s: f64, config: &NavigationConfig, x: &Estimate) {
        let mut plant = *self.declared();
        for (at, state) in (EFFECTS..).zip(config.effect_states.iter()) {
            if let StateParameter::LogFactor(j) = state.parameter {
                theta::scale(&mut plant, usize::from(j), libm::exp(x.get(at)));
            }
        }
        for (index, hooks) in entries(self.plant) {
            if let Some(change) = hooks.plant {
                change(Values::of(index, config, x).as_slice(), t_s, &mut plant);
            }
        }
        model.retune(&plant);
        self.next_change_s = f64::INFINITY;
        for (index, _) in entries(self.plant) {
            let values = Values::of(index, config, x);
            let parameters = CATALOGUE.get(index).map(|info| info.parameters).unwrap_or_default();
            for (parameter, time_s) in parameters.iter().zip(values.as_slice()) {
                if matches!(parameter.kind, ParameterKind::Onset | ParameterKind::End) && *time_s > t_s {
                    self.next_change_s = self.next_change_s.min(*time_s);
                }
            }
        }
    }

    /// Actuator input over a step under a command.
    pub(super) fn actuated(
        &mut self,
        commanded: &ActuatorInput,
        step: &Step,
        config: &NavigationConfig,
        x: &Estimate,
    ) -> ActuatorInput {
        let mut input = *commanded;
        for (index, hooks) in entries(self.input) {
            if let Some(change) = hooks.input {
                change(Values::of(index, config, x).as_slice(), step, &mut self.memory, &mut input);
            }
        }
        for (at, state) in (EFFECTS..).zip(config.effect_states.iter()) {
            if let StateParameter::FinTrim(axis) = state.parameter {
                for (fin, sign) in input.fins_rad.iter_mut().zip(trimmed(axis)) {
                    *fin += sign * x.get(at);
                }
            }
        }
        input
    }

    /// Whether any state changes the acceleration.
    pub(super) fn accelerate(&self) -> bool {
        self.accelerates
    }

    /// Whether an effect makes the actuators deviate from their commands.
    pub(super) fn actuate(&self) -> bool {
        self.input != 0 || self.trims
    }

    /// ∂v̇/∂(augmented state) in closed form, into the step. M v̇ + … = 0 is Y θ = h, so that M ∂v̇/∂θ_j = −Y_j.
    #[inline(never)]
    pub(super) fn accelerations(
        &self,
        model: &VehicleModel,
        input: &ActuatorInput,
        acceleration: &Vector6<f64>,
        config: &NavigationConfig,
        x: &Estimate,
        step: &mut Discretisation,
    ) {
        let velocity = state::velocity(&x.vehicle);
        let down = Attitude::new(&state::attitude(&x.vehicle)).down();
        let plant = model.parameters();
        let motion = Motion { velocity: &velocity, down: &down, input, plant };
        let mut columns = Regressor::zeros();
        regressor(acceleration, &velocity, &down, &model.actuator_regressor(&velocity, input), &mut columns);
        let theta = theta_of(plant);
        let by_fin = model.fin_wrenches_by_delta(&velocity, &input.fins_rad);
        let turned =
            |fins: [f64; FINS]| -> Vector6<f64> { by_fin.iter().zip(fins).map(|(by, angle)| by * angle).sum() };

        step.effect_count = 0;
        for (slot, state) in config.effect_states.iter().enumerate() {
            let wrench = match state.parameter {
                StateParameter::LogFactor(j) => {
                    let j = usize::from(j).min(PARAMETERS - 1);
                    Vector6::from_fn(|i, _| columns[(i, j)] * -theta[j])
                }
                StateParameter::FinTrim(axis) => turned(trimmed(axis)),
                StateParameter::Effect(id) => match (id.effect().hooks.wrench_by, id.effect().hooks.fins_by) {
                    (Some(by), _) => by(id.index(), &motion),
                    (_, Some(by)) => turned(by(id.index(), &self.memory)),
                    _ => continue,
                },
                StateParameter::CurrentRate(_) => continue,
            };
            let Some(effect) = step.effects.get_mut(step.effect_count) else { return };
            effect.slot = slot;
            effect.acceleration = model.acceleration_of(&wrench);
            step.effect_count += 1;
        }
    }

    /// Turns the readings of ideal sensors into those of sensors with effects, rows of H included.
    #[inline(never)]
    pub(super) fn observe(
        &self,
        channel: SensorChannel,
        readings: &[f64],
        t_s: f64,
        config: &NavigationConfig,
        x: &Estimate,
        out: &mut Observations,
    ) {
        let moment = Moment { t_s, sound_speed_mps: config.sound_speed_mps };
        for (index, hooks) in entries(self.measure[channel as usize]) {
            if let Some(variance) = hooks.variance {
                let added = variance(Values::of(index, config, x).as_slice(), channel);
                out.as_mut_slice().iter_mut().for_each(|observation| observation.variance += added);
            }
            let Some(measure) = hooks.measure else { continue };
            // What is predicted so far.
            let mut before = [0.0; 3];
            for ((before, z), observation) in before.iter_mut().zip(readings).zip(out.as_slice()) {
                *before = z - observation.innovation;
            }
            let mut after = before;
            let values = Values::of(index, config, x);
            let slopes = (measure.apply)(values.as_slice(), &moment, &mut after);
            turn(out, &slopes.by_reading);
            let changes = before.iter().zip(&after).map(|(before, after)| after - before);
            for (i, (observation, change)) in out.as_mut_slice().iter_mut().zip(changes).enumerate() {
                observation.innovation -= change;
                for (place, column) in values.places.iter().zip(&slopes.by_parameter) {
                    if let Some(place) = place
                        && column[i] != 0.0
                    {
                        observation.row.push(*place, column[i]);
                    }
                }
            }
        }
    }

    /// Keeps the estimated effects within their plausible ranges.
    pub(super) fn bound(config: &NavigationConfig, x: &mut Estimate) {
        for (at, state) in (EFFECTS..).zip(config.effect_states.iter()) {
            let [min, max] = match state.parameter {
                StateParameter::Effect(id) => [id.info().min, id.info().max],
                StateParameter::LogFactor(_) => [-LARGEST_LOG_FACTOR, LARGEST_LOG_FACTOR],
                StateParameter::CurrentRate(_) | StateParameter::FinTrim(_) => continue,
            };
            let value = x.get(at);
            if value < min {
                x.set_tail(at, &[min]);
            } else if value > max {
                x.set_tail(at, &[max]);
            }
        }
    }

    /// The gate on a channel, sigmas.
    pub(super) fn gate_sigma(&self, channel: SensorChannel, config: &NavigationConfig, x: &Estimate) -> f64 {
        let mut gate = config.gate_sigma;
        for (index, hooks) in entries(self.gate[channel as usize]) {
            let narrower = hooks.gate_sigma.and_then(|gate| gate(Values::of(index, config, x).as_slice(), channel));
            gate = gate.min(narrower.unwrap_or(gate));
        }
        gate
    }

    /// Whether any effect is seen on a channel.
    pub(super) fn change(&self, channel: SensorChannel) -> bool {
        self.measure[channel as usize] != 0
    }
}

/// H → J H of a measurement of at most three scalars.
fn turn(out: &mut Observations, by_reading: &[[f64; 3]; 3]) {
    if let [observation] = out.as_mut_slice() {
        observation.row.scale(by_reading[0][0]);
        return;
    }
    let is_diagonal = (0..3).all(|i| (0..3).all(|j| i == j || by_reading[i][j] == 0.0));
    if is_diagonal {
        for (i, observation) in out.as_mut_slice().iter_mut().enumerate().take(3) {
            if by_reading[i][i] != 1.0 {
                observation.row.scale(by_reading[i][i]);
            }
        }
        return;
    }
    mix(out, by_reading);
}

#[inline(never)]
fn mix(out: &mut Observations, by_reading: &[[f64; 3]; 3]) {
    let mut rows = [Row::EMPTY; 3];
    for (row, weights) in rows.iter_mut().zip(by_reading) {
        for (weight, observation) in weights.iter().zip(out.as_slice()) {
            row.add_scaled(*weight, &observation.row);
        }
    }
    for (observation, row) in out.as_mut_slice().iter_mut().zip(rows) {
        observation.row = row;
    }
}
