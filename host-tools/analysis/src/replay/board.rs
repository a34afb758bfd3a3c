//! The app as on its board: started, fed and drained as in the session.

use super::compare::{Comparison, Difference};
use super::survey::{Stored, Survey};
use crate::duration::exact_s;
use anyhow::{anyhow, bail};
use backseat_app::parameters::{self, PARAMETER_SCHEMA, PARAMETERS, Settings};
use backseat_app::store::{Response, RestartRecord};
use backseat_app::{App, COMMIT};
use backseat_logs::session::{Entry, Event};
use backseat_wire::hostlink::{ImageId, MAX_FRAME, Port, Restart, ToBoard, encode};
use std::collections::VecDeque;

/// A board that is replayed to the bit.
pub struct Replay {
    app: Box<App>,
    /// The start, still to be done: parameters come first.
    starting: Option<(Restart, Response)>,
    stored: VecDeque<Stored>,
    lockstep: bool,
    /// Sent by the board, by the log, since the last input: a step's bytes stand before the step.
    sent: Vec<(u64, Port, Vec<u8>)>,
    comparison: Comparison,
    comparing: bool,
    /// The lock-step clock was set to zero: what comes before its first answer may be from before.
    settling: bool,
    time_us: u64,
    /// What is added to the board's time, which begins again with each start, to have the session's, µs.
    shift_us: i64,
    pub outcome: ExactReplay,
}

/// What came of it.
#[derive(Debug, Default)]
pub struct ExactReplay {
    pub steps: usize,
    /// Steps whose digest is another.
    pub differing_steps: usize,
    /// First and last step, time of the session, µs.
    pub span_us: Option<(u64, u64)>,
    pub digest: u64,
    pub bytes: usize,
    pub messages: usize,
    /// The first step after which filter state and covariance are not the same.
    pub step: Option<Difference>,
    /// The first thing the board sent that is not the same.
    pub record: Option<Difference>,
    pub notes: Vec<String>,
}

impl Replay {
    /// A fresh board.
    pub fn new(survey: &Survey) -> Self {
        let mut replay = Self {
            app: Box::new(App::new()),
            starting: None,
            stored: survey.stored.clone(),
            lockstep: survey.lockstep,
            sent: Vec::new(),
            comparison: Comparison::default(),
            // until its clock is set to zero a board may have run on its own
            comparing: !survey.lockstep,
            settling: false,
            time_us: 0,
            shift_us: 0,
            outcome: ExactReplay::default(),
        };
        if !replay.stored.is_empty() {
            replay.app.restore(None);
        }
        if survey.has_key {
            let note = "the board had a key, which no log holds: packets and requests that it refused as forged are \
                        taken here, and an abort is not heeded";
            replay.outcome.notes.push(note.to_owned());
        }
        replay
    }

    /// Takes the log's next entry, and where it stands in the session, µs.
    pub fn take(&mut self, entry: Entry, placed_us: u64) -> anyhow::Result<()> {
        let Entry { time_us, event } = entry;
        if let Event::Start { firmware, parameter_schema, image, restart, record } = &event {
            // ends what was before it, by the time of that
            self.start((firmware, *image), *parameter_schema, *restart, record)?;
        }
        self.shift_us = placed_us as i64 - time_us as i64;
        match event {
            Event::Start { .. } => {}
            Event::Parameters(values) => self.parameters(&values)?,
            Event::Received { port, bytes } => {
                self.input(time_us);
                self.app.receive(port, time_us, &bytes);
                // the clock's message: its steps are in the log
                self.app.take_announced();
                self.acted(time_us);
            }
            Event::Sent { port, bytes } if self.lockstep => {
                if self.comparing {
                    self.comparison.logged(port, self.placed_us(self.time_us), &bytes);
                }
            }
            Event::Sent { port, bytes } => self.sent.push((time_us, port, bytes)),
            Event::Edge => {
                self.input(time_us);
                self.app.pps(time_us);
            }
            Event::Oscillator(oscillator) => self.app.set_oscillator(oscillator),
            Event::Fittings(readings) => self.app.fittings(readings),
            Event::Restart => {
                self.input(time_us);
                self.discard();
                self.app.restart();
                (self.comparing, self.settling) = (false, true);
            }
            Event::Step { digest } => self.step(time_us, digest),
            Event::Note(_) => {}
            Event::Lost(records) => self.hole(&format!("{records} records are missing")),
        }
        Ok(())
    }

