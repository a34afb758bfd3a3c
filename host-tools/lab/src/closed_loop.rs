//! A closed loop without a board: the simulator's vehicle, a filter that sees its sensors, and whoever steers on the
//! filter's estimate.

use anyhow::anyhow;
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::{
    AcousticPath, InitialState, Measurement, NavigationConfig, Navigator, ShipEnd, ShipReport, VehicleEnd,
};
use backseat_core::state::{PSI, VehicleState, X, Y};
use backseat_logs::VehicleFile;
use hil_sim::observation::{Observation, ObservationKind};
use hil_sim::scenario::{Line, Plant, Scenario, Settings, Start};
use hil_sim::truth::Actuators;
use hil_sim::world::World;

/// The board's step, µs.
pub const STEP_US: u64 = 100_000;
/// Speed and depth of the missions, m/s and m.
pub const SPEED_MPS: f64 = 1.0;
pub const DEPTH_M: f64 = 3.0;

/// Starts the vehicle deep and under way, 50 m before the first line, where no surface disturbs.
pub fn start_deep(settings: &mut Settings) {
    settings.start = Start { x_m: -50.0, y_m: 0.0, depth_m: DEPTH_M, heading_rad: 0.0, speed_mps: SPEED_MPS };
    settings.plant = Plant { surface: false, ..settings.plant };
}

/// The mission along these lines.
///
/// # Errors
/// More lines than a mission holds.
pub fn mission_along(lines: &[Line]) -> anyhow::Result<Mission> {
    let mut mission = Mission::new();
    for [x_m, y_m] in lines.iter().flat_map(|line| [line.from_m, line.to_m]) {
        let waypoint = Waypoint { x_m, y_m, depth_m: DEPTH_M, speed_mps: SPEED_MPS };
        mission.push(waypoint).map_err(|error| anyhow!("mission: {error:?}"))?;
    }
    Ok(mission)
}

/// Distance of a state from the line that it flies, m; none in turns and before the first.
pub fn across_m(lines: &[Line], x: &[f64; 12]) -> Option<f64> {
    let along = |line: &Line| {
        let way = [line.to_m[0] - line.from_m[0], line.to_m[1] - line.from_m[1]];
        let length = way[0].hypot(way[1]);
        let off = [x[X] - line.from_m[0], x[Y] - line.from_m[1]];
        let at = (off[0] * way[0] + off[1] * way[1]) / length;
        let across = (off[1] * way[0] - off[0] * way[1]) / length;
        let turned = (way[1].atan2(way[0]) - x[PSI]).cos();
        (at > 50.0 && at < length - 50.0 && turned > 0.7).then_some(across)
    };
    lines.iter().filter_map(along).min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// World and filter.
pub struct ClosedLoop {
    pub world: World,
    pub navigator: Box<Navigator>,
    input: ActuatorInput,
}

impl ClosedLoop {
    /// From the true state, with a filter of the declared vehicle's model.
    ///
    /// # Errors
    /// A vehicle or a configuration that the filter refuses.
    pub fn new(
        scenario: &Scenario,
        declared: &VehicleFile,
        model: &VehicleModel,
        config: &NavigationConfig,
    ) -> anyhow::Result<Self> {
        let world = World::new(scenario);
        let mut navigator = Box::new(Navigator::new());
        navigator.configure(config, model).map_err(|error| anyhow!("filter: {error:?}"))?;
        let state = VehicleState::from_column_slice(&world.truth().state);
        let sensors = &declared.sensors;
        let ([roll, pitch, heading], rates) = (sensors.angles_rad(), sensors.rates_radps);
        let sigma = VehicleState::from([1.5, 1.5, 0.06, roll, pitch, heading, 0.1, 0.1, 0.1, rates, rates, rates]);
        navigator.initialise(0, &InitialState { state, sigma }).map_err(|error| anyhow!("filter: {error:?}"))?;
        Ok(Self { world, navigator, input: ActuatorInput::default() })
    }

    /// Moves world and filter to a time: depth, attitude, rates and acoustic packets go to the filter, no DVL.
    ///
    /// # Errors
    /// A filter that fails.
    pub fn advance(&mut self, to_us: u64) -> anyhow::Result<()> {
        let mut observed: Vec<Observation> = Vec::new();
        self.world.advance(to_us, &mut |observation| observed.push(*observation));
        for observation in observed {
            let path = |ship| AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(ship) };
            let [first, second] = match observation.kind {
                ObservationKind::Depth { depth_m } => [Some(Measurement::Depth { z_m: depth_m }), None],
                ObservationKind::Ahrs { euler_rad, rates_radps } => {
                    [Some(Measurement::Attitude { euler_rad }), Some(Measurement::Rates { rates_radps })]
                }
                ObservationKind::Downlink(packet) => {
                    let ship = ShipReport {
                        position_m: packet.ship.position_m,
                        velocity_mps: packet.ship.velocity_mps,
                        position_sigma_m: packet.ship.position_sigma_m,
                        velocity_sigma_mps: packet.ship.velocity_sigma_mps,
                    };
                    let (range_m, range_rate_mps) = (packet.range_m, packet.range_rate_mps);
                    [
                        Some(Measurement::Range { path: path(ship), range_m }),
                        Some(Measurement::RangeRate { path: path(ship), range_rate_mps }),
                    ]
                }
                _ => continue,
            };
            self.predict(observation.time_us)?;
            for measurement in [first, second].iter().flatten() {
                self.navigator.fuse(measurement);
            }
        }
        self.predict(to_us)
    }

    fn predict(&mut self, to_us: u64) -> anyhow::Result<()> {
        self.navigator.predict(to_us, &self.input).map_err(|error| anyhow!("filter: {error:?}"))
    }

    /// The command from now on, for the vehicle and for its filter.
    pub fn actuate(&mut self, time_us: u64, input: ActuatorInput) {
        self.input = input;
        let ActuatorInput { propeller_radps, fins_rad } = input;
        self.world.set_actuator_targets(time_us, Actuators { propeller_radps, fins_rad });
    }
}
