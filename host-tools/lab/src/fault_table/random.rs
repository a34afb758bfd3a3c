//! Rows drawn by a seed: two or three faults and undeclared effects at a time, each with a size.

use super::Row;
use crate::draw::{Draw, rounded};
use anyhow::Context;
use hil_sim::rng::Stream;
use hil_sim::scenario::{End, Limits, Scenario};
use std::fmt::Write as _;

/// What nothing breaks: the mission, the ship, with a DVL or without.
const BASES: [&str; 2] = [
    include_str!("../../../../hil-sim/scenarios/faults/none.toml"),
    include_str!("../../../../hil-sim/scenarios/faults/none_dvl.toml"),
];

/// Writes one fault or effect. Sizes are log-uniform from what nobody notices to what nobody misses.
type Write = fn(&mut Draw) -> String;

/// Names and how each is drawn; of the same group only one is drawn in a row.
const POOL: [(&str, Write); 22] = [
    ("gnss", |d| {
        let until_s = d.between(30.0, 120.0);
        format!(
            "[[fault]]\nname = \"gnss_jump\"\noffset_m = [{}, {}]\nfrom_s = 0\nuntil_s = {until_s}\n",
            d.signed(1.0, 10.0),
            d.signed(1.0, 10.0)
        )
    }),
    ("gnss_end", |d| {
        fault(d, "gnss_jump", |d| format!("offset_m = [{}, {}]", d.signed(2.0, 50.0), d.signed(2.0, 50.0)))
    }),
    ("ship", |d| {
        fault(d, "ship_gnss_jump", |d| format!("offset_m = [{}, {}]", d.signed(1.0, 50.0), d.signed(1.0, 50.0)))
    }),
    ("multipath", |d| {
        fault(d, "multipath", |d| format!("share = {}\nextra_m = {}", d.between(0.1, 0.7), d.size(3.0, 60.0)))
    }),
    ("clock_step", |d| fault(d, "modem_clock_step", |d| format!("offset_s = {}", d.signed(0.0005, 0.05)))),
    ("clock_drift", |d| fault(d, "modem_clock_drift", |d| format!("drift_ppm = {}", d.signed(0.2, 10.0)))),
    ("modem", |d| fault(d, "silent", |_| "port = \"modem\"".to_owned())),
    ("depth_jump", |d| fault(d, "depth_jump", |d| format!("depth_m = {}", d.signed(0.2, 5.0)))),
    ("depth_drift", |d| fault(d, "depth_drift", |d| format!("rate_mps = {}", d.signed(0.005, 0.1)))),
    ("ahrs", |d| fault(d, "lost", |d| format!("port = \"ahrs\"\nshare = {}", d.between(0.05, 0.4)))),
    ("frozen", |d| short(d, "ahrs_frozen", 20.0)),
    ("frontseat", |d| short(d, "frontseat_refuses", 3.0)),
    ("frontseat_line", |d| fault(d, "lost", |d| format!("port = \"frontseat\"\nshare = {}", d.between(0.05, 0.5)))),
    ("current", |d| {
        format!("[effects.water_current]\nnorth_mps = {}\neast_mps = {}\n", d.signed(0.02, 0.4), d.signed(0.02, 0.4))
    }),
    ("heading", |d| {
        format!(
            "[effects.heading_bias]\nconst_rad = {}\nsin_rad = {}\ncos_rad = {}\n",
            d.signed(0.01, 0.1),
            d.signed(0.005, 0.05),
            d.signed(0.005, 0.05)
        )
    }),
    ("drag", |d| format!("[effects.linear_drag]\nsurge_ns_per_m = {}\n", d.size(0.1, 2.0))),
    ("buoyancy", |d| format!("[effects.buoyancy_offset]\nkg = {}\n", d.signed(0.05, 1.0))),
    ("trim", |d| format!("[effects.pitch_trim]\nrad = {}\n", d.signed(0.01, 0.08))),
    ("thrust", |d| format!("[effects.thrust_loss]\nk_n_s2_per_rad_m = {}\n", d.size(0.001, 0.012))),
    ("dvl", |d| format!("[effects.dvl_scale]\nratio = {}\n", d.signed(0.005, 0.06))),
    ("sound", |d| format!("[effects.sound_speed]\nratio = {}\n", d.signed(0.001, 0.02))),
    ("flooding", |d| {
        format!(
            "[effects.flooding]\nkg = {}\nkg_per_s = {}\nx_m = {}\ntime_s = {}\n",
            d.size(0.2, 3.0),
            d.size(0.002, 0.05),
            d.signed(0.05, 0.5),
            d.between(150.0, 500.0)
        )
    }),
];

