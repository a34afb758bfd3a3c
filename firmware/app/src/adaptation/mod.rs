//! The adaptive identifier and the fault monitor beside the filter.
//!
//! In every step the attitude, rates, velocity and commands of one recent time go to both. That time lies [`LAG_US`]
//! back, so that all samples have arrived. The identifier is slower than the filter and independent of it: its estimates
//! go to the host, not into the filter, whose robust form estimates what it needs itself.
//!
//! | input | from |
//! |---|---|
//! | attitude, rates | samples of the attitude source, interpolated |
//! | velocity through the water | water track as it is, or bottom track less the filter's current; the source that the filter fuses |
//! | fins, propeller | mean of the commands since the sample before, while they act: quantised, delayed by `app.actuator_delay_s` |
//!
//! Adaptation pauses without velocity, near the surface, without a mission under way, or while the current is unknown;
//! telemetry gives the cause ([`Activity`]). A current that is neither estimated nor zero would be taken for motion of
//! the vehicle: switch `app.current_state` on where there may be one.

mod fault;
mod samples;

use crate::inputs::Inputs;
use crate::inputs::installation::velocity_at_centre;
use crate::parameters::Settings;
use backseat_core::dynamics::{ActuatorInput, Attitude};
use backseat_core::identification::{self, IdentificationConfig, Identifier, PARAMETERS, SampleOutcome};
use backseat_core::navigation::Navigator;
use backseat_core::state::Z;
use backseat_wire::hostlink::{Activity, FaultReport, Identification, Visibility};
use fault::FaultWatch;
use nalgebra::{Vector3, Vector6};
use samples::RecentSamples;

/// How far back a sample lies, µs: two samples of a 3 Hz sensor and the way of its bytes.
const LAG_US: u64 = 600_000;
/// The identifier's period, µs: the board's step.
const PERIOD_US: u64 = 100_000;
/// Half a length of the reference vehicle, m: above it an end of the hull may be out of the water, as for the filter.
const SURFACE_M: f64 = 1.0;
/// A current known less well than this is not subtracted from the bottom track, m/s: 3 % of a survey's speed.
const CURRENT_SIGMA_MPS: f64 = 0.03;
/// Time between two reports, µs.
const REPORT_US: u64 = 10_000_000;

/// All channels at one time.
struct MotionSample {
    time_us: u64,
    attitude: Vector3<f64>,
    /// Through the water.
    velocity: Vector6<f64>,
    /// Mean since the sample before.
    input: ActuatorInput,
}

/// The identifier with its inputs, and the fault monitor.
pub struct Adaptation {
    identifier: Identifier,
    faults: FaultWatch,
    attitude: RecentSamples,
    rates: RecentSamples,
    velocity: RecentSamples,
    /// The velocities kept are through the water.
    water_track: bool,
    /// The identifier is built from the parameters in use.
    configured: bool,
    activity: Activity,
    reported: Activity,
    next_report_us: u64,
}

impl Adaptation {
    pub const fn new() -> Self {
        Self {
            identifier: Identifier::new(),
            faults: FaultWatch::new(),
            attitude: RecentSamples::new(),
            rates: RecentSamples::new(),
            velocity: RecentSamples::new(),
            water_track: false,
            configured: false,
            activity: Activity::Off,
            reported: Activity::Off,
            next_report_us: 0,
        }
    }

    /// Forgets everything: the next sample starts from the parameters in use.
    pub fn restart(&mut self) {
        for samples in [&mut self.attitude, &mut self.rates, &mut self.velocity] {
            samples.clear();
        }
        self.faults.restart();
        self.configured = false;
        self.activity = Activity::Off;
        self.reported = Activity::Off;
        self.next_report_us = 0;
    }

    /// Takes the latest samples.
    fn listen(&mut self, inputs: &Inputs, settings: &Settings) {
        let samples = &inputs.latest;
        self.attitude.take(samples.euler_rad);
        self.rates.take(samples.rates_radps);
        let water_track = settings.app.use_water_track && samples.water_mps.is_some();
        if water_track != self.water_track {
            self.velocity.clear();
            self.water_track = water_track;
        }
        self.velocity.take(match (water_track, settings.app.use_dvl) {
            (true, _) => samples.water_mps,
            (false, true) => samples.bottom_mps,
            (false, false) => None,
        });
    }

