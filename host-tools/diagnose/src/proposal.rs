//! From structure that no entry accounts for to a proposed term: a formula with units and an interval, and what it could
//! be physically.
//!
//! The terms are those that [`crate::structure`] selects: one after the other from a dictionary of monomials whose
//! dimensions make sense, each significant after the size of the dictionary and of use on blocks that it was not fitted
//! to. Here they become part of the model, their values are fitted together on the training blocks, and the held-out
//! blocks say what they are worth.

use crate::linear;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::regressors::{Factor, GenericTerm, Proposed, Regressor, Snapshot, Target, Variation, reading};
use crate::samples::ResidualChannel;
use crate::structure::Structure;
use crate::whitener::Pass;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::{P, PHI, PSI, U, VehicleState, Z};
use backseat_logs::log::{Column, Log};
use backseat_logs::stats::Z_95;
use std::borrow::Cow;

/// Steps of Gauss and Newton; the terms are linear but for what the filter makes of them.
const STEPS: usize = 3;

/// A term that would account for what is left.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposedTerm {
    /// Which.
    pub term: GenericTerm,
    /// Fitted on the training blocks, in units of its target per unit of its factor.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Probability under the null after the size of the dictionary.
    pub p: f64,
    /// By how much Σ e² falls beside the terms before it, over the whole log.
    pub gain: f64,
    /// The same on the held-out blocks, fitted on the others.
    pub held_gain: f64,
}

impl ProposedTerm {
    /// As an equation, with its number.
    #[must_use]
    pub fn formula(&self) -> String {
        let sign = if self.value < 0.0 { "-" } else { "+" };
        let number = format!("{:.4}", Scaled(self.value.abs()));
        let factor =
            if self.term.factor == Factor::One { String::new() } else { format!(" {}", self.term.factor.symbol()) };
        format!("{} {sign}= {number}{factor}", self.term.target.symbol())
    }

    /// The 95 % interval of the number in [`Self::formula`], whose sign stands before the number.
    #[must_use]
    pub fn interval(&self) -> String {
        let [low, high] = self.ci95;
        let [low, high] = if self.value < 0.0 { [-high, -low] } else { [low, high] };
        format!("{:.4} to {:.4}", Scaled(low), Scaled(high))
    }

    /// Unit of its value.
    #[must_use]
    pub fn unit(&self) -> String {
        let (target, factor) = (self.term.target.unit(), self.term.factor.unit());
        if factor == "1" { target.to_owned() } else { format!("({target})/({factor})") }
    }

