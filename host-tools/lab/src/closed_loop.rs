//! A closed loop without a board: the simulator's vehicle, and whoever steers it. Steered on a filter's estimate it is a
//! [`ClosedLoop`], on its true state a [`TrueVehicle`]; [`fly`] is the loop of both.

use anyhow::anyhow;
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{ControlConfig, ControlError, Controller};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::{
    AcousticPath, InitialState, Measurement, NavigationConfig, Navigator, ShipEnd, ShipReport, VehicleEnd,
};
use backseat_core::state::{PSI, VehicleState, X, Y};
use backseat_identify::plan::Body;
use backseat_logs::VehicleFile;
use hil_sim::observation::{Observation, ObservationKind};
use hil_sim::scenario::{Plant, Scenario, Settings, Start, SurveyLine};
use hil_sim::truth::{Actuators, Parameters, State, Undeclared, Vehicle, Water};
use hil_sim::world::World;

/// The board's step, µs.
pub const STEP_US: u64 = 100_000;
const STEP_S: f64 = 0.1;
/// Speed and depth of the missions, m/s and m.
pub const SPEED_MPS: f64 = 1.0;
pub const DEPTH_M: f64 = 3.0;

/// Starts the vehicle deep and under way, 50 m before the first line, where no surface disturbs.
pub fn start_deep(settings: &mut Settings) {
    settings.start = Start { x_m: -50.0, y_m: 0.0, depth_m: DEPTH_M, heading_rad: 0.0, speed_mps: SPEED_MPS };
    settings.plant = Plant { surface: false, ..settings.plant };
}

/// A mission of waypoints.
///
/// # Errors
/// More waypoints than a mission holds.
pub fn mission(waypoints: impl IntoIterator<Item = Waypoint>) -> anyhow::Result<Mission> {
    let mut mission = Mission::new();
    for waypoint in waypoints {
        mission.push(waypoint).map_err(|error| anyhow!("mission: {error:?}"))?;
    }
    Ok(mission)
}

/// The mission along these lines.
///
/// # Errors
/// More lines than a mission holds.
pub fn mission_along(lines: &[SurveyLine]) -> anyhow::Result<Mission> {
    let ends = lines.iter().flat_map(|line| [line.from_m, line.to_m]);
    mission(ends.map(|[x_m, y_m]| Waypoint { x_m, y_m, depth_m: DEPTH_M, speed_mps: SPEED_MPS }))
}

/// The board's controller under way on a mission; `None` where the model has no trim at the speed of the mission, so
/// that no gain can be worked out for it: the board would refuse it.
///
/// # Errors
/// Anything else that the controller refuses.
pub fn controller(
    config: &ControlConfig,
    model: &VehicleModel,
    mission: &Mission,
    x: &VehicleState,
) -> anyhow::Result<Option<Box<Controller>>> {
    let mut controller = Box::new(Controller::new());
    match controller.configure(config, model) {
        Err(ControlError::NoTrim) => return Ok(None),
        configured => configured.map_err(|error| anyhow!("controller: {error:?}"))?,
    }
    controller.set_mission(mission);
    controller.start(x).map_err(|error| anyhow!("start: {error:?}"))?;
    Ok(Some(controller))
}

/// A vehicle that can be steered.
pub trait Steered {
    /// Moves it to a time, µs, under the last command.
    ///
    /// # Errors
    /// Its filter failed.
    fn advance(&mut self, to_us: u64) -> anyhow::Result<()>;
    /// The command from a time on, µs.
    fn actuate(&mut self, time_us: u64, input: ActuatorInput);
}

/// The flight loop: at every step of the board the vehicle is moved there, looked at and commanded, until the end of
/// the times or of the commands; whether it was that of the commands.
///
/// # Errors
/// Of the vehicle, or of what steers it.
pub fn fly<V: Steered>(
    vehicle: &mut V,
    times_us: std::ops::RangeInclusive<u64>,
    mut steer: impl FnMut(u64, &V) -> anyhow::Result<Option<ActuatorInput>>,
) -> anyhow::Result<bool> {
    for time_us in times_us.step_by(STEP_US as usize) {
        vehicle.advance(time_us)?;
        let Some(input) = steer(time_us, vehicle)? else { return Ok(true) };
        vehicle.actuate(time_us, input);
    }
    Ok(false)
}

fn actuators(input: &ActuatorInput) -> Actuators {
    Actuators { propeller_radps: input.propeller_radps, fins_rad: input.fins_rad }
}

/// The simulator's vehicle alone in still water without a surface, its true state known to whoever steers it.
pub struct TrueVehicle {
    vehicle: Vehicle,
    time_us: u64,
    input: ActuatorInput,
}

impl TrueVehicle {
    /// Steps of the true vehicle in one of the board's.
    const SUBSTEPS: u32 = 5;

    /// At time zero.
    pub fn new(parameters: &Parameters, undeclared: Undeclared, start: State, seed: u64) -> Self {
        let undeclared = Undeclared { no_surface: true, ..undeclared };
        let step_s = STEP_S / f64::from(Self::SUBSTEPS);
        let vehicle = Vehicle::with(parameters, &undeclared, start, step_s, seed);
        Self { vehicle, time_us: 0, input: ActuatorInput::default() }
    }
}

impl Body for TrueVehicle {
    fn state(&self) -> VehicleState {
        let x = self.vehicle.state();
        let parts = [x.position_m(), x.euler_rad(), x.velocity_mps(), x.rates_radps()];
        VehicleState::from_iterator(parts.into_iter().flatten())
    }

    fn step(&mut self, input: &ActuatorInput) {
        for _ in 0..Self::SUBSTEPS {
            self.vehicle.step(&actuators(input), &Water::default());
        }
        self.time_us += STEP_US;
    }
}

impl Steered for TrueVehicle {
    fn advance(&mut self, to_us: u64) -> anyhow::Result<()> {
        while self.time_us < to_us {
            let input = self.input;
            self.step(&input);
        }
        Ok(())
    }

    fn actuate(&mut self, _: u64, input: ActuatorInput) {
        self.input = input;
    }
}

/// Distance of a state from the line that it flies, m; none in turns and before the first.
pub fn across_m(lines: &[SurveyLine], x: &[f64; 12]) -> Option<f64> {
    let along = |line: &SurveyLine| {
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

    fn predict(&mut self, to_us: u64) -> anyhow::Result<()> {
        self.navigator.predict(to_us, &self.input).map_err(|error| anyhow!("filter: {error:?}"))
    }
}

impl Steered for ClosedLoop {
    /// Depth, attitude, rates and acoustic packets go to the filter, no DVL.
    fn advance(&mut self, to_us: u64) -> anyhow::Result<()> {
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

    fn actuate(&mut self, time_us: u64, input: ActuatorInput) {
        self.input = input;
        self.world.set_actuator_targets(time_us, actuators(&input));
    }
}
