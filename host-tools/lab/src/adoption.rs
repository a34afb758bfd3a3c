//! `cargo lab adoption`: what the backseat gains from using the parameters it identified.
//!
//! Each seed flies the scenario `adoption` three times: with the true parameters declared, with wrong ones that stay,
//! and with wrong ones that identified ones may replace. The result is the backseat's own horizontal error after the
//! loss of the DVL.

use crate::EnsembleArgs;
use crate::intervals::with_interval;
use anyhow::Context;
use backseat_analysis::ensemble::run_all;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::theta::{BETA1, BETA5, D11, M11, NAMES, Theta, theta_of};
use backseat_link::Client;
use backseat_logs::stats::{ErrorSummary, mean, mean_ci95, median};
use backseat_report::markdown::{markdown_table, wrapped};
use backseat_wire::hostlink::{AdoptionEvent, Visibility};
use hil_sim::backseat::InProcess;
use hil_sim::flight::{self, FlightLog};
use hil_sim::scenario::Scenario;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;

/// The parameters declared to the backseat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Declared {
    /// The true parameters.
    True,
    /// Wrong ones, to keep.
    Wrong,
    /// Wrong ones, to be improved.
    Improving,
}

impl Declared {
    /// In the order of the table.
    pub const ALL: [Self; 3] = [Self::True, Self::Wrong, Self::Improving];

    const fn name(self) -> &'static str {
        match self {
            Self::True => "true parameters",
            Self::Wrong => "wrong by 10 %, kept",
            Self::Improving => "wrong by 10 %, adoption",
        }
    }
}

/// Results of one flight.
#[derive(Clone, Debug)]
pub struct AdoptionFlight {
    /// Horizontal error from the loss of the DVL on.
    pub error: ErrorSummary,
    /// How often parameters were adopted, refused and reverted.
    pub verdicts: [usize; 3],
    /// Relative error of each identified parameter but the scale's factor, at the start and at the end; adapted at the
    /// end.
    pub parameters: Vec<(&'static str, f64, f64, bool)>,
}

/// Flies the scenario `adoption`.
///
/// # Errors
/// A flight that fails.
pub fn fly(seed: u64, declared: Declared, minutes: Option<f64>) -> anyhow::Result<AdoptionFlight> {
    let mut scenario = Scenario::built_in("adoption")?;
    let settings = &mut scenario.settings;
    settings.seed = seed;
    settings.backseat.adopt = declared == Declared::Improving;
    if declared == Declared::True {
        settings.backseat.wrong_share = 0.0;
    }
    if let Some(minutes) = minutes {
        settings.duration_s = settings.duration_s.min(60.0 * minutes);
    }
    let mut client = Client::new(InProcess::new());
    let flight = flight::fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| {})
        .with_context(|| format!("seed {seed}, {}", declared.name()))?;
    let from_s = scenario.settings.sensors.dvl.until_s.unwrap_or(0.0);
    let error = error_from(&flight, from_s).with_context(|| format!("seed {seed}: over before the DVL is lost"))?;
    let count = |event| flight.adoptions.iter().filter(|verdict| verdict.event == event).count();
    let verdicts = [AdoptionEvent::Adopted, AdoptionEvent::Refused, AdoptionEvent::Reverted].map(count);
    let parameters = parameter_errors(&scenario.vehicle.parameters, &scenario.declared_vehicle().parameters, &flight);
    Ok(AdoptionFlight { error, verdicts, parameters })
}

fn error_from(flight: &FlightLog, from_s: f64) -> Option<ErrorSummary> {
    let errors: Vec<f64> = flight
        .samples
        .iter()
        .filter(|sample| sample.truth.time_us as f64 * 1e-6 > from_s && sample.telemetry.sigma[0] > 0.0)
        .map(|sample| {
            let (estimate, truth) = (&sample.telemetry.state, &sample.truth.state);
            (estimate[0] - truth[0]).hypot(estimate[1] - truth[1])
        })
        .collect();
    ErrorSummary::of(&errors)
}

