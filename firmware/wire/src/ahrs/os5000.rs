//! OceanServer OS5000 compass: `$C…`, tagged values without commas, in fixed order, each only when enabled.

use super::AhrsSample;
use crate::nmea::{Emitter, Sentence, within};
use crate::units::{degrees, radians};
use crate::{Decimal, Error};

/// One sentence, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Os5000 {
    /// `C`: heading, [0, 2π), magnetic or true as the device is set up, rad.
    pub heading_rad: Option<f64>,
    /// `P`: pitch, rad.
    pub pitch_rad: Option<f64>,
    /// `R`: roll, rad.
    pub roll_rad: Option<f64>,
    /// `T`: temperature, °C.
    pub temperature_degc: Option<f64>,
    /// `D`: depth in feet or sensor voltage, as the device is set up.
    pub depth: Option<f64>,
    /// `Mx My Mz`: magnetic field, device units.
    pub mag: Option<[f64; 3]>,
    /// `Ax Ay Az`: as sent, g; positive down at rest, opposite to specific force.
    pub accel_g: Option<[f64; 3]>,
}

impl Os5000 {
    /// Reads the sentence: values in their order, each with its tag, none twice.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`] for a tag without value, [`Error::Malformed`],
    /// [`Error::OutOfRange`] by value.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        let mut rest = sentence.body();
        if rest.first() != Some(&b'C') || rest.contains(&b',') {
            return Err(Error::Unknown);
        }
        let mut compass = Self::default();
        let mut angle = |tag: &[u8], min: f64, max: f64| -> Result<Option<f64>, Error> {
            take(&mut rest, tag)?.map(|degrees| within(degrees, min, max).map(radians)).transpose()
        };
        compass.heading_rad = angle(b"C", 0.0, 360.0)?;
        compass.pitch_rad = angle(b"P", -90.0, 90.0)?;
        compass.roll_rad = angle(b"R", -180.0, 180.0)?;
        compass.temperature_degc = take(&mut rest, b"T")?;
        compass.depth = take(&mut rest, b"D")?;
        compass.mag = take_three(&mut rest, [b"Mx", b"My", b"Mz"])?;
        compass.accel_g = take_three(&mut rest, [b"Ax", b"Ay", b"Az"])?;
        if rest.is_empty() { Ok(compass) } else { Err(Error::Malformed) }
    }

    /// Attitude (when all three angles are there) and specific force.
    pub fn sample(&self) -> AhrsSample {
        let euler_rad = match (self.roll_rad, self.pitch_rad, self.heading_rad) {
            (Some(roll), Some(pitch), Some(heading)) => Some([roll, pitch, heading]),
            _ => None,
        };
        AhrsSample {
            euler_rad,
            rates_radps: None,
            specific_force_mps2: self
                .accel_g
                .and_then(|g| super::specific_force(g.map(|component| 0.0 - component)).ok()),
            timer_us: None,
        }
    }

    /// Writes the sentence with its line end: heading, temperature and depth to a tenth, tilts to a hundredth.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut emitter = Emitter::new(buffer, "")?;
        if let Some(heading) = self.heading_rad {
            let tenths = Decimal::from_f64(degrees(heading), 1)?.mantissa().rem_euclid(3_600);
            emitter.tagged("C", Decimal::new(tenths, 1))?;
        }
        for (tag, angle) in [("P", self.pitch_rad), ("R", self.roll_rad)] {
            if let Some(angle) = angle {
                let hundredths = Decimal::from_f64(degrees(angle), 2)?;
                let tenths = hundredths.rescaled(1).filter(|_| hundredths.mantissa() % 10 == 0);
                emitter.tagged(tag, tenths.map_or(hundredths, |tenths| Decimal::new(tenths, 1)))?;
            }
        }
        for (tag, value) in [("T", self.temperature_degc), ("D", self.depth)] {
            if let Some(value) = value {
                emitter.tagged(tag, Decimal::from_f64(value, 1)?)?;
            }
        }
        for (tags, values, decimals) in [(["Mx", "My", "Mz"], self.mag, 2), (["Ax", "Ay", "Az"], self.accel_g, 3)] {
            for (tag, value) in tags.into_iter().zip(values.into_iter().flatten()) {
                emitter.tagged(tag, Decimal::from_f64(value, decimals)?)?;
            }
        }
        emitter.finish()
    }
}

/// The value behind `tag` when the text begins with it.
fn take(rest: &mut &[u8], tag: &[u8]) -> Result<Option<f64>, Error> {
    let Some(after) = rest.strip_prefix(tag) else { return Ok(None) };
    let end = after.iter().position(u8::is_ascii_alphabetic).unwrap_or(after.len());
    let (number, next) = after.split_at_checked(end).ok_or(Error::Malformed)?;
    *rest = next;
    Ok(Some(Decimal::parse(number)?.to_f64()))
}

/// Three values that come together.
fn take_three(rest: &mut &[u8], tags: [&[u8]; 3]) -> Result<Option<[f64; 3]>, Error> {
    let [first, second, third] = tags;
    let Some(x) = take(rest, first)? else { return Ok(None) };
    let y = take(rest, second)?.ok_or(Error::Missing)?;
    let z = take(rest, third)?.ok_or(Error::Missing)?;
    Ok(Some([x, y, z]))
}
