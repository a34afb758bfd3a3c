use super::parse::{ERROR_CODES, MAX_TIMEOUT_S};
use super::servo::ServoBytes;
use super::{
    Acknowledge, Battery, Compass, FromFrontseat, FrontseatDvl, FrontseatMode, Power, Request, State, ToFrontseat,
    Units,
};
use crate::ahrs::os5000::Os5000;
use crate::nmea::{Emitter, within};
use crate::units::{KNOT_MPS, degrees};
use crate::{Decimal, Error};

impl FromFrontseat<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, units: &Units, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        match self {
            Self::Compass(compass) => emit_compass(compass, units, buffer),
            Self::State(state) => emit_state(state, units, buffer),
            Self::Power(power) => emit_power(power, buffer),
            Self::Dvl(dvl) => emit_dvl(dvl, buffer),
            Self::Acknowledge(Acknowledge { command, accepted, error }) => {
                let mut emitter = Emitter::new(buffer, "ACK")?;
                emitter.unsigned(*command)?.flag(!accepted)?.unsigned(*error)?;
                emitter.finish()
            }
            Self::Rmc(rmc) => rmc.emit(buffer),
            Self::Gga(gga) => gga.emit(buffer),
        }
    }
}

fn emit_compass<'b>(compass: &Compass, units: &Units, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    Os5000 {
        heading_rad: Some(compass.heading_rad),
        pitch_rad: Some(compass.pitch_rad),
        roll_rad: Some(compass.roll_rad),
        temperature_degc: compass.temperature_degc,
        depth: compass.depth_m.map(|depth| depth / units.compass_depth.metres()),
        mag: None,
        accel_g: None,
    }
    .emit(buffer)
}

fn emit_state<'b>(state: &State<'_>, units: &Units, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let mut emitter = Emitter::new(buffer, "OSI")?;
    servo(&mut emitter, &state.servo)?;
    emitter.text(match state.mode {
        FrontseatMode::Normal => "N",
        FrontseatMode::Stopped => "S",
        FrontseatMode::Parking => "P",
        FrontseatMode::ManualOverride => "M",
        FrontseatMode::ManualParking => "mP",
        FrontseatMode::Servo => "A",
        FrontseatMode::Mission => "W",
    })?;
    emitter.unsigned(state.next_waypoint)?;
    position(&mut emitter, state.position_deg)?;
    emitter.number(state.speed_mps / KNOT_MPS, 1)?.number(state.distance_to_next_m, 1)?;
    let code = ERROR_CODES.iter().find(|(error, _)| *error == state.error);
    emitter.text(code.map_or("E", |(_, code)| code))?;
    emitter.optional_number(state.altitude_m.map(|altitude| altitude / units.status_altitude.metres()), 1)?;
    match state.park_time_s {
        Some(seconds) => emitter.field(|writer| {
            writer.byte(b'P')?;
            writer.unsigned(u64::from(seconds), 1)
        })?,
        None => emitter.blank()?,
    };
    emitter.optional_number(state.declination_rad.map(degrees), 1)?;
    emitter.text(state.mission)?.text(state.remaining_time)?;
    heading(&mut emitter, state.heading_rad)?;
    emitter.number(state.depth_m / units.status_depth.metres(), 1)?.blank()?.blank()?;
    emitter.finish()
}

fn emit_power<'b>(power: &Power, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let mut emitter = Emitter::new(buffer, "OPI")?;
    emitter.number(power.percent, 1)?.number(power.remaining_wh, 1)?.number(power.power_w, 1)?;
    emitter.number(power.voltage_v, 1)?.number(power.current_a, 2)?.unsigned(power.minutes)?;
    emitter.text(match power.battery {
        Battery::Charging => "C",
        Battery::Full => "F",
        Battery::Discharging => "D",
    })?;
    emitter.flag(power.leak)?;
    emitter.finish()
}

fn emit_dvl<'b>(dvl: &FrontseatDvl, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let mut emitter = Emitter::new(buffer, "DVL")?;
    let mut value = |value: Option<f64>, decimals: u8| match value {
        Some(value) => emitter.number(value, decimals).map(|_| ()),
        None => emitter.text("-3200").map(|_| ()),
    };
    for axis in 0..3 {
        value(dvl.velocity_mps.and_then(|velocity| velocity.get(axis).copied()), 2)?;
    }
    for distance in dvl.distance_m {
        value(distance, 1)?;
    }
    value(dvl.depth_m, 2)?;
    value(dvl.altitude_m, 2)?;
    emitter.finish()
}

