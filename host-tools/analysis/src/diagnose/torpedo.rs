//! `diagnose FOLDER` of a torpedo's short runs, and `diagnose --predict`: as reports.

use super::format::probability;
use super::torpedo_drift::{drift_table, drift_value};
use crate::provenance;
use crate::read_log::{ReadLog, file_name};
use anyhow::anyhow;
use backseat_core::dynamics::ParameterError;
use backseat_diagnose::torpedo::carry::{self, Drift};
use backseat_diagnose::torpedo::{self, Found, HORIZONS_S, Parameter, Predictions, Step, TorpedoDiagnosis, Torque};
use backseat_identify::short_runs::predict::{CHANNELS, Squares, start_of};
use backseat_identify::short_runs::recording::{Wanted, Window, windows};
use backseat_identify::short_runs::{Draft, Run, RunModel};
use backseat_logs::textbook::Sizes;
use backseat_logs::{Log, VehicleFile};
use backseat_report::console::Spinner;
use backseat_report::plots::{self, Point, Scale, XyPlot};
use backseat_report::{Report, Table};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Horizon of the figures that are compared, place in [`HORIZONS_S`].
const COMPARED: usize = 2;
/// Seconds shown before and after a start or stop of the motor.
const AROUND_S: [f64; 2] = [2.0, 8.0];
/// Events drawn.
const MOST_EVENTS: usize = 4;

/// Whether `diagnose` treats a log as short runs.
pub fn is_for(log: &Log) -> bool {
    torpedo::is_for(log)
}

/// The textbook's torpedo of this class: the reference vehicle in the sizes of an Iver2, fresh water.
#[must_use]
pub fn textbook() -> VehicleFile {
    let sizes = Sizes { length_m: Some(1.4), diameter_m: Some(0.147), mass_kg: Some(21.0) };
    let mut file = sizes.scale(&VehicleFile::reference());
    file.name = "iver2-textbook".to_owned();
    file.parameters.rho_kg_per_m3 = 998.0;
    file.parameters.displaced_mass_kg = 21.05;
    file
}

/// What the runs say, and how well each run is navigated by it.
pub struct RunsResult {
    /// The diagnosis.
    pub diagnosis: TorpedoDiagnosis,
    /// Drift of each run without its DVL, where it is long enough.
    pub drifts: Vec<(String, Drift)>,
    notes: Vec<String>,
}

/// Diagnoses the runs of a log.
///
/// # Errors
/// Too few runs, or no convergence.
pub fn compute(read: &ReadLog, declared: Option<&VehicleFile>) -> anyhow::Result<RunsResult> {
    let spinner = Spinner::new("diagnose");
    let vehicle = declared.cloned().unwrap_or_else(textbook);
    let mut notes = read.log.notes.clone();
    if declared.is_none() {
        notes.push(format!(
            "no --vehicle given: the textbook is the reference vehicle in the sizes of an Iver2 ({}: 1.4 m, 0.147 m, 21 kg)",
            vehicle.name
        ));
    }
    let diagnosis = torpedo::diagnose(&read.log, &vehicle, Predictions::HeldOut, &mut |what| spinner.set(what))
        .map_err(|message| anyhow!("{}: {message}", read.log.path.display()))?;
    notes.extend(diagnosis.notes.iter().cloned());
    if !diagnosis.found.is_empty() {
        let candidates =
            "what is named is a candidate: docs/results/torpedo_twins.md counts wrong names in simulated folders";
        notes.push(candidates.to_owned());
    }
    let drifts = drifts(&diagnosis)?;
    Ok(RunsResult { diagnosis, drifts, notes })
}

/// The textbook, and what the other runs give, for one run.
fn models(d: &TorpedoDiagnosis, run: usize) -> anyhow::Result<[RunModel; 2]> {
    let configuration = d.runs[run].configuration;
    let one = |draft: &Draft| Ok::<_, ParameterError>(draft.models()?.swap_remove(configuration));
    Ok([one(&d.textbook)?, one(&d.without[run])?])
}

