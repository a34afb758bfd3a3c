//! The ship: where it is, and where it believes to be.

use crate::observation::ShipReport;
use crate::rng::{Source, Stream};
use crate::scenario::Ship;
use std::f64::consts::TAU;

/// Periods of the three waves of the wander, as multiples of the scenario's wander period;
/// incommensurate, so that the wander does not repeat within a mission.
const WANDER_PERIODS: [f64; 3] = [1.0, 0.618_033_988_75, 1.732_050_807_57];

/// The true state of the ship at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipTruth {
    /// North, east, m.
    pub position_m: [f64; 2],
    /// North, east, m/s.
    pub velocity_mps: [f64; 2],
}

/// The ship's true motion, known in closed form at any time: a circle at constant speed, clockwise
/// seen from above, and three slow waves per axis of random phase.
#[derive(Clone, Debug)]
pub struct ShipMotion {
    settings: Ship,
    phases_rad: [[f64; 3]; 2],
}

impl ShipMotion {
    /// The ship of a scenario.
    #[must_use]
    pub fn new(settings: &Ship, seed: u64) -> Self {
        let mut random = Stream::new(seed, Source::Ship);
        let phases_rad = core::array::from_fn(|_| core::array::from_fn(|_| TAU * random.uniform()));
        Self { settings: *settings, phases_rad }
    }

    /// The true state at a time since the start, s.
    #[must_use]
    pub fn at(&self, time_s: f64) -> ShipTruth {
        let s = &self.settings;
        let (sin, cos) = libm::sincos(s.bearing_rad + s.speed_mps * time_s / s.radius_m);
        let mut position_m = [s.centre_m[0] + s.radius_m * cos, s.centre_m[1] + s.radius_m * sin];
        let mut velocity_mps = [-s.speed_mps * sin, s.speed_mps * cos];
        // Each wave has a third of the variance; a sinusoid's is half its squared amplitude.
        let amplitude = s.wander_m * libm::sqrt(2.0 / 3.0);
        for axis in 0..2 {
            for (period, phase) in WANDER_PERIODS.iter().zip(self.phases_rad[axis]) {
                let omega = TAU / (period * s.wander_period_s);
                let (sin, cos) = libm::sincos(omega * time_s + phase);
                position_m[axis] += amplitude * sin;
                velocity_mps[axis] += amplitude * omega * cos;
            }
        }
        ShipTruth { position_m, velocity_mps }
    }
}

/// The ship's own estimate of itself: constant velocity driven by white acceleration, corrected by
/// its GNSS. North and east are alike, so that one covariance serves both.
#[derive(Clone, Debug)]
pub struct ShipEstimator {
    /// Power spectral density of the acceleration, m²/s³.
    density: f64,
    /// Variance of a fix, m².
    fix_variance: f64,
    time_s: f64,
    estimate: Option<Estimate>,
}

#[derive(Clone, Copy, Debug)]
struct Estimate {
    position_m: [f64; 2],
    velocity_mps: [f64; 2],
    /// Variance of position, covariance with velocity, variance of velocity.
    covariance: [f64; 3],
}

impl ShipEstimator {
    /// Knows nothing until the first fix.
    #[must_use]
    pub fn new(settings: &Ship, fix_sigma_m: f64) -> Self {
        let density = settings.estimator_mps2_per_sqrt_hz;
        Self { density: density * density, fix_variance: fix_sigma_m * fix_sigma_m, time_s: 0.0, estimate: None }
    }

    /// A GNSS fix.
    pub fn fix(&mut self, time_s: f64, position_m: [f64; 2]) {
        /// One sigma of the unknown velocity before the first fix, m/s.
        const VELOCITY_SIGMA: f64 = 3.0;
        self.estimate = Some(match self.predicted(time_s) {
            None => Estimate {
                position_m,
                velocity_mps: [0.0; 2],
                covariance: [self.fix_variance, 0.0, VELOCITY_SIGMA * VELOCITY_SIGMA],
            },
            Some(mut e) => {
                let [a, b, c] = e.covariance;
                let s = a + self.fix_variance;
                let gain = [a / s, b / s];
                for axis in 0..2 {
                    let innovation = position_m[axis] - e.position_m[axis];
                    e.position_m[axis] += gain[0] * innovation;
                    e.velocity_mps[axis] += gain[1] * innovation;
                }
                e.covariance = [a * self.fix_variance / s, b * self.fix_variance / s, c - gain[1] * b];
                e
            }
        });
        self.time_s = time_s;
    }

