//! Physics and failures of the simulated vehicle that no vehicle file declares.

use super::{Faults, Shift, Span};
use crate::noise::Colour;

/// More surge drag for a while.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DragChange {
    /// Linear surge drag meanwhile, N s/m.
    pub ns_per_m: f64,
    /// When.
    pub when: Span,
}

/// A fin that no longer moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stuck {
    /// Where it stands, rad.
    pub rad: f64,
    /// When.
    pub when: Span,
}

/// What happens to one fin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FinFault {
    /// Where it stands minus where its servo holds it, rad.
    pub bias_rad: f64,
    /// Its zero slips for a while, rad.
    pub shift_rad: Shift,
    /// It no longer moves.
    pub stuck: Option<Stuck>,
    /// Play of the linkage: the fin follows its servo once it is this far away, rad.
    pub play_rad: f64,
    /// The servo stands still for this share of every period, s.
    pub dropout: [f64; 2],
    /// The angle gives way by 1 / (1 + k u²), s²/m².
    pub slip_s2_per_m2: f64,
}

impl FinFault {
    /// Whether the servo takes no command.
    pub(super) fn is_out(&self, time_s: f64) -> bool {
        let [share, period_s] = self.dropout;
        share > 0.0 && time_s.rem_euclid(period_s) < share * period_s
    }
}

/// Physics and failures on top of the [`Parameters`](super::Parameters). The default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Undeclared {
    /// Something caught on the hull.
    pub drag_change: DragChange,
    /// The propeller turns at (1 − rate · t) of the command, 1/s.
    pub thrust_decay_per_s: f64,
    /// Top, bottom, port, starboard.
    pub fins: [FinFault; 4],
    /// From a command to what the actuators do, s.
    pub input_delay_s: f64,
    /// Dead band, slope, N, and saturation of the thrust over the command's share of full speed.
    pub thrust_curve: Option<[f64; 3]>,
    /// First-order time constant of the fins, s.
    pub fin_lag_s: f64,
    /// Reaction torque of the propeller over its thrust, m; positive rolls to port going ahead.
    pub propeller_torque_m: f64,
    /// Displaced mass gained per metre of depth, kg/m; a hull softer than water loses some.
    pub compressibility_kg_per_m: f64,
    /// Quadratic sway drag to starboard minus to port, half of the difference over the declared.
    pub sway_drag_asymmetry: f64,
    /// Surge force against the motion per squared heave velocity, N s²/m².
    pub heave_surge_n_s2_per_m2: f64,
    /// What breaks under way.
    pub faults: Faults,
    /// The vehicle is under water wherever it is, as the backseat's model has it.
    pub no_surface: bool,
    /// The hull is round where it leaves the water: awash it loses little of its buoyancy.
    pub round_hull: bool,
    /// Part of the disturbance is coloured.
    pub disturbance_colour: Option<Colour>,
}
