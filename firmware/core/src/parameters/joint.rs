//! Conditions on several parameters together.

use super::row::check_with;
use super::{Declaration, Learnt, ParameterError, VehicleParameters};
#[cfg(not(target_os = "none"))]
use core::fmt;

/// One condition on several parameters.
struct Rule {
    /// The parameters concerned.
    #[cfg(not(target_os = "none"))]
    parameters: &'static [&'static str],
    /// What is wrong if it does not hold, and what is expected.
    #[cfg(not(target_os = "none"))]
    text: &'static str,
    /// By the vehicle, where it is known the cruise speed, m/s, and what was learnt.
    holds: fn(&VehicleParameters, Option<f64>, &Learnt) -> bool,
}

macro_rules! rule {
    ([$($parameter:literal),+], $text:literal, $holds:expr) => {
        Rule {
            #[cfg(not(target_os = "none"))]
            parameters: &[$($parameter),+],
            #[cfg(not(target_os = "none"))]
            text: $text,
            holds: $holds,
        }
    };
}

/// Their numbers go over the host link: add new ones at the end.
const RULES: [Rule; 10] = [
    rule!(["vehicle.length_m", "vehicle.diameter_m"], "the hull is thicker than long", |v, _, _| v.length_m
        >= v.diameter_m),
    // An identified m_11 may lie some percent below the dry mass.
    rule!(
        ["vehicle.mass_kg", "inertia.m_diag[0]", "inertia.m_diag[1]", "inertia.m_diag[2]"],
        "rigid body plus added mass is less than half of the dry mass",
        |v, _, _| v.m_diag.iter().take(3).all(|m| *m >= 0.5 * v.mass_kg)
    ),
    rule!(
        ["vehicle.mass_kg", "vehicle.displaced_mass_kg"],
        "the vehicle sinks or floats like a stone or a cork: expected a displaced mass of half to twice the dry mass",
        |v, _, _| (0.5 * v.mass_kg..=2.0 * v.mass_kg).contains(&v.displaced_mass_kg)
    ),
    rule!(
        ["vehicle.b_cb_to_cg_m[2]"],
        "the vehicle is statically unstable: expected the centre of buoyancy above the centre of gravity (more than 0)",
        |v, _, _| v.b_cb_to_cg_m[2] > 0.0
    ),
    rule!(
        ["drag.d26", "drag.quadratic_diag[1]", "drag.quadratic_diag[5]"],
        "drag feeds energy into sway and yaw: expected a smaller d26",
        |v, _, _| v.d26.abs() <= cross_drag_limit(v.quadratic_diag[1], v.quadratic_diag[5])
    ),
    rule!(
        ["drag.d35", "drag.quadratic_diag[2]", "drag.quadratic_diag[4]"],
        "drag feeds energy into heave and pitch: expected a smaller d35",
        |v, _, _| v.d35.abs() <= cross_drag_limit(v.quadratic_diag[2], v.quadratic_diag[4])
    ),
    rule!(
        [
            "vehicle.length_m",
            "fins.phi_rad[0]",
            "fins.phi_rad[1]",
            "fins.phi_rad[2]",
            "fins.phi_rad[3]",
            "fins.cp_m[0][0]",
            "fins.cp_m[1][0]",
            "fins.cp_m[2][0]",
            "fins.cp_m[3][0]",
            "fins.gain[0]",
            "fins.gain[1]",
            "fins.gain[2]",
            "fins.gain[3]"
        ],
        "the fins cannot steer: expected fins away from the centre of gravity that turn the vehicle in pitch and in yaw",
        |v, _, _| fins_steer(v)
    ),
    rule!(
        [
            "drag.quadratic_diag[0]",
            "drag.linear_surge_ns_per_m",
            "propeller.beta5_n_s2_per_rad2",
            "propeller.advance_n_s2_per_rad_m",
            "propeller.omega_max_radps"
        ],
        "thrust and drag do not balance at a speed of a vehicle: expected a top speed of 0.1 to 30 m/s",
        |v, _, _| (0.1..=30.0).contains(&top_speed_mps(v))
    ),
    rule!(
        [
            "app.cruise_speed_mps",
            "drag.quadratic_diag[0]",
            "drag.linear_surge_ns_per_m",
            "propeller.beta5_n_s2_per_rad2",
            "propeller.advance_n_s2_per_rad_m",
            "propeller.omega_max_radps"
        ],
        "the vehicle does not reach the cruise speed: expected a lower one, or more thrust",
        |v, cruise_speed_mps, _| cruise_speed_mps.is_none_or(|speed_mps| speed_mps <= top_speed_mps(v))
    ),
    rule!(
        ["learnt.correlation_m22"],
        "no covariance has the correlations of [learnt]: expected a positive definite matrix",
        |_, _, learnt| learnt.check().is_ok()
    ),
];

