//! A flight in lock-step: as fast as the machine allows, and the same bytes each time.

use super::record::{Recorder, Sample};
use super::{FlightError, FlightLog, STEP_US, advance, prepare};
use crate::backseat::{Client, Ports};
use crate::devices::Devices;
use crate::scenario::Scenario;
use crate::world::World;
use backseat_wire::hostlink::Port;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A board at time zero must not look like "no time yet".
const SECOND_US: u64 = 1_000_000;
/// Flown on after the mission's end, so that the last fixes are seen.
const EPILOGUE_US: u64 = 10 * SECOND_US;

/// Flies a scenario to the end of its mission, of its time, or until `stop`.
///
/// `folder` receives `log.csv` and `truth.csv` as the flight goes; `progress` is called once a
/// simulated second with the time, s.
///
/// # Errors
/// A backseat that dies, falls silent or refuses; a file that cannot be written.
pub fn fly<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    folder: Option<&Path>,
    stop: &AtomicBool,
    progress: impl FnMut(f64),
) -> Result<FlightLog, FlightError> {
    prepare(scenario, client)?;
    fly_prepared(scenario, client, folder, stop, progress)
}

/// [`fly`] with the parameters and the mission that the board has already.
///
/// # Errors
/// As [`fly`].
pub fn fly_prepared<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    folder: Option<&Path>,
    stop: &AtomicBool,
    mut progress: impl FnMut(f64),
) -> Result<FlightLog, FlightError> {
    let begun = Instant::now();
    let mut recorder = Recorder::new(folder)?;
    client.step(0, &[], &[])?;
    client.start_mission()?;

    let mut world = World::new(scenario);
    let mut devices = Devices::new(scenario);
    let mut end_us = (scenario.settings.duration_s * 1e6) as u64;
    let mut under_way = false;
    let mut now_us = 0;
    while now_us < end_us && !stop.load(Ordering::Relaxed) {
        now_us += STEP_US;
        advance(&mut world, &mut devices, &mut recorder, now_us)?;
        let edge = now_us % SECOND_US == 0;
        let pps_us: &[u64] = if edge { &[now_us] } else { &[] };
        let output = client.step(now_us, pps_us, &devices.arrivals(now_us))?;
        for (port, bytes) in Port::DEVICES.into_iter().zip(&output.sent) {
            if !bytes.is_empty() {
                devices.sent_by_backseat(port, now_us, bytes);
            }
        }
        recorder.flight.digest = output.digest;
        recorder.flight.fusions.extend(output.fusions);
        recorder.flight.identifications.extend(output.identification);
        recorder.flight.adoptions.extend(output.adoptions);
        let Some(telemetry) = output.telemetry else { continue };
        if under_way && telemetry.leg.is_none() && !recorder.flight.finished {
            recorder.flight.finished = true;
            end_us = end_us.min(now_us + EPILOGUE_US);
        }
        under_way |= telemetry.leg.is_some();
        if edge {
            recorder.sample(Sample { truth: world.truth(), ship: world.ship(), telemetry })?;
            progress(now_us as f64 * 1e-6);
        }
    }
    let mut flight = recorder.finish()?;
    flight.simulated_s = now_us as f64 * 1e-6;
    flight.wall_s = begun.elapsed().as_secs_f64();
    Ok(flight)
}