/// Of each run, the speed per propeller speed being that of the other runs.
fn drifts(d: &TorpedoDiagnosis) -> anyhow::Result<Vec<(String, Drift)>> {
    let mut drifts = Vec::new();
    for (place, run) in d.runs.iter().enumerate() {
        let others = d.runs.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, run)| run);
        let [textbook, found] = &models(d, place)?;
        let drift = carry::drift(run, [textbook, found], carry::speed_per_radps(others));
        drifts.extend(drift.map(|drift| (run.label.clone(), drift)));
    }
    Ok(drifts)
}

/// The report; `vehicle_file` was written.
pub fn report(result: &RunsResult, log: &Log, vehicle_file: Option<&Path>) -> anyhow::Result<Report> {
    let d = &result.diagnosis;
    let mut report = Report::new(format!("Diagnosis of {}", file_name(&log.path)), answer(d));
    report = report.table(effects(d));
    for found in &d.found {
        report = report.text(&format!("{}: {}. {}.", found.entry.name, found.entry.equation, found.entry.signature));
        for (other, manoeuvre) in &found.alike {
            report = report.text(&format!("These runs do not tell it from {other}; to separate them: {manoeuvre}."));
        }
    }
    if let Some(torque) = &d.torque {
        report = report.table(stops(d, torque));
    }
    report = report.text(&format!("Not shown by these runs: {}.", d.not_shown.join(", ")));
    for place in 0..d.configurations.len() {
        report = report.table(predictions(d, place, COMPARED));
    }
    report = report.table(drift_table(&result.drifts));
    report = report.on_page();
    report = events(report, d)?;
    report = examples(report, d)?;
    report = report.table(coefficients(d));
    for place in 0..d.configurations.len() {
        for horizon in 0..COMPARED {
            report = report.table(predictions(d, place, horizon));
        }
    }
    report = report.everywhere().section("Notes").notes(&result.notes);
    report = report.file("vehicle_file", vehicle_file);
    if let Some(path) = vehicle_file {
        let command = format!("backseat diagnose FOLDER --vehicle {} --predict 20", backseat_report::word(path));
        report = report
            .section("Next")
            .text("Judges the vehicle file on runs that it has not seen; FOLDER is that of such runs:")
            .command(&command);
    }
    Ok(provenance::of(values(report, result), None))
}

/// The verdict, what was found, and what the textbook and the model found miss on runs that the fit had not.
#[must_use]
pub fn answer(d: &TorpedoDiagnosis) -> String {
    let names: Vec<&str> = d.found.iter().map(|found| found.entry.name).collect();
    let found = match verdict(d) {
        "none" => "None. The textbook's model with its coefficients fitted is all that these runs show.".to_owned(),
        "explained" => format!("Explained. These runs need {}, strongest first.", names.join(", ")),
        _ => format!("Ambiguous. These runs need {}, strongest first; some look like others.", names.join(", ")),
    };
    let missed = |step: &Step, channel| step.rms(&d.runs, None, COMPARED, channel);
    let gains = CHANNELS.iter().enumerate().filter_map(|(channel, (name, _))| {
        let [before, after] = [d.steps.first()?, d.steps.last()?].map(|step| missed(step, channel));
        Some(format!("{name} {:.3} -> {:.3}", before?, after?))
    });
    let gains: Vec<String> = gains.collect();
    if gains.is_empty() {
        return found;
    }
    format!("{found} Held-out predictions over {:.0} s, textbook -> found: {}.", HORIZONS_S[COMPARED], gains.join(", "))
}

fn verdict(d: &TorpedoDiagnosis) -> &'static str {
    match d.found.first() {
        None => "none",
        Some(first) if first.alike.is_empty() => "explained",
        Some(_) => "ambiguous",
    }
}

fn interval(parameter: &Parameter) -> String {
    let [low, high] = parameter.ci95;
    // a factor has no unit
    let unit = parameter.unit.trim_start_matches('1');
    format!("{:.4} {unit} ({low:.4} to {high:.4})", parameter.value).replace("  ", " ")
}

