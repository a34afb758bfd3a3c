//! The declared list. Vehicle, noise and sensor names are the flattened keys of the vehicle file.

use super::settings::{AhrsProtocol, AttitudeSource, ControlMode, DvlSource};
use super::{Kind, Parameter};
use backseat_core::control::{AllocationMethod, ControlLaw};
use backseat_core::effects::{self, ParameterId, ParameterKind};
use backseat_core::identification::Scale;
use backseat_core::navigation::ProcessModel;
use backseat_wire::iver::LengthUnit;
use backseat_wire::modem::{ClockEncoding, DopplerSign};

/// A row; `live` ones may change while a mission runs.
macro_rules! real {
    (live $name:literal, $($rest:tt)+) => { real!(@ true, $name, $($rest)+) };
    ($name:literal, $($rest:tt)+) => { real!(@ false, $name, $($rest)+) };
    (@ $live:literal, $name:literal, $unit:literal, $min:expr, $max:expr, $description:literal, $($path:tt)+) => {
        Parameter {
            name: $name,
            unit: $unit,
            kind: Kind::Real,
            min: $min,
            max: $max,
            #[cfg(not(target_os = "none"))]
            description: $description,
            under_way: $live,
            get: |s| s.$($path)+,
            set: |s, value| s.$($path)+ = value,
        }
    };
}

/// A count; the store admits whole numbers of the range only, so the cast is exact.
macro_rules! whole {
    (live $name:literal, $($rest:tt)+) => { whole!(@ true, $name, $($rest)+) };
    ($name:literal, $($rest:tt)+) => { whole!(@ false, $name, $($rest)+) };
    (@ $live:literal, $name:literal, $unit:literal, $min:literal, $max:literal, $description:literal, $($path:tt)+) => {
        Parameter {
            name: $name,
            unit: $unit,
            kind: Kind::Whole,
            min: $min as f64,
            max: $max as f64,
            #[cfg(not(target_os = "none"))]
            description: $description,
            under_way: $live,
            get: |s| f64::from(s.$($path)+),
            set: |s, value| s.$($path)+ = value as _,
        }
    };
}

/// Name of an effect's parameter: `effects.`, the effect, a dot, the parameter.
const fn effect_name<const LENGTH: usize>(id: ParameterId) -> [u8; LENGTH] {
    let parts = [b"effects.", id.effect().name.as_bytes(), b".", id.info().name.as_bytes()];
    let (mut name, mut at, mut part) = ([0; LENGTH], 0, 0);
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            name[at] = parts[part][i];
            (at, i) = (at + 1, i + 1);
        }
        part += 1;
    }
    name
}

/// A parameter of the effect catalogue, by its place there.
macro_rules! effect {
    ($place:literal) => {{
        const ID: ParameterId = ParameterId::at($place);
        const LENGTH: usize = "effects.".len() + ID.effect().name.len() + 1 + ID.info().name.len();
        const NAME: [u8; LENGTH] = effect_name(ID);
        Parameter {
            name: match core::str::from_utf8(&NAME) {
                Ok(name) => name,
                Err(_) => "",
            },
            unit: ID.info().unit,
            kind: if matches!(ID.info().kind, ParameterKind::Fin) { Kind::Whole } else { Kind::Real },
            // zero is no effect
            min: ID.info().min.min(0.0),
            max: ID.info().max,
            #[cfg(not(target_os = "none"))]
            description: ID.effect().equations,
            under_way: false,
            get: |s| s.navigation.effects.get(ID),
            set: |s, value| s.navigation.effects.set(ID, value),
        }
    }};
}
const _: () = assert!(effects::PARAMETERS == 37, "the table below lists the parameters of the catalogue by place");

/// One of several, by number; `live` ones may change while a mission runs.
macro_rules! choice {
    (live $name:literal, $($rest:tt)+) => { choice!(@ true, $name, $($rest)+) };
    ($name:literal, $($rest:tt)+) => { choice!(@ false, $name, $($rest)+) };
    (@ $live:literal, $name:literal, $description:literal, $($field:ident).+, [$($variant:expr),+]) => {
        Parameter {
            name: $name,
            unit: "1",
            kind: Kind::Whole,
            min: 0.0,
            max: [$($variant),+].len() as f64 - 1.0,
            #[cfg(not(target_os = "none"))]
            description: $description,
            under_way: $live,
            get: |s| [$($variant),+].iter().position(|v| *v == s.$($field).+).unwrap_or(0) as f64,
            set: |s, value| {
                if let Some(v) = [$($variant),+].get(value as usize) {
                    s.$($field).+ = *v;
                }
            },
        }
    };
}

