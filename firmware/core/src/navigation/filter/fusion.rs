//! Measurement update: sequential scalars, each equal to Joseph's form.
//!
//! All scalars of one measurement are linearised at the state before it, and later innovations are
//! corrected by what earlier ones moved. That equals the batch update of the whole vector whatever
//! the order, and ν²/S of the scalars are independent.

use super::cekf::Filter;
use super::effects::Effects;
use super::vertical;
use crate::navigation::algebra::observation::{Observation, Refused};
use crate::navigation::algebra::observer::{LinearStep, Observer, ScalarUpdate};
use crate::navigation::interface::effect_states::StateParameter;
use crate::navigation::interface::error::NavigationError;
use crate::navigation::interface::measurement::{
    AcousticPath, FusionOutcome, FusionRecord, Fusions, Measurement, Sensor, ShipEnd,
};
use crate::navigation::sources::{
    attitude, depth, dvl, range, range_rate, rates, ship_gnss, two_way, usbl, vehicle_gnss,
};
use crate::navigation::trust::innovation_monitor::{EXCEEDANCE, Estimated, LARGEST_CURRENT_MPS};
use crate::navigation::trust::source_state::largest_sigma;
use crate::state::{self, P, PHI, U, X, Y, Z, wrap_angle};
use core::ops::Range;

/// The shorter way round, for sensors of angles.
pub(super) fn wrap_innovation(sensor: Sensor, innovation: f64) -> f64 {
    if sensor == Sensor::Attitude { wrap_angle(innovation) } else { innovation }
}

impl Filter {
    /// Fuses one measurement; returns the outcome of each of its scalars.
    pub fn fuse(&mut self, measurement: &Measurement, observer: &mut impl Observer) -> Fusions {
        let mut fusions = Fusions::none();
        self.fuse_into(measurement, &mut fusions, observer);
        fusions
    }

    /// The records are written where they are wanted: copying them costs more than a hundred instructions.
    #[inline(never)]
    fn fuse_into(&mut self, measurement: &Measurement, fusions: &mut Fusions, observer: &mut impl Observer) {
        let (sensor, scalars) = (measurement.sensor(), measurement.scalars());
        if !self.is_initialised() {
            self.refuse(sensor, scalars, FusionOutcome::Invalid, fusions);
            return;
        }
        if let Measurement::Attitude { euler_rad: [_, pitch_rad, _] } = measurement {
            self.watch_pitch(*pitch_rad);
        }
        let peer = match measurement {
            Measurement::Range { path: AcousticPath { ship: ShipEnd::Peer(peer), .. }, .. } => Some(peer),
            _ => None,
        };
        if let Some(peer) = peer {
            self.expect_peer(peer);
        }
        match (self.observe(measurement), peer) {
            (Ok(()), None) => self.update(sensor, fusions, observer),
            (Ok(()), Some(peer)) => self.fuse_peer(peer, fusions, observer),
            (Err(outcome), _) => self.refuse(sensor, scalars, outcome, fusions),
        }
    }

