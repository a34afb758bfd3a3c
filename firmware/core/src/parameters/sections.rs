//! The sections of the vehicle file; what they hold is declared with the structs that they fill.
//!
//! The ranges span vehicles from a hand-launched glider to a midget submarine. They catch slips (a unit, a sign, a
//! missing exponent), not poor estimates. What numbers have to satisfy together is checked by [`super::joint_check`].
//! Section `[app]` fills several: [`crate::navigation::NavigationConfig`], [`crate::control::ControlConfig`], and the
//! app's own.

/// A section of the vehicle file.
#[cfg(not(target_os = "none"))]
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Its name in the file.
    pub name: &'static str,
    /// What it declares.
    pub about: &'static str,
    /// What of it has to be in a file.
    pub presence: Presence,
}

/// What of a section has to be in a vehicle file.
#[cfg(not(target_os = "none"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// The section, with all its keys.
    Required,
    /// All its keys, if the section is there; without it the defaults hold.
    Whole,
    /// Nothing: the defaults hold for what is left out.
    Optional,
}

/// The sections in the order of a file. `[effects]` is the catalogue's ([`crate::effects`]).
#[cfg(not(target_os = "none"))]
pub const SECTIONS: [Section; 11] = {
    use Presence::{Optional, Required, Whole};
    const fn section(name: &'static str, about: &'static str, presence: Presence) -> Section {
        Section { name, about, presence }
    }
    [
        section("vehicle", "NED; body axes forward, starboard, down; origin = centre of gravity", Required),
        section("inertia", "rigid body plus added mass (added mass positive)", Required),
        section("drag", "positive: opposes motion", Required),
        section("fins", "top, bottom, port, starboard", Required),
        section("propeller", "thrust = beta5 omega |omega| - k omega u", Required),
        section("noise", "process noise: square root of the acceleration power spectral density", Optional),
        section("sensors", "one sigma, white", Optional),
        section("prior", "one sigma of what the declaration leaves open; 0: known", Whole),
        section(
            "learnt",
            "what dives and identification have shown of what the robust filter estimates; sigma 0: [prior] holds",
            Whole,
        ),
        section("installation", "lever arms from the centre of gravity, turns and delays of the sensors", Optional),
        section("safety", "what ends a mission though navigation is valid", Optional),
    ]
};
