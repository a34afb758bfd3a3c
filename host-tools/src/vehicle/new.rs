//! `backseat vehicle new`: a vehicle file from a template and the numbers of a data sheet.

use crate::output::print;
use anyhow::bail;
use backseat_logs::VehicleFile;
use backseat_logs::output::{self, Existing};
use backseat_logs::textbook::{Scatter, Sizes, TEMPLATES, Template, six_digits};
use backseat_report::{Report, Table};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  backseat vehicle new --from remus100 --out remus.toml
  backseat vehicle new --from iver3 --name ours --length 1.7 --diameter 0.16 --mass 29 --out ours.toml
  backseat vehicle check ours.toml

Without sizes the template is written as it is, with the source of each number. With any of them the numbers that the
data sheet does not give are scaled: added mass with the mass, moments of inertia with mass and size squared, drag with
the areas that make it, thrust with the drag, so that the top speed stays. How well that is known is printed: the
sigma that `diagnose FOLDER` gives the same numbers as their prior. `identify` then finds better ones.";

/// Write a vehicle file from a template and the numbers of a data sheet
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle to start from
    #[arg(long, default_value = "iver3", value_parser = template())]
    from: Template,
    /// Name of the new vehicle
    #[arg(long)]
    name: Option<String>,
    /// Length over all, m
    #[arg(long, value_name = "M")]
    length: Option<f64>,
    /// Diameter of the hull, m
    #[arg(long, value_name = "M")]
    diameter: Option<f64>,
    /// Dry mass, kg; the displaced mass keeps its ratio to it
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// The new vehicle file
    #[arg(long, value_name = "V.toml")]
    out: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

fn template() -> impl TypedValueParser<Value = Template> {
    PossibleValuesParser::new(TEMPLATES.map(|template| PossibleValue::new(template.name).help(template.about)))
        .try_map(|name| TEMPLATES.into_iter().find(|template| template.name == name).ok_or("no such template"))
}

/// Writes the file.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let file = VehicleFile::parse(args.from.text, Path::new("the template"))?;
    for (name, value) in [("length", args.length), ("diameter", args.diameter), ("mass", args.mass)] {
        if value.is_some_and(|value| !(value.is_finite() && value > 0.0)) {
            bail!("--{name}: expected a positive number");
        }
    }
    let sizes = Sizes { length_m: args.length, diameter_m: args.diameter, mass_kg: args.mass };
    let is_scaled = args.name.is_some() || sizes != Sizes::default();
    let text = if is_scaled {
        let mut scaled = sizes.scale(&file);
        six_digits(&mut scaled.parameters, &sizes);
        scaled.name = args.name.clone().unwrap_or(scaled.name);
        let source = format!(
            "Scaled by `backseat vehicle new` from {}: what the data sheet does not give are estimates.\n\
             After each number: unit; range that is accepted; meaning.",
            file.name
        );
        // numbers that do not go together are refused here, not at the first use of the file
        let text = scaled.to_toml(&source);
        VehicleFile::parse(&text, &args.out)?;
        text
    } else {
        args.from.text.to_owned()
    };
    let scatter = Scatter::TAKEN.rows();
    let published = Scatter::of_templates().rows();
    let header = ["coefficient", "one sigma of its factor", "published vehicles differ by"];
    let known = scatter.iter().zip(published).fold(
        Table::new("How well a scaled number is known", &header),
        |table, ((name, sigma), (_, published))| {
            let factor = format!("{:.2} to {:.2}", (-sigma).exp(), sigma.exp());
            table.row([(*name).to_owned(), factor, format!("{:.2}", published.exp())])
        },
    );
    output::write(&args.out, existing, |out| out.write_all(text.as_bytes()))?;
    let path = args.out.display().to_string();
    let report = Report::new("A new vehicle", format!("written: {path}"))
        .table(known)
        .text(&format!("next: backseat vehicle check {}", backseat_report::word(&args.out)))
        .value("vehicle_file", path)
        .value("from", file.name)
        .value("scaled", is_scaled)
        .value("prior_sigma_ln", serde_json::Map::from_iter(scatter.map(|(name, of)| (name.to_owned(), of.into()))));
    print(&report, args.json)
}
