//! Numbers that are the same everywhere.

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform within ±`bound`.
    pub fn within(&mut self, bound: f64) -> f64 {
        bound * ((self.next() >> 11) as f64 * (2.0 / 9_007_199_254_740_992.0) - 1.0)
    }

    pub fn array<const N: usize>(&mut self, bound: f64) -> [f64; N] {
        core::array::from_fn(|_| self.within(bound))
    }
}
