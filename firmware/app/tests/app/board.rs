//! Drivers of the app: bytes handed over directly, cut at random, or through the pump.

use backseat_app::{App, Progress, Pump};
use backseat_wire::hostlink::{
    Chunk, Decoder, Estimates, FaultReport, FromBoard, FusionTelemetry, Health, Identification, Images, KeptCrash,
    LearntStored, MAX_FRAME, MAX_MESSAGE, Naming, Port, Refusal, Restart, Ship, Signed, Steered, Step, StepDone,
    Telemetry, ToBoard, Waypoint, encode,
};
use std::collections::VecDeque;
use std::convert::Infallible;

/// Bytes that reach a port.
#[derive(Clone, Debug)]
pub struct Arrival {
    pub port: Port,
    pub time_us: u64,
    pub bytes: Vec<u8>,
}

pub use crate::random::Random;

/// What came from the board on the host port.
#[derive(Default)]
pub struct Heard {
    pub telemetry: Vec<Telemetry>,
    pub fusions: Vec<FusionTelemetry>,
    pub done: Vec<StepDone>,
    /// Answers to requests; `Ok` is anything that is no refusal.
    pub answers: Vec<Result<(), Refusal>>,
    pub parameters: Vec<(String, f64)>,
    pub corners_m: Vec<[f64; 2]>,
    pub waypoints: Vec<Option<Waypoint>>,
    pub restarts: Vec<Restart>,
    pub earlier_crashes: Vec<KeptCrash>,
    pub health: Option<Health>,
    pub identifications: Vec<Identification>,
    pub learnt_stored: Vec<LearntStored>,
    pub ships: Vec<Ship>,
    pub keys: Vec<bool>,
    pub faults: Vec<FaultReport>,
    pub estimates: Vec<Estimates>,
    pub naming: Vec<Naming>,
    pub steered: Vec<Steered>,
    pub challenges: Vec<(u64, u64)>,
    pub images: Option<Images>,
}

/// The host's end of the host link.
pub struct Listener {
    decoder: Decoder,
    pub heard: Heard,
}

impl Listener {
    pub fn new() -> Self {
        Self { decoder: Decoder::new(), heard: Heard::default() }
    }

    pub fn listen(&mut self, mut bytes: &[u8]) {
        let heard = &mut self.heard;
        while let Some(frame) = self.decoder.feed(&mut bytes) {
            match frame.expect("a good frame").message().expect("a message") {
                FromBoard::Telemetry(telemetry) => heard.telemetry.push(telemetry),
                FromBoard::Fusion(fusion) => heard.fusions.push(fusion),
                FromBoard::StepDone(done) => heard.done.push(done),
                FromBoard::Refused(refusal) => heard.answers.push(Err(refusal)),
                FromBoard::Parameter(info) => heard.parameters.push((info.name.to_owned(), info.value)),
                FromBoard::Mission { waypoint, .. } => heard.waypoints.push(waypoint),
                FromBoard::Done | FromBoard::Hello { .. } => heard.answers.push(Ok(())),
                FromBoard::Challenge { challenge, counter } => heard.challenges.push((challenge, counter)),
                FromBoard::Images(images) => heard.images = Some(images),
                FromBoard::Restart(restart) => heard.restarts.push(restart),
                FromBoard::EarlierCrash(crash) => heard.earlier_crashes.push(crash),
                FromBoard::Health(health) => heard.health = Some(health),
                FromBoard::Identification(identification) => heard.identifications.push(identification),
                FromBoard::LearntStored(stored) => heard.learnt_stored.push(stored),
                FromBoard::Ship(ship) => heard.ships.push(ship),
                FromBoard::Fault(report) => heard.faults.push(report),
                FromBoard::Estimates(estimates) => heard.estimates.push(estimates),
                FromBoard::Naming(naming) => heard.naming.push(naming),
                FromBoard::Steered(steered) => heard.steered.push(steered),
                FromBoard::Fence { corner_m, .. } => heard.corners_m.extend(corner_m),
                FromBoard::Key { set } => {
                    heard.answers.push(Ok(()));
                    heard.keys.push(set);
                }
            }
        }
    }
}

/// One way of running the app.
pub trait Board {
    fn request(&mut self, message: &ToBoard<'_>);
    /// Takes a step; the bytes sent to each device port.
    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4];
    fn heard(&mut self) -> &mut Heard;
    fn app(&self) -> &App;

    /// A request, and its answer if there is one yet.
    fn answer(&mut self, message: &ToBoard<'_>) -> Option<Result<(), Refusal>> {
        self.request(message);
        self.heard().answers.pop()
    }
}

