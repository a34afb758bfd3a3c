//! Arrivals of a moored pinger at a surface vehicle (repository yoojinhwang/iver3-summer2022, one row a ping).
//!
//! The pinger's clock is its own: a row has a time of arrival but neither launch nor range. Positions are local, the
//! pinger's surveyed place is their origin.

use super::RAD_PER_DEG;
use super::format::{Format, Known, Role, known};
use crate::log::Column;
use std::borrow::Cow;

const COLUMNS: &[Known] = &[
    known("t_rx_s", Role::Arrival),
    known("north_m", Role::plain(Column::GpsX)),
    known("east_m", Role::plain(Column::GpsY)),
    known("speed_mps", Role::plain(Column::SpeedLog)),
    known("heading_true_deg", Role::scaled(Column::Heading, RAD_PER_DEG)),
];

/// The one format.
pub(super) static FORMAT: Format = Format {
    name: "pinger log",
    separators: b",",
    columns: Cow::Borrowed(COLUMNS),
    needed: &["t_rx_s", "north_m", "east_m"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[(Column::ShipX, 0.0), (Column::ShipY, 0.0)]),
    dropped: &[
        ("gps_range", "follows from the position"),
        ("lat", "north_m and east_m are used"),
        ("lon", "north_m and east_m are used"),
        ("level", "signal strength, not an arrival time"),
    ],
    remarks: &["the pinger lies at the origin of north_m and east_m; its clock is not synchronised"],
};

#[cfg(test)]
mod tests {
    use super::super::tests::import;

    #[test]
    fn arrivals_with_and_without_a_position() {
        let text = "t_rx_s,lat_deg,lon_deg,north_m,east_m,gps_range_m,speed_mps,heading_true_deg,signal_level,noise_level\n\
            0.0,,,,,,,,81.0,27.5\n\
            8.179,33.7,-118.1,3.0,4.0,5.0,0.5,90.0,80.0,27.0\n";
        let imported = import(text).unwrap();
        assert_eq!(imported.format, "pinger log");
        let [first, second] = &imported.log.rows[..] else { panic!("{:?}", imported.log.rows) };
        assert_eq!((first.arrival_us(), first.gnss_m(), first.ship_at_launch_m()), (Some(0), None, Some([0.0; 2])));
        assert_eq!((second.time_us, second.arrival_us()), (8_179_000, Some(8_179_000)));
        assert_eq!(second.gnss_m(), Some([3.0, 4.0]));
        assert!(
            imported.log.notes.iter().any(|note| note.contains("gps_range_m (follows")),
            "{:?}",
            imported.log.notes
        );
    }
}
