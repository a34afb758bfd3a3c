//! Logs of device sentences, one a line, with or without a time in front: NMEA 0183 of receivers and compasses, PD6 of
//! a DVL, a Micro-Modem's own sentences, as the modem wrote them or as a program like pyAcomms stamped them, and the fixes
//! of a ship's USBL.
//!
//! The sentences are read by the board's own parsers. Times are UTC: a sentence that names its time has that time, and
//! all others the time in front of their line, moved by how far the clock of the lines is from UTC.

mod content;
#[cfg(test)]
mod tests;
mod usbl;

pub(super) use content::dvl_samples;

use super::Imported;
use super::line_time::{self, Clock, LineTime};
use super::messages::Gathering;
use crate::DataError;
use crate::log::{Column, table};
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::dvl::pd6;
use backseat_wire::nmea::{Checksum, Sentence};
use content::{Content, Own, parse};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;
use usbl::Ship;

/// Name of the format.
pub(super) const NAME: &str = "device sentences";
/// Speed that makes a travel time a range, m/s; a vehicle log holds ranges.
const SOUND_MPS: f64 = 1500.0;
/// A packet and its statistics belong together within this time, µs.
const ONE_PACKET_US: i64 = 15_000_000;
/// Longest frame of a modem, bytes.
const LONGEST_FRAME: usize = 256;

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

/// Whether the first line that is no comment holds a sentence, or one after it a report of an EvoLogics modem.
pub(super) fn is_sentences(path: &Path) -> Result<bool, DataError> {
    let mut reader = BufReader::new(table::open_lines(path)?);
    let (mut bytes, mut is_first) = (Vec::new(), true);
    for _ in 0..50 {
        bytes.clear();
        if reader.read_until(b'\n', &mut bytes).map_err(|e| DataError::io(path, &e))? == 0 {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        match line.trim() {
            "" => {}
            comment if comment.starts_with(['#', '%']) => {}
            line if is_first && split(line).is_some() || usbl::find(line).is_some() => return Ok(true),
            _ => is_first = false,
        }
    }
    Ok(false)
}

/// What stands before the sentence, and the sentence.
fn split(line: &str) -> Option<(&str, &str)> {
    let is_name = |text: &str, least: usize| {
        let name = text.split(',').next().unwrap_or_default();
        (least..=7).contains(&name.len()) && name.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit())
    };
    // first: what a modem received may have a $ in it
    if let Some(at) = usbl::find(line) {
        return Some(line.split_at(at));
    }
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
    let mut lines = BufReader::new(table::open_lines(path)?);
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
        if usbl::find(text) == Some(0) {
            self.take_evologics(line, text);
            return;
        }
        // some write the star of a checksum without one
        let sentence = match Sentence::from_line(text.trim_end_matches('*').as_bytes(), Checksum::Optional) {
            Ok(sentence) => sentence,
            Err(_) => {
                let name = text.get(1..).unwrap_or_default().split(',').next().unwrap_or_default();
                return self.gathering.leave_out(name, "the checksum is wrong, or the line was cut off");
            }
        };
        let name = String::from_utf8_lossy(sentence.id()).into_owned();
        let content = match sentence.id() {
            b"PSIMSSB" => usbl::ssb(&sentence),
            b"PSIMSNS" => usbl::sns(&sentence),
            _ => parse(&sentence),
        };
        match content {
            Ok((own, is_prompt, content)) => {
                self.names.insert(name);
                self.items.push(Item { line, own, is_prompt, content });
            }
            Err(reason) => self.gathering.leave_out(&name, reason),
        }
    }

    fn take_evologics(&mut self, line: LineTime, text: &str) {
        let (name, found) = usbl::evologics(text);
        match found {
            Ok((now, own, content)) => {
                self.names.insert(name.to_owned());
                // without a time in front, that of the modem
                let line = if line == LineTime::None { line_time::parse(now) } else { line };
                self.items.push(Item { line, own, is_prompt: false, content });
            }
            Err(reason) => self.gathering.leave_out(name, reason),
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
        let is_ships = self.items.iter().any(|item| matches!(item.content, Content::Heard(_)));
        let mut ship = Ship::default();
        for item in std::mem::take(&mut self.items) {
            let own_us = match item.own {
                Own::Full(us) => Some(us),
                Own::OfDay(time) => Some(clock.nearest(time, item.line, last_us)),
                Own::Before(us) => clock.utc_us(item.line).map(|line_us| line_us - us),
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
                Content::Fix(place_deg, _) if is_ships => {
                    ship.fixes.extend(self.gathering.add_ship_fix(time_us, place_deg).map(|fix_m| (time_us, fix_m)));
                }
                Content::Fix([latitude, longitude], _) => self.gathering.add_fix(time_us, latitude, longitude),
                Content::Samples(samples) if is_ships => {
                    match samples.into_iter().find(|(column, _)| *column == Column::Heading) {
                        Some((_, heading_rad)) => ship.headings.push((time_us, heading_rad)),
                        None => self.gathering.leave_out("samples without a heading", "the ship's, of no use here"),
                    }
                }
                Content::ShipHeading { heading_rad, is_local } => {
                    ship.headings.push((time_us, heading_rad));
                    ship.is_local |= is_local;
                }
                Content::Heard(heard) => ship.heard.push((time_us, heard)),
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
                    let range_m = (arrival_us - launch_us) as f64 * 1e-6 * SOUND_MPS;
                    let samples = match content {
                        Frame::Ship(ship_deg) => {
                            ranges += 1;
                            let [x_m, y_m] = self.gathering.local_m(ship_deg);
                            let range = [(Column::Range, range_m), (Column::ShipX, x_m), (Column::ShipY, y_m)];
                            range.into_iter().chain(rate.map(|rate_mps| (Column::RangeRate, rate_mps))).collect()
                        }
                        Frame::Vehicle => {
                            uplinks += 1;
                            vec![(Column::UplinkRange, range_m)]
                        }
                    };
                    self.gathering.add_flight([launch_us, arrival_us], samples);
                    (frame, arrival) = (None, None);
                } else if launch_us > arrival_us {
                    arrival = None;
                } else {
                    frame = None;
                }
            }
        }
        let of_usbl = ship.finish(&mut self.gathering);
        let recognised: Vec<String> = self.names.into_iter().collect();
        let mut notes = vec![format!("{NAME}; recognised: {}", recognised.join(", "))];
        notes.extend(clock.note());
        notes.extend(of_usbl);
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
                Own::Before(_) | Own::None => line_time::Utc::Unknown,
            };
            (item.line, own)
        });
        Clock::of(pairs)
    }
}
