//! Packet against centralized on one flight.

use super::{Packet, PacketFed, lose, packets, reports, thin_fixes, track};
use crate::flights;
use anyhow::{Context, anyhow, ensure};
use backseat_analysis::flight_score;
use backseat_core::dynamics::VehicleModel;
use backseat_core::navigation::{InitialSpeed, InitialState, NavigationConfig, ProcessModel};
use backseat_core::state::{X, Y};
use backseat_estimation::filter::{self, FilterOptions, Start, TrackSample};
use backseat_logs::stats::{ErrorSummary, rms};
use backseat_logs::{Column, Log, LogRow, Truth};
use backseat_report::markdown::markdown_table;
use backseat_wire::ship_state;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::Scenario;
use std::fmt::Write as _;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  cargo lab packet-navigation
  cargo lab packet-navigation --seed 7 --minutes 60")]
pub struct Args {
    /// Seed of all randomness
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// End after this simulated time
    #[arg(long, value_name = "MINUTES")]
    minutes: Option<f64>,
}

/// Between the ship's fixes where they are rare, s: two packets to a fix.
const RARE_FIX_S: u64 = 60;
/// Share of the packets that the last part loses.
const LOST: f64 = 0.3;

/// Both filters on one supply of ship fixes.
struct Supply {
    heading: String,
    centralized: FilterScore,
    packet_fed: FilterScore,
}

/// A filter against the truth, once a second.
struct FilterScore {
    error: ErrorSummary,
    /// One sigma by the filter's own covariance, root mean square, m.
    drms_m: f64,
}

impl FilterScore {
    fn of(track: &[TrackSample], truth: &Truth) -> anyhow::Result<Self> {
        let (mut errors_m, mut bounds_m) = (Vec::new(), Vec::new());
        for row in &truth.rows {
            let Ok(at) = track.binary_search_by_key(&row.time_us, |sample| sample.time_us) else { continue };
            let sample = &track[at];
            errors_m.push((sample.state[X] - row.state[X]).hypot(sample.state[Y] - row.state[Y]));
            bounds_m.push(sample.drms_m());
        }
        let error = ErrorSummary::of(&errors_m).context("the log has no row at a time of the truth")?;
        Ok(Self { error, drms_m: rms(&bounds_m).unwrap_or(f64::NAN) })
    }
}

/// Flies the survey and prints the table.
///
/// # Errors
/// A flight or a filter that fails.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let mut scenario = Scenario::built_in("survey")?;
    scenario.settings.seed = arguments.seed;
    if let Some(minutes) = arguments.minutes {
        ensure!(minutes > 0.0 && minutes.is_finite(), "--minutes {minutes}: a positive number is needed");
        scenario.settings.duration_s = scenario.settings.duration_s.min(minutes * 60.0);
    }
    let flight = flights::fly(&scenario)?;
    let truth = flight_score::truth_of(&flight);

    let mut options = FilterOptions::new(&scenario.vehicle, ProcessModel::Dynamic);
    options.use_dvl = false;
    options.track_interval_us = 0;
    // Neither filter refuses a measurement, so that both fuse the same ones.
    options.navigation.gate_sigma = 1e3;
    options.navigation.range_curvature = 1e6; // ranges to first order
    let speed_mps = scenario.settings.start.speed_mps;
    let (log, start) = from_first_fix(&flight.log, speed_mps, &options.navigation)
        .context("the flight has no fix, depth, attitude and actuators to start from")?;
    options.start = Some(start);
    let on =
        |heading: String, log: &Log, lost: &[Packet]| compare(heading, &lose(log, lost), &truth, &scenario, &options);
    let rare = thin_fixes(&log, RARE_FIX_S * 1_000_000);
    let mut random = Stream::new(arguments.seed, Source::Outliers);
    let lost: Vec<Packet> = packets(&log).into_iter().filter(|_| random.uniform() < LOST).collect();
    let share = 100.0 * lost.len() as f64 / packets(&log).len().max(1) as f64;
    let supplies = [
        on("every second".into(), &log, &[])?,
        on(format!("every {RARE_FIX_S} s"), &rare, &[])?,
        on(format!("every {RARE_FIX_S} s, {share:.0} % of the packets lost"), &rare, &lost)?,
    ];
    let flown = flight_score::backseat("as flown on the board", &flight);
    let text = table(&supplies, flown.as_ref()) + &notes(arguments, &supplies, flight.simulated_s);
    backseat_report::console::print(text.as_bytes())
}

