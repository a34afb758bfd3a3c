//! Configuration of the identifier.

use super::theta::{BETA5, M11};
use crate::dynamics::ParameterError;

/// The parameter that is known, and with it the scale of θ: forces are not measured, so Y θ = 0 determines θ up to a
/// factor. It is held at its declared value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// m11 (dry mass and the small surge added mass). What adds mass, flooding, then appears as a change of all others.
    M11,
    /// β5 (bollard thrust). Fouling of the propeller then appears as a change of all others.
    Beta5,
}

impl Scale {
    /// Index of the known parameter in θ.
    #[must_use]
    pub const fn parameter(self) -> usize {
        match self {
            Self::M11 => M11,
            Self::Beta5 => BETA5,
        }
    }
}

/// Time between samples, s. Intervals within half of it are taken as they are, others empty the filter.
pub(super) const PERIOD_S: f64 = 0.1;
/// α of (4.41), 1/s.
pub(super) const ALPHA_PER_S: f64 = 0.3;
/// γ of Γ_j = γ / mean(Yᵀ M⁻¹ Y)_jj at the start and in the end, 1/s².
pub(super) const GAMMA_PER_S2: [f64; 2] = [0.3, 0.03];
/// Time constant of γ's fall, s of adaptation.
pub(super) const GAMMA_TIME_S: f64 = 1000.0;
/// The estimates of this time are averaged, s; a snapshot is several times worse.
pub(super) const AVERAGE_S: f64 = 1000.0;
/// A parameter is excited when an error of half its box would change the acceleration of some axis by this much, root
/// mean square: m/s² and rad/s². It also has to do so by more than the sensors' noise does.
pub(super) const EXCITATION_FLOOR: [f64; 6] = [1.0e-3, 1.0e-3, 1.0e-3, 1.0e-2, 1.0e-3, 1.0e-3];

crate::with_defaults! {
    /// What differs between vehicles and logs.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct IdentificationConfig;
    /// DVL and attitude sensor as in Table 4.13.
    const DEFAULT {
        /// The known parameter.
        scale: Scale = Scale::M11,
        /// The first samples that only set the gains, s.
        warm_up_s: f64 = 60.0,
        /// θ̂ stays between these multiples of the prior.
        box_ratio: [f64; 2] = [0.3, 3.0],
        /// One-sigma noise of the measured v, m/s and rad/s.
        velocity_noise: [f64; 6] = [0.013, 0.013, 0.013, 1.75e-4, 1.75e-4, 1.75e-4],
        /// One-sigma noise of roll and pitch, rad.
        roll_pitch_noise_rad: f64 = 4.36e-3,
    }
}

impl IdentificationConfig {
    /// Before it is configured: all bytes zero, so that an identifier costs no flash.
    pub(super) const NONE: Self = Self {
        scale: Scale::M11,
        warm_up_s: 0.0,
        box_ratio: [0.0; 2],
        velocity_noise: [0.0; 6],
        roll_pitch_noise_rad: 0.0,
    };

    /// # Errors
    /// The first setting outside its range.
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        let [low, high] = self.box_ratio;
        if !(0.01..=0.99).contains(&low) || !(1.01..=100.0).contains(&high) {
            return Err(ConfigError::Box);
        }
        let mut noise = self.velocity_noise.iter().chain([&self.roll_pitch_noise_rad]);
        if noise.all(|noise| (0.0..=1.0).contains(noise)) { Ok(()) } else { Err(ConfigError::Noise) }
    }
}

/// Why the identifier did not start.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ConfigError {
    /// A parameter of the prior is outside its range.
    Vehicle(ParameterError),
    /// B3 of the prior is not positive: the vehicle would float upside down.
    Unstable,
    /// `box_ratio` does not hold the prior.
    Box,
    /// A sensor's noise is not between 0 and 1.
    Noise,
}
