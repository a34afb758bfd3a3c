//! Faults: what breaks between the world and the backseat, by scenario file and seed.
//!
//! | module | where it acts |
//! |---|---|
//! | `bytes` | on the serial lines, frame by frame, either way |
//! | `sensors` | on the readings of DVL, AHRS, depth sensor and GNSS, the ship's among them |
//! | `modem` | on acoustic packets: their time, sender and content |
//! | `frontseat` | on the frontseat's willingness |
//! | `backseat` | on the board under test: resets, its clock, its memory |
//! | `read` | `[[fault]]` in the scenario file |
//!
//! The backseat is not informed. A fault acts from `from_s` until `until_s`; several may act at once. Each draws from a
//! random stream of its own, so that one fault does not change what another does, nor any sensor's noise.

mod backseat;
mod bytes;
mod frontseat;
mod modem;
mod read;
mod sensors;

pub use backseat::{Board, Flash};
pub use bytes::FaultyLine;
pub use frontseat::{FrontseatFault, FrontseatFaults};
pub use modem::{Delivery, PacketFaults};
pub use read::snake;
pub use sensors::SensorFaults;

use crate::rng::Stream;
use backseat_logs::DataError;
use backseat_logs::output::{self, Existing};
use backseat_wire::hostlink::{Port, ResetCause};
use backseat_wire::iver::FrontseatMode;
use read::Written;
use serde::Deserialize;
use serde_json::{Value, json};
use std::fmt;
use std::path::Path;

/// A fault and when it acts.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Written")]
pub struct Fault {
    /// What breaks.
    pub kind: FaultKind,
    /// From this time on, µs.
    pub from_us: u64,
    /// Up to this time, µs.
    pub until_us: u64,
    /// As it was written, for reports.
    text: String,
}

impl Fault {
    /// Whether it acts at a time.
    pub fn acts(&self, time_us: u64) -> bool {
        (self.from_us..self.until_us).contains(&time_us)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// What breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// A serial line.
    Line {
        /// Of this port.
        port: Port,
        /// On the way to the backseat, from it, or both.
        direction: Direction,
        /// How.
        damage: Damage,
    },
    /// A sensor gives wrong readings.
    Sensor(SensorFault),
    /// A packet is not what it should be.
    Packet(PacketFault),
    /// The frontseat does as it likes.
    Frontseat(FrontseatFault),
    /// The board under test.
    Board(BoardFault),
    /// The vehicle, as last-resort hardware reads it.
    Fitting(FittingFault),
}

/// What last-resort hardware reads. The water itself is the effect `flooding`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FittingFault {
    /// The detector is wet.
    Leak,
    /// The supply falls.
    SupplyDip {
        /// To so much, V.
        supply_v: f64,
    },
}

/// Which way of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// From the device to the backseat.
    #[default]
    ToBackseat,
    /// From the backseat to the device.
    FromBackseat,
    /// Both, as when a cable is cut.
    Both,
}

/// What happens to frames; shares are of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damage {
    /// Never arrive.
    Lost {
        /// Share of frames.
        share: f64,
    },
    /// Arrive twice.
    Repeated {
        /// Share of frames.
        share: f64,
    },
    /// Change places with the next.
    Reordered {
        /// Share of frames.
        share: f64,
    },
    /// Arrive late, whatever comes after them.
    Late {
        /// Share of frames.
        share: f64,
        /// By so much, µs.
        delay_us: u64,
    },
    /// One bit is wrong.
    BitFlipped {
        /// Share of frames.
        share: f64,
    },
    /// The end is missing.
    Truncated {
        /// Share of frames.
        share: f64,
    },
    /// Nothing comes.
    Silent,
    /// Every frame comes so many times, as far as the line's speed allows.
    Babbling {
        /// How many times.
        factor: u32,
    },
    /// Random bytes, so many for each byte of a frame, as far as the line's speed allows.
    Garbage {
        /// How many.
        factor: u32,
    },
}

/// What a sensor does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// No bottom lock.
    DvlNoLock,
    /// Lock on something else: this velocity, m/s, with the sensor's own noise.
    DvlFalseLock {
        /// u, v, w, m/s.
        velocity_mps: [f64; 3],
    },
    /// The last sample again and again.
    AhrsFrozen,
    /// Not a number.
    AhrsNan,
    /// Rolled by half a turn.
    AhrsUpsideDown,
    /// The device's 32-bit timer rolls over at the fault's begin.
    AhrsTimerRollover,
    /// Depth is wrong by so much, m.
    DepthJump {
        /// Added, m.
        depth_m: f64,
    },
    /// Depth drifts.
    DepthDrift {
        /// m/s, from the fault's begin on.
        rate_mps: f64,
    },
    /// Depth is multiplied, as by another unit.
    DepthFactor {
        /// Factor.
        factor: f64,
    },
    /// Fixes of the vehicle are off by so much, north and east, m.
    GnssJump {
        /// Added, m.
        offset_m: [f64; 2],
    },
    /// Fixes of the vehicle drift away.
    GnssDrift {
        /// North and east, m/s, from the fault's begin on.
        drift_mps: [f64; 2],
    },
    /// Fixes of the vehicle wander.
    GnssWander(Wander),
    /// Fixes of the ship's receiver, which topside hears, are off by so much, north and east, m.
    ShipGnssJump {
        /// Added, m.
        offset_m: [f64; 2],
    },
    /// Heading is wrong by so much, rad.
    HeadingJump {
        /// Added, rad.
        heading_rad: f64,
    },
    /// Heading drifts.
    HeadingDrift {
        /// rad/s, from the fault's begin on.
        rate_radps: f64,
    },
}

