//! The whole app behind its pump.

use crate::feed::{self, Frames};
use crate::measure::count;
use crate::row;
use backseat_app::{App, Progress, Pump, STEP_US};
use backseat_wire::hostlink::Port;
use core::convert::Infallible;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

/// A port with bytes waiting; what is written to it is gone.
struct Memory<'a>(&'a [u8]);

impl ErrorType for Memory<'_> {
    type Error = Infallible;
}

impl ReadReady for Memory<'_> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.is_empty())
    }
}

impl Read for Memory<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let (now, later) = self.0.split_at(buffer.len().min(self.0.len()));
        buffer[..now.len()].copy_from_slice(now);
        self.0 = later;
        Ok(now.len())
    }
}

impl WriteReady for Memory<'_> {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}

impl Write for Memory<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A hundred seconds with everything switched on: the dearest cycle under way, and the first one.
pub fn measure(app: &mut App, pump: &mut Pump, frames: &mut Frames) {
    let everything = [
        ("app.use_dvl", 1.0),
        ("app.use_water_track", 1.0),
        ("app.use_range_rate", 1.0),
        ("app.control_law", 2.0),
        ("app.adapt", 1.0),
        // nobody obeys the commands here: that ends no mission, and no sensor is suspect for it
        ("app.refusal_timeout_s", 120.0),
        ("app.gate_sigma", 1000.0),
    ];
    let commit = count(|| feed::set(app, &everything)).1;
    let (mut first, mut worst, mut worst_step, mut sum, mut steps) = (0, 0, 0, 0, 0);
    for k in 0..=feed::WORST_STEP {
        if k == feed::START_STEP {
            feed::start(app);
        }
        frames.prepare(k);
        let now_us = k * STEP_US;
        let instructions = count(|| cycle(app, pump, frames, k, now_us)).1;
        if app.stepped_us().is_none() {
            continue;
        }
        if first == 0 {
            first = instructions;
            continue;
        }
        (sum, steps) = (sum + instructions, steps + 1);
        if instructions > worst {
            (worst, worst_step) = (instructions, k as usize);
        }
    }
    // the voyage is one: navigation ran, and the mission
    assert!(app.is_under_way() && app.digest() != 0);
    row("cycle", "worst", worst_step, 0, worst, 0);
    row("cycle", "mean", 0, 0, sum / steps, 0);
    row("cycle", "first", 0, 0, first, 0);
    row("cycle", "commit", 0, 0, commit, 0);
}

fn cycle(app: &mut App, pump: &mut Pump, frames: &Frames, k: u64, now_us: u64) {
    if k.is_multiple_of(10) {
        app.pps(now_us);
    }
    let mut ports = Port::ALL.map(|port| Memory(frames.port(port)));
    while let Ok(Progress::Moved) = pump.poll(app, &mut ports, now_us) {}
}
