//! The messages of the host link.

use super::crash::{Crash, KeptCrash};
use super::fittings::FittingReadings;
use super::health::Health;
use super::identification::{Estimates, FaultReport, Identification, LearntStored, Naming};
use super::images::{Image, ImageId, Images};
use super::mode::{Mode, ModeReason};
use super::refusal::Refusal;
use super::signed::Signed;
use crate::packet::Key;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most chunks one [`Step`] may announce.
pub const MAX_CHUNKS: usize = 32;
/// Most pulse-per-second edges one [`Step`] may carry.
pub const MAX_PPS: usize = 2;

/// Most corners of a mission's fence.
pub const MAX_FENCE_CORNERS: usize = 32;

/// A serial port of the backseat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Port {
    /// Iver3 frontseat computer.
    Frontseat,
    /// Doppler velocity log.
    Dvl,
    /// Attitude and heading reference.
    Ahrs,
    /// WHOI Micro-Modem.
    Modem,
    /// PC: telemetry, parameters, mission, lock-step clock.
    Host,
}

impl Port {
    /// The four device ports, in the order of their discriminants.
    pub const DEVICES: [Self; 4] = [Self::Frontseat, Self::Dvl, Self::Ahrs, Self::Modem];
    /// All five ports.
    pub const ALL: [Self; 5] = [Self::Frontseat, Self::Dvl, Self::Ahrs, Self::Modem, Self::Host];
    /// Names for people, in the order of [`Self::ALL`].
    pub const NAMES: [&str; 5] = ["frontseat", "dvl", "ahrs", "modem", "host"];
    /// Usual baud rates, in the order of [`Self::ALL`].
    pub const DEFAULT_BAUD: [u32; 5] = [19_200, 115_200, 115_200, 19_200, 115_200];

    /// Its name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// Bytes that reach a device port in this step: the port's next `length` bytes arrived at `time_us`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Chunk {
    /// Which port.
    pub port: Port,
    /// Arrival of its last byte, board time, µs.
    pub time_us: u64,
    /// How many bytes.
    pub length: u16,
}

/// Lock-step clock: advance to `time_us` with these inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Board time of the step, µs; steps are 100 ms apart.
    pub time_us: u64,
    /// Pulse-per-second edges since the last step, board time, µs.
    pub pps_us: Vec<u64, MAX_PPS>,
    /// What arrived since the last step, in order of arrival.
    pub chunks: Vec<Chunk, MAX_CHUNKS>,
    /// What the simulator's last-resort hardware reads: the board's own is left alone.
    pub fittings: FittingReadings,
}

/// Answer to a [`Step`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepDone {
    /// The step's time, µs.
    pub time_us: u64,
    /// Bytes sent to each device port during the step ([`Port::DEVICES`] order).
    pub sent: [u16; 4],
    /// Running digest of filter state and covariance.
    pub digest: u64,
}

/// A corner of the mission in the local NED frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Waypoint {
    /// North, m.
    pub x_m: f64,
    /// East, m.
    pub y_m: f64,
    /// Depth of the leg that ends here, m; 0 is surfaced.
    pub depth_m: f64,
    /// Speed of the leg that ends here, m/s.
    pub speed_mps: f64,
}

/// Why the board started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// Supply switched on.
    PowerOn,
    /// Reset button or programmer.
    Pin,
    /// Supply fell below the brown-out level.
    BrownOut,
    /// The independent watchdog: the navigation step did not run in time.
    Watchdog,
    /// A debug probe or programmer.
    Software,
    /// Anything else.
    Other,
    /// A fault or a panic of the firmware, which left a [`Crash`].
    Fault,
}

/// The board's last start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restart {
    /// Why it started.
    pub cause: ResetCause,
    /// Resets by a fault since the supply was switched on.
    pub resets: u32,
    /// Too many of them in too short a time: safe mode.
    pub safe: bool,
    /// What ended the run before, where it was the firmware itself.
    #[serde(default)]
    pub crash: Option<Crash>,
}

