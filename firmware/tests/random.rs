//! Random numbers of a seed, the same on every machine: for all tests that may not depend on a crate for them, and for
//! those that run on the target. `#[path]` brings them in.
#![allow(dead_code, reason = "each test program uses a part")]

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone)]
pub struct Random(pub u64);

impl Random {
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to `count` − 1.
    pub fn below(&mut self, count: usize) -> usize {
        (self.word() % count.max(1) as u64) as usize
    }

    /// In (0, 1].
    pub fn uniform(&mut self) -> f64 {
        ((self.word() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// In [-bound, bound).
    pub fn within(&mut self, bound: f64) -> f64 {
        bound * ((self.word() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    }

    pub fn array<const N: usize>(&mut self, bound: f64) -> [f64; N] {
        core::array::from_fn(|_| self.within(bound))
    }

    /// Mean 0, variance 1 (Box and Muller).
    #[cfg(not(target_os = "none"))]
    #[allow(clippy::disallowed_methods, reason = "the tests' own arithmetic need not have the same bits everywhere")]
    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (core::f64::consts::TAU * self.uniform()).cos()
    }
}
