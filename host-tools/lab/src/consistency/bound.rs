//! The posterior Cramér-Rao bound by Tichavský's recursion (Tichavský, Muravchik and Nehorai, IEEE Trans. Signal
//! Processing 46(5), 1998), apart from the filter's code: dense matrices, Jacobians by differences of the simulator's
//! own integrator at the true states.
//!
//! For x_{k+1} = f(x_k) + w, w ~ N(0, Q), z = h(x) + v, v ~ N(0, R), F = ∂f/∂x and H = ∂h/∂x at the truth, E over the
//! ensemble,
//!   J_{k+1} = D22 − D21 (J_k + D11)⁻¹ D12,  D11 = E[Fᵀ Q⁻¹ F],  D12 = D21ᵀ = −E[F]ᵀ Q⁻¹,  D22 = Q⁻¹ + E[Hᵀ R⁻¹ H].
//! It is computed as its inverse P = J⁻¹. With F̄ = E[F] and the excess X = E[(F − F̄)ᵀ Q⁻¹ (F − F̄)],
//! D11 = F̄ᵀ Q⁻¹ F̄ + X, and the matrix inversion lemma gives
//!   P_{k+1}⁻¹ = (F̄ (P_k⁻¹ + X)⁻¹ F̄ᵀ + Q)⁻¹ + E[Hᵀ R⁻¹ H],
//! in which nothing of the size of Q⁻¹ (some 1e11) cancels, and a delayed state, of which Q is singular, needs no
//! special case.
//!
//! # Delayed states
//! A range measured at the arrival of a packet relates the vehicle then to the ship at the launch: at a launch the
//! ship's four states are copied, the copy stays as it is while the packet travels, and the range informs about vehicle
//! and copy.
//!
//! # Two bounds
//! *Ensemble*: the above, below which no estimator's mean squared error over the ensemble can be. *Track*: the same
//! recursion along every single true track, the covariances averaged afterwards. It is not below the first (Jensen),
//! and an estimator that loses nothing by linearisation reaches it.

use super::case::{DeclaredCase, DeclaredEffect};
use super::declared::{AHRS_STEPS, DEPTH_STEPS, DVL_STEPS, DeclaredWorld, GRID_STEPS, RangeArrival, SECOND_STEPS};
use super::motion::{self, Smooth};
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

/// One step of the grid, s.
const STEP_S: f64 = 0.01 * GRID_STEPS as f64;
/// Steps of the grid that are averaged at once.
const CHUNK: usize = 20;

/// Input of a step of the recursion: averages over an ensemble.
#[derive(Clone, Debug)]
pub struct Moments {
    /// F̄.
    pub transition: DMatrix<f64>,
    /// X; `None` for a single track.
    pub excess: Option<DMatrix<f64>>,
    /// Q.
    pub noise: DMatrix<f64>,
}

impl Moments {
    /// From the transitions of an ensemble under one Q.
    ///
    /// # Panics
    /// If there is no transition, or Q is singular.
    #[must_use]
    pub fn of(transitions: &[DMatrix<f64>], noise: DMatrix<f64>) -> Self {
        let count = transitions.len() as f64;
        let mut transition = transitions[0].clone() * 0.0;
        transitions.iter().for_each(|each| transition += each / count);
        let factor = noise.clone().cholesky().expect("Q is positive definite");
        let mut excess = DMatrix::zeros(transition.ncols(), transition.ncols());
        for each in transitions {
            let off = each - &transition;
            excess += off.tr_mul(&factor.solve(&off)) / count;
        }
        Self { transition, excess: Some(excess), noise }
    }
}

/// P = J⁻¹ of the recursion.
#[derive(Clone, Debug)]
pub struct Bound {
    /// J⁻¹: a lower bound of the covariance of any estimate.
    pub covariance: DMatrix<f64>,
}

impl Bound {
    /// From the prior's covariance.
    #[must_use]
    pub fn new(covariance: DMatrix<f64>) -> Self {
        Self { covariance }
    }

    /// From x_k to x_{k+1}.
    pub fn advance(&mut self, moments: &Moments) {
        if let Some(excess) = &moments.excess {
            self.learn(excess);
        }
        let Moments { transition, noise, .. } = moments;
        self.covariance = transition * &self.covariance * transition.transpose() + noise;
        self.symmetrise();
    }

