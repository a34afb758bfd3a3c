//! Names that columns of tables have, and units in them.

/// What stands in a cell without a sample, in lower case.
pub(super) const MISSING: [&str; 7] = ["nan", "-nan", "n/a", "na", "null", "none", "-"];
/// Parts of names that messages of ROS have, whose frames are east-north-up and forward-left-up.
pub(super) const ROS: [&str; 3] = ["angular_velocity.", "orientation.", "linear."];

/// Parts of names, and the column of the vehicle log that such a column is taken for. The first that fits counts.
pub(super) const NAMES: &[(&[&str], &str)] = &[
    (&["goal", "desired", "next", "setpoint", "target", "cmd_heading", "magnetic", "mag_"], ""),
    (&["latitude", "=lat", "lat_deg", ".lat", "gps_lat"], "latitude_deg"),
    (&["longitude", "=lon", "=long", "=lng", "lon_deg", ".lon", "gps_lon"], "longitude_deg"),
    (&["rollrate", "roll_rate", "gyro_x", "gyrox", "angular_velocity.x", "=p", "=wx"], "p_radps"),
    (&["pitchrate", "pitch_rate", "gyro_y", "gyroy", "angular_velocity.y", "=q", "=wy"], "q_radps"),
    (&["yawrate", "yaw_rate", "gyro_z", "gyroz", "angular_velocity.z", "=r", "=wz"], "r_radps"),
    (&["fin_top", "top_fin", "rudder_top", "upper_rudder"], "fin_top_rad"),
    (&["fin_bottom", "bottom_fin", "rudder_bottom", "lower_rudder"], "fin_bottom_rad"),
    (&["fin_port", "port_fin", "elevator_port", "port_elevator"], "fin_port_rad"),
    (&["fin_starboard", "starboard_fin", "elevator_starboard", "starboard_elevator", "fin_stbd"], "fin_starboard_rad"),
    (&["rudder"], "rudder"),
    (&["elevator", "sternplane", "stern_plane", "diveplane"], "elevator"),
    (&["rpm", "propeller", "thruster", "=prop", "motor"], "prop_rpm"),
    (&["depth", "tiefe", "=z", "pos_z", "position.z", PRESSURE], "depth_m"),
    (&["heading", "=yaw", "=hdg", "=psi", "compass", "kurs", "yaw"], "heading_rad"),
    (&["pitch", "=theta"], "pitch_rad"),
    (&["roll", "=phi"], "roll_rad"),
    (
        &["dvl_u", "dvl_x", "dvl_vx", "surge", "=u", "=vx", "vel_x", "velocity.x", "velocity_x", "linear.x", "forward"],
        "dvl_u_mps",
    ),
    (
        &[
            "=dvl_v",
            "dvl_y",
            "dvl_vy",
            "sway",
            "=v",
            "=vy",
            "vel_y",
            "velocity.y",
            "velocity_y",
            "linear.y",
            "starboard",
        ],
        "dvl_v_mps",
    ),
    (&["dvl_w", "dvl_z", "dvl_vz", "heave", "=w", "=vz", "vel_z", "velocity.z", "velocity_z", "linear.z"], "dvl_w_mps"),
    (&["sound"], "sound_speed_mps"),
    (&["speed", "=sog", "=stw"], "speed_log_mps"),
    (&["ship_x", "ship_north"], "ship_gps_x_m"),
    (&["ship_y", "ship_east"], "ship_gps_y_m"),
    (&["northing", "north", "gps_x", "gps_n", "=x", "pos_x", "position.x"], "gps_x_m"),
    (&["easting", "east", "gps_y", "gps_e", "=y", "pos_y", "position.y"], "gps_y_m"),
    (&["range_rate", "doppler"], "range_rate_mps"),
    (&["range", "slant"], "range_m"),
    (&["density"], "water_density_kg_per_m3"),
];

/// Part of the name of a pressure, which is a depth in sea water.
pub(super) const PRESSURE: &str = "press";

/// Units as names state them, and how the mapping calls them.
pub(super) const UNITS: &[(&str, &str)] = &[
    ("deg/s", "deg/s"),
    ("dps", "deg/s"),
    ("rad/s", "rad/s"),
    ("radps", "rad/s"),
    ("mm/s", "mm/s"),
    ("cm/s", "cm/s"),
    ("km/h", "km/h"),
    ("m/s", "m/s"),
    ("mps", "m/s"),
    ("knots", "kn"),
    ("kts", "kn"),
    ("kn", "kn"),
    ("feet", "ft"),
    ("ft", "ft"),
    ("deg", "deg"),
    ("°", "deg"),
    ("rad", "rad"),
    ("rpm", "rpm"),
    ("dbar", "dbar"),
    ("bar", "bar"),
    ("mbar", "mbar"),
    ("hpa", "mbar"),
    ("kpa", "kPa"),
    ("pa", "Pa"),
    ("mm", "mm"),
    ("cm", "cm"),
    ("km", "km"),
    ("msec", "ms"),
    ("ms", "ms"),
    ("usec", "us"),
    ("us", "us"),
    ("nsec", "ns"),
    ("ns", "ns"),
    ("sec", "s"),
    ("s", "s"),
    ("m", "m"),
];
