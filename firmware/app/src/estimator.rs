//! The filter and what feeds it: events in the order of their validity, inputs, initialisation.

use crate::acoustics::{Acoustics, body_to_ned};
use crate::event::Event;
use crate::parameters::Settings;
use crate::queue::Queue;
use crate::time::UtcClock;
use backseat_core::dynamics::{ActuatorInput, FINS, VehicleModel};
use backseat_core::navigation::{
    ConfigError, FusionRecord, Fusions, InitialSpeed, InitialState, Measurement, NavigationError, Navigator, Sensor,
};
use backseat_core::state::{P, Q, R, Z};
use heapless::{Deque, Vec};

/// Scalar fusions kept for telemetry in one step; a step at full rates has about ten.
const MAX_RECORDS: usize = 48;
/// Commands on their way to the actuators.
const MAX_COMMANDS: usize = 16;
/// A fix older than this does not initialise, µs.
const INITIAL_FIX_AGE_US: u64 = 2_500_000;

/// Latest sample of one source, and when it was valid.
type Latest<T> = Option<(u64, T)>;

/// What the last samples said, whether fused or not.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    pub depth_m: Latest<f64>,
    pub euler_rad: Latest<[f64; 3]>,
    pub rates_radps: Latest<[f64; 3]>,
    pub bottom_mps: Latest<[f64; 3]>,
    pub fix_m: Latest<[f64; 2]>,
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
    lateness: Lateness,
    transducer_depth_m: Option<f64>,
}

impl Estimator {
    pub const fn new() -> Self {
        Self {
            navigator: Navigator::new(),
            acoustics: Acoustics::new(),
            queue: Queue::new(),
            samples: Samples { depth_m: None, euler_rad: None, rates_radps: None, bottom_mps: None, fix_m: None },
            input: ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; FINS] },
            commands: Deque::new(),
            records: Vec::new(),
            lateness: Lateness { late: 0, too_late: 0 },
            transducer_depth_m: None,
        }
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

    /// Forgets samples, events and inputs.
    pub fn reset(&mut self) {
        let Self { queue, samples, input, commands, records, .. } = self;
        queue.clear();
        *samples = Samples { depth_m: None, euler_rad: None, rates_radps: None, bottom_mps: None, fix_m: None };
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
            if self.navigator.is_initialised() && self.reach(time_us, settings)? {
                self.fuse(&event, settings, clock);
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
            Event::WaterTrack { .. } | Event::Acoustic(_) => {}
        }
    }

    /// Moves the filter to an event; false when the event is too old to be used at all.
    fn reach(&mut self, time_us: u64, settings: &Settings) -> Result<bool, NavigationError> {
        let behind_us = self.navigator.time_us().saturating_sub(time_us);
        if behind_us == 0 {
            self.predict(time_us)?;
            return Ok(true);
        }
        // A little late: fused as if valid now, which at 1 m/s and 20 ms is far below its noise.
        let usable = behind_us as f64 * 1e-6 <= settings.app.late_tolerance_s;
        let count = if usable { &mut self.lateness.late } else { &mut self.lateness.too_late };
        *count = count.saturating_add(1);
        Ok(usable)
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

    fn fuse(&mut self, event: &Event, settings: &Settings, clock: &UtcClock) {
        let app = &settings.app;
        let x = self.navigator.state();
        let measurement = match *event {
            Event::Depth { depth_m } if app.use_depth => {
                Measurement::Depth { z_m: depth_m - body_to_ned(x, &app.depth_arm_m)[2] }
            }
            Event::Attitude { euler_rad } if app.use_attitude => Measurement::Attitude { euler_rad },
            Event::Rates { rates_radps } if app.use_rates => Measurement::Rates { rates_radps },
            Event::BottomTrack { velocity_mps } if app.use_dvl => {
                Measurement::BottomTrack { velocity_mps: at_centre([x[P], x[Q], x[R]], velocity_mps, &app.dvl_arm_m) }
            }
            Event::WaterTrack { velocity_mps } if app.use_water_track => {
                Measurement::WaterTrack { velocity_mps: at_centre([x[P], x[Q], x[R]], velocity_mps, &app.dvl_arm_m) }
            }
            Event::Fix { position_m } if app.use_gnss && x[Z] <= app.gnss_max_depth_m => {
                let arm_m = body_to_ned(x, &app.gnss_arm_m);
                Measurement::VehicleGnss { position_m: [position_m[0] - arm_m[0], position_m[1] - arm_m[1]] }
            }
            Event::Acoustic(event) => {
                let Some(fix) = self.acoustics.take(&event, &mut self.navigator, clock, app) else { return };
                self.hear_depth(fix.transducer_depth_m);
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
            // beyond the capacity they are fused all the same, only not reported
            let _ = self.records.push(*record);
        }
    }

    /// Starts the filter (2.3.1.2) once fix, attitude and depth are fresh.
    fn initialise(&mut self, now_us: u64, settings: &Settings) {
        let app = &settings.app;
        let s = &self.samples;
        let (Some(fix_m), Some(euler_rad), Some(depth_m)) = (
            fresh(s.fix_m, now_us, INITIAL_FIX_AGE_US),
            fresh(s.euler_rad, now_us, timeout_us(app.attitude_timeout_s)),
            fresh(s.depth_m, now_us, timeout_us(app.depth_timeout_s)),
        ) else {
            return;
        };
        let rates_radps = fresh(s.rates_radps, now_us, timeout_us(app.attitude_timeout_s)).unwrap_or_default();
        let speed = match fresh(s.bottom_mps, now_us, timeout_us(app.attitude_timeout_s)) {
            Some(velocity_mps) if app.use_dvl => {
                InitialSpeed::Dvl(at_centre(rates_radps, velocity_mps, &app.dvl_arm_m))
            }
            _ => InitialSpeed::Commanded(steady_speed_mps(&self.input, settings)),
        };
        let config = *self.navigator.config();
        let sigma_m = config.sensors.gnss_m;
        let initial = InitialState::from_fix(fix_m, sigma_m, depth_m, euler_rad, rates_radps, speed, &config);
        // refused only for values that are not finite: the next samples come soon
        let _ = self.navigator.initialise(now_us, &initial);
    }

    /// Longest row of rejections of any sensor in use.
    pub fn rejections_in_a_row(&self) -> u32 {
        Sensor::ALL.into_iter().map(|sensor| self.navigator.consecutive_rejections(sensor)).max().unwrap_or(0)
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
fn at_centre(omega: [f64; 3], v: [f64; 3], r: &[f64; 3]) -> [f64; 3] {
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
