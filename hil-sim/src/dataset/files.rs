//! A data set on disk: `log.csv` and `vehicle.toml` as the input of a diagnosis, `truth/` as the solution.

use super::{Dataset, Spec};
use crate::scenario::Effect;
use backseat_logs::output::{self, Existing};
use backseat_logs::{Column, DataError, LogWriter, TruthWriter};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Writes a data set into a folder, which is made; nothing that is there is replaced.
///
/// The log, its columns and the vehicle file do not depend on the effects.
///
/// # Errors
/// If a file exists or cannot be written.
pub fn write(dataset: &Dataset, spec: &Spec, folder: &Path) -> Result<(), DataError> {
    let truth = folder.join("truth");
    std::fs::create_dir_all(&truth).map_err(|error| DataError::io(&truth, &error))?;

    let mut columns = Column::STANDARD.to_vec();
    if spec.ctd {
        columns.push(Column::WaterDensity);
    }
    if spec.usbl {
        columns.extend_from_slice(Column::group(Column::UsblRange, Column::UsblElevation));
        columns.extend([Column::UsblRangeSigma, Column::UsblAngleSigma]);
    }
    if spec.lbl {
        columns.push(Column::TwoWayRange);
        columns.extend_from_slice(Column::group(Column::Station, Column::StationZ));
    }
    let mut log = LogWriter::with_columns(&folder.join("log.csv"), &columns)?;
    dataset.log.rows.iter().try_for_each(|row| log.write(row))?;
    log.finish()?;
    spec.vehicle.write(&folder.join("vehicle.toml"), "The vehicle as it is declared.", Existing::Keep)?;

    let mut states = TruthWriter::create(&truth.join("truth.csv"))?;
    dataset.truth.rows.iter().try_for_each(|row| states.write(row))?;
    states.finish()?;
    write_effects(&dataset.effects, dataset.seed, folder)
}

/// Writes `truth/effects.json` into a folder.
///
/// # Errors
/// If the file exists or cannot be written.
pub fn write_effects(effects: &[Effect], seed: u64, folder: &Path) -> Result<(), DataError> {
    let truth = folder.join("truth");
    std::fs::create_dir_all(&truth).map_err(|error| DataError::io(&truth, &error))?;
    let effects = json!({ "seed": seed, "effects": effects_json(effects) });
    output::write(&truth.join("effects.json"), Existing::Keep, |file| {
        serde_json::to_writer_pretty(&mut *file, &effects)?;
        file.write_all(b"\n")
    })
}

/// Names and numbers of effects: `[{"name", "catalogue", "parameters": {…}}]`.
#[must_use]
pub fn effects_json(effects: &[Effect]) -> Value {
    let one = |effect: &Effect| {
        let numbers = effect.parameters().map(|(parameter, value)| {
            let value = if parameter.is_fin() { json!(parameter.text(value)) } else { json!(value) };
            (parameter.name.to_owned(), value)
        });
        let numbers: Map<String, Value> = numbers.collect();
        json!({ "name": effect.name(), "catalogue": effect.kind().catalogue, "parameters": numbers })
    };
    effects.iter().map(one).collect()
}
