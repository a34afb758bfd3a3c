//! The columns of the vehicle log: names, order in a row, decimals written.

/// A column of the vehicle log. Members of a group (attitude, rates, DVL…) are consecutive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(usize)]
pub enum Column {
    /// Propeller speed commanded, rpm.
    PropRpm,
    /// Top fin commanded, rad.
    FinTop,
    /// Bottom fin commanded, rad.
    FinBottom,
    /// Port fin commanded, rad.
    FinPort,
    /// Starboard fin commanded, rad.
    FinStarboard,
    /// Depth, m.
    Depth,
    /// Roll φ, rad.
    Roll,
    /// Pitch θ, rad.
    Pitch,
    /// True heading ψ, rad.
    Heading,
    /// Roll rate, rad/s.
    P,
    /// Pitch rate, rad/s.
    Q,
    /// Yaw rate, rad/s.
    R,
    /// DVL surge over ground, m/s.
    DvlU,
    /// DVL sway over ground, m/s.
    DvlV,
    /// DVL heave over ground, m/s.
    DvlW,
    /// One-way range, m.
    Range,
    /// Range rate, positive opening, m/s.
    RangeRate,
    /// Time of launch of the packet, s.
    Tol,
    /// Time of arrival of the packet, s.
    Toa,
    /// North of the ship at time of launch, m.
    ShipX,
    /// East of the ship at time of launch, m.
    ShipY,
    /// Vehicle GNSS north, m.
    GpsX,
    /// Vehicle GNSS east, m.
    GpsY,
    /// Ship GNSS north, m.
    ShipGpsX,
    /// Ship GNSS east, m.
    ShipGpsY,
    /// Speed of a log that has no DVL in body axes (importers), along the heading, m/s.
    SpeedLog,
    /// Water density, kg/m³.
    WaterDensity,
    /// Sound speed, m/s.
    SoundSpeed,
    /// Propeller command of a log that states it in servo counts (importers), from stop, positive ahead.
    PropCount,
    /// Yaw fin command of such a log, servo counts from the middle of their range.
    YawFinCount,
    /// Ballast of a glider beyond its middle, positive floats, m³.
    Ballast,
    /// Position of a glider's moving mass along its axis, m, as logged.
    MovingMass,
    /// Measured speed through the water along the path, m/s.
    WaterSpeed,
    /// Current north that the vehicle itself estimated, m/s.
    OwnCurrentN,
    /// Current east that the vehicle itself estimated, m/s.
    OwnCurrentE,
    /// Height of the antenna of GpsX and GpsY as a depth below the origin, m.
    GpsZ,
    /// Two-way travel time of a ping sent at the time of the row, without turn-around, s.
    TwoWayTime,
    /// Number of the fixed transponder that the ping or the place belongs to.
    Station,
    /// Declared place of that transponder, north, m.
    StationX,
    /// Declared place of that transponder, east, m.
    StationY,
    /// Declared place of that transponder, depth below the origin, m.
    StationZ,
    /// North of the antenna when the reply arrived, m.
    ReplyGpsX,
    /// East of the antenna when the reply arrived, m.
    ReplyGpsY,
    /// Height of the antenna when the reply arrived, as a depth, m.
    ReplyGpsZ,
    /// Roll when the reply arrived, rad.
    ReplyRoll,
    /// Pitch when the reply arrived, rad.
    ReplyPitch,
    /// Heading when the reply arrived, rad.
    ReplyHeading,
    /// Reference velocity over ground north (GNSS, or an inertial solution made afterwards), m/s.
    RefNorth,
    /// Reference velocity over ground east, m/s.
    RefEast,
    /// Reference velocity down, m/s.
    RefDown,
    /// Command of the left thruster, from -1 to 1.
    ThrusterLeft,
    /// Command of the right thruster, from -1 to 1.
    ThrusterRight,
    /// Rudder angle of a vessel with one rudder, positive turns to starboard, rad.
    Rudder,
    /// Measured true wind, speed over ground, m/s.
    WindSpeed,
    /// Direction that this wind comes from, clockwise from north, rad.
    WindFrom,
    /// Mass of the vessel as the maker of the log states it, kg.
    Mass,
    /// Length of the vessel as the maker of the log states it, m.
    Length,
    /// Area above the water seen from ahead, as stated, m².
    WindageFront,
    /// Area above the water seen from the side, as stated, m².
    WindageSide,
    /// Number of the run in a table that holds several, from 1.
    Run,
    /// Half of the round trip of the vehicle's ping less the ship's turn-around, as a distance, m; `tol_s` is when the
    /// ping left, `toa_s` when the answer arrived, the ship's place that at its answer.
    TwoWayRange,
    /// Distance by the travel time of the vehicle's own packet, measured at the ship, m; `tol_s` is when it left the
    /// vehicle, `toa_s` when it arrived at the ship, the ship's place that at the arrival.
    UplinkRange,
}

impl Column {
    /// Number of columns beside the time.
    pub const COUNT: usize = Self::UplinkRange as usize + 1;

