//! A short flight in the simulator with the backseat steering: what `sim run` will look like.

use backseat_link::Client;
use backseat_logs::VehicleFile;
use hil_sim::backseat::InProcess;
use hil_sim::ending::Ending;
use hil_sim::flight;
use hil_sim::scenario::Scenario;
use std::sync::atomic::AtomicBool;

/// Time that is flown, s: surfaced for 60 m of the survey's run-in, then the dive to 3 m; the second where the first does
/// not bring it down, since a tonne takes minutes to gather way.
const DURATIONS_S: [f64; 2] = [180.0, 600.0];
/// Time at the end over which the depth is judged, s.
const JUDGED_S: usize = 20;

/// How it went.
#[derive(Clone, Copy, Debug)]
pub struct ShortFlight {
    /// Time that was flown, s.
    pub duration_s: f64,
    /// How it ended.
    pub ending: Ending,
    /// Mean depth of the last seconds, and the depth that was to be held, m.
    pub depth_m: [f64; 2],
    /// Largest roll and pitch, rad.
    pub largest_rad: [f64; 2],
    /// Mean speed of the last seconds, and the speed commanded, m/s.
    pub speed_mps: [f64; 2],
}

impl ShortFlight {
    /// Whether it came down to the depth commanded, more or less.
    pub fn is_down(&self) -> bool {
        let [depth_m, wanted_m] = self.depth_m;
        (depth_m - wanted_m).abs() <= 0.5 * wanted_m
    }
}

/// Flies the beginning of the default mission at a speed.
///
/// # Errors
/// The backseat refuses the vehicle.
pub fn fly(vehicle: &VehicleFile, speed_mps: f64) -> anyhow::Result<ShortFlight> {
    let [short_s, long_s] = DURATIONS_S;
    let flight = fly_for(vehicle, speed_mps, short_s)?;
    let is_late = flight.ending == Ending::Unfinished && !flight.is_down();
    if is_late { fly_for(vehicle, speed_mps, long_s) } else { Ok(flight) }
}

fn fly_for(vehicle: &VehicleFile, speed_mps: f64, duration_s: f64) -> anyhow::Result<ShortFlight> {
    let mut scenario = Scenario::built_in("survey")?;
    scenario.settings.duration_s = duration_s;
    scenario.vehicle = vehicle.clone();
    scenario.settings.mission.set_speed(speed_mps);
    // figures of other vehicles were made with the plain section
    scenario.settings.plant.round_hull = vehicle.cruise_speed_mps().is_some();
    let wanted_m = scenario.settings.waypoints().iter().map(|waypoint| waypoint.depth_m).fold(0.0, f64::max);
    let mut client = Client::new(InProcess::new());
    let flight = flight::fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| {})?;
    let samples = &flight.samples;
    let last = &samples[samples.len().saturating_sub(JUDGED_S)..];
    let mean = |of: fn(&flight::FlightSample) -> f64| last.iter().map(of).sum::<f64>() / last.len().max(1) as f64;
    let largest = |place: usize| samples.iter().map(|sample| sample.truth.state[place].abs()).fold(0.0, f64::max);
    Ok(ShortFlight {
        duration_s,
        ending: Ending::of(&scenario, &flight),
        depth_m: [mean(|sample| sample.truth.state[2]), wanted_m],
        largest_rad: [largest(3), largest(4)],
        speed_mps: [mean(|sample| sample.truth.state[6]), speed_mps],
    })
}
