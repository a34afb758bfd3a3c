//! The vehicle's half of the decentralized extended information filter.

use super::discretisation::{integral, inverse_transition, noise};
use super::information::{Information, NotPositive, Step, cholesky, root, symmetric};
use super::ship::{Delta, STATES};
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel, kinematic_linearise};
use backseat_core::navigation::{InitialState, NavigationConfig, ProcessModel};
use backseat_core::state::{self, P, PHI, PSI, U, VEHICLE_STATES, VehicleState, X, Y, Z, wrap_angle};
use backseat_logs::{Column, LogRow};
use nalgebra::{Matrix2, SMatrix, SVector, Vector3};

/// Where the current stands.
const CURRENT: usize = VEHICLE_STATES;
/// Vehicle and current.
pub const OWN: usize = CURRENT + 2;
/// Where the ship at its last launch stands: x, y, ẋ, ẏ.
const SHIP: usize = OWN;
/// All states kept between packets.
pub const ALL: usize = SHIP + STATES;
/// All states while a packet is folded in: the ship at this launch is appended.
const FOLDED: usize = ALL + STATES;
/// White noises of a step: twelve of the vehicle, two for each axis of the current.
const NOISES: usize = VEHICLE_STATES + 4;
/// Longest step of a prediction, µs, as in the centralized filter.
const STEP_US: u64 = 100_000;

/// Mean and covariance of vehicle and current.
pub type Moments = (SVector<f64, OWN>, SMatrix<f64, OWN, OWN>);

/// Why a packet or a step was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeifError {
    /// The packet continues from a launch that is not the last one received.
    #[error("the packet continues from a launch that was not received")]
    OtherOrigin,
    /// Λ has lost its definiteness.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
}

/// Information over [vehicle 12 | current 2 | ship at the launch of the last packet 4].
pub struct Deif {
    model: VehicleModel,
    config: NavigationConfig,
    time_us: u64,
    information: Information<ALL, 1>,
    /// Where the vehicle's model is linearised next.
    point: VehicleState,
    /// Launch of the last packet.
    ship_us: Option<u64>,
}

impl Deif {
    /// From the same prior as the centralized filter. What is not estimated (the current if not
    /// configured, the ship before its first packet) has unit information that nothing touches.
    #[must_use]
    pub fn new(time_us: u64, initial: &InitialState, config: &NavigationConfig, model: &VehicleModel) -> Self {
        let mut information = Information::none();
        for i in 0..VEHICLE_STATES {
            information.know(i, [initial.state[i]], initial.sigma[i]);
        }
        let current_sigma = config.effect_states.current().map_or(1.0, |current| current.initial_sigma);
        for i in CURRENT..ALL {
            information.know(i, [0.0], if i < SHIP { current_sigma } else { 1.0 });
        }
        Self { model: model.clone(), config: *config, time_us, information, point: initial.state, ship_us: None }
    }

