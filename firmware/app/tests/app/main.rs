//! The app from outside: bytes in, bytes out.

mod adaptation;
mod authentic;
mod board;
mod board_log;
mod clock_source;
mod faults;
mod flight;
mod helm;
mod host_link;
mod images;
mod learning;
mod lockstep;
mod modes;
mod parameter_store;
mod persistence;
mod safety;
mod signed;
mod step_watch;
mod streams;
mod time;
mod updates;
mod world;

#[path = "../../../tests/random.rs"]
mod random;
