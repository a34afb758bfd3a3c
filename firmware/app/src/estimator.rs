//! The filter and what feeds it: events in the order of their validity, inputs, initialisation.

use crate::acoustics::{Acoustics, body_to_ned};
use crate::event::Event;
use crate::held::Held;
use crate::parameters::Settings;
use crate::queue::Queue;
use crate::store::Navigation;
use crate::time::UtcClock;
use backseat_core::dynamics::{ActuatorInput, FINS, VehicleModel};
use backseat_core::navigation::{
    ConfigError, FusionOutcome, FusionRecord, Fusions, InitialSpeed, InitialState, Measurement, NavigationError,
    Navigator, Sensor, ShipReport,
};
use backseat_core::state::{P, Q, R, U, V, W, Z};
use heapless::{Deque, Vec};

/// Scalar fusions kept for telemetry in one step; a step at full rates has about ten.
const MAX_RECORDS: usize = 32;
/// Commands on their way to the actuators.
const MAX_COMMANDS: usize = 16;
/// A fix older than this does not initialise, µs.
const INITIAL_FIX_AGE_US: u64 = 2_500_000;

/// Latest sample of one source, and when it was valid.
pub type Latest<T> = Option<(u64, T)>;

/// What the last samples said, whether fused or not.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    pub depth_m: Latest<f64>,
    pub euler_rad: Latest<[f64; 3]>,
    pub rates_radps: Latest<[f64; 3]>,
    pub bottom_mps: Latest<[f64; 3]>,
    pub water_mps: Latest<[f64; 3]>,
    pub fix_m: Latest<[f64; 2]>,
}

impl Samples {
    const NONE: Self =
        Self { depth_m: None, euler_rad: None, rates_radps: None, bottom_mps: None, water_mps: None, fix_m: None };
}

/// Events that could not be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lateness {
    /// Fused at the filter's time, a little later than they were valid.
    pub late: u32,
    /// Dropped, because they were older than the tolerance.
    pub too_late: u32,
}

/// The filter, its queue and its inputs.
pub struct Estimator {
    navigator: Navigator,
    acoustics: Acoustics,
    queue: Queue<Event>,
    samples: Samples,
    /// What the actuators do at filter time.
    input: ActuatorInput,
    /// What they will do from a later time on.
    commands: Deque<(u64, ActuatorInput), MAX_COMMANDS>,
    records: Vec<FusionRecord, MAX_RECORDS>,
    /// Of the last packet, until it was reported.
    ship: Held<ShipReport>,
    lateness: Lateness,
    transducer_depth_m: Option<f64>,
    /// From before a reset, until a fix or a range confirms or replaces it.
    resumed: Option<Navigation>,
}

