//! Zero-order hold of the linearised process model: Φ, Q_d and the step of the state.
//!
//! At the state x_k the model is ẋ = f + F (x − x_k), which is (2.5) with its pseudo-input
//! corrected. Over a step h it gives
//!   Φ = e^{F h},  x_{k+1} = x_k + ∫ e^{F s} ds f,  Q_d = ∫ e^{F s} Q e^{F s}ᵀ ds.
//! The columns of e^{F s} that differ from the identity's are summed as one Taylor series, at the
//! end of the step and at three times inside it; the integral of Q_d is the five-point Lobatto rule
//! over these (degree 7; its error falls with the eighth power of the step). Both agree with
//! the matrix exponential of Van Loan to rounding at the filter's steps, at a tenth of its cost.
//! A step too long for the series is halved until it is not, and the halves are composed.

use crate::dynamics::Linearisation;
use crate::state::{P, PHI, PSI, THETA, U, VEHICLE_STATES, V, VehicleState, W, X, Y};

/// The states that drive others: e^{F s} has the identity's columns for position, and the
/// heading's differs only in two entries.
pub(super) const DRIVING: [usize; 8] = [PHI, THETA, U, V, W, P, P + 1, P + 2];
/// First velocity among [`DRIVING`]: where white acceleration enters.
const VELOCITIES: usize = 2;

/// Columns of the series: [`DRIVING`] and f.
const COLUMNS: usize = DRIVING.len() + 1;
type Column = [f64; VEHICLE_STATES];

/// Times of the Lobatto rule inside the step: (1 ∓ √(3/7))/2 and ½, as parts of it.
const NODES: [f64; 3] = [0.172_673_164_646_011_43, 0.5, 0.827_326_835_353_988_6];
/// Their weights.
const NODE_WEIGHTS: [f64; 3] = [49.0 / 180.0, 16.0 / 45.0, 49.0 / 180.0];
/// Weight of the two ends.
const END_WEIGHT: f64 = 1.0 / 20.0;

/// ‖F‖ h above which the step is halved.
const LONGEST: f64 = 1.5;
/// Most halvings: 2¹⁶ covers every finite model the parameters allow.
const MOST_HALVINGS: u32 = 16;
/// The series ends where the bound (‖F‖ h)^k / k! falls below this. The norm exceeds the spectral
/// radius about twofold, so the error left is some hundred times smaller.
const TERM_BOUND: f64 = 3.0e-8;
/// Highest order: 1.5¹⁴/14! is below `TERM_BOUND`.
const HIGHEST_ORDER: u32 = 14;
/// Rate by which angles are scaled in the norm, rad/s: that of a torpedo's roll, so that
/// the stiffness of roll and the rate of roll weigh alike.
const ANGLE_RATE: f64 = 5.0;

/// F by columns of its driving states, as the series uses it.
struct Jacobian {
    /// [`DRIVING`] columns.
    columns: [Column; DRIVING.len()],
    /// ∂(ẋ, ẏ)/∂ψ.
    heading: [f64; 2],
}

/// Φ, Q_d and the increment of one step; scratch of the filter.
pub(super) struct Discretisation {
    /// [`DRIVING`] columns of Φ.
    pub(super) phi: [Column; DRIVING.len()],
    /// Φ_xψ and Φ_yψ.
    pub(super) phi_heading: [f64; 2],
    /// Q_d; entries (i, j), i ≥ j, as `q[j][i]`.
    pub(super) q: [Column; VEHICLE_STATES],
    /// x_{k+1} − x_k.
    pub(super) increment: Column,
    nodes: [[Column; DRIVING.len() - VELOCITIES]; NODES.len()],
}

impl Discretisation {
    pub(super) const fn new() -> Self {
        Self {
            phi: [[0.0; VEHICLE_STATES]; DRIVING.len()],
            phi_heading: [0.0; 2],
            q: [[0.0; VEHICLE_STATES]; VEHICLE_STATES],
            increment: [0.0; VEHICLE_STATES],
            nodes: [[[0.0; VEHICLE_STATES]; DRIVING.len() - VELOCITIES]; NODES.len()],
        }
    }

    /// One step of `step_s` seconds; `psd` are the acceleration power spectral densities of
    /// u, v, w, p, q, r.
    pub(super) fn compute(&mut self, model: &Linearisation, psd: &[f64; 6], step_s: f64) {
        let jacobian = Jacobian::new(model);
        let norm = jacobian.scaled_norm();
        let mut h = step_s;
        let mut halvings = 0;
        while norm * h > LONGEST && halvings < MOST_HALVINGS {
            h *= 0.5;
            halvings += 1;
        }
        self.series(&jacobian, &model.f, h, order(norm * h));
        self.quadrature(psd, h);
        self.phi_heading = jacobian.heading.map(|a| a * h);
        for _ in 0..halvings {
            self.double();
        }
    }

