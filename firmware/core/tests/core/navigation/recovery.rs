//! The gate: outliers stay out, what contradicts the filter is suspect, and both kinds of error come right: a source
//! that lies, and a filter that is wrong.

use super::support::*;
use backseat_core::navigation::*;

/// A vehicle on its way, and a filter with the sensors that are switched on.
struct RecoveryFlight {
    truth: Truth,
    config: NavigationConfig,
    navigator: Box<Navigator>,
    noise: Noise,
    second: u64,
    /// Added to what the ship says of itself, m.
    ship_error_m: [f64; 2],
    /// Added to the heading that the compass says, rad.
    heading_error_rad: f64,
    /// Added to the pitch that the AHRS says, rad.
    pitch_error_rad: f64,
    /// Added to what the DVL says, m/s; `None`: no DVL.
    dvl_error_mps: Option<f64>,
    /// Longest time in a row during which nothing was suspect or unconfirmed, √(σx² + σy²) below 30 m (so that the app
    /// would call it navigating), and the position wrong by more than three of its own sigmas, s.
    dishonest_s: u64,
    dishonest_now_s: u64,
}

impl RecoveryFlight {
    fn new(seed: u64, offset_m: [f64; 2], current: [f64; 2]) -> Self {
        Self::of(NavigationConfig::REFERENCE, seed, offset_m, current)
    }

    fn robust(seed: u64) -> Self {
        let mut config = NavigationConfig::REFERENCE;
        config.make_robust();
        Self::of(config, seed, [0.0; 2], [0.0; 2])
    }

    fn of(config: NavigationConfig, seed: u64, offset_m: [f64; 2], current: [f64; 2]) -> Self {
        let config = NavigationConfig { surface: None, ..config };
        let mut navigator = navigator(&config);
        let initial = initial();
        let truth = Truth::new(initial.state, current, [0.0; 4]);
        let mut wrong = initial;
        wrong.state[0] += offset_m[0];
        wrong.state[1] += offset_m[1];
        navigator.initialise(0, &wrong).unwrap();
        let noise = Noise(seed);
        Self {
            truth,
            config,
            navigator,
            noise,
            second: 0,
            ship_error_m: [0.0; 2],
            heading_error_rad: 0.0,
            pitch_error_rad: 0.0,
            dvl_error_mps: None,
            dishonest_s: 0,
            dishonest_now_s: 0,
        }
    }

    /// A second: depth, attitude, rates (and a DVL) ten times.
    fn fly(&mut self) {
        self.second += 1;
        for step in 1..=10 {
            for _ in 0..10 {
                self.truth.tick(&CRUISE, &self.config, &mut self.noise);
            }
            let time_us = (self.second - 1) * 1_000_000 + step * 100_000;
            self.navigator.predict(time_us, &CRUISE).unwrap();
            let (x, sensors, noise) = (&self.truth.x, &self.config.sensors, &mut self.noise);
            self.navigator.fuse(&Measurement::Depth { z_m: x[2] + sensors.depth_m * noise.normal() });
            let mean = [x[3], x[4] + self.pitch_error_rad, x[5] + self.heading_error_rad];
            let euler_rad = noise.normals(mean, sensors.attitude_rad);
            self.navigator.fuse(&Measurement::Attitude { euler_rad });
            let rates_radps = noise.normals([x[9], x[10], x[11]], sensors.rates_radps);
            self.navigator.fuse(&Measurement::Rates { rates_radps });
            if let Some(error_mps) = self.dvl_error_mps {
                let velocity_mps = noise.normals([x[6] + error_mps, x[7], x[8]], sensors.dvl_mps);
                self.navigator.fuse(&Measurement::BottomTrack { velocity_mps });
            }
        }
        let unconfirmed = Sensor::ALL.into_iter().any(|sensor| self.navigator.main().unconfirmed_sigma(sensor) > 0.0);
        let healthy = !self.suspect() && !unconfirmed && self.navigator.horizontal_sigma_m() < 30.0;
        self.dishonest_now_s = if healthy && self.sigmas() > 3.0 { self.dishonest_now_s + 1 } else { 0 };
        self.dishonest_s = self.dishonest_s.max(self.dishonest_now_s);
    }

