//! Measurement update, scalar by scalar, with the derivatives.

use super::{Filter, Kind, LANES, NONE, Residual, matrix};
use crate::log_effects::PathAt;
use crate::normal_equations::BlockEquationsBuilder;
use crate::regressors::{self, Snapshot, Target};
use crate::samples::{Reading, ResidualChannel, ShipAtLaunch};
use backseat_core::dynamics::Attitude;
use backseat_core::effects::SensorChannel;
use backseat_core::navigation::{models, triad};
use backseat_core::state::{self, P, PHI, PSI, U, V, VehicleState, X, Y, Z, wrap_angle};
use backseat_logs::log::Usbl;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Above this depth waves swing what a DVL reads: orbits of 4 s have a third of their speed there, exp(-ω² z / g).
const WAVES_REACH_M: f64 = 4.0;

type Jacobian = SMatrix<f64, 3, 12>;

/// A reading's prediction, linearised.
struct Prediction {
    sensor: SensorChannel,
    /// First channel and number of scalars.
    first: ResidualChannel,
    count: usize,
    /// h(x) of a perfect sensor.
    truth: [f64; 3],
    measured: [f64; 3],
    /// ∂(truth)/∂x.
    jacobian: Jacobian,
    variance: [f64; 3],
    /// Factor of noise that lasts on its sigma, which is for what is declared of the sensor.
    lasting: [f64; 3],
    /// Factor on the variance where neighbouring readings share a part of their errors.
    alike: f64,
    /// Rᵀ: what a velocity of the water adds to the scalars, by its north and east part.
    by_water: [[f64; 3]; 2],
    /// The acoustic path.
    path: PathAt,
}

impl Prediction {
    /// Length of the acoustic path; 0 where no range is read.
    fn distance_m(&self) -> f64 {
        let is_range = matches!(self.sensor, SensorChannel::Range | SensorChannel::TwoWayRange);
        if is_range { self.truth[0] } else { 0.0 }
    }
}

/// The vehicle's transducer minus the ship's.
struct Baseline {
    /// NED, m.
    dp: Vector3<f64>,
    /// ∂dp/∂(φ, θ, ψ), m per rad.
    by_attitude: Matrix3<f64>,
}