/// Sends requests, signed by the board's key if it has one, and expects them to be carried out.
pub fn request_all(board: &mut dyn Board, messages: &[ToBoard<'_>]) {
    for message in messages {
        let key = board.app().parameters().app.acoustic_key;
        if key.is_set() {
            board.request(&ToBoard::ChallengeGet);
            let (challenge, counter) = board.heard().challenges.pop().expect("an answer");
            let mut buffer = [0; MAX_MESSAGE];
            let signed = Signed::new(message, &key, challenge, counter + 1, &mut buffer).expect("a request");
            board.request(&ToBoard::Signed(signed));
        } else {
            board.request(message);
        }
        let answer = board.heard().answers.pop();
        assert_eq!(answer, Some(Ok(())), "{message:?}");
    }
}

fn frame(message: &ToBoard<'_>) -> Vec<u8> {
    encode(message, &mut [0; MAX_FRAME]).expect("a frame").to_vec()
}

/// Calls the app itself, with chunks cut into random pieces when it has a seed.
pub struct Direct {
    app: Box<App>,
    listener: Listener,
    cuts: Option<Random>,
    time_us: u64,
    /// Bytes sent to the host so far.
    pub host_bytes: usize,
    raw: Vec<u8>,
}

impl Direct {
    pub fn new(seed: Option<u64>) -> Self {
        Self {
            app: Box::new(App::new()),
            listener: Listener::new(),
            cuts: seed.map(Random),
            time_us: 0,
            host_bytes: 0,
            raw: Vec::new(),
        }
    }

    /// What was sent to the host since the last call.
    pub fn listen_raw(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.raw)
    }

    pub fn app_mut(&mut self) -> &mut App {
        &mut self.app
    }

    fn receive(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        let mut rest = bytes;
        while let (Some(cuts), 2..) = (&mut self.cuts, rest.len()) {
            let (piece, tail) = rest.split_at(cuts.below(rest.len().min(40)));
            self.app.receive(port, time_us, piece);
            rest = tail;
        }
        self.app.receive(port, time_us, rest);
    }

    fn drain(&mut self, port: Port) -> Vec<u8> {
        let mut bytes = Vec::new();
        while !self.app.transmit(port).is_empty() {
            bytes.extend_from_slice(self.app.transmit(port));
            let count = self.app.transmit(port).len();
            self.app.transmitted(port, count);
        }
        bytes
    }
}

impl Board for Direct {
    fn request(&mut self, message: &ToBoard<'_>) {
        self.receive(Port::Host, self.time_us, &frame(message));
        let bytes = self.drain(Port::Host);
        self.raw.extend_from_slice(&bytes);
        self.listener.listen(&bytes);
    }

    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4] {
        self.time_us = time_us;
        let mut edges = pps_us.iter().peekable();
        for arrival in arrivals {
            while let Some(edge_us) = edges.next_if(|edge_us| **edge_us <= arrival.time_us) {
                self.app.pps(*edge_us);
            }
            self.receive(arrival.port, arrival.time_us, &arrival.bytes);
        }
        edges.for_each(|edge_us| self.app.pps(*edge_us));
        self.app.step(time_us);
        let sent = Port::DEVICES.map(|port| self.drain(port));
        let bytes = self.drain(Port::Host);
        self.host_bytes += bytes.len();
        self.raw.extend_from_slice(&bytes);
        self.listener.listen(&bytes);
        sent
    }

    fn heard(&mut self) -> &mut Heard {
        &mut self.listener.heard
    }

    fn app(&self) -> &App {
        &self.app
    }
}

/// A port in memory; `stingy` ones give and take a few bytes at a time.
#[derive(Default)]
pub struct MemoryPort {
    pub to_board: VecDeque<u8>,
    pub from_board: Vec<u8>,
    pub stingy: Option<usize>,
}

impl embedded_io::ErrorType for MemoryPort {
    type Error = Infallible;
}

impl embedded_io::ReadReady for MemoryPort {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_board.is_empty())
    }
}

impl embedded_io::Read for MemoryPort {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.to_board.len()).min(self.stingy.unwrap_or(usize::MAX));
        for (slot, byte) in buffer.iter_mut().zip(self.to_board.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl embedded_io::WriteReady for MemoryPort {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}

impl embedded_io::Write for MemoryPort {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(self.stingy.unwrap_or(usize::MAX));
        self.from_board.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The app behind its pump, clocked in lock-step.
pub struct Pumped {
    pub app: Box<App>,
    pub pump: Pump,
    pub ports: [MemoryPort; 5],
    listener: Listener,
}

impl Pumped {
    pub fn new() -> Self {
        Self { app: Box::new(App::new()), pump: Pump::new(), ports: Default::default(), listener: Listener::new() }
    }

    /// Pumps until nothing moves.
    pub fn run(&mut self, now_us: u64) -> Progress {
        loop {
            let progress = self.pump.poll(&mut self.app, &mut self.ports, now_us).expect("ports in memory do not fail");
            if progress != Progress::Moved {
                let bytes = std::mem::take(&mut self.ports[Port::Host as usize].from_board);
                self.listener.listen(&bytes);
                return progress;
            }
        }
    }

    pub fn send(&mut self, port: Port, bytes: &[u8]) {
        self.ports[port as usize].to_board.extend(bytes);
    }

    /// A request on its way to the host port.
    pub fn ask(&mut self, message: &ToBoard<'_>) {
        self.send(Port::Host, &frame(message));
    }

    pub fn announce(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) {
        let chunks = arrivals.iter().map(|a| Chunk {
            port: a.port,
            time_us: a.time_us,
            length: u16::try_from(a.bytes.len()).unwrap(),
        });
        let step = Step {
            time_us,
            pps_us: pps_us.iter().copied().collect(),
            chunks: chunks.collect(),
            fittings: Default::default(),
        };
        self.send(Port::Host, &frame(&ToBoard::Step(step)));
    }
}

impl Board for Pumped {
    fn request(&mut self, message: &ToBoard<'_>) {
        self.send(Port::Host, &frame(message));
        self.run(0);
    }

    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4] {
        for arrival in arrivals {
            self.send(arrival.port, &arrival.bytes);
        }
        self.announce(time_us, pps_us, arrivals);
        self.run(0);
        let done = self.listener.heard.done.pop().expect("a step is answered");
        assert_eq!((done.time_us, done.digest), (time_us, self.app.digest()));
        let sent = Port::DEVICES.map(|port| std::mem::take(&mut self.ports[port as usize].from_board));
        assert_eq!(done.sent.map(usize::from), [0, 1, 2, 3].map(|i| sent[i].len()));
        sent
    }

    fn heard(&mut self) -> &mut Heard {
        &mut self.listener.heard
    }

    fn app(&self) -> &App {
        &self.app
    }
}
