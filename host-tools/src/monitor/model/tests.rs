//! What frames make of the model.

use super::*;
use backseat_app::parameters::{PARAMETERS, ParameterStore};
use backseat_core::navigation::Sensor;
use backseat_wire::hostlink::{
    Activity, BoardLog, Crash, FusionTelemetry, Hardware, Held, ImageId, MAX_FRAME, ModeReason, Oscillator, Stack,
    Visibility, encode,
};

/// The frame of a message, as it comes over the line.
pub fn frame(message: &FromBoard<'_>) -> Vec<u8> {
    encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()
}

pub fn feed(model: &mut Model, now_us: u64, message: &FromBoard<'_>) {
    model.receive(now_us, &frame(message));
}

/// Steps of the flight below and the board's messages in each of them.
const STEPS: u64 = 900;
const EPOCH_US: u64 = 1_748_952_000_000_000;

/// A vehicle 10 cm further north with every step, then east.
pub fn record(step: u64) -> Telemetry {
    let (north, east) = if step < 600 { (step as f64 * 0.1, 0.0) } else { (60.0, (step - 600) as f64 * 0.1) };
    let mut state = [0.0; 12];
    state[..9].copy_from_slice(&[
        north,
        east,
        3.02,
        0.01,
        -0.03,
        if step < 600 { 0.0 } else { 1.57 },
        1.0,
        0.02,
        -0.01,
    ]);
    let mut sigma = [0.01; 12];
    sigma[..2].copy_from_slice(&[0.6, 0.4]);
    Telemetry {
        time_us: step * 100_000,
        utc_us: EPOCH_US + step * 100_000,
        mode: Mode::Navigating,
        reason: ModeReason::Nominal,
        state,
        sigma,
        cov_xy_m2: 0.1,
        current_mps: [0.05, 0.1],
        propeller_radps: 103.0,
        fins_rad: [0.02, 0.02, -0.05, 0.05],
        leg: (step >= 10).then_some(u16::from(step >= 600) + 1),
        rejected_frames: [0; 4],
        level_m: [10.0, 1.0],
    }
}

pub fn fusion(sensor: Sensor, axis: u8, time_us: u64, innovation: f64) -> FromBoard<'static> {
    let outcome = u8::from(innovation.abs() > 5.0);
    FromBoard::Fusion(FusionTelemetry { sensor: sensor as u8, axis, outcome, time_us, innovation, variance: 1.0 })
}

fn identification(time_us: u64) -> FromBoard<'static> {
    let of = theta_of(&Settings::DEFAULT.vehicle);
    let grown = 1.0 + time_us as f64 * 1e-9;
    let mut visibility = [Visibility::Separate; 21];
    visibility[..5].copy_from_slice(&[
        Visibility::Known,
        Visibility::Collinear,
        Visibility::Collinear,
        Visibility::Frozen,
        Visibility::Frozen,
    ]);
    FromBoard::Identification(Identification {
        time_us,
        activity: Activity::Adapting,
        adapted_s: time_us as f64 * 1e-6,
        theta: std::array::from_fn(|j| if j == 0 { of[j] } else { of[j] * (1.0 + (grown - 1.0) * j as f64) }),
        visibility,
        drifted: 0,
    })
}

