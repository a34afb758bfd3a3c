//! `$CACST`, reception statistics: the sentence that carries the time of arrival.

use super::ClockMode;
use crate::calendar::{DateTime, TimeOfDay};
use crate::nmea::{Emitter, Fields, parse_integer};
use crate::{Decimal, Error};

/// From this number on the first field is a version, below it is the mode.
const FIRST_VERSION: u8 = 6;

/// A time of arrival: older firmware gives no date.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModemTime {
    /// `hhmmss.ssss`, to 100 µs.
    OfDay(TimeOfDay),
    /// `yyyymmddhhmmss.ffffff`.
    Full(DateTime),
}

impl ModemTime {
    /// µs since 1970; without a date, of the day that brings it nearest to `reference_us`.
    pub fn unix_us(self, reference_us: u64) -> u64 {
        match self {
            Self::OfDay(time) => time.nearest(reference_us),
            Self::Full(full) => full.unix_us(),
        }
    }
}

/// `$CACST`. Read by position from the left: a missing tail is `None`, and writing stops at the first `None`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceptionStatistics {
    /// Leading version number (6 and later), `None` in the older form.
    pub version: Option<u8>,
    /// 0 good, 1 bad CRC, 2 timeout.
    pub mode: u8,
    /// Time of arrival.
    pub arrival: ModemTime,
    /// Clock mode.
    pub clock: ClockMode,
    /// Match-filter detector: peak, power, ratio.
    pub detector: [Option<i32>; 3],
    /// Sound pressure level, dB.
    pub spl_db: Option<i32>,
    /// Analogue gain.
    pub gain: Option<i32>,
    /// Shifts: ainp, ain, mfd, p2b.
    pub shifts: [Option<i32>; 4],
    /// Data rate.
    pub rate: Option<i32>,
    /// Source.
    pub source: Option<i32>,
    /// Destination.
    pub destination: Option<i32>,
    /// PSK error code, 0 none.
    pub psk_error: Option<i32>,
    /// -1 none, 1 FSK, 2 FSK mini, 3 PSK, 4 PSK mini, 5 flexible.
    pub packet_type: Option<i32>,
    /// Frames in the packet.
    pub frames: Option<i32>,
    /// Of which bad.
    pub bad_frames: Option<i32>,
    /// Received signal strength, dB.
    pub rss_db: Option<Decimal>,
    /// Signal to noise ratio in, out, per symbol, dB; -100 where there is none.
    pub snr_db: [Option<Decimal>; 3],
    /// Mean squared error of the equaliser, dB.
    pub mse_db: Option<Decimal>,
    /// Data quality factor.
    pub quality: Option<i32>,
    /// Relative speed, m/s; sign by [`super::DopplerSign`].
    pub doppler_mps: Option<Decimal>,
    /// Noise, dB (from version 3 on).
    pub noise_db: Option<i32>,
    /// Carrier, Hz (from version 4 on).
    pub carrier_hz: Option<i32>,
    /// Bandwidth, Hz.
    pub bandwidth_hz: Option<i32>,
}

impl ReceptionStatistics {
    /// Mode of a good reception.
    pub const GOOD: u8 = 0;

    /// With everything after the clock mode missing.
    pub const fn new(version: Option<u8>, mode: u8, arrival: ModemTime, clock: ClockMode) -> Self {
        Self {
            version,
            mode,
            arrival,
            clock,
            detector: [None; 3],
            spl_db: None,
            gain: None,
            shifts: [None; 4],
            rate: None,
            source: None,
            destination: None,
            psk_error: None,
            packet_type: None,
            frames: None,
            bad_frames: None,
            rss_db: None,
            snr_db: [None; 3],
            mse_db: None,
            quality: None,
            doppler_mps: None,
            noise_db: None,
            carrier_hz: None,
            bandwidth_hz: None,
        }
    }

