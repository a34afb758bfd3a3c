//! The whole app: any bytes on all ports at any times, and then a mission.

use crate::false_inputs::FalseInput;
use crate::flight::{self, Board, STEP_US};
use arbitrary::{Arbitrary, Unstructured};
use backseat_wire::hostlink::Port;

/// Something that happens to a board.
#[derive(Arbitrary, Debug)]
enum Happening {
    /// Any bytes on any port: so many of those that follow.
    Bytes { port: u8, wait_us: u16, length: u8 },
    /// What real devices said, from anywhere in a mission, perhaps with a bit pattern wrong in each piece.
    Replayed { wait_us: u16, from: u16, count: u8, wrong: Option<(u16, u8)> },
    /// Sentences and frames that are right in form.
    False { wait_us: u16, times: u8, input: FalseInput },
    /// An edge of the pulse per second.
    Edge { wait_us: u32 },
    /// The app steps on.
    Steps { count: u8 },
    /// The clock of whoever calls goes back ...
    Back { us: u32 },
    /// ... or leaps ahead, by twelve days at most.
    Leap { us: u64 },
}

const LONGEST_LEAP_US: u64 = 1 << 40;
/// What one input may cost: steps, and pieces that are played again.
const MOST_STEPS: usize = 500;
const MOST_PIECES: usize = 2_000;

/// The whole app: after any bytes on all ports at any times, the clock going back or leaping ahead, it is given a
/// mission and flies it: it navigates where the vehicle is, within its own sigmas, and every command is within limits
/// and rates.
pub fn app(data: &[u8]) {
    let recorded = flight::recorded();
    let mut board = Board::new();
    board.configure();
    let (mut steps, mut pieces) = (0, 0);
    let mut rest = Unstructured::new(data);
    while !rest.is_empty()
        && let Ok(happening) = Happening::arbitrary(&mut rest)
    {
        match happening {
            Happening::Bytes { port, wait_us, length } => {
                board.wait(u64::from(wait_us));
                let bytes = rest.bytes(rest.len().min(usize::from(length))).unwrap_or_default();
                board.receive(Port::ALL[usize::from(port) % Port::ALL.len()], bytes);
            }
            Happening::Replayed { wait_us, from, count, wrong } => {
                let from = usize::from(from) % recorded.len();
                for (port, bytes) in recorded[from..].iter().take(usize::from(count)).take(MOST_PIECES - pieces) {
                    pieces += 1;
                    board.wait(u64::from(wait_us));
                    let mut bytes = bytes.clone();
                    if let Some((at, xor)) = wrong {
                        let at = usize::from(at) % bytes.len();
                        bytes[at] ^= xor;
                    }
                    board.receive(*port, &bytes);
                }
            }
            Happening::False { wait_us, times, input } => {
                let (port, bytes) = input.on_port();
                for _ in 0..usize::from(times % 16).min(MOST_PIECES - pieces) {
                    pieces += 1;
                    board.wait(u64::from(wait_us));
                    board.receive(port, &bytes);
                }
            }
            Happening::Edge { wait_us } => {
                board.wait(u64::from(wait_us));
                board.edge();
            }
            Happening::Steps { count } => {
                for _ in 0..usize::from(count).min(MOST_STEPS - steps) {
                    steps += 1;
                    board.wait(STEP_US);
                    board.step();
                }
            }
            Happening::Back { us } => board.back(u64::from(us)),
            Happening::Leap { us } => board.wait(us % LONGEST_LEAP_US),
        }
        board.drain();
    }
    flight::fly(&mut board);
}
