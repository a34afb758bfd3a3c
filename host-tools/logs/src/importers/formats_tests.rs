//! Every format of `formats.toml` on rows written for these tests; no measured file is part of the project.

use super::tests::import;
use crate::log::Column;
use std::f64::consts::FRAC_PI_2;

const RENAMED_ROWS: &str = "t_s,lat_deg,lon_deg,north_m,east_m,mag_var_deg,heading_true_deg,pitch_deg,roll_deg,depth_m,speed_log_mps,motor_cmd,fin_yaw_t,power_W\n\
    0.0,25.9,-80.1,0.0,0.0,-7.1,90.0,0.0,0.0,0.0,1.0,160,128,22\n\
    1.0,25.9,-80.1,0.0,1.0,-7.1,90.0,0.0,0.0,,1.0,160,128,22\n\
    2.0,25.9,-80.1,0.1,2.1,-7.1,90.0,0.0,0.0,0.1,1.0,160,128,22\n";

/// The header of a real export in part, times and dates as Excel writes them; the rows are made up.
const SPREADSHEET_ROWS: &str = "Latitude,Longitude,Time,Date,Number of Sats,C True Heading,Pitch Angle,Roll Angle,DFS Depth (m),Vehicle Speed (kn),Motor Speed CMD,Fin Yaw T,Date m/d/y   ,Time hh:mm:ss\n\
    25.90000000,-80.10000000,59:58.5,10/7/22,8,90,1,-1,0.0,2,160,128,10/7/22,11:59:58\n\
    25.90000000,-80.09999000,59:59.5,10/7/22,8,90,1,-1,0.0,2,160,128,10/7/22,11:59:59\n\
    25.90000000,-80.09998000,00:00.6,10/7/22,8,90,1,-1,0.0,2,160,128,10/7/22,12:00:00\n";

#[test]
fn a_spreadsheet_took_the_hours_away() {
    let imported = import(SPREADSHEET_ROWS).unwrap();
    assert_eq!(imported.format, "Iver UVC mission log");
    let log = imported.log;
    assert_eq!(log.rows.iter().map(|row| row.time_us).collect::<Vec<_>>(), [0, 1_000_000, 2_100_000]);
    assert_eq!(log.rows[0].get(Column::PropCount), Some(32.0));
    assert!(log.notes.iter().any(|note| note.contains("without hours")), "{:?}", log.notes);
    // a row that goes back by less than half an hour is no new hour
    let back = SPREADSHEET_ROWS.replace("00:00.6", "50:00.6");
    assert!(import(&back).unwrap_err().to_string().contains(":4:3: Time: the time is before"));
}

const NATIVE_ROWS: &str = "Latitude;Longitude;Time;Date;Number of Sats;C Magnetic Heading;C True Heading;Pitch Angle;Roll Angle;DFS Depth (ft);Vehicle Speed (kn);Fin Yaw T;DVL -Altitude (m);\n\
    25.90000000;-80.10000000;23:59:59.00;10/7/2022;8;0;0;0;0;1;2;128;3.0;\n\
    25.90000900;-80.10000000;00:00:00.00;10/8/2022;0;0;0;0;0;1;2;128;3.0;\n\
    25.90001800;-80.10000000;00:00:01.00;10/8/2022;8;0;0;0;0;1;2;128;3.0;\n";

#[test]
fn renamed_columns_of_the_iver() {
    let imported = import(RENAMED_ROWS).unwrap();
    assert_eq!(imported.format, "Iver UVC mission log, renamed columns");
    assert_eq!(imported.log.rows.len(), 3);
    assert_eq!(imported.log.rows[2].gnss_m(), Some([0.1, 2.1]));
    assert_eq!(imported.log.rows[1].get(Column::Depth), None);
    let notes = imported.log.notes.join("\n");
    assert_eq!(imported.log.rows[0].get(Column::PropCount), Some(32.0));
    for part in ["recognised: t_s", "motor_cmd", "fin_yaw_t", "power_W (not part", "lat_deg, lon_deg (north_m"] {
        assert!(notes.contains(part), "{part} in {notes}");
    }
    let last = &imported.log.rows[2];
    assert_eq!(last.get(Column::Heading), Some(FRAC_PI_2));
    assert_eq!(last.get(Column::SpeedLog), Some(1.0));
}

