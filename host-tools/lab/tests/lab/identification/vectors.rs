//! NBLS against the independent implementation's small problem (`firmware/core/tests/data/README.md`).

use backseat_core::identification::theta::M11;
use backseat_lab::identification::nullspace::{COLUMNS, nullspace, unit_length};
use nalgebra::{SMatrix, SVector};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|number| number.as_f64().expect("a number")).collect()
}

#[test]
fn val_nullspace_matches_the_reference() {
    let text = include_str!("../../../../../firmware/core/tests/data/ident_vectors.json");
    let all: Value = serde_json::from_str(text).expect("JSON");
    let small = &all["nbls_small"];
    let rows: Vec<f64> = small["WtW"].as_array().expect("a matrix").iter().flat_map(numbers).collect();
    let normal = SMatrix::<f64, COLUMNS, COLUMNS>::from_row_slice(&rows);
    let expected = SVector::<f64, COLUMNS>::from_row_slice(&numbers(&small["theta_scaled_to_m11"]));
    let sizes = SVector::<f64, COLUMNS>::from_row_slice(&numbers(&small["column_scale"]));
    let theirs = numbers(&small["eigenvalues_scaled"]);
    let (_, eigenvalues) = nullspace(&normal, &sizes, (M11, expected[M11]));
    let largest = theirs.iter().fold(0.0_f64, |most, value| most.max(*value));
    for (found, expected) in eigenvalues.iter().zip(&theirs) {
        // Rounding of the largest.
        assert!((found - expected).abs() < 1.0e-12 * largest, "{found} instead of {expected}");
    }
    // With their scaling and with ours.
    for sizes in [sizes, unit_length(&normal)] {
        let (theta, _) = nullspace(&normal, &sizes, (M11, expected[M11]));
        for (j, (found, expected)) in theta.iter().zip(expected.iter()).enumerate() {
            // Columns that are nearly collinear: rounding of 1e-16 in WᵀW comes back a million times.
            assert!((found - expected).abs() < 1.0e-6 * (1.0 + expected.abs()), "{j}: {found} instead of {expected}");
        }
    }
}
