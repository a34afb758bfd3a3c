//! The same extended Kalman filter with P = S Sᵀ, by Potter's update and orthogonal triangularisation.
//!
//! A second filter, linearised at its own state, takes no part but as a library: with P = 0 its gains are zero, so that
//! fusing with it only evaluates h and H, and with P = I the cross covariance of a fresh clone is the clone's Jacobian.

extern crate std;

use crate::dynamics::ActuatorInput;
use crate::effects::Step;
use crate::navigation::algebra::covariance::{ROWS, Vector};
use crate::navigation::algebra::layout::{CLONE_STATES, CloneKind, EFFECTS, N_MAX, SHIP_STATES, SHIP_VELOCITY};
use crate::navigation::filter::cekf::Filter;
use crate::navigation::filter::effects::Effects;
use crate::navigation::{CloneId, FusionOutcome, Fusions, Measurement, Sensor, StateParameter};
use crate::state::{U, V, VEHICLE_STATES, X, Y, wrap_angle};
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

/// Square of the frequency of the semidiurnal tide, 12.42 h, rad²/s²: while nobody is heard, the rate of the current
/// changes by −ω² times the current.
const TIDE_OMEGA2: f64 = {
    let omega = core::f64::consts::TAU / (12.42 * 3600.0);
    omega * omega
};

pub struct Reference {
    /// State and functions.
    shadow: Box<Filter>,
    /// Rows of S, all of one length.
    s: Vec<Vec<f64>>,
    clones: Vec<CloneId>,
}

/// Largest |x − x_ref| / σ and |P − P_ref| / (σ_i σ_j), the latter without and with the ship's heading and turn rate.
pub struct Deviation {
    pub state: f64,
    pub covariance: f64,
    pub unobserved: f64,
}

