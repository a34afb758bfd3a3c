//! 3.1.4: time that a simulation takes with each allocation of moments to fins, and how well it follows the lines.

use super::{Kind, Measured, Study, conditions, steering};
use anyhow::anyhow;
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{AllocationMethod, ControlConfig, ControlLaw, Controller};
use backseat_core::dynamics::VehicleModel;
use backseat_core::state::VehicleState;
use hil_sim::truth::{Actuators, Undeclared, Vehicle, Water};
use std::time::Instant;

/// Both allocations on the same lines.
pub const ALLOCATION: Study = Study { name: "allocation", kind: Kind::Own(run) };

/// Time between commands, s, and steps of the plant in it.
const STEP_S: f64 = 0.1;
const SUBSTEPS: u32 = 5;
/// Length of a simulation, s: two lines and the turn between them.
const FLIGHT_S: f64 = 2200.0;
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
    let start = scenario.initial_state();
    let undeclared = Undeclared { no_surface: true, ..Undeclared::default() };
    let step_s = STEP_S / f64::from(SUBSTEPS);
    let mut vehicle = Vehicle::with(&scenario.truth_parameters(), &undeclared, start, step_s, seed);
    let model = VehicleModel::new(&scenario.vehicle.parameters).map_err(|error| anyhow!("{error}"))?;
    let mut controller = Box::new(Controller::new());
    let config = ControlConfig { law: ControlLaw::Pd, allocation, ..ControlConfig::REFERENCE };
    controller.configure(&config, &model).map_err(|error| anyhow!("controller: {error:?}"))?;
    let mut mission = Mission::new();
    for waypoint in scenario.settings.waypoints() {
        let (x_m, y_m, depth_m, speed_mps) = (waypoint.x_m, waypoint.y_m, waypoint.depth_m, waypoint.speed_mps);
        mission.push(Waypoint { x_m, y_m, depth_m, speed_mps }).map_err(|error| anyhow!("mission: {error:?}"))?;
    }
    controller.set_mission(&mission);
    let state = |vehicle: &Vehicle| {
        let x = vehicle.state();
        let parts = [x.position_m(), x.euler_rad(), x.velocity_mps(), x.rates_radps()];
        VehicleState::from_iterator(parts.into_iter().flatten())
    };
    controller.start(&state(&vehicle)).map_err(|error| anyhow!("start: {error:?}"))?;
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    for step in 0..(FLIGHT_S / STEP_S) as u64 {
        let x = state(&vehicle);
        let command = controller.command(step * 100_000, &x, [0.0; 2]);
        for (sum, error) in squares.iter_mut().zip([command.error.cross_m, command.error.depth_m, x[3]]) {
            *sum += error * error;
        }
        count += 1.0;
        let targets = Actuators { propeller_radps: command.input.propeller_radps, fins_rad: command.input.fins_rad };
        for _ in 0..SUBSTEPS {
            vehicle.step(&targets, &Water::default());
        }
    }
    Ok(squares.map(|sum| f64::sqrt(sum / count)))
}
