//! Flights under printed conditions, by the app itself; and chapter 5, by each law and on each filter.

use super::conditions::{self, Conditions};
use super::{Kind, Measured, Study};
use crate::experiment::declared;
use crate::flights;
use anyhow::{Context, bail};
use backseat_analysis::flight_score;
use backseat_core::navigation::{ProcessNoise, SurfaceNoise};
use backseat_logs::Truth;
use backseat_logs::stats::ErrorSummary;
use hil_sim::flight::FlightLog;
use hil_sim::scenario::{ControlLaw, Exchange, Mission, Scenario, Slot};

/// Flights of chapter 5, closed loop.
pub const STEERING: Study = Study { name: "steering", kind: Kind::Own(run) };

/// On which estimate the vehicle is steered.
#[derive(Clone, Copy, Debug)]
struct SteeredOn {
    row: &'static str,
    law: ControlLaw,
    kinematic: bool,
    dvl: bool,
}

const DYNAMIC: SteeredOn = SteeredOn {
    row: "LQR on reference, dynamic, no DVL",
    law: ControlLaw::LqrOnReference,
    kinematic: false,
    dvl: false,
};

const FLOWN: [SteeredOn; 5] = [
    DYNAMIC,
    SteeredOn { row: "LQR on line, dynamic, no DVL", law: ControlLaw::Lqr, ..DYNAMIC },
    SteeredOn { row: "PD, dynamic, no DVL", law: ControlLaw::Pd, ..DYNAMIC },
    SteeredOn { row: "LQR on reference, kinematic + DVL", kinematic: true, dvl: true, ..DYNAMIC },
    SteeredOn { row: "LQR on reference, kinematic, no DVL", kinematic: true, ..DYNAMIC },
];

/// A flight, with its truth.
pub struct PrintedFlight {
    pub scenario: Scenario,
    pub flight: FlightLog,
    pub truth: Truth,
}

/// The scenario of printed conditions.
pub fn scenario_of(conditions: &Conditions, seed: u64) -> anyhow::Result<Scenario> {
    let mut scenario = Scenario::built_in("survey")?;
    let Conditions { lines, ship: [radius_m, ship_mps], packets_s: [first_s, period_s], .. } = *conditions;
    let (settings, vehicle) = (&mut scenario.settings, &mut scenario.vehicle);
    settings.seed = seed;
    let Mission::Lawnmower(mission) = &mut settings.mission else { bail!("the survey is no lawnmower") };
    mission.lines = lines.count.try_into()?;
    (mission.length_m, mission.spacing_m) = (lines.length_m, lines.spacing_m);
    (mission.depth_m, mission.speed_mps) = (lines.depth_m, lines.speed_mps);
    let ship = &mut settings.ship;
    ship.centre_m = [0.5 * lines.length_m, 0.5 * f64::from(lines.count - 1) * lines.spacing_m];
    (ship.radius_m, ship.speed_mps) = (radius_m, ship_mps);
    let acoustics = &mut settings.acoustics;
    (acoustics.first_s, acoustics.period_s) = (first_s, period_s.try_into()?);
    acoustics.slots = conditions
        .slots_s
        .iter()
        .map(|&offset_s| Slot { offset_s, exchange: Exchange::Downlink, companion: None })
        .collect();
    let sensors = &mut settings.sensors;
    let ([depth_hz, depth_m], [ahrs_hz, tilt_deg, heading_deg]) = (conditions.depth, conditions.attitude);
    (sensors.depth.rate_hz, sensors.ahrs.rate_hz) = (depth_hz, ahrs_hz);
    let noise = &mut vehicle.sensors;
    (noise.depth_m, noise.attitude_rad, noise.heading_rad) = (depth_m, tilt_deg.to_radians(), heading_deg.to_radians());
    noise.rates_radps = conditions.rates_degps.map_or(noise.rates_radps, f64::to_radians);
    if conditions.experiment_vehicle {
        vehicle.parameters = declared();
    }
    settings.backseat.rates = conditions.rates_degps.is_some();
    settings.backseat.robust = false;
    settings.backseat.control_law = conditions.law;
    Ok(scenario)
}

/// Flies under printed conditions.
pub fn fly(conditions: &Conditions, seed: u64) -> anyhow::Result<PrintedFlight> {
    fly_on(scenario_of(conditions, seed)?, false)
}

fn fly_on(scenario: Scenario, kinematic: bool) -> anyhow::Result<PrintedFlight> {
    let mut parameters = Vec::new();
    if kinematic {
        parameters.push(("app.process_model".to_owned(), 1.0));
        // Noise that covers what the fins do to follow a noisy estimate: with less, the dive is rejected and lost.
        let ProcessNoise { linear_mps2_per_sqrt_hz: linear, angular_radps2_per_sqrt_hz: angular } =
            SurfaceNoise::KINEMATIC.noise;
        for (group, values) in [("linear_mps2_per_sqrt_hz", linear), ("angular_radps2_per_sqrt_hz", angular)] {
            let noise = values.into_iter().enumerate();
            parameters.extend(noise.map(|(axis, value)| (format!("noise.{group}[{axis}]"), value)));
        }
    }
    let flight = flights::fly_with(&scenario, &parameters)?;
    let truth = flight_score::truth_of(&flight);
    Ok(PrintedFlight { scenario, flight, truth })
}

fn run(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for estimate in &FLOWN {
        let mut scenario = scenario_of(&conditions::C, seed)?;
        scenario.settings.backseat.dvl = estimate.dvl;
        scenario.settings.backseat.control_law = estimate.law;
        let flown = fly_on(scenario, estimate.kinematic).with_context(|| estimate.row)?;
        keep(&mut measured, estimate.row, &flown);
    }
    Ok(measured)
}

fn keep(measured: &mut Measured, row: &str, flown: &PrintedFlight) {
    let PrintedFlight { scenario, flight, .. } = flown;
    if let Some(track) = flight_score::track_of(scenario, flight) {
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
