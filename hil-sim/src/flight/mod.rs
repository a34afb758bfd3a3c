//! One flight: world, devices and backseat on one clock.

mod lockstep;
mod realtime;
mod record;
mod setup;

pub use lockstep::{Watched, fly, fly_fleet, fly_prepared, fly_watched, fly_with_ship};
pub use realtime::{Start, fly_realtime};
pub use record::{FlightLog, FlightSample, ModeChange, ShipSide};
pub use setup::board_parameters;

use crate::devices::Devices;
use crate::faults::Board;
use crate::scenario::Scenario;
use crate::ship_end::{Craft, ProgramError, ShipEnd};
use crate::world::World;
use backseat_core::state::{X, Y};
use backseat_link::{BackseatError, Client, Ports};
use backseat_logs::DataError;
use record::Recorder;

/// Length of a lock-step, µs.
pub const STEP_US: u64 = 100_000;

/// A mission that ends this far from its last waypoint was not flown to its end, m: the waypoint is passed within the
/// radius at which the leg changes, and the vehicle runs on during the epilogue.
pub(crate) const END_RADIUS_M: f64 = 150.0;

/// Distance from the last waypoint, m.
pub(crate) fn short_of_m(scenario: &Scenario, state: &[f64; 12]) -> Option<f64> {
    let waypoints = scenario.settings.waypoints();
    waypoints.last().map(|waypoint| (state[X] - waypoint.x_m).hypot(state[Y] - waypoint.y_m))
}

/// Why a flight ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum FlightError {
    /// The backseat.
    #[error(transparent)]
    Backseat(#[from] BackseatError),
    /// The ship's program.
    #[error(transparent)]
    Ship(#[from] ProgramError),
    /// A file.
    #[error(transparent)]
    Data(#[from] DataError),
}

/// Sends a board the parameters, the key and the mission of a scenario. A board that has the key already takes them
/// as well: they are signed by it.
///
/// # Errors
/// A board that does not answer or refuses one of them.
pub fn prepare<P: Ports>(scenario: &Scenario, client: &mut Client<P>) -> Result<(), BackseatError> {
    client.hello()?;
    let key = scenario.settings.acoustics.key;
    client.sign_with(key);
    client.set_parameters(&board_parameters(scenario))?;
    if key.is_set() {
        client.set_key(key)?;
    }
    if Board::is_reset(&scenario.settings.faults) {
        // Twice: a copy that has served for a while has another beside it.
        client.store_parameters()?;
        client.store_parameters()?;
    }
    client.set_fenced_mission(&scenario.settings.waypoints(), &scenario.settings.fence.corners_m)
}

/// Hands the acoustics over to two modems, if there is a ship's end.
fn join(scenario: &Scenario, world: &mut World, devices: &mut Devices, ship: Option<&ShipEnd>) {
    if ship.is_some() {
        let (environment, acoustics) = (&scenario.settings.environment, &scenario.settings.acoustics);
        world.hand_over_acoustics();
        devices.pair_modem(environment.start_unix_s, acoustics.packet_duration_s, acoustics.vehicle_pulse);
    }
}

/// A vehicle that is moved: where it is, its devices, its log.
struct Moved<'a> {
    craft: Craft<'a>,
    recorder: &'a mut Recorder,
}

/// Moves worlds and devices to `to_us`, stopping wherever a device acts.
fn advance(vehicles: &mut [Moved<'_>], mut ship: Option<&mut ShipEnd>, to_us: u64) -> Result<(), FlightError> {
    loop {
        if let Some(ship) = &mut ship {
            ship.settle()?;
        }
        let acts = vehicles.iter().filter_map(|moved| moved.craft.devices.next_us());
        let until_us = acts.chain(ship.as_ref().map(|ship| ship.next_us())).fold(to_us, u64::min);
        for (index, Moved { craft, recorder }) in vehicles.iter_mut().enumerate() {
            let mut observed = Vec::new();
            craft.world.advance(until_us, &mut |observation| observed.push(*observation));
            for observation in &observed {
                let sensed = craft.devices.sensed(observation);
                craft.devices.observe(&sensed);
                if let Some(ship) = &mut ship {
                    ship.observe(index, &sensed, craft);
                }
                recorder.observe(&sensed, &craft.world.truth());
            }
            let targets = craft.devices.run(until_us);
            if recorder.actuators(until_us, targets) {
                craft.world.set_actuator_targets(until_us, targets);
            }
        }
        if let Some(ship) = &mut ship {
            let crafts = vehicles.iter_mut().map(|Moved { craft: Craft { address, world, devices }, .. }| Craft {
                address: *address,
                world,
                devices,
            });
            ship.run(until_us, &mut crafts.collect::<Vec<_>>())?;
        }
        if until_us >= to_us {
            // A packet that arrives within a step of the physics is observed at the end of that step.
            return vehicles
                .iter_mut()
                .try_for_each(|Moved { craft, recorder }| Ok(recorder.complete_to(craft.world.time_us())?));
        }
    }
}
