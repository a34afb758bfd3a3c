//! The state vector x̂ beside its layout.

use super::covariance::Vector;
use super::layout::{CloneKind, EFFECTS, Layout, TAIL};
use crate::navigation::interface::measurement::CloneId;
use crate::state::{PSI, VEHICLE_STATES, VehicleState, wrap_angle};
use core::f64::consts::PI;
use nalgebra::{ArrayStorage, Vector2};

/// x̂: the vehicle, and behind it whatever the layout says.
#[derive(Clone)]
pub(crate) struct Estimate {
    pub(crate) vehicle: VehicleState,
    pub(crate) tail: [f64; TAIL],
    pub(crate) layout: Layout,
    /// Current [north, east] where it is not estimated, m/s.
    pub(crate) water_mps: [f64; 2],
}

impl Estimate {
    pub(crate) const fn new() -> Self {
        Self {
            vehicle: VehicleState::from_array_storage(ArrayStorage([[0.0; VEHICLE_STATES]; 1])),
            tail: [0.0; TAIL],
            layout: Layout::new(),
            water_mps: [0.0; 2],
        }
    }

    /// x̂_i; 0 outside.
    pub(crate) fn get(&self, i: usize) -> f64 {
        let value = match i.checked_sub(VEHICLE_STATES) {
            None => self.vehicle.as_slice().get(i),
            Some(i) => self.tail.get(i),
        };
        value.copied().unwrap_or(0.0)
    }

    /// States in a row, all of them the vehicle's or none.
    pub(crate) fn block<const K: usize>(&self, at: usize) -> [f64; K] {
        let behind = match at.checked_sub(VEHICLE_STATES) {
            None => self.vehicle.as_slice().get(at..),
            Some(at) => self.tail.get(at..),
        };
        behind.and_then(<[f64]>::first_chunk).copied().unwrap_or([0.0; K])
    }

    /// Writes states behind the vehicle's.
    pub(crate) fn set_tail(&mut self, at: usize, values: &[f64]) {
        for (x, value) in self.tail.iter_mut().skip(at.saturating_sub(VEHICLE_STATES)).zip(values) {
            *x = *value;
        }
    }

    /// Adds to a state behind the vehicle's.
    pub(crate) fn add_tail(&mut self, at: usize, value: f64) {
        if let Some(x) = at.checked_sub(VEHICLE_STATES).and_then(|i| self.tail.get_mut(i)) {
            *x += value;
        }
    }

    /// All states in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        self.vehicle.iter().chain(&self.tail).copied().take(self.layout.len())
    }

    /// x̂ += K ν.
    pub(crate) fn correct(&mut self, gain: &Vector, innovation: f64) {
        let tail = self.layout.len().saturating_sub(VEHICLE_STATES);
        let (vehicle_gain, tail_gain) = gain.split_at(VEHICLE_STATES);
        for (x, k) in self.vehicle.as_mut_slice().iter_mut().zip(vehicle_gain) {
            *x += k * innovation;
        }
        for (x, k) in self.tail.get_mut(..tail).unwrap_or_default().iter_mut().zip(tail_gain) {
            *x += k * innovation;
        }
        self.wrap_heading();
    }

    pub(crate) fn wrap_heading(&mut self) {
        if self.vehicle[PSI].abs() > PI {
            self.vehicle[PSI] = wrap_angle(self.vehicle[PSI]);
        }
    }

    /// Current [north, east], m/s.
    pub(crate) fn current(&self) -> Vector2<f64> {
        Vector2::from(self.layout.current().map_or(self.water_mps, |at| self.block::<2>(at)))
    }

    /// Makes room for states behind the vehicle's.
    pub(crate) fn insert(&mut self, n: usize, at: usize, count: usize) {
        let (at, n) = (at.saturating_sub(EFFECTS), n.saturating_sub(EFFECTS).min(TAIL.saturating_sub(count)));
        if at <= n {
            self.tail.copy_within(at..n, at + count);
        }
    }

    /// Removes states behind the vehicle's.
    pub(crate) fn remove(&mut self, n: usize, at: usize, count: usize) {
        let (at, n) = (at.saturating_sub(EFFECTS), n.saturating_sub(EFFECTS).min(TAIL));
        if at + count <= n {
            self.tail.copy_within(at + count..n, at);
        }
    }

    /// Where a clone of that kind stands.
    pub(crate) fn clone_at(&self, id: CloneId, kind: CloneKind) -> Option<usize> {
        self.layout.clone_at(id, kind)
    }
}
