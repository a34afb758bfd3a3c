//! A board on the bench and in the water: the app, its clock, and the simulated vehicle around it.

use crate::false_inputs::HOST_KEY;
use crate::finite;
use backseat_app::{App, Progress, Pump, parameters};
use backseat_wire::hostlink::{
    Decoder, FromBoard, MAX_FRAME, MAX_MESSAGE, Mode, ModeReason, Port, Signed, Telemetry, ToBoard, Waypoint, encode,
};
use backseat_wire::iver::{Servo, ServoBytes, ToFrontseat, Units};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::Key;
use hil_sim::backseat::Memory;
use hil_sim::devices::Devices;
use hil_sim::flight::board_parameters;
use hil_sim::scenario::Scenario;
use hil_sim::world::World;
use std::sync::OnceLock;

/// Time between two steps, µs.
pub(crate) const STEP_US: u64 = backseat_app::STEP_US;
const SECOND_US: u64 = 1_000_000;
/// Longer than the app takes to believe its sensors again: three clock labels that agree, ten seconds of rejected fixes
/// that agree.
const SETTLE_S: u64 = 45;
/// An estimate this far off is no reason not to start, m: five sigmas of a fix.
const NEAR_M: f64 = 15.0;
/// Who starts no further off, horizontally and in depth, and before the end of the first leg, is on its way, m.
const FOUND_M: [f64; 2] = [5.0, 1.0];
/// A mission that lasts so long goes on.
const FIRST_S: u64 = 5;
/// A run at the surface and half of a dive.
const MISSION_S: u64 = 35;
/// `survey` starts here, heading north, m.
const START_M: f64 = -100.0;
/// Where the legs end, north, and their depth, m.
const LEGS: [(f64, f64); 2] = [(-92.0, 0.0), (100.0, 3.0)];

/// The scenario that every board flies.
pub(crate) fn scenario() -> &'static Scenario {
    static SCENARIO: OnceLock<Scenario> = OnceLock::new();
    SCENARIO.get_or_init(|| Scenario::built_in("survey").expect("it is built in"))
}

/// The app and everything that it said.
pub(crate) struct Board {
    app: Box<App>,
    now_us: u64,
    /// The latest time that the app has seen.
    latest_us: u64,
    host: Decoder,
    frontseat: Framer,
    telemetry: Option<Telemetry>,
    /// The last answer to a request: whether it was carried out.
    answer: Option<Result<(), String>>,
    /// The last fin command.
    servo: ServoBytes,
    /// Commands change no faster than their rates, but for neutral.
    steady: bool,
    /// Of the operator's last request.
    counter: u64,
}

impl Board {
    pub(crate) fn new() -> Self {
        Self {
            app: Box::new(App::new()),
            now_us: 0,
            latest_us: 0,
            host: Decoder::new(),
            frontseat: Framer::new(Checksum::Required),
            telemetry: None,
            answer: None,
            servo: ServoBytes::NEUTRAL,
            steady: false,
            counter: 0,
        }
    }

    pub(crate) fn wait(&mut self, us: u64) {
        self.now_us += us;
    }

    pub(crate) fn back(&mut self, us: u64) {
        self.now_us = self.now_us.saturating_sub(us);
    }

    pub(crate) fn receive(&mut self, port: Port, bytes: &[u8]) {
        self.tell_time();
        self.app.receive(port, self.now_us, bytes);
    }

    pub(crate) fn edge(&mut self) {
        self.tell_time();
        self.app.pps(self.now_us);
    }

    pub(crate) fn step(&mut self) {
        self.tell_time();
        self.app.step(self.now_us);
    }

    fn tell_time(&mut self) {
        self.latest_us = self.latest_us.max(self.now_us);
    }

    /// Takes what waits on a port.
    fn take(&mut self, port: Port) -> Vec<u8> {
        let mut bytes = Vec::new();
        while !self.app.transmit(port).is_empty() {
            let count = self.app.transmit(port).len();
            bytes.extend_from_slice(self.app.transmit(port));
            self.app.transmitted(port, count);
        }
        bytes
    }

    /// Takes what waits on all ports and judges it; what went to the devices.
    pub(crate) fn drain(&mut self) -> [(Port, Vec<u8>); 4] {
        let said = self.take(Port::Host);
        self.hear(&said);
        let sent = Port::DEVICES.map(|port| (port, self.take(port)));
        self.judge(&sent[0].1);
        sent
    }

