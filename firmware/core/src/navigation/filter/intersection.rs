//! A range to another vehicle, which may have used what this filter knows.
//!
//! Two vehicles that hear the same ship and each other err alike, and no packet says by how much. Covariance
//! intersection (S. J. Julier and J. K. Uhlmann, 1997) is consistent whatever their correlation: with any 0 < ω < 1,
//!
//! P := P / ω,   R = hₚ Pₚ hₚᵀ / (1 − ω) + σ_r²,
//!
//! and then an ordinary update. Pₚ is what the other vehicle states of its position; the noise of the range itself is
//! independent and is not divided (*split* covariance intersection, 2001). ω gives the least trace of the horizontal
//! position. All that the range does not see loses by it: one that gains little is not used.

use super::cekf::Filter;
use super::effects::Effects;
use crate::navigation::algebra::observer::{LinearStep, Observer, ScalarUpdate};
use crate::navigation::interface::measurement::{FusionOutcome, Fusions, Sensor};
use crate::state::{X, Y};

/// A range is used if it leaves no more of the position's variance.
const WORTH: f64 = 0.95;
/// Steps of the search for ω, each of which keeps two thirds of its bounds.
const STEPS: usize = 16;

impl Filter {
    /// Fuses the scalar that was observed.
    #[cold]
    #[inline(never)]
    pub(super) fn intersect(&mut self, address: u8, fusions: &mut Fusions, observer: &mut impl Observer) {
        let variance = self.project(0);
        let Some(observed) = self.observations.as_slice().first() else { return };
        let (innovation, noise, shared) = (observed.innovation, observed.variance, observed.shared);
        let own = variance - noise;
        let total = variance + shared;
        let before = self.p.get(X, X) + self.p.get(Y, Y);
        let moved = self.w.iter().skip(X).take(2).map(|w| w * w).sum::<f64>();
        let predicted = |omega: f64| own / omega + shared / (1.0 - omega) + noise;
        let trace = |omega: f64| (before - moved / (omega * predicted(omega))) / omega;
        let (mut least, mut most) = (0.5, 1.0);
        for _ in 0..STEPS {
            let third = (most - least) / 3.0;
            if trace(least + third) < trace(most - third) {
                most -= third;
            } else {
                least += third;
            }
        }
        let omega = 0.5 * (least + most);
        let outcome = if !self.peers.believes(address, innovation, total) {
            FusionOutcome::Gated
        } else if trace(omega) > WORTH * before {
            FusionOutcome::Redundant
        } else {
            self.p.scale(1.0 / omega);
            self.w.iter_mut().for_each(|w| *w /= omega);
            self.hear(Sensor::Peer);
            if self.fuse_scalar(innovation, predicted(omega)) { FusionOutcome::Fused } else { FusionOutcome::Invalid }
        };
        fusions.push(self.record(Sensor::Peer, 0, innovation, total, outcome));
        if outcome == FusionOutcome::Fused {
            Effects::bound(&self.config, &mut self.x);
            if let Some(observed) = self.observations.as_slice().first() {
                let gain = self.gain.get(..self.dimension()).unwrap_or_default();
                let row = &observed.row;
                observer.observe(&LinearStep::Update(ScalarUpdate { row, gain, innovation, variance: total }));
            }
        }
    }
}
