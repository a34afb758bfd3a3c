//! The way between fixes against heading and speed.
//!
//! The heading may be recorded as any reflection or quarter turn of itself, and so may the fixes. Each of the eight is
//! fitted with a factor of the speed and a current; the current is held to what the sea has.

use super::grid::Grid;
use super::legs::{Leg, Legs, Way, polar};
use super::relation::{Demand, Outcome, Relation, State};
use super::slope::{Equation, Slope};
use crate::log::Column;
use crate::stats::{mean, median};
use nalgebra::Normed;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::f64::consts::FRAC_PI_2;

const PLACE: &[Column] = &[Column::Heading];
const USES: &[Column] = &[
    Column::GpsX,
    Column::GpsY,
    Column::RefNorth,
    Column::RefEast,
    Column::DvlU,
    Column::DvlV,
    Column::SpeedLog,
    Column::WaterSpeed,
];

pub const RELATIONS: [Relation; 4] = [
    Relation { name: "course against heading", needs: PLACE, uses: USES, test: course },
    Relation { name: "speed over ground against speed", needs: PLACE, uses: USES, test: gross_speed },
    Relation { name: "unit of the speed against fixes", needs: PLACE, uses: USES, test: speed },
    Relation {
        name: "sway against fixes",
        needs: &[Column::Heading, Column::DvlU, Column::DvlV],
        uses: USES,
        test: sway,
    },
];

/// What a current costs beside what it explains: 0.5 m/s of it counts as 0.25 m/s of misfit.
const CURRENT_WEIGHT: f64 = 0.25;
/// Speed below which a vessel may drift, m/s.
const DRIFT_MPS: f64 = 0.4;
/// The same where a speed is logged, of which it is to make a share of its typical one.
const STILL_MPS: f64 = 0.15;
/// Fewest legs that tell two hypotheses apart, and the chance that is none where most of the misfit goes as well.
const ENOUGH: usize = 5;
const CHANCE: f64 = 2e-3;
/// Share of the misfit that the right hypothesis may leave: noise of fixes on short legs.
const LEFT: f64 = 0.4;
/// Fewest legs for "no relation".
const MANY: usize = 12;

/// A hypothesis: the heading is reflected, then turned by quarters.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Turned {
    is_reflected: bool,
    quarters: i32,
}

impl Turned {
    fn apply(self, way: Way) -> Way {
        let way = if self.is_reflected { way.conj() } else { way };
        way * polar(1.0, f64::from(self.quarters) * FRAC_PI_2)
    }
}

fn no_legs() -> Outcome {
    Outcome::untested("no fixes, or no reference velocity, over a time with heading")
}

/// Legs on which the vehicle makes way, as (fixed, reckoned) per second.
fn moving(legs: &Legs) -> Vec<(Way, Way)> {
    let typical =
        median(&legs.legs.iter().map(|leg| leg.ahead.norm() / leg.seconds).collect::<Vec<_>>()).unwrap_or(0.0);
    let is_moving = |leg: &&Leg| {
        let (fixed, ahead) = (leg.fixed.norm() / leg.seconds, leg.ahead.norm() / leg.seconds);
        if legs.speed.is_none() { fixed > DRIFT_MPS } else { fixed > STILL_MPS && ahead > 0.3 * typical }
    };
    let rate = |leg: &Leg| (leg.fixed / leg.seconds, (leg.ahead + leg.aside) / leg.seconds);
    legs.legs.iter().filter(is_moving).flat_map(|leg| std::iter::repeat_n(rate(leg), leg.counts)).collect()
}

/// Factor of the speed and current that fit best, and the misfit of each leg, (m/s)².
fn fit(ways: &[(Way, Way)], turned: Turned) -> Vec<f64> {
    let n = ways.len() as f64;
    let turned: Vec<(Way, Way)> = ways.iter().map(|&(fixed, reckoned)| (fixed, turned.apply(reckoned))).collect();
    let (mut factor, mut current) = (1.0, Way::default());
    for _ in 0..20 {
        let (mut dot, mut square) = (0.0, 1e-12);
        for (fixed, reckoned) in &turned {
            dot += ((fixed - current) * reckoned.conj()).re;
            square += reckoned.norm_sqr();
        }
        factor = (dot / square).max(0.2 * rms(&turned, |way| way.0) / rms(&turned, |way| way.1).max(1e-9));
        let left: Way = turned.iter().map(|(fixed, reckoned)| fixed - reckoned * factor).sum();
        current = left / (n * (1.0 + CURRENT_WEIGHT));
    }
    let cost = CURRENT_WEIGHT * current.norm_sqr();
    turned.iter().map(|(fixed, reckoned)| (fixed - reckoned * factor - current).norm_sqr() + cost).collect()
}