    /// Lets `pump` move what is to be moved now, and judges it; what went to the devices.
    pub(crate) fn poll(&mut self, pump: &mut Pump, ports: &mut [Memory; 5]) -> [(Port, Vec<u8>); 4] {
        self.tell_time();
        while pump.poll(&mut self.app, ports, self.now_us) == Ok(Progress::Moved) {}
        let said = core::mem::take(&mut ports[Port::Host as usize].from_board);
        self.hear(&said);
        let sent = Port::DEVICES.map(|port| (port, core::mem::take(&mut ports[port as usize].from_board)));
        self.judge(&sent[0].1);
        sent
    }

    /// Nothing moves, and no mission is asked for.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.app.lends_clock()
    }

    /// The last telemetry since this was asked, and the last answer.
    pub(crate) fn heard(&mut self) -> (Option<Telemetry>, Option<Result<(), String>>) {
        (self.telemetry.take(), self.answer.take())
    }

    /// Takes what the board says to the host.
    fn hear(&mut self, mut rest: &[u8]) {
        while let Some(frame) = self.host.feed(&mut rest) {
            match frame.expect("its frames are good").message().expect("its messages are known") {
                FromBoard::Telemetry(record) => {
                    finite(&record);
                    assert!(record.sigma.iter().all(|sigma| *sigma >= 0.0), "{record:?}");
                    self.telemetry = Some(record);
                }
                FromBoard::Done => self.answer = Some(Ok(())),
                FromBoard::Refused(refusal) => self.answer = Some(Err(format!("{refusal:?}"))),
                _ => {}
            }
        }
    }

    /// Every command to the frontseat is within limits, and within rates, and carries its own timeout.
    fn judge(&mut self, mut said: &[u8]) {
        let settings = *self.app.parameters();
        let limits = settings.control.limits.within(&settings.vehicle);
        while let Some(sentence) = self.frontseat.feed(&mut said) {
            let sentence = sentence.expect("its sentences are good");
            match ToFrontseat::parse(&sentence, &settings.app.units).expect("the frontseat knows it") {
                ToFrontseat::Servo(Servo { servo, timeout_s }) => {
                    assert_eq!(timeout_s, settings.app.command_timeout_s);
                    let was = core::mem::replace(&mut self.servo, servo);
                    let calibration = &settings.app.servo;
                    if servo == calibration.bytes([0.0; 4], 0.0) {
                        continue;
                    }
                    let angles = calibration.fins_rad(&servo).into_iter().zip(calibration.fins_rad(&was));
                    for ((angle, was), fin) in angles.zip(&calibration.fins) {
                        // half a count of rounding, at either end of a change
                        let count = 1.0 / fin.counts_per_unit.abs();
                        assert!(angle.abs() <= limits.fin_rad + 0.5 * count, "{servo:?}");
                        let slow = (angle - was).abs() <= 0.1 * limits.fin_rate_radps + count;
                        assert!(slow || !self.steady, "{servo:?} after {was:?}");
                    }
                    let count = 1.0 / calibration.motor.counts_per_unit.abs();
                    let [speed, was] = [&servo, &was].map(|servo| calibration.propeller_radps(servo));
                    assert!(speed >= -0.5 * count && speed <= limits.propeller_radps + 0.5 * count, "{servo:?}");
                    let slow = (speed - was).abs() <= 0.1 * limits.propeller_radps2 + count;
                    assert!(slow || !self.steady, "{servo:?} after {was:?}");
                }
                ToFrontseat::Steer(steer) => {
                    assert_eq!(steer.timeout_s, settings.app.command_timeout_s);
                    finite(&steer);
                }
                _ => {}
            }
        }
    }

    /// The frame of an operator's request: signed by the only key that a host sets here, if it has set one.
    pub(crate) fn sign(&mut self, message: &ToBoard<'_>) -> Vec<u8> {
        self.counter += 1;
        let mut plain = [0; MAX_MESSAGE];
        let signed = Signed::new(message, &Key::new(HOST_KEY), 0, self.counter, &mut plain).expect("a request");
        encode(&ToBoard::Signed(signed), &mut [0; MAX_FRAME]).expect("a frame").to_vec()
    }

    /// Asks the board for something; whether it was done.
    pub(crate) fn request(&mut self, message: &ToBoard<'_>) -> Result<(), String> {
        self.answer = None;
        let frame = self.sign(message);
        self.receive(Port::Host, &frame);
        self.drain();
        self.answer.take().expect("an answer")
    }

    /// Tells it the parameters of the scenario, and the defaults of all others: an input may have set any of them.
    pub(crate) fn configure(&mut self) {
        static PARAMETERS: OnceLock<Vec<(String, f64)>> = OnceLock::new();
        let parameters = PARAMETERS.get_or_init(|| {
            let defaults =
                parameters::PARAMETERS.iter().map(|parameter| (parameter.name.to_owned(), parameter.default()));
            defaults.chain(board_parameters(scenario())).collect()
        });
        self.request(&ToBoard::ParameterBegin).expect("begun");
        for (name, value) in parameters {
            self.request(&ToBoard::ParameterSet { name, value: *value }).expect(name);
        }
        self.request(&ToBoard::ParameterCommit).expect("a valid set");
    }

    /// What an operator does before a mission, whatever was before: stop, parameters, waypoints.
    pub(crate) fn prepare(&mut self) {
        self.request(&ToBoard::MissionStop).expect("stopped");
        self.configure();
        let legs = legs();
        self.request(&ToBoard::MissionBegin { count: legs.len() as u16 }).expect("begun");
        for (index, waypoint) in (0..).zip(legs) {
            self.request(&ToBoard::MissionItem { index, waypoint }).expect("an item");
        }
        self.request(&ToBoard::MissionCommit).expect("a mission");
    }
}