impl Estimator {
    pub const fn new() -> Self {
        Self {
            navigator: Navigator::new(),
            acoustics: Acoustics::new(),
            queue: Queue::new(),
            samples: Samples::NONE,
            input: ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; FINS] },
            commands: Deque::new(),
            records: Vec::new(),
            ship: Held::none(),
            lateness: Lateness { late: 0, too_late: 0 },
            transducer_depth_m: None,
            resumed: None,
        }
    }

    /// Carries on from before a reset once attitude and depth are there, should no fix come first.
    pub fn resume(&mut self, navigation: Option<Navigation>) {
        self.resumed = navigation;
    }

    /// What was before a reset, as long as the position rests on it.
    pub fn resumed(&self) -> Option<Navigation> {
        self.resumed
    }

    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    pub fn acoustics(&self) -> &Acoustics {
        &self.acoustics
    }

    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    pub fn lateness(&self) -> Lateness {
        self.lateness
    }

    /// Events dropped because the queue was full.
    pub fn overflows(&self) -> u32 {
        self.queue.dropped()
    }

    /// What became of the scalars of the last step.
    pub fn records(&self) -> &[FusionRecord] {
        &self.records
    }

    /// The ship of the last packet that gave a range, once.
    pub fn take_ship(&mut self) -> Option<ShipReport> {
        self.ship.take()
    }

    /// What the actuators do now.
    pub fn input(&self) -> &ActuatorInput {
        &self.input
    }

    /// Builds the filter anew; what was under way in it is forgotten.
    pub fn configure(&mut self, settings: &Settings, model: &VehicleModel) -> Result<(), ConfigError> {
        self.acoustics.reset();
        self.transducer_depth_m = None;
        self.navigator.configure(&settings.navigation_config(), model)
    }

    /// Another vehicle, while the filter runs.
    ///
    /// # Errors
    /// The effects do not fit it; the old one stays.
    pub fn set_model(&mut self, model: &VehicleModel) -> Result<(), ConfigError> {
        self.navigator.set_model(model)
    }

    /// Forgets samples, events and inputs.
    pub fn reset(&mut self) {
        let Self { queue, samples, input, commands, records, ship, resumed, .. } = self;
        *resumed = None;
        ship.clear();
        queue.clear();
        *samples = Samples::NONE;
        *input = ActuatorInput::default();
        commands.clear();
        records.clear();
    }

    /// An event that is valid at `time_us`.
    pub fn push(&mut self, time_us: u64, event: Event) {
        self.queue.push(time_us, event);
    }

    /// The actuators do `input` from `time_us` on.
    pub fn command(&mut self, time_us: u64, input: &ActuatorInput) {
        if self.commands.is_full() {
            self.commands.pop_front();
        }
        let _ = self.commands.push_back((time_us, *input));
    }

    /// Takes everything that is valid until `now_us`, in order, and moves the filter there.
    ///
    /// # Errors
    /// Why the filter can no longer be used.
    pub fn step(&mut self, now_us: u64, settings: &Settings, clock: &UtcClock) -> Result<(), NavigationError> {
        self.records.clear();
        while let Some((time_us, event)) = self.queue.pop_until(now_us) {
            self.remember(time_us, &event);
            if self.navigator.is_initialised()
                && let Some(late_s) = self.reach(time_us, settings)?
            {
                self.fuse(&event, late_s, settings, clock);
            }
        }
        if self.navigator.is_initialised() {
            self.predict(now_us)?;
            self.acoustics.expire(now_us, &mut self.navigator, &settings.app);
        } else {
            self.input_at(now_us);
            self.initialise(now_us, settings);
        }
        match self.navigator.failure() {
            Some(failure) => Err(failure),
            None => Ok(()),
        }
    }

    fn remember(&mut self, time_us: u64, event: &Event) {
        match *event {
            Event::Depth { depth_m } => self.samples.depth_m = Some((time_us, depth_m)),
            Event::Attitude { euler_rad } => self.samples.euler_rad = Some((time_us, euler_rad)),
            Event::Rates { rates_radps } => self.samples.rates_radps = Some((time_us, rates_radps)),
            Event::BottomTrack { velocity_mps } => self.samples.bottom_mps = Some((time_us, velocity_mps)),
            Event::Fix { position_m } => self.samples.fix_m = Some((time_us, position_m)),
            Event::WaterTrack { velocity_mps } => self.samples.water_mps = Some((time_us, velocity_mps)),
            Event::Acoustic(_) => {}
        }
    }

    /// Moves the filter to an event; by how much the event is older than the filter, s, or `None`
    /// when it is too old to be used.
    fn reach(&mut self, time_us: u64, settings: &Settings) -> Result<Option<f64>, NavigationError> {
        let late_us = self.navigator.time_us().saturating_sub(time_us);
        if late_us == 0 {
            self.predict(time_us)?;
            return Ok(Some(0.0));
        }
        let late_s = late_us as f64 * 1e-6;
        let usable = late_s <= settings.app.late_tolerance_s;
        let count = if usable { &mut self.lateness.late } else { &mut self.lateness.too_late };
        *count = count.saturating_add(1);
        Ok(usable.then_some(late_s))
    }

    /// Predicts to `to_us`, in parts where the actuators change in between.
    fn predict(&mut self, to_us: u64) -> Result<(), NavigationError> {
        while let Some(&(time_us, input)) = self.commands.front()
            && time_us <= to_us
        {
            if time_us > self.navigator.time_us() {
                self.navigator.predict(time_us, &self.input)?;
            }
            self.input = input;
            self.commands.pop_front();
        }
        if to_us > self.navigator.time_us() { self.navigator.predict(to_us, &self.input) } else { Ok(()) }
    }

    /// The input at a time, while there is no filter to move along.
    fn input_at(&mut self, now_us: u64) {
        while let Some(&(time_us, input)) = self.commands.front()
            && time_us <= now_us
        {
            self.input = input;
            self.commands.pop_front();
        }
    }

    /// Fuses an event that was valid `late_s` ago. Fixes come up to a second late and are carried
    /// along; the others are late by a step at most, which moves them by less than their noise.
    fn fuse(&mut self, event: &Event, late_s: f64, settings: &Settings, clock: &UtcClock) {
        let app = &settings.app;
        let x = self.navigator.state();
        let measurement = match *event {
            Event::Depth { depth_m } if app.use_depth => {
                Measurement::Depth { z_m: depth_m - body_to_ned(x, &app.installation.depth_arm_m)[2] }
            }
            Event::Attitude { euler_rad } if app.use_attitude => Measurement::Attitude { euler_rad },
            Event::Rates { rates_radps } if app.use_rates => Measurement::Rates { rates_radps },
            Event::BottomTrack { velocity_mps } if app.use_dvl => Measurement::BottomTrack {
                velocity_mps: at_centre([x[P], x[Q], x[R]], velocity_mps, &app.installation.dvl_arm_m),
            },
            Event::WaterTrack { velocity_mps } if app.use_water_track => Measurement::WaterTrack {
                velocity_mps: at_centre([x[P], x[Q], x[R]], velocity_mps, &app.installation.dvl_arm_m),
            },
            Event::Fix { position_m } if app.use_gnss && x[Z] <= app.gnss_max_depth_m => {
                let arm_m = body_to_ned(x, &app.installation.gnss_arm_m);
                let through_water_mps = body_to_ned(x, &[x[U], x[V], x[W]]);
                let current_mps = self.navigator.current();
                let along = |i: usize| (through_water_mps[i] + current_mps[i]) * late_s - arm_m[i];
                Measurement::VehicleGnss { position_m: [position_m[0] + along(0), position_m[1] + along(1)] }
            }
            Event::Acoustic(event) => {
                let Some(fix) = self.acoustics.take(&event, &mut self.navigator, clock, app) else { return };
                self.hear_depth(fix.transducer_depth_m);
                self.ship.set(fix.ship);
                for measurement in [fix.range, fix.range_rate].into_iter().flatten() {
                    let fusions = self.navigator.fuse(&measurement);
                    self.record(&fusions);
                }
                self.navigator.drop_clone(fix.clone);
                return;
            }
            _ => return,
        };
        let fusions = self.navigator.fuse(&measurement);
        self.record(&fusions);
    }

    /// The ship says how deep its transducer hangs.
    fn hear_depth(&mut self, depth_m: f64) {
        if self.transducer_depth_m != Some(depth_m) {
            let config = backseat_core::navigation::NavigationConfig {
                ship_transducer_depth_m: depth_m,
                ..*self.navigator.config()
            };
            if self.navigator.reconfigure(&config).is_ok() {
                self.transducer_depth_m = Some(depth_m);
            }
        }
    }

    fn record(&mut self, fusions: &Fusions) {
        for record in fusions.iter() {
            let confirms = matches!(record.sensor, Sensor::VehicleGnss | Sensor::Range);
            if confirms && record.outcome == FusionOutcome::Fused {
                self.resumed = None;
            }
            // beyond the capacity they are fused all the same, only not reported
            let _ = self.records.push(*record);
        }
    }

    /// Starts the filter (2.3.1.2) once fix (or the position from before a reset), attitude and depth are fresh.
    fn initialise(&mut self, now_us: u64, settings: &Settings) {
        let app = &settings.app;
        let s = &self.samples;
        let fix_m = fresh(s.fix_m, now_us, INITIAL_FIX_AGE_US);
        let resumed = if fix_m.is_some() { None } else { self.resumed };
        let (Some(fix_m), Some(euler_rad), Some(depth_m)) = (
            fix_m.or(resumed.map(|navigation| navigation.position_m)),
            fresh(s.euler_rad, now_us, timeout_us(app.attitude_timeout_s)),
            fresh(s.depth_m, now_us, timeout_us(app.depth_timeout_s)),
        ) else {
            return;
        };
        let rates_radps = fresh(s.rates_radps, now_us, timeout_us(app.attitude_timeout_s)).unwrap_or_default();
        let speed = match fresh(s.bottom_mps, now_us, timeout_us(app.attitude_timeout_s)) {
            Some(velocity_mps) if app.use_dvl => {
                InitialSpeed::Dvl(at_centre(rates_radps, velocity_mps, &app.installation.dvl_arm_m))
            }
            _ => InitialSpeed::Commanded(steady_speed_mps(&self.input, settings)),
        };
        let config = *self.navigator.config();
        let sigma_m = resumed.map_or(config.sensors.gnss_m, |navigation| navigation.sigma_after(now_us));
        let initial = InitialState::from_fix(fix_m, sigma_m, depth_m, euler_rad, rates_radps, speed, &config);
        // refused only for values that are not finite: the next samples come soon
        if self.navigator.initialise(now_us, &initial).is_ok() {
            self.resumed = resumed;
        }
    }

    /// Since when attitude or depth and the filter have contradicted each other, µs.
    pub fn unsteerable_since_us(&self) -> Option<u64> {
        let since_us = [Sensor::Attitude, Sensor::Depth].map(|sensor| self.navigator.suspect_since_us(sensor));
        since_us.into_iter().flatten().min()
    }

    /// A fix that the filter could start from.
    pub fn has_fix(&self, now_us: u64) -> bool {
        fresh(self.samples.fix_m, now_us, INITIAL_FIX_AGE_US).is_some()
    }

    /// Whether any sensor and the filter contradict each other, or have and no fix has said who was right.
    pub fn is_suspect(&self) -> bool {
        let navigator = &self.navigator;
        Sensor::ALL.into_iter().any(|sensor| navigator.is_suspect(sensor) || navigator.unconfirmed_sigma(sensor) > 0.0)
    }
}

