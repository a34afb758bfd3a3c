use super::{Addresses, Cycle, FlexibleReceived, Fragment, FromModem, Setting, ToModem, UserBits};
use crate::Error;
use crate::calendar::{DateTime, TimeOfDay, write_date};
use crate::nmea::Emitter;

impl FromModem<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut e = Emitter::new(buffer, self.id())?;
        match self {
            Self::Cycle(message) => cycle(&mut e, message)?,
            Self::DataRequest(message) => {
                time(&mut e, message.time, 0)?;
                addresses(&mut e, message.addresses)?;
                e.flag(message.acknowledge)?.unsigned(message.bytes)?.unsigned(message.frame)?;
            }
            Self::DataTaken(message) => {
                addresses(&mut e, message.addresses)?;
                e.flag(message.acknowledge)?.unsigned(message.bytes)?;
            }
            Self::TransmitBegins { bytes } | Self::TransmitEnded { bytes } => {
                e.unsigned(*bytes)?;
            }
            Self::ReceiveBegins { psk } => {
                e.flag(*psk)?;
            }
            Self::Received(message) => {
                addresses(&mut e, message.addresses)?;
                e.flag(message.acknowledge)?.unsigned(message.frame)?;
                e.field(|writer| message.payload.write(writer))?;
            }
            Self::Acknowledged(message) => {
                addresses(&mut e, message.addresses)?;
                e.unsigned(message.frame)?.flag(message.acknowledge)?;
            }
            Self::DataQuality { quality, packet_type } => {
                e.signed(*quality)?.signed(*packet_type)?;
            }
            Self::Doppler(speed) => {
                e.decimal(*speed)?;
            }
            Self::Statistics(statistics) => statistics.write(&mut e)?,
            Self::TransmitStatistics(statistics) => {
                if let Some(version) = statistics.version {
                    e.unsigned(version)?;
                }
                e.field(|writer| write_date(statistics.time.date, writer))?;
                time(&mut e, statistics.time.time, 6)?;
                e.unsigned(statistics.clock.0)?.unsigned(statistics.mode)?;
            }
            Self::TimeOfArrival { time: arrival, clock } => {
                time(&mut e, arrival.to_tenth_ms(), 4)?;
                e.unsigned(clock.0)?;
            }
            Self::Message { text, number } => {
                e.text(text)?.signed(*number)?;
            }
            Self::Error(report) => {
                time(&mut e, report.time, 0)?;
                e.text(report.module)?.signed(report.number)?;
                if !report.text.is_empty() {
                    e.text(report.text)?;
                }
            }
            Self::PingSent(pair) | Self::PingArrived(pair) => addresses(&mut e, *pair)?,
            Self::PingReply(reply) => {
                addresses(&mut e, reply.addresses)?;
                if let Some(travel) = reply.travel_s {
                    e.decimal(travel)?;
                }
            }
            Self::PingReply2(reply) => {
                e.text("PNR")?.field(|writer| reply.time.write_iso(writer, 6))?;
                addresses(&mut e, reply.addresses)?;
                match reply.travel_s {
                    Some(travel) => e.decimal(travel)?,
                    None => e.blank()?,
                };
            }
            Self::Setting(message) => setting(&mut e, message)?,
            Self::Clock(clock) => clock_fields(&mut e, clock)?,
            Self::TimeSet { status, time } => {
                e.unsigned(*status)?;
                iso(&mut e, time)?;
            }
            Self::TimeReport(report) => {
                iso(&mut e, &report.time)?;
                e.text(report.clock_source)?.text(report.pps_source)?;
            }
            Self::Revision(revision) => {
                time(&mut e, revision.time, 0)?;
                e.text(revision.identifier)?.text(revision.version)?;
            }
            Self::UserBits(message) => user_bits(&mut e, message)?,
            Self::FlexibleTaken(message) => {
                e.unsigned(message.error)?.unsigned(message.id)?.unsigned(message.destination)?;
                e.unsigned(message.rate)?.flag(message.acknowledge)?.unsigned(0_u8)?;
            }
            Self::FlexibleReceived(message) => flexible_received(&mut e, message)?,
            Self::TravelTimes { travel_s, time: when } => {
                for travel in travel_s {
                    match travel {
                        Some(travel) => e.decimal(*travel)?,
                        None => e.blank()?,
                    };
                }
                time(&mut e, *when, 2)?;
            }
        }
        e.finish()
    }

    const fn id(&self) -> &'static str {
        match self {
            Self::Cycle(_) => "CACYC",
            Self::DataRequest(_) => "CADRQ",
            Self::DataTaken(_) => "CATXD",
            Self::TransmitBegins { .. } => "CATXP",
            Self::TransmitEnded { .. } => "CATXF",
            Self::ReceiveBegins { .. } => "CARXP",
            Self::Received(_) => "CARXD",
            Self::Acknowledged(_) => "CAACK",
            Self::DataQuality { .. } => "CADQF",
            Self::Doppler(_) => "CADOP",
            Self::Statistics(_) => "CACST",
            Self::TransmitStatistics(_) => "CAXST",
            Self::TimeOfArrival { .. } => "CATOA",
            Self::Message { .. } => "CAMSG",
            Self::Error(_) => "CAERR",
            Self::PingSent(_) => "CAMPC",
            Self::PingArrived(_) => "CAMPA",
            Self::PingReply(_) => "CAMPR",
            Self::PingReply2(_) => "CACMR",
            Self::Setting(_) => "CACFG",
            Self::Clock(_) => "CACLK",
            Self::TimeSet { .. } => "CATMS",
            Self::TimeReport(_) => "CATMQ",
            Self::Revision(_) => "CAREV",
            Self::UserBits(_) => "CAMUA",
            Self::FlexibleTaken(_) => "CATDP",
            Self::FlexibleReceived(_) => "CARDP",
            Self::TravelTimes { .. } => "SNTTA",
        }
    }
}