    /// What the ship says about itself at a time; nothing before its first fix.
    #[must_use]
    pub fn report(&self, time_s: f64) -> Option<ShipReport> {
        self.predicted(time_s).map(|e| ShipReport {
            position_m: e.position_m,
            velocity_mps: e.velocity_mps,
            position_sigma_m: e.covariance[0].sqrt(),
            velocity_sigma_mps: e.covariance[2].sqrt(),
        })
    }

    fn predicted(&self, time_s: f64) -> Option<Estimate> {
        self.estimate.map(|mut e| {
            let dt = time_s - self.time_s;
            for axis in 0..2 {
                e.position_m[axis] += dt * e.velocity_mps[axis];
            }
            let [a, b, c] = e.covariance;
            let q = self.density;
            e.covariance = [a + dt * (2.0 * b + dt * (c + q * dt / 3.0)), b + dt * (c + 0.5 * q * dt), c + q * dt];
            e
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circle_without_wander_is_exact() {
        let settings = Ship { wander_m: 0.0, ..Ship::default() };
        let ship = ShipMotion::new(&settings, 1);
        let quarter = ship.at(0.25 * TAU * 600.0 / 2.0);
        // A quarter turn from north is east of the centre, heading south. Rounding of 600 m.
        assert!((quarter.position_m[0] - 500.0).abs() < 1e-10 && (quarter.position_m[1] - 1050.0).abs() < 1e-10);
        assert!((quarter.velocity_mps[0] + 2.0).abs() < 1e-12 && quarter.velocity_mps[1].abs() < 1e-12);
    }

    #[test]
    fn velocity_is_the_derivative_of_position() {
        let ship = ShipMotion::new(&Ship::default(), 3);
        let (before, here, after) = (ship.at(999.0), ship.at(1000.0), ship.at(1001.0));
        for axis in 0..2 {
            let slope = 0.5 * (after.position_m[axis] - before.position_m[axis]);
            // Third derivative of the fastest wave: 0.4 m (2π/74 s)³ / 6.
            assert!((slope - here.velocity_mps[axis]).abs() < 5e-5);
        }
    }

    #[test]
    fn reported_accuracy_is_honest() {
        // Mean normalised squared error over 200 independent filters of a ship on its circle.
        let settings = Ship::default();
        let (mut position, mut velocity) = (0.0, 0.0);
        for seed in 0..200 {
            let motion = ShipMotion::new(&settings, seed);
            let mut noise = Stream::new(seed, Source::ShipGnss);
            let mut estimator = ShipEstimator::new(&settings, 0.5);
            for second in 0..120 {
                let time = f64::from(second);
                let error = noise.normals::<2>(0.5);
                let truth = motion.at(time).position_m;
                estimator.fix(time, core::array::from_fn(|i| truth[i] + error[i]));
            }
            let (truth, report) = (motion.at(119.0), estimator.report(119.0).unwrap());
            for axis in 0..2 {
                position +=
                    ((report.position_m[axis] - truth.position_m[axis]) / report.position_sigma_m).powi(2) / 400.0;
                velocity += ((report.velocity_mps[axis] - truth.velocity_mps[axis]) / report.velocity_sigma_mps)
                    .powi(2)
                    / 400.0;
            }
        }
        // 400 squared normals have a mean of 1 +- 0.07; the turn and the wander, which a constant
        // velocity model does not know, may add a little, and the allowance for them take it away.
        assert!((0.6..1.3).contains(&position), "{position}");
        assert!((0.2..1.5).contains(&velocity), "{velocity}");
    }
}
