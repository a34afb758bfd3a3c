//! A session with a PC's times: the app on board time, reconstructed from the telemetry.
//!
//! The PC reads each byte late, by cable and buffers, and no record holds the app's own steps and pulse edges: the
//! replay is close to what the board computed, never the same to the bit.

use super::board::{settings, take};
use super::survey::{ReportedStep, Survey, reported_step};
use anyhow::bail;
use backseat_app::{App, START_US, STEP_US};
use backseat_logs::session::{Entry, Event};
use backseat_wire::hostlink::{Decoder, FromBoard, Port};
use std::collections::VecDeque;

const SECOND_US: u64 = 1_000_000;
/// Where pulse edges carry UTC it is constant against board time but for the crystal; a label's latency is not.
const STEADY_US: i64 = 200;

/// The app, fed from a PC's recording.
pub struct Approximate {
    app: Box<App>,
    /// The PC's clock minus the board's, µs.
    offset_us: i64,
    /// Steps that the board is known to have taken; without telemetry, every 0.1 s from the first byte on.
    steps: VecDeque<ReportedStep>,
    has_telemetry: bool,
    next_us: Option<u64>,
    /// UTC minus board time at the last step, µs.
    utc_offset_us: Option<i64>,
    decoder: Decoder,
    pub outcome: ApproximateReplay,
}

/// What came of it.
#[derive(Debug, Default)]
pub struct ApproximateReplay {
    pub steps: usize,
    /// First and last step, board time, µs.
    pub span_us: Option<(u64, u64)>,
    pub digest: u64,
    /// Pulse edges that the telemetry's UTC gave.
    pub edges: usize,
    /// Distances from the board's position at its steps, m.
    pub distances_m: Vec<f64>,
    /// Steps at which one of the two had a position and the other none.
    pub unmatched: usize,
    pub notes: Vec<String>,
}

impl Approximate {
    pub fn new(survey: &Survey) -> Self {
        let mut outcome = ApproximateReplay::default();
        let starts = survey.reported.windows(2).position(|pair| pair[1].time_us <= pair[0].time_us);
        let reported = &survey.reported[..starts.map_or(survey.reported.len(), |i| i + 1)];
        if let Some(last) = reported.last().filter(|_| starts.is_some()) {
            let t_s = last.time_us as f64 * 1e-6;
            outcome.notes.push(format!("the board started again after {t_s:.1} s: replayed up to there"));
        }
        if reported.is_empty() {
            outcome.notes.push(
                "no telemetry of the board in it: nothing to compare with, and no pulse edges, without \
                                which acoustic ranges are left out"
                    .to_owned(),
            );
        }
        if !survey.has_parameters {
            outcome.notes.push("no parameters of the board in it: the defaults".to_owned());
        }
        // The telemetry that was read soonest after its step is the best.
        let offset = |step: &ReportedStep| step.read_us as i64 - step.time_us as i64;
        Self {
            app: Box::new(App::new()),
            offset_us: reported.iter().map(offset).min().unwrap_or(0),
            steps: reported.iter().copied().collect(),
            has_telemetry: !reported.is_empty(),
            next_us: None,
            utc_offset_us: None,
            decoder: Decoder::new(),
            outcome,
        }
    }

    /// Takes the session's next entry; false when the rest cannot be replayed.
    pub fn take(&mut self, entry: Entry) -> anyhow::Result<bool> {
        match entry.event {
            Event::Parameters(values) => {
                let settings = settings(&values)?;
                if !self.app.restore(Some(&settings)) {
                    bail!("its parameters make no valid set");
                }
            }
            Event::Received { port, bytes } => {
                let time_us = self.board_us(entry.time_us);
                self.advance(time_us);
                self.app.receive(port, time_us, &bytes);
                self.app.take_announced();
            }
            _ => {}
        }
        Ok(!self.has_telemetry || !self.steps.is_empty())
    }

    fn board_us(&mut self, read_us: u64) -> u64 {
        if !self.has_telemetry && self.next_us.is_none() {
            // as a board that begins to step when its first byte comes
            self.offset_us = read_us as i64 - START_US as i64;
            self.next_us = Some(START_US);
        }
        u64::try_from(read_us as i64 - self.offset_us).unwrap_or(0)
    }

    /// Takes the steps that are due before bytes of this time.
    fn advance(&mut self, time_us: u64) {
        while let Some(step) = self.steps.pop_front_if(|step| step.time_us < time_us) {
            self.edges(&step);
            self.step(step.time_us, step.position_m);
        }
        while let Some(next_us) = self.next_us.filter(|next_us| *next_us < time_us) {
            self.step(next_us, None);
            self.next_us = Some(next_us + STEP_US);
        }
    }

    /// The edge since the last step, where UTC rests on edges.
    fn edges(&mut self, step: &ReportedStep) {
        let offset_us = (step.utc_us != 0).then(|| step.utc_us as i64 - step.time_us as i64);
        let before_us = std::mem::replace(&mut self.utc_offset_us, offset_us);
        let (Some(offset_us), Some(before_us)) = (offset_us, before_us) else { return };
        let since_us = step.utc_us % SECOND_US;
        if (offset_us - before_us).abs() <= STEADY_US && since_us < STEP_US {
            self.app.pps(step.time_us.saturating_sub(since_us));
            self.outcome.edges += 1;
        }
    }

    fn step(&mut self, time_us: u64, logged_m: Option<[f64; 2]>) {
        self.app.step(time_us);
        let outcome = &mut self.outcome;
        outcome.steps += 1;
        outcome.span_us = Some((outcome.span_us.map_or(time_us, |(first, _)| first), time_us));
        outcome.digest = self.app.digest();
        for port in Port::DEVICES {
            take(&mut self.app, port, usize::MAX);
        }
        let said = take(&mut self.app, Port::Host, usize::MAX);
        let mut said = said.as_slice();
        let mut replayed_m = None;
        while let Some(frame) = self.decoder.feed(&mut said) {
            if let Ok(FromBoard::Telemetry(record)) = frame.and_then(|frame| frame.message()) {
                replayed_m = reported_step(time_us, &record).position_m;
            }
        }
        match (logged_m, replayed_m) {
            (Some([x, y]), Some([a, b])) => outcome.distances_m.push((x - a).hypot(y - b)),
            (Some(_), None) | (None, Some(_)) if self.has_telemetry => outcome.unmatched += 1,
            _ => {}
        }
    }

    /// The session is at its end.
    pub fn finish(mut self) -> ApproximateReplay {
        self.next_us = None;
        self.advance(u64::MAX);
        self.outcome
    }
}