impl Reference {
    /// From a filter that holds no clone: its state, and the root of its covariance.
    pub fn of(filter: &Filter) -> Self {
        let n = filter.dimension();
        let p: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| filter.propagated_covariance(i, j)).collect()).collect();
        let mut reference = Self { shadow: Box::new(filter.clone()), s: root(&p), clones: Vec::new() };
        reference.set_shadow_covariance(0.0);
        reference
    }

    fn set_shadow_covariance(&mut self, diagonal: f64) {
        self.shadow.p.clear();
        let n = self.shadow.dimension();
        self.shadow.p.set_diagonal(0, &[diagonal; N_MAX][..n]);
    }

    /// One step of the process model, as `Filter::predict` takes it.
    pub fn predict(&mut self, to_us: u64, input: &ActuatorInput) {
        let shadow = &mut *self.shadow;
        let h = (to_us - shadow.time_us) as f64 * 1.0e-6;
        let t_s = shadow.effect_time_s();
        if let Some(model) = &mut shadow.model {
            shadow.effects.retune(model, t_s, &shadow.config, &shadow.x);
        }
        let mut input = *input;
        if shadow.effects.actuate() {
            input = shadow.effects.actuated(&input, &Step { t_s, h_s: h }, &shadow.config, &shadow.x);
        }
        shadow.discretise(h, &input);
        self.move_state(h);
        self.move_root(h);
        self.shadow.time_us = to_us;
        // A wide S costs more than making it square from time to time.
        if self.s[0].len() > 4 * self.s.len() {
            triangularise(&mut self.s);
        }
    }

    /// Each state that another drives, and that other: positions by the current and by the ship's velocity.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let layout = &self.shadow.x.layout;
        let ship = layout.ship().expect("a ship");
        let current = layout.current().into_iter().flat_map(|at| [(X, at), (Y, at + 1)]);
        current.chain((0..3).map(|i| (ship + i, ship + SHIP_VELOCITY + i))).collect()
    }

    /// The current's states and their rates.
    fn tide(&self) -> Vec<(usize, usize)> {
        let rate = self.shadow.x.layout.current_rate();
        rate.into_iter().flat_map(|rate| [(EFFECTS, rate), (EFFECTS + 1, rate + 1)]).collect()
    }

    fn move_state(&mut self, h: f64) {
        let (pairs, tide, alone) = (self.pairs(), self.tide(), self.shadow.is_alone());
        let x = &mut self.shadow.x;
        for (x, increment) in x.vehicle.iter_mut().zip(&self.shadow.step.increment) {
            *x += increment;
        }
        x.wrap_heading();
        for (position, velocity) in pairs {
            let moved = h * x.get(velocity);
            if position < VEHICLE_STATES {
                x.vehicle[position] += moved;
            } else {
                x.add_tail(position, moved);
            }
        }
        for (current, rate) in tide {
            let change = h * x.get(rate);
            x.vehicle[X + current - EFFECTS] += 0.5 * h * change;
            x.add_tail(current, change);
            if alone {
                x.add_tail(rate, -TIDE_OMEGA2 * h * x.get(current));
            }
        }
    }

    /// S → [Φ S, G] with G Gᵀ = Q.
    fn move_root(&mut self, h: f64) {
        let (pairs, tide, alone) = (self.pairs(), self.tide(), self.shadow.is_alone());
        let step = &self.shadow.step;
        let phi: Vec<_> = (0..VEHICLE_STATES)
            .map(|j| {
                let mut unit = [0.0; VEHICLE_STATES];
                unit[j] = 1.0;
                step.times(&unit)
            })
            .collect();
        let old = self.s[..VEHICLE_STATES].to_vec();
        for (i, row) in self.s.iter_mut().take(VEHICLE_STATES).enumerate() {
            row.fill(0.0);
            for (column, old) in phi.iter().zip(&old) {
                add(row, column[i], old);
            }
        }
        for effect in &step.effects[..step.effect_count] {
            let source = self.s[EFFECTS + effect.slot].clone();
            for i in 0..VEHICLE_STATES {
                add(&mut self.s[i], effect.gamma[i], &source);
            }
        }
        for &(position, velocity) in &pairs {
            self.shear(position, velocity, h);
        }
        for &(current, rate) in &tide {
            self.shear(X + current - EFFECTS, rate, 0.5 * h * h);
            self.shear(current, rate, h);
        }

        let (step, config) = (&self.shadow.step, &self.shadow.config);
        let mut q = vec![vec![0.0; VEHICLE_STATES]; VEHICLE_STATES];
        for i in 0..VEHICLE_STATES {
            for j in 0..VEHICLE_STATES {
                q[i][j] = step.q[i.min(j)][i.max(j)];
            }
        }
        let vehicle: Vec<usize> = (0..VEHICLE_STATES).collect();
        let mut noise = vec![(vehicle, root(&q))];
        let walks: Vec<_> = config.effect_states.iter().map(|state| state.random_walk_per_sqrt_s).collect();
        let (linear, angular) =
            (config.ship_noise.linear_mps2_per_sqrt_hz, config.ship_noise.angular_radps2_per_sqrt_hz);
        for (position, velocity) in pairs {
            let walk = match position {
                X | Y => walks[velocity - EFFECTS],
                _ if velocity == EFFECTS + walks.len() + SHIP_STATES - 1 => angular,
                _ => linear,
            };
            let a = walk * walk;
            let q = vec![vec![a * h * h * h / 3.0, a * h * h / 2.0], vec![a * h * h / 2.0, a * h]];
            noise.push((vec![position, velocity], root(&q)));
        }
        let currents = if self.shadow.x.layout.current().is_some() { 2 } else { 0 };
        for (slot, walk) in walks.iter().enumerate().skip(currents).filter(|(_, walk)| **walk > 0.0) {
            noise.push((vec![EFFECTS + slot], vec![vec![walk * h.sqrt()]]));
        }
        for (places, factor) in noise {
            let width = self.s[0].len();
            self.s.iter_mut().for_each(|row| row.resize(width + places.len(), 0.0));
            for (place, factor) in places.iter().zip(&factor) {
                self.s[*place][width..].copy_from_slice(factor);
            }
        }
        if alone {
            for (current, rate) in tide {
                self.shear(rate, current, -TIDE_OMEGA2 * h);
            }
        }
    }

    /// Row `i` of S += a times row `j`.
    fn shear(&mut self, i: usize, j: usize, a: f64) {
        let source = self.s[j].clone();
        add(&mut self.s[i], a, &source);
    }

    /// Takes in what `filter` took in of a measurement, and judges the sensors and the sea as it does.
    pub fn fuse(&mut self, measurement: &Measurement, fusions: &Fusions, filter: &Filter) {
        let n = self.s.len();
        self.shadow.fuse(measurement, &mut ());
        assert!(self.shadow.failure.is_none());
        (self.shadow.monitor, self.shadow.heard_us) = (filter.monitor.clone(), filter.heard_us);
        let mut moved = [0.0; N_MAX];
        for (axis, record) in fusions.iter().enumerate() {
            match record.outcome {
                FusionOutcome::Gated | FusionOutcome::PositionUncertain => continue,
                outcome => assert_eq!(outcome, FusionOutcome::Fused),
            }
            let item = &self.shadow.observations.as_slice()[axis];
            let innovation = item.innovation - item.row.dot(&moved);
            let is_angle = record.sensor == Sensor::Attitude;
            let innovation = if is_angle { wrap_angle(innovation) } else { innovation };
            let (row, variance) = (item.row, item.variance);
            let mut phi = vec![0.0; self.s[0].len()];
            for (state, value) in row.iter() {
                add(&mut phi, value, &self.s[state]);
            }
            let s = dot(&phi, &phi) + variance;
            let mut gain: Vector = [0.0; ROWS];
            (0..n).for_each(|i| gain[i] = dot(&self.s[i], &phi) / s);
            let considered = self.considered(record.sensor);
            if considered.is_empty() {
                // Potter: φ = Sᵀhᵀ, S → S − γ (S φ) φᵀ.
                let gamma = s / (s + (variance * s).sqrt());
                (0..n).for_each(|i| add(&mut self.s[i], -gamma * gain[i], &phi));
            } else {
                // Schmidt: no gain on these; S → [S − K φᵀ, K √R].
                considered.iter().for_each(|i| gain[*i] = 0.0);
                for (row, gain) in self.s.iter_mut().zip(gain) {
                    add(row, -gain, &phi);
                    row.push(gain * variance.sqrt());
                }
            }
            (0..n).for_each(|i| moved[i] += gain[i] * innovation);
            self.shadow.x.correct(&gain, innovation);
        }
        Effects::bound(&self.shadow.config, &mut self.shadow.x);
    }

    /// The states that are only considered, by waves at the surface or while nobody is heard.
    fn considered(&self, sensor: Sensor) -> Vec<usize> {
        let states = || (EFFECTS..).zip(self.shadow.config.effect_states.iter());
        if self.shadow.is_moved_by_waves(sensor) {
            return [X, Y, U, V].into_iter().chain(states().map(|(at, _)| at)).collect();
        }
        let is_factor = |parameter| matches!(parameter, StateParameter::LogFactor(_));
        if !self.shadow.is_alone() || !states().any(|(_, state)| is_factor(state.parameter)) {
            return Vec::new();
        }
        let by_place = states().filter(|(_, state)| state.parameter.is_told_by_place()).map(|(at, _)| at);
        [X, Y, U].into_iter().chain(by_place).collect()
    }

    /// Takes the same clone as the filter.
    pub fn clone_with(&mut self, take: impl Fn(&mut Filter) -> CloneId, id: CloneId) {
        let n = self.s.len();
        self.set_shadow_covariance(1.0);
        assert_eq!(take(&mut self.shadow), id);
        for i in n..self.shadow.dimension() {
            let mut row = vec![0.0; self.s[0].len()];
            for j in 0..n {
                add(&mut row, self.shadow.p.get(i, j), &self.s[j]);
            }
            self.s.push(row);
        }
        self.set_shadow_covariance(0.0);
        self.clones.push(id);
    }

    /// Drops the clone that the filter drops.
    pub fn drop_clone(&mut self, id: CloneId) {
        let layout = &self.shadow.x.layout;
        let at = [CloneKind::Vehicle, CloneKind::Ship].iter().find_map(|kind| layout.clone_at(id, *kind));
        let at = at.expect("a clone");
        self.shadow.drop_clone(id, &mut ());
        self.clones.retain(|held| *held != id);
        self.s.drain(at..at + CLONE_STATES);
        assert_eq!(self.s.len(), self.shadow.dimension());
    }

    /// How far the filter is off.
    pub fn deviation(&self, navigator: &Filter) -> Deviation {
        let n = self.s.len();
        assert_eq!(n, navigator.dimension());
        let sigma: Vec<f64> = (0..n).map(|i| dot(&self.s[i], &self.s[i]).sqrt()).collect();
        let ship = self.shadow.x.layout.ship().expect("a ship");
        let mut unobserved = vec![ship + 2, ship + 5];
        let of_ship = |id: &CloneId| self.shadow.x.layout.clone_at(*id, CloneKind::Ship);
        unobserved.extend(self.clones.iter().filter_map(of_ship).flat_map(|at| [at + 2, at + 5]));
        let mut deviation = Deviation { state: 0.0, covariance: 0.0, unobserved: 0.0 };
        for i in 0..n {
            // Headings may differ by a turn.
            let difference = wrap_angle(navigator.state_at(i) - self.shadow.state_at(i)).abs();
            deviation.state = deviation.state.max(difference / sigma[i]);
            for j in 0..=i {
                let p = dot(&self.s[i], &self.s[j]);
                let off = (navigator.covariance(i, j) - p).abs() / (sigma[i] * sigma[j]);
                let of_both = unobserved.contains(&i) || unobserved.contains(&j);
                let largest = if of_both { &mut deviation.unobserved } else { &mut deviation.covariance };
                *largest = largest.max(off);
            }
        }
        deviation
    }
}

