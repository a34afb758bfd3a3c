//! What a board did in a lock-step.

use backseat_core::navigation::Sensor;
use backseat_wire::hostlink::{Fittings, FusionTelemetry, Identification, Naming, Telemetry};

/// One scalar fusion of the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportedFusion {
    /// Which sensor.
    pub sensor: Sensor,
    /// Board time, µs.
    pub time_us: u64,
    /// Component.
    pub axis: u8,
    /// It was used.
    pub fused: bool,
    /// Innovation, sensor's unit.
    pub innovation: f64,
    /// Its variance.
    pub variance: f64,
}

impl ReportedFusion {
    /// As the host link carries it; `None` for a sensor that is not known here.
    #[must_use]
    pub fn of(telemetry: &FusionTelemetry) -> Option<Self> {
        let FusionTelemetry { sensor, axis, outcome, time_us, innovation, variance } = *telemetry;
        let sensor = *Sensor::ALL.get(usize::from(sensor))?;
        Some(Self { sensor, time_us, axis, fused: outcome == 0, innovation, variance })
    }
}

/// What the board did in one step.
#[derive(Clone, Debug, Default)]
pub struct StepOutput {
    /// Bytes it sent to each device port (in the order of `Port::DEVICES`).
    pub sent: [Vec<u8>; 4],
    /// Its record of the step.
    pub telemetry: Option<Telemetry>,
    /// What it fused.
    pub fusions: Vec<ReportedFusion>,
    /// What it identified, if it reports that.
    pub identification: Option<Identification>,
    /// What it names of what has changed, if it reports that.
    pub naming: Option<Naming>,
    /// How its last-resort hardware stands, if that has changed.
    pub fittings: Option<Fittings>,
    /// Running digest of filter state and covariance.
    pub digest: u64,
}
