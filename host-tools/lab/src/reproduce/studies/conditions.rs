//! Missions, ships, packets and sensors as the thesis prints them for each of its studies.
//!
//! What it does not print is ours: centre, start and sense of the ship's circle, noise of both GNSS receivers (those of
//! the default survey), process noise, controller gains, and for the sea trial the ship's track.

use hil_sim::scenario::ControlLaw;

/// Conditions of a flight.
#[derive(Clone, Copy, Debug)]
pub struct Conditions {
    /// The mission.
    pub lines: Lines,
    /// Radius of the ship's circle, m, and its speed, m/s.
    pub ship: [f64; 2],
    /// First launch, s, and period, s.
    pub packets_s: [u32; 2],
    /// Launches within a period, s.
    pub slots_s: &'static [u32],
    /// Depth: rate, Hz, and noise, m.
    pub depth: [f64; 2],
    /// Attitude: rate, Hz, noise of roll and pitch, and of heading, deg.
    pub attitude: [f64; 3],
    /// Noise of angular rates, deg/s; none are used if it is not printed.
    pub rates_degps: Option<f64>,
    /// Who steers, on the estimate of the dynamic filter without a DVL.
    pub law: ControlLaw,
    /// Attitude comes so rarely that the kinematic model needs the process noise of steep manoeuvres.
    pub slow_compass: bool,
    /// The vehicle is that of the identification experiments.
    pub experiment_vehicle: bool,
}

/// Parallel lines.
#[derive(Clone, Copy, Debug)]
pub struct Lines {
    pub count: u16,
    pub length_m: f64,
    pub spacing_m: f64,
    pub depth_m: f64,
    pub speed_mps: f64,
}

/// Ten lines of 1 km, 100 m apart.
const SURVEY: Lines = Lines { count: 10, length_m: 1000.0, spacing_m: 100.0, depth_m: 3.0, speed_mps: 1.0 };
/// The OCTANS gyrocompass: 0.05 degrees of roll and pitch, 0.10 of heading at 3 Hz.
const GYROCOMPASS: [f64; 3] = [3.0, 0.05, 0.10];
/// Its angular rates, 0.4 to 0.6 deg/s.
const GYRO_RATES: Option<f64> = Some(0.5);
const PAROSCIENTIFIC: [f64; 2] = [7.0, 0.06];

/// 3.2.1: Table 3.1.
pub const D_SURVEY: Conditions = Conditions {
    lines: SURVEY,
    ship: [600.0, 2.0],
    packets_s: [60, 30],
    slots_s: &[0],
    depth: PAROSCIENTIFIC,
    attitude: [3.0, 1.0, 1.0],
    rates_degps: None,
    law: ControlLaw::Pd,
    slow_compass: false,
    experiment_vehicle: false,
};
/// 2.6.1: Table 2.1. 2 knots, ship at 1.5 knots.
pub const K_DVL: Conditions = Conditions {
    lines: Lines { speed_mps: 1.03, ..SURVEY },
    ship: [300.0, 0.77],
    packets_s: [60, 60],
    attitude: GYROCOMPASS,
    rates_degps: GYRO_RATES,
    ..D_SURVEY
};
/// 2.6.2: Table 2.2.
pub const K_FOG: Conditions =
    Conditions { ship: [800.0, 2.0], packets_s: [10, 10], attitude: GYROCOMPASS, rates_degps: GYRO_RATES, ..D_SURVEY };
/// 2.6.2, a compass of 1 degree instead of the gyrocompass.
pub const K_COMPASS: Conditions = Conditions { attitude: [3.0, 1.0, 1.0], rates_degps: None, ..K_FOG };
/// 3.2.2: Tables 3.2 and 3.3, the downlinks of the cycle.
pub const D_SEA: Conditions = Conditions {
    lines: Lines { count: 6, length_m: 300.0, spacing_m: 50.0, depth_m: 2.5, speed_mps: 1.3 },
    ship: [200.0, 1.0],
    packets_s: [30, 30],
    slots_s: &[5, 10, 15],
    depth: [1.0, 0.1],
    attitude: [1.0, 1.0, 1.0],
    rates_degps: None,
    law: ControlLaw::Lqr,
    slow_compass: true,
    experiment_vehicle: false,
};
/// 4.3.2.2: Table 4.9, the size of the lawnmower and the ship of 3.2.1. By the PD law this vehicle, 0.3 kg light, leaves
/// the surface in three of ten seeds within the time that a dive may take; by the LQR it dives.
pub const N_NAV: Conditions = Conditions {
    attitude: GYROCOMPASS,
    rates_degps: GYRO_RATES,
    law: ControlLaw::Lqr,
    experiment_vehicle: true,
    ..D_SURVEY
};
/// 5.3: Table 5.1.
pub const C: Conditions =
    Conditions { attitude: GYROCOMPASS, rates_degps: GYRO_RATES, law: ControlLaw::LqrOnReference, ..D_SURVEY };