    fn run(&mut self, seconds: u64) {
        (0..seconds).for_each(|_| self.fly());
    }

    /// Half a minute and a range from a ship on a circle around the vehicle; whether it was used.
    fn range(&mut self, error_m: f64) -> bool {
        self.run(30);
        let angle = self.second as f64 / 300.0;
        let (x, y) = (self.truth.x[0], self.truth.x[1]);
        let ship = [x + 600.0 * angle.cos(), y + 600.0 * angle.sin()];
        let range_m = (x - ship[0]).hypot(y - ship[1]).hypot(self.truth.x[2]) + error_m + self.noise.normal();
        let path = reported(still([ship[0] + self.ship_error_m[0], ship[1] + self.ship_error_m[1]], [0.5, 0.1]));
        used(&self.navigator.fuse(&Measurement::Range { path, range_m }))
    }

    fn ranges(&mut self, count: u64) -> u64 {
        (0..count).map(|_| u64::from(self.range(0.0))).sum()
    }

    fn fix(&mut self, error_m: [f64; 2]) -> bool {
        self.run(1);
        let mean = [self.truth.x[0] + error_m[0], self.truth.x[1] + error_m[1]];
        let position_m = self.noise.normals(mean, 1.5);
        used(&self.navigator.fuse(&Measurement::VehicleGnss { position_m }))
    }

    fn suspect(&self) -> bool {
        Sensor::ALL.into_iter().any(|sensor| self.navigator.main().is_suspect(sensor))
    }

    fn error_m(&self) -> f64 {
        let x = self.navigator.state();
        (x[0] - self.truth.x[0]).hypot(x[1] - self.truth.x[1])
    }

    /// Horizontal error in own sigmas: √(eᵀ P⁻¹ e).
    fn sigmas(&self) -> f64 {
        let (navigator, x) = (&self.navigator, self.navigator.state());
        let error = [x[0] - self.truth.x[0], x[1] - self.truth.x[1]];
        let [xx, xy, yy] = [(0, 0), (0, 1), (1, 1)].map(|(i, j)| navigator.covariance(i, j));
        nees_position(error, xx, xy, yy).unwrap().sqrt()
    }
}

fn used(fusions: &Fusions) -> bool {
    fusions.iter().all(|record| record.outcome == FusionOutcome::Fused)
}

#[test]
fn a_filter_that_is_wrong_is_pulled_in_by_good_ranges() {
    // 120 m off: an outage of twenty minutes in a current of 0.1 m/s that is not declared
    let mut flight = RecoveryFlight::new(1, [-72.0, 96.0], [0.0; 2]);
    let mut rejected = 0;
    while !flight.range(0.0) {
        rejected += 1;
        assert_eq!(flight.suspect(), rejected >= 3, "three in a row");
        // 120 m are three sigmas after 270 s of suspicion, and three ranges have to agree
        assert!(rejected < 20, "not for ever");
    }
    assert!(rejected >= 6, "not at once: {rejected}");
    assert_eq!(flight.navigator.main().recoveries(Sensor::Range), 1);
    flight.ranges(20);
    // The position is that of the ranges: across the line of sight the suspicion that goes on leaves some 10 m. The
    // covariance covers the other position too.
    assert!(flight.error_m() < 27.0, "{}", flight.error_m());
    let unconfirmed_m = flight.navigator.main().unconfirmed_sigma(Sensor::Range);
    assert!((25.0..50.0).contains(&unconfirmed_m), "two fifths of what was seen of 120 m: {unconfirmed_m}");
    assert!(flight.navigator.horizontal_sigma_m() > unconfirmed_m);
    // A fix settles it.
    assert!(flight.fix([0.0; 2]));
    assert_eq!(flight.navigator.main().unconfirmed_sigma(Sensor::Range), 0.0);
    flight.ranges(10);
    assert!(flight.error_m() < 3.0 && flight.navigator.horizontal_sigma_m() < 3.0);
}

