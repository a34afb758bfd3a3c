//! Numbers of a drawn flight, and the text of a scenario that has them.

use hil_sim::rng::{Source, Stream};

/// Random numbers, written with as many digits as are meant.
pub struct Draw {
    stream: Stream,
    /// Length of the flight, s.
    pub duration_s: f64,
    /// How wrong the vehicle's file is.
    pub wrong_share: f64,
}

impl Draw {
    /// Those of a flight's seed.
    pub fn new(seed: u64) -> Self {
        Self::of(Stream::new(seed, Source::Study))
    }

    /// Those of a stream.
    pub fn of(stream: Stream) -> Self {
        Self { stream, duration_s: 0.0, wrong_share: 0.0 }
    }

    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        rounded(from + (to - from) * self.stream.uniform())
    }

    /// Log-uniform.
    pub fn size(&mut self, from: f64, to: f64) -> f64 {
        rounded(from * (to / from).powf(self.stream.uniform()))
    }

    /// Log-uniform, either sign.
    pub fn signed(&mut self, from: f64, to: f64) -> f64 {
        let sign = if self.stream.uniform() < 0.5 { -1.0 } else { 1.0 };
        sign * self.size(from, to)
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.stream.uniform() * count as f64) as usize).min(count - 1)
    }

    /// A time under way, s.
    pub fn during(&mut self) -> f64 {
        self.between(200.0, 0.7 * self.duration_s)
    }

    /// An effect by its numbers.
    pub fn effect(&mut self, name: &str, numbers: impl Fn(&mut Self) -> Vec<(&'static str, f64)>) -> String {
        format!("[effects.{name}]\n{}", table(&numbers(self)))
    }

    /// The environment's current by its numbers.
    pub fn current(&mut self, numbers: impl Fn(&mut Self) -> Vec<(&'static str, f64)>) -> String {
        format!("[environment.current]\n{}", table(&numbers(self)))
    }

    /// A fault from some time under way on, for minutes to hours.
    pub fn fault(&mut self, name: &str, numbers: impl Fn(&mut Self) -> String) -> String {
        let from_s = self.during();
        let until_s = rounded(from_s + self.size(60.0, self.duration_s.max(120.0)));
        format!("[[fault]]\nname = \"{name}\"\n{}\nfrom_s = {from_s}\nuntil_s = {until_s}\n", numbers(self))
    }

    /// A fault from the start to the end.
    pub fn lasting(&mut self, name: &str, numbers: impl Fn(&mut Self) -> String) -> String {
        format!("[[fault]]\nname = \"{name}\"\n{}\nfrom_s = 0\n", numbers(self))
    }
}

fn table(numbers: &[(&str, f64)]) -> String {
    numbers.iter().map(|(name, value)| format!("{name} = {value:?}\n")).collect()
}

/// Four digits.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
