//! Tests that look inside the filter: against a plain reference, independent numbers and dual numbers.

mod columns;
mod delayed;
mod endurance;
mod rows;
mod vectors;
mod vertical;