#[test]
fn native_columns_units_and_midnight() {
    let log = import(NATIVE_ROWS).unwrap().log;
    assert_eq!(log.rows[2].time_us, 2_000_000);
    assert!((log.rows[0].get(Column::Depth).unwrap() - 0.3048).abs() < 1e-12); // 1 foot
    assert!((log.rows[0].get(Column::SpeedLog).unwrap() - 2.0 * 1852.0 / 3600.0).abs() < 1e-12);
    assert_eq!(log.rows[1].gnss_m(), None); // no satellites
    let north_m = log.rows[2].gnss_m().unwrap()[0];
    // 18 µ° of latitude at 25.9 N; WGS 84 has 110.78 km to the degree there (NIMA TR8350.2).
    assert!((north_m - 18e-6 * 110_780.0).abs() < 1e-3, "{north_m}");
    assert!(log.notes.iter().any(|note| note.starts_with("1 position dropped")), "{:?}", log.notes);
    let deep = import(NATIVE_ROWS.replace(";1;2;", ";10;2;")).unwrap().log;
    assert!(!deep.has(Column::GpsX)); // ten feet of water over the antenna
}

#[test]
fn broken_rows_name_line_and_column() {
    let complaint = |text: &str| import(text).unwrap_err().to_string();
    assert!(complaint(&NATIVE_ROWS.replace("00:00:01.00", "soon")).contains(":4:3: Time:"));
    assert!(complaint(&NATIVE_ROWS.replace("10/8/2022", "10/8/2322")).contains("the time is more than a century"));
    assert!(complaint(&NATIVE_ROWS.replace("10/8/2022", "8.10.22")).contains(":3:4: Date:"));
    assert!(complaint(&RENAMED_ROWS.replace("2.0,25.9", "0.5,25.9")).contains(":4:1: t_s: the time is before"));
    assert!(complaint(&RENAMED_ROWS.replace("160,128,22\n1", "160\n1")).contains(":2: 12 cells"));
    assert!(complaint(&NATIVE_ROWS.replace("C True Heading", "Heading")).contains("no column C True Heading"));
    assert!(complaint(&NATIVE_ROWS.replace("25.90001800", "125.9")).contains(":4:1: Latitude: 125.9 is outside"));
}

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
    assert!(imported.log.notes.iter().any(|note| note.contains("gps_range_m (follows")), "{:?}", imported.log.notes);
}

#[test]
fn val_axes_of_the_lake_vehicle() {
    // Heading north (yaw 90 degrees from east), drifting to the right, sinking, turning to the right.
    let text = "t_s,lat_deg,lon_deg,north_m,east_m,roll_rad,pitch_rad,yaw_enu_rad,dvl_fwd_mps,dvl_left_mps,dvl_up_mps,wx_radps,wy_radps,wz_radps,vn_raw,ve_raw\n\
        0,34.5,108.4,1,2,0.1,0.2,1.5707963267948966,1.5,-0.2,-0.3,0.01,0.02,-0.03,0,0\n\
        0.1,34.5,108.4,1,2,0.1,0.2,-3.0,1.5,-0.2,-0.3,0.01,0.02,-0.03,0,0\n";
    let log = import(text).unwrap().log;
    let row = &log.rows[0];
    assert_eq!(row.attitude_rad(), Some([0.1, -0.2, 0.0]));
    assert_eq!(row.dvl_mps(), Some([1.5, 0.2, 0.3]));
    assert_eq!(row.rates_radps(), Some([0.01, -0.02, 0.03]));
    // 3 rad clockwise from east is 261.9 degrees from north, −98.1: 1.5708 + 3 − 2 π.
    let heading = log.rows[1].get(Column::Heading).unwrap();
    assert!((heading - (FRAC_PI_2 + 3.0 - std::f64::consts::TAU)).abs() < 1e-12); // rounding
}

const FLIGHT_ROWS: &str = "t_unix_s,t_s,pitch_rad,roll_rad,heading_mag_rad,battpos_in,ballast_cc,ballast_cmd_cc,depth_m,gps_lat_deg,gps_lon_deg,gps_status,water_vx_lmc_mps,water_vy_lmc_mps\n\
    1466704271.7,0,-0.1,0.2,2.0,1.0,230.0,233,0.5,54.7,15.1,1,0.05,0.04\n\
    1466704275.7,4.0,-0.1,0.2,2.0,1.0,230.0,,0.5,54.7,15.1,0,,\n\
    1466704279.7,8.0,-0.4,0.2,2.0,0.4,-230.0,,5.5,54.7,15.1,,,\n\
    1466704283.7,12.0,-0.4,0.2,2.0,0.4,-230.0,,5.5,54.7,15.1,0,,\n";