#[test]
fn a_ship_that_is_wrong_by_half_a_kilometre_is_never_believed_without_saying_so() {
    let mut flight = RecoveryFlight::new(2, [0.0; 2], [0.0; 2]);
    flight.ranges(20);
    assert!(flight.error_m() < 5.0);
    flight.ship_error_m = [300.0, -400.0];
    flight.ranges(60);
    // Whatever became of it: not called navigating beyond three sigmas, but for the time that three ranges take.
    assert!(flight.dishonest_s <= 90, "{} s", flight.dishonest_s);
    assert!(flight.sigmas() < 3.0, "{} m are {} sigmas", flight.error_m(), flight.sigmas());
    flight.ship_error_m = [0.0; 2];
    assert!(flight.fix([0.0; 2]), "the fix is consistent with what is believed");
    flight.ranges(10);
    assert!(flight.error_m() < 3.0 && flight.navigator.horizontal_sigma_m() < 3.0);
}

#[test]
fn a_dvl_contradicts_a_ship_that_lies() {
    let mut flight = RecoveryFlight::new(3, [0.0; 2], [0.0; 2]);
    flight.dvl_error_mps = Some(0.0);
    flight.ranges(10);
    flight.ship_error_m = [300.0, -400.0];
    let used = flight.ranges(30);
    // those whose line of sight is across the lie
    assert!(used <= 8, "{used} in a quarter of an hour");
    assert!(flight.error_m() < 30.0 && flight.sigmas() < 3.0, "{} m, {} sigmas", flight.error_m(), flight.sigmas());
}

#[test]
fn multipath_is_borne() {
    let mut flight = RecoveryFlight::new(4, [0.0; 2], [0.0; 2]);
    let mut largest = 0.0_f64;
    for _ in 0..200 {
        let late = flight.noise.uniform() < 0.3;
        let error_m = if late { 300.0 * flight.noise.uniform() } else { 0.0 };
        flight.range(error_m);
        largest = largest.max(flight.error_m());
    }
    // those below the gate pull by metres, three of them within a suspicion by some ten
    assert!(largest < 40.0 && flight.dishonest_s < 120, "{largest} m, {} s", flight.dishonest_s);
}

#[test]
fn an_undeclared_current_is_not_navigated_through_in_silence() {
    let mut flight = RecoveryFlight::new(5, [0.0; 2], [0.12, 0.09]);
    flight.ranges(100);
    assert!(flight.dishonest_s <= 120, "{} s", flight.dishonest_s);
    // it displaces the estimate by 4.5 m between two ranges
    assert!(flight.error_m() < 40.0, "{} m", flight.error_m());
}

#[test]
fn a_fix_that_leaps_is_not_believed_at_once() {
    let mut flight = RecoveryFlight::new(6, [0.0; 2], [0.0; 2]);
    for second in 0..60 {
        assert!(flight.fix([0.0; 2]), "{second}");
    }
    for second in 0..60 {
        assert!(!flight.fix([200.0, 0.0]), "{second}");
        assert_eq!(flight.suspect(), second >= 2, "{second}");
    }
    assert!(flight.error_m() < 5.0);
    for _ in 0..3 {
        assert!(flight.fix([0.0; 2]), "and the right one comes back at once");
    }
    assert!(!flight.suspect());
}

#[test]
fn surfaced_fixes_pull_a_lost_filter_in() {
    let mut flight = RecoveryFlight::new(7, [60.0, -80.0], [0.0; 2]);
    let mut rejected = 0;
    while !flight.fix([0.0; 2]) {
        rejected += 1;
    }
    // 100 m are three sigmas of 0.5 m/s after 66 s
    assert!((50..80).contains(&rejected), "{rejected}");
    assert!(flight.error_m() < 6.0 && flight.sigmas() < 3.7);
    for _ in 0..20 {
        flight.fix([0.0; 2]);
    }
    assert!(flight.error_m() < 3.0 && flight.navigator.horizontal_sigma_m() < 2.0);
    assert_eq!((flight.suspect(), flight.navigator.main().unconfirmed_sigma(Sensor::VehicleGnss)), (false, 0.0));
}

