//! Causes that are taken as there while others are weighed.

use super::causes::Cause;
use super::columns::COLUMNS;
use super::evidence::{BESIDE, Number};
use super::onset::{Onset, REMEMBERED};
use heapless::Vec;

/// A cause since an onset, by its place in the table; 0 and all bytes zero: none.
#[derive(Clone, Copy)]
pub(super) struct Taken {
    /// And one.
    pub(super) place: u8,
    pub(super) time_us: u64,
}

impl Taken {
    pub(super) const NONE: Self = Self { place: 0, time_us: 0 };

    pub(super) fn cause(&self) -> Option<Cause> {
        Cause::from_number(self.place)
    }
}

/// The numbers of the causes taken, and with `states` what they have done to the estimate within their first block.
pub(super) fn numbers<'a>(
    taken: &[Taken; 2],
    onsets: &'a [Onset],
    start_us: u64,
    states: bool,
) -> Vec<Number<'a>, BESIDE> {
    let mut numbers = Vec::new();
    for own in taken {
        let onset = onsets.iter().find(|onset| onset.time_us == own.time_us);
        if let (Some(cause), Some(onset)) = (own.cause(), onset) {
            let onset_h = onset.time_us.saturating_sub(start_us) as f64 / 3.6e9;
            let states = if states { 0..REMEMBERED.len() } else { 0..0 }.map(|m| Number::State(m, onset));
            let parts = cause.parts(onset_h).into_iter().flatten().map(|part| Number::Change(part, onset));
            // two causes of two numbers each have room
            states.chain(parts).for_each(|number| {
                let _ = numbers.push(number);
            });
        }
    }
    numbers
}

/// The largest scatter of the columns that a cause is made of.
pub(super) fn colour_of(cause: Cause, onset_h: f64, colour: &[f64; COLUMNS]) -> f64 {
    let columns = cause.parts(onset_h).into_iter().flatten().flat_map(|part| part.direction);
    let used = columns.filter(|(_, weight)| *weight != 0.0);
    used.map(|(column, _)| colour.get(column).copied().unwrap_or(1.0)).fold(1.0, f64::max)
}
