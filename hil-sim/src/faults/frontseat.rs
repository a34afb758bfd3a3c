//! Faults of the frontseat.

use super::{Active, Fault, FaultKind, active};
use backseat_wire::iver::FrontseatMode;

/// What the frontseat does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrontseatFault {
    /// A safety rule is engaged: every command is refused (`$ACK` 26).
    Refuses,
    /// It is down: it sends and hears nothing, fins and motor are off.
    Reboots,
    /// Its mode is this one; where that takes commands they are acknowledged, and another source steers.
    Mode(FrontseatMode),
}

/// The frontseat's faults of a scenario.
#[derive(Clone, Debug)]
pub struct FrontseatFaults {
    faults: Vec<Active<FrontseatFault>>,
}

impl FrontseatFaults {
    /// Those of a scenario.
    pub fn new(faults: &[Fault], seed: u64) -> Self {
        let pick = |kind: &FaultKind| if let FaultKind::Frontseat(fault) = kind { Some(*fault) } else { None };
        Self { faults: active(faults, seed, pick) }
    }

    /// What is wrong at a time.
    pub fn at(&self, time_us: u64) -> Option<FrontseatFault> {
        self.faults.iter().find(|active| active.fault.acts(time_us)).map(|active| active.what)
    }

    /// When that next changes after `time_us`, µs.
    pub fn next_us(&self, time_us: u64) -> Option<u64> {
        let edges = self.faults.iter().flat_map(|active| [active.fault.from_us, active.fault.until_us]);
        edges.filter(|edge_us| *edge_us > time_us && *edge_us < u64::MAX).min()
    }
}
