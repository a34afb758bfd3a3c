//! What becomes of readings on their way into a log: steps of the last digit, gaps, and a reading that is written twice.

use crate::noise::NoiseKind;
use crate::observation::{Observation, ObservationKind};
use crate::rng::{Source, Stream};

/// Steps of the readings, and how often they are lost or repeated; drawn from the seed.
pub(super) struct Readings {
    random: Stream,
    /// Of depth in m, angles in rad, velocities in m/s; 0: none.
    steps: [f64; 3],
    /// Gaps of the Doppler log: chance that one begins with a reading, and their mean length in s.
    gaps: (f64, f64),
    /// Chance that the Doppler log or the attitude sensor gives its last reading again.
    repeated: f64,
    lost_until_us: u64,
    last: [Option<ObservationKind>; 2],
}

impl Readings {
    /// `None` where noise is not mixed: readings are logged as they are.
    pub(super) fn new(noise: NoiseKind, seed: u64) -> Option<Self> {
        let mut random = Stream::new(seed, Source::Readings);
        let mut one_of = |of: [f64; 3]| of[(3.0 * random.uniform()) as usize];
        let steps = [one_of([0.0, 0.01, 0.1]), one_of([0.0, 0.1, 0.01]).to_radians(), one_of([0.0, 0.001, 0.01])];
        let (gaps, repeated) = ((one_of([0.0, 0.0005, 0.002]), 5.0), one_of([0.0, 0.0, 0.02]));
        (noise == NoiseKind::Mixed).then_some(Self {
            random,
            steps,
            gaps,
            repeated,
            lost_until_us: 0,
            last: [None, None],
        })
    }

    /// The reading as it is logged, if it is.
    pub(super) fn logged(&mut self, observation: &Observation) -> Option<Observation> {
        let Observation { time_us, mut kind } = *observation;
        let [depth_m, angle_rad, velocity_mps] = self.steps;
        match &mut kind {
            ObservationKind::Depth { depth_m: depth } => *depth = stepped(*depth, depth_m),
            ObservationKind::Ahrs { euler_rad, .. } => {
                *euler_rad = euler_rad.map(|angle| stepped(angle, angle_rad));
                self.repeat(0, &mut kind);
            }
            ObservationKind::Dvl { velocity_mps: Some(velocity), .. } => {
                *velocity = velocity.map(|v| stepped(v, velocity_mps));
                let (chance, mean_s) = self.gaps;
                if chance > 0.0 && self.random.uniform() < chance {
                    let lasts_s = -mean_s * libm::log(1.0 - self.random.uniform());
                    self.lost_until_us = time_us + (lasts_s * 1e6) as u64;
                }
                if time_us < self.lost_until_us {
                    return None;
                }
                self.repeat(1, &mut kind);
            }
            _ => {}
        }
        Some(Observation { time_us, kind })
    }

    fn repeat(&mut self, sensor: usize, kind: &mut ObservationKind) {
        if self.repeated > 0.0 && self.random.uniform() < self.repeated {
            if let Some(last) = &self.last[sensor] {
                *kind = *last;
            }
        } else {
            self.last[sensor] = Some(*kind);
        }
    }
}

fn stepped(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}