#[test]
fn units_and_which_positions_are_fixes() {
    let imported = import(FLIGHT_ROWS).unwrap();
    assert_eq!(imported.format, "glider flight log");
    let log = imported.log;
    let fixes: Vec<u64> = log.rows.iter().filter(|row| row.gnss_m().is_some()).map(|row| row.time_us).collect();
    assert_eq!(fixes, [4_000_000], "stale, reckoned and submerged positions are no fixes");
    assert!((log.rows[2].get(Column::Ballast).unwrap() + 230e-6).abs() < 1e-15);
    assert!((log.rows[0].get(Column::MovingMass).unwrap() - 0.0254).abs() < 1e-15);
    assert_eq!(log.rows[0].get(Column::OwnCurrentE), Some(0.05));
    assert!(log.notes.iter().any(|note| note.starts_with("3 positions dropped")), "{:?}", log.notes);
}

#[test]
fn two_logs_join_by_time() {
    let mut log = import(FLIGHT_ROWS).unwrap().log;
    let science = import("t_s,density_kgm3,U_adcp_mps\n4.0,1005.5,\n6.0,1006.0,0.3\n").unwrap().log;
    log.join(science);
    let times: Vec<u64> = log.rows.iter().map(|row| row.time_us / 1_000_000).collect();
    assert_eq!(times, [0, 4, 4, 6, 8, 12]);
    assert_eq!(log.column(Column::WaterSpeed).collect::<Vec<_>>(), [(6_000_000, 0.3)]);
}

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
    assert!((get(Column::ReplyHeading) - FRAC_PI_2).abs() < 1e-12); // rounding
    log.join(import("name,east_m,north_m,up_m,sigma_m\nM11,-47,408.5,-1345,3\nM13,1,2,-3,3\n").unwrap().log);
    let place = log.rows.iter().find(|row| row.get(Column::StationX).is_some()).unwrap();
    assert_eq!((place.time_us, place.get(Column::Station)), (0, Some(11.0)));
    assert_eq!((place.get(Column::StationX), place.get(Column::StationZ)), (Some(408.5), Some(1345.0)));
    let error = import("name,east_m,north_m,up_m\nfirst,1,2,3\n").unwrap_err().to_string();
    assert!(error.contains("holds no number, such as M11"), "{error}");
}

#[test]
fn a_new_label_begins_a_new_run() {
    let head = "run,t_s,wind_rel_mps,wind_rel_from_rad,wind_true_mps,wind_true_from_rad";
    let log = import(format!("{head}\na,0.0,1,1,0.5,1\na,0.1,1,1,0.5,4\nb,0.0,1,1,2,1\nb,0.1,1,1,2,1\n")).unwrap().log;
    let runs: Vec<_> = log.column(Column::Run).collect();
    assert_eq!(runs, [(0, 1.0), (100_000, 1.0), (100_100_000, 2.0), (100_200_000, 2.0)]);
    assert_eq!(log.rows[1].get(Column::WindFrom), Some(4.0));
    assert!(log.notes.iter().any(|note| note == "run 2: b, from 100 s of the joined log"), "{:?}", log.notes);
    // Within a run times may not go back.
    assert!(import(format!("{head}\na,0.1,1,1,0.5,1\na,0.0,1,1,0.5,1\n")).is_err());
}

#[test]
fn runs_of_two_tables_join_by_their_labels() {
    let wind = "run,t_s,wind_rel_mps,wind_rel_from_rad,wind_true_mps,wind_true_from_rad\n";
    let mut log = import(format!("{wind}a,0.0,1,1,0.5,1\na,0.1,1,1,0.5,4\n")).unwrap().log;
    log.join(import(format!("{wind}b,0.0,1,1,2,1\na,0.1,1,1,3,1\n")).unwrap().log);
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
    let ship =
        "run,t_s,x_m,u_mps,y_m,v_mid_mps,heading_rad,r_radps,prop_rps,rudder_rad\nz,0,1,0.5,2,0.1,0.2,0.01,8,-0.3\n";
    let row = import(ship).unwrap().log.rows[0].clone();
    assert_eq!(
        (row.get(Column::PropRpm), row.get(Column::Rudder), row.gnss_m()),
        (Some(480.0), Some(-0.3), Some([1.0, 2.0]))
    );
    let row =
        import("t_s,vx_mps,vy_mps,cmd_left,cmd_right\n0,0.3,0.4,,\n0.1,0.3,0.4,0.5,0.6\n").unwrap().log.rows[1].clone();
    assert_eq!((row.get(Column::ThrusterRight), row.get(Column::Mass)), (Some(0.6), Some(28.0)));
}

