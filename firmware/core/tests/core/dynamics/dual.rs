//! Dual numbers a + b ε, ε² = 0: exact first derivatives of any formula written over [`Scalar`].

use core::ops::{Add, Div, Mul, Neg, Sub};

/// What the textbook model needs from a number.
pub trait Scalar:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn atan2(self, x: Self) -> Self;
}

#[derive(Clone, Copy, Debug)]
pub struct Dual {
    pub value: f64,
    pub slope: f64,
}

impl From<f64> for Dual {
    fn from(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self { value: self.value + b.value, slope: self.slope + b.slope }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Self { value: self.value - b.value, slope: self.slope - b.slope }
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self { value: self.value * b.value, slope: self.slope * b.value + self.value * b.slope }
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        Self { value, slope: (self.slope - value * b.slope) / b.value }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope }
    }
}

#[allow(clippy::disallowed_methods)] // the comparison is meant to be independent of libm
impl Scalar for Dual {
    fn sin(self) -> Self {
        Self { value: self.value.sin(), slope: self.slope * self.value.cos() }
    }
    fn cos(self) -> Self {
        Self { value: self.value.cos(), slope: -self.slope * self.value.sin() }
    }
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        // Only the speed of a fin's inflow is a root; its force is quadratic in it, so any finite
        // slope at zero serves.
        Self { value, slope: if value == 0.0 { 0.0 } else { self.slope / (2.0 * value) } }
    }
    fn abs(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }
    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let slope = if square == 0.0 { 0.0 } else { (self.slope * x.value - self.value * x.slope) / square };
        Self { value: self.value.atan2(x.value), slope }
    }
}
