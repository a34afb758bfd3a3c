//! A flight in lock-step: as fast as the machine allows, and the same bytes each time.

use super::record::{FlightSample, Recorder};
use super::{FlightError, FlightLog, Moved, STEP_US, advance, join, prepare};
use crate::devices::Devices;
use crate::faults::Board;
use crate::scenario::Scenario;
use crate::ship_end::{Craft, ShipEnd};
use crate::truth::VehicleTruth;
use crate::world::World;
use backseat_link::{Client, Ports, ReportedFusion, StepOutput};
use backseat_wire::hostlink::{Fittings, Port, Telemetry};
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
    pub fusions: &'a [ReportedFusion],
    /// What it sent to the frontseat.
    pub to_frontseat: &'a [u8],
    /// It was reset in this step.
    pub reset: bool,
    /// How its last-resort hardware stands, as it has last told.
    pub fittings: &'a Fittings,
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
    fly_with_ship(scenario, client, None, folder, stop, progress)
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
    progress: impl FnMut(f64),
) -> Result<FlightLog, FlightError> {
    fly_on(scenario, client, None, folder, stop, each_second(progress))
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
    progress: impl FnMut(f64),
) -> Result<FlightLog, FlightError> {
    prepare(scenario, client)?;
    fly_on(scenario, client, ship, folder, stop, each_second(progress))
}

fn each_second(mut progress: impl FnMut(f64)) -> impl FnMut(Watched<'_>) {
    move |step| {
        if step.time_us.is_multiple_of(SECOND_US) {
            progress(step.time_us as f64 * 1e-6);
        }
    }
}

/// [`fly_with_ship`], watched step by step.
///
/// # Errors
/// As [`fly`].
pub fn fly_watched<P: Ports>(
    scenario: &Scenario,
    client: &mut Client<P>,
    ship: Option<&mut ShipEnd>,
    stop: &AtomicBool,
    watch: impl FnMut(Watched<'_>),
) -> Result<FlightLog, FlightError> {
    prepare(scenario, client)?;
    fly_on(scenario, client, ship, None, stop, watch)
}

/// A vehicle in flight: its world, its board, its log.
struct Aloft<'a, P> {
    scenario: &'a Scenario,
    client: &'a mut Client<P>,
    world: World,
    devices: Devices,
    board: Board,
    recorder: Recorder,
    end_us: u64,
    under_way: bool,
    /// As the board has last told.
    fittings: Fittings,
}

impl<'a, P: Ports> Aloft<'a, P> {
    /// A vehicle whose board has its parameters and its mission; `folder` receives its logs.
    ///
    /// # Errors
    /// As [`fly`].
    pub fn new(
        scenario: &'a Scenario,
        client: &'a mut Client<P>,
        ship: Option<&ShipEnd>,
        folder: Option<&Path>,
    ) -> Result<Self, FlightError> {
        let recorder = Recorder::new(scenario, folder)?;
        let settings = &scenario.settings;
        client.set_fittings(settings.fittings.read(0, &settings.faults, &Fittings::default()));
        client.step(0, &[], &[])?;
        client.start_mission()?;
        let (mut world, mut devices) = (World::new(scenario), Devices::new(scenario));
        join(scenario, &mut world, &mut devices, ship);
        let (board, end_us) = (Board::new(&scenario.settings.faults), (scenario.settings.duration_s * 1e6) as u64);
        let fittings = Fittings::default();
        Ok(Self { scenario, client, world, devices, board, recorder, end_us, under_way: false, fittings })
    }

