//! Effects in simulated dead reckoning between fixes.

use super::*;
use crate::verdict::Verdict;
use backseat_core::state::VehicleState;
use backseat_logs::{LogRow, TruthRow};
use hil_sim::rng::{Source, Stream};

/// What is found stands on the log and not on one draw of its noise.
const SEEDS: [u64; 2] = [1, 2];

/// Boxes at 1.5 m/s in a current of 0.12 m/s to the north and 0.08 to the west, a receiver's noise on the fixes;
/// the compass reads `bias` too much. A DVL, where there is one, is turned by 0.05 rad.
fn log(seed: u64, bias: f64, has_dvl: bool) -> (Log, Truth) {
    at_speeds(seed, bias, has_dvl, |_| 1.5)
}

/// The same at a speed of its own on each leg.
fn at_speeds(seed: u64, bias: f64, has_dvl: bool, speed_mps: impl Fn(u64) -> f64) -> (Log, Truth) {
    let (mut log, mut truth) = (Log::default(), Truth::default());
    let (mut north, mut east) = (0.0, 0.0);
    let (mut gnss, mut dvl) = (Stream::new(seed, Source::VehicleGnss), Stream::new(seed, Source::Dvl));
    for second in 0..2400_u64 {
        // Legs of two minutes, turns of 3 degrees a second.
        let at = |second: u64| {
            let (leg, along) = (f64::from(u32::try_from(second / 150).unwrap()), f64::from((second % 150) as u32));
            (leg + ((along - 120.0) / 30.0).max(0.0)) * std::f64::consts::FRAC_PI_2
        };
        let heading = at(second);
        let ((sin, cos), speed) = (heading.sin_cos(), speed_mps(second / 150));
        let mut row = LogRow::new(second * 1_000_000);
        row.set(Column::Heading, heading + bias).set(Column::SpeedLog, speed);
        let over_ground = [speed * cos + 0.12, speed * sin - 0.08];
        if has_dvl {
            let body = [over_ground[0] * cos + over_ground[1] * sin, over_ground[1] * cos - over_ground[0] * sin];
            let (sin, cos) = 0.05_f64.sin_cos();
            let measured = [body[0] * cos + body[1] * sin, body[1] * cos - body[0] * sin];
            row.set_all(Column::DvlU, &[measured[0] + dvl.normal() * 0.006, measured[1] + dvl.normal() * 0.006, 0.0]);
        }
        row.set_all(Column::GpsX, &[north + 0.6 * gnss.normal(), east + 0.6 * gnss.normal()]);
        log.rows.push(row);
        let mut state = VehicleState::zeros();
        (state[0], state[1]) = (north, east);
        truth.rows.push(TruthRow { time_us: second * 1_000_000, state, current_mps: [0.12, -0.08] });
        let (sin, cos) = (0.5 * (heading + at(second + 1))).sin_cos();
        let speed = 0.5 * (speed + speed_mps((second + 1) / 150));
        north += speed * cos + 0.12;
        east += speed * sin - 0.08;
    }
    (log, truth)
}

#[test]
fn val_current_from_heading_and_speed_alone() {
    for seed in SEEDS {
        let (log, truth) = log(seed, 0.0, false);
        let found = run(&log, &VehicleFile::reference(), true, Some(&truth)).unwrap();
        let d = &found.diagnosis;
        assert_eq!(d.verdict, Verdict::Explained, "{:?} {:?}", d.effects, d.structure.named);
        assert_eq!(d.effects[0].instance.candidate.effect, "water_current");
        for (value, truth) in d.effects[0].values.iter().zip([0.12, -0.08]) {
            let half = 0.75 * (value.ci95[1] - value.ci95[0]);
            assert!((value.value - truth).abs() < half && half < 0.03, "{value:?}");
        }
        // Against the truth, which has no noise: only what the current's interval leaves.
        let [before, after] = &found.scores;
        assert_eq!(before.position_against, Some("truth, dead reckoning of each stretch by itself"));
        // Stretches of 120 and 240 s at 0.144 m/s.
        assert!((8.0..30.0).contains(&before.position_rmse_m.unwrap()), "{before:?}");
        assert!(after.position_rmse_m.unwrap() < 2.0, "{after:?}");
    }
}

