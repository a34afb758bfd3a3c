//! What comes back: a mission for the board, its start, its stop, as `backseat mission` does them; what a helm wants.

use super::helm::{LastOrder, Order, Wish};
use crate::mission;
use backseat_analysis::mission_file;
use backseat_link::board::{Board, PortName};
use backseat_wire::ship_state::Key;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Longest text that is looked at, bytes: the longest mission of a board is a tenth of it.
const LONGEST: usize = 65_536;
/// As many wait while one is carried out.
const QUEUE: usize = 4;
/// How often an order of a helm is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// The board took an order so short a time ago that its helm steers: it holds for two seconds and is asked for twice a
/// second.
const STEERS: Duration = Duration::from_secs(4);

/// Where the sides hand in what they are asked.
#[derive(Clone)]
pub struct Commands {
    asked: SyncSender<(&'static str, String)>,
    orders: LastOrder,
}

impl Commands {
    /// Carries them out one after the other, through the port that the bridge keeps for other commands, signed by the
    /// key. What became of each comes out of the receiver; of a helm's orders a refusal, once until it is another.
    pub fn open(port: PortName, key: Key) -> (Self, Receiver<String>) {
        let (queue, asked) = sync_channel::<(&str, String)>(QUEUE);
        let (answers, answered) = sync_channel(QUEUE);
        let orders = LastOrder::default();
        let own = orders.clone();
        std::thread::spawn(move || {
            let refused = |error: anyhow::Error| format!("refused: {error:#}");
            let (mut last, mut held) = (None, None);
            loop {
                let (side, answer) = match asked.recv_timeout(LOOK) {
                    Ok((side, text)) => (side, carry_out(&port, key, &text).unwrap_or_else(refused)),
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => {
                        let Some(order) = own.take() else { continue };
                        let answer = steer(&port, key, order.wish, &mut held).unwrap_or_else(|why| Some(refused(why)));
                        if last == answer {
                            continue;
                        }
                        last.clone_from(&answer);
                        let Some(answer) = answer else { continue };
                        ("MOOS", answer)
                    }
                };
                eprintln!("bridge: asked by {side}: {answer}");
                if answers.send(answer).is_err() {
                    return;
                }
            }
        });
        (Self { asked: queue, orders }, answered)
    }

    /// For tests: what is handed in comes out of the receiver.
    #[cfg(test)]
    pub fn kept() -> (Self, Receiver<(&'static str, String)>) {
        let (queue, asked) = sync_channel(QUEUE);
        (Self { asked: queue, orders: LastOrder::default() }, asked)
    }

    /// For tests: the order that waits.
    #[cfg(test)]
    pub fn order(&self) -> Option<Order> {
        self.orders.take()
    }

    /// Whether it is taken: `start`, `stop`, or the text of a mission file.
    #[must_use]
    pub fn offer(&self, side: &'static str, text: &[u8]) -> bool {
        let text = str::from_utf8(text).ok().filter(|text| text.len() <= LONGEST);
        text.is_some_and(|text| self.asked.try_send((side, text.to_owned())).is_ok())
    }

    /// What a helm wants now; what it wanted before counts no more.
    pub fn steer(&self, order: Order) {
        self.orders.set(order);
    }
}

/// Asks the board for what a helm wants; what there is to say. `held`: when it last took something to hold.
fn steer(port: &PortName, key: Key, wish: Wish, held: &mut Option<Instant>) -> anyhow::Result<Option<String>> {
    match wish {
        Wish::Hold { heading_rad, depth_m, speed_mps } => {
            Board::connect(port, key)?.helm(heading_rad, depth_m, speed_mps)?;
            *held = Some(Instant::now());
            Ok(None)
        }
        // the zero of a helm that does not steer, as it posts it before it is engaged, is none
        Wish::Stop if held.is_none_or(|at| at.elapsed() > STEERS) => Ok(None),
        Wish::Stop => {
            Board::connect(port, key)?.stop_mission()?;
            *held = None;
            Ok(Some("stopped: the helm's speed is zero".to_owned()))
        }
    }
}

fn carry_out(port: &PortName, key: Key, text: &str) -> anyhow::Result<String> {
    let connect = || Board::connect(port, key);
    match text.trim() {
        "start" => connect()?.start_mission().map(|()| "started".to_owned()),
        "stop" => connect()?.stop_mission().map(|()| "stopped".to_owned()),
        _ => {
            let stored = mission_file::parse(text, Path::new("mission"))?;
            let warnings = mission::put(&mut connect()?, &stored)?;
            let warnings: String = warnings.iter().map(|warning| format!("; warning: {warning}")).collect();
            Ok(format!("stored: {} waypoints{warnings}", stored.waypoints.len()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_long_no_text_or_too_much_is_not_taken() {
        let (commands, asked) = Commands::kept();
        assert!(!commands.offer("MOOS", &vec![b' '; LONGEST + 1]));
        assert!(!commands.offer("MOOS", b"\xFFstart"));
        assert_eq!((0..10).filter(|_| commands.offer("MOOS", b"start")).count(), QUEUE);
        assert_eq!(asked.recv().unwrap(), ("MOOS", "start".to_owned()));
    }
}
