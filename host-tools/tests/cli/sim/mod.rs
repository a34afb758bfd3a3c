//! `backseat sim`: flights, data sets and session logs, as a user makes them.

mod both_ways;
mod dataset;
mod flight;
mod session;
mod ship;
mod short_runs;
mod trial;
