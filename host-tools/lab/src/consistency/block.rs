//! Blocks of the state.

use std::ops::Range;

/// States whose errors are normalised together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// All twelve of the vehicle.
    Vehicle,
    /// x, y, z.
    Position,
    /// x, y.
    Horizontal,
    /// φ, θ, ψ.
    Attitude,
    /// u, v, w.
    Velocity,
    /// p, q, r.
    Rates,
    /// Effect states.
    Effects,
}

impl Block {
    /// All.
    pub const ALL: [Self; 7] =
        [Self::Vehicle, Self::Position, Self::Horizontal, Self::Attitude, Self::Velocity, Self::Rates, Self::Effects];

    /// For tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Vehicle => "vehicle",
            Self::Position => "position",
            Self::Horizontal => "north, east",
            Self::Attitude => "attitude",
            Self::Velocity => "velocity",
            Self::Rates => "rates",
            Self::Effects => "effects",
        }
    }

    /// Which states of the filter.
    #[must_use]
    pub fn states(self, effects: usize) -> Range<usize> {
        match self {
            Self::Vehicle => 0..12,
            Self::Position => 0..3,
            Self::Horizontal => 0..2,
            Self::Attitude => 3..6,
            Self::Velocity => 6..9,
            Self::Rates => 9..12,
            Self::Effects => 12..12 + effects,
        }
    }
}
