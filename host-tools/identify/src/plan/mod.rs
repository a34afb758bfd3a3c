//! Planning: the mission with most information about the vehicle in a given time.
//!
//! A mission is a chain of legs, each with a turn, a depth and a speed: this is what the board can fly. It is built leg
//! by leg. Many legs are drawn at random, and the board's controller flies each of them on the declared model, from the
//! leg before it on. Of those that stay within the limits, the leg is kept that adds most to the logarithm of the
//! determinant of the information (D-optimal) for its time. Roll by differential fins is not excited: a mission cannot
//! command it.

mod flight;
mod information;

pub use flight::{Body, Followed, controller, exact_sample, follow};
pub use information::{Collected, Information};

use crate::{PERIOD_S, Sample};
use backseat_core::control::mission::{MAX_WAYPOINTS, Mission, MissionError, Waypoint};
use backseat_core::control::{ControlError, Controller};
use backseat_core::dynamics::{ParameterError, VehicleModel, VehicleParameters};
use backseat_core::state::{self, VehicleState};
use flight::Declared;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// Legs tried for each that is kept.
const TRIALS: usize = 48;
/// Shortest and longest leg of half an hour, m: some 100 of the 128 waypoints that a mission has. Longer plans have
/// longer legs.
const LEG_M: [f64; 2] = [12.0, 40.0];
/// That half hour, s.
const USUAL_S: f64 = 1800.0;
/// Longest time for a leg and the one before it, s.
const PAIR_S: f64 = 300.0;
/// A plan is as long as it was asked for to this share.
const LENGTH: f64 = 0.02;
/// Share of the pitch limit that a plan uses, and distance of its depths from their limits, m: the vehicle overshoots,
/// and is not quite the declared one (pitch was steeper by an eighth where that was wrong by 30 %).
const PITCH_SHARE: f64 = 0.8;
const DEPTH_MARGIN_M: f64 = 0.5;
/// Flights of the whole plan, each followed by other legs from where it left the limits, more or fewer where it was too
/// short or too long.
const FLIGHTS: usize = 20;
/// Turns tried, rad.
const TURNS: [f64; 6] = [0.0, 0.35, 0.8, FRAC_PI_2, 2.0, 2.6];

/// ChaCha stream of the legs that are drawn; another number gives other plans.
const STREAM: u64 = 13;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The depths are no range, or lie outside what is allowed.
    #[error("depths {} to {} m: expected two depths of 1 to 300 m, at least 1 m apart, the shallower first", .0[0], .0[1])]
    Depth([f64; 2]),
    /// The speeds are no range, or lie outside what a mission may ask for.
    #[error("speeds {} to {} m/s: expected two speeds of 0.5 to 3 m/s, the slower first", .0[0], .0[1])]
    Speed([f64; 2]),
    /// The duration is too short or too long.
    #[error("duration {0} s: expected 120 to 7200 s")]
    Duration(f64),
    /// A parameter of the declared vehicle is outside its range.
    #[error("declared vehicle: {0}")]
    Vehicle(ParameterError),
    /// The controller refuses the declared vehicle.
    #[error("the controller refuses the declared vehicle: {0:?}")]
    Controller(ControlError),
    /// The controller refuses the mission.
    #[error("the controller refuses the mission: {0:?}")]
    Mission(MissionError),
    /// The search ended without one.
    #[error("no plan of {0:.0} s within the limits was found; try another seed, or wider limits")]
    NotFound(f64),
}

/// Limits that a plan must keep.
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

    fn check(&self) -> Result<(), PlanError> {
        let [shallow, deep] = self.depth_m;
        let [slow, fast] = self.speed_mps;
        if !(shallow >= 1.0 && deep > shallow + 1.0 && deep <= 300.0) {
            return Err(PlanError::Depth(self.depth_m));
        }
        if !(slow >= Mission::MIN_SPEED_MPS && fast > slow && fast <= Mission::MAX_SPEED_MPS) {
            return Err(PlanError::Speed(self.speed_mps));
        }
        Ok(())
    }

    /// Depth in the middle, m.
    pub fn middle_m(&self) -> f64 {
        0.5 * (self.depth_m[0] + self.depth_m[1])
    }
}

