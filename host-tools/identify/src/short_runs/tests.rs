//! Runs made by the model itself: what was put in is found again, and windows are where they should be.

use super::recording::{Run, RunSample, Wanted, Window, stretches, windows};
use super::start::{OPEN, open};
use super::stops::stops;
use super::unknowns::{coefficients, into_vehicle, of_effect};
use super::{Draft, Problem, Starts, Unknown, predict};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::{P, PHI, Q, R, THETA, U, V, VehicleState, W, Z};
use backseat_logs::VehicleFile;
use backseat_logs::short_runs::{Configuration, OF_CONFIGURATION, Value};

fn sample(t_s: f64, depth_m: f64, radps: f64) -> RunSample {
    let input = ActuatorInput { propeller_radps: radps, fins_rad: [0.0; 4] };
    RunSample { t_s, attitude_rad: [0.0; 3], depth_m, dvl_mps: Some([1.0, 0.0, 0.0]), input }
}

fn run(samples: Vec<RunSample>) -> Run {
    Run { label: "run".to_owned(), facts: Vec::new(), configuration: 0, samples }
}

#[test]
fn stretches_end_at_pauses_at_the_surface_on_end_and_where_the_motor_stops() {
    let mut samples: Vec<RunSample> = (0..120).map(|i| sample(0.5 * f64::from(i), 2.0, 100.0)).collect();
    samples[10].depth_m = 0.1;
    samples[60].input.propeller_radps = 0.0;
    samples[90..].iter_mut().for_each(|sample| sample.t_s += 5.0);
    samples[115].attitude_rad[1] = -1.3; // no torpedo is driven so steeply
    let run = run(samples);
    let powered = Wanted { depth_m: 0.5, powered: true, speed_mps: 0.0 };
    assert_eq!(stretches(&run, powered), [(0, 9), (11, 59), (61, 89), (90, 114), (116, 119)]);
    let whole = windows(&[run], powered, 10.0, 10.0);
    let of_second: Vec<(usize, usize)> = whole.iter().map(|window| (window.first, window.last)).take(3).collect();
    // 24 s give three windows of 10 s that overlap by half
    assert_eq!(of_second, [(11, 31), (21, 41), (31, 51)]);
}

/// Runs of 40 s with rudder, elevator and a motor that stops, as a vehicle with these terms would have them.
fn flown(draft: &Draft, count: usize) -> Vec<Run> {
    let mut start = VehicleState::zeros();
    (start[Z], start[U]) = (5.0, 1.0);
    flown_from(&start, 100.0, draft, count)
}

/// The same from a start, with a speed of the propeller.
fn flown_from(start: &VehicleState, propeller_radps: f64, draft: &Draft, count: usize) -> Vec<Run> {
    let model = &draft.models().unwrap()[0];
    (0..count)
        .map(|place| {
            let phase = place as f64;
            let input = |t_s: f64| {
                let square = |period_s: f64| if ((t_s + phase) / period_s).fract() < 0.5 { 0.1 } else { -0.08 };
                let (rudder, elevator) = (square(9.0), 0.4 * square(13.0));
                let radps = if t_s < 31.0 { propeller_radps + 5.0 * phase } else { 0.0 };
                ActuatorInput { propeller_radps: radps, fins_rad: [rudder, -rudder, elevator, -elevator] }
            };
            let times = (0..80).map(|row| 0.5 * f64::from(row));
            let mut run = run(times.map(|t_s| RunSample { input: input(t_s), ..sample(t_s, 5.0, 0.0) }).collect());
            let readings = model.predict(&run, Window { run: 0, first: 0, last: 79 }, start);
            for (row, (sample, reading)) in run.samples.iter_mut().zip(readings).enumerate() {
                let reading = reading.unwrap();
                sample.attitude_rad = reading.attitude_rad;
                sample.depth_m = reading.depth_m;
                sample.dvl_mps = reading.dvl_mps.filter(|_| row % 2 == 0);
            }
            run
        })
        .collect()
}

