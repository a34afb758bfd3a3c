//! Teledyne PD0: little-endian binary ensembles of blocks found through an offset table.

use super::{Coordinates, DvlSample, INVALID, altitude_m, error_mps, to_mmps, velocity_mps};
use crate::framer::{Verdict, Window, at, judged, sum16};
use crate::units::{degrees, radians};
use crate::write::Writer;
use crate::{Counts, Error};

/// Longest ensemble taken, checksum included.
pub const MAX_ENSEMBLE: usize = 2_048;

/// One ensemble: the blocks a mission needs, as integers of the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ensemble {
    /// Fixed leader.
    pub fixed: Option<FixedLeader>,
    /// Variable leader.
    pub variable: Option<VariableLeader>,
    /// Bottom track.
    pub bottom: Option<BottomTrack>,
    /// Velocity of the first cell of the water profile (water relative to instrument), mm/s.
    pub first_cell_mmps: Option<[i16; 4]>,
}

/// Fixed leader (block 0000h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedLeader {
    /// Firmware version and revision.
    pub firmware: [u8; 2],
    /// System configuration.
    pub configuration: u16,
    /// Beams.
    pub beams: u8,
    /// Depth cells.
    pub cells: u8,
    /// Pings per ensemble.
    pub pings: u16,
    /// Cell length, cm.
    pub cell_cm: u16,
    /// Coordinate byte (`EX`).
    pub coordinates: u8,
    /// Heading alignment (`EA`), 0.01 degree.
    pub heading_alignment_cdeg: i16,
}

/// Variable leader (block 0080h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VariableLeader {
    /// Ensemble number, with its most significant byte.
    pub ensemble: u32,
    /// Year of the century, month, day, hour, minute, second, hundredth.
    pub clock: [u8; 7],
    /// Built-in test, 0 good.
    pub built_in_test: u16,
    /// Speed of sound, m/s.
    pub sound_speed_mps: u16,
    /// Depth of the transducer, dm.
    pub depth_dm: u16,
    /// Heading, 0.01 degree.
    pub heading_cdeg: u16,
    /// Pitch, 0.01 degree, beam 3 up positive.
    pub pitch_cdeg: i16,
    /// Roll, 0.01 degree, as sent.
    pub roll_cdeg: i16,
    /// Salinity, parts per thousand.
    pub salinity_ppt: u16,
    /// Temperature, 0.01 °C.
    pub temperature_cdegc: i16,
}

/// Bottom track (block 0600h). Velocities are those of bottom and water relative to the instrument; -32768 is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BottomTrack {
    /// Vertical range of each beam, cm; 0 is invalid.
    pub range_cm: [u32; 4],
    /// x, y, z, error, mm/s.
    pub velocity_mmps: [i16; 4],
    /// Correlation.
    pub correlation: [u8; 4],
    /// Evaluation amplitude.
    pub amplitude: [u8; 4],
    /// Percent good.
    pub percent_good: [u8; 4],
    /// Velocity of the reference layer, mm/s.
    pub layer_velocity_mmps: [i16; 4],
    /// Largest tracking depth, dm.
    pub max_depth_dm: u16,
}

const SYNC: [u8; 2] = [0x7F, 0x7F];
/// Header without its offsets.
const HEADER: usize = 6;
const CHECKSUM: usize = 2;
const FIXED: u16 = 0x0000;
const VARIABLE: u16 = 0x0080;
const VELOCITY: u16 = 0x0100;
const BOTTOM: u16 = 0x0600;
/// Block sizes of an Explorer.
const FIXED_LENGTH: usize = 58;
const VARIABLE_LENGTH: usize = 60;
const CELL_LENGTH: usize = 10;
const BOTTOM_LENGTH: usize = 81;

