//! The board asks the water: two causes are open, a manoeuvre is flown, the vehicle is back on its line.

use backseat_core::control::Manoeuvre;
use backseat_link::Client;
use backseat_wire::hostlink::Question;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{FlightLog, fly};
use hil_sim::scenario::Scenario;
use std::sync::atomic::AtomicBool;

/// A fin loses three tenths of its lift on the first line; that it stands still is as likely at first.
fn flown(separate: &str) -> FlightLog {
    let text = include_str!("../../scenarios/survey.toml")
        .replace("\nseed = 1\n", &format!("\nseed = 560005\nseparate = \"{separate}\"\n"))
        .replace("duration_s = 12_000.0", "duration_s = 1240.0");
    let effect = "[effects.fin_lost]\nfin = \"starboard\"\nshare = 0.7\ntime_s = 700.0\n";
    let scenario = Scenario::with_built_in_vehicle(&format!("{text}\n{effect}"), "separation.toml").unwrap();
    fly(&scenario, &mut Client::new(InProcess::new()), None, &AtomicBool::new(false), |_| {}).unwrap()
}

#[test]
fn a_fin_that_is_lost_or_stuck_is_moved_where_that_is_permitted() {
    let (asked, silent) = rayon::join(|| flown("on legs"), || flown("never"));
    assert!(silent.naming.iter().all(|naming| naming.question.is_none()) && !silent.naming.is_empty());
    let told: Vec<Question> = asked.naming.iter().filter_map(|naming| naming.question).collect();
    let last = told.last().expect("two causes stay open");
    eprintln!("{told:?}");
    // of fin_lost starboard against fin_stuck starboard
    assert_eq!((last.causes, last.manoeuvre), ([4, 8], Manoeuvre::Elevator.number()));
    assert!(last.after.unwrap() > 3.0, "{last:?}");
    let begun_us = told[0].time_us;
    for (asked, silent) in asked.samples.iter().zip(&silent.samples) {
        let (with, without) = (&asked.truth.state, &silent.truth.state);
        let apart_m = (with[0] - without[0]).hypot(with[1] - without[1]);
        match asked.truth.time_us {
            time_us if time_us < begun_us => assert_eq!(with, without, "the same until then"),
            time_us if time_us < begun_us + 60_000_000 => {
                assert!(apart_m < 10.0 && (with[2] - without[2]).abs() < 1.5, "{with:?} {without:?}");
            }
            // the filters have not seen the same since
            _ => assert!(apart_m < 10.0 && (with[2] - without[2]).abs() < 0.3, "{with:?} {without:?}"),
        }
    }
}
