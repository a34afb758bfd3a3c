//! Rows of the app itself: protocols, ports, modes.

use super::settings::{AhrsProtocol, AppSettings, AttitudeSource, ControlMode, DvlSource, Fitted, NamingUse, Separate};
use backseat_core::identification::Scale;
use backseat_core::navigation::Area;
use backseat_core::parameters::Row;
use backseat_core::row;
use backseat_wire::iver::LengthUnit;
use backseat_wire::modem::{ClockEncoding, DopplerSign};
use core::f64::consts::PI;

/// Rows of the table of parameters ([`backseat_core::parameters`]) for [`AppSettings`].
#[rustfmt::skip] // a row a line, to be read as a table
pub(super) const APP: &[Row<AppSettings>] = &[
    // filter
    row!(flag "app.robust", "Estimate what the declaration leaves open (section prior); otherwise the vehicle is taken as declared.", robust),
    row!(flag "app.current_state", "Estimate a horizontal water current as two states of the filter, if it is not robust.", current_state),
    row!(real "app.current_initial_sigma_mps", "", "m/s", [0.001, 5.0], "Standard deviation of the current at the start, per axis.", current_initial_sigma_mps),
    row!(real "app.current_random_walk_mps_per_sqrt_s", "", "m/s/sqrt(s)", [0.0, 0.1], "Random walk of the current, per axis.", current_random_walk_mps_per_sqrt_s),
    row!(live real "app.late_tolerance_s", "", "s", [0.0, 5.0], "A measurement that is older than the filter by more than this is dropped; a younger one is fused late.", late_tolerance_s),
    // local frame and acoustics
    row!(real "app.origin_lat_deg", "", "deg", [-85.0, 85.0], "Latitude of the origin of the local frame, north positive.", origin_lat_deg),
    row!(real "app.origin_lon_deg", "", "deg", [-180.0, 180.0], "Longitude of the origin of the local frame, east positive.", origin_lon_deg),
    row!(flag "app.use_range", "Fuse acoustic ranges.", use_range),
    row!(flag "app.use_peers", "Fuse acoustic ranges to other vehicles, by their own packets.", use_peers),
    row!(flag "app.use_range_rate", "Fuse acoustic range rates.", use_range_rate),
    row!(choice "app.doppler_sign", "Sign of the modem's Doppler: 0 positive when the range opens, 1 positive when it closes.", doppler_sign, [DopplerSign::OpeningPositive, DopplerSign::ClosingPositive]),
    row!(choice "app.clock_encoding", "Clock mode of the modem: 0 legacy, 1 bit field (firmware 2.0.26038 and later).", clock_encoding, [ClockEncoding::Legacy, ClockEncoding::BitField]),
    row!(live real "app.range_max_m", "", "m", [10.0, 20000.0], "A longer acoustic range is refused.", range_max_m),
    row!(whole "app.ship_address", "", "1", [0.0, 255.0], "Modem address of the ship.", ship_address),
    row!(whole "app.modem_address", "", "1", [0.0, 255.0], "Modem address of the vehicle.", modem_address),
    row!(live real "app.packet_timeout_s", "", "s", [1.0, 60.0], "A packet is given up if its data and statistics have not come within this time of its start.", packet_timeout_s),
    row!(whole "app.cycle_period_s", "", "s", [0.0, 255.0], "Length of the acoustic cycle, which starts at whole multiples of it since 1970; 0: the vehicle sends nothing.", cycle_period_s),
    row!(whole "app.uplink_at_s", "", "s", [0.0, 255.0], "Second of the cycle at which the vehicle's state leaves; 255: none.", uplink_at_s),
    row!(whole "app.ping_at_s", "", "s", [0.0, 255.0], "Second of the cycle at which the vehicle pings the ship; 255: none.", ping_at_s),
    // sensors
    row!(flag "app.use_depth", "Fuse the depth of the pressure sensor.", use_depth),
    row!(flag "app.use_attitude", "Fuse attitude.", use_attitude),
    row!(flag "app.use_rates", "Fuse body rates.", use_rates),
    row!(flag "app.use_dvl", "Fuse DVL bottom track.", use_dvl),
    row!(flag "app.use_water_track", "Fuse DVL water track.", use_water_track),
    row!(flag "app.use_gnss", "Fuse GNSS fixes at the surface.", use_gnss),
    row!(real "app.receiver_bias_m", "sigma_b", "m", [0.0, 100.0], "Slowly varying error of a GNSS receiver per axis, the vehicle's and the ship's alike: part of the sigma of the position that the board states, never of the filter's. The vehicle's counts times the HDOP of $GPGGA, where that is more than 1.", receiver_bias_m),
    row!(choice "app.water_area", "Where the mission is flown, which says how much the current may change: 0 lake, 1 open coast, 2 strait or estuary. Part of the protection level, never of the filter.", water_area, [Area::Lake, Area::Coast, Area::Strait]),
    row!(real "app.level_probability_per_hour", "", "1/h", [1.0e-9, 0.1], "Probability in an hour that the error exceeds the protection level.", level_probability_per_hour),
    row!(choice "app.naming", "What changes in flight: 0 is not named; 1 is named, and nothing follows; 2 the filter predicts with a cause that is sure; 3 the controller steers with it too.", naming, [NamingUse::Off, NamingUse::Name, NamingUse::Navigate, NamingUse::All]),
    row!(choice "app.separate", "Manoeuvres that tell two causes apart which stay open: 0 none, 1 those that stay on the line, 2 also one that leaves it by up to 10 m.", separate, [Separate::Never, Separate::OnLegs, Separate::Free]),
    row!(live flag "app.log_required", "The mission is not to begin without the board's own log: `backseat check` says NO GO where no card is written.", log_required),
    row!(live real "app.gnss_max_depth_m", "", "m", [0.0, 10.0], "A fix is fused only if the estimated depth is at most this.", gnss_max_depth_m),
    row!(choice "app.ahrs_protocol", "Protocol of the AHRS port: 0 MicroStrain 3DM-GX3, 1 MicroStrain MIP, 2 OceanServer OS5000.", ahrs_protocol, [AhrsProtocol::Gx3, AhrsProtocol::Mip, AhrsProtocol::Os5000]),
    row!(choice "app.dvl_source", "Source of DVL velocities: on the DVL port 0 PD0, 1 PD4 or PD5, 2 PD6; 3 the frontseat's $DVL.", dvl_source, [DvlSource::Pd0, DvlSource::Pd4, DvlSource::Pd6, DvlSource::Frontseat]),
    row!(choice "app.attitude_source", "Source of attitude: 0 AHRS port, 1 the frontseat's $C.", attitude_source, [AttitudeSource::Ahrs, AttitudeSource::Frontseat]),
    row!(real "app.declination_rad", "", "rad", [-PI, PI], "Magnetic declination, added to the heading as received; east positive.", declination_rad),
    row!(real "app.dvl_mounting_rad", "", "rad", [-PI, PI], "Direction of the DVL's beam 3, from forward to starboard; only for velocities in instrument axes.", dvl_mounting_rad),
    // adaptation
    row!(live flag "app.adapt", "Identify the vehicle under way, while the filter fuses a DVL.", adapt),
    row!(choice "app.adapt_scale", "Parameter taken as known, which fixes the scale of the others: 0 inertia.m_diag[0], 1 propeller.beta5_n_s2_per_rad2.", adapt_scale, [Scale::M11, Scale::Beta5]),
    // frontseat
    row!(live real "app.compass_rate_hz", "", "Hz", [0.0, 10.0], "Requests of compass and depth ($C) per second.", compass_rate_hz),
    row!(live real "app.status_rate_hz", "", "Hz", [0.0, 10.0], "Requests of the vehicle's state ($OSI) per second.", status_rate_hz),
    row!(live real "app.gps_rate_hz", "", "Hz", [0.0, 10.0], "Requests of a fix ($GPRMC) per second.", gps_rate_hz),
    row!(live real "app.power_rate_hz", "", "Hz", [0.0, 1.0], "Requests of charge and leak ($OPI) per second; 0: only the error of $OSI says them.", power_rate_hz),
    row!(choice "app.command_depth_unit", "Unit of the depth in $OMS: 0 metres, 1 feet.", units.command_depth, [LengthUnit::Metres, LengthUnit::Feet]),
    row!(choice "app.status_depth_unit", "Unit of the depth in field 15 of $OSI: 0 metres, 1 feet.", units.status_depth, [LengthUnit::Metres, LengthUnit::Feet]),
    row!(choice "app.status_altitude_unit", "Unit of the altitude in field 9 of $OSI: 0 metres, 1 feet.", units.status_altitude, [LengthUnit::Metres, LengthUnit::Feet]),
    row!(choice "app.compass_depth_unit", "Unit of the depth in $C: 0 metres, 1 feet.", units.compass_depth, [LengthUnit::Metres, LengthUnit::Feet]),
    row!(choice "app.control_mode", "What is commanded: 0 fins and motor ($OMP), 1 heading, depth and speed ($OMS).", control_mode, [ControlMode::Direct, ControlMode::Helm]),
    row!(real "app.helm_pitch_max_rad", "", "rad", [0.0, 1.5], "Largest pitch angle in $OMS.", helm_pitch_max_rad),
    row!(whole "app.command_timeout_s", "", "s", [1.0, 120.0], "The frontseat drops a command that was not renewed for this long.", command_timeout_s),
    row!(real "app.actuator_delay_s", "", "s", [0.0, 1.0], "Time from sending a command to the movement of the fins.", actuator_delay_s),
    row!(real "app.fin_top_counts_per_rad", "", "1/rad", [-2000.0, 2000.0], "Signed gain of the servo byte of the top fin.", servo.fins[0].counts_per_unit),
    row!(whole "app.fin_top_null", "", "1", [1.0, 254.0], "Servo byte of the neutral top fin.", servo.fins[0].null),
    row!(real "app.fin_top_limit_rad", "", "rad", [0.0, 1.0], "Largest angle commanded of the top fin.", servo.fins[0].limit),
    row!(real "app.fin_bottom_counts_per_rad", "", "1/rad", [-2000.0, 2000.0], "Signed gain of the servo byte of the bottom fin.", servo.fins[1].counts_per_unit),
    row!(whole "app.fin_bottom_null", "", "1", [1.0, 254.0], "Servo byte of the neutral bottom fin.", servo.fins[1].null),
    row!(real "app.fin_bottom_limit_rad", "", "rad", [0.0, 1.0], "Largest angle commanded of the bottom fin.", servo.fins[1].limit),
    row!(real "app.fin_port_counts_per_rad", "", "1/rad", [-2000.0, 2000.0], "Signed gain of the servo byte of the port fin.", servo.fins[2].counts_per_unit),
    row!(whole "app.fin_port_null", "", "1", [1.0, 254.0], "Servo byte of the neutral port fin.", servo.fins[2].null),
    row!(real "app.fin_port_limit_rad", "", "rad", [0.0, 1.0], "Largest angle commanded of the port fin.", servo.fins[2].limit),
    row!(real "app.fin_starboard_counts_per_rad", "", "1/rad", [-2000.0, 2000.0], "Signed gain of the servo byte of the starboard fin.", servo.fins[3].counts_per_unit),
    row!(whole "app.fin_starboard_null", "", "1", [1.0, 254.0], "Servo byte of the neutral starboard fin.", servo.fins[3].null),
    row!(real "app.fin_starboard_limit_rad", "", "rad", [0.0, 1.0], "Largest angle commanded of the starboard fin.", servo.fins[3].limit),
    row!(real "app.motor_counts_per_radps", "", "s/rad", [-100.0, 100.0], "Signed gain of the motor byte.", servo.motor.counts_per_unit),
    row!(whole "app.motor_null", "", "1", [1.0, 254.0], "Motor byte of the stopped propeller.", servo.motor.null),
    row!(real "app.motor_limit_radps", "", "rad/s", [0.0, 1000.0], "Largest propeller speed commanded.", servo.motor.limit),
    // modes
    row!(at_most real "app.attitude_timeout_s", "", "s", [0.2, 60.0], "Attitude older than this is stale: navigation is not valid.", attitude_timeout_s),
    row!(at_most real "app.depth_timeout_s", "", "s", [0.2, 60.0], "Depth older than this is stale: navigation is not valid.", depth_timeout_s),
    row!(at_most real "app.frontseat_timeout_s", "", "s", [0.5, 120.0], "A frontseat that is silent for longer is lost.", frontseat_timeout_s),
    row!(at_most real "app.refusal_timeout_s", "", "s", [0.5, 120.0], "Under way, a frontseat that refuses commands for longer ends the mission.", refusal_timeout_s),
    row!(at_most real "app.degraded_sigma_m", "", "m", [1.0, 10000.0], "Standard deviation of the position from which navigation counts as degraded.", degraded_sigma_m),
    row!(at_most real "app.lost_sigma_m", "", "m", [1.0, 100000.0], "Standard deviation of the position from which the position counts as lost.", lost_sigma_m),
    row!(real "app.alert_horizontal_m", "", "m", [0.0, 100000.0], "Horizontal protection level from which navigation counts as degraded; 0: none.", alert_horizontal_m),
    row!(real "app.alert_depth_m", "", "m", [0.0, 1000.0], "Protection level in depth from which navigation counts as degraded; with it the largest depth counts the level. 0: none.", alert_depth_m),
    // last-resort hardware
    row!(choice "app.abort_line", "Abort line, an output: 0 not fitted, 1 active while high, 2 active while low.", fittings.abort_line, [Fitted::No, Fitted::High, Fitted::Low]),
    row!(choice "app.drop_weight", "Release of the drop weight, or its burn wire, an output: 0 not fitted, 1 released while high, 2 released while low.", fittings.drop_weight, [Fitted::No, Fitted::High, Fitted::Low]),
    row!(choice "app.leak_detector", "Leak detector, an input: 0 not fitted, 1 wet while high, 2 wet while low.", fittings.leak, [Fitted::No, Fitted::High, Fitted::Low]),
    row!(flag "app.supply_measured", "The vehicle's supply is measured: 0 not fitted.", fittings.supply),
    row!(real "app.supply_ratio", "", "1", [1.0, 100.0], "The vehicle's supply over the voltage at the pin that measures it.", fittings.supply_ratio),
    row!(at_least real "app.supply_last_v", "", "V", [0.0, 100.0], "A vehicle whose supply is lower stops and rises, and releases its weight.", fittings.supply_last_v),
    row!(whole "app.drop_readings", "", "1", [1.0, 250.0], "So many readings, ten a second, confirm a leak, a depth or a supply for the drop weight, and as many take it back.", fittings.readings),
    row!(at_most real "app.drop_depth_margin_m", "", "m", [0.0, 11000.0], "Deeper than safety.depth_max_m by this the drop weight is released.", fittings.depth_margin_m),
    row!(live real "app.drop_no_ascent_s", "", "s", [0.0, 1.0e5], "The drop weight is released when a vehicle under water whose mission was ended has not come up for so long; 0: it is not.", fittings.no_ascent_s),
];
