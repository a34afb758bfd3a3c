//! Whole numbers packed by the bit.

/// Longest delta, bytes.
pub(super) const LONGEST: usize = 64;

/// Signed numbers of a few bits each, in a row.
pub(super) struct Bits<'a> {
    pub bytes: &'a mut [u8; LONGEST],
    /// The next bit.
    pub at: u32,
}

impl Bits<'_> {
    /// `None`: the bits do not hold the value.
    pub fn put(&mut self, value: i64, count: u32) -> Option<()> {
        let limit = 1_i64 << (count - 1);
        if !(-limit..limit).contains(&value) {
            return None;
        }
        for bit in 0..count {
            self.bytes[(self.at / 8) as usize] |= ((value >> bit & 1) as u8) << (self.at % 8);
            self.at += 1;
        }
        Some(())
    }

    pub fn take(&mut self, count: u32) -> i64 {
        let mut value = 0;
        for bit in 0..count {
            value |= i64::from(self.bytes[(self.at / 8) as usize] >> (self.at % 8) & 1) << bit;
            self.at += 1;
        }
        // the last bit is the sign
        value << (64 - count) >> (64 - count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_bits_come_back() {
        let mut bytes = [0; LONGEST];
        let mut bits = Bits { bytes: &mut bytes, at: 0 };
        for (value, count) in [(-1, 4), (7, 4), (-8, 4), (1000, 15), (-16384, 15)] {
            bits.put(value, count).unwrap();
        }
        assert_eq!(bits.put(8, 4), None);
        bits.at = 0;
        assert_eq!([4, 4, 4, 15, 15].map(|count| bits.take(count)), [-1, 7, -8, 1000, -16384]);
    }
}
