//! Logs of device sentences, one a line, with or without a time in front: NMEA 0183 of receivers and compasses, PD6 of
//! a DVL, and a Micro-Modem's own sentences, as the modem wrote them or as a program like pyAcomms stamped them.
//!
//! The sentences are read by the board's own parsers. Times are UTC: a sentence that names its time has that time, and
//! all others the time in front of their line, moved by how far the clock of the lines is from UTC.

use super::Imported;
use super::line_time::{self, Clock, LineTime};
use super::messages::Gathering;
use crate::DataError;
use crate::log::{Column, table};
use backseat_wire::ahrs::os5000::Os5000;
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::dvl::{DvlSample, pd6};
use backseat_wire::gps::{Gga, Rmc};
use backseat_wire::modem::{ClockEncoding, DopplerSign, FromModem, ReceptionStatistics};
use backseat_wire::nmea::{Checksum, Sentence};
use backseat_wire::ship_state::ShipState;
use backseat_wire::vehicle_state::VehicleState;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "device sentences";
/// Speed that makes a travel time a range, m/s; a vehicle log holds ranges.
const SOUND_MPS: f64 = 1500.0;
/// A packet and its statistics belong together within this time, µs.
const ONE_PACKET_US: i64 = 15_000_000;
/// Longest frame of a modem, bytes.
const LONGEST_FRAME: usize = 256;

/// When something happened, as its sentence says.
#[derive(Clone, Copy)]
enum Own {
    /// µs since 1970.
    Full(i64),
    OfDay(TimeOfDay),
    /// The sentence names no time.
    None,
}

/// What a line holds.
enum Content {
    /// Latitude and longitude, degrees, and whether it is of a GGA.
    Fix([f64; 2], bool),
    Samples(Vec<(Column, f64)>),
    Ship(ShipState),
    Vehicle(VehicleState),
    /// A good packet: range rate, m/s.
    Arrival(Option<f64>),
    /// Nothing but its time, which dates others.
    Time,
}

impl Content {
    /// The vehicle whose uplink it is.
    fn vehicle(&self) -> Option<u8> {
        if let Self::Vehicle(state) = self { Some(state.source) } else { None }
    }
}

/// What a frame makes of the time of its arrival.
#[derive(Clone, Copy)]
enum Frame {
    /// A range at the vehicle, from the ship at this latitude and longitude, degrees.
    Ship([f64; 2]),
    /// A range at the ship.
    Vehicle,
}

fn launch_us(transmit_s: u32) -> i64 {
    i64::from(transmit_s) * 1_000_000
}

struct Item {
    line: LineTime,
    own: Own,
    /// The sentence comes within a second of the time that it names: good enough to compare clocks by.
    is_prompt: bool,
    content: Content,
}

/// Whether the first line that is no comment holds a sentence.
pub(super) fn is_sentences(path: &Path) -> Result<bool, DataError> {
    let mut reader = BufReader::new(table::open(path)?);
    let mut bytes = Vec::new();
    for _ in 0..50 {
        bytes.clear();
        if reader.read_until(b'\n', &mut bytes).map_err(|e| DataError::io(path, &e))? == 0 {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        match line.trim() {
            "" => {}
            comment if comment.starts_with(['#', '%']) => {}
            line => return Ok(split(line).is_some()),
        }
    }
    Ok(false)
}

/// What stands before the sentence, and the sentence.
fn split(line: &str) -> Option<(&str, &str)> {
    let is_name = |text: &str, least: usize| {
        let name = text.split(',').next().unwrap_or_default();
        (least..=6).contains(&name.len()) && name.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit())
    };
    if let Some(at) = line.find('$') {
        let (before, sentence) = line.split_at(at);
        return is_name(&sentence[1..], 4).then_some((before, sentence.trim_end()));
    }
    // PD6: a colon and two capitals
    line.match_indices(':').map(|(at, _)| line.split_at(at)).find(|(before, sentence)| {
        let is_start = before.is_empty() || before.ends_with(char::is_whitespace);
        is_start && sentence.get(3..4) == Some(",") && is_name(&sentence[1..], 2)
    })
}

/// Reads a log of sentences.
pub(super) fn read(path: &Path) -> Result<Imported, DataError> {
    let mut reader = Reader {
        gathering: Gathering::default(),
        items: Vec::new(),
        names: BTreeSet::new(),
        pd6: pd6::Decoder::new(0.0),
    };
    let mut lines = BufReader::new(table::open(path)?);
    let mut bytes = Vec::new();
    loop {
        bytes.clear();
        if lines.read_until(b'\n', &mut bytes).map_err(|e| DataError::io(path, &e))? == 0 {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', '%']) {
            continue;
        }
        match split(line) {
            Some((before, sentence)) => reader.take(line_time::parse(before), sentence),
            None => reader.gathering.leave_out("lines", "no sentence in them"),
        }
    }
    reader.finish(path)
}

