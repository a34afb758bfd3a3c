//! The navigation filter from outside: reference run, statistics against simulated truth, gate and recovery, contracts.
#![allow(clippy::disallowed_methods)] // the tests' own arithmetic need not have the same bits on every machine

mod alone;
mod consistency;
mod contracts;
mod effects;
mod integrity;
mod invariance;
mod mini_run;
mod order;
mod peers;
mod recovery;
mod robust;
mod support;