    /// Adds E[Hᵀ R⁻¹ H], or any information.
    pub fn learn(&mut self, information: &DMatrix<f64>) {
        let n = self.covariance.nrows();
        let spread = DMatrix::identity(n, n) + &self.covariance * information;
        // P and information are positive semidefinite: the eigenvalues of 1 + P I are at least 1.
        self.covariance = spread.lu().solve(&self.covariance).expect("1 + P I is regular");
        self.symmetrise();
    }

    /// Copies states `from..from + count` to `to`, correlated as they are.
    pub fn copy(&mut self, from: usize, to: usize, count: usize) {
        for i in 0..count {
            let row = self.covariance.row(from + i).clone_owned();
            self.covariance.set_row(to + i, &row);
        }
        for i in 0..count {
            let column = self.covariance.column(from + i).clone_owned();
            self.covariance.set_column(to + i, &column);
        }
    }

    fn symmetrise(&mut self) {
        self.covariance = 0.5 * (&self.covariance + self.covariance.transpose());
    }
}

/// A measured arrival, or any measurement: ∂h/∂x and variances.
#[derive(Clone, Debug)]
pub struct Sensed {
    /// H.
    pub gradient: DMatrix<f64>,
    /// Diagonal of R.
    pub variances: Vec<f64>,
}

impl Sensed {
    fn add_to(&self, information: &mut DMatrix<f64>) {
        for (row, variance) in self.gradient.row_iter().zip(&self.variances) {
            information.ger(1.0 / variance, &row.transpose(), &row.transpose(), 1.0);
        }
    }
}

/// Least mean squared errors at one whole second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Least {
    /// North and east, m².
    pub position_m2: f64,
    /// Roll, pitch, heading, rad².
    pub attitude_rad2: f64,
    /// Velocity through the water in NED, m²/s².
    pub velocity_m2ps2: f64,
}

impl Least {
    fn of(bound: &Bound) -> Self {
        let sum = |at: std::ops::Range<usize>| at.map(|i| bound.covariance[(i, i)]).sum();
        Self { position_m2: sum(0..2), attitude_rad2: sum(3..6), velocity_m2ps2: sum(6..9) }
    }

    fn add(&mut self, other: &Self, share: f64) {
        self.position_m2 += share * other.position_m2;
        self.attitude_rad2 += share * other.attitude_rad2;
        self.velocity_m2ps2 += share * other.velocity_m2ps2;
    }
}

/// Both bounds, at each whole second from zero.
#[derive(Clone, Debug)]
pub struct Bounds {
    /// Tichavský's.
    pub ensemble: Vec<Least>,
    /// Mean of those of the single tracks.
    pub track: Vec<Least>,
}

/// Which coordinate stands where: vehicle 12 | effects | ship 4 | ship at launch 4.
#[derive(Clone, Copy, Debug)]
struct Layout {
    effects: usize,
}

impl Layout {
    const VEHICLE: usize = 12;

    fn ship(self) -> usize {
        Self::VEHICLE + self.effects
    }

    fn launched(self) -> usize {
        self.ship() + 4
    }

    fn len(self) -> usize {
        self.launched() + 4
    }
}

/// One run, and the bound along its own track.
struct Track<'a> {
    case: &'a DeclaredCase,
    layout: Layout,
    world: DeclaredWorld<'a>,
    bound: Bound,
    least: Vec<Least>,
}

/// What one run adds to the averages of one step.
struct TrackShare {
    /// Of vehicle and effects.
    transition: DMatrix<f64>,
    /// Q of vehicle and effects.
    noise: DMatrix<f64>,
    information: Option<DMatrix<f64>>,
}

