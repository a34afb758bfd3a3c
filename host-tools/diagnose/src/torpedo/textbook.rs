//! The textbook's model of the vehicle before anything is fitted.

use backseat_identify::short_runs::predict::{CHANNELS, Squares, open_loop};
use backseat_identify::short_runs::{Run, RunModel};
use backseat_logs::VehicleFile;
use backseat_logs::stats::{median, rms};

/// Makes room for the propeller speed of the runs: if they have more than is declared, it is that of the motor, before a
/// gear that nobody states. The thrust then follows from the usual speed at the usual propeller speed.
pub fn calibrated(declared: &VehicleFile, runs: &[Run]) -> (VehicleFile, Vec<String>) {
    let mut vehicle = declared.clone();
    let fast = runs.iter().flat_map(|run| &run.samples).map(|sample| sample.input.propeller_radps).fold(0.0, f64::max);
    if fast <= vehicle.parameters.omega_max_radps {
        return (vehicle, Vec::new());
    }
    let (mut speeds, mut ratios) = (Vec::new(), Vec::new());
    for sample in runs.iter().flat_map(|run| &run.samples) {
        if let Some([u, ..]) = sample.dvl_mps
            && sample.is_powered()
            && sample.depth_m > 0.5
            && u > 0.5
        {
            speeds.push(u);
            ratios.push(u / sample.input.propeller_radps);
        }
    }
    let plant = &mut vehicle.parameters;
    plant.omega_max_radps = (1.3 * fast).ceil();
    let Some(ratio) = median(&ratios) else { return (vehicle, Vec::new()) };
    let fins = 2.0 * plant.rho_kg_per_m3 * plant.fin_area_m2 * plant.cd[0];
    plant.beta5_n_s2_per_rad2 = (plant.quadratic_diag[0] + fins) * ratio * ratio;
    let note = format!(
        "prop_rpm reaches {:.0} rad/s where the vehicle file allows {:.0}: it is that of the motor, whose gear is not known; \
         the textbook's thrust is that of its drag at {:.4} m/s per rad/s, the median of {} readings",
        fast,
        declared.parameters.omega_max_radps,
        ratio,
        speeds.len()
    );
    (vehicle, vec![note])
}

/// Time over which the model's errors show what it leaves to chance, s.
const GROWTH_S: f64 = 5.0;
/// Readings further apart differ by more than noise, s.
const NEXT_S: f64 = 1.5;

/// Takes over noise where the runs have more than is declared: that of the DVL by the difference of one reading from the
/// next, half the square of which is noise; that of the motion by how far predictions are off. An acceleration of
/// density σ² makes a variance of σ² t of a velocity and σ² t³/3 of an angle, σ² T/2 and σ² T³/12 in the mean over T.
pub fn set_noise(vehicle: &mut VehicleFile, runs: &[Run], models: &[RunModel]) {
    let mut steps = Vec::new();
    for run in runs {
        let readings = run.samples.iter().filter(|sample| sample.is_powered() && sample.depth_m > 0.5);
        let readings: Vec<(f64, [f64; 3])> =
            readings.filter_map(|sample| Some((sample.t_s, sample.dvl_mps?))).collect();
        for pair in readings.windows(2).filter(|pair| pair[1].0 - pair[0].0 < NEXT_S) {
            steps.extend([0, 1].map(|axis| (pair[1].1[axis] - pair[0].1[axis]) / 2.0_f64.sqrt()));
        }
    }
    let dvl_mps = rms(&steps).unwrap_or(0.0);
    vehicle.sensors.dvl_mps = vehicle.sensors.dvl_mps.max(rounded(dvl_mps, 1e3));
    let squares = open_loop(runs, models, GROWTH_S).iter().fold(Squares::default(), |sum, squares| sum.plus(squares));
    let of = |channel: usize| squares.rms(channel).map_or(0.0, |rms| rms / CHANNELS[channel].1);
    let along = |channel: usize| ((of(channel).powi(2) - dvl_mps.powi(2)).max(0.0) * 2.0 / GROWTH_S).sqrt();
    let about = |channel: usize| of(channel) * (12.0 / GROWTH_S.powi(3)).sqrt();
    let larger = |declared: &mut f64, found: f64| *declared = declared.max(rounded(found, 1e4));
    let [u, v, w] = &mut vehicle.noise.linear_mps2_per_sqrt_hz;
    [(u, along(4)), (v, along(5)), (w, along(5))].into_iter().for_each(|(declared, found)| larger(declared, found));
    let angular = vehicle.noise.angular_radps2_per_sqrt_hz.iter_mut().enumerate();
    angular.for_each(|(axis, declared)| larger(declared, about(axis)));
}

fn rounded(value: f64, parts: f64) -> f64 {
    (parts * value).round() / parts
}

/// What the runs say of a board: its law, the speed that the vehicle is flown at, m/s, and how far its fins are turned,
/// rad, within their stops. A board that turns them less may not get it below the surface.
pub fn of_board(runs: &[Run], vehicle: &VehicleFile, dvl_scale: f64) -> Vec<(String, f64)> {
    let samples = || runs.iter().flat_map(|run| &run.samples).filter(|sample| sample.is_powered());
    let rounded = |value: f64| rounded(value, 100.0);
    let speeds: Vec<f64> =
        samples().filter(|sample| sample.depth_m > 0.5).filter_map(|s| Some(s.dvl_mps?[0])).collect();
    let usual: Vec<f64> = speeds.into_iter().filter(|u| *u > 0.5).map(|u| u / (1.0 + dvl_scale)).collect();
    let turned = samples().flat_map(|sample| sample.input.fins_rad).fold(0.0, |most: f64, fin| most.max(fin.abs()));
    // a vehicle that hardly rights itself is beyond what the gains of a linear-quadratic regulator hold
    let mut all = vec![("app.control_law".to_owned(), 0.0)];
    // what a board admits as its cruise speed
    let usual = median(&usual).map(rounded).filter(|speed_mps| (0.5..=3.0).contains(speed_mps));
    all.extend(usual.map(|speed_mps| ("app.cruise_speed_mps".to_owned(), speed_mps)));
    let limit_rad = rounded(turned.min(vehicle.parameters.delta_max_rad));
    if limit_rad > 0.0 {
        all.push(("app.fin_limit_rad".to_owned(), limit_rad));
    }
    all
}
