//! The typed set behind the parameter list.

use backseat_core::control::ControlConfig;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::Scale;
use backseat_core::navigation::{Area, Declared, EffectStates, Learnt, NavigationConfig, ProcessModel, SurfaceNoise};
use backseat_core::parameters::{Installation, SafetyLimits};
use backseat_wire::iver::Units;
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::modem::{ClockEncoding, DopplerSign};
use backseat_wire::ship_state::Key;

/// Protocol of the AHRS port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AhrsProtocol {
    /// MicroStrain 3DM-GX3-25, single-byte protocol.
    Gx3,
    /// MicroStrain MIP.
    Mip,
    /// OceanServer OS5000 sentences.
    Os5000,
}

/// Where the DVL's velocity comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DvlSource {
    /// PD0 on the DVL port.
    Pd0,
    /// PD4 or PD5 on the DVL port.
    Pd4,
    /// PD6 on the DVL port.
    Pd6,
    /// The frontseat's `$DVL`.
    Frontseat,
}

/// Where attitude comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttitudeSource {
    /// The AHRS port.
    Ahrs,
    /// The frontseat's `$C`.
    Frontseat,
}

/// How the frontseat is commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlMode {
    /// `$OMP`: fins and motor.
    Direct,
    /// `$OMS`: heading, depth and speed.
    Helm,
}

/// What is done with what changes in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamingUse {
    /// It is not named.
    Off,
    /// It is named, and nothing follows.
    Name,
    /// The filter predicts with a cause that is sure.
    Navigate,
    /// The controller steers with it too.
    All,
}

/// Whether a manoeuvre may tell two causes apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separate {
    /// None is flown.
    Never,
    /// One that stays on the line.
    OnLegs,
    /// One that leaves it by up to 10 m as well.
    Free,
}

/// Whether hardware is fitted to a pin, and at which level it acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fitted {
    /// It is not.
    No,
    /// It acts, or is wet, while the pin is high.
    High,
    /// While it is low.
    Low,
}

impl Fitted {
    /// It is.
    #[must_use]
    pub const fn is_fitted(self) -> bool {
        !matches!(self, Self::No)
    }
}

/// Last-resort hardware.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittingSettings {
    /// Output: tells another safety system that the mission was ended.
    pub abort_line: Fitted,
    /// Output: releases a weight, or burns its wire.
    pub drop_weight: Fitted,
    /// Input.
    pub leak: Fitted,
    /// The vehicle's supply is measured.
    pub supply: bool,
    /// The supply over the voltage at the pin.
    pub supply_ratio: f64,
    /// Below it the supply is at its end, V.
    pub supply_last_v: f64,
    /// So many readings, ten a second, confirm a cause.
    pub readings: u8,
    /// Deeper than the largest depth by so much the weight falls, m.
    pub depth_margin_m: f64,
    /// The weight falls when a vehicle whose mission was ended has not come up for so long, s; 0: it does not.
    pub no_ascent_s: f64,
}

impl FittingSettings {
    /// Nothing is fitted.
    pub const NONE: Self = Self {
        abort_line: Fitted::No,
        drop_weight: Fitted::No,
        leak: Fitted::No,
        supply: false,
        supply_ratio: 11.0,
        supply_last_v: 0.0,
        readings: 20,
        depth_margin_m: 5.0,
        no_ascent_s: 60.0,
    };
}

