//! A flight of the app in this process: the whole board in lock-step with the simulator.

use anyhow::Context;
use backseat_link::{Client, Ports};
use hil_sim::backseat::InProcess;
use hil_sim::flight::{self, FlightError, FlightLog};
use hil_sim::scenario::Scenario;
use std::sync::atomic::AtomicBool;

/// Flies a scenario to its end.
///
/// # Errors
/// The simulator or the app failed; the error names the seed.
pub fn fly(scenario: &Scenario) -> anyhow::Result<FlightLog> {
    fly_with(scenario, &[])
}

/// The same with parameters of the board that no scenario has, by name.
///
/// # Errors
/// The same; a parameter that the board refuses.
pub fn fly_with(scenario: &Scenario, more: &[(String, f64)]) -> anyhow::Result<FlightLog> {
    fly_on(scenario, &mut Client::new(InProcess::new()), more, &AtomicBool::new(false))
}

/// The same on a board, until `stop`.
///
/// # Errors
/// The same.
pub fn fly_on<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    more: &[(String, f64)],
    stop: &AtomicBool,
) -> anyhow::Result<FlightLog> {
    let mut fly = || -> Result<FlightLog, FlightError> {
        flight::prepare(scenario, client)?;
        if !more.is_empty() {
            client.set_parameters(more)?;
        }
        flight::fly_prepared(scenario, client, None, stop, |_| {})
    };
    let seed = scenario.settings.seed;
    fly().with_context(|| format!("flight of seed {seed}"))
}
