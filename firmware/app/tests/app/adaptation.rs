//! The identifier runs when it may; what it finds is used when it proves better, and given up when it does not.

use crate::board::{Board, Direct, request_all};
use crate::flight::parameters;
use crate::world::World;
use backseat_app::parameters::PARAMETERS;
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_wire::hostlink::{Activity, Adoption, AdoptionEvent, Port, Refusal, ToBoard, Visibility, Waypoint};

/// Inertia, drag and thrust far from what is declared to the board; faster for the same propeller by a sixth.
pub fn other_vehicle() -> VehicleModel {
    let mut other = VehicleParameters::IVER3;
    for (value, factor) in other.m_diag.iter_mut().zip([1.0, 1.15, 0.85, 1.0, 1.2, 0.85]) {
        *value *= factor;
    }
    for (value, factor) in other.quadratic_diag.iter_mut().zip([0.85, 1.15, 1.15, 1.0, 0.85, 1.15]) {
        *value *= factor;
    }
    other.cl[0] *= 0.85;
    other.beta5_n_s2_per_rad2 *= 1.15;
    VehicleModel::new(&other).unwrap()
}

/// Turns, dives and changes of speed, over and over.
fn legs() -> Vec<Waypoint> {
    let round = [
        (60.0, 0.0, 6.0, 1.3),
        (90.0, 60.0, 3.0, 0.9),
        (20.0, 90.0, 8.0, 1.2),
        (-40.0, 60.0, 4.0, 1.4),
        (-20.0, 0.0, 7.0, 1.0),
        (30.0, 40.0, 3.0, 1.4),
        (40.0, -30.0, 6.0, 0.9),
        (-30.0, -20.0, 4.0, 1.3),
    ];
    let waypoint = |(x_m, y_m, depth_m, speed_mps)| Waypoint { x_m, y_m, depth_m, speed_mps };
    std::iter::once((0.0, 0.0, 3.0, 1.0)).chain(round.into_iter().cycle().take(100)).map(waypoint).collect()
}

/// A vehicle under way with a DVL on a board with these settings.
pub fn under_way(model: Option<VehicleModel>, settings: &[(&str, f64)]) -> (World, Direct) {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.model = model.unwrap_or(world.model);
    world.dvl = true;
    parameters(&mut board, &[("app.use_dvl", 1.0)]);
    parameters(&mut board, settings);
    world.run(&mut board, 10);
    let legs = legs();
    request_all(&mut board, &[ToBoard::MissionBegin { count: legs.len() as u16 }]);
    for (index, waypoint) in (0..).zip(legs) {
        request_all(&mut board, &[ToBoard::MissionItem { index, waypoint }]);
    }
    request_all(&mut board, &[ToBoard::MissionCommit, ToBoard::MissionStart]);
    (world, board)
}

/// Runs until a verdict, at most so long.
fn verdict(world: &mut World, board: &mut Direct, seconds: u64) -> Option<Adoption> {
    for _ in 0..seconds {
        world.run(board, 1);
        if let Some(verdict) = board.heard().adoptions.pop() {
            return Some(verdict);
        }
    }
    None
}

fn vehicle(board: &Direct) -> VehicleParameters {
    board.app().parameters().vehicle
}

#[test]
fn better_parameters_are_used_and_the_host_takes_them_back() {
    let (mut world, mut board) = under_way(Some(other_vehicle()), &[("app.robust", 0.0), ("app.adopt", 1.0)]);
    assert_eq!(vehicle(&board), VehicleParameters::IVER3);
    board.request(&ToBoard::AdoptionRevert);
    assert_eq!(board.heard().answers.pop(), Some(Err(Refusal::NotReady)));

    let adopted = verdict(&mut world, &mut board, 900).expect("a verdict");
    assert_eq!((adopted.event, adopted.changes, adopted.stretches), (AdoptionEvent::Adopted, 1, 10));
    // 7 % less drag and thrust are declared than there are; 10 stretches of 15 s show far more than noise does.
    assert!(adopted.error_other < 0.6 * adopted.error_active, "{adopted:?}");
    assert!(adopted.gain[0] > 3.5 * adopted.gain[1], "{adopted:?}");
    let speed = |p: &VehicleParameters| {
        let fins = 2.0 * p.rho_kg_per_m3 * p.fin_area_m2 * p.cd[0];
        libm::sqrt(p.beta5_n_s2_per_rad2 / (p.quadratic_diag[0] + fins))
    };
    let (truth, used) = (*world.model.parameters(), vehicle(&board));
    // DVL noise of 1 cm/s over minutes is below 1 %.
    assert!((speed(&used) / speed(&truth) - 1.0).abs() < 0.03, "{} {}", speed(&used), speed(&truth));
    assert!(PARAMETERS.iter().all(|p| (p.min..=p.max).contains(&p.get(board.app().parameters()))));

    request_all(&mut board, &[ToBoard::AdoptionRevert]);
    world.run(&mut board, 1);
    let reverted = board.heard().adoptions.pop().expect("a verdict");
    assert_eq!((reverted.event, reverted.changes), (AdoptionEvent::RevertedByHost, 2));
    // bit for bit what was declared
    assert_eq!(vehicle(&board), VehicleParameters::IVER3);
    let advised = verdict(&mut world, &mut board, 600).expect("a verdict");
    assert_eq!((advised.event, advised.changes), (AdoptionEvent::Advised, 2));
    assert_eq!(vehicle(&board), VehicleParameters::IVER3);
}

