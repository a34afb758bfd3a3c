//! The filter: samples in the order of their validity, initialisation, and the state at the present.
//!
//! A declared delay makes samples older than the present. The filter therefore runs at a horizon, the longest declared
//! delay ([`horizon_us`]) behind the present: there every sample is fused in its order, with the actuator commands of
//! its time. From the horizon the state is predicted to the present with the history of the commands
//! ([`Estimator::output`]), as in PX4's ekf2; this output steers the vehicle and is reported. Without declared delays
//! the horizon is the present. A sample that is later than its declared delay is fused at the filter's time, or dropped
//! beyond the tolerance.

mod acoustics;
mod named;

use crate::inputs::installation::{self, body_to_ned, horizon_us, velocity_at_centre};
use crate::inputs::{ActuatorHistory, Inputs, Packets, SensorSample, fresh};
use crate::parameters::{AppSettings, NamingUse, Settings};
use crate::store::{Coasted, Navigation, coast_m};
use crate::time::{UtcClock, micros};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::naming::Naming;
use backseat_core::navigation::{
    CloneId, ConfigError, Declared, FusionOutcome, FusionRecord, Fusions, InitialSpeed, InitialState, Integrity, Level,
    Measurement, NavigationError, Navigator, ProcessModel, ProtectionLevel, Sensor, ShipReport,
};
use backseat_core::state::{PHI, PSI, U, V, VehicleState, W, X, Y, Z, wrap_angle};
use heapless::Vec;

/// Scalar fusions kept for telemetry in one step; a step at full rates has about ten.
const MAX_RECORDS: usize = 32;
/// A fix older than this does not initialise, µs.
const INITIAL_FIX_AGE_US: u64 = 2_500_000;
/// Step of the prediction to the present, s.
const OUTPUT_STEP_S: f64 = 0.05;

/// One sigma of a pressure sensor's slow error, m: 0.25 % of 100 m. No other sensor on board measures depth, and the
/// cross-check by pitch and speed does not see so slow an error.
const DEPTH_SLOW_M: f64 = 0.25;

/// Samples that came too late for their order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lateness {
    /// Fused at the filter's time, a little later than they were valid.
    pub late: u32,
    /// Dropped, because they were older than the tolerance.
    pub too_late: u32,
}

/// Where the filter lives: in the app, or by the feature `static-filter` where a board puts it.
#[cfg(not(feature = "static-filter"))]
pub type FilterPlace = Navigator;
/// Where the filter lives: where the board puts it.
#[cfg(feature = "static-filter")]
pub type FilterPlace = &'static mut Navigator;

/// The filter with the state for its start and its restart.
pub struct Estimator {
    navigator: FilterPlace,
    /// What the filter's covariance leaves out.
    integrity: Integrity,
    /// What bounds its error.
    protection: ProtectionLevel,
    /// Names what has changed.
    naming: Naming,
    /// It is to.
    names: bool,
    /// Each step declares it anew before it is used.
    declared: Declared,
    /// One sigma per axis of the slow errors of the vehicle's and of the ship's receiver, m.
    receivers_m: [f64; 2],
    /// One sigma by which pitch and speed say that the pressure sensor has drifted, m.
    depth_drift_m: f64,
    model: Option<VehicleModel>,
    pub packets: Packets,
    /// The vehicle at the start of each packet under way, by the packet's number.
    clones: Vec<(u8, CloneId), 2>,
    /// The vehicle when its ping left.
    ping: Option<CloneId>,
    /// The vehicle at the present.
    pub output: VehicleState,
    /// Outcomes of the scalars of the last step.
    pub records: Vec<FusionRecord, MAX_RECORDS>,
    /// Of the last packet, until it was reported.
    ship: Option<ShipReport>,
    pub lateness: Lateness,
    transducer_depth_m: Option<f64>,
    /// When the last range was fused, µs.
    pub range_us: Option<u64>,
    /// From before a reset, until a fix or a range confirms or replaces it.
    pub resumed: Option<Navigation>,
}

