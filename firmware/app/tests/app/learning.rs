//! What a dive learns is the prior of the next one.

use crate::adaptation::{other_vehicle, under_way};
use crate::board::{Board, Direct, request_all};
use crate::flight::parameters;
use crate::world::World;
use backseat_app::parameters::Settings;
use backseat_core::navigation::{LEARNT_NAMES, Learnt};
use backseat_wire::hostlink::{Estimates, ToBoard};

/// Flies for so long and ends the mission.
fn dive(world: &mut World, board: &mut Direct, seconds: u64) {
    world.run(board, seconds);
    assert_eq!(board.app().to_store(), None, "under way");
    request_all(board, &[ToBoard::MissionStop]);
    world.run(board, 1);
}

/// What a dive of twelve minutes leaves.
fn learnt() -> Settings {
    let (mut world, mut board) = under_way(Some(other_vehicle()), &[]);
    board.app_mut().restore(None);
    dive(&mut world, &mut board, 720);
    let settings = *board.app().to_store().expect("to be written");
    assert_eq!(&settings, board.app().parameters());
    board.app_mut().stored(true);
    world.run(&mut board, 1);
    assert_eq!(board.heard().learnt_stored.pop().map(|stored| stored.kept), Some(true));
    assert_eq!(board.app().to_store(), None, "once a dive");
    settings
}

/// The first report of a board with these settings.
fn first_estimates(settings: &Settings) -> Estimates {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    assert!(board.app_mut().restore(Some(settings)));
    world.run(&mut board, 12);
    board.heard().estimates.first().cloned().expect("a report")
}

#[test]
fn the_next_dive_starts_from_what_was_learnt() {
    let settings = learnt();
    assert_eq!((settings.learnt.dives, settings.learnt.check()), (1, Ok(())));
    // The board does not know of it: thrust 15 % higher and drag 15 % lower, both over the known m11.
    let speed_factor = settings.learnt.mean[7] - settings.learnt.mean[3];
    let truth = libm::log(1.15 / 0.85);
    assert!((speed_factor - truth).abs() < 0.1, "{speed_factor} {truth}");

    let (before, after) = (first_estimates(&Settings::DEFAULT), first_estimates(&settings));
    assert_eq!((before.dives, after.dives), (0, 1));
    for (place, name) in LEARNT_NAMES.iter().enumerate() {
        let of = |estimates: &Estimates| *estimates.estimates.iter().find(|e| usize::from(e.place) == place).unwrap();
        // They start alike but for what was learnt; twelve seconds at the surface add little.
        let (fresh, kept) = (of(&before), of(&after));
        assert!(kept.sigma <= fresh.sigma * 1.01, "{name}: {kept:?} {fresh:?}");
    }
    let separable = |estimates: &Estimates| estimates.estimates.iter().filter(|e| e.separable).count();
    assert!(separable(&after) > separable(&before) && separable(&before) == 0, "{before:?} {after:?}");
}

#[test]
fn another_vehicle_and_the_host_s_wish_forget_it() {
    let settings = learnt();
    let board_after = |values: &[(&str, f64)]| {
        let mut board = Direct::new(None);
        assert!(board.app_mut().restore(Some(&settings)));
        parameters(&mut board, values);
        board.app().parameters().learnt
    };
    assert_eq!(board_after(&[("installation.sound_speed_mps", 1490.0)]), settings.learnt);
    assert_eq!(board_after(&[("vehicle.mass_kg", 38.5)]), Learnt::NONE);
    assert_eq!(board_after(&[("effects.heading_bias.const_rad", 0.01)]), Learnt::NONE);
    let forgotten = board_after(&[("learnt.mass_sigma[0]", 0.0)]);
    assert_eq!((forgotten.sigma[0], forgotten.sigma[1]), (0.0, settings.learnt.sigma[1]));
}

#[test]
fn correlations_of_no_covariance_are_refused() {
    let mut board = Direct::new(None);
    request_all(&mut board, &[ToBoard::Unlock, ToBoard::ParameterBegin]);
    for (name, value) in [("learnt.mass_sigma[0]", 0.1), ("learnt.mass_sigma[1]", 0.1), ("learnt.correlation_m22", 1.0)]
    {
        request_all(&mut board, &[ToBoard::ParameterSet { name, value }]);
    }
    assert!(board.answer(&ToBoard::ParameterCommit).unwrap().is_err());
    assert_eq!(board.app().parameters().learnt, Learnt::NONE);
}

#[test]
fn a_short_dive_and_the_nominal_filter_leave_nothing() {
    for (settings, seconds) in [(&[][..], 300), (&[("app.robust", 0.0)][..], 700)] {
        let (mut world, mut board) = under_way(None, settings);
        board.app_mut().restore(None);
        dive(&mut world, &mut board, seconds);
        assert_eq!((board.app().to_store(), board.app().parameters().learnt), (None, Learnt::NONE), "{settings:?}");
    }
}
