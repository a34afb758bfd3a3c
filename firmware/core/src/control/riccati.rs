//! Riccati equation of the linear quadratic regulator, solved by structure-preserving doubling.
//!
//! Minimises ∫ (xᵀQx + uᵀRu) dt of ẋ = Ax + Bu over all time: 0 = AᵀP + PA − PB R⁻¹ BᵀP + Q, and u = −Kx with
//! K = R⁻¹BᵀP.
//!
//! The solution over a time h for any start P₀ is H + Eᵀ P₀ (I + G P₀)⁻¹ E with three matrices that depend on h
//! only; H is the solution from P₀ = 0, E the transition of the closed loop. Two steps of h compose to one of 2h:
//!
//! ```text
//! E ← E (I + GH)⁻¹ E      G ← G + E (I + GH)⁻¹ G Eᵀ      H ← H + Eᵀ H (I + GH)⁻¹ E
//! ```
//!
//! (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, *A structure-preserving doubling algorithm for continuous-time algebraic
//! Riccati equations*, Linear Algebra Appl. 396, 2005, started from the exact flow over a short h instead of its
//! Cayley transform.) The short flow is the Taylor series of exp([−A S; Q Aᵀ] h), S = B R⁻¹ Bᵀ. All matrices stay bounded: G and H are positive
//! semi-definite, so I + GH never is singular, and convergence is quadratic.
//!
//! The work is cut in slices of a few matrix products, so that a board can spread a solution over its steps.

use super::linear::solve_in_place;
use nalgebra::{Cholesky, SMatrix};

/// h ‖Hamiltonian‖ of the Taylor series: with [`ORDER`] terms the first one left out is below 1e-16 (0.05⁹/9! = 5e-18).
const SHORT_FLOW: f64 = 0.05;
/// Terms of the Taylor series.
const ORDER: u8 = 8;
/// Doublings after which a system is taken as not stabilisable: h grows by 1e15, far beyond any time constant
/// that a double can tell from infinity.
const MAX_DOUBLINGS: u8 = 50;

/// Why there is no solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RiccatiError {
    /// R is not positive definite.
    InputWeight,
    /// A matrix is not finite.
    NotFinite,
    /// No solution that stabilises the system was approached.
    NotStabilisable,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Done,
    /// Term of the Taylor series to be added next, of the first block column.
    First(u8),
    /// The same of the second.
    Second(u8),
    /// From the flow's blocks to E, G, H.
    Join,
    /// Doublings done.
    Double(u8),
}

/// A solution in progress. 8 N² + NM doubles, 10 kB for the vehicle: keep it in a static.
#[derive(Clone, Debug)]
pub struct RiccatiSolver<const N: usize, const M: usize> {
    /// Until the flow is complete; scratch afterwards, as `s`.
    a: SMatrix<f64, N, N>,
    s: SMatrix<f64, N, N>,
    q: SMatrix<f64, N, N>,
    e: SMatrix<f64, N, N>,
    g: SMatrix<f64, N, N>,
    h: SMatrix<f64, N, N>,
    work: [SMatrix<f64, N, N>; 2],
    /// R⁻¹ Bᵀ.
    rb: SMatrix<f64, M, N>,
    step_s: f64,
    phase: Phase,
}

const fn zeros<const R: usize, const C: usize>() -> SMatrix<f64, R, C> {
    SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; R]; C]))
}

impl<const N: usize, const M: usize> RiccatiSolver<N, M> {
    /// Most calls of [`Self::step`] that one solution can take.
    pub const MAX_STEPS: usize = 2 * ORDER as usize + 1 + MAX_DOUBLINGS as usize + 1;