/// Numbers that are each in range but do not go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inconsistent {
    rule: u8,
}

impl Inconsistent {
    /// The number of the rule that does not hold, as it goes over the host link.
    #[must_use]
    pub const fn rule(self) -> u8 {
        self.rule
    }
}

#[cfg(not(target_os = "none"))]
impl Inconsistent {
    /// By [`Self::rule`]; `None`: a rule that is not known here.
    #[must_use]
    pub fn of_rule(rule: u8) -> Option<Self> {
        (usize::from(rule) < RULES.len()).then_some(Self { rule })
    }

    /// The parameters concerned, by their names.
    #[must_use]
    pub fn parameters(self) -> &'static [&'static str] {
        RULES[usize::from(self.rule)].parameters
    }

    /// The same with the values at hand: one line for people.
    #[must_use]
    pub fn with_values(self, value: impl Fn(&str) -> Option<f64>) -> impl fmt::Display {
        fmt::from_fn(move |f| {
            write!(f, "{self}; ")?;
            for (i, name) in self.parameters().iter().enumerate() {
                let comma = if i == 0 { "" } else { ", " };
                match value(name) {
                    Some(value) => write!(f, "{comma}{name} = {value}")?,
                    None => write!(f, "{comma}{name}")?,
                }
            }
            Ok(())
        })
    }
}

#[cfg(not(target_os = "none"))]
impl fmt::Display for Inconsistent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "parameters do not go together: {}", RULES[usize::from(self.rule)].text)
    }
}

#[cfg(not(target_os = "none"))]
impl core::error::Error for Inconsistent {}

/// Checks the joint conditions on parameters that are each in range; those on the cruise speed, m/s, only where it is
/// known.
///
/// # Errors
/// The first rule that does not hold.
pub fn joint_check(
    vehicle: &VehicleParameters,
    cruise_speed_mps: Option<f64>,
    learnt: &Learnt,
) -> Result<(), Inconsistent> {
    match (0..).zip(&RULES).find(|(_, rule)| !(rule.holds)(vehicle, cruise_speed_mps, learnt)) {
        Some((rule, _)) => Err(Inconsistent { rule }),
        None => Ok(()),
    }
}

impl VehicleParameters {
    /// Checks every number against the range that the table of parameters declares. Drag must take energy out of every
    /// motion, so that d26 and d35 are bounded by [`cross_drag_limit`] of their axes.
    ///
    /// # Errors
    /// The first parameter that is not finite or outside its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.validate_from(|declaration| declaration.min)
    }

    /// [`Self::validate`] of a vehicle with effects: fitted ones may take more linear drag or advance away than was
    /// declared.
    pub(crate) fn validate_with_effects(&self) -> Result<(), ParameterError> {
        self.validate_from(|declaration| match declaration.key {
            "drag.linear_surge_ns_per_m" | "propeller.advance_n_s2_per_rad_m" => -declaration.max,
            _ => declaration.min,
        })
    }

    fn validate_from(&self, min: impl Fn(&Declaration) -> f64) -> Result<(), ParameterError> {
        check_with(Self::ROWS, self, min)?;
        let d = &self.quadratic_diag;
        for (key, value, max) in
            [("drag.d26", self.d26, cross_drag_limit(d[1], d[5])), ("drag.d35", self.d35, cross_drag_limit(d[2], d[4]))]
        {
            if value.abs() > max {
                return Err(ParameterError { key, index: 0, value, min: -max, max });
            }
        }
        Ok(())
    }
}

