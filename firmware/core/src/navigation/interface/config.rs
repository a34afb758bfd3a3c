//! Configuration of the filter.

use super::effect_states::EffectStates;
use super::error::ConfigError;
use crate::effects::{EffectError, EffectSet};
use crate::parameters::{Installation, ParameterError, Priors, ProcessNoise, SensorNoise, check};

/// How the vehicle's velocity evolves between measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessModel {
    /// Constant body velocity, driven by white acceleration (2.25)-(2.33).
    Kinematic,
    /// The vehicle's 6-DOF dynamics driven by fins and propeller (3.2)-(3.24).
    Dynamic,
}

/// Process noise near the surface, where the hydrodynamics of the model do not hold: parts of the hull leave
/// the water and lose their buoyancy, and waves push.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNoise {
    /// It holds above this depth, m: half a length, from where on no end of a diving hull is out of the water.
    pub depth_m: f64,
    /// The noise there.
    pub noise: ProcessNoise,
}

impl SurfaceNoise {
    /// Dynamic model of the reference vehicle: a tenth of its buoyancy comes and goes at either end within a second. So
    /// large that the position is as well known after a dive as the filter says (60 simulated dives).
    pub const DYNAMIC: Self = Self {
        depth_m: 1.0,
        noise: ProcessNoise {
            linear_mps2_per_sqrt_hz: [4.0e-2, 2.0e-2, 1.0e-1],
            angular_radps2_per_sqrt_hz: [5.0e-2, 2.0e-1, 3.0e-2],
        },
    };
    /// Kinematic model: the vehicle also starts from rest here, at 0.3 m/s² for some seconds, and dives.
    pub const KINEMATIC: Self = Self {
        depth_m: 1.0,
        noise: ProcessNoise {
            linear_mps2_per_sqrt_hz: [2.0e-1, 1.0e-1, 1.0e-1],
            angular_radps2_per_sqrt_hz: [1.0e-1, 2.0e-1, 2.0e-1],
        },
    };
}

/// An input is taken to hold for so long, s; what moves the vehicle after that is unknown.
pub const LONGEST_HOLD_S: f64 = 10.0;
/// Its process noise then, by the kinematic model: after a minute it is as fast or slow as an AUV may be, 0.8 m/s (one
/// sigma), and 27 m from straight ahead to either side. Where it heads is no part of this: see `UNKNOWN_POSE_RAD`.
pub const UNKNOWN_INPUT: ProcessNoise =
    ProcessNoise { linear_mps2_per_sqrt_hz: [0.1, 0.1, 0.03], angular_radps2_per_sqrt_hz: [0.0; 3] };
/// One sigma of roll, pitch and heading behind such a time, rad: an AUV's slopes, and any heading (π/√3). Added at its
/// end: a linear filter would take what the heading may have been for hundreds of metres.
pub const UNKNOWN_POSE_RAD: [f64; 3] = [0.3, 0.3, 1.8];
/// One sigma of the rates then, rad/s.
pub const UNKNOWN_RATE_RADPS: f64 = 0.2;

/// The ship moves at constant velocity and turn rate, driven by white acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipNoise {
    /// √PSD of the horizontal acceleration (x and y alike), m/s²/√Hz.
    pub linear_mps2_per_sqrt_hz: f64,
    /// √PSD of the heading acceleration, rad/s²/√Hz.
    pub angular_radps2_per_sqrt_hz: f64,
}