    /// What it could be physically, where it is known what leaves such a term.
    #[must_use]
    pub fn physical_reading(&self) -> Option<String> {
        use Factor as F;
        use ResidualChannel as C;
        let (value, low) = (self.value, self.value.min(0.0) < 0.0);
        let text = match (self.term.target, self.term.factor) {
            (Target::Reading(C::Heading), F::YawRate) if low => format!("the heading is late by {:.2} s", -value),
            (Target::Reading(C::Pitch), F::PitchRate) if low => format!("the pitch is late by {:.2} s", -value),
            (Target::Reading(C::Heading), F::SinTwoHeading | F::CosTwoHeading) => "soft iron at the compass".to_owned(),
            (Target::Reading(C::Heading | C::P | C::Q | C::R), F::Time) => "the sensor drifts".to_owned(),
            (Target::Reading(C::R), F::YawRate) => "scale of the yaw gyro".to_owned(),
            (Target::Reading(C::DvlV), F::YawRate) => format!("the DVL sits {value:.2} m ahead of its declared place"),
            (Target::Reading(C::DvlU), F::YawRate) => {
                format!("the DVL sits {:.2} m to starboard of its declared place", -value)
            }
            (Target::Reading(C::DvlU), F::PitchRate) => format!("the DVL sits {value:.2} m below its declared place"),
            (Target::Reading(C::DvlV), F::RollRate) => format!("the DVL sits {:.2} m below its declared place", -value),
            (Target::Reading(C::DvlW), F::PitchRate) => {
                format!("the DVL sits {:.2} m ahead of its declared place", -value)
            }
            (Target::Reading(C::DvlW), F::RollRate) => {
                format!("the DVL sits {value:.2} m to starboard of its declared place")
            }
            (Target::Reading(C::DvlU | C::DvlV | C::DvlW), F::One) => "an offset of the DVL".to_owned(),
            (Target::Reading(C::Depth), F::SinPitch) => {
                "the depth cell sits ahead of or behind its declared place".to_owned()
            }
            (Target::Reading(C::Depth), F::SurgeSquared) => "dynamic pressure at the depth cell".to_owned(),
            (Target::Reading(C::Depth), F::Time) => "tide, or a drifting depth cell".to_owned(),
            (Target::Reading(C::Heading), F::Propeller) => "the motor's current turns the compass".to_owned(),
            (Target::Reading(C::Range), F::DistanceSquared) => {
                "curved rays: the speed of sound is not the same at all depths".to_owned()
            }
            (Target::Water(_), F::Depth) => "a current that changes with depth".to_owned(),
            (Target::Water(_), F::Time | F::TimeSquared) => "a current that changes with time".to_owned(),
            (Target::Acceleration(3), F::Propeller) => "the hull rolls against the propeller's torque".to_owned(),
            (Target::Acceleration(2), F::Depth) => {
                "the hull is compressed with depth, or water is lighter above".to_owned()
            }
            (Target::Acceleration(0), F::HeaveSquared | F::SwaySquared | F::YawRateAbs | F::FinSquares) => {
                "drag of a motion that the declared model leaves out".to_owned()
            }
            (Target::Acceleration(0), F::Surge | F::SurgeSquared) => "drag ahead".to_owned(),
            (Target::Acceleration(0), F::Propeller) => "thrust".to_owned(),
            (Target::Acceleration(0), F::Time) => "drag or thrust that changes with time".to_owned(),
            (Target::Acceleration(1), F::SwaySquared) => "sway drag that is not the same to both sides".to_owned(),
            (Target::Acceleration(2), F::HeaveSquared) => "heave drag that is not the same up and down".to_owned(),
            (Target::Acceleration(_), F::FinTop | F::FinBottom | F::FinPort | F::FinStarboard) => {
                "lift of this fin, or of its place".to_owned()
            }
            (Target::Acceleration(3..=5), F::One) => "a moment that is always there: trim".to_owned(),
            (Target::Acceleration(3..=5), F::SurgeSquared) => {
                "a moment by the flow: a bent fin, a sensor on one side".to_owned()
            }
            _ => return None,
        };
        Some(text)
    }
}

/// A number with four significant digits.
struct Scaled(f64);

impl std::fmt::Display for Scaled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = f.precision().unwrap_or(4) as i32;
        let places = digits - 1 - self.0.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
        write!(f, "{:.*}", places.clamp(0, 12) as usize, self.0)
    }
}

/// Makes the terms found part of the model: their values with intervals, and the pass with them. `None` without terms,
/// or where the model does not run with them.
#[must_use]
pub fn fit(log_data: &mut PreparedLog, structure: &Structure) -> Option<(Vec<ProposedTerm>, Pass)> {
    if structure.hints.is_empty() {
        return None;
    }
    let terms: Vec<GenericTerm> = structure.hints.iter().map(|hint| hint.generic).collect();
    let mut values: Vec<f64> = structure.hints.iter().map(|hint| hint.value).collect();
    let columns: Vec<usize> = (0..terms.len()).collect();
    let regressors: Vec<Regressor> = terms
        .iter()
        .map(|term| Regressor { cause: Variation::GenericTerm(*term), onsets_s: vec![f64::NEG_INFINITY] })
        .collect();
    let set = log_data.scope.declared;
    let with = |log_data: &mut PreparedLog, values: &[f64]| {
        log_data.setup.proposed = terms.iter().copied().zip(values.iter().copied()).collect();
        let pass = log_data.pass(&set, &regressors);
        log_data.setup.proposed.clear();
        pass
    };
    let mut pass = with(log_data, &values)?;
    for _ in 0..STEPS {
        let train = pass.normal.sum(|block| log_data.is_in(DataPart::Train, block));
        let step = linear::fit(&train, &columns, &[])?;
        let moved: Vec<f64> = values.iter().zip(&step.theta).map(|(value, step)| value + step).collect();
        let next = with(log_data, &moved)?;
        let square = |pass: &Pass| pass.normal.sum(|block| log_data.is_in(DataPart::Train, block)).square;
        if square(&next) > square(&pass) {
            break;
        }
        (values, pass) = (moved, next);
    }
    let train = pass.normal.sum(|block| log_data.is_in(DataPart::Train, block));
    let at = linear::fit(&train, &columns, &[])?;
    let at = linear::Fit { gain: 0.0, theta: vec![0.0; columns.len()], ..at };
    let sigmas = linear::sigmas(&pass.normal, |block| log_data.is_in(DataPart::Train, block), &columns, &at, &[]);
    let proposed = structure.hints.iter().zip(values).zip(sigmas).map(|((hint, value), sigma)| ProposedTerm {
        term: hint.generic,
        value,
        ci95: [value - Z_95 * sigma, value + Z_95 * sigma],
        p: hint.p,
        gain: hint.gain,
        held_gain: hint.held_gain,
    });
    Some((proposed.collect(), pass))
}

