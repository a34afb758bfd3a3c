//! Zero-order hold of the linearised process model: Φ, Q_d and the step of the state.
//!
//! At the state x_k the model is ẋ = f + F (x − x_k), which is (2.5) with its pseudo-input
//! corrected. Over a step h it gives
//!   Φ = e^{F h},  x_{k+1} = x_k + ∫ e^{F s} ds f,  Q_d = ∫ e^{F s} Q e^{F s}ᵀ ds.
//! The columns of e^{F s} that differ from the identity's are summed as one Taylor series, at the
//! end of the step and at two times inside it; the integral of Q_d is the four-point Lobatto rule
//! over these (degree 5; its error falls with the sixth power of the step). At 0.1 s and 1 m/s Φ and x agree with
//! Van Loan's matrix exponential to 1e-6 and Q_d to 1e-5, far closer than holding F over the step (2e-5 in x) or
//! knowing Q, at a tenth of its cost. A step too long for the series is halved until it is not, and the halves are
//! composed.

use super::layout::PLANT_STATES;
use crate::dynamics::Linearisation;
use crate::state::{P, PHI, PSI, THETA, U, V, VEHICLE_STATES, VehicleState, W, X, Y};
use nalgebra::{ArrayStorage, Matrix3, Vector6};

/// The states that drive others: e^{F s} has the identity's columns for position, and the
/// heading's differs only in two entries.
pub(crate) const DRIVING: [usize; 8] = [PHI, THETA, U, V, W, P, P + 1, P + 2];
/// First velocity among [`DRIVING`]: where white acceleration enters.
const VELOCITIES: usize = 2;

type Column = [f64; VEHICLE_STATES];
/// Columns of e^{F s} driven by white acceleration.
type Driven = [Column; DRIVING.len() - VELOCITIES];

/// Times of the Lobatto rule inside the step: (1 ∓ √(1/5))/2, as parts of it.
const NODES: [f64; 2] = [0.276_393_202_250_021, 0.723_606_797_749_979];
/// Their weight.
const NODE_WEIGHT: f64 = 5.0 / 12.0;
/// Weight of the two ends.
const END_WEIGHT: f64 = 1.0 / 12.0;

/// ‖F‖ h above which the step is halved.
const LONGEST: f64 = 1.5;
/// Most halvings: 2¹⁶ covers every finite model the parameters allow.
const MOST_HALVINGS: u32 = 16;
/// The series ends where the bound (‖F‖ h)^k / k! falls below this. The norm exceeds the spectral
/// radius about twofold, so the error left is some hundred times smaller.
const TERM_BOUND: f64 = 1.0e-4;
/// Highest order: 1.5¹¹/11! is below `TERM_BOUND`.
const HIGHEST_ORDER: usize = 11;
/// Rate by which angles are scaled in the norm, rad/s: that of a torpedo's roll, so that
/// the stiffness of roll and the rate of roll weigh alike.
const ANGLE_RATE: f64 = 4.0;

/// F by columns of its driving states, as the series uses it.
struct Jacobian {
    /// [`DRIVING`] columns.
    columns: [Column; DRIVING.len()],
    /// ∂(ẋ, ẏ)/∂ψ.
    heading: [f64; 2],
    /// Whether anything changes the velocities: not so in the kinematic model.
    accelerates: bool,
}

/// An effect state on which the acceleration depends.
#[derive(Clone, Copy)]
pub(crate) struct AcceleratingEffect {
    /// Which of the effect states.
    pub(crate) slot: usize,
    /// ∂v̇/∂state.
    pub(crate) acceleration: Vector6<f64>,
    /// ∂x_{k+1}/∂state.
    pub(crate) gamma: Column,
}

impl AcceleratingEffect {
    const NONE: Self = Self {
        slot: 0,
        acceleration: Vector6::from_array_storage(ArrayStorage([[0.0; 6]; 1])),
        gamma: [0.0; VEHICLE_STATES],
    };
}