    fn start(
        &mut self,
        (firmware, image): (&str, ImageId),
        schema: u16,
        restart: Restart,
        record: &[u8],
    ) -> anyhow::Result<()> {
        if schema != PARAMETER_SCHEMA {
            bail!("the board had version {schema} of the parameter list; this program has {PARAMETER_SCHEMA}");
        }
        if firmware != env!("CARGO_PKG_VERSION") {
            let note = format!("the board had firmware {firmware}; this program has {}", env!("CARGO_PKG_VERSION"));
            self.outcome.notes.push(note);
        }
        if ![COMMIT, 0].contains(&image.commit) {
            let program = ImageId { commit: COMMIT, ..ImageId::default() };
            self.outcome.notes.push(format!("the board had another release: {image}; this program is {program}"));
        }
        if self.lockstep {
            // a simulator resets its board under way: what was sent until now is complete
            self.input(self.time_us);
            self.comparison.start_again(self.placed_us(self.time_us));
        }
        self.time_us = 0;
        *self.app = App::new();
        // the board has a memory for parameters
        self.app.restore(None);
        self.sent.clear();
        let last = RestartRecord::decode(record);
        let (response, _) = RestartRecord::respond(restart.cause, last.as_ref());
        self.starting = Some((restart, response));
        Ok(())
    }

    /// Makes `values` the active set, the way the board came to it.
    fn parameters(&mut self, values: &[(String, f64)]) -> anyhow::Result<()> {
        let wanted = settings(values)?;
        if self.starting.is_some() {
            if !self.app.restore(Some(&wanted)) {
                bail!("its parameters make no valid set");
            }
            return Ok(());
        }
        let active = self.app.parameters();
        let changed: Vec<_> = PARAMETERS.iter().filter(|p| p.get(&wanted) != p.get(active)).collect();
        if changed.is_empty() {
            return Ok(());
        }
        self.input(self.time_us);
        let sets = changed.iter().map(|p| ToBoard::ParameterSet { name: p.name, value: p.get(&wanted) });
        for request in
            [ToBoard::Unlock, ToBoard::ParameterBegin].into_iter().chain(sets).chain([ToBoard::ParameterCommit])
        {
            let mut buffer = [0; MAX_FRAME];
            let frame = encode(&request, &mut buffer).map_err(|error| anyhow!("{error:?}"))?;
            self.app.receive(Port::Host, self.time_us, frame);
            // these answers were not asked for
            self.discard();
        }
        if *self.app.parameters() != wanted {
            bail!("its parameters make no valid set");
        }
        Ok(())
    }

    fn step(&mut self, time_us: u64, digest: u64) {
        self.begin();
        self.settled();
        let (before, after) = std::mem::take(&mut self.sent).into_iter().partition(|(us, ..)| *us < time_us);
        self.settle(before);
        self.time_us = time_us;
        self.app.step(time_us);
        let placed_us = self.placed_us(time_us);
        let outcome = &mut self.outcome;
        outcome.steps += 1;
        outcome.span_us = Some((outcome.span_us.map_or(placed_us, |(first, _)| first.min(placed_us)), placed_us));
        outcome.digest = self.app.digest();
        if self.comparing && self.app.digest() != digest {
            outcome.differing_steps += 1;
            outcome.step.get_or_insert_with(|| Difference {
                t_s: exact_s(placed_us),
                record: "step".to_owned(),
                field: "digest of state and covariance".to_owned(),
                logged: format!("{digest:016x}"),
                replayed: format!("{:016x}", outcome.digest),
            });
        }
        self.acted(time_us);
        self.settle(after);
    }

