//! How far the values of a fit may be off: by their information, and by how far they differ from run to run.
//!
//! The residuals of a run go together, so that runs are what is independent. A few runs tell a spread badly. Each number's
//! own therefore counts half, and half the median over all numbers that the data tell (a moderated t, Smyth 2004), which
//! has twice the degrees of freedom. No sigma is smaller than that of the information.

use super::fit::Fit;
use backseat_logs::stats::median;
use nalgebra::{DMatrix, DVector};

/// The prior's share from which a number tells nothing of the runs.
const PRIORS: f64 = 0.5;

impl Fit {
    /// Runs that were used.
    pub fn runs(&self) -> Vec<usize> {
        self.parts.iter().map(|part| part.run).collect()
    }

    /// Degrees of freedom of [`Self::sigmas`].
    pub fn degrees(&self) -> usize {
        2 * self.parts.len().saturating_sub(1)
    }

    /// Values of a fit without one run, by one Gauss-Newton step from those with it.
    pub fn without(&self, run: usize) -> Vec<f64> {
        let Some(part) = self.parts.iter().find(|part| part.run == run) else { return self.values.clone() };
        let step = (&self.information - &part.normal).cholesky().map(|factor| factor.solve(&part.gradient));
        let step = step.unwrap_or_else(|| DVector::zeros(self.values.len()));
        self.values.iter().zip(step.iter()).map(|(value, step)| value - step).collect()
    }

    /// One sigma of each value.
    pub fn sigmas(&self) -> Vec<f64> {
        self.sigmas_by(self.all_without())
    }

    /// The same by the values of fits without each run in turn.
    pub fn sigmas_by(&self, without: Vec<Vec<f64>>) -> Vec<f64> {
        let spread = self.spread(without);
        (0..self.values.len()).map(|place| spread.sigma(self, &[(place, 1.0)])).collect()
    }

    /// The same of a sum of values, each times its factor.
    pub fn sigma_of(&self, sum: &[(usize, f64)]) -> f64 {
        self.spread(self.all_without()).sigma(self, sum)
    }

    fn all_without(&self) -> Vec<Vec<f64>> {
        self.parts.iter().map(|part| self.without(part.run)).collect()
    }

    fn spread(&self, without: Vec<Vec<f64>>) -> Spread {
        let mut spread = Spread { without, usual: 1.0 };
        let told: Vec<f64> = (0..self.values.len())
            .filter(|&place| self.prior_share[place] < PRIORS)
            .map(|place| spread.ratio(self, &[(place, 1.0)]))
            .collect();
        spread.usual = median(&told).unwrap_or(spread.usual);
        spread
    }

    /// Values and covariance.
    pub fn gaussian(&self) -> Gaussian {
        Gaussian { mean: DVector::from_column_slice(&self.values), covariance: self.covariance.clone() }
    }
}

struct Spread {
    without: Vec<Vec<f64>>,
    /// Variance from run to run over that of the information, median of all numbers.
    usual: f64,
}

impl Spread {
    fn variance(fit: &Fit, sum: &[(usize, f64)]) -> f64 {
        sum.iter().flat_map(|(i, a)| sum.iter().map(move |(j, b)| a * b * fit.covariance[(*i, *j)])).sum()
    }

    /// Variance by leaving out each run over that of the information.
    fn ratio(&self, fit: &Fit, sum: &[(usize, f64)]) -> f64 {
        let count = self.without.len() as f64;
        let sums: Vec<f64> =
            self.without.iter().map(|values| sum.iter().map(|(place, factor)| factor * values[*place]).sum()).collect();
        let mean = sums.iter().sum::<f64>() / count;
        let squares: f64 = sums.iter().map(|value| (value - mean).powi(2)).sum();
        (count - 1.0) / count * squares / Self::variance(fit, sum)
    }

    fn sigma(&self, fit: &Fit, sum: &[(usize, f64)]) -> f64 {
        let moderated = 0.5 * (self.ratio(fit, sum) + self.usual);
        (Self::variance(fit, sum) * moderated.max(1.0)).sqrt()
    }
}

/// Values that are known so well.
#[derive(Clone, Debug)]
pub struct Gaussian {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Gaussian {
    fn block(&self, places: &[usize]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let own = DMatrix::from_fn(places.len(), places.len(), |i, j| self.covariance[(places[i], places[j])]);
        let values = DVector::from_fn(places.len(), |i, _| self.mean[places[i]]);
        Some((own.cholesky()?.inverse(), values))
    }

    /// Cost that some values take away beside all others.
    pub fn gain(&self, places: &[usize]) -> f64 {
        self.block(places).map_or(0.0, |(inverse, values)| values.dot(&(inverse * &values)))
    }

    /// The others with these at none.
    pub fn without(&self, places: &[usize]) -> Option<Self> {
        let (inverse, values) = self.block(places)?;
        let border = DMatrix::from_fn(self.mean.len(), places.len(), |i, j| self.covariance[(i, places[j])]);
        let by = &border * inverse;
        let mut covariance = &self.covariance - &by * border.transpose();
        // what is fixed stays invertible beside the others
        places.iter().for_each(|&place| covariance[(place, place)] += 1e-12);
        Some(Self { mean: &self.mean - by * values, covariance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_without_a_value_the_others_take_over_what_goes_with_it() {
        // least squares of y = a + b x at x = 1, 2 with y = 1, 2: a = 0, b = 1; without b the mean of y, and a cost of 0.5
        let covariance = DMatrix::from_row_slice(2, 2, &[2.0, 3.0, 3.0, 5.0]).try_inverse().unwrap();
        let all = Gaussian { mean: DVector::from_column_slice(&[0.0, 1.0]), covariance };
        let less = all.without(&[1]).unwrap();
        assert!((less.mean[0] - 1.5).abs() < 1e-12 && less.mean[1].abs() < 1e-12);
        assert!((less.covariance[(0, 0)] - 0.5).abs() < 1e-9);
        assert!((all.gain(&[1]) - 0.5).abs() < 1e-12);
    }
}
