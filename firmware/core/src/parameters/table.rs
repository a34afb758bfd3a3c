//! The table of what is declared, a section of the vehicle file after the other.
//!
//! The ranges span vehicles from a hand-launched glider to a midget submarine. They catch slips (a unit, a sign, a
//! missing exponent), not poor estimates. What numbers have to satisfy together is checked by [`super::joint_check`].
//! The rows of section `[app]` stand with the structs that they fill: [`crate::navigation::NavigationConfig`],
//! [`crate::control::ControlConfig`], and the app's own.

use super::{Installation, Priors, ProcessNoise, Row, SafetyLimits, SensorNoise, Shape, VehicleParameters};
use crate::row;
use core::f64::consts::{FRAC_PI_2, PI};

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

/// Plant and actuators.
#[rustfmt::skip] // a row a line, to be read as a table
pub const VEHICLE: &[Row<VehicleParameters>] = &[
    row!(real "vehicle.length_m", "L", "m", [0.1, 50.0], "Length over all.", length_m),
    row!(real "vehicle.diameter_m", "D", "m", [0.01, 10.0], "Diameter of the hull.", diameter_m),
    row!(real "vehicle.mass_kg", "m", "kg", [0.1, 1.0e5], "Dry mass.", mass_kg),
    row!(real "vehicle.displaced_mass_kg", "rho V", "kg", [0.1, 1.0e5], "Mass of the displaced water; a vehicle floats if it is more than the mass.", displaced_mass_kg),
    // From hot fresh water to the brine of the Dead Sea (1240), and as far as effects.water_density takes it from
    // there.
    row!(real "vehicle.rho_kg_per_m3", "rho", "kg/m^3", [950.0, 1300.0], "Density of the water.", rho_kg_per_m3),
    // Anywhere on Earth.
    row!(real "vehicle.g_mps2", "g", "m/s^2", [9.76, 9.84], "Acceleration of gravity.", g_mps2),
    row!(vector[0, 3 of 3] "vehicle.b_cb_to_cg_m", "b", "m", [-1.0, 1.0], "Vector from the centre of buoyancy to the centre of gravity, body frame; +z: stable.", b_cb_to_cg_m),

    row!(vector[0, 3 of 6] "inertia.m_diag", "m_11, m_22, m_33", "kg", [0.1, 1.0e6], "Diagonal of the mass matrix M (3.6).", m_diag),
    row!(vector[3, 3 of 6] "inertia.m_diag", "m_44, m_55, m_66", "kg m^2", [1.0e-6, 1.0e7], "Diagonal of the mass matrix M (3.6).", m_diag),

    row!(vector[0, 3 of 6] "drag.quadratic_diag", "d_11, d_22, d_33", "N s^2/m^2", [1.0e-3, 1.0e6], "Diagonal of the quadratic drag (3.7 corrected).", quadratic_diag),
    row!(vector[3, 3 of 6] "drag.quadratic_diag", "d_44, d_55, d_66", "N m s^2/rad^2", [1.0e-6, 1.0e7], "Diagonal of the quadratic drag (3.7 corrected).", quadratic_diag),
    row!(real "drag.d26", "d_26", "N s^2/rad^2", [-1.0e7, 1.0e7], "Off-diagonal drag (4.21): |r| r on sway, |v| v on yaw.", d26),
    row!(real "drag.d35", "d_35", "N s^2/rad^2", [-1.0e7, 1.0e7], "Off-diagonal drag (4.21): |q| q on heave, |w| w on pitch.", d35),
    row!(real "drag.linear_surge_ns_per_m", "d_u", "N s/m", [0.0, 1.0e5], "Linear drag in surge.", linear_surge_ns_per_m),
    row!(vector[0, 3 of 3] "drag.moment_uu", "K_uu, M_uu, N_uu", "N s^2/m", [-1.0e4, 1.0e4], "Moments with u |u| of a hull that is not symmetric, or of fins off their zero.", moment_uu),
    row!(real "drag.z_uw", "Z_uw", "kg/m", [-1.0e5, 1.0e5], "Lift of the hull: Z += z_uw |u| w; negative: against the heave.", z_uw),

    row!(elements[Shape::Vector(4), 0, 4] "fins.phi_rad", "phi_i", "rad", [-2.0 * PI, 2.0 * PI], "Rotation of the fin's frame about body x; its y axis points outboard.",
        |s, i| s.fins.get(i).map_or(f64::NAN, |fin| fin.phi_rad),
        |s, i, value| if let Some(fin) = s.fins.get_mut(i) { fin.phi_rad = value; }),
    row!(elements[Shape::Matrix(4, 3), 0, 12] "fins.cp_m", "r_i", "m", [-25.0, 25.0], "Centre of pressure of a fin from the centre of gravity, body frame.",
        |s, i| s.fins.get(i / 3).and_then(|fin| fin.cp_m.get(i % 3)).copied().unwrap_or(f64::NAN),
        |s, i, value| if let Some(place) = s.fins.get_mut(i / 3).and_then(|fin| fin.cp_m.get_mut(i % 3)) { *place = value; }),
    // A fin that turns against its command is wired wrongly; one that does not turn is a fault and no vehicle.
    row!(elements[Shape::Vector(4), 0, 4] "fins.gain", "", "1", [-3.0, 3.0], "Angle that a fin takes over the angle commanded.",
        |s, i| s.fins.get(i).map_or(f64::NAN, |fin| fin.gain),
        |s, i, value| if let Some(fin) = s.fins.get_mut(i) { fin.gain = value; }),
    row!(real "fins.area_m2", "A", "m^2", [1.0e-6, 10.0], "Planform area of one fin.", fin_area_m2),
    row!(vector[0, 1 of 2] "fins.cd", "beta_1", "1", [1.0e-6, 100.0], "Drag coefficient of a fin: beta1 + beta2 alpha^2.", cd),
    row!(vector[1, 1 of 2] "fins.cd", "beta_2", "1/rad^2", [1.0e-6, 100.0], "Drag coefficient of a fin: beta1 + beta2 alpha^2.", cd),
    // A flat plate of infinite span has 2 pi per radian; lift must rise with incidence, or the fins steer the wrong
    // way.
    row!(vector[0, 1 of 2] "fins.cl", "beta_3", "1/rad", [1.0e-3, 20.0], "Lift coefficient of a fin: beta3 alpha + beta4 alpha^3.", cl),
    row!(vector[1, 1 of 2] "fins.cl", "beta_4", "1/rad^3", [-1.0e3, 1.0e3], "Lift coefficient of a fin: beta3 alpha + beta4 alpha^3.", cl),
    row!(real "fins.stall_rad", "alpha_s", "rad", [1.0e-2, PI], "Incidence beyond which lift and drag coefficient keep their values.", stall_rad),
    row!(real "fins.delta_max_rad", "delta_max", "rad", [1.0e-3, FRAC_PI_2], "Mechanical limit of the fins.", delta_max_rad),

    row!(real "propeller.beta5_n_s2_per_rad2", "beta_5", "N s^2/rad^2", [1.0e-9, 10.0], "Thrust is beta5 omega |omega| (3.24).", beta5_n_s2_per_rad2),
    row!(real "propeller.advance_n_s2_per_rad_m", "k", "N s^2/(rad m)", [0.0, 10.0], "Thrust lost with speed: k omega u.", advance_n_s2_per_rad_m),
    row!(real "propeller.torque_arm_m", "", "m", [-1.0, 1.0], "Reaction torque of the propeller over its thrust: K = -arm T; positive rolls to port ahead.", torque_arm_m),
    row!(real "propeller.omega_max_radps", "omega_max", "rad/s", [1.0, 1.0e4], "Largest speed of the propeller.", omega_max_radps),
];