/// The configuration that a name such as `k_uu[1]` belongs to, in words.
fn named(d: &TorpedoDiagnosis, name: &str) -> String {
    let found = name.split_once('[').and_then(|(term, rest)| {
        let place: usize = rest.trim_end_matches(']').parse().ok()?;
        Some(format!("{term}, {}", d.configurations.get(place)?.name))
    });
    found.unwrap_or_else(|| name.to_owned())
}

fn effects(d: &TorpedoDiagnosis) -> Table {
    let header = ["effect", "parameter", "value (95 % interval)", "p"];
    let mut table = Table::new("Effects found; of their numbers those outside what the textbook leaves open", &header);
    for found in &d.found {
        let shown = found.parameters.iter().filter(|parameter| parameter.is_shown());
        for (place, parameter) in shown.enumerate() {
            let [name, p] = match place {
                0 => [found.entry.name.to_owned(), probability(found.p_value)],
                _ => [String::new(), String::new()],
            };
            table = table.row([name, named(d, &parameter.name), interval(parameter), p]);
        }
    }
    table
}

/// What each stop of the motor says of the propeller's torque.
fn stops(d: &TorpedoDiagnosis, torque: &Torque) -> Table {
    let [mean, sigma] = torque.arm_m;
    let [with, without] = torque.stops.errors;
    let caption = format!(
        "Propeller's torque at stops of the motor, each with a moment and a list of its own: {mean:.4} +- {sigma:.4} m; squared \
         errors of roll in {} rows {without:.0} without, {with:.0} with it; delay of the propeller {:.1} s",
        torque.stops.rows, torque.stops.delay_s
    );
    torque.stops.each.iter().fold(Table::new(caption, &["run", "stop [s]", "arm [m]", "sigma [m]"]), |table, stop| {
        let label = d.runs[stop.run].label.clone();
        table.row([label, format!("{:.1}", stop.time_s), format!("{:.4}", stop.arm_m), format!("{:.4}", stop.sigma_m)])
    })
}

fn coefficients(d: &TorpedoDiagnosis) -> Table {
    let header = ["coefficient", "ln of its factor (95 % interval)", "share of the prior"];
    d.coefficients.iter().fold(Table::new("Coefficients of the textbook, as fitted", &header), |table, one| {
        table.row([one.name.clone(), interval(one), format!("{:.0} %", 100.0 * one.prior_share)])
    })
}

/// Root mean squares of one configuration at one horizon, a row a model.
fn predictions(d: &TorpedoDiagnosis, configuration: usize, horizon: usize) -> Table {
    let header: Vec<&str> = std::iter::once("model").chain(CHANNELS.iter().map(|(name, _)| *name)).collect();
    let count: usize = d
        .runs
        .iter()
        .zip(&d.steps[0].held_out)
        .filter(|(run, _)| run.configuration == configuration)
        .map(|(_, squares)| squares[horizon].windows)
        .sum();
    let caption = format!(
        "{}: open-loop predictions of {:.0} s, root mean square over {count} windows of runs that the fit had not (the last \
         model fitted without each run, those before it a step away from the fit to all)",
        d.configurations[configuration].name, HORIZONS_S[horizon]
    );
    d.steps.iter().fold(Table::new(caption, &header), |table, step| {
        let cell = |channel: usize| {
            let rms = step.rms(&d.runs, Some(configuration), horizon, channel);
            rms.map_or_else(|| "-".to_owned(), |rms| format!("{rms:.3}"))
        };
        table.row(std::iter::once(step.name.clone()).chain((0..CHANNELS.len()).map(cell)))
    })
}

