//! A host that means harm: any message, in any order and cut anywhere, to a board that flies on its own clock.

use crate::false_inputs::FalseInput;
use crate::flight::{self, Board};
use arbitrary::{Arbitrary, Unstructured};
use backseat_app::Pump;
use backseat_wire::hostlink::{Chunk, MAX_FRAME, Port, Step, Telemetry, ToBoard, encode};
use hil_sim::backseat::Memory;
use hil_sim::devices::Devices;
use hil_sim::world::World;

/// Time between two looks at the ports, µs.
const POLL_US: u64 = 20_000;
const SECOND_US: u64 = 1_000_000;
/// Until the board has left the start to a simulator in vain, and knows where it is, s.
const SETTLE_S: u32 = 8;
/// Under way before the host begins, s.
const UNDER_WAY_S: u32 = 4;
/// What one input may cost, s.
const MOST_SECONDS: u32 = 40;
/// A host's clock that has stopped, or a step whose bytes never come, has ended by then, s.
const FORGOTTEN_S: u32 = 32;

/// What the host does in one second.
#[derive(Arbitrary, Debug)]
enum Act {
    /// A step of lock-step at any time, that announces so many bytes.
    Step { time_us: u64, at_zero: bool, port: u8, bytes: u16 },
    /// A parameter, in its range.
    Parameter { index: u16, value: u16 },
    /// A request.
    Request { which: u8 },
    /// A mission is announced, and one item comes.
    Mission { count: u16, index: u16 },
    /// Any bytes.
    Bytes { length: u8 },
    /// A message that breaks off.
    Cut { which: u8, length: u8 },
    /// Nothing.
    Silence,
}

impl Act {
    fn bytes(&self, rest: &mut Unstructured<'_>) -> Vec<u8> {
        let framed =
            |message: &ToBoard<'_>| encode(message, &mut [0; MAX_FRAME]).map(<[u8]>::to_vec).unwrap_or_default();
        match *self {
            Self::Step { time_us, at_zero, port, bytes } => {
                let mut step = Step {
                    time_us: if at_zero { 0 } else { time_us },
                    pps_us: heapless::Vec::new(),
                    chunks: heapless::Vec::new(),
                    fittings: Default::default(),
                };
                if bytes != 0 {
                    let port = Port::DEVICES[usize::from(port) % Port::DEVICES.len()];
                    let _ = step.chunks.push(Chunk { port, time_us, length: bytes });
                }
                framed(&ToBoard::Step(step))
            }
            Self::Parameter { index, value } => FalseInput::Parameter { index, value }.on_port().1,
            Self::Request { which } => FalseInput::Request { which }.on_port().1,
            Self::Mission { count, index } => {
                let waypoint = backseat_wire::hostlink::Waypoint { x_m: 10.0, y_m: 0.0, depth_m: 1.0, speed_mps: 1.0 };
                let item = ToBoard::MissionItem { index, waypoint };
                [ToBoard::MissionBegin { count }, item].iter().flat_map(framed).collect()
            }
            Self::Bytes { length } => {
                rest.bytes(rest.len().min(usize::from(length))).map(<[u8]>::to_vec).unwrap_or_default()
            }
            Self::Cut { which, length } => {
                let mut bytes = FalseInput::Request { which }.on_port().1;
                bytes.truncate(usize::from(length) % bytes.len().max(1));
                bytes
            }
            Self::Silence => Vec::new(),
        }
    }
}

/// The board behind its pump, among honest devices.
struct Bench {
    board: Board,
    pump: Pump,
    ports: [Memory; 5],
    world: World,
    devices: Devices,
    now_us: u64,
}

impl Bench {
    fn new() -> Self {
        let mut board = Board::new();
        board.prepare();
        Self {
            board,
            pump: Pump::new(),
            ports: Default::default(),
            world: World::new(flight::scenario()),
            devices: Devices::new(flight::scenario()),
            now_us: 0,
        }
    }

    /// A second; the last telemetry and the last answer in it.
    fn second(&mut self) -> (Option<Telemetry>, Option<Result<(), String>>) {
        self.board.heard();
        for _ in 0..SECOND_US / POLL_US {
            self.now_us += POLL_US;
            self.board.wait(POLL_US);
            flight::swim(&mut self.world, &mut self.devices, self.now_us);
            for (port, arrival) in self.devices.arrivals(self.now_us) {
                self.ports[port as usize].to_board.extend(&arrival.bytes);
            }
            if self.now_us.is_multiple_of(SECOND_US) {
                self.board.edge();
            }
            let free = self.board.is_at_rest() || self.pump.is_lockstep();
            for (port, bytes) in self.board.poll(&mut self.pump, &mut self.ports) {
                self.devices.sent_by_backseat(port, self.now_us, &bytes);
            }
            assert!(free || !self.pump.is_lockstep(), "a board under way gave its clock away");
        }
        self.board.heard()
    }

    fn send(&mut self, bytes: &[u8]) {
        self.ports[Port::Host as usize].to_board.extend(bytes);
    }

    /// Sends a request and waits for the answer, at most a second.
    fn request(&mut self, message: &ToBoard<'_>) -> (Option<Telemetry>, Option<Result<(), String>>) {
        let frame = self.board.sign(message);
        self.send(&frame);
        self.second()
    }
}

/// Whatever a host sends to a board under way: its clock stays its own, it goes on stepping, commands stay within limits
/// and rates; and once the host is quiet, an operator's stop is carried out within a second.
pub fn host(data: &[u8]) {
    let mut bench = Bench::new();
    (0..SETTLE_S).for_each(|_| drop(bench.second()));
    let (_, started) = bench.request(&ToBoard::MissionStart);
    assert_eq!(started, Some(Ok(())));
    (0..UNDER_WAY_S).for_each(|_| drop(bench.second()));
    let mut rest = Unstructured::new(data);
    for _ in 0..MOST_SECONDS {
        let Ok(act) = Act::arbitrary(&mut rest) else { break };
        let bytes = act.bytes(&mut rest);
        bench.send(&bytes);
        let own = !bench.pump.is_lockstep();
        let (telemetry, _) = bench.second();
        assert!(telemetry.is_some() || !own || bench.pump.is_lockstep(), "no step in a second after {act:?}");
        if rest.is_empty() {
            break;
        }
    }
    (0..FORGOTTEN_S).for_each(|_| drop(bench.second()));
    assert!(!bench.pump.is_lockstep(), "a host that is gone keeps the clock");
    // a message that broke off takes the next one with it
    bench.send(&[0]);
    let (_, stopped) = bench.request(&ToBoard::MissionStop);
    assert_eq!(stopped, Some(Ok(())), "a stop is never refused");
    let (telemetry, _) = bench.second();
    assert!(telemetry.is_some_and(|telemetry| telemetry.leg.is_none()));
}
