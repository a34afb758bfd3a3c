//! What is known of the board, gathered from its frames. Time is an argument: µs of this computer's own clock.

mod alarms;
mod enquiry;
mod journal;
mod learned;
mod link;
mod mission;
mod sources;
mod trend;
pub mod words;

pub use alarms::Alarm;
pub use journal::{Journal, Severity};
pub use learned::Identified;
pub use link::{Link, Meter};
pub use sources::{SourceHistory, Turn};

use backseat_app::parameters::{self, PARAMETER_SCHEMA, Settings};
use backseat_core::identification::theta::{self, theta_of};
use backseat_wire::hostlink::{
    Decoder, Estimates, FaultReport, FromBoard, Health, Identification, ImageId, KeptCrash, LogState, Mode, Naming,
    Port, Refusal, Restart, Ship, Steered, Telemetry, ToBoard, Waypoint,
};
use enquiry::Enquiry;
use learned::Learned;
use link::Frame;
use sources::Sources;
use trend::Thinned;

/// Time between two telemetry records, µs.
const STEP_US: u64 = 100_000;
/// Points of the track that are kept.
const TRACK: usize = 1000;
/// Positions closer together than this are one point of the track, m.
const TRACK_STEP_M: f64 = 0.5;
/// Values of the current's trend.
const TREND: usize = 64;
/// A current slower than this is none, m/s.
const STILL_MPS: f64 = 1e-6;

/// What is known of the board.
pub struct Model {
    decoder: Decoder,
    enquiry: Enquiry,
    pub link: Link,
    /// The port is there; where not, since when.
    pub away_since_us: Option<u64>,
    pub telemetry: Option<Telemetry>,
    /// When the last record came.
    heard_us: Option<u64>,
    pub sources: Sources,
    track: Thinned<[f64; 2]>,
    last_point: Option<[f64; 2]>,
    pub mission: Vec<Waypoint>,
    /// From the last packet.
    pub ship: Option<Ship>,
    /// The fault monitor's last report.
    pub fault: Option<FaultReport>,
    /// Last counters, and the good frames a second of each device port.
    pub health: Option<Health>,
    pub port_rates: [Meter; 4],
    pub losses_rate: Meter,
    pub firmware: Option<String>,
    same_schema: bool,
    pub restart: Option<Restart>,
    /// Of its earlier crashes those that no card has got.
    pub crashes: Vec<KeptCrash>,
    /// Start number of an image that is on trial.
    pub trial: Option<u8>,
    /// The parameters received so far; defaults before.
    settings: Box<Settings>,
    /// All of them were received.
    is_complete: bool,
    pub learned: Learned,
    /// Of the robust filter.
    pub estimates: Option<Estimates>,
    /// What the board names of what has changed.
    pub naming: Option<Naming>,
    steered: Option<Steered>,
    current: Thinned<f64>,
    pub journal: Journal,
}

impl Model {
    pub fn new() -> Self {
        let mut enquiry = Enquiry::default();
        enquiry.restart();
        Self {
            decoder: Decoder::new(),
            enquiry,
            link: Link::default(),
            away_since_us: None,
            telemetry: None,
            heard_us: None,
            sources: Sources::default(),
            track: Thinned::new(TRACK),
            last_point: None,
            mission: Vec::new(),
            ship: None,
            fault: None,
            health: None,
            port_rates: Default::default(),
            losses_rate: Meter::default(),
            firmware: None,
            trial: None,
            same_schema: false,
            restart: None,
            crashes: Vec::new(),
            settings: Box::new(Settings::DEFAULT),
            is_complete: false,
            learned: Learned::default(),
            estimates: None,
            naming: None,
            steered: None,
            current: Thinned::new(TREND),
            journal: Journal::default(),
        }
    }

    /// Bytes of the host port.
    pub fn receive(&mut self, now_us: u64, mut bytes: &[u8]) {
        self.link.bytes += bytes.len() as u64;
        // Out of the way of the borrow of its frames.
        let mut decoder = std::mem::take(&mut self.decoder);
        while let Some(outcome) = decoder.feed(&mut bytes) {
            let frame = match outcome.map(|frame| frame.message::<FromBoard<'_>>()) {
                Ok(Ok(message)) => {
                    self.take(now_us, message);
                    Frame::Good
                }
                Ok(Err(_)) => Frame::Unknown,
                Err(_) => Frame::Broken,
            };
            self.link.note(frame);
        }
        self.decoder = decoder;
    }