/// Settings of the app itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AppSettings {
    /// Origin of the local frame, degrees north.
    pub origin_lat_deg: f64,
    /// Origin of the local frame, degrees east.
    pub origin_lon_deg: f64,

    /// Where the sensors sit, how they are turned and how late they are.
    pub installation: Installation,
    /// Fuse acoustic ranges.
    pub use_range: bool,
    /// Fuse acoustic ranges to other vehicles.
    pub use_peers: bool,
    /// Fuse acoustic range rates.
    pub use_range_rate: bool,
    /// Sign of the modem's Doppler.
    pub doppler_sign: DopplerSign,
    /// How the modem's firmware encodes its clock mode.
    pub clock_encoding: ClockEncoding,
    /// Largest plausible range, m.
    pub range_max_m: f64,
    /// Only packets of this modem address count.
    pub ship_address: u8,
    /// The board's own modem address.
    pub modem_address: u8,
    /// Length of the acoustic cycle, s; 0: the vehicle sends nothing.
    pub cycle_period_s: u8,
    /// Second of the cycle at which the state uplink leaves, s; 255: none.
    pub uplink_at_s: u8,
    /// Second of the cycle at which the vehicle pings the ship, s; 255: none.
    pub ping_at_s: u8,
    /// Packets count only with the authentication code of this key, if it is set. In no list: nothing reads it back.
    pub acoustic_key: Key,
    /// Data and statistics of a packet come within this time of its start, s.
    pub packet_timeout_s: f64,

    /// Fuse depth.
    pub use_depth: bool,
    /// Fuse attitude.
    pub use_attitude: bool,
    /// Fuse body rates.
    pub use_rates: bool,
    /// Fuse DVL bottom track.
    pub use_dvl: bool,
    /// Fuse DVL water track.
    pub use_water_track: bool,
    /// Fuse fixes at the surface.
    pub use_gnss: bool,
    /// One sigma per axis of a GNSS receiver's slowly varying error, the vehicle's and the ship's alike, m.
    pub receiver_bias_m: f64,
    /// Where the mission is flown: how much the water changes.
    pub water_area: Area,
    /// Probability in an hour that the error exceeds the protection level.
    pub level_probability_per_hour: f64,
    /// What is done with what changes in flight.
    pub naming: NamingUse,
    /// Whether a manoeuvre may tell two causes apart.
    pub separate: Separate,
    /// Deepest estimate at which a fix is believed, m.
    pub gnss_max_depth_m: f64,
    /// AHRS protocol.
    pub ahrs_protocol: AhrsProtocol,
    /// DVL source.
    pub dvl_source: DvlSource,
    /// Attitude source.
    pub attitude_source: AttitudeSource,
    /// Added to a magnetic heading, rad.
    pub declination_rad: f64,
    /// Direction of the DVL's beam 3 in the vehicle, forward to starboard, rad.
    pub dvl_mounting_rad: f64,
    /// Measurements that are older than the filter by more than this are dropped, s.
    pub late_tolerance_s: f64,

    /// Estimate what the declaration leaves open ([`backseat_core::navigation::Priors`]).
    pub robust: bool,
    /// Estimate the water current.
    pub current_state: bool,
    /// One sigma of the current at the start, m/s per axis.
    pub current_initial_sigma_mps: f64,
    /// √PSD of the current's random walk, m/s/√s per axis.
    pub current_random_walk_mps_per_sqrt_s: f64,

    /// Identify the vehicle's parameters under way, as long as there is a DVL that the filter fuses.
    pub adapt: bool,
    /// The parameter that is known and fixes the scale of the others.
    pub adapt_scale: Scale,

    /// `$C` per second.
    pub compass_rate_hz: f64,
    /// `$OSI` per second.
    pub status_rate_hz: f64,
    /// `$GPRMC` per second.
    pub gps_rate_hz: f64,
    /// `$OPI` per second.
    pub power_rate_hz: f64,
    /// Units of the frontseat's lengths.
    pub units: Units,
    /// `$OMP` or `$OMS`.
    pub control_mode: ControlMode,
    /// Largest pitch in `$OMS`, rad.
    pub helm_pitch_max_rad: f64,
    /// Timeout sent with every command, s.
    pub command_timeout_s: u8,
    /// From sending a command to the fins' movement, s.
    pub actuator_delay_s: f64,
    /// Calibration of the bytes of `$OMP`.
    pub servo: ServoCalibration,

    /// Attitude older than this is stale, s.
    pub attitude_timeout_s: f64,
    /// Depth older than this is stale, s.
    pub depth_timeout_s: f64,
    /// A frontseat silent for longer is lost, s.
    pub frontseat_timeout_s: f64,
    /// A frontseat that refuses commands for longer is not in backseat control, s.
    pub refusal_timeout_s: f64,
    /// Position sigma from which navigation counts as degraded, m.
    pub degraded_sigma_m: f64,
    /// Position sigma from which the position counts as lost, m.
    pub lost_sigma_m: f64,
    /// Protection level from which navigation counts as degraded, horizontally, m; 0: none.
    pub alert_horizontal_m: f64,
    /// The same in depth, m; 0: none.
    pub alert_depth_m: f64,
    /// What ends a mission though navigation is valid.
    pub safety: SafetyLimits,
    /// Last-resort hardware.
    pub fittings: FittingSettings,
}

