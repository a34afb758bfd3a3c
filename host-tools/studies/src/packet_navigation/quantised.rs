//! A delta in fewer bits than its eighteen numbers have as floats.
//!
//! Λ and η as they stand cannot be rounded far: Λ is nearly singular where the ship's model ties the two launches
//! together, so that a rounded one is no longer positive, and an error of η is one of the ship's position divided by
//! Λ. The same Gaussian in other numbers ([`Conditional`]) can: what the interval says of the ship at its start, and
//! where the ship is at its end *given* that start,
//!
//!   s₀ ~ (m₀, Λ₀),   s₁ = m₁ + F (s₀ − m₀) + w,   w ~ (0, Q).
//!
//! Both parts stay positive whatever their numbers are rounded to, a mean that is rounded is off by the rounding and no
//! more, and an interval without a fix is exact: Λ₀ = 0, and F and Q are the ship's model. Means are sent as
//! differences from what the vehicle has already, the end of the interval before: no packet says how far the ship is
//! from the origin but the first.

use super::information::{Information, NotPositive, cholesky, symmetric};
use super::ship::{Delta, STATES};
use nalgebra::{Matrix2, SMatrix};

/// Bytes of a packet beside the delta: kind and source, sequence, second of launch (16 bits), sequence of the packet it
/// continues from, transducer's depth, CRC (16 bits).
pub const HEADER: usize = 8;
/// Longest delta, bytes.
const LONGEST: usize = 64;
/// Largest size of an entry of F, with times in units of the interval.
const F_LIMIT: f64 = 4.0;
/// Standard deviations between which Q lies: m and m/s.
const Q_RANGE: [[f64; 2]; 2] = [[5.0e-3, 500.0], [5.0e-4, 50.0]];
/// Roots of information between which Λ₀ lies, or none: 1/m and s/m.
const INFORMATION_RANGE: [[f64; 2]; 2] = [[1.0e-3, 100.0], [1.0e-3, 1000.0]];
/// An information matrix with less than this share in a direction knows nothing there.
const NOTHING: f64 = 1.0e-9;

/// Position and velocity of both axes: rows p and v, columns north and east.
type Mean = Matrix2<f64>;

/// A delta as two conditional parts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Conditional {
    start: Mean,
    information: Matrix2<f64>,
    end: Mean,
    f: Matrix2<f64>,
    q: Matrix2<f64>,
}

impl Conditional {
    /// Where nothing is known of the start, it is taken to be at `datum`.
    fn of(delta: &Delta, datum: &Mean) -> Result<Self, NotPositive> {
        let Information { lambda, eta } = &delta.information;
        let block = |i: usize, j: usize| lambda.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
        let (eta0, eta1) = (eta.fixed_rows::<2>(0).into_owned(), eta.fixed_rows::<2>(2).into_owned());
        let factor = cholesky(block(1, 1))?;
        let f = -factor.solve(&block(1, 0));
        let information = symmetric(block(0, 0) + block(0, 1) * f);
        let of_start = eta0 - block(0, 1) * factor.solve(&eta1);
        // Only along what the interval knows: elsewhere the difference of two large numbers is left.
        let scale = lambda.fixed_view::<2, 2>(0, 0).diagonal().map(|l| if l > 0.0 { l.sqrt() } else { 1.0 });
        let scaled = Matrix2::from_fn(|i, j| information[(i, j)] / (scale[i] * scale[j]));
        let eigen = scaled.symmetric_eigen();
        let mut inverse = Matrix2::zeros();
        let mut known = Matrix2::zeros();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > NOTHING {
                inverse += vector * vector.transpose() / *value;
                known += vector * vector.transpose() * *value;
            }
        }
        let unscaled =
            |m: Matrix2<f64>, by: fn(f64, f64) -> f64| Matrix2::from_fn(|i, j| by(by(m[(i, j)], scale[i]), scale[j]));
        let (inverse, information) = (unscaled(inverse, |m, s| m / s), unscaled(known, |m, s| m * s));
        let start = datum + inverse * (of_start - information * datum);
        Ok(Self { start, information, end: factor.solve(&eta1) + f * start, f, q: factor.inverse() })
    }

    fn information(&self) -> Result<Information<STATES, 2>, NotPositive> {
        let precision = cholesky(self.q)?.inverse();
        let mut lambda = SMatrix::<f64, STATES, STATES>::zeros();
        lambda.fixed_view_mut::<2, 2>(2, 2).copy_from(&precision);
        lambda.fixed_view_mut::<2, 2>(2, 0).copy_from(&(-precision * self.f));
        lambda.fixed_view_mut::<2, 2>(0, 2).copy_from(&(-self.f.transpose() * precision));
        lambda.fixed_view_mut::<2, 2>(0, 0).copy_from(&(self.information + self.f.transpose() * precision * self.f));
        let mut eta = SMatrix::<f64, STATES, 2>::zeros();
        let offset = precision * (self.end - self.f * self.start);
        eta.fixed_rows_mut::<2>(2).copy_from(&offset);
        eta.fixed_rows_mut::<2>(0).copy_from(&(self.information * self.start - self.f.transpose() * offset));
        Ok(Information { lambda: symmetric(lambda), eta })
    }
}

