//! The host board: its ports and the file that holds its parameters.

mod ports;
mod store;
