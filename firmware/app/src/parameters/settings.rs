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

backseat_core::with_defaults! {
    /// Last-resort hardware.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct FittingSettings;
    /// Nothing is fitted.
    const NONE {
        /// Output: tells another safety system that the mission was ended.
        abort_line: Fitted = Fitted::No,
        /// Output: releases a weight, or burns its wire.
        drop_weight: Fitted = Fitted::No,
        /// Input.
        leak: Fitted = Fitted::No,
        /// The vehicle's supply is measured.
        supply: bool = false,
        /// The supply over the voltage at the pin.
        supply_ratio: f64 = 11.0,
        /// Below it the supply is at its end, V.
        supply_last_v: f64 = 0.0,
        /// So many readings, ten a second, confirm a cause.
        readings: u8 = 20,
        /// Deeper than the largest depth by so much the weight falls, m.
        depth_margin_m: f64 = 5.0,
        /// The weight falls when a vehicle whose mission was ended has not come up for so long, s; 0: it does not.
        no_ascent_s: f64 = 60.0,
    }
}

backseat_core::with_defaults! {
    /// Settings of the app itself.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AppSettings;
    /// A fresh board: reference vehicle, no DVL, `$OMP`.
    const DEFAULT {
        /// Origin of the local frame, degrees north.
        origin_lat_deg: f64 = 41.5,
        /// Origin of the local frame, degrees east.
        origin_lon_deg: f64 = -70.7,

        /// Where the sensors sit, how they are turned and how late they are.
        installation: Installation = Installation::DEFAULT,
        /// Fuse acoustic ranges.
        use_range: bool = true,
        /// Fuse acoustic ranges to other vehicles.
        use_peers: bool = false,
        /// Fuse acoustic range rates.
        use_range_rate: bool = false,
        /// Sign of the modem's Doppler.
        doppler_sign: DopplerSign = DopplerSign::OpeningPositive,
        /// How the modem's firmware encodes its clock mode.
        clock_encoding: ClockEncoding = ClockEncoding::Legacy,
        /// Largest plausible range, m.
        range_max_m: f64 = 5000.0,
        /// Only packets of this modem address count.
        ship_address: u8 = 1,
        /// The board's own modem address.
        modem_address: u8 = 2,
        /// Length of the acoustic cycle, s; 0: the vehicle sends nothing.
        cycle_period_s: u8 = 0,
        /// Second of the cycle at which the state uplink leaves, s; 255: none.
        uplink_at_s: u8 = 255,
        /// Second of the cycle at which the vehicle pings the ship, s; 255: none.
        ping_at_s: u8 = 255,
        /// Packets count only with the authentication code of this key, if it is set. In no list: nothing reads it.
        acoustic_key: Key = Key::NONE,
        /// Data and statistics of a packet come within this time of its start, s.
        packet_timeout_s: f64 = 10.0,

        /// Fuse depth.
        use_depth: bool = true,
        /// Fuse attitude.
        use_attitude: bool = true,
        /// Fuse body rates.
        use_rates: bool = true,
        /// Fuse DVL bottom track.
        use_dvl: bool = false,
        /// Fuse DVL water track.
        use_water_track: bool = false,
        /// Fuse fixes at the surface.
        use_gnss: bool = true,
        /// One sigma per axis of a GNSS receiver's slowly varying error, the vehicle's and the ship's alike, m.
        receiver_bias_m: f64 = 1.5,
        /// Where the mission is flown: how much the water changes.
        water_area: Area = Declared::DEFAULT.area,
        /// Probability in an hour that the error exceeds the protection level.
        level_probability_per_hour: f64 = Declared::DEFAULT.probability_per_hour,
        /// What is done with what changes in flight.
        naming: NamingUse = NamingUse::Name,
        /// Whether a manoeuvre may tell two causes apart.
        separate: Separate = Separate::Never,
        /// The mission wants the board's own log.
        log_required: bool = true,
        /// Deepest estimate at which a fix is believed, m.
        gnss_max_depth_m: f64 = 1.0,
        /// AHRS protocol.
        ahrs_protocol: AhrsProtocol = AhrsProtocol::Gx3,
        /// DVL source.
        dvl_source: DvlSource = DvlSource::Pd0,
        /// Attitude source.
        attitude_source: AttitudeSource = AttitudeSource::Ahrs,
        /// Added to a magnetic heading, rad.
        declination_rad: f64 = 0.0,
        /// Direction of the DVL's beam 3 in the vehicle, forward to starboard, rad.
        dvl_mounting_rad: f64 = 0.0,
        /// Measurements that are older than the filter by more than this are dropped, s.
        late_tolerance_s: f64 = 1.0,

        /// Estimate what the declaration leaves open ([`backseat_core::navigation::Priors`]).
        robust: bool = true,
        /// Estimate the water current.
        current_state: bool = false,
        /// One sigma of the current at the start, m/s per axis.
        current_initial_sigma_mps: f64 = 0.2,
        /// √PSD of the current's random walk, m/s/√s per axis.
        current_random_walk_mps_per_sqrt_s: f64 = 1.0e-4,

        /// Identify the vehicle's parameters under way, as long as there is a DVL that the filter fuses.
        adapt: bool = true,
        /// The parameter that is known and fixes the scale of the others.
        adapt_scale: Scale = Scale::M11,

        /// `$C` per second.
        compass_rate_hz: f64 = 7.0,
        /// `$OSI` per second.
        status_rate_hz: f64 = 1.0,
        /// `$GPRMC` per second.
        gps_rate_hz: f64 = 1.0,
        /// `$OPI` per second.
        power_rate_hz: f64 = 0.0,
        /// Units of the frontseat's lengths.
        units: Units = Units::remote_helm(5),
        /// `$OMP` or `$OMS`.
        control_mode: ControlMode = ControlMode::Direct,
        /// Largest pitch in `$OMS`, rad.
        helm_pitch_max_rad: f64 = 0.523_598_775_598_298_8,
        /// Timeout sent with every command, s.
        command_timeout_s: u8 = 2,
        /// From sending a command to the fins' movement, s.
        actuator_delay_s: f64 = 0.0,
        /// Calibration of the bytes of `$OMP`.
        servo: ServoCalibration = ServoCalibration::NOMINAL,

        /// Attitude older than this is stale, s.
        attitude_timeout_s: f64 = 2.0,
        /// Depth older than this is stale, s.
        depth_timeout_s: f64 = 2.0,
        /// A frontseat silent for longer is lost, s.
        frontseat_timeout_s: f64 = 10.0,
        /// A frontseat that refuses commands for longer is not in backseat control, s.
        refusal_timeout_s: f64 = 3.0,
        /// Position sigma from which navigation counts as degraded, m.
        degraded_sigma_m: f64 = 30.0,
        /// Position sigma from which the position counts as lost, m.
        lost_sigma_m: f64 = 300.0,
        /// Protection level from which navigation counts as degraded, horizontally, m; 0: none.
        alert_horizontal_m: f64 = 0.0,
        /// The same in depth, m; 0: none.
        alert_depth_m: f64 = 0.0,
        /// What ends a mission though navigation is valid.
        safety: SafetyLimits = SafetyLimits::DEFAULT,
        /// Last-resort hardware.
        fittings: FittingSettings = FittingSettings::NONE,
    }
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
