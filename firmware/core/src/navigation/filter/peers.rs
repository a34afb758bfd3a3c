//! A range to another vehicle, which states where it was and how well it knows that.
//!
//! The error of one statement is that of the next, but for what the other vehicle has learnt or forgotten in between.
//! Taken as independent, ten ranges to a vehicle that drifts would make a tenth of its variance out of one error. So
//! the error b of each vehicle's statement (stated less true, north and east) is a state of this filter, which considers it
//! from the first range that it uses, and the statements alone say how it changes: with covariances P⁻ before and P⁺
//! now, the vehicle has first forgotten G, the positive part of P⁺ − P⁻, and then learnt,
//!
//! b⁺ = A (b⁻ + g) + w,   A = P⁺ (P⁻ + G)⁻¹,   g ~ N(0, G),   w ~ N(0, P⁺ − A P⁺),
//!
//! because the error of an optimal filter is correlated with its earlier one by its present covariance. That is the
//! server and client of J. M. Walls and R. M. Eustice (2014), with the server's history read from the covariances that
//! it states in place of its origin states, for which a packet of 32 bytes has no room.
//!
//! It holds if the other vehicle knows nothing of this one. A vehicle that has used another one's range since its last
//! fix *leans*, and says so; its ranges are weighed, but not used. Information flows from those who know by themselves
//! to those who do not, and never in a circle. A fix ends it: from then on the position rests on the fix.

use super::cekf::Filter;
use super::effects::Effects;
use crate::navigation::algebra::layout::PEER_STATES;
use crate::navigation::algebra::observer::{LinearStep, Observer, ScalarUpdate};
use crate::navigation::interface::measurement::{FusionOutcome, FusionRecord, Fusions, PeerReport, Sensor};
use crate::navigation::sources::acoustic::stated;
use crate::state::{X, Y};
use nalgebra::{Matrix2, Vector2};

/// A range is used if it leaves no more of the position's variance: a vehicle that leans is of less use to others.
const WORTH: f64 = 0.95;

impl Filter {
    /// Before a packet of another vehicle is observed: the error of its statement becomes that of this packet.
    #[cold]
    #[inline(never)]
    pub(super) fn expect_peer(&mut self, peer: &PeerReport) {
        let now = stated(peer);
        if let Some((at, before)) = self.x.layout.peer(peer.address).zip(self.peers.stated(peer.address)) {
            self.move_peer(at, &before, &now);
            self.peers.state(peer.address, now);
        }
    }

    /// Fuses the scalar that was observed.
    #[cold]
    pub(super) fn fuse_peer(&mut self, peer: &PeerReport, fusions: &mut Fusions, observer: &mut impl Observer) {
        let inserted = self.judge_peer(peer, fusions);
        if let Some(at) = inserted {
            observer.observe(&LinearStep::Insert { at, count: PEER_STATES });
        }
        if let (Some(FusionRecord { innovation, variance, outcome: FusionOutcome::Fused, .. }), [observed, ..]) =
            (fusions.iter().next(), self.observations.as_slice())
        {
            let (innovation, variance) = (*innovation, *variance);
            let gain = self.gain.get(..self.dimension()).unwrap_or_default();
            let (row, considers) = (&observed.row, self.considers());
            observer.observe(&LinearStep::Update(ScalarUpdate { row, gain, innovation, variance, considers }));
        }
    }