/// Largest |d26| (of d22, d66) or |d35| (of d33, d55) for which drag takes energy out of every motion.
///
/// The drag power of a coupled pair with speeds a and b is d_a a³ + d_b b³ ± d_ab (a b² + a² b);
/// with the sign that feeds the motion and t = a/b it stays positive while
/// |d_ab| ≤ (d_a t³ + d_b)/(t² + t) for all t > 0. The minimum of the right-hand side lies at the only
/// positive root of t⁴ + 2t³ − 2κt − κ, κ = d_b/d_a. 98.8 for the reference vehicle's d26.
///
/// Both arguments must be positive.
#[must_use]
pub fn cross_drag_limit(d_a: f64, d_b: f64) -> f64 {
    let kappa = d_b / d_a;
    // The quartic is convex for t > 0 and not negative at max(1, κ): Newton falls monotonically
    // on the root, by a quarter a step at first.
    let mut t = if kappa > 1.0 { kappa } else { 1.0 };
    for _ in 0..100 {
        let value = ((t + 2.0) * t * t - 2.0 * kappa) * t - kappa;
        let slope = (4.0 * t + 6.0) * t * t - 2.0 * kappa;
        let next = t - value / slope;
        if next.is_nan() || next >= t {
            break;
        }
        t = next;
    }
    (d_a * t * t * t + d_b) / (t * t + t)
}

/// Whether the lift of the fins makes moments about both pitch and yaw, with levers of a twentieth of the length. The
/// lift of a fin is along z of its frame, (0, -sin phi, cos phi).
fn fins_steer(vehicle: &VehicleParameters) -> bool {
    let (mut pitch, mut yaw) = (0.0, 0.0);
    for fin in &vehicle.fins {
        let (sine, cosine) = libm::sincos(fin.phi_rad);
        let lever = fin.gain * fin.cp_m[0];
        pitch += (lever * cosine) * (lever * cosine);
        yaw += (lever * sine) * (lever * sine);
    }
    let least = 0.05 * vehicle.length_m;
    pitch >= least * least && yaw >= least * least
}

/// Speed at which the drag of straight flight balances the thrust of the fastest propeller, m/s.
fn top_speed_mps(vehicle: &VehicleParameters) -> f64 {
    let omega = vehicle.omega_max_radps;
    let square = vehicle.quadratic_diag[0];
    let linear = vehicle.linear_surge_ns_per_m + vehicle.advance_n_s2_per_rad_m * omega;
    let thrust = vehicle.beta5_n_s2_per_rad2 * omega * omega;
    (libm::sqrt(linear * linear + 4.0 * square * thrust) - linear) / (2.0 * square)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_can_break_and_names_its_parameters() {
        let iver = VehicleParameters::IVER3;
        let (cruise_speed_mps, none) = (Some(1.0), Learnt::NONE);
        assert_eq!(joint_check(&iver, cruise_speed_mps, &none), Ok(()));
        let broken = [
            VehicleParameters { diameter_m: 3.0, ..iver },
            VehicleParameters { m_diag: [18.0, 74.0, 74.0, 0.2, 20.0, 20.0], ..iver },
            VehicleParameters { displaced_mass_kg: 3.8, ..iver },
            VehicleParameters { b_cb_to_cg_m: [0.0, 0.0, -0.015], ..iver },
            VehicleParameters { d26: 100.0, ..iver },
            VehicleParameters { d35: -100.0, ..iver },
            VehicleParameters { fins: iver.fins.map(|fin| super::super::FinGeometry { phi_rad: 0.0, ..fin }), ..iver },
            VehicleParameters { omega_max_radps: 5.0, ..iver },
            VehicleParameters { omega_max_radps: 50.0, ..iver },
        ];
        for (rule, vehicle) in (0..).zip(&broken) {
            let refused = joint_check(vehicle, cruise_speed_mps, &none).unwrap_err();
            assert_eq!((refused.rule(), Inconsistent::of_rule(rule)), (rule, Some(refused)));
            assert!(!refused.parameters().is_empty());
        }
        assert_eq!(joint_check(&broken[8], None, &none), Ok(()));
        let mut learnt = Learnt { sigma: [0.1; 16], ..none };
        learnt.set_correlation(1, 0, 1.0);
        let refused = joint_check(&iver, None, &learnt).unwrap_err();
        assert_eq!(usize::from(refused.rule()), broken.len());
        assert_eq!(Inconsistent::of_rule(RULES.len() as u8), None);
    }

    /// The top speed of the reference vehicle by hand: sqrt(3e-4 / 3) 200 rad/s.
    #[test]
    fn val_top_speed() {
        assert!((top_speed_mps(&VehicleParameters::IVER3) - 2.0).abs() < 1e-12);
    }
}