/// Φ, Q_d and the increment of one step; scratch of the filter.
#[derive(Clone)]
pub(crate) struct Discretisation {
    /// [`DRIVING`] columns of Φ.
    pub(crate) phi: [Column; DRIVING.len()],
    /// Φ_xψ and Φ_yψ.
    pub(crate) phi_heading: [f64; 2],
    /// Q_d; entries (i, j), i ≥ j, as `q[j][i]`.
    pub(crate) q: [Column; VEHICLE_STATES],
    /// x_{k+1} − x_k.
    pub(crate) increment: Column,
    /// Effect states that accelerate: slot, ∂v̇/∂state, and from the next [`Self::compute`] on
    /// Γ = ∫ e^{F s} ds ∂v̇/∂state.
    pub(crate) effects: [AcceleratingEffect; PLANT_STATES],
    /// How many of them there are.
    pub(crate) effect_count: usize,
    /// e^{F s} at the inner nodes.
    nodes: [Driven; NODES.len()],
    /// Terms of the series: (F h)^k / k! times a column of the identity, or f; one column after the other.
    terms: [Column; HIGHEST_ORDER + 1],
}

impl Discretisation {
    pub(crate) const fn new() -> Self {
        Self {
            phi: [[0.0; VEHICLE_STATES]; DRIVING.len()],
            phi_heading: [0.0; 2],
            q: [[0.0; VEHICLE_STATES]; VEHICLE_STATES],
            increment: [0.0; VEHICLE_STATES],
            effects: [AcceleratingEffect::NONE; PLANT_STATES],
            effect_count: 0,
            nodes: [[[0.0; VEHICLE_STATES]; DRIVING.len() - VELOCITIES]; NODES.len()],
            terms: [[0.0; VEHICLE_STATES]; HIGHEST_ORDER + 1],
        }
    }

    /// One step of `step_s` seconds (not inlined: the board's compiler then keeps its registers); `psd` are the
    /// acceleration power spectral densities of u, v, w, p, q, r.
    #[inline(never)]
    pub(crate) fn compute(&mut self, model: &Linearisation, psd: &[f64; 6], step_s: f64) {
        let jacobian = Jacobian::new(model);
        let norm = jacobian.scaled_norm();
        let mut h = step_s;
        let mut halvings = 0;
        while norm * h > LONGEST && halvings < MOST_HALVINGS {
            h *= 0.5;
            halvings += 1;
        }
        self.series(&jacobian, &model.f, h, norm * h);
        self.quadrature(psd, h);
        self.phi_heading = jacobian.heading.map(|a| a * h);
        if self.effect_count > 0 {
            self.integrate_effects(h);
        }
        for _ in 0..halvings {
            self.double();
        }
    }

    /// Sums the Taylor series of Φ(h), of Φ at the inner nodes, and of the increment; `x` is ‖F‖ h.
    fn series(&mut self, jacobian: &Jacobian, f: &VehicleState, h: f64, x: f64) {
        let (mut bound, mut order) = (x, 1);
        while bound >= TERM_BOUND && order < HIGHEST_ORDER {
            order += 1;
            bound *= x / order as f64;
        }
        let terms = self.terms.get_mut(..=order).unwrap_or_default();
        let (plain, driven) = self.phi.split_at_mut(VELOCITIES);
        let [early, late] = &mut self.nodes;
        let mut driven = driven.iter_mut().zip(early).zip(late);
        for (k, (&state, column)) in DRIVING.iter().zip(&jacobian.columns).enumerate() {
            begin_series(terms, state, column, h);
            jacobian.continue_series(terms, h);
            if let Some(column) = plain.get_mut(k) {
                sum(terms, &ONES, column);
            } else if let Some(((end, early), late)) = driven.next() {
                sum_at_nodes(terms, end, early, late);
            }
        }
        if let [first, second, ..] = &mut *terms {
            for (term, f) in first.iter_mut().zip(f.as_slice()) {
                *term = h * f;
            }
            jacobian.times(first, h, second);
        }
        jacobian.continue_series(terms, h);
        sum(terms, &INTEGRAL, &mut self.increment);
    }