#[test]
#[ignore = "a quarter of a minute: .ci/nightly"]
fn a_dvl_turned_and_a_compass_off_are_one_to_dead_reckoning() {
    for seed in SEEDS {
        let (log, _) = log(seed, 0.0, true);
        let with = run(&log, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        assert_eq!(with.verdict, Verdict::Ambiguous, "{:?}", with.effects);
        let found = &with.effects[0];
        let alternative = found.alternatives.iter().find(|alternative| alternative.is_possible()).unwrap();
        let mut names = [found.instance.candidate.effect, alternative.instance.candidate.effect];
        names.sort_unstable();
        assert_eq!(names, ["dvl_misalignment", "heading_bias"]);
        // Without the DVL the current shows again.
        let without = run(&log, &VehicleFile::reference(), false, None).unwrap().diagnosis;
        assert_eq!(without.effects[0].instance.candidate.effect, "water_current", "{:?}", without.effects);
    }
}

/// Two seconds late where the speed keeps for minutes, and four where it swings back in six and eight: there the slope at
/// no delay leads away from it.
#[test]
#[ignore = "half a minute: .ci/nightly"]
fn val_a_late_dvl_shows_where_the_speed_changes() {
    for (by_s, late_s) in [(40.0, 2.0), (1.0, 4.0)] {
        assert_late(by_s, late_s);
    }
}

fn assert_late(by_s: f64, late_s: f64) {
    for seed in SEEDS {
        let (mut log, _) = log(seed, 0.0, true);
        let mut gnss = Stream::new(seed, Source::VehicleGnss);
        let speed = |t_s: f64| 1.5 + 0.5 * (t_s / by_s).sin() + 0.5 * (t_s / (1.3 * by_s)).sin();
        let (mut north, mut east) = (0.0, 0.0);
        let headings: Vec<f64> = log.rows.iter().map(|row| row.get(Column::Heading).unwrap()).collect();
        for (second, row) in log.rows.iter_mut().enumerate() {
            let next = headings.get(second + 1).unwrap_or(&headings[second]);
            let heading = 0.5 * (headings[second] + next);
            row.set_all(Column::DvlU, &[speed(second as f64 - late_s), 0.0, 0.0]);
            row.set_all(Column::GpsX, &[north + 0.3 * gnss.normal(), east + 0.3 * gnss.normal()]);
            north += speed(second as f64 + 0.5) * heading.cos();
            east += speed(second as f64 + 0.5) * heading.sin();
        }
        let found = run(&log, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        let delay = found.effects.iter().find(|f| f.instance.candidate.effect == "dvl_delay").expect("a delay");
        // A sine once a second is a little less between its readings: a few hundredths.
        assert!((delay.values[0].value - late_s).abs() < 0.1, "{:?}", delay.values);
    }
}

#[test]
fn val_sideslip_in_turns_is_neither_a_lag_nor_an_arm() {
    // Outwards by 1.5 m times the yaw rate, as a torpedo does: the track is that of a point 1.5 m astern.
    for seed in SEEDS {
        let (mut log, _) = log(seed, 0.0, false);
        for row in &mut log.rows {
            let heading = row.get(Column::Heading).unwrap();
            let [north, east] = row.gnss_m().unwrap();
            row.set_all(Column::GpsX, &[north - 1.5 * heading.cos(), east - 1.5 * heading.sin()]);
        }
        let found = run(&log, &VehicleFile::reference(), true, None).unwrap();
        let d = &found.diagnosis;
        let names: Vec<&str> = d.effects.iter().map(|effect| effect.instance.candidate.effect).collect();
        assert_eq!((d.verdict, names), (Verdict::Explained, vec!["water_current"]), "{:?}", d.notes);
        let (slip, sigma) = (found.theta[1][SIDESLIP], found.sigmas[SIDESLIP]);
        assert!((slip + 1.5).abs() < 3.0 * sigma && sigma < 0.5, "{slip} {sigma}");
    }
}

/// Legs of two minutes on these headings in turn, at once from one to the next, without any noise; the compass is off
/// by `error(heading)`.
fn legs(headings: &[f64], error: impl Fn(f64) -> f64) -> Log {
    let (mut log, mut north, mut east) = (Log::default(), 0.0, 0.0);
    for second in 0..2400 {
        let [heading, next] = [second, second + 1].map(|at| headings[at / 120 % headings.len()]);
        let mut row = LogRow::new(second as u64 * 1_000_000);
        row.set(Column::Heading, heading + error(heading)).set(Column::SpeedLog, 1.5);
        log.rows.push(row.set_all(Column::GpsX, &[north, east]).clone());
        // Reckoning takes the middle of two headings as well.
        let (sin, cos) = (heading + 0.5 * backseat_core::state::wrap_angle(next - heading)).sin_cos();
        north += 1.5 * cos;
        east += 1.5 * sin;
    }
    log
}

/// Errors of a compass by the heading: of the first harmonic, and of the second.
const IRON: fn(f64) -> f64 = |heading| 0.05 * heading.sin();
const SOFT_IRON: fn(f64) -> f64 = |heading| 0.05 * (2.0 * heading).sin();

/// What is named where the compass is off by `error` and the legs go in these directions.
fn named_on(headings: &[f64], error: fn(f64) -> f64) -> Vec<&'static str> {
    let d = run(&legs(headings, error), &VehicleFile::reference(), true, None).unwrap().diagnosis;
    d.effects.iter().map(|found| found.instance.candidate.effect).collect()
}

/// The same in that many directions, evenly spread.
fn named_in(count: u32, error: fn(f64) -> f64) -> Vec<&'static str> {
    let headings: Vec<_> = (0..count).map(|k| 0.3 + f64::from(k) * std::f64::consts::TAU / f64::from(count)).collect();
    named_on(&headings, error)
}

