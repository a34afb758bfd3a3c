//! Fixed-point decimal numbers: the text fields of every protocol, without float parsing or formatting.

use crate::Error;
use core::num::NonZeroU64;

/// Most digits after the point.
pub const MAX_SCALE: u8 = 18;

/// Not zero by type, so that dividing by them needs no check.
const POWERS: [NonZeroU64; MAX_SCALE as usize + 1] = {
    let mut powers = [NonZeroU64::MIN; MAX_SCALE as usize + 1];
    let mut index = 1;
    while index < powers.len() {
        powers[index] = powers[index - 1].saturating_mul(NonZeroU64::MIN.saturating_add(9));
        index += 1;
    }
    powers
};

/// `mantissa / 10^scale`.
///
/// Up to 15 significant digits, [`Self::to_f64`] is the correctly rounded value (both operands of its one division
/// are exact) and [`Self::from_f64`] gives the same digits back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decimal {
    mantissa: i64,
    scale: u8,
}

impl Decimal {
    /// `mantissa / 10^scale`; a scale beyond [`MAX_SCALE`] is taken as that.
    pub const fn new(mantissa: i64, scale: u8) -> Self {
        Self { mantissa, scale: if scale > MAX_SCALE { MAX_SCALE } else { scale } }
    }

    /// Reads `[+-]digits[.digits]` with a digit on at least one side of the point and at most 18 in all.
    ///
    /// # Errors
    /// [`Error::Missing`] when empty, [`Error::Malformed`] for any other character, [`Error::OutOfRange`] for more
    /// digits.
    pub fn parse(text: &[u8]) -> Result<Self, Error> {
        let (negative, digits) = match text {
            [] => return Err(Error::Missing),
            [b'-', rest @ ..] => (true, rest),
            [b'+', rest @ ..] => (false, rest),
            _ => (false, text),
        };
        let (mut magnitude, mut scale, mut count, mut point) = (0_i64, 0_u8, 0_u8, false);
        for character in digits {
            match character {
                b'0'..=b'9' if count == MAX_SCALE => return Err(Error::OutOfRange),
                b'0'..=b'9' => {
                    magnitude = magnitude.saturating_mul(10).saturating_add(i64::from(character - b'0'));
                    count += 1;
                    scale += u8::from(point);
                }
                b'.' if !point => point = true,
                _ => return Err(Error::Malformed),
            }
        }
        if count == 0 {
            return Err(Error::Malformed);
        }
        Ok(Self { mantissa: if negative { -magnitude } else { magnitude }, scale })
    }

    /// The nearest decimal with `scale` digits after the point, half away from zero.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when not finite or beyond 18 digits.
    pub fn from_f64(value: f64, scale: u8) -> Result<Self, Error> {
        let scaled = libm::round(value * Self::new(0, scale).unit().get() as f64);
        if scaled > -1.0e18 && scaled < 1.0e18 { Ok(Self::new(scaled as i64, scale)) } else { Err(Error::OutOfRange) }
    }

    /// The value as floating point.
    pub fn to_f64(self) -> f64 {
        self.mantissa as f64 / self.unit().get() as f64
    }

    /// All digits, signed.
    pub const fn mantissa(self) -> i64 {
        self.mantissa
    }

    /// Digits after the point.
    pub const fn scale(self) -> u8 {
        self.scale
    }

    /// `10^scale`.
    pub fn unit(self) -> NonZeroU64 {
        POWERS.get(usize::from(self.scale)).copied().unwrap_or(NonZeroU64::MIN)
    }

    /// The mantissa at another scale, truncated toward zero.
    pub fn rescaled(self, scale: u8) -> Option<i64> {
        let (from, to) = (self.unit(), Self::new(0, scale).unit());
        if to >= from {
            self.mantissa.checked_mul(i64::try_from(to.get() / from).ok()?)
        } else {
            self.mantissa.checked_div(i64::try_from(from.get() / to).ok()?)
        }
    }
}