    /// All channels at the present sample time, or why there is no sample.
    fn gather(&self, navigator: &Navigator, inputs: &Inputs, settings: &Settings) -> Result<MotionSample, Activity> {
        if navigator.state()[Z] < SURFACE_M {
            return Err(Activity::Surfaced);
        }
        let time_us = navigator.time_us().checked_sub(LAG_US).ok_or(Activity::NoAttitude)?;
        let euler_rad = self.attitude.angles_at(time_us).ok_or(Activity::NoAttitude)?;
        let rates_radps = self.rates.at(time_us).ok_or(Activity::NoAttitude)?;
        let at_instrument = self.velocity.at(time_us).ok_or(Activity::NoVelocity)?;
        let attitude = Vector3::from(euler_rad);
        let mut velocity =
            Vector3::from(velocity_at_centre(rates_radps, at_instrument, &settings.app.installation.dvl_arm_m));
        if !self.water_track {
            if navigator.main().current_sigma().is_some_and(|sigma| sigma.iter().any(|s| *s > CURRENT_SIGMA_MPS)) {
                return Err(Activity::NoVelocity);
            }
            let [north, east] = navigator.current();
            velocity -= Attitude::new(&attitude).rotation().tr_mul(&Vector3::new(north, east, 0.0));
        }
        let since_us = time_us.saturating_sub(PERIOD_US);
        let [p, q, r] = rates_radps;
        Ok(MotionSample {
            time_us,
            attitude,
            velocity: Vector6::new(velocity.x, velocity.y, velocity.z, p, q, r),
            input: inputs.actuators.mean(since_us, time_us).ok_or(Activity::NotUnderWay)?,
        })
    }

    /// Builds identifier and fault monitor from the parameters in use; the noise of a sample is that of its sensor, and
    /// more where the sensor is slower than the samples and its noise with it.
    fn configure(&mut self, settings: &Settings) -> bool {
        let intervals = [&self.attitude, &self.rates, &self.velocity].map(RecentSamples::interval_s);
        let [Some(attitude_s), Some(rates_s), Some(velocity_s)] = intervals else { return false };
        let period_s = PERIOD_US as f64 * 1e-6;
        let noise = |sigma: f64, interval_s: f64| sigma * libm::sqrt((interval_s / period_s).max(1.0));
        let sensors = &settings.navigation.sensors;
        let (dvl, rates) = (noise(sensors.dvl_mps, velocity_s), noise(sensors.rates_radps, rates_s));
        let config = IdentificationConfig {
            scale: settings.app.adapt_scale,
            velocity_noise: [dvl, dvl, dvl, rates, rates, rates],
            roll_pitch_noise_rad: noise(sensors.attitude_rad, attitude_s),
            ..IdentificationConfig::DEFAULT
        };
        if self.identifier.configure(&config, &settings.vehicle).is_err() {
            return false;
        }
        self.faults.use_vehicle(&settings.vehicle);
        true
    }

    /// One step.
    pub fn step(&mut self, under_way: bool, inputs: &Inputs, navigator: &Navigator, settings: &Settings) {
        self.listen(inputs, settings);
        let gathered = if !settings.app.adapt {
            Err(Activity::Off)
        } else if !under_way || !navigator.is_initialised() {
            Err(Activity::NotUnderWay)
        } else {
            self.gather(navigator, inputs, settings)
        };
        let sample = match gathered {
            Ok(sample) => sample,
            Err(reason) => {
                self.activity = reason;
                self.faults.interrupt();
                return;
            }
        };
        if !self.configured {
            self.configured = self.configure(settings);
            if !self.configured {
                self.activity = Activity::Off;
                return;
            }
        }
        let MotionSample { time_us, attitude, velocity, input } = &sample;
        self.faults.sample(*time_us, attitude, velocity, input);
        let report = self.identifier.sample(*time_us, attitude, velocity, input);
        self.activity = match report.outcome {
            SampleOutcome::Filling | SampleOutcome::WarmingUp => Activity::Starting,
            SampleOutcome::Adapting => Activity::Adapting,
            SampleOutcome::Diverged => Activity::Diverged,
            SampleOutcome::NotConfigured | SampleOutcome::Refused | SampleOutcome::OutOfOrder => self.activity,
        };
    }

    /// The fault monitor has found something wrong with the vehicle.
    pub fn has_fault(&self) -> bool {
        self.faults.has_fault()
    }

    /// State of the fault monitor, when it has changed.
    pub fn fault_report(&mut self, now_us: u64) -> Option<FaultReport> {
        self.faults.report(now_us)
    }

    /// The identified parameters for the host, when it is time for them.
    pub fn report(&mut self, now_us: u64) -> Option<Identification> {
        let news = self.configured || self.activity != self.reported;
        if now_us < self.next_report_us || !news {
            return None;
        }
        self.next_report_us = now_us.saturating_add(REPORT_US);
        self.reported = self.activity;
        let theta = self.identifier.estimate().filter(|_| self.configured);
        let mut visibility = [Visibility::Frozen; PARAMETERS];
        if self.configured {
            for (shown, excitation) in visibility.iter_mut().zip(self.identifier.excitation()) {
                *shown = match excitation.visibility {
                    identification::Visibility::Known => Visibility::Known,
                    identification::Visibility::Frozen => Visibility::Frozen,
                    identification::Visibility::Collinear => Visibility::Collinear,
                    identification::Visibility::Separate => Visibility::Separate,
                };
            }
        }
        Some(Identification {
            time_us: now_us,
            activity: self.activity,
            adapted_s: self.identifier.adapted_s(),
            theta: theta.map_or([0.0; PARAMETERS], |theta| theta.into()),
            visibility,
            drifted: self.identifier.drift().drifted(),
        })
    }
}
