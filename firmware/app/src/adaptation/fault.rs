//! The fault monitor beside the identifier: the same samples, compared with the parameters in use.

use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::identification::{Diagnosis, FaultCause, FaultMonitor, FaultState};
use backseat_wire::hostlink::{self, FaultReport};
use nalgebra::{Vector3, Vector6};

/// Time between two reports of a diagnosed fault, whose magnitude improves with time, µs.
const REPORT_US: u64 = 10_000_000;

/// The monitor, the vehicle in use and the state last reported to the host.
pub struct FaultWatch {
    monitor: FaultMonitor,
    model: Option<VehicleModel>,
    reported: FaultState,
    next_report_us: u64,
}

impl FaultWatch {
    pub const fn new() -> Self {
        Self { monitor: FaultMonitor::new(), model: None, reported: FaultState::Learning, next_report_us: 0 }
    }

    /// Forgets everything; it watches again from the next vehicle on.
    pub fn restart(&mut self) {
        *self = Self::new();
    }

    /// The parameters in use have changed: the monitor learns its quiet means again.
    pub fn use_vehicle(&mut self, vehicle: &VehicleParameters) {
        self.monitor.restart();
        self.model = VehicleModel::new(vehicle).ok();
    }

    /// No sample for a while.
    pub fn interrupt(&mut self) {
        self.monitor.interrupt();
    }

    /// One sample, as the identifier gets it.
    pub fn sample(
        &mut self,
        time_us: u64,
        attitude: &Vector3<f64>,
        velocity: &Vector6<f64>,
        input_since: &ActuatorInput,
    ) {
        if let Some(model) = &self.model {
            self.monitor.sample(model, time_us, attitude, velocity, input_since);
        }
    }

    /// Something is wrong with the vehicle.
    pub fn has_fault(&self) -> bool {
        self.monitor.state() == FaultState::Diagnosed
    }

    /// Its state, when it has changed since the last report to the host.
    pub fn report(&mut self, now_us: u64) -> Option<FaultReport> {
        let state = self.monitor.state();
        let diagnosis = self.monitor.diagnosis();
        let due = diagnosis.is_some() && now_us >= self.next_report_us;
        if state == self.reported && !due {
            return None;
        }
        self.reported = state;
        self.next_report_us = now_us.saturating_add(REPORT_US);
        Some(FaultReport {
            time_us: now_us,
            state: match state {
                FaultState::Learning => hostlink::FaultState::Learning,
                FaultState::Quiet => hostlink::FaultState::Quiet,
                FaultState::Suspicious => hostlink::FaultState::Suspicious,
                FaultState::Diagnosed => hostlink::FaultState::Diagnosed,
            },
            diagnosis: diagnosis.as_ref().map(to_wire),
        })
    }
}

fn to_wire(diagnosis: &Diagnosis) -> hostlink::FaultDiagnosis {
    let cause = |cause| match cause {
        FaultCause::Fin(fin) => hostlink::FaultCause::Fin(fin),
        FaultCause::Entanglement => hostlink::FaultCause::Entanglement,
        FaultCause::Fouling => hostlink::FaultCause::Fouling,
        FaultCause::Flooding => hostlink::FaultCause::Flooding,
    };
    hostlink::FaultDiagnosis {
        cause: cause(diagnosis.cause),
        rival: diagnosis.rival.map(cause),
        magnitude: diagnosis.magnitude,
        moment_kgm: diagnosis.moment_kgm,
        confidence: diagnosis.confidence,
        since_us: diagnosis.since_us,
    }
}
