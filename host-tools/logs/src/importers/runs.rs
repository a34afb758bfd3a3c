//! Tables of several runs, each with a label and times of its own: a DVL beside a post-processed inertial solution
//! (repository ansfl/A-KIT), a ship model with rudder and propeller and its anemometer (repository
//! NAOE-5thLab/FRT-DS-ESSO); and a twin-thruster surface vehicle (repository bsb808/pub_usv_modeling).

use super::format::{Format, Known, Role, known};
use crate::log::Column;
use std::borrow::Cow;

/// The times of the 400 samples of a run are spread over 0 to 400 s; a step of one second is meant.
const STEP: f64 = 399.0 / 400.0;

const DVL_INS_COLUMNS: &[Known] = &[
    known("run", Role::Run),
    known("t_s", Role::Seconds(STEP)),
    known("gt_vn_mps", Role::plain(Column::RefNorth)),
    known("gt_ve_mps", Role::plain(Column::RefEast)),
    known("gt_vd_mps", Role::plain(Column::RefDown)),
    known("gt_roll_rad", Role::plain(Column::Roll)),
    known("gt_pitch_rad", Role::plain(Column::Pitch)),
    known("gt_yaw_rad", Role::plain(Column::Heading)),
    known("dvl_x_mps", Role::plain(Column::DvlU)),
    known("dvl_y_mps", Role::plain(Column::DvlV)),
    known("dvl_z_mps", Role::plain(Column::DvlW)),
];