/// On two headings any two numbers fit any errors: nothing says that they are a second harmonic's.
fn assert_no_soft_iron_on_two_headings(apart: f64) {
    for error in [IRON, |_| 0.05, SOFT_IRON] {
        let names = named_on(&[0.3, 0.3 + apart], error);
        assert!(!names.contains(&"soft_iron"), "{apart}: {names:?}");
    }
}

/// What the first harmonic leaves in second order, because the compass and not the true heading is its argument, shows
/// where nothing else is in the log.
fn assert_iron_is_no_soft_iron(count: u32) {
    let names = named_in(count, IRON);
    assert!(names[0] == "heading_bias" && !names.contains(&"soft_iron"), "{count}: {names:?}");
}

#[test]
fn val_soft_iron_needs_five_directions() {
    assert_no_soft_iron_on_two_headings(1.0);
    assert_iron_is_no_soft_iron(4);
    assert_eq!(named_in(5, SOFT_IRON)[0], "soft_iron");
}

#[test]
#[ignore = "a sweep of half a minute: .ci/nightly"]
fn val_soft_iron_in_two_to_seven_directions() {
    for apart in [0.5, 2.5, 3.0] {
        assert_no_soft_iron_on_two_headings(apart);
    }
    for count in [3, 5, 6, 7] {
        assert_iron_is_no_soft_iron(count);
    }
    for count in [6, 7] {
        assert_eq!(named_in(count, SOFT_IRON)[0], "soft_iron", "{count}");
    }
}