impl Ensemble {
    /// Reads a whole ensemble with its checksum.
    ///
    /// # Errors
    /// [`Error::Framing`] without `7F 7F`, [`Error::Length`], [`Error::Checksum`], [`Error::Offset`] for a block beyond
    /// the ensemble or too short for its fields.
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        match examine(frame) {
            Verdict::Frame(length, ensemble) if length == frame.len() => Ok(ensemble),
            Verdict::Frame(..) | Verdict::Incomplete => Err(Error::Length),
            Verdict::Noise => Err(Error::Framing),
            Verdict::Reject(cause) => Err(cause),
        }
    }

    /// What it means to the vehicle; `mounting_rad` as in [`Coordinates::to_body`].
    pub fn sample(&self, mounting_rad: f64) -> DvlSample {
        // Without a fixed leader the frame of reference is unknown.
        let frame = self.fixed.map_or(Coordinates::Beam, |fixed| fixed.frame());
        // PD0 has the velocity of bottom and water as the instrument sees them.
        let to_body = |mmps| frame.to_body(velocity_mps(mmps)?.map(|component| 0.0 - component), mounting_rad);
        let variable = self.variable.as_ref();
        DvlSample {
            bottom_mps: self.bottom.and_then(|bottom| to_body(bottom.velocity_mmps)),
            water_mps: self.bottom.and_then(|bottom| to_body(bottom.layer_velocity_mmps)),
            altitude_m: self.bottom.and_then(|bottom| altitude_m(bottom.range_cm)),
            error_mps: self.bottom.and_then(|bottom| error_mps(bottom.velocity_mmps)),
            attitude_rad: variable.map(|leader| {
                let cdeg = [f64::from(leader.roll_cdeg), f64::from(leader.pitch_cdeg), f64::from(leader.heading_cdeg)];
                cdeg.map(|angle| radians(angle / 100.0))
            }),
            depth_m: variable.map(|leader| f64::from(leader.depth_dm) / 10.0),
            sound_speed_mps: variable.map(|leader| f64::from(leader.sound_speed_mps)),
            time_of_day_s: variable.map(|leader| {
                let [_, _, _, clock @ ..] = leader.clock;
                super::time_of_day_s(clock)
            }),
            frame,
        }
    }

    /// The ensemble of an instrument that measured `sample`, in its frame; velocities in a frame that is not fixed to
    /// the vehicle are left invalid.
    pub fn from_sample(sample: &DvlSample, ensemble: u32, mounting_rad: f64) -> Self {
        let from_body = |body: Option<[f64; 3]>, error: Option<f64>| {
            let Some([x, y, z]) = body.and_then(|body| sample.frame.from_body(body, mounting_rad)) else {
                return [INVALID; 4];
            };
            [to_mmps(-x), to_mmps(-y), to_mmps(-z), error.map_or(INVALID, to_mmps)]
        };
        let [roll, pitch, heading] =
            sample.attitude_rad.unwrap_or_default().map(|angle| libm::round(degrees(angle) * 100.0));
        let (coordinates, tilts) = sample.frame.to_bits();
        let range_cm = sample.altitude_m.map_or(0, |altitude| libm::round(altitude * 100.0) as u32);
        let locked = sample.bottom_mps.is_some();
        let [hour, minute, second, hundredth] = super::clock(sample.time_of_day_s.unwrap_or(0.0));
        Self {
            fixed: Some(FixedLeader {
                firmware: [34, 18],
                // 600 kHz, convex, 30 degrees, four-beam Janus.
                configuration: 0x420B,
                beams: 4,
                cells: 1,
                pings: 1,
                cell_cm: 200,
                coordinates: coordinates << 3 | u8::from(tilts) << 2 | 0b11,
                heading_alignment_cdeg: 0,
            }),
            variable: Some(VariableLeader {
                ensemble,
                clock: [0, 1, 1, hour, minute, second, hundredth],
                built_in_test: 0,
                sound_speed_mps: libm::round(sample.sound_speed_mps.unwrap_or(1_500.0)) as u16,
                depth_dm: libm::round(sample.depth_m.unwrap_or(0.0) * 10.0) as u16,
                heading_cdeg: super::heading_cdeg(heading),
                pitch_cdeg: pitch as i16,
                roll_cdeg: roll as i16,
                salinity_ppt: 35,
                temperature_cdegc: 1_500,
            }),
            bottom: Some(BottomTrack {
                range_cm: [range_cm; 4],
                velocity_mmps: from_body(sample.bottom_mps, sample.error_mps),
                correlation: [if locked { 250 } else { 0 }; 4],
                amplitude: [if locked { 200 } else { 0 }; 4],
                percent_good: [if locked { 100 } else { 0 }; 4],
                layer_velocity_mmps: from_body(sample.water_mps, None),
                max_depth_dm: 800,
            }),
            first_cell_mmps: None,
        }
    }

    /// Writes the blocks that are there, in an Explorer's sizes.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let lengths = [
            self.fixed.map_or(0, |_| FIXED_LENGTH),
            self.variable.map_or(0, |_| VARIABLE_LENGTH),
            self.first_cell_mmps.map_or(0, |_| CELL_LENGTH),
            self.bottom.map_or(0, |_| BOTTOM_LENGTH),
        ];
        let blocks = lengths.iter().filter(|length| **length > 0).count();
        let first = HEADER + 2 * blocks;
        let covered = first + lengths.iter().sum::<usize>();
        let mut writer = Writer::new(buffer);
        writer.bytes(&SYNC)?;
        writer.bytes(&(covered as u16).to_le_bytes())?;
        writer.bytes(&[0, blocks as u8])?;
        let mut offset = first;
        for length in lengths.into_iter().filter(|length| *length > 0) {
            writer.bytes(&(offset as u16).to_le_bytes())?;
            offset += length;
        }
        if let Some(fixed) = &self.fixed {
            writer.bytes(&fixed.block())?;
        }
        if let Some(variable) = &self.variable {
            writer.bytes(&variable.block())?;
        }
        if let Some(cell) = self.first_cell_mmps {
            writer.bytes(&VELOCITY.to_le_bytes())?;
            cell.into_iter().try_for_each(|component| writer.bytes(&component.to_le_bytes()))?;
        }
        if let Some(bottom) = &self.bottom {
            writer.bytes(&bottom.block())?;
        }
        let sum = sum16(writer.written());
        writer.bytes(&sum.to_le_bytes())?;
        Ok(writer.finish())
    }
}

