//! Reading of the reference files' arrays, comparison.

use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use serde_json::Value;

pub fn ident() -> Value {
    serde_json::from_str(include_str!("../data/ident_vectors.json")).expect("JSON")
}

pub fn model(parameters: &VehicleParameters) -> VehicleModel {
    VehicleModel::new(parameters).expect("valid parameters")
}

/// The numbers of a JSON array.
pub fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().unwrap_or_else(|| panic!("not an array: {value}"));
    array.iter().map(|number| number.as_f64().expect("a number")).collect()
}

/// The numbers of a JSON matrix, row-major.
pub fn matrix(value: &Value) -> Vec<f64> {
    value.as_array().expect("a matrix").iter().flat_map(numbers).collect()
}

/// Compares number by number: |ours − theirs| ≤ tolerance (1 + |theirs|).
pub fn assert_close<'a>(
    ours: impl IntoIterator<Item = &'a f64>,
    theirs: impl IntoIterator<Item = &'a f64>,
    tolerance: f64,
    what: &str,
) {
    let (ours, theirs): (Vec<_>, Vec<_>) = (ours.into_iter().collect(), theirs.into_iter().collect());
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let error = (*a - *b).abs() / (1.0 + b.abs());
        assert!(error <= tolerance, "{what}[{i}]: {a} instead of {b}, error {error:e}");
    }
}
