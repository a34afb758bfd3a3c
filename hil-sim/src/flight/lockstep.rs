//! A flight in lock-step: as fast as the machine allows, and the same bytes each time.

use super::record::{Recorder, Sample};
use super::{FlightError, FlightLog, STEP_US, advance, join, prepare};
use crate::devices::Devices;
use crate::faults::Board;
use crate::scenario::Scenario;
use crate::ship_end::ShipEnd;
use crate::truth::VehicleTruth;
use crate::world::World;
use backseat_link::{Client, FusionRecord, Ports, StepOutput};
use backseat_wire::hostlink::{Port, Telemetry};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A board at time zero must not look like "no time yet".
const SECOND_US: u64 = 1_000_000;

/// One step as it is watched.
#[derive(Clone, Copy, Debug)]
pub struct Watched<'a> {
    /// Simulated time, µs.
    pub time_us: u64,
    /// The true vehicle.
    pub truth: &'a VehicleTruth,
    /// The backseat's record of the step; there is none while it is down, or where its clock runs backwards.
    pub telemetry: Option<&'a Telemetry>,
    /// What it fused, at its own times.
    pub fusions: &'a [FusionRecord],
    /// What it sent to the frontseat.
    pub to_frontseat: &'a [u8],
    /// It was reset in this step.
    pub reset: bool,
}

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
    fly_on(scenario, client, None, folder, stop, |step| {
        if step.time_us % SECOND_US == 0 {
            progress(step.time_us as f64 * 1e-6);
        }
    })
}

/// [`fly`], perhaps with a program on the ship, which sends and hears through a modem of its own.
///
/// # Errors
/// As [`fly`].
pub fn fly_with_ship<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    ship: Option<&mut ShipEnd>,
    folder: Option<&Path>,
    stop: &AtomicBool,
    mut progress: impl FnMut(f64),
) -> Result<FlightLog, FlightError> {
    prepare(scenario, client)?;
    fly_on(scenario, client, ship, folder, stop, |step| {
        if step.time_us % SECOND_US == 0 {
            progress(step.time_us as f64 * 1e-6);
        }
    })
}

/// [`fly`], watched step by step.
///
/// # Errors
/// As [`fly`].
pub fn fly_watched<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    stop: &AtomicBool,
    watch: impl FnMut(Watched<'_>),
) -> Result<FlightLog, FlightError> {
    prepare(scenario, client)?;
    fly_on(scenario, client, None, None, stop, watch)
}

fn fly_on<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    mut ship: Option<&mut ShipEnd>,
    folder: Option<&Path>,
    stop: &AtomicBool,
    mut watch: impl FnMut(Watched<'_>),
) -> Result<FlightLog, FlightError> {
    let begun = Instant::now();
    let settings = &scenario.settings;
    let mut recorder = Recorder::new(folder)?;
    client.step(0, &[], &[])?;
    client.start_mission()?;

    let mut world = World::new(scenario);
    let mut devices = Devices::new(scenario);
    join(scenario, &mut world, &mut devices, ship.as_deref());
    let mut board = Board::new(&settings.faults);
    let mut end_us = (settings.duration_s * 1e6) as u64;
    let epilogue_us = (settings.epilogue_s * 1e6) as u64;
    let mut under_way = false;
    let mut now_us = 0;
    while now_us < end_us && !stop.load(Ordering::Relaxed) {
        now_us += STEP_US;
        advance(&mut world, &mut devices, ship.as_deref_mut(), &mut recorder, now_us)?;
        let edge = now_us % SECOND_US == 0;
        let reset = board.reset(now_us);
        if let Some(reset) = reset {
            client.reset(reset)?;
        }
        let output = step(client, &mut devices, &board, now_us, edge)?;
        let truth = world.truth();
        let (telemetry, fusions, to_frontseat) = output.as_ref().map_or((None, &[][..], &[][..]), |output| {
            (output.telemetry.as_ref(), &output.fusions[..], &output.sent[Port::Frontseat as usize][..])
        });
        let reset = reset.is_some();
        watch(Watched { time_us: now_us, truth: &truth, telemetry, fusions, to_frontseat, reset });
        let Some(output) = output else { continue };
        recorder.flight.digest = output.digest;
        recorder.flight.fusions.extend(output.fusions);
        recorder.flight.identifications.extend(output.identification);
        recorder.flight.adoptions.extend(output.adoptions);
        let Some(telemetry) = output.telemetry else { continue };
        if under_way && telemetry.leg.is_none() && !recorder.flight.finished {
            recorder.flight.finished = true;
            end_us = end_us.min(now_us + epilogue_us);
        }
        under_way |= telemetry.leg.is_some();
        if edge {
            recorder.ship_side(scenario, now_us, ship.as_deref(), &truth, &world.ship());
            recorder.sample(Sample { truth, ship: world.ship(), telemetry })?;
        }
    }
    let mut flight = recorder.finish()?;
    flight.simulated_s = now_us as f64 * 1e-6;
    flight.wall_s = begun.elapsed().as_secs_f64();
    Ok(flight)
}

/// One step of the board, on its own clock; nothing while it is down, when what arrives is lost.
fn step<P: Ports>(
    client: &mut Client<P>,
    devices: &mut Devices,
    board: &Board,
    now_us: u64,
    edge: bool,
) -> Result<Option<StepOutput>, FlightError> {
    let mut arrivals = devices.arrivals(now_us);
    if !board.is_up(now_us) {
        return Ok(None);
    }
    for (_, arrival) in &mut arrivals {
        arrival.time_us = board.local_us(arrival.time_us);
    }
    let local_us = board.local_us(now_us);
    let pps_us: &[u64] = if edge { &[local_us] } else { &[] };
    let output = client.step(local_us, pps_us, &arrivals)?;
    for (port, bytes) in Port::DEVICES.into_iter().zip(&output.sent) {
        if !bytes.is_empty() {
            devices.sent_by_backseat(port, now_us, bytes);
        }
    }
    Ok(Some(output))
}
