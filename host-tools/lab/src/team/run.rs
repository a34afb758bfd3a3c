//! The cases, and the flight of one seed.

use crate::alone::worlds::{CURRENT_MPS, HEADING_RAD, SHARE, SHIP_LEAVES_S};
use anyhow::Context;
use backseat_core::navigation::Sensor;
use backseat_link::Client;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{FlightLog, FlightSample, fly_fleet};
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::{Current, Effect, Mission, MissionWaypoint, Scenario};
use hil_sim::ship_end::ShipEnd;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

/// What is wrong with the third vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Liar {
    /// Nothing.
    Nobody,
    /// Its uplinks misstate its place by so much north, m.
    Place(f64),
    /// Its clock is ahead, s.
    Clock(f64),
}

/// How a team flies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TeamCase {
    /// As in tables and on the command line.
    pub name: &'static str,
    /// For the page.
    pub about: &'static str,
    /// They use each other's packets.
    pub peers: bool,
    /// The first surfaces for fixes behind every second line.
    pub surfaces: bool,
    /// See [`Liar`].
    pub liar: Liar,
}

const TEAM: TeamCase =
    TeamCase { name: "team", about: "each uses the others' packets", peers: true, surfaces: true, liar: Liar::Nobody };

/// All.
pub const CASES: [TeamCase; 5] = [
    TeamCase { name: "each-alone", about: "the same, and nobody uses another's packets", peers: false, ..TEAM },
    TEAM,
    TeamCase { name: "no-fixes", about: "as the team, and nobody surfaces", surfaces: false, ..TEAM },
    TeamCase {
        name: "wrong-place",
        about: "the third vehicle's packets are 50 m off",
        liar: Liar::Place(50.0),
        ..TEAM
    },
    TeamCase { name: "wrong-clock", about: "the third vehicle's clock is 10 ms off", liar: Liar::Clock(0.01), ..TEAM },
];

/// Place of the vehicle that lies, where one does.
pub const LIAR: usize = 2;
/// Time between points, s.
pub const POINT_S: f64 = 60.0;
/// How far the first runs on behind a line to surface, m.
const SURFACES_M: f64 = 100.0;

/// Stored result of a seed: the vehicles in their order.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TeamRun {
    pub vehicles: Vec<Navigated>,
}

/// How one of them was navigated.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Navigated {
    /// One a minute.
    pub points: Vec<Point>,
    /// Ranges to others that were used, those beyond three sigmas, and those that told nothing new or came from one that
    /// is not believed.
    pub ranges: [usize; 3],
    /// Seconds in which the error was beyond the protection level, and all.
    pub beyond_s: [usize; 2],
}

/// The board's estimate at one time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Point {
    /// Time of the flight, s.
    pub time_s: f64,
    /// Horizontal error, m.
    pub error_m: f64,
    /// Expected (DRMS), m.
    pub drms_m: f64,
    /// eᵀ P⁻¹ e / 2 of the stated horizontal covariance: 1 on average.
    pub nees: f64,
}

/// Flies one seed.
///
/// # Errors
/// A flight that fails.
pub fn run(case: TeamCase, seed: u64) -> anyhow::Result<TeamRun> {
    let team = scenarios(case, seed)?;
    let mut clients: Vec<_> = team.iter().map(|_| Client::new(InProcess::new())).collect();
    let [first, ..] = &team[..] else { anyhow::bail!("no vehicle") };
    let mut ship = ShipEnd::with_topside(first)?;
    let mut fleet: Vec<_> = team.iter().zip(&mut clients).map(|(scenario, client)| (scenario, client, None)).collect();
    let flights = fly_fleet(&mut fleet, &mut ship, &AtomicBool::new(false), |_| {});
    let flights = flights.with_context(|| format!("team of seed {seed}"))?;
    Ok(TeamRun { vehicles: flights.iter().map(navigated).collect() })
}

