//! Entries of the catalogue that the analysis of a log can name and size, and that no board holds as parameters.
//!
//! Two kinds. A wrong place or delay of a sensor is corrected where it is declared, in `[installation]` of the vehicle
//! file, which board, simulator and tools apply; it needs no second home. The others belong to models of whole logs
//! (`host-tools/diagnose`, module `log_models`), which have their equations. Neither costs the board a byte or a cycle.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo, ParameterKind, info::with};

const fn entry(
    name: &'static str,
    parameters: &'static [ParameterInfo],
    enters: Enters,
    equations: &'static str,
    signature: &'static str,
    confused_with: &'static [Confusion],
) -> EffectInfo {
    EffectInfo { name, parameters, enters, equations, signature, confused_with, hooks: Hooks::NONE }
}

/// Three coordinates of a lever arm, true place minus declared place in body axes; a ship has long ones.
const ARM: &[ParameterInfo] = &[
    ParameterInfo::symmetric("x_m", "m", 50.0),
    ParameterInfo::symmetric("y_m", "m", 50.0),
    ParameterInfo::symmetric("z_m", "m", 50.0),
];

/// All of them.
pub(super) const ENTRIES: &[EffectInfo] = &[
    entry(
        "gnss_lever_arm",
        ARM.split_at(2).0,
        Enters::Measurement,
        "fix = p + R (r_g + arm)",
        "In turns the fixes show a sway of arm_x times the yaw rate that the model lacks. On straight lines the track \
         is displaced by a constant in body axes",
        &[
            with(
                "dvl_lever_arm",
                "Dead reckoning: an arm of the DVL or the speed log with the opposite sign leaves the same residual",
                "Measure either arm with a tape, or turn with fins and propeller in the log",
            ),
            with(
                "heading_lag",
                "One speed: a heading that is late by tau displaces the track in turns as an arm of speed times tau does",
                "Turn at two speeds: the lever arm does not depend on speed",
            ),
        ],
    ),
    entry(
        "dvl_lever_arm",
        ARM,
        Enters::Measurement,
        "v_m = v + omega x (r_d + arm)",
        "In turns the DVL shows a sway of arm_x times the yaw rate and a surge of -arm_y times the yaw rate that a \
         reference velocity does not",
        &[
            with(
                "gnss_lever_arm",
                "Dead reckoning against fixes: an arm of the antenna with the opposite sign leaves the same residual",
                "Measure either arm with a tape",
            ),
            with(
                "dvl_delay",
                "Only slow turns at constant yaw rate: a late velocity in body axes is hardly wrong",
                "Begin and end turns sharply: the delay shows in the acceleration, the arm in the yaw rate",
            ),
        ],
    ),
    entry(
        "transducer_lever_arm",
        ARM,
        Enters::Measurement,
        "range = |p + R (r_t + arm) - p_other|",
        "The range residual depends on the direction of the other end in body axes: cos(bearing) arm_x + \
         sin(bearing) arm_y",
        &[
            with(
                "gnss_lever_arm",
                "Always: ranges see where the transducer is relative to the antenna",
                "Measure one of the two arms with a tape",
            ),
            with(
                "sound_speed",
                "All ranges are in one direction and of one length",
                "Circle the other end, or pass it on both sides",
            ),
        ],
    ),
    entry(
        "usbl_turn",
        &[ParameterInfo::symmetric("rad", "rad", 0.6)],
        Enters::Measurement,
        "bearing_m = bearing + rad",
        "Fixes by USBL are displaced across the line of sight, to one side, in proportion to the distance",
        &[
            with(
                "heading_bias",
                "A ship that stays in one direction, and no fixes at the surface: both turn the track about it",
                "Surface for fixes, or circle with the ship",
            ),
            with(
                "water_current",
                "A vehicle that goes straight away from the ship: both lead it to one side",
                "Go around the ship",
            ),
        ],
    ),
    entry(
        "transponder_place",
        &[
            ParameterInfo { name: "transponder", unit: "1", min: 0.0, max: 1.0e9, kind: ParameterKind::Transponder },
            ParameterInfo::symmetric("north_m", "m", 200.0),
            ParameterInfo::symmetric("east_m", "m", 200.0),
        ],
        Enters::Measurement,
        "range = |p - (p_declared + (north, east))|",
        "Ranges to one transponder are off by an amount that turns with the direction to it; those to others are not",
        &[
            with(
                "sound_speed",
                "One transponder is heard, always from about the same distance",
                "Pass it near and far, on both sides",
            ),
            with(
                "water_current",
                "One transponder, heard from one side: a current leads to it or away",
                "Go around the transponder",
            ),
        ],
    ),
    entry(
        "heading_lag",
        &[ParameterInfo::symmetric("s", "s", 20.0)],
        Enters::Measurement,
        "psi_m(t) = psi(t - s): a pure delay, or the mean delay of a slow compass",
        "The heading error is proportional to the yaw rate. On straight lines there is none",
        &[
            with("gnss_lever_arm", "One speed: speed times lag looks like a lever arm", "Turn at two speeds"),
            with("dvl_lever_arm", "One speed: speed times lag looks like a lever arm", "Turn at two speeds"),
        ],
    ),
    entry(
        "dvl_delay",
        &[ParameterInfo::symmetric("s", "s", 10.0)],
        Enters::Measurement,
        "v_m(t) = v(t - s); negative: the time stamps of what it is compared with are the late ones",
        "The velocity residual is proportional to the acceleration in body axes, at the ends of turns above all",
        &[with("dvl_lever_arm", "Turns without a beginning or an end in the log", "Begin and end turns sharply")],
    ),
    entry(
        "gnss_delay",
        &[ParameterInfo::symmetric("s", "s", 10.0)],
        Enters::Measurement,
        "fix(t) = p(t - s)",
        "The fixes are behind along the track by s times the speed over ground. It shows where speed or course change",
        &[
            with(
                "gnss_lever_arm",
                "One speed: a fix that is late by s is behind as an antenna is that stands s times the speed astern",
                "Turn or stop at two speeds: the lever arm does not depend on speed",
            ),
            with(
                "heading_lag",
                "Turns at one speed: fixes that are late and a heading that is early displace the track alike",
                "Change the speed on a straight line: only late fixes show it",
            ),
        ],
    ),
    entry(
        "input_delay",
        &[ParameterInfo::size("s", "s", 0.0, 10.0)],
        Enters::Process,
        "the actuators do at t what was commanded at t - s",
        "The residual follows the changes of a command and vanishes while it is constant",
        &[with(
            "fin_lag",
            "Commands that change slowly: a delay and a first-order lag of the same time look the same",
            "Step the command",
        )],
    ),
    entry(
        "current_tide",
        &[
            ParameterInfo::size("amplitude_mps", "m/s", -3.0, 3.0),
            ParameterInfo::size("period_s", "s", 0.0, 1.0e5),
            ParameterInfo::symmetric("phase_rad", "rad", 6.3),
        ],
        Enters::Process,
        "current = amplitude (cos, sin)(2 pi t / period + phase), clockwise",
        "The difference between fixes and dead reckoning grows or turns with time, alike on all headings",
        &[with("water_current", "A log shorter than a tenth of the period", "Record a longer log")],
    ),
    entry(
        "current_change",
        &[
            ParameterInfo::symmetric("north_mps", "m/s", 1.5),
            ParameterInfo::symmetric("east_mps", "m/s", 1.5),
            ParameterInfo::ONSET,
            ParameterInfo::END,
        ],
        Enters::Both,
        "c += (north, east) while time <= t < until",
        "As of water_current, from a time on: position, ranges and bottom track were right before",
        &[
            with("water_current", "The change comes near the start or the end of the log", "Record a longer log"),
            with(
                "heading_change",
                "There is no DVL bottom track, and the heading is the same since the change",
                "Fly lines across, or surface for fixes on another heading",
            ),
            with(
                "drag_change",
                "There is no DVL, and the heading is the same since the change",
                "Fly the same line in both directions",
            ),
        ],
    ),
    entry(
        "heading_change",
        &[ParameterInfo::symmetric("rad", "rad", 0.6), ParameterInfo::ONSET, ParameterInfo::END],
        Enters::Measurement,
        "psi_m += rad while time <= t < until",
        "The dead-reckoned track is rotated by a constant from a time on; the heading jumps more than the yaw rate turns it",
        &[with("heading_bias", "The change comes near the start or the end of the log", "Record a longer log")],
    ),
    entry(
        "pitch_change",
        &[ParameterInfo::symmetric("rad", "rad", 0.2), ParameterInfo::ONSET, ParameterInfo::END],
        Enters::Measurement,
        "theta_m += rad while time <= t < until",
        "The pitch jumps more than the pitch rate turns it; from then on it disagrees with depth rate over speed",
        &[with("pitch_sensor", "The change comes near the start or the end of the log", "Record a longer log")],
    ),
    entry(
        "dvl_change",
        &[
            ParameterInfo::symmetric("ratio", "1", 0.1),
            ParameterInfo::symmetric("yaw_rad", "rad", 0.3),
            ParameterInfo::ONSET,
            ParameterInfo::END,
        ],
        Enters::Measurement,
        "v_m = (1 + ratio) Rz(yaw)^T v while time <= t < until",
        "Surge or sway that the DVL shows jumps by a share of surge; the vehicle does not move otherwise",
        &[
            with("dvl_scale", "The change comes near the start or the end of the log", "Record a longer log"),
            with("dvl_misalignment", "The change comes near the start or the end of the log", "Record a longer log"),
            with(
                "current_change",
                "The heading is the same since the change",
                "Fly lines across, and the same line in both directions",
            ),
        ],
    ),
    entry(
        "clock_change",
        &[ParameterInfo::symmetric("s", "s", 0.5), ParameterInfo::ONSET, ParameterInfo::END],
        Enters::Measurement,
        "r_m += c s while time <= t < until",
        "From a time on all ranges are too long or too short by the same: a clock jumps, or echoes are heard",
        &[
            with("clock_offset", "The change comes near the start or the end of the log", "Record a longer log"),
            with("clock_drift", "Few ranges before or after", "Record a longer log"),
            with(
                "current_change",
                "There is no DVL, and the other end is in one direction since the change",
                "Circle the other end, or surface for fixes",
            ),
        ],
    ),
    entry(
        "fin_bias_change",
        &[ParameterInfo::FIN, ParameterInfo::symmetric("rad", "rad", 0.3), ParameterInfo::ONSET, ParameterInfo::END],
        Enters::Process,
        "delta_fin = delta_c + rad while time <= t < until",
        "The trim steps at one time: a fin slips on its shaft. From then on the fin follows its command as before",
        &[
            with("fin_bias", "The change comes near the start or the end of the log", "Record a longer log"),
            with(
                "fin_stuck",
                "The fin has hardly been commanded since the onset",
                "Turn and dive, so that the fin is commanded",
            ),
            with(
                "buoyancy_change",
                "An elevator that is hardly commanded since the change",
                "Change the depth, or fly at a second propeller speed",
            ),
        ],
    ),
    entry(
        "buoyancy_change",
        &[
            ParameterInfo::symmetric("kg", "kg", 2.0),
            ParameterInfo::symmetric("trim_rad", "rad", 0.5),
            ParameterInfo::ONSET,
            ParameterInfo::END,
        ],
        Enters::Process,
        "rho V += kg, and b_x = b_z tan(atan2(b_x, b_z) + trim) while time <= t < until",
        "As of buoyancy_offset and pitch_trim, from a time on: water that enters, or a weight that drops, ahead or astern",
        &[
            with("buoyancy_offset", "The change comes near the start or the end of the log", "Record a longer log"),
            with(
                "fin_stuck",
                "An elevator that is hardly commanded since the change",
                "Change the depth, or fly at a second propeller speed",
            ),
        ],
    ),
    entry(
        "thrust_change",
        &[
            ParameterInfo::size("k_n_s2_per_rad_m", "N s^2/(rad m)", -0.01, 0.03),
            ParameterInfo::ONSET,
            ParameterInfo::END,
        ],
        Enters::Process,
        "X -= k omega u while time <= t < until",
        "As of thrust_loss, from a time on: a blade lost, weed in the propeller. Of the thrust beta5 omega^2 it is the share \
         k u / (beta5 omega)",
        &[
            with(
                "drag_change",
                "One propeller speed since the change: drag and lost thrust slow the vehicle alike",
                "Hold two propeller speeds for some minutes each; stop the propeller and let the vehicle run out",
            ),
            with(
                "current_change",
                "There is no DVL, and the heading is the same since the change",
                "Fly the same line in both directions",
            ),
        ],
    ),
    entry(
        "current_shear",
        &[ParameterInfo::symmetric("north_per_s", "1/s", 0.5), ParameterInfo::symmetric("east_per_s", "1/s", 0.5)],
        Enters::Process,
        "current(z) = current(0) + shear z",
        "The current found depends on the depth of the dive",
        &[with("water_current", "One depth only", "Dive to two depths on the same track")],
    ),
    entry(
        "soft_iron",
        &[ParameterInfo::symmetric("sin2_rad", "rad", 0.3), ParameterInfo::symmetric("cos2_rad", "rad", 0.3)],
        Enters::Measurement,
        "psi_m = psi + sin2 sin(2 psi) + cos2 cos(2 psi)",
        "The dead-reckoned track is rotated by an angle that depends on heading as its second harmonic",
        &[with("heading_bias", "Fewer than five headings", "Fly a surfaced leg with GNSS on eight headings")],
    ),
    entry(
        "magnetic_declination",
        &[ParameterInfo::symmetric("rad", "rad", 0.6)],
        Enters::Measurement,
        "psi_m = psi + rad, rad = -declination where a magnetic heading is called true",
        "As a constant heading bias of the size of the local declination",
        &[with("heading_bias", "Always: it is its constant", "Compare with a model of the earth's field")],
    ),
    entry(
        "depth_scale",
        &[ParameterInfo::symmetric("ratio", "1", 0.1)],
        Enters::Measurement,
        "z_m = (1 + ratio) z",
        "The depth error grows with depth; the integrated heave shows the true change of depth",
        &[with("pitch_sensor", "Dives of one slope", "Dive at two pitch angles")],
    ),
    entry(
        "wind",
        &[ParameterInfo::symmetric("north_mps", "m/s", 40.0), ParameterInfo::symmetric("east_mps", "m/s", 40.0)],
        Enters::Process,
        "X, Y = rho_a / 2 A C |w| w, w the wind less the vessel's own velocity in body axes; N from both",
        "Sway and yaw accelerations are missing that turn with the heading: constant in earth axes over a run",
        &[with(
            "water_current",
            "Velocities over ground only: both drive the vessel towards one side",
            "Stop the propeller: a current carries the vessel, a wind turns it beam on; or log an anemometer",
        )],
    ),
    entry(
        "thrust_curve",
        &[
            ParameterInfo::size("dead_band", "1", 0.0, 1.0),
            ParameterInfo::size("slope_n", "N", 0.0, 1.0e5),
            ParameterInfo::size("saturation", "1", 0.0, 1.0),
        ],
        Enters::Process,
        "T = slope (min(|c|, saturation) - dead_band) sign(c) above the dead band, else 0; c the command",
        "Small commands do not move the vehicle, large ones make it no faster",
        &[with(
            "thrust_loss",
            "Steady speeds only: thrust that falls with speed looks like a saturation",
            "Record accelerations from rest at several commands",
        )],
    ),
    entry(
        "fin_rate",
        &[ParameterInfo::size("s_per_rad", "s/rad", 0.0, 5.0)],
        Enters::Process,
        "|delta_dot| <= 1 / s_per_rad",
        "Body rates lag behind the model where fins are thrown over, not where they move a little",
        &[with("fin_lag", "Fins that always move as far", "Throw the fins over, and move them a little")],
    ),
    entry(
        "propeller_lag",
        &[ParameterInfo::size("s", "s", 0.0, 5.0)],
        Enters::Process,
        "omega_dot = (omega_c - omega) / s",
        "Surge lags behind the model where the propeller changes its speed",
        &[with("input_delay", "A propeller that changes its speed alone", "Throw the fins over: they are not late")],
    ),
    entry(
        "propeller_torque",
        &[ParameterInfo::symmetric("arm_m", "m", 0.5)],
        Enters::Process,
        "K = -arm T",
        "Roll is proportional to thrust",
        &[with("roll_trim", "One propeller speed only", "Hold two propeller speeds for some minutes each")],
    ),
    entry(
        "compressibility",
        &[ParameterInfo::symmetric("kg_per_m", "kg/m", 0.5)],
        Enters::Process,
        "displaced mass = declared + kg_per_m z",
        "The buoyancy found depends on depth",
        &[with("buoyancy_offset", "One depth only", "Dive to two depths")],
    ),
];
