//! 64-bit digest of numbers, bit for bit.

/// FNV-1a over 64-bit words with one extra fold, which carries the high bits of a word down.
#[derive(Clone, Copy)]
pub(crate) struct Digest(u64);

impl Digest {
    /// FNV offset basis.
    pub(crate) const START: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;

    pub(crate) fn from(running: u64) -> Self {
        Self(running)
    }

    pub(crate) fn word(&mut self, word: u64) {
        let product = (self.0 ^ word).wrapping_mul(Self::PRIME);
        self.0 = product ^ (product >> 32);
    }

    /// NaN has one pattern: its payload differs between machines.
    pub(crate) fn number(&mut self, value: f64) {
        self.word(if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() });
    }

    pub(crate) fn finish(self) -> u64 {
        self.0
    }
}