    /// Fills `observations`.
    fn observe(&mut self, measurement: &Measurement) -> Result<(), Refused> {
        self.monitor.sigma = self.effects.gate_sigma(measurement.channel(), &self.config, &self.x);
        let (x, config, out) = (&self.x, &self.config, &mut self.observations);
        let sigma = &config.sensors;
        out.clear();
        match measurement {
            Measurement::Depth { z_m } => depth::observe(x, *z_m, sigma.depth_m, out),
            Measurement::Attitude { euler_rad } if vertical::is_steep(&x.vehicle) => {
                vertical::observe(&x.vehicle, euler_rad, &sigma.angles_rad(), out);
            }
            Measurement::Attitude { euler_rad } => attitude::observe(x, euler_rad, &sigma.angles_rad(), out),
            Measurement::Rates { rates_radps } => rates::observe(x, rates_radps, sigma.rates_radps, out),
            Measurement::BottomTrack { velocity_mps } => dvl::observe_bottom(x, velocity_mps, sigma.dvl_mps, out),
            Measurement::WaterTrack { velocity_mps } => dvl::observe_water(x, velocity_mps, sigma.dvl_mps, out),
            Measurement::VehicleGnss { position_m } => vehicle_gnss::observe(x, position_m, sigma.gnss_m, out),
            Measurement::ShipGnss { position_m } => ship_gnss::observe(x, position_m, sigma.ship_gnss_m, out)?,
            Measurement::Range { path, range_m } => range::observe(x, &self.p, path, *range_m, config, out)?,
            Measurement::RangeRate { path, range_rate_mps } => {
                range_rate::observe(x, &self.p, path, *range_rate_mps, config, out)?;
            }
            Measurement::TwoWayRange { outward, back, range_m } => {
                two_way::observe(x, outward, back, *range_m, config, out)?;
            }
            Measurement::Usbl { path, fix } => usbl::observe(x, path, fix, config, out)?,
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

    fn update(&mut self, sensor: Sensor, fusions: &mut Fusions, observer: &mut impl Observer) {
        if self.monitor.alert && sensor == Sensor::VehicleGnss {
            // a fix is gated by the whole uncertainty of the position
            let [sigma, ..] = self.monitor.floor(Sensor::Range);
            self.leave_at_least(sensor, [sigma; 3]);
        }
        let waves = self.monitor.waves.have_refused(sensor);
        if waves {
            let by_waves = self.monitor.waves.variance(sensor);
            self.observations.as_mut_slice().iter_mut().for_each(|item| item.variance += by_waves);
        }
        let mut variance = self.project(0);
        let ratio = self.worst_test_ratio(variance);
        let alert = ratio > EXCEEDANCE || self.monitor.alert;
        if alert && !self.weigh(sensor, ratio) {
            if ratio > 1.0 {
                self.monitor.waves.begin(sensor, self.time_us);
            }
            self.gated(sensor, fusions, observer);
            return self.learn_waves(fusions);
        }

        self.hear(sensor);
        let steep = vertical::is_steep(&self.x.vehicle).then(|| state::attitude(&self.x.vehicle));
        for axis in 0..self.observations.as_slice().len() {
            if axis > 0 {
                variance = self.project(axis);
            }
            let innovation = wrap_innovation(sensor, self.observations.innovation(axis));
            if !self.fuse_scalar(sensor, innovation, variance) {
                fusions.push(self.record(sensor, axis, f64::NAN, f64::NAN, FusionOutcome::Invalid));
                break;
            }
            fusions.push(self.record(sensor, axis, innovation, variance, FusionOutcome::Fused));
            if let Some(Observation { row, .. }) = self.observations.as_slice().get(axis) {
                let gain = self.gain.get(..self.dimension()).unwrap_or_default();
                let considers = self.considers();
                observer.observe(&LinearStep::Update(ScalarUpdate { row, gain, innovation, variance, considers }));
            }
            for observation in self.observations.as_mut_slice().iter_mut().skip(axis + 1) {
                observation.innovation -= observation.row.dot(&self.gain) * innovation;
            }
        }
        if let Some(before) = steep {
            self.turn_steep(&before, observer);
        }
        if !self.config.effect_states.is_empty() {
            Effects::bound(&self.config, &mut self.x);
            if let (Sensor::Depth, Some(FusionRecord { innovation, variance, .. })) = (sensor, fusions.iter().next())
                && self.config.effect_states.iter().any(|state| matches!(state.parameter, StateParameter::LogFactor(_)))
            {
                self.monitor.waves.learn_sea(self.time_us, *innovation, *variance);
            }
        }
        if sensor == Sensor::Range {
            self.monitor.range_us = self.time_us;
        } else if alert {
            self.leave_at_least(sensor, self.monitor.floor(sensor));
        }
        if sensor == Sensor::VehicleGnss {
            self.peers.leans = false;
        }
        if waves {
            self.learn_waves(fusions);
        }
    }

    /// Shows the scalars of a reading in waves to the monitor.
    #[cold]
    #[inline(never)]
    fn learn_waves(&mut self, fusions: &Fusions) {
        for FusionRecord { sensor, axis, innovation, variance, outcome, .. } in fusions.iter() {
            if *outcome != FusionOutcome::Invalid && self.monitor.waves.have_refused(*sensor) {
                self.monitor.waves.learn(*sensor, usize::from(*axis), self.time_us, *innovation, *variance);
            }
        }
    }

    /// P hᵀ of one scalar into `w`; returns S = h P hᵀ + R.
    pub(super) fn project(&mut self, axis: usize) -> f64 {
        let n = self.dimension();
        let Some(observation) = self.observations.as_slice().get(axis) else { return f64::NAN };
        self.p.times_row(n, &observation.row, &mut self.w);
        observation.row.dot(&self.w) + observation.variance
    }

    /// Updates by the scalar whose P hᵀ is in `w`; `false` when the filter has failed.
    pub(super) fn fuse_scalar(&mut self, sensor: Sensor, innovation: f64, variance: f64) -> bool {
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
        let by_waves = self.is_moved_by_waves(sensor);
        if by_waves || self.is_alone() {
            self.consider(by_waves);
        }
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

    /// The same where it is not worth its place in every line.
    #[cold]
    #[inline(never)]
    fn total_variance(&self, item: &Observation) -> f64 {
        self.innovation_variance(item)
    }

    fn test_ratio(&self, innovation: f64, variance: f64) -> f64 {
        innovation * innovation / (self.monitor.sigma * self.monitor.sigma * variance)
    }

    #[cold]
    fn gated(&self, sensor: Sensor, fusions: &mut Fusions, observer: &mut impl Observer) {
        for (axis, item) in self.observations.as_slice().iter().enumerate() {
            let variance = self.total_variance(item);
            let (row, innovation) = (&item.row, wrap_innovation(sensor, item.innovation));
            let refused = ScalarUpdate { row, gain: &[], innovation, variance, considers: false };
            observer.observe(&LinearStep::Refused(refused));
            fusions.push(self.record(sensor, axis, item.innovation, variance, FusionOutcome::Gated));
        }
    }

    #[cold]
    fn refuse(&self, sensor: Sensor, scalars: usize, outcome: FusionOutcome, fusions: &mut Fusions) {
        for axis in 0..scalars {
            fusions.push(self.record(sensor, axis, f64::NAN, f64::NAN, outcome));
        }
    }

    pub(super) fn record(
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

    /// Whether to use a measurement that is an exceedance, or that comes while a sensor is suspect or unconfirmed.
    #[cold]
    #[inline(never)]
    fn weigh(&mut self, sensor: Sensor, ratio: f64) -> bool {
        // Range and range rate of a packet share one geometry: without the range, the rate means nothing.
        if sensor == Sensor::RangeRate && self.monitor.is_suspect(Sensor::Range) {
            return false;
        }
        let items = self.observations.as_slice();
        let most = self.config.exceedances;
        if ratio > EXCEEDANCE {
            let variance = items.iter().fold(0.0, |most: f64, item| most.max(self.total_variance(item)));
            let surfaced = self.config.is_at_surface(self.x.vehicle[Z]);
            self.monitor.exceedance(sensor, self.time_us, items, (variance, surfaced), most);
            return ratio <= 1.0 && !self.monitor.is_suspect(sensor);
        }
        let bound = EXCEEDANCE * self.monitor.sigma * self.monitor.sigma;
        let (mut alone, mut believable) = (true, true);
        for (axis, item) in items.iter().enumerate() {
            let variance = self.total_variance(item);
            let before = self.monitor.variance_without_suspicion(sensor, variance, item.variance);
            alone &= item.innovation * item.innovation <= bound * before;
            if matches!(sensor, Sensor::Range | Sensor::BottomTrack | Sensor::WaterTrack) {
                let worst = self.monitor.worst(sensor, axis);
                believable &= worst * worst <= bound * variance;
            }
        }
        self.monitor.consistent(sensor, self.time_us, (alone, believable), most)
    }

    /// Adds what suspicion adds over a step of the prediction.
    #[cold]
    #[inline(never)]
    pub(super) fn grow_suspects(&mut self, step_s: f64) {
        let current = self.x.layout.current();
        let estimated = Estimated {
            vehicle: self.config.effect_states.iter().any(|state| state.parameter.is_of_the_vehicle()),
            current: current.is_some(),
        };
        for sensor in Sensor::ALL {
            let growth = self.monitor.grow(sensor, self.time_us, step_s, estimated);
            if let (Some(at), [position, covariance, variance]) = (current, growth.current)
                && variance > 0.0
            {
                for (i, at) in [(X, at), (Y, at + 1)] {
                    let room = LARGEST_CURRENT_MPS * LARGEST_CURRENT_MPS - self.p.get(at, at);
                    let share = (room / variance).clamp(0.0, 1.0);
                    self.p.add(i, i, share * position);
                    self.p.add(i, at, share * covariance);
                    self.p.add(at, at, share * variance);
                }
            }
            let largest = largest_sigma(sensor);
            for i in self.positioned_by(sensor) {
                let room = largest * largest - self.p.get(i, i);
                self.p.add(i, i, growth.positioned.min(room.max(0.0)));
            }
            for i in [X, Y] {
                self.p.add(i, i, growth.drift);
            }
            if sensor != Sensor::Range {
                self.leave_at_least(sensor, growth.floor);
            }
        }
    }

    /// Puts a floor under the uncertainty of the states that a sensor observes, one sigma.
    pub(super) fn leave_at_least(&mut self, sensor: Sensor, sigma: [f64; 3]) {
        for (i, sigma) in self.positioned_by(sensor).zip(sigma) {
            let short = sigma * sigma - self.p.get(i, i);
            self.p.add(i, i, short.max(0.0));
        }
    }

    /// The states whose error makes this sensor's innovation grow.
    fn positioned_by(&self, sensor: Sensor) -> Range<usize> {
        match sensor {
            Sensor::Depth => Z..Z + 1,
            Sensor::Attitude => PHI..PHI + 3,
            Sensor::Rates => P..P + 3,
            Sensor::BottomTrack | Sensor::WaterTrack => U..U + 3,
            Sensor::RangeRate => U..U + 2,
            Sensor::VehicleGnss | Sensor::Range | Sensor::Usbl | Sensor::Peer => X..X + 2,
            Sensor::ShipGnss => self.x.layout.ship().map_or(0..0, |at| at..at + 2),
        }
    }
}
