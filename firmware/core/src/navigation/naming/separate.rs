//! Which manoeuvre tells two causes apart that the flight so far does not.
//!
//! With θ_A and θ_B the two causes, each of the size that explains the past best, a manoeuvre that moves the vehicle and
//! its fins by (x, u) away from a straight line (x₀, u₀) adds to the difference of their predictions
//!
//!   d = ∂v̇/∂θ(x, u) (θ_A − θ_B) − ∂v̇/∂θ(x₀, u₀) (θ_A − θ_B)
//!
//! What is seen of it at once counts by the noise of accelerations that `identify --plan` takes, what is not, surge and
//! sway, currents and the compass, by the place that it leads to, of which ranges see one direction. If one of the two is
//! true, the logarithm of their odds is expected to move towards it by half the sum of the squares, as far as evidence
//! counts: less where innovations are coloured, and where large changes are not linear.

use super::candidate::Candidate;
use super::causes::{ALL, CAUSES, Cause};
use super::columns::{COLUMNS, CURRENT, HEADING, accelerations};
use crate::control::Manoeuvre;
use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::identification::ACCELERATION_NOISE;
use crate::state::{PSI, U, VehicleState};

/// Both are at least so probable ...
const LEAST: f64 = 0.05;
/// ... and together so much ...
const TOGETHER: f64 = 0.9;
/// ... after so many blocks in a row: three minutes.
const DWELL: u16 = 9;
/// One sigma of a place by ranges, m.
const PLACE_M: f64 = 1.0;
/// Step of the prediction, s.
const STEP_S: f64 = 1.0;

/// The two causes that are the most probable; all bytes zero: none.
pub(super) struct Pair {
    /// Their places in the table, the lower one first.
    places: [usize; 2],
    /// After so many blocks in a row both have been open.
    blocks: u16,
    /// Their sizes and onsets, as weighed last.
    of: [([f64; 2], u64); 2],
    /// Evidence counts to one over that.
    width: f64,
    /// ln of the evidence of each cause, as weighed last with none taken as there.
    log_sums: [f64; CAUSES],
}

impl Pair {
    pub(super) const NONE: Self =
        Self { places: [0; 2], blocks: 0, of: [([0.0; 2], 0); 2], width: 0.0, log_sums: [0.0; CAUSES] };

    pub(super) fn forget(&mut self) {
        self.blocks = 0;
    }

    /// All causes have been weighed; `width`: evidence counts to one over that.
    pub(super) fn see(&mut self, candidates: &[Candidate; CAUSES], width: f64) {
        self.width = width;
        let mut order = [(0, f64::NEG_INFINITY); 2];
        for (i, (candidate, own)) in candidates.iter().zip(&mut self.log_sums).enumerate() {
            *own = candidate.log_sum;
            let [first, second] = &mut order;
            if candidate.log_sum > first.1 {
                (*first, *second) = ((i, candidate.log_sum), *first);
            } else if candidate.log_sum > second.1 {
                *second = (i, candidate.log_sum);
            }
        }
        let [(one, best), (two, next)] = order;
        let share = |log_sum: f64| libm::exp((log_sum - best) / width);
        let sum: f64 = candidates.iter().map(|candidate| share(candidate.log_sum)).sum();
        let is_open = share(next) > LEAST * sum && 1.0 + share(next) > TOGETHER * sum;
        let places = if one < two { [one, two] } else { [two, one] };
        let before = if places == self.places { self.blocks } else { 0 };
        (self.places, self.blocks) = (places, if is_open { before.saturating_add(1) } else { 0 });
        for (own, place) in self.of.iter_mut().zip(places) {
            let candidate = candidates.get(place).copied().unwrap_or(Candidate::NONE);
            *own = (candidate.weighed.size, candidate.time_us);
        }
    }

    /// Open for long enough.
    pub(super) fn is_undecided(&self) -> bool {
        self.blocks >= DWELL
    }

    /// ln of the evidence for a cause, as far as it counts.
    pub(super) fn evidence(&self, cause: Cause) -> f64 {
        let place = usize::from(cause.number()).checked_sub(1);
        place.and_then(|place| self.log_sums.get(place)).copied().unwrap_or(0.0) / self.width()
    }

    /// Evidence counts to one over that where innovations are white.
    pub(super) fn width(&self) -> f64 {
        self.width.max(1.0)
    }

