//! Teledyne PD4 and PD5: little-endian binary records of fixed length. PD5 is PD4 with attitude and distance made good.

use super::{Coordinates, DvlSample, INVALID, altitude_m, error_mps, to_mmps, velocity_mps};
use crate::framer::{Verdict, Window, at, judged, sum16};
use crate::units::{degrees, radians};
use crate::write::Writer;
use crate::{Counts, Error};

/// Length of a PD5 record, the longer one, checksum included.
pub const MAX_RECORD: usize = 88;

/// One record, as integers of the wire. Velocities are those of the vehicle; -32768 is invalid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// System configuration: coordinates, tilts, three-beam solutions, frequency.
    pub configuration: u8,
    /// x, y, z, error relative to the bottom, mm/s.
    pub bottom_mmps: [i16; 4],
    /// Vertical range of each beam, cm; 0 is invalid.
    pub range_cm: [u16; 4],
    /// Two bits a beam: low correlation, low amplitude.
    pub bottom_status: u8,
    /// x, y, z, error relative to the water, mm/s.
    pub water_mmps: [i16; 4],
    /// Start and end of the water layer, dm.
    pub layer_dm: [u16; 2],
    /// Bits 0 to 3 beam low correlation, bit 4 altitude too shallow.
    pub water_status: u8,
    /// Hour, minute, second, hundredth of the first ping.
    pub clock: [u8; 4],
    /// Built-in test, 0 good.
    pub built_in_test: u16,
    /// Speed of sound, m/s.
    pub sound_speed_mps: u16,
    /// Temperature, 0.01 °C.
    pub temperature_cdegc: i16,
    /// What PD5 adds.
    pub extended: Option<Extended>,
}

/// The fields that only PD5 has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extended {
    /// Salinity, parts per thousand.
    pub salinity_ppt: u8,
    /// Depth of the transducer, dm.
    pub depth_dm: u16,
    /// Pitch, 0.01 degree.
    pub pitch_cdeg: i16,
    /// Roll, 0.01 degree.
    pub roll_cdeg: i16,
    /// Heading, 0.01 degree.
    pub heading_cdeg: u16,
    /// Distance made good over the bottom, dm.
    pub bottom_distance_dm: [i32; 4],
    /// Distance made good through the water, dm.
    pub water_distance_dm: [i32; 4],
}

const SYNC: u8 = 0x7D;
/// Bytes before the checksum.
const PD4_LENGTH: usize = 45;
const PD5_LENGTH: usize = 86;