/// Bits of each kind of number, and the steps of the means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Of a position.
    pub position_bits: u32,
    /// Of a velocity.
    pub velocity_bits: u32,
    /// Of an entry of F, and of a correlation.
    pub share_bits: u32,
    /// Of a standard deviation and a root of information, by their logarithm.
    pub sigma_bits: u32,
    /// Step of a position, m.
    pub position_step_m: f64,
    /// Step of a velocity, m/s.
    pub velocity_step_mps: f64,
}

impl Layout {
    /// 23 bytes: with the header one FSK frame of 32.
    pub const FINE: Self = Self {
        position_bits: 15,
        velocity_bits: 11,
        share_bits: 8,
        sigma_bits: 8,
        position_step_m: 0.01,
        velocity_step_mps: 0.005,
    };
    /// 18 bytes: with header and authentication code (4 bytes) one frame.
    pub const COARSE: Self = Self {
        position_bits: 12,
        velocity_bits: 8,
        share_bits: 6,
        sigma_bits: 6,
        position_step_m: 0.08,
        velocity_step_mps: 0.04,
    };
    /// 13 bytes.
    pub const COARSEST: Self = Self {
        position_bits: 10,
        velocity_bits: 6,
        share_bits: 4,
        sigma_bits: 4,
        position_step_m: 0.32,
        velocity_step_mps: 0.16,
    };
    /// 54 bytes: with the header two frames.
    pub const TWO_FRAMES: Self = Self {
        position_bits: 24,
        velocity_bits: 24,
        share_bits: 24,
        sigma_bits: 24,
        position_step_m: 1.0e-4,
        velocity_step_mps: 1.0e-5,
    };

    /// Bytes of a delta.
    #[must_use]
    pub const fn bytes(&self) -> usize {
        let bits = 4 * (self.position_bits + self.velocity_bits) + 6 * self.share_bits + 4 * self.sigma_bits;
        bits.div_ceil(8) as usize
    }

    /// The deltas as the vehicle decodes them, one after the other: each continues from the one before.
    ///
    /// # Errors
    /// A delta that is not positive, or a difference that does not fit its bits.
    pub fn carry(&self, deltas: &[Delta]) -> Result<Vec<Delta>, Unsendable> {
        let mut datum = None;
        let mut received = Vec::with_capacity(deltas.len());
        for delta in deltas {
            let mut bytes = [0; LONGEST];
            self.encode(delta, datum, &mut Bits { bytes: &mut bytes, at: 0 })?;
            let (decoded, end) = self.decode(delta, datum, &mut Bits { bytes: &mut bytes, at: 0 })?;
            datum = Some(end);
            received.push(decoded);
        }
        Ok(received)
    }

    fn encode(&self, delta: &Delta, datum: Option<Mean>, bits: &mut Bits<'_>) -> Result<(), Unsendable> {
        let from = datum.unwrap_or_default();
        let conditional = Conditional::of(delta, &from)?;
        let Conditional { start, information, end, f, q } = conditional;
        let h = interval_s(delta);
        // The first has no start: its bits are the end's.
        match datum {
            Some(from) => {
                self.put_mean(bits, &(start - from), 1)?;
                let start = from + self.rounded(&(start - from));
                let end = end + f * (start - conditional.start);
                self.put_mean(bits, &(end - transition(h) * start), 1)?;
            }
            None => self.put_mean(bits, &end, 2)?,
        }
        for (entry, unit) in f.iter().zip(f_units(h)) {
            self.put_share(bits, entry * unit / F_LIMIT)?;
        }
        let [position, velocity] = [q[(0, 0)].sqrt(), q[(1, 1)].sqrt()];
        self.put_log(bits, position, Q_RANGE[0], false);
        self.put_log(bits, velocity, Q_RANGE[1], false);
        self.put_share(bits, q[(0, 1)] / (position * velocity))?;
        let [position, velocity] = [information[(0, 0)].sqrt(), information[(1, 1)].sqrt()];
        self.put_log(bits, position, INFORMATION_RANGE[0], true);
        self.put_log(bits, velocity, INFORMATION_RANGE[1], true);
        let both = position * velocity;
        self.put_share(bits, if both > 0.0 { information[(0, 1)] / both } else { 0.0 })
    }

