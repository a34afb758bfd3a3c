//! How the innovations of the nominal filter move with each column.
//!
//! With K the filter's own gain and Φ its own transition, the derivative g = ∂x̂/∂θ of its estimate runs along:
//!
//!   between measurements   g ← Φ g + Γ,           Γ = ∫ Φ ds ∂v̇/∂θ
//!   at a measurement       a = (h g + ∂z/∂θ)/√S,  g ← g − K (h g + ∂z/∂θ)
//!
//! so that its normalised innovation e is white noise plus a θ.

use super::columns::{COLUMNS, CURRENT, Shifts, accelerations};
use super::motion::Motion;
use super::onset::{BLOCK_US, Onset, REMEMBERED, STATES};
use super::sums::Sums;
use super::unlisted::Unlisted;
use crate::dynamics::ActuatorInput;
use crate::navigation::algebra::discretisation::DRIVING;
use crate::navigation::algebra::observer::{LinearStep, Observer, ScalarUpdate, Transition};
use crate::navigation::filter::cekf::Filter;
use crate::navigation::interface::measurement::{Measurement, Sensor};
use crate::state::{PSI, U, VEHICLE_STATES, VehicleState, X, Y, Z};

/// Onsets that are kept.
pub(super) const ONSETS: usize = 10;
/// The filter has forgotten an onset after this time, µs: its ranges have come from all around.
const REMEMBERS_US: u64 = 2_400_000_000;

/// An innovation counts as one of so many sigmas at most, what it depends on in proportion.
const MOST_SIGMAS: f64 = 3.0;

/// Follows the nominal filter: g, and what the step under way needs.
pub struct Sensitivities {
    /// The filter is followed.
    pub(super) watches: bool,
    /// ∂x̂/∂θ, by columns.
    by_column: [[f64; STATES]; COLUMNS],
    /// ∂v̇/∂θ of the forces.
    forces: [[f64; 6]; CURRENT],
    shifts: Shifts,
    motion: Motion,
    /// Scalar of the measurement under way.
    axis: u8,
    /// Innovations count.
    counts: bool,
    /// Time of the range under way, µs; 0: another measurement.
    range_us: u64,
    pub(super) sums: Sums,
    pub(super) ranges: Unlisted,
    onsets: [Onset; ONSETS],
    pub(super) kept: usize,
}

impl Sensitivities {
    pub(super) const fn new() -> Self {
        Self {
            watches: false,
            by_column: [[0.0; STATES]; COLUMNS],
            forces: [[0.0; 6]; CURRENT],
            shifts: Shifts::NONE,
            motion: Motion::NONE,
            axis: 0,
            counts: false,
            range_us: 0,
            sums: Sums::NONE,
            ranges: Unlisted::NONE,
            onsets: [const { Onset::NONE }; ONSETS],
            kept: 0,
        }
    }

    pub(super) fn restart(&mut self) {
        self.by_column = [[0.0; STATES]; COLUMNS];
        self.sums = Sums::NONE;
        self.ranges.restart();
        self.motion = Motion::NONE;
        self.kept = 0;
    }

    /// The onsets kept, the newest last.
    pub(super) fn onsets(&self) -> &[Onset] {
        self.onsets.get(..self.kept).unwrap_or_default()
    }

    /// Keeps what the onsets have summed for what is weighed now.
    pub(super) fn hold(&mut self) {
        self.onsets.iter_mut().take(self.kept).for_each(Onset::hold);
    }

    /// Keeps the present as an onset; the last one where there is no more room.
    pub(super) fn keep_onset(&mut self, time_us: u64, colour: [f64; COLUMNS]) {
        self.hold();
        let Self { onsets, kept, sums, by_column, .. } = self;
        for onset in onsets.iter_mut().take(*kept) {
            onset.lasts &= time_us.saturating_sub(onset.time_us) < REMEMBERS_US;
        }
        if let Some(onset) = onsets.get_mut(*kept) {
            onset.begin(time_us, sums, colour, by_column);
            *kept += 1;
        }
    }

    /// Forgets the onset that is missed least: its neighbours are the closest, measured by its age. `is_needed` is told the
    /// one before it, and itself.
    pub(super) fn thin(&mut self, now_us: u64, is_needed: impl Fn(&Onset, &Onset) -> bool) {
        let mut least = (f64::INFINITY, 0);
        for (i, [before, own, after]) in self.onsets().array_windows().enumerate() {
            if !is_needed(before, own) {
                let age_us = now_us.saturating_sub(own.time_us).saturating_add(BLOCK_US);
                let gap = after.time_us.saturating_sub(before.time_us) as f64 / age_us as f64;
                if gap < least.0 {
                    least = (gap, i + 1);
                }
            }
        }
        for i in least.1..self.kept.saturating_sub(1) {
            if let Some([own, next]) = self.onsets.get_mut(i..).and_then(|rest| rest.first_chunk_mut()) {
                own.clone_from(next);
            }
        }
        self.kept = self.kept.saturating_sub(1);
    }

    /// Every column that moves.
    fn columns_mut(&mut self) -> impl Iterator<Item = &mut [f64; STATES]> {
        let lasting = self.onsets.iter_mut().take(self.kept).filter(|onset| onset.lasts);
        self.by_column.iter_mut().chain(lasting.flat_map(|onset| &mut onset.columns))
    }

    /// Call it before the filter moves. Its numbers are off the stack again when that does.
    #[inline(never)]
    pub(super) fn will_predict(&mut self, filter: &Filter, x: &VehicleState, input: &ActuatorInput, hours: f64) {
        let Some(model) = filter.model() else { return };
        let forces = accelerations(model, &self.motion.of(x), input, hours);
        for (own, new) in self.forces.iter_mut().zip(&forces) {
            *own = (*new).into();
        }
    }

