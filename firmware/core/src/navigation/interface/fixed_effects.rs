//! What the fixed effects of a configuration make of the water and of a reading.

use super::config::NavigationConfig;
use crate::effects::{EffectSet, Moment, SensorChannel};

/// Velocity [north, east] over ground of the water under fixed effects, m/s.
pub(crate) fn water_of(effects: &EffectSet) -> [f64; 2] {
    let mut water = [0.0; 2];
    for (_, info, values) in effects.active() {
        if let Some(of) = info.hooks.water {
            let [north, east] = of(values);
            water = [water[0] + north, water[1] + east];
        }
    }
    water
}

/// Reading of an ideal sensor where a sensor with the fixed effects reads `measured`, at the epoch.
pub(crate) fn ideal_reading(config: &NavigationConfig, channel: SensorChannel, measured: [f64; 3]) -> [f64; 3] {
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