/// a · b in four sums, which the compiler may keep side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// a += k b.
fn add(a: &mut [f64], k: f64, b: &[f64]) {
    if k != 0.0 {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += k * b);
    }
}

/// Lower triangular G with G Gᵀ = q; what rounding leaves of a pivot that is zero is zero.
fn root(q: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = q.len();
    let mut g = vec![vec![0.0; n]; n];
    for j in 0..n {
        let pivot = q[j][j] - dot(&g[j][..j], &g[j][..j]);
        if pivot <= 1.0e-15 * q[j][j] {
            continue;
        }
        g[j][j] = pivot.sqrt();
        for i in j + 1..n {
            g[i][j] = (q[i][j] - dot(&g[i][..j], &g[j][..j])) / g[j][j];
        }
    }
    g
}

/// S → S U, lower triangular, with U orthogonal: Householder's reflections.
fn triangularise(s: &mut [Vec<f64>]) {
    for i in 0..s.len() {
        let (done, below) = s.split_at_mut(i + 1);
        let row = &mut done[i][i..];
        let norm = dot(row, row).sqrt();
        if norm == 0.0 {
            continue;
        }
        let beta = -norm.copysign(row[0]);
        let mut v = row.to_vec();
        v[0] -= beta;
        row.fill(0.0);
        row[0] = beta;
        let scale = 2.0 / dot(&v, &v);
        for other in below {
            let projection = scale * dot(&other[i..], &v);
            add(&mut other[i..], -projection, &v);
        }
    }
    let n = s.len();
    s.iter_mut().for_each(|row| row.truncate(n));
}
