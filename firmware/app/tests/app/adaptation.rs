//! The identifier runs when it may, and changes nothing that is in use.

use crate::board::{Board, Direct, request_all};
use crate::flight::{parameters, start_along};
use crate::world::World;
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_wire::hostlink::{Activity, Port, ToBoard, Visibility, Waypoint};

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
    start_along(&mut board, &legs());
    (world, board)
}

fn vehicle(board: &Direct) -> VehicleParameters {
    board.app().parameters().vehicle
}

#[test]
fn what_is_identified_is_reported_and_not_used() {
    let (mut world, mut board) = under_way(Some(other_vehicle()), &[]);
    world.run(&mut board, 300);
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