    fn moved(&mut self) -> Moved<'_> {
        let Self { scenario, world, devices, recorder, .. } = self;
        Moved { craft: Craft { address: scenario.settings.acoustics.address, world, devices }, recorder }
    }

    /// The board's step, after world and devices have moved to `now_us`.
    fn step(
        &mut self,
        now_us: u64,
        mut ship: Option<&mut ShipEnd>,
        watch: impl FnOnce(Watched<'_>),
    ) -> Result<(), FlightError> {
        let Self { scenario, client, world, devices, board, recorder, end_us, under_way, fittings } = self;
        let edge = now_us.is_multiple_of(SECOND_US);
        let reset = board.reset(now_us);
        if let Some(reset) = reset {
            client.reset(reset)?;
        }
        client.set_fittings(scenario.settings.fittings.read(now_us, &scenario.settings.faults, fittings));
        let output = step(client, devices, board, now_us, edge)?;
        // the ship's program has worked beside the board
        if let Some(ship) = &mut ship {
            ship.settle()?;
        }
        if let Some(told) = output.as_ref().and_then(|output| output.fittings) {
            *fittings = told;
            world.drop_weight(told.released.map_or(0.0, |_| scenario.settings.fittings.drop_weight_kg));
        }
        let truth = world.truth();
        let (telemetry, fusions, to_frontseat) = output.as_ref().map_or((None, &[][..], &[][..]), |output| {
            (output.telemetry.as_ref(), &output.fusions[..], &output.sent[Port::Frontseat as usize][..])
        });
        let reset = reset.is_some();
        watch(Watched { time_us: now_us, truth: &truth, telemetry, fusions, to_frontseat, reset, fittings });
        let Some(output) = output else { return Ok(()) };
        recorder.flight.digest = output.digest;
        recorder.flight.fusions.extend(output.fusions);
        recorder.flight.identifications.extend(output.identification);
        recorder.flight.naming.extend(output.naming);
        let Some(telemetry) = output.telemetry else { return Ok(()) };
        if *under_way && telemetry.leg.is_none() && !recorder.flight.finished {
            recorder.flight.finished = true;
            *end_us = (*end_us).min(now_us + (scenario.settings.epilogue_s * 1e6) as u64);
        }
        *under_way |= telemetry.leg.is_some();
        if edge {
            recorder.ship_side(scenario, now_us, ship.as_deref(), &truth, &world.ship());
            recorder.sample(FlightSample { truth, ship: world.ship(), telemetry })?;
        }
        Ok(())
    }
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
    let mut aloft = Aloft::new(scenario, client, ship.as_deref(), folder)?;
    let mut now_us = 0;
    while now_us < aloft.end_us && !stop.load(Ordering::Relaxed) {
        now_us += STEP_US;
        advance(&mut [aloft.moved()], ship.as_deref_mut(), now_us)?;
        aloft.step(now_us, ship.as_deref_mut(), &mut watch)?;
    }
    landed(aloft, now_us, begun)
}

fn landed<P>(aloft: Aloft<'_, P>, now_us: u64, begun: Instant) -> Result<FlightLog, FlightError> {
    let mut flight = aloft.recorder.finish()?;
    flight.simulated_s = now_us as f64 * 1e-6;
    flight.wall_s = begun.elapsed().as_secs_f64();
    Ok(flight)
}

/// Several vehicles about one ship, each with a board of its own, until all have ended: each hears the others. Their
/// scenarios are a first one and its [`Scenario::companions`].
///
/// # Errors
/// As [`fly`].
pub fn fly_fleet<P: Ports>(
    vehicles: &mut [(&Scenario, &mut Client<P>, Option<&Path>)],
    ship: &mut ShipEnd,
    stop: &AtomicBool,
    mut progress: impl FnMut(f64),
) -> Result<Vec<FlightLog>, FlightError> {
    let begun = Instant::now();
    let mut fleet: Vec<Aloft<'_, P>> = Vec::new();
    for (scenario, client, folder) in vehicles.iter_mut() {
        prepare(scenario, client)?;
        let mut aloft = Aloft::new(scenario, client, Some(ship), *folder)?;
        if let Some(first) = fleet.first() {
            aloft.world.share_ship(&first.world);
        }
        fleet.push(aloft);
    }
    let mut now_us = 0;
    while fleet.iter().any(|aloft| now_us < aloft.end_us) && !stop.load(Ordering::Relaxed) {
        now_us += STEP_US;
        advance(&mut fleet.iter_mut().map(Aloft::moved).collect::<Vec<_>>(), Some(ship), now_us)?;
        for aloft in &mut fleet {
            aloft.step(now_us, Some(&mut *ship), |_| {})?;
        }
        if now_us.is_multiple_of(SECOND_US) {
            progress(now_us as f64 * 1e-6);
        }
    }
    fleet.into_iter().map(|aloft| landed(aloft, now_us, begun)).collect()
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
