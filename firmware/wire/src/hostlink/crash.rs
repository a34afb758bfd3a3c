//! What a fault or a panic of the firmware leaves behind.

use core::fmt::{self, Write};
use serde::{Deserialize, Serialize};

/// Bytes of a file's name that are kept, its last ones.
const FILE: usize = 24;

/// What the firmware was at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Task {
    /// Start, then flash and card.
    #[default]
    Thread,
    /// The app, with its ports.
    App,
    /// Another interrupt, or a fault's own handler.
    Interrupt,
}

/// Where the firmware ended, and the registers that say why (Armv7-M ARM, B3.2). Addresses are of the image with this
/// [`build`](Self::build): `addr2line -e IMAGE ADDRESS` gives the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(default)]
pub struct Crash {
    /// First four bytes of the image's build ID (`readelf -n IMAGE`).
    pub build: u32,
    /// Board time, µs, modulo 2³².
    pub time_us: u32,
    /// Instruction; 0 where it is not known: a panic, a full stack.
    pub pc: u32,
    /// Where it would have returned to; of a full stack an address near its end that may be one.
    pub lr: u32,
    /// Stack pointer.
    pub sp: u32,
    /// Configurable fault status.
    pub cfsr: u32,
    /// Hard fault status.
    pub hfsr: u32,
    /// Address of a refused access; of use where the status says that it is valid.
    pub address: u32,
    /// Number of the exception that ran; 0: thread mode.
    pub exception: u16,
    /// Line of a panic; 0: a fault.
    pub line: u32,
    /// End of the name of its file.
    pub file: [u8; FILE],
    /// The stack in use was full.
    pub stack_overflow: bool,
    /// What ran.
    pub task: Task,
    /// Steps since its start.
    pub step: u32,
    /// Stack that interrupts, the steps among them, and thread mode had used at most, bytes.
    pub stacks: [u32; 2],
}

/// A crash, and how many before it the board could not keep until a card had them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct KeptCrash {
    /// What was kept.
    pub crash: Crash,
    /// How many had to make room.
    pub overwritten: u32,
}

impl Crash {
    /// A panic at this place.
    #[must_use]
    pub fn at(file: &str, line: u32) -> Self {
        let mut kept = [0; FILE];
        let bytes = file.as_bytes();
        for (place, byte) in kept.iter_mut().zip(bytes.iter().skip(bytes.len().saturating_sub(FILE))) {
            *place = *byte;
        }
        Self { line, file: kept, ..Self::default() }
    }
}

impl fmt::Display for Crash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { build, time_us, pc, lr, cfsr, address, exception, line, file, stack_overflow, task, step, .. } =
            self;
        if *line != 0 {
            f.write_str("panic at ")?;
            file.iter().filter(|byte| byte.is_ascii_graphic()).try_for_each(|byte| f.write_char(char::from(*byte)))?;
            write!(f, ":{line}")?;
        } else if *stack_overflow {
            write!(f, "stack overflow near {lr:#010x}, status {cfsr:#x}, address {address:#010x}")?;
        } else {
            write!(f, "fault at {pc:#010x}, called from {lr:#010x}, status {cfsr:#x}, address {address:#010x}")?;
        }
        let task = match task {
            Task::Thread => "thread mode",
            Task::App => "the app",
            Task::Interrupt => "an interrupt",
        };
        let [interrupts, thread] = self.stacks;
        write!(f, ", in {task} (exception {exception}), step {step}, stacks {interrupts} and {thread} bytes")?;
        // without floating point, whose formatting a board would carry for this alone
        let (s, tenths) = (time_us / 1_000_000, time_us / 100_000 % 10);
        write!(f, ", {s}.{tenths} s after its start, image {build:08x}")
    }
}

impl fmt::Display for KeptCrash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { crash, overwritten } = self;
        crash.fmt(f)?;
        if *overwritten == 0 { Ok(()) } else { write!(f, "; {overwritten} before it were not kept") }
    }
}
