//! The slope of one quantity on another, and how sure it is, from stretches that are independent of each other.
//!
//! Noise of sensors and motion is correlated over seconds, so samples are no independent evidence. Equations are
//! therefore kept by stretches; the standard error is that of the jackknife over stretches (Efron and Stein 1981), and
//! the degrees of freedom are the stretches that carry the motion, (Σ w)² / Σ w² with w the motion in each.

use crate::stats::percentile;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

/// One equation: y = gain · x + Σ others · unknowns.
pub struct Equation {
    /// Stretch of the log that it belongs to.
    pub stretch: usize,
    pub y: f64,
    pub x: f64,
    /// What else acts, and is fitted beside it.
    pub others: [f64; 4],
}

/// A fitted gain.
#[derive(Clone, Debug)]
pub struct Slope {
    pub gain: f64,
    /// Standard error by the jackknife.
    pub sigma: f64,
    /// Partial correlation.
    pub correlation: f64,
    /// The gain by each stretch in which x moves.
    stretches: Vec<f64>,
    /// Degrees of freedom.
    pub freedom: f64,
}

/// A chance below this is none: some thirty relations are tested in a log.
const CHANCE: f64 = 1e-4;
/// Readings beyond so many times what 99 of 100 stay within are outliers.
const OUTLIER: f64 = 2.0;
/// Fewest stretches and degrees of freedom.
const ENOUGH: (usize, f64) = (5, 1.5);
/// Stretches with less than this share of the mean motion show no sign.
const STILL: f64 = 0.2;

impl Slope {
    /// Fits; `None` with too few stretches in which x moves.
    pub fn of(mut equations: Vec<Equation>) -> Option<Self> {
        equations.retain(|e| e.y.is_finite() && e.x.is_finite() && e.others.iter().all(|other| other.is_finite()));
        if equations.len() < ENOUGH.0 {
            return None;
        }
        clip(&mut equations, |equation| &mut equation.y);
        clip(&mut equations, |equation| &mut equation.x);
        free_of_others(&mut equations)?;
        let mut sums: Vec<[f64; 4]> = Vec::new();
        let mut stretch = None;
        for Equation { stretch: of, x, y, .. } in &equations {
            if stretch != Some(*of) {
                stretch = Some(*of);
                sums.push([0.0; 4]);
            }
            if let Some(sum) = sums.last_mut() {
                *sum = [sum[0] + x * x, sum[1] + x * y, sum[2] + y * y, sum[3] + 1.0];
            }
        }
        let total = sums.iter().fold([0.0; 4], |t, s| [t[0] + s[0], t[1] + s[1], t[2] + s[2], t[3] + s[3]]);
        let [xx, xy, yy, _] = total;
        let quartic: f64 = sums.iter().map(|s| s[0] * s[0]).sum();
        if xx <= 1e-30 || yy <= 1e-30 || quartic <= 0.0 {
            return None;
        }
        let freedom = xx * xx / quartic - 1.0;
        if sums.len() < ENOUGH.0 || freedom < ENOUGH.1 {
            return None;
        }
        let gain = xy / xx;
        let left_out: Vec<f64> = sums.iter().map(|s| (xy - s[1]) / (xx - s[0]).max(1e-30)).collect();
        let mean = left_out.iter().sum::<f64>() / left_out.len() as f64;
        let n = sums.len() as f64;
        let sigma = ((n - 1.0) / n * left_out.iter().map(|g| (g - mean) * (g - mean)).sum::<f64>()).sqrt();
        let stretches = sums.iter().filter(|s| s[0] > STILL * xx / n).map(|s| s[1] / s[0]).collect();
        Some(Self { gain, sigma, correlation: xy / (xx * yy).sqrt(), stretches, freedom })
    }

    /// Stretches in which x moves, and how many of them have their gain on the side of a value where the whole has it.
    pub fn beyond(&self, value: f64) -> [usize; 2] {
        let is_same = |gain: &&f64| (**gain - value) * (self.gain - value) > 0.0;
        [self.stretches.len(), self.stretches.iter().filter(is_same).count()]
    }

    /// Probability of this sign by chance.
    pub fn chance(&self) -> f64 {
        self.tail(0.0)
    }

    /// Whether the sign is beyond chance.
    pub fn is_sure(&self) -> bool {
        self.chance() < CHANCE
    }

    /// Whether the gain differs from a value beyond chance.
    pub fn is_beyond(&self, value: f64) -> bool {
        self.tail(value) < CHANCE
    }

    /// Probability that the gain is on this side of a value by chance: by Student's t, or by the stretches alone, which a
    /// few large motions among many small ones do not sway.
    fn tail(&self, value: f64) -> f64 {
        let t = (self.gain - value).abs() / self.sigma.max(1e-12 * self.gain.abs()).max(f64::MIN_POSITIVE);
        let by_size = StudentsT::new(0.0, 1.0, self.freedom).map_or(1.0, |student| student.sf(t));
        let [all, same] = self.beyond(value).map(|count| count as u64);
        let by_count = Binomial::new(0.5, all).map_or(1.0, |chance| if same > 0 { chance.sf(same - 1) } else { 1.0 });
        by_size.min(by_count)
    }

    /// The gain, if x had the noise rather than y: the truth lies between the two (Frisch 1934).
    pub fn other_bound(&self) -> f64 {
        self.gain / (self.correlation * self.correlation)
    }
}

/// Bounds what outliers weigh.
fn clip(equations: &mut [Equation], of: impl Fn(&mut Equation) -> &mut f64) {
    let sizes: Vec<f64> = equations.iter_mut().map(|equation| of(equation).abs()).collect();
    let bound = OUTLIER * percentile(&sizes, 0.99).unwrap_or(f64::INFINITY);
    for equation in equations {
        let value = of(equation);
        *value = value.clamp(-bound, bound);
    }
}

/// Takes out of x and y what the other unknowns explain (Frisch and Waugh 1933).
fn free_of_others(equations: &mut [Equation]) -> Option<()> {
    let used: Vec<usize> = (0..4).filter(|&k| equations.iter().any(|e| e.others[k] != 0.0)).collect();
    if used.is_empty() {
        return Some(());
    }
    let size = used.len();
    let (mut normal, mut of_x, mut of_y) =
        (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size), DVector::<f64>::zeros(size));
    for equation in equations.iter() {
        for (i, &a) in used.iter().enumerate() {
            for (j, &b) in used.iter().enumerate() {
                normal[(i, j)] += equation.others[a] * equation.others[b];
            }
            of_x[i] += equation.others[a] * equation.x;
            of_y[i] += equation.others[a] * equation.y;
        }
    }
    for i in 0..size {
        normal[(i, i)] *= 1.0 + 1e-9;
        normal[(i, i)] += 1e-12;
    }
    let factor = normal.cholesky()?;
    let (of_x, of_y) = (factor.solve(&of_x), factor.solve(&of_y));
    for equation in equations {
        for (i, &a) in used.iter().enumerate() {
            equation.x -= of_x[i] * equation.others[a];
            equation.y -= of_y[i] * equation.others[a];
        }
    }
    Some(())
}
