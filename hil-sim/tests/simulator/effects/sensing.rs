//! Errors of instruments and acoustics: the flight is the same, what is measured is not.

use super::{ObservedFlight, close, cruise, flown, quiet, with};
use hil_sim::noise::NoiseKind;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A turn to starboard with a little pitch: every heading within two minutes.
const TURN: [f64; 4] = [0.08, -0.08, 0.02, -0.02];

/// One effect alone, in a turn.
fn turned(name: &str, values: &[(&str, f64)]) -> ObservedFlight {
    flown(&with(quiet(), name, values), cruise(TURN), 120)
}

#[test]
fn val_compass_errors_follow_the_true_heading() {
    let hard = turned("heading_bias", &[("const_rad", 0.01), ("sin_rad", -0.02), ("cos_rad", 0.03)]);
    let soft = turned("soft_iron", &[("sin2_rad", 0.02), ("cos2_rad", -0.01)]);
    let mut quadrants = [false; 4];
    for (truth, [_, _, heading], _) in hard.ahrs() {
        let psi = truth.state[5];
        quadrants[(psi.rem_euclid(TAU) / FRAC_PI_2) as usize] = true;
        let error = libm::remainder(heading - psi, std::f64::consts::TAU);
        close(error, 0.01 - 0.02 * psi.sin() + 0.03 * psi.cos(), 1e-12); // rounding
    }
    assert_eq!(quadrants, [true; 4]);
    for (truth, [_, _, heading], _) in soft.ahrs() {
        let psi = truth.state[5];
        let error = libm::remainder(heading - psi, std::f64::consts::TAU);
        close(error, 0.02 * (2.0 * psi).sin() - 0.01 * (2.0 * psi).cos(), 1e-12); // rounding
    }
}

#[test]
fn val_a_lagging_compass_trails_a_steady_turn_by_rate_times_lag() {
    let flown = turned("heading_lag", &[("s", 2.0)]);
    let (truth, [_, _, heading], _) = flown.ahrs().last().unwrap();
    let [.., phi, theta, _, _, _, _, _, q, r] = truth.state;
    let turn_rate = (q * phi.sin() + r * phi.cos()) / theta.cos();
    // The turn is steady to a part in a thousand by then.
    close(libm::remainder(truth.state[5] - heading, std::f64::consts::TAU), 2.0 * turn_rate, 2e-3 * turn_rate.abs());
}

#[test]
fn val_the_motor_turns_the_compass_by_its_speed_squared() {
    for (truth, [_, _, heading], _) in turned("compass_crosstalk", &[("rad_s2", 2e-6)]).ahrs() {
        let error = libm::remainder(heading - truth.state[5], std::f64::consts::TAU);
        close(error, 2e-6 * truth.actuators.propeller_radps.powi(2), 1e-12);
    }
}

#[test]
fn val_biases_and_scales_are_exactly_those_given() {
    for (truth, [_, pitch, _], _) in turned("pitch_sensor", &[("bias_rad", 0.02), ("scale", -0.1)]).ahrs() {
        close(pitch, 0.9 * truth.state[4] + 0.02, 1e-12);
    }
    for (truth, _, rates) in turned("gyro_bias", &[("p_radps", 1e-3), ("q_radps", -2e-3), ("r_radps", 3e-3)]).ahrs() {
        for (i, bias) in [1e-3, -2e-3, 3e-3].into_iter().enumerate() {
            close(rates[i] - truth.state[9 + i], bias, 1e-12);
        }
    }
    let flown = turned("depth_bias", &[("m", -0.4)]);
    for observation in &flown.observations {
        if let hil_sim::observation::ObservationKind::Depth { depth_m } = observation.kind {
            close(depth_m - flown.at(observation.time_us).state[2], -0.4, 1e-12);
        }
    }
    for (truth, velocity) in turned("dvl_scale", &[("ratio", 0.02)]).dvl() {
        (0..3).for_each(|i| close(velocity[i], 1.02 * truth.velocity_over_ground_mps[i], 1e-12));
    }
    for (truth, [u, v, w]) in turned("dvl_misalignment", &[("yaw_rad", 0.03), ("pitch_rad", 0.02)]).dvl() {
        let [ahead, across, down] = truth.velocity_over_ground_mps;
        let (a, b) =
            (0.03_f64.cos() * ahead + 0.03_f64.sin() * across, 0.03_f64.cos() * across - 0.03_f64.sin() * ahead);
        close(u, 0.02_f64.cos() * a - 0.02_f64.sin() * down, 1e-12);
        close(v, b, 1e-12);
        close(w, 0.02_f64.sin() * a + 0.02_f64.cos() * down, 1e-12);
    }
}