/// Measured, textbook and found of one channel over a window, from one start.
fn lines(run: &Run, models: [&RunModel; 2], window: Window, of: fn([f64; 3], f64) -> f64) -> [Vec<Point>; 3] {
    let samples = &run.samples[window.first..=window.last];
    let at_s = |index: usize| samples[index].t_s - samples[0].t_s;
    let measured = (0..samples.len()).map(|i| (at_s(i), of(samples[i].attitude_rad, samples[i].depth_m))).collect();
    let [before, after] = models.map(|model| {
        let readings = model.predict(run, window, &start_of(model, run, window));
        let value = |reading: &Option<backseat_identify::short_runs::model::Reading>| {
            reading.map_or(f64::NAN, |reading| of(reading.attitude_rad, reading.depth_m))
        };
        readings.iter().enumerate().map(|(i, reading)| (at_s(i), value(reading))).collect::<Vec<Point>>()
    });
    [measured, before, after]
}

fn xy(y_label: &str, [measured, before, after]: &[Vec<Point>; 3]) -> String {
    plots::xy(&XyPlot {
        x_label: "time from the start of the prediction [s]",
        y_label,
        series: &[("measured", measured), ("textbook", before), ("found", after)],
        reference: None,
        x_scale: Scale::Linear,
        y_scale: Scale::Linear,
    })
}

/// Roll where the motor stops under water.
fn events(mut report: Report, d: &TorpedoDiagnosis) -> anyhow::Result<Report> {
    report = report.section("Roll at motor stops");
    let mut drawn = 0;
    for (place, run) in d.runs.iter().enumerate() {
        for (index, pair) in run.samples.windows(2).enumerate() {
            let is_stop = pair[0].is_powered() && !pair[1].is_powered() && pair[0].depth_m > 0.5;
            if !is_stop || drawn == MOST_EVENTS {
                continue;
            }
            let stop_s = pair[1].t_s;
            let within = |sample: &&backseat_identify::short_runs::recording::RunSample| {
                sample.t_s >= stop_s - AROUND_S[0] && sample.t_s <= stop_s + AROUND_S[1]
            };
            let first = run.samples.iter().position(|sample| within(&sample)).unwrap_or(index);
            let last = first + run.samples[first..].iter().take_while(within).count().saturating_sub(1);
            let window = Window { run: 0, first, last };
            let [textbook, found] = &models(d, place)?;
            let roll = lines(run, [textbook, found], window, |attitude, _| attitude[0].to_degrees());
            let caption =
                format!("{}: the motor stops {:.0} s after the start of the prediction.", run.label, AROUND_S[0]);
            report = report.figure(&caption, xy("roll [deg]", &roll));
            drawn += 1;
        }
    }
    Ok(if drawn == 0 { report.text("No motor stops under water in these runs.") } else { report })
}

type Of = fn([f64; 3], f64) -> f64;
const SHOWN: [(&str, Of); 4] = [
    ("roll [deg]", |attitude, _| attitude[0].to_degrees()),
    ("pitch [deg]", |attitude, _| attitude[1].to_degrees()),
    ("heading [deg]", |attitude, _| attitude[2].to_degrees()),
    ("depth [m]", |_, depth_m| depth_m),
];

/// The first whole window of each run, with its label and a plot for each of [`SHOWN`].
fn windows_of(d: &TorpedoDiagnosis) -> anyhow::Result<Vec<(String, [String; SHOWN.len()])>> {
    let wanted = Wanted { depth_m: 0.5, powered: true, speed_mps: 0.0 };
    let length_s = HORIZONS_S[COMPARED];
    let mut drawn = Vec::new();
    let mut previous = None;
    for window in windows(&d.runs, wanted, length_s, length_s) {
        if previous.replace(window.run) == Some(window.run) {
            continue;
        }
        let run = &d.runs[window.run];
        let [textbook, found] = &models(d, window.run)?;
        let plots = SHOWN.map(|(label, of)| xy(label, &lines(run, [textbook, found], window, of)));
        drawn.push((run.label.clone(), plots));
    }
    Ok(drawn)
}