#[test]
fn a_false_bottom_lock_is_suspect_and_forgotten() {
    let mut flight = RecoveryFlight::new(8, [0.0; 2], [0.0; 2]);
    flight.dvl_error_mps = Some(0.0);
    flight.run(60);
    flight.dvl_error_mps = Some(-0.8);
    flight.run(3);
    assert!(flight.navigator.main().is_suspect(Sensor::BottomTrack));
    flight.run(17);
    assert!((flight.navigator.state()[6] - flight.truth.x[6]).abs() < 0.1, "the model knows better");
    flight.dvl_error_mps = Some(0.0);
    flight.run(10);
    assert!(flight.navigator.main().is_suspect(Sensor::BottomTrack), "it has to agree for as long as it contradicted");
    flight.run(10);
    assert!(!flight.suspect() && flight.navigator.main().unconfirmed_sigma(Sensor::BottomTrack) == 0.0);
}

/// In a turn the vehicle is as slow as a wrong DVL says, for ten seconds.
#[test]
fn a_false_bottom_lock_that_the_vehicle_crosses_stays_out() {
    let mut flight = RecoveryFlight::new(16, [0.0; 2], [0.0; 2]);
    flight.dvl_error_mps = Some(0.0);
    flight.run(60);
    for (error_mps, seconds) in [(-0.8, 60), (0.0, 10), (-0.8, 60)] {
        flight.dvl_error_mps = Some(error_mps);
        flight.run(seconds);
    }
    assert!(flight.navigator.main().is_suspect(Sensor::BottomTrack));
    assert_eq!(flight.navigator.main().recoveries(Sensor::BottomTrack), 0);
}

#[test]
fn a_bottom_lock_that_stays_false_is_not_navigated_by_in_silence() {
    let mut flight = RecoveryFlight::new(9, [0.0; 2], [0.0; 2]);
    flight.dvl_error_mps = Some(0.0);
    flight.ranges(4);
    flight.dvl_error_mps = Some(-0.8);
    flight.run(600);
    assert!(flight.dishonest_s <= 120, "{} s", flight.dishonest_s);
}

#[test]
fn a_suspect_source_that_falls_silent_stays_unconfirmed() {
    let mut flight = RecoveryFlight::new(10, [0.0; 2], [0.0; 2]);
    flight.ranges(10);
    for _ in 0..3 {
        assert!(!flight.range(90.0));
    }
    assert!(flight.suspect());
    flight.run(301);
    assert!(!flight.suspect(), "there is nothing left to suspicion");
    let unconfirmed_m = flight.navigator.main().unconfirmed_sigma(Sensor::Range);
    assert!((34.0..38.0).contains(&unconfirmed_m), "two fifths of 90 m: {unconfirmed_m}");
    assert!(flight.navigator.horizontal_sigma_m() >= unconfirmed_m);
}

#[test]
fn outliers_that_disagree_never_come_in() {
    let mut flight = RecoveryFlight::new(11, [0.0; 2], [0.0; 2]);
    for second in 0..120 {
        let (angle, away) = (6.3 * flight.noise.uniform(), 400.0 + 2000.0 * flight.noise.uniform());
        assert!(!flight.fix([away * f64::cos(angle), away * f64::sin(angle)]), "{second}");
    }
    assert_eq!(flight.navigator.main().recoveries(Sensor::VehicleGnss), 0);
    assert!(flight.suspect());
}

#[test]
fn what_is_absurd_is_not_believed_however_steady() {
    let mut flight = RecoveryFlight::new(12, [0.0; 2], [0.0; 2]);
    for _ in 0..60 {
        flight.run(1);
        for position_m in [[1e300, 0.0], [1e9, 1e9]] {
            let before = flight.navigator.digest();
            assert!(!used(&flight.navigator.fuse(&Measurement::VehicleGnss { position_m })));
            assert_eq!(flight.navigator.digest(), before);
        }
        flight.navigator.fuse(&Measurement::Depth { z_m: 1e12 });
    }
    assert_eq!(Sensor::ALL.map(|sensor| flight.navigator.main().recoveries(sensor)), [0; Sensor::ALL.len()]);
}