/// θ is known up to the factor by which the declared scale is wrong, so errors are relative to the truth times that
/// factor.
fn parameter_errors(
    vehicle: &VehicleParameters,
    declared: &VehicleParameters,
    flight: &FlightLog,
) -> Vec<(&'static str, f64, f64, bool)> {
    let (truth, declared) = (theta_of(vehicle), theta_of(declared));
    let factor = declared[M11] / truth[M11];
    let Some(last) = flight.identifications.last() else { return Vec::new() };
    let adapts = |j: usize| !matches!(last.visibility[j], Visibility::Frozen | Visibility::Known);
    let relative = |value: f64, j: usize| value / (factor * truth[j]) - 1.0;
    // What sets the steady speed: thrust over the drag of hull and fins together, which are collinear.
    let fins = 2.0 * vehicle.rho_kg_per_m3 * vehicle.fin_area_m2;
    let speed = |theta: &Theta| (theta[BETA5] / (theta[D11] + fins * theta[BETA1])).sqrt();
    let [true_speed, declared_speed, last_speed] = [&truth, &declared, &Theta::from(last.theta)].map(speed);
    let steady = ("steady speed", declared_speed / true_speed - 1.0, last_speed / true_speed - 1.0, adapts(BETA5));
    let known = |j: &usize| *j != M11 && truth[*j] != 0.0;
    (0..NAMES.len())
        .filter(known)
        .map(|j| (NAMES[j], relative(declared[j], j), relative(last.theta[j], j), adapts(j)))
        .chain([steady])
        .collect()
}

/// Flies and prints the table.
///
/// # Errors
/// A flight that fails; a file that cannot be written.
pub fn run(arguments: &EnsembleArgs) -> anyhow::Result<()> {
    let seeds = arguments.first_seed..arguments.first_seed + arguments.runs;
    let plan: Vec<(u64, Declared)> = seeds.flat_map(|seed| Declared::ALL.map(|declared| (seed, declared))).collect();
    let outcomes: Vec<AdoptionFlight> =
        run_all("flights", &plan, |(seed, declared)| fly(*seed, *declared, arguments.minutes))?;
    let of = |declared: Declared| -> Vec<&AdoptionFlight> {
        plan.iter().zip(&outcomes).filter(|((_, other), _)| *other == declared).map(|(_, outcome)| outcome).collect()
    };
    let rows = Declared::ALL.map(|declared| (declared, of(declared)));
    let text = markdown(arguments, &rows);
    if let Some(path) = &arguments.out {
        std::fs::write(path, wrapped(&text)).with_context(|| path.display().to_string())?;
    }
    if arguments.json {
        println!("{}", to_json(&rows));
    } else {
        print!("{text}");
    }
    Ok(())
}

fn medians(outcomes: &[&AdoptionFlight]) -> Vec<f64> {
    outcomes.iter().map(|outcome| outcome.error.median_m).collect()
}