/// Judges what may be an ensemble: header first, so that a false one is not waited for.
fn examine(bytes: &[u8]) -> Verdict<Ensemble> {
    if !bytes.iter().zip(SYNC).all(|(byte, sync)| *byte == sync) {
        return Verdict::Noise;
    }
    let (Ok(covered), Ok([blocks])) = (at(bytes, 2), at(bytes, 5)) else { return Verdict::Incomplete };
    let (covered, first) = (usize::from(u16::from_le_bytes(covered)), HEADER + 2 * usize::from(blocks));
    let length = covered + CHECKSUM;
    if covered < first || length > MAX_ENSEMBLE {
        return Verdict::Reject(Error::Length);
    }
    let Some(table) = bytes.get(HEADER..first) else { return Verdict::Incomplete };
    if offsets(table).any(|offset| offset < first || offset + 2 > covered) {
        return Verdict::Reject(Error::Offset);
    }
    let (Some(ensemble), Ok(printed)) = (bytes.get(..covered), at(bytes, covered)) else { return Verdict::Incomplete };
    if sum16(ensemble) != u16::from_le_bytes(printed) {
        return Verdict::Reject(Error::Checksum);
    }
    judged(length, read(ensemble, table))
}

fn offsets(table: &[u8]) -> impl Iterator<Item = usize> + Clone + '_ {
    table.chunks_exact(2).filter_map(|pair| Some(usize::from(u16::from_le_bytes(*pair.first_chunk()?))))
}

fn read(ensemble: &[u8], table: &[u8]) -> Result<Ensemble, Error> {
    let mut decoded = Ensemble::default();
    for offset in offsets(table) {
        // A block ends where the next begins, wherever that is in the table.
        let end = offsets(table).filter(|other| *other > offset).min().unwrap_or(ensemble.len());
        let block = ensemble.get(offset..end).ok_or(Error::Offset)?;
        match u16::from_le_bytes(at(block, 0)?) {
            FIXED => decoded.fixed = Some(FixedLeader::read(block)?),
            VARIABLE => decoded.variable = Some(VariableLeader::read(block)?),
            VELOCITY => decoded.first_cell_mmps = Some(four_i16(block, 2)?),
            BOTTOM => decoded.bottom = Some(BottomTrack::read(block)?),
            _ => {}
        }
    }
    Ok(decoded)
}

impl FixedLeader {
    /// Frame of the velocities, by the coordinate byte.
    pub const fn frame(&self) -> Coordinates {
        Coordinates::from_bits(self.coordinates >> 3, self.coordinates & 0b100 != 0)
    }

    fn read(block: &[u8]) -> Result<Self, Error> {
        let [beams, cells] = at(block, 8)?;
        let [coordinates] = at(block, 25)?;
        Ok(Self {
            firmware: at(block, 2)?,
            configuration: u16_at(block, 4)?,
            beams,
            cells,
            pings: u16_at(block, 10)?,
            cell_cm: u16_at(block, 12)?,
            coordinates,
            heading_alignment_cdeg: i16_at(block, 26)?,
        })
    }

    fn block(&self) -> [u8; FIXED_LENGTH] {
        let mut block = [0; FIXED_LENGTH];
        put(&mut block, 0, &FIXED.to_le_bytes());
        put(&mut block, 2, &self.firmware);
        put(&mut block, 4, &self.configuration.to_le_bytes());
        put(&mut block, 8, &[self.beams, self.cells]);
        put(&mut block, 10, &self.pings.to_le_bytes());
        put(&mut block, 12, &self.cell_cm.to_le_bytes());
        put(&mut block, 25, &[self.coordinates]);
        put(&mut block, 26, &self.heading_alignment_cdeg.to_le_bytes());
        block
    }
}

