//! Effects that a vehicle file declares beside its parameters: taken out of the log, or into the parameters, before
//! anything is identified. θ then describes the vehicle without them.

use crate::sample::PERIOD_S;
use backseat_core::dynamics::{ActuatorInput, VehicleParameters};
use backseat_core::effects::{ActuatorMemory, EffectSet, Moment, ParameterKind, SensorChannel, Step, parameters};
use backseat_core::parameters::Installation;

/// Sound speed, m/s: no effect on attitude, rates or DVL asks for it.
const SOUND_SPEED_MPS: f64 = Installation::DEFAULT.sound_speed_mps;
/// Rounds of the fixed point: effects change a reading by less than a third of itself.
const ROUNDS: usize = 30;

/// Moves the effects on the plant into the vehicle's parameters and out of the set. Those that begin at some time stay
/// in the set, and their names are returned: they are not taken into account.
pub fn fold_into_plant(vehicle: &mut VehicleParameters, effects: &mut EffectSet) -> Vec<&'static str> {
    let mut left = Vec::new();
    let declared = *effects;
    for (index, info, values) in declared.active() {
        let Some(plant) = info.hooks.plant else { continue };
        if info.parameters.iter().any(|parameter| parameter.kind == ParameterKind::Onset) {
            left.push(info.name);
            continue;
        }
        plant(values, 0.0, vehicle);
        for id in parameters().filter(|id| id.effect_index() == index) {
            effects.set(id, 0.0);
        }
    }
    left
}

/// Takes the effects of sensors, water and actuators out of a log, in order of time.
pub(crate) struct EffectRemoval<'a> {
    effects: &'a EffectSet,
    epoch_us: u64,
    memory: ActuatorMemory,
}

impl<'a> EffectRemoval<'a> {
    pub fn new(effects: &'a EffectSet, epoch_us: u64) -> Self {
        Self { effects, epoch_us, memory: ActuatorMemory::default() }
    }

    /// The effects that are taken out.
    pub fn names(&self) -> Vec<&'static str> {
        let sensed = |channels: &[SensorChannel]| {
            channels
                .iter()
                .any(|channel| matches!(channel, SensorChannel::Attitude | SensorChannel::Rates | SensorChannel::Dvl))
        };
        let active = self.effects.active().map(|(_, info, _)| info);
        let acts = active.filter(|info| {
            let hooks = &info.hooks;
            hooks.water.is_some()
                || hooks.input.is_some()
                || hooks.measure.is_some_and(|measure| sensed(measure.channels))
        });
        acts.map(|info| info.name).collect()
    }

    fn since_s(&self, time_us: u64) -> f64 {
        time_us.saturating_sub(self.epoch_us) as f64 * 1.0e-6
    }

    /// What a sensor without effects would have read.
    pub fn reading(&self, channel: SensorChannel, time_us: u64, measured: [f64; 3]) -> [f64; 3] {
        let moment = Moment { t_s: self.since_s(time_us), sound_speed_mps: SOUND_SPEED_MPS };
        let hooks: Vec<_> = self
            .effects
            .active()
            .filter_map(|(_, info, values)| {
                Some((info.hooks.measure.filter(|m| m.channels.contains(&channel))?, values))
            })
            .collect();
        let mut ideal = measured;
        for _ in 0..if hooks.is_empty() { 0 } else { ROUNDS } {
            let mut reading = ideal;
            for (measure, values) in &hooks {
                (measure.apply)(values, &moment, &mut reading);
            }
            for i in 0..3 {
                ideal[i] += measured[i] - reading[i];
            }
        }
        ideal
    }

    /// Velocity of the water over ground [north, east], m/s.
    pub fn water(&self) -> [f64; 2] {
        let waters = self.effects.active().filter_map(|(_, info, values)| Some((info.hooks.water?)(values)));
        waters.fold([0.0; 2], |sum, water| [sum[0] + water[0], sum[1] + water[1]])
    }

    /// What the actuators did in the period that began at a time, of what was commanded.
    pub fn input(&mut self, time_us: u64, commanded: &ActuatorInput) -> ActuatorInput {
        let step = Step { t_s: self.since_s(time_us), h_s: PERIOD_S };
        let mut input = *commanded;
        let effects = self.effects;
        for (_, info, values) in effects.active() {
            if let Some(change) = info.hooks.input {
                change(values, &step, &mut self.memory, &mut input);
            }
        }
        input
    }
}
