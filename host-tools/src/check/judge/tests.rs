use super::*;
use backseat_wire::hostlink::{Image, ImageId, ParameterInfo, Stack};

fn look(before: [u32; 5], after: [u32; 5]) -> Look {
    let health = |receive_losses| Health {
        accepted_frames: [0; 4],
        rejected_frames: [0; 4],
        pps_edges: 0,
        synchronised: false,
        receive_losses,
        late_steps: 0,
        latest_step_us: 0,
        hardware: None,
        refused_requests: 0,
        fittings: Default::default(),
        oscillator: Oscillator::Crystal,
        log: BoardLog::NONE,
    };
    Look {
        identity: Identity {
            firmware: String::new(),
            schema: PARAMETER_SCHEMA,
            image: ImageId::default(),
            restart: None,
            earlier_crashes: Vec::new(),
        },
        images: None,
        parameters: Vec::new(),
        waypoints: 0,
        counters: (health(before), health(after)),
        telemetry: Vec::new(),
        watched: Duration::from_secs(3),
        now_us: 0,
        has_key: false,
    }
}

#[test]
fn hardware_that_fails_is_no_go() {
    let stacks = [Stack { used: 15_000, room: 24_576 }, Stack { used: 7_000, room: 16_384 }];
    let good =
        Hardware { brown_out_level: 3, longest_step_us: 8_700, load_permille: 90, stacks, ..Hardware::default() };
    let of = |hardware| {
        let mut look = look([0; 5], [0; 5]);
        look.counters.1.hardware = hardware;
        super::hardware(&look)
    };
    let found = "load 9 %, longest step 8.7 ms, stacks 15000 of 24576 and 7000 of 16384 bytes";
    assert_eq!(of(Some(good)), CheckLine::new(Verdict::Pass, "hardware", found));
    let full = [Stack { used: 23_000, room: 24_576 }, good.stacks[1]];
    for (hardware, verdict) in [
        (None, Verdict::Note),
        (Some(Hardware { supply_dips: 1, ..good }), Verdict::Fail),
        (Some(Hardware { brown_out_level: 0, ..good }), Verdict::Note),
        (Some(Hardware { wrong_bits: [2, 0], ..good }), Verdict::Note),
        (Some(Hardware { lost_edges: 1, ..good }), Verdict::Note),
        (Some(Hardware { wrong_bits: [0, 1], ..good }), Verdict::Fail),
        (Some(Hardware { load_permille: 900, ..good }), Verdict::Fail),
        (Some(Hardware { stacks: full, ..good }), Verdict::Fail),
    ] {
        assert_eq!(of(hardware).verdict, verdict, "{hardware:?}");
    }
}

#[test]
fn an_image_on_trial_is_no_go() {
    let tried = StoredImage { image: Image::default(), starts: 3, confirmed: false };
    for (trial, other, verdict) in [
        (None, None, Verdict::Pass),
        (None, Some(StoredImage { confirmed: true, ..tried }), Verdict::Pass),
        (None, Some(tried), Verdict::Note),
        (Some(1), None, Verdict::Fail),
    ] {
        assert_eq!(images(&Images { trial, other }).verdict, verdict, "{trial:?} {other:?}");
    }
}

/// A flag as the board declares it.
fn flag(name: &'static str, value: f64) -> Declared {
    let (unit, min, max) = ("1", 0.0, 1.0);
    Declared::new(&ParameterInfo { index: 0, count: 1, name, unit, value, min, max, default: 1.0 }, false)
}

#[test]
fn no_log_is_no_go_unless_the_mission_says_otherwise() {
    let of = |state, parameters| {
        let mut look = look([0; 5], [0; 5]);
        look.counters.1.log = BoardLog { state, lost_records: 0 };
        look.parameters = parameters;
        log(&look).verdict
    };
    for (state, verdict) in [
        (LogState::NotFitted, Verdict::Note),
        (LogState::Searching, Verdict::Fail),
        (LogState::Failed, Verdict::Fail),
        (LogState::Full, Verdict::Fail),
        (LogState::Writing, Verdict::Pass),
    ] {
        assert_eq!(of(state, Vec::new()), verdict, "{state:?}");
        assert_eq!(of(state, vec![flag("app.log_required", 1.0)]), verdict, "{state:?}");
        let optional = if verdict == Verdict::Fail { Verdict::Note } else { verdict };
        assert_eq!(of(state, vec![flag("app.log_required", 0.0)]), optional, "{state:?}");
    }
}

#[test]
fn a_board_without_pps_fails_where_a_computer_is_noted() {
    for (hardware, verdict) in [(None, Verdict::Note), (Some(Hardware::default()), Verdict::Fail)] {
        let mut look = look([0; 5], [0; 5]);
        look.parameters = vec![flag("app.use_range", 1.0)];
        look.counters.1.hardware = hardware;
        assert_eq!(pps(&look).verdict, verdict, "{hardware:?}");
    }
}

#[test]
fn losses_fail_while_they_happen() {
    let cases = [
        ([0; 5], [0; 5], Verdict::Pass, "none on any port since start"),
        ([0, 0, 7, 0, 0], [0, 0, 7, 0, 0], Verdict::Note, "in 3 s: ahrs 0 (7 since start)"),
        ([0, 0, 7, 0, 0], [0, 2, 8, 0, 0], Verdict::Fail, "in 3 s: dvl 2 (2 since start), ahrs 1 (8 since start)"),
    ];
    for (before, after, verdict, found) in cases {
        assert_eq!(losses(&look(before, after)), CheckLine::new(verdict, "receive losses", found));
    }
}