/// One prediction of each run with a whole window: roll, pitch, heading, depth.
fn examples(report: Report, d: &TorpedoDiagnosis) -> anyhow::Result<Report> {
    let report = report.section("Predictions from one start, by what the other runs give");
    Ok(windows_of(d)?.into_iter().fold(report, |report, (label, plots)| {
        plots.into_iter().fold(report, |report, plot| report.figure(&format!("Run {label}."), plot))
    }))
}

/// Roll, pitch, heading and depth of the last run with a whole window as one picture, SVG; `None`: there is none.
///
/// # Errors
/// A parameter outside its range.
pub fn picture(result: &RunsResult) -> anyhow::Result<Option<String>> {
    let drawn = windows_of(&result.diagnosis)?;
    Ok(drawn
        .into_iter()
        .last()
        .map(|(_, [roll, pitch, heading, depth])| plots::sheet(&[&[roll, heading], &[pitch, depth]])))
}

/// The keys of the contract.
fn values(report: Report, result: &RunsResult) -> Report {
    let d = &result.diagnosis;
    let last = d.steps.len() - 1;
    let steps: Vec<Value> = d
        .steps
        .iter()
        .map(|step| {
            let groups = d.configurations.iter().enumerate().map(|(place, configuration)| {
                let horizons = (0..HORIZONS_S.len()).map(|horizon| {
                    (format!("{:.0}_s", HORIZONS_S[horizon]), channels(|c| step.rms(&d.runs, Some(place), horizon, c)))
                });
                (configuration.name.clone(), Value::Object(horizons.collect()))
            });
            json!({"model": step.name, "cost": step.cost, "held_out": groups.collect::<Map<_, _>>()})
        })
        .collect();
    report
        .value("verdict", verdict(d))
        .value("effects", d.found.iter().map(|found| effect(d, found)).collect::<Vec<_>>())
        .value("before", scores(d, 0))
        .value("after", scores(d, last))
        .value("proposed_terms", Vec::<Value>::new())
        .value("not_shown", json!(d.not_shown))
        .value("coefficients", d.coefficients.iter().map(|one| (one.name.clone(), number(one))).collect::<Map<_, _>>())
        .value(
            "held_out",
            "each run by a fit to the other runs; before the whole model by one step from the fit to all",
        )
        .value("models", steps)
        .value("stops", d.torque.as_ref().map(stops_value))
        .value("drift_share", drift_value(&result.drifts))
        .value("notes", result.notes.clone())
}

fn stops_value(torque: &Torque) -> Value {
    let [mean_m, sigma_m] = torque.arm_m;
    let each: Vec<[f64; 2]> = torque.stops.each.iter().map(|stop| [stop.arm_m, stop.sigma_m]).collect();
    json!({"arm_m": mean_m, "sigma_m": sigma_m, "each_m": each, "p_value": torque.p_value})
}

fn number(parameter: &Parameter) -> Value {
    json!({"value": parameter.value, "ci95": parameter.ci95, "unit": parameter.unit, "prior_share": parameter.prior_share})
}

fn effect(d: &TorpedoDiagnosis, found: &Found) -> Value {
    let of = |is_shown: bool| -> Map<String, Value> {
        let parameters = found.parameters.iter().filter(|parameter| parameter.is_shown() == is_shown);
        parameters.map(|parameter| (named(d, &parameter.name), number(parameter))).collect()
    };
    json!({
        "name": found.entry.name,
        "parameters": of(true),
        "parameters_not_shown": of(false),
        "p_value": found.p_value,
        "ambiguous_with": found.alike.iter().map(|(other, _)| *other).collect::<Vec<_>>(),
        "separating_manoeuvre": found.alike.first().map(|(_, manoeuvre)| *manoeuvre),
        "equation": found.entry.equation,
    })
}

fn channels(rms: impl Fn(usize) -> Option<f64>) -> Value {
    Value::Object(CHANNELS.iter().enumerate().map(|(c, (name, _))| ((*name).to_owned(), json!(rms(c)))).collect())
}

