//! The entries of the catalogue as the simulator makes them happen: names, parameters and signs are those of the
//! catalogue, plausible amplitudes beside them, equations of the simulator's own.

use super::physics::Waves;
use super::{Draw, EffectKind, ParameterKind, Physics};
use crate::scenario::Current;
use crate::truth::{DragChange, Span, Stuck};

pub(super) const fn number(name: &'static str, range: [f64; 2], draw: Draw) -> ParameterKind {
    ParameterKind { name, range, optional: false, draw }
}

pub(super) const fn optional(name: &'static str, limit: f64, draw: Draw) -> ParameterKind {
    ParameterKind { name, range: [-limit, limit], optional: true, draw }
}

pub(super) const FIN: ParameterKind = number("fin", [1.0, 4.0], Draw::Fin);
pub(super) const TIME: ParameterKind = number("time_s", [0.0, 1.0e6], Draw::Event);
/// When an event ends; 0: it does not.
pub(super) const UNTIL: ParameterKind =
    ParameterKind { name: "until_s", range: [0.0, 1.0e6], optional: true, draw: Draw::Never };

/// A fin's place from the value of its parameter.
pub(super) fn fin(value: f64) -> usize {
    (value as usize).saturating_sub(1).min(3)
}

/// From a time to another, which is never if it is 0.
pub(super) fn span(from_s: f64, until_s: f64) -> Span {
    Span { from_s, until_s: if until_s > 0.0 { until_s } else { f64::INFINITY } }
}

macro_rules! entries {
    (
        catalogue: $catalogue:literal, by_name_only: $by_name_only:literal;
        $($name:literal, $about:literal, [$($parameter:expr),* $(,)?], $apply:expr;)*
    ) => {
        &[$(EffectKind {
            name: $name,
            catalogue: $catalogue,
            by_name_only: $by_name_only,
            about: $about,
            parameters: &[$($parameter),*],
            apply: $apply,
        }),*]
    };
}
pub(super) use entries;