impl ToFrontseat<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, units: &Units, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut emitter = Emitter::new(buffer, self.id())?;
        match self {
            Self::Request(request) => emit_request(&mut emitter, request)?,
            Self::Steer(steer) => {
                heading(&mut emitter, steer.heading_rad)?;
                emitter.number(within(steer.depth_m / units.command_depth.metres(), 0.0, 5_000.0)?, 1)?;
                emitter.number(within(degrees(steer.max_pitch_rad), 0.0, 90.0)?, 1)?;
                emitter.number(within(steer.speed_mps / KNOT_MPS, 0.0, 50.0)?, 1)?;
                timeout(&mut emitter, steer.timeout_s)?;
            }
            Self::Servo(command) => {
                servo(&mut emitter, &command.servo)?;
                emitter.text("00")?;
                timeout(&mut emitter, command.timeout_s)?;
            }
            Self::Start(start) => {
                emitter.flag(start.ignore_gps)?.flag(start.ignore_sounder)?;
                emitter.flag(start.ignore_pressure)?.flag(start.safety_return)?.text(start.mission)?;
                if let Some(path) = start.return_path {
                    emitter.text(path)?;
                }
            }
            Self::Stop => {
                emitter.unsigned(0_u8)?;
            }
            Self::Jump { waypoint } => {
                emitter.unsigned(if *waypoint > 999 { return Err(Error::OutOfRange) } else { *waypoint })?;
            }
            Self::Position(aid) => {
                position(&mut emitter, aid.position_deg)?;
                emitter.number(aid.speed_mps / KNOT_MPS, 1)?;
                emitter.optional_number(aid.conductivity_ms_per_cm, 2)?;
                emitter.optional_number(aid.temperature_degc, 2)?;
            }
            Self::Velocity(aid) => {
                let [x, y] = aid.velocity_mps;
                emitter.number(x, 2)?.number(y, 2)?;
                timeout(&mut emitter, aid.timeout_s)?;
            }
        }
        emitter.finish()
    }

    const fn id(&self) -> &'static str {
        match self {
            Self::Request(_) => "OSD",
            Self::Steer(_) => "OMS",
            Self::Servo(_) => "OMP",
            Self::Start(_) => "OMSTART",
            Self::Stop => "OMSTOP",
            Self::Jump { .. } => "OJW",
            Self::Position(_) => "OPOS",
            Self::Velocity(_) => "ODVL",
        }
    }
}

fn emit_request(emitter: &mut Emitter<'_>, request: &Request) -> Result<(), Error> {
    let Request { gps, compass, state, power, sonde, dvl, t, i } = *request;
    let letters =
        [(gps, "G"), (compass, "C"), (state, "S"), (power, "P"), (sonde, "Y"), (dvl, "D"), (t, "T"), (i, "I")];
    for (wanted, letter) in letters {
        emitter.text(if wanted { letter } else { "" })?;
    }
    Ok(())
}

fn servo(emitter: &mut Emitter<'_>, servo: &ServoBytes) -> Result<(), Error> {
    emitter.field(|writer| {
        servo.fins.into_iter().try_for_each(|fin| writer.hex(fin))?;
        writer.hex(servo.motor)
    })?;
    Ok(())
}

fn position(emitter: &mut Emitter<'_>, position_deg: [f64; 2]) -> Result<(), Error> {
    let [latitude, longitude] = position_deg;
    emitter.number(within(latitude, -90.0, 90.0)?, 5)?.number(within(longitude, -180.0, 180.0)?, 5)?;
    Ok(())
}

/// Degrees in [0, 360) to 0.1, of any angle within some turns.
fn heading(emitter: &mut Emitter<'_>, heading_rad: f64) -> Result<(), Error> {
    let tenths = Decimal::from_f64(degrees(heading_rad), 1)?.mantissa().rem_euclid(3_600);
    emitter.decimal(Decimal::new(tenths, 1))?;
    Ok(())
}

fn timeout(emitter: &mut Emitter<'_>, timeout_s: u8) -> Result<(), Error> {
    if timeout_s > MAX_TIMEOUT_S {
        return Err(Error::OutOfRange);
    }
    emitter.unsigned(timeout_s)?;
    Ok(())
}
