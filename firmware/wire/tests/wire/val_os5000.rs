use crate::vectors::{sentence, sentences};
use backseat_wire::Error;
use backseat_wire::ahrs::os5000::Os5000;

const FILE: &str = include_str!("../vectors/os5000.nmea");

#[test]
fn val_every_vector_is_taken_or_refused_and_survives_being_written() {
    let mut buffer = [0; 128];
    let (mut taken, mut refused) = (0, 0);
    for (_, line) in sentences(FILE) {
        // Malformed on purpose: tags without values.
        if line.starts_with("$CPRTD") || line.contains("D*53") {
            assert_eq!(Os5000::parse(&sentence(line)), Err(Error::Missing), "{line}");
            refused += 1;
            continue;
        }
        let compass = Os5000::parse(&sentence(line)).unwrap_or_else(|cause| panic!("{line}: {cause:?}"));
        let written = String::from_utf8(compass.emit(&mut buffer).unwrap().to_vec()).unwrap();
        assert_eq!(Os5000::parse(&sentence(&written)), Ok(compass), "{line}");
        assert_eq!(written.trim_end(), line);
        taken += 1;
    }
    assert_eq!((taken, refused), (6, 2));
}

#[test]
fn val_manual_example_with_everything() {
    let line = "$C212.4P2.5R-14.0T28.4Mx107977.90My-79422.00Mz173.27Ax0.045Ay-0.245Az0.977*3A";
    let compass = Os5000::parse(&sentence(line)).unwrap();
    assert_eq!(compass.mag, Some([107_977.90, -79_422.0, 173.27]));
    let sample = compass.sample();
    let [roll, pitch, heading] = sample.euler_rad.unwrap();
    for (value, degrees) in [(roll, -14.0_f64), (pitch, 2.5), (heading, 212.4)] {
        assert!((value - degrees.to_radians()).abs() < 1e-12);
    }
    // Positive down as sent; a specific force points up at rest.
    let [x, y, z] = sample.specific_force_mps2.unwrap();
    assert!(
        (x + 0.045 * 9.80665).abs() < 1e-9 && (y - 0.245 * 9.80665).abs() < 1e-9 && (z + 0.977 * 9.80665).abs() < 1e-9
    );
    assert_eq!((sample.rates_radps, sample.timer_us), (None, None));
}

#[test]
fn refused_by_cause() {
    for (line, cause) in [
        ("$C360.1P0.0R0.0", Error::OutOfRange),
        ("$C10.0P91.0R0.0", Error::OutOfRange),
        ("$C10.0R1.0P0.0", Error::Malformed),
        ("$C10.0P1.0P0.0", Error::Malformed),
        ("$C1.0.0P1.0", Error::Malformed),
        ("$C1.0Ax0.0Ay1.0", Error::Missing),
        ("$C1.0,P2", Error::Unknown),
        ("$HCHDT,1", Error::Unknown),
    ] {
        assert_eq!(Os5000::parse(&sentence(line)).unwrap_err(), cause, "{line}");
    }
}