impl Record {
    /// Reads a whole record with its checksum.
    ///
    /// # Errors
    /// [`Error::Framing`] without sync byte, [`Error::Unknown`] for another structure, [`Error::Length`],
    /// [`Error::Checksum`].
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        match examine(frame) {
            Verdict::Frame(length, record) if length == frame.len() => Ok(record),
            Verdict::Frame(..) | Verdict::Incomplete => Err(Error::Length),
            Verdict::Noise => Err(Error::Framing),
            Verdict::Reject(cause) => Err(cause),
        }
    }

    /// Frame of the velocities, by the configuration byte.
    pub const fn frame(&self) -> Coordinates {
        Coordinates::from_bits(self.configuration >> 6, self.configuration & 0b10_0000 != 0)
    }

    /// What it means to the vehicle; `mounting_rad` as in [`Coordinates::to_body`]. A water velocity of exactly zero is
    /// taken as invalid, as units in the field send it.
    pub fn sample(&self, mounting_rad: f64) -> DvlSample {
        let frame = self.frame();
        let to_body = |mmps| frame.to_body(velocity_mps(mmps)?, mounting_rad);
        let still = matches!(self.water_mmps, [0, 0, 0, _]);
        DvlSample {
            bottom_mps: to_body(self.bottom_mmps),
            water_mps: to_body(self.water_mmps).filter(|_| !still),
            altitude_m: altitude_m(self.range_cm.map(u32::from)),
            error_mps: error_mps(self.bottom_mmps),
            attitude_rad: self.extended.map(|extended| {
                [f64::from(extended.roll_cdeg), f64::from(extended.pitch_cdeg), f64::from(extended.heading_cdeg)]
                    .map(|angle| radians(angle / 100.0))
            }),
            depth_m: self.extended.map(|extended| f64::from(extended.depth_dm) / 10.0),
            sound_speed_mps: Some(f64::from(self.sound_speed_mps)),
            time_of_day_s: Some(super::time_of_day_s(self.clock)),
            frame,
        }
    }

    /// The record of an instrument that measured `sample`: PD5 when `extended`. Velocities in a frame that is not fixed
    /// to the vehicle are left invalid.
    pub fn from_sample(sample: &DvlSample, extended: bool, mounting_rad: f64) -> Self {
        let from_body = |body: Option<[f64; 3]>, error: Option<f64>| {
            let Some(xyz) = body.and_then(|body| sample.frame.from_body(body, mounting_rad)) else {
                return [INVALID; 4];
            };
            let [x, y, z] = xyz.map(to_mmps);
            [x, y, z, error.map_or(INVALID, to_mmps)]
        };
        let (coordinates, tilts) = sample.frame.to_bits();
        let [roll, pitch, heading] =
            sample.attitude_rad.unwrap_or_default().map(|angle| libm::round(degrees(angle) * 100.0));
        let status = |valid: bool, lost| if valid { 0 } else { lost };
        Self {
            // Three-beam solutions allowed, 600 kHz.
            configuration: coordinates << 6 | u8::from(tilts) << 5 | 0b1_0011,
            bottom_mmps: from_body(sample.bottom_mps, sample.error_mps),
            range_cm: [sample.altitude_m.map_or(0, |altitude| libm::round(altitude * 100.0) as u16); 4],
            bottom_status: status(sample.bottom_mps.is_some(), 0xFF),
            water_mmps: from_body(sample.water_mps, None),
            layer_dm: [20, 60],
            water_status: status(sample.water_mps.is_some(), 0x1F),
            clock: super::clock(sample.time_of_day_s.unwrap_or(0.0)),
            built_in_test: 0,
            sound_speed_mps: libm::round(sample.sound_speed_mps.unwrap_or(1_500.0)) as u16,
            temperature_cdegc: 1_500,
            extended: extended.then(|| Extended {
                salinity_ppt: 35,
                depth_dm: libm::round(sample.depth_m.unwrap_or(0.0) * 10.0) as u16,
                pitch_cdeg: pitch as i16,
                roll_cdeg: roll as i16,
                heading_cdeg: super::heading_cdeg(heading),
                bottom_distance_dm: [0; 4],
                water_distance_dm: [0; 4],
            }),
        }
    }

    /// Writes PD4, or PD5 with its extension.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut writer = Writer::new(buffer);
        let length = if self.extended.is_some() { PD5_LENGTH } else { PD4_LENGTH };
        writer.bytes(&[SYNC, u8::from(self.extended.is_some())])?;
        writer.bytes(&(length as u16).to_le_bytes())?;
        writer.byte(self.configuration)?;
        self.bottom_mmps.iter().try_for_each(|component| writer.bytes(&component.to_le_bytes()))?;
        self.range_cm.iter().try_for_each(|range| writer.bytes(&range.to_le_bytes()))?;
        writer.byte(self.bottom_status)?;
        self.water_mmps.iter().try_for_each(|component| writer.bytes(&component.to_le_bytes()))?;
        self.layer_dm.iter().try_for_each(|depth| writer.bytes(&depth.to_le_bytes()))?;
        writer.byte(self.water_status)?;
        writer.bytes(&self.clock)?;
        writer.bytes(&self.built_in_test.to_le_bytes())?;
        writer.bytes(&self.sound_speed_mps.to_le_bytes())?;
        writer.bytes(&self.temperature_cdegc.to_le_bytes())?;
        if let Some(extended) = &self.extended {
            writer.byte(extended.salinity_ppt)?;
            writer.bytes(&extended.depth_dm.to_le_bytes())?;
            writer.bytes(&extended.pitch_cdeg.to_le_bytes())?;
            writer.bytes(&extended.roll_cdeg.to_le_bytes())?;
            writer.bytes(&extended.heading_cdeg.to_le_bytes())?;
            for distance in extended.bottom_distance_dm.iter().chain(&extended.water_distance_dm) {
                writer.bytes(&distance.to_le_bytes())?;
            }
        }
        let sum = sum16(writer.written());
        writer.bytes(&sum.to_le_bytes())?;
        Ok(writer.finish())
    }
}

