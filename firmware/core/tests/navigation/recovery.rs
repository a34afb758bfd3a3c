//! The gate: outliers stay out, a filter that is wrong lets the truth in again.

use super::support::*;
use backseat_core::navigation::*;

fn started(offset_m: [f64; 2]) -> Box<Navigator> {
    let mut navigator = navigator(&NavigationConfig::REFERENCE);
    let mut initial = initial();
    initial.state[0] += offset_m[0];
    initial.state[1] += offset_m[1];
    initial.state[5] = 0.0;
    navigator.initialise(0, &initial).unwrap();
    navigator
}

fn keep_attitude(navigator: &mut Navigator) {
    navigator.fuse(&Measurement::Attitude { euler_rad: [0.0, -0.036, 0.0] });
    navigator.fuse(&Measurement::Depth { z_m: 3.0 });
}

#[test]
fn surfaced_fixes_pull_a_lost_filter_in() {
    let mut navigator = started([60.0, -80.0]);
    let mut noise = Noise(3);
    let (mut rejected, mut back_s) = (0, 0);
    for second in 1..=60_u64 {
        navigator.predict(second * 1_000_000, &CRUISE).unwrap();
        keep_attitude(&mut navigator);
        let fix = noise.normals([second as f64, 0.0], 1.5);
        let fusions = navigator.fuse(&Measurement::VehicleGnss { position_m: fix });
        if fusions.iter().all(|record| record.outcome == FusionOutcome::Gated) {
            rejected += 1;
            assert_eq!(navigator.consecutive_rejections(Sensor::VehicleGnss), rejected);
        } else if back_s == 0 {
            back_s = second;
            let error = [navigator.state()[0] - second as f64, navigator.state()[1]];
            let (xx, xy, yy) = (navigator.variance(0), navigator.covariance(0, 1), navigator.variance(1));
            // Pulled in at once, and honest about it: 99.9 % of two degrees of freedom.
            assert!(nees_position(error, xx, xy, yy).unwrap() < 13.8);
        }
    }
    // Ten seconds of agreement and no more.
    assert_eq!((back_s, rejected), (11, 10));
    assert_eq!(navigator.recoveries(Sensor::VehicleGnss), 1);
    assert_eq!(navigator.consecutive_rejections(Sensor::VehicleGnss), 0);
    let error = (navigator.state()[0] - 60.0).hypot(navigator.state()[1]);
    assert!(error < 3.0 && navigator.horizontal_sigma_m() < 2.0, "{error}");
    assert!(navigator.failure().is_none());
}

#[test]
fn ranges_pull_a_lost_filter_in() {
    let mut navigator = started([120.0, 90.0]);
    let mut noise = Noise(4);
    for k in 1..=20_u64 {
        for part in 1..=30 {
            navigator.predict((k - 1) * 30_000_000 + part * 1_000_000, &CRUISE).unwrap();
            keep_attitude(&mut navigator);
        }
        let angle = 0.1 * k as f64;
        let (x, ship) = (30.0 * k as f64, [600.0 * angle.cos() + 900.0, 600.0 * angle.sin()]);
        let range = (x - ship[0]).hypot(ship[1]).hypot(3.0);
        let report =
            ShipReport { position_m: ship, velocity_mps: [0.0; 2], position_sigma_m: 0.5, velocity_sigma_mps: 0.1 };
        let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(report) };
        navigator.fuse(&Measurement::Range { path, range_m: range + noise.normal() });
    }
    assert!(navigator.recoveries(Sensor::Range) >= 1);
    let error = (navigator.state()[0] - 600.0).hypot(navigator.state()[1]);
    // Within four of its own DRMS, which is a metre again fifteen packets later.
    assert!(error < 4.0 * navigator.horizontal_sigma_m() && error < 4.0, "{error}");
}

#[test]
fn outliers_that_disagree_never_come_in() {
    let mut navigator = started([0.0, 0.0]);
    let mut noise = Noise(6);
    for second in 1..=300_u64 {
        navigator.predict(second * 1_000_000, &CRUISE).unwrap();
        keep_attitude(&mut navigator);
        let angle = 6.3 * noise.uniform();
        let away = 100.0 + 2000.0 * noise.uniform();
        let position_m = [second as f64 + away * angle.cos(), away * angle.sin()];
        let fusions = navigator.fuse(&Measurement::VehicleGnss { position_m });
        assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Gated && record.test_ratio > 0.0));
    }
    assert_eq!(navigator.recoveries(Sensor::VehicleGnss), 0);
    assert_eq!(navigator.consecutive_rejections(Sensor::VehicleGnss), 300);
}

#[test]
fn what_is_absurd_is_not_believed_however_steady() {
    let mut navigator = started([0.0, 0.0]);
    for second in 1..=60_u64 {
        navigator.predict(second * 1_000_000, &CRUISE).unwrap();
        for position_m in [[1e300, 0.0], [1e9, 1e9]] {
            let before = navigator.digest();
            assert!(
                navigator
                    .fuse(&Measurement::VehicleGnss { position_m })
                    .iter()
                    .all(|r| r.outcome == FusionOutcome::Gated)
            );
            assert_eq!(navigator.digest(), before);
        }
        navigator.fuse(&Measurement::Depth { z_m: 1e12 });
    }
    assert_eq!(Sensor::ALL.map(|sensor| navigator.recoveries(sensor)), [0; 9]);
}

#[test]
fn one_bad_axis_keeps_the_others_out() {
    let mut navigator = started([0.0, 0.0]);
    let before = navigator.digest();
    let fusions = navigator.fuse(&Measurement::BottomTrack { velocity_mps: [1.0, 0.0, 3.0] });
    assert_eq!(fusions.iter().count(), 3);
    assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Gated));
    let ratios: Vec<bool> = fusions.iter().map(|record| record.test_ratio > 1.0).collect();
    assert_eq!(ratios, [false, false, true]);
    assert_eq!(navigator.digest(), before);
}
