//! The classical fourth-order Runge-Kutta step.

use super::State;

fn moved(state: &State, slope: &State, by: f64) -> State {
    State(core::array::from_fn(|i| state.0[i] + by * slope.0[i]))
}

/// One step of ẋ = f(x); the attitude quaternion is brought back to unit length.
#[inline]
pub fn runge_kutta_4(state: &State, step_s: f64, f: impl Fn(&State) -> State) -> State {
    let k1 = f(state);
    let k2 = f(&moved(state, &k1, 0.5 * step_s));
    let k3 = f(&moved(state, &k2, 0.5 * step_s));
    let k4 = f(&moved(state, &k3, step_s));
    let sixth = step_s / 6.0;
    let mut next =
        State(core::array::from_fn(|i| state.0[i] + sixth * (k1.0[i] + 2.0 * (k2.0[i] + k3.0[i]) + k4.0[i])));
    let [a, b, c, d] = [next.0[3], next.0[4], next.0[5], next.0[6]];
    let norm = (a * a + b * b + c * c + d * d).sqrt();
    for component in &mut next.0[3..7] {
        *component /= norm;
    }
    next
}
