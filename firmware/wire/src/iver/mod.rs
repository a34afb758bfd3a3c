//! OceanServer / L3 Iver frontseat, "Remote Helm" backseat interface.
//!
//! No vendor manual is public; the layout follows working drivers (GobySoft goby3 `iver_driver`, USYD acfr-lcm,
//! IVER3-3013 scripts). Unknowns are parameters: [`Units`] and [`servo::ServoCalibration`].

mod emit;
mod parse;
pub mod servo;

pub use servo::ServoBytes;

use crate::gps::{Gga, Rmc};

/// Unit of a depth or height on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// International feet.
    Feet,
    /// Metres.
    Metres,
}

/// What the frontseat's version makes of its lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Units {
    /// Depth in `$OMS`.
    pub command_depth: LengthUnit,
    /// Depth from surface in `$OSI`, field 15.
    pub status_depth: LengthUnit,
    /// Altimeter in `$OSI`, field 9.
    pub status_altitude: LengthUnit,
    /// Depth `D` in `$C`.
    pub compass_depth: LengthUnit,
}

impl Units {
    /// By major version of Remote Helm: feet before 5, metres from 5.
    ///
    /// Only `$OMS` is known to change; the two of `$OSI` are taken to change with it (check on the bench), `$C` stays
    /// in feet.
    pub const fn remote_helm(major: u8) -> Self {
        let unit = if major < 5 { LengthUnit::Feet } else { LengthUnit::Metres };
        Self { command_depth: unit, status_depth: unit, status_altitude: unit, compass_depth: LengthUnit::Feet }
    }
}

/// What the frontseat sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromFrontseat<'a> {
    /// `$C`: compass.
    Compass(Compass),
    /// `$OSI`: state of the vehicle.
    State(State<'a>),
    /// `$OPI`: power.
    Power(Power),
    /// `$DVL`: the frontseat's own DVL.
    Dvl(FrontseatDvl),
    /// `$ACK`: answer to a command.
    Acknowledge(Acknowledge),
    /// `$GPRMC`, passed through.
    Rmc(Rmc),
    /// `$GPGGA`, passed through.
    Gga(Gga),
}

/// What the backseat sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToFrontseat<'a> {
    /// `$OSD`: ask for sentences.
    Request(Request),
    /// `$OMS`: heading, depth and speed.
    Steer(Steer),
    /// `$OMP`: fins and motor directly.
    Servo(Servo),
    /// `$OMSTART`: start a stored mission.
    Start(Start<'a>),
    /// `$OMSTOP,0`: abort.
    Stop,
    /// `$OJW`: jump to a waypoint, 0 to 999.
    Jump {
        /// Its number.
        waypoint: u16,
    },
    /// `$OPOS`: position aiding.
    Position(PositionAid),
    /// `$ODVL`: velocity aiding.
    Velocity(VelocityAid),
}

/// `$C<heading>P<pitch>R<roll>T<temperature>D<depth>`: the OS5000 through the frontseat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compass {
    /// Heading (magnetic or true as the compass is set up), [0, 2π), rad.
    pub heading_rad: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Temperature, °C.
    pub temperature_degc: Option<f64>,
    /// Depth, m.
    pub depth_m: Option<f64>,
}

/// Mode of the frontseat (`$OSI` 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrontseatMode {
    /// `N`.
    Normal = 1, // an Option's None is zero
    /// `S`.
    Stopped,
    /// `P`: the frontseat keeps control.
    Parking,
    /// `M`.
    ManualOverride,
    /// `mP`, `m`, older `Mp`.
    ManualParking,
    /// `A`: servo mode, the backseat steers.
    Servo,
    /// `W`.
    Mission,
}

impl FrontseatMode {
    /// Whether it takes commands of a backseat (goby3's state mapping).
    pub const fn accepts_commands(self) -> bool {
        !matches!(self, Self::Stopped | Self::Parking)
    }
}

/// Error code of the frontseat (`$OSI` 8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrontseatError {
    /// `N`.
    None,
    /// `Sop`.
    OverPitch,
    /// `Stl`.
    TimeLimit,
    /// `Sle`.
    Leak,
    /// `Sfp`.
    NoForwardProgress,
    /// `Sed`.
    DepthExceeded,
    /// `Sup`.
    NoUpwardProgress,
    /// `Stf`.
    TowFloat,
    /// `Srp`.
    SafetyReturn,
    /// `Snd`.
    DepthSensorStuck,
    /// `Snc`.
    CompassStopped,
    /// `Spw`.
    MinimumPower,
    /// `Sti`.
    StopAndTransmit,
    /// Any other code.
    Other,
}

/// `$OSI`. Fields from 16 on changed between versions and are not read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<'a> {
    /// Echo of fins and motor.
    pub servo: ServoBytes,
    /// Mode.
    pub mode: FrontseatMode,
    /// Next waypoint.
    pub next_waypoint: u16,
    /// Latitude and longitude, degrees, north and east positive.
    pub position_deg: [f64; 2],
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Distance to the next waypoint, m.
    pub distance_to_next_m: f64,
    /// Error code.
    pub error: FrontseatError,
    /// Altimeter, m.
    pub altitude_m: Option<f64>,
    /// Park time, s.
    pub park_time_s: Option<u32>,
    /// Magnetic declination, rad, east positive.
    pub declination_rad: Option<f64>,
    /// Mission name.
    pub mission: &'a str,
    /// Remaining mission time as the frontseat words it.
    pub remaining_time: &'a str,
    /// True heading, rad.
    pub heading_rad: f64,
    /// Corrected depth from surface, m.
    pub depth_m: f64,
}

