//! The columns of the vehicle log: names, order in a row, decimals written.

macro_rules! columns {
    ($($(#[$doc:meta])* $column:ident = $name:literal,)*) => {
        /// A column of the vehicle log. Members of a group (attitude, rates, DVL…) are consecutive.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(usize)]
        pub enum Column {
            $($(#[$doc])* $column,)*
        }

        impl Column {
            /// Number of columns beside the time.
            pub const COUNT: usize = [$($name),*].len();

            /// All columns in the order of a written log.
            pub const ALL: [Self; Self::COUNT] = [$(Self::$column),*];

            /// Name in the header.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$column => $name,)*
                }
            }
        }
    };
}

columns! {
    /// Propeller speed commanded, rpm.
    PropRpm = "prop_rpm",
    /// Top fin commanded, rad.
    FinTop = "fin_top_rad",
    /// Bottom fin commanded, rad.
    FinBottom = "fin_bottom_rad",
    /// Port fin commanded, rad.
    FinPort = "fin_port_rad",
    /// Starboard fin commanded, rad.
    FinStarboard = "fin_starboard_rad",
    /// Depth, m.
    Depth = "depth_m",
    /// Roll φ, rad.
    Roll = "roll_rad",
    /// Pitch θ, rad.
    Pitch = "pitch_rad",
    /// True heading ψ, rad.
    Heading = "heading_rad",
    /// Roll rate, rad/s.
    P = "p_radps",
    /// Pitch rate, rad/s.
    Q = "q_radps",
    /// Yaw rate, rad/s.
    R = "r_radps",
    /// DVL surge over ground, m/s.
    DvlU = "dvl_u_mps",
    /// DVL sway over ground, m/s.
    DvlV = "dvl_v_mps",
    /// DVL heave over ground, m/s.
    DvlW = "dvl_w_mps",
    /// One-way range, m.
    Range = "range_m",
    /// Range rate, positive opening, m/s.
    RangeRate = "range_rate_mps",
    /// Time of launch of the packet, s.
    Tol = "tol_s",
    /// Time of arrival of the packet, s.
    Toa = "toa_s",
    /// North of the ship at time of launch, m.
    ShipX = "ship_x_m",
    /// East of the ship at time of launch, m.
    ShipY = "ship_y_m",
    /// Vehicle GNSS north, m.
    GpsX = "gps_x_m",
    /// Vehicle GNSS east, m.
    GpsY = "gps_y_m",
    /// Ship GNSS north, m.
    ShipGpsX = "ship_gps_x_m",
    /// Ship GNSS east, m.
    ShipGpsY = "ship_gps_y_m",
    /// Speed of a log that has no DVL in body axes (importers), along the heading, m/s.
    SpeedLog = "speed_log_mps",
    /// Water density, kg/m³.
    WaterDensity = "water_density_kg_per_m3",
    /// Sound speed, m/s.
    SoundSpeed = "sound_speed_mps",
    /// Propeller command of a log that states it in servo counts (importers), from stop, positive ahead.
    PropCount = "prop_count",
    /// Yaw fin command of such a log, servo counts from the middle of their range.
    YawFinCount = "fin_yaw_count",
    /// Ballast of a glider beyond its middle, positive floats, m³.
    Ballast = "ballast_m3",
    /// Position of a glider's moving mass along its axis, m, as logged.
    MovingMass = "moving_mass_m",
    /// Measured speed through the water along the path, m/s.
    WaterSpeed = "water_speed_mps",
    /// Current north that the vehicle itself estimated, m/s.
    OwnCurrentN = "own_current_north_mps",
    /// Current east that the vehicle itself estimated, m/s.
    OwnCurrentE = "own_current_east_mps",
    /// Height of the antenna of GpsX and GpsY as a depth below the origin, m.
    GpsZ = "gps_z_m",
    /// Two-way travel time of a ping sent at the time of the row, without turn-around, s.
    TwoWayTime = "two_way_time_s",
    /// Number of the fixed transponder that the ping or the place belongs to.
    Station = "station",
    /// Declared place of that transponder, north, m.
    StationX = "station_x_m",
    /// Declared place of that transponder, east, m.
    StationY = "station_y_m",
    /// Declared place of that transponder, depth below the origin, m.
    StationZ = "station_z_m",
    /// North of the antenna when the reply arrived, m.
    ReplyGpsX = "reply_gps_x_m",
    /// East of the antenna when the reply arrived, m.
    ReplyGpsY = "reply_gps_y_m",
    /// Height of the antenna when the reply arrived, as a depth, m.
    ReplyGpsZ = "reply_gps_z_m",
    /// Roll when the reply arrived, rad.
    ReplyRoll = "reply_roll_rad",
    /// Pitch when the reply arrived, rad.
    ReplyPitch = "reply_pitch_rad",
    /// Heading when the reply arrived, rad.
    ReplyHeading = "reply_heading_rad",
    /// Reference velocity over ground north (GNSS, or an inertial solution made afterwards), m/s.
    RefNorth = "ref_north_mps",
    /// Reference velocity over ground east, m/s.
    RefEast = "ref_east_mps",
    /// Reference velocity down, m/s.
    RefDown = "ref_down_mps",
    /// Command of the left thruster, from -1 to 1.
    ThrusterLeft = "thruster_left",
    /// Command of the right thruster, from -1 to 1.
    ThrusterRight = "thruster_right",
    /// Rudder angle of a vessel with one rudder, positive turns to starboard, rad.
    Rudder = "rudder_rad",
    /// Measured true wind, speed over ground, m/s.
    WindSpeed = "wind_speed_mps",
    /// Direction that this wind comes from, clockwise from north, rad.
    WindFrom = "wind_from_rad",
    /// Mass of the vessel as the maker of the log states it, kg.
    Mass = "mass_kg",
    /// Length of the vessel as the maker of the log states it, m.
    Length = "length_m",
    /// Area above the water seen from ahead, as stated, m².
    WindageFront = "windage_front_m2",
    /// Area above the water seen from the side, as stated, m².
    WindageSide = "windage_side_m2",
    /// Number of the run in a table that holds several, from 1.
    Run = "run",
    /// Half of the round trip of the vehicle's ping less the ship's turn-around, as a distance, m; `tol_s` is when the
    /// ping left, `toa_s` when the answer arrived, the ship's place that at its answer.
    TwoWayRange = "two_way_range_m",
    /// Distance by the travel time of the vehicle's own packet, measured at the ship, m; `tol_s` is when it left the
    /// vehicle, `toa_s` when it arrived at the ship, the ship's place that at the arrival.
    UplinkRange = "uplink_range_m",
    /// Slant range of a USBL from its array to the other end, m; `tol_s` is when the sound left, `toa_s` when it arrived
    /// at the array, the ship's place that at its end.
    UsblRange = "usbl_range_m",
    /// Bearing from the array, clockwise from true north, or from the bow where the array is on the vehicle, rad.
    UsblBearing = "usbl_bearing_rad",
    /// Elevation from the array, positive up, above the horizontal, or above the deck of the vehicle, rad.
    UsblElevation = "usbl_elevation_rad",
    /// The same as a vector: north from the array, or forward where the array is on the vehicle, m.
    UsblNorth = "usbl_north_m",
    /// East from the array, or to starboard, m.
    UsblEast = "usbl_east_m",
    /// Down from the array, m.
    UsblDown = "usbl_down_m",
    /// One sigma of the range of a USBL, m.
    UsblRangeSigma = "usbl_range_sigma_m",
    /// One sigma of the direction of a USBL, rad.
    UsblAngleSigma = "usbl_angle_sigma_rad",
    /// 1: the array is on the vehicle, and its angles count from bow and deck; 0: it is on the ship.
    UsblOnVehicle = "usbl_on_vehicle",
}

impl Column {
    /// Columns written by [`LogWriter`](super::LogWriter) when nothing else is asked for: all
    /// but the optional ones.
    pub const STANDARD: &'static [Self] = Self::ALL.split_at(Self::SpeedLog as usize).0;

    /// The columns from one to another, in their order.
    #[must_use]
    pub const fn group(first: Self, last: Self) -> &'static [Self] {
        const ALL: &[Column] = &Column::ALL;
        ALL.split_at(last as usize + 1).0.split_at(first as usize).1
    }

    /// The column of a header name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|column| column.name() == name)
    }

    /// Decimals written: well below the resolution of any sensor of the kind.
    #[must_use]
    pub const fn decimals(self) -> usize {
        match self {
            Self::PropRpm | Self::WaterDensity | Self::SoundSpeed => 3,
            Self::Depth | Self::Range | Self::ShipX | Self::ShipY | Self::TwoWayRange | Self::UplinkRange => 4,
            Self::GpsX | Self::GpsY | Self::ShipGpsX | Self::ShipGpsY => 4,
            Self::DvlU | Self::DvlV | Self::DvlW | Self::RangeRate | Self::SpeedLog => 5,
            Self::Ballast | Self::TwoWayTime => 9,
            _ => 6,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_and_names_agree() {
        for (index, column) in Column::ALL.into_iter().enumerate() {
            assert_eq!(column as usize, index);
            assert_eq!(Column::from_name(column.name()), Some(column));
        }
        assert_eq!(Column::STANDARD.last(), Some(&Column::ShipGpsY));
    }
}