#[test]
fn one_bad_axis_keeps_the_others_out() {
    let mut navigator = started(&NavigationConfig::REFERENCE);
    let before = navigator.digest();
    let fusions = navigator.fuse(&Measurement::BottomTrack { velocity_mps: [1.0, 0.0, 3.0] });
    assert_eq!(fusions.iter().count(), 3);
    assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Gated));
    let ratios: Vec<bool> = fusions.iter().map(|record| record.test_ratio > 1.0).collect();
    assert_eq!(ratios, [false, false, true]);
    assert_eq!(navigator.digest(), before);
}

/// Half an hour in still water has made the filter sure of its current. One of 0.15 m/s then sets in.
#[test]
fn a_current_that_sets_in_is_learnt_from_the_ranges_that_contradict() {
    let mut flight = RecoveryFlight::robust(13);
    flight.ranges(60);
    flight.truth.current = [0.12, 0.09];
    flight.ranges(20);
    let [north, east] = flight.navigator.current();
    assert!((north - 0.12).hypot(east - 0.09) < 0.03, "{north} {east}");
    assert_eq!(flight.navigator.main().recoveries(Sensor::Range), 1);
    // half a minute of the old current would be 4.5 m
    assert!(flight.error_m() < 4.0, "{} m", flight.error_m());
    assert!(flight.dishonest_s <= 120, "{} s", flight.dishonest_s);
}

/// The compass is off by 23 degrees for two minutes. Ranges see it where the line of sight is along the error.
#[test]
fn ranges_that_agree_while_the_line_of_sight_turns_confirm_a_compass() {
    let mut flight = RecoveryFlight::new(14, [0.0; 2], [0.0; 2]);
    flight.ranges(10);
    flight.heading_error_rad = 0.4;
    flight.run(120);
    flight.heading_error_rad = 0.0;
    flight.run(60);
    assert!(flight.navigator.main().unconfirmed_sigma(Sensor::Attitude) > 0.1 && !flight.suspect());
    flight.ranges(30);
    assert!(flight.navigator.main().unconfirmed_sigma(Sensor::Attitude) > 0.1, "not within a quarter of an hour");
    flight.ranges(10);
    assert_eq!(flight.navigator.main().unconfirmed_sigma(Sensor::Attitude), 0.0);
    assert!(flight.error_m() < 5.0 && flight.sigmas() < 3.7, "{} m", flight.error_m());
}

#[test]
fn ranges_do_not_confirm_a_compass_that_stays_wrong() {
    let mut flight = RecoveryFlight::new(15, [0.0; 2], [0.0; 2]);
    flight.ranges(10);
    flight.heading_error_rad = 0.4;
    flight.ranges(60);
    assert!(flight.navigator.main().unconfirmed_sigma(Sensor::Attitude) > 0.1);
    assert!(flight.dishonest_s <= 120, "{} s", flight.dishonest_s);
}

/// Pitch or heading contradicts the filter for two minutes and agrees again, deep or where the model does not hold.
#[test]
fn a_pitch_that_contradicts_at_the_surface_leaves_no_doubt() {
    for (surfaced, pitch_rad, heading_rad, doubted) in
        [(false, 0.4, 0.0, true), (true, 0.4, 0.0, false), (true, 0.0, 0.4, true), (true, 0.4, 0.4, true)]
    {
        let mut flight = RecoveryFlight::new(16, [0.0; 2], [0.0; 2]);
        flight.ranges(2);
        let noise = flight.config.process_noise;
        let surface = surfaced.then_some(SurfaceNoise { depth_m: 50.0, noise });
        flight.navigator.reconfigure(&NavigationConfig { surface, ..flight.config }).unwrap();
        (flight.pitch_error_rad, flight.heading_error_rad) = (pitch_rad, heading_rad);
        flight.run(120);
        (flight.pitch_error_rad, flight.heading_error_rad) = (0.0, 0.0);
        flight.run(60);
        assert!(!flight.suspect() && flight.navigator.main().recoveries(Sensor::Attitude) > 0);
        let sigma = flight.navigator.main().unconfirmed_sigma(Sensor::Attitude);
        assert_eq!(sigma > 0.0, doubted, "{surfaced} {pitch_rad} {heading_rad}: {sigma}");
    }
}
