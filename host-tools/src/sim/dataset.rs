//! `backseat sim dataset`: measured logs of a vehicle that does more than was declared.

use crate::output::print;
use anyhow::bail;
use backseat_logs::{VehicleFile, output};
use backseat_report::{Report, Table, console};
use hil_sim::dataset::{self, Shape, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::scenario::{Request, effects};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  backseat sim dataset --effect random --seed 1 --hours 1 --out set1
  backseat sim dataset --effect water_current --effect fin_stuck:fin=top,rad=0.05 --seed 2 --hours 0.5 --out set2 --excite
  backseat sim dataset --effect none --seed 3 --hours 0.5 --out set3 --noise coloured
  backseat sim dataset --effect usbl_turn --seed 4 --hours 0.5 --out set4 --usbl --no-ranges --no-dvl
  backseat sim dataset --list")]
pub struct Args {
    /// NAME, or NAME:parameter=value,…; `random` (from the catalogue), `random-outside` (from effects in no catalogue)
    /// or `none`. The seed draws missing numbers. May be repeated.
    #[arg(long = "effect", value_name = "NAME", required_unless_present = "list")]
    effects: Vec<String>,
    /// Seed of everything: effects, mission, noise.
    #[arg(long, value_name = "N", required_unless_present = "list")]
    seed: Option<u64>,
    /// Length of the log, hours.
    #[arg(long, value_name = "H", required_unless_present = "list", allow_negative_numbers = true)]
    hours: Option<f64>,
    /// Folder for log.csv and vehicle.toml, and for truth/ with truth.csv and effects.json.
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Declared vehicle [default: the built-in reference].
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Dives, steps of speed and legs across instead of lines to and fro.
    #[arg(long)]
    excite: bool,
    /// No DVL.
    #[arg(long)]
    no_dvl: bool,
    /// No acoustic ranges.
    #[arg(long)]
    no_ranges: bool,
    /// A USBL on the ship: a fix every ten seconds.
    #[arg(long)]
    usbl: bool,
    /// Four transponders on the bottom (LBL): round trips every ten seconds.
    #[arg(long)]
    lbl: bool,
    /// Log the water density (CTD).
    #[arg(long)]
    ctd: bool,
    /// Spectra of the noise.
    #[arg(long, value_name = "white|coloured|mixed|off", default_value = "white", value_parser = noise)]
    noise: NoiseKind,
    /// List the effects with their parameters and end.
    #[arg(long)]
    list: bool,
    /// Print one JSON object on stdout; it does not reveal the effects.
    #[arg(long)]
    json: bool,
}

fn noise(text: &str) -> Result<NoiseKind, String> {
    match text {
        "white" => Ok(NoiseKind::White),
        "coloured" => Ok(NoiseKind::Coloured),
        "mixed" => Ok(NoiseKind::Mixed),
        "off" => Ok(NoiseKind::Off),
        _ => Err("white, coloured, mixed or off".to_owned()),
    }
}

/// Simulates and writes.
///
/// # Errors
/// An effect that is unknown, a vehicle file that is wrong, a file that exists or cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    if arguments.list {
        return match arguments.json {
            true => console::print(format!("{}\n", list_json()).as_bytes()),
            false => print(&list(), false),
        };
    }
    let (Some(seed), Some(hours), Some(out)) = (arguments.seed, arguments.hours, &arguments.out) else {
        bail!("--seed, --hours and --out are needed");
    };
    if !(0.05..=24.0).contains(&hours) {
        bail!("--hours {hours}: 0.05 to 24");
    }
    if out.join("log.csv").exists() {
        bail!("{}: holds a log already", out.display());
    }
    output::check_folder(out)?;
    let vehicle = match &arguments.vehicle {
        Some(path) => VehicleFile::read(path)?,
        None => VehicleFile::reference(),
    };
    let spec = Spec {
        duration_s: 3600.0 * hours,
        effects: requests(&arguments.effects)?,
        shape: if arguments.excite { Shape::Excite } else { Shape::Lawnmower },
        noise: arguments.noise,
        dvl: !arguments.no_dvl,
        ranges: !arguments.no_ranges,
        usbl: arguments.usbl,
        lbl: arguments.lbl,
        ctd: arguments.ctd,
        ..Spec::new(vehicle)
    };
    let dataset = dataset::simulate(&spec, seed);
    dataset::write(&dataset, &spec, out)?;
    let rows = dataset.log.rows.len();
    let report = Report::new(
        "A data set",
        format!("{rows} rows, {hours} h; what the vehicle does beyond its file stands in the truth"),
    )
    .file("log", Some(&out.join("log.csv")))
    .file("vehicle", Some(&out.join("vehicle.toml")))
    .file("truth", Some(&out.join("truth")))
    .value("rows", rows);
    print(&report, arguments.json)
}

/// What is asked for; `none` is nothing and goes with nothing else.
fn requests(texts: &[String]) -> anyhow::Result<Vec<Request>> {
    if texts.iter().any(|text| text == "none") {
        if texts.len() > 1 {
            bail!("--effect none goes with no other effect");
        }
        return Ok(Vec::new());
    }
    texts.iter().map(|text| Request::parse(text).map_err(anyhow::Error::msg)).collect()
}

/// Every effect with its parameters, as one object.
fn list_json() -> Value {
    let effects = effects::all().map(|kind| {
        let parameters = kind.parameters.iter();
        let parameters = parameters.map(|p| json!({"name": p.name, "range": p.range, "optional": p.optional}));
        json!({
            "name": kind.name,
            "about": kind.about,
            "in_catalogue": kind.catalogue,
            "parameters": parameters.collect::<Vec<_>>(),
        })
    });
    json!({"effects": effects.collect::<Vec<_>>()})
}

/// Every effect with its parameters.
fn list() -> Report {
    let table = |catalogue, title| {
        let kinds = effects::all().filter(|kind| kind.catalogue == catalogue);
        kinds.fold(Table::new(title, &["effect", "what it does", "parameters"]), |table, kind| {
            let parameters = kind.parameters.iter();
            let parameters = parameters.map(|p| format!("{}{}", p.name, if p.optional { " (or 0)" } else { "" }));
            table.row([kind.name.to_owned(), kind.about.to_owned(), parameters.collect::<Vec<_>>().join(", ")])
        })
    };
    Report::new("Effects", "What `--effect` puts into a data set.")
        .table(table(true, "In the catalogue"))
        .table(table(false, "In no catalogue"))
}
