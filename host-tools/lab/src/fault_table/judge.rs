//! A flight with faults, watched step by step and compared with its limits.

use super::CommandWatch;
use backseat_core::navigation::Sensor;
use backseat_logs::stats::median;
use backseat_wire::hostlink::{Mode, ModeReason, Telemetry};
use hil_sim::flight::{FlightLog, Watched};
use hil_sim::scenario::{End, Limits, Scenario};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// An error beyond so many of its own sigmas, horizontally or in depth, in a mode that steers, is silent ...
const SIGMAS: f64 = 3.0;
/// ... and for longer than this in sum ...
pub(super) const SILENT_S: f64 = 120.0;
/// ... in any window of this length it is a defect, s.
const WINDOW_S: f64 = 600.0;
/// So many rejections of one source in a row ...
const ROW: u32 = 10;
/// ... over at least this time, µs, and the mode must not be `navigating`: the two seconds that a fish or a wave may
/// last, and a few steps.
const ROW_US: u64 = 2_500_000;
/// Missions of the table are flown at 3 m: that, `safety.depth_below_leg_m` (5 m), and 1 m, m.
const DEEPEST_M: f64 = 9.0;
/// A step does not propagate a variance by this factor; a covariance that was scaled to fit does.
const JUMP: f64 = 2.0;

/// A mode and its reason, from a time on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spell {
    /// Simulated time, µs.
    pub from_us: u64,
    /// How long, µs.
    pub length_us: u64,
    /// The mode.
    pub mode: Mode,
    /// Why.
    pub reason: ModeReason,
}

/// History of a source.
#[derive(Clone, Copy, Debug, Default)]
struct SourceHistory {
    rejected_in_a_row: u32,
    since_us: u64,
    last_us: u64,
    rejected: u32,
    last_variance: f64,
}

/// How long an error has been silent in the last [`WINDOW_S`]. A moment without error in between does not start the
/// count again.
#[derive(Clone, Debug, Default)]
struct Silence {
    /// End and length of the silent steps in the window, µs.
    steps: VecDeque<(u64, u64)>,
    sum_us: u64,
    most_us: u64,
}

impl Silence {
    fn step(&mut self, time_us: u64, dt_us: u64, silent: bool) {
        while let Some((_, length_us)) =
            self.steps.pop_front_if(|(end_us, _)| *end_us as f64 <= time_us as f64 - WINDOW_S * 1e6)
        {
            self.sum_us -= length_us;
        }
        if silent {
            self.steps.push_back((time_us, dt_us));
            self.sum_us += dt_us;
            self.most_us = self.most_us.max(self.sum_us);
        }
    }

    fn most_s(&self) -> f64 {
        self.most_us as f64 * 1e-6
    }
}

/// Watches a flight.
pub struct Judge {
    fault_us: u64,
    last_leg: u16,
    pub(super) commands: CommandWatch,
    sources: [SourceHistory; Sensor::ALL.len()],
    fixed: bool,
    /// Of the step before, m².
    position_variance: f64,
    errors_m: Vec<f64>,
    navigating_errors_m: Vec<f64>,
    end_error_m: Option<f64>,
    ratios: [f64; 2],
    deepest_m: f64,
    steered_deepest_m: f64,
    /// Horizontally, in depth.
    silence: [Silence; 2],
    navigating_us: u64,
    steered_us: u64,
    spells: Vec<Spell>,
    frames: [u32; 4],
    frames_before_reset: [u32; 4],
    leg: Option<u16>,
    violations: BTreeSet<String>,
    last_us: u64,
}

