//! The methods against reference numbers.

mod vectors;
