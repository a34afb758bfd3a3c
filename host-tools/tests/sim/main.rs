//! `backseat sim`: flights, data sets and session logs, as a user makes them.

mod dataset;
mod flight;
mod session;
