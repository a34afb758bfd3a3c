//! The vehicle's own state, as its acoustic uplink carries it.
//!
//! 28 bytes, little-endian, at the front of the 32-byte FSK frame, or all 32 with an authentication code, which is that
//! of [`crate::ship_state`].
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u8 | version, 9; with an authentication code 10 |
//! | 1 | u8 | source, the vehicle's modem address |
//! | 2 | u32 | transmit second: UTC seconds since 1970 at which the packet leaves |
//! | 6 | i32 | latitude, 1e-7 degree |
//! | 10 | i32 | longitude, 1e-7 degree |
//! | 14 | u40 | bits 0 to 10 and 11 to 21: velocity over ground north and east, cm/s, two's complement; bits 22 to 33: depth, 0.1 m; bit 34: the position leans on other vehicles; bits 35 to 39: velocity accuracy (one sigma per axis), 0.01 m/s · 2^(n/4), rounded up; 31: 2.15 m/s or more |
//! | 19 | u8 | position accuracy (one sigma along the longer half axis of the error ellipse): 0.1 m · 2^(n/16), rounded up; 255: 6.3 km or more |
//! | 20 | u8 | horizontal protection level, as the accuracy; 255: none, or more |
//! | 21 | u8 | true heading, 1/256 of a turn |
//! | 22 | u8 | bits 0 to 2: mode as in the host link; bits 3 to 6: protection level in depth, 0.5 m · 2^(n/2), rounded up, 15: none, or more; bit 7: clock and pulse of the vehicle's modem are good, so that the travel time is a range |
//! | 23 | u24 | what the board names: [`Named`]; while it names nothing, bits 5 to 18 the error ellipse: [`Ellipse`] |
//! | 26 | u16 | CRC-16/IBM-3740 over bytes 0 to 25 |
//! | 28 | u32 | version 10 only: authentication code over bytes 0 to 27 |
//!
//! Position and velocity are those of the transducer at the transmit second, which is also what tells one packet from
//! another. Steps of accuracy and level are 4.4 %, of the velocity's accuracy 19 %, of the level in depth 41 %: what is
//! stated is never less than what the vehicle knows.

use crate::framer::at;
use crate::nmea::within;
use crate::packet::{CODE, Framing, Key, degrees, seal, whole_degrees};
use crate::write::Writer;
use crate::{Error, ellipse::Ellipse, named::Named};
use core::f64::consts::{LN_2, TAU};

/// Bytes of the payload.
pub const LENGTH: usize = 28;
/// Bytes of the payload with its authentication code.
pub const AUTHENTIC_LENGTH: usize = LENGTH + CODE;
/// Version without an authentication code.
pub const VERSION: u8 = 9;
/// Version with one.
pub const AUTHENTIC_VERSION: u8 = 10;

const FRAMING: Framing<LENGTH> = Framing { versions: [VERSION, AUTHENTIC_VERSION] };
const SYNCHRONOUS: u8 = 1 << 7;
const MODES: u8 = 1 << 3;

/// A length or a speed in steps of a constant ratio.
struct Steps {
    least: f64,
    /// So many double it.
    octave: f64,
    /// The last: beyond all others.
    last: u8,
}

const HORIZONTAL: Steps = Steps { least: 0.1, octave: 16.0, last: 255 };
const VERTICAL: Steps = Steps { least: 0.5, octave: 2.0, last: 15 };
const SPEED: Steps = Steps { least: 0.01, octave: 4.0, last: 31 };

/// Bits of a velocity, and the largest one, m/s.
const VELOCITY: u32 = 11;
const VELOCITY_MPS: f64 = 10.23;
/// Bits of the depth.
const DEPTH: u32 = 12;
/// Place of the bit that says whether the position leans on other vehicles.
const LEANS: u32 = 2 * VELOCITY + DEPTH;
/// Bits of the cause that is named.
const QUIET: u32 = 5;
/// Bits behind which nothing is written while nothing is named.
const QUIET_BITS: u32 = 19;

