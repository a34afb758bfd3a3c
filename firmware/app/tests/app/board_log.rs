//! The board log: handed to a fresh app, its records give the same digests.

use crate::board::{Arrival, Board, Heard, Listener, MemoryPort, request_all};
use crate::flight::{parameters, start};
use crate::world::World;
use backseat_app::parameters::PARAMETERS;
use backseat_app::{App, Progress, Pump, START_US};
use backseat_app::{Recorder, poll_recorded, record_start};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{Decoder, MAX_FRAME, Port, ResetCause, Restart, ToBoard, encode};
use backseat_wire::ship_state::Key;

const RESTART: Restart = Restart { cause: ResetCause::PowerOn, resets: 0, safe: false, crash: None };

/// A log in memory.
#[derive(Default)]
struct Log(Vec<u8>);

impl Recorder for Log {
    fn record(&mut self, record: &LogRecord<'_>) {
        self.0.extend_from_slice(encode(record, &mut [0; MAX_FRAME]).expect("every record fits a frame"));
    }
}

/// The app behind its pump, on the board's own clock, recorded.
struct Recorded {
    app: Box<App>,
    pump: Pump,
    ports: [MemoryPort; 5],
    log: Log,
    listener: Listener,
    time_us: u64,
}

impl Recorded {
    fn poll(&mut self, time_us: u64) {
        let Self { app, pump, ports, log, .. } = self;
        while poll_recorded(pump, app, ports, log, time_us).expect("memory does not fail") == Progress::Moved {}
        let bytes = std::mem::take(&mut self.ports[Port::Host as usize].from_board);
        self.listener.listen(&bytes);
    }
}

impl Board for Recorded {
    fn request(&mut self, message: &ToBoard<'_>) {
        let frame = encode(message, &mut [0; MAX_FRAME]).expect("a frame").to_vec();
        self.ports[Port::Host as usize].to_board.extend(frame);
        self.poll(self.time_us);
    }

    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4] {
        for &time_us in pps_us {
            self.app.pps(time_us);
            self.log.record(&LogRecord::Edge { time_us });
        }
        for arrival in arrivals {
            self.ports[arrival.port as usize].to_board.extend(&arrival.bytes);
            self.poll(arrival.time_us);
        }
        self.poll(time_us);
        self.time_us = time_us;
        Port::DEVICES.map(|port| std::mem::take(&mut self.ports[port as usize].from_board))
    }

    fn heard(&mut self) -> &mut Heard {
        &mut self.listener.heard
    }

    fn app(&self) -> &App {
        &self.app
    }
}

#[test]
fn a_mission_replayed_from_its_log_is_the_same_to_the_bit() {
    let (app, log) = (Box::new(App::new()), Log::default());
    let (pump, ports, listener) = (Pump::new(), Default::default(), Listener::new());
    let mut board = Recorded { app, pump, ports, log, listener, time_us: 0 };
    record_start(&mut board.log, &board.app, RESTART, &[]);
    let mut world = World::new();
    parameters(&mut board, &[("app.helm", 1.0)]);
    world.run(&mut board, 8 + START_US / 1_000_000);
    // the key is on no log: its frame is not recorded, and what is replayed without it takes the same packets
    let key = [0xC5, 0x3A, 0x91, 0x7E, 0x12, 0xD8, 0x64, 0xAF, 0x0B, 0xF6, 0x29, 0x83, 0x5D, 0xE1, 0x48, 0x97];
    request_all(&mut board, &[ToBoard::KeyBegin, ToBoard::KeySet(Key::new(key))]);
    assert!(!board.log.0.windows(4).any(|window| key.windows(4).any(|part| window == part)));
    world.key = Key::new(key);
    start(&mut board);
    world.run(&mut board, 30);
    request_all(&mut board, &[ToBoard::Helm { heading_rad: 1.0, depth_m: 4.0, speed_mps: 1.2 }]);
    world.run(&mut board, 30);
    assert!(board.app.is_under_way() && board.app.digest() != 0);
    assert!(board.heard().fusions.iter().any(|fusion| fusion.sensor == 7 && fusion.outcome == 0));

    let mut app = Box::new(App::new());
    let (mut decoder, mut rest) = (Decoder::new(), &board.log.0[..]);
    let (mut values, mut steps) = (Vec::new(), 0);
    let (mut sent, mut logged) = ([const { Vec::new() }; 5], [const { Vec::new() }; 5]);
    while let Some(frame) = decoder.feed(&mut rest) {
        match frame.expect("intact").message().expect("a record") {
            LogRecord::Start { restart, .. } => assert_eq!(restart, RESTART),
            LogRecord::Parameters { first, values: part } => {
                assert_eq!(usize::from(first), values.len());
                values.extend_from_slice(&part);
            }
            LogRecord::Received { port, time_us, bytes } => app.receive(port, time_us, bytes),
            LogRecord::Edge { time_us } => app.pps(time_us),
            LogRecord::Step { time_us, digest } => {
                app.step(time_us);
                assert_eq!(app.digest(), digest, "{time_us} µs");
                steps += 1;
            }
            LogRecord::Sent { port, bytes, .. } => logged[port as usize].extend_from_slice(bytes),
            LogRecord::Oscillator { oscillator, .. } => app.set_oscillator(oscillator),
            LogRecord::Fittings { readings, .. } => app.fittings(readings),
            LogRecord::EarlierCrash(_) => {}
            LogRecord::Lost { .. } => panic!("nothing is lost in memory"),
        }
        for port in Port::ALL {
            while !app.transmit(port).is_empty() {
                let count = app.transmit(port).len();
                sent[port as usize].extend_from_slice(app.transmit(port));
                app.transmitted(port, count);
            }
        }
    }
    // but for the host, which had an answer to the frame with the key
    assert!(sent[..4] == logged[..4], "what is sent to the devices is the same as well");
    assert_eq!(app.digest(), board.app.digest());
    assert!(steps > 600, "{steps} steps");
    let defaults: Vec<f64> = PARAMETERS.iter().map(|parameter| parameter.default()).collect();
    assert_eq!(values, defaults);
}
