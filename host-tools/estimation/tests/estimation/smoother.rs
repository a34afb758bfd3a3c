//! The smoother against a batch solution of the same linearised model.

use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::{
    AcousticPath, EffectState, EffectStates, Filter, InitialShip, InitialState, LinearStep, Measurement,
    NavigationConfig, Navigator, Observer, Priors, Sensor, ShipEnd, ShipReport, StateParameter, VehicleEnd,
};
use backseat_core::state::{PSI, U, VehicleState, X, Y};
use backseat_estimation::filter::FilterOptions;
use backseat_estimation::smoother::Recording;
use backseat_logs::VehicleFile;
use nalgebra::{DMatrix, DVector};

/// Every error of the model at once: e = A θ + b is the state minus the filter's estimate, where θ holds the errors of
/// the start and of every step. A measurement is a line of G θ + v = r.
struct Batch {
    a: DMatrix<f64>,
    b: DVector<f64>,
    /// Covariance of the filter, stepped densely.
    p: DMatrix<f64>,
    /// Covariance of θ.
    prior: DMatrix<f64>,
    rows: Vec<DVector<f64>>,
    residuals: Vec<f64>,
    variances: Vec<f64>,
    samples: Vec<(DMatrix<f64>, DVector<f64>, VehicleState)>,
}

/// Variance that is none but rounding.
const NOTHING: f64 = 1.0e-10;

impl Batch {
    /// Nothing is measured yet.
    fn new(filter: &Filter) -> Self {
        let n = filter.dimension();
        let p = covariance(filter);
        Self {
            a: DMatrix::identity(n, n),
            b: DVector::zeros(n),
            prior: p.clone(),
            p,
            rows: Vec::new(),
            residuals: Vec::new(),
            variances: Vec::new(),
            samples: Vec::new(),
        }
    }

    /// Adds independent errors of covariance `noise` to e.
    fn disturb(&mut self, noise: &DMatrix<f64>) {
        let (n, old) = (self.a.nrows(), self.prior.nrows());
        self.prior = self.prior.clone().resize(old + n, old + n, 0.0);
        self.prior.view_mut((old, old), (n, n)).copy_from(noise);
        self.a = self.a.clone().resize(n, old + n, 0.0);
        self.a.view_mut((0, old), (n, n)).fill_with_identity();
        self.p += noise;
    }

    fn map(&mut self, by: &DMatrix<f64>) {
        (self.a, self.b) = (by * &self.a, by * &self.b);
        self.p = by * &self.p * by.transpose();
    }

    /// The filter's covariance, and so the noise that it has added since.
    fn agree(&mut self, filter: &Filter) {
        let p = covariance(filter);
        let noise = &p - &self.p;
        if noise.amax() > NOTHING {
            self.disturb(&noise);
        }
        self.p = p;
    }

    /// Keeps the time for a comparison.
    fn sample(&mut self, filter: &Filter) {
        self.samples.push((self.a.clone(), self.b.clone(), *filter.state()));
    }

    fn solution(&self) -> (DVector<f64>, DMatrix<f64>) {
        let g = DMatrix::from_fn(self.rows.len(), self.prior.nrows(), |i, j| {
            self.rows[i].as_slice().get(j).copied().unwrap_or(0.0)
        });
        let cross = &self.prior * g.transpose();
        let noise = DMatrix::from_diagonal(&DVector::from_vec(self.variances.clone()));
        let solver = (&g * &cross + noise).cholesky().unwrap();
        let mean = &cross * solver.solve(&DVector::from_vec(self.residuals.clone()));
        let covariance = &self.prior - &cross * solver.solve(&cross.transpose());
        (mean, covariance)
    }
}

