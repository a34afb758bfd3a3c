//! The keys of a vehicle file: what the table of parameters declares, arranged as in a file.

use super::VehicleFile;
use backseat_app::parameters::{AppSettings, PARAMETERS, Parameter, Settings};
use backseat_core::navigation::NavigationConfig;
use backseat_core::parameters::{Kind, Shape};

/// What a board has beyond its vehicle ([`super::BoardFile`]).
pub(super) const BOARD_SECTION: &str = "app";

/// Keys of required sections that may be left out.
pub(super) const OPTIONAL: [&str; 5] =
    ["fins.stall_rad", "fins.gain", "drag.moment_uu", "drag.z_uw", "propeller.torque_arm_m"];

/// The keys of a section, each with all its numbers.
pub(super) fn keys(section: &str) -> impl Iterator<Item = &'static [Parameter]> {
    PARAMETERS.chunk_by(|a, b| a.key == b.key).filter(move |key| key[0].section() == section)
}

/// The key's name in its section.
pub(super) fn short_key(parameter: &Parameter) -> &'static str {
    parameter.key.split_once('.').map_or(parameter.key, |(_, key)| key)
}

impl VehicleFile {
    /// The settings of a board with this vehicle, all else at its default.
    pub fn settings(&self) -> Settings {
        Settings {
            vehicle: self.parameters,
            navigation: NavigationConfig {
                process_noise: self.noise,
                sensors: self.sensors,
                priors: self.priors,
                effects: self.effects.set,
                ..NavigationConfig::REFERENCE
            },
            learnt: self.learnt,
            app: AppSettings { installation: self.installation, safety: self.safety, ..AppSettings::DEFAULT },
            ..Settings::DEFAULT
        }
    }

    /// Takes over what the sections of a vehicle declare; not the effects.
    pub fn take(&mut self, settings: &Settings) {
        self.parameters = settings.vehicle;
        self.noise = settings.navigation.process_noise;
        self.sensors = settings.navigation.sensors;
        self.priors = settings.navigation.priors;
        self.learnt = settings.learnt;
        self.installation = settings.app.installation;
        self.safety = settings.app.safety;
    }
}

/// The numbers of a key, arranged by its shape.
pub(super) fn value_text(key: &[Parameter], settings: &Settings) -> String {
    let values: Vec<f64> = key.iter().map(|parameter| parameter.get(settings)).collect();
    match key[0].shape {
        Shape::Scalar => format!("{:?}", values[0]),
        Shape::Vector(_) => format!("{values:?}"),
        Shape::Matrix(_, columns) => format!("{:?}", values.chunks(columns).collect::<Vec<_>>()),
    }
}

/// Unit, range and help; the numbers of a key may have different ones.
pub(super) fn comment(key: &[Parameter]) -> String {
    let each = |of: fn(&Parameter) -> String| {
        let mut all: Vec<String> = key.iter().map(of).collect();
        all.dedup();
        all.join(", ")
    };
    format!("{}; {}; {}", each(|parameter| parameter.unit.to_owned()), each(range), key[0].help)
}

/// The range as it is written in files and pages.
pub(super) fn range(parameter: &Parameter) -> String {
    format!("{} to {}", super::short(parameter.min), super::short(parameter.max))
}

/// What is wrong with a value that the parameter does not admit.
pub(super) fn complaint(parameter: &Parameter, value: f64) -> String {
    let Parameter { name, .. } = parameter;
    let whole = if parameter.kind == Kind::Whole { "no whole number, or " } else { "" };
    format!("{name}: {value} is {whole}outside {} ({})", range(parameter), parameter.unit)
}
