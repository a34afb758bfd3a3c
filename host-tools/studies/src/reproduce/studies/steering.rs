//! The survey of chapter 5 flown closed loop, on the backseat's own estimate, by each law and on each filter.

use super::{Measured, Study};
use anyhow::Context;
use backseat_core::navigation::{ProcessNoise, SurfaceNoise};
use backseat_data::Truth;
use backseat_data::stats::ErrorSummary;
use backseat_link::Client;
use hil_sim::analysis;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{self, FlightLog, board_parameters};
use hil_sim::scenario::{ControlLaw, Scenario};
use std::sync::atomic::AtomicBool;

/// Flights of the survey, closed loop.
pub const STEERING: Study = Study { name: "steering", run };

/// How a survey is flown.
#[derive(Clone, Copy, Debug)]
pub struct Configuration {
    name: &'static str,
    law: ControlLaw,
    kinematic: bool,
    dvl: bool,
}

/// The default mission.
pub const LQR_DYNAMIC: Configuration =
    Configuration { name: "LQR, dynamic, no DVL", law: ControlLaw::Lqr, kinematic: false, dvl: false };

const FLOWN: [Configuration; 5] = [
    LQR_DYNAMIC,
    Configuration { name: "PD, dynamic, no DVL", law: ControlLaw::Pd, ..LQR_DYNAMIC },
    Configuration { name: "LQR on reference, dynamic, no DVL", law: ControlLaw::LqrOnReference, ..LQR_DYNAMIC },
    Configuration { name: "LQR, kinematic + DVL", kinematic: true, dvl: true, ..LQR_DYNAMIC },
    Configuration { name: "LQR, kinematic, no DVL", kinematic: true, ..LQR_DYNAMIC },
];

/// A flight, with its truth.
pub struct Flown {
    pub scenario: Scenario,
    pub flight: FlightLog,
    pub truth: Truth,
}

/// Flies the survey of a seed.
pub fn fly(seed: u64, configuration: &Configuration) -> anyhow::Result<Flown> {
    let mut scenario = Scenario::built_in("survey")?;
    scenario.settings.seed = seed;
    scenario.settings.backseat.control_law = configuration.law;
    scenario.settings.backseat.dvl = configuration.dvl;
    let mut parameters = board_parameters(&scenario);
    if configuration.kinematic {
        parameters.push(("app.process_model".to_owned(), 1.0));
        // Noise that covers what the fins do to follow a noisy estimate: with less, the dive is rejected and lost.
        let ProcessNoise { linear_mps2_per_sqrt_hz: linear, angular_radps2_per_sqrt_hz: angular } =
            SurfaceNoise::KINEMATIC.noise;
        for (group, values) in [("linear_mps2_per_sqrt_hz", linear), ("angular_radps2_per_sqrt_hz", angular)] {
            let noise = values.into_iter().enumerate();
            parameters.extend(noise.map(|(axis, value)| (format!("noise.{group}[{axis}]"), value)));
        }
    }
    let mut client = Client::new(InProcess::new());
    client.hello()?;
    client.set_parameters(&parameters)?;
    client.set_mission(&scenario.settings.waypoints())?;
    let flight = flight::fly_prepared(&scenario, &mut client, None, &AtomicBool::new(false), |_| {})
        .with_context(|| configuration.name)?;
    let truth = analysis::truth_of(&flight);
    Ok(Flown { scenario, flight, truth })
}

fn run(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for configuration in &FLOWN {
        keep(&mut measured, configuration.name, &fly(seed, configuration)?);
    }
    Ok(measured)
}

fn keep(measured: &mut Measured, row: &str, flown: &Flown) {
    let Flown { scenario, flight, .. } = flown;
    if let Some(track) = analysis::track_of(scenario, flight) {
        measured.set(row, "cross_median_m", track.cross_track.median_m);
        measured.set(row, "cross_p95_m", track.cross_track.p95_m);
        measured.set(row, "cross_max_m", track.cross_track.max_m);
        measured.set(row, "depth_p95_m", track.depth.p95_m);
    }
    let errors: Vec<(f64, f64)> = flight
        .samples
        .iter()
        .filter(|sample| sample.telemetry.sigma[0] > 0.0)
        .map(|sample| {
            let (estimate, truth) = (&sample.telemetry.state, &sample.truth.state);
            (sample.truth.time_us as f64 / 3.6e9, (estimate[0] - truth[0]).hypot(estimate[1] - truth[1]))
        })
        .collect();
    let magnitudes: Vec<f64> = errors.iter().map(|(_, error)| *error).collect();
    if let Some(summary) = ErrorSummary::of(&magnitudes) {
        measured.set(row, "navigation_median_m", summary.median_m);
        measured.set(row, "navigation_p95_m", summary.p95_m);
    }
    measured.set(row, "finished", f64::from(u8::from(flight.finished)));
    // How hard the fins work: root mean square of their angles and of the change from command to command.
    let fins: Vec<[f64; 4]> = flight.log.rows.iter().filter_map(|row| Some(row.actuators()?.fins_rad)).collect();
    let root_mean = |sum: f64, count: usize| (sum / (4 * count.max(1)) as f64).sqrt().to_degrees();
    let squares: f64 = fins.iter().flatten().map(|fin| fin * fin).sum();
    let changes: f64 = fins.windows(2).flat_map(|pair| (0..4).map(move |i| (pair[1][i] - pair[0][i]).powi(2))).sum();
    measured.set(row, "fins_deg", root_mean(squares, fins.len()));
    measured.set(row, "fin_steps_deg", root_mean(changes, fins.len()));
    measured.curve("navigation", row, errors.into_iter().step_by(60));
}