impl Observer for Batch {
    fn observe(&mut self, step: &LinearStep<'_>) {
        let n = self.a.nrows();
        match step {
            LinearStep::Transition(transition) => {
                let mut columns = vec![[0.0; 12]; transition.live()];
                transition.vehicle_rows(&mut columns);
                let mut phi = DMatrix::identity(n, n);
                for (j, column) in columns.iter().enumerate() {
                    (0..12).for_each(|i| phi[(i, j)] = column[i]);
                }
                transition.others().for_each(|(i, j, value)| phi[(i, j)] += value);
                self.map(&phi);
            }
            LinearStep::Update(update) => {
                let mut h = DVector::zeros(n);
                update.row().for_each(|(i, value)| h[i] += value);
                let gain = DVector::from_column_slice(update.gain);
                // K S = (P + D) hᵀ, with D a floor that was put under P just before.
                let added = &gain * update.variance - &self.p * &h;
                if added.amax() > NOTHING {
                    let floor = DVector::from_fn(n, |i, _| if h[i] == 0.0 { 0.0 } else { added[i] / h[i] });
                    self.disturb(&DMatrix::from_diagonal(&floor));
                }
                self.rows.push(self.a.tr_mul(&h));
                self.residuals.push(update.innovation - h.dot(&self.b));
                self.variances.push(update.variance - h.dot(&(&self.p * &h)));
                self.b -= &gain * update.innovation;
                self.p -= &gain * gain.transpose() * update.variance;
            }
            LinearStep::Append(states) => {
                let mut by = DMatrix::identity(n, n).resize(n + states.count(), n, 0.0);
                for i in 0..states.count() {
                    states.row(i).for_each(|(j, value)| by[(n + i, j)] += value);
                }
                self.map(&by);
            }
            LinearStep::Refused(_) => {}
            LinearStep::Insert { .. } => panic!("the ship is there from the start"),
            LinearStep::Remove { at, count } => {
                self.a = self.a.clone().remove_rows(*at, *count);
                self.b = self.b.clone().remove_rows(*at, *count);
                self.p = self.p.clone().remove_rows(*at, *count).remove_columns(*at, *count);
            }
        }
    }
}

/// P of the filter.
fn covariance(filter: &Filter) -> DMatrix<f64> {
    DMatrix::from_fn(filter.dimension(), filter.dimension(), |i, j| filter.propagated_covariance(i, j))
}

fn start() -> Recording {
    let vehicle = VehicleFile::reference();
    // All states that there are; nothing is refused.
    let rate = |axis| EffectState {
        parameter: StateParameter::CurrentRate(axis),
        initial_sigma: 1.0e-4,
        random_walk_per_sqrt_s: 1.0e-6,
    };
    let robust = EffectStates::robust(&Priors::DEFAULT);
    let states = robust.with_state(rate(0)).and_then(|states| states.with_state(rate(1))).unwrap();
    let config = NavigationConfig {
        gate_sigma: 1.0e3,
        bank: false,
        effect_states: states,
        ..FilterOptions::robust(&vehicle).navigation
    };
    let mut recording = recording(&config);
    let ship = InitialShip { state: [200.0, 50.0, 0.0, 0.3, 0.2, 0.0], sigma: [0.5, 0.5, 0.1, 0.15, 0.15, 0.01] };
    recording.initialise_ship(&ship).unwrap();
    recording.keep();
    recording
}

/// The reference vehicle on its way at 3 m depth.
fn recording(config: &NavigationConfig) -> Recording {
    let model = VehicleModel::new(&VehicleFile::reference().parameters).unwrap();
    let mut navigator = Box::new(Navigator::new());
    navigator.configure(config, &model).unwrap();
    let mut state = VehicleState::zeros();
    (state[2], state[PSI], state[U]) = (3.0, 0.4, 1.0);
    let sigma = VehicleState::from_column_slice(&[1.0, 1.0, 0.1, 0.02, 0.02, 0.02, 0.1, 0.05, 0.05, 0.02, 0.02, 0.02]);
    navigator.initialise(0, &InitialState { state, sigma }).unwrap();
    Recording::new(navigator)
}