#[test]
fn val_axes_of_the_lake_vehicle_as_published() {
    // Heading north (yaw 90 degrees from east), nose down, drifting to the right, sinking, turning to the right.
    let head = "lat,lon,alt,roll,pitch,yaw,vn,ve,vf,vl,vu,ax,ay,az,af,al,au,wx,wy,wz,wf,wl,wu,pos_accuracy,\
        vel_accuracy,navstat,numsats,posmode,velmode,orimode,time";
    let row = |lat: f64, t_s: f64| {
        format!(
            "{lat},108.4,0,0.1,0.2,1.5707963267948966,0,0,1.5,-0.2,-0.3,0,0,0,0,0,0,0.01,0.02,-0.03,0,0,0,0,0,0,0,{t_s},{t_s},{t_s},{t_s}"
        )
    };
    let imported = import(format!("{head}\r\n{}\r\n{}\r\n", row(34.5, 0.0), row(34.50001, 0.2))).unwrap();
    assert_eq!(imported.format, "DVL and AHRS log of AUV_navigation_dataset");
    let [first, second] = &imported.log.rows[..] else { panic!("{:?}", imported.log.rows) };
    assert_eq!((first.attitude_rad(), first.gnss_m()), (Some([0.1, -0.2, 0.0]), Some([0.0, 0.0])));
    assert_eq!((first.dvl_mps(), first.rates_radps()), (Some([1.5, 0.2, 0.3]), Some([0.01, -0.02, 0.03])));
    assert_eq!(second.time_us, 200_000);
    // 10 µ° of latitude at 34.5 N; WGS 84 has 110.93 km to the degree there (NIMA TR8350.2)
    assert!((second.gnss_m().unwrap()[0] - 1.1093).abs() < 1e-3, "{:?}", second.gnss_m());
    let notes = imported.log.notes.join("\n");
    assert!(notes.contains("numsats, posmode, velmode, orimode (not filled in"), "{notes}");
    // the older layout has other units under the same names
    assert!(import(format!("{}\n{}\n", head.replace(",alt,", ",alt_gps,"), row(34.5, 0.0))).is_err());
}

#[test]
fn pings_and_places_as_garpos_has_them() {
    let text = "# cfgfile = ./initcfg/X/X.ini\n\
        ,SET,LN,MT,TT,ResiTT,TakeOff,gamma,flag,ST,ant_e0,ant_n0,ant_u0,head0,pitch0,roll0,RT,ant_e1,ant_n1,ant_u1,head1,pitch1,roll1\n\
        0,S01,L01,M11,2.25,0.0,0.0,0.0,False,30072.5,-27.5,1473.0,14.5,180,0.5,-1,30075.7,-26.5,1462.0,14.25,90,0,0\n\
        1,S01,L01,M13,9.5,0.0,0.0,0.0,True,30082.5,-22.0,1412.0,14.5,188,0,0,30096.6,-22.25,1401.0,14.5,190,0,0\n\
        2,S01,L01,M13,3.5,0.0,0.0,0.0,False,30092.5,-22.0,1412.0,14.5,188,0,0,30096.6,-22.25,1401.0,14.5,190,0,0\n";
    let imported = import(text).unwrap();
    assert_eq!(imported.format, "GARPOS observation file");
    let mut log = imported.log;
    assert_eq!(log.column(Column::TwoWayTime).collect::<Vec<_>>(), [(0, 2.25), (20_000_000, 3.5)]);
    let row = &log.rows[0];
    let get = |column| row.get(column).unwrap();
    assert_eq!((row.gnss_m(), get(Column::GpsZ), get(Column::ReplyGpsY)), (Some([1473.0, -27.5]), -14.5, -26.5));
    assert!((get(Column::ReplyHeading) - FRAC_PI_2).abs() < 1e-12); // rounding
    assert!(log.notes.iter().any(|note| note.starts_with("1 row left out")), "{:?}", log.notes);
    let site = "[Obs-parameter]\n Site_name = X\n\n[Model-parameter]\n# MT_Pos : 'stapos_E' 'stapos_N'\n\
        M11_dPos = -47.0 408.5 -1345.0 3.0 3.0\n M13_dPos = 1 2 -3 0 0 0\n dCentPos = 0.5 0.25 -1 0 0 0\n\
        ATDoffset = 1.5 -1.25 20 0 0 0\n";
    log.join(import(site).unwrap().log);
    assert_eq!(log.stations_m()[&11], [408.75, -46.5, 1346.0]);
    assert_eq!(log.stations_m()[&13], [2.25, 1.5, 4.0]);
    assert!(log.notes.iter().any(|note| note.contains("1.5, -1.25, 20 m forward")), "{:?}", log.notes);
    let complaint = |text: &str| import(text).unwrap_err().to_string();
    assert!(
        complaint(&site.replace("408.5", "north")).contains(":6:1: M11_dPos: expected east, north, up in m, no north")
    );
    assert!(complaint(&site.replace("M11", "A")).contains(":6:1: \"A\" holds no number, such as M11"));
    assert!(complaint("[Obs-parameter]\n").contains("without a place"));
}

