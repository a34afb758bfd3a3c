//! The numbers that are fitted: which they are, their prior, and how they make a model.

use super::model::{Dvl, RunModel, add_to_plant, common};
use backseat_core::dynamics::{ParameterError, VehicleParameters};
use backseat_core::effects::{FIN_NAMES, ParameterId, dvl_scale};
use backseat_logs::VehicleFile;
use backseat_logs::short_runs::{COMMON, Configuration, OF_CONFIGURATION, ShortRuns, Value};
use backseat_logs::textbook::Scatter;

/// Where a number stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Factor e^x of these entries of the mass matrix.
    Mass(&'static [usize]),
    /// Factor e^x of these quadratic drags.
    Drag(&'static [usize]),
    /// Factor e^x of the fins' lift.
    FinLift,
    /// Factor e^x of the fins' angle of stall.
    Stall,
    /// Added to the cubic of the fins' lift.
    LiftCurve,
    /// Factor e^x of the thrust.
    Thrust,
    /// Thrust lost with speed, as a share of the thrust at 1.5 m/s and the log's usual propeller speed.
    Advance,
    /// Factor e^x of the height of the metacentre, b_z.
    Metacentre,
    /// Gain of a fin.
    FinGain(usize),
    /// Lift of the hull.
    HullLift,
    /// Arm of the propeller's torque.
    TorqueArm,
    /// A common term.
    Common(usize),
    /// A term of one configuration: term, configuration.
    Of(usize, usize),
    /// Delay of the DVL, s.
    DvlDelay,
    /// Turn of the DVL, rad.
    DvlYaw,
    /// By which share the DVL reads too much.
    DvlScale,
}

/// One number that is fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Name in reports.
    pub name: String,
    /// Effect of the catalogue that it belongs to; empty for the textbook's coefficients.
    pub effect: &'static str,
    /// Where it stands.
    pub place: Place,
    /// Mean of the prior, in its own coordinate.
    pub prior: f64,
    /// One sigma of the prior.
    pub sigma: f64,
    /// What a data sheet, a mounting or a row's time leaves open of it around none: no finding.
    pub open: [f64; 2],
}

impl Unknown {
    /// Where a fit begins: at the prior. An angle of stall that is never reached has no derivative, so that one begins
    /// where large incidences do reach it.
    pub fn first_guess(&self) -> f64 {
        if self.place == Place::Stall { self.prior - 1.5 * self.sigma } else { self.prior }
    }
}

/// The model that all values make.
#[derive(Clone, Debug)]
pub struct Draft {
    /// Plant.
    pub parameters: VehicleParameters,
    /// In the order of [`COMMON`].
    pub common: [f64; COMMON.len()],
    /// Of each configuration.
    pub configurations: Vec<[f64; OF_CONFIGURATION.len()]>,
    /// How the DVL reads.
    pub dvl: Dvl,
}

/// Where a vehicle file has the DVL's scale.
fn dvl_ratio() -> Option<ParameterId> {
    ParameterId::find(dvl_scale::INFO.name, "ratio")
}

impl Draft {
    /// What a vehicle file declares.
    #[must_use]
    pub fn of(vehicle: &VehicleFile, configurations: usize) -> Self {
        let declared = vehicle.short_runs.clone().unwrap_or_default();
        let of = |place: usize| {
            declared.configurations.get(place).map_or_else(
                || OF_CONFIGURATION.map(|term| term.default),
                |configuration| configuration.values.map(|value| value.value),
            )
        };
        Self {
            parameters: vehicle.parameters,
            common: declared.common.map(|value| value.value),
            configurations: (0..configurations.max(1)).map(of).collect(),
            dvl: Dvl {
                delay_s: vehicle.installation.dvl_delay_s,
                yaw_rad: vehicle.installation.dvl_turn_rad[2],
                scale: dvl_ratio().map_or(0.0, |id| vehicle.effects.set.get(id)),
            },
        }
    }

    /// Adds the values of unknowns.
    pub fn with(&self, unknowns: &[Unknown], values: &[f64]) -> Self {
        let mut draft = self.clone();
        for (unknown, &value) in unknowns.iter().zip(values) {
            draft.add(unknown.place, value);
        }
        draft
    }