impl Steps {
    fn value(&self, step: u8) -> f64 {
        self.least * libm::exp(f64::from(step) * LN_2 / self.octave)
    }

    /// Rounded up; the margin keeps what was read where it was.
    fn step(&self, value: f64) -> Result<u8, Error> {
        let steps = self.octave / LN_2 * libm::log(within(value, 0.0, f64::MAX)? / self.least);
        // casts saturate
        Ok((libm::ceil(steps - 1.0e-9) as u8).min(self.last))
    }

    /// `None` for the last step.
    fn level(&self, step: u8) -> Option<f64> {
        (step < self.last).then(|| self.value(step))
    }

    fn step_of_level(&self, level_m: Option<f64>) -> Result<u8, Error> {
        level_m.map_or(Ok(self.last), |level_m| self.step(level_m))
    }
}

/// The vehicle at the time of launch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleState {
    /// The vehicle's modem address.
    pub source: u8,
    /// Time of launch, s since 1970 UTC.
    pub transmit_s: u32,
    /// Latitude and longitude, degrees, north and east positive.
    pub position_deg: [f64; 2],
    /// Velocity over ground, north and east, m/s.
    pub velocity_mps: [f64; 2],
    /// Depth of the transducer, m.
    pub depth_m: f64,
    /// One sigma of the position along the longer half axis of its error ellipse, m.
    pub position_sigma_m: f64,
    /// Shape of that ellipse; a circle while something is named.
    pub ellipse: Ellipse,
    /// Since its last fix the vehicle has used another one's range.
    pub leans: bool,
    /// One sigma of the velocity per axis, m/s.
    pub velocity_sigma_mps: f64,
    /// True heading, rad, [0, 2 pi).
    pub heading_rad: f64,
    /// What the position's error exceeds with the declared probability only, horizontally and in depth, m; `None`
    /// where that is not bounded.
    pub level_m: [Option<f64>; 2],
    /// Mode, as the host link numbers them; below 8.
    pub mode: u8,
    /// The packet left on a pulse by a clock that is set: its travel time is a range.
    pub synchronous: bool,
    /// What the board names of what has changed.
    pub named: Named,
}

impl VehicleState {
    /// Whether a frame says that it is one.
    #[must_use]
    pub fn is_announced(frame: &[u8]) -> bool {
        frame.first().is_some_and(|version| FRAMING.versions.contains(version))
    }

    /// Reads a frame as [`Self::parse`] does, if the key is not set or its authentication code is right.
    ///
    /// # Errors
    /// [`Error::Forged`] without a code, or with a wrong one; else those of [`Self::parse`].
    pub fn parse_authentic(frame: &[u8], key: &Key) -> Result<Self, Error> {
        Self::read(FRAMING.open_authentic(frame, key)?)
    }

