//! Names that columns of tables have, and units in them.

/// What stands in a cell without a sample, in lower case. NaN is read as none by itself.
pub(super) const MISSING: [&str; 7] = ["nan", "-nan", "n/a", "na", "null", "none", "-"];
/// Parts of names that messages of ROS have, whose frames are east-north-up and forward-left-up.
pub(super) const ROS: [&str; 3] = ["angular_velocity.", "orientation.", "linear."];

/// Parts of names of what is no reading of the vehicle: wishes, quality, other things.
pub(super) const NONE: &str = "goal desired next setpoint target err std sigma cov variance status quality fixtype state \
    water_depth altitude control battery temp raw xtrack";
/// A wish, but of an actuator: there the command is what is recorded.
pub(super) const COMMAND: [&str; 2] = ["cmd", "command"];
/// What stands beside a magnetic heading; its true one is preferred.
pub(super) const MAGNETIC: [&str; 2] = ["magnetic", "mag"];

/// Parts of names, and the column of the vehicle log that such a column is taken for. The first that fits, and whose unit
/// fits, counts. `=` is the whole name, but for its unit and what says nothing; `~` a word of it.
pub(super) const NAMES: &[(&str, &str)] = &[
    ("latitude ~lat", "latitude_deg"),
    ("longitude ~lon ~long ~lng", "longitude_deg"),
    ("elevation", "usbl_elevation_rad"),
    ("bearing azimuth", "usbl_bearing_rad"),
    ("usbl_range usbl_slant usbl_distance", "usbl_range_m"),
    ("usbl_north =usbl_n", "usbl_north_m"),
    ("usbl_east =usbl_e", "usbl_east_m"),
    ("usbl_down =usbl_d", "usbl_down_m"),
    ("transponder beacon_id", "station"),
    ("rollrate roll_rate gyro_x gyrox angular_velocity.x =p =wx", "p_radps"),
    ("pitchrate pitch_rate gyro_y gyroy angular_velocity.y =q =wy", "q_radps"),
    ("yawrate yaw_rate gyro_z gyroz angular_velocity.z =r =wz", "r_radps"),
    ("fin_top top_fin rudder_top upper_rudder rudder_upper fin_yaw_t", "fin_top_rad"),
    ("fin_bottom bottom_fin rudder_bottom lower_rudder rudder_lower fin_yaw_b", "fin_bottom_rad"),
    ("fin_port port_fin elevator_port port_elevator fin_pitch_l", "fin_port_rad"),
    ("fin_starboard starboard_fin elevator_starboard starboard_elevator fin_stbd fin_pitch_r", "fin_starboard_rad"),
    ("rudder", "rudder"),
    ("elevator sternplane stern_plane diveplane", "elevator"),
    ("cmd_left left_cmd thruster_left left_thruster", "thruster_left"),
    ("cmd_right right_cmd thruster_right right_thruster", "thruster_right"),
    ("rpm propeller thruster ~prop motor", "prop_rpm"),
    ("depth tiefe =z pos_z position.z press", "depth_m"),
    ("heading ~yaw =hdg =psi compass kurs yaw", "heading_rad"),
    ("pitch =theta", "pitch_rad"),
    ("roll =phi", "roll_rad"),
    ("=vn v_north vel_north vel_n velocity_north north_velocity north", "ref_north_mps"),
    ("=ve v_east vel_east vel_e velocity_east east_velocity east", "ref_east_mps"),
    ("=vd v_down vel_down vel_d velocity_down", "ref_down_mps"),
    ("=dvl_u dvl_x dvl_vx surge =u =vx vel_x velocity.x velocity_x linear.x forward fwd", "dvl_u_mps"),
    ("=dvl_v dvl_y dvl_vy sway =v =vy vel_y velocity.y velocity_y linear.y starboard ~left ~right ~stbd", "dvl_v_mps"),
    ("=dvl_w dvl_z dvl_vz heave =w =vz vel_z velocity.z velocity_z linear.z ~up ~down", "dvl_w_mps"),
    ("sound", "sound_speed_mps"),
    ("speed =sog =stw", "speed_log_mps"),
    ("ship_x ship_north", "ship_gps_x_m"),
    ("ship_y ship_east", "ship_gps_y_m"),
    ("northing north gps_x gps_n =x pos_x position.x", "gps_x_m"),
    ("easting east gps_y gps_e =y pos_y position.y", "gps_y_m"),
    ("range_rate doppler", "range_rate_mps"),
    ("range slant", "range_m"),
    ("density", "water_density_kg_per_m3"),
];

/// Words of a name that say nothing of what it is.
pub(super) const NOTHING: [&str; 12] =
    ["mid", "meas", "measured", "body", "est", "ahrs", "imu", "gt", "true", "nav", "sensor", "value"];

/// Part of the name of a pressure, which is a depth in sea water.
pub(super) const PRESSURE: &str = "press";

/// Units as names state them, and how the mapping calls them.
const UNIT_NAMES: &[(&str, &str)] = &[
    ("deg/s °/s dps degps deg_s", "deg/s"),
    ("rad/s rad_s radps rad/sec", "rad/s"),
    ("deg/min", "deg/min"),
    ("mrad/s", "mrad/s"),
    ("mm/s", "mm/s"),
    ("cm/s", "cm/s"),
    ("km/h kph", "km/h"),
    ("m/s m_s mps", "m/s"),
    ("mmps", "mm/s"),
    ("cmps", "cm/s"),
    ("knots knot kts kt kn", "kn"),
    ("ft/s fps", "ft/s"),
    ("feet ft", "ft"),
    ("fathoms fathom", "fathom"),
    ("gon", "gon"),
    ("cdeg centidegrees", "cdeg"),
    ("mrad", "mrad"),
    ("mil mils", "mil"),
    ("degrees degree deg °", "deg"),
    ("radians rad", "rad"),
    ("rpm", "rpm"),
    ("rps 1/s rev/s hz", "1/s"),
    ("counts count cnt pwm percent %", COUNTS),
    ("dbar", "dbar"),
    ("bar", "bar"),
    ("mbar hpa", "mbar"),
    ("kpa", "kPa"),
    ("pa", "Pa"),
    ("inches inch", "in"),
    ("mm", "mm"),
    ("cm", "cm"),
    ("km", "km"),
    ("yards yd", "yd"),
    ("nmi", "nmi"),
    ("msec ms", "ms"),
    ("usec us", "us"),
    ("nsec ns", "ns"),
    ("sec s", "s"),
    ("min", "min"),
    ("h", "h"),
    ("datenum days", "d"),
    ("kg/m3 kg/m^3 kgm3", "kg/m^3"),
    ("m", "m"),
];

/// Units as names state them one by one, and how the mapping calls them.
pub(super) fn unit_names() -> impl Iterator<Item = (&'static str, &'static str)> {
    UNIT_NAMES.iter().flat_map(|(names, unit)| names.split(' ').map(move |name| (name, *unit)))
}

/// No unit of anything: what a servo or a motor takes.
pub(super) const COUNTS: &str = "counts";
