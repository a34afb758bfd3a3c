//! The filters of the table.

use super::cases::MissionCase;
use backseat_core::navigation::ProcessModel;
use backseat_estimation::filter::{FilterOptions, ShipSource};
use backseat_logs::VehicleFile;

/// The robust filter without the bank.
const ALONE: &str = "robust without its bank";

fn alone(mut robust: FilterOptions) -> FilterOptions {
    robust.navigation.bank = false;
    robust.smooth = false;
    robust
}

/// The filters that give the bound: over measurements without noise they stay at the truth, and their covariance is
/// that of the problem linearised there.
pub fn bounds(case: &MissionCase, declared: &VehicleFile) -> Vec<(&'static str, FilterOptions)> {
    let names = [("nominal", "bound of the nominal problem (DRMS)"), (ALONE, "bound of the robust problem (DRMS)")];
    let filters = filters(case, declared).into_iter();
    filters.filter_map(|(name, options)| Some((names.iter().find(|(of, _)| *of == name)?.1, options))).collect()
}

fn base(case: &MissionCase, declared: &VehicleFile, model: ProcessModel) -> FilterOptions {
    let mut options = FilterOptions::new(declared, model);
    options.ship = ShipSource::Packet;
    options.use_dvl = case.has_dvl;
    options.use_rates = case.rates;
    options.use_range_rate = false;
    options
}

/// The robust filter.
pub fn robust(case: &MissionCase, declared: &VehicleFile) -> FilterOptions {
    let mut options = base(case, declared, ProcessModel::Dynamic);
    options.navigation.make_robust();
    options
}

/// The filters over the log of a case, to which this vehicle is declared, in the order of the table.
pub fn filters(case: &MissionCase, declared: &VehicleFile) -> Vec<(&'static str, FilterOptions)> {
    let base = |model| base(case, declared, model);
    let mut filters = vec![("nominal", base(ProcessModel::Dynamic))];
    let robust = FilterOptions { smooth: true, ..robust(case, declared) };
    filters.push(("robust", robust));
    if case.is_declared {
        filters.push((ALONE, alone(robust)));
        let kinematic = base(ProcessModel::Kinematic);
        let mut stiff = kinematic;
        stiff.navigation.process_noise.linear_mps2_per_sqrt_hz = [1.0e-3, 1.0e-3, 1.0e-2];
        let mut tight = kinematic;
        tight.use_dvl = true;
        tight.navigation.process_noise.linear_mps2_per_sqrt_hz = [4.0e-3, 8.0e-3, 4.0e-3];
        tight.navigation.process_noise.angular_radps2_per_sqrt_hz = [6.0e-3, 6.0e-3, 1.5e-2];
        filters.push(("kinematic, loose Q", kinematic));
        filters.push(("kinematic, q_u,v = 1e-3", stiff));
        filters.push(("kinematic + DVL, Q of the straight lines", tight));
    }
    filters
}