    fn add(&mut self, place: Place, value: f64) {
        let plant = &mut self.parameters;
        match place {
            Place::Mass(places) => places.iter().for_each(|&i| plant.m_diag[i] *= value.exp()),
            Place::Drag(places) => places.iter().for_each(|&i| plant.quadratic_diag[i] *= value.exp()),
            Place::FinLift => plant.cl = plant.cl.map(|cl| cl * value.exp()),
            Place::Stall => plant.stall_rad *= value.exp(),
            Place::Thrust => plant.beta5_n_s2_per_rad2 *= value.exp(),
            Place::Advance => {
                // at 8100 rpm and 1.5 m/s thrust is β5 ω² − k ω u
                let usual_radps = 850.0 / 1.5;
                plant.advance_n_s2_per_rad_m += value.max(0.0) * plant.beta5_n_s2_per_rad2 * usual_radps;
            }
            Place::LiftCurve => plant.cl[1] += value,
            Place::Metacentre => plant.b_cb_to_cg_m[2] *= value.exp(),
            Place::FinGain(fin) => plant.fins[fin].gain += value,
            Place::HullLift => plant.z_uw += value,
            Place::TorqueArm => plant.torque_arm_m += value,
            Place::Common(term) => self.common[term] += value,
            Place::Of(term, configuration) => {
                if let Some(terms) = self.configurations.get_mut(configuration) {
                    terms[term] += value;
                }
            }
            Place::DvlDelay => self.dvl.delay_s += value,
            Place::DvlYaw => self.dvl.yaw_rad += value,
            Place::DvlScale => self.dvl.scale += value,
        }
    }

    /// One model for each configuration.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn models(&self) -> Result<Vec<RunModel>, ParameterError> {
        self.configurations.iter().map(|of| RunModel::new(&self.parameters, self.common, of, self.dvl)).collect()
    }

    /// Whether every number is inside its range; otherwise the name of one that is not.
    pub fn outside(&self) -> Option<&'static str> {
        let common = COMMON.iter().zip(self.common);
        let of = self.configurations.iter().flat_map(|terms| OF_CONFIGURATION.iter().zip(*terms));
        common.chain(of).find(|(term, value)| !(term.min..=term.max).contains(value)).map(|(term, _)| term.name)
    }

    /// Whether a number has run to an end of its range.
    pub fn is_on_limit(&self, place: Place) -> bool {
        let placed = match place {
            Place::Common(term) => Some((&COMMON[term], self.common[term])),
            Place::Of(term, of) => self.configurations.get(of).map(|terms| (&OF_CONFIGURATION[term], terms[term])),
            _ => None,
        };
        placed.is_some_and(|(term, value)| (value - term.min).min(term.max - value) < 1e-2 * (term.max - term.min))
    }
}

const fn mass(places: &'static [usize]) -> Place {
    Place::Mass(places)
}

/// The textbook's coefficients, with the sigma of what scaling by a data sheet leaves open. By how much two that a body of
/// revolution has alike differ is of fins, antennas and doors: no template has it measured.
#[must_use]
pub fn coefficients() -> Vec<Unknown> {
    let scatter = Scatter::TAKEN;
    let ([m1, m2, m4, m5], [d1, d2, d4, d5]) = (scatter.mass, scatter.drag);
    let of = |name: &str, place, sigma| Unknown {
        name: name.to_owned(),
        effect: "",
        place,
        prior: 0.0,
        sigma,
        open: [0.0; 2],
    };
    vec![
        of("ln m11", mass(&[0]), m1),
        of("ln m22 = m33", mass(&[1, 2]), m2),
        of("ln m44", mass(&[3]), m4),
        of("ln m55 = m66", mass(&[4, 5]), m5),
        of("ln d11", Place::Drag(&[0]), d1),
        of("ln d22 = d33", Place::Drag(&[1, 2]), d2),
        of("ln d33/d22", Place::Drag(&[2]), 0.5),
        of("ln d44", Place::Drag(&[3]), d4),
        of("ln d55 = d66", Place::Drag(&[4, 5]), d5),
        of("ln fin lift", Place::FinLift, scatter.fin_lift),
        of("ln stall", Place::Stall, scatter.stall),
        of("ln beta5", Place::Thrust, scatter.thrust),
        of("ln m33/m22", mass(&[2]), 0.15),
        of("ln m66/m55", mass(&[5]), 0.10),
        of("ln d66/d55", Place::Drag(&[5]), 0.3),
        of("ln b_z", Place::Metacentre, scatter.metacentre),
    ]
}

/// One sigma of what a term differs by between two configurations, in the order of [`OF_CONFIGURATION`]: hull and ballast
/// are the same, a battery moves by a few mm; fins may stand off their zero by anything. Without it moments with u² and
/// trims trade from day to day, which one speed does not forbid and another does.
pub(super) const SPREAD: [f64; OF_CONFIGURATION.len()] = [ANY, ANY, ANY, 3e-4, 1e-4, 0.05, ANY];
const ANY: f64 = 1e3;

