//! All parameters as one list, number by number, in the order of their index: core's rows, the effects, the app's rows.

use super::settings::{AppSettings, Settings};
use backseat_core::control::ControlConfig;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::{self, ParameterId, ParameterKind};
use backseat_core::navigation::{Learnt, NavigationConfig, Priors, ProcessNoise, SensorNoise};
use backseat_core::parameters::{Declaration, Installation, Kind, LEARNT, Row, SafetyLimits, Shape, UnderWay, count};
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
    /// Its unit, for constants, in which nothing is dereferenced.
    pub(crate) const fn unit(&self) -> &'static str {
        self.declaration.unit
    }

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

const COUNT: usize = count(VehicleParameters::ROWS)
    + count(ProcessNoise::ROWS)
    + count(SensorNoise::ROWS)
    + count(Priors::ROWS)
    + count(LEARNT)
    + count(Installation::ROWS)
    + effects::PARAMETERS
    + count(NavigationConfig::ROWS)
    + count(AppSettings::ROWS)
    + count(ControlConfig::ROWS)
    + count(SafetyLimits::ROWS);

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
    push!(VehicleParameters::ROWS as Access::Vehicle);
    push!(ProcessNoise::ROWS as Access::Noise);
    push!(SensorNoise::ROWS as Access::Sensors);
    push!(Priors::ROWS as Access::Prior);
    push!(LEARNT as Access::Learnt);
    push!(Installation::ROWS as Access::Installation);
    let mut place = 0;
    while place < effects::PARAMETERS {
        list[length] = effect(place);
        (place, length) = (place + 1, length + 1);
    }
    push!(NavigationConfig::ROWS as Access::Filter);
    push!(AppSettings::ROWS as Access::App);
    push!(ControlConfig::ROWS as Access::Control);
    push!(SafetyLimits::ROWS as Access::Safety);
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

/// Most bytes of all names.
const ROOM: usize = 32 * COUNT;

/// The names one behind the other, and where each ends.
const JOINED: ([u8; ROOM], [usize; COUNT]) = {
    const fn push(bytes: &mut [u8; ROOM], mut length: usize, part: &[u8]) -> usize {
        let mut i = 0;
        while i < part.len() {
            bytes[length] = part[i];
            (i, length) = (i + 1, length + 1);
        }
        length
    }
    const fn push_index(bytes: &mut [u8; ROOM], length: usize, index: usize) -> usize {
        assert!(index < 100, "two digits");
        let digits = [b'0' + (index / 10) as u8, b'0' + (index % 10) as u8];
        let length = push(bytes, length, b"[");
        let length = push(bytes, length, if index >= 10 { &digits } else { digits.split_at(1).1 });
        push(bytes, length, b"]")
    }
    let (mut bytes, mut ends) = ([0; ROOM], [0; COUNT]);
    let (mut i, mut end) = (0, 0);
    while i < COUNT {
        let Parameter { element, declaration, access, .. } = UNNAMED[i];
        end = push(&mut bytes, end, declaration.key.as_bytes());
        if let Access::Effect(id) = access {
            end = push(&mut bytes, end, b".");
            end = push(&mut bytes, end, id.effect().name.as_bytes());
            end = push(&mut bytes, end, b".");
            end = push(&mut bytes, end, id.info().name.as_bytes());
        }
        match declaration.shape {
            Shape::Scalar => {}
            Shape::Vector(_) => end = push_index(&mut bytes, end, element),
            Shape::Matrix(_, columns) => {
                end = push_index(&mut bytes, end, element / columns);
                end = push_index(&mut bytes, end, element % columns);
            }
        }
        ends[i] = end;
        i += 1;
    }
    (bytes, ends)
};
/// So that the image holds no byte more than the names have.
static NAMES: [u8; JOINED.1[COUNT - 1]] = {
    let (mut names, mut i) = ([0; JOINED.1[COUNT - 1]], 0);
    while i < names.len() {
        names[i] = JOINED.0[i];
        i += 1;
    }
    names
};

/// All parameters, in the order of their index.
pub static PARAMETERS: &[Parameter] = &{
    let mut list = UNNAMED;
    let (mut i, mut start) = (0, 0);
    while i < COUNT {
        let end = JOINED.1[i];
        list[i].name = match core::str::from_utf8(NAMES.split_at(end).0.split_at(start).1) {
            Ok(name) => name,
            Err(_) => panic!("names are ASCII"),
        };
        (i, start) = (i + 1, end);
    }
    list
};

/// The declared parameter of this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|parameter| parameter.name == name)
}