/// The mission: a run at the surface and a dive.
pub(crate) fn legs() -> [Waypoint; 2] {
    LEGS.map(|(x_m, depth_m)| Waypoint { x_m, y_m: 0.0, depth_m, speed_mps: 1.0 })
}

/// A board among its simulated devices, second by second.
pub(crate) struct Trial {
    pub(crate) board: Board,
    world: World,
    devices: Devices,
    end_us: u64,
}

impl Trial {
    /// At the surface, with the scenario's parameters.
    pub(crate) fn new() -> Self {
        let mut board = Board::new();
        board.configure();
        Self { board, world: World::new(scenario()), devices: Devices::new(scenario()), end_us: 0 }
    }

    /// A second of ten steps; `change` may alter what each port hears in each of them. The telemetry in the end.
    pub(crate) fn second(&mut self, mut change: impl FnMut(u64, Port, &mut Vec<u8>)) -> Telemetry {
        for tenth in 0..SECOND_US / STEP_US {
            self.end_us += STEP_US;
            self.board.wait(STEP_US);
            swim(&mut self.world, &mut self.devices, self.end_us);
            let mut heard = Port::DEVICES.map(|port| (port, Vec::new()));
            for (port, arrival) in self.devices.arrivals(self.end_us) {
                heard[port as usize].1.extend_from_slice(&arrival.bytes);
            }
            for (port, bytes) in &mut heard {
                change(tenth, *port, bytes);
                self.board.receive(*port, bytes);
            }
            if self.end_us.is_multiple_of(SECOND_US) {
                self.board.edge();
            }
            self.board.step();
            for (port, bytes) in self.board.drain() {
                self.devices.sent_by_backseat(port, self.end_us, &bytes);
            }
        }
        self.board.telemetry.clone().expect("each step is reported")
    }
}

/// The frontseat's, in the scenario.
pub(crate) fn units() -> Units {
    Units::remote_helm(5)
}

/// What the devices say in such a flight, in order.
pub(crate) fn recorded() -> &'static [(Port, Vec<u8>)] {
    static RECORDED: OnceLock<Vec<(Port, Vec<u8>)>> = OnceLock::new();
    RECORDED.get_or_init(|| {
        let mut heard = Vec::new();
        let mut board = Board::new();
        board.configure();
        assert!(flies(&mut board, |port, bytes| heard.push((port, bytes.to_vec()))));
        heard
    })
}

/// Prepares the board for a mission that begins now, and flies it; a board that was lied to so well that it does not
/// find itself has to say so, and flies after its supply was switched.
///
/// # Panics
/// If it does not navigate, or not where the vehicle is, or commands what it must not.
pub(crate) fn fly(board: &mut Board) {
    if !flies(board, |_, _| {}) {
        *board = Board::new();
        board.configure();
        assert!(flies(board, |_, _| {}), "after power-up it does not find itself: {:?}", board.telemetry);
    }
}

