//! `[effects]`: what the vehicle and its sensors do beyond what the other sections declare.
//!
//! One table an effect of the catalogue, its parameters as keys: a number, or `{ value = …, ci95 = [low, high] }` where
//! an interval is known; a fin by its name.

use super::source::{FileText, Value, kind, with_interval};
use crate::DataError;
use backseat_core::effects::{
    CATALOGUE, EffectSet, FIN_NAMES, ParameterId, ParameterInfo, ParameterKind, fin_index, fin_value, find, parameters,
};
use std::fmt::Write as _;
use toml::de::{DeTable, DeValue};

/// The section's name.
pub(super) const SECTION: &str = "effects";

/// The effects of a vehicle file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleEffects {
    /// Their values.
    pub set: EffectSet,
    /// 95 % intervals of those that have one.
    pub ci95: Vec<(ParameterId, [f64; 2])>,
}

impl VehicleEffects {
    pub(super) fn parse(source: &FileText<'_>, table: &DeTable<'_>) -> Result<Self, DataError> {
        let mut effects = Self::default();
        for (name, value) in table {
            let Some(info) = find(name.get_ref()) else {
                let known: Vec<_> = CATALOGUE.iter().map(|info| info.name).collect();
                let message = format!("unknown effect {}; known are {}", name.get_ref(), known.join(", "));
                return Err(source.error(name.span(), message));
            };
            let Some(table) = value.get_ref().as_table() else {
                let message = format!("{SECTION}.{}: expected a table, found {}", info.name, kind(value.get_ref()));
                return Err(source.error(value.span(), message));
            };
            for (key, value) in table {
                let Some(id) = ParameterId::find(info.name, key.get_ref()) else {
                    let known: Vec<_> = info.parameters.iter().map(|parameter| parameter.name).collect();
                    let (key_name, known) = (key.get_ref(), known.join(", "));
                    let message = format!("unknown key {key_name} in [{SECTION}.{}]; it has {known}", info.name);
                    return Err(source.error(key.span(), message));
                };
                effects.read(source, id, value)?;
            }
            // An event without an end does not end.
            let mut needed = info.parameters.iter().filter(|parameter| parameter.kind != ParameterKind::End);
            if let Some(missing) = needed.find(|parameter| !table.contains_key(parameter.name)) {
                let message = format!("[{SECTION}.{}] lacks {} ({})", info.name, missing.name, missing.unit);
                return Err(source.error(name.span(), message));
            }
            let of = |kind| parameters().find(|id| id.effect().name == info.name && id.info().kind == kind);
            if let (Some(onset), Some(end)) = (of(ParameterKind::Onset), of(ParameterKind::End)) {
                let [onset_s, end_s] = [onset, end].map(|id| effects.set.get(id));
                if end_s != 0.0 && end_s <= onset_s {
                    let message = format!("{}: {end_s} s is not after {}: {onset_s} s", dotted(end), dotted(onset));
                    return Err(source.error(name.span(), message));
                }
            }
        }
        effects.ci95.sort_by_key(|(id, _)| id.place());
        Ok(effects)
    }

    fn read(&mut self, source: &FileText<'_>, id: ParameterId, value: &Value<'_>) -> Result<(), DataError> {
        let name = dotted(id);
        let ParameterInfo { min, max, unit, kind: meaning, .. } = *id.info();
        let (value, interval) = source.value_and_interval(value, &name)?;
        let number = match value.get_ref() {
            DeValue::String(fin) if meaning == ParameterKind::Fin => fin_value(fin).ok_or_else(|| {
                source.error(value.span(), format!("{name}: {fin} is none of {}", FIN_NAMES.join(", ")))
            })?,
            _ => source.number(value, &name)?,
        };
        if !id.info().admits(number) {
            return Err(source.error(value.span(), format!("{name}: {number} is outside {min} to {max} ({unit})")));
        }
        self.set.set(id, number);
        self.ci95.extend(interval.map(|limits| (id, limits)));
        Ok(())
    }

    /// The section's text; empty without effects.
    pub(super) fn to_toml(&self) -> String {
        let mut text = String::new();
        for (index, info, _) in self.set.active() {
            let _ = writeln!(text, "\n[{SECTION}.{}]  # {}", info.name, info.equations);
            for id in parameters().filter(|id| id.effect_index() == index) {
                let ParameterInfo { name, unit, min, max, kind, .. } = *id.info();
                let value = self.set.get(id);
                if kind == ParameterKind::End && value == 0.0 {
                    continue;
                }
                let number = match fin_index(value).filter(|_| kind == ParameterKind::Fin) {
                    Some(fin) => format!("{:?}", FIN_NAMES[fin]),
                    None => format!("{value:?}"),
                };
                let interval = self.ci95.iter().find(|(of, _)| *of == id).map(|(_, interval)| *interval);
                let value = with_interval(number, interval);
                let range = match kind {
                    ParameterKind::Fin => FIN_NAMES.join(", "),
                    _ => format!("{} to {}", super::short(min), super::short(max)),
                };
                let _ = writeln!(text, "{name} = {value}  # {unit}; {range}");
            }
        }
        text
    }

    /// Sets one value by its dotted name; `None`: no effect has that name.
    pub(super) fn apply(&mut self, name: &str, value: f64) -> Option<Result<(), String>> {
        let id = parameters().find(|id| dotted(*id) == name)?;
        let ParameterInfo { min, max, unit, .. } = *id.info();
        if !id.info().admits(value) {
            return Some(Err(format!("{name}: {value} is outside {min} to {max} ({unit})")));
        }
        if self.set.get(id) != value {
            self.ci95.retain(|(of, _)| *of != id);
        }
        self.set.set(id, value);
        Some(Ok(()))
    }

    /// Every value under its dotted name, those of absent effects as well: a board forgets an effect by its zeros.
    pub(super) fn flatten(&self) -> impl Iterator<Item = (String, f64)> + '_ {
        parameters().map(|id| (dotted(id), self.set.get(id)))
    }
}

/// `effects.water_current.north_mps`.
fn dotted(id: ParameterId) -> String {
    format!("{SECTION}.{}.{}", id.effect().name, id.info().name)
}
