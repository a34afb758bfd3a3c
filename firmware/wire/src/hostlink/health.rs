//! What a board says of itself: its lines, its clock, its log, its steps.

use super::fittings::Fittings;
use serde::{Deserialize, Serialize};

/// What the board's clock counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Oscillator {
    /// A crystal, some 20 ppm; a simulator's or a PC's clock counts as one.
    #[default]
    Crystal,
    /// The chip's own RC oscillator, 1 %: 10 ms from one pulse edge to the next.
    Internal,
}

/// What becomes of the log that the board itself keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LogState {
    /// This board has no memory for one.
    #[default]
    NotFitted,
    /// The card has not answered yet.
    Searching,
    /// It is written.
    Writing,
    /// No card, or one that failed; it is tried again.
    Failed,
    /// The card has no room left; it is tried again.
    Full,
}

/// The log that the board itself keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoardLog {
    /// What becomes of it.
    pub state: LogState,
    /// Records that found no room since start.
    pub lost_records: u32,
}

impl BoardLog {
    /// That of a board without memory for one.
    pub const NONE: Self = Self { state: LogState::NotFitted, lost_records: 0 };
}

/// What the board's own hardware has come to since start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hardware {
    /// How often the supply fell below the level at which flash is still written.
    pub supply_dips: u32,
    /// The supply at which the chip is reset, as its option bytes say: 0 to 3, of which 3 is the highest.
    pub brown_out_level: u8,
    /// Steps in which wrong bits were found, in the filter's RAM or the program's flash: bits that were corrected, and
    /// bits that were not.
    pub wrong_bits: [u32; 2],
    /// What the longest step took, with what was received and sent beside it, µs.
    pub longest_step_us: u32,
    /// Share of the last second that receiving, steps and sending took, per mille.
    pub load_permille: u16,
    /// Edges of the pulse per second that came too fast to be told apart.
    pub lost_edges: u32,
    /// Stack that interrupts, the steps among them, and thread mode have used at most, and their room, bytes.
    pub stacks: [Stack; 2],
}

impl Hardware {
    /// More of the time is taken than a board that is about to dive should take.
    #[must_use]
    pub const fn is_loaded(&self) -> bool {
        self.load_permille > 800
    }

    /// The chip goes on at a supply at which it may do anything.
    #[must_use]
    pub const fn has_low_brown_out(&self) -> bool {
        self.brown_out_level < 3
    }
}

/// A stack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stack {
    /// Used at most, bytes.
    pub used: u32,
    /// Room, bytes.
    pub room: u32,
}

impl Stack {
    /// It has nearly been full.
    #[must_use]
    pub const fn is_narrow(&self) -> bool {
        self.used as u64 * 10 > self.room as u64 * 9
    }
}

/// What came in since start, port by port (`Port::DEVICES` order), the pulse per second, and the board's own log.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Good frames, of those the app makes use of.
    pub accepted_frames: [u32; 4],
    /// Frames refused.
    pub rejected_frames: [u32; 4],
    /// Edges of the pulse-per-second input.
    pub pps_edges: u32,
    /// UTC rests on those edges.
    pub synchronised: bool,
    /// Losses of received bytes that the board's drivers noticed, of all five ports (`Port::ALL` order): overruns,
    /// full rings, and what the UART itself calls an error.
    pub receive_losses: [u32; 5],
    /// What the board's clock counts.
    pub oscillator: Oscillator,
    /// The board's own log.
    pub log: BoardLog,
    /// Steps that came a whole step late or more, since start.
    pub late_steps: u32,
    /// By how much the latest of them was, µs.
    pub latest_step_us: u32,
    /// What the board's own hardware says; none where a computer stands in for the board.
    pub hardware: Option<Hardware>,
    /// Requests refused since start because they were not signed, or not by the board's key.
    pub refused_requests: u32,
    /// Last-resort hardware.
    pub fittings: Fittings,
}
