use super::{
    Acknowledged, Addresses, ClockMode, Cycle, Data, DataRequest, DataTaken, ErrorReport, Flexible, FlexibleReceived,
    FlexibleTaken, Fragment, FromModem, MAX_FRAGMENTS, Payload, PingReply, PingReply2, RATES, Received,
    ReceptionStatistics, Revision, Setting, TimeReport, ToModem, TransmitStatistics, UserBits,
};
use crate::calendar::{Date, DateTime, TimeOfDay, parse_date};
use crate::nmea::{Fields, Sentence, parse_flag, parse_integer};
use crate::{Decimal, Error, hex};

/// Longest travel time that can be meant, s: a thousand kilometres.
const MAX_TRAVEL_S: i64 = 700;

impl<'a> FromModem<'a> {
    /// Reads what the modem sent.
    ///
    /// # Errors
    /// [`Error::Unhandled`] for sentences no mission needs, [`Error::Unknown`] for others; [`Error::Missing`],
    /// [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'a>) -> Result<Self, Error> {
        let mut f = sentence.fields();
        match sentence.id() {
            b"CACYC" => Ok(Self::Cycle(cycle(&mut f)?)),
            b"CADRQ" => Ok(Self::DataRequest(DataRequest {
                time: f.time()?,
                addresses: addresses(&mut f)?,
                acknowledge: f.flag()?,
                bytes: f.integer()?,
                frame: f.integer()?,
            })),
            b"CATXD" => Ok(Self::DataTaken(DataTaken {
                addresses: addresses(&mut f)?,
                acknowledge: f.flag()?,
                bytes: f.integer()?,
            })),
            b"CATXP" => Ok(Self::TransmitBegins { bytes: f.integer()? }),
            b"CATXF" => Ok(Self::TransmitEnded { bytes: f.integer()? }),
            b"CARXP" => Ok(Self::ReceiveBegins { psk: f.flag()? }),
            b"CARXD" => Ok(Self::Received(Received {
                addresses: addresses(&mut f)?,
                acknowledge: f.flag()?,
                frame: f.integer()?,
                payload: Payload::from_digits(f.raw())?,
            })),
            b"CAACK" | b"CAAACK" => Ok(Self::Acknowledged(Acknowledged {
                addresses: addresses(&mut f)?,
                frame: f.integer()?,
                acknowledge: f.flag()?,
            })),
            b"CADQF" => Ok(Self::DataQuality { quality: f.integer()?, packet_type: f.integer()? }),
            b"CADOP" => Ok(Self::Doppler(f.decimal()?)),
            b"CACST" => Ok(Self::Statistics(ReceptionStatistics::parse(&mut f)?)),
            b"CAXST" => transmit_statistics(&mut f),
            b"CATOA" => Ok(Self::TimeOfArrival { time: f.time()?, clock: ClockMode(f.integer()?) }),
            b"CAMSG" => Ok(Self::Message { text: some_text(&mut f)?, number: f.integer()? }),
            b"CAERR" => Ok(Self::Error(ErrorReport {
                time: f.time()?,
                module: some_text(&mut f)?,
                number: f.integer()?,
                text: rest(&mut f)?,
            })),
            b"CAMPC" => Ok(Self::PingSent(addresses(&mut f)?)),
            b"CAMPA" => Ok(Self::PingArrived(addresses(&mut f)?)),
            b"CAMPR" => {
                Ok(Self::PingReply(PingReply { addresses: addresses(&mut f)?, travel_s: f.optional(travel_time)? }))
            }
            b"CACMR" => match f.some()? {
                b"PNR" => Ok(Self::PingReply2(PingReply2 {
                    time: f.iso_time()?,
                    addresses: addresses(&mut f)?,
                    travel_s: f.optional(travel_time)?,
                })),
                _ => Err(Error::Unhandled),
            },
            b"CACFG" => Ok(Self::Setting(setting(&mut f)?)),
            b"CACLK" => Ok(Self::Clock(clock(&mut f)?)),
            b"CATMS" => Ok(Self::TimeSet { status: f.integer()?, time: f.iso_time()? }),
            b"CATMQ" => Ok(Self::TimeReport(TimeReport {
                time: f.iso_time()?,
                clock_source: some_text(&mut f)?,
                pps_source: some_text(&mut f)?,
            })),
            b"CAREV" => Ok(Self::Revision(Revision {
                time: f.time()?,
                identifier: some_text(&mut f)?,
                version: some_text(&mut f)?,
            })),
            b"CAMUA" => Ok(Self::UserBits(user_bits(&mut f)?)),
            b"CATDP" => Ok(Self::FlexibleTaken(FlexibleTaken {
                error: f.integer()?,
                id: f.integer()?,
                destination: f.integer()?,
                rate: rate(&mut f)?,
                acknowledge: f.flag()?,
            })),
            b"CARDP" => flexible_received(&mut f),
            b"SNTTA" => Ok(Self::TravelTimes {
                travel_s: [
                    f.optional(travel_time)?,
                    f.optional(travel_time)?,
                    f.optional(travel_time)?,
                    f.optional(travel_time)?,
                ],
                time: f.time()?,
            }),
            // Echoes, a ping's arrival in two field orders, and a packet type whose layout is not public.
            b"CACMD" | b"CACMA" | b"CARFP" | b"CAMUC" | b"CACFQ" | b"CAMSC" => Err(Error::Unhandled),
            _ => Err(Error::Unknown),
        }
    }
}

