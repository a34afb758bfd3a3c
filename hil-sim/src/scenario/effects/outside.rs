//! Effects that no entry of the catalogue describes: for a diagnosis, the unknown.

use super::catalogue::{FIN, entries, fin, number, optional};
use super::{Draw, EffectKind};
use crate::scenario::Current;

pub(super) const ENTRIES: &[EffectKind] = entries! { catalogue: false, by_name_only: false;
    "compressibility", "displaced mass gained per metre of depth; a hull softer than water loses some",
    [number("kg_per_m", [-0.2, 0.2], Draw::Signed(0.005, 0.04))],
    |p, v| p.undeclared.compressibility_kg_per_m += v[0];

    "fin_lift", "lift coefficient β3 of one fin, true / declared − 1",
    [FIN, number("ratio", [-0.9, 1.0], Draw::Signed(0.15, 0.7))],
    |p, v| p.vehicle.fins[fin(v[0])].cl[0] *= 1.0 + v[1];

    "tidal_current", "a current that turns clockwise",
    [
        number("amplitude_mps", [0.0, 1.5], Draw::Size(0.03, 0.3)),
        number("period_s", [600.0, 50_000.0], Draw::Uniform(1500.0, 6000.0)),
        optional("phase_rad", 6.3, Draw::Angle),
    ],
    |p, v| p.currents.push(Current { tide_mps: v[0], tide_period_s: v[1], tide_phase_rad: v[2], ..Current::default() });

    "current_shear", "a current that grows with depth",
    [
        optional("north_mps_per_m", 0.5, Draw::Vector(0.005, 0.04)),
        optional("east_mps_per_m", 0.5, Draw::Vector(0.005, 0.04)),
    ],
    |p, v| p.currents.push(Current { shear_north_mps_per_m: v[0], shear_east_mps_per_m: v[1], ..Current::default() });

    "sway_drag_asymmetry", "sway drag (1 + ratio) of the declared to starboard, (1 − ratio) to port",
    [number("ratio", [-0.95, 0.95], Draw::Signed(0.2, 0.8))],
    |p, v| p.undeclared.sway_drag_asymmetry += v[0];

    "heave_surge", "surge drag by the square of heave velocity",
    [number("n_s2_per_m2", [0.0, 1000.0], Draw::Size(20.0, 250.0))],
    |p, v| p.undeclared.heave_surge_n_s2_per_m2 += v[0];

    "servo_backlash", "one fin stays behind its servo by the play of its linkage, this much either way",
    [FIN, number("rad", [0.0, 0.3], Draw::Size(0.02, 0.1))],
    |p, v| p.undeclared.fins[fin(v[0])].play_rad += v[1];

    "servo_dropout", "one servo does not move for a part of every period",
    [
        FIN,
        number("share", [0.0, 1.0], Draw::Uniform(0.3, 0.8)),
        number("period_s", [1.0, 600.0], Draw::Uniform(10.0, 60.0)),
    ],
    |p, v| p.undeclared.fins[fin(v[0])].dropout = [v[1], v[2]];

    "fin_slip", "one loose fin gives way under load: angle / (1 + k u²)",
    [FIN, number("k_s2_per_m2", [0.0, 10.0], Draw::Size(0.1, 1.0))],
    |p, v| p.undeclared.fins[fin(v[0])].slip_s2_per_m2 += v[1];

    "compass_crosstalk", "the motor's current turns the compass, in proportion to the propeller's speed squared",
    [number("rad_s2", [-1e-4, 1e-4], Draw::Signed(5e-7, 5e-6))],
    |p, v| p.instruments.compass.motor_s2 += v[0];

    "ray_bending", "a curved ray makes a range longer by k r²",
    [number("per_m", [0.0, 1e-3], Draw::Size(5e-6, 5e-5))],
    |p, v| p.channel.bending_per_m += v[0];
};
