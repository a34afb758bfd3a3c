//! What each sentence holds.

use super::LONGEST_FRAME;
use crate::log::Column;
use backseat_wire::ahrs::os5000::Os5000;
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::dvl::DvlSample;
use backseat_wire::gps::{Gga, Rmc};
use backseat_wire::modem::{ClockEncoding, DopplerSign, FromModem, ModemTime, ReceptionStatistics};
use backseat_wire::nmea::Sentence;
use backseat_wire::ship_state::ShipState;
use backseat_wire::vehicle_state::VehicleState;

/// When something happened, as its sentence says.
#[derive(Clone, Copy)]
pub(super) enum Own {
    /// µs since 1970.
    Full(i64),
    OfDay(TimeOfDay),
    /// µs before its line.
    Before(i64),
    /// The sentence names no time.
    None,
}

/// What a line holds.
pub(super) enum Content {
    /// Latitude and longitude, degrees, and whether it is of a GGA.
    Fix([f64; 2], bool),
    Samples(Vec<(Column, f64)>),
    Ship(ShipState),
    Vehicle(VehicleState),
    /// A good packet: range rate, m/s.
    Arrival(Option<f64>),
    /// A fix by a ship's USBL.
    Heard(Heard),
    /// The ship's heading, and whether the times of its USBL are local.
    ShipHeading {
        heading_rad: f64,
        is_local: bool,
    },
    /// Nothing but its time, which dates others.
    Time,
}

/// A fix by a ship's USBL.
pub(super) struct Heard {
    /// The transponder's name.
    pub(super) target: String,
    /// From the array: north, east, down; or ahead, to starboard, down, where it is head up. m
    pub(super) vector_m: [f64; 3],
    pub(super) is_head_up: bool,
    /// One sigma across the direction, m.
    pub(super) across_sigma_m: Option<f64>,
    /// Travel time, one way, s.
    pub(super) travel_s: Option<f64>,
    /// By the maker's own filter.
    pub(super) is_filtered: bool,
}

impl Content {
    /// The vehicle whose uplink it is.
    pub(super) fn vehicle(&self) -> Option<u8> {
        if let Self::Vehicle(state) = self { Some(state.source) } else { None }
    }
}

/// Why a sentence with a bad field is left out.
pub(super) const BROKEN: &str = "a field is missing or out of its range";

/// A sentence's own time, whether it comes promptly, and what it holds; or why it is left out.
pub(super) fn parse(sentence: &Sentence<'_>) -> Result<(Own, bool, Content), &'static str> {
    let id = sentence.id();
    match id.get(id.len().saturating_sub(3)..).unwrap_or_default() {
        b"RMC" => {
            let rmc = Rmc::parse(sentence).map_err(|_| BROKEN)?;
            let own = rmc.utc.map_or(Own::None, |utc| Own::Full(utc.unix_us() as i64));
            let content =
                rmc.position_deg.filter(|_| rmc.valid).map_or(Content::Time, |place| Content::Fix(place, false));
            Ok((own, true, content))
        }
        b"GGA" => {
            let gga = Gga::parse(sentence).map_err(|_| BROKEN)?;
            let own = gga.time.map_or(Own::None, Own::OfDay);
            let place = gga.position_deg.filter(|_| gga.quality > 0).ok_or("no fix")?;
            Ok((own, true, Content::Fix(place, true)))
        }
        b"HDT" => {
            let text = sentence.fields().raw();
            let degrees: f64 = std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).ok_or(BROKEN)?;
            let range = 0.0..=360.0;
            let heading = range.contains(&degrees).then(|| degrees.to_radians()).ok_or(BROKEN)?;
            Ok((Own::None, false, Content::Samples(vec![(Column::Heading, heading)])))
        }
        b"HPR" => {
            let sample = Os5000::parse(sentence).map_err(|_| BROKEN)?;
            let samples = [
                (Column::Roll, sample.roll_rad),
                (Column::Pitch, sample.pitch_rad),
                (Column::Heading, sample.heading_rad),
            ];
            let samples = samples.into_iter().filter_map(|(column, value)| Some((column, value?))).collect();
            Ok((Own::None, false, Content::Samples(samples)))
        }
        b"GST" | b"GSA" | b"GSV" | b"VTG" | b"GLL" | b"ZDA" | b"GNS" => Err("RMC and GGA have the fix"),
        _ => modem(sentence),
    }
}

/// A sentence of the modem.
fn modem(sentence: &Sentence<'_>) -> Result<(Own, bool, Content), &'static str> {
    match FromModem::parse(sentence).map_err(|_| "not part of a vehicle log")? {
        FromModem::Received(received) if received.frame == 1 => {
            let mut frame = [0; LONGEST_FRAME];
            let frame = received.payload.copy_to(&mut frame).map_err(|_| "a frame too long")?;
            let content = match (ShipState::parse(frame), VehicleState::parse(frame)) {
                (Ok(state), _) => Content::Ship(state),
                (_, Ok(state)) => Content::Vehicle(state),
                _ => return Err("a frame that holds no state of a ship or a vehicle"),
            };
            Ok((Own::None, false, content))
        }
        FromModem::Statistics(statistics) if statistics.mode != ReceptionStatistics::GOOD => Err("a bad packet"),
        FromModem::Statistics(statistics) => {
            let is_synchronous = [ClockEncoding::Legacy, ClockEncoding::BitField]
                .iter()
                .any(|encoding| statistics.clock.is_synchronous(*encoding));
            if !is_synchronous {
                return Err("a packet without a synchronous clock: no one-way travel time");
            }
            let own = match statistics.arrival {
                ModemTime::OfDay(time) => Own::OfDay(time),
                ModemTime::Full(full) => Own::Full(full.unix_us() as i64),
            };
            let rate = statistics.doppler_mps.map(|speed| DopplerSign::ClosingPositive.range_rate_mps(speed.to_f64()));
            Ok((own, false, Content::Arrival(rate)))
        }
        FromModem::TimeReport(report) => Ok((Own::Full(report.time.unix_us() as i64), true, Content::Time)),
        FromModem::PingReply(_) | FromModem::PingReply2(_) => Err("two-way times: a vehicle log holds one-way ranges"),
        _ => Err("not part of a vehicle log"),
    }
}

/// Velocity over ground and attitude of a DVL.
pub(in crate::importers) fn dvl_samples(sample: &DvlSample) -> Vec<(Column, f64)> {
    let mut samples = Vec::new();
    let mut add = |columns: [Column; 3], values: Option<[f64; 3]>| {
        samples.extend(values.into_iter().flat_map(|values| columns.into_iter().zip(values)));
    };
    add([Column::DvlU, Column::DvlV, Column::DvlW], sample.bottom_mps);
    add([Column::Roll, Column::Pitch, Column::Heading], sample.attitude_rad);
    samples.extend(sample.depth_m.map(|depth_m| (Column::Depth, depth_m)));
    samples.extend(sample.sound_speed_mps.map(|speed| (Column::SoundSpeed, speed)));
    samples
}