/// Results of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedFlight {
    /// Its seed.
    pub seed: u64,
    /// Horizontal error from the first fault on: median and largest, m.
    pub error_m: [f64; 2],
    /// Those while the mode was `navigating`, one a step, m.
    pub navigating_errors_m: Vec<f64>,
    /// In the end, m.
    pub end_error_m: f64,
    /// Largest error over its own sigma while the mode was `navigating`, and in any mode, from the first fault on.
    pub ratios: [f64; 2],
    /// Longest time with an error beyond three sigmas, in sum in any window of 600 s, in a mode that steers:
    /// horizontally and in depth, s.
    pub silent_s: [f64; 2],
    /// Share of the mission's time in which the mode was `navigating`.
    pub navigating: f64,
    /// Deepest point of the true track, m.
    pub deepest_m: f64,
    /// The same while a mission was under way, m.
    pub steered_deepest_m: f64,
    /// Modes from the first fault on.
    pub spells: Vec<Spell>,
    /// When the first fault began, µs.
    pub fault_us: u64,
    /// Refused frames by port, rejected measurements by sensor, packets without a range by cause.
    pub alarms: BTreeMap<String, u32>,
    /// Steering, neutral and stop commands.
    pub commands: [u32; 3],
    /// How the mission ended.
    pub end: End,
    /// The backseat's digest in the end.
    pub digest: u64,
    /// Every rule that was broken.
    pub violations: Vec<String>,
}