pub(super) const ENTRIES: &[EffectKind] = entries! { catalogue: true, by_name_only: false;
    "water_current", "the water moves over ground",
    [optional("north_mps", 1.5, Draw::Vector(0.02, 0.4)), optional("east_mps", 1.5, Draw::Vector(0.02, 0.4))],
    |p, v| p.currents.push(Current { north_mps: v[0], east_mps: v[1], ..Current::default() });

    "linear_drag", "surge drag in proportion to speed",
    [number("surge_ns_per_m", [-5.0, 20.0], Draw::Size(0.1, 2.0))],
    |p, v| p.vehicle.linear_surge_ns_per_m += v[0];

    "drag_change", "more surge drag from a time on, for good or until another",
    [number("surge_ns_per_m", [-5.0, 20.0], Draw::Size(0.1, 2.0)), TIME, UNTIL],
    |p, v| p.undeclared.drag_change = DragChange { ns_per_m: v[0], when: span(v[1], v[2]) };

    "thrust_loss", "thrust falls with speed ahead: β5 ω |ω| − k ω u",
    [number("k_n_s2_per_rad_m", [-0.01, 0.03], Draw::Size(0.001, 0.012))],
    |p, v| p.vehicle.advance_n_s2_per_rad_m += v[0];

    "cross_drag", "drag of sway by yaw rate and of heave by pitch rate, and the moments the other way",
    [optional("d26", 99.0, Draw::Vector(4.0, 40.0)), optional("d35", 99.0, Draw::Vector(4.0, 40.0))],
    |p, v| { p.vehicle.d26 += v[0]; p.vehicle.d35 += v[1]; };

    "roll_trim", "centre of gravity to one side: atan(b_y / b_z)",
    [number("rad", [-0.5, 0.5], Draw::Signed(0.01, 0.12))],
    |p, v| trim(&mut p.vehicle.cb_to_cg_m, 1, v[0]);

    "pitch_trim", "centre of gravity ahead or astern: atan(b_x / b_z)",
    [number("rad", [-0.5, 0.5], Draw::Signed(0.01, 0.12))],
    |p, v| trim(&mut p.vehicle.cb_to_cg_m, 0, v[0]);

    "buoyancy_offset", "displaced mass, true minus declared",
    [number("kg", [-2.0, 2.0], Draw::Signed(0.02, 0.3))],
    |p, v| p.vehicle.displaced_mass_kg += v[0];

    "water_density", "density, true minus declared: buoyancy, drag, fins, thrust and added mass in proportion",
    [number("offset_kg_per_m3", [-40.0, 40.0], Draw::Signed(1.0, 8.0))],
    density;

    "thrust_decay", "the propeller turns at (1 − rate t) of the command",
    [number("per_hour", [-0.5, 0.5], Draw::Size(0.01, 0.2))],
    |p, v| p.undeclared.thrust_decay_per_s += v[0] / 3600.0;

    "fin_lag", "first-order lag of all fins",
    [number("s", [0.0, 5.0], Draw::Size(0.15, 1.5))],
    |p, v| p.undeclared.fin_lag_s += v[0];

    "fin_bias", "one fin stands off its command, actual minus commanded",
    [FIN, number("rad", [-0.3, 0.3], Draw::Signed(0.005, 0.06))],
    |p, v| p.undeclared.fins[fin(v[0])].bias_rad += v[1];

    "fin_stuck", "one fin stands still from a time on, for good or until another",
    [FIN, number("rad", [-0.6, 0.6], Draw::Signed(0.01, 0.1)), TIME, UNTIL],
    |p, v| p.undeclared.fins[fin(v[0])].stuck = Some(Stuck { rad: v[1], when: span(v[2], v[3]) });

    "heading_bias", "compass: const + sin · sin ψ + cos · cos ψ of the true heading",
    [
        optional("const_rad", 3.2, Draw::Vector(0.008, 0.09)),
        optional("sin_rad", 1.0, Draw::Vector(0.008, 0.09)),
        optional("cos_rad", 1.0, Draw::Vector(0.008, 0.09)),
    ],
    |p, v| {
        let compass = &mut p.instruments.compass;
        compass.constant += v[0];
        compass.first[0] += v[1];
        compass.first[1] += v[2];
    };

    "pitch_sensor", "(1 + scale) pitch + bias",
    [optional("bias_rad", 0.2, Draw::Signed(0.004, 0.04)), optional("scale", 0.2, Draw::Signed(0.02, 0.15))],
    |p, v| { p.instruments.pitch[0] += v[0]; p.instruments.pitch[1] += v[1]; };

    "gyro_bias", "body rates, measured minus true",
    [
        optional("p_radps", 0.1, Draw::Vector(0.0005, 0.01)),
        optional("q_radps", 0.1, Draw::Vector(0.0005, 0.01)),
        optional("r_radps", 0.1, Draw::Vector(0.0005, 0.01)),
    ],
    |p, v| (0..3).for_each(|i| p.instruments.gyro_radps[i] += v[i]);

    "depth_bias", "depth, measured minus true",
    [number("m", [-5.0, 5.0], Draw::Signed(0.05, 1.0))],
    |p, v| p.instruments.depth_m += v[0];

    "dvl_scale", "DVL velocity, measured / true − 1",
    [number("ratio", [-0.1, 0.1], Draw::Signed(0.002, 0.04))],
    |p, v| p.instruments.dvl_ratio += v[0];

    "dvl_misalignment", "the DVL is turned in its mount: by yaw, then pitch",
    [optional("yaw_rad", 0.3, Draw::Vector(0.004, 0.06)), optional("pitch_rad", 0.3, Draw::Vector(0.004, 0.06))],
    |p, v| { p.instruments.dvl_mounting_rad[0] += v[0]; p.instruments.dvl_mounting_rad[1] += v[1]; };

    "sound_speed", "ranges from travel times, measured / true − 1",
    [number("ratio", [-0.05, 0.05], Draw::Signed(0.001, 0.02))],
    |p, v| p.channel.sound_speed_ratio += v[0];

    "clock_offset", "receiver's clock minus true time",
    [number("s", [-0.5, 0.5], Draw::Signed(0.0005, 0.02))],
    |p, v| p.channel.clock_offset_s += v[0];

    "clock_drift", "rate error of the receiver's clock",
    [number("ppm", [-100.0, 100.0], Draw::Signed(0.5, 20.0))],
    |p, v| p.channel.clock_drift += 1.0e-6 * v[0];

    "range_outliers", "a share of the ranges is of another path or another ping",
    [number("share", [0.0, 0.5], Draw::Size(0.03, 0.3))],
    |p, v| p.channel.outlier_share += v[0];

    "waves", "orbital motion at the vehicle's depth, a narrow swell from anywhere",
    [number("amplitude_mps", [0.0, 1.5], Draw::Size(0.02, 0.3)), number("period_s", [1.0, 30.0], Draw::Uniform(4.0, 12.0))],
    |p, v| p.waves = Some(Waves { amplitude_mps: v[0], period_s: v[1] });
};

/// Turns the lever from centre of buoyancy to centre of gravity towards an axis.
fn trim(lever_m: &mut [f64; 3], axis: usize, angle: f64) {
    let declared = libm::atan2(lever_m[axis], lever_m[2]);
    lever_m[axis] = lever_m[2] * libm::tan(declared + angle);
}

/// Everything that water does with its mass. The rotational added inertia is not known apart from the rigid body's
/// and stays: half a percent of it is below what any log shows.
fn density(physics: &mut Physics, values: &[f64]) {
    let vehicle = &mut physics.vehicle;
    let ratio = 1.0 + values[0] / vehicle.rho_kg_per_m3;
    for inertia in &mut vehicle.inertia[..3] {
        *inertia = vehicle.mass_kg + ratio * (*inertia - vehicle.mass_kg);
    }
    let drags = vehicle.quadratic_drag.iter_mut().chain([&mut vehicle.d26, &mut vehicle.d35]);
    drags.for_each(|drag| *drag *= ratio);
    vehicle.thrust_n_s2_per_rad2 *= ratio;
    vehicle.advance_n_s2_per_rad_m *= ratio;
    vehicle.displaced_mass_kg *= ratio;
    vehicle.rho_kg_per_m3 *= ratio;
}