/// Where the sensors sit.
#[rustfmt::skip]
pub const INSTALLATION: &[Row<Installation>] = &[
    row!(vector[0, 3 of 3] "installation.dvl_arm_m", "r_d", "m", [-20.0, 20.0], "DVL from the centre of gravity, body frame.", dvl_arm_m),
    row!(vector[0, 3 of 3] "installation.dvl_turn_rad", "", "rad", [-PI, PI], "Roll, pitch, yaw of the DVL's axes in the body.", dvl_turn_rad),
    row!(live real "installation.dvl_delay_s", "", "s", [0.0, 2.0], "Time from the validity of a DVL velocity to the arrival of its last byte.", dvl_delay_s),
    row!(vector[0, 3 of 3] "installation.ahrs_turn_rad", "", "rad", [-PI, PI], "Roll, pitch, yaw of the AHRS' axes in the body.", ahrs_turn_rad),
    row!(live real "installation.ahrs_delay_s", "", "s", [0.0, 2.0], "Time from the validity of attitude and rates to the arrival of their last byte.", ahrs_delay_s),
    row!(vector[0, 3 of 3] "installation.depth_arm_m", "r_z", "m", [-20.0, 20.0], "Pressure sensor from the centre of gravity, body frame.", depth_arm_m),
    row!(live real "installation.depth_delay_s", "", "s", [0.0, 2.0], "Time from the validity of a depth to the arrival of its last byte.", depth_delay_s),
    row!(vector[0, 3 of 3] "installation.gnss_arm_m", "r_g", "m", [-20.0, 20.0], "GNSS antenna from the centre of gravity, body frame.", gnss_arm_m),
    row!(live real "installation.gnss_delay_s", "", "s", [0.0, 2.0], "Time from the validity of a fix to the arrival of its last byte.", gnss_delay_s),
    row!(vector[0, 3 of 3] "installation.transducer_arm_m", "r_t", "m", [-20.0, 20.0], "Acoustic transducer from the centre of gravity, body frame.", transducer_arm_m),
    row!(live real "installation.transducer_delay_s", "", "s", [-1.0, 1.0], "Calibrated delay of modem and hardware, subtracted from every time of flight.", transducer_delay_s),
    // From fresh water at 0 degrees (1403) and the Baltic to hot brine, with room for a modem's own scale.
    row!(live real "installation.sound_speed_mps", "c", "m/s", [1300.0, 1700.0], "Sound speed that turns times of flight into ranges.", sound_speed_mps),
    row!(real "installation.ship_transducer_depth_m", "z_s", "m", [0.0, 100.0], "Depth of the ship's transducer; on the vehicle the ship's packets say it.", ship_transducer_depth_m),
];

