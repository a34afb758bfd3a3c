//! Colours: Okabe and Ito's set, which stays distinct for colour-blind readers, and neutrals for everything that is no
//! data.
//!
//! Plots are drawn in the light theme's colours. The page's style sheet replaces each by its partner in the dark theme,
//! which is why every role has a value of its own.

use std::fmt::Write;

/// A colour by its role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ink {
    pub light: u32,
    pub dark: u32,
}

const fn ink(light: u32, dark: u32) -> Ink {
    Ink { light, dark }
}

/// Writing.
pub(super) const TEXT: Ink = ink(0x1B1F24, 0xE6E9EC);
/// Axes and ticks.
pub(super) const AXIS: Ink = ink(0x7A828C, 0x8A939D);
/// Mesh.
pub(super) const GRID: Ink = ink(0xE3E6EA, 0x30373E);
/// The truth, or what everything else is compared with.
pub(super) const TRUTH: Ink = ink(0x3A4048, 0xC9CED4);
/// Acoustic paths and other things in the background.
pub(super) const FAINT: Ink = ink(0x868E99, 0x98A1AB);
pub(super) const BLUE: Ink = ink(0x0072B2, 0x3A9BDC);
pub(super) const VERMILION: Ink = ink(0xD55E00, 0xE8792B);
pub(super) const GREEN: Ink = ink(0x009E73, 0x1DB98B);
pub(super) const PURPLE: Ink = ink(0xCC79A7, 0xD98FB8);
pub(super) const ORANGE: Ink = ink(0xE69F00, 0xF0B429);
pub(super) const SKY: Ink = ink(0x56B4E9, 0x7CC8F2);
const BROWN: Ink = ink(0x7A4B22, 0xB98358);
const OLIVE: Ink = ink(0x6B6B00, 0xB5B53A);
const PLUM: Ink = ink(0x5A2A83, 0xA783CC);

/// Lines take these in turn; the last three are for plots of more lines than the set has.
pub(super) const SERIES: [Ink; 9] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BROWN, OLIVE, PLUM];

/// The rules that turn plots to the dark theme.
pub(super) fn dark_rules() -> String {
    let mut css = String::new();
    for role in [TEXT, AXIS, GRID, TRUTH, FAINT].iter().chain(&SERIES) {
        for attribute in ["fill", "stroke"] {
            let _ = writeln!(css, "  svg [{attribute}=\"#{:06X}\"] {{ {attribute}: #{:06X} }}", role.light, role.dark);
        }
    }
    css
}
