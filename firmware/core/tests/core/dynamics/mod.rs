//! The 6-DOF model against reference numbers, a second derivation and conservation laws.

mod conservation;
mod dual;
mod jacobian;
mod parameters;
#[path = "../random.rs"]
mod random;
mod reference;
mod singular;
mod support;
mod textbook;
