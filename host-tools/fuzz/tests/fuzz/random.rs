//! Random numbers of a seed, and for how long to draw them.

use std::time::Duration;

/// SplitMix64 (Steele, Lea and Flood, 2014).
pub struct Random(pub u64);

impl Random {
    /// A whole number from zero up to `count`, without it.
    pub fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % count.max(1) as u64) as usize
    }
}

/// The time that a variable of the environment gives, which has to be set.
pub fn seconds(variable: &str) -> Duration {
    let text = std::env::var(variable).unwrap_or_else(|_| panic!("{variable} is not set"));
    Duration::from_secs(text.parse().unwrap_or_else(|_| panic!("{variable}: expected whole seconds")))
}
