//! What a vehicle names of what has changed, as its uplinks tell it.

use backseat_wire::named::Named;

/// So many packets in a row without the second of two causes: it is named no longer. One of two carries it.
const GONE: u8 = 2;

/// The causes that a vehicle names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// The first and the one beside it, and the transmit second that told it first.
    told: [Option<(Named, u32)>; 2],
    /// Packets since the second was told.
    without: u8,
}

impl Names {
    /// Nothing is named.
    pub const NONE: Self = Self { told: [None; 2], without: 0 };

    /// Takes what a packet says; whether other causes are named than before.
    pub fn take(&mut self, named: Named, transmit_s: u32) -> bool {
        let before = self.causes();
        let [first, second] = &mut self.told;
        let slot = if named.beside { &mut *second } else { first };
        let since_s = slot.filter(|(own, _)| own.cause == named.cause).map_or(transmit_s, |(_, since_s)| since_s);
        *slot = (named.cause != 0).then_some((named, since_s));
        self.without = if named.beside { 0 } else { self.without.saturating_add(1) };
        if named.cause == 0 || self.without >= GONE {
            *second = None;
        }
        self.causes() != before
    }

    fn causes(&self) -> [u8; 2] {
        self.told.map(|told| told.map_or(0, |(named, _)| named.cause))
    }

    /// What is named, the first in front, each with the transmit second since which it has been told.
    pub fn iter(&self) -> impl Iterator<Item = (Named, u32)> + '_ {
        self.told.iter().flatten().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn two_causes_come_by_turns_and_the_second_goes_when_it_is_told_no_longer() {
        let fin = Named { cause: 2, size: [23, 0], ..Named::NOTHING };
        let thrust = Named { cause: 13, beside: true, ..Named::NOTHING };
        let mut names = Names::NONE;
        assert!(!names.take(Named::NOTHING, 0));
        assert!(names.take(fin, 30) && !names.take(Named { size: [20, 0], ..fin }, 60) && names.take(thrust, 90));
        assert!(!names.take(fin, 120) && !names.take(thrust, 150));
        assert_eq!(names.iter().collect::<Vec<_>>(), [(fin, 30), (thrust, 90)]);
        assert!(!names.take(fin, 180) && names.take(fin, 210));
        assert_eq!(names.iter().collect::<Vec<_>>(), [(fin, 30)]);
        let drag = Named { cause: 15, ..fin };
        assert!(names.take(drag, 240));
        assert_eq!(names.iter().collect::<Vec<_>>(), [(drag, 240)]);
        assert!(names.take(thrust, 270) && names.take(Named::NOTHING, 300));
        assert_eq!(names, Names { told: [None; 2], without: 1 });
    }
}
