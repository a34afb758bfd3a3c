//! Closed-loop flights, in which only the sensors are as declared.
//!
//! The backseat flies the survey's lines in closed loop, from the surface down and up again; servos and propeller lag,
//! the hull loses buoyancy at the surface, the ship sails its circle, the filters start from a fix. No filter can be
//! consistent within the band here; it must not be overconfident.

use super::block::Block;
use super::ensemble::{Ensemble, ErrorSample, FilteredRun, SHIP_IN_PACKETS, add_square, filtered_run};
use super::packets;
use crate::flights;
use backseat_core::navigation::{Navigator, ProcessModel, nees_position};
use backseat_core::state::VehicleState;
use backseat_estimation::filter::FilterOptions;
use hil_sim::flight::FlightLog;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::{Mission, Scenario};
use nalgebra::DVector;
use rayon::prelude::*;
use std::num::NonZeroU16;

/// One sigma of a current's components, as the filter's current states have it.
const CURRENT_MPS: f64 = 0.3;
/// Lines and their length: the whole survey in small.
const LINES: NonZeroU16 = NonZeroU16::new(4).unwrap();
const LENGTH_M: f64 = 150.0;
const SPACING_M: f64 = 30.0;

/// Flies still water, or currents drawn from their prior, and filters it: an ensemble for each filter.
///
/// # Errors
/// A flight or a filter that fails.
pub fn surveys(minutes: u32, seeds: &[u64], current: bool) -> anyhow::Result<Vec<Ensemble>> {
    let flights: Vec<Vec<(String, FilteredRun)>> =
        seeds.par_iter().map(|seed| fly(minutes, *seed, current)).collect::<anyhow::Result<_>>()?;
    let Some(first) = flights.first() else { return Ok(Vec::new()) };
    let of_filter = |(place, (name, _)): (usize, &(String, FilteredRun))| {
        let runs = flights.iter().map(|flight| flight[place].1.clone()).collect();
        Ensemble { name: name.clone(), runs }
    };
    Ok(first.iter().enumerate().map(of_filter).collect())
}

fn fly(minutes: u32, seed: u64, current: bool) -> anyhow::Result<Vec<(String, FilteredRun)>> {
    let mut scenario = Scenario::built_in(if current { "survey_current" } else { "survey" })?;
    let settings = &mut scenario.settings;
    settings.seed = seed;
    settings.duration_s = 60.0 * f64::from(minutes);
    if let Mission::Lawnmower(lawnmower) = &mut settings.mission {
        (lawnmower.lines, lawnmower.length_m, lawnmower.spacing_m) = (LINES, LENGTH_M, SPACING_M);
    }
    if current {
        let mut prior = Stream::new(seed, Source::Effects);
        [settings.environment.current.north_mps, settings.environment.current.east_mps] = prior.normals(CURRENT_MPS);
    }
    let flight = flights::fly(&scenario)?;

    let of = |model, use_dvl| FilterOptions { use_dvl, ..FilterOptions::new(&scenario.vehicle, model) };
    let mut dynamic = of(ProcessModel::Dynamic, false);
    let mut runs = Vec::new();
    let filters = if current {
        dynamic.navigation.effect_states = FilterOptions::water_current();
        vec![("dynamic, current drawn from its prior", dynamic)]
    } else {
        runs.push(("backseat: dynamic, packets".to_owned(), on_board(&scenario, &flight)));
        vec![("dynamic", dynamic), ("kinematic + DVL", of(ProcessModel::Kinematic, true))]
    };
    for (name, options) in filters {
        runs.push((name.to_owned(), filtered(&scenario, &flight, &options)?));
    }
    Ok(runs)
}

fn filtered(scenario: &Scenario, flight: &FlightLog, options: &FilterOptions) -> anyhow::Result<FilteredRun> {
    let effects = options.navigation.effect_states.len();
    let sample = |navigator: &Navigator, second| {
        let truth = true_at(flight, second)?;
        let state = VehicleState::from_column_slice(&truth.state);
        Some(ErrorSample::of(navigator, &state, &truth.current_mps[..effects]))
    };
    Ok(filtered_run(&flight.log, &scenario.vehicle, options, sample)?)
}

fn true_at(flight: &FlightLog, second: usize) -> Option<&hil_sim::truth::VehicleTruth> {
    let time_us = 1_000_000 * second as u64;
    let place = flight.samples.binary_search_by_key(&time_us, |sample| sample.truth.time_us).ok()?;
    Some(&flight.samples[place].truth)
}

/// The board's own estimate: the covariance of the horizontal position only.
fn on_board(scenario: &Scenario, flight: &FlightLog) -> FilteredRun {
    let mut run = FilteredRun::default();
    for sample in &flight.samples {
        let (telemetry, truth) = (&sample.telemetry, &sample.truth);
        let (sigma, cov_xy_m2) = (telemetry.sigma, telemetry.cov_xy_m2);
        let error = VehicleState::from_column_slice(&telemetry.state) - VehicleState::from_column_slice(&truth.state);
        let nees = nees_position([error[0], error[1]], sigma[0].powi(2), cov_xy_m2, sigma[1].powi(2));
        let second = (truth.time_us / 1_000_000) as usize;
        run.samples.resize(second, None);
        run.samples.push(nees.map(|nees| ErrorSample {
            error: DVector::from_column_slice(error.as_slice()),
            velocity_ned_mps: [f64::NAN; 3],
            nees: Block::ALL.map(|block| if block == Block::Horizontal { nees } else { f64::NAN }),
        }));
    }
    for record in &flight.fusions {
        run.rejected += u64::from(!record.fused);
        add_square(&mut run.squares, record.sensor, record.axis, record.innovation.powi(2) / record.variance);
    }
    let (log, ship) = (&flight.log, &scenario.settings.ship);
    let launches_us = packets::launches(log);
    let reports = packets::reports(log, &launches_us, ship, scenario.vehicle.sensors.ship_gnss_m);
    for (report, launch_us) in reports.iter().zip(&launches_us) {
        let sample = flight.samples.binary_search_by_key(launch_us, |sample| sample.truth.time_us);
        let (Some(report), Ok(place)) = (report, sample) else { continue };
        let [north, east] = flight.samples[place].ship.position_m;
        let squared = (report.position_m[0] - north).powi(2) + (report.position_m[1] - east).powi(2);
        let of_packets = run.squares.entry(SHIP_IN_PACKETS).or_default();
        of_packets.push((squared / report.position_sigma_m.powi(2), 2));
    }
    run
}
