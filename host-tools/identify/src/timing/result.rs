//! What is known of the timing once it is fitted.

use crate::simulation::OUTPUTS;
use backseat_core::dynamics::INPUTS;
use backseat_estimation::commands::{Hold, HoldKind, InputTiming};

/// An autocorrelation of the residuals from here on is reported as structure.
const COLOURED: f64 = 0.1;

/// What a log says about one actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorTiming {
    /// Which, as in [`backseat_estimation::commands::ACTUATORS`].
    pub name: &'static str,
    /// How it follows its command.
    pub hold: Hold,
    /// 95 % interval of the delay, s; `None` where the motion does not show it.
    pub ci95: Option<[f64; 2]>,
}

/// Residuals of one output in segments of ten seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputWhiteness {
    /// Which.
    pub name: &'static str,
    /// Ljung and Box: probability under whiteness.
    pub p: f64,
    /// Largest autocorrelation up to two seconds.
    pub max_autocorrelation: f64,
}

/// When the actuators follow, and what is left then.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingEstimate {
    /// By actuator.
    pub actuators: [ActuatorTiming; INPUTS],
    /// By how much −2 ln L is smaller than with all commands held and without delay.
    pub gain: f64,
    /// By output.
    pub whiteness: [OutputWhiteness; OUTPUTS],
}

impl TimingEstimate {
    /// For [`crate::LoggedInputs::act`].
    pub fn timing(&self) -> InputTiming {
        self.actuators.map(|actuator| actuator.hold)
    }

    /// In sentences: what is not held without delay, and a warning where the fit is not white.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for actuator in self.actuators.iter().filter(|actuator| actuator.hold != Hold::default()) {
            let moves = match actuator.hold.kind {
                HoldKind::Held => "holds each command until the next sample",
                HoldKind::Continuous => "moves on between the samples of its command",
            };
            let delay =
                actuator.ci95.filter(|_| actuator.hold.delay_s != 0.0).map_or_else(String::new, |[low, high]| {
                    format!(", {:.3} s late ({low:.3} to {high:.3})", actuator.hold.delay_s)
                });
            notes.push(format!("{} {moves}{delay}", actuator.name));
        }
        let coloured: Vec<String> = self
            .whiteness
            .iter()
            .filter(|output| output.max_autocorrelation > COLOURED && output.p < 1.0e-12)
            .map(|output| format!("{} {:.2}", output.name, output.max_autocorrelation))
            .collect();
        if !coloured.is_empty() {
            notes.push(format!(
                "warning: residuals are not white (largest autocorrelation {}): the water disturbs, or model or timing lack \
                 something; `backseat diagnose` looks for it",
                coloured.join(", ")
            ));
        }
        notes
    }
}