    /// The delta, and the ship's mean at its end.
    fn decode(&self, sent: &Delta, datum: Option<Mean>, bits: &mut Bits<'_>) -> Result<(Delta, Mean), Unsendable> {
        let h = interval_s(sent);
        let (start, end) = match datum {
            Some(from) => {
                let start = from + self.take_mean(bits, 1);
                (start, transition(h) * start + self.take_mean(bits, 1))
            }
            None => (Mean::zeros(), self.take_mean(bits, 2)),
        };
        let mut f = Matrix2::zeros();
        for (entry, unit) in f.iter_mut().zip(f_units(h)) {
            *entry = self.take_share(bits) * F_LIMIT / unit;
        }
        let [position, velocity] = Q_RANGE.map(|range| self.take_log(bits, range, false));
        // Q needs an inverse.
        let most = 1.0 - 0.5 / self.share_steps();
        let both = position * velocity * self.take_share(bits).clamp(-most, most);
        let q = Matrix2::new(position * position, both, both, velocity * velocity);
        let [position, velocity] = INFORMATION_RANGE.map(|range| self.take_log(bits, range, true));
        let both = position * velocity * self.take_share(bits);
        let information = Matrix2::new(position * position, both, both, velocity * velocity);
        let decoded = Conditional { start, information, end, f, q };
        Ok((Delta { information: decoded.information()?, ..*sent }, end))
    }

    fn put_mean(&self, bits: &mut Bits<'_>, mean: &Mean, width: u32) -> Result<(), Unsendable> {
        for (row, (count, step)) in self.mean_fields().into_iter().enumerate() {
            for column in 0..2 {
                bits.put(rounded(mean[(row, column)], step), width * count)?;
            }
        }
        Ok(())
    }

    fn take_mean(&self, bits: &mut Bits<'_>, width: u32) -> Mean {
        let mut mean = Mean::zeros();
        for (row, (count, step)) in self.mean_fields().into_iter().enumerate() {
            for column in 0..2 {
                mean[(row, column)] = bits.take(width * count) as f64 * step;
            }
        }
        mean
    }

    fn rounded(&self, mean: &Mean) -> Mean {
        let steps = self.mean_fields();
        Mean::from_fn(|row, column| rounded(mean[(row, column)], steps[row].1) as f64 * steps[row].1)
    }

    fn mean_fields(&self) -> [(u32, f64); 2] {
        [(self.position_bits, self.position_step_m), (self.velocity_bits, self.velocity_step_mps)]
    }

    fn share_steps(&self) -> f64 {
        f64::from((1_i32 << (self.share_bits - 1)) - 1)
    }

    /// A number within ±1, whose ends are exact.
    fn put_share(&self, bits: &mut Bits<'_>, share: f64) -> Result<(), Unsendable> {
        bits.put((share * self.share_steps()).round() as i64, self.share_bits)
    }

    fn take_share(&self, bits: &mut Bits<'_>) -> f64 {
        bits.take(self.share_bits) as f64 / self.share_steps()
    }

    /// A positive number by its logarithm, cut to its range; `with_zero` keeps the lowest code for nothing.
    fn put_log(&self, bits: &mut Bits<'_>, value: f64, [low, high]: [f64; 2], with_zero: bool) {
        let lowest = -(1_i64 << (self.sigma_bits - 1));
        let steps = ((1_i64 << self.sigma_bits) - 1 - i64::from(with_zero)) as f64;
        let code = if with_zero && value < low {
            lowest
        } else {
            let share = (value.clamp(low, high) / low).ln() / (high / low).ln();
            lowest + i64::from(with_zero) + (share * steps).round() as i64
        };
        // within the bits by construction
        let _ = bits.put(code, self.sigma_bits);
    }

    fn take_log(&self, bits: &mut Bits<'_>, [low, high]: [f64; 2], with_zero: bool) -> f64 {
        let steps = ((1_i64 << self.sigma_bits) - 1 - i64::from(with_zero)) as f64;
        let code = bits.take(self.sigma_bits) + (1_i64 << (self.sigma_bits - 1));
        match (with_zero, code) {
            (true, 0) => 0.0,
            _ => low * ((code - i64::from(with_zero)) as f64 / steps * (high / low).ln()).exp(),
        }
    }
}

/// Why a delta cannot be sent in a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unsendable {
    /// It is no Gaussian.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
    /// A number is too large.
    #[error("a number of a delta does not fit its bits")]
    TooLarge,
}

/// From origin to launch; of the first, which has no origin, one second.
fn interval_s(delta: &Delta) -> f64 {
    delta.origin_us.map_or(1.0, |origin_us| (delta.launch_us - origin_us) as f64 * 1e-6)
}

fn transition(h: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, h, 0.0, 1.0)
}

