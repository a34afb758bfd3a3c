//! The ship: where it is, and where it believes to be.

use crate::observation::ShipReport;
use crate::rng::{Source, Stream};
use crate::scenario::{Ship, ShipTrack};
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

/// The ship's true motion, known in closed form at any time: its track at constant speed, and three slow waves per
/// axis of random phase.
#[derive(Clone, Debug)]
pub struct ShipMotion {
    settings: Ship,
    phases_rad: [[f64; 3]; 2],
}

impl ShipMotion {
    /// The ship of a scenario.
    pub fn new(settings: &Ship, seed: u64) -> Self {
        let mut random = Stream::new(seed, Source::Ship);
        let phases_rad = core::array::from_fn(|_| core::array::from_fn(|_| TAU * random.uniform()));
        Self { settings: *settings, phases_rad }
    }

    /// The true state at a time since the start, s.
    pub fn at(&self, time_s: f64) -> ShipTruth {
        let s = &self.settings;
        let turned_rad = if s.track == ShipTrack::Circle { s.speed_mps * time_s / s.radius_m } else { 0.0 };
        let (sin, cos) = libm::sincos(s.bearing_rad + turned_rad);
        let mut position_m = [s.centre_m[0] + s.radius_m * cos, s.centre_m[1] + s.radius_m * sin];
        let mut velocity_mps = [0.0; 2];
        let along = match s.track {
            ShipTrack::Circle => {
                velocity_mps = [-s.speed_mps * sin, s.speed_mps * cos];
                None
            }
            ShipTrack::Station => None,
            ShipTrack::Drift => Some((s.speed_mps * time_s, s.speed_mps)),
            ShipTrack::Line => {
                let way_m = libm::fmod(s.speed_mps * time_s, 2.0 * s.length_m);
                let is_out = way_m < s.length_m;
                Some(if is_out { (way_m, s.speed_mps) } else { (2.0 * s.length_m - way_m, -s.speed_mps) })
            }
        };
        if let Some((way_m, speed_mps)) = along {
            let (sin, cos) = libm::sincos(s.course_rad);
            for (axis, part) in [cos, sin].into_iter().enumerate() {
                position_m[axis] += way_m * part;
                velocity_mps[axis] = speed_mps * part;
            }
        }
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

    /// The ship's own estimate at a time; none before its first fix.
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
    fn a_line_is_steamed_to_and_fro_and_a_station_kept() {
        let circle = Ship { wander_m: 0.0, radius_m: 100.0, centre_m: [0.0; 2], ..Ship::default() };
        let east = Ship { course_rad: 0.25 * TAU, length_m: 300.0, ..circle };
        let at = |track: ShipTrack, time_s: f64| ShipMotion::new(&Ship { track, ..east }, 1).at(time_s);
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
        // 100 m north of the centre, 2 m/s: after 100 s 200 m out, after 200 s 200 m out on the way back.
        let (out, back) = (at(ShipTrack::Line, 100.0), at(ShipTrack::Line, 200.0));
        assert!(near(out.position_m, [100.0, 200.0]) && near(out.velocity_mps, [0.0, 2.0]), "{out:?}");
        assert!(near(back.position_m, [100.0, 200.0]) && near(back.velocity_mps, [0.0, -2.0]), "{back:?}");
        assert!(near(at(ShipTrack::Drift, 200.0).position_m, [100.0, 400.0]));
        let kept = at(ShipTrack::Station, 500.0);
        assert!(near(kept.position_m, [100.0, 0.0]) && near(kept.velocity_mps, [0.0; 2]), "{kept:?}");
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

    /// Mean squared error of reported position and velocity over the reported variances, after two
    /// minutes of fixes, from 200 ships.
    fn normalised_errors(mut track: impl FnMut(u64) -> Vec<ShipTruth>) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for seed in 0..200 {
            let mut noise = Stream::new(seed, Source::ShipGnss);
            let mut estimator = ShipEstimator::new(&Ship::default(), 0.5);
            let track = track(seed);
            for (second, truth) in track.iter().enumerate() {
                let error = noise.normals::<2>(0.5);
                estimator.fix(second as f64, core::array::from_fn(|i| truth.position_m[i] + error[i]));
            }
            let last = track.len() - 1;
            let (truth, report) = (track[last], estimator.report(last as f64).unwrap());
            for axis in 0..2 {
                let position = report.position_m[axis] - truth.position_m[axis];
                let velocity = report.velocity_mps[axis] - truth.velocity_mps[axis];
                sums[0] += (position / report.position_sigma_m).powi(2) / 400.0;
                sums[1] += (velocity / report.velocity_sigma_mps).powi(2) / 400.0;
            }
        }
        sums
    }

    #[test]
    fn val_estimator_is_consistent_with_a_ship_that_moves_as_it_believes() {
        // Constant velocity driven by white acceleration of the declared density, exact over 1 s:
        // velocity gains a, position a/2 and an independent part of variance 1/12.
        let density = Ship::default().estimator_mps2_per_sqrt_hz;
        let errors = normalised_errors(|seed| {
            let mut random = Stream::new(seed, Source::Ship);
            let mut ship = ShipTruth { position_m: [0.0; 2], velocity_mps: random.normals(1.5) };
            let step = |_| {
                let before = ship;
                for axis in 0..2 {
                    let [a, b]: [f64; 2] = random.normals(density);
                    ship.position_m[axis] += ship.velocity_mps[axis] + 0.5 * a + b / 12.0_f64.sqrt();
                    ship.velocity_mps[axis] += a;
                }
                before
            };
            (0..120).map(step).collect()
        });
        // 400 squared normals have a mean of 1 ± 0.07: three sigma.
        assert!(errors.iter().all(|e| (0.79..1.21).contains(e)), "{errors:?}");
    }

    #[test]
    fn reported_accuracy_covers_the_circle() {
        let errors = normalised_errors(|seed| {
            let motion = ShipMotion::new(&Ship::default(), seed);
            (0..120).map(|second| motion.at(f64::from(second))).collect()
        });
        // A steady turn is no white acceleration; what the report must not be is overconfident.
        assert!(errors.iter().all(|e| (0.2..1.21).contains(e)), "{errors:?}");
    }
}
