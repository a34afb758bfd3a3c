//! Faults of a serial line: frames lost, repeated, reordered, late, damaged; lines silent or babbling.
//!
//! A frame is what a device sends at once. Nothing here makes a line faster than it is: copies and garbage that would
//! not fit between two frames at the line's speed are not sent.

use super::{Active, Damage, Direction, Fault, FaultKind, active};
use backseat_link::Arrival;
use backseat_wire::hostlink::Port;
use std::collections::VecDeque;

/// One direction of a line.
#[derive(Clone, Debug)]
pub struct FaultyLine {
    faults: Vec<Active<Damage>>,
    /// Time of one byte on the wire, µs.
    byte_us: f64,
    /// The line is busy with what was not sent by the device until then, µs.
    busy_until_us: u64,
    /// A frame that waits for the next, to go after it.
    held: Option<Arrival>,
    /// Late frames, in order of their new time.
    late: VecDeque<Arrival>,
}

impl FaultyLine {
    /// The line of `port` in one direction.
    pub fn new(faults: &[Fault], seed: u64, port: Port, direction: Direction, baud: u32) -> Self {
        let pick = |kind: &FaultKind| match *kind {
            FaultKind::Line { port: of, direction: way, damage }
                if of == port && (way == direction || way == Direction::Both) =>
            {
                Some(damage)
            }
            _ => None,
        };
        Self {
            faults: active(faults, seed, pick),
            byte_us: 1e7 / f64::from(baud),
            busy_until_us: 0,
            held: None,
            late: VecDeque::new(),
        }
    }

    /// What becomes of frames that arrive in this order up to `until_us`.
    pub fn pass(&mut self, frames: Vec<Arrival>, until_us: u64) -> Vec<Arrival> {
        if self.faults.is_empty() {
            return frames;
        }
        let mut out = Vec::new();
        for frame in frames {
            self.frame(frame, &mut out);
        }
        while self.late.front().is_some_and(|frame| frame.time_us <= until_us) {
            out.extend(self.late.pop_front());
        }
        out.sort_by_key(|frame| frame.time_us);
        out
    }

    fn frame(&mut self, mut frame: Arrival, out: &mut Vec<Arrival>) {
        let time_us = frame.time_us;
        let mut copies = 0;
        let mut garbage = 0;
        let mut hold = false;
        let mut delay_us = 0;
        for Active { what, fault, random } in &mut self.faults {
            if !fault.acts(time_us) {
                continue;
            }
            let mut hit = |share: f64| random.uniform() < share;
            match *what {
                Damage::Lost { share } if hit(share) => return,
                Damage::Silent => return,
                Damage::Repeated { share } if hit(share) => copies += 1,
                Damage::Reordered { share } => hold |= hit(share),
                Damage::Late { share, delay_us: by_us } if hit(share) => delay_us += by_us,
                Damage::BitFlipped { share } if hit(share) => {
                    let bit = (random.uniform() * 8.0 * frame.bytes.len() as f64) as usize;
                    if let Some(byte) = frame.bytes.get_mut(bit / 8) {
                        *byte ^= 1 << (bit % 8);
                    }
                }
                Damage::Truncated { share } if hit(share) => {
                    let length = (random.uniform() * frame.bytes.len() as f64) as usize;
                    frame.bytes.truncate(length);
                }
                Damage::Babbling { factor } => copies += factor.saturating_sub(1),
                Damage::Garbage { factor } => garbage += factor as usize * frame.bytes.len(),
                _ => {}
            }
        }
        if frame.bytes.is_empty() {
            return;
        }
        if delay_us > 0 {
            frame.time_us += delay_us;
            let place = self.late.partition_point(|other| other.time_us <= frame.time_us);
            self.late.insert(place, frame);
            return;
        }
        if hold && self.held.is_none() {
            self.held = Some(frame);
            return;
        }
        self.crowd(&frame, copies, garbage, out);
        out.push(frame);
        if let Some(held) = self.held.take() {
            out.push(Arrival { time_us, ..held });
        }
    }

