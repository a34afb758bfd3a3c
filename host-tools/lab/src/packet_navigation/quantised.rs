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
//! more, and an interval without a fix stays one: Λ₀ = 0, and F is the ship's model. Means are sent as
//! differences from what the vehicle has already, the end of the interval before: no packet says how far the ship is
//! from the origin but the first.

use super::bits::{Bits, LONGEST};
use super::information::{Information, NotPositive, cholesky, root, symmetric};
use super::ship::{Delta, STATES};
use nalgebra::{Matrix2, SMatrix};

/// Bytes of a packet beside the delta: kind and source, sequence, second of launch (16 bits), sequence of the packet it
/// continues from, transducer's depth, CRC (16 bits).
pub const HEADER: usize = 8;
/// Largest velocity at the end by a position at the start, 1/s. A fix some time after the start gives the velocity since
/// then by its distance from the start, so that F holds one over that time; how short it can be is a matter of the
/// fixes' noise. With the ship's filter as it stands (fixes of 0.5 m, at most one a second, 0.02 m/s² per √Hz) F reaches
/// 0.113.
const GAIN_LIMIT_PER_S: f64 = 0.125;
/// Standard deviations between which Q lies: m and m/s.
const Q_RANGE: [[f64; 2]; 2] = [[5.0e-3, 500.0], [5.0e-4, 50.0]];
/// Roots of information between which Λ₀ lies, or none: 1/m and s/m.
const INFORMATION_RANGE: [[f64; 2]; 2] = [[1.0e-3, 100.0], [1.0e-3, 1000.0]];
/// An interval that adds less than this share to what is known of its start in a direction says nothing there.
const NOTHING: f64 = 1.0e-9;

/// Position and velocity of both axes: rows p and v, columns north and east.
type Mean = Matrix2<f64>;

/// What the packets so far say of the ship, of each axis.
#[derive(Clone, Copy)]
struct Known {
    mean: Mean,
    covariance: Matrix2<f64>,
}

