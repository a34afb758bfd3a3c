//! One account of the horizontal position: what one entry of the table allows.
//!
//! A linear filter of few states beside the vehicle's, which shares nothing with it but the velocity through the water:
//!
//! ṗ = (1 + s) v + h v⊥ + c, with every other state a Gauss-Markov process.
//!
//! A measurement far beyond its variance counts as one of three sigmas (Huber), and each opens position and current, so
//! that a reflected path moves little and a lasting contradiction moves the account in the end.

use core::ops::Range;

/// Evidence is forgotten with this time constant, s: an entry may begin at any time, and this is half of a ship's circle.
pub(super) const EVIDENCE_S: f64 = 1800.0;
/// Position, m.
pub(super) const POSITION: Range<usize> = 0..2;
/// Current, m/s.
pub(super) const CURRENT: Range<usize> = 2..4;
/// s: speed through the water, true / filter's − 1.
pub(super) const SPEED: Range<usize> = 4..5;
/// h: course, true minus measured, rad.
pub(super) const COURSE: Range<usize> = 5..6;
/// Reported minus true place of the ship, m.
pub(super) const SHIP: Range<usize> = 6..8;
/// Fixes minus true place of the vehicle, m.
pub(super) const FIX: Range<usize> = 8..10;
/// Range, measured minus true, m.
pub(super) const BIAS: Range<usize> = 10..11;
/// The same, over range.
pub(super) const SCALE: Range<usize> = 11..12;
/// DVL velocity, measured / true − 1.
pub(super) const DVL_SCALE: Range<usize> = 12..13;
/// Yaw of the DVL in its mount, rad.
pub(super) const DVL_YAW: Range<usize> = 13..14;
/// All of them.
pub(super) const STATES: usize = 14;

/// √PSD of the position's noise, m/√s: what a dynamic model misses within a turn and a wave, 2 cm/s for 2 s.
const POSITION_NOISE: f64 = 0.03;
/// Squared: so many sigmas are beyond everything, 1e-15 of a normal number.
const EXPLAINED: f64 = 64.0;
/// Squared: a measurement counts with so many sigmas at most ...
const HUBER: f64 = 9.0;
/// ... and beyond so many, squared, what an entry allows is open again ...
const REOPENS: f64 = 12.0;
/// ... with what position and current have taken for theirs before it was noticed: 0.1 m/s ...
const OPENED_MPS: f64 = 0.1;
/// ... for 200 s, m.
const OPENED_M: f64 = 20.0;

/// Change of depth after which the water is another, m: thermoclines and shear layers of shelf seas are thinner than
/// ten metres.
const CURRENT_DEPTH_M: f64 = 5.0;

/// A process that an account does not know: zero mean, this standard deviation, forgotten after this time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nuisance {
    /// Which states of an account.
    pub states: (usize, usize),
    /// One sigma, in the state's unit.
    pub sigma: f64,
    /// Time constant, s.
    pub memory_s: f64,
}

/// Sigma and memory of each state; 0 of those that are known.
#[derive(Clone, Copy)]
pub(super) struct Priors {
    variance: [f64; STATES],
    memory_s: [f64; STATES],
    /// It is what the entry is about.
    open: [bool; STATES],
}

impl Priors {
    pub(super) const NONE: Self =
        Self { variance: [0.0; STATES], memory_s: [f64::INFINITY; STATES], open: [false; STATES] };

    pub(super) fn set(&mut self, nuisance: &Nuisance, open: bool) {
        let (from, to) = nuisance.states;
        let states = self.variance.iter_mut().zip(&mut self.memory_s).zip(&mut self.open).enumerate();
        for (_, ((variance, memory_s), is_open)) in states.filter(|(i, _)| (from..to).contains(i)) {
            *variance = variance.max(nuisance.sigma * nuisance.sigma);
            (*memory_s, *is_open) = (nuisance.memory_s, open);
        }
    }
}

/// How the vehicle has moved through the water.
#[derive(Clone, Copy)]
pub(super) struct Motion {
    /// For so long, s.
    pub(super) step_s: f64,
    /// North and east, m.
    pub(super) through_water_m: [f64; 2],
    /// Change of depth, m.
    pub(super) depth_m: f64,
}

/// Scalar measurement: what it depends on, innovation, variance of its noise.
#[derive(Clone, Copy)]
pub(super) struct Scalar {
    pub(super) row: [f64; STATES],
    pub(super) innovation: f64,
    pub(super) variance: f64,
}

/// The account.
#[derive(Clone)]
pub(super) struct Account {
    pub(super) x: [f64; STATES],
    p: [[f64; STATES]; STATES],
    /// ln of the likelihood of what it has predicted of late.
    pub(super) evidence: f64,
}

impl Account {
    pub(super) const NEW: Self = Self { x: [0.0; STATES], p: [[0.0; STATES]; STATES], evidence: 0.0 };