crate::declared! {
    /// Everything that the filter is configured with.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct NavigationConfig;
    /// The reference vehicle without a DVL on its dynamic model.
    const REFERENCE, with {
        /// Process noise that belongs to `process_model`.
        process_noise: ProcessNoise = ProcessNoise::DYNAMIC,
        /// Factors on the roots of `process_noise` along u, v, w, p, q, r; 1 but for the robust filter.
        noise_factor: [f64; 6] = [1.0; 6],
        /// Process noise near the surface, if it differs there.
        surface: Option<SurfaceNoise> = Some(SurfaceNoise::DYNAMIC),
        /// Process noise of the ship.
        ship_noise: ShipNoise = ShipNoise { linear_mps2_per_sqrt_hz: 2.0e-2, angular_radps2_per_sqrt_hz: 1.0e-3 },
        /// Sensor noise.
        sensors: SensorNoise = SensorNoise::DEFAULT,
        /// Effects that are present; those that are states start from here.
        effects: EffectSet = EffectSet::NONE,
        /// Effects that are estimated.
        effect_states: EffectStates = EffectStates::NONE,
        /// Sound speed by which travel times became ranges, m/s: scales clock errors.
        sound_speed_mps: f64 = Installation::DEFAULT.sound_speed_mps,
        /// Depth of the ship's transducer, m.
        ship_transducer_depth_m: f64 = Installation::DEFAULT.ship_transducer_depth_m,
        /// (σx² + σy²)/r over the noise of a range from which on the range is taken to second order; 1e6: always to first,
        /// as in the thesis.
        range_curvature: f64 = 0.05,
        /// √(σx² + σy²) beyond which range rates are not used, m; 1e6: always used, as in the thesis.
        range_rate_within_m: f64 = 50.0,
        /// Priors of the states that [`Self::make_robust`] adds.
        priors: Priors = Priors::DEFAULT,
        /// The current changes, and a filter with a steady one and the nominal filter run beside this one; the three are
        /// weighed by their ranges.
        bank: bool = false,
    };
    /// Its rows of the table of parameters that are no part of another section.
    const ROWS {
        [choice "app.process_model"] "Process model of the filter: 0 dynamic, 1 kinematic." process_model: ProcessModel = ProcessModel::Dynamic; [ProcessModel::Dynamic, ProcessModel::Kinematic],
        [real "app.gate_sigma", "", "1", [1.0, LARGEST_GATE_SIGMA]] "Innovations beyond this many standard deviations are rejected." gate_sigma: f64 = 5.0,
        [whole "app.rejections_in_a_row", "", "1", [1.0, 1000.0]] "Number of measurements of one sensor in a row, beyond three fifths of the gate, that make it suspect." exceedances: u32 = 3,
    }
}

impl NavigationConfig {
    /// All zero: of a filter that is not configured, and whose static takes no flash.
    pub(crate) const BLANK: Self = Self {
        process_model: ProcessModel::Kinematic,
        process_noise: ProcessNoise { linear_mps2_per_sqrt_hz: [0.0; 3], angular_radps2_per_sqrt_hz: [0.0; 3] },
        noise_factor: [0.0; 6],
        surface: None,
        ship_noise: ShipNoise { linear_mps2_per_sqrt_hz: 0.0, angular_radps2_per_sqrt_hz: 0.0 },
        sensors: SensorNoise {
            depth_m: 0.0,
            attitude_rad: 0.0,
            heading_rad: 0.0,
            rates_radps: 0.0,
            dvl_mps: 0.0,
            range_m: 0.0,
            range_rate_mps: 0.0,
            gnss_m: 0.0,
            ship_gnss_m: 0.0,
        },
        effects: EffectSet::NONE,
        effect_states: EffectStates::NONE,
        sound_speed_mps: 0.0,
        ship_transducer_depth_m: 0.0,
        gate_sigma: 0.0,
        exceedances: 0,
        range_curvature: 0.0,
        range_rate_within_m: 0.0,
        priors: Priors::KNOWN,
        bank: false,
    };
}

/// Process noise of the robust filter over that of the nominal one: the parameters that are not states act most on
/// heave and pitch. More would hurt. A speed that is learnt from pitch and depth, both noisy, is biased where the
/// noise is not what the filter says (L. Ljung, IEEE Trans. Automatic Control 24, 1979): a factor of 5 in heave and
/// pitch makes it 4 % too fast on the first line. What waves do is in [`crate::navigation::trust::waves`].
const ROBUST_NOISE: [f64; 6] = [1.0, 1.0, 2.0, 1.0, 2.0, 1.0];