fn markdown(arguments: &EnsembleArgs, rows: &[(Declared, Vec<&AdoptionFlight>); 3]) -> String {
    let EnsembleArgs { runs, first_seed, .. } = arguments;
    let cut = arguments.minutes.map_or(String::new(), |minutes| format!(" --minutes {minutes}"));
    let mut text = format!(
        "# Adoption of identified parameters\n\n\
         Made by `cargo lab adoption --runs {runs} --first-seed {first_seed}{cut}` (seeds {first_seed} to {}).\n\n\
         Scenario `adoption`, closed loop, the app in this process: twenty minutes of turns, dives and speeds of 0.8 to 1.4 m/s with a\n\
         DVL, then four lines of 1 km without it. The backseat's values of inertia, drag, fins and thrust are each 10 % too high or\n\
         too low, with signs drawn by the seed. Dynamic model, packets every 30 s with range (1 m) and range rate, AHRS 3 Hz (1 degree,\n\
         0.5 degrees/s), DVL 5 Hz (1 cm/s), process noise of the vehicle file. Horizontal error of the backseat's own estimate from the\n\
         loss of the DVL on: mean over the runs of each run's median and 95th percentile, with the 95 % interval of that mean; the\n\
         median over the runs; adoptions, refusals and reversions a run.\n\n",
        first_seed + runs - 1
    );
    let header =
        ["declared", "median [m]", "median of medians [m]", "95 % [m]", "largest [m]", "adopted / refused / reverted"];
    let mut errors = markdown_table(header);
    for (declared, outcomes) in rows {
        let median_m = medians(outcomes);
        let p95_m: Vec<f64> = outcomes.iter().map(|outcome| outcome.error.p95_m).collect();
        let largest = outcomes.iter().map(|outcome| outcome.error.max_m).fold(0.0, f64::max);
        let verdicts = [0, 1, 2].map(|i| {
            let counts: Vec<f64> = outcomes.iter().map(|outcome| outcome.verdicts[i] as f64).collect();
            mean(&counts).unwrap_or(f64::NAN)
        });
        let [adopted, refused, reverted] = verdicts;
        errors.add_row([
            declared.name().to_owned(),
            with_interval(&median_m, 2),
            format!("{:.2}", median(&median_m).unwrap_or(f64::NAN)),
            with_interval(&p95_m, 2),
            format!("{largest:.1}"),
            format!("{adopted:.1} / {refused:.1} / {reverted:.1}"),
        ]);
    }
    let [all_true, wrong, improving] =
        rows.each_ref().map(|(_, outcomes)| mean(&medians(outcomes)).unwrap_or(f64::NAN));
    let _ = writeln!(
        text,
        "{errors}\n\nOf the error that wrong parameters cost ({:.2} m), adoption removes {:.0} %.",
        wrong - all_true,
        100.0 * (wrong - improving) / (wrong - all_true)
    );
    let _ = writeln!(
        text,
        "\nRoot mean square over the runs of the identified parameters' errors, as declared and after the twenty minutes, relative to the\n\
         truth times the factor by which the declared m11, the scale, is wrong; how often the parameter was excited at the end\n"
    );
    let mut parameters = markdown_table(["parameter", "declared [%]", "identified [%]", "excited"]);
    let improving = &rows[2].1;
    for (i, (name, ..)) in improving.first().map_or(&[][..], |outcome| &outcome.parameters[..]).iter().enumerate() {
        let rms = |pick: fn(&(&'static str, f64, f64, bool)) -> f64| {
            let squares: Vec<f64> = improving.iter().map(|outcome| pick(&outcome.parameters[i]).powi(2)).collect();
            100.0 * mean(&squares).unwrap_or(f64::NAN).sqrt()
        };
        let excited = improving.iter().filter(|outcome| outcome.parameters[i].3).count();
        let (declared, identified) = (rms(|p| p.1), rms(|p| p.2));
        let excited = format!("{excited} of {}", improving.len());
        parameters.add_row([(*name).to_owned(), format!("{declared:.1}"), format!("{identified:.1}"), excited]);
    }
    text + &format!("{parameters}\n")
}

fn to_json(rows: &[(Declared, Vec<&AdoptionFlight>); 3]) -> Value {
    let configurations = rows.iter().map(|(declared, outcomes)| {
        let median_m = medians(outcomes);
        json!({
            "name": declared.name(),
            "runs": outcomes.len(),
            "median_m": mean(&median_m), "median_ci95_m": mean_ci95(&median_m),
            "medians_m": median_m,
            "verdicts": outcomes.iter().map(|outcome| outcome.verdicts).collect::<Vec<_>>(),
        })
    });
    json!({"configurations": configurations.collect::<Vec<_>>()})
}
