use super::servo::ServoBytes;
use super::{
    Acknowledge, Battery, Compass, FromFrontseat, FrontseatDvl, FrontseatError, FrontseatMode, LengthUnit, PositionAid,
    Power, Request, Servo, Start, State, Steer, ToFrontseat, Units, VelocityAid,
};
use crate::Error;
use crate::ahrs::os5000::Os5000;
use crate::gps::{Gga, Rmc};
use crate::nmea::{Fields, Sentence, parse_integer, within};
use crate::units::{FOOT_M, KNOT_MPS, radians};

/// Longest timeout of a command, s.
pub(super) const MAX_TIMEOUT_S: u8 = 120;
/// A DVL value at or below this is invalid.
const DVL_INVALID: f64 = -3_200.0;

/// Errors of the frontseat and how they are written.
pub(super) const ERROR_CODES: [(FrontseatError, &str); 14] = [
    (FrontseatError::None, "N"),
    (FrontseatError::OverPitch, "Sop"),
    (FrontseatError::TimeLimit, "Stl"),
    (FrontseatError::Leak, "Sle"),
    (FrontseatError::NoForwardProgress, "Sfp"),
    (FrontseatError::DepthExceeded, "Sed"),
    (FrontseatError::NoUpwardProgress, "Sup"),
    (FrontseatError::TowFloat, "Stf"),
    (FrontseatError::SafetyReturn, "Srp"),
    (FrontseatError::DepthSensorStuck, "Snd"),
    (FrontseatError::CompassStopped, "Snc"),
    (FrontseatError::MinimumPower, "Spw"),
    (FrontseatError::StopAndTransmit, "Sti"),
    (FrontseatError::Other, "E"),
];

impl LengthUnit {
    pub(super) fn metres(self) -> f64 {
        match self {
            Self::Feet => FOOT_M,
            Self::Metres => 1.0,
        }
    }
}

impl<'a> FromFrontseat<'a> {
    /// Reads what the frontseat sent.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by
    /// field.
    pub fn parse(sentence: &Sentence<'a>, units: &Units) -> Result<Self, Error> {
        let mut fields = sentence.fields();
        match sentence.id() {
            b"OSI" => Ok(Self::State(state(&mut fields, units)?)),
            b"OPI" => Ok(Self::Power(power(&mut fields)?)),
            b"DVL" => Ok(Self::Dvl(dvl(&mut fields)?)),
            b"ACK" => Ok(Self::Acknowledge(acknowledge(&mut fields)?)),
            [_, _, b'R', b'M', b'C'] => Ok(Self::Rmc(Rmc::parse(sentence)?)),
            [_, _, b'G', b'G', b'A'] => Ok(Self::Gga(Gga::parse(sentence)?)),
            [b'C', ..] if fields.is_empty() => Ok(Self::Compass(compass(sentence, units)?)),
            _ => Err(Error::Unknown),
        }
    }
}

fn compass(sentence: &Sentence<'_>, units: &Units) -> Result<Compass, Error> {
    let compass = Os5000::parse(sentence)?;
    Ok(Compass {
        heading_rad: compass.heading_rad.ok_or(Error::Missing)?,
        pitch_rad: compass.pitch_rad.ok_or(Error::Missing)?,
        roll_rad: compass.roll_rad.ok_or(Error::Missing)?,
        temperature_degc: compass.temperature_degc,
        depth_m: compass.depth.map(|depth| depth * units.compass_depth.metres()),
    })
}

fn state<'a>(fields: &mut Fields<'a>, units: &Units) -> Result<State<'a>, Error> {
    Ok(State {
        servo: ServoBytes::parse(fields.some()?)?,
        mode: mode(fields.some()?)?,
        next_waypoint: fields.integer()?,
        position_deg: position(fields)?,
        speed_mps: within(fields.number()?, -50.0, 50.0)? * KNOT_MPS,
        distance_to_next_m: fields.number()?,
        error: error(fields.some()?),
        altitude_m: fields.optional_number()?.map(|altitude| altitude * units.status_altitude.metres()),
        park_time_s: fields.optional(park_time)?,
        declination_rad: match fields.optional_number()? {
            Some(angle) => Some(radians(within(angle, -180.0, 180.0)?)),
            None => None,
        },
        mission: fields.text()?,
        remaining_time: fields.text()?,
        heading_rad: heading(fields)?,
        depth_m: within(fields.number()?, -100.0, 5_000.0)? * units.status_depth.metres(),
    })
}

fn mode(field: &[u8]) -> Result<FrontseatMode, Error> {
    match field {
        b"N" => Ok(FrontseatMode::Normal),
        b"S" => Ok(FrontseatMode::Stopped),
        b"P" => Ok(FrontseatMode::Parking),
        b"M" => Ok(FrontseatMode::ManualOverride),
        b"mP" | b"Mp" | b"m" => Ok(FrontseatMode::ManualParking),
        b"A" => Ok(FrontseatMode::Servo),
        b"W" => Ok(FrontseatMode::Mission),
        _ => Err(Error::Malformed),
    }
}

fn error(field: &[u8]) -> FrontseatError {
    let known = ERROR_CODES.iter().find(|(_, code)| code.as_bytes() == field);
    known.map_or(FrontseatError::Other, |(error, _)| *error)
}

