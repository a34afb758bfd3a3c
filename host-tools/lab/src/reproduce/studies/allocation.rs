//! 3.1.4: time that a simulation takes with each allocation of moments to fins, and how well it follows the lines.

use super::{Kind, Measured, Study, conditions, steering};
use crate::closed_loop::{self, STEP_US, TrueVehicle};
use anyhow::{Context, anyhow};
use backseat_core::control::mission::Waypoint;
use backseat_core::control::{AllocationMethod, ControlConfig, ControlLaw};
use backseat_core::dynamics::VehicleModel;
use backseat_core::state::PHI;
use backseat_identify::plan::Body as _;
use hil_sim::truth::Undeclared;
use std::time::Instant;

/// Both allocations on the same lines.
pub const ALLOCATION: Study = Study { name: "allocation", kind: Kind::Own(run) };

/// Length of a simulation, µs: two lines and the turn between them.
const FLIGHT_US: u64 = 2_200_000_000;
/// Repetitions, of which the fastest counts: other processes can only make it slower.
const REPETITIONS: usize = 3;

fn run(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    let mut least_s = [f64::INFINITY; 2];
    for _ in 0..REPETITIONS {
        for (least_s, (row, allocation)) in
            least_s.iter_mut().zip([("decoupled", AllocationMethod::Decoupled), ("6-DOF", AllocationMethod::SixDof)])
        {
            let began = Instant::now();
            let [cross_m, depth_m, roll_rad] = fly(seed, allocation)?;
            *least_s = least_s.min(began.elapsed().as_secs_f64());
            measured.set(row, "cross_m", cross_m);
            measured.set(row, "depth_m", depth_m);
            measured.set(row, "roll_deg", roll_rad.to_degrees());
        }
    }
    let [decoupled_s, six_s] = least_s;
    for (row, s) in [("decoupled", decoupled_s), ("6-DOF", six_s)] {
        measured.set(row, "time_ms", 1.0e3 * s);
        measured.set(row, "time_ratio", s / decoupled_s);
    }
    Ok(measured)
}

/// Root mean squares of the errors across the line and in depth, and of roll: PD on the true state.
fn fly(seed: u64, allocation: AllocationMethod) -> anyhow::Result<[f64; 3]> {
    let scenario = steering::scenario_of(&conditions::D_SURVEY, seed)?;
    let parameters = scenario.truth_parameters();
    let mut vehicle = TrueVehicle::new(&parameters, Undeclared::default(), scenario.initial_state(), seed);
    let model = VehicleModel::new(&scenario.vehicle.parameters).map_err(|error| anyhow!("{error}"))?;
    let config = ControlConfig { law: ControlLaw::Pd, allocation, ..ControlConfig::REFERENCE };
    let waypoints = scenario.settings.waypoints().into_iter();
    let mission = closed_loop::mission(waypoints.map(|waypoint| {
        let (x_m, y_m, depth_m, speed_mps) = (waypoint.x_m, waypoint.y_m, waypoint.depth_m, waypoint.speed_mps);
        Waypoint { x_m, y_m, depth_m, speed_mps }
    }))?;
    let controller = closed_loop::controller(&config, &model, &mission, &vehicle.state())?;
    let mut controller = controller.context("the vehicle has no trim")?;
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    closed_loop::fly(&mut vehicle, 0..=FLIGHT_US - STEP_US, |time_us, vehicle| {
        let x = vehicle.state();
        let command = controller.command(time_us, &x, [0.0; 2]);
        for (sum, error) in squares.iter_mut().zip([command.error.cross_m, command.error.depth_m, x[PHI]]) {
            *sum += error * error;
        }
        count += 1.0;
        Ok(Some(command.input))
    })?;
    Ok(squares.map(|sum| f64::sqrt(sum / count)))
}