/// A mission and what is expected of it.
pub struct Plan {
    /// Its waypoints.
    pub waypoints: Vec<Waypoint>,
    /// Its length, s.
    pub duration_s: f64,
    /// The information it is expected to collect.
    pub collected: Collected,
    /// Steepest pitch, rad.
    pub steepest_rad: f64,
    /// Shallowest and deepest, m.
    pub depths_m: [f64; 2],
}

/// A plan as far as it is flown.
#[derive(Clone)]
struct Incumbent {
    /// Where the last leg begins.
    x: VehicleState,
    /// When it does, s, and what was learned up to there.
    time_s: f64,
    known: Collected,
    /// After the last leg.
    end: VehicleState,
    end_s: f64,
    collected: Collected,
}

struct Planner<'a> {
    model: &'a VehicleModel,
    information: Information<'a>,
    steering: Box<Controller>,
    limits: &'a Limits,
    leg_m: [f64; 2],
}

/// Plans a mission of `duration_s` for the declared vehicle; the same seed gives the same plan.
///
/// # Errors
/// Limits, duration or vehicle outside their ranges, or no plan that keeps the limits.
pub fn plan(declared: &VehicleParameters, limits: &Limits, duration_s: f64, seed: u64) -> Result<Plan, PlanError> {
    limits.check()?;
    if !(120.0..=7200.0).contains(&duration_s) {
        return Err(PlanError::Duration(duration_s));
    }
    let model = VehicleModel::new(declared).map_err(PlanError::Vehicle)?;
    let planner = Planner {
        model: &model,
        information: Information::new(&model, declared),
        steering: flight::controller(&model)?,
        limits,
        leg_m: LEG_M.map(|length| length * f64::max(1.0, duration_s / USUAL_S)),
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(STREAM);
    let from = flight::start(limits.middle_m());
    let nothing = Collected::default();
    let mut waypoints: Vec<Waypoint> = Vec::new();
    let mut stood =
        vec![Incumbent { x: from, time_s: 0.0, known: nothing.clone(), end: from, end_s: 0.0, collected: nothing }];
    let mut target_s = duration_s;
    for _ in 0..FLIGHTS {
        while let Some(incumbent) = stood.last()
            && incumbent.end_s < (1.0 - LENGTH) * target_s
            && waypoints.len() < MAX_WAYPOINTS
        {
            let latest_s = (1.0 + LENGTH) * target_s;
            let Some((leg, next)) = planner.next(incumbent, waypoints.last(), latest_s, &mut random) else { break };
            waypoints.push(leg);
            stood.push(next);
        }
        // Once more in one flight, as the board will fly it.
        let mut body = Declared { model: &model, x: from };
        let flown = flight::follow_legs(&mut body, &mut planner.steering.clone(), &waypoints, 2.0 * duration_s)?;
        if let Some(sample) = planner.leaves(&flown.samples, limits.pitch_rad) {
            // Where the corner into that leg was cut matters too.
            let legs = flown.turns.iter().take_while(|turn| turn.0 <= sample).count().saturating_sub(1);
            waypoints.truncate(legs);
            stood.truncate(legs + 1);
            continue;
        }
        let off_s = duration_s - flown.duration_s();
        if flown.finished && off_s.abs() <= 2.0 * LENGTH * duration_s {
            let mut collected = Collected::default();
            planner.information.add(flown.samples.iter().map(|(sample, _)| sample), &mut collected);
            return Ok(Plan {
                waypoints,
                duration_s: flown.duration_s(),
                collected,
                steepest_rad: flown.steepest_rad(),
                depths_m: flown.depths_m(),
            });
        }
        target_s += off_s;
        while stood.last().is_some_and(|incumbent| incumbent.end_s > target_s) && !waypoints.is_empty() {
            waypoints.pop();
            stood.pop();
        }
    }
    Err(PlanError::NotFound(duration_s))
}

impl Planner<'_> {
    /// The best of the legs tried, and the plan with it; `None` if none stays within the limits and ends before
    /// `latest_s`.
    fn next(
        &self,
        incumbent: &Incumbent,
        last: Option<&Waypoint>,
        latest_s: f64,
        random: &mut ChaCha8Rng,
    ) -> Option<(Waypoint, Incumbent)> {
        let legs: Vec<Waypoint> = (0..TRIALS).map(|_| leg(&incumbent.end, self.limits, self.leg_m, random)).collect();
        let now = incumbent.collected.log_determinant();
        let tried = legs.par_iter().filter_map(|leg| {
            let after = self.fly(incumbent, last, leg).filter(|after| after.end_s <= latest_s)?;
            let gain = (after.collected.log_determinant() - now) / (after.end_s - incumbent.end_s).max(1.0);
            Some((gain, *leg, after))
        });
        let best = tried.reduce_with(|a, b| if b.0 > a.0 { b } else { a });
        best.map(|(_, leg, after)| (leg, after))
    }

    /// The last leg again and then a new one: the corner is cut, and the propeller does not stop, as in the mission.
    fn fly(&self, incumbent: &Incumbent, last: Option<&Waypoint>, leg: &Waypoint) -> Option<Incumbent> {
        let waypoints: Vec<Waypoint> = last.into_iter().chain([leg]).copied().collect();
        let mut body = Declared { model: self.model, x: incumbent.x };
        let flown = flight::follow_legs(&mut body, &mut self.steering.clone(), &waypoints, PAIR_S).ok()?;
        let turn = if last.is_some() { *flown.turns.first()? } else { (0, incumbent.x) };
        let ends = body.x.rows(state::X, 2).norm() < self.limits.radius_m;
        let (mut known, (before, after)) = (incumbent.known.clone(), flown.samples.split_at(turn.0));
        if !flown.finished || !ends || self.leaves(after, PITCH_SHARE * self.limits.pitch_rad).is_some() {
            return None;
        }
        // What is flown again starts with a propeller at rest, which the mission does not.
        self.information.add(before.iter().skip(20).map(|(sample, _)| sample), &mut known);
        let mut collected = known.clone();
        self.information.add(after.iter().map(|(sample, _)| sample), &mut collected);
        let seconds = |samples: usize| samples as f64 * PERIOD_S;
        let time_s = incumbent.time_s + seconds(before.len());
        Some(Incumbent { x: turn.1, time_s, known, end: body.x, end_s: time_s + seconds(after.len()), collected })
    }

    /// The first sample that does not keep this pitch, or the limits of depth.
    fn leaves(&self, samples: &[(Sample, f64)], pitch_rad: f64) -> Option<usize> {
        let [shallow, deep] = self.limits.depth_m;
        samples
            .iter()
            .position(|(sample, depth_m)| sample.attitude.y.abs() >= pitch_rad || !(shallow..=deep).contains(depth_m))
    }
}