    /// What one of them says less what the other does, of all columns; `hours`: of an onset.
    pub(super) fn difference(&self, hours: impl Fn(u64) -> f64) -> [f64; COLUMNS] {
        let mut difference = [0.0; COLUMNS];
        for ((cause, (size, onset_us)), sign) in self.causes().iter().zip(&self.of).zip([1.0, -1.0]) {
            add(&mut difference, *cause, size, hours(*onset_us), sign);
        }
        difference
    }

    pub(super) fn causes(&self) -> [Cause; 2] {
        self.places.map(|place| ALL.get(place).copied().unwrap_or(Cause::ThrustLost))
    }
}

/// Adds a cause of a size to the numbers of all columns.
fn add(numbers: &mut [f64; COLUMNS], cause: Cause, size: &[f64; 2], onset_h: f64, sign: f64) {
    for (part, size) in cause.parts(onset_h).iter().zip(size) {
        for (column, weight) in part.iter().flat_map(|part| part.direction) {
            if let Some(number) = numbers.get_mut(column) {
                *number += sign * weight * size;
            }
        }
    }
}

/// What a difference of the causes does: accelerations, and a velocity over ground, north and east.
fn effect(
    model: &VehicleModel,
    x: &VehicleState,
    input: &ActuatorInput,
    difference: &[f64; COLUMNS],
    hours: f64,
) -> ([f64; 6], [f64; 2]) {
    let mut acceleration = [0.0; 6];
    for (column, number) in accelerations(model, x, input, hours).iter().zip(difference) {
        acceleration.iter_mut().zip(column).for_each(|(sum, a)| *sum += number * a);
    }
    let (sin, cos) = libm::sincos(x[PSI]);
    // who reads a heading that is too large believes to be further to the right than he is
    let off_rad = difference[HEADING] + difference[HEADING + 1] * sin + difference[HEADING + 2] * cos;
    let across_mps = -x[U] * off_rad;
    (acceleration, [difference[CURRENT] - sin * across_mps, difference[CURRENT + 1] + cos * across_mps])
}