impl Estimator {
    /// Offset of the filter's place in it, bytes.
    #[cfg(feature = "static-filter")]
    pub const FILTER_PLACE: usize = core::mem::offset_of!(Self, navigator);

    pub const fn new(navigator: FilterPlace) -> Self {
        Self {
            navigator,
            integrity: Integrity::new(),
            protection: ProtectionLevel::new(),
            naming: Naming::new(),
            names: false,
            declared: Declared::NONE,
            receivers_m: [0.0; 2],
            depth_drift_m: 0.0,
            model: None,
            packets: Packets::new(),
            clones: Vec::new(),
            ping: None,
            output: VehicleState::from_array_storage(nalgebra::ArrayStorage([[0.0; 12]])),
            records: Vec::new(),
            ship: None,
            lateness: Lateness { late: 0, too_late: 0 },
            transducer_depth_m: None,
            range_us: None,
            resumed: None,
        }
    }

    /// Carries on from before a reset once attitude and depth are there, should no fix come first.
    pub fn resume(&mut self, navigation: Option<Navigation>) {
        self.resumed = navigation;
    }

    /// The filter, at its horizon.
    #[cfg_attr(feature = "static-filter", expect(clippy::needless_borrow, reason = "the place is a reference there"))]
    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    /// Variance of vehicle state `i` as the board states it: the filter's, and what that leaves out.
    pub fn stated_variance(&self, i: usize) -> f64 {
        let variance = self.navigator.variance(i);
        let slow_m = if i == Z { libm::hypot(DEPTH_SLOW_M, self.depth_drift_m) } else { 0.0 };
        let (time_us, wave_variance_m2) = (self.navigator.time_us(), self.navigator.main().wave_variance());
        variance + self.integrity.unseen((i, variance), time_us, wave_variance_m2, self.receivers_m) + slow_m * slow_m
    }

    /// √(σx² + σy²) of these, m.
    pub fn stated_sigma_m(&self) -> f64 {
        libm::sqrt(self.stated_variance(X) + self.stated_variance(Y))
    }

    /// What is declared of receivers and water; the vehicle's receiver counts by its dilution of precision.
    pub fn declare(&mut self, app: &AppSettings, hdop: Option<f64>) {
        self.names = app.naming != NamingUse::Off;
        let sigma_m = app.receiver_bias_m;
        self.receivers_m = [sigma_m * hdop.unwrap_or(1.0).max(1.0), sigma_m];
        self.declared = Declared {
            area: app.water_area,
            receivers_m: self.receivers_m,
            probability_per_hour: app.level_probability_per_hour,
        };
    }

    /// One sigma by which pitch and speed say that the pressure sensor has drifted, m. It holds until the next mission.
    pub fn set_depth_drift(&mut self, sigma_m: f64) {
        self.depth_drift_m = sigma_m;
    }

    /// What the error exceeds with the declared probability only; `None` while there is no position.
    pub fn level(&self) -> Option<Level> {
        self.protection.level().filter(|_| self.navigator.is_initialised())
    }

    /// The ship of the last packet that gave a range, once.
    pub fn take_ship(&mut self) -> Option<ShipReport> {
        self.ship.take()
    }

    /// Builds the filter anew and drops its delayed states and pending samples.
    ///
    /// # Errors
    /// A value that the filter refuses; it is as it was.
    #[inline(never)] // its memory is not to stay on the stack under the Riccati equation
    pub fn configure(&mut self, settings: &Settings, model: &VehicleModel) -> Result<(), ConfigError> {
        self.packets.reset();
        self.clones.clear();
        self.ping = None;
        self.transducer_depth_m = None;
        self.navigator.configure(&settings.navigation_config(), model)?;
        self.model = Some(model.clone());
        Ok(())
    }

    /// Forgets the last step and what was before a reset.
    pub fn reset(&mut self) {
        self.resumed = None;
        self.range_us = None;
        self.ship = None;
        self.records.clear();
    }

