//! The command `backseat` as a user runs it.

mod bad_input;
mod bench;
mod board;
mod diagnosed;
mod effect_terms;
mod export;
mod harness;
mod help;
mod identify;
mod info;
mod installation;
mod navigate;
mod next;
mod qemu;
mod record;
mod replay;
mod sim;
mod topside;
mod tutorial;
mod vehicle;