#[test]
fn what_was_put_in_is_found_again_and_survives_the_vehicle_file() {
    let vehicle = VehicleFile::reference();
    let base = Draft::of(&vehicle, 1);
    let mut truth = base.clone();
    truth.parameters.torque_arm_m = -0.02;
    truth.common[0] = 0.3; // the fins' delay
    // a moment with u^2 beside the torque is not put in: four runs do not separate the two
    let runs = flown(&truth, 4);
    let mut unknowns = coefficients();
    for effect in ["propeller_torque", "input_delay"] {
        unknowns.extend(of_effect(effect, 1));
    }
    let problem = Problem { runs: &runs, base: base.clone(), unknowns, starts: Starts::Open };
    let start: Vec<f64> = problem.unknowns.iter().map(Unknown::first_guess).collect();
    let fit = problem.fit(&|_| true, &start, &[5.0, 15.0]).unwrap();
    let sigmas = fit.sigmas();
    for (name, expected) in [("torque_arm_m", -0.02), ("fin_delay_s", 0.3)] {
        let place = problem.unknowns.iter().position(|unknown| unknown.name == name).unwrap();
        let (value, sigma) = (fit.values[place], sigmas[place]);
        assert!((value - expected).abs() < 3.0 * sigma, "{name} {value} +- {sigma}, put in {expected}");
        assert!(value.abs() > 2.0 * sigma, "{name} {value} +- {sigma} is not shown");
    }
    // better than the textbook on every channel that the terms change, and the same from the file
    let mut found = base.with(&problem.unknowns, &fit.values);
    let roll = |draft: &Draft| {
        let models = draft.models().unwrap();
        predict::open_loop(&runs, &models, 10.0).iter().map(|squares| squares.rms(0).unwrap()).fold(0.0, f64::max)
    };
    assert!(roll(&found) < 0.3 * roll(&base), "{} {}", roll(&found), roll(&base));
    // faster than any run and thrown about: what is asked of 20 s of a real vehicle at 2.2 m/s
    let mut thrown = VehicleState::zeros();
    let away = [(Z, 5.0), (PHI, 0.4), (THETA, -0.2), (U, 2.2), (V, 0.2), (W, -0.2), (P, 0.5), (Q, 0.2), (R, -0.2)];
    away.into_iter().for_each(|(place, value)| thrown[place] = value);
    let fast = &flown_from(&thrown, 245.0, &truth, 1)[0];
    let window = Window { run: 0, first: 0, last: 40 };
    let mut squares = predict::Squares::default();
    squares.add(&predict::errors(fast, window, &found.models().unwrap()[0].predict(fast, window, &thrown)));
    let off: Vec<f64> = (0..5).map(|channel| squares.rms(channel).unwrap()).collect();
    assert!(off.iter().zip([8.0, 4.0, 5.0, 1.5, 0.105]).all(|(off, asked)| *off < asked), "{off:?}");
    // trims go into the sections that every command reads
    (found.configurations[0][3], found.configurations[0][5]) = (0.002, 0.1);
    let values = OF_CONFIGURATION.map(|term| Value::from(term.default));
    let configuration = Configuration { name: "all".to_owned(), settings: Vec::new(), values };
    let file = into_vehicle(&vehicle, &found, &[configuration]);
    let added_kg = file.parameters.displaced_mass_kg - vehicle.parameters.displaced_mass_kg;
    assert!((added_kg - 0.1).abs() < 1e-9, "{added_kg}");
    let read = VehicleFile::parse(&file.to_toml("a test"), std::path::Path::new("v.toml")).unwrap();
    assert!((roll(&Draft::of(&read, 1)) - roll(&found)).abs() < 1e-9); // the same numbers
}

#[test]
fn val_a_rudder_thrown_between_rows_turns_the_vehicle_as_a_fine_integration_has_it() {
    // rows of 0.5 s against rows of 0.01 s with the same commands; a delay that is no whole number of steps
    for delay_s in [-0.31, 0.19] {
        let mut draft = Draft::of(&VehicleFile::reference(), 1);
        draft.common[0] = delay_s;
        let model = &draft.models().unwrap()[0];
        let heading_rad = |row_s: f64, rows: u32| {
            let thrown = |t_s: f64| if t_s < 1.995 { 0.0 } else { 0.5 };
            let row = |i: u32| {
                let mut row = sample(row_s * f64::from(i), 5.0, 100.0);
                row.input.fins_rad = [thrown(row.t_s), -thrown(row.t_s), 0.0, 0.0];
                row
            };
            let run = run((0..=rows).map(row).collect());
            let mut start = VehicleState::zeros();
            (start[Z], start[U]) = (5.0, 1.0);
            let window = Window { run: 0, first: 0, last: rows as usize };
            model.predict(&run, window, &start).last().unwrap().unwrap().attitude_rad[2]
        };
        let (coarse, fine) = (heading_rad(0.5, 8), heading_rad(0.01, 400));
        assert!((coarse - fine).abs() < 2e-4 * fine.abs(), "delay {delay_s} s: {coarse} rad, finely {fine} rad");
    }
}