    /// All columns in the order of a written log.
    pub const ALL: [Self; Self::COUNT] = [
        Self::PropRpm,
        Self::FinTop,
        Self::FinBottom,
        Self::FinPort,
        Self::FinStarboard,
        Self::Depth,
        Self::Roll,
        Self::Pitch,
        Self::Heading,
        Self::P,
        Self::Q,
        Self::R,
        Self::DvlU,
        Self::DvlV,
        Self::DvlW,
        Self::Range,
        Self::RangeRate,
        Self::Tol,
        Self::Toa,
        Self::ShipX,
        Self::ShipY,
        Self::GpsX,
        Self::GpsY,
        Self::ShipGpsX,
        Self::ShipGpsY,
        Self::SpeedLog,
        Self::WaterDensity,
        Self::SoundSpeed,
        Self::PropCount,
        Self::YawFinCount,
        Self::Ballast,
        Self::MovingMass,
        Self::WaterSpeed,
        Self::OwnCurrentN,
        Self::OwnCurrentE,
        Self::GpsZ,
        Self::TwoWayTime,
        Self::Station,
        Self::StationX,
        Self::StationY,
        Self::StationZ,
        Self::ReplyGpsX,
        Self::ReplyGpsY,
        Self::ReplyGpsZ,
        Self::ReplyRoll,
        Self::ReplyPitch,
        Self::ReplyHeading,
        Self::RefNorth,
        Self::RefEast,
        Self::RefDown,
        Self::ThrusterLeft,
        Self::ThrusterRight,
        Self::Rudder,
        Self::WindSpeed,
        Self::WindFrom,
        Self::Mass,
        Self::Length,
        Self::WindageFront,
        Self::WindageSide,
        Self::Run,
        Self::TwoWayRange,
        Self::UplinkRange,
    ];

    /// Columns written by [`LogWriter`](super::LogWriter) when nothing else is asked for: all
    /// but the optional ones.
    pub const STANDARD: &'static [Self] = Self::ALL.split_at(Self::SpeedLog as usize).0;

    /// Name in the header.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PropRpm => "prop_rpm",
            Self::FinTop => "fin_top_rad",
            Self::FinBottom => "fin_bottom_rad",
            Self::FinPort => "fin_port_rad",
            Self::FinStarboard => "fin_starboard_rad",
            Self::Depth => "depth_m",
            Self::Roll => "roll_rad",
            Self::Pitch => "pitch_rad",
            Self::Heading => "heading_rad",
            Self::P => "p_radps",
            Self::Q => "q_radps",
            Self::R => "r_radps",
            Self::DvlU => "dvl_u_mps",
            Self::DvlV => "dvl_v_mps",
            Self::DvlW => "dvl_w_mps",
            Self::Range => "range_m",
            Self::RangeRate => "range_rate_mps",
            Self::Tol => "tol_s",
            Self::Toa => "toa_s",
            Self::ShipX => "ship_x_m",
            Self::ShipY => "ship_y_m",
            Self::GpsX => "gps_x_m",
            Self::GpsY => "gps_y_m",
            Self::ShipGpsX => "ship_gps_x_m",
            Self::ShipGpsY => "ship_gps_y_m",
            Self::SpeedLog => "speed_log_mps",
            Self::WaterDensity => "water_density_kg_per_m3",
            Self::SoundSpeed => "sound_speed_mps",
            Self::PropCount => "prop_count",
            Self::YawFinCount => "fin_yaw_count",
            Self::Ballast => "ballast_m3",
            Self::MovingMass => "moving_mass_m",
            Self::WaterSpeed => "water_speed_mps",
            Self::OwnCurrentN => "own_current_north_mps",
            Self::OwnCurrentE => "own_current_east_mps",
            Self::GpsZ => "gps_z_m",
            Self::TwoWayTime => "two_way_time_s",
            Self::Station => "station",
            Self::StationX => "station_x_m",
            Self::StationY => "station_y_m",
            Self::StationZ => "station_z_m",
            Self::ReplyGpsX => "reply_gps_x_m",
            Self::ReplyGpsY => "reply_gps_y_m",
            Self::ReplyGpsZ => "reply_gps_z_m",
            Self::ReplyRoll => "reply_roll_rad",
            Self::ReplyPitch => "reply_pitch_rad",
            Self::ReplyHeading => "reply_heading_rad",
            Self::RefNorth => "ref_north_mps",
            Self::RefEast => "ref_east_mps",
            Self::RefDown => "ref_down_mps",
            Self::ThrusterLeft => "thruster_left",
            Self::ThrusterRight => "thruster_right",
            Self::Rudder => "rudder_rad",
            Self::WindSpeed => "wind_speed_mps",
            Self::WindFrom => "wind_from_rad",
            Self::Mass => "mass_kg",
            Self::Length => "length_m",
            Self::WindageFront => "windage_front_m2",
            Self::WindageSide => "windage_side_m2",
            Self::Run => "run",
            Self::TwoWayRange => "two_way_range_m",
            Self::UplinkRange => "uplink_range_m",
        }
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
