//! Cases: the world that is flown, and the filter over it.

use super::motion::Motion;
use backseat_core::navigation::{EffectStates, InitialShip, InitialState, ProcessModel, ProcessNoise};
use backseat_core::state::VehicleState;
use backseat_estimation::filter::{FilterOptions, ShipSource, Start};
use backseat_logs::{DataError, VehicleFile};
use hil_sim::dataset::Leg;
use hil_sim::scenario::{Plant, Scenario};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// An effect state as it enters the true world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeclaredEffect {
    /// North of `water_current`, m/s.
    CurrentNorth,
    /// East of `water_current`, m/s.
    CurrentEast,
    /// `linear_drag`, N s/m.
    LinearDrag,
    /// `clock_offset`, s.
    ClockOffset,
}

/// An effect as it is declared: zero on average, with this sigma at the start, then a random walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectPrior {
    /// Which.
    pub effect: DeclaredEffect,
    /// One sigma at the start.
    pub sigma: f64,
    /// √PSD of the walk, per √s.
    pub walk: f64,
}

impl DeclaredEffect {
    /// Entry and parameter of the catalogue.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::CurrentNorth => ("water_current", "north_mps"),
            Self::CurrentEast => ("water_current", "east_mps"),
            Self::LinearDrag => ("linear_drag", "surge_ns_per_m"),
            Self::ClockOffset => ("clock_offset", "s"),
        }
    }
}

/// The current of [`FilterOptions::water_current`].
const CURRENT: [EffectPrior; 2] = [
    EffectPrior { effect: DeclaredEffect::CurrentNorth, sigma: 0.3, walk: 1.0e-4 },
    EffectPrior { effect: DeclaredEffect::CurrentEast, sigma: 0.3, walk: 1.0e-4 },
];
/// A tenth of the drag at 1 m/s, creeping by a tenth of that.
const DRAG: EffectPrior = EffectPrior { effect: DeclaredEffect::LinearDrag, sigma: 0.3, walk: 1.0e-3 };
/// A millisecond: 1.5 m of range.
const CLOCK: EffectPrior = EffectPrior { effect: DeclaredEffect::ClockOffset, sigma: 1.0e-3, walk: 1.0e-6 };

/// A world that behaves as declared, and the filter with this declaration.
#[derive(Clone, Debug)]
pub struct DeclaredCase {
    /// For tables.
    pub name: &'static str,
    /// The filter.
    pub options: FilterOptions,
    /// The declared vehicle: its noise is that of the world.
    pub vehicle: VehicleFile,
    /// The vehicle's equations.
    pub motion: Motion,
    /// Mean and sigma of the vehicle at the start.
    pub vehicle_prior: InitialState,
    /// Mean and sigma of the ship at the start.
    pub ship_prior: InitialShip,
    /// Effects, in the order of the filter's states.
    pub effects: Vec<EffectPrior>,
    /// Waypoints of the autopilot; empty: no steering.
    pub legs: Vec<Leg>,
    /// Length, s.
    pub duration_s: u32,
    /// The bound assumes the same knowledge as the filter has.
    pub bounded: bool,
}

impl DeclaredCase {
    /// Standard deviations of the accelerations' white noise, √PSD, u, v, w, p, q, r.
    #[must_use]
    pub fn densities(&self) -> [f64; 6] {
        let noise = &self.options.navigation.process_noise;
        let ([u, v, w], [p, q, r]) = (noise.linear_mps2_per_sqrt_hz, noise.angular_radps2_per_sqrt_hz);
        [u, v, w, p, q, r]
    }
}

/// Acceleration of the ship, m/s²/√Hz: it drifts by 80 m in a quarter of an hour, so that the geometry stays that of
/// the mission in every run.
const SHIP_NOISE: f64 = 5.0e-3;