impl AppSettings {
    /// A fresh board: reference vehicle, no DVL, `$OMP`.
    pub const DEFAULT: Self = Self {
        origin_lat_deg: 41.5,
        origin_lon_deg: -70.7,
        installation: Installation::DEFAULT,
        use_range: true,
        use_peers: false,
        use_range_rate: false,
        doppler_sign: DopplerSign::OpeningPositive,
        clock_encoding: ClockEncoding::Legacy,
        range_max_m: 5000.0,
        ship_address: 1,
        modem_address: 2,
        cycle_period_s: 0,
        uplink_at_s: 255,
        ping_at_s: 255,
        acoustic_key: Key::NONE,
        packet_timeout_s: 10.0,
        use_depth: true,
        use_attitude: true,
        use_rates: true,
        use_dvl: false,
        use_water_track: false,
        use_gnss: true,
        receiver_bias_m: 1.5,
        water_area: Declared::DEFAULT.area,
        level_probability_per_hour: Declared::DEFAULT.probability_per_hour,
        naming: NamingUse::Name,
        separate: Separate::Never,
        gnss_max_depth_m: 1.0,
        ahrs_protocol: AhrsProtocol::Gx3,
        dvl_source: DvlSource::Pd0,
        attitude_source: AttitudeSource::Ahrs,
        declination_rad: 0.0,
        dvl_mounting_rad: 0.0,
        late_tolerance_s: 1.0,
        robust: true,
        current_state: false,
        current_initial_sigma_mps: 0.2,
        current_random_walk_mps_per_sqrt_s: 1.0e-4,
        adapt: true,
        adapt_scale: Scale::M11,
        compass_rate_hz: 7.0,
        status_rate_hz: 1.0,
        gps_rate_hz: 1.0,
        power_rate_hz: 0.0,
        units: Units::remote_helm(5),
        control_mode: ControlMode::Direct,
        helm_pitch_max_rad: 0.523_598_775_598_298_8,
        command_timeout_s: 2,
        actuator_delay_s: 0.0,
        servo: ServoCalibration::NOMINAL,
        attitude_timeout_s: 2.0,
        depth_timeout_s: 2.0,
        frontseat_timeout_s: 10.0,
        refusal_timeout_s: 3.0,
        degraded_sigma_m: 30.0,
        lost_sigma_m: 300.0,
        alert_horizontal_m: 0.0,
        alert_depth_m: 0.0,
        safety: SafetyLimits::DEFAULT,
        fittings: FittingSettings::NONE,
    };
}

/// All parameters of the app.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Plant and actuators.
    pub vehicle: VehicleParameters,
    /// Filter; its effect states and sound speed come from the app's settings.
    pub navigation: NavigationConfig,
    /// What the robust filter starts from.
    pub learnt: Learnt,
    /// Controller.
    pub control: ControlConfig,
    /// The rest.
    pub app: AppSettings,
}

impl Settings {
    /// A fresh board.
    pub const DEFAULT: Self = Self {
        vehicle: VehicleParameters::IVER3,
        navigation: NavigationConfig::REFERENCE,
        learnt: Learnt::NONE,
        control: ControlConfig::REFERENCE,
        app: AppSettings::DEFAULT,
    };

    /// What the filter is built from.
    #[must_use]
    #[inline(never)] // its memory is not to stay on the stack under the filter
    pub fn navigation_config(&self) -> NavigationConfig {
        let mut config = self.navigation;
        // Each model has its own near the surface, too; the table has the dynamic model's.
        if config.process_model == ProcessModel::Kinematic && config.surface.is_some() {
            config.surface = Some(SurfaceNoise::KINEMATIC);
        }
        if self.app.robust && config.process_model == ProcessModel::Dynamic {
            config.make_robust();
        } else if self.app.current_state {
            let app = &self.app;
            config.effect_states =
                EffectStates::water_current(app.current_initial_sigma_mps, app.current_random_walk_mps_per_sqrt_s);
        }
        config.sound_speed_mps = self.app.installation.sound_speed_mps;
        config.ship_transducer_depth_m = self.app.installation.ship_transducer_depth_m;
        config
    }
}
