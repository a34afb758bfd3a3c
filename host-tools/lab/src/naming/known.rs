//! When a change could be known: the same flight over again, by somebody who is told cause, size and onset.

use super::draw::{Change, Drawn};
use crate::flights::fly_on;
use backseat_core::navigation::naming::{Cause, Named, Naming};
use backseat_link::{BackseatError, Client, Ports};
use backseat_wire::hostlink::Port;
use hil_sim::backseat::InProcess;
use serde::{Deserialize, Serialize};

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
    /// Sigmas and ln of the odds at the end, and that other cause.
    pub sigmas: f64,
    pub log_odds: f64,
    pub rival: u8,
}

/// The board, looked at after each block.
struct Watched {
    board: InProcess,
    cause: Cause,
    change: Change,
    onset_us: Option<u64>,
    last_us: u64,
    knowable: Knowable,
}

impl Watched {
    fn look(&mut self) {
        let naming = self.board.naming();
        let newest_us = naming.statement().map_or(0, |statement| statement.time_us);
        if newest_us == self.last_us {
            return;
        }
        self.last_us = newest_us;
        let time_s = 1e-6 * newest_us as f64;
        match self.onset_us {
            // the block in which it began ends here: the onset stays as long as it is in use
            None if time_s >= self.change.time_s => {
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

    fn weigh(&mut self, onset_us: u64, time_s: f64) {
        let Some(known) = self.board.naming().known(self.cause, self.change.size, onset_us) else { return };
        let own = &mut self.knowable;
        (own.sigmas, own.log_odds, own.rival) = (known.sigmas, known.log_odds, known.rival.number());
        if known.sigmas >= SIGNIFICANT {
            own.significant_s.get_or_insert(time_s);
            if known.log_odds >= SEPARATE_ODDS.ln() {
                own.separable_s.get_or_insert(time_s);
            }
        }
    }
}

impl Ports for Watched {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.board.write(port, bytes)
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.board.read(port, received)
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.board.poll(port, received)?;
        self.look();
        Ok(())
    }
}

/// Flies it again, and weighs the first change.
///
/// # Errors
/// A flight that fails.
pub fn knowable(drawn: &Drawn) -> anyhow::Result<Option<Knowable>> {
    let found = drawn.changes.first().and_then(|change| Some((Cause::from_number(change.cause)?, change)));
    let Some((cause, change)) = found else { return Ok(None) };
    let (change, knowable) = (change.clone(), Knowable::default());
    let board = Watched { board: InProcess::new(), cause, change, onset_us: None, last_us: 0, knowable };
    let mut client = Client::new(board);
    fly_on(&drawn.scenario, &mut client, &[])?;
    Ok(Some(client.ports().knowable.clone()))
}
