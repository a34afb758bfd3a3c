//! `[[fault]]`: a name, when it acts, and its numbers.

use super::{
    BoardFault, Damage, Direction, Fault, FaultKind, FittingFault, FrontseatFault, ModeName, PacketFault, SensorFault,
    Wander,
};
use crate::quantity;
use FaultKind::{Board, Frontseat, Packet, Sensor};
use backseat_wire::hostlink::{Port, ResetCause};
use serde::Deserialize;
use std::fmt::Write as _;

/// Time that a watchdog's reset takes, s: between the bounds that the restart record assumes.
const WATCHDOG_DOWN_S: f64 = 0.7;

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum PortName {
    Frontseat,
    Dvl,
    Ahrs,
    Modem,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ResetCauseName {
    #[default]
    Watchdog,
    BrownOut,
}

macro_rules! written {
    ($($field:ident: $type:ty $(, $check:literal)?;)*) => {
        /// A fault as it is written. What its name does not call for must be left out.
        #[derive(Clone, Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub(super) struct Written {
            name: Name,
            #[serde(deserialize_with = "quantity::delay")]
            from_s: f64,
            #[serde(default, deserialize_with = "quantity::delay")]
            until_s: Option<f64>,
            $(#[serde(default $(, deserialize_with = $check)?)] $field: Option<$type>,)*
        }

        impl Written {
            /// The keys that were not used.
            fn left(&self) -> Vec<&'static str> {
                let mut left = Vec::new();
                $(if self.$field.is_some() { left.push(stringify!($field)); })*
                left
            }

            /// Name and numbers in one line.
            fn text(&self) -> String {
                let mut text = snake(&format!("{:?}", self.name));
                $(if let Some(value) = &self.$field { let _ = write!(text, " {}={}", stringify!($field), shown(value)); })*
                let _ = match self.until_s {
                    Some(until_s) => write!(text, " ({} to {until_s} s)", self.from_s),
                    None => write!(text, " (from {} s)", self.from_s),
                };
                text
            }
        }
    };
}

written! {
    port: PortName;
    direction: Direction;
    share: f64, "quantity::share";
    delay_s: f64, "quantity::delay";
    factor: u32;
    velocity_mps: [f64; 3], "quantity::velocity";
    depth_m: f64, "quantity::coordinate";
    rate_mps: f64, "quantity::coordinate";
    ratio: f64, "quantity::length";
    offset_m: [f64; 2], "quantity::coordinate";
    drift_mps: [f64; 2], "quantity::velocity";
    sigma_m: f64, "quantity::length";
    period_s: f64, "quantity::duration";
    heading_rad: f64, "quantity::angle";
    rate_radps: f64, "quantity::angle";
    extra_m: f64, "quantity::length";
    address: u8;
    offset_s: f64, "quantity::coordinate";
    drift_ppm: f64, "quantity::coordinate";
    mode: ModeName;
    cause: ResetCauseName;
    down_s: f64, "quantity::delay";
    copies: u8;
    supply_v: f64, "quantity::non_negative";
}

/// Takes the value of a key that the fault cannot do without.
macro_rules! need {
    ($written:ident.$key:ident) => {
        $written.$key.take().ok_or_else(|| concat!(stringify!($key), " is missing").to_owned())?
    };
}

impl TryFrom<Written> for Fault {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let text = written.text();
        let name = snake(&format!("{:?}", written.name));
        let Written { from_s, until_s, .. } = written;
        if until_s.is_some_and(|until_s| until_s <= from_s) {
            return Err(format!("fault {name}: until_s is not after from_s"));
        }
        let mut rest = written;
        let kind = rest.kind().map_err(|why| format!("fault {name}: {why}"))?;
        if let Some(key) = rest.left().first() {
            return Err(format!("fault {name}: has no {key}"));
        }
        Ok(Self { kind, from_us: micros(from_s), until_us: until_s.map_or(u64::MAX, micros), text })
    }
}

impl Written {
    /// Frames of a port, one way of its line or both, are damaged.
    fn line(&mut self, damage: Damage) -> Result<FaultKind, String> {
        let port = match need!(self.port) {
            PortName::Frontseat => Port::Frontseat,
            PortName::Dvl => Port::Dvl,
            PortName::Ahrs => Port::Ahrs,
            PortName::Modem => Port::Modem,
        };
        Ok(FaultKind::Line { port, direction: self.direction.take().unwrap_or_default(), damage })
    }

    fn factor(&mut self) -> Result<u32, String> {
        match need!(self.factor) {
            factor @ 1..=1000 => Ok(factor),
            other => Err(format!("factor: {other} is outside 1 to 1000")),
        }
    }

    fn wander(&mut self) -> Result<Wander, String> {
        let period_s = need!(self.period_s);
        Ok(Wander { sigma_m: need!(self.sigma_m), period_s })
    }
}

/// The names of faults, and what each takes of its numbers.
macro_rules! faults {
    (|$numbers:ident| $($name:ident => $kind:expr,)*) => {
        #[derive(Clone, Copy, Debug, Deserialize)]
        #[serde(rename_all = "snake_case")]
        enum Name {
            $($name,)*
        }

        impl Written {
            /// Takes what the name calls for.
            fn kind(&mut self) -> Result<FaultKind, String> {
                let $numbers = self;
                Ok(match $numbers.name {
                    $(Name::$name => $kind,)*
                })
            }
        }
    };
}

