//! Measurement update: sequential scalars, each equal to Joseph's form.
//!
//! All scalars of one measurement are linearised at the state before it, and later innovations are
//! corrected by what earlier ones moved. That equals the batch update of the whole vector whatever
//! the order, and ν²/S of the scalars are independent.

use super::gate::largest_sigma;
use super::layout::{CLONE_VELOCITY, CloneKind};
use super::observation::{Observation, Refused};
use super::{
    FusionOutcome, FusionRecord, Fusions, Measurement, NavigationError, Navigator, Sensor, meas_attitude, meas_depth,
    meas_dvl, meas_range, meas_range_rate, meas_rates, meas_ship_gnss, meas_two_way, meas_vehicle_gnss,
};
use crate::state::{P, PHI, PSI, Q, R, THETA, U, V, W, X, Y, Z, wrap_angle};

/// The shorter way round, for sensors of angles.
pub(super) fn wrap_innovation(sensor: Sensor, innovation: f64) -> f64 {
    if sensor == Sensor::Attitude { wrap_angle(innovation) } else { innovation }
}

impl Navigator {
    /// Fuses one measurement and says what became of each of its scalars.
    pub fn fuse(&mut self, measurement: &Measurement) -> Fusions {
        let mut fusions = Fusions::none();
        self.fuse_into(measurement, &mut fusions);
        fusions
    }

    /// The records are written where they are wanted: copying them costs more than a hundred instructions.
    #[inline(never)]
    fn fuse_into(&mut self, measurement: &Measurement, fusions: &mut Fusions) {
        let (sensor, scalars) = (measurement.sensor(), measurement.scalars());
        if !self.is_initialised() {
            self.refuse(sensor, scalars, FusionOutcome::Invalid, fusions);
            return;
        }
        match self.observe(measurement) {
            Ok(()) => self.update(sensor, fusions),
            Err(outcome) => self.refuse(sensor, scalars, outcome, fusions),
        }
    }

    /// Fills `observations`.
    fn observe(&mut self, measurement: &Measurement) -> Result<(), Refused> {
        self.gate.sigma = self.effects.gate_sigma(measurement.channel(), &self.config, &self.x);
        let (x, config, out) = (&self.x, &self.config, &mut self.observations);
        let sigma = &config.sensors;
        out.clear();
        match measurement {
            Measurement::Depth { z_m } => meas_depth::observe(x, *z_m, sigma.depth_m, out),
            Measurement::Attitude { euler_rad } => meas_attitude::observe(x, euler_rad, sigma.attitude_rad, out),
            Measurement::Rates { rates_radps } => meas_rates::observe(x, rates_radps, sigma.rates_radps, out),
            Measurement::BottomTrack { velocity_mps } => meas_dvl::observe_bottom(x, velocity_mps, sigma.dvl_mps, out),
            Measurement::WaterTrack { velocity_mps } => meas_dvl::observe_water(x, velocity_mps, sigma.dvl_mps, out),
            Measurement::VehicleGnss { position_m } => meas_vehicle_gnss::observe(x, position_m, sigma.gnss_m, out),
            Measurement::ShipGnss { position_m } => meas_ship_gnss::observe(x, position_m, sigma.ship_gnss_m, out)?,
            Measurement::Range { path, range_m } => meas_range::observe(x, path, *range_m, config, out)?,
            Measurement::RangeRate { path, range_rate_mps } => {
                meas_range_rate::observe(x, path, *range_rate_mps, config, out)?;
            }
            Measurement::TwoWayRange { outward, back, range_m } => {
                meas_two_way::observe(x, outward, back, *range_m, config, out)?;
            }
        }
        if self.effects.change(measurement.channel()) {
            let t_s = self.effect_time_s();
            self.effects.observe(
                measurement.channel(),
                measurement.readings(),
                t_s,
                &self.config,
                &self.x,
                &mut self.observations,
            );
        }
        let out = &self.observations;
        if out.as_slice().iter().all(Observation::is_valid) { Ok(()) } else { Err(FusionOutcome::Invalid) }
    }

    fn update(&mut self, sensor: Sensor, fusions: &mut Fusions) {
        let mut variance = self.project(0);
        if self.worst_test_ratio(variance) > 1.0 {
            let due = self.gate.rejected(sensor, self.time_us, self.observations.as_slice());
            if !(due && self.inflate(sensor)) {
                return self.gated(sensor, fusions);
            }
            self.gate.recovered(sensor);
            variance = self.project(0);
        }
        self.gate.accepted(sensor);

        for axis in 0..self.observations.as_slice().len() {
            if axis > 0 {
                variance = self.project(axis);
            }
            let innovation = wrap_innovation(sensor, self.observations.innovation(axis));
            if !self.fuse_scalar(innovation, variance) {
                fusions.push(self.record(sensor, axis, f64::NAN, f64::NAN, FusionOutcome::Invalid));
                break;
            }
            fusions.push(self.record(sensor, axis, innovation, variance, FusionOutcome::Fused));
            for observation in self.observations.as_mut_slice().iter_mut().skip(axis + 1) {
                observation.innovation -= observation.row.dot(&self.gain) * innovation;
            }
        }
    }

    /// P hᵀ of one scalar into `w`; returns S = h P hᵀ + R.
    fn project(&mut self, axis: usize) -> f64 {
        let n = self.dimension();
        let Some(observation) = self.observations.as_slice().get(axis) else { return f64::NAN };
        self.p.times_row(n, &observation.row, &mut self.w);
        observation.row.dot(&self.w) + observation.variance
    }

