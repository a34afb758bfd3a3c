//! What a torpedo's runs can show beyond the textbook: entries of the catalogue, and entries that only the host has.

/// One entry.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Name.
    pub name: &'static str,
    /// How it enters.
    pub equation: &'static str,
    /// What it leaves in the motion.
    pub signature: &'static str,
    /// Other entries that can explain the same, and the manoeuvre that separates them.
    pub confused_with: &'static [(&'static str, &'static str)],
}

const fn entry(
    name: &'static str,
    equation: &'static str,
    signature: &'static str,
    confused_with: &'static [(&'static str, &'static str)],
) -> Entry {
    Entry { name, equation, signature, confused_with }
}

/// What separates a torque from other moments.
pub(super) const MOTOR_STOP: &str =
    "stop the motor at speed: the torque ends at once, what goes with u^2 fades with the speed";
const DOUBLET: &str = "a doublet of one fin at a time, both ways";
const TWO_SPEEDS: &str = "hold two propeller speeds for a minute each";

/// In the order in which they are listed.
pub const ENTRIES: [Entry; 16] = [
    entry(
        "propeller_torque",
        "K = -arm T",
        "Roll steps when the motor starts and stops",
        &[("speed_moment", MOTOR_STOP), ("roll_trim", MOTOR_STOP)],
    ),
    entry(
        "speed_moment",
        "K += k_uu u|u|, M += m_uu u|u|, N += n_uu u|u|, for each configuration",
        "Steady roll, pitch or turn that grows with the square of speed: fins off their zero, a bent hull or mast",
        &[("fin_bias", "set one fin after the other to zero at speed"), ("propeller_torque", MOTOR_STOP)],
    ),
    entry(
        "input_delay",
        "delta(t) = commanded(t - fin_delay_s), omega(t) = recorded(t - propeller_delay_s)",
        "The motion follows a command of an earlier row, or leads it",
        &[("attitude_delay", "log the fins' own angle, or step a fin at rest beside a camera")],
    ),
    entry(
        "attitude_delay",
        "attitude(row) = attitude(t - attitude_delay_s)",
        "Roll, pitch and heading are late against depth and DVL",
        &[("input_delay", "turn the vehicle by hand beside a second clock")],
    ),
    entry(
        "fin_gain",
        "delta = gain delta_commanded, each fin",
        "One fin turns or rolls the vehicle less than its counterpart: calibration, linkage, a slipping horn",
        &[("speed_moment", DOUBLET)],
    ),
    entry(
        "lift_curve",
        "C_L = beta3 alpha + (beta4 + cl4) alpha^3",
        "Large fin angles turn the vehicle more, or less, than small ones promise",
        &[("ln d55 = d66", TWO_SPEEDS)],
    ),
    entry(
        "hull_lift",
        "Z += z_uw |u| w",
        "The vehicle sinks less beside its own axis when it is fast than the drag across the hull promises",
        &[("ln d33/d22", "rise or sink with the motor stopped, then dive at speed")],
    ),
    entry(
        "rudder_gain",
        "gain of top and bottom += rudder_gain, for each configuration but the first",
        "The same rudder turns the vehicle less in one configuration than in another",
        &[("fin_gain", DOUBLET)],
    ),
    entry(
        "pitch_trim",
        "b_x += b_x_m, for each configuration",
        "A pitch moment that does not depend on speed",
        &[("speed_moment", TWO_SPEEDS)],
    ),
    entry("roll_trim", "b_y += b_y_m, for each configuration", "A list at rest", &[("speed_moment", MOTOR_STOP)]),
    entry(
        "buoyancy_offset",
        "displaced mass += buoyancy_kg, for each configuration",
        "The vehicle rises or sinks at zero pitch",
        &[("pitch_trim", "drift for a minute with the motor stopped")],
    ),
    entry(
        "thrust_loss",
        "T -= k omega u",
        "Thrust falls with speed of advance",
        &[("ln d11", "accelerate from rest at two propeller speeds")],
    ),
    entry(
        "ahrs_tilt",
        "roll, pitch of the specific force in the share ahrs_tilt",
        "Roll and pitch that are read swing with the accelerations of starts and turns",
        &[("attitude_delay", "log the gyro's rates")],
    ),
    entry("dvl_delay", "v_m(t) = v(t - s)", "The DVL is late when the vehicle accelerates and at motor stops", &[]),
    entry("dvl_scale", "v_m = (1 + dvl_scale) v", "Depth rate and pitch give another speed than the DVL", &[]),
    entry("dvl_misalignment", "v_m = Rz(yaw)^T v", "Sway proportional to surge on straight lines", &[]),
];

/// The entry of a name.
#[must_use]
pub fn of(name: &str) -> Option<&'static Entry> {
    ENTRIES.iter().find(|entry| entry.name == name)
}