    /// Nothing to solve yet: P = 0, K = 0.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            a: zeros(),
            s: zeros(),
            q: zeros(),
            e: zeros(),
            g: zeros(),
            h: zeros(),
            work: [zeros(); 2],
            rb: zeros(),
            step_s: 0.0,
            phase: Phase::Done,
        }
    }

    /// A and Q, to be written before [`Self::begin`].
    pub fn matrices(&mut self) -> (&mut SMatrix<f64, N, N>, &mut SMatrix<f64, N, N>) {
        (&mut self.a, &mut self.q)
    }

    /// Sets up the problem whose [`Self::matrices`] were written, with B and R; nothing but products with them is
    /// computed yet.
    ///
    /// # Errors
    /// R is not positive definite, or something is not finite.
    pub fn begin(&mut self, b: &SMatrix<f64, N, M>, r: &SMatrix<f64, M, M>) -> Result<(), RiccatiError> {
        let r = Cholesky::new(*r).ok_or(RiccatiError::InputWeight)?;
        b.transpose_to(&mut self.rb);
        r.solve_mut(&mut self.rb);
        self.s.gemm(1.0, b, &self.rb, 0.0);
        // Q and S have different units; the geometric mean is what counts, whatever the scale of the cost.
        let norm = self.a.norm() + libm::sqrt(self.q.norm() * self.s.norm());
        if !norm.is_finite() {
            return Err(RiccatiError::NotFinite);
        }
        self.step_s = (SHORT_FLOW / norm.max(f64::MIN_POSITIVE)).min(1.0);
        self.e.fill_with_identity();
        self.h.fill(0.0);
        self.g.fill(0.0);
        let [x, y] = &mut self.work;
        x.fill_with_identity();
        y.fill(0.0);
        self.phase = Phase::First(1);
        Ok(())
    }

    /// Does one slice of work, at most nine N x N products; true when the solution is complete.
    ///
    /// # Errors
    /// The system cannot be stabilised; the solver is at rest then.
    pub fn step(&mut self) -> Result<bool, RiccatiError> {
        let next = match self.phase {
            Phase::First(term) => Ok(self.flow(false, term)),
            Phase::Second(term) => Ok(self.flow(true, term)),
            Phase::Join => self.join(),
            Phase::Double(done) => self.double(done),
            Phase::Done => Ok(Phase::Done),
        };
        self.phase = match next {
            Ok(phase) => phase,
            Err(error) => {
                self.phase = Phase::Done;
                return Err(error);
            }
        };
        Ok(self.phase == Phase::Done)
    }

    /// P of the last complete solution.
    #[must_use]
    pub fn cost(&self) -> &SMatrix<f64, N, N> {
        &self.h
    }

    /// K = R⁻¹BᵀP of the last complete solution.
    pub fn gain_to(&self, k: &mut SMatrix<f64, M, N>) {
        k.fill(0.0);
        k.gemm(1.0, &self.rb, &self.h, 1.0);
    }

    /// term ← [−A S; Q Aᵀ] h/k · term, added to the sums.
    fn flow(&mut self, second: bool, term: u8) -> Phase {
        let [x, y] = &mut self.work;
        let scale = self.step_s / f64::from(term);
        let (mut column_x, mut column_y) = (zeros::<N, 1>(), zeros::<N, 1>());
        for (mut next_x, mut next_y) in x.column_iter_mut().zip(y.column_iter_mut()) {
            column_x.copy_from(&next_x);
            column_y.copy_from(&next_y);
            let (x, y) = (&column_x, &column_y);
            next_x.gemv(-scale, &self.a, x, 0.0);
            next_x.gemv(scale, &self.s, y, 1.0);
            next_y.gemv(scale, &self.q, x, 0.0);
            next_y.gemv_tr(scale, &self.a, y, 1.0);
        }
        if second {
            self.g += &*x;
        } else {
            self.e += &*x;
            self.h += &*y;
        }
        match (second, term < ORDER) {
            (false, true) => Phase::First(term + 1),
            (true, true) => Phase::Second(term + 1),
            (false, false) => {
                x.fill(0.0);
                y.fill_with_identity();
                Phase::Second(1)
            }
            (true, false) => Phase::Join,
        }
    }

    /// E = Φ₁₁⁻¹, G = Φ₁₁⁻¹ Φ₁₂, H = Φ₂₁ Φ₁₁⁻¹.
    fn join(&mut self) -> Result<Phase, RiccatiError> {
        let [flow, from] = &mut self.work;
        flow.copy_from(&self.e);
        self.e.fill_with_identity();
        if !solve_in_place(flow, [&mut self.e, &mut self.g]) {
            return Err(RiccatiError::NotStabilisable);
        }
        from.copy_from(&self.h);
        self.h.gemm(1.0, from, &self.e, 0.0);
        symmetrise(&mut self.g);
        symmetrise(&mut self.h);
        Ok(Phase::Double(0))
    }

    fn double(&mut self, done: u8) -> Result<Phase, RiccatiError> {
        let [w, we] = &mut self.work;
        let (wg, product) = (&mut self.a, &mut self.s);
        w.fill_with_identity();
        w.gemm(1.0, &self.g, &self.h, 1.0);
        we.copy_from(&self.e);
        self.e.transpose_to(product);
        wg.gemm(1.0, &self.g, product, 0.0);
        if !solve_in_place(w, [we, wg]) {
            return Err(RiccatiError::NotStabilisable);
        }
        product.gemm(1.0, &self.h, we, 0.0);
        // w is free now: the increment of H.
        w.gemm_tr(1.0, &self.e, product, 0.0);
        self.h += &*w;
        symmetrise(&mut self.h);
        self.g.gemm(1.0, &self.e, wg, 1.0);
        symmetrise(&mut self.g);
        product.gemm(1.0, &self.e, we, 0.0);
        self.e.copy_from(product);

        let size = self.h.amax();
        if !size.is_finite() || !self.e.amax().is_finite() {
            return Err(RiccatiError::NotStabilisable);
        }
        // Convergence is quadratic: an increment of 1e-14 leaves an error far below rounding. E vanishes only
        // if the closed loop is stable; H alone would also settle where an unstable mode costs nothing.
        if w.amax() <= 1e-14 * size && self.e.amax() <= 1e-6 {
            return Ok(Phase::Done);
        }
        if done >= MAX_DOUBLINGS { Err(RiccatiError::NotStabilisable) } else { Ok(Phase::Double(done + 1)) }
    }
}

fn symmetrise<const N: usize>(a: &mut SMatrix<f64, N, N>) {
    for i in 0..N {
        for j in 0..i {
            let mean = 0.5 * (a[(i, j)] + a[(j, i)]);
            a[(i, j)] = mean;
            a[(j, i)] = mean;
        }
    }
}
