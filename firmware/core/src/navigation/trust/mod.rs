//! What may be believed: the gate, sources that contradict the filter, waves, consistency, and what P leaves out.

pub(super) mod consistency;
pub(super) mod innovation_monitor;
pub(super) mod innovation_window;
pub(super) mod integrity;
pub(super) mod peers;
pub(super) mod source_state;
pub(super) mod waves;
