//! The laboratory: short versions of its studies, one executable.

mod consistency;
mod faults;
mod identification;
mod reproduce;
