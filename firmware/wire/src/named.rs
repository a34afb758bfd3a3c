//! What a board names of what has changed, in the 24 bits that its acoustic uplink has for it.
//!
//! | bits | meaning |
//! |---|---|
//! | 0 to 4 | cause, its number in `backseat_core::navigation::naming`; 0: nothing; 31: none of these |
//! | 5 to 9 | what else it could be, 0: nothing; of *none of these* the nearest cause |
//! | 10 | it is the second of two: packets carry them by turns |
//! | 11 | its probability among all causes is 90 % or more |
//! | 12 to 17, 18 to 23 | size, and the second number of those that have two: two's complement, in steps |
//!
//! Steps are 19 %: step n of either sign is the cause's scale times 2^((n - 23) / 4), 0 is nothing, 31 is that or more.
//! The scales stand beside the causes, because this crate knows nothing of numbers.

use crate::Error;

/// The cause of *none of these*.
pub const NONE_OF_THESE: u8 = 31;
/// The largest step of a size.
pub const MOST_STEPS: i8 = 31;

/// One cause that is named.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Named {
    /// Which; 0: nothing is named.
    pub cause: u8,
    /// What else it could be; 0: nothing.
    pub rival: u8,
    /// The second of two.
    pub beside: bool,
    /// Its probability is 90 % or more.
    pub is_sure: bool,
    /// Its numbers in steps.
    pub size: [i8; 2],
}

impl Named {
    /// Nothing is named.
    pub const NOTHING: Self = Self { cause: 0, rival: 0, beside: false, is_sure: false, size: [0; 2] };

    pub(crate) fn read([a, b, c]: [u8; 3]) -> Self {
        let bits = u32::from_le_bytes([a, b, c, 0]);
        let five = |from: u32| (bits >> from) as u8 & 31;
        // the sign is the field's top bit
        let size = |from: u32| ((bits >> from) as u8).wrapping_shl(2).cast_signed() >> 2;
        Self {
            cause: five(0),
            rival: five(5),
            beside: bits & 1 << 10 != 0,
            is_sure: bits & 1 << 11 != 0,
            size: [size(12), size(18)],
        }
    }

    pub(crate) fn bytes(&self) -> Result<[u8; 3], Error> {
        let [first, second] = self.size;
        let whole = [self.cause, self.rival].iter().all(|number| *number <= 31)
            && [first, second].iter().all(|steps| (-MOST_STEPS - 1..=MOST_STEPS).contains(steps));
        if !whole {
            return Err(Error::OutOfRange);
        }
        let steps = |steps: i8| u32::from(steps.cast_unsigned() & 63);
        let bits = u32::from(self.cause)
            | u32::from(self.rival) << 5
            | u32::from(self.beside) << 10
            | u32::from(self.is_sure) << 11
            | steps(first) << 12
            | steps(second) << 18;
        let [a, b, c, _] = bits.to_le_bytes();
        Ok([a, b, c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pattern_is_read_and_written_back() {
        for bits in 0..1_u32 << 24 {
            let [a, b, c, _] = bits.to_le_bytes();
            assert_eq!(Named::read([a, b, c]).bytes(), Ok([a, b, c]));
        }
        assert_eq!(Named::read([0; 3]), Named::NOTHING);
    }

    #[test]
    fn what_has_no_room_is_refused() {
        let wide = [
            Named { cause: 32, ..Named::NOTHING },
            Named { rival: 32, ..Named::NOTHING },
            Named { size: [32, 0], ..Named::NOTHING },
            Named { size: [0, -33], ..Named::NOTHING },
        ];
        assert!(wide.iter().all(|named| named.bytes() == Err(Error::OutOfRange)));
    }
}