/// The log without what terms add to its readings; terms of other kinds change nothing here.
#[must_use]
pub fn corrected<'a>(log: &'a Log, proposed: &[Proposed]) -> Cow<'a, Log> {
    if !proposed.iter().any(|(term, _)| matches!(term.target, Target::Reading(_))) {
        return Cow::Borrowed(log);
    }
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let duration_s = log.duration_s().max(1.0);
    let mut x = VehicleState::zeros();
    let mut input = ActuatorInput::default();
    let mut corrected = log.clone();
    for row in &mut corrected.rows {
        for (first, at) in [(Column::Roll, PHI), (Column::P, P), (Column::DvlU, U)] {
            for axis in 0..3 {
                let column = Column::ALL[first as usize + axis];
                x[at + axis] = row.get(column).unwrap_or(x[at + axis]);
            }
        }
        x[Z] = row.get(Column::Depth).unwrap_or(x[Z]);
        input = row.actuators().unwrap_or(input);
        let share = (row.time_us - start_us) as f64 * 1e-6 / duration_s;
        let snapshot = Snapshot { share, x: &x, heading: x[PSI].sin_cos(), input: &input, distance_m: 0.0 };
        for (channel, column) in READINGS {
            let by = reading(proposed, channel, &snapshot);
            if let Some(value) = row.get(column).filter(|_| by != 0.0) {
                row.set(column, value - by);
            }
        }
        if let Some(read) = row.get(Column::Range) {
            // The term grows with the distance, not with what is read: r = read - k r², by repetition.
            let mut distance_m = read;
            for _ in 0..12 {
                distance_m = read - reading(proposed, ResidualChannel::Range, &Snapshot { distance_m, ..snapshot });
            }
            row.set(Column::Range, distance_m);
        }
    }
    let names: Vec<String> = proposed.iter().map(|(term, _)| term.name()).collect();
    corrected.notes.push(format!("readings without the proposed terms: {}", names.join(", ")));
    Cow::Owned(corrected)
}

/// Where the readings of channels stand in a log.
const READINGS: [(ResidualChannel, Column); 10] = [
    (ResidualChannel::Depth, Column::Depth),
    (ResidualChannel::Roll, Column::Roll),
    (ResidualChannel::Pitch, Column::Pitch),
    (ResidualChannel::Heading, Column::Heading),
    (ResidualChannel::P, Column::P),
    (ResidualChannel::Q, Column::Q),
    (ResidualChannel::R, Column::R),
    (ResidualChannel::DvlU, Column::DvlU),
    (ResidualChannel::DvlV, Column::DvlV),
    (ResidualChannel::DvlW, Column::DvlW),
];

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::log::LogRow;

    /// A range of 900 m that a curved ray made longer by 5e-5 r², and a heading beside it that no term concerns.
    #[test]
    fn val_curved_rays_are_taken_out_of_a_log() {
        let mut log = Log::default();
        log.rows.push(LogRow::new(0).set(Column::Range, 940.5).set(Column::Heading, 0.3).clone());
        let term = GenericTerm::find("range", "distance^2").unwrap();
        let row = corrected(&log, &[(term, 5e-5)]).rows[0].clone();
        assert!((row.get(Column::Range).unwrap() - 900.0).abs() < 1e-9, "{row:?}");
        assert_eq!(row.get(Column::Heading), Some(0.3));
    }
}
