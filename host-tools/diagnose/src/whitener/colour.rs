//! Noise that lasts: a first-order Gauss-Markov process beside the white noise of a channel, as a state of the filter. Of
//! ranges every other end has its own.
//!
//! With n_j the noise states, c_j their covariances with the vehicle's state and V theirs with each other:
//! n ← a n, c_j ← a_j Φ c_j, V_ij ← a_i a_j V_ij + σ_j² (1 − a_j²) δ_ij, where a_j = exp(−h/τ_j).

use super::matrix::{self, Square};
use super::{LANES, Lanes, NONE};
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

/// The states of all colours, in groups of [`LANES`], the last filled up with zeros.
#[derive(Clone, Debug, Default)]
pub(super) struct ColourStates {
    colours: Vec<Colour>,
    /// Places of the colours of each channel, and the transponder whose they are.
    places: [Vec<(usize, Option<u32>)>; ResidualChannel::COUNT],
    /// n.
    value: Vec<f64>,
    /// c_j: of each group twelve lines.
    cross: Vec<[Lanes; 12]>,
    /// V: of each noise state a line for each group.
    own: Vec<Lanes>,
    /// Length of the last step, s, and a_j over it.
    kept: (f64, Vec<Lanes>),
    /// Covariance of every noise state with the scalar under way.
    with_scalar: Vec<Lanes>,
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
        let none = vec![NONE; colours.len().div_ceil(LANES)];
        let kept = (f64::NAN, none.clone());
        let mut states = Self { colours, places, kept, with_scalar: none, ..Self::default() };
        states.forget();
        states
    }

    /// As before the first reading.
    pub(super) fn forget(&mut self) {
        let (count, groups) = (self.count(), self.groups());
        self.value = vec![0.0; count];
        self.cross = vec![[NONE; 12]; groups];
        self.own = vec![NONE; count * groups];
        for (j, colour) in self.colours.iter().enumerate() {
            *matrix::at_mut(&mut self.own[j * groups + j / LANES], j % LANES) = colour.sigma * colour.sigma;
        }
    }

    pub(super) fn count(&self) -> usize {
        self.colours.len()
    }

    fn groups(&self) -> usize {
        self.count().div_ceil(LANES)
    }

    /// Places of the colours of a channel, of a range to this other end.
    fn of(&self, (channel, end): (ResidualChannel, Option<u32>)) -> impl Iterator<Item = usize> + '_ {
        let is_own = move |(_, station): &&(usize, Option<u32>)| channel != ResidualChannel::Range || *station == end;
        self.places[channel as usize].iter().filter(is_own).map(|(j, _)| *j)
    }

    /// Whether some noise of a channel lasts.
    pub(super) fn has(&self, channel: ResidualChannel) -> bool {
        !self.places[channel as usize].is_empty()
    }

    /// What the noise states add to the prediction of a scalar.
    pub(super) fn reading(&self, of: (ResidualChannel, Option<u32>)) -> f64 {
        self.of(of).map(|j| self.value[j]).sum()
    }

    /// What a state kept in the last step.
    pub(super) fn kept(&self, j: usize) -> f64 {
        matrix::at(&self.kept.1[j / LANES], j % LANES)
    }

    /// Time update over `h_s` with Φ = I + d.
    pub(super) fn step(&mut self, h_s: f64, d: &Square) {
        let groups = self.groups();
        if self.kept.0 != h_s {
            self.kept.0 = h_s;
            for (j, colour) in self.colours.iter().enumerate() {
                *matrix::at_mut(&mut self.kept.1[j / LANES], j % LANES) = (-h_s / colour.tau_s).exp();
            }
        }
        for (cross, kept) in self.cross.iter_mut().zip(&self.kept.1) {
            matrix::add_product(d, cross);
            for line in cross {
                matrix::multiply(line, kept);
            }
        }
        for (i, colour) in self.colours.iter().enumerate() {
            let a = matrix::at(&self.kept.1[i / LANES], i % LANES);
            for (line, kept) in self.own[i * groups..][..groups].iter_mut().zip(&self.kept.1) {
                matrix::multiply(line, &kept.map(|four| four * a));
            }
            *matrix::at_mut(&mut self.own[i * groups + i / LANES], i % LANES) += colour.sigma.powi(2) * (1.0 - a * a);
            self.value[i] *= a;
        }
    }

    /// Adds to P hᵀ what the colours of a scalar, which is read with `h` and `load` times them, do; takes down the
    /// covariance of every noise state with the scalar, and returns that of its own colours together.
    pub(super) fn correlate(
        &mut self,
        of: (ResidualChannel, Option<u32>),
        load: f64,
        h: &[f64; 12],
        ph: &mut [f64; 12],
    ) -> f64 {
        let groups = self.groups();
        let mut with_scalar = std::mem::take(&mut self.with_scalar);
        for (group, (sum, cross)) in with_scalar.iter_mut().zip(&self.cross).enumerate() {
            *sum = NONE;
            for (factor, line) in h.iter().zip(cross).filter(|(factor, _)| **factor != 0.0) {
                matrix::add_times(sum, *factor, line);
            }
            for own in self.of(of) {
                matrix::add_times(sum, load, &self.own[own * groups + group]);
            }
        }
        let mut together = 0.0;
        for j in self.of(of) {
            together += matrix::at(&with_scalar[j / LANES], j % LANES);
            for (ph, line) in ph.iter_mut().zip(&self.cross[j / LANES]) {
                *ph += load * matrix::at(line, j % LANES);
            }
        }
        self.with_scalar = with_scalar;
        together
    }

    /// Covariance of a state with the scalar that `correlate` was given.
    pub(super) fn with_scalar(&self, j: usize) -> f64 {
        matrix::at(&self.with_scalar[j / LANES], j % LANES)
    }

    /// ∂(reading)/∂θ through the noise states, of whose derivatives these are the lines.
    pub(super) fn slope(&self, of: (ResidualChannel, Option<u32>), lines: &[Lanes]) -> Lanes {
        let mut sum = NONE;
        for line in self.of(of).map(|colour| &lines[colour]) {
            matrix::add_times(&mut sum, 1.0, line);
        }
        sum
    }

    /// Measurement update, behind `correlate`: `ph` is the covariance of the vehicle's state with the scalar.
    pub(super) fn update(&mut self, ph: &[f64; 12], variance: f64, innovation: f64) {
        let groups = self.groups();
        for (cross, pn) in self.cross.iter_mut().zip(&self.with_scalar) {
            let gain = pn.map(|pn| pn / variance);
            for (line, ph) in cross.iter_mut().zip(ph) {
                matrix::add_times(line, -ph, &gain);
            }
        }
        for i in 0..self.count() {
            let gain = matrix::at(&self.with_scalar[i / LANES], i % LANES) / variance;
            for (line, pn) in self.own[i * groups..][..groups].iter_mut().zip(&self.with_scalar) {
                matrix::add_times(line, -gain, pn);
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