/// Four seconds with every kind of step; the readings are off by up to two sigmas.
#[test]
fn val_smoother_equals_the_batch_solution() {
    let mut recording = start();
    let [Some(main), ..] = recording.members() else { panic!("the filter runs") };
    let mut reference = main.filter.clone();
    let mut batch = Batch::new(&reference);
    let mut clone = None;
    for k in 1..=40_u64 {
        let phase = k as f64;
        let input = ActuatorInput { propeller_radps: 106.0, fins_rad: [0.02 * (0.3 * phase).sin(), 0.0, 0.01, -0.01] };
        recording.predict(k * 100_000, &input).unwrap();
        reference.predict(k * 100_000, &input, &mut batch).unwrap();
        batch.agree(&reference);
        let state = *reference.state();
        let mut measurements = Vec::new();
        if k % 2 == 0 {
            measurements.push(Measurement::Depth { z_m: state[2] + 0.1 * phase.sin() });
        }
        if k % 3 == 0 {
            let error = 0.03 * phase.cos();
            measurements
                .push(Measurement::Attitude { euler_rad: [state[3] + error, state[4] - error, state[5] + error] });
        }
        if k % 10 == 0 {
            let [x, y, ..] = reference.ship_state().unwrap();
            measurements.push(Measurement::ShipGnss { position_m: [x + 0.6, y - 0.4] });
        }
        if let Some(id) = clone.filter(|_| k % 10 == 5) {
            let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Delayed(id) };
            measurements.push(Measurement::Range { path, range_m: 205.0 });
            measurements.push(Measurement::RangeRate { path, range_rate_mps: -0.5 });
        }
        for measurement in &measurements {
            recording.fuse(measurement);
            reference.fuse(measurement, &mut batch);
        }
        match clone {
            None if k % 10 == 1 => {
                clone = recording.clone_ship().ok();
                reference.clone_ship(&mut batch).unwrap();
            }
            Some(id) if k % 10 == 5 => {
                recording.drop_clone(id);
                reference.drop_clone(id, &mut batch);
                clone = None;
            }
            _ => {}
        }
        recording.sample();
        batch.sample(&reference);
    }
    assert!(batch.rows.len() > 70, "{} scalars", batch.rows.len());
    assert_eq!(recording.digest(), reference.digest());

    let (theta, covariance) = batch.solution();
    let smoothed = recording.smooth();
    assert_eq!(smoothed.len(), batch.samples.len());
    let mut moved = 0.0_f64;
    for (sample, (a, b, filtered)) in smoothed.iter().zip(&batch.samples) {
        let known = a.ncols();
        let e = a * theta.rows(0, known) + b;
        let p = a * covariance.view((0, 0), (known, known)) * a.transpose();
        for i in 0..12 {
            // Relative to the uncertainty: the batch inverts a matrix with a condition number of about 1e6.
            let error = (sample.state[i] - filtered[i] - e[i]) / p[(i, i)].sqrt();
            assert!(error.abs() < 1.0e-6, "state {i}: {error:e} sigmas");
            let ratio = sample.sigma[i] / p[(i, i)].sqrt() - 1.0;
            assert!(ratio.abs() < 1.0e-6, "sigma {i}: {ratio:e}");
            moved = moved.max(e[i].abs() / p[(i, i)].sqrt());
        }
    }
    assert!(moved > 0.5, "smoothing moved the estimate by {moved} sigmas at most: the test sees nothing");
}

