use crate::vectors::{assert_framed_at_every_split, sentence, sentences};
use backseat_wire::Error;
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::gps::{Gga, Gst, Hdt, Rmc};
use backseat_wire::nmea::{Checksum, Sentence};

const FILE: &str = include_str!("../vectors/gps.nmea");

#[test]
fn val_every_vector_is_taken_and_survives_being_written() {
    let mut buffer = [0; 128];
    let (mut taken, mut refused) = (0, 0);
    for (_, line) in sentences(FILE) {
        let sentence = sentence(line);
        // The last synth line has minutes = 60.
        if line.contains("4160.0000") {
            assert_eq!(Rmc::parse(&sentence), Err(Error::OutOfRange));
            refused += 1;
            continue;
        }
        if line.contains("RMC") {
            let rmc = Rmc::parse(&sentence).unwrap_or_else(|cause| panic!("{line}: {cause:?}"));
            let written = String::from_utf8(rmc.emit(&mut buffer).unwrap().to_vec()).unwrap();
            assert_eq!(Rmc::parse(&self::sentence(&written)), Ok(rmc), "{line} {written}");
        } else {
            let gga = Gga::parse(&sentence).unwrap_or_else(|cause| panic!("{line}: {cause:?}"));
            let written = String::from_utf8(gga.emit(&mut buffer).unwrap().to_vec()).unwrap();
            assert_eq!(Gga::parse(&self::sentence(&written)), Ok(gga), "{line} {written}");
        }
        taken += 1;
    }
    assert_eq!((taken, refused), (10, 1));
}

#[test]
fn val_published_rmc() {
    let rmc = Rmc::parse(&sentence("$GPRMC,150853,A,4132.1365,N,07040.3828,W,000.0,077.3,090909,015.5*0B")).unwrap();
    // 2009-09-09 15:08:53 UTC, by `date -u -d @`.
    assert_eq!(rmc.utc.unwrap().unix_us(), 1_252_508_933_000_000);
    assert!(rmc.valid);
    let [latitude, longitude] = rmc.position_deg.unwrap();
    // 41 + 32.1365 / 60, -(70 + 40.3828 / 60); 1e-12 degree is a tenth of a micrometre.
    assert!((latitude - 41.535_608_333_333_33).abs() < 1e-12 && (longitude + 70.673_046_666_666_67).abs() < 1e-12);
    assert_eq!(rmc.speed_mps, Some(0.0));
    assert!((rmc.course_rad.unwrap() - 77.3_f64.to_radians()).abs() < 1e-12);
    // No E or W: its sign is not known.
    assert_eq!(rmc.variation_rad, None);
}

#[test]
fn val_published_gga() {
    let gga =
        Gga::parse(&sentence("$GNGGA,000001.00,2304.167961,N,16553.836924,W,2,11,1.0,44.542,M,0.000,M,2.0,0103*43"))
            .unwrap();
    assert_eq!(gga.time.unwrap().us(), 1_000_000);
    assert_eq!((gga.quality, gga.satellites, gga.hdop), (2, 11, Some(1.0)));
    assert_eq!((gga.altitude_m, gga.geoid_m), (Some(44.542), Some(0.0)));
    let [latitude, longitude] = gga.position_deg.unwrap();
    assert!((latitude - (23.0 + 4.167_961 / 60.0)).abs() < 1e-12);
    assert!((longitude + (165.0 + 53.836_924 / 60.0)).abs() < 1e-12);
}

#[test]
fn no_fix_has_no_position() {
    let rmc = Rmc::parse(&sentence("$GPRMC,120000.00,V,,,,,,,201126,,,N*78")).unwrap();
    assert_eq!((rmc.valid, rmc.position_deg, rmc.speed_mps), (false, None, None));
    assert!(rmc.utc.is_some());
    let gga = Gga::parse(&sentence("$GPGGA,120000.00,,,,,0,00,99.9,,M,,M,,*5C")).unwrap();
    assert_eq!((gga.quality, gga.position_deg), (0, None));
}

#[test]
fn written_as_these_bytes() {
    let rmc = Rmc::parse(&sentence("$GPRMC,120000,A,8959.9999,S,17959.9999,W,010.5,359.9,201126,014.6,W*61")).unwrap();
    let mut buffer = [0; 128];
    assert_eq!(
        rmc.emit(&mut buffer).unwrap(),
        b"$GPRMC,120000.00,A,8959.999900,S,17959.999900,W,010.50,359.9,201126,014.6,W,A*12\r\n"
    );
    assert_eq!(rmc.emit(&mut buffer[..40]), Err(Error::BufferFull));
}

#[test]
fn refused_by_cause() {
    for (line, cause) in [
        ("$GPRMC,120000,A,9000.0001,N,07000.0000,W,0,0,201126,,", Error::OutOfRange),
        ("$GPRMC,120000,A,4100.0000,N,18000.0001,W,0,0,201126,,", Error::OutOfRange),
        ("$GPRMC,120000,A,4100.0000,X,07000.0000,W,0,0,201126,,", Error::Malformed),
        ("$GPRMC,120000,A,100.0000,N,07000.0000,W,0,0,201126,,", Error::Malformed),
        ("$GPRMC,120000,A,-4100.000,N,07000.0000,W,0,0,201126,,", Error::Malformed),
        ("$GPRMC,250000,A,4100.0000,N,07000.0000,W,0,0,201126,,", Error::OutOfRange),
        ("$GPRMC,120000,A,4100.0000,N,07000.0000,W,0,0,310226,,", Error::OutOfRange),
        ("$GPRMC,120000,A,,,,,0,0,201126,,", Error::Missing),
        ("$GPRMC,120000,Q,4100.0000,N,07000.0000,W,0,0,201126,,", Error::Malformed),
        ("$GPRMC", Error::Missing),
        ("$GPVTG,1", Error::Unknown),
    ] {
        assert_eq!(Rmc::parse(&sentence(line)).unwrap_err(), cause, "{line}");
    }
}

#[test]
fn framed_at_every_split() {
    let lines: Vec<&str> = sentences(FILE).into_iter().map(|(_, line)| line).collect();
    assert_framed_at_every_split(&lines);
}

/// The example of NMEA 0183 (u-blox and Trimble manuals print it) and a gyrocompass's heading.
#[test]
fn val_accuracy_and_heading() {
    let gst = Gst::parse(&sentence("$GPGST,024603.00,3.2,6.6,4.7,47.3,5.8,5.6,22.0*58")).unwrap();
    assert_eq!(gst.sigma_m, Some([5.8, 5.6]));
    assert_eq!(gst.time, Some(TimeOfDay::from_us(9_963_000_000)));
    let hdt = Hdt::parse(&sentence("$HEHDT,90.00,T*26"));
    let heading = hdt.unwrap().heading_rad.unwrap();
    assert!((heading - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let mut buffer = [0; 96];
    let parsed = Sentence::from_line(gst.emit(&mut buffer).unwrap(), Checksum::Required).unwrap();
    assert_eq!((Gst::parse(&parsed), Hdt::parse(&parsed)), (Ok(gst), Err(Error::Unknown)));
}
