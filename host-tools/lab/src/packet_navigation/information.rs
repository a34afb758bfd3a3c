//! A Gaussian by its information: Λ = P⁻¹ and η = Λ x̂. Knowing nothing is Λ = 0; independent
//! knowledge adds.

use nalgebra::{Cholesky, Const, SMatrix, SVector};

/// A matrix is not positive definite, by rounding or by a state without information.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an information matrix is not positive definite")]
pub struct NotPositive;

/// Λ and η of `N` states. The `C` columns of η are `C` independent vectors that share one Λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Information<const N: usize, const C: usize> {
    /// Λ.
    pub lambda: SMatrix<f64, N, N>,
    /// η.
    pub eta: SMatrix<f64, N, C>,
}

/// x → Φ x + b + G w, w white of unit variance.
pub struct Step<const N: usize, const C: usize, const G: usize> {
    /// Φ⁻¹.
    pub inverse: SMatrix<f64, N, N>,
    /// b.
    pub shift: SMatrix<f64, N, C>,
    /// G.
    pub noise: SMatrix<f64, N, G>,
}

impl<const N: usize, const C: usize> Information<N, C> {
    /// No information.
    #[must_use]
    pub fn none() -> Self {
        Self { lambda: SMatrix::zeros(), eta: SMatrix::zeros() }
    }

    /// Adds a measurement of state `i`: `value` with `sigma`, independent of the others.
    pub fn know(&mut self, i: usize, value: [f64; C], sigma: f64) {
        let mut h = SVector::zeros();
        h[i] = 1.0;
        self.observe(&h, value, sigma * sigma);
    }

    /// z = hᵀ x + noise of this variance: Λ += h hᵀ/R, η += h z/R.
    pub fn observe(&mut self, h: &SVector<f64, N>, z: [f64; C], variance: f64) {
        let weighted = h / variance;
        self.lambda += weighted * h.transpose();
        self.eta += weighted * SMatrix::<f64, 1, C>::from_row_slice(&z);
    }

    /// Time update. With M = Φ⁻ᵀ Λ Φ⁻¹ the inverse of M⁻¹ + G Gᵀ is M − M G (I + Gᵀ M G)⁻¹ Gᵀ M:
    /// nothing is inverted but I + Gᵀ M G, so that Λ may be singular.
    ///
    /// # Errors
    /// Rounding has made that matrix indefinite.
    pub fn predict<const G: usize>(&mut self, step: &Step<N, C, G>) -> Result<(), NotPositive> {
        let m = step.inverse.tr_mul(&(self.lambda * step.inverse));
        let eta = step.inverse.tr_mul(&self.eta) + m * step.shift;
        let mg = m * step.noise;
        let s = SMatrix::<f64, G, G>::identity() + step.noise.tr_mul(&mg);
        let gain = cholesky(s)?.solve(&mg.transpose()).transpose();
        self.lambda = symmetric(m - gain * mg.transpose());
        self.eta = eta - gain * step.noise.tr_mul(&eta);
        Ok(())
    }

    /// x̂ = Λ⁻¹ η and P = Λ⁻¹.
    ///
    /// # Errors
    /// A state has no information.
    pub fn moments(&self) -> Result<(SMatrix<f64, N, C>, SMatrix<f64, N, N>), NotPositive> {
        let factor = cholesky(self.lambda)?;
        Ok((factor.solve(&self.eta), factor.inverse()))
    }
}

/// L with L Lᵀ = `a`.
pub(super) fn root<const N: usize>(a: SMatrix<f64, N, N>) -> Result<SMatrix<f64, N, N>, NotPositive> {
    Ok(cholesky(a)?.unpack())
}

pub(super) fn cholesky<const N: usize>(a: SMatrix<f64, N, N>) -> Result<Cholesky<f64, Const<N>>, NotPositive> {
    Cholesky::new(a).ok_or(NotPositive)
}

/// The part that rounding has left symmetric.
pub(super) fn symmetric<const N: usize>(a: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (a + a.transpose()) * 0.5
}
