use super::*;
use crate::importers::tests::import;
use crate::log::{Column, Log};
use backseat_wire::ship_state::ShipState;
use backseat_wire::vehicle_state::VehicleState;

/// Sentences of `firmware/wire/tests/vectors`, and their decoded values as printed there.
const GNSS: &str = "1418256003.20 $GNRMC,000001.00,A,2304.167961,N,16553.836924,W,7.87,100.6,111214,0,E,D*17\n\
    1418256003.21 $GNGGA,000001.00,2304.167961,N,16553.836924,W,2,11,1.0,44.542,M,0.000,M,2.0,0103*43\n\
    1418256004.10 $GPHDT,90.0,T\n\
    1418256004.20 $GPGSV,1,1,00*79\n\
    1418256004.30 $GNGGA,000002.00,2304.167961,N,16553.836924,W,2,11*00\n";

#[test]
fn val_a_receiver_with_the_clock_of_the_lines_ahead() {
    let imported = import(GNSS).unwrap();
    let log = &imported.log;
    assert_eq!((imported.format, log.rows.len()), (NAME, 2));
    // 11 December 2014, 00:00:01 UTC (date -u -d ... +%s)
    assert_eq!(log.start_unix_us, Some(1_418_256_001_000_000));
    assert_eq!(log.rows[0].gnss_m(), Some([0.0, 0.0]));
    let origin = log.origin_deg.unwrap();
    assert!(
        (origin[0] - (23.0 + 4.167_961 / 60.0)).abs() < 1e-9 && (origin[1] + 165.0 + 53.836_924 / 60.0).abs() < 1e-9
    );
    // the lines are 2.2 s ahead: the heading was read at 1.90 s UTC, 0.90 s after the fix
    assert_eq!(log.rows[1].time_us, 900_000);
    assert!((log.rows[1].get(Column::Heading).unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let notes = log.notes.join("\n");
    assert!(
        notes.contains("2.20 s ahead of UTC") && notes.contains("GNGGA (1)") && notes.contains("GPGSV (1)"),
        "{notes}"
    );
}

#[test]
fn val_a_packet_becomes_a_range() {
    let ship = ShipState {
        source: 1,
        sequence: 7,
        transmit_s: 1_795_176_000, // 20 November 2026, 12:00:00
        position_deg: [41.5, -70.5],
        velocity_mps: [0.0, 0.0],
        position_sigma_m: 1.0,
        velocity_sigma_mps: 0.1,
        transducer_depth_m: 2.0,
    };
    let digits: String = ship.emit().unwrap().iter().map(|byte| format!("{byte:02X}")).collect();
    // the clock mode and arrival of the synthetic vector of the Micro-Modem: 0.6667 s after the second, closing by
    // 0.5 m/s
    let log = format!(
        "2026-11-20 12:00:06,120 - modem - $CARXD,1,2,0,1,{digits}00000000000000\n\
         2026-11-20 12:00:06,180 - modem - $CACST,6,0,20261120120000.666700,03,1440,25,0175,0166,75,01,01,01,03,1,001,002,0,\
         3,3,0,150,12.0,9.0,10,-9,212,-0.50,45,25000,5000,0\n\
         2026-11-20 12:00:07,000 - modem - $CAMPR,2,1,0.6667\n"
    );
    let imported = import(&log).unwrap();
    let log = &imported.log;
    assert_eq!(log.rows.len(), 1, "{log:?}");
    let row = &log.rows[0];
    assert!((row.get(Column::Range).unwrap() - 0.6667 * 1500.0).abs() < 1e-6);
    assert_eq!(row.get(Column::RangeRate).map(|rate| (rate * 100.0).round()), Some(50.0));
    assert_eq!(row.ship_at_launch_m(), Some([0.0, 0.0]));
    // times from the arrival on; the launch is before the log begins
    assert_eq!(
        (row.time_us, row.arrival_us(), log.start_unix_us),
        (666_700, Some(666_700), Some(1_795_176_000_000_000))
    );
    assert_eq!(row.launch_us(), Some(0));
    assert!(log.notes.iter().any(|note| note.contains("CAMPR (1): two-way")), "{:?}", log.notes);
}

/// The ship's modem: the packet before with a vehicle's state, 0.6667 s under way.
#[test]
fn val_an_uplink_becomes_a_range_at_the_ship() {
    let uplink = |source: u8, synchronous: bool| {
        let state = VehicleState {
            source,
            transmit_s: 1_795_176_000, // 20 November 2026, 12:00:00
            position_deg: [41.5, -70.5],
            velocity_mps: [1.0, 0.0],
            depth_m: 3.0,
            position_sigma_m: 1.0,
            ellipse: backseat_wire::ellipse::Ellipse::CIRCLE,
            leans: false,
            velocity_sigma_mps: 0.1,
            heading_rad: 0.0,
            level_m: [None; 2],
            mode: 3,
            synchronous,
            named: backseat_wire::named::Named::NOTHING,
        };
        let mut buffer = [0; backseat_wire::vehicle_state::AUTHENTIC_LENGTH];
        let bytes = state.emit(&backseat_wire::ship_state::Key::NONE, &mut buffer).unwrap();
        let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        format!(
            "2026-11-20 12:00:06,120 - modem - $CARXD,{source},1,0,1,{digits}00000000\n\
             2026-11-20 12:00:06,180 - modem - $CACST,6,0,20261120120000.666700,03,1440,25,0175,0166,75,01,01,01,03,{source},\
             001,002,0,3,3,0,150,12.0,9.0,10,-9,212,-0.50,45,25000,5000,0\n"
        )
    };
    let log = import(uplink(2, true)).unwrap().log;
    let row = &log.rows[0];
    assert!((row.get(Column::UplinkRange).unwrap() - 0.6667 * 1500.0).abs() < 1e-6 && log.rows.len() == 1);
    assert_eq!((row.get(Column::Range), row.ship_at_launch_m(), log.origin_deg), (None, None, None));
    assert_eq!((row.launch_us(), row.arrival_us()), (Some(0), Some(666_700)));
    // a vehicle without a pulse, and two vehicles
    assert!(import(uplink(2, false)).is_err());
    let two = import(format!("{}{}", uplink(2, true), uplink(3, true))).unwrap_err().to_string();
    assert!(two.contains("uplinks of several vehicles"), "{two}");
}

#[test]
fn val_a_dvl_in_pd6() {
    // the synthetic set of firmware/wire/tests/vectors/pd6.txt: 1.25 m/s forward
    let log = "12.5 :SA, +1.25, -0.40,310.20\n12.5 :TS,26112012000100,35.0,+15.2,   3.2,1506.1,  0\n\
        12.5 :BI,   +12, +1250,    -4,    +1,A\n12.5 :BD,       -12.30,       +10.40,        +0.20,  10.40,  0.00\n";
    let row = import(log).unwrap().log.rows[0].clone();
    assert_eq!(row.dvl_mps(), Some([1.25, 0.012, 0.004]));
    assert_eq!(row.get(Column::Depth), Some(3.2));
}

#[test]
fn tables_are_no_sentences() {
    for text in ["t_s,depth_m", "Latitude;Longitude", "price $,x", "12:30:45,1,2", "$", ":", "$abc"] {
        assert!(split(text).is_none(), "{text}");
    }
}

fn samples(log: &Log, column: Column) -> Vec<f64> {
    log.column(column).map(|(_, value)| value).collect()
}

/// A ship's log of HiPAP as APOS lays it out (NMEA 0183 sentences, 850-160045/E), the numbers our own.
const HIPAP: &str = "$GPGGA,083717.34,4130.500000,N,07040.250000,W,2,12,0.6,-0.52,M,20.34,M,7.0,0907*7A\n\
    $PSIMSNS,075617.446,,1,1,-0.50,1.25,0.10,215.00,,a0,0.000,,M121*56\n\
    $PSIMSSB,083733.036,B05,A,NRy,C,N,F,0.000,0.000,0.000,20.000,T,0.004000,*06\n\
    $PSIMSSB,083733.386,B05,A,,C,N,F,52.125,3.250,31.500,1.414,T,0.040000,*5B\n\
    $GPGGA,083737.34,4130.500000,N,07040.250000,W,2,12,0.6,-0.52,M,20.34,M,7.0,0907*78\n\
    $PSIMSSB,094532.523,B05,V,NRy,C,N,M,,,,,T,0.002500,*2F\n\
    $PSIMSSB,083733.386,B05,A,,C,N,F,52.125,3.250,31.5\n\
    $PSIMSSB,083733.386,B05,A,,C,N,F,52.125,3.250,91.500,1.414,T,0.040000,*54\n";

#[test]
fn val_hipap_sees_the_vehicle_from_the_ship() {
    let Imported { format, log } = import(HIPAP).unwrap();
    assert_eq!(format, NAME);
    let row = log.rows.iter().find(|row| row.usbl().is_some()).unwrap();
    let fix = row.usbl().unwrap();
    for (found, expected) in fix.vector_m().iter().zip([52.125, 3.250, 31.500]) {
        assert!((found - expected).abs() < 1e-9, "{fix:?}");
    }
    // 1.414 m is the root of 1 m and 1 m squared
    assert!((fix.angle_sigma_rad * fix.range_m - 1.0).abs() < 1e-3 && !fix.on_vehicle, "{fix:?}");
    // 16.046 s after the first fix of the ship, whose place it is; the sound was 0.040000 s under way
    assert_eq!((row.time_us, row.arrival_us(), row.launch_us()), (16_046_000, Some(16_046_000), Some(16_006_000)));
    assert_eq!(row.ship_at_launch_m(), Some([0.0, 0.0]));
    assert_eq!(samples(&log, Column::ShipGpsX), [0.0, 0.0]);
    assert!(!log.has(Column::GpsX) && !log.has(Column::Heading));
    let notes = log.notes.join("\n");
    for part in [
        "1 fixes by USBL of B05, of an array on the ship",
        "1 of them from the maker's own filter",
        "left out PSIMSSB (2): no position was measured",
        "left out PSIMSSB (1): a field is missing",
        "left out PSIMSSB (1): the checksum is wrong, or the line was cut off",
    ] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
}

/// The axes of Kongsberg's table (850-160045/E), the vehicle 100 m east and 50 m north of a ship that heads east.
#[test]
fn val_kongsbergs_axes() {
    let sns = |settings: &str| format!("$PSIMSNS,120000.0,B01,1,1,0,0,0,90.00,,{settings},0.000,,M121\n");
    let ssb = |axes: &str, x_y: &str| format!("$PSIMSSB,120000.0,B01,A,,{axes},M,{x_y},48.50,0.00,N,,*\n");
    for (axes, x_y) in [("C,N", "50,100"), ("C,E", "100,50"), ("C,H", "-50,100"), ("P,H", "111.80339887,-26.56505118")]
    {
        let log = import(format!("{}{}", sns("a0"), ssb(axes, x_y))).unwrap().log;
        let fix = log.rows[0].usbl().unwrap();
        for (found, expected) in fix.vector_m().iter().zip([50.0, 100.0, 48.5]) {
            assert!((found - expected).abs() < 1e-6, "{axes}: {:?}", fix.vector_m());
        }
        assert_eq!(fix.angle_sigma_rad, crate::log::USBL_ANGLE_SIGMA_RAD);
    }
    for (text, expected) in [
        (ssb("C,H", "-50,100"), "no heading of the ship within a second"),
        (ssb("U,N", "5000000,500000"), "set APOS to Cartesian coordinates"),
        (format!("{}{}", sns("80"), ssb("C,N", "50,100")), "local times"),
    ] {
        let complaint = import(&text).unwrap_err().to_string();
        assert!(complaint.contains(expected), "{complaint}");
    }
}

/// A fix and a line that is none as EvoLogics' S2C guide lays them out (standard version 1.7.D1, page 91), the numbers
/// our own.
const EVOLOGICS: [&str; 2] = [
    "USBLLONG,1700000000.499612,1700000000.365264,2,1044.2500,-1060.5000,7.5000,1060.5000,-1044.2500,-7.5000,\
     3.1416,-0.0000,-1.5708,990922,-40,120,0.0001",
    "USBLLONG,1700000100.400000,1700000100.100000,2,15.2500,4.5000,2.2500,15.2500,4.5000,2.2500,\
     0.0000,-0.0000,0.0000,10700,-50,106,0.1500",
];

#[test]
fn val_evologics_sees_the_vehicle_from_the_ship() {
    let [fix, no_attitude] = EVOLOGICS;
    let framed = format!("+++AT:{}:{fix}", fix.len());
    let rest = format!(
        "+++AT:13:DELIVEREDIM,2\n+++AT:9:RECVIM,3,$\n+++AT?S:2:OK\n{no_attitude}\n{}\n{}\n",
        framed.replace(",120,0.0001", ",12"),
        fix.replace("USBLLONG", "USBLANGLES")
    );
    // in command mode, in data mode, and with the time of a program that is an hour ahead
    for (text, start_us) in [
        (format!("OK\n{fix}\n{rest}"), 1_700_000_000_365_264),
        (format!("{framed}\r\n{rest}"), 1_700_000_000_365_264),
        (format!("[INFO] [1700003600.500000]: {framed}\n{rest}"), 1_700_003_600_365_652),
    ] {
        let Imported { format, log } = import(&text).unwrap();
        assert_eq!((format, log.rows.len()), (NAME, 1), "{log:?}");
        let (row, found) = (&log.rows[0], log.rows[0].usbl().unwrap());
        for (found, expected) in found.vector_m().iter().zip([-1044.2500, 1060.5000, 7.5000]) {
            assert!((found - expected).abs() < 1e-9, "{found}");
        }
        // 0.1 mm of 1486 m; the sound was 0.990922 s under way
        assert!((found.angle_sigma_rad * found.range_m - 1e-4).abs() < 1e-9);
        assert_eq!((row.arrival_us(), row.launch_us()), (Some(990_922), Some(0)));
        assert_eq!(log.start_unix_us, Some(start_us - 990_922));
        let notes = log.notes.join("\n");
        for part in [
            "no attitude of the array",
            "USBLANGLES (1): a direction without a range",
            "the line was cut off",
            "RECVIM (1)",
        ] {
            assert!(notes.contains(part), "{part}: {notes}");
        }
    }
}

#[test]
fn the_transponder_that_is_heard_most_is_the_vehicle() {
    let heard = |name: &str, second: u32, east_m: u32| {
        format!("$PSIMSSB,1200{second:02}.0,{name},A,,C,N,M,0,{east_m},10,1.0,N,,\n")
    };
    let text = [heard("M1", 0, 50), heard("M2", 1, 60), heard("M2", 11, 70)].concat();
    let log = import(&text).unwrap().log;
    assert_eq!(samples(&log, Column::UsblEast), [60.0, 70.0]);
    assert!(log.notes.iter().any(|note| note.contains("left out fixes by USBL of M1 (1)")), "{:?}", log.notes);
}
