//! Effects on hull, actuators and water, by force balance.

use super::{CRUISE_RADPS, close, cruise, flown, quiet, with};
use hil_sim::scenario::Scenario;
use hil_sim::truth::{Actuators, Plant, State};
use hil_sim::world::World;

/// Quadratic surge drag of hull and four straight fins, N s²/m².
const DRAG: f64 = 3.0 + 4.0 * 0.5 * 1025.0 * 0.009 * 0.02;
/// Thrust at cruise, N.
const THRUST: f64 = 3e-4 * CRUISE_RADPS * CRUISE_RADPS;
/// A speed is steady to this, m/s: the rest of a transient with a time constant of 6 s, and rounding.
const STEADY: f64 = 1e-6;

/// Speed ahead after two minutes straight on.
fn steady_speed(scenario: &Scenario) -> f64 {
    flown(scenario, cruise([0.0; 4]), 120).last().state[6]
}

/// The positive root of a u² + b u = c.
fn root(a: f64, b: f64, c: f64) -> f64 {
    ((b * b + 4.0 * a * c).sqrt() - b) / (2.0 * a)
}

/// What an effect adds to the accelerations at a state, times the inertia: its wrench.
fn wrench(name: &str, values: &[(&str, f64)], state: &State, actuators: &Actuators) -> [f64; 6] {
    let acceleration = |scenario: &Scenario| {
        let physics = scenario.physics();
        Plant::with(&physics.vehicle, &physics.undeclared).acceleration(state, actuators)
    };
    let (clean, dirty) = (acceleration(&quiet()), acceleration(&with(quiet(), name, values)));
    let inertia = quiet().truth_parameters().inertia;
    core::array::from_fn(|i| inertia[i] * (dirty[i] - clean[i]))
}

fn level(velocity: [f64; 3], rates: [f64; 3]) -> State {
    State::new([0.0, 0.0, 10.0], [0.0; 3], velocity, rates)
}

#[test]
fn val_steady_speed_is_where_thrust_and_drag_balance() {
    close(steady_speed(&quiet()), (THRUST / DRAG).sqrt(), STEADY);
    let dragged = with(quiet(), "linear_drag", &[("surge_ns_per_m", 0.8)]);
    close(steady_speed(&dragged), root(DRAG, 0.8, THRUST), STEADY);
    let losing = with(quiet(), "thrust_loss", &[("k_n_s2_per_rad_m", 0.004)]);
    close(steady_speed(&losing), root(DRAG, 0.004 * CRUISE_RADPS, THRUST), STEADY);
    // Both add up.
    let both = with(dragged, "thrust_loss", &[("k_n_s2_per_rad_m", 0.004)]);
    close(steady_speed(&both), root(DRAG, 0.8 + 0.004 * CRUISE_RADPS, THRUST), STEADY);
}

#[test]
fn val_a_drag_change_acts_from_its_time_on() {
    let clean = flown(&quiet(), cruise([0.0; 4]), 120);
    let changed =
        flown(&with(quiet(), "drag_change", &[("surge_ns_per_m", 1.0), ("time_s", 40.0)]), cruise([0.0; 4]), 120);
    assert_eq!(clean.truth[4000].state, changed.truth[4000].state);
    assert!(changed.truth[4001].state[6] < clean.truth[4001].state[6]);
    close(changed.last().state[6], root(DRAG, 1.0, THRUST), 1e-4); // 80 s after the step
    let passing = [("surge_ns_per_m", 1.0), ("time_s", 40.0), ("until_s", 60.0)];
    let passed = flown(&with(quiet(), "drag_change", &passing), cruise([0.0; 4]), 140);
    assert_eq!(passed.truth[6000].state, changed.truth[6000].state);
    assert!(passed.truth[6001].state[6] > changed.truth[6001].state[6]);
    close(passed.last().state[6], (THRUST / DRAG).sqrt(), 1e-4); // 80 s after its end
}

#[test]
fn val_the_propeller_decays_by_the_hour() {
    let flown = flown(&with(quiet(), "thrust_decay", &[("per_hour", 0.3)]), cruise([0.0; 4]), 600);
    for truth in flown.truth.iter().step_by(5000).skip(1) {
        // The step that ends here began a step earlier.
        let begun_h = (truth.time_us as f64 * 1e-6 - 0.01) / 3600.0;
        close(truth.actuators.propeller_radps, CRUISE_RADPS * (1.0 - 0.3 * begun_h), 1e-9);
    }
}