/// A model that has heard a flight of ninety seconds, and the time now.
pub fn flying() -> (Model, u64) {
    let mut model = Model::new();
    feed(
        &mut model,
        0,
        &FromBoard::Hello { firmware: "backseat 0.1.0", parameter_schema: PARAMETER_SCHEMA, image: ImageId::default() },
    );
    let mut store = ParameterStore::new();
    store.begin();
    for (name, value) in
        [("effects.thrust_loss.k_n_s2_per_rad_m", 0.012), ("app.use_dvl", 1.0), ("app.current_state", 1.0)]
    {
        store.set(name, value, false).unwrap();
    }
    store.commit(false, |_, _, _| true).unwrap();
    for index in 0..PARAMETERS.len() {
        feed(&mut model, 0, &FromBoard::Parameter(store.info(index as u16).unwrap()));
    }
    let corners = [[0.0, -5.0], [0.0, 0.0], [60.0, 0.0], [60.0, 80.0]];
    for (index, [x_m, y_m]) in (0..).zip(corners) {
        let waypoint = Some(Waypoint { x_m, y_m, depth_m: 3.0, speed_mps: 1.0 });
        feed(&mut model, 0, &FromBoard::Mission { index, count: 4, waypoint });
    }
    let ship = Ship { time_us: 0, position_m: [20.0, 60.0], velocity_mps: [0.5, 0.0], sigma_m: 0.5 };
    feed(&mut model, 0, &FromBoard::Ship(ship));
    let mut now_us = 0;
    for step in 0..STEPS {
        now_us = step * 100_000;
        let wobble = ((step % 7) as f64 - 3.0) / 2.0;
        for axis in 0..3 {
            feed(&mut model, now_us, &fusion(Sensor::Attitude, axis, now_us, wobble));
            feed(&mut model, now_us, &fusion(Sensor::Rates, axis, now_us, 0.5 * wobble));
        }
        if step % 2 == 0 {
            feed(&mut model, now_us, &fusion(Sensor::Depth, 0, now_us, 0.7));
            feed(&mut model, now_us, &fusion(Sensor::BottomTrack, 0, now_us, wobble));
        }
        if step % 300 == 0 {
            let innovation = if step == 300 { 7.5 } else { 1.2 };
            feed(&mut model, now_us, &fusion(Sensor::Range, 0, now_us, innovation));
        }
        feed(&mut model, now_us, &FromBoard::Telemetry(record(step)));
        if step % 100 == 99 {
            feed(&mut model, now_us, &identification(now_us));
        }
        if step % 10 == 0 {
            let count = |per_s: u32| per_s * (step / 10) as u32;
            feed(
                &mut model,
                now_us,
                &FromBoard::Health(Health {
                    accepted_frames: [count(14), count(5), count(20), 3],
                    rejected_frames: [0, 0, 2, 0],
                    pps_edges: count(1),
                    synchronised: true,
                    receive_losses: [0; 5],
                    oscillator: Oscillator::Crystal,
                    log: BoardLog::NONE,
                    late_steps: 0,
                    latest_step_us: 0,
                    hardware: None,
                    refused_requests: 0,
                    fittings: Default::default(),
                }),
            );
        }
        model.tick(now_us);
    }
    (model, now_us)
}

/// What a real board says of itself, on top of it: two crashes, one of them kept.
pub fn of_a_board(model: &mut Model, now_us: u64) {
    let stacks = [Stack { used: 14_436, room: 24_576 }, Stack { used: 9056, room: 20_480 }];
    let hardware = Hardware {
        brown_out_level: 3,
        longest_step_us: 12_340,
        load_permille: 321,
        lost_edges: 2,
        stacks,
        ..Hardware::default()
    };
    let log = BoardLog { state: LogState::Writing, lost_records: 0 };
    let health = Health { log, hardware: Some(hardware), ..model.health.unwrap() };
    feed(model, now_us, &FromBoard::Health(health));
    let crash = Crash { pc: 0x0800_1234, step: 77, stacks: [9000, 8000], ..Crash::default() };
    let cause = backseat_wire::hostlink::ResetCause::Fault;
    feed(model, now_us, &FromBoard::Restart(Restart { cause, resets: 2, safe: false, crash: Some(crash) }));
    let crash = Crash { step: 33, ..Crash::at("app/src/app.rs", 12) };
    feed(model, now_us, &FromBoard::EarlierCrash(KeptCrash { crash, overwritten: 0 }));
}

#[test]
fn what_the_board_is_short_of_is_an_alarm() {
    let (mut model, now_us) = flying();
    of_a_board(&mut model, now_us);
    assert!(alarms(&model, now_us).is_empty(), "{:?}", alarms(&model, now_us));
    let crashes = model.crash_texts();
    assert!(crashes[0].starts_with("fault at 0x08001234") && crashes[1].starts_with("panic at app/src/app.rs:12"));
    let health = model.health.unwrap();
    let good = health.hardware.unwrap();
    let full = Stack { used: 24_000, ..good.stacks[0] };
    let hardware = Hardware { wrong_bits: [3, 1], load_permille: 850, stacks: [full, good.stacks[1]], ..good };
    let log = BoardLog { state: LogState::Full, lost_records: 5 };
    feed(&mut model, now_us, &FromBoard::Health(Health { log, hardware: Some(hardware), ..health }));
    assert_eq!(
        alarms(&model, now_us),
        [
            "1 wrong bits in the board's memory, not corrected",
            "board log: card is full",
            "load of the board 85 %",
            "stack of interrupts used 24000 of 24576 bytes"
        ]
    );
    let (object, _) = crate::monitor::json::object(&model, now_us, 0);
    assert_eq!((&object["resets"], object["crashes"].as_array().unwrap().len()), (&serde_json::json!(2), 2));
}

