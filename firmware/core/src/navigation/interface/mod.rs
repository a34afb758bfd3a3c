//! What goes into the filter and what comes out of it: values without behaviour, which import nothing of the rooms above.

pub(super) mod config;
pub(super) mod effect_states;
pub(super) mod error;
pub(super) mod fixed_effects;
pub(super) mod initial;
pub(super) mod measurement;
