//! The model of a vessel with propellers and rudders on or near the surface, of the terms of [`super::planar`].

use super::planar::{Manoeuvre, Part, Term, terms};
use super::readings::Reading;
use backseat_logs::Column;

/// Axes of the model: surge, sway, yaw.
pub const AXES: [&str; 3] = ["surge", "sway", "yaw"];
/// Longest step of the integration, s: time constants of vessels are seconds.
const LONGEST_STEP_S: f64 = 0.2;

/// A coefficient of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficient {
    /// 0 surge, 1 sway, 2 yaw.
    pub axis: usize,
    /// Place among the terms of the axis.
    pub term: usize,
    /// Value, in the unit of the term.
    pub value: f64,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
}

/// Surge, sway and yaw of one vessel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ManoeuvringModel {
    /// Columns of its propellers and of its rudders in a log.
    pub actuators: [Vec<Column>; 2],
    /// Its coefficients; terms that are left out are zero.
    pub coefficients: Vec<Coefficient>,
}

impl ManoeuvringModel {
    /// The terms of an axis.
    pub fn terms(&self, axis: usize) -> impl Iterator<Item = Term> {
        terms(axis, [0, 1].map(|kind| self.actuators[kind].len()))
    }

    /// Name and unit of a coefficient: that of its term, and its propeller or rudder where there are several.
    #[must_use]
    pub fn name(&self, coefficient: &Coefficient) -> (String, &'static str) {
        let Some(term) = self.terms(coefficient.axis).nth(coefficient.term) else { return (String::new(), "") };
        let unit = term.unit(coefficient.axis);
        match term.part {
            Part::Propeller(place) if self.actuators[0].len() > 1 => (format!("{}_{}", term.name, place + 1), unit),
            Part::Rudder(place) if self.actuators[1].len() > 1 => (format!("{}_{}", term.name, place + 1), unit),
            _ => (term.name.to_owned(), unit),
        }
    }

    /// Accelerations in surge and sway, m/s², and of the yaw rate, rad/s².
    #[must_use]
    pub fn acceleration(&self, of: &Manoeuvre<'_>) -> [f64; 3] {
        acceleration(&self.laws(), of)
    }

    /// Axis, coefficient and term, ready for many steps.
    fn laws(&self) -> Vec<(usize, f64, Term)> {
        let law = |c: &Coefficient| Some((c.axis, c.value, self.terms(c.axis).nth(c.term)?));
        self.coefficients.iter().filter_map(law).collect()
    }

    /// The states u, v, r, heading, north, east at the readings, from one at the first.
    #[must_use]
    pub fn simulate(&self, start: [f64; 6], readings: &[Reading]) -> Vec<[f64; 6]> {
        self.integrate(start, readings, |[_, _, r, heading, ..], _| [*r, *heading])
    }

    /// Positions north, east at the readings, from the place and the velocity of the first: the model moves the vessel
    /// along the measured heading.
    #[must_use]
    pub fn track(&self, readings: &[Reading]) -> Vec<[f64; 2]> {
        let Some(first) = readings.first() else { return Vec::new() };
        let ([u, v, r], [north, east]) = (first.velocity, first.position_m.unwrap_or_default());
        let states = self.integrate([u, v, r, first.heading_rad, north, east], readings, |_, measured| measured);
        states.into_iter().map(|[.., north, east]| [north, east]).collect()
    }

    /// Integrates; `turn` chooses yaw rate and heading, of the state or as measured. Propellers, rudders and what was
    /// measured run linearly from one reading to the next.
    fn integrate(
        &self,
        start: [f64; 6],
        readings: &[Reading],
        turn: impl Fn(&[f64; 6], [f64; 2]) -> [f64; 2],
    ) -> Vec<[f64; 6]> {
        let laws = self.laws();
        let moved = |x: &[f64; 6], slope: &[f64; 6], by: f64| [0, 1, 2, 3, 4, 5].map(|i| x[i] + slope[i] * by);
        let (mut propellers, mut rudders) = (Vec::new(), Vec::new());
        let mut x = start;
        let mut states = vec![x];
        for pair in readings.windows(2) {
            let [from, to] = [&pair[0], &pair[1]];
            let steps = ((to.t_s - from.t_s) / LONGEST_STEP_S).ceil().max(1.0);
            let dt = (to.t_s - from.t_s) / steps;
            for step in 0..steps as usize {
                let share = (step as f64 + 0.5) / steps;
                let between = |a: f64, b: f64| a + share * (b - a);
                let fill = |of: &mut Vec<f64>, a: &[f64], b: &[f64]| {
                    of.clear();
                    of.extend(a.iter().zip(b).map(|(a, b)| between(*a, *b)));
                };
                fill(&mut propellers, &from.propellers, &to.propellers);
                fill(&mut rudders, &from.rudders, &to.rudders);
                let measured = [between(from.velocity[2], to.velocity[2]), between(from.heading_rad, to.heading_rad)];
                let slope = |x: &[f64; 6]| {
                    let ([u, v, ..], [r, heading]) = (*x, turn(x, measured));
                    let at = Manoeuvre { velocity: [u, v, r], propellers: &propellers, rudders: &rudders };
                    let ([du, dv, dr], (sin, cos)) = (acceleration(&laws, &at), heading.sin_cos());
                    [du, dv, dr, r, u * cos - v * sin, u * sin + v * cos]
                };
                // the midpoint rule
                let middle = moved(&x, &slope(&x), 0.5 * dt);
                x = moved(&x, &slope(&middle), dt);
            }
            states.push(x);
        }
        states
    }
}

fn acceleration(laws: &[(usize, f64, Term)], of: &Manoeuvre<'_>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    laws.iter().for_each(|(axis, coefficient, term)| sum[*axis] += coefficient * term.value(of));
    sum
}

/// Columns of which more than `own_share` (root mean square) is not in those before them (Gram and Schmidt): place and
/// root mean square.
#[must_use]
pub fn separable(columns: &[Vec<f64>], own_share: f64) -> Vec<(usize, f64)> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (mut basis, mut chosen): (Vec<Vec<f64>>, Vec<(usize, f64)>) = (Vec::new(), Vec::new());
    for (place, column) in columns.iter().enumerate() {
        let mut own = column.clone();
        let size = dot(&own, &own).sqrt();
        for other in &basis {
            let share = dot(&own, other);
            own.iter_mut().zip(other).for_each(|(own, other)| *own -= share * other);
        }
        let left = dot(&own, &own).sqrt();
        if size > 0.0 && left > own_share * size {
            own.iter_mut().for_each(|own| *own /= left);
            basis.push(own);
            chosen.push((place, size / (column.len() as f64).sqrt()));
        }
    }
    chosen
}

#[cfg(test)]
mod tests;