/// One for each vehicle: as the scenario `team`, in a current, with 10 % wrong parameters and a wrong compass each.
fn scenarios(case: TeamCase, seed: u64) -> anyhow::Result<Vec<Scenario>> {
    let mut scenario = Scenario::built_in("team")?;
    let settings = &mut scenario.settings;
    settings.seed = seed;
    settings.backseat.peers = case.peers;
    settings.backseat.range_rate = false;
    settings.backseat.wrong_share = SHARE;
    let draw = &mut Stream::new(seed, Source::Study);
    let (sin, cos) = libm::sincos(TAU * draw.uniform());
    settings.environment.current =
        Current { north_mps: CURRENT_MPS * cos, east_mps: CURRENT_MPS * sin, ..Current::default() };
    settings.acoustics.until_s = Some(SHIP_LEAVES_S);
    // What half an hour without the ship, and a position that is lost, would end.
    scenario.vehicle.safety.degraded_time_max_s = 1.0e5;
    scenario.vehicle.app.push(("app.lost_sigma_m".to_owned(), 1.0e5));
    let mut team = vec![scenario.clone()];
    team.extend(scenario.companions());
    for (place, vehicle) in team.iter_mut().enumerate() {
        let mut effects = vec![Effect::new("heading_bias", &[("const_rad", draw.sign() * HEADING_RAD)])];
        match case.liar {
            Liar::Place(north_m) if place == LIAR => vehicle.settings.acoustics.misstated_m = [north_m, 0.0],
            Liar::Clock(clock_s) if place == LIAR => effects.push(Effect::new("clock_offset", &[("s", clock_s)])),
            _ => {}
        }
        for effect in effects {
            vehicle.settings.effects.push(effect.map_err(anyhow::Error::msg)?);
        }
        if place == 0 && case.surfaces {
            surface(vehicle);
        }
    }
    Ok(team)
}

/// Lets a lawnmower surface behind every second line.
fn surface(scenario: &mut Scenario) {
    let leg = |x_m, y_m, depth_m, speed_mps| MissionWaypoint { x_m, y_m, depth_m, speed_mps, scored: false };
    let mut legs = Vec::new();
    for (place, w) in scenario.settings.waypoints().iter().enumerate() {
        legs.push(leg(w.x_m, w.y_m, w.depth_m, w.speed_mps));
        // the first waypoint is before the lines, of which each has two; those that end behind the start
        if place > 0 && place % 4 == 0 {
            legs.push(leg(w.x_m - SURFACES_M, w.y_m, 0.0, w.speed_mps));
        }
    }
    scenario.settings.mission = Mission::Waypoints(legs);
}

fn navigated(flight: &FlightLog) -> Navigated {
    let mut points: Vec<Point> = Vec::new();
    let mut beyond_s = [0, 0];
    for sample in flight.samples.iter().filter(|sample| sample.telemetry.sigma[0] > 0.0) {
        let point = point(sample);
        beyond_s[0] += usize::from(point.error_m > f64::from(sample.telemetry.level_m[0]));
        beyond_s[1] += 1;
        if point.time_s % POINT_S == 0.0 {
            points.push(point);
        }
    }
    let mut ranges = [0; 3];
    for fusion in flight.fusions.iter().filter(|fusion| fusion.sensor == Sensor::Peer) {
        let is_beyond = fusion.innovation * fusion.innovation > 9.0 * fusion.variance;
        ranges[if fusion.fused { 0 } else { 2 - usize::from(is_beyond) }] += 1;
    }
    Navigated { points, ranges, beyond_s }
}

fn point(sample: &FlightSample) -> Point {
    let FlightSample { truth, telemetry, .. } = sample;
    let [x, y] = [0, 1].map(|i| telemetry.state[i] - truth.state[i]);
    let [north, east] = [0, 1].map(|i| telemetry.sigma[i] * telemetry.sigma[i]);
    let cross = telemetry.cov_xy_m2;
    let nees = 0.5 * (x * x * east - 2.0 * x * y * cross + y * y * north) / (north * east - cross * cross);
    Point { time_s: truth.time_us as f64 * 1e-6, error_m: x.hypot(y), drms_m: (north + east).sqrt(), nees }
}