impl VariableLeader {
    fn read(block: &[u8]) -> Result<Self, Error> {
        let [high] = at(block, 11)?;
        Ok(Self {
            ensemble: u32::from(high) << 16 | u32::from(u16_at(block, 2)?),
            clock: at(block, 4)?,
            built_in_test: u16_at(block, 12)?,
            sound_speed_mps: u16_at(block, 14)?,
            depth_dm: u16_at(block, 16)?,
            heading_cdeg: u16_at(block, 18)?,
            pitch_cdeg: i16_at(block, 20)?,
            roll_cdeg: i16_at(block, 22)?,
            salinity_ppt: u16_at(block, 24)?,
            temperature_cdegc: i16_at(block, 26)?,
        })
    }

    fn block(&self) -> [u8; VARIABLE_LENGTH] {
        let [low, middle, high, _] = self.ensemble.to_le_bytes();
        let mut block = [0; VARIABLE_LENGTH];
        put(&mut block, 0, &VARIABLE.to_le_bytes());
        put(&mut block, 2, &[low, middle]);
        put(&mut block, 4, &self.clock);
        put(&mut block, 11, &[high]);
        put(&mut block, 12, &self.built_in_test.to_le_bytes());
        put(&mut block, 14, &self.sound_speed_mps.to_le_bytes());
        put(&mut block, 16, &self.depth_dm.to_le_bytes());
        put(&mut block, 18, &self.heading_cdeg.to_le_bytes());
        put(&mut block, 20, &self.pitch_cdeg.to_le_bytes());
        put(&mut block, 22, &self.roll_cdeg.to_le_bytes());
        put(&mut block, 24, &self.salinity_ppt.to_le_bytes());
        put(&mut block, 26, &self.temperature_cdegc.to_le_bytes());
        block
    }
}

impl BottomTrack {
    fn read(block: &[u8]) -> Result<Self, Error> {
        let mut range_cm = [0; 4];
        // The high bytes came with later firmware.
        let high: [u8; 4] = at(block, 77).unwrap_or_default();
        for (beam, (range, high)) in range_cm.iter_mut().zip(high).enumerate() {
            *range = u32::from(high) << 16 | u32::from(u16_at(block, 16 + 2 * beam)?);
        }
        Ok(Self {
            range_cm,
            velocity_mmps: four_i16(block, 24)?,
            correlation: at(block, 32)?,
            amplitude: at(block, 36)?,
            percent_good: at(block, 40)?,
            layer_velocity_mmps: four_i16(block, 50)?,
            max_depth_dm: u16_at(block, 70)?,
        })
    }

    fn block(&self) -> [u8; BOTTOM_LENGTH] {
        let mut block = [0; BOTTOM_LENGTH];
        put(&mut block, 0, &BOTTOM.to_le_bytes());
        put(&mut block, 2, &[1, 0]);
        for (beam, range) in self.range_cm.into_iter().enumerate() {
            let [low, middle, high, _] = range.to_le_bytes();
            put(&mut block, 16 + 2 * beam, &[low, middle]);
            put(&mut block, 77 + beam, &[high]);
        }
        for (at, velocity) in [(24, self.velocity_mmps), (50, self.layer_velocity_mmps)] {
            for (axis, component) in velocity.into_iter().enumerate() {
                put(&mut block, at + 2 * axis, &component.to_le_bytes());
            }
        }
        put(&mut block, 32, &self.correlation);
        put(&mut block, 36, &self.amplitude);
        put(&mut block, 40, &self.percent_good);
        put(&mut block, 70, &self.max_depth_dm.to_le_bytes());
        block
    }
}

fn put(block: &mut [u8], offset: usize, bytes: &[u8]) {
    for (slot, byte) in block.iter_mut().skip(offset).zip(bytes) {
        *slot = *byte;
    }
}

fn u16_at(block: &[u8], offset: usize) -> Result<u16, Error> {
    Ok(u16::from_le_bytes(at(block, offset)?))
}

fn i16_at(block: &[u8], offset: usize) -> Result<i16, Error> {
    Ok(i16::from_le_bytes(at(block, offset)?))
}

fn four_i16(block: &[u8], offset: usize) -> Result<[i16; 4], Error> {
    Ok([i16_at(block, offset)?, i16_at(block, offset + 2)?, i16_at(block, offset + 4)?, i16_at(block, offset + 6)?])
}

/// Finds ensembles in a byte stream.
pub struct Decoder {
    window: Window<MAX_ENSEMBLE>,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new() }
    }

    /// Consumes bytes up to the next ensemble or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Ensemble, Error>> {
        self.window.feed(bytes, examine)
    }

    /// Ensembles accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}
