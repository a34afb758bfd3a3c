//! `backseat identify --plan`: the mission that tells most about the vehicle in a given time.
//!
//! A mission is a chain of legs, each with a turn, a depth and a speed: what the board can fly. It is built leg by leg: of many legs
//! drawn at random, each flown by the board's controller on the declared model, the one that adds most to the logarithm of the
//! determinant of the information (D-optimal) in its time is kept, among those that stay within the limits. Roll by differential
//! fins is not in it: a mission cannot ask for it.

mod flight;
mod information;
mod study;

pub use study::run as run_study;

use anyhow::{Context, bail, ensure};
use backseat_core::control::mission::{MAX_WAYPOINTS, Waypoint};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::state;
use flight::Declared;
use hil_sim::rng::{Source, Stream};
use information::{Collected, Information};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// Legs tried for each that is kept.
const TRIALS: usize = 48;
/// Longest leg, m: 128 waypoints of these fill an hour.
const LEG_M: [f64; 2] = [12.0, 40.0];
/// Turns tried, rad.
const TURNS: [f64; 6] = [0.0, 0.35, 0.8, FRAC_PI_2, 2.0, 2.6];

/// What a plan must keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Shallowest and deepest, m.
    pub depth_m: [f64; 2],
    /// Slowest and fastest leg, m/s.
    pub speed_mps: [f64; 2],
    /// Steepest pitch, rad.
    pub pitch_rad: f64,
    /// Farthest from the start, m.
    pub radius_m: f64,
}

impl Limits {
    /// A test range: 3 to 20 m deep, 0.7 to 1.5 m/s, 25°, 250 m.
    pub const DEFAULT: Self = Self { depth_m: [3.0, 20.0], speed_mps: [0.7, 1.5], pitch_rad: 0.436, radius_m: 250.0 };

    fn check(&self) -> anyhow::Result<()> {
        let [shallow, deep] = self.depth_m;
        let [slow, fast] = self.speed_mps;
        ensure!(
            shallow >= 1.0 && deep > shallow + 1.0 && deep <= 300.0,
            "--depth takes two depths of 1 to 300 m, 1 m apart"
        );
        ensure!(slow >= 0.5 && fast > slow && fast <= 3.0, "--speed takes two speeds of 0.5 to 3 m/s");
        Ok(())
    }

    /// Depth in the middle.
    pub fn middle_m(&self) -> f64 {
        0.5 * (self.depth_m[0] + self.depth_m[1])
    }
}

/// A mission and what it promises.
pub struct Plan {
    pub waypoints: Vec<Waypoint>,
    pub duration_s: f64,
    pub collected: Collected,
}

/// Plans a mission of at most `duration_s` for the declared vehicle; in flight corners are cut, and it is over up to a third sooner.
pub fn plan(declared: &VehicleParameters, limits: &Limits, duration_s: f64, seed: u64) -> anyhow::Result<Plan> {
    limits.check()?;
    ensure!((120.0..=7200.0).contains(&duration_s), "--duration takes 120 to 7200 s");
    let model = VehicleModel::new(declared).map_err(|error| anyhow::anyhow!("declared vehicle: {error}"))?;
    let information = Information::new(&model, declared);
    let steering = flight::controller(&model)?;
    let mut body = Declared { model: &model, x: flight::start(limits.middle_m()) };
    let mut random = Stream::new(seed, Source::Mission);
    let mut plan = Plan { waypoints: Vec::new(), duration_s: 0.0, collected: Collected::default() };
    while plan.duration_s < duration_s && plan.waypoints.len() < MAX_WAYPOINTS {
        let from = body.x;
        let legs: Vec<Waypoint> = (0..TRIALS).map(|_| leg(&from, limits, &mut random)).collect();
        let now = plan.collected.log_determinant();
        let tried = legs.par_iter().map(|leg| {
            let (mut body, mut steering) = (body.clone(), steering.clone());
            let samples = flight::follow(&mut body, &mut steering, &[*leg], 120.0).ok()?;
            let stays = samples.iter().all(|(sample, depth_m)| {
                *depth_m > limits.depth_m[0] - 0.5
                    && *depth_m < limits.depth_m[1] + 0.5
                    && sample.attitude.y.abs() < limits.pitch_rad
            });
            let ends = body.x.rows(state::X, 2).norm() < limits.radius_m;
            let mut collected = plan.collected.clone();
            // Each trial starts with a propeller at rest, which the mission does not.
            information.add(samples.iter().skip(20).map(|(sample, _)| sample), &mut collected);
            let time_s = samples.len() as f64 * backseat_identify::data::PERIOD_S;
            let gain = (collected.log_determinant() - now) / time_s;
            (stays && ends && time_s > 5.0).then_some((gain, *leg, body.x, collected, time_s))
        });
        let best = tried.filter_map(|trial| trial).reduce_with(|a, b| if b.0 > a.0 { b } else { a });
        let Some((_, leg, x, collected, time_s)) = best else {
            bail!("no leg of {TRIALS} tried stays within the limits after {:.0} s", plan.duration_s);
        };
        plan.waypoints.push(leg);
        plan.duration_s += time_s;
        plan.collected = collected;
        body.x = x;
    }
    // Once more in one flight, as the board will fly it.
    let mut body = Declared { model: &model, x: flight::start(limits.middle_m()) };
    let mut steering = steering;
    let samples = flight::follow(&mut body, &mut steering, &plan.waypoints, duration_s).context("the plan")?;
    plan.collected = Collected::default();
    information.add(samples.iter().map(|(sample, _)| sample), &mut plan.collected);
    plan.duration_s = samples.len() as f64 * backseat_identify::data::PERIOD_S;
    Ok(plan)
}