#[test]
fn what_predicts_no_better_is_refused() {
    let (mut world, mut board) = under_way(None, &[("app.robust", 0.0), ("app.adopt", 1.0)]);
    for _ in 0..3 {
        let refused = verdict(&mut world, &mut board, 900).expect("a verdict");
        assert_eq!((refused.event, refused.changes), (AdoptionEvent::Refused, 0), "{refused:?}");
    }
    assert_eq!(vehicle(&board), VehicleParameters::IVER3);
}

#[test]
fn what_proves_worse_afterwards_is_given_up() {
    let (mut world, mut board) = under_way(Some(other_vehicle()), &[("app.robust", 0.0), ("app.adopt", 1.0)]);
    let adopted = verdict(&mut world, &mut board, 900).expect("a verdict");
    assert_eq!(adopted.event, AdoptionEvent::Adopted);
    // From here on the vehicle is as it was declared at first.
    world.model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
    let mut reverted = verdict(&mut world, &mut board, 600).expect("a verdict");
    if reverted.event == AdoptionEvent::Refused {
        reverted = verdict(&mut world, &mut board, 600).expect("a verdict");
    }
    assert_eq!((reverted.event, reverted.changes), (AdoptionEvent::Reverted, 2), "{reverted:?}");
    assert_eq!(vehicle(&board), VehicleParameters::IVER3);
}

#[test]
fn without_leave_nothing_is_used() {
    let (mut world, mut board) = under_way(Some(other_vehicle()), &[]);
    let advised = verdict(&mut world, &mut board, 900).expect("a verdict");
    assert_eq!((advised.event, advised.changes), (AdoptionEvent::Advised, 0));
    assert_eq!(vehicle(&board), VehicleParameters::IVER3);
    let identified = board.heard().identifications.last().cloned().expect("a report");
    assert_eq!((identified.activity, identified.visibility[0]), (Activity::Adapting, Visibility::Known));
    assert!(identified.visibility.iter().filter(|v| **v != Visibility::Frozen).count() > 10, "{identified:?}");

    // The identification itself is switched off under way.
    parameters(&mut board, &[("app.adapt", 0.0)]);
    world.run(&mut board, 20);
    board.heard().identifications.clear();
    let adapted_s = |board: &mut Direct| board.heard().identifications.last().map(|i| (i.activity, i.adapted_s));
    world.run(&mut board, 20);
    let before = adapted_s(&mut board).expect("a report");
    world.run(&mut board, 30);
    assert_eq!(adapted_s(&mut board), Some(before));
    assert_eq!(before.0, Activity::Off);
}

#[test]
fn nothing_adapts_without_velocity_or_at_the_surface() {
    let (mut world, mut board) = under_way(None, &[]);
    let last = |board: &mut Direct| board.heard().identifications.last().map(|i| (i.activity, i.adapted_s));
    // -30 m, 5 m to the first waypoint at 3 m depth: it starts at the surface
    world.run(&mut board, 2);
    assert_eq!(last(&mut board).map(|(activity, _)| activity), Some(Activity::Surfaced));
    world.run(&mut board, 200);
    let (activity, adapted_s) = last(&mut board).expect("a report");
    assert!(activity == Activity::Adapting && adapted_s > 60.0, "{activity:?} {adapted_s}");

    world.silent[Port::Dvl as usize] = true;
    world.run(&mut board, 12);
    let (activity, frozen_s) = last(&mut board).expect("a report");
    assert_eq!(activity, Activity::NoVelocity);
    world.run(&mut board, 60);
    assert_eq!(last(&mut board), Some((Activity::NoVelocity, frozen_s)));

    // Lock comes back: the filter fills again, then it goes on from where it was.
    world.silent[Port::Dvl as usize] = false;
    world.run(&mut board, 30);
    let (activity, resumed_s) = last(&mut board).expect("a report");
    assert!(activity == Activity::Adapting && (frozen_s + 5.0..frozen_s + 30.0).contains(&resumed_s), "{resumed_s}");

    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 20);
    let (activity, stopped_s) = last(&mut board).expect("a report");
    assert_eq!(activity, Activity::NotUnderWay);
    world.run(&mut board, 60);
    assert_eq!(last(&mut board), Some((Activity::NotUnderWay, stopped_s)));
}

#[test]
fn what_passed_its_probation_is_stored_once_the_mission_is_over() {
    let (mut world, mut board) = under_way(Some(other_vehicle()), &[("app.robust", 0.0), ("app.adopt", 1.0)]);
    board.app_mut().restore(None);
    while verdict(&mut world, &mut board, 900).expect("a verdict").event != AdoptionEvent::Adopted {}
    assert_eq!(board.app().to_store(), None);
    // Probation and the next trial end together; one that is adopted starts a probation of its own.
    while verdict(&mut world, &mut board, 900).expect("a verdict").event == AdoptionEvent::Adopted {}
    assert_eq!(board.app().to_store(), None, "under way");
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    assert_eq!(board.app().to_store().map(|settings| settings.vehicle), Some(vehicle(&board)));
    assert_ne!(vehicle(&board), VehicleParameters::IVER3);
    request_all(&mut board, &[ToBoard::Unlock, ToBoard::ParameterBegin]);
    board.request(&ToBoard::MissionStart);
    assert_eq!(board.heard().answers.pop(), Some(Err(Refusal::NotReady)), "while it is written");
    board.app_mut().stored(true);
    world.run(&mut board, 1);
    assert_eq!(board.heard().adoptions.pop().map(|verdict| verdict.event), Some(AdoptionEvent::Stored));
    // Nobody asked, so nobody is answered.
    assert!(board.heard().answers.is_empty() && board.app().to_store().is_none());
}