impl<'a> ToModem<'a> {
    /// Reads what the host sent.
    ///
    /// # Errors
    /// [`Error::Unhandled`] for sentences no mission needs, [`Error::Unknown`] for others; [`Error::Missing`],
    /// [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'a>) -> Result<Self, Error> {
        let mut f = sentence.fields();
        match sentence.id() {
            b"CCCYC" => Ok(Self::Cycle(cycle(&mut f)?)),
            b"CCTXD" => Ok(Self::Data(Data {
                addresses: addresses(&mut f)?,
                acknowledge: f.flag()?,
                payload: Payload::from_digits(f.raw())?,
            })),
            b"CCMPC" => Ok(Self::Ping(addresses(&mut f)?)),
            b"CCMUC" => Ok(Self::UserBits(user_bits(&mut f)?)),
            b"CCCFG" => Ok(Self::Configure(setting(&mut f)?)),
            b"CCCFQ" => Ok(Self::Query { name: some_text(&mut f)? }),
            b"CCCLK" => Ok(Self::SetClock(clock(&mut f)?)),
            b"CCTMS" => Ok(Self::SetTime { time: f.iso_time()?, mode: f.integer()? }),
            b"CCTMQ" => f.integer::<u8>().map(|_| Self::QueryTime),
            b"CCTDP" => {
                let (destination, rate, acknowledge) = (f.integer()?, rate(&mut f)?, f.flag()?);
                f.raw();
                Ok(Self::Flexible(Flexible { destination, rate, acknowledge, payload: Payload::from_digits(f.raw())? }))
            }
            b"CCMSC" => Ok(Self::Reboot { source: f.integer()? }),
            b"CCCMD" | b"CCPNT" | b"CCPDT" => Err(Error::Unhandled),
            _ => Err(Error::Unknown),
        }
    }
}

fn addresses(f: &mut Fields<'_>) -> Result<Addresses, Error> {
    Ok(Addresses { source: address(f)?, destination: address(f)? })
}

fn address(f: &mut Fields<'_>) -> Result<u8, Error> {
    match f.integer()? {
        address @ 0..=127 => Ok(address),
        _ => Err(Error::OutOfRange),
    }
}

fn rate(f: &mut Fields<'_>) -> Result<u8, Error> {
    let rate = f.integer()?;
    if usize::from(rate) < RATES.len() { Ok(rate) } else { Err(Error::OutOfRange) }
}