/// A leg from where the vehicle is; extremes of depth and speed as often as what lies between.
fn leg(x: &backseat_core::state::VehicleState, limits: &Limits, random: &mut Stream) -> Waypoint {
    let mut within = |[low, high]: [f64; 2], margin: f64| {
        let share = (1.6 * random.uniform() - 0.3).clamp(0.0, 1.0);
        low + margin + share * (high - low - 2.0 * margin)
    };
    let depth_m = within(limits.depth_m, 0.0);
    let speed_mps = within(limits.speed_mps, 0.0);
    let length_m = within(LEG_M, 0.0);
    let turn = TURNS[((TURNS.len() as f64 * random.uniform()) as usize).min(TURNS.len() - 1)];
    let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
    let out = x.rows(state::X, 2).norm();
    let mut course = x[state::PSI] + sign * turn;
    if out + length_m > limits.radius_m {
        course = (-x[state::Y]).atan2(-x[state::X]) + sign * 0.3 * PI * random.uniform();
    }
    Waypoint {
        x_m: x[state::X] + length_m * course.cos(),
        y_m: x[state::Y] + length_m * course.sin(),
        depth_m,
        speed_mps,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::control::mission::{Lawnmower, Mission};
    use backseat_data::VehicleFile;

    #[test]
    fn a_plan_keeps_its_limits_is_repeatable_and_tells_more_than_a_line() {
        let declared = VehicleFile::reference().parameters;
        let limits = Limits { depth_m: [4.0, 10.0], speed_mps: [0.8, 1.2], ..Limits::DEFAULT };
        let planned = plan(&declared, &limits, 200.0, 3).unwrap();
        // Corners are cut in flight, and the propeller does not start anew at each leg, so that it is over sooner than asked.
        assert!((100.0..=200.0).contains(&planned.duration_s), "{} s", planned.duration_s);
        for w in &planned.waypoints {
            assert!((4.0..=10.0).contains(&w.depth_m) && (0.8..=1.2).contains(&w.speed_mps), "{w:?}");
        }
        assert_eq!(plan(&declared, &limits, 200.0, 3).unwrap().waypoints, planned.waypoints);

        let model = VehicleModel::new(&declared).unwrap();
        let mission = Mission::lawnmower(&Lawnmower { line_m: 60.0, spacing_m: 20.0, ..Lawnmower::REFERENCE }).unwrap();
        let mut body = Declared { model: &model, x: flight::start(limits.middle_m()) };
        let mut steering = flight::controller(&model).unwrap();
        let lines = flight::follow(&mut body, &mut steering, mission.waypoints(), planned.duration_s).unwrap();
        let mut collected = Collected::default();
        Information::new(&model, &declared).add(lines.iter().map(|(sample, _)| sample), &mut collected);
        // One nat a parameter is a clear gain; 20 of them.
        assert!(planned.collected.log_determinant() > collected.log_determinant() + 20.0);
        assert!(planned.collected.remaining_percent() < collected.remaining_percent());
    }

    #[test]
    fn limits_that_are_none_are_refused() {
        let declared = VehicleFile::reference().parameters;
        for limits in [
            Limits { depth_m: [8.0, 4.0], ..Limits::DEFAULT },
            Limits { speed_mps: [0.1, 1.0], ..Limits::DEFAULT },
            Limits { depth_m: [f64::NAN, 4.0], ..Limits::DEFAULT },
        ] {
            assert!(plan(&declared, &limits, 200.0, 1).is_err(), "{limits:?}");
        }
        assert!(plan(&declared, &Limits::DEFAULT, 10.0, 1).is_err());
    }
}