/// `$OPI`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Charge, 0 to 100.
    pub percent: f64,
    /// Energy left, Wh.
    pub remaining_wh: f64,
    /// Power drawn, W.
    pub power_w: f64,
    /// Voltage, V.
    pub voltage_v: f64,
    /// Current, A, positive while charging.
    pub current_a: f64,
    /// Minutes to full or empty.
    pub minutes: u32,
    /// Charging, full or discharging.
    pub battery: Battery,
    /// Leak detector.
    pub leak: bool,
}

/// Battery state (`$OPI` 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Battery {
    /// `C`.
    Charging,
    /// `F`.
    Full,
    /// `D`.
    Discharging,
}

/// `$DVL`. Values of -3200 and below are invalid. Axes and reference of the velocity are not public: check on the
/// bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontseatDvl {
    /// x, y, z as sent, m/s.
    pub velocity_mps: Option<[f64; 3]>,
    /// Distance made good x, y, m.
    pub distance_m: [Option<f64>; 2],
    /// Depth from surface, m.
    pub depth_m: Option<f64>,
    /// Altitude, m.
    pub altitude_m: Option<f64>,
}

/// `$ACK`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acknowledge {
    /// Number of the command type, see the constants.
    pub command: u8,
    /// Status 0.
    pub accepted: bool,
    /// Error number; [`Self::SAFETY_RULE`] is the one a mission must know.
    pub error: u8,
}

impl Acknowledge {
    /// `$OMSTOP`.
    pub const STOP: u8 = 1;
    /// `$OMSTART`.
    pub const START: u8 = 3;
    /// `$OPOS`.
    pub const POSITION: u8 = 6;
    /// `$OJW`.
    pub const JUMP: u8 = 7;
    /// `$OSD`.
    pub const REQUEST: u8 = 8;
    /// `$OMS`.
    pub const STEER: u8 = 9;
    /// `$OMP`.
    pub const SERVO: u8 = 10;
    /// `$ODVL`.
    pub const VELOCITY: u8 = 15;
    /// Error: a safety rule is engaged and the command was not processed.
    pub const SAFETY_RULE: u8 = 26;
    /// Error: the vehicle must be running.
    pub const NOT_RUNNING: u8 = 45;

    /// Error for a malformed sentence of a command type, 0 where there is none.
    pub const fn malformed(command: u8) -> u8 {
        match command {
            Self::STOP => 28,
            Self::START => 30,
            Self::POSITION => 18,
            Self::JUMP => 19,
            Self::REQUEST => 27,
            Self::STEER => 20,
            Self::SERVO => 21,
            Self::VELOCITY => 35,
            _ => 0,
        }
    }
}

/// `$OSD`: which sentences the frontseat shall send once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// `G`: `$GPRMC`.
    pub gps: bool,
    /// `C`: `$C`.
    pub compass: bool,
    /// `S`: `$OSI`.
    pub state: bool,
    /// `P`: `$OPI`.
    pub power: bool,
    /// `Y`: the YSI sonde.
    pub sonde: bool,
    /// `D`: `$DVL`.
    pub dvl: bool,
    /// `T`: meaning not public.
    pub t: bool,
    /// `I`: meaning not public.
    pub i: bool,
}

/// `$OMS`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steer {
    /// True heading, rad; written in [0, 360) degrees to 0.1.
    pub heading_rad: f64,
    /// Depth, m, not negative.
    pub depth_m: f64,
    /// Largest pitch, rad.
    pub max_pitch_rad: f64,
    /// Speed, m/s, not negative; written in knots to 0.1.
    pub speed_mps: f64,
    /// The frontseat drops the command after this, s, at most 120.
    pub timeout_s: u8,
}

/// `$OMP`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Servo {
    /// Fins and motor.
    pub servo: ServoBytes,
    /// The frontseat drops the command after this, s, at most 120.
    pub timeout_s: u8,
}

/// `$OMSTART`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start<'a> {
    /// Start without GPS.
    pub ignore_gps: bool,
    /// Start without sounder.
    pub ignore_sounder: bool,
    /// Start without pressure.
    pub ignore_pressure: bool,
    /// Safety-return instead of normal mission.
    pub safety_return: bool,
    /// Mission file.
    pub mission: &'a str,
    /// Safety-return path file.
    pub return_path: Option<&'a str>,
}

/// `$OPOS`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionAid {
    /// Latitude and longitude, degrees, north and east positive.
    pub position_deg: [f64; 2],
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Conductivity, mS/cm.
    pub conductivity_ms_per_cm: Option<f64>,
    /// Temperature, °C.
    pub temperature_degc: Option<f64>,
}

/// `$ODVL`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityAid {
    /// x, y as `$DVL` has them, m/s.
    pub velocity_mps: [f64; 2],
    /// Valid for, s.
    pub timeout_s: u8,
}