struct Reader {
    gathering: Gathering,
    items: Vec<Item>,
    names: BTreeSet<String>,
    pd6: pd6::Decoder,
}

impl Reader {
    fn take(&mut self, line: LineTime, text: &str) {
        if text.starts_with(':') {
            self.take_pd6(line, text);
            return;
        }
        let sentence = match Sentence::from_line(text.as_bytes(), Checksum::Optional) {
            Ok(sentence) => sentence,
            Err(_) => {
                let name = text.get(1..).unwrap_or_default().split(',').next().unwrap_or_default();
                return self.gathering.leave_out(name, "the checksum is wrong, or the line was cut off");
            }
        };
        let name = String::from_utf8_lossy(sentence.id()).into_owned();
        match parse(&sentence) {
            Ok((own, is_prompt, content)) => {
                self.names.insert(name);
                self.items.push(Item { line, own, is_prompt, content });
            }
            Err(reason) => self.gathering.leave_out(&name, reason),
        }
    }

    fn take_pd6(&mut self, line: LineTime, text: &str) {
        let with_end = format!("{text}\r\n");
        let mut bytes = with_end.as_bytes();
        while let Some(outcome) = self.pd6.feed(&mut bytes) {
            let Ok(sample) = outcome else {
                self.gathering.leave_out(text.get(..3).unwrap_or(":"), "no line of PD6");
                continue;
            };
            self.names.insert("PD6".to_owned());
            let own =
                sample.time_of_day_s.map_or(Own::None, |s| Own::OfDay(TimeOfDay::from_us((s * 1e6).round() as u64)));
            self.items.push(Item { line, own, is_prompt: false, content: Content::Samples(dvl_samples(&sample)) });
        }
    }

    fn finish(mut self, path: &Path) -> Result<Imported, DataError> {
        let clock = self.clock();
        let has_gga = self.items.iter().any(|item| matches!(item.content, Content::Fix(_, true)));
        // whose ranges they are, the vehicle's log does not say
        let heard: BTreeSet<u8> = self.items.iter().filter_map(|item| item.content.vehicle()).collect();
        let mut frame: Option<(i64, Frame)> = None;
        let mut arrival: Option<(i64, Option<f64>)> = None;
        let (mut last_us, mut ranges, mut uplinks) = (clock.first_full_us, 0, 0);
        for item in std::mem::take(&mut self.items) {
            let own_us = match item.own {
                Own::Full(us) => Some(us),
                Own::OfDay(time) => Some(clock.nearest(time, item.line, last_us)),
                Own::None => None,
            };
            let Some(time_us) = own_us.or_else(|| clock.utc_us(item.line)).or(last_us) else {
                self.gathering.leave_out("lines", "before the first time");
                continue;
            };
            if own_us.is_some() {
                last_us = Some(time_us);
            }
            match item.content {
                Content::Time => {}
                Content::Fix(_, false) if has_gga => {}
                Content::Fix([latitude, longitude], _) => self.gathering.add_fix(time_us, latitude, longitude),
                Content::Samples(samples) => self.gathering.add(time_us, &samples),
                Content::Ship(state) => frame = Some((launch_us(state.transmit_s), Frame::Ship(state.position_deg))),
                // clock and pulse of the vehicle are as good as its frame says
                Content::Vehicle(_) if heard.len() > 1 => {
                    self.gathering
                        .leave_out("CARXD", "uplinks of several vehicles: which one's log is it to be joined to?");
                    frame = None;
                }
                Content::Vehicle(state) => {
                    frame = state.synchronous.then_some((launch_us(state.transmit_s), Frame::Vehicle));
                }
                Content::Arrival(rate) => arrival = Some((time_us, rate)),
            }
            if let (Some((launch_us, content)), Some((arrival_us, rate))) = (frame, arrival) {
                if (0..ONE_PACKET_US).contains(&(arrival_us - launch_us)) {
                    let times_us = [launch_us, arrival_us];
                    match content {
                        Frame::Ship(ship_deg) => {
                            self.gathering.add_range(times_us, SOUND_MPS, rate, ship_deg);
                            ranges += 1;
                        }
                        Frame::Vehicle => {
                            self.gathering.add_uplink(times_us, SOUND_MPS);
                            uplinks += 1;
                        }
                    }
                    (frame, arrival) = (None, None);
                } else if launch_us > arrival_us {
                    arrival = None;
                } else {
                    frame = None;
                }
            }
        }
        let recognised: Vec<String> = self.names.into_iter().collect();
        let mut notes = vec![format!("{NAME}; recognised: {}", recognised.join(", "))];
        notes.extend(clock.note());
        if ranges > 0 {
            notes
                .push(format!("{ranges} ranges at a speed of sound of {SOUND_MPS} m/s: the modem's times as they are"));
        }
        if uplinks > 0 {
            notes.push(format!("{uplinks} ranges of a vehicle's uplinks at the same speed: this is the ship's modem"));
        }
        Ok(Imported { format: NAME, log: self.gathering.finish(path, notes)? })
    }

