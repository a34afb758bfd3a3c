//! `backseat studies navigation`: the navigation table over an ensemble of seeded missions.
//!
//! Each seed is flown twice in this process (still water; 0.15 m/s current with current states), closed
//! loop, LQR on the backseat's own estimate. The measurements of each flight then go through the
//! filters of the table. Conditions: ten 1 km lines at 1 m/s and 3 m depth; depth 7 Hz, attitude 3 Hz
//! with 1 degree and **no rates**, ranges every 30 s with 1 m and no range rate, ship on a 600 m circle
//! with GNSS of 0.5 m at 1 Hz, vehicle GNSS only while surfaced at either end.

use crate::EnsembleArguments;
use crate::ensemble::run_all;
use crate::table::{markdown_table, with_interval};
use anyhow::Context;
use backseat_core::navigation::ProcessModel;
use backseat_data::filter::{self, FilterOptions};
use backseat_data::stats::{mean, mean_ci95, nis_bounds95};
use backseat_data::{Truth, VehicleFile};
use backseat_link::Client;
use hil_sim::analysis::{self, Configuration, Nis, NisBySensor};
use hil_sim::backseat::InProcess;
use hil_sim::flight::{self, FlightLog};
use hil_sim::scenario::{Scenario, perturbed};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

/// A filter of the table.
struct Filter {
    name: &'static str,
    current: bool,
    options: FilterOptions,
    vehicle: VehicleFile,
}

/// One row of the table, over all runs.
#[derive(Default)]
struct Row {
    median_m: Vec<f64>,
    p95_m: Vec<f64>,
    rms_m: Vec<f64>,
    drms_m: Vec<f64>,
    nis: NisBySensor,
}

impl Row {
    fn add(&mut self, configuration: &Configuration) {
        self.median_m.push(configuration.error.median_m);
        self.p95_m.push(configuration.error.p95_m);
        self.rms_m.push(configuration.error.rms_m);
        self.drms_m.extend(configuration.drms_m);
        for (sensor, nis) in &configuration.nis {
            let pooled: &mut Nis = self.nis.entry(sensor).or_default();
            pooled.sum += nis.sum;
            pooled.count += nis.count;
            pooled.rejected += nis.rejected;
        }
    }

    fn ratio(&self, reference_m: &[f64]) -> Option<f64> {
        Some(mean(&self.rms_m)? / mean(reference_m)?)
    }
}

