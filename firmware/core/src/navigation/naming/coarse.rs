//! A size in the steps of an acoustic packet: 19 % each, from 2 % to four times what the cause is expected to be.

use super::causes::Cause;
use core::f64::consts::LN_2;

/// Steps that double a size.
const OCTAVE: f64 = 4.0;
/// The step of a size of one sigma.
const SIGMA: f64 = 23.0;
const MOST: f64 = 31.0;

impl Cause {
    /// Its numbers in steps, with their signs; 0: less than the least, or no such number.
    #[must_use]
    pub fn steps(self, size: [f64; 2]) -> [i8; 2] {
        self.each(size, |value, scale| {
            let step = libm::round(SIGMA + OCTAVE / LN_2 * libm::log(value.abs() / scale));
            let step = step.clamp(0.0, MOST); // 0 for nothing: its logarithm is no number that counts
            libm::copysign(step, value) as i8
        })
    }

    /// Its numbers by their steps.
    #[must_use]
    pub fn size_of(self, steps: [i8; 2]) -> [f64; 2] {
        self.each(steps, |step, scale| {
            let value = scale * libm::exp((f64::from(step).abs() - SIGMA) * LN_2 / OCTAVE);
            if step == 0 { 0.0 } else { libm::copysign(value, f64::from(step)) }
        })
    }

    /// Of each of its numbers and what it is expected to be.
    fn each<T: Copy, R: Default>(self, values: [T; 2], of: impl Fn(T, f64) -> R) -> [R; 2] {
        let [first, second] = self.parts(0.0).map(|part| part.map(|part| part.sigma));
        let [_, (other, _)] = self.numbers();
        let one = |value, scale: Option<f64>| scale.map_or_else(R::default, |scale| of(value, scale));
        let [value, beside] = values;
        [one(value, first), one(beside, second.filter(|_| !other.is_empty()))]
    }
}

#[cfg(test)]
mod tests {
    use super::super::causes::ALL;
    use super::*;

    #[test]
    fn a_size_comes_back_to_a_tenth_with_its_sign() {
        for cause in ALL {
            let scale = cause.parts(0.0)[0].unwrap().sigma;
            for exponent in -37..14 {
                let size = scale * libm::exp(0.1 * f64::from(exponent));
                for size in [size, -size] {
                    let [read, other] = cause.size_of(cause.steps([size, 0.0]));
                    assert!((read / size - 1.0).abs() < 0.0906, "{cause:?} {size} {read}");
                    assert_eq!(other, 0.0);
                }
            }
            assert_eq!(cause.steps([0.0, 0.0]), [0; 2]);
            assert_eq!(cause.steps([1.0e9 * scale, 0.0])[0], 31);
        }
        assert_eq!(Cause::CurrentChanged.steps([0.15, -0.15]), [23, -23]);
        assert_eq!(Cause::FinStuck(0).steps([0.1, 1.0]), [23, 0], "its second number is not told");
    }
}
