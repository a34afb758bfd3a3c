//! What a fault or a panic of the firmware leaves behind.

use core::fmt::{self, Write};
use serde::{Deserialize, Serialize};

/// Bytes of a file's name that are kept, its last ones.
const FILE: usize = 24;

/// Where the firmware ended, and the registers that say why (Armv7-M ARM, B3.2). Addresses are of the image with this
/// [`build`](Self::build): `addr2line -e IMAGE ADDRESS` gives the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crash {
    /// First four bytes of the image's build ID (`readelf -n IMAGE`).
    pub build: u32,
    /// Board time, µs, modulo 2³².
    pub time_us: u32,
    /// Instruction; of a panic that of its handler.
    pub pc: u32,
    /// Where it would have returned to.
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
        let Self { build, time_us, pc, lr, cfsr, address, exception, line, file, .. } = self;
        if *line == 0 {
            write!(f, "fault at {pc:#010x}, called from {lr:#010x}, status {cfsr:#x}, address {address:#010x}")?;
        } else {
            f.write_str("panic at ")?;
            file.iter().filter(|byte| byte.is_ascii_graphic()).try_for_each(|byte| f.write_char(char::from(*byte)))?;
            write!(f, ":{line}")?;
        }
        // without floating point, whose formatting a board would carry for this alone
        let (s, tenths) = (time_us / 1_000_000, time_us / 100_000 % 10);
        write!(f, ", exception {exception}, {s}.{tenths} s after its start, image {build:08x}")
    }
}