/// What changes under way is there from its onset to its end, and at no other time.
#[test]
fn val_sensors_slip_and_come_back() {
    let when = [("time_s", 40.0), ("until_s", 80.0)];
    let slipped = |name, sizes: &[(&str, f64)]| turned(name, &[sizes, &when].concat());
    let share =
        |truth: &hil_sim::truth::VehicleTruth| f64::from(u8::from((40_000_000..80_000_000).contains(&truth.time_us)));
    for (truth, [_, pitch, _], _) in slipped("pitch_change", &[("rad", 0.02)]).ahrs() {
        close(pitch - truth.state[4], 0.02 * share(truth), 1e-12);
    }
    for (truth, [_, _, heading], _) in slipped("heading_change", &[("rad", -0.1)]).ahrs() {
        close(libm::remainder(heading - truth.state[5], TAU), -0.1 * share(truth), 1e-12);
    }
    for (truth, [u, v, w]) in slipped("dvl_change", &[("ratio", 0.02), ("yaw_rad", 0.05)]).dvl() {
        let [ahead, across, down] = truth.velocity_over_ground_mps;
        let (gain, (sin, cos)) = (1.0 + 0.02 * share(truth), (0.05 * share(truth)).sin_cos());
        close(u, gain * (cos * ahead + sin * across), 1e-12);
        close(v, gain * (cos * across - sin * ahead), 1e-12);
        close(w, gain * down, 1e-12);
    }
    let ranges = |scenario: &hil_sim::scenario::Scenario| flown(scenario, cruise([0.0; 4]), 400).ranges();
    let jumped = with(quiet(), "clock_change", &[("s", 0.004), ("time_s", 100.0), ("until_s", 250.0)]);
    let pairs: Vec<_> = ranges(&quiet()).into_iter().zip(ranges(&jumped)).collect();
    assert!(pairs.len() > 10);
    for ((t_s, clean), (_, dirty)) in pairs {
        let is_there = (100.0..250.0).contains(&t_s);
        close(dirty - clean, if is_there { 6.0 } else { 0.0 }, 1e-9); // rounding of sums of 1000 m
    }
}

#[test]
fn val_a_dvl_ahead_of_its_place_sees_the_turn_as_sway() {
    let flown = turned("dvl_lever_arm", &[("x_m", 0.3)]);
    let (truth, velocity) = flown.dvl().last().unwrap();
    let [.., q, r] = truth.state;
    assert!(r > 0.05);
    close(velocity[1] - truth.velocity_over_ground_mps[1], 0.3 * r, 1e-12);
    close(velocity[2] - truth.velocity_over_ground_mps[2], -0.3 * q, 1e-12);
}

#[test]
fn val_ranges_are_long_by_speed_of_sound_clock_and_ray() {
    let straight = |name, values: &[(&str, f64)]| {
        let scenario = if values.is_empty() { quiet() } else { with(quiet(), name, values) };
        flown(&scenario, cruise([0.0; 4]), 400).ranges()
    };
    let clean = straight("", &[]);
    assert!(clean.len() > 10);
    let pairs = |name, values: &[(&str, f64)]| {
        let dirty = straight(name, values);
        assert_eq!(dirty.len(), clean.len());
        clean.iter().zip(dirty).map(|(&(t, clean), (_, dirty))| (t, clean, dirty)).collect::<Vec<_>>()
    };
    for (_, clean, dirty) in pairs("sound_speed", &[("ratio", 0.01)]) {
        // Slower sound is met a little later: the vehicle moves by 1 m/s times 10 ms meanwhile.
        close(dirty / clean - 1.0, 0.01, 2e-5);
    }
    for (_, clean, dirty) in pairs("ray_bending", &[("per_m", 2e-5)]) {
        close(dirty - clean, 2e-5 * clean * clean, 2e-4); // range noise under the square
    }
    for (_, clean, dirty) in pairs("clock_offset", &[("s", 0.004)]) {
        close(dirty - clean, 1500.0 * 0.004, 1e-9); // rounding of sums of 1000 m
    }
    for (t, clean, dirty) in pairs("clock_drift", &[("ppm", -20.0)]) {
        close(dirty - clean, 1500.0 * -20e-6 * t, 2e-7); // the time is rounded to microseconds
    }
}