/// The app's record of one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Board time, µs.
    pub time_us: u64,
    /// Seconds since 1970 UTC, µs; 0 while unknown.
    pub utc_us: u64,
    /// Mode and its reason.
    pub mode: Mode,
    /// Why.
    pub reason: ModeReason,
    /// Vehicle state x_v (12), SI.
    pub state: [f64; 12],
    /// One sigma of each vehicle state.
    pub sigma: [f64; 12],
    /// Covariance of x and y, m².
    pub cov_xy_m2: f64,
    /// Current north, east, m/s (0 where not estimated).
    pub current_mps: [f64; 2],
    /// What the propeller does from this step on, as commanded, rad/s.
    pub propeller_radps: f64,
    /// The same of the fins [top, bottom, port, starboard], rad.
    pub fins_rad: [f64; 4],
    /// Leg of the mission being followed; `None` when no mission runs.
    pub leg: Option<u16>,
    /// Frames rejected per device port since start.
    pub rejected_frames: [u32; 4],
    /// Protection level, m: what the error exceeds horizontally and in depth with the declared probability only; 0 while
    /// there is no position.
    pub level_m: [f32; 2],
}

/// One scalar fusion, as `backseat_core::navigation::FusionRecord`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FusionTelemetry {
    /// Sensor, by its index in the filter's list.
    pub sensor: u8,
    /// Component.
    pub axis: u8,
    /// Outcome: 0 fused, 1 gated, 2 invalid, 3 stale clone, 4 a range rate while the position is uncertain,
    /// 5 a range to another vehicle that tells little or leans.
    pub outcome: u8,
    /// Time, µs.
    pub time_us: u64,
    /// Innovation, sensor's unit.
    pub innovation: f64,
    /// Innovation variance.
    pub variance: f64,
}

/// The ship's state from a packet that gave a range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ship {
    /// Board time at which the packet was complete, µs.
    pub time_us: u64,
    /// North and east at the launch of the packet, m.
    pub position_m: [f64; 2],
    /// North and east, m/s.
    pub velocity_mps: [f64; 2],
    /// One sigma of each coordinate, m.
    pub sigma_m: f64,
}

/// Who steers while a mission is under way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Steered {
    /// Board time, µs.
    pub time_us: u64,
    /// What is held as a host asked for; none: the mission's leg is flown.
    pub by_host: Option<Held>,
}

/// What a host has the vehicle hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// True heading, rad.
    pub heading_rad: f32,
    /// Depth, m.
    pub depth_m: f32,
    /// Speed through the water, m/s.
    pub speed_mps: f32,
}

/// A declared parameter of the board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterInfo<'a> {
    /// Position in the list.
    pub index: u16,
    /// How many there are.
    pub count: u16,
    /// Name, as the key of the vehicle file where there is one.
    pub name: &'a str,
    /// Unit, "1" for none.
    pub unit: &'a str,
    /// Present value.
    pub value: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Default.
    pub default: f64,
}