/// Angle from the reckoned way to the fixed one, rad, clockwise, beside a current, and one sigma of it. `None` on too few
/// legs, or on legs of one course.
pub fn turn(grid: &Grid) -> Option<[f64; 2]> {
    let legs = Legs::of(grid).filter(|legs| legs.speed.is_some())?;
    let ways = moving(&legs);
    let n = ways.len() as f64;
    if ways.len() < MANY || concentration(ways.iter().map(|way| way.1)) > 0.8 {
        return None;
    }
    let mean = |of: fn(&(Way, Way)) -> Way| ways.iter().map(of).sum::<Way>() / n;
    let (fixed, reckoned) = (mean(|way| way.0), mean(|way| way.1));
    let square: f64 = ways.iter().map(|way| (way.1 - reckoned).norm_sqr()).sum();
    let factor = ways.iter().map(|way| (way.0 - fixed) * (way.1 - reckoned).conj()).sum::<Way>() / square;
    let left = |way: &(Way, Way)| (way.0 - fixed - factor * (way.1 - reckoned)).norm_sqr();
    let variance = ways.iter().map(left).sum::<f64>() / (2.0 * n - 4.0);
    Some([factor.im.atan2(factor.re), (variance / square).sqrt() / factor.norm()])
}

/// Angle between two ways, rad.
fn difference(a: Way, b: Way) -> f64 {
    let turn = a * b.conj();
    turn.im.atan2(turn.re).abs()
}

fn rms(ways: &[(Way, Way)], of: impl Fn(&(Way, Way)) -> Way) -> f64 {
    (ways.iter().map(|way| of(way).norm_sqr()).sum::<f64>() / ways.len().max(1) as f64).sqrt()
}

/// Length of the mean direction: 1 is one direction, 0 is all.
fn concentration(ways: impl Iterator<Item = Way>) -> f64 {
    let (sum, count) =
        ways.fold((Way::default(), 0.0), |(sum, count), way| (sum + way / way.norm().max(1e-9), count + 1.0));
    sum.norm() / f64::max(count, 1.0)
}

fn course(grid: &Grid) -> Outcome {
    let Some(legs) = Legs::of(grid) else { return no_legs() };
    let ways = moving(&legs);
    if ways.len() < ENOUGH {
        return Outcome::untested(format!("{} legs between fixes with way on", ways.len()));
    }
    let seconds = legs.legs.iter().map(|leg| leg.seconds).sum::<f64>();
    let narrow = concentration(ways.iter().map(|way| way.0));
    if legs.speed.is_none() && narrow > 0.95 {
        return Outcome::untested("one course, and no speed beside the fixes: what drifts looks the same");
    }
    let as_recorded = Turned { is_reflected: false, quarters: 0 };
    let all = [false, true]
        .into_iter()
        .flat_map(|is_reflected| (0..4).map(move |quarters| Turned { is_reflected, quarters }));
    let fitted: Vec<(Turned, Vec<f64>)> = all.map(|turned| (turned, fit(&ways, turned))).collect();
    let (own, power) = (&fitted[0].1, rms(&ways, |way| way.0).powi(2));
    let typical = |misfits: &[f64]| median(misfits).unwrap_or(f64::INFINITY);
    let angles: Vec<f64> = ways.iter().map(|(fixed, reckoned)| difference(*fixed, *reckoned).to_degrees()).collect();
    let angle = median(&angles).unwrap_or(0.0);
    let said = format!(
        "over {} legs or minutes of {} in {seconds:.0} s, course and heading_rad differ by {angle:.0} degrees (median)",
        ways.len(),
        legs.fixes
    );
    let total = |misfits: &[f64]| misfits.iter().map(|misfit| misfit.min(4.0 * power)).sum::<f64>();
    let best = fitted.iter().min_by(|a, b| total(&a.1).total_cmp(&total(&b.1))).unwrap_or(&fitted[0]);
    if best.0 != as_recorded && is_better(&ways, own, best) {
        return Outcome::new(State::Contradicted, said);
    }
    let unexplained = mean(&best.1).unwrap_or(0.0) / power;
    let turns = concentration(ways.iter().map(|way| way.1));
    let is_driven = legs.speed.is_some() || grid.has(Column::PropRpm);
    if unexplained > 0.5 && ways.len() >= MANY && is_driven && narrow.min(turns) < 0.9 {
        return Outcome::new(State::Contradicted, format!("{said}: heading_rad has no relation to the course"));
    }
    let holds = best.0 == as_recorded || typical(own) < 0.1 * power;
    let is_explained = mean(own).unwrap_or(0.0) < 0.5 * power;
    Outcome::new(if holds && is_explained { State::Holds } else { State::Untested }, said)
}

