//! The simulator from outside: its truth, sensors, effects, ship and scenarios, and golden histories of flights.

mod declared_effects;
mod effects;
mod golden_history;
mod hostile_host;
mod last_resort;
mod scenario;
mod separation;
mod ship_end;
mod truth;
mod vertical;
mod world;
