//! The ship's own filter: constant velocity driven by white acceleration, corrected by its GNSS.
//!
//! North and east are independent; each has a position and a velocity. A fix brings its own sigmas where the receiver
//! says them.

use crate::walk::Walk;

/// One sigma of the unknown velocity before the first fix, m/s.
const VELOCITY_SIGMA_MPS: f64 = 5.0;
/// A fix this many sigmas off is not believed ...
const GATE_SIGMAS: f64 = 5.0;
/// ... unless so many in a row are: then the filter starts again from the last.
const REFUSED_IN_A_ROW: u8 = 5;
/// Which place was right, the one before a jump or the one after, nobody on the ship can tell: the jump counts as an
/// error of one sigma and is forgotten with this time constant, s. Reflected signals last for minutes.
const JUMP_FORGOTTEN_S: f64 = 600.0;

/// What became of a fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FixOutcome {
    /// It was believed.
    Used,
    /// It was not.
    Refused,
    /// It was believed because those before it said the same; the ship was thought to be so far from there, m.
    Jumped(f64),
}

/// The ship at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipEstimate {
    /// North, east, m.
    pub position_m: [f64; 2],
    /// North, east over ground, m/s.
    pub velocity_mps: [f64; 2],
    /// One sigma of the position, north, east, m.
    pub position_sigma_m: [f64; 2],
    /// One sigma of the velocity, north, east, m/s.
    pub velocity_sigma_mps: [f64; 2],
}

impl ShipEstimate {
    /// The larger sigma of the two axes, m.
    pub fn sigma_m(&self) -> f64 {
        self.position_sigma_m[0].max(self.position_sigma_m[1])
    }
}

/// One axis: position, velocity, and their covariance as variance of position, covariance, variance of velocity.
#[derive(Clone, Copy, Debug)]
struct Axis {
    x: [f64; 2],
    p: [f64; 3],
}

impl Axis {
    /// White acceleration of density `q`, m²/s³, for `dt` seconds, either way in time.
    fn predicted(&self, dt: f64, q: f64) -> Self {
        let [x, v] = self.x;
        let [a, b, c] = self.p;
        let (gap, q2) = (dt.abs(), q * dt * dt.abs());
        let p = [a + dt * (2.0 * b + dt * c) + q * gap * gap * gap / 3.0, b + dt * c + 0.5 * q2, c + q * gap];
        Self { x: [x + v * dt, v], p }
    }

    /// A measurement of position (0) or velocity (1).
    fn fuse(&mut self, which: usize, value: f64, sigma: f64) {
        let [a, b, c] = self.p;
        let ([to_x, to_v], own) = if which == 0 { ([a, b], a) } else { ([b, c], c) };
        let s = own + sigma * sigma;
        if s <= 0.0 {
            return;
        }
        let innovation = value - if which == 0 { self.x[0] } else { self.x[1] };
        self.x = [self.x[0] + to_x / s * innovation, self.x[1] + to_v / s * innovation];
        self.p = [a - to_x * to_x / s, b - to_x * to_v / s, c - to_v * to_v / s];
    }
}

/// The filter. Its time is UTC, µs since 1970.
#[derive(Clone, Debug)]
pub struct ShipFilter {
    /// Density of the acceleration, m²/s³.
    density: f64,
    time_us: u64,
    axes: Option<[Axis; 2]>,
    refused: u32,
    in_a_row: u8,
    /// Sum of the jumps, north and east, at the time of the last, m: a receiver that jumps back is where it was.
    jump_m: [f64; 2],
    jump_us: u64,
    /// The last fix that was used, m, and its larger sigma.
    last_m: [f64; 2],
    last_sigma_m: f64,
    walk: Walk,
}