    /// Filter time, µs.
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.time_us
    }

    /// Linearises at `point` from here on (heading taken the short way) instead of where the
    /// filter's own steps have led.
    pub fn linearise_at(&mut self, point: &VehicleState) {
        let heading = self.point[PSI] + wrap_angle(point[PSI] - self.point[PSI]);
        self.point = *point;
        self.point[PSI] = heading;
    }

    /// Equal steps of at most 0.1 s under a constant input.
    ///
    /// # Errors
    /// Λ is no longer definite.
    pub fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> Result<(), NotPositive> {
        let gap_us = to_us.saturating_sub(self.time_us);
        let steps = gap_us.div_ceil(STEP_US);
        for _ in 0..steps {
            self.step(gap_us as f64 * 1e-6 / steps as f64, input)?;
        }
        self.time_us = to_us;
        Ok(())
    }

    fn step(&mut self, h: f64, input: &ActuatorInput) -> Result<(), NotPositive> {
        let dynamic = self.config.process_model == ProcessModel::Dynamic;
        let linearisation =
            if dynamic { self.model.linearise(&self.point, input) } else { kinematic_linearise(&self.point) };
        let (f, jacobian) = (linearisation.f, linearisation.F());
        let noises = match &self.config.surface {
            Some(surface) if self.point[Z] < surface.depth_m => &surface.noise,
            _ => &self.config.process_noise,
        };
        let mut q = SMatrix::<f64, VEHICLE_STATES, VEHICLE_STATES>::zeros();
        for i in 0..3 {
            q[(U + i, U + i)] = noises.linear_mps2_per_sqrt_hz[i].powi(2);
            q[(P + i, P + i)] = noises.angular_radps2_per_sqrt_hz[i].powi(2);
        }
        let mut step =
            Step { inverse: SMatrix::identity(), shift: SVector::zeros(), noise: SMatrix::<f64, ALL, NOISES>::zeros() };
        step.inverse.fixed_view_mut::<12, 12>(0, 0).copy_from(&inverse_transition(&jacobian, h));
        step.noise.fixed_view_mut::<12, 12>(0, 0).copy_from(&root(noise(&jacobian, q, h))?);
        // Pseudo-input of (2.5), corrected: f − F x*.
        let pseudo_input = f - jacobian * self.point;
        step.shift.fixed_rows_mut::<12>(0).copy_from(&integral(&jacobian, pseudo_input, h));
        if let Some(current) = self.config.effect_states.current() {
            let walk =
                Matrix2::new(h * h * h / 3.0, h * h / 2.0, h * h / 2.0, h) * current.random_walk_per_sqrt_s.powi(2);
            let walk = if walk[(1, 1)] > 0.0 { root(walk)? } else { walk };
            for axis in 0..2 {
                step.inverse[(X + axis, CURRENT + axis)] = -h;
                for k in 0..2 {
                    step.noise[(X + axis, VEHICLE_STATES + 2 * axis + k)] = walk[(0, k)];
                    step.noise[(CURRENT + axis, VEHICLE_STATES + 2 * axis + k)] = walk[(1, k)];
                }
            }
        }
        self.point += integral(&jacobian, f, h);
        self.information.predict(&step)
    }

    /// Depth, attitude, rates and vehicle GNSS of a row; all linear.
    pub fn fuse(&mut self, row: &LogRow) {
        let sensors = self.config.sensors;
        if let Some(depth_m) = row.get(Column::Depth) {
            self.information.know(Z, [depth_m], sensors.depth_m);
        }
        for (axis, angle) in row.attitude_rad().into_iter().flatten().enumerate() {
            let here = self.point[PHI + axis];
            self.information.know(PHI + axis, [here + wrap_angle(angle - here)], sensors.angles_rad()[axis]);
        }
        for (axis, rate) in row.rates_radps().into_iter().flatten().enumerate() {
            self.information.know(P + axis, [rate], sensors.rates_radps);
        }
        for (axis, position) in row.gnss_m().into_iter().flatten().enumerate() {
            self.information.know(X + axis, [position], sensors.gnss_m);
        }
    }

    /// Folds a packet's delta in: the ship at this launch is appended, the one at the launch before
    /// is marginalised out by the Schur complement.
    ///
    /// # Errors
    /// [`DeifError::OtherOrigin`], and nothing is changed.
    pub fn receive(&mut self, delta: &Delta) -> Result<(), DeifError> {
        if delta.origin_us != self.ship_us {
            return Err(DeifError::OtherOrigin);
        }
        let mut lambda = SMatrix::<f64, FOLDED, FOLDED>::zeros();
        let mut eta = SVector::<f64, FOLDED>::zeros();
        lambda.fixed_view_mut::<ALL, ALL>(0, 0).copy_from(&self.information.lambda);
        eta.fixed_rows_mut::<ALL>(0).copy_from(&self.information.eta);
        for axis in 0..2 {
            let place = [SHIP, SHIP + 2, ALL, ALL + 2].map(|at| at + axis);
            for (i, &row) in place.iter().enumerate() {
                eta[row] += delta.information.eta[(i, axis)];
                for (j, &column) in place.iter().enumerate() {
                    lambda[(row, column)] += delta.information.lambda[(i, j)];
                }
            }
        }
        // Kept: vehicle, current, ship at this launch.
        let kept: [usize; ALL] = std::array::from_fn(|i| if i < SHIP { i } else { i + STATES });
        let keep = SMatrix::<f64, ALL, ALL>::from_fn(|i, j| lambda[(kept[i], kept[j])]);
        let cross = SMatrix::<f64, STATES, ALL>::from_fn(|i, j| lambda[(SHIP + i, kept[j])]);
        let old = cholesky(lambda.fixed_view::<STATES, STATES>(SHIP, SHIP).into_owned())?;
        let old_eta = eta.fixed_rows::<STATES>(SHIP).into_owned();
        self.information = Information {
            lambda: symmetric(keep - cross.tr_mul(&old.solve(&cross))),
            eta: SVector::<f64, ALL>::from_fn(|i, _| eta[kept[i]]) - cross.tr_mul(&old.solve(&old_eta)),
        };
        self.ship_us = Some(delta.launch_us);
        Ok(())
    }

    /// Range (2.34) from the ship at the launch of the last packet to the vehicle now.
    ///
    /// # Errors
    /// Λ is no longer definite.
    pub fn range(&mut self, range_m: f64) -> Result<(), NotPositive> {
        let x = self.information.moments()?.0;
        let (dp, distance_m) = self.baseline(&x);
        let gradient = [dp / distance_m, Vector3::zeros()];
        self.acoustic(&x, gradient, range_m - distance_m, self.config.sensors.range_m);
        Ok(())
    }

    /// Range rate (2.39) over the same path.
    ///
    /// # Errors
    /// Λ is no longer definite.
    pub fn range_rate(&mut self, range_rate_mps: f64) -> Result<(), NotPositive> {
        let x = self.information.moments()?.0;
        let (dp, distance_m) = self.baseline(&x);
        let rotation = attitude(&x).rotation();
        let ground = rotation * nu(&x) + self.current_of(Vector3::new(x[CURRENT], x[CURRENT + 1], 0.0));
        let dv = ground - Vector3::new(x[SHIP + 2], x[SHIP + 3], 0.0);
        let direction = dp / distance_m;
        let rate = direction.dot(&dv);
        let gradient = [(dv - direction * rate) / distance_m, direction];
        self.acoustic(&x, gradient, range_rate_mps - rate, self.config.sensors.range_rate_mps);
        Ok(())
    }

    /// p_vehicle − p_ship and its length.
    fn baseline(&self, x: &SVector<f64, ALL>) -> (Vector3<f64>, f64) {
        let dp = Vector3::new(x[X] - x[SHIP], x[Y] - x[SHIP + 1], x[Z] - self.config.ship_transducer_depth_m);
        (dp, dp.norm())
    }

    /// A scalar with its gradient by dp and dv: z = h x̂ + ν.
    fn acoustic(&mut self, x: &SVector<f64, ALL>, by: [Vector3<f64>; 2], innovation: f64, sigma: f64) {
        let [position, velocity] = by;
        let attitude = attitude(x);
        let mut h = SVector::<f64, ALL>::zeros();
        h.fixed_rows_mut::<3>(X).copy_from(&position);
        h.fixed_rows_mut::<3>(PHI).copy_from(&attitude.rotated_by_attitude(&nu(x)).tr_mul(&velocity));
        h.fixed_rows_mut::<3>(U).copy_from(&attitude.rotation().tr_mul(&velocity));
        h.fixed_rows_mut::<2>(CURRENT).copy_from(&self.current_of(velocity).xy());
        h.fixed_rows_mut::<2>(SHIP).copy_from(&-position.xy());
        h.fixed_rows_mut::<2>(SHIP + 2).copy_from(&-velocity.xy());
        self.information.observe(&h, [h.dot(x) + innovation], sigma * sigma);
    }

    /// `a` where the current is estimated, else zero.
    fn current_of(&self, a: Vector3<f64>) -> Vector3<f64> {
        if self.config.effect_states.current().is_some() { a } else { Vector3::zeros() }
    }

    /// Mean (heading wrapped) and covariance of vehicle and current.
    ///
    /// # Errors
    /// Λ is no longer definite.
    pub fn moments(&self) -> Result<Moments, NotPositive> {
        let (mean, covariance) = self.information.moments()?;
        let mut own = mean.fixed_rows::<OWN>(0).into_owned();
        own[PSI] = wrap_angle(own[PSI]);
        Ok((own, covariance.fixed_view::<OWN, OWN>(0, 0).into_owned()))
    }
}

fn attitude(x: &SVector<f64, ALL>) -> Attitude {
    Attitude::new(&state::attitude(&x.fixed_rows::<VEHICLE_STATES>(0).into_owned()))
}

fn nu(x: &SVector<f64, ALL>) -> Vector3<f64> {
    x.fixed_rows::<3>(U).into_owned()
}