    /// A complete record of a good or bad packet for an emulator, with plausible values in the fields that are not
    /// used.
    pub const fn complete(version: Option<u8>, mode: u8, arrival: ModemTime, clock: ClockMode) -> Self {
        Self {
            detector: [Some(1440), Some(25), Some(175)],
            spl_db: Some(166),
            gain: Some(75),
            shifts: [Some(1), Some(1), Some(1), Some(3)],
            rate: Some(0),
            source: Some(0),
            destination: Some(0),
            psk_error: Some(0),
            packet_type: Some(1),
            frames: Some(1),
            bad_frames: Some(0),
            rss_db: Some(Decimal::new(150, 0)),
            snr_db: [Some(Decimal::new(12, 0)), Some(Decimal::new(9, 0)), Some(Decimal::new(-100, 0))],
            mse_db: Some(Decimal::new(-1, 0)),
            quality: Some(220),
            doppler_mps: Some(Decimal::new(0, 1)),
            noise_db: Some(45),
            carrier_hz: Some(10_000),
            bandwidth_hz: Some(2_000),
            ..Self::new(version, mode, arrival, clock)
        }
    }
}

impl ReceptionStatistics {
    pub(super) fn parse(f: &mut Fields<'_>) -> Result<Self, Error> {
        let first = f.integer()?;
        let (version, mode) = if first >= FIRST_VERSION { (Some(first), f.integer()?) } else { (None, first) };
        if mode > 2 {
            return Err(Error::OutOfRange);
        }
        let arrival = match version {
            Some(_) => ModemTime::Full(DateTime::parse_compact(f.some()?)?),
            None => ModemTime::OfDay(f.time()?),
        };
        let mut s = Self::new(version, mode, arrival, ClockMode(f.integer()?));
        for integer in s.detector.iter_mut().chain([&mut s.spl_db, &mut s.gain]).chain(&mut s.shifts).chain([
            &mut s.rate,
            &mut s.source,
            &mut s.destination,
            &mut s.psk_error,
            &mut s.packet_type,
            &mut s.frames,
            &mut s.bad_frames,
        ]) {
            *integer = f.optional(parse_integer)?;
        }
        for decimal in [&mut s.rss_db].into_iter().chain(&mut s.snr_db).chain([&mut s.mse_db]) {
            *decimal = f.optional(Decimal::parse)?;
        }
        s.quality = f.optional(parse_integer)?;
        s.doppler_mps = f.optional(Decimal::parse)?;
        for integer in [&mut s.noise_db, &mut s.carrier_hz, &mut s.bandwidth_hz] {
            *integer = f.optional(parse_integer)?;
        }
        Ok(s)
    }

    pub(super) fn write(&self, e: &mut Emitter<'_>) -> Result<(), Error> {
        if let Some(version) = self.version {
            e.unsigned(version)?;
        }
        e.unsigned(self.mode)?.field(|writer| match self.arrival {
            ModemTime::OfDay(time) => time.to_tenth_ms().write(writer, 4),
            ModemTime::Full(full) => full.write_compact(writer, 6),
        })?;
        e.padded(self.clock.0, if self.version.is_some() { 2 } else { 1 })?;
        let integer = |value: Option<i32>| value.map(|value| Decimal::new(i64::from(value), 0));
        let [peak, power, ratio] = self.detector.map(integer);
        let [ainp, ain, mfd, p2b] = self.shifts.map(integer);
        let [snr_in, snr_out, snr_symbol] = self.snr_db;
        let fields = [
            (peak, 1),
            (power, 2),
            (ratio, 4),
            (integer(self.spl_db), 4),
            (integer(self.gain), 2),
            (ainp, 2),
            (ain, 2),
            (mfd, 2),
            (p2b, 2),
            (integer(self.rate), 1),
            (integer(self.source), 3),
            (integer(self.destination), 3),
            (integer(self.psk_error), 1),
            (integer(self.packet_type), 1),
            (integer(self.frames), 1),
            (integer(self.bad_frames), 1),
            (self.rss_db, 1),
            (snr_in, 1),
            (snr_out, 1),
            (snr_symbol, 1),
            (self.mse_db, 1),
            (integer(self.quality), 3),
            (self.doppler_mps, 1),
            (integer(self.noise_db), 2),
            (integer(self.carrier_hz), 1),
            (integer(self.bandwidth_hz), 1),
        ];
        for (value, width) in fields.into_iter().map_while(|(value, width)| Some((value?, width))) {
            e.field(|writer| writer.decimal_padded(value, width))?;
        }
        Ok(())
    }
}