/// Whether a hypothesis fits where it differs from what was recorded, and that does not, beyond chance.
fn is_better(ways: &[(Way, Way)], own: &[f64], (turned, misfits): &(Turned, Vec<f64>)) -> bool {
    let differs = |way: &(Way, Way)| (way.1 - turned.apply(way.1)).norm() > 0.5 * way.1.norm();
    let telling: Vec<usize> = (0..ways.len()).filter(|&k| differs(&ways[k])).collect();
    if telling.len() < ENOUGH {
        return false;
    }
    let of = |misfits: &[f64]| telling.iter().map(|&k| misfits[k]).sum::<f64>();
    let gains: Vec<f64> = telling.iter().map(|&k| (own[k] - misfits[k]) / (own[k] + misfits[k]).max(1e-12)).collect();
    let count = gains.len() as f64;
    let average = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|gain| (gain - average).powi(2)).sum::<f64>() / (count - 1.0);
    // no smaller than a tenth: a fit without noise must not count as infinitely many legs
    let t = average / (variance.sqrt().max(0.1) / count.sqrt());
    let is_sure = StudentsT::new(0.0, 1.0, count - 1.0).is_ok_and(|student| student.sf(t) < CHANCE);
    is_sure && of(misfits) < LEFT * of(own)
}

/// Metres and seconds by the fixes against those by the speed, whatever the course.
fn gross_speed(grid: &Grid) -> Outcome {
    let Some(legs) = Legs::of(grid) else { return no_legs() };
    let Some(speed) = legs.speed else { return Outcome::untested("no speed is logged") };
    let ratios: Vec<f64> = legs
        .legs
        .iter()
        .filter(|leg| leg.ahead.norm() > 0.05 * leg.seconds || leg.fixed.norm() > DRIFT_MPS * leg.seconds)
        .flat_map(|leg| std::iter::repeat_n(leg.fixed.norm() / leg.ahead.norm().max(1e-6), leg.counts))
        .collect();
    let Some(ratio) = median(&ratios).filter(|_| ratios.len() >= ENOUGH) else {
        return Outcome::untested(format!("{} legs between fixes", ratios.len()));
    };
    let evidence =
        format!("{} cover {ratio:.3} times the way of {} (median of {} legs)", legs.fixes, speed.name(), ratios.len());
    // currents of half the speed are within the first
    let is_plain = |ratio: &f64| (0.5..1.7).contains(ratio);
    let beyond = ratios.iter().filter(|r| if ratio > 1.0 { **r > 2.2 } else { **r < 0.4 }).count();
    let state = if is_plain(&ratio) {
        State::Holds
    } else if beyond * 4 > ratios.len() * 3 {
        State::Contradicted
    } else {
        State::Untested
    };
    Outcome::new(state, evidence)
}

/// Which unknown of the track is looked at.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Ahead,
    Aside,
}

fn speed(grid: &Grid) -> Outcome {
    // a log through the water and a DVL on a slope are within
    track(grid, Part::Ahead, &Demand { gain: [0.7, 1.4], correlation: 0.6, stretch_s: SHORTEST_LEG_S })
}

fn sway(grid: &Grid) -> Outcome {
    track(grid, Part::Aside, &Demand { gain: [0.2, 5.0], correlation: 0.2, stretch_s: SHORTEST_LEG_S })
}

const SHORTEST_LEG_S: f64 = 10.0;

/// The way by fixes on the way ahead and aside, a turned heading and a steady current fitted beside.
fn track(grid: &Grid, part: Part, demand: &Demand) -> Outcome {
    let Some(legs) = Legs::of(grid) else { return no_legs() };
    let Some(speed) = legs.speed else { return Outcome::untested("no speed is logged") };
    let mut equations = Vec::new();
    for (stretch, leg) in legs.legs.iter().enumerate() {
        let turned = leg.ahead * Way::i();
        let [x, other] = if part == Part::Ahead { [leg.ahead, leg.aside] } else { [leg.aside, leg.ahead] };
        // per second, so that a long leg counts no more than a short one
        let per = 1.0 / leg.seconds;
        let row = |of: fn(&Way) -> f64, across: f64| Equation {
            stretch,
            y: of(&leg.fixed) * per,
            x: of(&x) * per,
            others: [of(&other) * per, of(&turned) * per, 1.0 - across, across],
        };
        equations.push(row(|way| way.re, 0.0));
        equations.push(row(|way| way.im, 1.0));
    }
    let x = if part == Part::Ahead { speed.name() } else { "dvl_v_mps" };
    Outcome::of([Slope::of(equations)], x, &format!("the way by {}", legs.fixes), demand)
}