    /// Q_d by the Lobatto rule: Σ weight psd_k column_k column_kᵀ at its times.
    fn quadrature(&mut self, psd: &[f64; 6], h: f64) {
        self.q = [[0.0; VEHICLE_STATES]; VEHICLE_STATES];
        let inner = psd.map(|psd| NODE_WEIGHT * h * psd);
        let end = psd.map(|psd| END_WEIGHT * h * psd);
        for (k, end) in end.iter().enumerate() {
            self.q[U + k][U + k] = *end;
        }
        let [early, late] = &self.nodes;
        let (_, driven) = self.phi.split_at(VELOCITIES);
        let sets = [(&early[..], &inner), (&late[..], &inner), (driven, &end)];
        // Lower triangle by blocks of four.
        add_outer::<0, 1>(&mut self.q, &sets);
        add_outer::<4, 1>(&mut self.q, &sets);
        add_outer::<8, 2>(&mut self.q, &sets);
    }

    /// Γ = ∫ e^{F s} ds ∂v̇/∂state, the integral by the same rule as Q_d and once for all states.
    #[inline(never)]
    fn integrate_effects(&mut self, h: f64) {
        let [early, late] = &self.nodes;
        let (_, end) = self.phi.split_at(VELOCITIES);
        let mut integral: Driven = [[0.0; VEHICLE_STATES]; DRIVING.len() - VELOCITIES];
        for (k, (((column, early), late), end)) in integral.iter_mut().zip(early).zip(late).zip(end).enumerate() {
            if let Some(own) = column.get_mut(U + k) {
                *own = END_WEIGHT * h;
            }
            add(column, NODE_WEIGHT * h, early);
            add(column, NODE_WEIGHT * h, late);
            add(column, END_WEIGHT * h, end);
        }
        for effect in self.effects.iter_mut().take(self.effect_count) {
            effect.gamma = [0.0; VEHICLE_STATES];
            for (a, column) in effect.acceleration.iter().zip(&integral).filter(|(a, _)| **a != 0.0) {
                add(&mut effect.gamma, *a, column);
            }
        }
    }

    /// Φ(2h) = Φ², Q(2h) = Q + Φ Q Φᵀ, increment(2h) = increment + Φ increment.
    #[cold]
    #[inline(never)]
    fn double(&mut self) {
        for j in 0..VEHICLE_STATES {
            for i in 0..j {
                self.q[j][i] = self.q[i][j];
            }
        }
        let mut half = self.q;
        for column in &mut half {
            *column = self.times(column);
        }
        for j in 0..VEHICLE_STATES {
            let row = core::array::from_fn(|i| half[i][j]);
            let turned = self.times(&row);
            add(&mut self.q[j], 1.0, &turned);
        }
        let moved = self.times(&self.increment);
        add(&mut self.increment, 1.0, &moved);
        for k in 0..self.effect_count.min(PLANT_STATES) {
            let moved = self.times(&self.effects[k].gamma);
            add(&mut self.effects[k].gamma, 1.0, &moved);
        }
        self.phi = self.phi.map(|column| self.times(&column));
        self.phi_heading = self.phi_heading.map(|a| 2.0 * a);
    }

    /// Φ of no step at all.
    pub(crate) fn set_identity(&mut self) {
        for (column, state) in self.phi.iter_mut().zip(DRIVING) {
            *column = [0.0; VEHICLE_STATES];
            column[state] = 1.0;
        }
        self.phi_heading = [0.0; 2];
        self.q = [[0.0; VEHICLE_STATES]; VEHICLE_STATES];
        self.increment = [0.0; VEHICLE_STATES];
        self.effect_count = 0;
    }

    /// x → A x of the attitude after the step, A e₃ = e₃: the rows of Φ and Γ, and Q_d.
    #[inline(never)]
    pub(crate) fn turn_attitude(&mut self, by: &Matrix3<f64>) {
        let turn = |column: &mut Column| {
            let old = [column[PHI], column[THETA], column[PSI]];
            for i in 0..3 {
                column[PHI + i] = (0..3).map(|j| by[(i, j)] * old[j]).sum();
            }
        };
        self.phi.iter_mut().for_each(turn);
        self.effects.iter_mut().take(self.effect_count).for_each(|effect| turn(&mut effect.gamma));
        for j in 0..VEHICLE_STATES {
            for i in 0..j {
                self.q[j][i] = self.q[i][j];
            }
        }
        self.q.iter_mut().for_each(turn);
        for i in 0..VEHICLE_STATES {
            let old = [self.q[PHI][i], self.q[THETA][i], self.q[PSI][i]];
            for j in 0..3 {
                self.q[PHI + j][i] = (0..3).map(|k| by[(j, k)] * old[k]).sum();
            }
        }
    }

