//! Sensors that sit, point and lag: against closed forms.

use super::{close, cruise, flown, quiet, with};
use hil_sim::observation::ObservationKind;
use hil_sim::scenario::{Installation, Scenario};
use std::f64::consts::FRAC_PI_2;

/// A turn to starboard with pitch and roll.
const TURN: [f64; 4] = [0.08, -0.06, 0.03, -0.02];
/// Rounding of sums and products of order one.
const ROUNDING: f64 = 1e-12;

fn installed(installation: Installation) -> Scenario {
    let mut scenario = quiet();
    scenario.settings.installation = installation;
    scenario
}

#[test]
fn val_a_dvl_on_its_arm_and_across_measures_late_what_its_place_did() {
    let (arm, late_us) = ([0.4, 0.1, 0.2], 200_000);
    let flown = flown(
        &installed(Installation {
            dvl_arm_m: arm,
            dvl_turn_rad: [0.0, 0.0, FRAC_PI_2],
            dvl_delay_s: 0.2,
            ..Installation::default()
        }),
        cruise(TURN),
        60,
    );
    let mut seen = 0;
    for observation in &flown.observations {
        let ObservationKind::Dvl { velocity_mps: Some([ahead, aside, down]), .. } = observation.kind else { continue };
        let truth = flown.at(observation.time_us - late_us);
        let ([u, v, w], [.., p, q, r]) = (truth.velocity_over_ground_mps, truth.state);
        let [x, y, z] = arm;
        let [u, v, w] = [u + q * z - r * y, v + r * x - p * z, w + p * y - q * x];
        // its forward axis points to starboard
        close(ahead, v, ROUNDING);
        close(aside, -u, ROUNDING);
        close(down, w, ROUNDING);
        seen += 1;
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn an_undeclared_place_or_delay_is_that_of_a_sensor_mounted_there() {
    type Effect = (&'static str, &'static [(&'static str, f64)]);
    let cases: [(Effect, Installation); 4] = [
        (
            ("gnss_lever_arm", &[("x_m", -0.6), ("y_m", 0.2)]),
            Installation { gnss_arm_m: [-0.6, 0.2, 0.0], ..Installation::default() },
        ),
        (
            ("dvl_lever_arm", &[("x_m", 0.4), ("y_m", -0.3), ("z_m", 0.2)]),
            Installation { dvl_arm_m: [0.4, -0.3, 0.2], ..Installation::default() },
        ),
        (
            ("transducer_lever_arm", &[("x_m", 1.0), ("z_m", -0.5)]),
            Installation { transducer_arm_m: [1.0, 0.0, -0.5], ..Installation::default() },
        ),
        (("dvl_delay", &[("s", 0.3)]), Installation { dvl_delay_s: 0.3, ..Installation::default() }),
    ];
    for ((name, values), installation) in cases {
        // Near the surface, where there are fixes, and long enough for some ranges.
        let observed = |mut scenario: Scenario| {
            scenario.settings.start.depth_m = 0.1;
            flown(&scenario, cruise([0.08, -0.06, 0.0, 0.0]), 120).observations
        };
        let mounted = observed(installed(installation));
        let undeclared = observed(with(quiet(), name, values));
        assert!(mounted == undeclared, "{name}");
        assert!(mounted != observed(quiet()), "{name}");
    }
}

#[test]
fn val_late_inputs_move_the_vehicle_later_and_in_the_same_way() {
    let (plain, late) = (quiet(), with(quiet(), "input_delay", &[("s", 0.5)]));
    let [plain, late] = [plain, late].map(|scenario| flown(&scenario, cruise(TURN), 20).truth);
    // Half a second of coasting first, which costs 4 % of the speed; from then on the same motion but for that.
    let yaw_rate = |truth: &[hil_sim::truth::VehicleTruth], step: usize| truth[step].state[11];
    assert_eq!(yaw_rate(&late, 49), 0.0);
    for step in [100, 300, 500] {
        close(yaw_rate(&late, step + 50), yaw_rate(&plain, step), 0.1 * yaw_rate(&plain, 500).abs());
    }
}

#[test]
fn val_a_thrust_curve_has_a_dead_band_a_slope_and_a_top() {
    let speed = |share: f64| {
        let mut scenario = with(quiet(), "thrust_curve", &[("dead_band", 0.2), ("slope_n", 12.0), ("saturation", 0.7)]);
        scenario.settings.start.speed_mps = 0.2;
        let most = scenario.truth_parameters().propeller_max_radps;
        let mut targets = cruise([0.0; 4]);
        targets.propeller_radps = share * most;
        flown(&scenario, targets, 200).last().state[6]
    };
    assert!(speed(0.15) < 0.1);
    assert_eq!(speed(0.7), speed(1.0));
    // Steady: thrust is drag, in proportion to the square of the speed.
    let [slow, fast] = [0.3, 0.6].map(speed);
    close((fast / slow).powi(2), (0.6 - 0.2) / (0.3 - 0.2), 0.02);
}

#[test]
fn val_a_depth_scale_grows_with_depth() {
    let flown = flown(&with(quiet(), "depth_scale", &[("ratio", 0.05)]), cruise(TURN), 30);
    let mut seen = 0;
    for observation in &flown.observations {
        if let ObservationKind::Depth { depth_m } = observation.kind {
            close(depth_m, 1.05 * flown.at(observation.time_us).state[2], 1e-12);
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn val_an_ahrs_across_rolls_when_the_vehicle_pitches() {
    let installation =
        Installation { ahrs_turn_rad: [0.0, 0.0, FRAC_PI_2], ahrs_delay_s: 0.1, ..Installation::default() };
    let flown = flown(&installed(installation), cruise(TURN), 60);
    assert!(flown.ahrs().count() > 100);
    for observation in &flown.observations {
        let ObservationKind::Ahrs { euler_rad: [roll, pitch, heading], rates_radps } = observation.kind else {
            continue;
        };
        let [_, _, _, phi, theta, psi, _, _, _, p, q, r] = flown.at(observation.time_us - 100_000).state;
        // The direction of gravity in its axes, and its forward axis, which points to starboard, in the horizontal.
        close(-pitch.sin(), theta.cos() * phi.sin(), ROUNDING);
        close(pitch.cos() * roll.sin(), theta.sin(), ROUNDING);
        close(pitch.cos() * heading.sin(), phi.sin() * theta.sin() * psi.sin() + phi.cos() * psi.cos(), ROUNDING);
        [q, -p, r].iter().zip(rates_radps).for_each(|(truth, rate)| close(rate, *truth, ROUNDING));
    }
}

#[test]
fn val_depth_and_fix_are_those_of_sensor_and_antenna() {
    let (depth_arm, gnss_arm) = ([0.5, -0.1, 0.3], [-0.6, 0.2, -0.1]);
    let mut scenario = installed(Installation {
        depth_arm_m: depth_arm,
        depth_delay_s: 0.3,
        gnss_arm_m: gnss_arm,
        gnss_delay_s: 0.5,
        ..Installation::default()
    });
    scenario.settings.start.depth_m = 0.1;
    scenario.settings.sensors.gnss.sigma_m = Some(0.0);
    let flown = flown(&scenario, cruise([0.08, -0.06, 0.0, 0.0]), 30);
    let (mut depths, mut fixes) = (0, 0);
    for observation in &flown.observations {
        match observation.kind {
            ObservationKind::Depth { depth_m } => {
                let [_, _, z, phi, theta, ..] = flown.at(observation.time_us - 300_000).state;
                let [x, y, below] = depth_arm;
                let level = theta.cos() * (phi.sin() * y + phi.cos() * below) - theta.sin() * x;
                close(depth_m, z + level, ROUNDING);
                depths += 1;
            }
            ObservationKind::VehicleGnss { fix: Some(fix) } => {
                assert_eq!(fix.time_us, observation.time_us - 500_000);
                let [x, y, _, phi, theta, psi, ..] = flown.at(fix.time_us).state;
                let [a, b, c] = gnss_arm;
                let ahead = theta.cos() * a + theta.sin() * (phi.sin() * b + phi.cos() * c);
                let aside = phi.cos() * b - phi.sin() * c;
                close(fix.position_m[0], x + psi.cos() * ahead - psi.sin() * aside, 1e-10);
                close(fix.position_m[1], y + psi.sin() * ahead + psi.cos() * aside, 1e-10);
                fixes += 1;
            }
            _ => {}
        }
    }
    assert!(depths > 100 && fixes > 10, "{depths} {fixes}");
}

#[test]
fn val_ranges_end_at_the_transducer_and_carry_its_delay() {
    let ranges = |installation| {
        let mut scenario = installed(installation);
        scenario.settings.start.depth_m = 50.0;
        let flown = flown(&scenario, cruise([0.0; 4]), 400);
        let at = |t: f64| flown.at((t * 1e6) as u64).state[2];
        flown.ranges().into_iter().map(|(t, range)| (range, at(t))).collect::<Vec<_>>()
    };
    let clean = ranges(Installation::default());
    assert!(clean.len() > 10);
    let late = ranges(Installation { transducer_delay_s: 0.004, ..Installation::default() });
    clean.iter().zip(&late).for_each(|((clean, _), (late, _))| close(late - clean, 1500.0 * 0.004, 1e-9));
    let below = ranges(Installation { transducer_arm_m: [0.0, 0.0, 10.0], ..Installation::default() });
    for ((clean, z), (below, _)) in clean.iter().zip(&below) {
        // The ship's transducer is at the surface. The sound arrives up to 2 ms later, in which the vehicle moves 2 mm.
        close(*below, (clean * clean - z * z + (z + 10.0).powi(2)).sqrt(), 2e-2);
    }
}