/// PC to board.
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box the large ones")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToBoard<'a> {
    /// Who are you?
    Hello,
    /// Lock-step clock.
    Step(Step),
    /// Start a parameter transaction; a broken one leaves the old set active.
    ParameterBegin,
    /// Stage one value.
    ParameterSet {
        /// Name.
        name: &'a str,
        /// Value.
        value: f64,
    },
    /// Validate and activate the staged set.
    ParameterCommit,
    /// Ask for one parameter by its index.
    ParameterGet {
        /// Index.
        index: u16,
    },
    /// Start a mission transfer of `count` waypoints.
    MissionBegin {
        /// How many will follow.
        count: u16,
    },
    /// The next waypoint.
    MissionItem {
        /// Its position, from 0.
        index: u16,
        /// The waypoint.
        waypoint: Waypoint,
    },
    /// All have come: replace the mission.
    MissionCommit,
    /// Ask for one waypoint of the stored mission.
    MissionGet {
        /// Its position, from 0.
        index: u16,
    },
    /// Fly the stored mission.
    MissionStart,
    /// Stop: neutral fins, propeller off, frontseat in charge.
    MissionStop,
    /// Keep the active parameters through power-off; answered when they are written.
    ParameterStore,
    /// Ask for the counters.
    HealthGet,
    /// Move the fins one after the other, a little and for four seconds, with the propeller stopped; not under way.
    FinWiggle,
    /// Take parameters under way as well, for a minute: those that may change there.
    Unlock,
    /// The key of acoustic payloads and signed requests comes next: within two seconds, which the board does not log.
    /// Answered by whether there is one.
    KeyBegin,
    /// The key; none switches authentication off. Nothing ever gives it back.
    KeySet(Key),
    /// The next corner of the fence of the mission on its way in: between `MissionBegin` and `MissionCommit`. A mission
    /// without them has no polygon.
    FenceCorner {
        /// Its position, from 0.
        index: u8,
        /// How many there are, at most [`MAX_FENCE_CORNERS`].
        count: u8,
        /// North and east, m.
        corner_m: [f64; 2],
    },
    /// Ask for one corner of the stored mission's fence.
    FenceGet {
        /// Its position, from 0.
        index: u8,
    },
    /// Ask for what a [`Signed`] request is signed with beside the key.
    ChallengeGet,
    /// A request and its code.
    Signed(#[serde(borrow)] Signed<'a>),
    /// Ask which images the board has.
    UpdateGet,
    /// An image for the other bank comes next. As with the requests below, the answer comes when flash is written.
    UpdateBegin(Image),
    /// The next bytes of it.
    UpdateWrite {
        /// Their place, from 0: where the last ones ended.
        offset: u32,
        /// At most [`UPDATE_CHUNK`](super::UPDATE_CHUNK); but for the last ones so many.
        bytes: &'a [u8],
    },
    /// All have come: if the CRC is right, the board starts again with the new image, on trial.
    UpdateCommit,
    /// The image that runs stays.
    UpdateConfirm,
    /// Release the drop weight, at any time; or, at rest, let its output rest again.
    DropWeight {
        /// Whether it falls.
        release: bool,
    },
    /// Hold this instead of the leg that is being flown. It holds for two seconds, then the leg is flown again: whoever
    /// steers says it again before.
    Helm {
        /// True heading, rad.
        heading_rad: f64,
        /// Depth, m.
        depth_m: f64,
        /// Speed through the water, m/s.
        speed_mps: f64,
    },
}

/// Board to PC.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FromBoard<'a> {
    /// Answer to `Hello`.
    Hello {
        /// Firmware version.
        firmware: &'a str,
        /// Version of the parameter list.
        parameter_schema: u16,
        /// Which image runs.
        image: ImageId,
    },
    /// Answer to `Step`, after all bytes of the step were handed to the ports.
    StepDone(StepDone),
    /// Once a step.
    Telemetry(Telemetry),
    /// Each fusion.
    Fusion(FusionTelemetry),
    /// Answer to `ParameterGet`.
    Parameter(ParameterInfo<'a>),
    /// Answer to `MissionGet`.
    Mission {
        /// Its position.
        index: u16,
        /// How many there are.
        count: u16,
        /// The waypoint, `None` when there is no such.
        waypoint: Option<Waypoint>,
    },
    /// The request was carried out.
    Done,
    /// The request was refused.
    Refused(Refusal),
    /// After the start of a board that knows its reset cause, and after `Hello`.
    Restart(Restart),
    /// Answer to `HealthGet`, and after a step when received bytes were lost since the last.
    Health(Health),
    /// Every ten seconds while the identifier is switched on.
    Identification(Identification),
    /// After a dive of which the robust filter has learnt.
    LearntStored(LearntStored),
    /// After each packet that gave a range.
    Ship(Ship),
    /// Answer to `KeyBegin`.
    Key {
        /// There is one.
        set: bool,
    },
    /// When the fault monitor changes its mind, and every ten seconds while a fault is diagnosed.
    Fault(FaultReport),
    /// Every ten seconds while the robust filter runs.
    Estimates(Estimates),
    /// Answer to `FenceGet`.
    Fence {
        /// Its position.
        index: u8,
        /// How many there are; 0: no polygon.
        count: u8,
        /// North and east, m; `None` when there is no such.
        corner_m: Option<[f64; 2]>,
    },
    /// Every minute under water while something is named, and when nothing is any more.
    Naming(Naming),
    /// Answer to `ChallengeGet`.
    Challenge {
        /// Another at each start of the board.
        challenge: u64,
        /// That of the last signed request that was taken.
        counter: u64,
    },
    /// Answer to `UpdateGet`.
    Images(Images),
    /// After each `Restart`, once for every earlier crash that no card has got yet, the oldest first.
    EarlierCrash(KeptCrash),
    /// When a host begins to steer, steers otherwise, and ends; every ten seconds while it steers.
    Steered(Steered),
}