    /// Uses the scalar or not; where the states of the vehicle's error stand if they are new.
    #[inline(never)]
    fn judge_peer(&mut self, peer: &PeerReport, fusions: &mut Fusions) -> Option<usize> {
        let mut variance = self.project(0);
        let innovation = self.observations.innovation(0);
        let before = self.p.get(X, X) + self.p.get(Y, Y);
        let [x, y] = [X, Y].map(|i| self.w.get(i).copied().unwrap_or_default());
        let mut outcome = if !self.peers.believes(peer.address, innovation, variance) {
            FusionOutcome::Gated
        } else if peer.leans || before - (x * x + y * y) / variance > WORTH * before {
            FusionOutcome::Redundant
        } else {
            FusionOutcome::Fused
        };
        let mut inserted = None;
        if outcome == FusionOutcome::Fused {
            if self.x.layout.peer(peer.address).is_none() {
                inserted = self.insert_peer(peer);
                variance = self.project(0);
            }
            self.hear(Sensor::Peer);
            outcome = if self.x.layout.peer(peer.address).is_none() {
                FusionOutcome::Redundant
            } else if self.fuse_scalar(Sensor::Peer, innovation, variance) {
                FusionOutcome::Fused
            } else {
                FusionOutcome::Invalid
            };
            self.peers.leans |= outcome == FusionOutcome::Fused;
            Effects::bound(&self.config, &mut self.x);
        }
        fusions.push(self.record(Sensor::Peer, 0, innovation, variance, outcome));
        inserted
    }

    /// Makes the error of a vehicle's statement a state, and the scalar that was observed one that depends on it.
    fn insert_peer(&mut self, peer: &PeerReport) -> Option<usize> {
        let (n, now) = (self.dimension(), stated(peer));
        let at = self.x.layout.add_peer(peer.address)?;
        self.p.insert(n, at, PEER_STATES);
        self.x.insert(n, at, PEER_STATES);
        self.x.set_tail(at, &[0.0; PEER_STATES]);
        self.set_peer_block(at, &now);
        self.peers.state(peer.address, now);
        if let [observed, ..] = self.observations.as_mut_slice() {
            // it begins with the direction of the path
            let (_, direction) = observed.row.as_slices();
            if let &[x, y, ..] = direction {
                let direction = Vector2::new(x, y);
                observed.variance -= direction.dot(&(now * direction));
                observed.row.shift(at, PEER_STATES);
                observed.row.push(at, x);
                observed.row.push(at + 1, y);
            }
        }
        Some(at)
    }

    /// The error of a vehicle's statement from one packet to the next.
    fn move_peer(&mut self, at: usize, before: &Matrix2<f64>, now: &Matrix2<f64>) {
        let forgotten = positive_part(&(now - before));
        let Some(inverse) = (before + forgotten).try_inverse() else { return };
        let a = now * inverse;
        for i in (0..self.dimension()).filter(|i| !(at..at + PEER_STATES).contains(i)) {
            let moved = a * Vector2::new(self.p.get(i, at), self.p.get(i, at + 1));
            self.p.set(i, at, moved.x);
            self.p.set(i, at + 1, moved.y);
        }
        let cross = self.p.get(at, at + 1);
        let block = Matrix2::new(self.p.get(at, at), cross, cross, self.p.get(at + 1, at + 1));
        self.set_peer_block(at, &(a * (block + forgotten) * a.transpose() + now - a * now));
        let error = a * Vector2::from(self.x.block::<2>(at));
        self.x.set_tail(at, error.as_slice());
    }

    fn set_peer_block(&mut self, at: usize, block: &Matrix2<f64>) {
        self.p.set(at, at, block[(0, 0)]);
        self.p.set(at + 1, at, 0.5 * (block[(0, 1)] + block[(1, 0)]));
        self.p.set(at + 1, at + 1, block[(1, 1)]);
    }

    /// Since the last fix the position rests on another vehicle's packets too.
    #[must_use]
    pub fn leans(&self) -> bool {
        self.peers.leans
    }

    /// Whether there are delayed states.
    pub(crate) fn has_clones(&self) -> bool {
        self.x.layout.has_clones()
    }
}

/// Of a symmetric matrix: its negative eigenvalues are taken as zero.
fn positive_part(d: &Matrix2<f64>) -> Matrix2<f64> {
    let (mean, half) = (0.5 * (d[(0, 0)] + d[(1, 1)]), libm::hypot(0.5 * (d[(0, 0)] - d[(1, 1)]), d[(0, 1)]));
    let (largest, smallest) = (mean + half, mean - half);
    if smallest >= 0.0 {
        *d
    } else if largest <= 0.0 {
        Matrix2::zeros()
    } else {
        (d - Matrix2::identity() * smallest) * (largest / (largest - smallest))
    }
}