/// One letter and seconds.
fn park_time(field: &[u8]) -> Result<u32, Error> {
    match field {
        [letter, seconds @ ..] if letter.is_ascii_alphabetic() => parse_integer(seconds),
        _ => Err(Error::Malformed),
    }
}

fn position(fields: &mut Fields<'_>) -> Result<[f64; 2], Error> {
    Ok([within(fields.number()?, -90.0, 90.0)?, within(fields.number()?, -180.0, 180.0)?])
}

fn heading(fields: &mut Fields<'_>) -> Result<f64, Error> {
    Ok(radians(within(fields.number()?, 0.0, 360.0)?))
}

fn power(fields: &mut Fields<'_>) -> Result<Power, Error> {
    Ok(Power {
        percent: within(fields.number()?, 0.0, 100.0)?,
        remaining_wh: fields.number()?,
        power_w: fields.number()?,
        voltage_v: fields.number()?,
        current_a: fields.number()?,
        minutes: fields.integer()?,
        battery: match fields.some()? {
            b"C" => Battery::Charging,
            b"F" => Battery::Full,
            b"D" => Battery::Discharging,
            _ => return Err(Error::Malformed),
        },
        leak: fields.flag()?,
    })
}

fn dvl(fields: &mut Fields<'_>) -> Result<FrontseatDvl, Error> {
    let mut value = || Ok::<_, Error>(Some(fields.number()?).filter(|value| *value > DVL_INVALID));
    let (x, y, z) = (value()?, value()?, value()?);
    Ok(FrontseatDvl {
        velocity_mps: match (x, y, z) {
            (Some(x), Some(y), Some(z)) => {
                Some([within(x, -30.0, 30.0)?, within(y, -30.0, 30.0)?, within(z, -30.0, 30.0)?])
            }
            _ => None,
        },
        distance_m: [value()?, value()?],
        depth_m: value()?,
        altitude_m: value()?,
    })
}

fn acknowledge(fields: &mut Fields<'_>) -> Result<Acknowledge, Error> {
    Ok(Acknowledge { command: fields.integer()?, accepted: !fields.flag()?, error: fields.integer()? })
}

impl<'a> ToFrontseat<'a> {
    /// Reads what the backseat sent.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by
    /// field.
    pub fn parse(sentence: &Sentence<'a>, units: &Units) -> Result<Self, Error> {
        let mut fields = sentence.fields();
        match sentence.id() {
            b"OSD" => Ok(Self::Request(request(&mut fields)?)),
            b"OMS" => Ok(Self::Steer(Steer {
                heading_rad: heading(&mut fields)?,
                depth_m: within(fields.number()?, 0.0, 5_000.0)? * units.command_depth.metres(),
                max_pitch_rad: radians(within(fields.number()?, 0.0, 90.0)?),
                speed_mps: within(fields.number()?, 0.0, 50.0)? * KNOT_MPS,
                timeout_s: timeout(&mut fields)?,
            })),
            b"OMP" => {
                let servo = ServoBytes::parse(fields.some()?)?;
                if fields.some()? != b"00" {
                    return Err(Error::Malformed);
                }
                Ok(Self::Servo(Servo { servo, timeout_s: timeout(&mut fields)? }))
            }
            b"OMSTART" => Ok(Self::Start(Start {
                ignore_gps: fields.flag()?,
                ignore_sounder: fields.flag()?,
                ignore_pressure: fields.flag()?,
                safety_return: fields.flag()?,
                mission: match fields.text()? {
                    "" => return Err(Error::Missing),
                    mission => mission,
                },
                return_path: Some(fields.text()?).filter(|path| !path.is_empty()),
            })),
            b"OMSTOP" => match fields.some()? {
                b"0" => Ok(Self::Stop),
                _ => Err(Error::Malformed),
            },
            b"OJW" => match fields.integer()? {
                waypoint @ 0..=999 => Ok(Self::Jump { waypoint }),
                _ => Err(Error::OutOfRange),
            },
            b"OPOS" => Ok(Self::Position(PositionAid {
                position_deg: position(&mut fields)?,
                speed_mps: within(fields.number()?, -50.0, 50.0)? * KNOT_MPS,
                conductivity_ms_per_cm: fields.optional_number()?,
                temperature_degc: fields.optional_number()?,
            })),
            b"ODVL" => Ok(Self::Velocity(VelocityAid {
                velocity_mps: [within(fields.number()?, -30.0, 30.0)?, within(fields.number()?, -30.0, 30.0)?],
                timeout_s: timeout(&mut fields)?,
            })),
            _ => Err(Error::Unknown),
        }
    }
}

fn timeout(fields: &mut Fields<'_>) -> Result<u8, Error> {
    match fields.integer()? {
        timeout @ 0..=MAX_TIMEOUT_S => Ok(timeout),
        _ => Err(Error::OutOfRange),
    }
}

/// Letters in any order, blanks among them.
fn request(fields: &mut Fields<'_>) -> Result<Request, Error> {
    let mut request = Request::default();
    while !fields.is_empty() {
        match fields.raw() {
            [] => {}
            b"G" => request.gps = true,
            b"C" => request.compass = true,
            b"S" => request.state = true,
            b"P" => request.power = true,
            b"Y" => request.sonde = true,
            b"D" => request.dvl = true,
            b"T" => request.t = true,
            b"I" => request.i = true,
            _ => return Err(Error::Malformed),
        }
    }
    Ok(request)
}