    /// Takes every sample that is valid until the horizon, in order, moves the filter there and the output to `now_us`.
    ///
    /// # Errors
    /// Why the filter can no longer be used.
    pub fn step(
        &mut self,
        now_us: u64,
        inputs: &mut Inputs,
        settings: &Settings,
        clock: &UtcClock,
    ) -> Result<(), NavigationError> {
        let horizon_us = now_us.saturating_sub(horizon_us(&settings.app.installation));
        self.records.clear();
        while let Some((time_us, sample)) = inputs.next_until(horizon_us) {
            if self.navigator.is_initialised()
                && let Some(late_s) = self.reach(time_us, &inputs.actuators, settings)?
            {
                self.fuse(&sample, late_s, settings, clock);
            }
        }
        if self.navigator.is_initialised() {
            self.predict(horizon_us, &inputs.actuators)?;
            self.protection.follow(&self.navigator.followed(), &self.declared);
            self.naming.step(self.navigator.nominal().filter(|_| self.names));
            if self.packets.expire(horizon_us, &settings.app) {
                self.drop_clones();
            }
        } else {
            self.initialise(horizon_us, inputs, settings);
        }
        match self.navigator.failure() {
            Some(failure) => Err(failure),
            None => {
                self.predict_output(now_us, &inputs.actuators);
                Ok(())
            }
        }
    }

    /// Moves the filter to a sample; by how much the sample is older than the filter, s, or `None`
    /// when it is too old to be used.
    fn reach(
        &mut self,
        time_us: u64,
        actuators: &ActuatorHistory,
        settings: &Settings,
    ) -> Result<Option<f64>, NavigationError> {
        let late_us = self.navigator.time_us().saturating_sub(time_us);
        if late_us == 0 {
            self.predict(time_us, actuators)?;
            return Ok(Some(0.0));
        }
        let late_s = late_us as f64 * 1e-6;
        let usable = late_s <= settings.app.late_tolerance_s;
        let count = if usable { &mut self.lateness.late } else { &mut self.lateness.too_late };
        *count = count.saturating_add(1);
        Ok(usable.then_some(late_s))
    }

    /// Predicts to `to_us`, in parts where the actuators change in between. At the filter's own time as well: what was fused
    /// last is checked there.
    fn predict(&mut self, to_us: u64, actuators: &ActuatorHistory) -> Result<(), NavigationError> {
        while let Some(change_us) = actuators.next_change_us(self.navigator.time_us(), to_us) {
            self.predict_under(change_us, actuators)?;
        }
        if to_us >= self.navigator.time_us() {
            self.predict_under(to_us, actuators)?;
        }
        Ok(())
    }

    /// Predicts under the input of the filter's time.
    fn predict_under(&mut self, to_us: u64, actuators: &ActuatorHistory) -> Result<(), NavigationError> {
        let Self { navigator, naming, names, .. } = self;
        let input = actuators.at(navigator.time_us());
        let observer = naming.will_predict(navigator.nominal().filter(|_| *names), navigator.state(), input);
        navigator.predict_observed(to_us, input, observer)
    }

    /// Moves the output from the filter's time to the present; the covariance stays that of the horizon.
    fn predict_output(&mut self, now_us: u64, actuators: &ActuatorHistory) {
        self.output = *self.navigator.state();
        let kinematic = self.navigator.config().process_model == ProcessModel::Kinematic;
        let Some(model) = self.model.as_ref().filter(|_| self.navigator.is_initialised()) else { return };
        let [north, east] = self.navigator.current();
        let mut time_us = self.navigator.time_us();
        while time_us < now_us {
            let next_us = actuators.next_change_us(time_us, now_us).unwrap_or(now_us);
            let next_us = next_us.min(time_us.saturating_add(micros(OUTPUT_STEP_S)));
            let step_s = next_us.saturating_sub(time_us) as f64 * 1e-6;
            let input = actuators.at(time_us);
            let slope = |x: &VehicleState| {
                let mut slope = model.derivative(x, input);
                if kinematic {
                    slope.fixed_rows_mut::<6>(U).fill(0.0);
                }
                slope[X] += north;
                slope[Y] += east;
                slope
            };
            // Heun's method
            let first = slope(&self.output);
            let second = slope(&(self.output + first * step_s));
            self.output += (first + second) * (0.5 * step_s);
            self.output[PSI] = wrap_angle(self.output[PSI]);
            time_us = next_us;
        }
    }