#[test]
fn val_trims_turn_a_vehicle_at_rest_to_their_angle() {
    // A drifting body is damped by its fins alone: some minutes.
    let rest = |name, rad| {
        let mut scenario = with(quiet(), name, &[("rad", rad)]);
        scenario.settings.start.speed_mps = 0.0;
        *flown(&scenario, Actuators::default(), 300).truth.last().unwrap()
    };
    // Weight to starboard rolls to starboard; weight ahead puts the nose down.
    close(rest("roll_trim", 0.1).state[3], 0.1, 2e-3); // what is left of the swing
    close(rest("pitch_trim", 0.05).state[4], -0.05, 5e-3);
}

#[test]
fn val_buoyancy_and_density_by_weight() {
    let still = level([0.0; 3], [0.0; 3]);
    let lift = wrench("buoyancy_offset", &[("kg", 0.2)], &still, &Actuators::default());
    close(lift[2], -0.2 * 9.81, 1e-9);
    let salt = wrench("water_density", &[("offset_kg_per_m3", 5.0)], &still, &Actuators::default());
    // The added mass has grown as well: per thousand of the force.
    close(salt[2], -38.0 * 5.0 / 1025.0 * 9.81, 0.01);
    // Thrust and drag change alike.
    let neutral = |mut scenario: Scenario| {
        scenario.settings.start.speed_mps = 1.0;
        scenario
    };
    let ratio = 1.0 + 5.0 / 1025.0;
    let mut salty = with(neutral(quiet()), "water_density", &[("offset_kg_per_m3", 5.0)]);
    salty.vehicle.parameters.displaced_mass_kg /= ratio;
    close(steady_speed(&salty), (THRUST / DRAG).sqrt(), STEADY);
}

#[test]
fn val_cross_drag_and_its_moments() {
    let moving = level([1.0, -0.2, 0.15], [0.0, -0.1, 0.3]);
    let got = wrench("cross_drag", &[("d26", 8.0), ("d35", -6.0)], &moving, &Actuators::default());
    let expected = [0.0, -8.0 * 0.3 * 0.3, -6.0 * 0.1 * 0.1, 0.0, 6.0 * 0.15 * 0.15, 8.0 * 0.2 * 0.2];
    (0..6).for_each(|i| close(got[i], expected[i], 1e-9));
}

#[test]
fn val_fins_lag_stand_off_and_stick() {
    let command = [0.1, -0.1, 0.05, -0.05];
    let lagging = flown(&with(quiet(), "fin_lag", &[("s", 0.8)]), cruise(command), 2);
    // After one time constant, 1 − 1/e of the way.
    close(lagging.truth[80].actuators.fins_rad[0], 0.1 * (1.0 - (-1.0_f64).exp()), 1e-9);
    let biased = flown(&with(quiet(), "fin_bias", &[("fin", 3.0), ("rad", 0.02)]), cruise(command), 1);
    assert_eq!(biased.last().actuators.fins_rad, [0.1, -0.1, 0.07, -0.05]);
    let stuck = with(quiet(), "fin_stuck", &[("fin", 1.0), ("rad", -0.03), ("time_s", 1.0)]);
    let stuck = flown(&stuck, cruise(command), 2);
    assert_eq!(stuck.truth[100].actuators.fins_rad, command);
    assert_eq!(stuck.truth[101].actuators.fins_rad, [-0.03, -0.1, 0.05, -0.05]);
    let freed = with(quiet(), "fin_stuck", &[("fin", 1.0), ("rad", -0.03), ("time_s", 1.0), ("until_s", 1.5)]);
    let freed = flown(&freed, cruise(command), 2);
    assert_eq!(freed.truth[150].actuators.fins_rad, stuck.truth[150].actuators.fins_rad);
    assert_eq!(freed.truth[151].actuators.fins_rad, command);
    let slipped = with(quiet(), "fin_bias_change", &[("fin", 2.0), ("rad", 0.02), ("time_s", 1.0), ("until_s", 1.5)]);
    let slipped = flown(&slipped, cruise(command), 2);
    let bottom_at = |step: usize| slipped.truth[step].actuators.fins_rad[1];
    assert_eq!([100, 101, 150, 151].map(bottom_at), [-0.1, -0.08, -0.08, -0.1]);
}

#[test]
fn val_fins_with_play_that_drop_out_and_that_slip() {
    let fin = |name: &str, values: &[(&str, f64)], command: f64, seconds: u64| {
        let truth = *flown(&with(quiet(), name, values), cruise([command, 0.0, 0.0, 0.0]), seconds).last();
        (truth.actuators.fins_rad[0], truth)
    };
    // From rest it stops short of the command by its play; a command within the play does not move it.
    let play = [("fin", 1.0), ("rad", 0.03)];
    close(fin("servo_backlash", &play, 0.1, 1).0, 0.07, 1e-12);
    close(fin("servo_backlash", &play, 0.02, 1).0, 0.0, 1e-12);
    // Out for the first three of every four seconds.
    let dropout = [("fin", 1.0), ("share", 0.75), ("period_s", 4.0)];
    assert_eq!(fin("servo_dropout", &dropout, 0.1, 3).0, 0.0);
    close(fin("servo_dropout", &dropout, 0.1, 4).0, 0.1, 1e-12);
    let (angle, truth) = fin("fin_slip", &[("fin", 1.0), ("k_s2_per_m2", 0.5)], 0.1, 20);
    close(angle, 0.1 / (1.0 + 0.5 * truth.state[6].powi(2)), 1e-6); // the speed of a step before
}

