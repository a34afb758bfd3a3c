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
enum Name {
    Lost,
    Repeated,
    Reordered,
    Late,
    BitFlipped,
    Truncated,
    Silent,
    Babbling,
    Garbage,
    DvlNoLock,
    DvlFalseLock,
    AhrsFrozen,
    AhrsNan,
    AhrsUpsideDown,
    AhrsTimerRollover,
    DepthJump,
    DepthDrift,
    DepthFactor,
    GnssJump,
    GnssDrift,
    GnssWander,
    ShipGnssJump,
    HeadingJump,
    HeadingDrift,
    PacketLate,
    PacketDuplicated,
    PacketWrongSource,
    PacketWrongSecond,
    PacketForged,
    PacketReplayed,
    PacketAbort,
    Multipath,
    ModemClockStep,
    ModemClockDrift,
    ShipPosition,
    ShipWander,
    FrontseatRefuses,
    FrontseatReboots,
    FrontseatMode,
    Reset,
    BoardClock,
    FlashCorrupted,
    Leak,
    SupplyDip,
}

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
    /// Takes what damage to frames calls for; nothing for other faults.
    fn damage(&mut self) -> Result<Option<Damage>, String> {
        let factor = |factor: u32| match factor {
            1..=1000 => Ok(factor),
            other => Err(format!("factor: {other} is outside 1 to 1000")),
        };
        Ok(Some(match self.name {
            Name::Lost => Damage::Lost { share: need!(self.share) },
            Name::Repeated => Damage::Repeated { share: need!(self.share) },
            Name::Reordered => Damage::Reordered { share: need!(self.share) },
            Name::Late => Damage::Late { delay_us: micros(need!(self.delay_s)), share: need!(self.share) },
            Name::BitFlipped => Damage::BitFlipped { share: need!(self.share) },
            Name::Truncated => Damage::Truncated { share: need!(self.share) },
            Name::Silent => Damage::Silent,
            Name::Babbling => Damage::Babbling { factor: factor(need!(self.factor))? },
            Name::Garbage => Damage::Garbage { factor: factor(need!(self.factor))? },
            _ => return Ok(None),
        }))
    }

    fn wander(&mut self) -> Result<Wander, String> {
        let period_s = need!(self.period_s);
        Ok(Wander { sigma_m: need!(self.sigma_m), period_s })
    }

    /// Takes what the name calls for.
    fn kind(&mut self) -> Result<FaultKind, String> {
        if let Some(damage) = self.damage()? {
            let port = match need!(self.port) {
                PortName::Frontseat => Port::Frontseat,
                PortName::Dvl => Port::Dvl,
                PortName::Ahrs => Port::Ahrs,
                PortName::Modem => Port::Modem,
            };
            return Ok(FaultKind::Line { port, direction: self.direction.take().unwrap_or_default(), damage });
        }
        Ok(match self.name {
            Name::DvlNoLock => Sensor(SensorFault::DvlNoLock),
            Name::DvlFalseLock => Sensor(SensorFault::DvlFalseLock { velocity_mps: need!(self.velocity_mps) }),
            Name::AhrsFrozen => Sensor(SensorFault::AhrsFrozen),
            Name::AhrsNan => Sensor(SensorFault::AhrsNan),
            Name::AhrsUpsideDown => Sensor(SensorFault::AhrsUpsideDown),
            Name::AhrsTimerRollover => Sensor(SensorFault::AhrsTimerRollover),
            Name::DepthJump => Sensor(SensorFault::DepthJump { depth_m: need!(self.depth_m) }),
            Name::DepthDrift => Sensor(SensorFault::DepthDrift { rate_mps: need!(self.rate_mps) }),
            Name::DepthFactor => Sensor(SensorFault::DepthFactor { factor: need!(self.ratio) }),
            Name::GnssJump => Sensor(SensorFault::GnssJump { offset_m: need!(self.offset_m) }),
            Name::GnssDrift => Sensor(SensorFault::GnssDrift { drift_mps: need!(self.drift_mps) }),
            Name::ShipGnssJump => Sensor(SensorFault::ShipGnssJump { offset_m: need!(self.offset_m) }),
            Name::GnssWander => Sensor(SensorFault::GnssWander(self.wander()?)),
            Name::HeadingJump => Sensor(SensorFault::HeadingJump { heading_rad: need!(self.heading_rad) }),
            Name::HeadingDrift => Sensor(SensorFault::HeadingDrift { rate_radps: need!(self.rate_radps) }),
            Name::PacketLate => Packet(PacketFault::Late { delay_us: micros(need!(self.delay_s)) }),
            Name::PacketDuplicated => Packet(PacketFault::Duplicated { delay_us: micros(need!(self.delay_s)) }),
            Name::PacketWrongSource => Packet(PacketFault::WrongSource { address: need!(self.address) }),
            Name::PacketWrongSecond => {
                let offset_s = need!(self.offset_s);
                if offset_s.fract() != 0.0 {
                    return Err(format!("offset_s: {offset_s} is no whole second"));
                }
                Packet(PacketFault::WrongSecond { offset_s: offset_s as i32 })
            }
            Name::PacketForged => Packet(PacketFault::Forged),
            Name::PacketReplayed => Packet(PacketFault::Replayed),
            Name::PacketAbort => Packet(PacketFault::Abort { address: need!(self.address) }),
            Name::Multipath => {
                Packet(PacketFault::Multipath { share: need!(self.share), extra_m: need!(self.extra_m) })
            }
            Name::ModemClockStep => Packet(PacketFault::ClockStep { offset_s: need!(self.offset_s) }),
            Name::ModemClockDrift => Packet(PacketFault::ClockDrift { rate: 1e-6 * need!(self.drift_ppm) }),
            Name::ShipPosition => {
                let offset_m = need!(self.offset_m);
                Packet(PacketFault::ShipPosition { offset_m, share: self.share.take().unwrap_or(1.0) })
            }
            Name::ShipWander => Packet(PacketFault::ShipWander(self.wander()?)),
            Name::FrontseatRefuses => Frontseat(FrontseatFault::Refuses),
            Name::FrontseatReboots => Frontseat(FrontseatFault::Reboots),
            Name::FrontseatMode => Frontseat(FrontseatFault::Mode(need!(self.mode).mode())),
            Name::Reset => {
                let cause = match self.cause.take().unwrap_or_default() {
                    ResetCauseName::Watchdog => ResetCause::Watchdog,
                    ResetCauseName::BrownOut => ResetCause::BrownOut,
                };
                let down_us = micros(self.down_s.take().unwrap_or(WATCHDOG_DOWN_S));
                Board(BoardFault::Reset { cause, down_us })
            }
            Name::BoardClock => {
                let offset_s = need!(self.offset_s);
                Board(BoardFault::Clock { offset_us: (offset_s * 1e6).round() as i64 })
            }
            Name::FlashCorrupted => match need!(self.copies) {
                copies @ 1..=2 => Board(BoardFault::Flash { copies }),
                other => return Err(format!("copies: {other} is not 1 or 2")),
            },
            Name::Leak => FaultKind::Fitting(FittingFault::Leak),
            Name::SupplyDip => FaultKind::Fitting(FittingFault::SupplyDip { supply_v: need!(self.supply_v) }),
            name => return Err(format!("{name:?} is no such fault")),
        })
    }
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