/// Writes files and joins what is read of them, in this order.
fn joined(files: &[(&str, &str)]) -> crate::Log {
    let folder = tempfile::tempdir().unwrap();
    let mut logs = files.iter().map(|(name, text)| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        super::read(&path).unwrap().log
    });
    let mut log = logs.next().unwrap();
    logs.for_each(|other| log.join(other));
    log
}

#[test]
fn a_file_is_a_run_by_its_name() {
    let dvl = "Time [s],DVL X [m/s],DVL Y [m/s],DVL Z [m/s]\n0.0,2,0.1,0\n1.00250626566,2.5,0.1,0\n";
    let reference = "Time [s],Longitude [rad],Latitude [rad],Altitude [m],V North [m/s],V East [m/s],V Down [m/s],Roll [rad],Pitch [rad],Yaw [rad]\n\
        0.0,0.6,0.5,-19,1,2,0.1,0,0.01,3\n1.00250626566,0.6,0.5,-19,1,2.5,0.1,0,0.01,3\n";
    let log = joined(&[
        ("DVL_trajectory1.csv", dvl),
        ("GT_trajectory1.csv", reference),
        ("DVL_trajectory2.csv", dvl),
        ("GT_trajectory2.csv", reference),
    ]);
    assert_eq!(log.runs, [("trajectory1".to_owned(), 0), ("trajectory2".to_owned(), 101_000_000)]);
    let of = |column| log.column(column).collect::<Vec<_>>();
    assert_eq!(of(Column::DvlU), [(0, 2.0), (1_000_000, 2.5), (101_000_000, 2.0), (102_000_000, 2.5)]);
    assert_eq!(of(Column::RefEast), [(0, 2.0), (1_000_000, 2.5), (101_000_000, 2.0), (102_000_000, 2.5)]);
    assert_eq!(of(Column::Run).iter().map(|(_, run)| *run).sum::<f64>(), 12.0);
}

#[test]
fn a_ship_model_with_its_wind() {
    let head = "t [s],x_position_mid [m],u_velo [m/s],y_position_mid [m],vm_velo [m/s],psi_hat [rad],r_angvelo [rad/s],n_prop [rps],delta_rudder [rad],\
        wind_velo_relative_mid [m/s],wind_dir_relative_mid [rad],wind_velo_true [m/s],wind_dir_true [rad]";
    let text = format!("{head}\n0.0,1,0.5,2,0.1,0.2,0.01,8,-0.3,1.2,5.2,1.0,5.0\n");
    let log = joined(&[("turn_1-Jan-2020.csv", &text), ("zigzag_2-Jan-2020.csv.gz", &text)]);
    assert_eq!(log.runs[1], ("zigzag_2-Jan-2020".to_owned(), 100_000_000));
    let row = &log.rows[1];
    let get = |column| row.get(column).unwrap();
    assert_eq!((get(Column::PropRpm), get(Column::Rudder), row.gnss_m()), (480.0, -0.3, Some([1.0, 2.0])));
    assert_eq!((get(Column::DvlU), get(Column::DvlV), get(Column::R)), (0.5, 0.1, 0.01));
    assert_eq!((get(Column::WindSpeed), get(Column::WindFrom), get(Column::Run)), (1.0, 5.0, 2.0));
}