    /// Before anything goes in: what the board sent until now, the app has to have sent.
    fn input(&mut self, time_us: u64) {
        self.begin();
        self.settled();
        let sent = std::mem::take(&mut self.sent);
        self.settle(sent);
        self.time_us = self.time_us.max(time_us);
    }

    /// A time of the board as that of the session, which goes on over its starts, µs.
    fn placed_us(&self, time_us: u64) -> u64 {
        time_us.saturating_add_signed(self.shift_us)
    }

    fn settled(&mut self) {
        if self.settling && self.app.stepped_us().is_some() {
            (self.comparing, self.settling) = (true, false);
        }
    }

    fn begin(&mut self) {
        if let Some((restart, response)) = self.starting.take() {
            self.app.resume(restart, &response);
        }
    }

    /// After an input: what the board's memory did, and in lock-step, where ports take all at once, what the app sends.
    fn acted(&mut self, time_us: u64) {
        if let Some(Stored { after_us, kept }) = self.stored.front().copied()
            && self.app.to_store().is_some()
            && after_us == self.app.stepped_us()
        {
            self.stored.pop_front();
            self.app.stored(kept);
        }
        if self.lockstep {
            for port in Port::ALL {
                let bytes = take(&mut self.app, port, usize::MAX);
                if self.comparing {
                    self.comparison.replayed(port, self.placed_us(time_us), &bytes);
                }
            }
        }
    }

    /// The ports took so many bytes: a full ring drops what it dropped on the board.
    fn settle(&mut self, sent: Vec<(u64, Port, Vec<u8>)>) {
        for (time_us, port, bytes) in sent {
            let replayed = take(&mut self.app, port, bytes.len());
            if self.comparing {
                let placed_us = self.placed_us(time_us);
                self.comparison.logged(port, placed_us, &bytes);
                self.comparison.replayed(port, placed_us, &replayed);
            }
        }
    }

    fn discard(&mut self) {
        for port in Port::ALL {
            take(&mut self.app, port, usize::MAX);
        }
    }

    /// From here on the log is not what the app was fed.
    pub fn hole(&mut self, why: &str) {
        let compared = std::mem::take(&mut self.comparing) || std::mem::take(&mut self.settling);
        if compared {
            self.outcome.notes.push(format!("compared up to {} s: {why}", exact_s(self.placed_us(self.time_us))));
        }
    }

    /// The log is at its end.
    pub fn finish(mut self) -> ExactReplay {
        self.input(self.time_us);
        if self.comparing {
            self.comparison.finish(self.placed_us(self.time_us));
        }
        let Comparison { bytes, messages, losses, difference, .. } = self.comparison;
        if losses > 0 {
            self.outcome.notes.push(format!("the board reports {losses} times that its drivers lost received bytes"));
        }
        ExactReplay { bytes, messages, record: difference, ..self.outcome }
    }
}

/// Takes up to `limit` bytes that wait for a port.
pub fn take(app: &mut App, port: Port, limit: usize) -> Vec<u8> {
    let mut taken = Vec::new();
    while taken.len() < limit && !app.transmit(port).is_empty() {
        let waiting = app.transmit(port);
        let count = waiting.len().min(limit - taken.len());
        taken.extend_from_slice(&waiting[..count]);
        app.transmitted(port, count);
    }
    taken
}

/// A set from its values by name; what is not named has its default.
pub fn settings(values: &[(String, f64)]) -> anyhow::Result<Settings> {
    let mut settings = Settings::DEFAULT;
    for (name, value) in values {
        let parameter = parameters::find(name).ok_or_else(|| anyhow!("{name}: this program has no such parameter"))?;
        if !(parameter.min..=parameter.max).contains(value) {
            bail!("{name} = {value}: expected {} to {}", parameter.min, parameter.max);
        }
        parameter.set(&mut settings, *value);
    }
    Ok(settings)
}