/// A leg from where the vehicle is; extremes of depth and speed as often as what lies between.
fn leg(x: &VehicleState, limits: &Limits, leg_m: [f64; 2], random: &mut ChaCha8Rng) -> Waypoint {
    let mut within = |[low, high]: [f64; 2]| {
        let share = (1.6 * random.random::<f64>() - 0.3).clamp(0.0, 1.0);
        low + share * (high - low)
    };
    let [shallow, deep] = limits.depth_m;
    let depth_m = within([shallow + DEPTH_MARGIN_M, deep - DEPTH_MARGIN_M]);
    let speed_mps = within(limits.speed_mps);
    let length_m = within(leg_m);
    let turn = TURNS[((TURNS.len() as f64 * random.random::<f64>()) as usize).min(TURNS.len() - 1)];
    let sign = if random.random::<f64>() < 0.5 { -1.0 } else { 1.0 };
    let out = x.rows(state::X, 2).norm();
    let mut course = x[state::PSI] + sign * turn;
    if out + length_m > limits.radius_m {
        course = (-x[state::Y]).atan2(-x[state::X]) + sign * 0.3 * PI * random.random::<f64>();
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
    use backseat_core::control::mission::Lawnmower;
    use backseat_logs::VehicleFile;

    #[test]
    fn a_plan_keeps_its_limits_is_repeatable_and_tells_more_than_a_line() {
        let declared = VehicleFile::reference().parameters;
        let limits = Limits { depth_m: [4.0, 10.0], speed_mps: [0.8, 1.2], ..Limits::DEFAULT };
        let planned = plan(&declared, &limits, 200.0, 3).unwrap();
        assert!((190.0..=210.0).contains(&planned.duration_s), "{} s", planned.duration_s);
        assert!(planned.steepest_rad < limits.pitch_rad && planned.depths_m[0] > 4.0 && planned.depths_m[1] < 10.0);
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
