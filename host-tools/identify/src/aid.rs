//! Adaptive identification over a log: the board's identifier as it runs under way, and offline without its delay.
//!
//! Offline the same laws run several times over the trajectory that [`crate::smoothing`] makes with the model of the
//! run before; each run's filter is slower than the last one's, because the model leaves less to it.

use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::excitation::described;
use crate::identifier::run_identifier;
use crate::options::{IdentifyError, Method, Options};
use crate::parameters;
use crate::sample::{PERIOD_S, STEPS};
use crate::smoothing::{self, CutOffs, Smoothed};
use backseat_core::dynamics::{Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::aid::{AidState, Instant, heun, model_acceleration, rates};
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::identification::theta::{PARAMETERS, theta_of, with_theta};
use backseat_core::identification::{Excitation, ParameterBox, Theta, Visibility};
use backseat_core::state;
use backseat_logs::interrupt;
use nalgebra::Vector6;

/// Passes offline: cut-off of what the model leaves of velocity (Hz), γ at the start and in the end (1/s²).
const PASSES: [(f64, [f64; 2]); 3] = [(0.5, [0.3, 0.03]), (0.1, [0.3, 0.03]), (0.05, [0.1, 0.01])];
/// Where integrated rates take over from measured angles, Hz.
const ATTITUDE_HZ: f64 = 0.03;
/// Cut-off of what the model leaves of the rates: gyros are quiet, and fast roll is seen by them alone, Hz.
const RATES_HZ: f64 = 1.0;
/// Time constant of γ's fall, s.
const GAMMA_TIME_S: f64 = 1000.0;
/// α of (4.41), 1/s.
const ALPHA_PER_S: f64 = 0.3;
/// The estimates of this last time are averaged, s, or of half the log if it is shorter.
const AVERAGE_S: f64 = 1000.0;
/// Bound of the trace of M⁻¹ Y Γ Yᵀ dt², as in the core.
const STIFFNESS_LIMIT: f64 = 0.3;

/// The board's identifier, as it would have run under way.
pub(crate) fn online(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<Estimate, IdentifyError> {
    let identifier = run_identifier(data, prior, options)?;
    let vehicle = identifier.parameters().unwrap_or(*prior);
    Ok(described(Method::AidOnline, data, prior, options, &parameters::of(&vehicle), None))
}

/// Several passes without delay.
pub(crate) fn offline(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, IdentifyError> {
    let vehicle = refine(data, prior, options, progress)?;
    Ok(described(Method::Aid, data, prior, options, &parameters::of(&vehicle), None))
}

/// The vehicle after all passes.
pub(crate) fn refine(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<VehicleParameters, IdentifyError> {
    let identifier = run_identifier(data, prior, options)?;
    let mut vehicle = identifier.parameters().unwrap_or(*prior);
    let excitation = identifier.excitation();
    let bounds = ParameterBox::around(prior, options.box_ratio);
    for (index, (velocity_hz, gamma)) in PASSES.into_iter().enumerate() {
        progress((index + 1) as f64 / (PASSES.len() + 1) as f64);
        let model = VehicleModel::new(&vehicle).map_err(IdentifyError::Prior)?;
        let v = velocity_hz;
        let cutoffs: CutOffs = [ATTITUDE_HZ, ATTITUDE_HZ, v, v, v, RATES_HZ, RATES_HZ, RATES_HZ];
        let smoothed: Vec<Smoothed> =
            data.stretches().map(|samples| smoothing::with_model(&model, samples, &cutoffs)).collect();
        vehicle = with_theta(&vehicle, &pass(data, &smoothed, &model, &excitation, &bounds, gamma));
    }
    progress(1.0);
    Ok(vehicle)
}

/// One run of the laws over smoothed stretches: the mean of θ̂ over the last part.
fn pass(
    data: &IdentificationData,
    smoothed: &[Smoothed],
    model: &VehicleModel,
    excitation: &Excitation,
    bounds: &ParameterBox,
    gamma: [f64; 2],
) -> Theta {
    let energy = mean_energy(data, smoothed, model);
    let dt = 0.5 * PERIOD_S;
    let total_s = data.duration_s();
    let average_from_s = total_s - AVERAGE_S.min(0.5 * total_s);
    let mut state = AidState { velocity: Vector6::zeros(), theta: theta_of(model.parameters()) };
    let (mut elapsed_s, mut sum, mut count) = (0.0, Theta::zeros(), 0.0);
    for (samples, smoothed) in data.stretches().zip(smoothed) {
        let Some(first) = smoothed.states.first() else { continue };
        state.velocity = state::velocity(first);
        for (instant, pair) in smoothed.states.windows(2).enumerate() {
            interrupt::check();
            let input = samples[instant / STEPS].input.step(instant % STEPS);
            let [then, now] = [0, 1].map(|i| {
                let x = &pair[i];
                Instant::new(model, &state::velocity(x), &Attitude::new(&state::attitude(x)).down(), &input[i])
            });
            let now_gamma = gamma[1] + (gamma[0] - gamma[1]) * (-elapsed_s / GAMMA_TIME_S).exp();
            let mut gains = Theta::from_fn(|j, _| {
                let adapts = matches!(excitation[j].visibility, Visibility::Separate | Visibility::Collinear);
                if adapts && energy[j] > 0.0 { now_gamma / energy[j] } else { 0.0 }
            });
            let first = rates(&state, ALPHA_PER_S, &then);
            let stiffness = stiffness(model, &first.model_acceleration, &then, &gains) * dt * dt;
            if stiffness > STIFFNESS_LIMIT {
                gains *= STIFFNESS_LIMIT / stiffness;
            }
            let mut next = heun(&state, &first, &gains, ALPHA_PER_S, &now, dt);
            bounds.project(&mut next.theta);
            if next.velocity.iter().chain(next.theta.iter()).all(|value| value.is_finite()) {
                state = next;
            } else {
                state.velocity = now.velocity;
            }
            elapsed_s += dt;
            if elapsed_s > average_from_s {
                sum += state.theta;
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { state.theta }
}

/// Mean of (Yᵀ M⁻¹ Y)_jj at every tenth sample.
fn mean_energy(data: &IdentificationData, smoothed: &[Smoothed], model: &VehicleModel) -> Theta {
    let theta = theta_of(model.parameters());
    let (mut energy, mut count) = (Theta::zeros(), 0.0);
    let mut y = Regressor::zeros();
    for (samples, smoothed) in data.stretches().zip(smoothed) {
        for (sample, x) in samples.iter().zip(smoothed.states.iter().step_by(2)).step_by(10) {
            let down = Attitude::new(&state::attitude(x)).down();
            let at = Instant::new(model, &state::velocity(x), &down, &sample.input.mean());
            let acceleration = model_acceleration(&theta, &at);
            regressor(&acceleration, &at.velocity, &at.down, &at.actuators, &mut y);
            for j in 0..PARAMETERS {
                energy[j] += column_energy(model, &y, j);
            }
            count += 1.0;
        }
    }
    energy / f64::max(count, 1.0)
}

fn column_energy(model: &VehicleModel, y: &Regressor, j: usize) -> f64 {
    model.parameters().m_diag.iter().enumerate().map(|(axis, mass)| y[(axis, j)] * y[(axis, j)] / mass).sum()
}

/// Trace of M⁻¹ Y Γ Yᵀ, 1/s².
fn stiffness(model: &VehicleModel, acceleration: &Vector6<f64>, at: &Instant, gains: &Theta) -> f64 {
    let mut y = Regressor::zeros();
    regressor(acceleration, &at.velocity, &at.down, &at.actuators, &mut y);
    (0..PARAMETERS).map(|j| gains[j] * column_energy(model, &y, j)).sum()
}
