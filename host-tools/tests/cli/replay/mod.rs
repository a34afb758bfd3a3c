//! `backseat replay`: flights, board logs and recordings through the flight code again, and to ports.

mod board_log;
mod flown;
mod recorded;
mod reset;
mod sim;
mod to_ports;