    /// Fuses a sample that was valid `late_s` before the filter's time.
    fn fuse(&mut self, sample: &SensorSample, late_s: f64, settings: &Settings, clock: &UtcClock) {
        let app = &settings.app;
        let used = match *sample {
            SensorSample::Depth { .. } => app.use_depth,
            SensorSample::Attitude { .. } => app.use_attitude,
            SensorSample::Rates { .. } => app.use_rates,
            SensorSample::BottomTrack { .. } => app.use_dvl,
            SensorSample::WaterTrack { .. } => app.use_water_track,
            SensorSample::Fix { .. } => app.use_gnss && self.navigator.state()[Z] <= app.gnss_max_depth_m,
            SensorSample::Acoustic(ref report) => {
                self.follow(report, settings, clock);
                false
            }
        };
        if !used {
            return;
        }
        let x = self.navigator.state();
        let through_water_mps = body_to_ned(x, &[x[U], x[V], x[W]]);
        let current_mps = self.navigator.current();
        let velocity_mps = [through_water_mps[0] + current_mps[0], through_water_mps[1] + current_mps[1]];
        if let Some(measurement) = installation::measurement(sample, &app.installation, x, velocity_mps, late_s) {
            self.fuse_measurement(&measurement);
        }
    }

    fn fuse_measurement(&mut self, measurement: &Measurement) {
        let Self { navigator, integrity, protection, declared, naming, names, .. } = self;
        let offset = navigator.mixture_offset(measurement);
        if let Some(aiding) = navigator.aiding(measurement) {
            protection.take(&navigator.followed(), &aiding, declared);
        }
        let observer = naming.will_fuse(navigator.nominal().filter(|_| *names), measurement);
        let fusions: Fusions = navigator.fuse_observed(measurement, observer);
        integrity.take(&fusions, navigator.main().monitor(), &navigator.config().sensors, offset);
        for record in fusions.iter() {
            let confirms = matches!(record.sensor, Sensor::VehicleGnss | Sensor::Range);
            if confirms && record.outcome == FusionOutcome::Fused {
                self.resumed = None;
            }
            if record.sensor == Sensor::Range && record.outcome == FusionOutcome::Fused {
                self.range_us = Some(self.navigator.time_us());
            }
            // beyond the capacity they are fused but not reported
            let _ = self.records.push(*record);
        }
    }

