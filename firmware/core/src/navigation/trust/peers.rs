//! Which other vehicles are believed.
//!
//! One whose clock, receiver or filter is off states sigmas as small as the others do. Its ranges are therefore
//! weighed before they are used: by Bayes' rule, ν ~ N(0, S) of one that is right against N(0, S + L²) of one that
//! is not, S with both vehicles' covariances. It is used as long as the odds are for it and the range itself is within
//! the gate. Nothing is added to the filter's own uncertainty: where two vehicles contradict each other, each goes on
//! by itself.

use crate::navigation::algebra::layout::PEERS;
use nalgebra::Matrix2;

/// L, how far off a vehicle is that is wrong, m.
const WRONG_M: f64 = 100.0;
/// ln of the odds before anything is heard, and at least for a range to be used: ten to one.
const PRIOR: f64 = 2.3;
/// ln of the least and largest odds: a vehicle that has been wrong for long has to be right for as long.
const BOUNDS: [f64; 2] = [-10.0, 5.0];
/// What one range changes: a single reflected path does not condemn a vehicle that was right before.
const STEP: [f64; 2] = [-2.5, 1.0];
/// Gate, squared sigmas.
const GATE: f64 = 9.0;

/// One that was heard. None of it may have a spare value: the filter's memory is zero at the start.
#[derive(Clone, Copy)]
struct Peer {
    /// Modem address.
    address: u8,
    /// ln of the odds for it.
    odds: f64,
    /// Covariance of what it said last, m².
    stated: Matrix2<f64>,
}

/// The vehicles that were heard.
#[derive(Clone)]
pub(crate) struct Peers {
    heard: [Option<Peer>; PEERS],
    /// Since the last fix the position rests on one of them too.
    pub(crate) leans: bool,
}

impl Peers {
    pub(crate) const NONE: Self = Self { heard: [None; PEERS], leans: false };

    /// Weighs a range of the vehicle with this modem address, and says whether it is to be used. A vehicle for which
    /// there is no room is not.
    pub(crate) fn believes(&mut self, address: u8, innovation: f64, variance: f64) -> bool {
        let known = |place: &&mut Option<Peer>| place.is_none_or(|peer| peer.address == address);
        let Some(place) = self.heard.iter_mut().find(known) else { return false };
        let Peer { odds, .. } = place.get_or_insert(Peer { address, odds: PRIOR, stated: Matrix2::zeros() });
        let (squared, wide) = (innovation * innovation, variance + WRONG_M * WRONG_M);
        let said = 0.5 * (libm::log(wide / variance) - squared / variance + squared / wide);
        let ([least, most], [down, up]) = (BOUNDS, STEP);
        *odds = (*odds + said.max(down).min(up)).max(least).min(most);
        *odds >= PRIOR && squared <= GATE * variance
    }

    /// Covariance of what a vehicle said last, m².
    pub(crate) fn stated(&self, address: u8) -> Option<Matrix2<f64>> {
        self.heard.iter().flatten().find(|peer| peer.address == address).map(|peer| peer.stated)
    }

    /// Keeps the covariance of what a vehicle says now, m².
    pub(crate) fn state(&mut self, address: u8, stated: Matrix2<f64>) {
        if let Some(peer) = self.heard.iter_mut().flatten().find(|peer| peer.address == address) {
            peer.stated = stated;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_outlier_is_forgiven_and_a_liar_is_not() {
        let mut peers = Peers::NONE;
        // S = 10 m²: ln √(10010 / 10) = 3.45, at most 1 a range: 3.3, 4.3, 5
        assert!((0..3).all(|_| peers.believes(3, 1.0, 10.0)));
        // 50 m: at most -2.5, and outside the gate; then 2.5 + 1
        assert!(!peers.believes(3, 50.0, 10.0));
        assert!(peers.believes(3, 1.0, 10.0));
        // 15 m, a clock that is 10 ms off
        assert!((0..20).all(|_| !peers.believes(4, 15.0, 10.0)));
        // from -10 to 2.3
        assert_eq!((0..20).position(|_| peers.believes(4, 0.0, 10.0)), Some(12));
        assert!(peers.believes(3, 1.0, 10.0), "the other is as before");
        // a position that is known to 100 m says nothing against 50
        assert!(peers.believes(5, 50.0, 1.0e4));
        assert!(peers.believes(6, 0.0, 1.0) && peers.believes(7, 0.0, 1.0) && !peers.believes(8, 0.0, 1.0));
    }
}