/// A sample that is younger than `age_us`.
pub fn fresh<T>(latest: Latest<T>, now_us: u64, age_us: u64) -> Option<T> {
    latest.filter(|(time_us, _)| now_us.saturating_sub(*time_us) <= age_us).map(|(_, value)| value)
}

/// Seconds of a timeout as µs.
pub fn timeout_us(timeout_s: f64) -> u64 {
    crate::decode::micros(timeout_s)
}

/// Velocity at the centre of gravity of one measured at an arm: v − ω × r.
pub fn at_centre(omega: [f64; 3], v: [f64; 3], r: &[f64; 3]) -> [f64; 3] {
    [
        v[0] - (omega[1] * r[2] - omega[2] * r[1]),
        v[1] - (omega[2] * r[0] - omega[0] * r[2]),
        v[2] - (omega[0] * r[1] - omega[1] * r[0]),
    ]
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

    /// A sensor ahead of the centre of gravity of a vehicle that yaws to starboard and pitches up
    /// moves to starboard and upwards by ω × r.
    #[test]
    fn val_velocities_move_to_the_centre_of_gravity() {
        let (q, r, arm_m) = (0.1, 0.2, 0.5);
        let measured = [1.0, r * arm_m, -q * arm_m];
        assert_eq!(at_centre([0.0, q, r], measured, &[arm_m, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn samples_grow_stale() {
        let latest = Some((1_000, 5));
        assert_eq!(fresh(latest, 1_500, 500), Some(5));
        assert_eq!(fresh(latest, 1_501, 500), None);
        assert_eq!(fresh(latest, 900, 500), Some(5));
    }

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