    /// The port is gone.
    pub fn lost(&mut self, now_us: u64, why: &str) {
        self.away_since_us = Some(now_us);
        self.note(Severity::Critical, format!("port lost: {why}"));
    }

    /// The port is there again.
    pub fn found(&mut self, now_us: u64) {
        let away_s = self.away_since_us.take().map_or(0.0, |since_us| now_us.saturating_sub(since_us) as f64 * 1e-6);
        self.note(Severity::Info, format!("port back after {away_s:.1} s"));
        self.decoder = Decoder::new();
        self.link.connected();
        self.firmware = None;
        self.enquiry.restart();
    }

    /// Keeps the rates up to date.
    pub fn tick(&mut self, now_us: u64) {
        self.link.tick(now_us);
    }

    /// What to ask the board now.
    pub fn question(&mut self, now_us: u64) -> Option<ToBoard<'static>> {
        self.enquiry.due(now_us)
    }

    /// Since the last telemetry record, s.
    pub fn silence_s(&self, now_us: u64) -> Option<f64> {
        self.heard_us.map(|heard_us| now_us.saturating_sub(heard_us) as f64 * 1e-6)
    }

    /// The board's time now, as far as it is known: its last record's, and as long as nothing came since.
    pub fn board_us(&self, now_us: u64) -> u64 {
        let since_us = self.heard_us.map_or(0, |heard_us| now_us.saturating_sub(heard_us));
        // a record is up to a step old
        let overdue_us = since_us.saturating_sub(STEP_US);
        self.telemetry.as_ref().map_or(0, |record| record.time_us.saturating_add(overdue_us))
    }

    /// The filter has a position.
    pub fn position(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|record| record.sigma[0] > 0.0)
    }

    /// Where it was, north and east, m.
    pub fn track(&self) -> &[[f64; 2]] {
        &self.track.kept
    }

    /// Innovations beyond this many sigmas are rejected.
    pub fn gate_sigmas(&self) -> f64 {
        self.settings.navigation.gate_sigma
    }

    /// The parameters in use, once all of them were received.
    pub fn settings(&self) -> Option<&Settings> {
        self.is_complete.then_some(&*self.settings)
    }

    /// The identified parameters beside those in use.
    pub fn identified(&self) -> Vec<Identified<'_>> {
        let in_use = self.settings().map(|settings| <[f64; theta::PARAMETERS]>::from(theta_of(&settings.vehicle)));
        self.learned.identified(in_use.as_ref())
    }

    pub fn identification(&self) -> Option<&Identification> {
        self.learned.last.as_ref()
    }

    /// Estimated water current: speed, m/s, direction it sets to, rad, and the speed's trend.
    pub fn current(&self) -> Option<(f64, f64, &[f64])> {
        let [north, east] = self.telemetry.as_ref()?.current_mps;
        let speed = north.hypot(east);
        (speed > STILL_MPS)
            .then(|| (speed, east.atan2(north).rem_euclid(std::f64::consts::TAU), &self.current.kept[..]))
    }

    /// What ended runs of the board before, as far as it keeps that, the newest first.
    pub fn crash_texts(&self) -> Vec<String> {
        let last = self.restart.and_then(|restart| restart.crash).map(|crash| crash.to_string());
        last.into_iter().chain(self.crashes.iter().rev().map(KeptCrash::to_string)).collect()
    }

    /// What is wrong now, the worst first.
    pub fn alarms(&self, now_us: u64) -> Vec<Alarm> {
        alarms::of(self, now_us)
    }

    /// Time of day where the board knows it, else its own.
    fn when(&self) -> String {
        self.telemetry
            .as_ref()
            .map_or_else(|| "--:--:--".to_owned(), |record| words::time_of_day(record.utc_us, record.time_us))
    }

    /// Says where other commands reach the board meanwhile.
    pub fn shared(&mut self, path: &str) {
        self.note(Severity::Info, format!("other commands: {path}"));
    }

    fn note(&mut self, severity: Severity, text: String) {
        self.journal.note(self.when(), severity, text);
    }

    fn take(&mut self, now_us: u64, message: FromBoard<'_>) {
        match message {
            FromBoard::Telemetry(record) => self.telemetry(now_us, record),
            FromBoard::Fusion(record) => {
                if let Some((sensor, turn)) = self.sources.note(&record) {
                    self.turned(sensor.name(), turn);
                }
            }
            FromBoard::Health(health) => self.health(now_us, health),
            FromBoard::Hello { firmware, parameter_schema, image } => {
                let mut firmware = backseat_link::printable(firmware);
                if image != ImageId::default() {
                    firmware += &format!(" ({image})");
                }
                self.enquiry.hello();
                self.same_schema = parameter_schema == PARAMETER_SCHEMA;
                self.is_complete = false;
                // another program may have asked as well
                if self.firmware.as_deref() != Some(&*firmware) {
                    let other = if self.same_schema { "" } else { ", with parameters not known here" };
                    self.note(Severity::Info, format!("{firmware}{other}"));
                    self.firmware = Some(firmware);
                }
            }
            FromBoard::Restart(restart) => self.restarted(restart),
            FromBoard::EarlierCrash(crash) => self.crashed(crash),
            FromBoard::Mission { index, count, waypoint } => self.waypoint(index, count, waypoint),
            FromBoard::Parameter(info) => {
                self.enquiry.parameter(info.index, info.count);
                if let Some(parameter) = parameters::find(info.name)
                    && (parameter.min..=parameter.max).contains(&info.value)
                {
                    parameter.set(&mut self.settings, info.value);
                }
                self.is_complete |= self.same_schema && info.index.checked_add(1) == Some(info.count);
            }
            FromBoard::Identification(record) => {
                let was = self.learned.last.as_ref().map(|last| last.activity);
                if was.is_some_and(|activity| activity != record.activity) {
                    self.note(Severity::Info, format!("identification: {}", words::activity(record.activity)));
                }
                let drifted = self.learned.note(&record);
                if !drifted.is_empty() {
                    self.note(Severity::Warning, format!("drifted against their noise: {}", drifted.join(", ")));
                }
            }
            FromBoard::Ship(ship) => self.ship = Some(ship),
            FromBoard::Estimates(record) => self.estimates = Some(record),
            FromBoard::Naming(naming) => {
                let is_new = backseat_link::named::is_new(self.naming.as_ref(), &naming);
                let (severity, text) = words::naming(&naming);
                self.naming = Some(naming);
                if is_new {
                    self.note(severity, text);
                }
            }
            FromBoard::Steered(steered) => self.steered(steered),
            FromBoard::Fault(report) => {
                let before = self.fault.replace(report);
                if before.is_none_or(|before| before.state != report.state) {
                    let (severity, text) = words::fault(&report);
                    self.note(severity, text);
                }
            }
            FromBoard::LearntStored(stored) => {
                self.enquiry.hurry();
                let (severity, text) = words::learnt(&stored);
                self.note(severity, text);
            }
            FromBoard::Images(images) => {
                self.enquiry.images();
                self.trial = images.trial;
            }
            FromBoard::Refused(Refusal::NoStore) => self.enquiry.images(),
            // Answers to another program.
            FromBoard::StepDone(_)
            | FromBoard::Challenge { .. }
            | FromBoard::Done
            | FromBoard::Refused(_)
            | FromBoard::Fence { .. }
            | FromBoard::Key { .. } => {}
        }
    }

    fn telemetry(&mut self, now_us: u64, record: Telemetry) {
        self.link.records += 1;
        self.heard_us = Some(now_us);
        let before = self.telemetry.replace(record.clone());
        let mode = (record.mode, record.reason);
        match &before {
            Some(last) if record.time_us < last.time_us => self.started_again(),
            Some(last) => {
                let missing = (record.time_us - last.time_us + STEP_US / 2) / STEP_US;
                if missing > 1 {
                    self.link.gap(missing - 1);
                }
            }
            None => {}
        }
        if before.as_ref().is_none_or(|last| (last.mode, last.reason) != mode) {
            // other parameters have navigation begin again
            if record.mode == Mode::Initialising {
                self.enquiry.hurry();
            }
            self.note(words::severity(record.mode), words::mode(record.mode, record.reason));
        }
        self.leg_changed(before.as_ref().and_then(|last| last.leg), &record);
        if record.sigma[0] > 0.0 {
            let point = [record.state[0], record.state[1]];
            let moved = |last: [f64; 2]| (point[0] - last[0]).hypot(point[1] - last[1]) >= TRACK_STEP_M;
            if self.last_point.is_none_or(moved) {
                self.track.push(point);
                self.last_point = Some(point);
            }
        }
        // one in ten seconds, as the identifier's
        if record.time_us % (100 * STEP_US) < STEP_US {
            self.current.push(record.current_mps[0].hypot(record.current_mps[1]));
        }
    }

    fn turned(&mut self, sensor: &str, turn: Turn) {
        match turn {
            Turn::Rejected(sigmas) => {
                self.note(Severity::Warning, format!("{sensor} rejected, {sigmas:.1} sigmas"));
            }
            Turn::FusedAgain(row) if row > 1 => {
                self.note(Severity::Info, format!("{sensor} fused again after {row} rejections"));
            }
            Turn::FusedAgain(_) => {}
        }
    }

    /// The board's time went back: nothing of before is of any use.
    fn started_again(&mut self) {
        self.sources.forget();
        self.track.clear();
        self.last_point = None;
        self.ship = None;
        self.fault = None;
        self.current.clear();
        self.learned.forget();
        self.estimates = None;
        self.steered = None;
        self.enquiry.restart();
        self.note(Severity::Warning, "the board started again".into());
    }

    fn restarted(&mut self, restart: Restart) {
        if self.restart == Some(restart) {
            return;
        }
        self.restart = Some(restart);
        self.crashes.clear();
        let Restart { cause, resets, safe, crash } = restart;
        let (severity, barred) = match (resets, safe) {
            (_, true) => (Severity::Critical, "; too many in too short a time: safe mode"),
            (0, false) => (Severity::Info, ""),
            (_, false) => (Severity::Warning, ""),
        };
        let text = format!("last start: {cause:?}, {resets} resets by a fault since power-on{barred}");
        self.note(severity, text);
        if let Some(crash) = crash {
            self.note(Severity::Critical, format!("before it: {crash}"));
        }
    }

    fn crashed(&mut self, crash: KeptCrash) {
        // told again with each answer to `Hello`
        if !self.crashes.contains(&crash) {
            self.crashes.push(crash);
            self.note(Severity::Warning, format!("an earlier crash: {crash}"));
        }
    }

    fn health(&mut self, now_us: u64, health: Health) {
        self.enquiry.health();
        for (meter, count) in self.port_rates.iter_mut().zip(health.accepted_frames) {
            meter.update(now_us, u64::from(count));
        }
        let losses = |health: &Health| health.receive_losses.iter().map(|n| u64::from(*n)).sum::<u64>();
        self.losses_rate.update(now_us, losses(&health));
        if let Some(last) = &self.health {
            for (port, (before, after)) in Port::ALL.iter().zip(last.receive_losses.iter().zip(health.receive_losses)) {
                if after > *before {
                    let text = format!("{} port lost bytes, {} times", port.name(), after - before);
                    self.journal.note(self.when(), Severity::Warning, text);
                }
            }
            if last.log.state != health.log.state {
                let severity = match health.log.state {
                    LogState::Failed | LogState::Full => Severity::Warning,
                    LogState::NotFitted | LogState::Searching | LogState::Writing => Severity::Info,
                };
                let text = format!("board log: {}", words::log_state(health.log.state));
                self.journal.note(self.when(), severity, text);
            }
        }
        let before = self.health.as_ref().and_then(|last| last.hardware).unwrap_or_default();
        if let Some(hardware) = health.hardware {
            if hardware.supply_dips > before.supply_dips {
                self.journal.note(self.when(), Severity::Critical, "the board's supply fell".to_owned());
            }
            if hardware.lost_edges > before.lost_edges {
                let text = format!("{} pulse edges came too fast to be told apart", hardware.lost_edges);
                self.journal.note(self.when(), Severity::Warning, text);
            }
            let [mended, lost] = hardware.wrong_bits;
            if hardware.wrong_bits != before.wrong_bits {
                let severity = if lost > before.wrong_bits[1] { Severity::Critical } else { Severity::Warning };
                let text = format!("wrong bits in the board's memory since its start: {mended} corrected, {lost} not");
                self.journal.note(self.when(), severity, text);
            }
        }
        let late_before = self.health.as_ref().map_or(health.late_steps, |last| last.late_steps);
        if health.late_steps > late_before {
            let latest_ms = f64::from(health.latest_step_us) * 1e-3;
            let text =
                format!("{} steps came late, the latest so far by {latest_ms:.0} ms", health.late_steps - late_before);
            self.journal.note(self.when(), Severity::Warning, text);
        }
        let refused_before = self.health.as_ref().map_or(0, |last| last.refused_requests);
        if health.refused_requests > refused_before {
            let text = format!("{} requests at its host port were not signed by its key", health.refused_requests);
            self.journal.note(self.when(), Severity::Warning, text);
        }
        self.health = Some(health);
    }
}

#[cfg(test)]
pub(crate) mod tests;