#[test]
fn val_a_few_rows_tell_when_a_command_acts() {
    let base = Draft::of(&VehicleFile::reference(), 1);
    let mut truth = base.clone();
    truth.common[0] = -0.27;
    truth.parameters.m_diag[5] *= 1.1;
    truth.parameters.fins[0].gain = 0.8;
    let runs = flown(&truth, 4);
    let mut unknowns = coefficients();
    ["input_delay", "fin_gain"].into_iter().for_each(|effect| unknowns.extend(of_effect(effect, 1)));
    let problem = Problem { runs: &runs, base, unknowns, starts: Starts::Rows };
    let start: Vec<f64> = problem.unknowns.iter().map(Unknown::first_guess).collect();
    let fit = problem.fit(&|_| true, &start, &[3.0]).unwrap();
    let place = problem.unknowns.iter().position(|unknown| unknown.name == "fin_delay_s").unwrap();
    let (value, sigma) = (fit.values[place], fit.sigmas()[place]);
    assert!((value + 0.27).abs() < 0.03 && sigma < 0.04, "{value} +- {sigma} s");
    // what each run says can be taken out
    let moved = fit.runs().iter().all(|&run| fit.without(run)[place] != value);
    assert!(moved, "{:?}", fit.runs());
}

#[test]
fn attitude_that_is_early_is_that_of_a_later_row() {
    let mut draft = Draft::of(&VehicleFile::reference(), 1);
    let runs = flown(&draft, 1);
    let window = Window { run: 0, first: 0, last: 20 };
    let mut start = VehicleState::zeros();
    (start[Z], start[U]) = (5.0, 1.0);
    let attitudes = |draft: &Draft| -> Vec<[f64; 3]> {
        let readings = draft.models().unwrap()[0].predict(&runs[0], window, &start);
        readings.iter().map(|reading| reading.unwrap().attitude_rad).collect()
    };
    let here = attitudes(&draft);
    draft.common[2] = -0.5; // one row
    let early = attitudes(&draft);
    assert_eq!(early[..20], here[1..]);
    assert!(here[20][2] != early[20][2]); // and goes on beyond the last
}

#[test]
fn a_start_is_less_known_where_the_vehicle_begins_to_turn() {
    let mut samples: Vec<RunSample> = (0..9).map(|i| sample(0.5 * f64::from(i), 2.0, 100.0)).collect();
    // from row 4 on it turns at 0.2 rad/s
    samples.iter_mut().for_each(|sample| sample.attitude_rad[2] = 0.2 * (sample.t_s - 2.0).max(0.0));
    let run = run(samples);
    let [steady, begins, turns] = [2, 4, 6].map(|index| open(&run, index));
    // sway, and yaw rate
    assert_eq!((steady[5], steady[9]), (OPEN[5].1, OPEN[9].1));
    assert!(begins[9] > 0.1 && turns[9] < 0.01, "{} and {} rad/s", begins[9], turns[9]);
    assert!(turns[5] > 0.05, "{} m/s", turns[5]);
    assert_eq!(steady[8], turns[8]);
}

#[test]
fn each_stop_of_the_motor_shows_the_torque_by_itself() {
    let base = Draft::of(&VehicleFile::reference(), 1);
    let arm = |torque_m: f64| {
        let mut truth = base.clone();
        truth.parameters.torque_arm_m = torque_m;
        truth.common[0] = 0.2;
        // a moment with u^2 of the other sign, which the model that is given lacks
        truth.configurations[0][0] = -0.4;
        stops(&flown(&truth, 4), &base)
    };
    // the reference vehicle rights itself: a smaller torque moves its roll by less than the model is good for
    let with = arm(-0.15);
    let [mean, sigma] = with.mean().unwrap();
    assert_eq!(with.each.len(), 4);
    assert!((mean + 0.15).abs() < 0.04 && sigma < 0.02, "{mean} +- {sigma}");
    assert!(with.errors[0] < 0.2 * with.errors[1], "{:?}", with.errors);
    let [mean, _] = arm(0.0).mean().unwrap();
    assert!(mean.abs() < 0.02, "{mean} where there is none");
}

#[test]
fn a_configuration_without_runs_has_the_trim_of_the_other_and_no_moment() {
    let vehicle = VehicleFile::reference();
    let mut truth = Draft::of(&vehicle, 1);
    truth.configurations[0][3] = 0.003;
    let runs = flown(&truth, 4);
    let mut unknowns = of_effect("pitch_trim", 2);
    unknowns.extend(of_effect("speed_moment", 2));
    let problem = Problem { runs: &runs, base: Draft::of(&vehicle, 2), unknowns, starts: Starts::Open };
    let start = vec![0.0; problem.unknowns.len()];
    let fit = problem.fit(&|_| true, &start, &[10.0]).unwrap();
    let of = |name: &str| {
        let place = problem.unknowns.iter().position(|unknown| unknown.name == name).unwrap();
        (fit.values[place], fit.prior_share[place])
    };
    let ((own_m, _), (other_m, _)) = (of("b_x_m[0]"), of("b_x_m[1]"));
    assert!((own_m - 0.003).abs() < 5e-4 && (other_m - own_m).abs() < 1e-4, "{own_m} and {other_m} m");
    let (moment, prior_share) = of("m_uu[1]");
    assert!(moment.abs() < 1e-3 && prior_share > 0.99, "{moment} N s^2/m, of which the prior gives {prior_share}");
}