/// The keys that every diagnosis has; there are no fixes and no innovations here.
fn scores(d: &TorpedoDiagnosis, step: usize) -> Value {
    let step = &d.steps[step];
    let horizons = (0..HORIZONS_S.len())
        .map(|horizon| (format!("{:.0}_s", HORIZONS_S[horizon]), channels(|c| step.rms(&d.runs, None, horizon, c))));
    json!({
        "velocity_rmse_mps": step.rms(&d.runs, None, 1, 4),
        "position_rmse_m": null,
        "innovation_whiteness_p": null,
        "max_autocorrelation": null,
        "prediction_rmse": Value::Object(horizons.collect()),
    })
}

/// `diagnose --predict S`: no fitting.
///
/// # Errors
/// The log lacks a column, or the vehicle file has a parameter outside its range.
pub fn predict(read: &ReadLog, declared: Option<&VehicleFile>, horizon_s: f64) -> anyhow::Result<Report> {
    let vehicle = declared.cloned().unwrap_or_else(textbook);
    let predicted = torpedo::predict(&read.log, &vehicle, horizon_s)
        .map_err(|message| anyhow!("{}: {message}", read.log.path.display()))?;
    let pooled = predicted.runs.iter().fold(Squares::default(), |sum, (_, _, squares)| sum.plus(squares));
    let header: Vec<&str> =
        ["run", "configuration", "windows"].into_iter().chain(CHANNELS.iter().map(|(name, _)| *name)).collect();
    let caption = format!(
        "Open-loop predictions over {horizon_s} s from the measured state: root mean square; windows that overlap by half, \
         powered and deeper than 0.5 m"
    );
    let row = |table: Table, label: &str, name: &str, squares: &Squares| {
        let cell = |channel| squares.rms(channel).map_or_else(|| "-".to_owned(), |rms: f64| format!("{rms:.3}"));
        let start = [label.to_owned(), name.to_owned(), squares.windows.to_string()];
        table.row(start.into_iter().chain((0..CHANNELS.len()).map(cell)))
    };
    let with_windows = predicted.runs.iter().filter(|(_, _, squares)| squares.windows > 0);
    let mut table = with_windows.fold(Table::new(caption, &header), |table, (label, name, squares)| {
        row(table, label, name.as_deref().unwrap_or("-"), squares)
    });
    table = row(table, "all", "", &pooled);
    let value = |squares: &Squares| {
        let mut value = channels(|channel| squares.rms(channel));
        value["windows"] = json!(squares.windows);
        value
    };
    let runs: Map<String, Value> = predicted
        .runs
        .iter()
        .map(|(label, name, squares)| {
            let mut of_run = value(squares);
            of_run["configuration"] = json!(name);
            (label.clone(), of_run)
        })
        .collect();
    let mut groups: Vec<(String, Squares)> = Vec::new();
    for (_, name, squares) in &predicted.runs {
        let name = name.clone().unwrap_or_else(|| "all runs".to_owned());
        match groups.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum = sum.plus(squares),
            None => groups.push((name, *squares)),
        }
    }
    let by_configuration: Map<String, Value> =
        groups.iter().map(|(name, squares)| (name.clone(), value(squares))).collect();
    let answer = match pooled.windows {
        0 => format!("No stretch of {horizon_s} s is powered and deeper than 0.5 m: nothing to predict."),
        count => format!("{count} windows of {horizon_s} s predicted by {}.", vehicle.name),
    };
    let mut notes = read.log.notes.clone();
    notes.extend(predicted.notes);
    notes.push(
        "the measured state: attitude of the row, rates by central differences over the rows beside it, depth of the rows \
         within 1.05 s, DVL readings of the last 1.3 s and its delay (0.7 s at least); nothing later than 1.05 s after the start"
            .to_owned(),
    );
    let report = Report::new(format!("Predictions of {}", file_name(&read.log.path)), answer)
        .table(table)
        .notes(&notes)
        .value(
            "prediction",
            json!({"horizon_s": horizon_s, "runs": runs, "configurations": by_configuration, "pooled": value(&pooled)}),
        )
        .value("notes", notes.clone());
    Ok(provenance::of(report, None))
}