impl Judge {
    /// For one flight of a scenario.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let settings = &scenario.settings;
        Self {
            fault_us: settings.faults.iter().map(|fault| fault.from_us).min().unwrap_or(0),
            last_leg: (settings.waypoints().len() as u16).saturating_sub(1),
            commands: CommandWatch::default(),
            sources: Default::default(),
            fixed: false,
            position_variance: f64::INFINITY,
            errors_m: Vec::new(),
            navigating_errors_m: Vec::new(),
            end_error_m: None,
            ratios: [0.0; 2],
            deepest_m: 0.0,
            steered_deepest_m: 0.0,
            silence: Default::default(),
            navigating_us: 0,
            steered_us: 0,
            spells: Vec::new(),
            frames: [0; 4],
            frames_before_reset: [0; 4],
            leg: None,
            violations: BTreeSet::new(),
            last_us: 0,
        }
    }

    /// One step.
    pub fn watch(&mut self, step: &Watched<'_>) {
        let dt_us = step.time_us - std::mem::replace(&mut self.last_us, step.time_us);
        if step.reset {
            self.commands.reset(step.time_us);
            self.sources.iter_mut().for_each(|source| source.rejected_in_a_row = 0);
            for (sum, frames) in self.frames_before_reset.iter_mut().zip(std::mem::take(&mut self.frames)) {
                *sum += frames;
            }
        }
        self.deepest_m = self.deepest_m.max(step.truth.state[2]);
        for record in step.fusions.iter().filter(|record| record.axis == 0) {
            self.fusion(step.time_us, record.sensor, record.fused, record.variance);
        }
        let Some(telemetry) = step.telemetry else {
            self.commands.hear(step.time_us, step.to_frontseat, false);
            return;
        };
        let mission = telemetry.leg.is_some();
        if mission {
            self.steered_deepest_m = self.steered_deepest_m.max(step.truth.state[2]);
        }
        self.commands.hear(step.time_us, step.to_frontseat, mission);
        self.leg = self.leg.max(telemetry.leg);
        self.frames = telemetry.rejected_frames;
        self.mode(step.time_us, dt_us, telemetry);
        self.position(step.time_us, dt_us, &step.truth.state, telemetry);
    }

    fn fusion(&mut self, time_us: u64, sensor: Sensor, fused: bool, variance: f64) {
        let source = &mut self.sources[sensor as usize];
        if !fused {
            if source.rejected_in_a_row == 0 {
                source.since_us = time_us;
            }
            source.last_us = time_us;
            source.rejected_in_a_row += 1;
            source.rejected += 1;
            source.last_variance = variance;
            self.fixed = false;
            return;
        }
        // Only after consecutive rejections, and unless a fix was fused since: a fix explains the return of any source.
        self.fixed |= sensor == Sensor::VehicleGnss;
        if source.rejected_in_a_row >= ROW && !self.fixed {
            let bound = match sensor {
                // hᵀPh is at most the sum of the position's variances; range noise, depth and ship add a few m².
                Sensor::Range => JUMP * self.position_variance + 10.0,
                // Half a minute apart, and no bound of the same kind at hand.
                Sensor::RangeRate => f64::INFINITY,
                _ => JUMP * source.last_variance,
            };
            if variance > bound {
                self.violations.insert(format!("{} taken back with a covariance scaled to fit", sensor.name()));
            }
        }
        source.rejected_in_a_row = 0;
    }

    fn mode(&mut self, time_us: u64, dt_us: u64, telemetry: &Telemetry) {
        let Telemetry { mode, reason, .. } = *telemetry;
        match self.spells.last_mut() {
            Some(spell) if (spell.mode, spell.reason) == (mode, reason) => spell.length_us += dt_us,
            _ => self.spells.push(Spell { from_us: time_us, length_us: dt_us, mode, reason }),
        }
        if mode != Mode::Navigating {
            return;
        }
        for (sensor, source) in Sensor::ALL.iter().zip(&self.sources) {
            // A source that has fallen silent since is covered by the limit on the position's error.
            let present = time_us < source.last_us + ROW_US;
            if present && source.rejected_in_a_row >= ROW && time_us >= source.since_us + ROW_US {
                self.violations.insert(format!("navigating after {ROW} rejections of {} in a row", sensor.name()));
            }
        }
    }

    fn position(&mut self, time_us: u64, dt_us: u64, truth: &[f64; 12], telemetry: &Telemetry) {
        let Telemetry { state, sigma, cov_xy_m2, mode, .. } = telemetry;
        if *mode == Mode::Initialising || sigma[0] <= 0.0 {
            return;
        }
        self.position_variance = sigma[0] * sigma[0] + sigma[1] * sigma[1];
        let [dx, dy] = [state[0] - truth[0], state[1] - truth[1]];
        let error_m = dx.hypot(dy);
        if time_us >= self.fault_us {
            self.errors_m.push(error_m);
            self.end_error_m = Some(error_m);
        }
        // One sigma along the error.
        let spread = dx * dx * sigma[0] * sigma[0] + 2.0 * dx * dy * cov_xy_m2 + dy * dy * sigma[1] * sigma[1];
        let ratio = if error_m > 0.0 { error_m * error_m / spread.sqrt() } else { 0.0 };
        let [healthy, any] = &mut self.ratios;
        if time_us >= self.fault_us {
            *any = any.max(ratio);
        }
        // Degraded steers as well, if it has a mission; without one nobody goes by it.
        let steers = *mode == Mode::Navigating || (*mode == Mode::Degraded && telemetry.leg.is_some());
        let deep = (state[2] - truth[2]).abs() / sigma[2];
        for (silence, ratio) in self.silence.iter_mut().zip([ratio, deep]) {
            silence.step(time_us, dt_us, steers && (ratio > SIGMAS || ratio.is_nan()));
        }
        if telemetry.leg.is_some() {
            self.steered_us += dt_us;
            self.navigating_us += if *mode == Mode::Navigating { dt_us } else { 0 };
        }
        if *mode == Mode::Navigating && time_us >= self.fault_us {
            *healthy = healthy.max(ratio);
            self.navigating_errors_m.push(error_m);
        }
    }

    /// The flight is over; `lost_packets` by cause. Compares everything with `limits`.
    #[must_use]
    pub fn finish(self, seed: u64, flight: &FlightLog, lost_packets: &[(&str, u32)], limits: &Limits) -> JudgedFlight {
        let error_m = [median(&self.errors_m), self.errors_m.iter().copied().reduce(f64::max)];
        let ended = self.leg.is_some() && self.commands.stops > 0;
        let flown = flight.finished && !ended && self.leg == Some(self.last_leg);
        let alarms = self.alarms(lost_packets);
        let mut outcome = JudgedFlight {
            seed,
            // none where the flight was over before its first fault
            error_m: error_m.map(|error| error.unwrap_or(0.0)),
            navigating_errors_m: self.navigating_errors_m,
            end_error_m: self.end_error_m.unwrap_or(f64::NAN),
            ratios: self.ratios,
            deepest_m: self.deepest_m,
            steered_deepest_m: self.steered_deepest_m,
            silent_s: self.silence.each_ref().map(Silence::most_s),
            navigating: self.navigating_us as f64 / self.steered_us.max(1) as f64,
            spells: self.spells.iter().copied().filter(|s| s.from_us + s.length_us > self.fault_us).collect(),
            fault_us: self.fault_us,
            alarms,
            commands: [self.commands.commands, self.commands.neutral, self.commands.stops],
            end: match (flown, ended) {
                (true, _) => End::Flown,
                (_, true) => End::Ended,
                _ => End::Any,
            },
            digest: flight.digest,
            violations: Vec::new(),
        };
        let mut violations = self.violations;
        violations.extend(self.commands.violations);
        outcome.broken(limits, &mut violations);
        outcome.violations = violations.into_iter().collect();
        outcome
    }

    fn alarms(&self, lost_packets: &[(&str, u32)]) -> BTreeMap<String, u32> {
        let ports = ["frontseat", "dvl", "ahrs", "modem"];
        let frames = ports.iter().zip(self.frames.iter().zip(self.frames_before_reset));
        let frames = frames.map(|(port, (now, before))| (format!("{port} frames"), now + before));
        let rejected = Sensor::ALL.iter().map(|&s| (format!("{} gated", s.name()), self.sources[s as usize].rejected));
        let packets = lost_packets.iter().map(|(cause, count)| (format!("packet {cause}"), *count));
        frames.chain(rejected).chain(packets).filter(|(_, count)| *count > 0).collect()
    }
}