faults! {
    |numbers|
    Lost => { let share = need!(numbers.share); numbers.line(Damage::Lost { share })? },
    Repeated => { let share = need!(numbers.share); numbers.line(Damage::Repeated { share })? },
    Reordered => { let share = need!(numbers.share); numbers.line(Damage::Reordered { share })? },
    Late => {
        let (delay_us, share) = (micros(need!(numbers.delay_s)), need!(numbers.share));
        numbers.line(Damage::Late { delay_us, share })?
    },
    BitFlipped => { let share = need!(numbers.share); numbers.line(Damage::BitFlipped { share })? },
    Truncated => { let share = need!(numbers.share); numbers.line(Damage::Truncated { share })? },
    Silent => numbers.line(Damage::Silent)?,
    Babbling => { let factor = numbers.factor()?; numbers.line(Damage::Babbling { factor })? },
    Garbage => { let factor = numbers.factor()?; numbers.line(Damage::Garbage { factor })? },
    DvlNoLock => Sensor(SensorFault::DvlNoLock),
    DvlFalseLock => Sensor(SensorFault::DvlFalseLock { velocity_mps: need!(numbers.velocity_mps) }),
    AhrsFrozen => Sensor(SensorFault::AhrsFrozen),
    AhrsNan => Sensor(SensorFault::AhrsNan),
    AhrsUpsideDown => Sensor(SensorFault::AhrsUpsideDown),
    AhrsTimerRollover => Sensor(SensorFault::AhrsTimerRollover),
    DepthJump => Sensor(SensorFault::DepthJump { depth_m: need!(numbers.depth_m) }),
    DepthDrift => Sensor(SensorFault::DepthDrift { rate_mps: need!(numbers.rate_mps) }),
    DepthFactor => Sensor(SensorFault::DepthFactor { factor: need!(numbers.ratio) }),
    GnssJump => Sensor(SensorFault::GnssJump { offset_m: need!(numbers.offset_m) }),
    GnssDrift => Sensor(SensorFault::GnssDrift { drift_mps: need!(numbers.drift_mps) }),
    ShipGnssJump => Sensor(SensorFault::ShipGnssJump { offset_m: need!(numbers.offset_m) }),
    GnssWander => Sensor(SensorFault::GnssWander(numbers.wander()?)),
    HeadingJump => Sensor(SensorFault::HeadingJump { heading_rad: need!(numbers.heading_rad) }),
    HeadingDrift => Sensor(SensorFault::HeadingDrift { rate_radps: need!(numbers.rate_radps) }),
    PacketLate => Packet(PacketFault::Late { delay_us: micros(need!(numbers.delay_s)) }),
    PacketDuplicated => Packet(PacketFault::Duplicated { delay_us: micros(need!(numbers.delay_s)) }),
    PacketWrongSource => Packet(PacketFault::WrongSource { address: need!(numbers.address) }),
    PacketWrongSecond => {
        let offset_s = need!(numbers.offset_s);
        if offset_s.fract() != 0.0 {
            return Err(format!("offset_s: {offset_s} is no whole second"));
        }
        Packet(PacketFault::WrongSecond { offset_s: offset_s as i32 })
    },
    PacketForged => Packet(PacketFault::Forged),
    PacketReplayed => Packet(PacketFault::Replayed),
    PacketAbort => Packet(PacketFault::Abort { address: need!(numbers.address) }),
    Multipath => {
        Packet(PacketFault::Multipath { share: need!(numbers.share), extra_m: need!(numbers.extra_m) })
    },
    ModemClockStep => Packet(PacketFault::ClockStep { offset_s: need!(numbers.offset_s) }),
    ModemClockDrift => Packet(PacketFault::ClockDrift { rate: 1e-6 * need!(numbers.drift_ppm) }),
    ShipPosition => {
        let offset_m = need!(numbers.offset_m);
        Packet(PacketFault::ShipPosition { offset_m, share: numbers.share.take().unwrap_or(1.0) })
    },
    ShipWander => Packet(PacketFault::ShipWander(numbers.wander()?)),
    FrontseatRefuses => Frontseat(FrontseatFault::Refuses),
    FrontseatReboots => Frontseat(FrontseatFault::Reboots),
    FrontseatMode => Frontseat(FrontseatFault::Mode(need!(numbers.mode).mode())),
    Reset => {
        let cause = match numbers.cause.take().unwrap_or_default() {
            ResetCauseName::Watchdog => ResetCause::Watchdog,
            ResetCauseName::BrownOut => ResetCause::BrownOut,
        };
        let down_us = micros(numbers.down_s.take().unwrap_or(WATCHDOG_DOWN_S));
        Board(BoardFault::Reset { cause, down_us })
    },
    BoardClock => {
        let offset_s = need!(numbers.offset_s);
        Board(BoardFault::Clock { offset_us: (offset_s * 1e6).round() as i64 })
    },
    FlashCorrupted => match need!(numbers.copies) {
        copies @ 1..=2 => Board(BoardFault::Flash { copies }),
        other => return Err(format!("copies: {other} is not 1 or 2")),
    },
    Leak => FaultKind::Fitting(FittingFault::Leak),
    SupplyDip => FaultKind::Fitting(FittingFault::SupplyDip { supply_v: need!(numbers.supply_v) }),
}

fn micros(time_s: f64) -> u64 {
    (time_s * 1e6).round() as u64
}

/// A value as it is written in a scenario file.
fn shown(value: &impl std::fmt::Debug) -> String {
    let text = format!("{value:?}");
    if text.starts_with(char::is_uppercase) { snake(&text) } else { text }
}

/// `AhrsFrozen` as `ahrs_frozen`.
#[must_use]
pub fn snake(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.extend(letter.to_lowercase());
    }
    text
}
