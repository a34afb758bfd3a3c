//! A flight drawn by a seed: what changes, by how much, and when.

use crate::draw::Draw;
use anyhow::Context;
use backseat_core::effects::FIN_NAMES;
use backseat_core::navigation::naming::Cause;
use hil_sim::scenario::Scenario;
use serde::{Deserialize, Serialize};

/// What is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// One cause of the table.
    One,
    /// Two of them.
    Two,
    /// None.
    None,
    /// One that is not in the table.
    Outside,
}

/// A change that was drawn.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Change {
    /// What is written into the scenario.
    pub text: String,
    /// Its number in the board's table; 0: it is not there.
    pub cause: u8,
    /// Its numbers, in the cause's units.
    pub size: [f64; 2],
    /// When, s.
    pub time_s: f64,
}

/// A flight that was drawn.
#[derive(Clone, Debug)]
pub struct Drawn {
    pub kind: Kind,
    pub changes: Vec<Change>,
    pub scenario: Scenario,
}

const SURVEY: &str = include_str!("../../../../hil-sim/scenarios/survey.toml");

/// The flight of a seed.
///
/// # Errors
/// A scenario that was drawn and cannot be read.
pub fn drawn(seed: u64, minutes: f64) -> anyhow::Result<Drawn> {
    let mut draw = Draw::new(seed);
    let kind = [Kind::One, Kind::None, Kind::One, Kind::Two, Kind::One, Kind::Outside, Kind::One][(seed % 7) as usize];
    let mut changes = Vec::new();
    let mut groups: Vec<&str> = Vec::new();
    let count = match kind {
        Kind::None => 0,
        Kind::One | Kind::Outside => 1,
        Kind::Two => 2,
    };
    while changes.len() < count {
        let time_s = draw.between(600.0, 5400.0);
        let (group, change) =
            if kind == Kind::Outside { outside(&mut draw, time_s) } else { inside(&mut draw, time_s) };
        if !groups.contains(&group) {
            groups.push(group);
            changes.push(change);
        }
    }
    let texts: Vec<&str> = changes.iter().map(|change| change.text.as_str()).collect();
    let scenario = survey(seed, minutes, &texts.join("\n"))?;
    Ok(Drawn { kind, changes, scenario })
}

/// The default survey with a seed, an end and more text.
pub fn survey(seed: u64, minutes: f64, more: &str) -> anyhow::Result<Scenario> {
    let duration_s = 60.0 * minutes;
    let mut text = SURVEY.replace("\nseed = 1\n", &format!("\nseed = {seed}\n"));
    text = text.replace("duration_s = 12_000.0", &format!("duration_s = {duration_s:?}"));
    text.push('\n');
    text.push_str(more);
    Scenario::with_built_in_vehicle(&text, &format!("naming_{seed}.toml")).context(text.clone())
}

fn change(text: String, cause: Option<Cause>, size: [f64; 2], time_s: f64) -> Change {
    Change { text, cause: cause.map_or(0, Cause::number), size, time_s }
}

fn fault(name: &str, what: &str, time_s: f64) -> String {
    format!("[[fault]]\nname = \"{name}\"\n{what}\nfrom_s = {time_s:?}\nuntil_s = 1e5\n")
}

/// A cause of the table, and what it must not come with twice.
fn inside(draw: &mut Draw, time_s: f64) -> (&'static str, Change) {
    let fin = draw.below(4);
    let name = FIN_NAMES[fin];
    match draw.below(11) {
        0 => {
            let lost = draw.between(0.05, 0.4);
            let text = format!("[effects.fouling]\nshare = {:?}\ntime_s = {time_s:?}\n", 1.0 - lost);
            ("thrust", change(text, Some(Cause::ThrustLost), [lost, 0.0], time_s))
        }
        1 => {
            let grown = draw.between(0.08, 0.6);
            let text = format!("[effects.entanglement]\nfactor = {:?}\ntime_s = {time_s:?}\n", 1.0 + grown);
            ("thrust", change(text, Some(Cause::DragGrown), [grown, 0.0], time_s))
        }
        2 | 3 => {
            let share = draw.between(0.0, 0.6);
            let text = format!("[effects.fin_lost]\nfin = \"{name}\"\nshare = {share:?}\ntime_s = {time_s:?}\n");
            ("fin", change(text, Some(Cause::FinLost(fin as u8)), [1.0 - share, 0.0], time_s))
        }
        4 | 5 => {
            let rad = draw.signed(0.01, 0.05);
            let text = format!("[effects.fin_stuck]\nfin = \"{name}\"\nrad = {rad:?}\ntime_s = {time_s:?}\n");
            ("fin", change(text, Some(Cause::FinStuck(fin as u8)), [rad, 1.0], time_s))
        }
        6 => {
            let (kg, x_m) = (draw.between(0.04, 0.14), draw.between(-0.3, 0.3));
            let text =
                format!("[effects.flooding]\nkg = {kg:?}\nkg_per_s = 0.005\nx_m = {x_m:?}\ntime_s = {time_s:?}\n");
            ("weight", change(text, Some(Cause::WeightChanged), [kg, kg * x_m], time_s))
        }
        7 | 8 => {
            let [north, east] = [draw.signed(0.03, 0.25), draw.signed(0.03, 0.25)];
            let text =
                format!("[environment.current]\nnorth_mps = {north:?}\neast_mps = {east:?}\nonset_s = {time_s:?}\n");
            ("current", change(text, Some(Cause::CurrentChanged), [north, east], time_s))
        }
        9 => {
            let rad = draw.signed(0.02, 0.08);
            let text = fault("heading_jump", &format!("heading_rad = {rad:?}"), time_s);
            ("heading", change(text, Some(Cause::HeadingOffset), [rad, 0.0], time_s))
        }
        _ => {
            let rate_mps = draw.signed(0.0005, 0.003);
            let text = fault("depth_drift", &format!("rate_mps = {rate_mps:?}"), time_s);
            ("depth", change(text, Some(Cause::DepthDrift), [3600.0 * rate_mps, 0.0], time_s))
        }
    }
}

/// What no cause of the table is.
fn outside(draw: &mut Draw, time_s: f64) -> (&'static str, Change) {
    let text = match draw.below(3) {
        0 => {
            let (share, extra_m) = (draw.between(0.3, 0.7), draw.size(3.0, 20.0));
            fault("multipath", &format!("share = {share:?}\nextra_m = {extra_m:?}"), time_s)
        }
        1 => fault("heading_drift", &format!("rate_radps = {:?}", draw.signed(5e-6, 5e-5)), time_s),
        _ => {
            let (sigma_m, period_s) = (draw.size(3.0, 10.0), draw.size(600.0, 2400.0));
            fault("ship_wander", &format!("sigma_m = {sigma_m:?}\nperiod_s = {period_s:?}"), time_s)
        }
    };
    ("outside", change(text, None, [0.0; 2], time_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_can_be_read_and_is_the_same_again() {
        for seed in 0..70 {
            let first = drawn(seed, 200.0).unwrap();
            let again = drawn(seed, 200.0).unwrap();
            let texts = |drawn: &Drawn| drawn.changes.iter().map(|change| change.text.clone()).collect::<Vec<_>>();
            assert_eq!(texts(&first), texts(&again));
        }
    }
}