fn texts(model: &Model) -> Vec<&str> {
    model.journal.since(0).0.map(|event| event.text.as_str()).collect()
}

fn alarms(model: &Model, now_us: u64) -> Vec<String> {
    model.alarms(now_us).into_iter().map(|alarm| alarm.text).collect()
}

#[test]
fn a_flight_is_gathered_from_its_frames() {
    let (model, now_us) = flying();
    assert_eq!(
        texts(&model),
        ["backseat 0.1.0", "navigating", "mission under way, leg 2", "range rejected, 7.5 sigmas", "leg 3"]
    );
    assert!(alarms(&model, now_us).is_empty(), "{:?}", alarms(&model, now_us));
    let rates = |sensor: Sensor| {
        let source = model.sources.iter().find(|source| source.sensor == sensor).unwrap();
        (source.rate_hz(now_us).unwrap(), source.fused, source.rejected)
    };
    assert_eq!(rates(Sensor::Attitude), (10.0, 900, 0));
    assert_eq!(rates(Sensor::BottomTrack), (5.0, 450, 0));
    assert_eq!((rates(Sensor::Range).1, rates(Sensor::Range).2), (2, 1));
    assert_eq!((model.link.records, model.link.gaps, model.link.broken), (900, 0, 0));
    assert_eq!(model.link.record_rate.per_s(), Some(10.0));
    let per_port: Vec<f64> = model.port_rates.iter().map(|rate| rate.per_s().unwrap()).collect();
    assert_eq!(per_port, [14.0, 5.0, 20.0, 0.0]);
    // half a metre apart
    assert!((170..=182).contains(&model.track().len()), "{}", model.track().len());
    let (speed, towards_rad, trend) = model.current().unwrap();
    assert!((speed - 0.05_f64.hypot(0.1)).abs() < 1e-12 && (towards_rad - 2_f64.atan()).abs() < 1e-12);
    assert_eq!(trend.len(), 9);
    let identified = model.identified();
    // the sixth grows by five parts in 1e9 of each µs
    assert!((identified[5].change.unwrap() - 5.0 * 89.9e-3).abs() < 1e-9, "{:?}", identified[5]);
    assert_eq!((identified[5].trend.len(), identified[0].visibility), (9, Visibility::Known));
    assert_eq!(model.mission.len(), 4);
}

#[test]
fn broken_and_missing_frames_are_counted() {
    let mut model = Model::new();
    // the end of an earlier program's frame is no error
    model.receive(0, b"junk\0");
    feed(&mut model, 0, &FromBoard::Telemetry(record(0)));
    let mut bytes = frame(&FromBoard::Telemetry(record(1)));
    bytes[20] ^= 1;
    model.receive(1, &bytes);
    feed(&mut model, 2, &FromBoard::Telemetry(record(2)));
    feed(&mut model, 3, &FromBoard::Telemetry(record(7)));
    let link = &model.link;
    assert_eq!((link.broken, link.frames, link.gaps, link.missing), (1, 3, 2, 5));
}

#[test]
fn however_the_bytes_are_cut() {
    let bytes: Vec<u8> = (0..50).flat_map(|step| frame(&FromBoard::Telemetry(record(step)))).collect();
    for cut in [1, 7, 300] {
        let mut model = Model::new();
        bytes.chunks(cut).for_each(|bytes| model.receive(0, bytes));
        assert_eq!((model.link.records, model.link.broken), (50, 0));
    }
}

#[test]
fn a_board_that_starts_again_is_another_flight() {
    let (mut model, now_us) = flying();
    feed(&mut model, now_us + 100_000, &FromBoard::Telemetry(Telemetry { leg: None, ..record(1) }));
    assert_eq!((model.track().len(), model.sources.len(), model.link.gaps), (1, 0, 0));
    assert!(model.identification().is_none());
    assert!(texts(&model).contains(&"the board started again"));
    assert_eq!(model.question(now_us + 3_000_000), Some(ToBoard::HealthGet));
    assert_eq!(model.question(now_us + 4_500_000), Some(ToBoard::HealthGet), "it was not answered");
}