#[test]
fn a_speed_that_is_held_is_left_out() {
    for seed in SEEDS {
        let (mut log, _) = log(seed, 0.0, false);
        for (i, row) in log.rows.iter_mut().enumerate() {
            let wobble = if i < 1800 { 1e-4 * f64::from(u32::try_from(i % 7).unwrap()) } else { 0.3 };
            row.set(Column::SpeedLog, 1.5 + wobble);
        }
        let found = run(&log, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        assert!(found.notes.iter().any(|note| note.contains("from 1800 s to 2399 s")), "{:?}", found.notes);
        assert_eq!(found.effects[0].instance.candidate.effect, "water_current");
    }
}

#[test]
fn a_heading_that_is_negated_is_never_called_explained() {
    for seed in SEEDS {
        let (mut log, _) = log(seed, 0.0, false);
        for row in &mut log.rows {
            let heading = row.get(Column::Heading).unwrap();
            row.set(Column::Heading, -heading);
        }
        let d = run(&log, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        assert!(matches!(d.verdict, Verdict::Implausible | Verdict::Unexplained), "{:?} {:?}", d.verdict, d.remaining);
    }
}

#[test]
#[ignore = "a quarter of a minute: .ci/nightly"]
fn no_arm_is_longer_than_the_vehicle() {
    // As where the sign of the sway is wrong: the track in turns is that of a point far ahead. At one speed that is also
    // heading and velocity that are late.
    for seed in SEEDS {
        let (mut log, _) = at_speeds(seed, 0.0, true, |leg| [1.5, 0.75][usize::from(leg % 3 == 2)]);
        for row in &mut log.rows {
            let heading = row.get(Column::Heading).unwrap();
            let [north, east] = row.gnss_m().unwrap();
            row.set_all(Column::GpsX, &[north + 6.0 * heading.cos(), east + 6.0 * heading.sin()]);
        }
        let d = run(&log, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        let arms = ["gnss_lever_arm", "dvl_lever_arm"];
        assert!(d.effects.iter().all(|found| !arms.contains(&found.instance.candidate.effect)), "{:?}", d.effects);
        assert_eq!(d.verdict, Verdict::Unexplained, "{:?}", d.notes);
    }
}

#[test]
fn val_the_current_does_not_depend_on_where_the_cut_lies() {
    assert_current_wherever_the_log_begins(SEEDS[0], &[101]);
}

#[test]
#[ignore = "a sweep of a quarter of a minute: .ci/nightly"]
fn val_the_current_does_not_depend_on_where_other_cuts_lie() {
    for seed in SEEDS {
        assert_current_wherever_the_log_begins(seed, &[37, 101, 211]);
    }
}

fn assert_current_wherever_the_log_begins(seed: u64, from_rows: &[usize]) {
    let (log, _) = log(seed, 0.0, false);
    let current = |from: usize| {
        let part = Log { rows: log.rows[from..].to_vec(), ..Log::default() };
        let d = run(&part, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        let found = d.effects.iter().find(|f| f.instance.candidate.effect == "water_current").unwrap();
        found.values.clone()
    };
    let whole = current(0);
    for &from in from_rows {
        for ((a, b), truth) in whole.iter().zip(current(from)).zip([0.12, -0.08]) {
            // What is fitted of either log is another part of it: as two logs may, and each from the truth.
            let [own, other] = [a, &b].map(|value| (value.ci95[1] - value.ci95[0]) / (2.0 * Z_95));
            assert!((a.value - b.value).abs() < 3.0 * own.hypot(other), "{from}: {a:?} {b:?}");
            assert!((b.value - truth).abs() < 3.0 * other, "{from}: {b:?}");
        }
    }
}

#[test]
fn val_a_current_that_sets_in() {
    for seed in SEEDS {
        let (mut log, _) = log(seed, 0.0, false);
        for (second, row) in log.rows.iter_mut().enumerate() {
            let [north, east] = row.gnss_m().unwrap();
            let since = (second as f64 - 1100.0).max(0.0);
            // Still water before, and then 0.3 m/s to the south.
            row.set_all(Column::GpsX, &[north - 0.12 * second as f64 - 0.3 * since, east + 0.08 * second as f64]);
        }
        let d = run(&log, &VehicleFile::reference(), true, None).unwrap().diagnosis;
        let found = d.effects.iter().find(|f| f.instance.candidate.effect == "water_current").unwrap();
        let value = |name: &str| found.values.iter().find(|value| value.name == name).unwrap().value;
        assert!((value("north_mps") + 0.3).abs() < 0.03 && value("east_mps").abs() < 0.03, "{:?}", found.values);
        assert!((value("onset_s") - 1100.0).abs() < 60.0, "{:?}", found.values);
    }
}

/// At one speed fixes that are four seconds late are a slip of six metres: the log does not tell the two apart, and says so.
#[test]
fn late_fixes_at_one_speed_are_told_as_one_of_several() {
    for seed in SEEDS {
        let (mut log, _) = log(seed, 0.0, false);
        let fixes: Vec<[f64; 2]> = log.rows.iter().map(|row| row.gnss_m().unwrap()).collect();
        for (row, late) in log.rows[4..].iter_mut().zip(&fixes) {
            row.set_all(Column::GpsX, late);
        }
        let found = run(&log, &VehicleFile::reference(), true, None).unwrap();
        let d = found.diagnosis;
        let is_named = d.effects.iter().any(|found| found.instance.candidate.effect == "gnss_delay");
        let is_told = d.notes.iter().any(|note| note.contains("one of fixes that are late, or an antenna further aft"));
        assert!(is_named || is_told, "{:?} {:?}", d.effects, d.notes);
        assert!(is_named || d.verdict == Verdict::Unexplained, "{:?}", d.verdict);
        // Beside arms and a late heading nothing is known of the delay to a second.
        let (_, delay) = found.sigmas_beside_all.iter().find(|(effect, _)| *effect == "gnss_delay").unwrap();
        assert!(delay[0] > 0.7, "{delay:?}");
    }
}

/// Fixes, heading and velocity that are equally late are the same way at another time.
#[test]
fn val_what_is_equally_late_is_no_error() {
    let (mut log, _) = log(SEEDS[0], 0.0, false);
    for (second, row) in log.rows.iter_mut().enumerate() {
        row.set(Column::SpeedLog, 1.0 + 0.5 * (second as f64 / 9.0).sin());
    }
    let track = track::of(&log, false, None);
    let model = DeadReckoning { track, has_dvl: false, duration_s: log.duration_s(), length_m: 2.0 };
    let mut theta = vec![0.0; COLUMNS];
    theta[SIDESLIP] = -0.7;
    (theta[ARM], theta[HEADING + 1]) = (0.8, 0.2);
    let none = model.rows(&theta);
    for column in [LAG, FIX_DELAY, DVL_DELAY] {
        theta[column] = 2.0;
    }
    let late = model.rows(&theta);
    // Beyond the ends of the log nothing was read.
    let inner = |rows: &[Row]| rows[20..rows.len() - 20].to_vec();
    for channel in [0, 1] {
        let off: Vec<f64> = inner(&none)
            .iter()
            .zip(&inner(&late))
            .skip(channel)
            .step_by(2)
            .map(|(none, late)| late.residual - none.residual)
            .collect();
        for off_m in &off {
            assert!((off_m - off[0]).abs() < 0.02, "{off_m} {}", off[0]);
        }
        for row in inner(&late).iter().skip(channel).step_by(2) {
            let common = row.slopes[LAG] + row.slopes[FIX_DELAY] + row.slopes[DVL_DELAY];
            let first = &inner(&late)[channel];
            let of_first = first.slopes[LAG] + first.slopes[FIX_DELAY] + first.slopes[DVL_DELAY];
            assert!((common - of_first).abs() < 0.02, "{common} {of_first}");
        }
    }
}