#[test]
fn val_outliers_are_as_many_as_asked_for_and_far_off() {
    let mut often = quiet();
    often.settings.acoustics.first_s = 2;
    often.settings.acoustics.period_s = 1.try_into().unwrap();
    let clean = flown(&often, cruise([0.0; 4]), 1200).ranges();
    let dirty = flown(&with(often, "range_outliers", &[("share", 0.2)]), cruise([0.0; 4]), 1200).ranges();
    let off: Vec<f64> = clean.iter().zip(&dirty).map(|(a, b)| b.1 - a.1).filter(|d| d.abs() > 1e-9).collect();
    let share = off.len() as f64 / clean.len() as f64;
    // Binomial, 1200 packets: sigma 1.2 %; four of them.
    close(share, 0.2, 0.05);
    assert!(off.iter().all(|d| d.abs() >= 5.0));
    let late = off.iter().filter(|d| **d > 0.0).count() as f64 / off.len() as f64;
    close(late, 0.75, 0.12); // 240 of them: sigma 2.8 %; four of them
}

/// Half of the variance of a range's error lasts for a minute: of 1200 ranges a second apart ten independent ones.
#[test]
fn val_errors_of_ranges_last() {
    let scenario = |range_sigma_m, noise| {
        let mut often = quiet();
        (often.settings.acoustics.first_s, often.settings.acoustics.period_s) = (2, 1.try_into().unwrap());
        (often.settings.acoustics.range_sigma_m, often.settings.noise) = (Some(range_sigma_m), noise);
        often
    };
    let ranges = |sigma_m, noise| flown(&scenario(sigma_m, noise), cruise([0.0; 4]), 1200).ranges();
    let exact = ranges(0.0, NoiseKind::White);
    let [white, coloured] = [NoiseKind::White, NoiseKind::Coloured].map(|noise| {
        let errors: Vec<f64> = exact.iter().zip(ranges(1.0, noise)).map(|(exact, range)| range.1 - exact.1).collect();
        let product = |lag: usize| errors.iter().zip(&errors[lag..]).map(|(a, b)| a * b).sum::<f64>();
        product(1) / product(0)
    });
    close(white, 0.0, 0.12); // four sigmas
    close(coloured, 0.5, 0.3); // the part that lasts is known to 45 %, the share of it to 0.15; two sigmas
}

#[test]
fn coloured_noise_changes_the_noise_and_nothing_else() {
    let scenario = |noise| {
        let mut scenario = quiet();
        scenario.settings.sensors.dvl.sigma_mps = Some(0.01);
        scenario.settings.noise = noise;
        scenario
    };
    let [white, coloured] =
        [NoiseKind::White, NoiseKind::Coloured].map(|noise| flown(&scenario(noise), cruise(TURN), 300));
    assert_eq!(white.last().state, coloured.last().state); // no disturbance here
    let statistics = |flown: &ObservedFlight| {
        let noise: Vec<f64> = flown.dvl().map(|(truth, v)| v[0] - truth.velocity_over_ground_mps[0]).collect();
        let product =
            |lag: usize| noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b).sum::<f64>() / noise.len() as f64;
        [product(0), product(1) / product(0)]
    };
    let ([var_white, rho_white], [var_coloured, rho_coloured]) = (statistics(&white), statistics(&coloured));
    // 1500 samples: the variance is known to 4 %, a correlation to 0.026; a tenth coloured at 1 s gives 0.08.
    close(var_white / 1e-4, 1.0, 0.15);
    close(var_coloured / 1e-4, 1.0, 0.15);
    assert!(rho_white.abs() < 0.06 && rho_coloured > rho_white + 0.03, "{rho_white} {rho_coloured}");
}