/// A slow error of a receiver: a sinusoid an axis, in quadrature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wander {
    /// One sigma an axis, m.
    pub sigma_m: f64,
    /// Period, s.
    pub period_s: f64,
}

impl Wander {
    /// North and east, m, so long after its begin.
    fn offset_m(&self, time_us: u64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * time_us as f64 * 1e-6 / self.period_s);
        let amplitude_m = std::f64::consts::SQRT_2 * self.sigma_m;
        [amplitude_m * sin, amplitude_m * cos]
    }
}

/// What is wrong with packets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PacketFault {
    /// Delay of the modem's sentences at a packet's end, µs.
    Late {
        /// µs.
        delay_us: u64,
    },
    /// All sentences of a packet are repeated after this, µs.
    Duplicated {
        /// µs.
        delay_us: u64,
    },
    /// Sent by another modem, whose ship state it carries.
    WrongSource {
        /// Its address.
        address: u8,
    },
    /// The payload names another second.
    WrongSecond {
        /// Added, s.
        offset_s: i32,
    },
    /// Authenticated with another key.
    Forged,
    /// The payload of the packet before, sent again as this one.
    Replayed,
    /// The ship aborts: its packets say so instead of where it is.
    Abort {
        /// Modem address of the vehicle; 255 is every one.
        address: u8,
    },
    /// A later path is detected.
    Multipath {
        /// Share of packets.
        share: f64,
        /// Longest detour, m; the detours are uniform.
        extra_m: f64,
    },
    /// The modem's clock is off, s.
    ClockStep {
        /// Added to times of arrival, s.
        offset_s: f64,
    },
    /// The modem's clock runs off.
    ClockDrift {
        /// Rate, s/s.
        rate: f64,
    },
    /// The ship reports a place that is off by so much, north and east, m.
    ShipPosition {
        /// Added, m.
        offset_m: [f64; 2],
        /// In this share of the packets.
        share: f64,
    },
    /// The ship's receiver wanders.
    ShipWander(Wander),
}

/// What happens to the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoardFault {
    /// It resets, and is back after a while.
    Reset {
        /// Why.
        cause: ResetCause,
        /// Time without a board, µs.
        down_us: u64,
    },
    /// Its clock is off by so much, µs.
    Clock {
        /// Added, µs.
        offset_us: i64,
    },
    /// Number of the two stored copies of the parameters that are corrupted; it shows at the next reset.
    Flash {
        /// 1 or 2.
        copies: u8,
    },
}

/// The frontseat's mode by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeName {
    /// An operator took over.
    ManualOverride,
    /// The frontseat keeps its place.
    Parking,
    /// It stopped.
    Stopped,
}

impl ModeName {
    const fn mode(self) -> FrontseatMode {
        match self {
            Self::ManualOverride => FrontseatMode::ManualOverride,
            Self::Parking => FrontseatMode::Parking,
            Self::Stopped => FrontseatMode::Stopped,
        }
    }
}

/// Writes `truth/faults.json` into a folder: what broke and when.
///
/// # Errors
/// If the file exists or cannot be written.
pub fn write(faults: &[Fault], seed: u64, folder: &Path) -> Result<(), DataError> {
    let truth = folder.join("truth");
    std::fs::create_dir_all(&truth).map_err(|error| DataError::io(&truth, &error))?;
    let seconds = |time_us: u64| (time_us < u64::MAX).then_some(time_us as f64 * 1e-6);
    let one = |fault: &Fault| json!({ "fault": fault.to_string(), "from_s": seconds(fault.from_us), "until_s": seconds(fault.until_us) });
    let faults = json!({ "seed": seed, "faults": faults.iter().map(one).collect::<Vec<Value>>() });
    output::write(&truth.join("faults.json"), Existing::Keep, |file| {
        serde_json::to_writer_pretty(&mut *file, &faults)?;
        file.write_all(b"\n")
    })
}

/// A fault in force, with its random numbers.
#[derive(Clone, Debug)]
struct Active<T> {
    what: T,
    fault: Fault,
    random: Stream,
}

/// The faults that `pick` makes something of, each with its stream.
fn active<T>(faults: &[Fault], seed: u64, pick: impl Fn(&FaultKind) -> Option<T>) -> Vec<Active<T>> {
    let numbered = (0..).zip(faults);
    numbered
        .filter_map(|(index, fault)| {
            Some(Active { what: pick(&fault.kind)?, fault: fault.clone(), random: Stream::of_fault(seed, index) })
        })
        .collect()
}