/// Both bounds over the runs of these seeds.
#[must_use]
pub fn bounds(case: &DeclaredCase, seeds: &[u64]) -> Bounds {
    let layout = Layout { effects: case.effects.len() };
    let prior = Bound::new(prior_covariance(case, layout));
    let mut tracks: Vec<Track> = seeds
        .iter()
        .map(|seed| Track {
            case,
            layout,
            world: DeclaredWorld::new(case, *seed),
            bound: prior.clone(),
            least: vec![Least::of(&prior)],
        })
        .collect();
    let mut ensemble = (prior.clone(), vec![Least::of(&prior)]);
    let grid = (case.duration_s as u64 * SECOND_STEPS / GRID_STEPS) as usize;
    for first in (0..grid).step_by(CHUNK) {
        let count = CHUNK.min(grid - first);
        let shares: Vec<Vec<TrackShare>> =
            tracks.par_iter_mut().map(|track| (0..count).map(|_| track.step()).collect()).collect();
        for k in 0..count {
            let of_step: Vec<&TrackShare> = shares.iter().map(|run| &run[k]).collect();
            let steps = (first + k) as u64 * GRID_STEPS;
            advance_ensemble(case, layout, &mut ensemble.0, steps, &of_step);
            if (steps + GRID_STEPS).is_multiple_of(SECOND_STEPS) {
                ensemble.1.push(Least::of(&ensemble.0));
            }
        }
    }
    let mut track = vec![Least::default(); ensemble.1.len()];
    for run in &tracks {
        let share = 1.0 / tracks.len() as f64;
        track.iter_mut().zip(&run.least).for_each(|(sum, least)| sum.add(least, share));
    }
    Bounds { ensemble: ensemble.1, track }
}

fn advance_ensemble(case: &DeclaredCase, layout: Layout, bound: &mut Bound, steps: u64, shares: &[&TrackShare]) {
    if DeclaredWorld::launches(steps) {
        bound.copy(layout.ship(), layout.launched(), 4);
    }
    let count = shares.len() as f64;
    // Q differs between the runs by the spread of their headings only.
    let noise = shares.iter().fold(&shares[0].noise * 0.0, |sum, share| sum + &share.noise / count);
    let transitions: Vec<DMatrix<f64>> = shares.iter().map(|share| share.transition.clone()).collect();
    bound.advance(&with_ship(case, layout, &Moments::of(&transitions, noise)));
    let mut information: Option<DMatrix<f64>> = None;
    for share in shares {
        if let Some(of_run) = &share.information {
            *information.get_or_insert_with(|| DMatrix::zeros(layout.len(), layout.len())) += of_run / count;
        }
    }
    if let Some(information) = &information {
        bound.learn(information);
    }
}

