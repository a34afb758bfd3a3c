//! How effects enter the models.

use crate::dynamics::{ActuatorInput, FINS, VehicleParameters};
use nalgebra::{Vector3, Vector6};

/// Changes plant parameters at a time, s since the epoch.
pub type PlantHook = fn(values: &[f64], t_s: f64, plant: &mut VehicleParameters);
/// ∂(applied wrench)/∂(parameter `index`), N and N m per unit.
pub type WrenchHook = fn(index: usize, at: &Motion<'_>) -> Vector6<f64>;
/// Turns commands into what actuators do.
pub type InputHook = fn(values: &[f64], step: &Step, memory: &mut ActuatorMemory, input: &mut ActuatorInput);
/// ∂(fin angles)/∂(parameter `index`) over the step just taken, rad per unit.
pub type FinsHook = fn(index: usize, memory: &ActuatorMemory) -> [f64; FINS];
/// Velocity of the water [north, east], m/s.
pub type WaterHook = fn(values: &[f64]) -> [f64; 2];
/// Variance added to each scalar of a channel.
pub type VarianceHook = fn(values: &[f64], channel: SensorChannel) -> f64;
/// Gate on a channel, sigmas.
pub type GateHook = fn(values: &[f64], channel: SensorChannel) -> Option<f64>;

/// The functions of an entry; those that it does not need are absent, which is the identity. The values passed are
/// those of the entry's parameters, in their order.
#[derive(Clone, Copy, Debug)]
pub struct Hooks {
    /// Changes the plant's parameters at time `t_s`; between times of the kinds
    /// [`ParameterKind::Onset`](super::ParameterKind::Onset) and [`ParameterKind::End`](super::ParameterKind::End) it
    /// does not depend on time.
    pub plant: Option<PlantHook>,
    /// ∂(applied wrench)/∂(parameter), N and N m per unit of the parameter `index`, of an entry with `plant` that may
    /// be a state of the filter.
    pub wrench_by: Option<WrenchHook>,
    /// Turns what was commanded into what the actuators did over a step.
    pub input: Option<InputHook>,
    /// ∂(fin angles over the step)/∂(parameter), rad per unit of the parameter `index`, of an entry with `input` that
    /// may be a state of the filter.
    pub fins_by: Option<FinsHook>,
    /// Velocity of the water over ground [north, east], m/s: linear in the values.
    pub water: Option<WaterHook>,
    /// Changes what sensors read.
    pub measure: Option<Measure>,
    /// Variance that the effect adds to each scalar of a channel, in the channel's unit squared.
    pub variance: Option<VarianceHook>,
    /// Narrowest gate that the effect calls for on a channel, sigmas.
    pub gate_sigma: Option<GateHook>,
}

impl Hooks {
    /// Nothing.
    pub const NONE: Self = Self {
        plant: None,
        wrench_by: None,
        input: None,
        fins_by: None,
        water: None,
        measure: None,
        variance: None,
        gate_sigma: None,
    };

    /// Whether parameters of the entry that are states change the acceleration.
    #[must_use]
    pub const fn accelerates(&self) -> bool {
        self.wrench_by.is_some() || self.fins_by.is_some()
    }

    /// Whether the filter can hold the entry's parameters as states.
    #[must_use]
    pub const fn may_be_state(&self) -> bool {
        self.water.is_some() || self.measure.is_some() || self.accelerates()
    }
}

/// What the vehicle does at one instant, as the derivatives of its wrench need it.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// Body velocity through the water, m/s and rad/s.
    pub velocity: &'a Vector6<f64>,
    /// s = Rᵀ e3.
    pub down: &'a Vector3<f64>,
    /// What the actuators do.
    pub input: &'a ActuatorInput,
    /// The plant, effects included.
    pub plant: &'a VehicleParameters,
}

/// One step of the process model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Its start, s since the epoch.
    pub t_s: f64,
    /// Its length, s.
    pub h_s: f64,
}

/// What actuators remember between steps: the fins' true angles, rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorMemory {
    /// Where the fins were at the end of the last step, rad; `None` before the first.
    pub fins_rad: Option<[f64; FINS]>,
    /// ∂(fins_rad)/∂(lag), rad/s.
    pub fins_by_lag: [f64; FINS],
    /// The same of the mean angle over the last step.
    pub mean_by_lag: [f64; FINS],
}

/// What is measured together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorChannel {
    /// Depth, m.
    Depth,
    /// Roll, pitch, heading, rad.
    Attitude,
    /// p, q, r, rad/s.
    Rates,
    /// DVL velocity, bottom or water track, m/s in body axes.
    Dvl,
    /// One-way range, m.
    Range,
    /// Range rate, m/s.
    RangeRate,
    /// Range of a two-way ping, m: no clock is shared.
    TwoWayRange,
    /// GNSS of vehicle or ship, m.
    Gnss,
    /// What a USBL measured, m: along the measured direction, across it in the horizontal, across it downwards.
    Usbl,
}

impl SensorChannel {
    /// All, in the order of their discriminants.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Depth,
        Self::Attitude,
        Self::Rates,
        Self::Dvl,
        Self::Range,
        Self::RangeRate,
        Self::TwoWayRange,
        Self::Gnss,
        Self::Usbl,
    ];
    /// How many.
    pub const COUNT: usize = 9;
}

/// When a measurement is taken, and what it is scaled by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// s since the epoch.
    pub t_s: f64,
    /// Sound speed by which travel times became ranges, m/s.
    pub sound_speed_mps: f64,
}

/// How an effect changes what sensors read.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// The channels it acts on.
    pub channels: &'static [SensorChannel],
    /// Changes a reading (unused components are zero) and says how.
    pub apply: fn(values: &[f64], moment: &Moment, reading: &mut [f64; 3]) -> Slopes,
}

/// Derivatives of a reading that an effect changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    /// ∂(after)/∂(before): `by_reading[i][j]`, i after, j before.
    pub by_reading: [[f64; 3]; 3],
    /// ∂(after)/∂(parameter k): `by_parameter[k]`.
    pub by_parameter: [[f64; 3]; 3],
}

impl Slopes {
    /// Nothing changes.
    pub const IDENTITY: Self = Self { by_reading: diagonal([1.0; 3]), by_parameter: [[0.0; 3]; 3] };

    /// Of a shift: only the parameters' columns.
    pub(super) const fn shift(by_parameter: [[f64; 3]; 3]) -> Self {
        Self { by_parameter, ..Self::IDENTITY }
    }
}

/// A diagonal matrix.
pub(super) const fn diagonal([a, b, c]: [f64; 3]) -> [[f64; 3]; 3] {
    [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]
}
