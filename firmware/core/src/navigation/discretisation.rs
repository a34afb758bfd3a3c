//! Zero-order hold of the linearised process model: Φ, Q_d and the step of the state.
//!
//! At the state x_k the model is ẋ = f + F (x − x_k), which is (2.5) with its pseudo-input
//! corrected. Over a step h it gives
//!   Φ = e^{F h},  x_{k+1} = x_k + ∫ e^{F s} ds f,  Q_d = ∫ e^{F s} Q e^{F s}ᵀ ds.
//! The columns of e^{F s} that differ from the identity's are summed as one Taylor series, at the
//! end of the step and at two times inside it; the integral of Q_d is the four-point Lobatto rule
//! over these (degree 5; its error falls with the sixth power of the step). At 0.1 s and 1 m/s Φ and x agree with
//! Van Loan's matrix exponential to 1e-7 and Q_d to 1e-5, far closer than F and Q are known, at a tenth of its cost.
//! A step too long for the series is halved until it is not, and the halves are composed.

use crate::dynamics::Linearisation;
use crate::state::{P, PHI, PSI, THETA, U, V, VEHICLE_STATES, VehicleState, W, X, Y};

/// The states that drive others: e^{F s} has the identity's columns for position, and the
/// heading's differs only in two entries.
pub(super) const DRIVING: [usize; 8] = [PHI, THETA, U, V, W, P, P + 1, P + 2];
/// First velocity among [`DRIVING`]: where white acceleration enters.
const VELOCITIES: usize = 2;

/// Columns of the series: [`DRIVING`] and f.
const COLUMNS: usize = DRIVING.len() + 1;
type Column = [f64; VEHICLE_STATES];

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
/// radius about twofold, so the error left is some thousand times smaller.
const TERM_BOUND: f64 = 1.0e-4;
/// Highest order: 1.5¹¹/11! is below `TERM_BOUND`.
const HIGHEST_ORDER: u32 = 11;
/// Rate by which angles are scaled in the norm, rad/s: that of a torpedo's roll, so that
/// the stiffness of roll and the rate of roll weigh alike.
const ANGLE_RATE: f64 = 5.0;

/// F by columns of its driving states, as the series uses it.
struct Jacobian {
    /// [`DRIVING`] columns.
    columns: [Column; DRIVING.len()],
    /// ∂(ẋ, ẏ)/∂ψ.
    heading: [f64; 2],
    /// Whether anything changes the velocities: not so in the kinematic model.
    accelerates: bool,
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
        self.series(&jacobian, &model.f, h, norm * h);
        self.quadrature(psd, h);
        self.phi_heading = jacobian.heading.map(|a| a * h);
        for _ in 0..halvings {
            self.double();
        }
    }

    /// Sums the Taylor series of Φ(h), of Φ at the inner nodes, and of the increment; `x` is ‖F‖ h.
    fn series(&mut self, jacobian: &Jacobian, f: &VehicleState, h: f64, x: f64) {
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

        let (mut bound, mut powers) = (1.0, [1.0; NODES.len()]);
        for k in 1..=HIGHEST_ORDER {
            let order = f64::from(k);
            bound *= x / order;
            let scale = h / order;
            for term in &mut terms {
                jacobian.advance(term, scale);
            }
            for (power, part) in powers.iter_mut().zip(&NODES) {
                *power *= part;
            }
            let [early, late] = &mut self.nodes;
            for (sum, term) in self.phi[..VELOCITIES].iter_mut().zip(&terms) {
                add(sum, 1.0, term);
            }
            let sums = self.phi[VELOCITIES..].iter_mut().zip(early).zip(late);
            for (((sum, early), late), term) in sums.zip(&terms[VELOCITIES..]) {
                for i in 0..VEHICLE_STATES {
                    sum[i] += term[i];
                    early[i] += powers[0] * term[i];
                    late[i] += powers[1] * term[i];
                }
            }
            add(&mut self.increment, h / (order + 1.0), &terms[COLUMNS - 1]);
            if bound < TERM_BOUND {
                break;
            }
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
        for node in &self.nodes {
            add_outer(q, node, psd, NODE_WEIGHT * h);
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
        Self {
            accelerates: columns.iter().any(|column| column[U..].iter().any(|a| *a != 0.0)),
            columns,
            heading: [model.position_by_attitude[(0, 2)], model.position_by_attitude[(1, 2)]],
        }
    }

    /// a ← scale F a. Not inlined: unrolled nine times it would be 50 kB of code.
    #[inline(never)]
    fn advance(&self, a: &mut Column, scale: f64) {
        let factors = DRIVING.map(|state| scale * a[state]);
        let heading = scale * a[PSI];
        let mut position = [heading * self.heading[0], heading * self.heading[1], 0.0];
        let (mut euler, mut velocity) = ([0.0; 3], [0.0; 6]);
        // Structural zeros: body velocity does not turn Euler angles, rates do not move the position.
        for k in 0..5 {
            for i in 0..3 {
                position[i] += factors[k] * self.columns[k][X + i];
            }
        }
        for k in [0, 1, 5, 6, 7] {
            for i in 0..3 {
                euler[i] += factors[k] * self.columns[k][PHI + i];
            }
        }
        if self.accelerates {
            for k in 0..DRIVING.len() {
                for i in 0..6 {
                    velocity[i] += factors[k] * self.columns[k][U + i];
                }
            }
        }
        a[..PHI].copy_from_slice(&position);
        a[PHI..U].copy_from_slice(&euler);
        a[U..].copy_from_slice(&velocity);
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

/// sum += a b.
#[inline(always)]
fn add(sum: &mut Column, a: f64, b: &Column) {
    add_part::<0, VEHICLE_STATES>(sum, a, b);
}

/// Rows `FROM..TO` of sum += a b.
#[inline(always)]
fn add_part<const FROM: usize, const TO: usize>(sum: &mut Column, a: f64, b: &Column) {
    for i in FROM..TO {
        sum[i] += a * b[i];
    }
}

/// Lower triangle (by blocks of four) of q += weight Σ psd_k column_k column_kᵀ.
fn add_outer(q: &mut [Column; VEHICLE_STATES], columns: &[Column], psd: &[f64; 6], weight: f64) {
    for (column, psd) in columns.iter().zip(psd) {
        let factor = weight * psd;
        for j in 0..4 {
            add_part::<0, VEHICLE_STATES>(&mut q[j], factor * column[j], column);
        }
        for j in 4..8 {
            add_part::<4, VEHICLE_STATES>(&mut q[j], factor * column[j], column);
        }
        for j in 8..VEHICLE_STATES {
            add_part::<8, VEHICLE_STATES>(&mut q[j], factor * column[j], column);
        }
    }
}
