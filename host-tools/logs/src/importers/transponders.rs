//! Two-way travel times between a ship and transponders on the seabed (as in repository s-watanabe-jhod/garpos), and
//! the table of the transponders' places.
//!
//! Axes of the tables are east, north, up; the log's are north, east, down. A row is a ping at its transmission; the
//! antenna and the attitude at the reception stand in the same row.

use super::RAD_PER_DEG;
use super::format::{Format, Known, Role, known};
use crate::log::Column;
use std::borrow::Cow;

const fn degrees(column: Column) -> Role {
    Role::scaled(column, RAD_PER_DEG)
}

const RANGES_COLUMNS: &[Known] = &[
    known("tx_t_s", Role::Epoch(1.0)),
    known("transponder", Role::Label(Column::Station)),
    known("twtt_s", Role::plain(Column::TwoWayTime)),
    known("tx_ant_north_m", Role::plain(Column::GpsX)),
    known("tx_ant_east_m", Role::plain(Column::GpsY)),
    known("tx_ant_up_m", Role::scaled(Column::GpsZ, -1.0)),
    known("tx_roll_deg", degrees(Column::Roll)),
    known("tx_pitch_deg", degrees(Column::Pitch)),
    known("tx_heading_deg", degrees(Column::Heading)),
    known("rx_ant_north_m", Role::plain(Column::ReplyGpsX)),
    known("rx_ant_east_m", Role::plain(Column::ReplyGpsY)),
    known("rx_ant_up_m", Role::scaled(Column::ReplyGpsZ, -1.0)),
    known("rx_roll_deg", degrees(Column::ReplyRoll)),
    known("rx_pitch_deg", degrees(Column::ReplyPitch)),
    known("rx_heading_deg", degrees(Column::ReplyHeading)),
];

/// Pings.
pub(super) static RANGES: Format = Format {
    name: "two-way travel times",
    separators: b",",
    columns: Cow::Borrowed(RANGES_COLUMNS),
    needed: &[
        "transponder",
        "twtt_s",
        "tx_t_s",
        "tx_ant_north_m",
        "rx_ant_north_m",
        "tx_heading_deg",
        "rx_heading_deg",
    ],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[("rx_t", "the reply's travel time is used instead"), ("set", "a label"), ("line", "a label")],
    remarks: &[],
};

const PLACES_COLUMNS: &[Known] = &[
    known("name", Role::Label(Column::Station)),
    known("north_m", Role::plain(Column::StationX)),
    known("east_m", Role::plain(Column::StationY)),
    known("up_m", Role::scaled(Column::StationZ, -1.0)),
];

/// Places.
pub(super) static PLACES: Format = Format {
    name: "places of transponders",
    separators: b",",
    columns: Cow::Borrowed(PLACES_COLUMNS),
    needed: &["name", "north_m", "east_m", "up_m"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[("sigma", "the places are fitted without a prior")],
    remarks: &[],
};

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    #[test]
    fn pings_and_places_join_by_the_number_in_the_label() {
        let text = "set,line,transponder,twtt_s,tx_t_s,tx_ant_east_m,tx_ant_north_m,tx_ant_up_m,tx_heading_deg,tx_pitch_deg,tx_roll_deg,rx_t_s,rx_ant_east_m,rx_ant_north_m,rx_ant_up_m,rx_heading_deg,rx_pitch_deg,rx_roll_deg\n\
            S01,L01,M11,2.289306,30072.5,-27.5,1473.0,14.5,180,0.5,-1,30075.7,-26.5,1462.0,14.25,90,0,0\n\
            S01,L01,M13,3.5,30092.5,-22.0,1412.0,14.5,188,0,0,30096.6,-22.25,1401.0,14.5,190,0,0\n";
        let mut log = import(text).unwrap().log;
        assert_eq!(log.rows.iter().map(|row| row.time_us).collect::<Vec<_>>(), [0, 20_000_000]);
        let row = &log.rows[0];
        let get = |column| row.get(column).unwrap();
        assert_eq!((get(Column::Station), get(Column::TwoWayTime)), (11.0, 2.289306));
        assert_eq!((row.gnss_m(), get(Column::GpsZ)), (Some([1473.0, -27.5]), -14.5));
        assert!((get(Column::ReplyHeading) - std::f64::consts::FRAC_PI_2).abs() < 1e-12); // rounding
        log.join(import("name,east_m,north_m,up_m,sigma_m\nM11,-47,408.5,-1345,3\nM13,1,2,-3,3\n").unwrap().log);
        let place = log.rows.iter().find(|row| row.get(Column::StationX).is_some()).unwrap();
        assert_eq!((place.time_us, place.get(Column::Station)), (0, Some(11.0)));
        assert_eq!((place.get(Column::StationX), place.get(Column::StationZ)), (Some(408.5), Some(1345.0)));
        let error = import("name,east_m,north_m,up_m\nfirst,1,2,3\n").unwrap_err().to_string();
        assert!(error.contains("holds no number, such as M11"), "{error}");
    }
}