    /// Starts at a place that is known but for a fix's error.
    pub(super) fn start(&mut self, position_m: [f64; 2], sigma_m: f64, priors: &Priors) {
        *self = Self::NEW;
        for i in 0..STATES {
            self.p[i][i] = priors.variance[i];
        }
        for i in POSITION {
            let offset = FIX.start + i;
            self.x[i] = position_m[i];
            // position = fix − offset
            self.p[i][i] = sigma_m * sigma_m + priors.variance[offset];
            self.p[i][offset] = -priors.variance[offset];
            self.p[offset][i] = -priors.variance[offset];
        }
    }

    /// The ship's place is known less well, by this variance.
    pub(super) fn widen_ship(&mut self, variance: f64) {
        SHIP.for_each(|i| self.p[i][i] += variance);
    }

    pub(super) fn predict(&mut self, motion: &Motion, priors: &Priors) {
        let &Motion { step_s: t, through_water_m: [n, e], depth_m } = motion;
        let x = &mut self.x;
        x[0] += n + t * x[2] + n * x[4] - e * x[5];
        x[1] += e + t * x[3] + e * x[4] + n * x[5];
        let p = &mut self.p;
        for j in 0..STATES {
            p[0][j] += t * p[2][j] + n * p[4][j] - e * p[5][j];
            p[1][j] += t * p[3][j] + e * p[4][j] + n * p[5][j];
        }
        for row in p.iter_mut() {
            row[0] += t * row[2] + n * row[4] - e * row[5];
            row[1] += t * row[3] + e * row[4] + n * row[5];
        }
        let mut kept = [1.0; STATES];
        for i in 0..STATES {
            let depths = if CURRENT.contains(&i) { depth_m.abs() / CURRENT_DEPTH_M } else { 0.0 };
            kept[i] = libm::exp(-t / priors.memory_s[i] - depths);
        }
        for i in 0..STATES {
            x[i] *= kept[i];
            for j in 0..STATES {
                p[i][j] *= kept[i] * kept[j];
            }
            p[i][i] += priors.variance[i] * (1.0 - kept[i] * kept[i]);
        }
        for i in POSITION {
            p[i][i] += POSITION_NOISE * POSITION_NOISE * t;
        }
        self.evidence *= libm::exp(-t / EVIDENCE_S);
    }

    /// Whether a measurement is within what the account holds possible.
    pub(super) fn explains(&self, scalar: &Scalar) -> bool {
        let (_, predicted) = self.spread(&scalar.row);
        scalar.innovation * scalar.innovation <= EXPLAINED * (predicted + scalar.variance)
    }

    /// Corrects it; `priors` of an entry that a contradiction opens again. Returns ln of the likelihood, a measurement
    /// beyond three sigmas as one of three.
    pub(super) fn correct(&mut self, scalar: &Scalar, priors: &Priors) -> f64 {
        let &Scalar { row, innovation, variance } = scalar;
        let squared = innovation * innovation;
        let (mut by_state, mut predicted) = self.spread(&row);
        let total = predicted + variance;
        let likelihood = -0.5 * ((squared / total).min(HUBER) + libm::log(total));
        if squared > REOPENS * total {
            for i in 0..STATES {
                // what moves the vehicle has done so since the last measurement
                let moved = (CURRENT.start..COURSE.end).contains(&i);
                if priors.open[i] && (moved || row[i] != 0.0) {
                    self.p[i][i] = self.p[i][i].max(priors.variance[i]);
                }
            }
            POSITION.for_each(|i| self.p[i][i] += OPENED_M * OPENED_M);
            CURRENT.for_each(|i| self.p[i][i] += OPENED_MPS * OPENED_MPS);
            (by_state, predicted) = self.spread(&row);
        }
        // one of three sigmas at most
        let total = (predicted + variance).max(squared / HUBER);
        for i in 0..STATES {
            let gain = by_state[i] / total;
            self.x[i] += gain * innovation;
            for j in 0..STATES {
                self.p[i][j] -= gain * by_state[j];
            }
        }
        likelihood
    }

    /// P hᵀ and h P hᵀ.
    fn spread(&self, row: &[f64; STATES]) -> ([f64; STATES], f64) {
        let mut by_state = [0.0; STATES];
        for (sum, of_state) in by_state.iter_mut().zip(&self.p) {
            *sum = of_state.iter().zip(row).map(|(p, h)| p * h).sum();
        }
        (by_state, by_state.iter().zip(row).map(|(p, h)| p * h).sum())
    }

    /// Variance of the position in a direction, m².
    pub(super) fn variance_along(&self, [n, e]: [f64; 2]) -> f64 {
        n * n * self.p[0][0] + 2.0 * n * e * self.p[0][1] + e * e * self.p[1][1]
    }

    /// Distance of a position from the account's, and its largest and smallest sigma in any direction, m.
    pub(super) fn apart(&self, position_m: [f64; 2]) -> (f64, [f64; 2]) {
        let [[xx, xy, ..], [_, yy, ..], ..] = &self.p;
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let half = libm::sqrt(half * half + xy * xy);
        let [north_m, east_m] = position_m;
        let apart_m = libm::hypot(north_m - self.x[0], east_m - self.x[1]);
        (apart_m, [mean + half, (mean - half).max(0.0)].map(libm::sqrt))
    }
}
