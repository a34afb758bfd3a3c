//! The 6-DOF model against reference numbers, a second derivation and conservation laws.

mod conservation;
mod dual;
mod jacobian;
mod parameters;
mod reference;
mod singular;
mod support;
mod textbook;
