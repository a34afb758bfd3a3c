//! A flight drawn by a seed: mission, place, ship, devices, and none to three classes of trouble.

use super::classes::{CLASSES, NONE, Which};
use crate::draw::{Draw, rounded};
use anyhow::Context;
use hil_sim::scenario::Scenario;
use std::fmt::Write as _;

/// Shortest flight, h.
const SHORTEST_H: f64 = 0.5;

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// From which classes.
    pub which: Which,
    /// Longest flight, h.
    pub longest_h: f64,
}

/// A flight that was drawn.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Names of its classes.
    pub classes: Vec<&'static str>,
    /// Its text.
    pub text: String,
    /// What is flown.
    pub scenario: Scenario,
}

/// The flight of a seed.
///
/// # Errors
/// A scenario that was drawn and cannot be read.
pub fn drawn(seed: u64, options: Options) -> anyhow::Result<Drawn> {
    let mut draw = Draw::new(seed);
    let hours = draw.size(SHORTEST_H, options.longest_h.max(SHORTEST_H));
    draw.duration_s = rounded(3600.0 * hours);
    let mission = mission(&mut draw);
    let count = [0, 1, 1, 2, 2, 3][draw.below(6)];
    let places = options.which.places();
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < count {
        let next = places[draw.below(places.len())];
        if chosen.iter().all(|&other| CLASSES[other].group != CLASSES[next].group) {
            chosen.push(next);
        }
    }
    chosen.sort_unstable();
    let trouble: Vec<String> = chosen.iter().map(|&place| (CLASSES[place].write)(&mut draw)).collect();
    let wrong_share = draw.wrong_share;
    let text = format!(
        "name = \"drawn_{seed}\"\nseed = {seed}\nvehicle = \"../iver3.toml\"\n{mission}wrong_share = {wrong_share}\n\n{}",
        trouble.join("\n")
    );
    let scenario = Scenario::with_built_in_vehicle(&text, &format!("drawn_{seed}.toml")).context(text.clone())?;
    let mut classes: Vec<&str> = chosen.iter().map(|&place| CLASSES[place].name).collect();
    if classes.is_empty() {
        classes.push(NONE);
    }
    Ok(Drawn { classes, text, scenario })
}

/// Mission, place and ship; ends within `[backseat]`.
fn mission(draw: &mut Draw) -> String {
    let duration_s = draw.duration_s;
    let length_m = draw.between(200.0, 1000.0);
    let spacing_m = draw.between(30.0, 100.0);
    let speed_mps = draw.between(0.8, 1.4);
    // a line, its turn and its run-out
    let line_s = (length_m + 2.0 * spacing_m) / speed_mps;
    let lines = (((duration_s - 300.0) / line_s).floor() as usize).clamp(1, 60);
    let depth_m = draw.size(2.0, 12.0);
    let width_m = spacing_m * (lines as f64 - 1.0);
    let (north_m, east_m) = (rounded(0.5 * length_m), rounded(0.5 * width_m));
    let heading_rad = 0.0;
    let radius_m = rounded(draw.between(0.5, 1.0) * length_m.max(width_m) + 100.0);
    let bearing_rad = draw.between(0.0, 6.2);
    let ship_mps = draw.between(0.7, 2.0);
    let period_s = [15, 30, 30, 60][draw.below(4)];
    let dvl = draw.below(3) == 0;
    let mut text = String::new();
    let _ = write!(
        text,
        "duration_s = {duration_s:?}
start = {{ x_m = -100.0, y_m = 0.0, depth_m = 0.07, heading_rad = {heading_rad:?}, speed_mps = 0.0 }}
ship = {{ centre_m = [{north_m:?}, {east_m:?}], radius_m = {radius_m:?}, speed_mps = {ship_mps:?}, bearing_rad = {bearing_rad:?} }}
acoustics = {{ period_s = {period_s} }}

[mission.lawnmower]
lines = {lines}
length_m = {length_m:?}
spacing_m = {spacing_m:?}
first_line_m = [0.0, 0.0]
heading_rad = {heading_rad:?}
speed_mps = {speed_mps:?}
depth_m = {depth_m:?}
dive_m = 40.0
run_out_m = 100.0

[environment]
magnetic_declination_rad = -0.2443
bottom_depth_m = 40.0

[backseat]
receiver_bias_m = 1.5
dvl = {dvl}
"
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every class can be read, and a seed draws the same again; classes held back are never drawn for work.
    #[test]
    fn what_is_drawn_can_be_read_and_is_the_same_again() {
        for which in [Which::Work, Which::Held, Which::All] {
            let options = Options { which, longest_h: 12.0 };
            for seed in 0..300 {
                let first = drawn(seed, options).unwrap();
                assert_eq!(first.text, drawn(seed, options).unwrap().text);
                let allowed =
                    |name: &&str| *name == NONE || which.places().iter().any(|&place| CLASSES[place].name == *name);
                assert!(first.classes.iter().all(allowed), "{:?}", first.classes);
            }
        }
    }
}
