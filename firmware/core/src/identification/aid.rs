//! The adaptive identifier's laws (4.38)-(4.46), corrected, and Heun's step on measured samples.
//!
//! With Δv = v̂ − v, symmetric positive M and V = ½ Δvᵀ M Δv + ½ θ̃ᵀ Γ⁻¹ θ̃ (θ̃ = θ̂ − θ) they give V̇ = −α Δvᵀ M Δv
//! (4.47). Because Y(ψ2, …) θ̂ = h identically, θ̂ᵀ Γ⁻¹ θ̂ is conserved where h = 0. A parameter with Γ_j = 0 is held,
//! and all of this stays true with θ̂_j = θ_j.

use super::regressor::{ActuatorRegressor, known_wrench};
use super::theta::{B1, BETA1, D11, M11, Theta, W};
use crate::dynamics::{ActuatorInput, VehicleModel, coriolis};
use nalgebra::{Vector3, Vector6};

/// The measurements of one instant in the form of the laws: computed once, used by two Heun steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// v: body velocity through the water, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// s = Rᵀ e3.
    pub down: Vector3<f64>,
    /// G_a(v, ξ).
    pub actuators: ActuatorRegressor,
    /// h(v, ξ), N and N m.
    pub known: Vector6<f64>,
}

impl Instant {
    /// From measurements. `model` gives the fins' geometry and the parameters that θ does not hold.
    #[must_use]
    pub fn new(model: &VehicleModel, velocity: &Vector6<f64>, down: &Vector3<f64>, input: &ActuatorInput) -> Self {
        Self {
            velocity: *velocity,
            down: *down,
            actuators: model.actuator_regressor(velocity, input),
            known: known_wrench(model.parameters(), velocity, input),
        }
    }
}

/// Both ends of an interval of dt (s) with one input, each moved dt/6 inwards along the motion of the model θ̂; an end
/// is v and s = Rᵀ e3.
///
/// Between samples ∫ x dt = dt/2 (x₀ + x₁) + dt²/12 (ẋ₀ − ẋ₁) to fourth order, which for what is linear in x is the
/// trapezoidal rule over the moved ends: Heun's step then integrates to fourth order. Inputs change in steps at the
/// samples, where ẋ has jumps; these are its values within the interval. Roll, whose fins damp it within an interval or
/// two, moves by them: without this correction a perfect model misses its acceleration by 8 %.
#[must_use]
pub fn interval(
    model: &VehicleModel,
    theta: &Theta,
    ends: [(&Vector6<f64>, &Vector3<f64>); 2],
    input: &ActuatorInput,
    dt: f64,
) -> [Instant; 2] {
    let mut reach = -dt / 6.0;
    ends.map(|(velocity, down)| {
        reach = -reach;
        let acceleration = model_acceleration(theta, &Instant::new(model, velocity, down, input));
        let rates = Vector3::new(velocity[3], velocity[4], velocity[5]);
        let (velocity, down) = (velocity + acceleration * reach, down + down.cross(&rates) * reach);
        Instant::new(model, &velocity, &down, input)
    })
}

/// State of the identifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AidState {
    /// v̂, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// θ̂.
    pub theta: Theta,
}

/// ψ2, the acceleration of the model θ̂ at the measured velocity:
/// M̂⁻¹ (−ad(v) M̂ v − d̂ ∘ |v| ∘ v + [ŵ s; B̂ x s] + G_a β̂ + h).
#[must_use]
pub fn model_acceleration(theta: &Theta, at: &Instant) -> Vector6<f64> {
    let v = &at.velocity;
    let m: [f64; 6] = core::array::from_fn(|i| theta[M11 + i]);
    let force = at.down * theta[W];
    let moment = Vector3::new(theta[B1], theta[B1 + 1], theta[B1 + 2]).cross(&at.down);
    let mut wrench = at.known + at.actuators * theta.fixed_rows::<5>(BETA1) - coriolis(&m, v);
    for axis in 0..3 {
        wrench[axis] += force[axis];
        wrench[3 + axis] += moment[axis];
    }
    Vector6::from_fn(|axis, _| (wrench[axis] - theta[D11 + axis] * v[axis].abs() * v[axis]) / m[axis])
}

/// Yᵀ(ψ2, v, s, ξ) Δv in closed form: (4.42)-(4.46), corrected, without their gains.
#[must_use]
pub fn gradient(psi2: &Vector6<f64>, error: &Vector6<f64>, at: &Instant) -> Theta {
    let split = |x: &Vector6<f64>| (Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5]));
    let (nu, omega) = split(&at.velocity);
    let (d_nu, d_omega) = split(error);
    // ψ1 = ad(v)ᵀ Δv.
    let (psi1_nu, psi1_omega) = (d_nu.cross(&omega) + d_omega.cross(&nu), d_omega.cross(&omega));

    let mut gradient = Theta::zeros();
    for axis in 0..6 {
        let v = at.velocity[axis];
        let psi1 = if axis < 3 { psi1_nu[axis] } else { psi1_omega[axis - 3] };
        gradient[M11 + axis] = psi1 * v + psi2[axis] * error[axis]; // (4.42)
        gradient[D11 + axis] = v.abs() * v * error[axis]; // (4.43)
    }
    gradient[W] = -at.down.dot(&d_nu); // (4.44)
    gradient.fixed_rows_mut::<3>(B1).copy_from(&d_omega.cross(&at.down)); // (4.45)
    gradient.fixed_rows_mut::<5>(BETA1).copy_from(&-at.actuators.tr_mul(error)); // (4.46)
    gradient
}

/// Right-hand sides at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// ψ2.
    pub model_acceleration: Vector6<f64>,
    /// dv̂/dt = ψ2 − α Δv (4.41, corrected).
    pub velocity: Vector6<f64>,
    /// Yᵀ Δv: dθ̂/dt = Γ Yᵀ Δv.
    pub gradient: Theta,
}

/// The laws at state `x` and instant `at`; α in 1/s.
#[must_use]
pub fn rates(x: &AidState, alpha: f64, at: &Instant) -> Rates {
    let psi2 = model_acceleration(&x.theta, at);
    let error = x.velocity - at.velocity;
    Rates { model_acceleration: psi2, velocity: psi2 - error * alpha, gradient: gradient(&psi2, &error, at) }
}

/// Heun's step of dt (s) to the measured instant `to`, given the rates at the instant before; `gains` is the diagonal
/// of Γ.
///
/// Euler's is ten times worse in pitch.
#[must_use]
pub fn heun(x: &AidState, first: &Rates, gains: &Theta, alpha: f64, to: &Instant, dt: f64) -> AidState {
    let by_gains = |gradient: &Theta, time: f64| gradient.component_mul(gains) * time;
    let predicted =
        AidState { velocity: x.velocity + first.velocity * dt, theta: x.theta + by_gains(&first.gradient, dt) };
    let second = rates(&predicted, alpha, to);
    AidState {
        velocity: x.velocity + (first.velocity + second.velocity) * (0.5 * dt),
        theta: x.theta + by_gains(&(first.gradient + second.gradient), 0.5 * dt),
    }
}
