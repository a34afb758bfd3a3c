//! A vehicle file from a template and the numbers of a data sheet.

use backseat_logs::VehicleFile;

/// A vehicle to start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Template {
    /// What it is called.
    pub name: &'static str,
    /// Which vehicle, and where its numbers are from.
    pub about: &'static str,
    /// Its vehicle file.
    pub text: &'static str,
}

/// Vehicles to start from.
pub const TEMPLATES: [Template; 3] = [
    Template {
        name: "iver3",
        about: "L3 OceanServer Iver3: engineering estimates, the reference vehicle",
        text: include_str!("../../../logs/vehicles/iver3.toml"),
    },
    Template {
        name: "remus100",
        about: "Hydroid REMUS 100: coefficients of Prestero (2001)",
        text: include_str!("../../../logs/vehicles/remus100.toml"),
    },
    Template {
        name: "lauv",
        about: "LAUV of LSTS Porto: coefficients of da Silva (2007)",
        text: include_str!("../../../logs/vehicles/lauv.toml"),
    },
];

/// What a data sheet says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sizes {
    /// Length over all, m.
    pub length_m: Option<f64>,
    /// Diameter of the hull, m.
    pub diameter_m: Option<f64>,
    /// Dry mass, kg; the displaced mass keeps its ratio to it. Without it the vehicle is as dense as the template.
    pub mass_kg: Option<f64>,
}

impl Sizes {
    /// The template in these sizes: added mass scales with the mass, moments of inertia with mass and size squared, drag
    /// with the areas that make it, thrust with the drag.
    pub fn scale(&self, template: &VehicleFile) -> VehicleFile {
        let mut file = template.clone();
        file.name = format!("{}-scaled", template.name);
        let p = &mut file.parameters;
        let length = self.length_m.map_or(1.0, |length| length / p.length_m);
        let diameter = self.diameter_m.map_or(1.0, |diameter| diameter / p.diameter_m);
        let mass = self.mass_kg.map_or(length * diameter * diameter, |mass| mass / p.mass_kg);
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn val_a_vehicle_twice_as_large_has_the_same_top_speed() {
        let sizes = Sizes { length_m: Some(4.0), diameter_m: Some(0.294), mass_kg: None };
        let (small, large) = (VehicleFile::reference(), sizes.scale(&VehicleFile::reference()));
        // a body twice as large: eight times the mass, 32 times the moments of inertia, four times drag and thrust
        assert!((large.parameters.mass_kg - 8.0 * small.parameters.mass_kg).abs() < 1e-9);
        assert!((large.parameters.m_diag[5] - 32.0 * small.parameters.m_diag[5]).abs() < 1e-9);
        let top = |file: &VehicleFile| file.parameters.beta5_n_s2_per_rad2 / file.parameters.quadratic_diag[0];
        assert!((top(&large) - top(&small)).abs() < 1e-15);
    }

    #[test]
    fn every_template_is_a_vehicle_file() {
        for Template { name, text, .. } in TEMPLATES {
            let file = VehicleFile::parse(text, Path::new("template")).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(!file.name.is_empty());
        }
    }
}
