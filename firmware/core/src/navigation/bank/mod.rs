//! The bank: filters with different models beside each other, weighed by their ranges and fixes.

pub(super) mod evidence;
pub(super) mod navigator;
