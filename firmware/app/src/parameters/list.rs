//! All parameters as one list, number by number, in the order of their index: core's rows, the effects, the app's rows.

use super::settings::{AppSettings, Settings};
use super::table::APP;
use backseat_core::control::ControlConfig;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::{self, ParameterId, ParameterKind};
use backseat_core::navigation::{Learnt, NavigationConfig, Priors, ProcessNoise, SensorNoise};
use backseat_core::parameters::{
    Declaration, INSTALLATION, Installation, Kind, LEARNT, NOISE, PRIOR, Row, SAFETY, SENSORS, SafetyLimits, Shape,
    UnderWay, VEHICLE, count,
};
use backseat_wire::hostlink::Refusal;
use core::ops::Deref;

/// One number of a key.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key and element: `vehicle.mass_kg`, `drag.quadratic_diag[0]`, `fins.cp_m[1][2]`.
    pub name: &'static str,
    /// Element of the key.
    pub element: usize,
    declaration: Declaration,
    access: Access,
}

/// Where its number is.
#[derive(Clone, Copy, Debug)]
enum Access {
    Vehicle(&'static Row<VehicleParameters>),
    Noise(&'static Row<ProcessNoise>),
    Sensors(&'static Row<SensorNoise>),
    Prior(&'static Row<Priors>),
    Learnt(&'static Row<Learnt>),
    Installation(&'static Row<Installation>),
    Effect(ParameterId),
    Filter(&'static Row<NavigationConfig>),
    App(&'static Row<AppSettings>),
    Control(&'static Row<ControlConfig>),
    Safety(&'static Row<SafetyLimits>),
}

impl Deref for Parameter {
    type Target = Declaration;

    fn deref(&self) -> &Declaration {
        &self.declaration
    }
}

impl Parameter {
    /// Its value in a set.
    #[must_use]
    pub fn get(&self, settings: &Settings) -> f64 {
        match self.access {
            Access::Vehicle(row) => (row.get)(&settings.vehicle, self.element),
            Access::Noise(row) => (row.get)(&settings.navigation.process_noise, self.element),
            Access::Sensors(row) => (row.get)(&settings.navigation.sensors, self.element),
            Access::Prior(row) => (row.get)(&settings.navigation.priors, self.element),
            Access::Learnt(row) => (row.get)(&settings.learnt, self.element),
            Access::Installation(row) => (row.get)(&settings.app.installation, self.element),
            Access::Effect(id) => settings.navigation.effects.get(id),
            Access::Filter(row) => (row.get)(&settings.navigation, self.element),
            Access::App(row) => (row.get)(&settings.app, self.element),
            Access::Control(row) => (row.get)(&settings.control, self.element),
            Access::Safety(row) => (row.get)(&settings.app.safety, self.element),
        }
    }

    /// Writes it to a set; the value was checked before.
    pub fn set(&self, settings: &mut Settings, value: f64) {
        match self.access {
            Access::Vehicle(row) => (row.set)(&mut settings.vehicle, self.element, value),
            Access::Noise(row) => (row.set)(&mut settings.navigation.process_noise, self.element, value),
            Access::Sensors(row) => (row.set)(&mut settings.navigation.sensors, self.element, value),
            Access::Prior(row) => (row.set)(&mut settings.navigation.priors, self.element, value),
            Access::Learnt(row) => (row.set)(&mut settings.learnt, self.element, value),
            Access::Installation(row) => (row.set)(&mut settings.app.installation, self.element, value),
            Access::Effect(id) => settings.navigation.effects.set(id, value),
            Access::Filter(row) => (row.set)(&mut settings.navigation, self.element, value),
            Access::App(row) => (row.set)(&mut settings.app, self.element, value),
            Access::Control(row) => (row.set)(&mut settings.control, self.element, value),
            Access::Safety(row) => (row.set)(&mut settings.app.safety, self.element, value),
        }
    }

    /// Whether a value may take the place of another while a mission runs or is armed.
    pub(super) fn may_become(&self, old: f64, new: f64) -> Result<(), Refusal> {
        match self.under_way {
            under_way if under_way.admits(old, new) => Ok(()),
            UnderWay::Fixed => Err(Refusal::UnderWay),
            _ => Err(Refusal::Relaxes),
        }
    }

    /// Its value in a fresh board.
    #[must_use]
    pub fn default(&self) -> f64 {
        self.get(&Settings::DEFAULT)
    }

    /// Section of the file that it stands in.
    #[must_use]
    pub fn section(&self) -> &'static str {
        self.key.split_once('.').map_or(self.key, |(section, _)| section)
    }
}

const COUNT: usize = count(VEHICLE)
    + count(NOISE)
    + count(SENSORS)
    + count(PRIOR)
    + count(LEARNT)
    + count(INSTALLATION)
    + effects::PARAMETERS
    + count(NavigationConfig::ROWS)
    + count(APP)
    + count(ControlConfig::ROWS)
    + count(SAFETY);

/// The list but for its names.
static UNNAMED: [Parameter; COUNT] = {
    let mut list = [effect(0); COUNT];
    let mut length = 0;
    macro_rules! push {
        ($rows:path as $access:path) => {
            let mut row = 0;
            while row < $rows.len() {
                let declaration = $rows[row].declaration;
                let mut i = 0;
                while i < declaration.count {
                    let element = declaration.first + i;
                    list[length] = Parameter { name: "", element, declaration, access: $access(&$rows[row]) };
                    (i, length) = (i + 1, length + 1);
                }
                row += 1;
            }
        };
    }
    push!(VEHICLE as Access::Vehicle);
    push!(NOISE as Access::Noise);
    push!(SENSORS as Access::Sensors);
    push!(PRIOR as Access::Prior);
    push!(LEARNT as Access::Learnt);
    push!(INSTALLATION as Access::Installation);
    let mut place = 0;
    while place < effects::PARAMETERS {
        list[length] = effect(place);
        (place, length) = (place + 1, length + 1);
    }
    push!(NavigationConfig::ROWS as Access::Filter);
    push!(APP as Access::App);
    push!(ControlConfig::ROWS as Access::Control);
    push!(SAFETY as Access::Safety);
    list
};

/// A parameter of the effect catalogue by its place there. Zero, which is no effect, is always allowed.
const fn effect(place: usize) -> Parameter {
    let id = ParameterId::at(place);
    let info = id.info();
    let declaration = Declaration {
        key: "effects",
        shape: Shape::Scalar,
        first: 0,
        count: 1,
        unit: info.unit,
        kind: if matches!(info.kind, ParameterKind::Fin) { Kind::Whole } else { Kind::Real },
        min: info.min.min(0.0),
        max: info.max,
        under_way: UnderWay::Fixed,
        #[cfg(not(target_os = "none"))]
        symbol: "",
        #[cfg(not(target_os = "none"))]
        help: id.effect().equations,
    };
    Parameter { name: "", element: 0, declaration, access: Access::Effect(id) }
}

/// Longest name, bytes.
const NAME: usize = 64;
/// The names, and their lengths.
static NAMES: [([u8; NAME], usize); COUNT] = {
    const fn push(name: &mut ([u8; NAME], usize), part: &[u8]) {
        let mut i = 0;
        while i < part.len() {
            name.0[name.1] = part[i];
            (i, name.1) = (i + 1, name.1 + 1);
        }
    }
    const fn push_index(name: &mut ([u8; NAME], usize), index: usize) {
        assert!(index < 100, "two digits");
        push(name, b"[");
        if index >= 10 {
            push(name, &[b'0' + (index / 10) as u8]);
        }
        push(name, &[b'0' + (index % 10) as u8, b']']);
    }
    let mut names = [([0; NAME], 0); COUNT];
    let mut i = 0;
    while i < COUNT {
        let Parameter { element, declaration, access, .. } = UNNAMED[i];
        push(&mut names[i], declaration.key.as_bytes());
        if let Access::Effect(id) = access {
            push(&mut names[i], b".");
            push(&mut names[i], id.effect().name.as_bytes());
            push(&mut names[i], b".");
            push(&mut names[i], id.info().name.as_bytes());
        }
        match declaration.shape {
            Shape::Scalar => {}
            Shape::Vector(_) => push_index(&mut names[i], element),
            Shape::Matrix(_, columns) => {
                push_index(&mut names[i], element / columns);
                push_index(&mut names[i], element % columns);
            }
        }
        i += 1;
    }
    names
};

/// All parameters, in the order of their index.
pub static PARAMETERS: &[Parameter] = &{
    let mut list = UNNAMED;
    let mut i = 0;
    while i < COUNT {
        let (name, length) = &NAMES[i];
        list[i].name = match core::str::from_utf8(name.split_at(*length).0) {
            Ok(name) => name,
            Err(_) => panic!("names are ASCII"),
        };
        i += 1;
    }
    list
};

/// The declared parameter of this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|parameter| parameter.name == name)
}
