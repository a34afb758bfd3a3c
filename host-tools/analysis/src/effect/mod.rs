//! The catalogue of effects, drafts of new entries, and files of what is in no vehicle file: `backseat effect`.

pub mod draft;
pub mod terms;

use backseat_core::effects::{CATALOGUE, EffectInfo, LOG_CATALOGUE};
use backseat_report::{Report, Table};
use serde_json::{Value, json};

/// Those that a board knows, then those that only the analysis of a log knows.
pub fn all() -> impl Iterator<Item = &'static EffectInfo> {
    CATALOGUE.iter().chain(LOG_CATALOGUE)
}

/// The report on the whole catalogue.
pub fn list() -> Report {
    let report = Report::new("Catalogue of effects", format!("{} effects that a model may lack", all().count()));
    let report = all().fold(report, |report, info| report.fact(info.name, info.equations));
    report.value("effects", all().map(entry).collect::<Vec<_>>())
}

/// The report on an entry.
pub fn show(info: &EffectInfo) -> Report {
    let mut report =
        Report::new(info.name, info.name).fact("equations", info.equations).fact("signature", info.signature);
    let table = Table::new("", &["parameter", "unit", "from", "to"]);
    report = report.table(info.parameters.iter().fold(table, |table, p| {
        table.row([p.name.to_owned(), p.unit.to_owned(), p.min.to_string(), p.max.to_string()])
    }));
    for confusion in info.confused_with {
        report = report.text(&format!(
            "It can be confused with {}: {}. {}",
            confusion.effect, confusion.condition, confusion.separating_manoeuvre
        ));
    }
    report.values(entry(info))
}

fn entry(info: &EffectInfo) -> Value {
    let parameters =
        info.parameters.iter().map(|p| json!({"name": p.name, "unit": p.unit, "min": p.min, "max": p.max}));
    let confusions = info.confused_with.iter().map(|confusion| {
        json!({"effect": confusion.effect, "condition": confusion.condition,
            "separating_manoeuvre": confusion.separating_manoeuvre})
    });
    json!({"name": info.name, "parameters": parameters.collect::<Vec<_>>(), "equations": info.equations,
        "signature": info.signature, "confused_with": confusions.collect::<Vec<_>>()})
}
