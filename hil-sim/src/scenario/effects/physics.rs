//! What the effects change in the simulated world.

use crate::scenario::{Current, Installation};
use crate::truth::{Parameters, Shift, Undeclared};

/// Waves by their orbital motion at the vehicle's depth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Waves {
    /// Amplitude of the orbital velocity, m/s.
    pub amplitude_mps: f64,
    /// Period, s.
    pub period_s: f64,
}

/// Compass errors, rad: the sum of the harmonics of the true heading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compass {
    /// Constant part.
    pub constant: f64,
    /// Amplitudes of sin ψ and cos ψ (hard iron).
    pub first: [f64; 2],
    /// Amplitudes of sin 2ψ and cos 2ψ (soft iron).
    pub second: [f64; 2],
    /// First-order lag of the heading, s.
    pub lag_s: f64,
    /// Error by the square of the propeller's speed, rad per (rad/s)².
    pub motor_s2: f64,
    /// Constant that something near it adds for a while.
    pub change: Shift,
}

/// Errors of the vehicle's instruments, measured minus true.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instruments {
    /// Heading.
    pub compass: Compass,
    /// Pitch: bias, rad, and scale, measured / true − 1.
    pub pitch: [f64; 2],
    /// Bias of pitch for a while, rad.
    pub pitch_change: Shift,
    /// Body rates, rad/s.
    pub gyro_radps: [f64; 3],
    /// Depth, m.
    pub depth_m: f64,
    /// Depth, measured / true − 1.
    pub depth_ratio: f64,
    /// DVL scale, measured / true − 1.
    pub dvl_ratio: f64,
    /// Yaw and pitch of the DVL in the vehicle, rad.
    pub dvl_mounting_rad: [f64; 2],
    /// Its scale and its yaw for a while.
    pub dvl_change: [Shift; 2],
    /// Where the DVL is minus where it is declared to be (the centre of gravity), m.
    pub dvl_lever_m: [f64; 3],
}

/// Errors of acoustic ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AcousticChannel {
    /// True travel times are (1 + ratio) of what the declared sound speed gives.
    pub sound_speed_ratio: f64,
    /// Receiver's clock minus true time at time zero, s.
    pub clock_offset_s: f64,
    /// Rate error of the receiver's clock.
    pub clock_drift: f64,
    /// What its clock shows more for a while, s.
    pub clock_change: Shift,
    /// Ranges are longer than the distance by this times its square, 1/m.
    pub bending_per_m: f64,
    /// Share of ranges that are no ranges.
    pub outlier_share: f64,
    /// Bearings of the ship's USBL, measured minus true, rad.
    pub usbl_turn_rad: f64,
    /// A transponder, from 1, whose true place is not the declared one.
    pub misplaced: usize,
    /// By how much, true minus declared, north and east, m.
    pub misplaced_m: [f64; 2],
}

/// The simulated world as the effects leave it.
#[derive(Clone, Debug, PartialEq)]
pub struct Physics {
    /// The vehicle.
    pub vehicle: Parameters,
    /// What no vehicle file can declare.
    pub undeclared: Undeclared,
    /// Currents; they add up.
    pub currents: Vec<Current>,
    /// Waves, if any.
    pub waves: Option<Waves>,
    /// The vehicle's instruments.
    pub instruments: Instruments,
    /// Where the sensors really sit, and how late they are.
    pub installation: Installation,
    /// Acoustics.
    pub channel: AcousticChannel,
}