impl NavigationConfig {
    /// Turns the nominal filter into the robust one: usually unknown quantities become states, and the process noise
    /// grows to cover the effects that are not states.
    pub fn make_robust(&mut self) {
        self.noise_factor = ROBUST_NOISE;
        self.effect_states = EffectStates::robust(&self.priors);
        self.bank = true;
    }

    /// Turns the nominal filter into the thesis' own (chapters 2 and 3): every measurement is used, to first order, and
    /// the process noise is the same at every depth. A single wrong range is believed.
    pub fn make_as_in_thesis(&mut self) {
        self.surface = None;
        self.gate_sigma = LARGEST_GATE_SIGMA;
        self.range_curvature = LARGEST;
        self.range_rate_within_m = LARGEST;
    }
}

/// Widest gate, sigmas: none.
const LARGEST_GATE_SIGMA: f64 = 1.0e3;
/// Largest value of a number that is not in the table of parameters: far beyond use, far from overflow.
const LARGEST: f64 = 1.0e6;

impl NavigationConfig {
    /// Checks every number: by its row of the table of parameters where it has one, and what states, effects and noise
    /// have to satisfy together.
    ///
    /// # Errors
    /// The first value that is not finite or outside its range. Noise must be positive, process
    /// noise of the ship and the walks of effect states may be zero.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let Self { sound_speed_mps, ship_transducer_depth_m, ship_noise: ship, .. } = *self;
        check(Self::ROWS, self)?;
        check(SensorNoise::ROWS, &self.sensors)?;
        check(Installation::ROWS, &Installation { sound_speed_mps, ship_transducer_depth_m, ..Installation::DEFAULT })?;
        check(ProcessNoise::ROWS, &self.process_noise)?;
        if let Some(surface) = &self.surface {
            in_range("surface.depth_m", surface.depth_m, 0.0)?;
            check(ProcessNoise::ROWS, &surface.noise)?;
        }
        for factor in self.noise_factor {
            in_range("noise_factor", factor, f64::MIN_POSITIVE)?;
        }
        in_range("ship_noise.linear_mps2_per_sqrt_hz", ship.linear_mps2_per_sqrt_hz, 0.0)?;
        in_range("ship_noise.angular_radps2_per_sqrt_hz", ship.angular_radps2_per_sqrt_hz, 0.0)?;
        in_range("range_curvature", self.range_curvature, 0.0)?;
        in_range("range_rate_within_m", self.range_rate_within_m, 0.0)?;
        for state in self.effect_states.iter() {
            in_range("effect_states.initial_sigma", state.initial_sigma, f64::MIN_POSITIVE)?;
            in_range("effect_states.random_walk_per_sqrt_s", state.random_walk_per_sqrt_s, 0.0)?;
        }
        self.effect_states.validate()?;
        match self.effects.validate() {
            Err(EffectError::OutOfRange { effect, parameter, .. }) => Err(ConfigError::Effect { effect, parameter }),
            _ => Ok(()),
        }
    }
}

impl NavigationConfig {
    /// Whether a depth, m, is so small that the hydrodynamics of the model do not hold.
    pub(crate) fn is_at_surface(&self, depth_m: f64) -> bool {
        self.surface.is_some_and(|surface| depth_m < surface.depth_m)
    }

    /// Power spectral densities of the accelerations along u, v, w, p, q, r at a depth, m; `sea`: factor on the noise in
    /// heave and pitch.
    pub(crate) fn psd_at(&self, depth_m: f64, sea: f64) -> [f64; 6] {
        match &self.surface {
            Some(surface) if self.is_at_surface(depth_m) => surface.noise.psd(),
            _ => {
                let psd = self.process_noise.psd();
                let sea = [1.0, 1.0, sea, 1.0, sea, 1.0];
                core::array::from_fn(|i| {
                    let factor = self.noise_factor[i] * sea[i];
                    psd[i] * (factor * factor)
                })
            }
        }
    }
}

fn in_range(key: &'static str, value: f64, min: f64) -> Result<(), ParameterError> {
    let max = LARGEST;
    if (min..=max).contains(&value) { Ok(()) } else { Err(ParameterError { key, index: 0, value, min, max }) }
}
