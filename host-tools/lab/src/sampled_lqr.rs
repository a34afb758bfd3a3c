//! The regulator of section 5.2 as a sampled one: the cost of continuous time, a control that is held between steps.
//!
//! Minimises ∫ (xᵀQx + uᵀRu) dt of ẋ = Ax + Bu with u constant over each step of h. Over a step that is a discrete
//! problem with a cross term, xᵀQ_d x + uᵀR_d u + 2xᵀN_d u, whose matrices are integrals of the motion within the step
//! (as in K. J. Åström, B. Wittenmark, *Computer-Controlled Systems*, on sampling the loss function). The discrete Riccati
//! equation is solved by structure-preserving doubling (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang,
//! Int. J. Control 77, 2004), as the continuous one on the board.

use backseat_core::control::lqr::{LQR_INPUTS, LqrGain, LqrWeights, lqr_input_matrix};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::state::VehicleState;
use nalgebra::{SMatrix, SVector};

/// States.
const N: usize = 12;
/// Inputs.
const M: usize = LQR_INPUTS;
/// States and inputs.
const BOTH: usize = N + M;
/// Doublings after which a system is taken as not stabilisable: a horizon of 2⁴⁰ steps.
const MAX_DOUBLINGS: usize = 40;

/// Vehicle and weights of a regulator.
pub struct SampledLqr<'a> {
    pub model: &'a VehicleModel,
    pub weights: LqrWeights,
    /// Time for which a control is held, s.
    pub period_s: f64,
}

impl SampledLqr<'_> {
    /// The gain for the vehicle linearised at a state and an input; `None` where no gain stabilises it. Its axes are
    /// those in which the state's heading is measured.
    pub fn gain_at(&self, x: &VehicleState, input: &ActuatorInput) -> Option<LqrGain> {
        let inverse_square = |d: f64| 1.0 / (d * d);
        let mut rates = SMatrix::<f64, BOTH, BOTH>::zeros();
        rates.fixed_view_mut::<N, N>(0, 0).copy_from(&self.model.linearise(x, input).F());
        rates.fixed_view_mut::<N, M>(0, N).copy_from(&lqr_input_matrix(self.model));
        let mut cost = SVector::<f64, BOTH>::zeros();
        cost.fixed_rows_mut::<N>(0).copy_from(&SVector::from(self.weights.state_deviation.map(inverse_square)));
        cost.fixed_rows_mut::<M>(N).copy_from(&SVector::from(self.weights.input_deviation.map(inverse_square)));
        gain(&rates, &SMatrix::from_diagonal(&cost), self.period_s)
    }
}

/// K of [A B; 0 0] and of the weights of states and inputs.
fn gain(rates: &SMatrix<f64, BOTH, BOTH>, cost: &SMatrix<f64, BOTH, BOTH>, h: f64) -> Option<LqrGain> {
    // Simpson's rule over the step: the fastest motion, 5 rad/s, leaves 4e-4 of the cost in 0.1 s.
    let half = exponential(&(rates * (0.5 * h)));
    let motion = half * half;
    let at = |motion: &SMatrix<f64, BOTH, BOTH>| motion.tr_mul(&(cost * motion));
    let over_step = (cost + at(&half) * 4.0 + at(&motion)) * (h / 6.0);
    let a = motion.fixed_view::<N, N>(0, 0).into_owned();
    let b = motion.fixed_view::<N, M>(0, N).into_owned();
    let q = over_step.fixed_view::<N, N>(0, 0).into_owned();
    let cross = over_step.fixed_view::<N, M>(0, N).into_owned();
    let r = over_step.fixed_view::<M, M>(N, N).into_owned();

    // Without the cross term: u = v − R⁻¹ Nᵀ x.
    let weight = r.cholesky()?;
    let shift = weight.solve(&cross.transpose());
    let mut e = a - b * shift;
    let mut h_sum = symmetric(q - cross * shift);
    let mut g = symmetric(b * weight.solve(&b.transpose()));
    for _ in 0..MAX_DOUBLINGS {
        let lu = (SMatrix::<f64, N, N>::identity() + g * h_sum).lu();
        let (we, wg) = (lu.solve(&e)?, lu.solve(&(g * e.transpose()))?);
        let added = symmetric(e.tr_mul(&(h_sum * we)));
        g = symmetric(g + e * wg);
        h_sum += added;
        e *= we;
        if !h_sum.iter().chain(e.iter()).all(|value| value.is_finite()) {
            return None;
        }
        // E vanishes only if the closed loop is stable.
        if added.amax() <= 1e-13 * h_sum.amax() && e.amax() <= 1e-6 {
            return Some((r + b.tr_mul(&(h_sum * b))).cholesky()?.solve(&(b.tr_mul(&(h_sum * a)) + cross.transpose())));
        }
    }
    None
}

/// exp(A) of a short step by its Taylor series: at a norm of 1 the first term left out is 1/11! = 3e-8.
fn exponential<const D: usize>(a: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let (mut sum, mut term) = (SMatrix::<f64, D, D>::identity(), SMatrix::<f64, D, D>::identity());
    for k in 1..11 {
        term = term * a / f64::from(k);
        sum += term;
    }
    sum
}

fn symmetric(a: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (a + a.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::control::lqr::Lqr;
    use backseat_core::dynamics::VehicleParameters;
    use backseat_core::state::{PSI, R};

    fn straight(model: &VehicleModel) -> (Lqr, VehicleState, ActuatorInput) {
        let mut lqr = Lqr::new();
        lqr.configure(model, 1.0).unwrap();
        let trim = *lqr.trim();
        let input = ActuatorInput { propeller_radps: 100.0, fins_rad: trim.fins_rad };
        (lqr, trim.state(), input)
    }

    /// The shorter the step, the closer to the board's continuous solution, in proportion.
    #[test]
    fn val_a_short_step_is_the_continuous_regulator() {
        let model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
        let (lqr, x, input) = straight(&model);
        let apart = |period_s: f64| {
            let sampled = SampledLqr { model: &model, weights: LqrWeights::DEFAULT, period_s };
            // The propeller's speed does not matter for a thrust that does not fall with the advance.
            (sampled.gain_at(&x, &input).unwrap() - lqr.gain()).amax() / lqr.gain().amax()
        };
        let [tenth, hundredth] = [apart(0.1), apart(0.01)];
        assert!(hundredth < 0.02 && (5.0..20.0).contains(&(tenth / hundredth)), "{tenth} {hundredth}");
    }

    /// A turn that slips: other gains than straight ahead, and a vehicle on its back end has one too.
    #[test]
    fn the_gain_follows_the_state() {
        let model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
        let (_, mut x, input) = straight(&model);
        let sampled = SampledLqr { model: &model, weights: LqrWeights::DEFAULT, period_s: 0.1 };
        let ahead = sampled.gain_at(&x, &input).unwrap();
        (x[R], x[PSI]) = (0.2, 0.3);
        let turning = sampled.gain_at(&x, &input).unwrap();
        assert!((turning - ahead).amax() > 0.05 * ahead.amax());
    }
}
