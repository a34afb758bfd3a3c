use super::*;
use crate::vessel::readings::{measured, readings};
use backseat_logs::{Log, LogRow};

/// A vessel of thrust 0.01 n², drag 0.1 u², and a rudder that turns it.
fn vessel() -> ManoeuvringModel {
    let of = |axis, name: &str, value| {
        let actuators = [1, 1];
        let term = terms(axis, actuators).position(|term| term.name == name).unwrap();
        Coefficient { axis, term, value, ci95: None }
    };
    ManoeuvringModel {
        actuators: [vec![Column::PropRpm], vec![Column::Rudder]],
        coefficients: vec![
            of(0, "uu", -0.1),
            of(0, "nn", 0.01),
            of(1, "uv", -0.5),
            of(1, "uud", 0.05),
            of(2, "ur", -1.0),
            of(2, "uud", -0.5),
        ],
    }
}

fn held(seconds: f64, rps: f64, rudder_rad: f64) -> Vec<Reading> {
    (0..=(seconds * 10.0) as u32)
        .map(|k| Reading {
            t_s: 0.1 * f64::from(k),
            propellers: vec![rps],
            rudders: vec![rudder_rad],
            ..Reading::default()
        })
        .collect()
}

#[test]
fn val_steady_speed_and_turn_are_those_of_the_coefficients() {
    let states = vessel().simulate([0.0; 6], &held(200.0, 10.0, 0.0));
    let [u, v, r, heading, north, east] = *states.last().unwrap();
    // 0.01 · 100 = 0.1 u²; the way of u = U tanh(t/T) is U T ln cosh(t/T), T = 1 / (0.1 U)
    let speed = 10.0_f64.sqrt();
    let time_constant_s = 1.0 / (0.1 * speed);
    let way = speed * (200.0 - time_constant_s * std::f64::consts::LN_2);
    assert!((u - speed).abs() < 1e-9 && (north / way - 1.0).abs() < 1e-5, "{u}, {north} instead of {way}");
    assert_eq!((v, r, heading, east), (0.0, 0.0, 0.0, 0.0));
    let states = vessel().simulate([u, 0.0, 0.0, 0.0, 0.0, 0.0], &held(100.0, 10.0, 0.1));
    let [u, v, r, ..] = *states.last().unwrap();
    // 1.0 u r = -0.5 u² sin δ, and 0.5 u v = 0.05 u² sin δ
    assert!((r + 0.5 * u * 0.1_f64.sin()).abs() < 1e-9 && (v - 0.1 * u * 0.1_f64.sin()).abs() < 1e-9, "{r} {v}");
}

#[test]
fn val_velocities_that_are_not_logged_are_slopes() {
    let rows = (0..200_u64).map(|k| {
        let t_s = 0.1 * k as f64;
        let mut row = LogRow::new(k * 100_000);
        // a circle of 10 m at 1 m/s, the bow 0.1 rad inwards of the path
        let course = 0.1 * t_s;
        row.set_all(Column::GpsX, &[10.0 * course.sin(), -10.0 * course.cos()]);
        row.set(Column::Heading, backseat_core::state::wrap_angle(course + 0.1));
        row.set(Column::PropRpm, 600.0).set(Column::Rudder, 0.2);
        row
    });
    let log = Log { rows: rows.collect(), ..Log::default() };
    assert!(measured(&log) == [false; 3]);
    let runs = readings(&log);
    let [(1, run)] = &runs[..] else { panic!("{}", runs.len()) };
    for reading in &run[20..180] {
        let [u, v, r] = reading.velocity;
        // the chord of 2 s of a circle of 10 m is 0.2 % short of the arc, and a slope over it three fifths of that
        assert!((u - 0.1_f64.cos()).abs() < 1.5e-3 && (v + 0.1_f64.sin()).abs() < 1.5e-3, "{u} {v}");
        assert!((r - 0.1).abs() < 1e-9 && reading.propellers == [10.0], "{r}");
    }
}
