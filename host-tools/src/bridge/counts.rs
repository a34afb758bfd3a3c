//! What one side has got and when, and what not.

use backseat_logs::stats::percentile;
use serde_json::{Value, json};
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Latencies that are kept, the last ones: of an hour and more.
const KEPT: usize = 100_000;

/// Counts of a side's messages.
#[derive(Default)]
pub struct Counts {
    sent: AtomicU64,
    dropped: AtomicU64,
    refused: AtomicU64,
    latencies_ms: Mutex<Vec<f64>>,
}

impl Counts {
    /// One message was sent, of bytes that arrived then; or it was dropped, because the side does not keep up.
    pub fn note(&self, sent: Option<Instant>) {
        let Some(arrived) = sent else {
            self.dropped.fetch_add(1, Ordering::Relaxed);
            return;
        };
        let latency_ms = arrived.elapsed().as_secs_f64() * 1e3;
        let place = self.sent.fetch_add(1, Ordering::Relaxed) as usize % KEPT;
        // a poisoned lock's data is whole: nothing panics while it is held
        let mut kept = self.latencies_ms.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.get_mut(place) {
            Some(oldest) => *oldest = latency_ms,
            None => kept.push(latency_ms),
        }
    }

    /// The other side sent what is not understood, or too much of it.
    pub fn refuse(&self) {
        self.refused.fetch_add(1, Ordering::Relaxed);
    }

    /// Sent, dropped, refused.
    pub fn read(&self) -> [u64; 3] {
        [&self.sent, &self.dropped, &self.refused].map(|count| count.load(Ordering::Relaxed))
    }

    /// Median, 95 % and maximum, ms.
    fn latency_ms(&self) -> Option<[f64; 3]> {
        let kept = self.latencies_ms.lock().unwrap_or_else(PoisonError::into_inner);
        let [median, most, longest] = [0.5, 0.95, 1.0].map(|share| percentile(&kept, share));
        Some([median?, most?, longest?])
    }

    /// As a JSON object.
    pub fn json(&self) -> Value {
        let [sent, dropped, refused] = self.read();
        let latency = self.latency_ms().map(|[median, p95, max]| json!({"median": median, "p95": p95, "max": max}));
        json!({"sent": sent, "dropped": dropped, "refused": refused, "latency_ms": latency})
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [sent, dropped, refused] = self.read();
        write!(f, "{sent} messages sent, {dropped} dropped, {refused} of the other side's refused")?;
        self.latency_ms().map_or(Ok(()), |[median, p95, max]| {
            write!(f, "; on their way {median:.1} ms (median; 95 % {p95:.1} ms, at most {max:.1} ms)")
        })
    }
}
