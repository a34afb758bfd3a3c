//! `--to`: what the board's ports received, to real or virtual ports.

use crate::record::NamedDevice;
use anyhow::{Context, anyhow, bail};
use backseat_logs::session::{Entry, Event, Reader};
use backseat_report::Report;
use backseat_report::console::Progress;
use backseat_wire::hostlink::Port;
use serde_json::json;
use serialport::{SerialPort, TTYPort};
use std::io::Write;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// A port that takes nothing for this long is given up.
const PATIENCE: Duration = Duration::from_secs(10);
/// Chunks that may wait for a port.
const QUEUE: usize = 1024;
/// All ports are open and their threads wait when the first byte is due.
const LEAD: Duration = Duration::from_millis(200);

/// What a port took, and how late.
#[derive(Clone, Debug)]
pub struct Played {
    pub port: Port,
    pub path: String,
    pub bytes: usize,
    /// From due to handed over, each chunk, sorted, µs; empty unless played at their times.
    pub late_us: Vec<u64>,
}

impl Played {
    /// Lateness that a share of all chunks keeps within, ms.
    pub fn late_ms(&self, share: f64) -> Option<f64> {
        let last = self.late_us.len().checked_sub(1)?;
        Some(self.late_us[(share * last as f64).round() as usize] as f64 * 1e-3)
    }
}

/// What all ports took.
pub fn report(played: &[Played], wall: Duration) -> Report {
    let ports: Vec<_> = played
        .iter()
        .map(|port| {
            json!({
                "port": port.port.name(),
                "path": port.path,
                "bytes": port.bytes,
                "late_ms": {"p50": port.late_ms(0.5), "p99": port.late_ms(0.99), "max": port.late_ms(1.0)},
            })
        })
        .collect();
    let wall_s = wall.as_secs_f64();
    let report =
        Report::new("A session played", format!("{wall_s:.1} s")).value("wall_s", wall_s).value("ports", ports);
    played.iter().fold(report, |report, port| {
        let mut text = format!("{} bytes to {}", port.bytes, port.path);
        if let (Some(p99), Some(max)) = (port.late_ms(0.99), port.late_ms(1.0)) {
            let pieces = port.late_us.len();
            text += &format!(" in {pieces} pieces, late by {p99:.3} ms (99 %), {max:.3} ms (max)");
        }
        report.fact(port.port.name(), text)
    })
}

/// Bytes, and when they are due.
type Chunk = (Option<Instant>, Vec<u8>);

/// Plays a session to these ports; how long it took.
pub fn play(log: &Path, targets: &[NamedDevice], realtime: bool) -> anyhow::Result<(Vec<Played>, Duration)> {
    let mut lines: Vec<PlayedLine> = Vec::new();
    for target in targets {
        if lines.iter().any(|line| line.port == target.port) {
            bail!("{}: given twice", target.port.name());
        }
        lines.push(PlayedLine::open(target)?);
    }
    let mut reader = Reader::open(log)?;
    let progress = Progress::new("replay", reader.position().1 as usize);
    let start = Instant::now() + LEAD;
    let mut timeline = Timeline::default();
    while let Some(entry) = reader.next() {
        let Entry { time_us, event } = entry?;
        let Event::Received { port, bytes } = event else { continue };
        let Some(line) = lines.iter().find(|line| line.port == port) else { continue };
        let due = start + timeline.advance(time_us);
        progress.set(reader.position().0 as usize);
        if line.queue.send((realtime.then_some(due), bytes)).is_err() {
            break; // its thread says why
        }
    }
    let played = lines.into_iter().map(PlayedLine::finish).collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(played) = played.iter().find(|played| played.bytes == 0) {
        bail!("{}: nothing to the board's {} port is in it", log.display(), played.port.name());
    }
    Ok((played, start.elapsed()))
}

/// Times of a session since its first bytes; a clock that goes back starts anew from where it was.
#[derive(Default)]
struct Timeline {
    last_us: Option<u64>,
    elapsed_us: u64,
}

impl Timeline {
    fn advance(&mut self, time_us: u64) -> Duration {
        let last_us = self.last_us.replace(time_us).unwrap_or(time_us);
        self.elapsed_us += time_us.saturating_sub(last_us);
        Duration::from_micros(self.elapsed_us)
    }
}

/// A port with a thread of its own, so that a slow one does not delay the others.
struct PlayedLine {
    port: Port,
    queue: SyncSender<Chunk>,
    thread: JoinHandle<anyhow::Result<Played>>,
}

impl PlayedLine {
    fn open(target: &NamedDevice) -> anyhow::Result<Self> {
        let (port, path) = (target.port, target.device.to_string());
        let mut device = target.open()?;
        device.set_timeout(PATIENCE).with_context(|| path.clone())?;
        let (queue, chunks) = sync_channel(QUEUE);
        let thread =
            thread::spawn(move || carry(device, &chunks, Played { port, path, bytes: 0, late_us: Vec::new() }));
        Ok(Self { port, queue, thread })
    }

    fn finish(self) -> anyhow::Result<Played> {
        drop(self.queue);
        self.thread.join().map_err(|_| anyhow!("{}: its thread failed", self.port.name()))?
    }
}

fn carry(mut device: TTYPort, chunks: &Receiver<Chunk>, mut played: Played) -> anyhow::Result<Played> {
    let failed = |path: &str| format!("{path}: takes no more bytes");
    for (due, bytes) in chunks {
        if let Some(due) = due {
            thread::sleep(due.saturating_duration_since(Instant::now()));
            let late = Instant::now().saturating_duration_since(due);
            played.late_us.push(u64::try_from(late.as_micros()).unwrap_or(u64::MAX));
        }
        device.write_all(&bytes).with_context(|| failed(&played.path))?;
        played.bytes += bytes.len();
    }
    device.flush().with_context(|| failed(&played.path))?;
    played.late_us.sort_unstable();
    Ok(played)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_goes_back_goes_on() {
        let mut timeline = Timeline::default();
        let times: Vec<u128> = [5, 7, 7, 1, 4].map(|us| timeline.advance(us).as_micros()).to_vec();
        assert_eq!(times, [0, 2, 2, 2, 5]);
    }
}