    /// Starts the filter (2.3.1.2) once fix (or the position from before a reset), attitude and depth are fresh.
    #[inline(never)] // its memory is not to stay on the stack under a step
    fn initialise(&mut self, now_us: u64, inputs: &Inputs, settings: &Settings) {
        let app = &settings.app;
        let s = &inputs.latest;
        let attitude_age_us = micros(app.attitude_timeout_s);
        let fix_m = fresh(s.fix_m, now_us, INITIAL_FIX_AGE_US);
        let resumed = if fix_m.is_some() { None } else { self.resumed };
        let coasted = resumed.map(|navigation| navigation.coasted(now_us, coast_m(&settings.vehicle)));
        let (Some(fix_m), Some(euler_rad), Some(depth_m)) = (
            fix_m.or(coasted.map(|navigation| navigation.position_m)),
            fresh(s.euler_rad, now_us, attitude_age_us),
            fresh(s.depth_m, now_us, micros(app.depth_timeout_s)),
        ) else {
            return;
        };
        let rates_radps = fresh(s.rates_radps, now_us, attitude_age_us).unwrap_or_default();
        let speed = match (fresh(s.bottom_mps, now_us, attitude_age_us), coasted) {
            (Some(velocity_mps), _) if app.use_dvl => {
                InitialSpeed::Dvl(velocity_at_centre(rates_radps, velocity_mps, &app.installation.dvl_arm_m))
            }
            (_, Some(Coasted { velocity_mps: [north_mps, east_mps], speed_sigma_mps, .. })) => {
                let [.., heading_rad] = euler_rad;
                let surge_mps = north_mps * libm::cos(heading_rad) + east_mps * libm::sin(heading_rad);
                InitialSpeed::Coasting(surge_mps, speed_sigma_mps)
            }
            _ => InitialSpeed::Commanded(steady_speed_mps(inputs.actuators.at(now_us), settings)),
        };
        let mut x = VehicleState::zeros();
        x.fixed_rows_mut::<3>(PHI).copy_from_slice(&euler_rad);
        let depth_m = depth_m - body_to_ned(&x, &app.installation.depth_arm_m)[2];
        let arm_m = if resumed.is_some() { [0.0; 3] } else { body_to_ned(&x, &app.installation.gnss_arm_m) };
        let fix_m = [fix_m[0] - arm_m[0], fix_m[1] - arm_m[1]];
        let config = *self.navigator.config();
        let sigma_m = coasted.map_or(config.sensors.gnss_m, |navigation| navigation.sigma_m);
        let initial = InitialState::from_fix(fix_m, sigma_m, depth_m, euler_rad, rates_radps, speed, &config);
        // refused only for values that are not finite: the next samples come soon
        if self.navigator.initialise(now_us, &initial).is_ok() {
            self.navigator.start_from(&settings.learnt);
            self.integrity = Integrity::new();
            self.naming.restart();
            self.protection.start(&self.navigator.followed(), sigma_m, &self.declared);
            self.resumed = resumed;
        }
    }

    /// Since when attitude or depth and the filter have contradicted each other, µs.
    pub fn unsteerable_since_us(&self) -> Option<u64> {
        let since_us = [Sensor::Attitude, Sensor::Depth].map(|sensor| self.navigator.main().suspect_since_us(sensor));
        since_us.into_iter().flatten().min()
    }

    /// A fix that the filter could start from.
    pub fn has_fix(&self, now_us: u64, inputs: &Inputs) -> bool {
        fresh(inputs.latest.fix_m, now_us, INITIAL_FIX_AGE_US).is_some()
    }

    /// Whether any sensor is suspect, or unconfirmed. Not unconfirmed ranges and fixes: they are used again, and the
    /// sigma of the position covers both position solutions for as long as it takes.
    pub fn is_suspect(&self) -> bool {
        let covered = |sensor: Sensor| matches!(sensor, Sensor::Range | Sensor::VehicleGnss);
        self.contradicts(|sensor| !covered(sensor))
    }

    /// Whether any sensor is suspect, or unconfirmed until a fix decides between it and the filter.
    pub fn is_doubted(&self) -> bool {
        self.contradicts(|_| true)
    }

    fn contradicts(&self, unconfirmed_counts: impl Fn(Sensor) -> bool) -> bool {
        let filter = self.navigator.main();
        Sensor::ALL.into_iter().any(|sensor| {
            filter.is_suspect(sensor) || (unconfirmed_counts(sensor) && filter.unconfirmed_sigma(sensor) > 0.0)
        })
    }
}

/// Speed at which quadratic surge drag balances the thrust, m/s.
fn steady_speed_mps(input: &ActuatorInput, settings: &Settings) -> f64 {
    let vehicle = &settings.vehicle;
    let thrust_n = vehicle.beta5_n_s2_per_rad2 * input.propeller_radps * input.propeller_radps.abs();
    let drag = vehicle.quadratic_diag[0];
    if thrust_n > 0.0 && drag > 0.0 { libm::sqrt(thrust_n / drag) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// sqrt(3e-4 · 100² / 3) = 1 m/s
    #[test]
    fn val_thrust_balances_drag_at_the_steady_speed() {
        let at = |propeller_radps| {
            steady_speed_mps(&ActuatorInput { propeller_radps, fins_rad: [0.0; 4] }, &Settings::DEFAULT)
        };
        assert!((at(100.0) - 1.0).abs() < 1e-12);
        assert_eq!(at(-100.0), 0.0);
    }
}