fn compare(
    heading: String,
    log: &Log,
    truth: &Truth,
    scenario: &Scenario,
    options: &FilterOptions,
) -> anyhow::Result<Supply> {
    let (vehicle, config) = (&scenario.vehicle, &options.navigation);
    let start = options.start.context("the filters start from a given state")?;
    let start_us = log.rows.first().context("an empty log")?.time_us;
    let model = VehicleModel::new(&vehicle.parameters).map_err(|error| anyhow!("{error}"))?;
    let centralized = filter::run(log, vehicle, options)?.track;
    let received = packets(log);
    let reports = reports(log, &received, &scenario.settings.ship, config.sensors.ship_gnss_m);
    let packet_fed = PacketFed::new(start_us, &start.vehicle, config, &model, options.use_range_rate)?;
    let packet_fed = track(log, &received, &reports, packet_fed)?;
    Ok(Supply {
        heading,
        centralized: FilterScore::of(&centralized, truth)?,
        packet_fed: FilterScore::of(&packet_fed, truth)?,
    })
}

/// The log from where a filter can start, and the start; its own samples are used up.
fn from_first_fix(log: &Log, speed_mps: f64, config: &NavigationConfig) -> Option<(Log, Start)> {
    let (mut fix, mut depth_m, mut euler, mut rates, mut actuators) = (None, None, None, None, None);
    for (index, row) in log.rows.iter().enumerate() {
        fix = row.gnss_m().or(fix);
        depth_m = row.get(Column::Depth).or(depth_m);
        euler = row.attitude_rad().or(euler);
        rates = row.rates_radps().or(rates);
        actuators = row.actuators().or(actuators);
        let (Some(fix_m), Some(depth_m), Some(euler), Some(rates), Some(input)) =
            (fix, depth_m, euler, rates, actuators)
        else {
            continue;
        };
        let speed = InitialSpeed::Commanded(speed_mps);
        let vehicle = InitialState::from_fix(fix_m, config.sensors.gnss_m, depth_m, euler, rates, speed, config);
        let mut first = LogRow::new(row.time_us);
        first.set_actuators(&input);
        let mut rows = vec![first];
        rows.extend_from_slice(&log.rows[index + 1..]);
        return Some((Log { rows, ..log.clone() }, Start { vehicle, ship: None }));
    }
    None
}

/// The filters of a supply, with the bytes that each packet carries about the ship.
fn filters(supply: &Supply) -> [(&'static str, &FilterScore, Option<usize>); 2] {
    [
        ("centralized, every ship fix", &supply.centralized, None),
        ("packet-fed, independent errors", &supply.packet_fed, Some(ship_state::LENGTH)),
    ]
}

fn table(supplies: &[Supply], flown: Option<&flight_score::Configuration>) -> String {
    let mut table =
        markdown_table(["ship fixes", "filter", "median [m]", "95 % [m]", "max [m]", "RMS / DRMS", "bytes"]);
    let mut row = |fixes: &str, name: &str, error: &ErrorSummary, drms_m: Option<f64>, bytes: Option<usize>| {
        let ratio = drms_m.map_or("-".into(), |drms_m| format!("{:.2}", error.rms_m / drms_m));
        let errors = [error.median_m, error.p95_m, error.max_m].map(|error_m| format!("{error_m:.3}"));
        let bytes = bytes.map_or("-".into(), |bytes| bytes.to_string());
        table.add_row([fixes.to_owned(), name.to_owned()].into_iter().chain(errors).chain([ratio, bytes]));
    };
    for supply in supplies {
        for (name, score, bytes) in filters(supply) {
            row(&supply.heading, name, &score.error, Some(score.drms_m), bytes);
        }
    }
    if let Some(flown) = flown {
        row("every second", flown.name, &flown.error, flown.drms_m, Some(ship_state::LENGTH));
    }
    format!("{table}\n")
}

fn notes(arguments: &Args, supplies: &[Supply], simulated_s: f64) -> String {
    let mut text = format!(
        "\nConditions: built-in survey, seed {}, {simulated_s:.0} s flown in lock-step on the backseat's own estimate; dynamic\n\
         model, no DVL, range and range rate every 30 s; no gates, and both filters start from one fix (the board gates and\n\
         starts by itself). Horizontal errors once a second. Bytes: the whole payload of a packet; an FSK frame holds 32.\n",
        arguments.seed
    );
    for Supply { heading, centralized, packet_fed } in supplies {
        let rms = 100.0 * (packet_fed.error.rms_m / centralized.error.rms_m - 1.0);
        let bound = 100.0 * (packet_fed.drms_m / centralized.drms_m - 1.0);
        let _ = writeln!(
            text,
            "Packet-fed against centralized, ship fixes {heading}: RMS error {rms:+.1} %, own bound {bound:+.1} %."
        );
    }
    text += "With fixes every second the ship forgets its errors between two packets, and ignoring their correlation costs nothing\n\
             beyond chance. With rare fixes every other packet extrapolates the turning ship and errs outwards (3 m after 30 s\n\
             even from a perfect velocity): the packet-fed filter takes each such error for a new one and is overconfident; the\n\
             centralized filter takes it back by correlation when the next fix is known.\n";
    text
}