/// Flies the mission; false if the board does not find itself, or doubts where it is, and says so.
fn flies(board: &mut Board, mut heard: impl FnMut(Port, &[u8])) -> bool {
    // the board's time is a counter that never goes back: one that did has to catch up before the app can be right
    // again
    let start_us = board.now_us.max(board.latest_us);
    board.now_us = start_us;
    board.prepare();
    let (mut world, mut devices) = (World::new(scenario()), Devices::new(scenario()));
    let mut end_us = 0;
    let mut second = |board: &mut Board| {
        for _ in 0..SECOND_US / STEP_US {
            end_us += STEP_US;
            swim(&mut world, &mut devices, end_us);
            for (port, arrival) in devices.arrivals(end_us) {
                heard(port, &arrival.bytes);
                board.app.receive(port, start_us + arrival.time_us, &arrival.bytes);
            }
            board.now_us = start_us + end_us;
            if end_us % SECOND_US == 0 {
                board.edge();
            }
            board.step();
            for (port, bytes) in board.drain() {
                devices.sent_by_backseat(port, end_us, &bytes);
            }
        }
        let [north_m, east_m, depth_m, ..] = world.truth().state;
        let telemetry = board.telemetry.clone().expect("each step is reported");
        let error_m = libm::hypot(telemetry.state[0] - north_m, telemetry.state[1] - east_m);
        (telemetry, [north_m, depth_m], error_m)
    };
    // who starts a mission looks at map and mode, and has another try: devices may have been asleep
    let mut settled_s = 0;
    let found = loop {
        let (telemetry, [north_m, depth_m], error_m) = second(board);
        let errors_m = [error_m, (telemetry.state[2] - depth_m).abs()];
        settled_s += 1;
        if telemetry.sigma[0] > 0.0 && error_m < NEAR_M && board.request(&ToBoard::MissionStart).is_ok() {
            let goes_well = (0..FIRST_S).all(|_| second(board).0.leg.is_some());
            settled_s += FIRST_S;
            if goes_well && board.telemetry.as_ref().is_some_and(|telemetry| telemetry.mode == Mode::Navigating) {
                let ahead = north_m < LEGS[0].0 - FOUND_M[0];
                break Some(ahead && errors_m[0] < FOUND_M[0] && errors_m[1] < FOUND_M[1]);
            }
            board.request(&ToBoard::MissionStop).expect("stopped");
        }
        if settled_s >= SETTLE_S {
            break None;
        }
    };
    let Some(found) = found else {
        // the mode of a board that was stopped is that; a start shows what it thinks of itself
        let started = board.request(&ToBoard::MissionStart);
        let (telemetry, _, error_m) = second(board);
        let healthy = started.is_ok() && telemetry.mode == Mode::Navigating;
        let sigma_m = libm::hypot(telemetry.sigma[0], telemetry.sigma[1]);
        assert!(!healthy || error_m < NEAR_M.max(3.0 * sigma_m), "it is not there: {telemetry:?}");
        return false;
    };
    board.steady = true;
    for elapsed in 1..=MISSION_S {
        let (telemetry, [north_m, depth_m], error_m) = second(board);
        // it ends a mission that it does not trust, and says why
        if telemetry.leg.is_none() && (!found || telemetry.mode == Mode::Safe) {
            return false;
        }
        assert!(telemetry.leg.is_some(), "after {elapsed} s: {telemetry:?}");
        if elapsed == MISSION_S {
            let sigma_m = libm::hypot(telemetry.sigma[0], telemetry.sigma[1]);
            assert!(error_m < 5.0 * sigma_m, "{error_m} m off: {telemetry:?}");
            if !found || matches!(telemetry.reason, ModeReason::PositionUncertain | ModeReason::Rejections) {
                // it was moved to where the fixes are now, remembers that it was sure of another place, and says so
                if telemetry.mode != Mode::Navigating {
                    return false;
                }
            }
            assert_eq!(telemetry.mode, Mode::Navigating, "{telemetry:?}");
            // 1 m/s from rest, and down with the second leg
            assert!(depth_m > 1.0 && (north_m > START_M + 20.0 || !found), "{north_m}, {depth_m}");
        }
    }
    true
}

/// World and devices move on, stopping wherever a device acts.
pub(crate) fn swim(world: &mut World, devices: &mut Devices, to_us: u64) {
    loop {
        let until_us = devices.next_us().unwrap_or(to_us).min(to_us);
        world.advance(until_us, &mut |observation| devices.observe(observation));
        world.set_actuator_targets(until_us, devices.run(until_us));
        if until_us >= to_us {
            return;
        }
    }
}
