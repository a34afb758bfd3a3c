//! Initialisation from a log (2.3.1.2): a fix, the sensors of that time, DVL or commanded speed.

use super::FilterOptions;
use backseat_core::navigation::{InitialSpeed, InitialState};
use backseat_core::state::{U, V, X, Y};
use backseat_logs::log::{Column, Log, LogRow, RADPS_PER_RPM};
use backseat_logs::{DataError, VehicleFile};

/// Oldest fix the filter starts from, µs.
const MAX_FIX_AGE_US: u64 = 10_000_000;

/// The state at which a log can start, and the row to go on with.
pub(super) struct LogStart {
    pub time_us: u64,
    pub initial: InitialState,
    pub next_row: usize,
}

/// Gathers the latest fix and samples until all are there and the fix is young.
pub(super) fn first_fix(log: &Log, vehicle: &VehicleFile, options: &FilterOptions) -> Result<LogStart, DataError> {
    let wants_depth = log.has(Column::Depth);
    let first_dvl_us = log.rows.iter().find(|row| options.use_dvl && row.dvl_mps().is_some()).map(|row| row.time_us);
    let wants_propeller = log.has(Column::PropRpm);
    // a run that never had a fix counts from where it starts
    let is_own_origin = !log.runs.is_empty() && !log.has(Column::GpsX);
    // a vehicle that never surfaced in the log starts from where the ship saw it
    let by_usbl = !log.has(Column::GpsX);
    let gnss_sigma_m = options.navigation.sensors.gnss_m;
    let (mut fix, mut depth_m, mut euler, mut rates, mut dvl, mut propeller) = (None, None, None, None, None, None);
    for (index, row) in log.rows.iter().enumerate() {
        let gnss = row.gnss_m().or(is_own_origin.then_some([0.0; 2])).map(|fix_m| (row.time_us, fix_m, gnss_sigma_m));
        let seen = || seen_from_ship(row).map(|(fix_m, sigma_m)| (row.time_us, fix_m, sigma_m.hypot(gnss_sigma_m)));
        fix = gnss.or_else(|| seen().filter(|_| by_usbl)).or(fix);
        depth_m = row.get(Column::Depth).or(depth_m);
        euler = row.attitude_rad().or(euler);
        rates = row.rates_radps().or(rates);
        dvl = row.dvl_mps().or(dvl);
        propeller = row.get(Column::PropRpm).map(|rpm| rpm * RADPS_PER_RPM).or(propeller);
        let (Some((fix_us, fix_m, fix_sigma_m)), Some(euler)) = (fix, euler) else { continue };
        let age_us = row.time_us - fix_us;
        // a DVL that finds the bottom only after the fix is not waited for, where the propeller tells the speed
        let is_late = |dvl_us: u64| dvl_us > fix_us + MAX_FIX_AGE_US && propeller.is_some();
        let wants_dvl = first_dvl_us.is_some_and(|dvl_us| !is_late(dvl_us));
        let lacks_speed = if wants_dvl { dvl.is_none() } else { wants_propeller && propeller.is_none() };
        if (wants_depth && depth_m.is_none()) || lacks_speed || age_us > MAX_FIX_AGE_US {
            continue;
        }
        let speed = match dvl.filter(|_| wants_dvl) {
            Some(velocity) => InitialSpeed::Dvl(velocity),
            None => InitialSpeed::Commanded(steady_speed_mps(vehicle, propeller.unwrap_or(0.0))),
        };
        let config = &options.navigation;
        let mut initial = InitialState::from_fix(
            fix_m,
            fix_sigma_m,
            depth_m.unwrap_or(0.0),
            euler,
            rates.unwrap_or([0.0; 3]),
            speed,
            config,
        );
        bridge(&mut initial, age_us as f64 * 1e-6);
        return Ok(LogStart { time_us: row.time_us, initial, next_row: index + 1 });
    }
    let lacks = match (fix, euler) {
        (None, _) => "no fix of the vehicle (gps_x_m, gps_y_m, or usbl_range_m … with ship_x_m, ship_y_m)".to_owned(),
        (_, None) => lacking_attitude(log),
        _ => "no depth, DVL or propeller within 10 s of a fix".to_owned(),
    };
    Err(DataError::file(&log.path, format!("the filter cannot start: {lacks}")))
}

