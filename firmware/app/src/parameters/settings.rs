//! The typed set behind the parameter list.

use backseat_core::control::ControlConfig;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::Scale;
use backseat_core::navigation::{Area, Declared, EffectStates, Learnt, NavigationConfig, ProcessModel, SurfaceNoise};
use backseat_core::parameters::{Installation, SafetyLimits};
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::iver::{LengthUnit, Units};
use backseat_wire::modem::{ClockEncoding, DopplerSign};
use backseat_wire::ship_state::Key;
use core::f64::consts::PI;

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

/// Whether the host may steer instead of the legs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HelmUse {
    /// It is refused.
    Never,
    /// While a leg is flown and navigation is nominal.
    UnderWay,
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

backseat_core::declared! {
    /// Settings of the app itself.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AppSettings;
    /// A fresh board: reference vehicle, no DVL, `$OMP`.
    const DEFAULT, with {
        /// Where the sensors sit, how they are turned and how late they are.
        installation: Installation = Installation::DEFAULT,
        /// Packets count only with the authentication code of this key, if it is set. In no list: nothing reads it.
        acoustic_key: Key = Key::NONE,
        /// Units of the frontseat's lengths.
        units: Units = Units::remote_helm(5),
        /// Calibration of the bytes of `$OMP`.
        servo: ServoCalibration = ServoCalibration::NOMINAL,
        /// What ends a mission though navigation is valid.
        safety: SafetyLimits = SafetyLimits::DEFAULT,
        /// Last-resort hardware.
        fittings: FittingSettings = FittingSettings::NONE,
    };
    /// Rows of the table of parameters.
    const ROWS {
        // filter
        [flag "app.robust"] "Estimate what the declaration leaves open (section prior); otherwise the vehicle is taken as declared." robust: bool = true,
        [flag "app.current_state"] "Estimate a horizontal water current as two states of the filter, if it is not robust." current_state: bool = false,
        [real "app.current_initial_sigma_mps", "", "m/s", [0.001, 5.0]] "Standard deviation of the current at the start, per axis." current_initial_sigma_mps: f64 = 0.2,
        [real "app.current_random_walk_mps_per_sqrt_s", "", "m/s/sqrt(s)", [0.0, 0.1]] "Random walk of the current, per axis." current_random_walk_mps_per_sqrt_s: f64 = 1.0e-4,
        [live real "app.late_tolerance_s", "", "s", [0.0, 5.0]] "A measurement that is older than the filter by more than this is dropped; a younger one is fused late." late_tolerance_s: f64 = 1.0,
        // local frame and acoustics
        [real "app.origin_lat_deg", "", "deg", [-85.0, 85.0]] "Latitude of the origin of the local frame, north positive." origin_lat_deg: f64 = 41.5,
        [real "app.origin_lon_deg", "", "deg", [-180.0, 180.0]] "Longitude of the origin of the local frame, east positive." origin_lon_deg: f64 = -70.7,
        [flag "app.use_range"] "Fuse acoustic ranges." use_range: bool = true,
        [flag "app.use_peers"] "Fuse acoustic ranges to other vehicles, by their own packets." use_peers: bool = false,
        [flag "app.use_range_rate"] "Fuse acoustic range rates." use_range_rate: bool = false,
        [choice "app.doppler_sign"] "Sign of the modem's Doppler: 0 positive when the range opens, 1 positive when it closes." doppler_sign: DopplerSign = DopplerSign::OpeningPositive; [DopplerSign::OpeningPositive, DopplerSign::ClosingPositive],
        [choice "app.clock_encoding"] "Clock mode of the modem: 0 legacy, 1 bit field (firmware 2.0.26038 and later)." clock_encoding: ClockEncoding = ClockEncoding::Legacy; [ClockEncoding::Legacy, ClockEncoding::BitField],
        [live real "app.range_max_m", "", "m", [10.0, 20000.0]] "A longer acoustic range is refused." range_max_m: f64 = 5000.0,
        [whole "app.ship_address", "", "1", [0.0, 255.0]] "Modem address of the ship." ship_address: u8 = 1,
        [whole "app.modem_address", "", "1", [0.0, 255.0]] "Modem address of the vehicle." modem_address: u8 = 2,
        [live real "app.packet_timeout_s", "", "s", [1.0, 60.0]] "A packet is given up if its data and statistics have not come within this time of its start." packet_timeout_s: f64 = 10.0,
        [whole "app.cycle_period_s", "", "s", [0.0, 255.0]] "Length of the acoustic cycle, which starts at whole multiples of it since 1970; 0: the vehicle sends nothing." cycle_period_s: u8 = 0,
        [whole "app.uplink_at_s", "", "s", [0.0, 255.0]] "Second of the cycle at which the vehicle's state leaves; 255: none." uplink_at_s: u8 = 255,
        [whole "app.ping_at_s", "", "s", [0.0, 255.0]] "Second of the cycle at which the vehicle pings the ship; 255: none." ping_at_s: u8 = 255,
        // sensors
        [flag "app.use_depth"] "Fuse the depth of the pressure sensor." use_depth: bool = true,
        [flag "app.use_attitude"] "Fuse attitude." use_attitude: bool = true,
        [flag "app.use_rates"] "Fuse body rates." use_rates: bool = true,
        [flag "app.use_dvl"] "Fuse DVL bottom track." use_dvl: bool = false,
        [flag "app.use_water_track"] "Fuse DVL water track." use_water_track: bool = false,
        [flag "app.use_gnss"] "Fuse GNSS fixes at the surface." use_gnss: bool = true,
        [real "app.receiver_bias_m", "sigma_b", "m", [0.0, 100.0]] "Slowly varying error of a GNSS receiver per axis, the vehicle's and the ship's alike: part of the sigma of the position that the board states, never of the filter's. The vehicle's counts times the HDOP of $GPGGA, where that is more than 1." receiver_bias_m: f64 = 1.5,
        [choice "app.water_area"] "Where the mission is flown, which says how much the current may change: 0 lake, 1 open coast, 2 strait or estuary. Part of the protection level, never of the filter." water_area: Area = Declared::DEFAULT.area; [Area::Lake, Area::Coast, Area::Strait],
        [real "app.level_probability_per_hour", "", "1/h", [1.0e-9, 0.1]] "Probability in an hour that the error exceeds the protection level." level_probability_per_hour: f64 = Declared::DEFAULT.probability_per_hour,
        [choice "app.naming"] "What changes in flight: 0 is not named; 1 is named, and nothing follows; 2 the filter predicts with a cause that is sure; 3 the controller steers with it too." naming: NamingUse = NamingUse::Name; [NamingUse::Off, NamingUse::Name, NamingUse::Navigate, NamingUse::All],
        [choice "app.separate"] "Manoeuvres that tell two causes apart which stay open: 0 none, 1 those that stay on the line, 2 also one that leaves it by up to 10 m." separate: Separate = Separate::Never; [Separate::Never, Separate::OnLegs, Separate::Free],
        [choice "app.helm"] "Whether a host may hold heading, depth and speed instead of the leg, for two seconds at a time: 0 never, 1 under way." helm: HelmUse = HelmUse::Never; [HelmUse::Never, HelmUse::UnderWay],
        [live flag "app.log_required"] "The mission is not to begin without the board's own log: `backseat check` says NO GO where no card is written." log_required: bool = true,
        [live real "app.gnss_max_depth_m", "", "m", [0.0, 10.0]] "A fix is fused only if the estimated depth is at most this." gnss_max_depth_m: f64 = 1.0,
        [choice "app.ahrs_protocol"] "Protocol of the AHRS port: 0 MicroStrain 3DM-GX3, 1 MicroStrain MIP, 2 OceanServer OS5000." ahrs_protocol: AhrsProtocol = AhrsProtocol::Gx3; [AhrsProtocol::Gx3, AhrsProtocol::Mip, AhrsProtocol::Os5000],
        [choice "app.dvl_source"] "Source of DVL velocities: on the DVL port 0 PD0, 1 PD4 or PD5, 2 PD6; 3 the frontseat's $DVL." dvl_source: DvlSource = DvlSource::Pd0; [DvlSource::Pd0, DvlSource::Pd4, DvlSource::Pd6, DvlSource::Frontseat],
        [choice "app.attitude_source"] "Source of attitude: 0 AHRS port, 1 the frontseat's $C." attitude_source: AttitudeSource = AttitudeSource::Ahrs; [AttitudeSource::Ahrs, AttitudeSource::Frontseat],
        [real "app.declination_rad", "", "rad", [-PI, PI]] "Magnetic declination, added to the heading as received; east positive." declination_rad: f64 = 0.0,
        [real "app.dvl_mounting_rad", "", "rad", [-PI, PI]] "Direction of the DVL's beam 3, from forward to starboard; only for velocities in instrument axes." dvl_mounting_rad: f64 = 0.0,
        // adaptation
        [live flag "app.adapt"] "Identify the vehicle under way, while the filter fuses a DVL." adapt: bool = true,
        [choice "app.adapt_scale"] "Parameter taken as known, which fixes the scale of the others: 0 inertia.m_diag[0], 1 propeller.beta5_n_s2_per_rad2." adapt_scale: Scale = Scale::M11; [Scale::M11, Scale::Beta5],
        // frontseat
        [live real "app.compass_rate_hz", "", "Hz", [0.0, 10.0]] "Requests of compass and depth ($C) per second." compass_rate_hz: f64 = 7.0,
        [live real "app.status_rate_hz", "", "Hz", [0.0, 10.0]] "Requests of the vehicle's state ($OSI) per second." status_rate_hz: f64 = 1.0,
        [live real "app.gps_rate_hz", "", "Hz", [0.0, 10.0]] "Requests of a fix ($GPRMC) per second." gps_rate_hz: f64 = 1.0,
        [live real "app.power_rate_hz", "", "Hz", [0.0, 1.0]] "Requests of charge and leak ($OPI) per second; 0: only the error of $OSI says them." power_rate_hz: f64 = 0.0,
        [choice "app.command_depth_unit"] "Unit of the depth in $OMS: 0 metres, 1 feet." (units.command_depth, [LengthUnit::Metres, LengthUnit::Feet]),
        [choice "app.status_depth_unit"] "Unit of the depth in field 15 of $OSI: 0 metres, 1 feet." (units.status_depth, [LengthUnit::Metres, LengthUnit::Feet]),
        [choice "app.status_altitude_unit"] "Unit of the altitude in field 9 of $OSI: 0 metres, 1 feet." (units.status_altitude, [LengthUnit::Metres, LengthUnit::Feet]),
        [choice "app.compass_depth_unit"] "Unit of the depth in $C: 0 metres, 1 feet." (units.compass_depth, [LengthUnit::Metres, LengthUnit::Feet]),
        [choice "app.control_mode"] "What is commanded: 0 fins and motor ($OMP), 1 heading, depth and speed ($OMS)." control_mode: ControlMode = ControlMode::Direct; [ControlMode::Direct, ControlMode::Helm],
        [real "app.helm_pitch_max_rad", "", "rad", [0.0, 1.5]] "Largest pitch angle in $OMS." helm_pitch_max_rad: f64 = 0.523_598_775_598_298_8,
        [whole "app.command_timeout_s", "", "s", [1.0, 120.0]] "The frontseat drops a command that was not renewed for this long." command_timeout_s: u8 = 2,
        [real "app.actuator_delay_s", "", "s", [0.0, 1.0]] "Time from sending a command to the movement of the fins." actuator_delay_s: f64 = 0.0,
        [real "app.fin_top_counts_per_rad", "", "1/rad", [-2000.0, 2000.0]] "Signed gain of the servo byte of the top fin." (servo.fins[0].counts_per_unit),
        [whole "app.fin_top_null", "", "1", [1.0, 254.0]] "Servo byte of the neutral top fin." (servo.fins[0].null),
        [real "app.fin_top_limit_rad", "", "rad", [0.0, 1.0]] "Largest angle commanded of the top fin." (servo.fins[0].limit),
        [real "app.fin_bottom_counts_per_rad", "", "1/rad", [-2000.0, 2000.0]] "Signed gain of the servo byte of the bottom fin." (servo.fins[1].counts_per_unit),
        [whole "app.fin_bottom_null", "", "1", [1.0, 254.0]] "Servo byte of the neutral bottom fin." (servo.fins[1].null),
        [real "app.fin_bottom_limit_rad", "", "rad", [0.0, 1.0]] "Largest angle commanded of the bottom fin." (servo.fins[1].limit),
        [real "app.fin_port_counts_per_rad", "", "1/rad", [-2000.0, 2000.0]] "Signed gain of the servo byte of the port fin." (servo.fins[2].counts_per_unit),
        [whole "app.fin_port_null", "", "1", [1.0, 254.0]] "Servo byte of the neutral port fin." (servo.fins[2].null),
        [real "app.fin_port_limit_rad", "", "rad", [0.0, 1.0]] "Largest angle commanded of the port fin." (servo.fins[2].limit),
        [real "app.fin_starboard_counts_per_rad", "", "1/rad", [-2000.0, 2000.0]] "Signed gain of the servo byte of the starboard fin." (servo.fins[3].counts_per_unit),
        [whole "app.fin_starboard_null", "", "1", [1.0, 254.0]] "Servo byte of the neutral starboard fin." (servo.fins[3].null),
        [real "app.fin_starboard_limit_rad", "", "rad", [0.0, 1.0]] "Largest angle commanded of the starboard fin." (servo.fins[3].limit),
        [real "app.motor_counts_per_radps", "", "s/rad", [-100.0, 100.0]] "Signed gain of the motor byte." (servo.motor.counts_per_unit),
        [whole "app.motor_null", "", "1", [1.0, 254.0]] "Motor byte of the stopped propeller." (servo.motor.null),
        [real "app.motor_limit_radps", "", "rad/s", [0.0, 1000.0]] "Largest propeller speed commanded." (servo.motor.limit),
        // modes
        [at_most real "app.attitude_timeout_s", "", "s", [0.2, 60.0]] "Attitude older than this is stale: navigation is not valid." attitude_timeout_s: f64 = 2.0,
        [at_most real "app.depth_timeout_s", "", "s", [0.2, 60.0]] "Depth older than this is stale: navigation is not valid." depth_timeout_s: f64 = 2.0,
        [at_most real "app.frontseat_timeout_s", "", "s", [0.5, 120.0]] "A frontseat that is silent for longer is lost." frontseat_timeout_s: f64 = 10.0,
        [at_most real "app.refusal_timeout_s", "", "s", [0.5, 120.0]] "Under way, a frontseat that refuses commands for longer ends the mission." refusal_timeout_s: f64 = 3.0,
        [at_most real "app.degraded_sigma_m", "", "m", [1.0, 10000.0]] "Standard deviation of the position from which navigation counts as degraded." degraded_sigma_m: f64 = 30.0,
        [at_most real "app.lost_sigma_m", "", "m", [1.0, 100000.0]] "Standard deviation of the position from which the position counts as lost." lost_sigma_m: f64 = 300.0,
        [real "app.alert_horizontal_m", "", "m", [0.0, 100000.0]] "Horizontal protection level from which navigation counts as degraded; 0: none." alert_horizontal_m: f64 = 0.0,
        [real "app.alert_depth_m", "", "m", [0.0, 1000.0]] "Protection level in depth from which navigation counts as degraded; with it the largest depth counts the level. 0: none." alert_depth_m: f64 = 0.0,
        // last-resort hardware
        [choice "app.abort_line"] "Abort line, an output: 0 not fitted, 1 active while high, 2 active while low." (fittings.abort_line, [Fitted::No, Fitted::High, Fitted::Low]),
        [choice "app.drop_weight"] "Release of the drop weight, or its burn wire, an output: 0 not fitted, 1 released while high, 2 released while low." (fittings.drop_weight, [Fitted::No, Fitted::High, Fitted::Low]),
        [choice "app.leak_detector"] "Leak detector, an input: 0 not fitted, 1 wet while high, 2 wet while low." (fittings.leak, [Fitted::No, Fitted::High, Fitted::Low]),
        [flag "app.supply_measured"] "The vehicle's supply is measured: 0 not fitted." (fittings.supply),
        [real "app.supply_ratio", "", "1", [1.0, 100.0]] "The vehicle's supply over the voltage at the pin that measures it." (fittings.supply_ratio),
        [at_least real "app.supply_last_v", "", "V", [0.0, 100.0]] "A vehicle whose supply is lower stops and rises, and releases its weight." (fittings.supply_last_v),
        [whole "app.drop_readings", "", "1", [1.0, 250.0]] "So many readings, ten a second, confirm a leak, a depth or a supply for the drop weight, and as many take it back." (fittings.readings),
        [at_most real "app.drop_depth_margin_m", "", "m", [0.0, 11000.0]] "Deeper than safety.depth_max_m by this the drop weight is released." (fittings.depth_margin_m),
        [live real "app.drop_no_ascent_s", "", "s", [0.0, 1.0e5]] "The drop weight is released when a vehicle under water whose mission was ended has not come up for so long; 0: it is not." (fittings.no_ascent_s),

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
