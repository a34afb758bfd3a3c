//! The numbers from outside: against reference numbers, second derivations, conservation laws and simulated truth.

#![allow(clippy::duplicate_mod, reason = "each suite adds draws of its own to its random generator")]

mod control;
mod dynamics;
mod identification;
mod navigation;