    /// How far the clock of the lines is from UTC, by the sentences that come promptly.
    fn clock(&self) -> Clock {
        let pairs = self.items.iter().filter(|item| item.is_prompt).map(|item| {
            let own = match item.own {
                Own::Full(us) => line_time::Utc::Full(us),
                Own::OfDay(time) => line_time::Utc::OfDay(time),
                Own::None => line_time::Utc::Unknown,
            };
            (item.line, own)
        });
        Clock::of(pairs)
    }
}

/// A sentence's own time, whether it comes promptly, and what it holds; or why it is left out.
fn parse(sentence: &Sentence<'_>) -> Result<(Own, bool, Content), &'static str> {
    const BROKEN: &str = "a field is missing or out of its range";
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
            use backseat_wire::modem::ModemTime;
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
pub(super) fn dvl_samples(sample: &DvlSample) -> Vec<(Column, f64)> {
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

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    /// Sentences of `firmware/wire/tests/vectors`, and their decoded values as printed there.
    const GNSS: &str = "1418256003.20 $GNRMC,000001.00,A,2304.167961,N,16553.836924,W,7.87,100.6,111214,0,E,D*17\n\
        1418256003.21 $GNGGA,000001.00,2304.167961,N,16553.836924,W,2,11,1.0,44.542,M,0.000,M,2.0,0103*43\n\
        1418256004.10 $GPHDT,90.0,T\n\
        1418256004.20 $GPGSV,1,1,00*79\n\
        1418256004.30 $GNGGA,000002.00,2304.167961,N,16553.836924,W,2,11*00\n";

    #[test]
    fn val_a_receiver_with_the_clock_of_the_lines_ahead() {
        let imported = import(GNSS).unwrap();
        let log = &imported.log;
        assert_eq!((imported.format, log.rows.len()), (NAME, 2));
        // 11 December 2014, 00:00:01 UTC (date -u -d ... +%s)
        assert_eq!(log.start_unix_us, Some(1_418_256_001_000_000));
        assert_eq!(log.rows[0].gnss_m(), Some([0.0, 0.0]));
        let origin = log.origin_deg.unwrap();
        assert!(
            (origin[0] - (23.0 + 4.167_961 / 60.0)).abs() < 1e-9
                && (origin[1] + 165.0 + 53.836_924 / 60.0).abs() < 1e-9
        );
        // the lines are 2.2 s ahead: the heading was read at 1.90 s UTC, 0.90 s after the fix
        assert_eq!(log.rows[1].time_us, 900_000);
        assert!((log.rows[1].get(Column::Heading).unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let notes = log.notes.join("\n");
        assert!(
            notes.contains("2.20 s ahead of UTC") && notes.contains("GNGGA (1)") && notes.contains("GPGSV (1)"),
            "{notes}"
        );
    }

    #[test]
    fn val_a_packet_becomes_a_range() {
        let ship = ShipState {
            source: 1,
            sequence: 7,
            transmit_s: 1_795_176_000, // 20 November 2026, 12:00:00
            position_deg: [41.5, -70.5],
            velocity_mps: [0.0, 0.0],
            position_sigma_m: 1.0,
            velocity_sigma_mps: 0.1,
            transducer_depth_m: 2.0,
        };
        let digits: String = ship.emit().unwrap().iter().map(|byte| format!("{byte:02X}")).collect();
        // the clock mode and arrival of the synthetic vector of the Micro-Modem: 0.6667 s after the second, closing by
        // 0.5 m/s
        let log = format!(
            "2026-11-20 12:00:06,120 - modem - $CARXD,1,2,0,1,{digits}00000000000000\n\
             2026-11-20 12:00:06,180 - modem - $CACST,6,0,20261120120000.666700,03,1440,25,0175,0166,75,01,01,01,03,1,001,002,0,\
             3,3,0,150,12.0,9.0,10,-9,212,-0.50,45,25000,5000,0\n\
             2026-11-20 12:00:07,000 - modem - $CAMPR,2,1,0.6667\n"
        );
        let imported = import(&log).unwrap();
        let log = &imported.log;
        assert_eq!(log.rows.len(), 1, "{log:?}");
        let row = &log.rows[0];
        assert!((row.get(Column::Range).unwrap() - 0.6667 * 1500.0).abs() < 1e-6);
        assert_eq!(row.get(Column::RangeRate).map(|rate| (rate * 100.0).round()), Some(50.0));
        assert_eq!(row.ship_at_launch_m(), Some([0.0, 0.0]));
        // times from the arrival on; the launch is before the log begins
        assert_eq!(
            (row.time_us, row.arrival_us(), log.start_unix_us),
            (666_700, Some(666_700), Some(1_795_176_000_000_000))
        );
        assert_eq!(row.launch_us(), Some(0));
        assert!(log.notes.iter().any(|note| note.contains("CAMPR (1): two-way")), "{:?}", log.notes);
    }

    /// The ship's modem: the packet before with a vehicle's state, 0.6667 s under way.
    #[test]
    fn val_an_uplink_becomes_a_range_at_the_ship() {
        let uplink = |source: u8, synchronous: bool| {
            let state = VehicleState {
                source,
                transmit_s: 1_795_176_000, // 20 November 2026, 12:00:00
                position_deg: [41.5, -70.5],
                velocity_mps: [1.0, 0.0],
                depth_m: 3.0,
                position_sigma_m: 1.0,
                ellipse: backseat_wire::ellipse::Ellipse::CIRCLE,
                leans: false,
                velocity_sigma_mps: 0.1,
                heading_rad: 0.0,
                level_m: [None; 2],
                mode: 3,
                synchronous,
                named: backseat_wire::named::Named::NOTHING,
            };
            let mut buffer = [0; backseat_wire::vehicle_state::AUTHENTIC_LENGTH];
            let bytes = state.emit(&backseat_wire::ship_state::Key::NONE, &mut buffer).unwrap();
            let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
            format!(
                "2026-11-20 12:00:06,120 - modem - $CARXD,{source},1,0,1,{digits}00000000\n\
                 2026-11-20 12:00:06,180 - modem - $CACST,6,0,20261120120000.666700,03,1440,25,0175,0166,75,01,01,01,03,{source},\
                 001,002,0,3,3,0,150,12.0,9.0,10,-9,212,-0.50,45,25000,5000,0\n"
            )
        };
        let log = import(&uplink(2, true)).unwrap().log;
        let row = &log.rows[0];
        assert!((row.get(Column::UplinkRange).unwrap() - 0.6667 * 1500.0).abs() < 1e-6 && log.rows.len() == 1);
        assert_eq!((row.get(Column::Range), row.ship_at_launch_m(), log.origin_deg), (None, None, None));
        assert_eq!((row.launch_us(), row.arrival_us()), (Some(0), Some(666_700)));
        // a vehicle without a pulse, and two vehicles
        assert!(import(&uplink(2, false)).is_err());
        let two = import(&format!("{}{}", uplink(2, true), uplink(3, true))).unwrap_err().to_string();
        assert!(two.contains("uplinks of several vehicles"), "{two}");
    }

    #[test]
    fn val_a_dvl_in_pd6() {
        // the synthetic set of firmware/wire/tests/vectors/pd6.txt: 1.25 m/s forward
        let log = "12.5 :SA, +1.25, -0.40,310.20\n12.5 :TS,26112012000100,35.0,+15.2,   3.2,1506.1,  0\n\
            12.5 :BI,   +12, +1250,    -4,    +1,A\n12.5 :BD,       -12.30,       +10.40,        +0.20,  10.40,  0.00\n";
        let row = import(log).unwrap().log.rows[0].clone();
        assert_eq!(row.dvl_mps(), Some([1.25, 0.012, 0.004]));
        assert_eq!(row.get(Column::Depth), Some(3.2));
    }

    #[test]
    fn tables_are_no_sentences() {
        for text in ["t_s,depth_m", "Latitude;Longitude", "price $,x", "12:30:45,1,2", "$", ":", "$abc"] {
            assert!(split(text).is_none(), "{text}");
        }
    }
}