    /// Copies and garbage that fit on the line before `frame`, from the last one on.
    fn crowd(&mut self, frame: &Arrival, copies: u32, garbage: usize, out: &mut Vec<Arrival>) {
        let begun_us = frame.time_us.saturating_sub((self.byte_us * frame.bytes.len() as f64) as u64);
        // A silent line has no room to catch up: at most half a second of chatter between two frames.
        let mut at_us = self.busy_until_us.max(begun_us.saturating_sub(500_000)) as f64;
        let room = |at_us: f64, length: usize| at_us + self.byte_us * length as f64 <= begun_us as f64;
        for _ in 0..copies {
            if !room(at_us, frame.bytes.len()) {
                break;
            }
            at_us += self.byte_us * frame.bytes.len() as f64;
            out.push(Arrival { time_us: at_us as u64, bytes: frame.bytes.clone() });
        }
        let length = garbage.min(((begun_us as f64 - at_us).max(0.0) / self.byte_us) as usize);
        if length > 0
            && let Some(Active { random, .. }) =
                self.faults.iter_mut().find(|active| matches!(active.what, Damage::Garbage { .. }))
        {
            let bytes = (0..length).map(|_| (random.uniform() * 256.0) as u8).collect();
            at_us += self.byte_us * length as f64;
            out.push(Arrival { time_us: at_us as u64, bytes });
        }
        self.busy_until_us = frame.time_us;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(damage: Damage) -> FaultyLine {
        let kind = FaultKind::Line { port: Port::Dvl, direction: Direction::ToBackseat, damage };
        let fault = Fault { kind, from_us: 1_000_000, until_us: 2_000_000, text: String::new() };
        FaultyLine::new(&[fault], 1, Port::Dvl, Direction::ToBackseat, 10_000) // 1 ms a byte
    }

    fn frame(time_us: u64, byte: u8) -> Arrival {
        Arrival { time_us, bytes: vec![byte; 10] }
    }

    /// Ten frames, 100 ms apart, from one second on.
    fn pass(damage: Damage) -> Vec<Arrival> {
        let frames = (0..10_u8).map(|i| frame(1_000_000 + 100_000 * u64::from(i), i)).collect();
        line(damage).pass(frames, 10_000_000)
    }

    #[test]
    fn each_damage_does_what_it_says_and_only_in_its_time() {
        assert!(pass(Damage::Silent).is_empty() && pass(Damage::Lost { share: 1.0 }).is_empty());
        assert_eq!(pass(Damage::Lost { share: 0.0 }).len(), 10);
        assert_eq!(pass(Damage::Repeated { share: 1.0 }).len(), 20);
        let order: Vec<u8> = pass(Damage::Reordered { share: 1.0 }).iter().map(|frame| frame.bytes[0]).collect();
        assert_eq!(order, [1, 0, 3, 2, 5, 4, 7, 6, 9, 8]);
        let late = pass(Damage::Late { share: 1.0, delay_us: 70_000 });
        assert_eq!((late.len(), late[0].time_us), (10, 1_070_000));
        for (i, flipped) in (0..).zip(pass(Damage::BitFlipped { share: 1.0 })) {
            assert_eq!(flipped.bytes.iter().map(|byte| (byte ^ i as u8).count_ones()).sum::<u32>(), 1);
        }
        assert!(pass(Damage::Truncated { share: 1.0 }).iter().all(|frame| frame.bytes.len() < 10));
        let mut silent = line(Damage::Silent);
        assert_eq!(silent.pass(vec![frame(999_999, 0), frame(1_000_000, 1), frame(2_000_000, 2)], 3_000_000).len(), 2);
    }

    /// 100 ms between frames of 10 ms: ten fit, whatever is wanted.
    #[test]
    fn a_babbling_line_is_no_faster_than_its_baud_rate() {
        let babbling = pass(Damage::Babbling { factor: 100 });
        let after_first = babbling.iter().filter(|frame| frame.time_us > 1_000_000).count();
        assert_eq!(after_first, 90);
        assert_eq!(pass(Damage::Babbling { factor: 3 }).len(), 30);
        let bytes: usize = pass(Damage::Garbage { factor: 5 }).iter().map(|frame| frame.bytes.len()).sum();
        assert_eq!(bytes, 600);
    }
}
