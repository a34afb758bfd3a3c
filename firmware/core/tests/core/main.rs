//! The numbers from outside: against reference numbers, second derivations, conservation laws and simulated truth.

mod control;
mod dynamics;
mod identification;
mod navigation;
#[path = "../../../tests/random.rs"]
mod random;
mod shared;
