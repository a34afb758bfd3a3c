//! The water: how it moves at a time and place.

use crate::rng::{Source, Stream};
use crate::scenario::Current;
use crate::scenario::effects::Waves;
use crate::truth::Water;
use std::f64::consts::TAU;

/// One long-crested wave train in deep water.
#[derive(Clone, Copy, Debug)]
struct Train {
    amplitude_mps: f64,
    omega: f64,
    /// Wave number, north and east, 1/m.
    number: [f64; 2],
    phase: f64,
    /// Unit vector of propagation.
    direction: [f64; 2],
}

/// All motion of the water.
///
/// Waves carry the vehicle along with the water around it, as they carry any neutrally buoyant body much shorter
/// than they are long; their slope over its length is left out.
#[derive(Clone, Debug)]
pub struct Sea {
    currents: Vec<Current>,
    trains: Vec<Train>,
}

/// Periods of the trains over the period of the waves: a narrow swell, beating within minutes.
const PERIODS: [f64; 3] = [0.93, 1.0, 1.08];

impl Sea {
    /// Currents add up; the waves come from anywhere.
    pub fn new(currents: &[Current], waves: Option<&Waves>, seed: u64) -> Self {
        const GRAVITY: f64 = 9.81;
        let mut random = Stream::new(seed, Source::Waves);
        let (sin, cos) = libm::sincos(TAU * random.uniform());
        let trains = waves.map_or_else(Vec::new, |waves| {
            let train = |factor| {
                let omega = TAU / (factor * waves.period_s);
                let number = omega * omega / GRAVITY;
                Train {
                    // Together they have the variance of one sinusoid of the amplitude.
                    amplitude_mps: waves.amplitude_mps / (PERIODS.len() as f64).sqrt(),
                    omega,
                    number: [number * cos, number * sin],
                    phase: TAU * random.uniform(),
                    direction: [cos, sin],
                }
            };
            PERIODS.map(train).to_vec()
        });
        Self { currents: currents.to_vec(), trains }
    }

    /// The water around a place at a time since the start, s.
    pub fn at(&self, time_s: f64, position_m: [f64; 3]) -> Water {
        let mut water = Water::default();
        for current in &self.currents {
            let Water { surface_mps, shear_mps_per_m, .. } = water_at(current, time_s, position_m);
            for axis in 0..2 {
                water.surface_mps[axis] += surface_mps[axis];
                water.shear_mps_per_m[axis] += shear_mps_per_m[axis];
            }
        }
        for train in &self.trains {
            let [north, east] = train.number;
            let phase = train.omega * time_s - north * position_m[0] - east * position_m[1] + train.phase;
            let (sin, cos) = libm::sincos(phase);
            for axis in 0..2 {
                water.surface_mps[axis] += train.amplitude_mps * cos * train.direction[axis];
            }
            // Forward under the crest, up before it.
            water.down_mps += train.amplitude_mps * sin;
        }
        water
    }
}

/// Time in which a current sets in, s.
pub const ONSET_S: f64 = 300.0;
/// Half the width of a front, m.
const FRONT_M: f64 = 20.0;

/// A current at a time since the start, s, and a place.
///
/// From one place to the next the vehicle is carried along with the water around it, as by waves: at 1 m/s and a change
/// of 0.15 m/s within 40 m it would lag behind by a tenth of that for some seconds.
#[must_use]
pub fn water_at(current: &Current, time_s: f64, [_, east_m, _]: [f64; 3]) -> Water {
    let (sin, cos) = libm::sincos(current.tide_phase_rad + TAU * time_s / current.tide_period_s);
    let [north, east] = current.gradient_per_s.map(|gradient| gradient * east_m);
    let begun = if current.onset_s > 0.0 { ((time_s - current.onset_s) / ONSET_S).clamp(0.0, 1.0) } else { 1.0 };
    let beyond = current.front_east_m.map_or(1.0, |at| 0.5 + 0.5 * libm::tanh((east_m - at) / FRONT_M));
    let share = begun * beyond;
    Water {
        surface_mps: [
            share * (current.north_mps + current.tide_mps * cos + north),
            share * (current.east_mps + current.tide_mps * sin + east),
        ],
        shear_mps_per_m: [share * current.shear_north_mps_per_m, share * current.shear_east_mps_per_m],
        down_mps: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tide_turns_clockwise_once_a_period_on_top_of_the_steady_current() {
        let current = Current { east_mps: 0.1, tide_mps: 0.2, tide_period_s: 4000.0, ..Current::default() };
        let quarter = water_at(&current, 1000.0, [0.0; 3]).surface_mps;
        // Rounding of sin and cos only.
        assert!((quarter[0]).abs() < 1e-15 && (quarter[1] - 0.3).abs() < 1e-15);
        let whole = water_at(&current, 4000.0, [0.0; 3]).surface_mps;
        assert!((whole[0] - 0.2).abs() < 1e-15 && (whole[1] - 0.1).abs() < 1e-15);
    }

    #[test]
    fn shear_is_linear_below_the_surface() {
        let current = Current { north_mps: 0.1, shear_north_mps_per_m: -0.01, ..Current::default() };
        let water = water_at(&current, 0.0, [0.0; 3]);
        assert_eq!(water.at_depth(5.0), [0.05, 0.0]);
        assert_eq!(water.at_depth(-1.0), [0.1, 0.0]);
    }

    #[test]
    fn a_current_sets_in_and_ends_at_a_front() {
        let current = Current { north_mps: 0.2, onset_s: 1000.0, front_east_m: Some(450.0), ..Current::default() };
        let at = |time_s, east_m| water_at(&current, time_s, [0.0, east_m, 0.0]).surface_mps[0];
        assert_eq!((at(1000.0, 900.0), at(1150.0, 900.0), at(1300.0, 900.0)), (0.0, 0.1, 0.2));
        assert!(at(2000.0, 350.0) < 1e-4 && (at(2000.0, 450.0) - 0.1).abs() < 1e-12);
        let gradient = Current { east_mps: 0.1, gradient_per_s: [1e-4, -1e-4], ..Current::default() };
        let [north, east] = water_at(&gradient, 0.0, [0.0, 500.0, 0.0]).surface_mps;
        // Rounding of a product and a sum.
        assert!((north - 0.05).abs() < 1e-15 && (east - 0.05).abs() < 1e-15);
    }

    #[test]
    fn val_waves_have_the_variance_of_their_amplitude_in_both_directions() {
        let sea = Sea::new(&[], Some(&Waves { amplitude_mps: 0.2, period_s: 6.0 }), 1);
        let samples: Vec<Water> = (0..60_000).map(|k| sea.at(0.1 * f64::from(k), [0.0; 3])).collect();
        let mean = |f: fn(&Water) -> f64| samples.iter().map(f).sum::<f64>() / samples.len() as f64;
        // A² / 2; a hundred minutes average the beats out to a percent.
        let horizontal = mean(|w| w.surface_mps[0].powi(2) + w.surface_mps[1].powi(2));
        let vertical = mean(|w| w.down_mps.powi(2));
        assert!((horizontal / 0.02 - 1.0).abs() < 0.02 && (vertical / 0.02 - 1.0).abs() < 0.02);
        assert!(mean(|w| w.down_mps).abs() < 1e-3);
    }
}
