//! The board's parameters before a flight: vehicle and site.

use crate::devices::calibration;
use crate::scenario::{ControlLaw, ControlMode, Exchange, Scenario};
use backseat_app::parameters::AppSettings;
use backseat_core::control::ControlConfig;

const DEFAULT: AppSettings = AppSettings::DEFAULT;
/// Resolution of depth in the frontseat's `$C`: a tenth of a foot.
const DEPTH_STEP_M: f64 = 0.030_48;

/// The board's parameters for a scenario: the declared vehicle, and what a technician would set for
/// these devices.
#[must_use]
pub fn board_parameters(scenario: &Scenario) -> Vec<(String, f64)> {
    let settings = &scenario.settings;
    let environment = &settings.environment;
    let backseat = &settings.backseat;
    let mut values = scenario.declared_vehicle().flatten();
    for (name, value) in &mut values {
        if name == "sensors.depth_m" {
            // Rounding adds the variance of a uniform error.
            *value = (value.powi(2) + DEPTH_STEP_M.powi(2) / 12.0).sqrt();
        }
    }
    let motor = calibration(scenario.vehicle.parameters.omega_max_radps).motor;
    if motor != DEFAULT.servo.motor {
        let limits = ControlConfig::REFERENCE.limits;
        let faster = motor.limit / DEFAULT.servo.motor.limit;
        let of_motor = [
            ("app.motor_counts_per_radps", motor.counts_per_unit),
            ("app.motor_limit_radps", motor.limit),
            ("app.propeller_limit_radps", motor.limit),
            ("app.propeller_rate_radps2", faster * limits.propeller_radps2),
        ];
        values.extend(of_motor.map(|(name, value)| (name.to_owned(), value)));
    }
    let control_law = match backseat.control_law {
        ControlLaw::Pd => 0.0,
        ControlLaw::Lqr => 1.0,
        ControlLaw::LqrOnReference => 2.0,
    };
    let helm = backseat.control_mode == ControlMode::Oms;
    let app: [(&str, f64); 19] = [
        ("app.origin_lat_deg", environment.origin_latitude_deg),
        ("app.origin_lon_deg", environment.origin_longitude_deg),
        ("app.declination_rad", environment.magnetic_declination_rad),
        ("app.dvl_mounting_rad", crate::devices::DVL_MOUNTING_RAD),
        ("app.clock_encoding", 1.0), // bit field
        ("app.doppler_sign", 1.0),   // positive closing
        ("app.use_range_rate", f64::from(u8::from(backseat.range_rate))),
        ("app.use_rates", f64::from(u8::from(backseat.rates))),
        ("app.use_dvl", f64::from(u8::from(backseat.dvl))),
        ("app.robust", f64::from(u8::from(backseat.robust))),
        ("app.receiver_bias_m", backseat.receiver_bias_m),
        ("app.alert_horizontal_m", settings.alert.horizontal_m),
        ("app.alert_depth_m", settings.alert.depth_m),
        ("app.separate", settings.separate.parameter()),
        ("app.log_required", f64::from(u8::from(settings.log_required))),
        ("app.current_state", f64::from(u8::from(backseat.current_state))),
        ("app.control_law", control_law),
        ("app.control_mode", f64::from(u8::from(helm))),
        // A frontseat that steers by itself reports its fins only in its state: the model needs them often.
        ("app.status_rate_hz", if helm { 10.0 } else { 1.0 }),
    ];
    values.extend(app.map(|(name, value)| (name.to_owned(), value)));
    values.extend(settings.fittings.parameters());
    // what the vehicle file says of its board, after what is usual
    values.extend(scenario.vehicle.app.iter().cloned());
    values.extend(cycle(scenario).map(|(name, value)| (name.to_owned(), value)));
    values
}

/// The vehicle's own slots, none where all of them are the ship's, and its address.
fn cycle(scenario: &Scenario) -> impl Iterator<Item = (&'static str, f64)> {
    let acoustics = &scenario.settings.acoustics;
    let period_s = acoustics.period_s.get();
    let first_s = scenario.settings.environment.start_unix_s.wrapping_add(acoustics.first_s);
    let at = |exchange: Exchange| {
        let slot = acoustics.slots.iter().find(|slot| slot.exchange == exchange && slot.companion.is_none())?;
        Some(f64::from(first_s.wrapping_add(slot.offset_s) % period_s))
    };
    let address = (acoustics.address != DEFAULT.modem_address).then_some(acoustics.address);
    let address = address.map(|address| ("app.modem_address", f64::from(address)));
    let (uplink, ping) = (at(Exchange::Uplink), at(Exchange::TwoWay));
    let period = uplink.or(ping).map(|_| ("app.cycle_period_s", f64::from(period_s)));
    let peers = scenario.settings.backseat.peers.then_some(("app.use_peers", 1.0));
    let slots = [uplink.map(|at_s| ("app.uplink_at_s", at_s)), ping.map(|at_s| ("app.ping_at_s", at_s))];
    period.into_iter().chain(slots.into_iter().flatten()).chain(address).chain(peers)
}