/// Ranges and a compass that contradict the filter, are suspect, return and stay unconfirmed: P grows and has floors put
/// under it. In the end a fix comes, or none.
#[test]
fn val_smoother_equals_the_batch_solution_where_sources_are_suspect() {
    for has_fix in [false, true] {
        let mut recording = recording(&NavigationConfig { surface: None, ..NavigationConfig::REFERENCE });
        recording.keep();
        let [Some(main), ..] = recording.members() else { panic!("the filter runs") };
        let mut reference = main.filter.clone();
        let mut batch = Batch::new(&reference);
        let mut stated_m2 = Vec::new();
        let input = ActuatorInput { propeller_radps: 106.0, fins_rad: [0.0, 0.0, 0.01, -0.01] };
        for second in 1..=75_u64 {
            recording.predict(second * 1_000_000, &input).unwrap();
            reference.predict(second * 1_000_000, &input, &mut batch).unwrap();
            batch.agree(&reference);
            let (x, k) = (*reference.state(), second as f64);
            let contradicts = |sensor, from| second >= from && reference.recoveries(sensor) == 0;
            let heading = if contradicts(Sensor::Attitude, 45) { 0.3 } else { 0.02 * k.cos() };
            let ship = [x[X] + 200.0, x[Y] + 20.0 * k - 500.0];
            let report =
                ShipReport { position_m: ship, velocity_mps: [0.0; 2], position_sigma_m: 0.5, velocity_sigma_mps: 0.1 };
            let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(report) };
            let innovation_m = if contradicts(Sensor::Range, 10) { 8.0 } else { k.sin() };
            let range_m = (x[X] - ship[0]).hypot(x[Y] - ship[1]).hypot(x[2]) + innovation_m;
            let mut measurements = vec![
                Measurement::Depth { z_m: x[2] + 0.1 * k.sin() },
                Measurement::Attitude { euler_rad: [x[3] + 0.01 * k.cos(), x[4] - 0.01, x[5] + heading] },
                Measurement::Range { path, range_m },
            ];
            if has_fix && second == 70 {
                measurements.push(Measurement::VehicleGnss { position_m: [x[X] + 1.0, x[Y] - 2.0] });
            }
            for measurement in &measurements {
                recording.fuse(measurement);
                reference.fuse(measurement, &mut batch);
                batch.agree(&reference);
            }
            recording.sample();
            batch.sample(&reference);
            stated_m2.push([X, Y].map(|i| reference.covariance(i, i) - reference.propagated_covariance(i, i)));
        }
        assert_eq!(recording.digest(), reference.digest());
        for sensor in [Sensor::Range, Sensor::Attitude] {
            assert_eq!(reference.recoveries(sensor), 1, "{sensor:?} was suspect");
            assert_eq!(reference.unconfirmed_sigma(sensor) == 0.0, has_fix, "{sensor:?} is confirmed by a fix");
        }
        let unconfirmed = stated_m2.iter().filter(|stated| stated[0] > 0.0).count();
        assert!(unconfirmed > 20, "ranges were unconfirmed for {unconfirmed} s");

        let (theta, covariance) = batch.solution();
        for ((sample, (a, b, filtered)), stated_m2) in recording.smooth().iter().zip(&batch.samples).zip(&stated_m2) {
            let known = a.ncols();
            let e = a * theta.rows(0, known) + b;
            let p = a * covariance.view((0, 0), (known, known)) * a.transpose();
            // Relative to the uncertainty; the tolerance as above.
            assert!((sample.cov_xy_m2 - p[(X, Y)]).abs() < 1.0e-6 * (p[(X, X)] * p[(Y, Y)]).sqrt());
            for i in 0..12 {
                let error = (sample.state[i] - filtered[i] - e[i]) / p[(i, i)].sqrt();
                assert!(error.abs() < 1.0e-6, "{} s, state {i}: {error:e} sigmas", sample.time_us / 1_000_000);
                let stated_m2 = stated_m2.get(i).copied().unwrap_or(0.0);
                let ratio = sample.sigma[i] / (p[(i, i)] + stated_m2).sqrt() - 1.0;
                assert!(ratio.abs() < 1.0e-6, "{} s, sigma {i}: {ratio:e}", sample.time_us / 1_000_000);
            }
        }
    }
}