/// All cases, each cut to `minutes`.
///
/// # Errors
/// If the built-in scenario cannot be read.
pub fn cases(minutes: u32) -> Result<Vec<DeclaredCase>, DataError> {
    let duration_s = 60 * minutes;
    let mut scenario = Scenario::built_in("survey")?;
    // The vehicle is what the file declares: no lag of servos or propeller.
    scenario.settings.plant =
        Plant { servo_rate_radps: 1.0e6, propeller_lag_s: 0.0, surface: false, ..Plant::default() };
    let vehicle = scenario.vehicle.clone();
    let dynamic = |name, effects: &[EffectPrior]| -> DeclaredCase {
        let vehicle_prior = vehicle_prior(0.0);
        DeclaredCase {
            name,
            options: options(&vehicle, ProcessModel::Dynamic, effects, vehicle_prior),
            vehicle: vehicle.clone(),
            motion: Motion::dynamic(&scenario.truth_parameters()),
            vehicle_prior,
            ship_prior: ship_prior(),
            effects: effects.to_vec(),
            legs: legs(),
            duration_s,
            bounded: true,
        }
    };
    let mut kinematic = dynamic("kinematic + DVL", &[]);
    kinematic.vehicle_prior = vehicle_prior(TAU / 900.0);
    // Rates stay: known well, or the vehicle would tumble.
    kinematic.vehicle_prior.sigma.fixed_rows_mut::<3>(9).fill(1.0e-4);
    kinematic.options = options(&vehicle, ProcessModel::Kinematic, &[], kinematic.vehicle_prior);
    kinematic.options.use_dvl = true;
    // Only noise moves this vehicle: so little that it stays upright for a quarter of an hour.
    kinematic.options.navigation.process_noise = ProcessNoise {
        linear_mps2_per_sqrt_hz: [5.0e-3, 5.0e-3, 2.0e-3],
        angular_radps2_per_sqrt_hz: [1.5e-5, 1.5e-5, 3.0e-5],
    };
    kinematic.motion = Motion::Kinematic;
    kinematic.legs.clear();
    let mut packets = dynamic("dynamic, ship from packets", &[]);
    packets.options.ship = ShipSource::Packet;
    packets.bounded = false;
    let mut first_order = dynamic("dynamic + current, ranges to first order", &CURRENT);
    first_order.options.navigation.range_curvature = 1.0e6;
    first_order.bounded = false;
    Ok(vec![
        kinematic,
        dynamic("dynamic", &[]),
        packets,
        dynamic("dynamic + current", &CURRENT),
        first_order,
        dynamic("dynamic + current, drag, clock", &[CURRENT[0], CURRENT[1], DRAG, CLOCK]),
    ])
}

fn options(vehicle: &VehicleFile, model: ProcessModel, effects: &[EffectPrior], prior: InitialState) -> FilterOptions {
    let mut options = FilterOptions::new(vehicle, model);
    options.use_dvl = false;
    options.track_interval_us = 3_600_000_000; // not used
    options.start = Some(Start { vehicle: prior, ship: Some(ship_prior()) });
    options.navigation.surface = None;
    options.navigation.ship_noise.linear_mps2_per_sqrt_hz = SHIP_NOISE;
    options.navigation.effect_states = effects.iter().fold(EffectStates::NONE, |states, prior| {
        let (effect, parameter) = prior.effect.names();
        states.with(effect, parameter, prior.sigma, prior.walk).expect("the filter can estimate it")
    });
    options
}

fn vehicle_prior(turn_rate_radps: f64) -> InitialState {
    let state = [0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, turn_rate_radps];
    let sigma = [1.5, 1.5, 0.1, 0.02, 0.02, 0.02, 0.05, 0.05, 0.05, 0.005, 0.005, 0.005];
    InitialState { state: VehicleState::from_column_slice(&state), sigma: VehicleState::from_column_slice(&sigma) }
}

/// East along a line south of the vehicle's, so that the bearing turns and the distance stays above 200 m.
fn ship_prior() -> InitialShip {
    InitialShip { state: [-250.0, -350.0, FRAC_PI_2, 0.0, 0.8, 0.0], sigma: [0.5, 0.5, 0.1, 0.1, 0.1, 0.01] }
}

/// Two lines to and fro, and across between them.
fn legs() -> Vec<Leg> {
    let leg = |heading_rad, until_s| Leg { heading_rad, depth_m: 5.0, speed_mps: 1.0, until_s };
    vec![
        leg(0.0, 240.0),
        leg(FRAC_PI_2, 300.0),
        leg(PI, 540.0),
        leg(FRAC_PI_2, 600.0),
        leg(0.0, 840.0),
        leg(-FRAC_PI_2, f64::INFINITY),
    ]
}
