//! Time update: state, covariance and derivatives from one reading to the next.

use super::matrix::{self, Square};
use super::{Filter, Kind, LANES, STEP_S};
use crate::regressors::{self, Snapshot, Target};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::effects::Step;
use backseat_core::navigation::ProcessNoise;
use backseat_core::state::{PSI, U, VehicleState, X, Z, wrap_angle};

impl Filter<'_> {
    /// Moves to `t_s` under the input that holds.
    pub(super) fn predict(&mut self, t_s: f64) {
        let gap_s = t_s - self.t_s;
        if gap_s <= 0.0 {
            return;
        }
        let steps = (gap_s / STEP_S).ceil().clamp(1.0, 6000.0);
        for _ in 0..steps as usize {
            self.step(gap_s / steps);
        }
        self.t_s = t_s;
    }

    fn step(&mut self, h: f64) {
        let step = Step { t_s: self.t_s, h_s: h };
        let commanded = self.input.at(self.t_s + 0.5 * h);
        let input = self.model.actuate(&step, &commanded);
        let linearisation = self.model.linearise(self.t_s, &self.x, &input);
        let snapshot = Snapshot {
            share: self.t_s / self.duration_s.max(1.0),
            x: &self.x,
            heading: self.heading(),
            input: &commanded,
            distance_m: 0.0,
        };
        let f: [f64; 12] = (linearisation.f + regressors::motion(&self.setup.proposed, &snapshot)).into();
        let dense = linearisation.F();
        let ah = matrix::square(|i, j| dense[(i, j)] * h);
        // e^{Ah} − I to third order: at 0.1 s and a roll stiffness of 4/s the next term is 1e-3 of the step.
        let ah2 = matrix::times(&ah, &ah);
        let ah3 = matrix::times(&ah2, &ah);
        let mut d = ah;
        for (d, (second, third)) in d.iter_mut().zip(ah2.iter().zip(&ah3)) {
            for (d, (second, third)) in d.iter_mut().zip(second.iter().zip(third)) {
                *d += *second * 0.5 + *third * (1.0 / 6.0);
            }
        }
        let turned = matrix::transpose(&ah);
        let once = matrix::apply_turned(&turned, &f);
        let twice = matrix::apply_turned(&turned, &once);
        let increment: [f64; 12] = std::array::from_fn(|i| (f[i] + 0.5 * once[i] + twice[i] / 6.0) * h);

        self.colours.step(h, &d);
        self.step_slopes((&step, &commanded), &linearisation.f, &turned, &d);

        for (x, increment) in self.x.iter_mut().zip(increment) {
            *x += increment;
        }
        self.x[PSI] = wrap_angle(self.x[PSI]);
        let moved = VehicleState::from(increment) / h;
        self.model.follow(&step, &moved, &self.x);
        for term in &mut self.terms {
            if let Kind::Effects { with, without, .. } = &mut term.kind {
                with.follow(&step, &moved, &self.x);
                without.iter_mut().for_each(|without| without.follow(&step, &moved, &self.x));
            }
        }
        // Half of the noise before and half behind, the trapezoid of ∫ Φ Q Φᵀ: good to the square of the step over the
        // time constants.
        let half = psd(self.noise()).map(|q| 0.5 * h * q);
        self.shake(&half);
        matrix::propagate(&d, &mut self.p);
        self.shake(&half);
        self.t_s += h;
    }

    /// Adds variance to the velocities.
    fn shake(&mut self, variance: &[f64; 6]) {
        for (i, variance) in (U..).zip(variance) {
            *matrix::at_mut(&mut self.p[i], i) += variance;
        }
    }

    fn noise(&self) -> &ProcessNoise {
        if self.x[Z] < self.setup.surface.depth_m { &self.setup.surface.noise } else { &self.setup.noise }
    }

    /// ∂x/∂θ ← Φ ∂x/∂θ + ∫ ∂f/∂θ.
    fn step_slopes(
        &mut self,
        (step, commanded): (&Step, &ActuatorInput),
        f: &VehicleState,
        turned: &Square,
        d: &Square,
    ) {
        self.wake();
        let h = step.h_s;
        if self.columns == 0 {
            return;
        }
        let (lines, groups) = (self.lines(), self.live_groups());
        for group in self.slopes.chunks_exact_mut(lines).take(groups) {
            if let Some((states, colours)) = group.split_first_chunk_mut() {
                matrix::add_product(d, states);
                for (colour, line) in colours.iter_mut().enumerate() {
                    let kept = self.colours.kept(colour);
                    *line = line.map(|four| four * kept);
                }
            }
        }

        let t_s = self.t_s;
        let heading = self.heading();
        let share = t_s / self.duration_s.max(1.0);
        let snapshot = Snapshot { share, x: &self.x, heading, input: commanded, distance_m: 0.0 };
        for term in &mut self.terms {
            let active = term.onsets_s.iter().filter(|onset| **onset <= t_s).count();
            if active == 0 {
                continue;
            }
            // (I h + A h²/2) ∂f/∂θ, of a monomial a column of it.
            let by_one = |place: usize, df: f64| -> [f64; 12] {
                std::array::from_fn(|i| {
                    (if i == place { df } else { 0.0 } + 0.5 * (matrix::at(&turned[place], i) * df)) * h
                })
            };
            let moved: [f64; 12] = match &mut term.kind {
                Kind::GenericTerm { target: Target::Acceleration(dof), factor } => {
                    by_one(U + usize::from(*dof), factor.value(&snapshot))
                }
                Kind::GenericTerm { target: Target::Water(axis), factor } => {
                    by_one(X + usize::from(*axis), factor.value(&snapshot))
                }
                Kind::Effects { with, without, unit, in_process: true, .. } => {
                    let moved = with.actuate(step, commanded);
                    let after = with.derivative(t_s, &self.x, &moved);
                    let before = match without {
                        None => *f,
                        Some(without) => {
                            let input = without.actuate(step, commanded);
                            without.derivative(t_s, &self.x, &input)
                        }
                    };
                    let df = (after - before) / *unit;
                    let once = matrix::apply_turned(turned, &df.into());
                    std::array::from_fn(|i| (df[i] + 0.5 * once[i]) * h)
                }
                _ => continue,
            };
            for place in &self.place[term.first..][..active] {
                let group = &mut self.slopes[place / LANES * lines..][..12];
                for (line, value) in group.iter_mut().zip(&moved) {
                    *matrix::at_mut(line, place % LANES) += value;
                }
            }
        }
    }
}

fn psd(noise: &ProcessNoise) -> [f64; 6] {
    let ([u, v, w], [p, q, r]) = (noise.linear_mps2_per_sqrt_hz, noise.angular_radps2_per_sqrt_hz);
    [u, v, w, p, q, r].map(|root| root * root)
}
