//! When commands act, told by the rows next to their changes.
//!
//! Over windows of 20 s a command that acts a fifth of a second early hardly shows beside what the model does wrong, and
//! starts that are held to differences of rows smear it: a rate at a row is a mean over a second. Windows of a few rows
//! whose starts are free tell it, as a regression of rates on the commands row by row would, with the vehicle's own
//! response between.

use super::fitted::Fitted;
use backseat_identify::short_runs::Unknown;

/// The effect of the catalogue.
pub(super) const EFFECT: &str = "input_delay";
/// What a few rows do not tell: attitude that is late is the same as commands that are early, and a DVL reads once or
/// twice.
pub(super) const NOT_TOLD: [&str; 2] = ["attitude_delay", "dvl_delay"];
/// Length of the windows, s.
pub(super) const LENGTH_S: f64 = 3.0;
/// What servos and the shape of the response add to a delay, one sigma, s.
const RESPONSE_S: f64 = 0.025;

/// A run whose leaving out moves a value by more sigmas is left out by a fit of its own: one step does not reach so far.
const FAR: f64 = 8.0;

/// One delay.
struct Delay {
    name: String,
    value: f64,
    sigma: f64,
    prior_share: f64,
}

/// The delays of the commands.
pub(super) struct Timing {
    delays: Vec<Delay>,
}

impl Timing {
    /// By a fit to windows of [`LENGTH_S`].
    pub(super) fn of(fitted: &Fitted<'_>) -> Self {
        let fit = &fitted.fit;
        let is_near = |values: &[f64]| {
            let moves = values.iter().zip(&fit.values).enumerate();
            moves.into_iter().all(|(place, (a, b))| (a - b).abs() < FAR * fit.covariance[(place, place)].sqrt())
        };
        let without = |run: usize| {
            let step = fit.without(run);
            let again = || fitted.problem.fit(&|other| other != run, &fit.values, &[LENGTH_S]);
            if is_near(&step) { step } else { again().map_or(step, |fit| fit.values) }
        };
        let sigmas = fit.sigmas_by(fit.runs().into_iter().map(without).collect());
        let delay = |place: usize| Delay {
            name: fitted.problem.unknowns[place].name.clone(),
            value: fit.values[place],
            sigma: sigmas[place].hypot(RESPONSE_S),
            prior_share: fit.prior_share[place],
        };
        Self { delays: fitted.places(EFFECT).into_iter().map(delay).collect() }
    }

    fn delay(&self, unknown: &Unknown) -> Option<&Delay> {
        self.delays.iter().find(|delay| delay.name == unknown.name)
    }

    /// What the rows say of an unknown, as its prior.
    pub(super) fn inform(&self, unknown: &mut Unknown) {
        if let Some(delay) = self.delay(unknown) {
            (unknown.prior, unknown.sigma) = (delay.value, delay.sigma);
        }
    }

    /// Its value, sigma, and the share of the textbook's prior in it.
    pub(super) fn known(&self, unknown: &Unknown) -> Option<[f64; 3]> {
        self.delay(unknown).map(|delay| [delay.value, delay.sigma, delay.prior_share])
    }
}