impl ShipFilter {
    /// Knows nothing until the first fix; allows for this acceleration.
    pub fn new(acceleration_mps2_per_sqrt_hz: f64) -> Self {
        let density = acceleration_mps2_per_sqrt_hz * acceleration_mps2_per_sqrt_hz;
        Self {
            density,
            time_us: 0,
            axes: None,
            refused: 0,
            in_a_row: 0,
            jump_m: [0.0; 2],
            jump_us: 0,
            last_m: [0.0; 2],
            last_sigma_m: 0.0,
            walk: Walk::NEW,
        }
    }

    /// A fix taken at `time_us`.
    pub fn fix(&mut self, time_us: u64, position_m: [f64; 2], sigma_m: [f64; 2]) -> FixOutcome {
        let finite = position_m.iter().chain(&sigma_m).all(|value| value.is_finite());
        if !finite || (self.axes.is_some() && time_us <= self.time_us) {
            return FixOutcome::Refused;
        }
        let mut outcome = FixOutcome::Used;
        let mut kept = self.predicted(time_us);
        if let Some(axes) = &kept {
            let off = |axis: &Axis, value: f64, sigma: f64| {
                (value - axis.x[0]).abs() > GATE_SIGMAS * libm::sqrt(axis.p[0] + sigma * sigma)
            };
            if axes.iter().zip(position_m).zip(sigma_m).any(|((axis, value), sigma)| off(axis, value, sigma)) {
                self.refused = self.refused.saturating_add(1);
                self.in_a_row += 1;
                if self.in_a_row < REFUSED_IN_A_ROW {
                    return FixOutcome::Refused;
                }
                let off_m = core::array::from_fn(|i| position_m[i] - axes[i].x[0]);
                outcome = FixOutcome::Jumped(self.jump(time_us, off_m));
                self.walk.clear();
                kept = None;
            }
        }
        self.in_a_row = 0;
        self.time_us = time_us;
        (self.last_m, self.last_sigma_m) = (position_m, sigma_m[0].max(sigma_m[1]));
        self.axes = Some(match kept {
            Some(mut axes) => {
                for ((axis, value), sigma) in axes.iter_mut().zip(position_m).zip(sigma_m) {
                    axis.fuse(0, value, sigma);
                }
                axes
            }
            None => {
                let fresh = |x: f64, sigma: f64| Axis {
                    x: [x, 0.0],
                    p: [sigma * sigma, 0.0, VELOCITY_SIGMA_MPS * VELOCITY_SIGMA_MPS],
                };
                [fresh(position_m[0], sigma_m[0]), fresh(position_m[1], sigma_m[1])]
            }
        });
        outcome
    }

    /// Counts a jump, or a walk, from where the ship was expected; its length, m.
    fn jump(&mut self, time_us: u64, [north, east]: [f64; 2]) -> f64 {
        let before_m = self.doubt_m(time_us);
        (self.jump_m, self.jump_us) = ([before_m[0] + north, before_m[1] + east], time_us);
        libm::hypot(north, east)
    }

    /// What is left of the jumps, north and east, m.
    fn doubt_m(&self, time_us: u64) -> [f64; 2] {
        let since_s = time_us.saturating_sub(self.jump_us) as f64 * 1.0e-6;
        self.jump_m.map(|jump_m| jump_m * libm::exp(-since_s / JUMP_FORGOTTEN_S))
    }

    /// Speed over ground, north and east, at the time of the last fix. By how much the fixes have moved without it, m,
    /// where that is a contradiction: it counts as a jump.
    pub fn velocity(&mut self, velocity_mps: [f64; 2], sigma_mps: f64) -> Option<f64> {
        if !velocity_mps.iter().all(|value| value.is_finite()) {
            return None;
        }
        for (axis, value) in self.axes.iter_mut().flatten().zip(velocity_mps) {
            axis.fuse(1, value, sigma_mps);
        }
        let walked_m = self.walk.take(self.time_us, self.last_m, velocity_mps, [self.last_sigma_m, sigma_mps])?;
        Some(self.jump(self.time_us, walked_m))
    }