/// Judges what may be a record: the sync byte is frequent in data, count and checksum confirm it.
fn examine(bytes: &[u8]) -> Verdict<Record> {
    if bytes.first() != Some(&SYNC) {
        return Verdict::Noise;
    }
    let covered = match bytes.get(1) {
        None => return Verdict::Incomplete,
        Some(0) => PD4_LENGTH,
        Some(1) => PD5_LENGTH,
        Some(_) => return Verdict::Reject(Error::Unknown),
    };
    let Ok(count) = at(bytes, 2) else { return Verdict::Incomplete };
    if usize::from(u16::from_le_bytes(count)) != covered {
        return Verdict::Reject(Error::Length);
    }
    let (Some(record), Ok(printed)) = (bytes.get(..covered), at(bytes, covered)) else { return Verdict::Incomplete };
    if sum16(record) != u16::from_le_bytes(printed) {
        return Verdict::Reject(Error::Checksum);
    }
    judged(covered + 2, read(record))
}

fn read(record: &[u8]) -> Result<Record, Error> {
    let u16_at = |offset| Ok::<_, Error>(u16::from_le_bytes(at(record, offset)?));
    let i16_at = |offset| Ok::<_, Error>(i16::from_le_bytes(at(record, offset)?));
    let i32_at = |offset| Ok::<_, Error>(i32::from_le_bytes(at(record, offset)?));
    let velocity =
        |offset| Ok::<_, Error>([i16_at(offset)?, i16_at(offset + 2)?, i16_at(offset + 4)?, i16_at(offset + 6)?]);
    let distance =
        |offset| Ok::<_, Error>([i32_at(offset)?, i32_at(offset + 4)?, i32_at(offset + 8)?, i32_at(offset + 12)?]);
    let [configuration] = at(record, 4)?;
    let [bottom_status] = at(record, 21)?;
    let [water_status] = at(record, 34)?;
    let extended = if record.len() == PD5_LENGTH {
        let [salinity_ppt] = at(record, 45)?;
        Some(Extended {
            salinity_ppt,
            depth_dm: u16_at(46)?,
            pitch_cdeg: i16_at(48)?,
            roll_cdeg: i16_at(50)?,
            heading_cdeg: u16_at(52)?,
            bottom_distance_dm: distance(54)?,
            water_distance_dm: distance(70)?,
        })
    } else {
        None
    };
    Ok(Record {
        configuration,
        bottom_mmps: velocity(5)?,
        range_cm: [u16_at(13)?, u16_at(15)?, u16_at(17)?, u16_at(19)?],
        bottom_status,
        water_mmps: velocity(22)?,
        layer_dm: [u16_at(30)?, u16_at(32)?],
        water_status,
        clock: at(record, 35)?,
        built_in_test: u16_at(39)?,
        sound_speed_mps: u16_at(41)?,
        temperature_cdegc: i16_at(43)?,
        extended,
    })
}

/// Finds records in a byte stream.
pub struct Decoder {
    window: Window<{ 2 * MAX_RECORD }>,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new() }
    }

    /// Consumes bytes up to the next record or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Record, Error>> {
        self.window.feed(bytes, examine)
    }

    /// Records accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}