/// What an entry of the catalogue adds, for so many configurations.
#[must_use]
pub fn of_effect(effect: &'static str, configurations: usize) -> Vec<Unknown> {
    let one = |name: &str, place, sigma, open: [f64; 2]| {
        let name = name.to_owned();
        Unknown { name, effect, place, prior: 0.0, sigma, open }
    };
    let common = |term: usize, sigma: f64, open| one(COMMON[term].name, Place::Common(term), sigma, open);
    let each = |term: usize, sigma: f64, open: f64| {
        (0..configurations.max(1)).map(move |configuration| Unknown {
            name: format!("{}[{configuration}]", OF_CONFIGURATION[term].name),
            effect,
            place: Place::Of(term, configuration),
            prior: 0.0,
            sigma,
            open: [-open, open],
        })
    };
    match effect {
        // a servo and a propeller lag; a row twice a second does not say when within it the motor's speed changed
        "input_delay" => {
            vec![common(common::FIN_DELAY, 0.4, [-0.05, 0.2]), common(common::PROPELLER_DELAY, 0.4, [-0.25, 0.5])]
        }
        "attitude_delay" => vec![common(common::ATTITUDE_DELAY, 0.3, [-0.05, 0.1])],
        "fin_gain" => FIN_NAMES
            .iter()
            .enumerate()
            .map(|(fin, name)| one(&format!("gain_{name}"), Place::FinGain(fin), 0.5, [-0.1, 0.1]))
            .collect(),
        "propeller_torque" => vec![one("torque_arm_m", Place::TorqueArm, 0.05, [0.0; 2])],
        "ahrs_tilt" => vec![common(common::AHRS_TILT, 0.7, [-0.1, 0.1])],
        "rudder_gain" => each(6, 0.3, 0.1).skip(1).collect(),
        "hull_lift" => vec![one("z_uw", Place::HullLift, 25.0, [-10.0, 10.0])],
        "dvl_scale" => vec![one("dvl_scale", Place::DvlScale, 0.06, [-0.02, 0.02])],
        "lift_curve" => vec![one("cl4", Place::LiftCurve, 3.0, [-1.0, 1.0])],
        // what is open is told by the fins' lift
        "speed_moment" => each(0, 0.3, 0.0).chain(each(1, 0.5, 0.0)).chain(each(2, 0.5, 0.0)).collect(),
        "pitch_trim" => each(3, 0.005, 5e-4).collect(),
        "roll_trim" => each(4, 0.001, 2e-4).collect(),
        "buoyancy_offset" => each(5, 0.3, 0.05).collect(),
        "thrust_loss" => {
            vec![Unknown { prior: 0.3, ..one("thrust loss, share", Place::Advance, 0.3, [0.0, 0.4]) }]
        }
        "dvl_delay" => vec![Unknown { prior: 0.5, ..one("dvl_delay_s", Place::DvlDelay, 0.5, [-0.1, 0.2]) }],
        "dvl_misalignment" => vec![one("dvl yaw_rad", Place::DvlYaw, 0.1, [-0.02, 0.02])],
        _ => Vec::new(),
    }
}

/// Fins are set to zero this well, rad.
const FIN_ZERO_RAD: f64 = 0.009;

/// What the zero of fins with this lift leaves open of a moment with u², N s²/m: of four about the roll axis, of two about
/// the others.
#[must_use]
pub fn open_moment(plant: &VehicleParameters, axis: usize) -> f64 {
    let slope = 0.5 * plant.rho_kg_per_m3 * plant.fin_area_m2 * plant.cl[0] * FIN_ZERO_RAD;
    let [x, y, z] = plant.fins[0].cp_m;
    match axis {
        0 => 2.0 * slope * y.hypot(z),
        _ => 2.0_f64.sqrt() * slope * x.abs(),
    }
}

/// Takes over what a fit found into a vehicle file. What the first configuration has goes into the sections that every
/// command reads; the configurations then hold their differences from it.
#[must_use]
pub fn into_vehicle(declared: &VehicleFile, draft: &Draft, configurations: &[Configuration]) -> VehicleFile {
    let mut vehicle = declared.clone();
    vehicle.parameters = draft.parameters;
    vehicle.installation.dvl_delay_s = draft.dvl.delay_s;
    vehicle.installation.dvl_turn_rad[2] = draft.dvl.yaw_rad;
    if let Some(ratio) = dvl_ratio() {
        vehicle.effects.set.set(ratio, draft.dvl.scale);
    }
    let first = draft.configurations.first().copied().unwrap_or_default();
    add_to_plant(&mut vehicle.parameters, &first);
    let configurations = configurations.iter().zip(&draft.configurations);
    let values = |of: &[f64; OF_CONFIGURATION.len()]| core::array::from_fn(|term| Value::from(of[term] - first[term]));
    vehicle.short_runs = Some(ShortRuns {
        common: draft.common.map(Value::from),
        configurations: configurations
            .map(|(configuration, of)| Configuration { values: values(of), ..configuration.clone() })
            .collect(),
    });
    vehicle
}