#[test]
fn val_currents_carry_and_shear() {
    let drift = |scenario: &Scenario| {
        let truth = *flown(scenario, cruise([0.0; 4]), 20).last();
        let [_, _, _, _, _, psi, u, v, ..] = truth.state;
        let (sin, cos) = psi.sin_cos();
        let [north, east, _] = truth.velocity_ned_mps;
        ([north - cos * u + sin * v, east - sin * u - cos * v], truth)
    };
    let (c, _) = drift(&with(quiet(), "water_current", &[("north_mps", 0.2), ("east_mps", -0.1)]));
    close(c[0], 0.2, 1e-9); // level flight, no roll or pitch to speak of
    close(c[1], -0.1, 1e-9);
    let tide = [("amplitude_mps", 0.2), ("period_s", 1000.0), ("phase_rad", 0.3)];
    let (c, truth) = drift(&with(quiet(), "tidal_current", &tide));
    let angle = 0.3 + std::f64::consts::TAU * truth.time_us as f64 * 1e-9;
    close(c[0], 0.2 * angle.cos(), 1e-9);
    close(c[1], 0.2 * angle.sin(), 1e-9);
    let (c, truth) = drift(&with(quiet(), "current_shear", &[("north_mps_per_m", 0.01)]));
    close(c[0], 0.01 * truth.state[2], 1e-9);
}

#[test]
fn val_waves_shake_the_dvl_by_their_variance() {
    let waves = with(quiet(), "waves", &[("amplitude_mps", 0.2), ("period_s", 6.0)]);
    let mut world = World::new(&waves);
    world.set_actuator_targets(0, cruise([0.0; 4]));
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for time_us in (0..=1_800_000_000u64).step_by(500_000) {
        world.advance(time_us, &mut |_| {});
        let truth = world.truth();
        let [north, east] = truth.current_mps;
        sum[0] += north * north + east * east;
        sum[1] += truth.velocity_ned_mps[2].powi(2);
        count += 1.0;
    }
    // A² / 2 in the plane of propagation, as much down; the three trains beat, half an hour averages them to 3 %.
    close(sum[0] / count, 0.02, 1e-3);
    close(sum[1] / count, 0.02, 1e-3);
}

#[test]
fn val_effects_outside_the_catalogue_by_their_own_laws() {
    let going = level([1.0, 0.1, -0.2], [0.0; 3]);
    let driven = Actuators { propeller_radps: CRUISE_RADPS, fins_rad: [0.0; 4] };
    close(wrench("propeller_torque", &[("arm_m", 0.02)], &going, &driven)[3], -0.02 * THRUST, 1e-9);
    // Ten metres down; the hull is squeezed as at its centre of buoyancy, 1.5 cm above the centre of gravity.
    close(wrench("compressibility", &[("kg_per_m", -0.02)], &going, &driven)[2], 0.02 * (10.0 - 0.015) * 9.81, 1e-9);
    close(wrench("heave_surge", &[("n_s2_per_m2", 50.0)], &going, &driven)[0], -50.0 * 0.2 * 0.2, 1e-9);
    // More drag to starboard, less to port: against the positive axis either way.
    for v in [0.1, -0.1] {
        let sideways = level([1.0, v, 0.0], [0.0; 3]);
        close(wrench("sway_drag_asymmetry", &[("ratio", 0.5)], &sideways, &driven)[1], -0.5 * 170.0 * 0.01, 1e-9);
    }
    // The starboard fin's linear lift, ½ ρ A V² β3 α, up for a leading edge up.
    let raised = Actuators { propeller_radps: 0.0, fins_rad: [0.0, 0.0, 0.0, 0.1] };
    let straight = level([1.0, 0.0, 0.0], [0.0; 3]);
    let lift = 0.5 * 1025.0 * 0.009 * 3.1 * 0.1;
    let got = wrench("fin_lift", &[("fin", 4.0), ("ratio", -0.4)], &straight, &raised);
    close(got[2], 0.4 * lift, 1e-9);
    close(got[4], 0.85 * 0.4 * lift, 1e-9);
}
