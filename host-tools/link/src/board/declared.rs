//! A parameter as the board declares it.

use crate::printable;
use backseat_app::parameters;
use backseat_core::parameters::Kind;
use backseat_wire::hostlink::ParameterInfo;
use serde_json::{Value, json};

/// When a new value takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// In the next step, also during a mission.
    AtOnce,
    /// Navigation starts again; not during a mission.
    Restart,
}

impl Effect {
    /// For a column of a table.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::AtOnce => "at once",
            Self::Restart => "restart",
        }
    }

    /// In words.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::AtOnce => "at once, also during a mission",
            Self::Restart => "restarts navigation; not during a mission",
        }
    }
}

/// A parameter as the board describes it, with help from this program's list if both lists are the same.
#[derive(Clone, Debug)]
pub struct Declared {
    /// Name.
    pub name: String,
    /// Unit; `1` if it has none.
    pub unit: String,
    /// Value in use.
    pub value: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Default.
    pub default: f64,
    /// The host link does not carry what follows.
    known: Option<&'static parameters::Parameter>,
}

impl Declared {
    /// `known_here`: the board's list has the version of this program's.
    pub fn new(info: &ParameterInfo<'_>, known_here: bool) -> Self {
        Self {
            name: printable(info.name),
            unit: printable(info.unit),
            value: info.value,
            min: info.min,
            max: info.max,
            default: info.default,
            known: parameters::find(info.name).filter(|_| known_here),
        }
    }

    /// One sentence of help; empty if the board declares another list than this program.
    pub fn description(&self) -> &'static str {
        self.known.map_or("", |parameter| parameter.help)
    }

    fn is_whole(&self) -> bool {
        self.known.is_some_and(|parameter| parameter.kind == Kind::Whole)
    }

    /// When a new value takes effect.
    pub fn effect(&self) -> Option<Effect> {
        self.known.map(|parameter| if parameter.under_way.is_live() { Effect::AtOnce } else { Effect::Restart })
    }

    /// Smallest and largest value, in words.
    pub fn range(&self) -> String {
        format!("{} to {}", number(self.min), number(self.max))
    }

    /// What its value may be, in words.
    pub fn admitted(&self) -> String {
        let unit = if self.unit == "1" { String::new() } else { format!(" {}", self.unit) };
        let whole = if self.is_whole() { "a whole number " } else { "" };
        format!("{whole}within {}{unit}", self.range())
    }

    /// As JSON object.
    pub fn json(&self) -> Value {
        json!({
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "min": self.min,
            "max": self.max,
            "default": self.default,
            "description": self.known.map(|parameter| parameter.help),
            "takes_effect": self.effect().map(Effect::meaning),
        })
    }
}

/// As short as it reads back the same.
pub fn number(value: f64) -> String {
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}
