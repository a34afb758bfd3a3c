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

crate::with_defaults! {
    /// Settings of the identifier.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct IdentificationConfig;
    /// 10 Hz, DVL and attitude sensor as in Table 4.13.
    const DEFAULT {
        /// Time between samples, s. Intervals within half of it are taken as they are, others empty the filter.
        period_s: f64 = 0.1,
        /// α of (4.41), 1/s.
        alpha_per_s: f64 = 0.3,
        /// γ of Γ_j = γ / mean(Yᵀ M⁻¹ Y)_jj at the start and in the end, 1/s².
        gamma_per_s2: [f64; 2] = [0.3, 0.03],
        /// Time constant of γ's fall, s of adaptation.
        gamma_time_s: f64 = 1000.0,
        /// The known parameter.
        scale: Scale = Scale::M11,
        /// The estimates of this time are averaged, s; a snapshot is several times worse.
        average_s: f64 = 1000.0,
        /// The first samples that only set the gains, s.
        warm_up_s: f64 = 60.0,
        /// θ̂ stays between these multiples of the prior.
        box_ratio: [f64; 2] = [0.3, 3.0],
        /// A parameter is excited when an error of half its box would change the acceleration of some axis by this
        /// much, root mean square: m/s² and rad/s². It also has to do so by more than the sensors' noise does.
        excitation_floor: [f64; 6] = [1.0e-3, 1.0e-3, 1.0e-3, 1.0e-2, 1.0e-3, 1.0e-3],
        /// One-sigma noise of the measured v, m/s and rad/s.
        velocity_noise: [f64; 6] = [0.013, 0.013, 0.013, 1.75e-4, 1.75e-4, 1.75e-4],
        /// One-sigma noise of roll and pitch, rad.
        roll_pitch_noise_rad: f64 = 4.36e-3,
    }
}

impl IdentificationConfig {
    /// Before it is configured: all bytes zero, so that an identifier costs no flash.
    pub(super) const NONE: Self = Self {
        period_s: 0.0,
        alpha_per_s: 0.0,
        gamma_per_s2: [0.0; 2],
        gamma_time_s: 0.0,
        scale: Scale::M11,
        average_s: 0.0,
        warm_up_s: 0.0,
        box_ratio: [0.0; 2],
        excitation_floor: [0.0; 6],
        velocity_noise: [0.0; 6],
        roll_pitch_noise_rad: 0.0,
    };

    /// # Errors
    /// The first setting outside its range.
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        let within = |value: f64, min: f64, max: f64| (min..=max).contains(&value);
        let [start, end] = self.gamma_per_s2;
        let [low, high] = self.box_ratio;
        // α dt < 1 is the limit of stability.
        let checks = [
            (within(self.period_s, 1.0e-3, 1.0), ConfigError::Period),
            (within(self.alpha_per_s, 1.0e-3, 0.5 / self.period_s), ConfigError::Alpha),
            (within(start, 1.0e-6, 10.0) && within(end, 1.0e-6, start), ConfigError::Gamma),
            (within(self.gamma_time_s, 1.0, 1.0e6), ConfigError::GammaTime),
            (within(self.average_s, 1.0, 1.0e6), ConfigError::Average),
            (within(self.warm_up_s, 1.0, 1.0e6), ConfigError::WarmUp),
            (within(low, 0.01, 0.99) && within(high, 1.01, 100.0), ConfigError::Box),
            (
                self.velocity_noise.iter().all(|&noise| within(noise, 0.0, 1.0))
                    && within(self.roll_pitch_noise_rad, 0.0, 1.0),
                ConfigError::Noise,
            ),
            (self.excitation_floor.iter().all(|&floor| within(floor, 1.0e-9, 10.0)), ConfigError::ExcitationFloor),
        ];
        checks.iter().try_for_each(|&(valid, error)| if valid { Ok(()) } else { Err(error) })
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
    /// `period_s` is not between 1 ms and 1 s.
    Period,
    /// `alpha_per_s` is not between 0.001 1/s and half the sample rate.
    Alpha,
    /// `gamma_per_s2` does not fall, or is not between 1e-6 and 10 1/s².
    Gamma,
    /// `gamma_time_s` is not between 1 s and 1e6 s.
    GammaTime,
    /// `average_s` is not between 1 s and 1e6 s.
    Average,
    /// `warm_up_s` is not between 1 s and 1e6 s.
    WarmUp,
    /// `box_ratio` does not hold the prior.
    Box,
    /// A sensor's noise is not between 0 and 1.
    Noise,
    /// An excitation floor is not between 1e-9 and 10.
    ExcitationFloor,
}