/// What makes F's entries, column by column, numbers without unit.
fn f_units(h: f64) -> [f64; 4] {
    [1.0, h, 1.0 / h, 1.0]
}

fn rounded(value: f64, step: f64) -> i64 {
    (value / step).round() as i64
}

/// Signed numbers of a few bits each, in a row.
struct Bits<'a> {
    bytes: &'a mut [u8; LONGEST],
    at: u32,
}

impl Bits<'_> {
    fn put(&mut self, value: i64, count: u32) -> Result<(), Unsendable> {
        let limit = 1_i64 << (count - 1);
        if !(-limit..limit).contains(&value) {
            return Err(Unsendable::TooLarge);
        }
        for bit in 0..count {
            self.bytes[(self.at / 8) as usize] |= ((value >> bit & 1) as u8) << (self.at % 8);
            self.at += 1;
        }
        Ok(())
    }

    fn take(&mut self, count: u32) -> i64 {
        let mut value = 0;
        for bit in 0..count {
            value |= i64::from(self.bytes[(self.at / 8) as usize] >> (self.at % 8) & 1) << bit;
            self.at += 1;
        }
        // the last bit is the sign
        value << (64 - count) >> (64 - count)
    }
}

/// The eighteen numbers as floats with eight bits of exponent and this many bits in all.
#[must_use]
pub fn short_floats(delta: &Delta, bits: u32) -> Delta {
    let cut = 32 - bits;
    let round = |number: f64| {
        let whole = (number as f32).to_bits();
        f64::from(f32::from_bits((whole + (1 << cut >> 1)) >> cut << cut))
    };
    let Information { lambda, eta } = &delta.information;
    Delta { information: Information { lambda: lambda.map(round), eta: eta.map(round) }, ..*delta }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet_navigation::ship::ShipInformation;
    use backseat_core::navigation::{InitialShip, NavigationConfig};

    /// Launches every 30 s, fixes every `fix_s` from the first on, of a ship that goes straight.
    fn deltas(fix_s: u64) -> Vec<Delta> {
        let config = NavigationConfig::REFERENCE;
        let at = |t: u64| [1200.0 + 1.5 * t as f64, -300.0 - 0.7 * t as f64];
        let mut ship = ShipInformation::new(0, &InitialShip::from_fix(at(0), &config), &config);
        let mut deltas = Vec::new();
        for t in 1..=240 {
            if t % fix_s == 0 {
                ship.fix(t * 1_000_000, at(t)).unwrap();
            }
            if t % 30 == 0 {
                deltas.push(ship.launch(t * 1_000_000).unwrap());
                ship.acknowledged();
            }
        }
        deltas
    }

    /// With enough bits the same Gaussian, whether the interval has thirty fixes, one or none.
    #[test]
    fn val_many_bits_change_nothing() {
        for fix_s in [1, 7, 50] {
            let exact = deltas(fix_s);
            let received = Layout::TWO_FRAMES.carry(&exact).unwrap();
            for (exact, received) in exact.iter().zip(&received) {
                let (a, b) = (&exact.information, &received.information);
                // Steps of 0.1 mm and 1e-6 of a share, against what the two launches tie together to some 0.1 m.
                assert!((a.lambda - b.lambda).amax() < 1e-4 * a.lambda.amax(), "{fix_s}: {} {}", a.lambda, b.lambda);
            }
        }
    }

    #[test]
    fn lengths_are_those_of_the_page() {
        let bytes = [Layout::TWO_FRAMES, Layout::FINE, Layout::COARSE, Layout::COARSEST].map(|layout| layout.bytes());
        assert_eq!(bytes, [54, 23, 18, 13]);
        assert!(Layout::FINE.bytes() + HEADER <= 32 && Layout::COARSE.bytes() + HEADER + 4 <= 32);
    }

    /// 30 m off within a second is nothing that a position of ±20 m can say.
    #[test]
    fn what_does_not_fit_is_refused() {
        let mut far = deltas(1);
        far.truncate(2);
        let narrow = Layout { position_bits: 6, ..Layout::COARSEST };
        assert_eq!(narrow.carry(&far), Err(Unsendable::TooLarge));
    }

    #[test]
    fn val_bits_come_back() {
        let mut bytes = [0; LONGEST];
        let mut bits = Bits { bytes: &mut bytes, at: 0 };
        for (value, count) in [(-1, 4), (7, 4), (-8, 4), (1000, 15), (-16384, 15)] {
            bits.put(value, count).unwrap();
        }
        assert_eq!(bits.put(8, 4), Err(Unsendable::TooLarge));
        bits.at = 0;
        assert_eq!([4, 4, 4, 15, 15].map(|count| bits.take(count)), [-1, 7, -8, 1000, -16384]);
    }
}