impl Filter<'_> {
    /// Fuses a reading and records its innovations.
    pub(super) fn fuse(
        &mut self,
        reading: &Reading,
        residuals: &mut Vec<Residual>,
        rows: &mut BlockEquationsBuilder<'_, '_>,
    ) {
        let sensors = self.setup.sensors;
        let x = self.x;
        let direct = |sensor, first, at: usize, measured: &[f64], sigma: f64| {
            let mut prediction = Prediction {
                sensor,
                first,
                count: measured.len(),
                truth: [0.0; 3],
                measured: [0.0; 3],
                jacobian: Jacobian::zeros(),
                variance: [sigma * sigma; 3],
                lasting: [1.0; 3],
                alike: 1.0,
                by_water: [[0.0; 3]; 2],
                path: PathAt::default(),
            };
            for (i, value) in measured.iter().enumerate() {
                prediction.measured[i] = *value;
                prediction.truth[i] = x[at + i];
                prediction.jacobian[(i, at + i)] = 1.0;
            }
            prediction
        };
        match reading {
            Reading::Depth(z) => {
                let prediction = direct(SensorChannel::Depth, ResidualChannel::Depth, Z, &[*z], sensors.depth_m);
                self.update(&prediction, true, residuals, rows);
            }
            Reading::Attitude(euler) => {
                let prediction =
                    direct(SensorChannel::Attitude, ResidualChannel::Roll, PHI, euler, sensors.attitude_rad);
                self.update(&prediction, true, residuals, rows);
            }
            Reading::Rates(rates) => {
                let prediction = direct(SensorChannel::Rates, ResidualChannel::P, P, rates, sensors.rates_radps);
                self.update(&prediction, true, residuals, rows);
            }
            Reading::Gnss { position_m, alike } => {
                let mut prediction = direct(SensorChannel::Gnss, ResidualChannel::GnssX, X, position_m, sensors.gnss_m);
                // What they share is known where their noise is.
                if !self.colours.has(ResidualChannel::GnssX) {
                    prediction.alike = *alike;
                }
                self.update(&prediction, true, residuals, rows);
            }
            Reading::Dvl(velocity) => {
                let mut prediction = direct(SensorChannel::Dvl, ResidualChannel::DvlU, U, velocity, sensors.dvl_mps);
                self.add_bottom_track(&mut prediction);
                self.update(&prediction, true, residuals, rows);
            }
            Reading::Usbl { usbl, ship } => {
                let used = self.is_direct_path();
                if let Some(prediction) = self.usbl(usbl, ship) {
                    self.update(&prediction, used, residuals, rows);
                }
            }
            Reading::Acoustic { range_m, range_rate_mps, ship, two_way } => {
                let used = self.is_direct_path();
                if let Some(prediction) = range_m.and_then(|range_m| self.range(range_m, ship, *two_way)) {
                    self.update(&prediction, used, residuals, rows);
                }
                if let Some(prediction) = range_rate_mps.and_then(|rate| self.range_rate(rate, ship)) {
                    self.update(&prediction, true, residuals, rows);
                }
            }
        }
    }

    /// Whether the next acoustic reading is no outlier.
    fn is_direct_path(&mut self) -> bool {
        let is_out = self.setup.outliers.get(self.acoustic_index).copied().unwrap_or(false);
        self.acoustic_index += 1;
        !is_out
    }

    fn add_bottom_track(&self, prediction: &mut Prediction) {
        let attitude = Attitude::new(&state::attitude(&self.x));
        let track = models::bottom_track(&attitude, &self.model.water_mps(self.t_s).into());
        prediction.by_water = [0, 1].map(|axis| std::array::from_fn(|i| track.rotation[(axis, i)]));
        for (truth, current) in prediction.truth.iter_mut().zip(&track.current_in_body) {
            *truth += current;
        }
        prediction.jacobian.fixed_view_mut::<3, 3>(0, PHI).copy_from(&track.by_attitude);
    }

    fn range(&self, measured: f64, ship: &ShipAtLaunch, two_way: bool) -> Option<Prediction> {
        let baseline = self.baseline(ship);
        let path = models::distance(&baseline.dp)?;
        let attitude = Attitude::new(&state::attitude(&self.x));
        let mut jacobian = Jacobian::zeros();
        jacobian.fixed_view_mut::<1, 3>(0, X).tr_copy_from(&path.direction);
        jacobian.fixed_view_mut::<1, 3>(0, PHI).tr_copy_from(&baseline.by_attitude.tr_mul(&path.direction));
        let sensors = &self.setup.sensors;
        Some(Prediction {
            sensor: if two_way { SensorChannel::TwoWayRange } else { SensorChannel::Range },
            first: ResidualChannel::Range,
            count: 1,
            truth: [path.distance_m, 0.0, 0.0],
            measured: [measured, 0.0, 0.0],
            jacobian,
            variance: [sensors.range_m.powi(2) + horizontal(&path.direction) * ship.position_variance_m2; 3],
            lasting: [1.0; 3],
            alike: 1.0,
            by_water: [[0.0; 3]; 2],
            path: PathAt {
                body: attitude.rotation().tr_mul(&path.direction).into(),
                ned: path.direction.into(),
                station: ship.station.map(|(number, _)| number),
            },
        })
    }

    /// Along the measured direction and twice across it, as the flight filter takes it.
    fn usbl(&self, usbl: &Usbl, ship: &ShipAtLaunch) -> Option<Prediction> {
        let baseline = self.baseline(ship);
        let attitude = Attitude::new(&state::attitude(&self.x));
        let vector = Vector3::from(usbl.vector_m());
        let (measured, by_attitude) = match usbl.on_vehicle {
            true => (-(attitude.rotation() * vector), attitude.rotated_by_attitude(&vector)),
            false => (vector, Matrix3::zeros()),
        };
        let along = models::distance(&measured)?.direction;
        let axes = triad(&along);
        let mut jacobian = Jacobian::zeros();
        let (mut truth, mut variance, mut lasting) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let range_sigma_m = usbl.range_sigma_m.unwrap_or(self.setup.sensors.range_m);
        let across_m = usbl.range_m * usbl.angle_sigma_rad;
        for (i, (axis, sigma)) in axes.iter().zip([range_sigma_m, across_m, across_m]).enumerate() {
            truth[i] = axis.dot(&(baseline.dp - measured));
            jacobian.fixed_view_mut::<1, 3>(i, X).tr_copy_from(axis);
            let turned = (baseline.by_attitude + by_attitude).tr_mul(axis);
            jacobian.fixed_view_mut::<1, 3>(i, PHI).tr_copy_from(&turned);
            variance[i] = sigma * sigma + horizontal(axis) * ship.position_variance_m2;
            let channel = ResidualChannel::ALL[ResidualChannel::UsblAlong as usize + i];
            lasting[i] = sigma / channel.declared_sigma(&self.setup.sensors);
        }
        truth[0] += usbl.range_m;
        Some(Prediction {
            sensor: SensorChannel::Usbl,
            first: ResidualChannel::UsblAlong,
            count: 3,
            truth,
            measured: [usbl.range_m, 0.0, 0.0],
            jacobian,
            variance,
            lasting,
            alike: 1.0,
            by_water: [[0.0; 3]; 2],
            path: PathAt { ned: along.into(), ..PathAt::default() },
        })
    }

    fn range_rate(&self, measured: f64, ship: &ShipAtLaunch) -> Option<Prediction> {
        let attitude = Attitude::new(&state::attitude(&self.x));
        let nu = Vector3::new(self.x[U], self.x[U + 1], self.x[U + 2]);
        let over_ground = models::ground_velocity(&attitude, &nu, &self.model.water_mps(self.t_s).into());
        let [north, east] = ship.velocity_mps;
        // The transducer moves with ω × arm beside the centre of gravity; the derivatives of that are left out: a tenth
        // of a radian per second and half a metre of arm move it by 0.05 m/s.
        let rates = Vector3::new(self.x[P], self.x[P + 1], self.x[P + 2]);
        let swing = over_ground.rotation * rates.cross(&Vector3::from(self.setup.installation.transducer_arm_m));
        let dv = over_ground.velocity_mps + swing - Vector3::new(north, east, 0.0);
        let baseline = self.baseline(ship);
        let model = models::range_rate(&baseline.dp, &dv)?;
        let unit = model.by_velocity;
        let mut jacobian = Jacobian::zeros();
        jacobian.fixed_view_mut::<1, 3>(0, X).tr_copy_from(&model.by_position);
        let by_attitude = over_ground.by_attitude.tr_mul(&unit) + baseline.by_attitude.tr_mul(&model.by_position);
        jacobian.fixed_view_mut::<1, 3>(0, PHI).tr_copy_from(&by_attitude);
        jacobian.fixed_view_mut::<1, 3>(0, U).tr_copy_from(&over_ground.rotation.tr_mul(&unit));
        let sensors = &self.setup.sensors;
        Some(Prediction {
            sensor: SensorChannel::RangeRate,
            first: ResidualChannel::RangeRate,
            count: 1,
            truth: [model.range_rate_mps, 0.0, 0.0],
            measured: [measured, 0.0, 0.0],
            jacobian,
            variance: [sensors.range_rate_mps.powi(2) + horizontal(&unit) * ship.velocity_variance_m2ps2; 3],
            lasting: [1.0; 3],
            alike: 1.0,
            by_water: [[unit.x, 0.0, 0.0], [unit.y, 0.0, 0.0]],
            path: PathAt::default(),
        })
    }

    fn baseline(&self, ship: &ShipAtLaunch) -> Baseline {
        let [north, east] = ship.position_m;
        let installation = &self.setup.installation;
        let arm = Vector3::from(installation.transducer_arm_m);
        let attitude = Attitude::new(&state::attitude(&self.x));
        let other_m = ship.station.map_or(installation.ship_transducer_depth_m, |(_, depth_m)| depth_m);
        let depth = self.x[Z] - other_m;
        let dp = Vector3::new(self.x[X] - north, self.x[Y] - east, depth) + attitude.rotation() * arm;
        Baseline { dp, by_attitude: attitude.rotated_by_attitude(&arm) }
    }

    fn update(
        &mut self,
        prediction: &Prediction,
        used: bool,
        residuals: &mut Vec<Residual>,
        rows: &mut BlockEquationsBuilder<'_, '_>,
    ) {
        self.wake();
        let t_s = self.t_s;
        let x0 = self.x;
        let (read, by_truth) = self.model.read(t_s, prediction.sensor, prediction.truth, (&x0, prediction.path));
        let proposed = self.proposed_reading(prediction);
        let by_truth = Matrix3::from_fn(|i, j| by_truth[i][j]);
        let jacobian: Jacobian = by_truth * prediction.jacobian;
        let added = self.model.added_variance(prediction.sensor);
        if used && self.columns > 0 {
            self.set_direct(prediction, &x0, &read);
        }
        let untold = self.untold_by(prediction.sensor);
        let swings = prediction.sensor == SensorChannel::Dvl && x0[Z] < WAVES_REACH_M;
        let is_moved_by_waves = swings || !untold.is_empty();
        for axis in 0..prediction.count {
            let channel = ResidualChannel::ALL[prediction.first as usize + axis];
            let swing = if is_moved_by_waves { self.setup.swing[channel as usize] } else { 1.0 };
            let scale = swing * self.setup.scale[channel as usize];
            let h: [f64; 12] = std::array::from_fn(|i| jacobian[(axis, i)]);
            let mut moved = self.x - x0;
            moved[PSI] = wrap_angle(moved[PSI]);
            let (of, load) = ((channel, prediction.path.station), prediction.lasting[axis]);
            let lasting = load * self.colours.reading(of);
            let mut innovation =
                prediction.measured[axis] - read[axis] - proposed[axis] - lasting - dot(&h, &moved.into());
            if prediction.sensor == SensorChannel::Attitude {
                innovation = wrap_angle(innovation);
            }
            // P is symmetric.
            let mut ph = matrix::apply_turned(&self.p, &h);
            let lasting = self.colours.correlate(of, load, &h, &mut ph);
            let variance =
                dot(&h, &ph) + load * lasting + (prediction.variance[axis] + added) * scale * scale * prediction.alike;
            let sigma = variance.sqrt();
            let (alike, station) = (prediction.alike, prediction.path.station);
            residuals.push(Residual { t_s, channel, innovation, sigma, alike, used, station, is_moved_by_waves });
            if !used {
                continue;
            }
            let full_gain = ph.map(|value| value / variance);
            let gain: [f64; 12] = std::array::from_fn(|i| if untold.contains(&i) { 0.0 } else { full_gain[i] });
            self.slopes_of(prediction, axis, &h);
            for (value, place) in self.ordered.iter_mut().zip(&self.place) {
                *value = matrix::at(&self.row[place / LANES], place % LANES);
            }
            rows.row(t_s, innovation / sigma, &self.ordered, -1.0 / sigma);
            if self.columns > 0 {
                let noise_gain = (0..self.colours.count()).map(|j| self.colours.with_scalar(j) / variance);
                self.gains.clear();
                self.gains.extend(gain.iter().copied().chain(noise_gain));
                let (lines, groups) = (self.lines(), self.live_groups());
                for (group, by) in self.slopes.chunks_exact_mut(lines).zip(&self.row).take(groups) {
                    for (line, k) in group.iter_mut().zip(&self.gains) {
                        matrix::add_times(line, -k, by);
                    }
                }
            }
            self.colours.update(&ph, variance, innovation);
            let by = matrix::row(&ph);
            for (i, k) in full_gain.iter().enumerate() {
                matrix::add_times(&mut self.p[i], -k, &by);
                self.x[i] += gain[i] * innovation;
            }
            for i in untold {
                for j in untold {
                    *matrix::at_mut(&mut self.p[*i], *j) += full_gain[*i] * ph[*j];
                }
            }
            self.x[PSI] = wrap_angle(self.x[PSI]);
        }
    }

    /// What a sensor does not tell at the surface, where waves move it: it is only considered, as in flight.
    fn untold_by(&self, sensor: SensorChannel) -> &'static [usize] {
        let is_moved_by_waves = matches!(sensor, SensorChannel::Depth | SensorChannel::Attitude | SensorChannel::Rates);
        if is_moved_by_waves && self.x[Z] < self.setup.surface.depth_m { &[X, Y, U, V] } else { &[] }
    }

    /// How the effects' readings differ at `x0`, where the model reads `read`: the same for all scalars of a sensor.
    fn set_direct(&mut self, prediction: &Prediction, x0: &VehicleState, read: &[f64; 3]) {
        let (t_s, sensor, truth, at) = (self.t_s, prediction.sensor, prediction.truth, (x0, prediction.path));
        let model = &self.model;
        self.direct.clear();
        self.direct.extend(self.terms.iter().map(|term| {
            let mut direct = [0.0; 3];
            let Kind::Effects { with, without, unit, channels, water, .. } = &term.kind else { return direct };
            if *water {
                let from = without.as_deref().unwrap_or(model).water_mps(t_s);
                let now = with.water_mps(t_s);
                for (axis, direct) in direct.iter_mut().enumerate() {
                    for side in 0..2 {
                        *direct += (now[side] - from[side]) * prediction.by_water[side][axis];
                    }
                }
            }
            if channels.contains(&sensor) {
                let after = with.read(t_s, sensor, truth, at).0;
                let before = without.as_ref().map_or(*read, |without| without.read(t_s, sensor, truth, at).0);
                for axis in 0..3 {
                    direct[axis] += after[axis] - before[axis];
                }
            }
            direct.map(|direct| direct / unit)
        }));
    }

    /// What terms in no catalogue add to each scalar.
    fn proposed_reading(&self, prediction: &Prediction) -> [f64; 3] {
        if self.setup.proposed.is_empty() {
            return [0.0; 3];
        }
        let input = self.input.at(self.t_s);
        let share = self.t_s / self.duration_s.max(1.0);
        let (heading, distance_m) = (self.x[PSI].sin_cos(), prediction.distance_m());
        let snapshot = Snapshot { share, x: &self.x, heading, input: &input, distance_m };
        let water = regressors::motion(&self.setup.proposed, &snapshot);
        std::array::from_fn(|axis| {
            let channel = ResidualChannel::ALL[prediction.first as usize + axis];
            let by_water: f64 = (0..2).map(|side| prediction.by_water[side][axis] * water[X + side]).sum();
            regressors::reading(&self.setup.proposed, channel, &snapshot) + by_water
        })
    }

    /// ∂h/∂θ of one scalar into `row`: through the state, and directly.
    fn slopes_of(&mut self, prediction: &Prediction, axis: usize, h: &[f64; 12]) {
        if self.columns == 0 {
            return;
        }
        let channel = ResidualChannel::ALL[prediction.first as usize + axis];
        let (lines, groups) = (self.lines(), self.live_groups());
        for (group, row) in self.slopes.chunks_exact(lines).zip(&mut self.row).take(groups) {
            let mut sum = NONE;
            for (factor, line) in h.iter().zip(group).filter(|(factor, _)| **factor != 0.0) {
                matrix::add_times(&mut sum, *factor, line);
            }
            let by_noise = self.colours.slope((channel, prediction.path.station), &group[12..]);
            matrix::add_times(&mut sum, prediction.lasting[axis], &by_noise);
            *row = sum;
        }
        let t_s = self.t_s;
        let snapshot = Snapshot {
            share: t_s / self.duration_s.max(1.0),
            x: &self.x,
            heading: self.heading(),
            input: &self.input.at(t_s),
            distance_m: prediction.distance_m(),
        };
        for (term, direct) in self.terms.iter().zip(&self.direct) {
            let direct = match &term.kind {
                Kind::GenericTerm { target: Target::Reading(target), factor } if *target == channel => {
                    factor.value(&snapshot)
                }
                Kind::GenericTerm { target: Target::Water(north_east), factor } => {
                    prediction.by_water[usize::from(*north_east)][axis] * factor.value(&snapshot)
                }
                Kind::Effects { .. } => direct[axis],
                Kind::GenericTerm { .. } => 0.0,
            };
            if direct != 0.0 {
                let active = term.onsets_s.iter().filter(|onset| **onset <= t_s).count();
                for place in &self.place[term.first..][..active] {
                    *matrix::at_mut(&mut self.row[place / LANES], place % LANES) += direct;
                }
            }
        }
    }
}

/// Square of the horizontal part of a unit vector: the share of a horizontal variance that lies along it.
fn horizontal(unit: &Vector3<f64>) -> f64 {
    unit.x * unit.x + unit.y * unit.y
}

#[inline]
fn dot(a: &[f64; 12], b: &[f64; 12]) -> f64 {
    let mut sum = 0.0;
    for i in 0..12 {
        sum += a[i] * b[i];
    }
    sum
}
