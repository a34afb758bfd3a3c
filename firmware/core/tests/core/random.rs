//! Random numbers of a seed, for all suites.
#![allow(dead_code, reason = "each suite uses a part")]

/// SplitMix64 (Steele, Lea and Flood 2014): enough to scatter test points, the same on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [-scale, scale).
    pub fn within(&mut self, scale: f64) -> f64 {
        scale * ((self.word() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    }
}