impl Track<'_> {
    fn step(&mut self) -> TrackShare {
        let (layout, case) = (self.layout, self.case);
        let steps = self.world.steps;
        if DeclaredWorld::launches(steps) {
            self.bound.copy(layout.ship(), layout.launched(), 4);
        }
        let smooth = motion::to_smooth(&self.world.state);
        let half = transition(case, &self.world, &smooth, 0.5 * STEP_S);
        let transition = transition(case, &self.world, &smooth, STEP_S);
        let own = Moments { noise: noise(case, &smooth, &half, &transition), transition, excess: None };
        self.bound.advance(&with_ship(case, layout, &own));

        let mut arrival = None;
        for _ in 0..GRID_STEPS {
            self.world.step();
            arrival = self.world.arrival.or(arrival);
        }
        let measured = self.measured(arrival);
        let information = (!measured.is_empty()).then(|| {
            let mut information = DMatrix::zeros(layout.len(), layout.len());
            measured.iter().for_each(|measured| measured.add_to(&mut information));
            information
        });
        if let Some(information) = &information {
            self.bound.learn(information);
        }
        if self.world.steps.is_multiple_of(SECOND_STEPS) {
            self.least.push(Least::of(&self.bound));
        }
        TrackShare { transition: own.transition, noise: own.noise, information }
    }

    /// What is measured at the present step, and what arrived on the way to it.
    fn measured(&self, arrival: Option<RangeArrival>) -> Vec<Sensed> {
        let (layout, case, steps) = (self.layout, self.case, self.world.steps);
        let sensors = &case.options.navigation.sensors;
        let mut y = DVector::zeros(layout.len());
        y.rows_mut(0, 12).copy_from(&motion::to_smooth(&self.world.state));
        y.rows_mut(12, layout.effects).copy_from_slice(&self.world.effects);
        let due = |every: u64| steps.is_multiple_of(every);
        let direct = |first: usize, count: usize, sigma: f64| {
            let mut gradient = DMatrix::zeros(count, layout.len());
            (0..count).for_each(|i| gradient[(i, first + i)] = 1.0);
            Sensed { gradient, variances: vec![sigma * sigma; count] }
        };
        let mut out = Vec::new();
        let part = |y: &DVector<f64>, at: usize| Vector3::new(y[at], y[at + 1], y[at + 2]);
        if due(DEPTH_STEPS) {
            out.push(direct(2, 1, sensors.depth_m));
        }
        if due(AHRS_STEPS) {
            out.push(Sensed {
                variances: sensors.angles_rad().map(|sigma| sigma * sigma).to_vec(),
                ..direct(3, 3, 1.0)
            });
            let rates = |y: &DVector<f64>| as_vector(motion::rates_by_euler_rates(&part(y, 3)) * part(y, 9));
            out.push(Sensed {
                gradient: motion::gradient(rates, &y, &[3, 4, 9, 10, 11]),
                variances: vec![sensors.rates_radps.powi(2); 3],
            });
        }
        let current =
            case.effects.iter().position(|prior| prior.effect == DeclaredEffect::CurrentNorth).map(|at| 12 + at);
        let ground = |y: &DVector<f64>| {
            let [north, east] = current.map_or([0.0; 2], |at| [y[at], y[at + 1]]);
            part(y, 6) + Vector3::new(north, east, 0.0)
        };
        let currents = current.into_iter().flat_map(|at| [at, at + 1]);
        if due(DVL_STEPS) && case.options.use_dvl {
            let track = |y: &DVector<f64>| as_vector(motion::rotation(&part(y, 3)).tr_mul(&ground(y)));
            let columns: Vec<usize> = (3..9).chain(currents.clone()).collect();
            out.push(Sensed {
                gradient: motion::gradient(track, &y, &columns),
                variances: vec![sensors.dvl_mps.powi(2); 3],
            });
        }
        if due(SECOND_STEPS) {
            out.push(direct(layout.ship(), 2, sensors.ship_gnss_m));
        }
        if let Some(arrival) = arrival {
            let clock =
                case.effects.iter().position(|prior| prior.effect == DeclaredEffect::ClockOffset).map(|at| 12 + at);
            let launched = layout.launched();
            y.rows_mut(0, 3).copy_from_slice(&arrival.position_m);
            let carried = ground(&y) - part(&y, 6);
            y.rows_mut(6, 3).copy_from(&(Vector3::from(arrival.velocity_mps) - carried));
            y.rows_mut(launched, 4).copy_from_slice(&arrival.ship);
            let sound = |y: &DVector<f64>| {
                let dp = part(y, 0) - Vector3::new(y[launched], y[launched + 1], 0.0);
                let dv = ground(y) - Vector3::new(y[launched + 2], y[launched + 3], 0.0);
                let late = clock.map_or(0.0, |at| case.options.navigation.sound_speed_mps * y[at]);
                DVector::from_vec(vec![dp.norm() + late, dp.dot(&dv) / dp.norm()])
            };
            let columns: Vec<usize> =
                (0..3).chain(6..9).chain(currents).chain(clock).chain(launched..launched + 4).collect();
            out.push(Sensed {
                gradient: motion::gradient(sound, &y, &columns),
                variances: vec![sensors.range_m.powi(2), sensors.range_rate_mps.powi(2)],
            });
        }
        out
    }
}

fn as_vector(v: Vector3<f64>) -> DVector<f64> {
    DVector::from_column_slice(v.as_slice())
}

/// Of vehicle and effects over `step_s`.
fn transition(case: &DeclaredCase, world: &DeclaredWorld, smooth: &Smooth, step_s: f64) -> DMatrix<f64> {
    let own = Layout::VEHICLE + case.effects.len();
    let drag = case.effects.iter().position(|prior| prior.effect == DeclaredEffect::LinearDrag);
    let value = drag.map(|_| world.effect(DeclaredEffect::LinearDrag));
    let vehicle = case.motion.transition(smooth, &world.actuators, step_s, value);
    let mut out = DMatrix::identity(own, own);
    out.view_mut((0, 0), (12, 12)).copy_from(&vehicle.columns(0, 12));
    for (at, prior) in (12..).zip(&case.effects) {
        match prior.effect {
            DeclaredEffect::CurrentNorth => out[(0, at)] = step_s,
            DeclaredEffect::CurrentEast => out[(1, at)] = step_s,
            DeclaredEffect::LinearDrag => out.view_mut((0, at), (12, 1)).copy_from(&vehicle.columns(12, 1)),
            DeclaredEffect::ClockOffset => {}
        }
    }
    out
}

