use super::*;
use crate::vessel::ship::{Voyage, simulate};
use std::time::Instant;

const STILL: Voyage = Voyage { duration_s: 3000.0, velocities: true, wind_mps: [0.0; 2], noise: true };

fn data(voyage: &Voyage, seed: u64) -> ManoeuvringData {
    ManoeuvringData::from_log(&simulate(voyage, seed).0, 7.0)
}

/// Data of the model itself, with the coefficients that fit a tanker: they come back, within their intervals.
#[test]
#[ignore = "a minute without optimisation: .ci/nightly"]
fn val_coefficients_of_the_model_itself_come_back() {
    let model = data(&STILL, 1).fit().unwrap().model;
    // its states beside the actuators of a voyage, with the noise of the sensors
    let mut data = data(&STILL, 2);
    let mut noise = hil_sim::rng::Stream::new(3, hil_sim::rng::Source::Dvl);
    for stretch in &mut data.stretches {
        let states = model.simulate(start(&stretch[0]), stretch);
        for (reading, [u, v, r, heading_rad, north, east]) in stretch.iter_mut().zip(states) {
            let [du, dv, dr, dh] = noise.normals::<4>(1.0);
            reading.velocity = [u + 5e-3 * du, v + 5e-3 * dv, r + 1e-3 * dr];
            reading.heading_rad = heading_rad + 1e-3 * dh;
            reading.position_m = Some([north, east].map(|place| place + 0.02 * noise.normal()));
        }
    }
    let found = data.fit().unwrap();
    let mut inside = 0;
    for coefficient in &found.model.coefficients {
        let key = |c: &&Coefficient| (c.axis, c.term) == (coefficient.axis, coefficient.term);
        let truth = model.coefficients.iter().find(key).map_or(0.0, |c| c.value);
        let [low, high] = coefficient.ci95.unwrap();
        inside += usize::from((low..=high).contains(&truth));
    }
    // 95 % of some twenty intervals that share their data
    let count = found.model.coefficients.len();
    println!("{inside} of {count} intervals hold");
    assert!(inside + 3 >= count && count >= 12, "{inside} of {count}: {found:?}");
    // residuals are the noise
    for (residual, sigma) in found.residual.iter().zip([5e-3, 5e-3, 1e-3, 1e-3, 0.02, 0.02]) {
        assert!((residual.unwrap() / sigma - 1.0).abs() < 0.05, "{:?}", found.residual);
    }
}

/// A tanker by other equations (MMG): its next manoeuvres are predicted much better than by going on as it does.
fn a_tanker_is_predicted(velocities: bool) {
    let voyage = Voyage { velocities, ..STILL };
    let began = Instant::now();
    let found = data(&voyage, 1).fit().unwrap();
    // other runs, other noise
    let judge = data(&Voyage { duration_s: 4800.0, ..voyage }, 2);
    let prediction = judge.predict(&found.model, 30.0).unwrap();
    println!("{velocities}: {prediction:?} {:?} {:?}", found.residual, began.elapsed());
    // the terms are not the tanker's own: a centimetre a second, and two degrees
    assert!(prediction.speed_mps[0] < 0.02 && prediction.heading_rad[0] < 0.05, "{prediction:?}");
    assert!(prediction.heading_rad[0] < 0.1 * prediction.heading_rad[1], "{prediction:?}");
    assert!(prediction.position_m[0] < 0.15 * prediction.position_m[1], "{prediction:?}");
}

#[test]
#[ignore = "a minute without optimisation: .ci/nightly"]
fn val_a_tanker_of_other_equations_is_predicted() {
    a_tanker_is_predicted(true);
}

#[test]
#[ignore = "a minute without optimisation: .ci/nightly"]
fn val_a_tanker_without_velocities_is_predicted() {
    a_tanker_is_predicted(false);
}

#[test]
fn too_short_a_log_is_refused() {
    let short = data(&Voyage { duration_s: 60.0, ..STILL }, 1);
    assert!(short.fit().unwrap_err().to_string().contains("at least 5 are needed"));
}

/// Once in a second or less often, and not evenly: windows of one reading say nothing, and break nothing.
#[test]
#[ignore = "a minute without optimisation: .ci/nightly"]
fn sparse_and_uneven_logs_are_fitted() {
    for (least_s, later_s) in [(0.9, 1.1), (1.9, 2.6)] {
        let mut log = simulate(&STILL, 1).0;
        let mut next_s = 0.0;
        let mut count = 0_u32;
        log.rows.retain(|row| {
            let is_kept = row.time_us as f64 * 1e-6 >= next_s - 1e-6;
            if is_kept {
                count += 1;
                next_s = row.time_us as f64 * 1e-6 + if count.is_multiple_of(2) { least_s } else { later_s };
            }
            is_kept
        });
        let found = ManoeuvringData::from_log(&log, 7.0).fit().unwrap();
        let prediction = data(&STILL, 2).predict(&found.model, 30.0).unwrap();
        assert!(prediction.heading_rad[0] < 0.2 * prediction.heading_rad[1], "{least_s}: {prediction:?}");
    }
}
