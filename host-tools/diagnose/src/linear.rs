//! Small least squares on normal equations: every hypothesis is a choice of columns (`usize`, or [`Column`]).

use crate::normal_equations::{BlockEquations, Column, NormalEquations};

/// A least-squares fit of some columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// By how much Σ e² falls.
    pub gain: f64,
    /// θ of the free columns, in their order.
    pub theta: Vec<f64>,
    /// (SᵀS)⁻¹ of the free columns, row by row.
    pub covariance: Vec<f64>,
}

impl Fit {
    /// One sigma of a free column by the Hessian.
    #[must_use]
    pub fn sigma(&self, i: usize) -> f64 {
        self.covariance[i * self.theta.len() + i].max(0.0).sqrt()
    }
}

/// Fits `free` columns with those of `fixed` present by their factor; `None` where the data do not determine them.
#[must_use]
pub fn fit<C: Copy + Into<Column>>(equations: &NormalEquations, free: &[C], fixed: &[(C, f64)]) -> Option<Fit> {
    let d = free.len();
    let mut a = vec![0.0; d * d];
    let mut b = vec![0.0; d];
    for (i, &ci) in free.iter().enumerate() {
        for (j, &cj) in free.iter().enumerate() {
            a[i * d + j] = equations.information(ci, cj);
        }
        b[i] =
            equations.score(ci) - fixed.iter().map(|&(c, factor)| equations.information(ci, c) * factor).sum::<f64>();
    }
    let inverse = invert(&a, d)?;
    let theta: Vec<f64> = (0..d).map(|i| (0..d).map(|j| inverse[i * d + j] * b[j]).sum()).collect();
    Some(Fit { gain: gain_of(equations, free, &theta, fixed), theta, covariance: inverse })
}

/// Values of `bounded` columns inside their bounds, of those before them without any: what would leave its bounds is held at
/// the edge, and the others are fitted again. The fit, the columns that are free in it, and those that are fixed.
#[allow(clippy::type_complexity)] // named where it is used
#[must_use]
pub fn fit_within<C: Copy + PartialEq + Into<Column>>(
    equations: &NormalEquations,
    unbounded: &[C],
    bounded: &[(C, [f64; 2])],
    fixed: &[(C, f64)],
) -> Option<(Fit, Vec<C>, Vec<(C, f64)>)> {
    let mut at = fixed.to_vec();
    let mut left: Vec<C> = unbounded.iter().copied().chain(bounded.iter().map(|(column, _)| *column)).collect();
    loop {
        let fit = fit(equations, &left, &at)?;
        let outside = bounded.iter().find_map(|(column, [low, high])| {
            let value = fit.theta[left.iter().position(|c| c == column)?];
            (value < *low || value > *high).then(|| (*column, value.clamp(*low, *high)))
        });
        let Some(held) = outside else { return Some((fit, left, at)) };
        left.retain(|column| *column != held.0);
        at.push(held);
    }
}

/// By how much Σ e² falls at given values.
#[must_use]
pub fn gain_of<C: Copy + Into<Column>>(
    equations: &NormalEquations,
    free: &[C],
    theta: &[f64],
    fixed: &[(C, f64)],
) -> f64 {
    let all: Vec<(C, f64)> = free.iter().copied().zip(theta.iter().copied()).chain(fixed.iter().copied()).collect();
    let mut gain = 0.0;
    for &(i, x) in &all {
        gain += 2.0 * x * equations.score(i);
        for &(j, y) in &all {
            gain -= x * y * equations.information(i, j);
        }
    }
    gain
}

/// Scatter of few blocks may be small by chance.
const LEAST_INFLATION: f64 = 0.5;

/// Factor by which the blocks' scores scatter more than the Hessian says, and the number of blocks: residuals that are
/// still coloured over a block lower the information by it. Neighbouring blocks count by half (Bartlett).
#[must_use]
pub fn inflation<C: Copy + Into<Column>>(
    normal: &BlockEquations,
    choose: impl Fn(usize) -> bool,
    free: &[C],
    fit: &Fit,
    fixed: &[(C, f64)],
) -> (f64, usize) {
    let d = free.len();
    let scatter = scatter(normal, &choose, free, fit, fixed);
    let trace: f64 = (0..d).map(|i| (0..d).map(|j| fit.covariance[i * d + j] * scatter[j * d + i]).sum::<f64>()).sum();
    let blocks = normal.blocks.iter().enumerate().filter(|(index, block)| choose(*index) && block.count > 0).count();
    ((trace / d.max(1) as f64).max(LEAST_INFLATION), blocks)
}