impl ToModem<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut e = Emitter::new(buffer, self.id())?;
        match self {
            Self::Cycle(message) => cycle(&mut e, message)?,
            Self::Data(message) => {
                addresses(&mut e, message.addresses)?;
                e.flag(message.acknowledge)?.field(|writer| message.payload.write(writer))?;
            }
            Self::Ping(pair) => addresses(&mut e, *pair)?,
            Self::UserBits(message) => user_bits(&mut e, message)?,
            Self::Configure(message) => setting(&mut e, message)?,
            Self::Query { name } => {
                e.text(name)?;
            }
            Self::SetClock(clock) => clock_fields(&mut e, clock)?,
            Self::SetTime { time, mode } => {
                iso(&mut e, time)?;
                e.unsigned(*mode)?;
            }
            Self::QueryTime => {
                e.unsigned(0_u8)?;
            }
            Self::Flexible(message) => {
                e.unsigned(message.destination)?.unsigned(message.rate)?.flag(message.acknowledge)?.unsigned(0_u8)?;
                e.field(|writer| message.payload.write(writer))?;
            }
            Self::Reboot { source } => {
                e.unsigned(*source)?.unsigned(*source)?.unsigned(0_u8)?;
            }
        }
        e.finish()
    }

    const fn id(&self) -> &'static str {
        match self {
            Self::Cycle(_) => "CCCYC",
            Self::Data(_) => "CCTXD",
            Self::Ping(_) => "CCMPC",
            Self::UserBits(_) => "CCMUC",
            Self::Configure(_) => "CCCFG",
            Self::Query { .. } => "CCCFQ",
            Self::SetClock(_) => "CCCLK",
            Self::SetTime { .. } => "CCTMS",
            Self::QueryTime => "CCTMQ",
            Self::Flexible(_) => "CCTDP",
            Self::Reboot { .. } => "CCMSC",
        }
    }
}

fn addresses(e: &mut Emitter<'_>, pair: Addresses) -> Result<(), Error> {
    e.unsigned(pair.source)?.unsigned(pair.destination)?;
    Ok(())
}

fn cycle(e: &mut Emitter<'_>, cycle: &Cycle) -> Result<(), Error> {
    e.unsigned(0_u8)?;
    addresses(e, cycle.addresses)?;
    e.unsigned(cycle.rate)?.flag(cycle.acknowledge)?.unsigned(cycle.frames)?;
    Ok(())
}

fn time(e: &mut Emitter<'_>, time: TimeOfDay, decimals: u8) -> Result<(), Error> {
    e.field(|writer| time.write(writer, decimals))?;
    Ok(())
}

/// The modem writes and wants whole seconds here.
fn iso(e: &mut Emitter<'_>, time: &DateTime) -> Result<(), Error> {
    e.field(|writer| {
        time.write_iso(writer, 0)?;
        writer.byte(b'Z')
    })?;
    Ok(())
}

fn clock_fields(e: &mut Emitter<'_>, clock: &DateTime) -> Result<(), Error> {
    let ((year, month, day), (hour, minute, second, _)) = (clock.date.parts(), clock.time.parts());
    e.unsigned(year)?;
    for part in [month, day, hour, minute, second] {
        e.unsigned(part)?;
    }
    Ok(())
}

fn setting(e: &mut Emitter<'_>, setting: &Setting<'_>) -> Result<(), Error> {
    e.text(setting.name)?.text(setting.value)?;
    Ok(())
}

fn user_bits(e: &mut Emitter<'_>, message: &UserBits) -> Result<(), Error> {
    addresses(e, message.addresses)?;
    if message.bits > 0x1FFF {
        return Err(Error::OutOfRange);
    }
    e.field(|writer| message.bits.to_be_bytes().into_iter().try_for_each(|byte| writer.hex(byte)))?;
    Ok(())
}

fn flexible_received(e: &mut Emitter<'_>, message: &FlexibleReceived<'_>) -> Result<(), Error> {
    addresses(e, message.addresses)?;
    e.unsigned(message.rate)?.flag(message.acknowledge)?.unsigned(0_u8)?;
    fragments(e, &message.mini)?;
    fragments(e, &message.data)
}

fn fragments(e: &mut Emitter<'_>, fragments: &[Option<Fragment<'_>>]) -> Result<(), Error> {
    e.field(|writer| {
        for (index, fragment) in fragments.iter().flatten().enumerate() {
            if index > 0 {
                writer.byte(b';')?;
            }
            writer.unsigned(u64::from(fragment.good), 1)?;
            writer.byte(b';')?;
            writer.unsigned(fragment.payload.len() as u64, 1)?;
            writer.byte(b';')?;
            fragment.payload.write(writer)?;
        }
        Ok(())
    })?;
    Ok(())
}
