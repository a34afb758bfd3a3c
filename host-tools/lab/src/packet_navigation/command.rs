//! `cargo lab packet-navigation`: packet against centralized on one flight.

use crate::packet_navigation::{HEADER, METHODS, Method, NUMBERS, Packet, packets, study, thin_fixes};
use anyhow::{Context, ensure};
use backseat_analysis::flight_score;
use backseat_core::navigation::{InitialSpeed, InitialState, NavigationConfig, ProcessModel};
use backseat_estimation::filter::{FilterOptions, Start};
use backseat_link::Client;
use backseat_logs::{Column, Log, LogRow};
use backseat_report::console::Progress;
use backseat_wire::ship_state;
use hil_sim::backseat::InProcess;
use hil_sim::flight;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::Scenario;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  cargo lab packet-navigation
  cargo lab packet-navigation --seed 7 --minutes 60 --json")]
pub struct Args {
    /// Seed of all randomness.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// End after this simulated time.
    #[arg(long, value_name = "MINUTES")]
    minutes: Option<f64>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Between the ship's fixes where they are rare, s: two packets to a fix.
const RARE_FIX_S: u64 = 60;
/// Share of the packets that the last part loses.
const LOST: f64 = 0.3;

/// The methods on one supply of ship fixes.
struct Part {
    heading: String,
    methods: Vec<Method>,
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
    let duration_s = scenario.settings.duration_s;
    let progress = Progress::new("simulated seconds", duration_s as usize);
    let mut client = Client::new(InProcess::new());
    let stop = AtomicBool::new(false);
    let flight = flight::fly(&scenario, &mut client, None, &stop, |t_s| progress.set(t_s as usize))?;
    let truth = flight_score::truth_of(&flight);
    drop(progress);
    let progress = Progress::new("filters", 3 * METHODS);

    let mut options = FilterOptions::new(&scenario.vehicle, ProcessModel::Dynamic);
    options.use_dvl = false;
    options.track_interval_us = 0;
    // No filter rejects measurements: see the module of the comparison.
    options.navigation.gate_sigma = 1e3;
    options.navigation.range_curvature = 1e6; // the information filter is of first order
    let speed_mps = scenario.settings.start.speed_mps;
    let (log, start) = from_first_fix(&flight.log, speed_mps, &options.navigation)
        .context("the flight has no fix, depth, attitude and actuators to start from")?;
    options.start = Some(start);
    let (vehicle, ship) = (&scenario.vehicle, &scenario.settings.ship);
    let judge = |log: &Log, lost: &[Packet]| study(log, lost, &truth, vehicle, &options, ship, || progress.advance());
    let rare = thin_fixes(&log, RARE_FIX_S * 1_000_000);
    let mut random = Stream::new(arguments.seed, Source::Outliers);
    let lost: Vec<Packet> = packets(&log).into_iter().filter(|_| random.uniform() < LOST).collect();
    let share = 100.0 * lost.len() as f64 / packets(&log).len().max(1) as f64;
    let parts = [
        Part { heading: "every second".into(), methods: judge(&log, &[])? },
        Part { heading: format!("every {RARE_FIX_S} s"), methods: judge(&rare, &[])? },
        Part {
            heading: format!("every {RARE_FIX_S} s, {share:.0} % of the packets lost"),
            methods: judge(&rare, &lost)?,
        },
    ];
    drop(progress);

