//! The filter over the runs of an ensemble.

use super::block::Block;
use super::case::DeclaredCase;
use super::declared::{DeclaredFlight, DeclaredWorld};
use super::motion::rotation;
use backseat_core::navigation::{FusionOutcome, Navigator, Sensor};
use backseat_core::state::{VEHICLE_STATES, VehicleState, wrap_angle};
use backseat_estimation::filter::{self, FilterOptions, FusionHistory};
use backseat_logs::{DataError, Log, VehicleFile};
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// One whole second of one run.
#[derive(Clone, Debug)]
pub struct ErrorSample {
    /// Estimate minus truth of the vehicle, then of the effects.
    pub error: DVector<f64>,
    /// Estimate minus truth of the velocity through the water in NED, m/s.
    pub velocity_ned_mps: [f64; 3],
    /// Normalised squares, by [`Block::ALL`]; NaN where the block has no states or P is not positive.
    pub nees: [f64; Block::ALL.len()],
}

/// Σ ν²/S of one measurement and its number of scalars.
pub type Square = (f64, u32);

/// One run.
#[derive(Clone, Debug, Default)]
pub struct FilteredRun {
    /// By whole second.
    pub samples: Vec<Option<ErrorSample>>,
    /// By sensor, in order of time, those refused by the gate included.
    pub squares: BTreeMap<&'static str, Vec<Square>>,
    /// Scalars that were not fused.
    pub rejected: u64,
}

/// All runs.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// For tables.
    pub name: String,
    /// In order of the seeds.
    pub runs: Vec<FilteredRun>,
}

/// Flies and filters a case.
///
/// # Errors
/// A filter that fails.
pub fn run(case: &DeclaredCase, seeds: &[u64]) -> Result<Ensemble, DataError> {
    run_in(case, &case.options, seeds)
}

/// Flies a case and filters it with options other than its own.
///
/// # Errors
/// A filter that fails.
pub fn run_in(world: &DeclaredCase, options: &FilterOptions, seeds: &[u64]) -> Result<Ensemble, DataError> {
    let one = |seed: &u64| filtered(world, options, &DeclaredWorld::fly(world, *seed));
    let runs = seeds.par_iter().map(one).collect::<Result<_, _>>()?;
    Ok(Ensemble { name: world.name.to_owned(), runs })
}

fn filtered(world: &DeclaredCase, options: &FilterOptions, flown: &DeclaredFlight) -> Result<FilteredRun, DataError> {
    filtered_run(&flown.log, &world.vehicle, options, |navigator, second| {
        flown.truth.get(second).map(|truth| ErrorSample::of(navigator, &truth.vehicle, &truth.effects))
    })
}

/// A filter over a log, with what `sample` says of it at each whole second.
pub(super) fn filtered_run(
    log: &Log,
    vehicle: &VehicleFile,
    options: &FilterOptions,
    sample: impl Fn(&Navigator, usize) -> Option<ErrorSample>,
) -> Result<FilteredRun, DataError> {
    let mut samples = Vec::new();
    let observe = |navigator: &Navigator| {
        let time_us = navigator.time_us();
        if time_us.is_multiple_of(1_000_000) {
            let second = (time_us / 1_000_000) as usize;
            samples.resize(second, None);
            samples.push(sample(navigator, second));
        }
    };
    let outcome = filter::run_watched(log, vehicle, options, |_| {}, observe)?;
    let (squares, rejected) = squares(&outcome.fusions);
    Ok(FilteredRun { samples, squares, rejected })
}

/// Innovations by sensor, and how many scalars were not fused.
fn squares(fusions: &FusionHistory) -> (BTreeMap<&'static str, Vec<Square>>, u64) {
    let mut squares = BTreeMap::<_, Vec<Square>>::new();
    let mut rejected = 0;
    for record in fusions.iter() {
        rejected += u64::from(record.outcome != FusionOutcome::Fused);
        if !matches!(record.outcome, FusionOutcome::Fused | FusionOutcome::Gated) {
            continue;
        }
        add_square(&mut squares, record.sensor, record.axis, record.nis());
    }
    (squares, rejected)
}

/// Adds ν²/S of one scalar; the first axis begins a measurement.
pub(super) fn add_square(squares: &mut BTreeMap<&'static str, Vec<Square>>, sensor: Sensor, axis: u8, square: f64) {
    let of_sensor = squares.entry(sensor.name()).or_default();
    match of_sensor.last_mut().filter(|_| axis > 0) {
        Some((sum, scalars)) => {
            *sum += square;
            *scalars += 1;
        }
        None => of_sensor.push((square, 1)),
    }
}

/// The ship's error over its own sigma, in the packets.
pub(super) const SHIP_IN_PACKETS: &str = "ship in packets";

/// Kinds of measurement in the order of tables.
pub fn measurement_names() -> impl Iterator<Item = &'static str> {
    Sensor::ALL.iter().map(|sensor| sensor.name()).chain([SHIP_IN_PACKETS])
}

impl ErrorSample {
    pub(super) fn of(navigator: &Navigator, truth: &VehicleState, effects: &[f64]) -> Self {
        let n = VEHICLE_STATES + effects.len();
        let true_state =
            |i: usize| truth.get(i).or_else(|| effects.get(i - VEHICLE_STATES)).copied().unwrap_or(f64::NAN);
        let error = DVector::from_fn(n, |i, _| {
            let error = navigator.state_at(i) - true_state(i);
            if (3..6).contains(&i) { wrap_angle(error) } else { error }
        });
        let covariance = DMatrix::from_fn(n, n, |i, j| navigator.covariance(i, j));
        let nees = Block::ALL.map(|block| {
            let states = block.states(effects.len());
            let (at, count) = (states.start, states.len());
            let part = error.rows(at, count).clone_owned();
            let factor = covariance.view((at, at), (count, count)).clone_owned().cholesky();
            factor.filter(|_| count > 0).map_or(f64::NAN, |factor| part.dot(&factor.solve(&part)))
        });
        let ned = |x: &VehicleState| rotation(&Vector3::new(x[3], x[4], x[5])) * Vector3::new(x[6], x[7], x[8]);
        Self { velocity_ned_mps: (ned(navigator.state()) - ned(truth)).into(), error, nees }
    }
}