/// Process noise. Zero would make the covariance singular in time; 10 m/s^2 within a second leaves nothing to predict.
#[rustfmt::skip]
pub const NOISE: &[Row<ProcessNoise>] = &[
    row!(vector[0, 3 of 3] "noise.linear_mps2_per_sqrt_hz", "sigma_u, sigma_v, sigma_w", "m/s^2/sqrt(Hz)", [1.0e-6, 10.0], "Acceleration in surge, sway, heave that the dynamic model does not explain.", linear_mps2_per_sqrt_hz),
    row!(vector[0, 3 of 3] "noise.angular_radps2_per_sqrt_hz", "sigma_p, sigma_q, sigma_r", "rad/s^2/sqrt(Hz)", [1.0e-6, 10.0], "Acceleration in roll, pitch, yaw that the dynamic model does not explain.", angular_radps2_per_sqrt_hz),
];

/// Sensor noise. The lower limits lie well below the resolution of any such sensor: a filter that trusts one without
/// bound is singular.
#[rustfmt::skip]
pub const SENSORS: &[Row<SensorNoise>] = &[
    row!(real "sensors.depth_m", "sigma_z", "m", [1.0e-4, 10.0], "Noise of depth.", depth_m),
    row!(real "sensors.attitude_rad", "sigma_phi", "rad", [1.0e-5, 0.5], "Noise of roll, pitch, heading.", attitude_rad),
    row!(real "sensors.heading_rad", "sigma_psi", "rad", [0.0, 0.5], "Noise of heading, where it differs from that of roll and pitch; 0: it does not.", heading_rad),
    row!(real "sensors.rates_radps", "sigma_omega", "rad/s", [1.0e-6, 0.5], "Noise of p, q, r.", rates_radps),
    row!(real "sensors.dvl_mps", "sigma_d", "m/s", [1.0e-4, 1.0], "Noise of the DVL's velocity per axis.", dvl_mps),
    row!(real "sensors.range_m", "sigma_rho", "m", [1.0e-3, 100.0], "Noise of the acoustic range.", range_m),
    row!(real "sensors.range_rate_mps", "sigma_rho_dot", "m/s", [1.0e-3, 10.0], "Noise of the acoustic range rate.", range_rate_mps),
    row!(real "sensors.gnss_m", "sigma_g", "m", [1.0e-3, 100.0], "Noise of a fix of the surfaced vehicle per axis.", gnss_m),
    row!(real "sensors.ship_gnss_m", "sigma_s", "m", [1.0e-3, 100.0], "Noise of a fix of the ship per axis.", ship_gnss_m),
];

