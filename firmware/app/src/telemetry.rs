//! The records of each step for the host.

use crate::estimator::Estimator;
use backseat_core::control::HelmCommand;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::naming::Statement;
use backseat_core::navigation::{FusionOutcome, FusionRecord, Navigator, ShipReport};
use backseat_core::state::{VEHICLE_STATES, X, Y, wrap_angle};
use backseat_wire::hostlink::{
    Decision, Estimate, Estimates, FusionTelemetry, Held, Mode, ModeReason, NamedCause, Naming, Question, Ship,
    Steered, Telemetry,
};

/// The record of a step.
pub fn record(
    time_us: u64,
    utc_us: Option<u64>,
    (mode, reason): (Mode, ModeReason),
    estimator: &Estimator,
    input: &ActuatorInput,
    leg: Option<u16>,
    rejected_frames: [u32; 4],
) -> Telemetry {
    let navigator = estimator.navigator();
    let level = estimator.level();
    let mut state = [0.0; VEHICLE_STATES];
    let mut sigma = [0.0; VEHICLE_STATES];
    if navigator.is_initialised() {
        for (i, (state, sigma)) in state.iter_mut().zip(&mut sigma).enumerate() {
            *state = estimator.output[i];
            *sigma = libm::sqrt(estimator.stated_variance(i));
        }
    }
    Telemetry {
        time_us,
        utc_us: utc_us.unwrap_or(0),
        mode,
        reason,
        state,
        sigma,
        cov_xy_m2: if navigator.is_initialised() { navigator.covariance(X, Y) } else { 0.0 },
        current_mps: if navigator.is_initialised() { navigator.current() } else { [0.0; 2] },
        propeller_radps: input.propeller_radps,
        fins_rad: input.fins_rad,
        leg,
        rejected_frames,
        level_m: level.map_or([0.0; 2], |level| [level.horizontal_m as f32, level.vertical_m as f32]),
    }
}

/// What the robust filter estimates; `None`: it does not run.
pub fn estimates(time_us: u64, navigator: &Navigator, dives: u16) -> Option<Estimates> {
    let mut estimates = heapless::Vec::new();
    for estimate in navigator.main().estimates() {
        if let Some(place) = estimate.parameter.place() {
            // there are no more than it has room for
            let _ = estimates.push(Estimate {
                place: place as u8,
                value: estimate.value as f32,
                sigma: estimate.sigma as f32,
                separable: estimate.is_separable(),
            });
        }
    }
    let weights = navigator.weights().map(|weight| weight as f32);
    navigator.config().bank.then_some(Estimates { time_us, weights, dives, estimates })
}

/// What is stated of what has changed.
pub fn naming(statement: &Statement, decision: Option<Decision>, question: Option<Question>) -> Naming {
    let mut named = heapless::Vec::new();
    for own in statement.named.iter().flatten() {
        // there are no more than it has room for
        let _ = named.push(NamedCause {
            cause: own.cause.number(),
            rival: own.rival.map_or(0, |rival| rival.number()),
            size: own.size.map(|size| size as f32),
            sigma: own.sigma.map(|sigma| sigma as f32),
            since_us: own.since_us,
            probability: own.probability as f32,
        });
    }
    Naming { time_us: statement.time_us, unexplained: statement.unexplained, named, decision, question }
}

/// What the host steers, or that it does not.
pub fn steered(time_us: u64, helm: Option<HelmCommand>) -> Steered {
    let by_host = helm.map(|HelmCommand { heading_rad, depth_m, speed_mps }| Held {
        heading_rad: wrap_angle(heading_rad) as f32,
        depth_m: depth_m as f32,
        speed_mps: speed_mps as f32,
    });
    Steered { time_us, by_host }
}

/// The ship as a packet reports it.
pub fn ship(time_us: u64, report: &ShipReport) -> Ship {
    let ShipReport { position_m, velocity_mps, position_sigma_m: sigma_m, .. } = *report;
    Ship { time_us, position_m, velocity_mps, sigma_m }
}

/// The record of one scalar fusion.
pub fn fusion(record: &FusionRecord) -> FusionTelemetry {
    FusionTelemetry {
        sensor: record.sensor as u8,
        axis: record.axis,
        outcome: match record.outcome {
            FusionOutcome::Fused => 0,
            FusionOutcome::Gated => 1,
            FusionOutcome::Invalid => 2,
            FusionOutcome::StaleClone => 3,
            FusionOutcome::PositionUncertain => 4,
            FusionOutcome::Redundant => 5,
        },
        time_us: record.time_us,
        innovation: record.innovation,
        variance: record.variance,
    }
}