/// Its first field is always 0; some firmware ends with a comma.
fn cycle(f: &mut Fields<'_>) -> Result<Cycle, Error> {
    f.integer::<u8>()?;
    Ok(Cycle {
        addresses: addresses(f)?,
        rate: rate(f)?,
        // A flag, but seen with other numbers.
        acknowledge: f.integer::<u8>()? != 0,
        frames: f.integer()?,
    })
}

fn some_text<'a>(f: &mut Fields<'a>) -> Result<&'a str, Error> {
    match f.text()? {
        "" => Err(Error::Missing),
        text => Ok(text),
    }
}

/// All that is left, commas included.
fn rest<'a>(f: &mut Fields<'a>) -> Result<&'a str, Error> {
    core::str::from_utf8(f.remaining()).map_err(|_| Error::Malformed)
}

fn travel_time(field: &[u8]) -> Result<Decimal, Error> {
    let time = Decimal::parse(field)?;
    if time.mantissa() < 0 || time.rescaled(0).is_none_or(|seconds| seconds > MAX_TRAVEL_S) {
        return Err(Error::OutOfRange);
    }
    Ok(time)
}

fn setting<'a>(f: &mut Fields<'a>) -> Result<Setting<'a>, Error> {
    Ok(Setting { name: some_text(f)?, value: some_text(f)? })
}

fn clock(f: &mut Fields<'_>) -> Result<DateTime, Error> {
    let date = Date::new(f.integer()?, f.integer()?, f.integer()?)?;
    let time = TimeOfDay::from_parts(f.integer()?, f.integer()?, f.integer()?, 0)?;
    Ok(DateTime { date, time })
}

/// A version number of two digits at most, or at once the date.
fn transmit_statistics<'a>(f: &mut Fields<'_>) -> Result<FromModem<'a>, Error> {
    let first = f.some()?;
    let (version, date) = if first.len() > 2 { (None, first) } else { (Some(parse_integer(first)?), f.some()?) };
    let time = DateTime { date: parse_date(date)?, time: f.time()? };
    let statistics = TransmitStatistics { version, time, clock: ClockMode(f.integer()?), mode: f.integer()? };
    Ok(FromModem::TransmitStatistics(statistics))
}

fn user_bits(f: &mut Fields<'_>) -> Result<UserBits, Error> {
    let addresses = addresses(f)?;
    let mut bytes = [0; 2];
    hex::decode_exact(f.some()?, &mut bytes)?;
    match u16::from_be_bytes(bytes) {
        bits @ 0..=0x1FFF => Ok(UserBits { addresses, bits }),
        _ => Err(Error::OutOfRange),
    }
}

fn flexible_received<'a>(f: &mut Fields<'a>) -> Result<FromModem<'a>, Error> {
    let addresses = addresses(f)?;
    let (rate, acknowledge) = (rate(f)?, f.flag()?);
    f.raw();
    Ok(FromModem::FlexibleReceived(FlexibleReceived {
        addresses,
        rate,
        acknowledge,
        mini: fragments(f.raw())?,
        data: fragments(f.raw())?,
    }))
}

/// `crc;count;digits` repeated, or nothing.
fn fragments(field: &[u8]) -> Result<[Option<Fragment<'_>>; MAX_FRAGMENTS], Error> {
    let mut fragments = [None; MAX_FRAGMENTS];
    if field.is_empty() {
        return Ok(fragments);
    }
    let mut parts = field.split(|byte| *byte == b';');
    for slot in &mut fragments {
        let Some(good) = parts.next() else { return Ok(fragments) };
        let (count, digits) = (parts.next().ok_or(Error::Missing)?, parts.next().ok_or(Error::Missing)?);
        let fragment = Fragment { good: parse_flag(good)?, payload: Payload::from_digits(digits)? };
        if parse_integer::<usize>(count)? != fragment.payload.len() {
            return Err(Error::Length);
        }
        *slot = Some(fragment);
    }
    if parts.next().is_some() { Err(Error::Overflow) } else { Ok(fragments) }
}