/// What the robust filter estimates. Zero means known. 1 of a parameter is a factor of e: a prior wider than that is
/// none.
#[rustfmt::skip]
pub const PRIOR: &[Row<Priors>] = &[
    row!(vector[0, 3 of 3] "prior.mass", "", "1", [0.0, 1.0], "Relative sigma of m_11, m_22, m_33.", mass),
    row!(vector[0, 2 of 2] "prior.drag", "", "1", [0.0, 1.0], "Relative sigma of d_11, d_66.", drag),
    row!(vector[0, 3 of 3] "prior.actuators", "", "1", [0.0, 1.0], "Relative sigma of beta_1, beta_3, beta_5.", actuators),
    row!(real "prior.walk_per_sqrt_s", "", "1/sqrt(s)", [0.0, 0.01], "Random walk of these parameters.", walk_per_sqrt_s),
    row!(real "prior.current_mps", "", "m/s", [0.0, 5.0], "Sigma of the water current at the start, per axis.", current_mps),
    row!(real "prior.current_walk_mps_per_sqrt_s", "", "m/s/sqrt(s)", [0.0, 0.1], "Random walk of the current, per axis.", current_walk_mps_per_sqrt_s),
    row!(real "prior.heading_rad", "", "rad", [0.0, 0.5], "Sigma of the constant part of the compass error.", heading_rad),
    row!(real "prior.hard_iron_rad", "", "rad", [0.0, 0.5], "Sigma of the sine and of the cosine part of the compass error.", hard_iron_rad),
    row!(real "prior.fin_trim_rad", "", "rad", [0.0, 0.3], "Sigma of the angle by which both rudders, or both elevators, stand off their commands.", fin_trim_rad),
    row!(real "prior.buoyancy_kg", "", "kg", [0.0, 2.0], "Sigma of the displaced mass.", buoyancy_kg),
    row!(real "prior.pitch_trim_rad", "", "rad", [0.0, 0.5], "Sigma of the angle of b, from the vertical, in pitch.", pitch_trim_rad),
    row!(real "prior.fin_lag_s", "", "s", [0.0, 2.0], "Sigma of the lag of the fins.", fin_lag_s),
];

/// Limits of safety.
#[rustfmt::skip]
pub const SAFETY: &[Row<SafetyLimits>] = &[
    row!(at_most real "safety.depth_max_m", "", "m", [2.0, 11000.0], "A vehicle deeper than this, or so fast that it will be in 2 s, stops and rises; a mission to less than 1 m above it is refused.", depth_max_m),
    row!(at_most real "safety.depth_below_leg_m", "", "m", [0.5, 11000.0], "A vehicle deeper than its leg by more than this that has not risen for 10 s stops and rises.", depth_below_leg_m),
    row!(at_least real "safety.altitude_min_m", "", "m", [0.0, 1000.0], "A vehicle under water that is closer to the bottom, by DVL or altimeter, or will be in 2 s, stops and rises; 0: not watched.", altitude_min_m),
    row!(at_most real "safety.fence_radius_m", "", "m", [10.0, 200000.0], "A vehicle further from the origin of the local frame stops and rises; a mission that leads there is refused.", fence_radius_m),
    row!(at_most real "safety.first_leg_max_m", "", "m", [1.0, 200000.0], "A mission whose first waypoint is further away than this is not begun.", first_leg_max_m),
    row!(at_most real "safety.mission_time_max_s", "", "s", [10.0, 1.0e7], "A mission that takes longer returns to where it began; one that is longer by its legs and speeds is refused.", mission_time_max_s),
    row!(at_most real "safety.leg_time_factor", "", "1", [1.0, 1.0e6], "A leg that takes longer than this times its length over its speed, and a minute, ends the mission.", leg_time_factor),
    row!(at_least real "safety.battery_min_percent", "", "%", [0.0, 100.0], "With less charge by the frontseat a mission returns to where it began, and none is begun.", battery_min_percent),
    row!(at_most real "safety.degraded_time_max_s", "", "s", [1.0, 1.0e7], "A mission whose navigation is degraded for longer without a break ends.", degraded_time_max_s),
    row!(at_most real "safety.contact_time_max_s", "", "s", [10.0, 1.0e7], "A mission without an acoustic range for longer ends at the surface, where the vehicle waits; by default never.", contact_time_max_s),
    row!(at_most real "safety.clock_time_max_s", "", "s", [1.0, 1.0e7], "A mission that uses ranges and whose pulse edges stay away for longer is handed back to the frontseat; one that began without them is not.", clock_time_max_s),
    row!(at_most real "safety.pitch_max_rad", "", "rad", [0.1, 1.6], "A vehicle that pitches more for 3 s stops and rises.", pitch_max_rad),
    row!(at_most real "safety.speed_max_mps", "", "m/s", [0.5, 30.0], "A vehicle that is faster through the water for 5 s stops and rises.", speed_max_mps),
    row!(at_most real "safety.dive_time_max_s", "", "s", [5.0, 1.0e7], "A vehicle that is to dive and has been shallower than 0.25 m for longer stops: no water, or no dive.", dive_time_max_s),
    row!(at_most real "safety.depth_jump_m", "", "m", [0.1, 11000.0], "A pressure sensor that has come back so far off the filter's depth ends the mission.", depth_jump_m),
    row!(at_most real "safety.depth_drift_m", "", "m", [0.5, 11000.0], "A pressure sensor that drifts so far off what pitch and speed make of depth, or half as far in two minutes, ends the mission; so does a change of weight that looks the same.", depth_drift_m),
];