    /// Φ a. Not inlined: the halvings are rare, and copies of it would be 10 kB of code.
    #[inline(never)]
    pub(crate) fn times(&self, a: &Column) -> Column {
        let mut out = [0.0; VEHICLE_STATES];
        out[..PHI].copy_from_slice(&a[..PHI]);
        out[PSI] = a[PSI];
        out[X] += self.phi_heading[0] * a[PSI];
        out[Y] += self.phi_heading[1] * a[PSI];
        for (column, &state) in self.phi.iter().zip(&DRIVING) {
            add(&mut out, a[state], column);
        }
        out
    }
}

impl Jacobian {
    fn new(model: &Linearisation) -> Self {
        let mut columns = [[0.0; VEHICLE_STATES]; DRIVING.len()];
        for (k, column) in columns.iter_mut().enumerate() {
            for i in 0..3 {
                match k {
                    0..VELOCITIES => {
                        column[X + i] = model.position_by_attitude[(i, k)];
                        column[PHI + i] = model.euler_by_roll_pitch[(i, k)];
                    }
                    2..5 => column[X + i] = model.position_by_velocity[(i, k - 2)],
                    _ => column[PHI + i] = model.euler_by_rates[(i, k - 5)],
                }
            }
            for i in 0..6 {
                column[U + i] = if k < VELOCITIES {
                    model.acceleration_by_roll_pitch[(i, k)]
                } else {
                    model.acceleration_by_velocity[(i, k - VELOCITIES)]
                };
            }
        }
        Self {
            accelerates: columns.iter().any(|column| column[U..].iter().any(|a| *a != 0.0)),
            columns,
            heading: [model.position_by_attitude[(0, 2)], model.position_by_attitude[(1, 2)]],
        }
    }

    /// The terms of a series from the second on: each is F h / k times the one before it.
    fn continue_series(&self, terms: &mut [Column], h: f64) {
        for k in 2..terms.len() {
            if let [.., last, next] = terms.get_mut(..=k).unwrap_or_default() {
                self.times(last, h / k as f64, next);
            }
        }
    }

    /// out = scale F a. Not inlined: nine copies would be 20 kB of code.
    #[inline(never)]
    fn times(&self, a: &Column, scale: f64, out: &mut Column) {
        let factors = DRIVING.map(|state| scale * a[state]);
        let heading = scale * a[PSI];
        let mut position = [heading * self.heading[0], heading * self.heading[1], 0.0];
        // Structural zeros: body velocity does not turn Euler angles, rates do not move the position.
        for k in 0..5 {
            for i in 0..3 {
                position[i] += factors[k] * self.columns[k][X + i];
            }
        }
        out[..PHI].copy_from_slice(&position);
        let mut euler = [0.0; 3];
        for k in [0, 1, 5, 6, 7] {
            for i in 0..3 {
                euler[i] += factors[k] * self.columns[k][PHI + i];
            }
        }
        out[PHI..U].copy_from_slice(&euler);
        let mut velocity = [0.0; 6];
        if self.accelerates {
            for k in 0..DRIVING.len() {
                for i in 0..6 {
                    velocity[i] += factors[k] * self.columns[k][U + i];
                }
            }
        }
        out[U..].copy_from_slice(&velocity);
    }

    /// Largest column sum of |D F D⁻¹| without the position rows, 1/s.
    fn scaled_norm(&self) -> f64 {
        let mut norm: f64 = 0.0;
        for (k, column) in self.columns.iter().enumerate() {
            let angles: f64 = column[PHI..U].iter().map(|a| a.abs()).sum();
            let velocities: f64 = column[U..].iter().map(|a| a.abs()).sum();
            let sum = ANGLE_RATE * angles + velocities;
            norm = norm.max(if k < VELOCITIES { sum / ANGLE_RATE } else { sum });
        }
        norm
    }
}

