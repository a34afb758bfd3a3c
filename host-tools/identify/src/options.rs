//! Methods, settings and errors.

use backseat_core::dynamics::ParameterError;
use backseat_core::identification::{ConfigError, Scale};
use std::fmt;
use std::str::FromStr;

/// How to identify.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// The board's adaptive identifier, causal, as it runs under way.
    AidOnline,
    /// Adaptive identification, zero-phase and in several passes.
    Aid,
    /// Weak form with instrumental variables.
    Iv,
    /// Prediction error over long runs, Gauss-Newton.
    OutputError,
    /// AID, instrumental variables, output error; each step only where held-out data are predicted better.
    Auto,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::AidOnline, Self::Aid, Self::Iv, Self::OutputError, Self::Auto];

    /// Name on the command line and in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::AidOnline => "aid-online",
            Self::Aid => "aid",
            Self::Iv => "iv",
            Self::OutputError => "output-error",
            Self::Auto => "auto",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|method| method.name() == text).ok_or_else(|| {
            format!("there is no method {text}; the methods are {}", Self::ALL.map(Self::name).join(", "))
        })
    }
}

/// Settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The parameter that is known.
    pub scale: Scale,
    /// One-sigma noise of u, v, w, p, q, r: m/s and rad/s.
    pub velocity_noise: [f64; 6],
    /// One-sigma noise of roll and pitch, rad.
    pub roll_pitch_noise_rad: f64,
    /// Parameters stay between these multiples of the prior.
    pub box_ratio: [f64; 2],
    /// Whether d26 and d35 are identified too; the automatic method tries them by itself.
    pub cross_drag: bool,
}

impl Options {
    /// Sensors of Table 4.13, scale by m11.
    pub const DEFAULT: Self = Self {
        scale: Scale::M11,
        velocity_noise: [0.013, 0.013, 0.013, 1.745e-4, 1.745e-4, 1.745e-4],
        roll_pitch_noise_rad: 4.363e-3,
        box_ratio: [0.3, 3.0],
        cross_drag: false,
    };

    /// With the noise, one sigma, of velocity, m/s, of angular rates, rad/s, and of roll and pitch, rad.
    #[must_use]
    pub const fn of_noise(linear_mps: f64, angular_radps: f64, roll_pitch_rad: f64) -> Self {
        let (v, w) = (linear_mps, angular_radps);
        Self { velocity_noise: [v, v, v, w, w, w], roll_pitch_noise_rad: roll_pitch_rad, ..Self::DEFAULT }
    }
}

/// Why an identification gave nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// A channel that every method needs.
    #[error("the log has no {0}")]
    Missing(&'static str),
    /// No stretch is long enough.
    #[error("the log has no minute of attitude, body rates and DVL velocity without a gap of more than 1 s")]
    TooShort,
    /// The prior is unusable.
    #[error("the declared vehicle is unusable: {0}")]
    Prior(ParameterError),
    /// The identifier refused its settings.
    #[error("the identifier refuses its settings: {0:?}")]
    Settings(ConfigError),
    /// The data determine nothing.
    #[error("{0}")]
    Degenerate(String),
}
