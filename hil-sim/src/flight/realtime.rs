//! A flight at the speed of the clock: frames at their true times, the board on its own timer.

use super::record::{FlightSample, Recorder};
use super::{END_RADIUS_M, FlightError, FlightLog, Moved, advance, join, prepare, short_of_m};
use crate::devices::Devices;
use crate::scenario::Scenario;
use crate::ship_end::{Craft, ShipEnd};
use crate::world::World;
use backseat_link::{BackseatError, Client, Ports, ReportedFusion};
use backseat_wire::hostlink::{FromBoard, ModeReason, Port, Telemetry};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Frames leave at most this late.
const TICK_US: u64 = 2_000;
/// The backseat steps this often, µs.
const STEP_US: u64 = 100_000;
/// The ports stay open for so long after the mission, µs: whoever stopped it hears that it was.
const FAREWELL_US: u64 = 1_000_000;
/// A board takes up its own clock two seconds after power-up, when no other has come.
const PATIENCE: Duration = Duration::from_secs(10);

/// Who starts the mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The simulator, at once; the flight ends with the mission.
    AtOnce,
    /// Whoever sends `mission start`. A mission that is stopped may be started again: the flight ends when the last
    /// waypoint was reached, with the scenario's time, or by `stop`.
    OnRequest,
}

/// Flies a scenario at the speed of the clock; arguments and result as [`super::fly_with_ship`].
///
/// # Errors
/// As [`super::fly`].
pub fn fly_realtime<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    start: Start,
    mut ship: Option<&mut ShipEnd>,
    folder: Option<&Path>,
    stop: &AtomicBool,
    mut progress: impl FnMut(f64),
) -> Result<FlightLog, FlightError> {
    let mut recorder = Recorder::new(scenario, folder)?;
    prepare(scenario, client)?;
    if start == Start::AtOnce {
        client.start_mission()?;
    }
    wait_for_clock(client)?;

    let begun = Instant::now();
    let mut world = World::new(scenario);
    let mut devices = Devices::new(scenario);
    join(scenario, &mut world, &mut devices, ship.as_deref());
    let mut end_us = (scenario.settings.duration_s * 1e6) as u64;
    let mut now_us = 0;
    let mut sampled_s = 0;
    let mut under_way = false;
    let mut stepped_us = None;
    while now_us < end_us && !stop.load(Ordering::Relaxed) {
        let due = Duration::from_micros(now_us + TICK_US);
        sleep(due.saturating_sub(begun.elapsed()));
        now_us = begun.elapsed().as_micros() as u64;
        let craft = Craft { address: scenario.settings.acoustics.address, world: &mut world, devices: &mut devices };
        advance(&mut [Moved { craft, recorder: &mut recorder }], ship.as_deref_mut(), now_us)?;
        for (port, arrival) in devices.arrivals(now_us) {
            client.deliver(now_us, port, &arrival.bytes)?;
        }
        for port in Port::DEVICES {
            let bytes = client.collect(now_us, port)?;
            devices.sent_by_backseat(port, now_us, &bytes);
        }
        let mut latest: Option<Telemetry> = None;
        let flight = &mut recorder.flight;
        client.drain(|message| match message {
            FromBoard::Telemetry(telemetry) => {
                let before_us = stepped_us.replace(telemetry.time_us).unwrap_or(telemetry.time_us);
                note_step(flight, telemetry.time_us.saturating_sub(before_us));
                latest = Some(telemetry);
            }
            FromBoard::Fusion(fusion) => flight.fusions.extend(ReportedFusion::of(&fusion)),
            FromBoard::Identification(record) => flight.identifications.push(record),
            FromBoard::Naming(record) => flight.naming.push(record),
            _ => {}
        })?;
        let Some(telemetry) = latest.filter(|_| !recorder.flight.finished) else { continue };
        // Stopped before its first leg it was never under way.
        let has_ended = (under_way || telemetry.reason == ModeReason::Stopped) && telemetry.leg.is_none();
        recorder.flight.finished =
            has_ended && (start == Start::AtOnce || is_at_the_end(scenario, &world.truth().state));
        under_way = telemetry.leg.is_some() || (under_way && start == Start::AtOnce);
        if recorder.flight.finished {
            end_us = end_us.min(now_us + FAREWELL_US);
        }
        let second = now_us / 1_000_000;
        if second > sampled_s || recorder.flight.finished {
            sampled_s = second;
            recorder.ship_side(scenario, now_us, ship.as_deref(), &world.truth(), &world.ship());
            recorder.sample(FlightSample { truth: world.truth(), ship: world.ship(), telemetry })?;
            progress(now_us as f64 * 1e-6);
        }
    }
    let mut flight = recorder.finish()?;
    flight.simulated_s = now_us as f64 * 1e-6;
    flight.wall_s = begun.elapsed().as_secs_f64();
    Ok(flight)
}

/// A step of the backseat that came so long after the one before it.
fn note_step(flight: &mut FlightLog, gap_us: u64) {
    let late_us = gap_us.saturating_sub(STEP_US);
    if late_us >= STEP_US {
        flight.late_steps += 1;
        flight.latest_step_s = flight.latest_step_s.max(late_us as f64 * 1e-6);
    }
}

/// Whether a mission that ends here was flown to its end.
fn is_at_the_end(scenario: &Scenario, state: &[f64; 12]) -> bool {
    short_of_m(scenario, state).is_none_or(|short_of_m| short_of_m <= END_RADIUS_M)
}

/// Until the board steps by itself: what is sent before that would only wait in its ports.
fn wait_for_clock<P: Ports>(client: &mut Client<P>) -> Result<(), BackseatError> {
    let begun = Instant::now();
    let mut running = false;
    while !running {
        if begun.elapsed() > PATIENCE {
            return Err(BackseatError::Silent { port: Port::Host, seconds: PATIENCE.as_secs() as u32 });
        }
        sleep(Duration::from_micros(TICK_US));
        client.drain(|message| running |= matches!(message, FromBoard::Telemetry(_)))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_steps_are_counted() {
        let mut flight = FlightLog::default();
        for gap_us in [0, 100_000, 199_000, 200_000, 579_000, 100_000] {
            note_step(&mut flight, gap_us);
        }
        assert_eq!((flight.late_steps, flight.latest_step_s), (2, 0.479));
    }
}
