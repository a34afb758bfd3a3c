//! Sentences of an emulated modem that wait for their time, and its clock.

use super::uart::Uart;
use backseat_wire::calendar::{DateTime, TimeOfDay};
use backseat_wire::modem::FromModem;
use backseat_wire::nmea::MAX_SENTENCE;
use std::collections::VecDeque;

/// What a modem has still to say, in order of time.
pub(super) struct Agenda {
    /// UTC of time zero, µs since 1970.
    pub(super) start_us: u64,
    sentences: VecDeque<(u64, Vec<u8>)>,
}

impl Agenda {
    pub(super) fn new(start_unix_s: u32) -> Self {
        Self { start_us: u64::from(start_unix_s) * 1_000_000, sentences: VecDeque::new() }
    }

    /// When the next sentence is due, µs.
    pub(super) fn next_us(&self) -> Option<u64> {
        self.sentences.front().map(|(time_us, _)| *time_us)
    }

    /// Sends what is due up to `now_us`.
    pub(super) fn run(&mut self, now_us: u64, transmitter: &mut Uart) {
        while let Some((time_us, bytes)) = self.sentences.pop_front_if(|(time_us, _)| *time_us <= now_us) {
            transmitter.send(time_us, &bytes);
        }
    }

    /// Says a sentence at `time_us`.
    pub(super) fn say(&mut self, time_us: u64, sentence: &FromModem<'_>) {
        let mut buffer = [0; MAX_SENTENCE];
        if let Ok(bytes) = sentence.emit(&mut buffer) {
            let place = self.sentences.partition_point(|(due_us, _)| *due_us <= time_us);
            self.sentences.insert(place, (time_us, bytes.to_vec()));
        }
    }

    pub(super) fn date_time(&self, time_us: u64) -> DateTime {
        // A scenario starts before the year 2106 and lasts days at most.
        DateTime::from_unix_us(self.start_us + time_us).expect("a date before 2400")
    }

    pub(super) fn time_of_day(&self, time_us: u64) -> TimeOfDay {
        TimeOfDay::from_us(self.start_us + time_us)
    }
}