/// Flies and prints the table.
///
/// # Errors
/// A flight or a filter that fails; a file that cannot be written.
pub fn run(arguments: &EnsembleArguments) -> anyhow::Result<()> {
    let seeds = arguments.first_seed..arguments.first_seed + arguments.runs;
    let plan: Vec<(u64, bool)> = seeds.flat_map(|seed| [(seed, false), (seed, true)]).collect();
    let outcomes: Vec<Vec<(&'static str, Configuration, Option<Configuration>)>> =
        run_all("flights", &plan, |(seed, current)| one_flight(arguments, *seed, *current))?;

    let mut order: Vec<&'static str> = Vec::new();
    let mut rows: BTreeMap<&'static str, (Row, Row)> = BTreeMap::new();
    for (name, configuration, floor) in outcomes.iter().flatten() {
        if !order.contains(name) {
            order.push(name);
        }
        let (row, floors) = rows.entry(name).or_default();
        row.add(configuration);
        if let Some(floor) = floor {
            floors.add(floor);
        }
    }
    let rows: Vec<(&str, &Row, &Row)> = order.iter().map(|name| (*name, &rows[name].0, &rows[name].1)).collect();
    let text = markdown(arguments, &rows);
    if let Some(path) = &arguments.out {
        std::fs::write(path, &text).with_context(|| path.display().to_string())?;
    }
    if arguments.json {
        println!("{}", to_json(&rows));
    } else {
        print!("{text}");
    }
    Ok(())
}

/// Flies one seed and runs the filters; each with its linearised floor where it has a covariance.
fn one_flight(
    arguments: &EnsembleArguments,
    seed: u64,
    current: bool,
) -> anyhow::Result<Vec<(&'static str, Configuration, Option<Configuration>)>> {
    let mut scenario = Scenario::built_in(if current { "survey_current" } else { "survey" })?;
    scenario.settings.seed = seed;
    if let Some(minutes) = arguments.minutes {
        scenario.settings.duration_s = scenario.settings.duration_s.min(60.0 * minutes);
    }
    let flight = fly(&scenario)?;
    let truth = analysis::truth_of(&flight);
    // The same filters on noise-free sensors stay at the truth: their covariance is the linearised floor.
    let quiet = fly(&without_sensor_noise(&scenario))?;
    let quiet_truth = analysis::truth_of(&quiet);

    let mut outcomes = Vec::new();
    let (name, steered) = if current {
        ("backseat in 0.15 m/s current, packets", "LQR in 0.15 m/s current: true cross-track error")
    } else {
        ("backseat: dynamic, packets, range rate, rates", "LQR: true cross-track error")
    };
    let backseat = |name, flight: &FlightLog| analysis::backseat(name, flight);
    outcomes.extend(backseat(name, &flight).map(|configuration| (name, configuration, backseat(name, &quiet))));
    for filter in filters(&scenario.vehicle, seed).iter().filter(|filter| filter.current == current) {
        let judged = |flight: &FlightLog, truth: &Truth| -> anyhow::Result<Option<Configuration>> {
            let run = filter::run(&flight.log, &filter.vehicle, &filter.options)
                .with_context(|| format!("{}, seed {seed}", filter.name))?;
            Ok(analysis::of_run(filter.name, &run, truth))
        };
        if let Some(configuration) = judged(&flight, &truth)? {
            outcomes.push((filter.name, configuration, judged(&quiet, &quiet_truth)?));
        }
    }
    if let Some(track) = analysis::track_of(&scenario, &flight) {
        outcomes.push((steered, Configuration::of_error(steered, track.cross_track), None));
    }
    Ok(outcomes)
}

fn fly(scenario: &Scenario) -> anyhow::Result<FlightLog> {
    let mut client = Client::new(InProcess::new());
    let flight = flight::fly(scenario, &mut client, None, &AtomicBool::new(false), |_| {});
    flight.with_context(|| format!("flight {} of seed {}", scenario.settings.name, scenario.settings.seed))
}

fn without_sensor_noise(scenario: &Scenario) -> Scenario {
    let mut quiet = scenario.clone();
    let sensors = &mut quiet.settings.sensors;
    sensors.depth.sigma_m = Some(0.0);
    sensors.ahrs.attitude_sigma_rad = Some(0.0);
    sensors.ahrs.rates_sigma_radps = Some(0.0);
    sensors.dvl.sigma_mps = Some(0.0);
    sensors.gnss.sigma_m = Some(0.0);
    sensors.ship_gnss.sigma_m = Some(0.0);
    quiet.settings.acoustics.range_sigma_m = Some(0.0);
    quiet.settings.acoustics.range_rate_sigma_mps = Some(0.0);
    quiet
}

/// The filters of the table.
fn filters(vehicle: &VehicleFile, seed: u64) -> Vec<Filter> {
    let base = |model, use_dvl| {
        let mut options = FilterOptions::new(vehicle, model);
        options.use_dvl = use_dvl;
        options.use_rates = false;
        options.use_range_rate = false;
        options
    };
    let dynamic = base(ProcessModel::Dynamic, false);
    let mut stiff = base(ProcessModel::Kinematic, false);
    stiff.navigation.process_noise.linear_mps2_per_sqrt_hz = [1.0e-3, 1.0e-3, 1.0e-2];
    let mut tight = base(ProcessModel::Kinematic, true);
    tight.navigation.process_noise.linear_mps2_per_sqrt_hz = [4.0e-3, 8.0e-3, 4.0e-3];
    tight.navigation.process_noise.angular_radps2_per_sqrt_hz = [6.0e-3, 6.0e-3, 1.5e-2];
    let mut with_current = dynamic;
    with_current.navigation.effect_states = FilterOptions::water_current();
    let mut packets = dynamic;
    packets.ship = filter::ShipSource::Packet;
    let wrong = |share: f64| VehicleFile { parameters: perturbed(&vehicle.parameters, share, seed), ..vehicle.clone() };
    let filter =
        |name, current, options, vehicle: &VehicleFile| Filter { name, current, options, vehicle: vehicle.clone() };
    vec![
        filter("dynamic, no DVL", false, dynamic, vehicle),
        filter("dynamic, no DVL, ship from packets", false, packets, vehicle),
        filter("dynamic, no DVL, parameters wrong by 5 %", false, dynamic, &wrong(0.05)),
        filter("dynamic, no DVL, parameters wrong by 10 %", false, dynamic, &wrong(0.10)),
        filter("kinematic, no DVL, loose Q", false, base(ProcessModel::Kinematic, false), vehicle),
        filter("kinematic, no DVL, q_u,v = 1e-3", false, stiff, vehicle),
        filter("kinematic + DVL", false, base(ProcessModel::Kinematic, true), vehicle),
        filter("kinematic + DVL, Q of the straight lines", false, tight, vehicle),
        filter("0.15 m/s current: dynamic without current state", true, dynamic, vehicle),
        filter("0.15 m/s current: dynamic with current state", true, with_current, vehicle),
    ]
}

fn markdown(arguments: &EnsembleArguments, rows: &[(&str, &Row, &Row)]) -> String {
    let EnsembleArguments { runs, first_seed, .. } = arguments;
    let last_seed = first_seed + runs - 1;
    let cut = arguments.minutes.map_or(String::new(), |minutes| format!(" --minutes {minutes}"));
    let mut text = format!(
        "# Navigation over an ensemble of missions\n\n\
         Made by `backseat studies navigation --runs {runs} --first-seed {first_seed}{cut}` (seeds {first_seed} to {last_seed}).\n\n\
         Ten 1 km lines 100 m apart, 1 m/s, 3 m depth, closed loop (LQR on the backseat's own estimate). Unless a row says otherwise:\n\
         depth 7 Hz 0.06 m, attitude 3 Hz 1 degree, no rates, range every 30 s with 1 m, no range rate, ship on a 600 m circle with\n\
         GNSS of 0.5 m at 1 Hz, GNSS of the vehicle only while surfaced at either end; truth and filter share the parameters.\n\
         Mean over the runs of each run's median and 95th percentile of the horizontal error, with the 95 % interval of that mean.\n\
         RMS over own DRMS: above 1 the filter believes too much. The floor is the same filter's DRMS when linearised at the truth\n\
         (flights with noise-free sensors).\n\n"
    );
    let mut errors =
        markdown_table(["navigation", "median [m]", "95 % [m]", "RMS [m]", "RMS / own DRMS", "RMS / floor"]);
    let ratio = |ratio: Option<f64>| ratio.map_or(String::new(), |ratio| format!("{ratio:.2}"));
    for (name, row, floor) in rows {
        errors.add_row([
            (*name).to_owned(),
            with_interval(&row.median_m, 2),
            with_interval(&row.p95_m, 2),
            format!("{:.2}", mean(&row.rms_m).unwrap_or(f64::NAN)),
            ratio(row.ratio(&row.drms_m)),
            ratio(row.ratio(&floor.drms_m)),
        ]);
    }
    text += &format!("{errors}\n");
    text += "\nThe kinematic model's loose Q (1, 2, 1 e-2 m/s²/√Hz; 2, 2, 5 e-2 rad/s²/√Hz) has to cover the turns, which a constant velocity\n\
             does not predict: on the lines its NIS of attitude and DVL stays below 1. A Q that fits the lines (4, 8, 4 e-3; 6, 6, 15 e-3)\n\
             contradicts compass and DVL in the turns: by doubting both the filter keeps the vehicle, and knows far less than it could.\n\
             Wrong parameters: inertia, drag, fins and thrust each off by the share, with signs drawn by the seed. In the current rows the\n\
             prior of 0.3 m/s is wider than the current of 0.15 m/s, so the first ranges fit better than it expects. `ship from packets` takes the raw fix at launch for the ship's position with its 0.5 m.\n";
    text += "\nMean normalised innovation squared, pooled over the runs (95 % interval of a consistent filter's; rejected scalars)\n\n";
    let sensors: Vec<&str> = backseat_core::navigation::Sensor::ALL.iter().map(|sensor| sensor.name()).collect();
    let sensors: Vec<&str> =
        sensors.into_iter().filter(|sensor| rows.iter().any(|(_, row, _)| row.nis.contains_key(sensor))).collect();
    let mut innovations = markdown_table(["navigation"].iter().chain(&sensors).copied());
    for (name, row, _) in rows.iter().filter(|(_, row, _)| !row.nis.is_empty()) {
        let cells = sensors.iter().map(|sensor| match row.nis.get(sensor).filter(|nis| nis.count > 0) {
            Some(nis) => {
                let (low, high) = nis_bounds95(nis.count).unwrap_or((f64::NAN, f64::NAN));
                format!("{:.3} ({low:.2} to {high:.2}; {})", nis.mean(), nis.rejected)
            }
            None => "-".to_owned(),
        });
        innovations.add_row(std::iter::once((*name).to_owned()).chain(cells));
    }
    text + &format!("{innovations}\n")
}

fn to_json(rows: &[(&str, &Row, &Row)]) -> Value {
    let configurations = rows.iter().map(|(name, row, floor)| {
        let nis: serde_json::Map<String, Value> = row
            .nis
            .iter()
            .map(|(sensor, nis)| {
                ((*sensor).to_owned(), json!({"mean": nis.mean(), "count": nis.count, "rejected": nis.rejected}))
            })
            .collect();
        json!({
            "name": name,
            "runs": row.median_m.len(),
            "median_m": mean(&row.median_m), "median_ci95_m": mean_ci95(&row.median_m),
            "p95_m": mean(&row.p95_m), "p95_ci95_m": mean_ci95(&row.p95_m),
            "rms_over_drms": row.ratio(&row.drms_m), "rms_over_floor": row.ratio(&floor.drms_m),
            "nis": nis,
        })
    });
    json!({"configurations": configurations.collect::<Vec<_>>()})
}