    /// Updates by the scalar whose P hᵀ is in `w`; `false` when the filter has failed.
    fn fuse_scalar(&mut self, innovation: f64, variance: f64) -> bool {
        if !(variance.is_finite() && variance > 0.0) {
            self.failure = Some(NavigationError::NotPositive);
            return false;
        }
        let n = self.dimension();
        let inverse = 1.0 / variance;
        for (k, g) in self.gain.iter_mut().zip(&self.w) {
            *k = *g * inverse;
        }
        self.p.update(n, &self.gain, &self.w);
        self.x.correct(&self.gain, innovation);
        true
    }

    /// Worst of all scalars before any is used; S of the first is known.
    fn worst_test_ratio(&self, first_variance: f64) -> f64 {
        let ratio = |(axis, item): (usize, &Observation)| {
            let variance = if axis == 0 { first_variance } else { self.innovation_variance(item) };
            self.test_ratio(item.innovation, variance)
        };
        self.observations.as_slice().iter().enumerate().map(ratio).fold(0.0, f64::max)
    }

    fn innovation_variance(&self, item: &Observation) -> f64 {
        self.p.bilinear(&item.row, &item.row) + item.variance
    }

    fn test_ratio(&self, innovation: f64, variance: f64) -> f64 {
        innovation * innovation / (self.gate.sigma * self.gate.sigma * variance)
    }

    #[cold]
    fn gated(&self, sensor: Sensor, fusions: &mut Fusions) {
        for (axis, item) in self.observations.as_slice().iter().enumerate() {
            let variance = self.innovation_variance(item);
            fusions.push(self.record(sensor, axis, item.innovation, variance, FusionOutcome::Gated));
        }
    }

    #[cold]
    fn refuse(&self, sensor: Sensor, scalars: usize, outcome: FusionOutcome, fusions: &mut Fusions) {
        for axis in 0..scalars {
            fusions.push(self.record(sensor, axis, f64::NAN, f64::NAN, outcome));
        }
    }

    fn record(
        &self,
        sensor: Sensor,
        axis: usize,
        innovation: f64,
        variance: f64,
        outcome: FusionOutcome,
    ) -> FusionRecord {
        let test_ratio = self.test_ratio(innovation, variance);
        FusionRecord { sensor, axis: axis as u8, time_us: self.time_us, innovation, variance, test_ratio, outcome }
    }

    /// Scales the sigmas of what the sensor positions until the innovations are one-sigma events;
    /// `false`, and nothing is changed, when no believable factor does.
    fn inflate(&mut self, sensor: Sensor) -> bool {
        let (scaled, count) = self.positioned_by(sensor);
        let scaled = scaled.get(..count).unwrap_or_default();
        let mut factor: f64 = 1.0;
        for item in self.observations.as_slice() {
            let inside = item.row.filtered(|i| scaled.contains(&i));
            let outside = item.row.filtered(|i| !scaled.contains(&i));
            // λ² a + 2 λ b + c + R = ν².
            let a = self.p.bilinear(&inside, &inside);
            let b = self.p.bilinear(&inside, &outside);
            let c = self.p.bilinear(&outside, &outside) + item.variance;
            let target = item.innovation * item.innovation;
            if a + 2.0 * b + c < target {
                let root = libm::sqrt(b * b + a * (target - c));
                // A NaN must not hide behind `max`.
                let needed = (root - b) / a;
                if !needed.is_finite() {
                    return false;
                }
                factor = factor.max(needed);
            }
        }
        let sigma = scaled.iter().map(|&i| libm::sqrt(self.variance(i))).fold(0.0, f64::max);
        if factor * sigma > largest_sigma(sensor) {
            return false;
        }
        let n = self.dimension();
        for &i in scaled {
            self.p.scale(n, i, factor);
        }
        true
    }

    /// The states whose error makes this sensor's innovation grow.
    fn positioned_by(&self, sensor: Sensor) -> ([usize; 8], usize) {
        let mut states = States::default();
        match sensor {
            Sensor::Depth => states.push(&[Z]),
            Sensor::Attitude => states.push(&[PHI, THETA, PSI]),
            Sensor::Rates => states.push(&[P, Q, R]),
            Sensor::BottomTrack | Sensor::WaterTrack => states.push(&[U, V, W]),
            Sensor::VehicleGnss | Sensor::Range => {
                states.push(&[X, Y]);
                self.x.layout.clones(CloneKind::Vehicle).for_each(|at| states.push(&[at, at + 1]));
            }
            Sensor::RangeRate => {
                states.push(&[U, V]);
                let clones = self.x.layout.clones(CloneKind::Vehicle).map(|at| at + CLONE_VELOCITY);
                clones.for_each(|at| states.push(&[at, at + 1]));
            }
            Sensor::ShipGnss => {
                let ships = self.x.layout.ship().into_iter().chain(self.x.layout.clones(CloneKind::Ship));
                ships.for_each(|at| states.push(&[at, at + 1]));
            }
        }
        (states.places, states.count)
    }
}

/// A short list of state indices.
#[derive(Default)]
struct States {
    places: [usize; 8],
    count: usize,
}

impl States {
    fn push(&mut self, states: &[usize]) {
        for (place, state) in self.places.iter_mut().skip(self.count).zip(states) {
            *place = *state;
            self.count += 1;
        }
    }
}