    /// Sums the Taylor series of Φ(h), of Φ at the inner nodes, and of the increment.
    fn series(&mut self, jacobian: &Jacobian, f: &VehicleState, h: f64, order: u32) {
        let mut terms = [[0.0; VEHICLE_STATES]; COLUMNS];
        for (k, &state) in DRIVING.iter().enumerate() {
            terms[k][state] = 1.0;
        }
        terms[COLUMNS - 1] = [f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8], f[9], f[10], f[11]];
        self.phi.copy_from_slice(&terms[..DRIVING.len()]);
        for node in &mut self.nodes {
            node.copy_from_slice(&terms[VELOCITIES..DRIVING.len()]);
        }
        self.increment = terms[COLUMNS - 1].map(|f| f * h);

        let mut powers = NODES;
        for k in 1..=order {
            let scale = h / f64::from(k);
            for term in &mut terms {
                *term = jacobian.times(term, scale);
            }
            for (sum, term) in self.phi.iter_mut().zip(&terms) {
                add(sum, 1.0, term);
            }
            for (node, power) in self.nodes.iter_mut().zip(&mut powers) {
                for (sum, term) in node.iter_mut().zip(&terms[VELOCITIES..]) {
                    add(sum, *power, term);
                }
            }
            for (power, node) in powers.iter_mut().zip(&NODES) {
                *power *= node;
            }
            add(&mut self.increment, h / f64::from(k + 1), &terms[COLUMNS - 1]);
        }
    }

    /// Q_d by the Lobatto rule.
    fn quadrature(&mut self, psd: &[f64; 6], h: f64) {
        self.q = [[0.0; VEHICLE_STATES]; VEHICLE_STATES];
        for (k, psd) in psd.iter().enumerate() {
            self.q[U + k][U + k] = END_WEIGHT * h * psd;
        }
        let (velocities, q) = (&self.phi[VELOCITIES..], &mut self.q);
        add_outer(q, velocities, psd, END_WEIGHT * h);
        for (node, weight) in self.nodes.iter().zip(&NODE_WEIGHTS) {
            add_outer(q, node, psd, weight * h);
        }
    }

    /// Φ(2h) = Φ², Q(2h) = Q + Φ Q Φᵀ, increment(2h) = increment + Φ increment.
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
        self.phi = self.phi.map(|column| self.times(&column));
        self.phi_heading = self.phi_heading.map(|a| 2.0 * a);
    }

    /// Φ a.
    pub(super) fn times(&self, a: &Column) -> Column {
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
        Self { columns, heading: [model.position_by_attitude[(0, 2)], model.position_by_attitude[(1, 2)]] }
    }

    /// scale F a.
    fn times(&self, a: &Column, scale: f64) -> Column {
        let mut out = [0.0; VEHICLE_STATES];
        out[X] = scale * a[PSI] * self.heading[0];
        out[Y] = scale * a[PSI] * self.heading[1];
        for (k, (column, &state)) in self.columns.iter().zip(&DRIVING).enumerate() {
            let factor = scale * a[state];
            // Structural zeros: body velocity does not turn Euler angles, rates do not move the position.
            if !(2..5).contains(&k) {
                add_part::<PHI, U>(&mut out, factor, column);
            }
            if k < 5 {
                add_part::<X, PHI>(&mut out, factor, column);
            }
            add_part::<U, VEHICLE_STATES>(&mut out, factor, column);
        }
        out
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

/// Order of the series at which its bound is reached.
fn order(x: f64) -> u32 {
    let mut k = 2;
    let mut term = 0.5 * x * x;
    while term > TERM_BOUND && k < HIGHEST_ORDER {
        k += 1;
        term *= x / f64::from(k);
    }
    k
}

/// sum += a b.
fn add(sum: &mut Column, a: f64, b: &Column) {
    for (sum, b) in sum.iter_mut().zip(b) {
        *sum += a * b;
    }
}

/// Rows `FROM..TO` of sum += a b.
fn add_part<const FROM: usize, const TO: usize>(sum: &mut Column, a: f64, b: &Column) {
    for (sum, b) in sum[FROM..TO].iter_mut().zip(&b[FROM..TO]) {
        *sum += a * b;
    }
}

/// Lower triangle of q += weight Σ psd_k column_k column_kᵀ.
fn add_outer(q: &mut [Column; VEHICLE_STATES], columns: &[Column], psd: &[f64; 6], weight: f64) {
    for (column, psd) in columns.iter().zip(psd) {
        let factor = weight * psd;
        for j in 0..VEHICLE_STATES {
            let a = factor * column[j];
            for (q, b) in q[j][j..].iter_mut().zip(&column[j..]) {
                *q += a * b;
            }
        }
    }
}
