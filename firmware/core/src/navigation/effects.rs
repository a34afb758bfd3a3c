//! Effects as the filter applies them: fixed values, overlaid with those that are states.

use super::discretisation::Discretisation;
use super::estimate::Estimate;
use super::layout::EFFECTS;
use super::observation::Observations;
use super::row::Row;
use super::{ConfigError, NavigationConfig};
use crate::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use crate::effects::{ActuatorMemory, CATALOGUE, EffectSet, Hooks, Moment, ParameterKind, SensorChannel, Step};
use crate::state;

/// A bit for each entry of the catalogue.
type Entries = u32;
const _: () = assert!(CATALOGUE.len() <= Entries::BITS as usize);

/// Which entries are at work, by what they do, and what they remember.
pub(super) struct Effects {
    /// Time that `t_s` counts from, µs.
    pub(super) epoch_us: u64,
    plant: Entries,
    /// Those of `plant` that hold a state.
    plant_states: Entries,
    input: Entries,
    /// Those that change what a channel's sensors read, or its noise.
    measure: [Entries; SensorChannel::COUNT],
    /// Those that narrow a channel's gate.
    gate: [Entries; SensorChannel::COUNT],
    /// The plant changes next, s since the epoch.
    next_onset_s: f64,
    memory: ActuatorMemory,
    /// The vehicle without effects, once it was adopted.
    declared: Option<VehicleParameters>,
}

/// The values of one entry.
pub(super) struct Values {
    values: [f64; 3],
    /// Where those that are states stand.
    places: [Option<usize>; 3],
    len: usize,
}

impl Values {
    /// Fixed values of the entry, or its states where it has some.
    pub(super) fn of(index: usize, config: &NavigationConfig, x: &Estimate) -> Self {
        let mut out = Self { values: [0.0; 3], places: [None; 3], len: 0 };
        for (value, fixed) in out.values.iter_mut().zip(config.effects.values(index)) {
            *value = *fixed;
            out.len += 1;
        }
        for (slot, state) in config.effect_states.iter().enumerate() {
            if state.parameter.effect_index() == index
                && let (Some(value), Some(place)) =
                    (out.values.get_mut(state.parameter.index()), out.places.get_mut(state.parameter.index()))
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
            plant_states: 0,
            input: 0,
            measure: [0; SensorChannel::COUNT],
            gate: [0; SensorChannel::COUNT],
            next_onset_s: 0.0,
            memory: ActuatorMemory { fins_rad: None },
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
        for state in config.effect_states.iter() {
            states |= 1 << state.parameter.effect_index();
        }
        present |= states;
        let with = |has: fn(&Hooks) -> bool| -> Entries {
            entries(present).filter(|(_, hooks)| has(hooks)).fold(0, |bits, (index, _)| bits | 1 << index)
        };
        self.plant = with(|hooks| hooks.plant.is_some());
        self.plant_states = self.plant & states;
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
    /// [`ConfigError::Plant`] if it and its effects do not go together, before or after any onset.
    pub(super) fn adopt(&mut self, model: &VehicleModel, config: &NavigationConfig) -> Result<(), ConfigError> {
        for t_s in [0.0, f64::INFINITY] {
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

    /// The filter's time or states are others: the model is stale, the actuators are where they are told to be.
    pub(super) fn restart(&mut self) {
        self.memory = ActuatorMemory::default();
        self.next_onset_s = if self.plant == 0 { f64::INFINITY } else { f64::NEG_INFINITY };
    }

    /// Whether the model no longer is what it was made for.
    pub(super) fn is_stale(&self, t_s: f64) -> bool {
        self.plant_states != 0 || t_s >= self.next_onset_s
    }

    /// Brings the model to the time `t_s` and the present states.
    pub(super) fn retune(&mut self, model: &mut VehicleModel, t_s: f64, config: &NavigationConfig, x: &Estimate) {
        let mut plant = *self.declared();
        for (index, hooks) in entries(self.plant) {
            if let Some(change) = hooks.plant {
                change(Values::of(index, config, x).as_slice(), t_s, &mut plant);
            }
        }
        model.retune(&plant);
        self.next_onset_s = f64::INFINITY;
        for (index, _) in entries(self.plant) {
            let values = Values::of(index, config, x);
            let parameters = CATALOGUE.get(index).map(|info| info.parameters).unwrap_or_default();
            for (parameter, onset_s) in parameters.iter().zip(values.as_slice()) {
                if parameter.kind == ParameterKind::Onset && *onset_s > t_s {
                    self.next_onset_s = self.next_onset_s.min(*onset_s);
                }
            }
        }
    }

    /// What the actuators did over a step under a command.
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
        input
    }

    /// Whether any state is one of the plant.
    pub(super) fn accelerate(&self) -> bool {
        self.plant_states != 0
    }

    /// Whether the actuators do not what they are told.
    pub(super) fn actuate(&self) -> bool {
        self.input != 0
    }

    /// ∂v̇/∂(effect state) of the plant's states, into the step.
    #[inline(never)]
    pub(super) fn accelerations(
        &self,
        model: &VehicleModel,
        input: &ActuatorInput,
        config: &NavigationConfig,
        x: &Estimate,
        step: &mut Discretisation,
    ) {
        let velocity = state::velocity(&x.vehicle);
        let with_hook = config.effect_states.iter().enumerate().filter_map(|(slot, state)| {
            let by = state.parameter.effect().hooks.wrench_by?;
            Some((slot, by(state.parameter.index(), &velocity, input)))
        });
        for (effect, (slot, wrench)) in step.effects.iter_mut().zip(with_hook) {
            effect.slot = slot;
            effect.acceleration = model.acceleration_of(&wrench);
            step.effect_count += 1;
        }
    }

    /// Turns what ideal sensors would show into what these show, rows of H included.
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

/// Velocity [north, east] over ground of the water under fixed effects, m/s.
pub(super) fn water_of(effects: &EffectSet) -> [f64; 2] {
    let mut water = [0.0; 2];
    for (_, info, values) in effects.active() {
        if let Some(of) = info.hooks.water {
            let [north, east] = of(values);
            water = [water[0] + north, water[1] + east];
        }
    }
    water
}

/// What an ideal sensor would have read where one with the fixed effects read `measured`, at the epoch.
pub(super) fn ideal_reading(config: &NavigationConfig, channel: SensorChannel, measured: [f64; 3]) -> [f64; 3] {
    let moment = Moment { t_s: 0.0, sound_speed_mps: config.sound_speed_mps };
    let mut ideal = measured;
    // Effects change a reading by less than a third of itself: each round wins half a digit at least, most far more.
    for _ in 0..12 {
        let mut reading = ideal;
        for (_, info, values) in config.effects.active() {
            if let Some(measure) = info.hooks.measure.filter(|measure| measure.channels.contains(&channel)) {
                (measure.apply)(values, &moment, &mut reading);
            }
        }
        for i in 0..3 {
            ideal[i] += measured[i] - reading[i];
        }
    }
    ideal
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