/// Q = ∫ Φ(s) G S Gᵀ Φ(s)ᵀ ds by Simpson's rule, exact where Φ is linear in s; Φ at the step's middle and end.
fn noise(case: &DeclaredCase, smooth: &Smooth, half: &DMatrix<f64>, whole: &DMatrix<f64>) -> DMatrix<f64> {
    let mut driven = motion::noise_input(smooth);
    for (mut column, density) in driven.column_iter_mut().zip(case.densities()) {
        column *= density;
    }
    let spread = |transition: &DMatrix<f64>| {
        let moved = transition.view((0, 0), (12, 12)) * &driven;
        &moved * moved.transpose()
    };
    let vehicle = (&driven * driven.transpose() + 4.0 * spread(half) + spread(whole)) * (STEP_S / 6.0);
    let own = Layout::VEHICLE + case.effects.len();
    let mut out = DMatrix::zeros(own, own);
    out.view_mut((0, 0), (12, 12)).copy_from(&vehicle);
    for (at, prior) in (12..).zip(&case.effects) {
        let q = prior.walk * prior.walk;
        out[(at, at)] = q * STEP_S;
        let position = match prior.effect {
            DeclaredEffect::CurrentNorth => 0,
            DeclaredEffect::CurrentEast => 1,
            // Their random walk within the step is not yet felt.
            DeclaredEffect::LinearDrag | DeclaredEffect::ClockOffset => continue,
        };
        out[(position, position)] += q * STEP_S.powi(3) / 3.0;
        out[(position, at)] += q * STEP_S.powi(2) / 2.0;
        out[(at, position)] += q * STEP_S.powi(2) / 2.0;
    }
    out
}

/// With the ship, which moves at constant velocity under white acceleration, and its copy, which stays.
fn with_ship(case: &DeclaredCase, layout: Layout, own: &Moments) -> Moments {
    let (n, at) = (own.transition.nrows(), layout.ship());
    let mut transition = DMatrix::identity(layout.len(), layout.len());
    transition.view_mut((0, 0), (n, n)).copy_from(&own.transition);
    let mut noise = DMatrix::zeros(layout.len(), layout.len());
    noise.view_mut((0, 0), (n, n)).copy_from(&own.noise);
    let q = case.options.navigation.ship_noise.linear_mps2_per_sqrt_hz.powi(2);
    for (position, velocity) in [(at, at + 2), (at + 1, at + 3)] {
        transition[(position, velocity)] = STEP_S;
        noise[(position, position)] = q * STEP_S.powi(3) / 3.0;
        noise[(position, velocity)] = q * STEP_S.powi(2) / 2.0;
        noise[(velocity, position)] = q * STEP_S.powi(2) / 2.0;
        noise[(velocity, velocity)] = q * STEP_S;
    }
    let excess = own.excess.as_ref().map(|own| {
        let mut excess = DMatrix::zeros(layout.len(), layout.len());
        excess.view_mut((0, 0), (n, n)).copy_from(own);
        excess
    });
    Moments { transition, excess, noise }
}

/// P0 in the coordinates of the bound, at the prior's mean.
fn prior_covariance(case: &DeclaredCase, layout: Layout) -> DMatrix<f64> {
    let x = &case.vehicle_prior.state;
    let in_filter = |x: &DVector<f64>| {
        let part = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let state = hil_sim::truth::State::new(part(0), part(3), part(6), part(9));
        DVector::from_column_slice(motion::to_smooth(&state).as_slice())
    };
    let all: Vec<usize> = (0..12).collect();
    let turned = motion::gradient(in_filter, &DVector::from_column_slice(x.as_slice()), &all);
    let sigma = DMatrix::from_diagonal(&DVector::from_column_slice(case.vehicle_prior.sigma.map(|s| s * s).as_slice()));
    let mut out = DMatrix::zeros(layout.len(), layout.len());
    out.view_mut((0, 0), (12, 12)).copy_from(&(&turned * sigma * turned.transpose()));
    for (at, prior) in (12..).zip(&case.effects) {
        out[(at, at)] = prior.sigma * prior.sigma;
    }
    for (i, of) in [0, 1, 3, 4].into_iter().enumerate() {
        out[(layout.ship() + i, layout.ship() + i)] = case.ship_prior.sigma[of].powi(2);
    }
    out
}