/// What of the attitude a log does not have.
fn lacking_attitude(log: &Log) -> String {
    let attitude = [Column::Roll, Column::Pitch, Column::Heading];
    let missing: Vec<&str> = attitude.iter().filter(|column| !log.has(**column)).map(|column| column.name()).collect();
    if missing.is_empty() {
        return "no attitude: no row has roll_rad, pitch_rad and heading_rad together".to_owned();
    }
    let missing = missing.join(", ");
    format!("no attitude ({missing}); of a vehicle that keeps level a mapping states roll and pitch under [constants]")
}

/// Where the ship's USBL saw the vehicle, north and east, m, and one sigma.
fn seen_from_ship(row: &LogRow) -> Option<([f64; 2], f64)> {
    let (usbl, [x_m, y_m]) = (row.usbl().filter(|usbl| !usbl.on_vehicle)?, row.ship_at_launch_m()?);
    let [north_m, east_m, _] = usbl.vector_m();
    Some(([x_m + north_m, y_m + east_m], usbl.range_m * usbl.angle_sigma_rad))
}

/// Moves the position from the fix's time to now along the initial velocity.
fn bridge(initial: &mut InitialState, age_s: f64) {
    let (u, v) = (initial.state[U], initial.state[V]);
    let (sin, cos) = initial.state[backseat_core::state::PSI].sin_cos();
    initial.state[X] += age_s * (u * cos - v * sin);
    initial.state[Y] += age_s * (u * sin + v * cos);
    let drift = age_s * initial.sigma[U].max(initial.sigma[V]);
    for axis in [X, Y] {
        initial.sigma[axis] = initial.sigma[axis].hypot(drift);
    }
}

/// Speed at which thrust (3.24) and straight-ahead drag balance, m/s.
pub(super) fn steady_speed_mps(vehicle: &VehicleFile, propeller_radps: f64) -> f64 {
    let p = &vehicle.parameters;
    let omega = propeller_radps.max(0.0);
    let fins = 4.0 * 0.5 * p.rho_kg_per_m3 * p.fin_area_m2 * p.cd[0];
    // a u² + b u = thrust
    let a = p.quadratic_diag[0] + fins;
    let b = p.linear_surge_ns_per_m + p.advance_n_s2_per_rad_m * omega;
    let thrust = p.beta5_n_s2_per_rad2 * omega * omega;
    2.0 * thrust / (b + (b * b + 4.0 * a * thrust).sqrt()).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_steady_speed_balances_the_forces() {
        let vehicle = VehicleFile::reference();
        assert_eq!(steady_speed_mps(&vehicle, 0.0), 0.0);
        // 1011.96 rpm drives the reference vehicle at 1 m/s (nav_mini_run.csv, first row): trim drag of the
        // fins, which is left out here, takes the last percent.
        let speed = steady_speed_mps(&vehicle, 1_011.955_139 * RADPS_PER_RPM);
        assert!((speed - 1.0).abs() < 0.02, "{speed}");
    }

    #[test]
    fn a_dvl_that_finds_the_bottom_after_the_dive_is_not_waited_for() {
        let vehicle = VehicleFile::reference();
        let options = FilterOptions::new(&vehicle, backseat_core::navigation::ProcessModel::Dynamic);
        let start_us = |dvl_us: u64| {
            let mut fix = LogRow::new(1_000_000);
            fix.set_all(Column::GpsX, &[5.0, 6.0]).set_all(Column::Roll, &[0.0; 3]);
            fix.set(Column::Depth, 0.1).set(Column::PropRpm, 1000.0);
            let mut dvl = LogRow::new(dvl_us);
            dvl.set_all(Column::DvlU, &[1.0, 0.0, 0.0]);
            let log = Log { rows: vec![fix, dvl], ..Log::default() };
            first_fix(&log, &vehicle, &options).unwrap().time_us
        };
        assert_eq!([3_000_000, 74_000_000].map(start_us), [3_000_000, 1_000_000]);
    }
}