impl JudgedFlight {
    /// The promise was kept: never wrong in silence for long.
    #[must_use]
    pub fn is_honest(&self) -> bool {
        self.silent_s.iter().all(|silent_s| *silent_s <= SILENT_S)
    }

    /// Every limit of its row that the flight breaks.
    fn broken(&self, limits: &Limits, violations: &mut BTreeSet<String>) {
        let mut check = |holds: bool, what: String| {
            if !holds {
                violations.insert(what);
            }
        };
        let (largest_m, most_m) = (self.error_m[1], limits.error_m);
        check(largest_m <= most_m, format!("error {largest_m:.1} m"));
        if let Some(most_m) = limits.end_error_m {
            check(self.end_error_m <= most_m, format!("error in the end {:.1} m", self.end_error_m));
        }
        if limits.unrevealable.is_none() {
            for (what, silent_s) in ["", " in depth"].iter().zip(self.silent_s) {
                check(silent_s <= SILENT_S, format!("beyond 3 sigmas{what} for {silent_s:.0} s of 600 s, silently"));
            }
        }
        let deepest_m = if limits.sinks.is_some() { self.steered_deepest_m } else { self.deepest_m };
        check(deepest_m <= DEEPEST_M, format!("{deepest_m:.1} m deep"));
        check(self.navigating >= limits.navigating, format!("navigating for {:.0} % only", 100.0 * self.navigating));
        let end = self.end;
        check(limits.mission == End::Any || end == limits.mission, format!("mission {}", name(&end)));
        if end == End::Ended {
            check(self.commands[1] > 0, "no neutral fins at the end".to_owned());
        }
        let shown = self.spells.iter().any(|spell| {
            spell.mode != Mode::Navigating && limits.reasons.iter().any(|reason| *reason == name(&spell.reason))
        });
        check(limits.reasons.is_empty() || shown, format!("none of {}", limits.reasons.join(", ")));
    }
}

/// `FrontseatSilent` as `frontseat_silent`.
pub(super) fn name(value: &impl std::fmt::Debug) -> String {
    hil_sim::faults::snake(&format!("{value:?}"))
}