/// Σ r rᵀ of the blocks' scores at the fit, neighbours by half.
fn scatter<C: Copy + Into<Column>>(
    normal: &BlockEquations,
    choose: &impl Fn(usize) -> bool,
    free: &[C],
    fit: &Fit,
    fixed: &[(C, f64)],
) -> Vec<f64> {
    let d = free.len();
    let mut scatter = vec![0.0; d * d];
    let mut previous: Option<(usize, Vec<f64>)> = None;
    for (index, block) in normal.blocks.iter().enumerate() {
        if !choose(index) || block.count == 0 {
            continue;
        }
        let rest: Vec<f64> = free
            .iter()
            .map(|&i| {
                let known = free.iter().zip(&fit.theta).map(|(&j, x)| block.information(i, j) * x).sum::<f64>();
                block.score(i) - known - fixed.iter().map(|&(j, x)| block.information(i, j) * x).sum::<f64>()
            })
            .collect();
        for i in 0..d {
            for j in 0..d {
                scatter[i * d + j] += rest[i] * rest[j];
                if let Some((_, last)) = previous.as_ref().filter(|(before, _)| before + 1 == index) {
                    scatter[i * d + j] += 0.5 * (rest[i] * last[j] + last[i] * rest[j]);
                }
            }
        }
        previous = Some((index, rest));
    }
    scatter
}

/// One sigma of each free column: the larger of the Hessian's and the sandwich's.
#[must_use]
pub fn sigmas<C: Copy + Into<Column>>(
    normal: &BlockEquations,
    choose: impl Fn(usize) -> bool,
    free: &[C],
    fit: &Fit,
    fixed: &[(C, f64)],
) -> Vec<f64> {
    let d = free.len();
    let middle = scatter(normal, &choose, free, fit, fixed);
    let h = &fit.covariance;
    (0..d)
        .map(|i| {
            let mut sandwich = 0.0;
            for j in 0..d {
                for k in 0..d {
                    sandwich += h[i * d + j] * middle[j * d + k] * h[k * d + i];
                }
            }
            h[i * d + i].max(sandwich).max(0.0).sqrt()
        })
        .collect()
}

/// Inverse of a positive definite matrix, scaled to a unit diagonal first; `None` where it is singular to working
/// precision (columns that the data cannot tell apart, or that leave no trace).
fn invert(a: &[f64], d: usize) -> Option<Vec<f64>> {
    /// Least share of a column that the others must leave: below it the data do not determine the column.
    const LEAST_SHARE: f64 = 1e-9;
    let scale: Vec<f64> = (0..d).map(|i| a[i * d + i].sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let mut l = vec![0.0; d * d];
    for i in 0..d {
        for j in 0..=i {
            let mut sum = a[i * d + j] / (scale[i] * scale[j]);
            for k in 0..j {
                sum -= l[i * d + k] * l[j * d + k];
            }
            if i == j {
                if sum < LEAST_SHARE {
                    return None;
                }
                l[i * d + i] = sum.sqrt();
            } else {
                l[i * d + j] = sum / l[j * d + j];
            }
        }
    }
    let mut inverse = vec![0.0; d * d];
    for column in 0..d {
        let mut x = vec![0.0; d];
        for i in 0..d {
            let mut sum = if i == column { 1.0 } else { 0.0 };
            for k in 0..i {
                sum -= l[i * d + k] * x[k];
            }
            x[i] = sum / l[i * d + i];
        }
        for i in (0..d).rev() {
            let mut sum = x[i];
            for k in i + 1..d {
                sum -= l[k * d + i] * x[k];
            }
            x[i] = sum / l[i * d + i];
        }
        for i in 0..d {
            inverse[i * d + column] = x[i] / (scale[i] * scale[column]);
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_two_columns_by_hand() {
        // [4 1; 1 2] θ = [9, 4]: θ = (2, 1), gain = 2·9 + 1·4 = 22.
        let two = NormalEquations::new(vec![4.0, 1.0, 2.0], vec![9.0, 4.0]);
        let both = fit(&two, &[0, 1], &[]).unwrap();
        assert!((both.theta[0] - 2.0).abs() < 1e-12 && (both.theta[1] - 1.0).abs() < 1e-12); // rounding
        assert!((both.gain - 22.0).abs() < 1e-12);
        assert!((both.covariance[0] - 2.0 / 7.0).abs() < 1e-12);
        // With the second present by 1: 4 θ = 9 − 1, and the gain is the same.
        let one = fit(&two, &[0], &[(1, 1.0)]).unwrap();
        assert!((one.theta[0] - 2.0).abs() < 1e-12 && (one.gain - 22.0).abs() < 1e-12);
    }

    #[test]
    fn val_a_difference_of_columns_by_hand() {
        // (1, −1) [4 1; 1 2] (1, −1)ᵀ = 4, (1, −1) [9, 4]ᵀ = 5: θ = 1.25, gain = 5² / 4.
        let two = NormalEquations::new(vec![4.0, 1.0, 2.0], vec![9.0, 4.0]);
        let less = fit(&two, &[Column::until(0, Some(1))], &[]).unwrap();
        assert!((less.theta[0] - 1.25).abs() < 1e-12 && (less.gain - 6.25).abs() < 1e-12); // rounding
        assert_eq!(two.information(Column::until(0, Some(1)), 1), -1.0);
    }

    #[test]
    fn columns_that_are_one_are_not_determined() {
        let same = NormalEquations::new(vec![3.0; 3], vec![1.0; 2]);
        assert!(fit(&same, &[0, 1], &[]).is_none());
        assert!(fit(&same, &[0], &[]).is_some());
    }
}