    /// The ship at a time; `None` before the first fix.
    pub fn at(&self, time_us: u64) -> Option<ShipEstimate> {
        let [north, east] = self.predicted(time_us)?;
        let root = |variance: f64| libm::sqrt(variance.max(0.0));
        let [north_m, east_m] = self.doubt_m(time_us);
        Some(ShipEstimate {
            position_m: [north.x[0], east.x[0]],
            velocity_mps: [north.x[1], east.x[1]],
            position_sigma_m: [root(north.p[0] + north_m * north_m), root(east.p[0] + east_m * east_m)],
            velocity_sigma_mps: [root(north.p[2]), root(east.p[2])],
        })
    }

    /// When the last fix was taken, UTC µs; `None` before the first.
    pub fn fix_us(&self) -> Option<u64> {
        self.axes.map(|_| self.time_us)
    }

    /// Fixes that were not believed.
    pub fn refused(&self) -> u32 {
        self.refused
    }

    fn predicted(&self, time_us: u64) -> Option<[Axis; 2]> {
        let ahead = time_us.saturating_sub(self.time_us) as f64 * 1.0e-6;
        let behind = self.time_us.saturating_sub(time_us) as f64 * 1.0e-6;
        self.axes.map(|axes| axes.map(|axis| axis.predicted(ahead - behind, self.density)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::vec::Vec;

    /// A ship that moves as the filter believes, exactly discretised: velocity gains a, position a/2 and an independent
    /// part of variance 1/12 a second. Over 300 such ships the squared errors over the stated variances have a mean of
    /// 1.
    #[test]
    fn val_stated_accuracy_is_the_true_one() {
        let mut sums = [0.0; 2];
        for seed in 0..300 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut normal = |sigma: f64| -> f64 {
                let value: f64 = StandardNormal.sample(&mut random);
                sigma * value
            };
            let mut filter = ShipFilter::new(0.05);
            let (mut x, mut v) = ([0.0; 2], [normal(2.0), normal(2.0)]);
            for second in 0..60 {
                let fix = [x[0] + normal(0.8), x[1] + normal(0.3)];
                filter.fix(second * 1_000_000, fix, [0.8, 0.3]);
                if second < 59 {
                    for axis in 0..2 {
                        let (a, b) = (normal(0.05), normal(0.05));
                        x[axis] += v[axis] + 0.5 * a + b / 12.0_f64.sqrt();
                        v[axis] += a;
                    }
                }
            }
            let estimate = filter.at(59_000_000).unwrap();
            for axis in 0..2 {
                sums[0] += ((estimate.position_m[axis] - x[axis]) / estimate.position_sigma_m[axis]).powi(2) / 600.0;
                sums[1] +=
                    ((estimate.velocity_mps[axis] - v[axis]) / estimate.velocity_sigma_mps[axis]).powi(2) / 600.0;
            }
        }
        // 600 squared normals: 1 ± 0.058; three sigma
        assert!(sums.iter().all(|mean| (0.82..1.18).contains(mean)), "{sums:?}");
    }

    /// Closed form: a constant of unknown value, fixes of 1 m, no acceleration: sigma falls to that of a straight
    /// line's end point, 2 / sqrt(n) for n fixes (least squares: variance 2 (2 n - 1) / (n (n + 1))).
    #[test]
    fn val_without_acceleration_it_is_a_least_squares_line() {
        let mut filter = ShipFilter::new(1.0e-9);
        for second in 0..100 {
            filter.fix(second * 1_000_000, [2.0 * second as f64, 0.0], [1.0; 2]);
        }
        let n = 100.0;
        let expected: f64 = 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0));
        let estimate = filter.at(99_000_000).unwrap();
        // the first velocity is known to 5 m/s, which is 1 part in 10^4 here
        assert!((estimate.position_sigma_m[0] / expected.sqrt() - 1.0).abs() < 1e-3, "{estimate:?}");
        assert!((estimate.velocity_mps[0] - 2.0).abs() < 1e-3);
    }