/// A DVL and a reference velocity with attitude.
pub(super) static DVL_INS: Format = Format {
    name: "DVL beside an inertial solution",
    separators: b",",
    columns: Cow::Borrowed(DVL_INS_COLUMNS),
    needed: &["run", "t_s", "gt_vn_mps", "gt_ve_mps", "gt_yaw_rad", "dvl_x_mps", "dvl_y_mps", "dvl_z_mps"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[
        ("gt_l", "the source's latitude and longitude may be swapped; the velocity is used"),
        ("gt_alt", "not needed"),
    ],
    remarks: &["times are scaled by 399/400, so that the 400 samples of a run are one second apart"],
};

const RPM_PER_RPS: f64 = 60.0;

const SHIP_COLUMNS: &[Known] = &[
    known("run", Role::Run),
    known("t_s", Role::Seconds(1.0)),
    known("x_m", Role::plain(Column::GpsX)),
    known("y_m", Role::plain(Column::GpsY)),
    known("u_mps", Role::plain(Column::DvlU)),
    known("v_mid_mps", Role::plain(Column::DvlV)),
    known("heading_rad", Role::plain(Column::Heading)),
    known("r_radps", Role::plain(Column::R)),
    known("prop_rps", Role::scaled(Column::PropRpm, RPM_PER_RPS)),
    known("rudder_rad", Role::plain(Column::Rudder)),
];

/// A ship model with one propeller and one rudder.
pub(super) static SHIP: Format = Format {
    name: "free-running ship model",
    separators: b",",
    columns: Cow::Borrowed(SHIP_COLUMNS),
    needed: &["run", "t_s", "u_mps", "v_mid_mps", "heading_rad", "r_radps", "prop_rps", "rudder_rad"],
    every_column_needed: true,
    constants: Cow::Borrowed(&[
        (Column::Mass, 244.6),
        (Column::Length, 3.0),
        (Column::WindageFront, 0.135),
        (Column::WindageSide, 0.520),
    ]),
    dropped: &[],
    remarks: &["u and v are those of midship; mass, length and windage are those that the repository states"],
};

const SHIP_WIND_COLUMNS: &[Known] = &[
    known("run", Role::Run),
    known("t_s", Role::Seconds(1.0)),
    known("wind_true_mps", Role::plain(Column::WindSpeed)),
    known("wind_true_from_rad", Role::plain(Column::WindFrom)),
];

/// The anemometer of that model.
pub(super) static SHIP_WIND: Format = Format {
    name: "anemometer of a ship model",
    separators: b",",
    columns: Cow::Borrowed(SHIP_WIND_COLUMNS),
    needed: &["run", "t_s", "wind_true_mps", "wind_true_from_rad"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[("rel", "the true wind is used")],
    remarks: &[],
};

/// Mass that the repository states, without added mass.
const TWIN_THRUSTER_KG: f64 = 28.0;

const THRUSTERS_COLUMNS: &[Known] = &[
    known("t_s", Role::Seconds(1.0)),
    known("vx_mps", Role::plain(Column::RefEast)),
    known("vy_mps", Role::plain(Column::RefNorth)),
    known("cmd_left", Role::plain(Column::ThrusterLeft)),
    known("cmd_right", Role::plain(Column::ThrusterRight)),
];

/// Velocity over ground and the commands of two thrusters.
pub(super) static THRUSTERS: Format = Format {
    name: "twin-thruster surface vehicle",
    separators: b",",
    columns: Cow::Borrowed(THRUSTERS_COLUMNS),
    needed: &["t_s", "vx_mps", "vy_mps", "cmd_left", "cmd_right"],
    every_column_needed: true,
    constants: Cow::Borrowed(&[(Column::Mass, TWIN_THRUSTER_KG)]),
    dropped: &[],
    remarks: &["mass 28 kg without added mass, as the repository states"],
};

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    #[test]
    fn a_new_label_begins_a_new_run() {
        let head = "run,t_s,wind_rel_mps,wind_rel_from_rad,wind_true_mps,wind_true_from_rad";
        let log =
            import(&format!("{head}\na,0.0,1,1,0.5,1\na,0.1,1,1,0.5,4\nb,0.0,1,1,2,1\nb,0.1,1,1,2,1\n")).unwrap().log;
        let runs: Vec<_> = log.column(Column::Run).collect();
        assert_eq!(runs, [(0, 1.0), (100_000, 1.0), (100_100_000, 2.0), (100_200_000, 2.0)]);
        assert_eq!(log.rows[1].get(Column::WindFrom), Some(4.0));
        assert!(log.notes.iter().any(|note| note == "run 2: b, from 100 s of the joined log"), "{:?}", log.notes);
        // Within a run times may not go back.
        assert!(import(&format!("{head}\na,0.1,1,1,0.5,1\na,0.0,1,1,0.5,1\n")).is_err());
    }

    #[test]
    fn runs_of_two_tables_join_by_their_labels() {
        let wind = "run,t_s,wind_rel_mps,wind_rel_from_rad,wind_true_mps,wind_true_from_rad\n";
        let mut log = import(&format!("{wind}a,0.0,1,1,0.5,1\na,0.1,1,1,0.5,4\n")).unwrap().log;
        log.join(import(&format!("{wind}b,0.0,1,1,2,1\na,0.1,1,1,3,1\n")).unwrap().log);
        let runs: Vec<_> = log.column(Column::Run).collect();
        assert_eq!(runs, [(0, 1.0), (100_000, 1.0), (100_000, 1.0), (100_100_000, 2.0)]);
        assert!(log.notes.iter().any(|note| note == "run 2: b, from 100 s of the joined log"), "{:?}", log.notes);
    }

    #[test]
    fn columns_of_the_three_formats() {
        let ins = "run,t_s,gt_lat_field_rad,gt_lon_field_rad,gt_alt_m,gt_vn_mps,gt_ve_mps,gt_vd_mps,gt_roll_rad,gt_pitch_rad,gt_yaw_rad,dvl_x_mps,dvl_y_mps,dvl_z_mps\n\
            1,0,0.5,0.6,-19,1,2,0.1,0,0.01,3,2,0.1,0\n1,1.00250626566,0.5,0.6,-19,1,2,0.1,0,0.01,3,2,0.1,0\n";
        let log = import(ins).unwrap().log;
        assert_eq!((log.rows[1].time_us, log.rows[1].get(Column::RefEast)), (1_000_000, Some(2.0)));
        assert_eq!(log.rows[1].dvl_mps(), Some([2.0, 0.1, 0.0]));
        let ship = "run,t_s,x_m,u_mps,y_m,v_mid_mps,heading_rad,r_radps,prop_rps,rudder_rad\nz,0,1,0.5,2,0.1,0.2,0.01,8,-0.3\n";
        let row = import(ship).unwrap().log.rows[0].clone();
        assert_eq!(
            (row.get(Column::PropRpm), row.get(Column::Rudder), row.gnss_m()),
            (Some(480.0), Some(-0.3), Some([1.0, 2.0]))
        );
        let row = import("t_s,vx_mps,vy_mps,cmd_left,cmd_right\n0,0.3,0.4,,\n0.1,0.3,0.4,0.5,0.6\n").unwrap().log.rows
            [1]
        .clone();
        assert_eq!((row.get(Column::ThrusterRight), row.get(Column::Mass)), (Some(0.6), Some(28.0)));
    }
}
