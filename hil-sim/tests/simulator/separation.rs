//! A manoeuvre that tells two causes apart: flown where the mission permits it, bounded, and back on the line.

use backseat_core::control::Manoeuvre;
use backseat_link::Client;
use backseat_wire::hostlink::Question;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{FlightLog, fly};
use hil_sim::scenario::{Effect, Scenario, Separate};
use std::sync::atomic::AtomicBool;

/// A fin is lost after ten minutes; the flight ends after 25.
fn flown(separate: Separate) -> FlightLog {
    let mut scenario = Scenario::built_in("survey").unwrap();
    let lost = Effect::new("fin_lost", &[("fin", 4.0), ("share", 0.4), ("time_s", 600.0)]).unwrap();
    scenario.settings.effects.push(lost);
    scenario.settings.duration_s = 1500.0;
    scenario.settings.separate = separate;
    let mut client = Client::new(InProcess::new());
    fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| {}).unwrap()
}

fn question(flight: &FlightLog) -> Option<Question> {
    flight.naming.iter().rev().find_map(|naming| naming.question)
}

#[test]
fn a_manoeuvre_is_flown_where_it_is_permitted_and_the_line_is_regained() {
    let flight = flown(Separate::OnLegs);
    let asked = question(&flight).expect("two causes stay open");
    eprintln!("{asked:?}");
    let manoeuvre = Manoeuvre::from_number(asked.manoeuvre).unwrap();
    let scenario = Scenario::built_in("survey").unwrap();
    let lines = scenario.settings.lines();
    let begun_s = asked.time_us as f64 * 1e-6;
    let (mut worst_m, mut after_m, mut deepest_m) = (0.0_f64, 0.0_f64, 0.0_f64);
    for sample in &flight.samples {
        let (t_s, x) = (sample.truth.time_us as f64 * 1e-6 - begun_s, &sample.truth.state);
        let east_m = |line: &hil_sim::scenario::SurveyLine| (x[1] - line.from_m[1]).abs();
        let across_m = lines.iter().map(east_m).fold(f64::INFINITY, f64::min);
        if (0.0..manoeuvre.duration_s()).contains(&t_s) {
            worst_m = worst_m.max(across_m);
            deepest_m = deepest_m.max(x[2]);
        } else if (manoeuvre.duration_s() + 30.0..manoeuvre.duration_s() + 40.0).contains(&t_s) {
            after_m = after_m.max(across_m);
        }
    }
    eprintln!("{worst_m} {after_m} {deepest_m}");
    // a filter whose vehicle has lost a fin is off by metres itself
    assert!(worst_m < 8.0 && after_m < 8.0 && deepest_m < 4.0, "{worst_m} {after_m} {deepest_m}");
    assert_eq!(question(&flown(Separate::Never)), None);
}
