//! What the screen and the logs show beyond the present: tracks and events.

use super::json::words;
use crate::screen::time_of_day;
use backseat_topside::Topside;
use serde_json::{Value, json};
use std::collections::VecDeque;

/// Points kept of each track.
const PATH: usize = 1000;
/// Time between two points, µs.
const PATH_US: u64 = 2_000_000;
/// Events kept for the screen.
const EVENTS: usize = 200;

/// The past.
pub struct Model {
    /// Ship, then the vehicles.
    pub paths: Vec<VecDeque<[f64; 2]>>,
    path_us: u64,
    events: VecDeque<(String, bool, String)>,
    /// Devices that are gone.
    lost: Vec<String>,
}

impl Model {
    /// Nothing yet.
    pub fn new(topside: &Topside) -> Self {
        let paths = vec![VecDeque::new(); 1 + topside.tracks().len()];
        Self { paths, path_us: 0, events: VecDeque::new(), lost: Vec::new() }
    }

    /// Takes what happened; as JSON for the logs.
    pub fn take(&mut self, topside: &mut Topside, time_us: u64) -> Vec<Value> {
        let mut taken = Vec::new();
        while let Some((event_us, event)) = topside.next_event() {
            let (trouble, text) = words(&event);
            let utc_s = topside.utc_us(event_us).map(|us| us as f64 * 1e-6);
            taken.push(json!({"utc_s": utc_s, "trouble": trouble, "text": text}));
            self.note(topside, event_us, trouble, text);
        }
        if time_us >= self.path_us {
            self.path_us = time_us + PATH_US;
            self.extend(topside, time_us);
        }
        taken
    }

    /// Something that the program noticed.
    pub fn note(&mut self, topside: &Topside, time_us: u64, trouble: bool, text: String) {
        let when = topside.utc_us(time_us).map_or("--:--:--".to_owned(), time_of_day);
        self.events.push_back((when, trouble, text));
        if self.events.len() > EVENTS {
            self.events.pop_front();
        }
    }

    fn extend(&mut self, topside: &Topside, time_us: u64) {
        let Some(utc_us) = topside.utc_us(time_us) else { return };
        let ship = topside.ship_at(utc_us).map(|ship| ship.position_m);
        let vehicles = topside.tracks().iter().map(|track| track.at(utc_us).map(|estimate| estimate.position_m));
        for (path, place) in self.paths.iter_mut().zip(std::iter::once(ship).chain(vehicles)) {
            path.extend(place);
            if path.len() > PATH {
                path.pop_front();
            }
        }
    }

    /// The last events, oldest first: when, whether it is a trouble, what.
    pub fn recent(&self, count: usize) -> impl Iterator<Item = (String, bool, String)> + '_ {
        self.events.iter().skip(self.events.len().saturating_sub(count)).cloned()
    }

    /// Which devices are gone.
    pub fn set_lost(&mut self, lost: Vec<String>) {
        self.lost = lost;
    }

    /// The devices that are gone, for the screen.
    pub fn lines_lost(&self) -> String {
        if self.lost.is_empty() { String::new() } else { format!("  unplugged: {}", self.lost.join(", ")) }
    }

    /// The last packet in words.
    pub fn last_sent(&self, topside: &Topside, utc_us: Option<u64>) -> String {
        let Some((sent, utc_us)) = topside.last_sent().zip(utc_us) else { return "no packet sent yet".to_owned() };
        let age_s = (utc_us / 1_000_000).saturating_sub(u64::from(sent.state.transmit_s));
        format!(
            "last packet {age_s} s ago: ship ±{:.1} m, ±{:.2} m/s",
            sent.state.position_sigma_m, sent.state.velocity_sigma_mps
        )
    }
}