    #[test]
    fn an_outage_grows_sigma_and_a_wild_fix_is_refused_until_it_is_confirmed() {
        let mut filter = ShipFilter::new(0.02);
        assert_eq!(filter.at(0), None);
        for second in 0..30 {
            assert_eq!(filter.fix(second * 1_000_000, [0.0; 2], [0.5; 2]), FixOutcome::Used);
        }
        let before = filter.at(29_000_000).unwrap().sigma_m();
        assert!(filter.at(120_000_000).unwrap().sigma_m() > 10.0 * before);
        for second in 30..34 {
            assert_eq!(filter.fix(second * 1_000_000, [500.0, 0.0], [0.5; 2]), FixOutcome::Refused, "{second}");
        }
        assert_eq!(filter.fix(34_000_000, [500.0, 0.0], [0.5; 2]), FixOutcome::Jumped(500.0));
        assert_eq!((filter.refused(), filter.at(34_000_000).unwrap().position_m), (5, [500.0, 0.0]));
        assert_eq!(filter.fix(34_000_000, [500.0, 0.0], [0.5; 2]), FixOutcome::Refused, "the same fix again");
        assert_eq!(filter.fix(35_000_000, [f64::NAN, 0.0], [0.5; 2]), FixOutcome::Refused);
    }

    /// Fixes that are drawn east by 0.3 m/s while the speed says that the ship lies still: the sigma grows with them.
    #[test]
    fn val_fixes_that_walk_count_in_the_sigma() {
        let mut filter = ShipFilter::new(0.02);
        let mut noticed_m = Vec::new();
        for second in 0..200_u64 {
            let east_m = 0.3 * (second as f64 - 60.0).max(0.0);
            filter.fix(second * 1_000_000, [0.0, east_m], [0.5; 2]);
            noticed_m.extend(filter.velocity([0.0; 2], 0.1));
        }
        assert!(noticed_m.len() >= 2 && noticed_m.iter().all(|by_m| (10.0..20.0).contains(by_m)), "{noticed_m:?}");
        let [north, east] = filter.at(199_000_000).unwrap().position_sigma_m;
        assert!(north < 0.6 && east > 20.0, "{north} {east}");
    }

    /// A jump of 8 m north: one sigma of 8 m, of 8/e m ten minutes later; back where it was after a minute, what is
    /// left is 8 (1 - e^(-1/10)) m. East nothing jumps.
    #[test]
    fn val_a_jump_counts_in_the_sigma_and_is_forgotten() {
        let fixed = |from: u64, to: u64, north_m: f64, filter: &mut ShipFilter| {
            for second in from..to {
                filter.fix(second * 1_000_000, [north_m, 0.0], [0.5; 2]);
                let _ = filter.velocity([0.0; 2], 0.1);
            }
            let [north, east] = filter.at((to - 1) * 1_000_000).unwrap().position_sigma_m;
            assert!(east < 0.6, "{east}");
            north
        };
        let near = |sigma_m: f64, expected_m: f64| (sigma_m - expected_m).abs() < 0.1;
        let mut filter = ShipFilter::new(0.02);
        assert!(fixed(0, 60, 0.0, &mut filter) < 0.5);
        assert!(near(fixed(60, 65, 8.0, &mut filter), 8.0));
        let mut back = filter.clone();
        assert!(near(fixed(65, 665, 8.0, &mut filter), 8.0 * (-1.0_f64).exp()));
        // the fifth fix at the old place is 60 s after the fifth at the other
        assert!(near(fixed(65, 120, 8.0, &mut back), 8.0 * (-55.0_f64 / 600.0).exp()));
        let left_m = 8.0 * (1.0 - (-0.1_f64).exp());
        assert!(near(fixed(120, 125, 0.0, &mut back), left_m.hypot(0.5)));
    }
}