    /// Call it before a measurement is fused.
    pub(super) fn will_fuse(&mut self, filter: &Filter, measurement: &Measurement, hours: f64, counts: bool) {
        self.shifts = Shifts::new(measurement, filter.state(), hours);
        self.axis = 0;
        self.counts = counts;
        self.range_us = if measurement.sensor() == Sensor::Range { filter.time_us() } else { 0 };
        self.motion.will_fuse(measurement.sensor());
    }

    #[inline(never)]
    fn step(&mut self, transition: &Transition<'_>) {
        let half_s = 0.5 * transition.step_s;
        self.motion.step(transition.step_s);
        let Self { by_column, forces, onsets, kept, .. } = self;
        for (k, column) in by_column.iter_mut().enumerate() {
            // half of the step's acceleration at its start, half at its end
            let push = |column: &mut [f64; STATES]| {
                if let Some(force) = forces.get(k) {
                    column.iter_mut().skip(U).zip(force).for_each(|(g, a)| *g += half_s * a);
                }
            };
            push(column);
            transit(transition, column);
            push(column);
            if let Some(g) = k.checked_sub(CURRENT).filter(|axis| *axis < 2).and_then(|axis| column.get_mut(X + axis)) {
                *g += transition.step_s;
            }
        }
        for onset in onsets.iter_mut().take(*kept).filter(|onset| onset.lasts) {
            onset.columns.iter_mut().for_each(|column| transit(transition, column));
        }
    }
}

impl Sensitivities {
    #[inline(never)]
    fn update(&mut self, update: &ScalarUpdate<'_>) {
        let Self { by_column, shifts, motion, axis, onsets, kept, sums, ranges, counts, range_us, .. } = self;
        motion.take(*axis, update);
        let mut slopes = by_column.each_ref().map(|column| update.row.dot(column));
        for (column, shift) in shifts.of(*axis) {
            if let Some(slope) = slopes.get_mut(column) {
                *slope += shift;
            }
        }
        *axis = axis.saturating_add(1);
        by_column.iter_mut().zip(&slopes).for_each(|(column, slope)| correct(column, update.gain, *slope));
        let mut weight = if *counts && update.variance > 0.0 { 1.0 / libm::sqrt(update.variance) } else { 0.0 };
        let sigmas = (update.innovation * weight).abs();
        if sigmas > MOST_SIGMAS {
            weight *= MOST_SIGMAS / sigmas;
        }
        let e = update.innovation * weight;
        slopes.iter_mut().for_each(|slope| *slope *= weight);
        if weight > 0.0 {
            sums.take(&slopes, e);
            if *range_us > 0 {
                ranges.take(*range_us, e);
            }
        }
        for onset in onsets.iter_mut().take(*kept).filter(|onset| onset.lasts) {
            let mut own = [0.0; REMEMBERED.len()];
            for (own, column) in own.iter_mut().zip(&mut onset.columns) {
                let slope = update.row.dot(column);
                correct(column, update.gain, slope);
                *own = weight * slope;
            }
            if weight > 0.0 {
                onset.running.take(&own, &slopes, e);
            }
        }
    }
}

/// g − K a.
fn correct(column: &mut [f64; STATES], gain: &[f64], slope: f64) {
    column.iter_mut().zip(gain).for_each(|(g, gain)| *g -= gain * slope);
}

/// Φ g.
fn transit(transition: &Transition<'_>, column: &mut [f64; STATES]) {
    let step = transition.step;
    let mut next = [0.0; VEHICLE_STATES];
    let [by_north, by_east] = step.phi_heading;
    next[X] = column[X] + by_north * column[PSI];
    next[Y] = column[Y] + by_east * column[PSI];
    next[Z] = column[Z];
    next[PSI] = column[PSI];
    for (state, phi) in DRIVING.iter().zip(&step.phi) {
        let g = column.get(*state).copied().unwrap_or(0.0);
        next.iter_mut().zip(phi).for_each(|(next, phi)| *next += g * phi);
    }
    column.iter_mut().zip(next).for_each(|(g, next)| *g = next);
}

impl Observer for Sensitivities {
    fn observe(&mut self, step: &LinearStep<'_>) {
        if !self.watches {
            return;
        }
        match step {
            LinearStep::Transition(transition) => self.step(transition),
            LinearStep::Update(update) | LinearStep::Refused(update) => self.update(update),
            LinearStep::Append(appended) => {
                for column in self.columns_mut() {
                    for i in 0..appended.count() {
                        let value = appended.row(i).map(|(at, c)| c * column.get(at).copied().unwrap_or(0.0)).sum();
                        if let Some(own) = column.get_mut(appended.at + i) {
                            *own = value;
                        }
                    }
                }
            }
            // another vehicle's error: it is where it is, whatever this one has
            LinearStep::Insert { at, count } => {
                for column in self.columns_mut() {
                    for i in (*at..STATES).rev() {
                        let kept = i.checked_sub(*count).filter(|from| from >= at);
                        let value = kept.and_then(|from| column.get(from)).copied().unwrap_or(0.0);
                        if let Some(own) = column.get_mut(i) {
                            *own = value;
                        }
                    }
                }
            }
            LinearStep::Remove { at, count } => {
                for column in self.columns_mut() {
                    for i in *at..STATES {
                        let next = column.get(i + count).copied().unwrap_or(0.0);
                        if let Some(own) = column.get_mut(i) {
                            *own = next;
                        }
                    }
                }
            }
        }
    }
}
