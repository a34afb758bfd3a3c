//! Columns of numbers as bytes: little-endian doubles, which numpy reads without a copy.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Named columns in order.
pub type Columns<'py> = Vec<(String, Bound<'py, PyBytes>)>;

/// A column as bytes.
pub fn bytes<'py>(py: Python<'py>, values: impl Iterator<Item = f64>) -> Bound<'py, PyBytes> {
    let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    PyBytes::new(py, &bytes)
}

/// The numbers of a column.
///
/// # Errors
/// The bytes are no whole number of doubles.
pub fn numbers(name: &str, bytes: &[u8]) -> PyResult<Vec<f64>> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    if !rest.is_empty() {
        return Err(PyValueError::new_err(format!("{name}: {} bytes are no column of doubles", bytes.len())));
    }
    Ok(chunks.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect())
}