    /// Reads the front of a frame, with or without an authentication code, which is not looked at.
    ///
    /// # Errors
    /// [`Error::Length`] when shorter, [`Error::Unknown`] for another version, [`Error::Checksum`],
    /// [`Error::OutOfRange`].
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        Self::read(FRAMING.open(frame)?)
    }

    fn read(payload: &[u8; LENGTH]) -> Result<Self, Error> {
        let [_, source] = at(payload, 0)?;
        let [a, b, c, d, e] = at(payload, 14)?;
        let [position_sigma, level, heading, mode] = at(payload, 19)?;
        let bits = u64::from_le_bytes([a, b, c, d, e, 0, 0, 0]);
        let field = |from: u32, count: u32| bits >> from & ((1 << count) - 1);
        // the sign is the field's top bit
        let velocity = |from| (field(from, VELOCITY) << (64 - VELOCITY)).cast_signed() >> (64 - VELOCITY);
        let named: [u8; 3] = at(payload, 23)?;
        let [first, second, third] = named;
        let is_quiet = Named::read(named).cause == 0;
        let quiet = u32::from_le_bytes([first, second, third, 0]);
        // what nothing is written to
        if is_quiet && quiet >> QUIET_BITS != 0 {
            return Err(Error::OutOfRange);
        }
        let velocity_sigma = field(LEANS + 1, 5) as u8;
        Ok(Self {
            source,
            transmit_s: u32::from_le_bytes(at(payload, 2)?),
            position_deg: [degrees(at(payload, 6)?, 90.0)?, degrees(at(payload, 10)?, 180.0)?],
            velocity_mps: [velocity(0) as f64 / 100.0, velocity(VELOCITY) as f64 / 100.0],
            depth_m: field(2 * VELOCITY, DEPTH) as f64 / 10.0,
            position_sigma_m: HORIZONTAL.value(position_sigma),
            velocity_sigma_mps: SPEED.value(velocity_sigma),
            heading_rad: f64::from(heading) * (TAU / 256.0),
            level_m: [HORIZONTAL.level(level), VERTICAL.level((mode & !SYNCHRONOUS) / MODES)],
            mode: mode % MODES,
            synchronous: mode & SYNCHRONOUS != 0,
            ellipse: if is_quiet { Ellipse::read((quiet >> QUIET) as u16) } else { Ellipse::CIRCLE },
            leans: field(LEANS, 1) != 0,
            named: if is_quiet { Named::NOTHING } else { Named::read(named) },
        })
    }

    /// Variance of the position north, covariance, variance east, m².
    #[must_use]
    pub fn position_covariance_m2(&self) -> [f64; 3] {
        self.ellipse.covariance_m2(self.position_sigma_m)
    }

    /// The payload, rounded to its resolution, with an authentication code if the key is set; accuracies are rounded up
    /// and saturate, so do depth and level.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for what it cannot carry, [`Error::BufferFull`].
    pub fn emit<'b>(&self, key: &Key, buffer: &'b mut [u8; AUTHENTIC_LENGTH]) -> Result<&'b [u8], Error> {
        let mut payload = [0; LENGTH];
        self.write(FRAMING.version(key), &mut payload)?;
        let mut writer = Writer::new(buffer);
        writer.bytes(&payload)?;
        if key.is_set() {
            writer.bytes(&key.code(&payload))?;
        }
        Ok(writer.finish())
    }

    fn write(&self, version: u8, payload: &mut [u8; LENGTH]) -> Result<(), Error> {
        let mut writer = Writer::new(payload);
        writer.bytes(&[version, self.source])?;
        writer.bytes(&self.transmit_s.to_le_bytes())?;
        let [latitude, longitude] = self.position_deg;
        writer.bytes(&whole_degrees(latitude, 90.0)?)?;
        writer.bytes(&whole_degrees(longitude, 180.0)?)?;
        let velocity = |mps: f64| {
            let centimetres = libm::round(within(mps, -VELOCITY_MPS, VELOCITY_MPS)? * 100.0) as i64;
            Ok::<_, Error>(centimetres.cast_unsigned() & ((1 << VELOCITY) - 1))
        };
        let [north, east] = self.velocity_mps;
        // casts saturate
        let depth = (libm::round(within(self.depth_m, -10.0, f64::MAX)? * 10.0) as u64).min((1 << DEPTH) - 1);
        let velocity_sigma = u64::from(SPEED.step(self.velocity_sigma_mps)?);
        let bits = velocity(north)?
            | velocity(east)? << VELOCITY
            | depth << (2 * VELOCITY)
            | u64::from(self.leans) << LEANS
            | velocity_sigma << (LEANS + 1);
        writer.bytes(bits.to_le_bytes().first_chunk::<5>().ok_or(Error::Length)?)?;
        let [level, depth_level] = self.level_m;
        writer.byte(HORIZONTAL.step(self.position_sigma_m)?)?;
        writer.byte(HORIZONTAL.step_of_level(level)?)?;
        let turns = within(self.heading_rad, -TAU, TAU)? / TAU;
        writer.byte((libm::round((turns - libm::floor(turns)) * 256.0) as u16 % 256) as u8)?;
        let mode = if self.mode < MODES { self.mode } else { return Err(Error::OutOfRange) };
        let depth_level = VERTICAL.step_of_level(depth_level)? * MODES;
        writer.byte(mode | depth_level | if self.synchronous { SYNCHRONOUS } else { 0 })?;
        if self.named.cause == 0 {
            let [a, b, c, _] = (u32::from(self.ellipse.bits()) << QUIET).to_le_bytes();
            writer.bytes(&[a, b, c])?;
        } else {
            writer.bytes(&self.named.bytes()?)?;
        }
        seal(&mut writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ship_state::ShipState;

    const STATE: VehicleState = VehicleState {
        source: 2,
        transmit_s: 1_748_952_060,
        position_deg: [41.5, -70.7],
        velocity_mps: [1.0, -0.25],
        depth_m: 3.0,
        position_sigma_m: 0.31,
        ellipse: Ellipse::CIRCLE,
        leans: true,
        velocity_sigma_mps: 0.02,
        heading_rad: TAU / 4.0,
        level_m: [Some(25.0), Some(1.2)],
        mode: 4,
        synchronous: true,
        named: Named { cause: 2, rival: 18, beside: false, is_sure: true, size: [-9, 0] },
    };

    /// Every byte by hand from the table above: 1748952060 = 0x683EE3FC, 41.5e7 = 0x18BC6EC0, -70.7e7 = -0x2A24_1780.
    #[test]
    fn val_the_layout_is_the_tables() {
        let mut buffer = [0; AUTHENTIC_LENGTH];
        let bytes = STATE.emit(&Key::NONE, &mut buffer).unwrap();
        let mut expected: [u8; LENGTH] = [0; LENGTH];
        // 100 | (-25 mod 2048) << 11 | 30 << 22 | leans << 34 | 4 << 35: 0.01 · 2^(4/4) = 0.02
        let motion = 100_u64 | 2023 << 11 | 30 << 22 | 1 << 34 | 4 << 35;
        // 2 | 18 << 5 | 1 << 11 | (-9 mod 64) << 12
        let named = 2_u32 | 18 << 5 | 1 << 11 | 55 << 12;
        let parts: [&[u8]; 9] = [
            &[9, 2],
            &1_748_952_060_u32.to_le_bytes(),
            &415_000_000_i32.to_le_bytes(),
            &(-707_000_000_i32).to_le_bytes(),
            &motion.to_le_bytes()[..5],
            &[27, 128],           // 0.1 · 2^(27/16) = 0.322 m, 0.1 · 2^(128/16) = 25.6 m
            &[64],                // east
            &[0x80 | 3 << 3 | 4], // 0.5 · 2^(3/2) = 1.41 m
            &named.to_le_bytes()[..3],
        ];
        let mut at = 0;
        for part in parts {
            expected[at..at + part.len()].copy_from_slice(part);
            at += part.len();
        }
        assert_eq!((at, &bytes[..at]), (LENGTH - 2, &expected[..at]));
        assert_eq!(bytes.len(), LENGTH);
        let read = VehicleState::parse(bytes).unwrap();
        let near = |value: f64, expected: f64| (value - expected).abs() < 1.0e-3;
        assert!(near(read.position_sigma_m, 0.3221), "{read:?}");
        assert!(near(read.level_m[0].unwrap(), 25.6) && near(read.level_m[1].unwrap(), 1.414), "{read:?}");
        assert!((read.velocity_sigma_mps - 0.02).abs() < 1.0e-9, "{read:?}");
        let VehicleState { position_sigma_m, velocity_sigma_mps, level_m, .. } = read;
        assert_eq!(read, VehicleState { position_sigma_m, velocity_sigma_mps, level_m, ..STATE });
        assert_eq!(
            read.emit(&Key::NONE, &mut [0; AUTHENTIC_LENGTH]).unwrap(),
            bytes,
            "what was read stays where it was"
        );
    }

    /// The shape stands from bit 5 on; a cause that is named takes its place.
    #[test]
    fn val_the_ellipse_stands_where_nothing_is_named() {
        let ellipse = Ellipse::read(5 | 256 << 5);
        let state = VehicleState { named: Named::NOTHING, ellipse, leans: false, ..STATE };
        let mut buffer = [0; AUTHENTIC_LENGTH];
        let bytes = state.emit(&Key::NONE, &mut buffer).unwrap();
        assert_eq!(bytes[23..26], (5_u32 << 5 | 256 << 10).to_le_bytes()[..3]);
        let read = VehicleState::parse(bytes).unwrap();
        assert_eq!((read.named, read.ellipse, read.leans), (Named::NOTHING, ellipse, false));
        let leaning = VehicleState { leans: true, ..state };
        let leaning = leaning.emit(&Key::NONE, &mut buffer).unwrap();
        assert_eq!((leaning[18] & 4, VehicleState::parse(leaning).unwrap().leans), (4, true));
        // east, 2^(-5/6) = 0.561
        let [north, cross, east] = read.position_covariance_m2();
        let sigma = read.position_sigma_m;
        assert!((north / (sigma * sigma) - 0.315).abs() < 1e-3 && cross.abs() < 1e-9 && east == sigma * sigma);
        let named = VehicleState { ellipse, ..STATE };
        let read = VehicleState::parse(named.emit(&Key::NONE, &mut buffer).unwrap()).unwrap();
        assert_eq!((read.named, read.ellipse), (STATE.named, Ellipse::CIRCLE));
    }

    #[test]
    fn a_level_is_never_stated_smaller_than_it_is() {
        for exponent in -20..90 {
            let level_m = libm::exp(0.1 * f64::from(exponent));
            let state = VehicleState { position_sigma_m: level_m, level_m: [Some(level_m); 2], ..STATE };
            let read = VehicleState::parse(state.emit(&Key::NONE, &mut [0; AUTHENTIC_LENGTH]).unwrap()).unwrap();
            let [horizontal, depth] = read.level_m;
            assert_eq!((horizontal.is_none(), depth.is_none()), (level_m > 6007.0, level_m > 64.0), "{level_m}");
            assert!(
                horizontal.is_none_or(|stated| stated >= level_m && stated < level_m.max(0.1) * 1.045),
                "{level_m}"
            );
            assert!(depth.is_none_or(|stated| stated >= level_m && stated < level_m.max(0.5) * 1.415), "{level_m}");
        }
        let unbounded = VehicleState { level_m: [None; 2], ..STATE };
        let read = VehicleState::parse(unbounded.emit(&Key::NONE, &mut [0; AUTHENTIC_LENGTH]).unwrap()).unwrap();
        assert_eq!((read.level_m, read.mode, read.synchronous), ([None; 2], 4, true));
        assert_eq!(
            VehicleState { level_m: [Some(f64::NAN), None], ..STATE }.emit(&Key::NONE, &mut [0; AUTHENTIC_LENGTH]),
            Err(Error::OutOfRange)
        );
    }

    #[test]
    fn a_key_is_asked_for_and_a_ships_packet_is_another() {
        let (key, other) = (Key::new([7; 16]), Key::new([8; 16]));
        let mut buffer = [0; AUTHENTIC_LENGTH];
        let plain = STATE.emit(&Key::NONE, &mut buffer).unwrap();
        assert_eq!(VehicleState::parse_authentic(plain, &key), Err(Error::Forged));
        let signed = STATE.emit(&key, &mut buffer).unwrap();
        assert_eq!(signed.len(), AUTHENTIC_LENGTH);
        assert!(VehicleState::parse_authentic(signed, &key).is_ok());
        assert_eq!(VehicleState::parse_authentic(signed, &other), Err(Error::Forged));
        // a bit of the payload, and then of the code
        for (place, cause) in [(9, Error::Checksum), (30, Error::Forged)] {
            let mut broken: [u8; AUTHENTIC_LENGTH] = signed.try_into().unwrap();
            broken[place] ^= 1;
            assert_eq!(VehicleState::parse_authentic(&broken, &key), Err(cause));
        }
        assert!(ShipState::parse(signed).is_err());
        assert_eq!(VehicleState::parse(&[1; 24]), Err(Error::Unknown));
        assert_eq!(VehicleState::parse(&[]), Err(Error::Length));
    }
}
