//! Noise that lasts: a first-order Gauss-Markov process beside the white noise of a channel, as a state of the filter. Of
//! ranges every other end has its own.
//!
//! With n_j the noise states, c_j their covariances with the vehicle's state and V theirs with each other:
//! n ← a n, c_j ← a_j Φ c_j, V_ij ← a_i a_j V_ij + σ_j² (1 − a_j²) δ_ij, where a_j = exp(−h/τ_j).

use super::matrix::{self, Square};
use crate::samples::{LogEvent, Reading, ResidualChannel, Samples};
use std::collections::BTreeSet;

/// A part of a channel's noise that lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// Whose noise.
    pub channel: ResidualChannel,
    /// One sigma, in the channel's unit.
    pub sigma: f64,
    /// Time constant, s.
    pub tau_s: f64,
}

/// The states of all colours.
#[derive(Clone, Debug, Default)]
pub(super) struct ColourStates {
    colours: Vec<Colour>,
    /// Places of the colours of each channel, and the transponder whose they are.
    places: [Vec<(usize, Option<u32>)>; ResidualChannel::COUNT],
    /// n.
    pub(super) value: Vec<f64>,
    /// c_j, a column each.
    cross: Vec<[f64; 12]>,
    /// V, row by row.
    own: Vec<f64>,
    /// Length of the last step, s, and a_j over it.
    kept: (f64, Vec<f64>),
}

impl ColourStates {
    pub(super) fn new(of_channels: &[Colour], samples: &Samples) -> Self {
        let mut colours = Vec::new();
        let mut places: [Vec<(usize, Option<u32>)>; ResidualChannel::COUNT] = Default::default();
        for colour in of_channels {
            let ends =
                if colour.channel == ResidualChannel::Range { other_ends(samples) } else { BTreeSet::from([None]) };
            for station in ends {
                places[colour.channel as usize].push((colours.len(), station));
                colours.push(*colour);
            }
        }
        let kept = (f64::NAN, vec![1.0; colours.len()]);
        let mut states = Self { colours, places, kept, ..Self::default() };
        states.forget();
        states
    }

    /// As before the first reading.
    pub(super) fn forget(&mut self) {
        let count = self.colours.len();
        self.value = vec![0.0; count];
        self.cross = vec![[0.0; 12]; count];
        self.own = vec![0.0; count * count];
        for (j, colour) in self.colours.iter().enumerate() {
            self.own[j * count + j] = colour.sigma * colour.sigma;
        }
    }

    pub(super) fn count(&self) -> usize {
        self.colours.len()
    }

    /// Places of the colours of a channel, of a range to this other end.
    pub(super) fn of(&self, (channel, end): (ResidualChannel, Option<u32>)) -> impl Iterator<Item = usize> + '_ {
        let is_own = move |(_, station): &&(usize, Option<u32>)| channel != ResidualChannel::Range || *station == end;
        self.places[channel as usize].iter().filter(is_own).map(|(j, _)| *j)
    }

    /// What the noise states add to the prediction of a scalar.
    pub(super) fn reading(&self, of: (ResidualChannel, Option<u32>)) -> f64 {
        self.of(of).map(|j| self.value[j]).sum()
    }

    /// What each state kept in the last step.
    pub(super) fn kept(&self) -> &[f64] {
        &self.kept.1
    }

    /// Time update over `h_s` with Φ = I + d.
    pub(super) fn step(&mut self, h_s: f64, d: &Square) {
        let count = self.count();
        if self.kept.0 != h_s {
            self.kept = (h_s, self.colours.iter().map(|colour| (-h_s / colour.tau_s).exp()).collect());
        }
        if count == 0 {
            return;
        }
        let kept = &self.kept.1;
        let turned = matrix::transpose(d);
        for (j, a) in kept.iter().enumerate() {
            self.value[j] *= a;
            let moved = matrix::apply_turned(&turned, &self.cross[j]);
            for (c, moved) in self.cross[j].iter_mut().zip(moved) {
                *c = a * (*c + moved);
            }
            for (own, other) in self.own[j * count..][..count].iter_mut().zip(kept) {
                *own *= a * other;
            }
            self.own[j * count + j] += self.colours[j].sigma.powi(2) * (1.0 - a * a);
        }
    }

    /// Σ of c_j over the colours of a scalar: what they add to P hᵀ.
    pub(super) fn cross_of(&self, of: (ResidualChannel, Option<u32>)) -> [f64; 12] {
        let mut sum = [0.0; 12];
        for j in self.of(of) {
            for (sum, c) in sum.iter_mut().zip(&self.cross[j]) {
                *sum += c;
            }
        }
        sum
    }

    /// Covariance of every noise state with the scalar that is read with `h` and `load` times its colours.
    pub(super) fn with_scalar(&self, of: (ResidualChannel, Option<u32>), load: f64, h: &[f64; 12]) -> Vec<f64> {
        let count = self.count();
        let read: Vec<(usize, f64)> = h.iter().copied().enumerate().filter(|(_, factor)| *factor != 0.0).collect();
        let of: Vec<usize> = self.of(of).collect();
        let covariance = |(cross, own): (&[f64; 12], &[f64])| {
            let by_state: f64 = read.iter().map(|(i, factor)| cross[*i] * factor).sum();
            by_state + load * of.iter().map(|j| own[*j]).sum::<f64>()
        };
        self.cross.iter().zip(self.own.chunks_exact(count.max(1))).map(covariance).collect()
    }

    /// Measurement update: `ph` and `pn` are the covariances of the vehicle's and of the noise states with the scalar.
    pub(super) fn update(&mut self, ph: &[f64; 12], pn: &[f64], variance: f64, innovation: f64) {
        let count = self.count();
        for (i, own) in pn.iter().enumerate() {
            let gain = own / variance;
            for (c, ph) in self.cross[i].iter_mut().zip(ph) {
                *c -= gain * ph;
            }
            for (j, other) in pn.iter().enumerate() {
                self.own[i * count + j] -= gain * other;
            }
            self.value[i] += gain * innovation;
        }
    }
}

/// Whom ranges are measured to: the ship, fixed transponders.
fn other_ends(samples: &Samples) -> BTreeSet<Option<u32>> {
    let of = |(_, event): &(f64, LogEvent)| match event {
        LogEvent::Reading(Reading::Acoustic { ship, .. }) => Some(ship.station.map(|(number, _)| number)),
        _ => None,
    };
    samples.events.iter().filter_map(of).collect()
}
