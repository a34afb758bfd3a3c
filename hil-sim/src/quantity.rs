//! Range checks at the place where a number is read, so that the error knows line and key.
//!
//! Each function here is a `deserialize_with`: it reads a number (or a fixed array of them) and
//! refuses what is not finite or outside the range of that kind of quantity.

use backseat_wire::ship_state::Key;
use serde::de::{Deserialize, Deserializer, Error};
use std::ops::RangeInclusive;

/// The key of an authentication code. Errors about it do not show it.
pub fn key<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Key, D::Error> {
    let text = String::deserialize(deserializer)?;
    text.parse().map_err(|_| D::Error::custom("not 32 hexadecimal digits"))
}

/// Longest name of a file or folder here; file systems take 255 bytes.
const NAME_MAX: usize = 100;

/// A name by which a folder is called: it stays where it is made.
pub fn name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let name = String::deserialize(deserializer)?;
    let plain = |c: char| !c.is_control() && !matches!(c, '/' | '\\' | ':');
    if name.is_empty() || name.len() > NAME_MAX || name.starts_with('.') || !name.chars().all(plain) {
        return Err(D::Error::custom(format!(
            "not a name: a folder is called by it; expected 1 to {NAME_MAX} bytes without /, \\, : and control characters, \
             not beginning with a dot"
        )));
    }
    Ok(name)
}

/// Something made of plain numbers.
pub trait Numbers {
    /// The numbers.
    fn numbers(&self) -> &[f64];
}

impl Numbers for f64 {
    fn numbers(&self) -> &[f64] {
        std::slice::from_ref(self)
    }
}

impl<const N: usize> Numbers for [f64; N] {
    fn numbers(&self) -> &[f64] {
        self
    }
}

impl<const N: usize> Numbers for Vec<[f64; N]> {
    fn numbers(&self) -> &[f64] {
        self.as_flattened()
    }
}

impl<T: Numbers> Numbers for Option<T> {
    fn numbers(&self) -> &[f64] {
        self.as_ref().map_or(&[], Numbers::numbers)
    }
}

fn within<'de, D, T>(deserializer: D, range: &RangeInclusive<f64>) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Numbers,
{
    let value = T::deserialize(deserializer)?;
    match value.numbers().iter().find(|number| !range.contains(number)) {
        None => Ok(value),
        Some(number) => Err(D::Error::custom(format_args!("{number} is outside {} to {}", range.start(), range.end()))),
    }
}

macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident: $range:expr;)*) => {$(
        $(#[$doc])*
        pub fn $name<'de, D, T>(deserializer: D) -> Result<T, D::Error>
        where
            D: Deserializer<'de>,
            T: Deserialize<'de> + Numbers,
        {
            within(deserializer, &$range)
        }
    )*};
}

quantities! {
    /// A place or displacement in the local frame: 100 km is as flat as the frame can be.
    coordinate: -1.0e5..=1.0e5;
    /// A length that may be zero.
    length: 0.0..=1.0e5;
    /// A length, mass, area, stiffness or the like that cannot be zero.
    positive: 1.0e-9..=1.0e6;
    /// A standard deviation, drag, time constant or other number that cannot be negative.
    non_negative: 0.0..=1.0e6;
    /// A depth a small vehicle can reach.
    depth: 0.0..=1000.0;
    /// An angle.
    angle: -std::f64::consts::TAU..=std::f64::consts::TAU;
    /// A speed, not negative.
    speed: 0.0..=10.0;
    /// A component of a velocity.
    velocity: -10.0..=10.0;
    /// A sampling rate.
    rate: 0.01..=100.0;
    /// A period or duration that cannot be zero.
    duration: 0.01..=1.0e6;
    /// A delay or phase that may be zero.
    delay: 0.0..=1.0e6;
    /// A share.
    share: 0.0..=1.0;
    /// Sound speed in water.
    sound_speed: 1300.0..=1700.0;
    /// Latitude in degrees, away from the poles where the local frame degenerates.
    latitude: -85.0..=85.0;
    /// Longitude in degrees.
    longitude: -180.0..=180.0;
    /// A small displacement inside the vehicle.
    lever: -0.5..=0.5;
    /// A change of velocity with depth, 1/s.
    shear: -0.5..=0.5;
    /// A factor on a declared number.
    factor: 0.0..=10.0;
}

/// A lever arm within the vehicle, m.
pub fn arm<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    three(deserializer, 20.0)
}

/// Roll, pitch, yaw, rad.
pub fn turn<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    three(deserializer, 3.2)
}

fn three<'de, D: Deserializer<'de>>(deserializer: D, limit: f64) -> Result<[f64; 3], D::Error> {
    let values = <[f64; 3]>::deserialize(deserializer)?;
    match values.iter().find(|value| !(-limit..=limit).contains(*value)) {
        Some(value) => Err(D::Error::custom(format_args!("{value} is not within {} to {limit}", -limit))),
        None => Ok(values),
    }
}

/// An integration step: a divisor of one second, 100 µs to 10 ms.
pub fn step_us<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    let step = u64::deserialize(deserializer)?;
    if (100..=10_000).contains(&step) && 1_000_000 % step == 0 {
        Ok(step)
    } else {
        Err(D::Error::custom(format_args!("{step} is not a divisor of 1000000 within 100 to 10000")))
    }
}

/// Tables of a settings file in which every key may be left out: after `as` who reads it, after `=` its default.
macro_rules! settings {
    ($($(#[$meta:meta])* pub struct $name:ident {
        $($(#[$doc:meta])* $field:ident: $type:ty $(as $read:literal)? = $default:expr,)*
    })*) => {$(
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {$(
            $(#[$doc])*
            $(#[serde(deserialize_with = $read)])?
            pub $field: $type,
        )*}

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    )*};
}
pub(crate) use settings;
