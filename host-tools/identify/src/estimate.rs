//! What a method says.

use crate::options::Method;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::Visibility;
use nalgebra::DMatrix;

/// One identified parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatedParameter {
    /// Name, as in [`crate::parameters::name`].
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Estimate.
    pub value: f64,
    /// 95 % confidence interval, where the method has one.
    pub ci95: Option<[f64; 2]>,
    /// What was declared.
    pub prior: f64,
    /// What the motion shows of it.
    pub visibility: Visibility,
}

/// A parameter that the data do not show, and what would.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unseen {
    /// Name.
    pub name: &'static str,
    /// The manoeuvre that would show it.
    pub manoeuvre: &'static str,
}

/// One step of the automatic method.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What was tried.
    pub what: String,
    /// Squared prediction error on held-out data in units of the noise, before and after; 1 is noise alone.
    pub held_out: [f64; 2],
    /// Standard error of the difference.
    pub standard_error: f64,
    /// Whether it was taken.
    pub accepted: bool,
}

/// The result of an identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// By which method.
    pub method: Method,
    /// Every parameter, in the order of θ, then d26 and d35.
    pub parameters: Vec<EstimatedParameter>,
    /// The vehicle with them.
    pub vehicle: VehicleParameters,
    /// Covariance of the errors of θ, d26 and d35, where the method has one; zero where a parameter was held.
    pub covariance: Option<DMatrix<f64>>,
    /// Groups that the motion shows only together.
    pub collinear: Vec<Vec<&'static str>>,
    /// What it does not show.
    pub unseen: Vec<Unseen>,
    /// Steps of the automatic method.
    pub steps: Vec<Step>,
    /// What else is to be known.
    pub notes: Vec<String>,
}