#[test]
fn alarms_tell_what_is_wrong_and_stop_when_it_is_not() {
    let (mut model, now_us) = flying();
    // two seconds without attitude, with ranges that are all rejected
    let mut time_us = now_us;
    for step in STEPS..STEPS + 25 {
        time_us = step * 100_000;
        feed(&mut model, time_us, &fusion(Sensor::Rates, 0, time_us, 0.1));
        feed(&mut model, time_us, &fusion(Sensor::BottomTrack, 0, time_us, 0.1));
        feed(&mut model, time_us, &fusion(Sensor::Depth, 0, time_us, 0.1));
        if step % 8 == 0 {
            feed(&mut model, time_us, &fusion(Sensor::Range, 0, time_us, -20.0));
        }
        feed(&mut model, time_us, &FromBoard::Telemetry(record(step)));
    }
    assert_eq!(alarms(&model, time_us), ["attitude silent for 2 s", "range rejected 3 times in a row"]);
    feed(&mut model, time_us, &fusion(Sensor::Attitude, 0, time_us, 0.1));
    feed(&mut model, time_us, &fusion(Sensor::Range, 0, time_us + 1, 0.1));
    assert!(alarms(&model, time_us).is_empty());
    assert!(texts(&model).contains(&"range fused again after 3 rejections"));
    let degraded = Telemetry { mode: Mode::Degraded, reason: ModeReason::DepthStale, ..record(STEPS + 25) };
    feed(&mut model, time_us, &FromBoard::Telemetry(degraded));
    assert_eq!(alarms(&model, time_us), ["degraded: depth missing or stale"]);
    // what the operator did is no alarm
    let stopped = Telemetry { mode: Mode::Safe, reason: ModeReason::Stopped, leg: None, ..record(STEPS + 26) };
    feed(&mut model, time_us, &FromBoard::Telemetry(stopped));
    assert!(alarms(&model, time_us).is_empty());
    assert!(texts(&model).contains(&"mission ended before its time"));
    model.restart = None;
    let restart = Restart { cause: backseat_wire::hostlink::ResetCause::Watchdog, resets: 3, safe: true, crash: None };
    feed(&mut model, time_us, &FromBoard::Restart(restart));
    assert_eq!(alarms(&model, time_us), ["reset too often by faults"]);
}

#[test]
fn it_is_shown_who_steers() {
    let (mut model, now_us) = flying();
    let held = Held { heading_rad: -0.5, depth_m: 2.0, speed_mps: 1.2 };
    let told = |time_us, by_host| FromBoard::Steered(Steered { time_us, by_host });
    feed(&mut model, now_us, &told(now_us, Some(held)));
    feed(&mut model, now_us, &told(now_us, Some(Held { heading_rad: 1.0, ..held })));
    feed(&mut model, now_us, &told(now_us, Some(held)));
    assert_eq!(texts(&model).last(), Some(&"a host steers: 331° 2.0 m 1.20 m/s"));
    let (object, _) = crate::monitor::json::object(&model, now_us, 0);
    assert_eq!(object["helm"]["depth_m"], 2.0);
    feed(&mut model, now_us, &told(now_us, None));
    assert_eq!((model.helm(), texts(&model).last()), (None, Some(&"no host steers any more")));
    // its end was not heard
    feed(&mut model, now_us, &told(now_us, Some(held)));
    for step in STEPS..STEPS + 125 {
        feed(&mut model, now_us, &FromBoard::Telemetry(record(step)));
        assert_eq!(model.helm().is_some(), step < STEPS + 119, "step {step}");
    }
}

#[test]
fn json_holds_what_the_screen_shows() {
    let (model, now_us) = flying();
    let (object, seen) = crate::monitor::json::object(&model, now_us, 0);
    assert_eq!(object["mode"], "navigating");
    assert_eq!(object["navigation"]["state"]["y_m"].as_f64().unwrap(), record(STEPS - 1).state[1]);
    assert_eq!(object["sensors"]["dvl"]["rate_hz"], 5.0);
    assert_eq!(object["sensors"]["range"]["rejected"], 1);
    assert_eq!(object["effects"]["thrust_loss.k_n_s2_per_rad_m"], 0.012);
    assert_eq!(object["identification"]["parameters"]["m11"]["visibility"], "known");
    assert_eq!(object["ship"]["position_m"][1], 60.0);
    assert_eq!(object["ports"]["ahrs"]["refused"], 2);
    assert_eq!(object["link"]["telemetry_per_s"], 10.0);
    assert_eq!(object["events"].as_array().unwrap().len(), 5);
    // each event once
    let (object, _) = crate::monitor::json::object(&model, now_us, seen);
    assert!(object["events"].as_array().unwrap().is_empty());
}
