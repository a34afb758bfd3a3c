//! `backseat vehicle new`: a vehicle file from a template and the numbers of a data sheet.

use anyhow::bail;
use backseat_logs::VehicleFile;
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use clap::ValueEnum;
use serde_json::json;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  backseat vehicle new --from remus100 --out remus.toml
  backseat vehicle new --from iver3 --name ours --length 1.7 --diameter 0.16 --mass 29 --out ours.toml
  backseat vehicle check ours.toml

Without sizes the template is written as it is, with the source of each number. With any of them the numbers that the
data sheet does not give are scaled: added mass with the mass, moments of inertia with mass and size squared, drag with
the areas that make it, thrust with the drag, so that the top speed stays. `identify` then finds better ones.";

/// Templates with their texts.
const TEMPLATES: [(Template, &str); 3] = [
    (Template::Iver3, include_str!("../../logs/vehicles/iver3.toml")),
    (Template::Remus100, include_str!("../../logs/vehicles/remus100.toml")),
    (Template::Lauv, include_str!("../../logs/vehicles/lauv.toml")),
];

/// Write a vehicle file from a template and the numbers of a data sheet
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle to start from
    #[arg(long, default_value = "iver3")]
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Template {
    /// L3 OceanServer Iver3: engineering estimates, the reference vehicle
    Iver3,
    /// Hydroid REMUS 100: coefficients of Prestero (2001)
    Remus100,
    /// LAUV of LSTS Porto: coefficients of da Silva (2007)
    Lauv,
}

/// Writes the file.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let Some((_, template)) = TEMPLATES.iter().find(|(template, _)| *template == args.from) else {
        bail!("no such template");
    };
    let file = VehicleFile::parse(template, Path::new("the template"))?;
    for (name, value) in [("length", args.length), ("diameter", args.diameter), ("mass", args.mass)] {
        if value.is_some_and(|value| !(value.is_finite() && value > 0.0)) {
            bail!("--{name}: expected a positive number");
        }
    }
    let is_scaled = args.name.is_some() || args.length.is_some() || args.diameter.is_some() || args.mass.is_some();
    let text = if is_scaled {
        let scaled = scaled(&file, args);
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
        (*template).to_owned()
    };
    output::write(&args.out, existing, |out| out.write_all(text.as_bytes()))?;
    let path = args.out.display();
    let printed = if args.json {
        format!("{}\n", json!({"vehicle_file": args.out, "from": file.name, "scaled": is_scaled}))
    } else {
        format!("written: {path}\nnext: backseat vehicle check {path}\n")
    };
    console::print(printed.as_bytes())
}

/// The template in other sizes.
fn scaled(template: &VehicleFile, args: &Args) -> VehicleFile {
    let mut file = template.clone();
    file.name = args.name.clone().unwrap_or_else(|| format!("{}-scaled", template.name));
    let p = &mut file.parameters;
    let length = args.length.map_or(1.0, |length| length / p.length_m);
    let diameter = args.diameter.map_or(1.0, |diameter| diameter / p.diameter_m);
    // without a mass: a vehicle as dense as the template
    let mass = args.mass.map_or(length * diameter * diameter, |mass| mass / p.mass_kg);
    p.length_m *= length;
    p.diameter_m *= diameter;
    p.mass_kg *= mass;
    p.displaced_mass_kg *= mass;
    p.b_cb_to_cg_m = p.b_cb_to_cg_m.map(|b| b * diameter);
    let rotary = mass * length * length;
    let inertia = [mass, mass, mass, mass * diameter * diameter, rotary, rotary];
    p.m_diag.iter_mut().zip(inertia).for_each(|(m, factor)| *m *= factor);
    let (frontal, side) = (diameter * diameter, diameter * length);
    let drag = [frontal, side, side, diameter.powi(4) * length, side * length.powi(3), side * length.powi(3)];
    p.quadratic_diag.iter_mut().zip(drag).for_each(|(d, factor)| *d *= factor);
    p.linear_surge_ns_per_m *= frontal;
    p.d26 *= side * length;
    p.d35 *= side * length;
    p.beta5_n_s2_per_rad2 *= frontal;
    p.advance_n_s2_per_rad_m *= frontal;
    p.fin_area_m2 *= side;
    for fin in &mut p.fins {
        fin.cp_m = [fin.cp_m[0] * length, fin.cp_m[1] * diameter, fin.cp_m[2] * diameter];
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_vehicle_twice_as_large_has_the_same_top_speed() {
        let args = Args {
            from: Template::Iver3,
            name: None,
            length: Some(4.0),
            diameter: Some(0.294),
            mass: None,
            out: PathBuf::new(),
            force: false,
            json: false,
        };
        let (small, large) = (VehicleFile::reference(), scaled(&VehicleFile::reference(), &args));
        // a body twice as large: eight times the mass, 32 times the moments of inertia, four times drag and thrust
        assert!((large.parameters.mass_kg - 8.0 * small.parameters.mass_kg).abs() < 1e-9);
        assert!((large.parameters.m_diag[5] - 32.0 * small.parameters.m_diag[5]).abs() < 1e-9);
        let top = |file: &VehicleFile| file.parameters.beta5_n_s2_per_rad2 / file.parameters.quadratic_diag[0];
        assert!((top(&large) - top(&small)).abs() < 1e-15);
    }

    #[test]
    fn every_template_is_a_vehicle_file() {
        for (template, text) in TEMPLATES {
            let file = VehicleFile::parse(text, Path::new("template")).unwrap_or_else(|e| panic!("{template:?}: {e}"));
            assert!(!file.name.is_empty());
        }
    }
}