/// Half the sum of the squares of what a manoeuvre adds to the difference of two causes, over its noise.
#[inline(never)]
pub(super) fn separation(
    manoeuvre: Manoeuvre,
    model: &VehicleModel,
    x: &VehicleState,
    input: &ActuatorInput,
    difference: &[f64; COLUMNS],
    hours: f64,
) -> f64 {
    let (straight, drift) = effect(model, x, input, difference, hours);
    let (mut at, mut squares) = (*x, 0.0);
    let (mut velocity, mut place) = ([0.0; 2], [0.0; 2]);
    let steps = (manoeuvre.duration_s() / STEP_S) as u32;
    for step in 0..steps {
        let t_s = STEP_S * (f64::from(step) + 0.5);
        let aside = manoeuvre.aside(t_s);
        let mut flown = *input;
        flown.propeller_radps *= 1.0 + aside.faster;
        // what holds the trim grows with the square of the speed; only surge is integrated
        let slower = x[U] / at[U].max(0.1);
        for (fin, more) in flown.fins_rad.iter_mut().zip(aside.fins_rad) {
            *fin = *fin * (slower * slower) + more;
        }
        at[PSI] = x[PSI] + manoeuvre.heading_rad(t_s, x[U]);
        let (own, over_ground) = effect(model, &at, &flown, difference, hours);
        let (sin, cos) = libm::sincos(at[PSI]);
        let [ahead, right, seen @ ..] = core::array::from_fn::<f64, 6, _>(|i| own[i] - straight[i]);
        for (a, noise) in seen.iter().zip(ACCELERATION_NOISE.iter().skip(2)) {
            squares += STEP_S * (a / noise) * (a / noise);
        }
        let forces = [cos * ahead - sin * right, sin * ahead + cos * right];
        for i in 0..2 {
            velocity[i] += STEP_S * forces[i];
            place[i] += STEP_S * (velocity[i] + over_ground[i] - drift[i]);
        }
        at[U] += STEP_S * (model.derivative(&at, &flown)[U] - model.derivative(x, input)[U]);
    }
    let seen_m = 0.5 * (place[0] * place[0] + place[1] * place[1]);
    0.5 * (squares + seen_m / (PLACE_M * PLACE_M))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::MANOEUVRES;
    use crate::dynamics::VehicleParameters;
    use crate::state::Z;

    /// Gains of all manoeuvres at 1 m/s, heading north.
    fn gains(one: (Cause, [f64; 2]), two: (Cause, [f64; 2])) -> [f64; 5] {
        let model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
        let mut x = VehicleState::zeros();
        (x[Z], x[U]) = (3.0, 1.0);
        let input = ActuatorInput { propeller_radps: 60.0, fins_rad: [0.01, -0.01, 0.02, -0.02] };
        let mut difference = [0.0; COLUMNS];
        for ((cause, size), sign) in [one, two].iter().zip([1.0, -1.0]) {
            add(&mut difference, *cause, size, 0.5, sign);
        }
        MANOEUVRES.map(|manoeuvre| separation(manoeuvre, &model, &x, &input, &difference, 1.0))
    }

    fn best(gains: [f64; 5]) -> Manoeuvre {
        let best = MANOEUVRES.iter().zip(gains).max_by(|(_, a), (_, b)| a.total_cmp(b));
        *best.unwrap().0
    }

    #[test]
    fn what_tells_two_causes_apart_is_chosen() {
        let lost = (Cause::FinLost(0), [0.4, 0.0]);
        // a rudder that is lost or stands gives another moment when it is moved; the elevator only brakes
        let rudder = gains(lost, (Cause::FinStuck(0), [0.02, 1.0]));
        assert_eq!(best(rudder), Manoeuvre::Rudder, "{rudder:?}");
        assert!(rudder[2] < 1e-3 * rudder[1], "{rudder:?}");
        let elevator = gains((Cause::FinLost(2), [0.4, 0.0]), (Cause::FinStuck(2), [0.02, 1.0]));
        assert_eq!(best(elevator), Manoeuvre::Elevator, "{elevator:?}");
        // a weight stays, the moment of a fin grows with the square of the speed
        let speed = gains((Cause::TrimAhead, [0.05, 0.0]), (Cause::FinSlipped(2), [0.02, 0.0]));
        assert_eq!(best(speed), Manoeuvre::Speed, "{speed:?}");
        // on one heading a compass that is off is a current
        let turn = gains((Cause::HeadingOffset, [-0.2, 0.0]), (Cause::CurrentChanged, [0.0, 0.2]));
        assert_eq!(best(turn), Manoeuvre::Turn, "{turn:?}");
        assert!(turn[..4].iter().all(|other| *other < 0.01 * turn[4]), "{turn:?}");
    }

    #[test]
    fn what_nothing_tells_apart_has_no_gain() {
        let clock = gains((Cause::ClockOffset, [3.0, 0.0]), (Cause::SoundSpeed, [0.01, 0.0]));
        assert_eq!(clock, [0.0; 5]);
        let same = gains((Cause::FinLost(1), [0.5, 0.0]), (Cause::FinLost(1), [0.5, 0.0]));
        assert_eq!(same, [0.0; 5]);
    }

    /// A closed form: a doublet of α moves a moment by the share of the fin that one has lost and the other has not.
    #[test]
    fn the_gain_of_a_doublet_is_that_of_its_moment() {
        let model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
        let mut x = VehicleState::zeros();
        x[U] = 1.0;
        let mut difference = [0.0; COLUMNS];
        add(&mut difference, Cause::FinLost(0), &[0.4, 0.0], 0.0, 1.0);
        let gain = separation(Manoeuvre::Rudder, &model, &x, &ActuatorInput::default(), &difference, 0.0);
        let wrench = model.fin_wrenches(&crate::state::velocity(&x), &[0.1, 0.0, 0.0, 0.0])[0];
        let a = model.acceleration_of(&wrench) * 0.4;
        let seen: f64 = (2..6).map(|i| a[i] / ACCELERATION_NOISE[i]).map(|seen| seen * seen).sum();
        assert!((gain / (0.5 * 8.0 * seen) - 1.0).abs() < 0.05, "{gain} {seen}");
    }

    #[test]
    fn two_causes_are_open_while_both_are_probable_and_no_other_is() {
        let mut candidates = [Candidate::NONE; CAUSES];
        for (candidate, log_sum) in candidates.iter_mut().zip([20.0, 18.5, 5.0]) {
            candidate.log_sum = log_sum;
        }
        let mut pair = Pair::NONE;
        for blocks in 1..4 {
            pair.see(&candidates, 1.0);
            assert_eq!((pair.blocks, pair.places), (blocks, [0, 1]));
        }
        candidates[1].log_sum = 20.5;
        pair.see(&candidates, 1.0);
        assert_eq!(pair.blocks, 4, "whichever leads");
        candidates[2].log_sum = 20.0;
        pair.see(&candidates, 1.0);
        assert_eq!(pair.blocks, 0, "a third");
        candidates[2].log_sum = 0.0;
        candidates[1].log_sum = 16.0;
        pair.see(&candidates, 1.0);
        assert_eq!(pair.blocks, 0, "one is sure");
    }
}