/// 0 no, 1 yes.
macro_rules! flag {
    (live $name:literal, $description:literal, $($field:ident).+) => {
        choice!(live $name, $description, $($field).+, [false, true])
    };
    ($name:literal, $description:literal, $($field:ident).+) => {
        choice!($name, $description, $($field).+, [false, true])
    };
}

/// All parameters, in the order of their index.
#[rustfmt::skip] // a row a line, to be read as a table
pub static PARAMETERS: &[Parameter] = &[
    // [vehicle]
    real!("vehicle.length_m", "m", 0.5, 20.0, "length over all", vehicle.length_m),
    real!("vehicle.diameter_m", "m", 0.05, 2.0, "hull diameter", vehicle.diameter_m),
    real!("vehicle.mass_kg", "kg", 1.0, 5000.0, "dry mass m", vehicle.mass_kg),
    real!("vehicle.displaced_mass_kg", "kg", 1.0, 5000.0, "displaced mass rho V; more than the mass floats", vehicle.displaced_mass_kg),
    real!("vehicle.rho_kg_per_m3", "kg/m3", 990.0, 1060.0, "water density", vehicle.rho_kg_per_m3),
    real!("vehicle.g_mps2", "m/s2", 9.7, 9.9, "gravity", vehicle.g_mps2),
    real!("vehicle.b_cb_to_cg_m[0]", "m", -0.2, 0.2, "centre of buoyancy to centre of gravity, body frame", vehicle.b_cb_to_cg_m[0]),
    real!("vehicle.b_cb_to_cg_m[1]", "m", -0.2, 0.2, "centre of buoyancy to centre of gravity, body frame", vehicle.b_cb_to_cg_m[1]),
    real!("vehicle.b_cb_to_cg_m[2]", "m", -0.2, 0.2, "centre of buoyancy to centre of gravity, body frame", vehicle.b_cb_to_cg_m[2]),
    // [inertia]
    real!("inertia.m_diag[0]", "kg", 0.001, 20000.0, "rigid body plus added mass", vehicle.m_diag[0]),
    real!("inertia.m_diag[1]", "kg", 0.001, 20000.0, "rigid body plus added mass", vehicle.m_diag[1]),
    real!("inertia.m_diag[2]", "kg", 0.001, 20000.0, "rigid body plus added mass", vehicle.m_diag[2]),
    real!("inertia.m_diag[3]", "kg m2", 0.001, 20000.0, "rigid body plus added mass", vehicle.m_diag[3]),
    real!("inertia.m_diag[4]", "kg m2", 0.001, 20000.0, "rigid body plus added mass", vehicle.m_diag[4]),
    real!("inertia.m_diag[5]", "kg m2", 0.001, 20000.0, "rigid body plus added mass", vehicle.m_diag[5]),
    // [drag]
    real!("drag.quadratic_diag[0]", "N s2/m2", 0.0, 20000.0, "diagonal quadratic drag, positive opposes motion", vehicle.quadratic_diag[0]),
    real!("drag.quadratic_diag[1]", "N s2/m2", 0.0, 20000.0, "diagonal quadratic drag, positive opposes motion", vehicle.quadratic_diag[1]),
    real!("drag.quadratic_diag[2]", "N s2/m2", 0.0, 20000.0, "diagonal quadratic drag, positive opposes motion", vehicle.quadratic_diag[2]),
    real!("drag.quadratic_diag[3]", "N m s2/rad2", 0.0, 20000.0, "diagonal quadratic drag, positive opposes motion", vehicle.quadratic_diag[3]),
    real!("drag.quadratic_diag[4]", "N m s2/rad2", 0.0, 20000.0, "diagonal quadratic drag, positive opposes motion", vehicle.quadratic_diag[4]),
    real!("drag.quadratic_diag[5]", "N m s2/rad2", 0.0, 20000.0, "diagonal quadratic drag, positive opposes motion", vehicle.quadratic_diag[5]),
    real!("drag.d26", "1", -1000.0, 1000.0, "off-diagonal drag of rows 2 and 6 (4.21)", vehicle.d26),
    real!("drag.d35", "1", -1000.0, 1000.0, "off-diagonal drag of rows 3 and 5 (4.21)", vehicle.d35),
    real!("drag.linear_surge_ns_per_m", "N s/m", 0.0, 1000.0, "linear surge drag", vehicle.linear_surge_ns_per_m),
    // [fins]
    real!("fins.phi_rad[0]", "rad", -3.2, 3.2, "rotation of the fin frame about body x", vehicle.fins[0].phi_rad),
    real!("fins.phi_rad[1]", "rad", -3.2, 3.2, "rotation of the fin frame about body x", vehicle.fins[1].phi_rad),
    real!("fins.phi_rad[2]", "rad", -3.2, 3.2, "rotation of the fin frame about body x", vehicle.fins[2].phi_rad),
    real!("fins.phi_rad[3]", "rad", -3.2, 3.2, "rotation of the fin frame about body x", vehicle.fins[3].phi_rad),
    real!("fins.cp_m[0][0]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[0].cp_m[0]),
    real!("fins.cp_m[0][1]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[0].cp_m[1]),
    real!("fins.cp_m[0][2]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[0].cp_m[2]),
    real!("fins.cp_m[1][0]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[1].cp_m[0]),
    real!("fins.cp_m[1][1]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[1].cp_m[1]),
    real!("fins.cp_m[1][2]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[1].cp_m[2]),
    real!("fins.cp_m[2][0]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[2].cp_m[0]),
    real!("fins.cp_m[2][1]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[2].cp_m[1]),
    real!("fins.cp_m[2][2]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[2].cp_m[2]),
    real!("fins.cp_m[3][0]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[3].cp_m[0]),
    real!("fins.cp_m[3][1]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[3].cp_m[1]),
    real!("fins.cp_m[3][2]", "m", -20.0, 20.0, "centre of pressure from the centre of gravity", vehicle.fins[3].cp_m[2]),
    real!("fins.area_m2", "m2", 0.0001, 1.0, "planform area of one fin", vehicle.fin_area_m2),
    real!("fins.cd[0]", "1", 0.0, 10.0, "drag coefficient beta1 + beta2 alpha^2", vehicle.cd[0]),
    real!("fins.cd[1]", "1", 0.0, 10.0, "drag coefficient beta1 + beta2 alpha^2", vehicle.cd[1]),
    real!("fins.cl[0]", "1", -100.0, 10.0, "lift coefficient beta3 alpha + beta4 alpha^3", vehicle.cl[0]),
    real!("fins.cl[1]", "1", -100.0, 10.0, "lift coefficient beta3 alpha + beta4 alpha^3", vehicle.cl[1]),
    real!("fins.stall_rad", "rad", 0.01, core::f64::consts::PI, "incidence beyond which the coefficients keep their values", vehicle.stall_rad),
    real!("fins.delta_max_rad", "rad", 0.05, 1.0, "mechanical limit", vehicle.delta_max_rad),
    // [propeller]
    real!("propeller.beta5_n_s2_per_rad2", "N s2/rad2", 1e-7, 1.0, "thrust beta5 omega |omega|", vehicle.beta5_n_s2_per_rad2),
    real!("propeller.advance_n_s2_per_rad_m", "N s2/(rad m)", 0.0, 1.0, "thrust loss k omega u", vehicle.advance_n_s2_per_rad_m),
    real!("propeller.omega_max_radps", "rad/s", 1.0, 1000.0, "largest propeller speed", vehicle.omega_max_radps),
    // [noise]
    real!("noise.linear_mps2_per_sqrt_hz[0]", "m/s2/sqrt(Hz)", 1e-6, 1.0, "acceleration noise u, v, w", navigation.process_noise.linear_mps2_per_sqrt_hz[0]),
    real!("noise.linear_mps2_per_sqrt_hz[1]", "m/s2/sqrt(Hz)", 1e-6, 1.0, "acceleration noise u, v, w", navigation.process_noise.linear_mps2_per_sqrt_hz[1]),
    real!("noise.linear_mps2_per_sqrt_hz[2]", "m/s2/sqrt(Hz)", 1e-6, 1.0, "acceleration noise u, v, w", navigation.process_noise.linear_mps2_per_sqrt_hz[2]),
    real!("noise.angular_radps2_per_sqrt_hz[0]", "rad/s2/sqrt(Hz)", 1e-6, 1.0, "acceleration noise p, q, r", navigation.process_noise.angular_radps2_per_sqrt_hz[0]),
    real!("noise.angular_radps2_per_sqrt_hz[1]", "rad/s2/sqrt(Hz)", 1e-6, 1.0, "acceleration noise p, q, r", navigation.process_noise.angular_radps2_per_sqrt_hz[1]),
    real!("noise.angular_radps2_per_sqrt_hz[2]", "rad/s2/sqrt(Hz)", 1e-6, 1.0, "acceleration noise p, q, r", navigation.process_noise.angular_radps2_per_sqrt_hz[2]),
    // [sensors]
    real!("sensors.depth_m", "m", 0.001, 10.0, "one sigma", navigation.sensors.depth_m),
    real!("sensors.attitude_rad", "rad", 0.0001, 0.5, "one sigma", navigation.sensors.attitude_rad),
    real!("sensors.rates_radps", "rad/s", 0.00001, 0.5, "one sigma", navigation.sensors.rates_radps),
    real!("sensors.dvl_mps", "m/s", 0.0005, 1.0, "one sigma", navigation.sensors.dvl_mps),
    real!("sensors.range_m", "m", 0.01, 100.0, "one sigma", navigation.sensors.range_m),
    real!("sensors.range_rate_mps", "m/s", 0.001, 10.0, "one sigma", navigation.sensors.range_rate_mps),
    real!("sensors.gnss_m", "m", 0.01, 100.0, "one sigma", navigation.sensors.gnss_m),
    real!("sensors.ship_gnss_m", "m", 0.01, 100.0, "one sigma", navigation.sensors.ship_gnss_m),
    // [installation]
    real!("installation.dvl_arm_m[0]", "m", -20.0, 20.0, "DVL from the centre of gravity, body frame", app.installation.dvl_arm_m[0]),
    real!("installation.dvl_arm_m[1]", "m", -20.0, 20.0, "DVL from the centre of gravity, body frame", app.installation.dvl_arm_m[1]),
    real!("installation.dvl_arm_m[2]", "m", -20.0, 20.0, "DVL from the centre of gravity, body frame", app.installation.dvl_arm_m[2]),
    real!("installation.dvl_turn_rad[0]", "rad", -3.2, 3.2, "roll, pitch, yaw of the DVL's axes in the body", app.installation.dvl_turn_rad[0]),
    real!("installation.dvl_turn_rad[1]", "rad", -3.2, 3.2, "roll, pitch, yaw of the DVL's axes in the body", app.installation.dvl_turn_rad[1]),
    real!("installation.dvl_turn_rad[2]", "rad", -3.2, 3.2, "roll, pitch, yaw of the DVL's axes in the body", app.installation.dvl_turn_rad[2]),
    real!(live "installation.dvl_delay_s", "s", 0.0, 2.0, "DVL: from validity to the arrival of the last byte", app.installation.dvl_delay_s),
    real!("installation.ahrs_turn_rad[0]", "rad", -3.2, 3.2, "roll, pitch, yaw of the AHRS' axes in the body", app.installation.ahrs_turn_rad[0]),
    real!("installation.ahrs_turn_rad[1]", "rad", -3.2, 3.2, "roll, pitch, yaw of the AHRS' axes in the body", app.installation.ahrs_turn_rad[1]),
    real!("installation.ahrs_turn_rad[2]", "rad", -3.2, 3.2, "roll, pitch, yaw of the AHRS' axes in the body", app.installation.ahrs_turn_rad[2]),
    real!(live "installation.ahrs_delay_s", "s", 0.0, 2.0, "AHRS: from validity to the arrival of the last byte", app.installation.ahrs_delay_s),
    real!("installation.depth_arm_m[0]", "m", -20.0, 20.0, "pressure sensor from the centre of gravity, body frame", app.installation.depth_arm_m[0]),
    real!("installation.depth_arm_m[1]", "m", -20.0, 20.0, "pressure sensor from the centre of gravity, body frame", app.installation.depth_arm_m[1]),
    real!("installation.depth_arm_m[2]", "m", -20.0, 20.0, "pressure sensor from the centre of gravity, body frame", app.installation.depth_arm_m[2]),
    real!(live "installation.depth_delay_s", "s", 0.0, 2.0, "depth: from validity to the arrival of the last byte", app.installation.depth_delay_s),
    real!("installation.gnss_arm_m[0]", "m", -20.0, 20.0, "antenna from the centre of gravity, body frame", app.installation.gnss_arm_m[0]),
    real!("installation.gnss_arm_m[1]", "m", -20.0, 20.0, "antenna from the centre of gravity, body frame", app.installation.gnss_arm_m[1]),
    real!("installation.gnss_arm_m[2]", "m", -20.0, 20.0, "antenna from the centre of gravity, body frame", app.installation.gnss_arm_m[2]),
    real!(live "installation.gnss_delay_s", "s", 0.0, 2.0, "fix: from validity to the arrival of the last byte", app.installation.gnss_delay_s),
    real!("installation.transducer_arm_m[0]", "m", -20.0, 20.0, "acoustic transducer from the centre of gravity, body frame", app.installation.transducer_arm_m[0]),
    real!("installation.transducer_arm_m[1]", "m", -20.0, 20.0, "acoustic transducer from the centre of gravity, body frame", app.installation.transducer_arm_m[1]),
    real!("installation.transducer_arm_m[2]", "m", -20.0, 20.0, "acoustic transducer from the centre of gravity, body frame", app.installation.transducer_arm_m[2]),
    real!(live "installation.transducer_delay_s", "s", -1.0, 1.0, "calibrated hardware delay, subtracted from every time of flight", app.installation.transducer_delay_s),
    real!(live "installation.sound_speed_mps", "m/s", 1300.0, 1700.0, "sound speed", app.installation.sound_speed_mps),
    real!("installation.ship_transducer_depth_m", "m", 0.0, 100.0, "depth of the ship's transducer", app.installation.ship_transducer_depth_m),
    // [effects]
    effect!(0), effect!(1), effect!(2), effect!(3), effect!(4), effect!(5), effect!(6), effect!(7), effect!(8), effect!(9),
    effect!(10), effect!(11), effect!(12), effect!(13), effect!(14), effect!(15), effect!(16), effect!(17), effect!(18),
    effect!(19), effect!(20), effect!(21), effect!(22), effect!(23), effect!(24), effect!(25), effect!(26), effect!(27),
    effect!(28), effect!(29), effect!(30), effect!(31), effect!(32), effect!(33), effect!(34), effect!(35), effect!(36),
    // filter
    choice!("app.process_model", "0 dynamic, 1 kinematic", navigation.process_model, [ProcessModel::Dynamic, ProcessModel::Kinematic]),
    flag!("app.current_state", "estimate the water current", app.current_state),
    real!("app.current_initial_sigma_mps", "m/s", 0.001, 5.0, "one sigma of the current at the start", app.current_initial_sigma_mps),
    real!("app.current_random_walk_mps_per_sqrt_s", "m/s/sqrt(s)", 0.0, 0.1, "random walk of the current", app.current_random_walk_mps_per_sqrt_s),
    real!("app.gate_sigma", "1", 1.0, 1000.0, "innovations beyond this many sigmas are rejected", navigation.gate_sigma),
    real!(live "app.late_tolerance_s", "s", 0.0, 5.0, "older measurements are dropped; younger ones are fused late", app.late_tolerance_s),
    // local frame and acoustics
    real!("app.origin_lat_deg", "deg", -85.0, 85.0, "origin of the local frame, north positive", app.origin_lat_deg),
    real!("app.origin_lon_deg", "deg", -180.0, 180.0, "origin of the local frame, east positive", app.origin_lon_deg),
    flag!("app.use_range", "fuse acoustic ranges", app.use_range),
    flag!("app.use_range_rate", "fuse acoustic range rates", app.use_range_rate),
    choice!("app.doppler_sign", "the modem's Doppler is 0 positive opening, 1 positive closing", app.doppler_sign, [DopplerSign::OpeningPositive, DopplerSign::ClosingPositive]),
    choice!("app.clock_encoding", "clock mode of the modem: 0 legacy, 1 bit field (firmware 2.0.26038 and later)", app.clock_encoding, [ClockEncoding::Legacy, ClockEncoding::BitField]),
    real!(live "app.range_max_m", "m", 10.0, 20000.0, "longer ranges are absurd", app.range_max_m),
    whole!("app.ship_address", "1", 0, 255, "modem address of the ship", app.ship_address),
    whole!("app.modem_address", "1", 0, 255, "modem address of the vehicle", app.modem_address),
    real!(live "app.packet_timeout_s", "s", 1.0, 60.0, "data and statistics come within this time of a packet's start", app.packet_timeout_s),
    // sensors
    flag!("app.use_depth", "fuse depth", app.use_depth),
    flag!("app.use_attitude", "fuse attitude", app.use_attitude),
    flag!("app.use_rates", "fuse body rates", app.use_rates),
    flag!("app.use_dvl", "fuse DVL bottom track", app.use_dvl),
    flag!("app.use_water_track", "fuse DVL water track", app.use_water_track),
    flag!("app.use_gnss", "fuse fixes at the surface", app.use_gnss),
    real!(live "app.gnss_max_depth_m", "m", 0.0, 10.0, "deepest estimate at which a fix is believed", app.gnss_max_depth_m),
    choice!("app.ahrs_protocol", "0 GX3, 1 MIP, 2 OS5000", app.ahrs_protocol, [AhrsProtocol::Gx3, AhrsProtocol::Mip, AhrsProtocol::Os5000]),
    choice!("app.dvl_source", "0 PD0, 1 PD4 or PD5, 2 PD6, 3 the frontseat's DVL sentence", app.dvl_source, [DvlSource::Pd0, DvlSource::Pd4, DvlSource::Pd6, DvlSource::Frontseat]),
    choice!("app.attitude_source", "0 AHRS port, 1 the frontseat's compass", app.attitude_source, [AttitudeSource::Ahrs, AttitudeSource::Frontseat]),
    real!("app.declination_rad", "rad", -3.2, 3.2, "added to the heading as received", app.declination_rad),
    real!("app.dvl_mounting_rad", "rad", -3.2, 3.2, "direction of the DVL's beam 3 in the vehicle, forward to starboard", app.dvl_mounting_rad),
    // adaptation
    flag!(live "app.adapt", "identify the vehicle under way, while the filter fuses a DVL", app.adapt),
    choice!("app.adapt_scale", "known parameter that fixes the scale: 0 inertia.m_diag[0], 1 propeller.beta5", app.adapt_scale, [Scale::M11, Scale::Beta5]),
    real!(live "app.adapt_settle_s", "s", 60.0, 100000.0, "time of adaptation before an estimate is tried", app.adapt_settle_s),
    flag!(live "app.adopt", "use identified parameters that have predicted better than those in use", app.adopt),
    real!(live "app.adopt_window_s", "s", 150.0, 100000.0, "time over which parameters are compared before a verdict", app.adopt_window_s),
    // frontseat
    real!(live "app.compass_rate_hz", "Hz", 0.0, 10.0, "compass (and depth) requests per second", app.compass_rate_hz),
    real!(live "app.status_rate_hz", "Hz", 0.0, 10.0, "state requests per second", app.status_rate_hz),
    real!(live "app.gps_rate_hz", "Hz", 0.0, 10.0, "GPS requests per second", app.gps_rate_hz),
    choice!("app.command_depth_unit", "unit of the length in OMS: 0 metres, 1 feet", app.units.command_depth, [LengthUnit::Metres, LengthUnit::Feet]),
    choice!("app.status_depth_unit", "unit of the length in OSI field 15: 0 metres, 1 feet", app.units.status_depth, [LengthUnit::Metres, LengthUnit::Feet]),
    choice!("app.status_altitude_unit", "unit of the length in OSI field 9: 0 metres, 1 feet", app.units.status_altitude, [LengthUnit::Metres, LengthUnit::Feet]),
    choice!("app.compass_depth_unit", "unit of the length in C: 0 metres, 1 feet", app.units.compass_depth, [LengthUnit::Metres, LengthUnit::Feet]),
    choice!("app.control_mode", "0 fins and motor (OMP), 1 heading, depth and speed (OMS)", app.control_mode, [ControlMode::Direct, ControlMode::Helm]),
    real!("app.helm_pitch_max_rad", "rad", 0.0, 1.5, "largest pitch in OMS", app.helm_pitch_max_rad),
    whole!("app.command_timeout_s", "s", 1, 120, "the frontseat drops a command after this", app.command_timeout_s),
    real!("app.actuator_delay_s", "s", 0.0, 1.0, "from sending a command to the fins' movement", app.actuator_delay_s),
    real!("app.fin_top_counts_per_rad", "1/rad", -2000.0, 2000.0, "signed gain of the servo byte", app.servo.fins[0].counts_per_unit),
    whole!("app.fin_top_null", "1", 1, 254, "servo byte of the neutral fin", app.servo.fins[0].null),
    real!("app.fin_top_limit_rad", "rad", 0.0, 1.0, "largest angle commanded", app.servo.fins[0].limit),
    real!("app.fin_bottom_counts_per_rad", "1/rad", -2000.0, 2000.0, "signed gain of the servo byte", app.servo.fins[1].counts_per_unit),
    whole!("app.fin_bottom_null", "1", 1, 254, "servo byte of the neutral fin", app.servo.fins[1].null),
    real!("app.fin_bottom_limit_rad", "rad", 0.0, 1.0, "largest angle commanded", app.servo.fins[1].limit),
    real!("app.fin_port_counts_per_rad", "1/rad", -2000.0, 2000.0, "signed gain of the servo byte", app.servo.fins[2].counts_per_unit),
    whole!("app.fin_port_null", "1", 1, 254, "servo byte of the neutral fin", app.servo.fins[2].null),
    real!("app.fin_port_limit_rad", "rad", 0.0, 1.0, "largest angle commanded", app.servo.fins[2].limit),
    real!("app.fin_starboard_counts_per_rad", "1/rad", -2000.0, 2000.0, "signed gain of the servo byte", app.servo.fins[3].counts_per_unit),
    whole!("app.fin_starboard_null", "1", 1, 254, "servo byte of the neutral fin", app.servo.fins[3].null),
    real!("app.fin_starboard_limit_rad", "rad", 0.0, 1.0, "largest angle commanded", app.servo.fins[3].limit),
    real!("app.motor_counts_per_radps", "s/rad", -100.0, 100.0, "signed gain of the motor byte", app.servo.motor.counts_per_unit),
    whole!("app.motor_null", "1", 1, 254, "motor byte of the stopped propeller", app.servo.motor.null),
    real!("app.motor_limit_radps", "rad/s", 0.0, 1000.0, "largest propeller speed commanded", app.servo.motor.limit),
    // control
    choice!("app.control_law", "0 PD, 1 LQR, 2 LQR about the reference trajectory", control.law, [ControlLaw::Pd, ControlLaw::Lqr, ControlLaw::LqrOnReference]),
    choice!("app.allocation", "0 decoupled, 1 six degrees of freedom", control.allocation, [AllocationMethod::Decoupled, AllocationMethod::SixDof]),
    real!("app.fin_limit_rad", "rad", 0.01, 1.0, "largest fin angle of the controller", control.limits.fin_rad),
    real!("app.fin_rate_radps", "rad/s", 0.01, 50.0, "largest fin rate", control.limits.fin_rate_radps),
    real!("app.propeller_limit_radps", "rad/s", 1.0, 1000.0, "largest propeller speed of the controller", control.limits.propeller_radps),
    real!("app.propeller_rate_radps2", "rad/s2", 0.1, 10000.0, "largest propeller acceleration", control.limits.propeller_radps2),
    real!("app.turn_radius_m", "m", 0.0, 500.0, "radius of the turns at waypoints", control.turn_radius_m),
    real!("app.cruise_speed_mps", "m/s", 0.3, 5.0, "speed that the gain is first made for", control.cruise_speed_mps),
    // modes
    real!(live "app.attitude_timeout_s", "s", 0.2, 60.0, "older attitude is stale", app.attitude_timeout_s),
    real!(live "app.depth_timeout_s", "s", 0.2, 60.0, "older depth is stale", app.depth_timeout_s),
    real!(live "app.frontseat_timeout_s", "s", 0.5, 120.0, "a frontseat silent for longer is lost", app.frontseat_timeout_s),
    real!(live "app.refusal_timeout_s", "s", 0.5, 120.0, "a frontseat that refuses for longer keeps control", app.refusal_timeout_s),
    real!(live "app.degraded_sigma_m", "m", 1.0, 10000.0, "position sigma from which navigation is degraded", app.degraded_sigma_m),
    real!(live "app.lost_sigma_m", "m", 1.0, 100000.0, "position sigma from which the position is lost", app.lost_sigma_m),
    whole!("app.rejections_in_a_row", "1", 1, 1000, "measurements of one sensor in a row, beyond three fifths of the gate, from which it is doubted", navigation.exceedances),
];