/// Before the first packet, which says everything itself.
const NOT_KNOWN: Known = Known { mean: Mean::new(0.0, 0.0, 0.0, 0.0), covariance: Matrix2::new(1.0, 0.0, 0.0, 1.0) };

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
    /// Along what the interval knows nothing of, its start is free. It is taken where `before` has it then, by the
    /// correlation of position and velocity: any other place would be a worse one for the next packet to continue from.
    fn of(delta: &Delta, before: &Known) -> Result<Self, NotPositive> {
        let Information { lambda, eta } = &delta.information;
        let block = |i: usize, j: usize| lambda.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
        let (eta0, eta1) = (eta.fixed_rows::<2>(0).into_owned(), eta.fixed_rows::<2>(2).into_owned());
        let factor = cholesky(block(1, 1))?;
        let f = -factor.solve(&block(1, 0));
        let information = symmetric(block(0, 0) + block(0, 1) * f);
        let missing = eta0 - block(0, 1) * factor.solve(&eta1) - information * before.mean;
        // Only along what the interval knows: elsewhere the difference of two large numbers is left.
        let root = root(before.covariance)?;
        let eigen = symmetric(root.tr_mul(&(information * root))).symmetric_eigen();
        let (mut shift, mut known) = (Mean::zeros(), Matrix2::zeros());
        let whitener = root.try_inverse().ok_or(NotPositive)?;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > NOTHING {
                let (along, of) = (root * vector, whitener.tr_mul(&vector));
                shift += along * along.tr_mul(&missing) / *value;
                known += of * of.transpose() * *value;
            }
        }
        let start = before.mean + shift;
        Ok(Self { start, information: known, end: factor.solve(&eta1) + f * start, f, q: factor.inverse() })
    }

    /// Covariance at the end, by that at the start before the interval.
    fn covariance(&self, before: Matrix2<f64>) -> Result<Matrix2<f64>, NotPositive> {
        let start = cholesky(cholesky(before)?.inverse() + self.information)?.inverse();
        Ok(symmetric(self.f * start * self.f.transpose() + self.q))
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
        // The ship keeps it to choose what it sends; the vehicle needs the mean alone.
        let mut before = NOT_KNOWN;
        let mut datum = None;
        let mut received = Vec::with_capacity(deltas.len());
        for delta in deltas {
            let mut bytes = [0; LONGEST];
            let conditional = Conditional::of(delta, &before)?;
            self.encode(&conditional, interval_s(delta), datum, &mut Bits { bytes: &mut bytes, at: 0 })?;
            let (decoded, end) = self.decode(delta, datum, &mut Bits { bytes: &mut bytes, at: 0 })?;
            before = Known { mean: end, covariance: conditional.covariance(before.covariance)? };
            datum = Some(end);
            received.push(decoded);
        }
        Ok(received)
    }

    fn encode(
        &self,
        conditional: &Conditional,
        h: f64,
        datum: Option<Mean>,
        bits: &mut Bits<'_>,
    ) -> Result<(), Unsendable> {
        let Conditional { start, information, end, f, q } = *conditional;
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
        for (entry, (origin, limit)) in f.iter().zip(f_ranges(h)) {
            self.put_share(bits, (entry - origin) / limit, "transition")?;
        }
        let [position, velocity] = [q[(0, 0)].sqrt(), q[(1, 1)].sqrt()];
        self.put_log(bits, position, Q_RANGE[0], false);
        self.put_log(bits, velocity, Q_RANGE[1], false);
        self.put_share(bits, q[(0, 1)] / (position * velocity), "correlation of the motion")?;
        let [position, velocity] = [information[(0, 0)].sqrt(), information[(1, 1)].sqrt()];
        self.put_log(bits, position, INFORMATION_RANGE[0], true);
        self.put_log(bits, velocity, INFORMATION_RANGE[1], true);
        let both = position * velocity;
        let correlation = if both > 0.0 { information[(0, 1)] / both } else { 0.0 };
        self.put_share(bits, correlation, "correlation of the fixes")
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
        for (entry, (origin, limit)) in f.iter_mut().zip(f_ranges(h)) {
            *entry = origin + self.take_share(bits) * limit;
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
                let name = ["position", "velocity"][row];
                bits.put(rounded(mean[(row, column)], step), width * count).ok_or(Unsendable::TooLarge(name))?;
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
    fn put_share(&self, bits: &mut Bits<'_>, share: f64, name: &'static str) -> Result<(), Unsendable> {
        bits.put((share * self.share_steps()).round() as i64, self.share_bits).ok_or(Unsendable::TooLarge(name))
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
    #[error("the {0} in a delta does not fit its bits")]
    TooLarge(&'static str),
}

/// From origin to launch; of the first, which has no origin, one second.
fn interval_s(delta: &Delta) -> f64 {
    delta.origin_us.map_or(1.0, |origin_us| (delta.launch_us - origin_us) as f64 * 1e-6)
}

fn transition(h: f64) -> Matrix2<f64> {
    Matrix2::new(1.0, h, 0.0, 1.0)
}

/// Origin and largest distance from it of F's entries, column by column. Without a fix they are 1, 0, h and 1, and exact.
fn f_ranges(h: f64) -> [(f64, f64); 4] {
    [(1.0, 1.0 + GAIN_LIMIT_PER_S * h), (0.0, GAIN_LIMIT_PER_S), (0.0, h), (0.0, 1.0)]
}

fn rounded(value: f64, step: f64) -> i64 {
    (value / step).round() as i64
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
        received(|t| t % fix_s == 0, |_| true)
    }

    /// Eight minutes of launches every 30 s, of which some are received, with fixes at some seconds.
    fn received(has_fix: impl Fn(u64) -> bool, is_received: impl Fn(u64) -> bool) -> Vec<Delta> {
        let config = NavigationConfig::REFERENCE;
        let at = |t: u64| [1200.0 + 1.5 * t as f64, -300.0 - 0.7 * t as f64];
        let mut ship = ShipInformation::new(0, &InitialShip::from_fix(at(0), &config), &config);
        let mut deltas = Vec::new();
        for t in 1..=480 {
            if has_fix(t) {
                ship.fix(t * 1_000_000, at(t)).unwrap();
            }
            if t % 30 == 0 {
                let delta = ship.launch(t * 1_000_000).unwrap();
                if is_received(t / 30) {
                    ship.acknowledged();
                    deltas.push(delta);
                }
            }
        }
        deltas
    }

    const ALL: [Layout; 4] = [Layout::TWO_FRAMES, Layout::FINE, Layout::COARSE, Layout::COARSEST];

    /// A fix a quarter of a minute into an interval of 90 s says how fast the ship went since the start, and that for the
    /// rest of the interval: F holds −4.1 in units of the interval, which a limit of 4 refused.
    #[test]
    fn val_after_lost_packets_every_layout_carries_the_delta() {
        for (lost, phase_s) in (1..=6).flat_map(|lost| (0..60).map(move |phase_s| (lost, phase_s))) {
            let exact = received(|t| t % 60 == phase_s, |packet| packet % (lost + 1) == 1);
            let carried = ALL.map(|layout| layout.carry(&exact).map_err(|error| format!("{lost} {phase_s} {error}")));
            for received in carried {
                assert_eq!(received.unwrap().len(), exact.len());
            }
        }
    }

    /// Fixes of a second or any multiple, begun at any time and ended by an outage, and every interval to ten minutes.
    #[test]
    fn val_no_pattern_of_fixes_exceeds_the_range_of_a_transition() {
        let mut largest = [0.0_f64; 4];
        for (every, first, last) in (1..=20_u64).flat_map(|every| {
            (0..every).step_by(3).flat_map(move |first| (first..240).step_by(5).map(move |last| (every, first, last)))
        }) {
            let has_fix = |t: u64| t > 30 && (t - 30) % every == first && t - 30 <= last;
            for delta in received(has_fix, |packet| packet == 1 || packet == 16) {
                let Some(origin_us) = delta.origin_us else { continue };
                let f = Conditional::of(&delta, &NOT_KNOWN).unwrap().f;
                let ranges = f_ranges((delta.launch_us - origin_us) as f64 * 1e-6);
                for (largest, (entry, (origin, limit))) in largest.iter_mut().zip(f.iter().zip(ranges)) {
                    *largest = largest.max((entry - origin).abs() / limit);
                }
            }
        }
        // The range is used, and not exceeded but by rounding.
        assert!(largest.iter().all(|share| (0.5..1.0 + 1e-6).contains(share)), "{largest:?}");
    }

    #[test]
    fn val_an_interval_without_a_fix_keeps_the_ship_s_own_transition() {
        for layout in ALL {
            let exact = received(|t| t < 30, |_| true);
            for delta in layout.carry(&exact).unwrap().iter().skip(1) {
                let f = Conditional::of(delta, &NOT_KNOWN).unwrap().f;
                assert!((f - transition(30.0)).amax() < 1e-9, "{f}");
            }
        }
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
        let bytes = ALL.map(|layout| layout.bytes());
        assert_eq!(bytes, [54, 23, 18, 13]);
        assert!(Layout::FINE.bytes() + HEADER <= 32 && Layout::COARSE.bytes() + HEADER + 4 <= 32);
    }

    /// 30 m off within a second is nothing that a position of ±20 m can say.
    #[test]
    fn what_does_not_fit_is_refused() {
        let mut far = deltas(1);
        far.truncate(2);
        let narrow = Layout { position_bits: 6, ..Layout::COARSEST };
        assert_eq!(narrow.carry(&far), Err(Unsendable::TooLarge("position")));
    }
}