    let flown = flight_score::backseat("packet-fed, as flown on the board", &flight);
    if arguments.json {
        println!("{}", json!({"seed": arguments.seed, "simulated_s": flight.simulated_s, "parts": to_json(&parts)}));
        return Ok(());
    }
    print!("{}", table(&parts, flown.as_ref()));
    print!("{}", notes(arguments, &parts, flight.simulated_s));
    Ok(())
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

fn table(parts: &[Part], flown: Option<&flight_score::Configuration>) -> String {
    let mut text = format!(
        "{:<34} {:>7} {:>7} {:>7} {:>8} {:>6} {:>28}\n{:<34} {:>7} {:>7} {:>7} {:>8} {:>6} {:>10} {:>8} {:>8}\n",
        "horizontal error [m]",
        "median",
        "95 %",
        "max",
        "RMS/DRMS",
        "bytes",
        "DEIF - centralized, largest",
        "",
        "",
        "",
        "",
        "",
        "each",
        "position",
        "state",
        "sigma"
    );
    for part in parts {
        let _ = writeln!(text, "ship fixes {}", part.heading);
        for method in &part.methods {
            let bytes = method.bytes.map_or("-".into(), |bytes| bytes.to_string());
            let judged = match &method.result {
                Ok(judged) => judged,
                Err(reason) => {
                    let _ = writeln!(text, "  {:<32} {:>32} {bytes:>6}  {reason}", method.name, "");
                    continue;
                }
            };
            let error = &judged.error;
            let ratio = error.rms_m / judged.drms_m;
            let _ = write!(
                text,
                "  {:<32} {:>7.3} {:>7.3} {:>7.3} {ratio:>8.2} {bytes:>6}",
                method.name, error.median_m, error.p95_m, error.max_m
            );
            if let Some(difference) = &judged.difference {
                let _ = write!(
                    text,
                    " {:>8.1e} m {:>8.1e} {:>8.1e}",
                    difference.position_m, difference.sigmas, difference.sigma_ratio
                );
            }
            text.push('\n');
        }
    }
    if let Some(flown) = flown {
        let error = &flown.error;
        let ratio = flown.drms_m.map_or("-".into(), |drms_m| format!("{:.2}", error.rms_m / drms_m));
        let _ = writeln!(
            text,
            "{:<34} {:>7.3} {:>7.3} {:>7.3} {ratio:>8} {:>6}",
            flown.name,
            error.median_m,
            error.p95_m,
            error.max_m,
            ship_state::LENGTH
        );
    }
    text
}

fn notes(arguments: &Args, parts: &[Part], simulated_s: f64) -> String {
    let mut text = format!(
        "\nConditions: built-in survey, seed {}, {simulated_s:.0} s flown in lock-step on the backseat's own estimate; dynamic\n\
         model, no DVL, range and range rate every 30 s; no gates, and all start from one fix (the board gates and starts by\n\
         itself). Differences are those at times of arrival: position, any state in its own sigmas, any sigma relative; with\n\
         the same linearisation points they are the flight filter's discretisation, not rounding (see the tests).\n\
         Bytes: the whole payload of a packet, or the DEIF's {NUMBERS} numbers, to which {HEADER} bytes come (source, sequences, time,\n\
         depth, CRC) and 4 of authentication where a key is set; an FSK frame holds 32.\n",
        arguments.seed
    );
    for part in parts {
        let [Ok(centralized), Ok(packet), ..] = &part.methods.iter().map(|m| m.result.as_ref()).collect::<Vec<_>>()[..]
        else {
            continue;
        };
        let rms = 100.0 * (packet.error.rms_m / centralized.error.rms_m - 1.0);
        let bound = 100.0 * (packet.drms_m / centralized.drms_m - 1.0);
        let _ = writeln!(
            text,
            "Packet-fed against centralized, ship fixes {}: RMS error {rms:+.1} %, own bound {bound:+.1} %.",
            part.heading
        );
    }
    text += "With fixes every second the ship forgets its errors between two packets, and ignoring their correlation costs nothing\n\
             beyond chance. With rare fixes every other packet extrapolates the turning ship and errs outwards (3 m after 30 s\n\
             even from a perfect velocity): the packet-fed filter takes each such error for a new one and is overconfident; the\n\
             centralized filter and the DEIF take it back by correlation when the next fix is known.\n";
    text
}

fn to_json(parts: &[Part]) -> Value {
    let method = |method: &Method| {
        let judged = method.result.as_ref().ok();
        let difference = judged
            .and_then(|judged| judged.difference)
            .map(|d| json!({"position_m": d.position_m, "state_sigmas": d.sigmas, "sigma_relative": d.sigma_ratio}));
        json!({
            "name": method.name,
            "median_m": judged.map(|judged| judged.error.median_m),
            "p95_m": judged.map(|judged| judged.error.p95_m),
            "max_m": judged.map(|judged| judged.error.max_m),
            "rms_m": judged.map(|judged| judged.error.rms_m),
            "drms_m": judged.map(|judged| judged.drms_m),
            "bytes_per_packet": method.bytes,
            "difference": difference,
            "failed": method.result.as_ref().err(),
        })
    };
    let parts = parts.iter().map(|part| {
        json!({"ship_fixes": part.heading, "configurations": part.methods.iter().map(method).collect::<Vec<_>>()})
    });
    parts.collect()
}
