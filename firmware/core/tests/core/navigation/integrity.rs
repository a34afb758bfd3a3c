//! What is stated of the position beside its covariance.

use super::support::*;
use backseat_core::navigation::*;

/// A flight of `seconds`, with fixes for the first twenty seconds and after `fixes_from_s`, and a range every 20 s. Both
/// sources may err: (error of a fix, error of the ship's report) at a time, m.
struct LevelFlight {
    navigator: Box<Navigator>,
    integrity: Integrity,
    truth: Truth,
}

impl LevelFlight {
    fn run(seconds: u64, fixes_from_s: u64, errors_m: impl Fn(f64) -> ([f64; 2], [f64; 2])) -> Self {
        let mut config = NavigationConfig { surface: None, ..NavigationConfig::REFERENCE };
        config.make_robust();
        config.bank = false;
        let mut navigator = navigator(&config);
        let mut initial = initial();
        let truth = Truth::new(initial.state, [0.0; 2], [0.0; 4]);
        let (start_m, _) = errors_m(0.0);
        (0..2).for_each(|i| initial.state[i] += start_m[i]);
        navigator.initialise(0, &initial).unwrap();
        let mut flight = Self { navigator, integrity: Integrity::new(), truth };
        let mut noise = Noise(5);
        for step in 1..=10 * seconds {
            (0..10).for_each(|_| flight.truth.tick(&CRUISE, &config, &mut noise));
            flight.navigator.predict(100_000 * step, &CRUISE).unwrap();
            let (x, sensors, time_s) = (flight.truth.x, &config.sensors, 0.1 * step as f64);
            let (fix_error_m, ship_error_m) = errors_m(time_s);
            flight.fuse(&Measurement::Depth { z_m: x[2] + sensors.depth_m * noise.normal() });
            flight.fuse(&Measurement::Attitude { euler_rad: noise.normals([x[3], x[4], x[5]], sensors.attitude_rad) });
            if step % 10 == 0 && (step <= 200 || step >= 10 * fixes_from_s) {
                let position_m = [x[0] + fix_error_m[0], x[1] + fix_error_m[1]];
                flight.fuse(&Measurement::VehicleGnss { position_m: noise.normals(position_m, sensors.gnss_m) });
            }
            if step % 200 == 150 {
                // the ship circles by a turn in ten minutes
                let angle = time_s / 600.0 * core::f64::consts::TAU;
                let ship_m = [x[0] + 400.0 * angle.cos(), x[1] + 400.0 * angle.sin()];
                let range_m = (x[0] - ship_m[0]).hypot(x[1] - ship_m[1]).hypot(x[2]) + noise.normal();
                let ship_m = [ship_m[0] + ship_error_m[0], ship_m[1] + ship_error_m[1]];
                let path = reported(still(ship_m, [0.5, 0.1]));
                flight.fuse(&Measurement::Range { path, range_m });
            }
        }
        flight
    }

    fn fuse(&mut self, measurement: &Measurement) {
        let Self { navigator, integrity, .. } = self;
        let offset = navigator.mixture_offset(measurement);
        let fusions = navigator.fuse(measurement);
        integrity.take(&fusions, navigator.main().monitor(), &navigator.config().sensors, offset);
    }

    fn error_m(&self) -> f64 {
        let [dx, dy] = [0, 1].map(|i| self.navigator.state()[i] - self.truth.x[i]);
        dx.hypot(dy)
    }

    /// What `integrity` adds to the variance of state `i` at the time of this flight, m².
    fn unseen(&self, integrity: &Integrity, (i, variance): (usize, f64), receivers_m: [f64; 2]) -> f64 {
        let wave_variance_m2 = self.navigator.main().wave_variance();
        integrity.unseen((i, variance), self.navigator.time_us(), wave_variance_m2, receivers_m)
    }

    /// √(σx² + σy²): of P alone, and with what it leaves out, without receivers' errors.
    fn sigmas_m(&self) -> [f64; 2] {
        let [p, stated] = [0, 1].map(|k| {
            let of = |i: usize| {
                let variance = self.navigator.variance(i);
                variance + if k == 1 { self.unseen(&self.integrity, (i, variance), [0.0; 2]) } else { 0.0 }
            };
            (of(0) + of(1)).sqrt()
        });
        [p, stated]
    }
}

/// A receiver's slow error is in no covariance: it is added once, and the ship's when a range was used; twice until the
/// ship has gone around, 16 minutes after the first range without a fix.
#[test]
fn val_receivers_are_added_by_their_variances() {
    let still = |_| ([0.0; 2], [0.0; 2]);
    let flight = LevelFlight::run(120, 1000, still);
    let unseen = |receivers_m| flight.unseen(&flight.integrity, (0, 1.0), receivers_m);
    assert_eq!(unseen([0.0; 2]), 0.0, "nothing contradicts");
    assert!((unseen([1.5, 2.0]) - (2.25 + 16.0)).abs() < 1e-12);
    let around = LevelFlight::run(1020, 2000, still);
    let unseen_around = |receivers_m| around.unseen(&around.integrity, (0, 1.0), receivers_m);
    assert!((unseen_around([1.5, 2.0]) - unseen_around([0.0; 2]) - (2.25 + 4.0)).abs() < 1e-12);
    assert_eq!(flight.unseen(&flight.integrity, (6, 1.0), [1.5, 2.0]), 0.0, "of a velocity");
    let before = Integrity::new();
    assert!((flight.unseen(&before, (1, 1.0), [1.5, 2.0]) - 2.25).abs() < 1e-12);
}

/// Fixes that drift away at 0.2 m/s while the ranges are honest: the filter follows the fixes, which are more, and P is as
/// small as theirs. What is stated covers the way back.
#[test]
fn val_a_slow_spoof_is_stated() {
    let flight = LevelFlight::run(480, 60, |t| ([0.12 * (t - 60.0).max(0.0), 0.16 * (t - 60.0).max(0.0)], [0.0; 2]));
    let ([p_m, stated_m], error_m) = (flight.sigmas_m(), flight.error_m());
    let doubted =
        flight.navigator.main().is_suspect(Sensor::Range) || flight.navigator.main().is_suspect(Sensor::VehicleGnss);
    assert!(doubted, "one of the two is wrong, and fixes are not the judge");
    assert!(error_m < 3.0 * stated_m, "{error_m} m, {p_m} m, {stated_m} m");
    assert!(error_m < 5.0 || error_m > 3.0 * p_m, "P alone would not have said it: {error_m} m, {p_m} m");
}

/// Fixes that are 9 m off from the start, and a first range that contradicts them: one is not enough to say which of the
/// two is wrong, but nothing else has confirmed the position. A first range that agrees leaves nothing.
#[test]
fn val_a_range_that_contradicts_the_first_fixes_is_stated() {
    let flight = LevelFlight::run(20, 1000, |_| ([9.0, 0.0], [0.0; 2]));
    let ([p_m, stated_m], error_m) = (flight.sigmas_m(), flight.error_m());
    assert!(error_m > 3.0 * p_m && error_m < 3.0 * stated_m, "{error_m} m, {p_m} m, {stated_m} m");
    assert!(!flight.navigator.main().is_suspect(Sensor::Range));
    let [p_m, stated_m] = LevelFlight::run(20, 1000, |_| ([0.0; 2], [0.0; 2])).sigmas_m();
    assert!((p_m - stated_m).abs() < 1e-9);
}