/// From some time under way on, for a while or to the end.
fn fault(draw: &mut Draw, name: &str, numbers: impl Fn(&mut Draw) -> String) -> String {
    let from_s = draw.between(130.0, 500.0);
    let until_s = rounded(from_s + draw.size(20.0, 1200.0));
    format!("[[fault]]\nname = \"{name}\"\n{}\nfrom_s = {from_s}\nuntil_s = {until_s}\n", numbers(draw))
}

/// For some seconds.
fn short(draw: &mut Draw, name: &str, longest_s: f64) -> String {
    let from_s = draw.between(130.0, 500.0);
    let until_s = rounded(from_s + draw.size(0.5, longest_s));
    format!("[[fault]]\nname = \"{name}\"\nfrom_s = {from_s}\nuntil_s = {until_s}\n")
}

/// So many rows of a seed, each with the text of its scenario.
///
/// # Errors
/// A scenario that was drawn and cannot be read.
pub fn drawn(count: usize, seed: u64) -> anyhow::Result<Vec<(Row, String)>> {
    (0..count).map(|index| draw(index, seed)).collect()
}

fn draw(index: usize, seed: u64) -> anyhow::Result<(Row, String)> {
    let mut draw = Draw::of(Stream::of_fault(seed, index as u64));
    let base = BASES[draw.below(BASES.len())];
    let (head, _) = base.split_once("[limits]").context("a scenario without limits")?;
    let wanted = 2 + draw.below(2);
    let mut drawn: Vec<usize> = Vec::new();
    while drawn.len() < wanted {
        let next = draw.below(POOL.len());
        if !drawn.contains(&next) {
            drawn.push(next);
        }
    }
    // In the order of the pool; tables of a scenario may stand in any.
    drawn.sort_unstable();
    let mut text = head.to_owned();
    let mut names = Vec::new();
    for place in drawn {
        let (name, write) = POOL[place];
        let _ = writeln!(text, "{}", write(&mut draw));
        names.push(name);
    }
    let name = format!("random_{seed}_{index}_{}", names.join("_"));
    let scenario = Scenario::with_built_in_vehicle(&text, &format!("{name}.toml"))?;
    let limits = Limits {
        why: "Drawn: only the rules that hold for every row.".to_owned(),
        error_m: f64::INFINITY,
        end_error_m: None,
        navigating: 0.0,
        mission: End::Any,
        reasons: Vec::new(),
        sinks: Some("Drawn: it may be heavier than water.".to_owned()),
        unrevealable: None,
    };
    Ok((Row { name, scenario, limits }, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every entry can be read, alone; rows are those of their seed.
    #[test]
    fn what_is_drawn_can_be_read_and_is_the_same_again() {
        for (place, (name, write)) in POOL.iter().enumerate() {
            for base in BASES {
                let (head, _) = base.split_once("[limits]").unwrap();
                let text = format!("{head}{}", write(&mut Draw::of(Stream::of_fault(7, place as u64))));
                assert!(Scenario::with_built_in_vehicle(&text, name).is_ok(), "{text}");
            }
        }
        let texts = |seed| drawn(60, seed).unwrap().into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts(3), texts(3));
        assert_ne!(texts(3), texts(4));
    }
}
