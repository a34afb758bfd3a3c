//! The app from outside: bytes in, bytes out.

mod adaptation;
mod authentic;
mod board;
mod board_log;
mod faults;
mod flight;
mod host_link;
mod lockstep;
mod modes;
mod persistence;
mod safety;
mod streams;
mod time;
mod world;