const ONES: [f64; HIGHEST_ORDER + 1] = [1.0; HIGHEST_ORDER + 1];
/// 1 / (k + 1): the integral of the k-th term.
const INTEGRAL: [f64; HIGHEST_ORDER + 1] = {
    let mut parts = [1.0; HIGHEST_ORDER + 1];
    let mut k = 0;
    while k <= HIGHEST_ORDER {
        parts[k] = 1.0 / (k + 1) as f64;
        k += 1;
    }
    parts
};

/// Rows summed at a time: what three sums keep in the registers of either machine.
const ROWS: usize = 4;

// Terms are reached from a register of their own in what follows, and not inlined: they lie too far inside the scratch
// for the board's loads, which would take an addition each.

/// The first two terms: a column of the identity, and h F times it.
#[inline(never)]
fn begin_series(terms: &mut [Column], state: usize, column: &Column, h: f64) {
    if let [first, second, ..] = terms {
        *first = [0.0; VEHICLE_STATES];
        if let Some(term) = first.get_mut(state) {
            *term = 1.0;
        }
        *second = column.map(|a| h * a);
    }
}

/// Σ weight_k term_k, small terms first.
#[inline(never)]
fn sum(terms: &[Column], weights: &[f64; HIGHEST_ORDER + 1], out: &mut Column) {
    let mut terms = terms.iter().zip(weights).rev();
    let Some((last, weight)) = terms.next() else { return };
    let mut sum = last.map(|term| weight * term);
    for (term, weight) in terms {
        add(&mut sum, *weight, term);
    }
    *out = sum;
}

/// One column at the end of the step and, by Horner's rule, at the two nodes inside it.
#[inline(never)]
fn sum_at_nodes(terms: &[Column], end: &mut Column, early: &mut Column, late: &mut Column) {
    let outputs = end.as_chunks_mut::<ROWS>().0.iter_mut();
    let outputs = outputs.zip(early.as_chunks_mut::<ROWS>().0).zip(late.as_chunks_mut::<ROWS>().0);
    let Some((last, terms)) = terms.split_last() else { return };
    for (((end, early), late), (part, last)) in outputs.zip(last.as_chunks::<ROWS>().0.iter().enumerate()) {
        let mut sums = [*last; 3];
        for term in terms.iter().rev() {
            let Some(term) = term.as_chunks::<ROWS>().0.get(part) else { break };
            for i in 0..ROWS {
                sums[0][i] += term[i];
                sums[1][i] = term[i] + NODES[0] * sums[1][i];
                sums[2][i] = term[i] + NODES[1] * sums[2][i];
            }
        }
        [*end, *early, *late] = sums;
    }
}

/// Columns `FROM..FROM + 4` of q += Σ weight column columnᵀ, rows from `FROM` on, as many columns at once as there are
/// registers for. Not inlined: a known number of columns would be unrolled beyond the registers.
#[inline(never)]
fn add_outer<const FROM: usize, const AT_ONCE: usize>(
    q: &mut [Column; VEHICLE_STATES],
    sets: &[(&[Column], &[f64; 6]); 3],
) {
    for j in (FROM..FROM + 4).step_by(AT_ONCE) {
        let mut sums: [Column; AT_ONCE] = core::array::from_fn(|lane| q[j + lane]);
        for (columns, weights) in sets {
            for (column, weight) in columns.iter().zip(*weights) {
                let factors: [f64; AT_ONCE] = core::array::from_fn(|lane| weight * column[j + lane]);
                for i in FROM..VEHICLE_STATES {
                    for (sum, factor) in sums.iter_mut().zip(factors) {
                        sum[i] += factor * column[i];
                    }
                }
            }
        }
        q[j..j + AT_ONCE].copy_from_slice(&sums);
    }
}

/// sum += a b.
#[inline(always)]
pub(super) fn add(sum: &mut Column, a: f64, b: &Column) {
    for i in 0..VEHICLE_STATES {
        sum[i] += a * b[i];
    }
}
