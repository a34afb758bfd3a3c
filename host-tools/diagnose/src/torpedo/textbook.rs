//! The textbook's model of the vehicle before anything is fitted.

use backseat_identify::short_runs::Run;
use backseat_logs::VehicleFile;
use backseat_logs::stats::median;

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

/// Median speed with the motor on under water, m/s.
pub fn usual_mps(runs: &[Run]) -> f64 {
    let samples = runs.iter().flat_map(|run| &run.samples).filter(|sample| sample.is_powered() && sample.depth_m > 0.5);
    let speeds: Vec<f64> = samples.filter_map(|sample| Some(sample.dvl_mps?[0])).filter(|u| *u > 0.5).collect();
    median(&speeds).unwrap_or(0.0)
}
