//! A stretch that stands twice in a log: a block that was pasted again, or two exports that overlap.

use super::Finding;
use crate::log::{Column, Log};
use std::collections::HashMap;

/// Samples that are compared at once, and how many different values they need.
const GRAM: usize = 40;
const DIFFERENT: usize = 20;
/// So many samples that are the same to the last digit are no chance: ten seconds of a fast sensor.
const LEAST: usize = 100;
/// Columns with noise in their last digits.
const NOISY: [Column; 5] = [Column::Heading, Column::Pitch, Column::R, Column::DvlU, Column::Depth];
/// Odd, and not small: sums of its powers differ where the samples do.
const BASE: u64 = 0x9E37_79B9_7F4A_7C15;

pub(super) fn check(log: &Log) -> Option<Finding> {
    let column = NOISY.into_iter().max_by_key(|column| log.column(*column).count())?;
    let samples: Vec<(u64, u64)> = log.column(column).map(|(time_us, value)| (time_us, value.to_bits())).collect();
    let first = (0..GRAM).fold(1_u64, |power, _| power.wrapping_mul(BASE));
    let (mut hash, mut seen) = (0_u64, HashMap::new());
    for end in 0..samples.len() {
        hash = hash.wrapping_mul(BASE).wrapping_add(samples[end].1);
        let Some(begin) = (end + 1).checked_sub(GRAM) else { continue };
        if let Some(before) = begin.checked_sub(1) {
            hash = hash.wrapping_sub(samples[before].1.wrapping_mul(first));
        }
        // a sensor that stands still repeats itself everywhere
        let is_again = |earlier: &usize| earlier + GRAM <= begin && is_varied(&samples[begin..=end]);
        if let Some(earlier) = seen.get(&hash).copied().filter(is_again) {
            let same = |(a, b): &(&(u64, u64), &(u64, u64))| a.1 == b.1;
            let ahead = samples[begin..].iter().zip(&samples[earlier..begin]).take_while(same).count();
            let back = samples[..begin].iter().rev().zip(samples[..earlier].iter().rev()).take_while(same).count();
            let (earlier, begin, count) = (earlier - back, begin - back, back + ahead);
            if count >= LEAST {
                let s = |place: usize| samples[place].0 as f64 * 1e-6;
                let message = format!(
                    "{} from {:.0} to {:.0} s stands again from {:.0} s on, to the last digit ({count} samples): part of the log \
                     was written twice",
                    column.name(),
                    s(earlier),
                    s(earlier + count - 1),
                    s(begin)
                );
                return Some(Finding::suspicious(column, message));
            }
        }
        if begin % GRAM == 0 {
            seen.entry(hash).or_insert(begin);
        }
    }
    None
}

fn is_varied(samples: &[(u64, u64)]) -> bool {
    let mut values: Vec<u64> = samples.iter().map(|(_, bits)| *bits).collect();
    values.sort_unstable();
    values.dedup();
    values.len() >= DIFFERENT
}
