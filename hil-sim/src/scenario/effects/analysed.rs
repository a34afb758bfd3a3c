//! Entries of the catalogue that only the analysis of a log has: places and delays that are not as declared, sensors and
//! a propeller with errors that no board corrects, and what a command does. Asked for by name, never drawn by chance.

use super::catalogue::{FIN, TIME, UNTIL, entries, fin, number, optional, span};
use super::{Draw, EffectKind, ParameterKind};
use crate::scenario::Current;
use crate::truth::Shift;

/// A quantity that is larger from a time to another, which is never if it is 0.
fn shift(by: f64, from_s: f64, until_s: f64) -> Shift {
    Shift { by, when: span(from_s, until_s) }
}

const fn arm(name: &'static str) -> ParameterKind {
    optional(name, 5.0, Draw::Vector(0.2, 1.0))
}

pub(super) const ENTRIES: &[EffectKind] = entries! { catalogue: false, by_name_only: true;
    "gnss_lever_arm", "where the antenna is minus where it is declared",
    [arm("x_m"), arm("y_m")],
    |p, v| (0..2).for_each(|i| p.installation.gnss_arm_m[i] += v[i]);

    "transducer_lever_arm", "where the transducer is minus where it is declared",
    [arm("x_m"), arm("y_m"), arm("z_m")],
    |p, v| (0..3).for_each(|i| p.installation.transducer_arm_m[i] += v[i]);

    "dvl_lever_arm", "where the DVL is minus where it is declared",
    [
        optional("x_m", 2.0, Draw::Vector(0.2, 0.8)),
        optional("y_m", 2.0, Draw::Vector(0.2, 0.8)),
        optional("z_m", 2.0, Draw::Vector(0.2, 0.8)),
    ],
    |p, v| (0..3).for_each(|i| p.instruments.dvl_lever_m[i] += v[i]);

    "dvl_delay", "the DVL's readings come late",
    [number("s", [0.0, 10.0], Draw::Size(0.1, 2.0))],
    |p, v| p.installation.dvl_delay_s += v[0];

    "gnss_delay", "the vehicle's fixes come late",
    [number("s", [0.0, 10.0], Draw::Size(0.3, 2.0))],
    |p, v| p.installation.gnss_delay_s += v[0];

    "input_delay", "fins and propeller follow their commands late",
    [number("s", [0.0, 10.0], Draw::Size(0.1, 1.0))],
    |p, v| p.undeclared.input_delay_s += v[0];

    "thrust_curve", "thrust by the command's share c of full speed: slope (min(c, saturation) − dead band)",
    [
        number("dead_band", [0.0, 0.9], Draw::Uniform(0.05, 0.2)),
        number("slope_n", [0.1, 1000.0], Draw::Uniform(10.0, 20.0)),
        number("saturation", [0.1, 1.0], Draw::Uniform(0.6, 0.95)),
    ],
    |p, v| p.undeclared.thrust_curve = Some([v[0], v[1], v[2]]);

    "depth_scale", "depth, measured / true − 1",
    [number("ratio", [-0.1, 0.1], Draw::Signed(0.005, 0.05))],
    |p, v| p.instruments.depth_ratio += v[0];

    "heading_lag", "first-order lag of the compass",
    [number("s", [0.0, 20.0], Draw::Size(0.3, 3.0))],
    |p, v| p.instruments.compass.lag_s += v[0];

    "soft_iron", "compass: sin2 · sin 2ψ + cos2 · cos 2ψ of the true heading",
    [optional("sin2_rad", 0.5, Draw::Vector(0.008, 0.06)), optional("cos2_rad", 0.5, Draw::Vector(0.008, 0.06))],
    |p, v| { p.instruments.compass.second[0] += v[0]; p.instruments.compass.second[1] += v[1]; };

    "usbl_turn", "the ship's USBL array is turned: bearing, measured minus true",
    [number("rad", [-0.6, 0.6], Draw::Signed(0.01, 0.15))],
    |p, v| p.channel.usbl_turn_rad += v[0];

    "transponder_place", "where a fixed transponder is minus where it is declared",
    [
        number("transponder", [1.0, 4.0], Draw::Transponder),
        optional("north_m", 200.0, Draw::Vector(3.0, 30.0)),
        optional("east_m", 200.0, Draw::Vector(3.0, 30.0)),
    ],
    |p, v| { p.channel.misplaced = v[0] as usize; p.channel.misplaced_m = [v[1], v[2]]; };

    "current_change", "a current sets in within minutes from a time on, for good or until another",
    [
        optional("north_mps", 1.5, Draw::Vector(0.05, 0.4)),
        optional("east_mps", 1.5, Draw::Vector(0.05, 0.4)),
        TIME,
        UNTIL,
    ],
    |p, v| {
        let begins = Current { north_mps: v[0], east_mps: v[1], onset_s: v[2], ..Current::default() };
        let ends = Current { north_mps: -v[0], east_mps: -v[1], onset_s: v[3], ..Current::default() };
        p.currents.extend([Some(begins), (v[3] > 0.0).then_some(ends)].into_iter().flatten());
    };

    "heading_change", "something near the compass turns it from a time on, for good or until another",
    [number("rad", [-0.6, 0.6], Draw::Signed(0.02, 0.15)), TIME, UNTIL],
    |p, v| p.instruments.compass.change = shift(v[0], v[1], v[2]);

    "pitch_change", "the pitch sensor slips from a time on, for good or until another",
    [number("rad", [-0.2, 0.2], Draw::Signed(0.008, 0.04)), TIME, UNTIL],
    |p, v| p.instruments.pitch_change = shift(v[0], v[1], v[2]);

    "dvl_change", "scale and yaw of the DVL change from a time on, for good or until another",
    [
        optional("ratio", 0.1, Draw::Signed(0.01, 0.04)),
        optional("yaw_rad", 0.3, Draw::Signed(0.01, 0.06)),
        TIME,
        UNTIL,
    ],
    |p, v| p.instruments.dvl_change = [shift(v[0], v[2], v[3]), shift(v[1], v[2], v[3])];

    "clock_change", "the receiver's clock jumps at a time, for good or until another",
    [number("s", [-0.5, 0.5], Draw::Signed(0.002, 0.02)), TIME, UNTIL],
    |p, v| p.channel.clock_change = shift(v[0], v[1], v[2]);

    "fin_bias_change", "the zero of one fin slips at a time, for good or until another",
    [FIN, number("rad", [-0.3, 0.3], Draw::Signed(0.015, 0.06)), TIME, UNTIL],
    |p, v| p.undeclared.fins[fin(v[0])].shift_rad = shift(v[1], v[2], v[3]);

    "buoyancy_change", "the vehicle gains buoyancy, ahead or astern, from a time on, for good or until another",
    [
        number("kg", [-2.0, 2.0], Draw::Signed(0.05, 0.4)),
        optional("trim_rad", 0.5, Draw::Signed(0.01, 0.12)),
        TIME,
        UNTIL,
    ],
    |p, v| {
        p.undeclared.faults.lift_kg = shift(v[0], v[2], v[3]);
        p.undeclared.faults.trim_rad = shift(v[1], v[2], v[3]);
    };

    "thrust_change", "thrust falls with speed ahead from a time on, for good or until another: β5 ω |ω| − k ω u",
    [number("k_n_s2_per_rad_m", [-0.01, 0.03], Draw::Size(0.002, 0.008)), TIME, UNTIL],
    |p, v| p.undeclared.faults.advance_n_s2_per_rad_m = shift(v[0], v[1], v[2]);

    "fin_rate", "one over the rate at which servos turn the fins",
    [number("s_per_rad", [0.01, 5.0], Draw::Size(0.4, 2.0))],
    |p, v| p.vehicle.servo_rate_radps = p.vehicle.servo_rate_radps.min(1.0 / v[0]);

    "propeller_lag", "first-order lag of the propeller",
    [number("s", [0.0, 5.0], Draw::Size(0.2, 2.0))],
    |p, v| p.vehicle.propeller_lag_s += v[0];

    "propeller_torque", "the hull rolls against the propeller: torque over thrust",
    [number("arm_m", [-0.2, 0.2], Draw::Signed(0.01, 0.06))],
    |p, v| p.undeclared.propeller_torque_m += v[0];
};
