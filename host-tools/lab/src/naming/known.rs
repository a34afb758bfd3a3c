//! When a change could be known: the same flight over again, by somebody who is told cause, size and onset.

use super::draw::{Change, Drawn};
use crate::flights::fly_on;
use backseat_core::navigation::naming::{Cause, Named};
use backseat_link::{BackseatError, Client, Ports};
use backseat_wire::hostlink::Port;
use hil_sim::backseat::InProcess;
use hil_sim::environment::ONSET_S;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// The board has so long to name a change, s.
pub const NAMED_WITHIN_S: f64 = 1200.0;
/// A change is significant from so many sigmas on.
const SIGNIFICANT: f64 = 3.0;
/// It is told apart from the nearest other cause from so large odds on.
const SEPARATE_ODDS: f64 = 100.0;

/// From when on a change could be known.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Knowable {
    /// It is significant, s.
    pub significant_s: Option<f64>,
    /// And told apart from the nearest other cause, s.
    pub separable_s: Option<f64>,
    /// Sigmas and ln of the odds when that was known, at the latest when it is to be named, and that other cause.
    pub sigmas: f64,
    pub log_odds: f64,
    pub rival: u8,
}

impl Knowable {
    /// Until when it is to be named, s: so long after it is significant, if it is told apart by then.
    pub fn named_until_s(&self) -> Option<f64> {
        let until_s = self.significant_s? + NAMED_WITHIN_S;
        (self.separable_s? <= until_s).then_some(until_s)
    }
}

/// The board, looked at after each block, until no more is asked.
struct Watched<'a> {
    board: InProcess,
    cause: Cause,
    change: &'a Change,
    stop: &'a AtomicBool,
    onset_us: Option<u64>,
    last_us: u64,
    knowable: Knowable,
}

impl Watched<'_> {
    fn look(&mut self) {
        let begins_s = self.begins_s();
        let naming = self.board.naming();
        let newest_us = naming.statement().map_or(0, |statement| statement.time_us);
        if newest_us == self.last_us {
            return;
        }
        self.last_us = newest_us;
        let time_s = 1e-6 * newest_us as f64;
        match self.onset_us {
            // the block in which it began ends here: the onset stays as long as it is in use
            None if time_s >= begins_s => {
                let named = Named {
                    cause: self.cause,
                    size: self.change.size,
                    sigma: [0.0; 2],
                    since_us: newest_us,
                    probability: 1.0,
                    rival: None,
                };
                naming.follow(Some(&named));
                self.onset_us = Some(newest_us);
            }
            None => {}
            Some(onset_us) => self.weigh(onset_us, time_s),
        }
    }

    /// A current that sets in evenly moves the vehicle as far as one that is there at once from the middle on.
    fn begins_s(&self) -> f64 {
        let sets_in_s = if self.cause == Cause::CurrentChanged { ONSET_S } else { 0.0 };
        self.change.time_s + 0.5 * sets_in_s
    }

    fn weigh(&mut self, onset_us: u64, time_s: f64) {
        let Some(known) = self.board.naming().known(self.cause, self.change.size, onset_us) else { return };
        let own = &mut self.knowable;
        (own.sigmas, own.log_odds, own.rival) = (known.sigmas, known.log_odds, known.rival.number());
        if known.sigmas >= SIGNIFICANT {
            own.significant_s.get_or_insert(time_s);
            if known.log_odds >= SEPARATE_ODDS.ln() {
                own.separable_s.get_or_insert(time_s);
            }
            let is_late = own.significant_s.is_some_and(|since_s| time_s >= since_s + NAMED_WITHIN_S);
            self.stop.store(is_late || own.separable_s.is_some(), Ordering::Relaxed);
        }
    }
}

impl Ports for Watched<'_> {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.board.write(port, bytes)
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.board.read(port, received)?;
        self.look();
        Ok(())
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.board.poll(port, received)
    }
}

/// Flies it again, and weighs the first change.
///
/// # Errors
/// A flight that fails.
pub fn knowable(drawn: &Drawn) -> anyhow::Result<Option<Knowable>> {
    let found = drawn.changes.first().and_then(|change| Some((Cause::from_number(change.cause)?, change)));
    let Some((cause, change)) = found else { return Ok(None) };
    let (board, stop, knowable) = (InProcess::new(), &AtomicBool::new(false), Knowable::default());
    let mut client = Client::new(Watched { board, cause, change, stop, onset_us: None, last_us: 0, knowable });
    fly_on(&drawn.scenario, &mut client, &[], stop)?;
    Ok(Some(client.ports().knowable.clone()))
}
