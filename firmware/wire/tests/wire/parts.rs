//! Decimals, dates, hex digits, the framer itself.

use backseat_wire::calendar::{Date, DateTime, TimeOfDay};
use backseat_wire::nmea::{Checksum, Framer, MAX_BODY, Sentence};
use backseat_wire::{Decimal, Error, hex};

#[test]
fn val_decimals_are_what_the_standard_library_reads() {
    for text in [
        "0",
        "-0.0",
        "1",
        "+12.5",
        "-3.89",
        "5321.6802",
        ".5",
        "7.",
        "000.0",
        "0.1",
        "0.7345",
        "999999.999999999",
        "-0.000001",
    ] {
        let decimal = Decimal::parse(text.as_bytes()).unwrap();
        assert_eq!(decimal.to_f64(), text.parse::<f64>().unwrap(), "{text}");
    }
    for scale in 0..10 {
        for mantissa in (-2_000_000_000_000..2_000_000_000_000_i64).step_by(77_777_777_777) {
            let decimal = Decimal::new(mantissa, scale);
            assert_eq!(Decimal::from_f64(decimal.to_f64(), scale), Ok(decimal));
        }
    }
    assert_eq!(Decimal::from_f64(0.05, 1), Ok(Decimal::new(1, 1)));
    assert_eq!(Decimal::from_f64(-0.04, 1), Ok(Decimal::new(0, 1)));
}

#[test]
fn decimals_refused_by_cause() {
    for (text, cause) in [
        ("", Error::Missing),
        ("-", Error::Malformed),
        (".", Error::Malformed),
        ("1.2.3", Error::Malformed),
        ("1e3", Error::Malformed),
        ("nan", Error::Malformed),
        ("1 ", Error::Malformed),
        ("--1", Error::Malformed),
        ("1234567890123456789", Error::OutOfRange),
    ] {
        assert_eq!(Decimal::parse(text.as_bytes()), Err(cause), "{text}");
    }
    for value in [f64::NAN, f64::INFINITY, -1e30] {
        assert_eq!(Decimal::from_f64(value, 3), Err(Error::OutOfRange));
    }
    assert_eq!(Decimal::new(i64::MAX, 0).rescaled(1), None);
}

#[test]
fn val_dates() {
    for (date, days) in [
        ((1970, 1, 1), 0),
        ((2000, 2, 29), 11_016),
        ((2000, 3, 1), 11_017),
        ((2026, 11, 20), 20_777),
        ((2100, 2, 28), 47_540),
        ((2100, 3, 1), 47_541),
    ] {
        let (year, month, day) = date;
        let date = Date::new(year, month, day).unwrap();
        assert_eq!((date.days(), Date::from_days(days)), (days, Ok(date)));
    }
    for days in 0..=157_000 {
        match Date::from_days(days) {
            Ok(date) => assert_eq!(date.days(), days),
            Err(cause) => assert!(cause == Error::OutOfRange && days > 156_000, "{days}"),
        }
    }
    for (year, month, day) in [(2025, 2, 29), (2100, 2, 29), (2024, 13, 1), (2024, 0, 1), (2024, 4, 31), (1969, 12, 31)]
    {
        assert_eq!(Date::new(year, month, day), Err(Error::OutOfRange));
    }
    let us = 1_795_176_001_234_567;
    assert_eq!(DateTime::from_unix_us(us).unwrap().unix_us(), us);
    assert_eq!(DateTime::from_unix_us(u64::MAX), Err(Error::OutOfRange));
    // At the end of time the day before must do.
    assert_eq!(TimeOfDay::from_us(3).nearest(u64::MAX) % 86_400_000_000, 3);
    for (text, cause) in [
        ("", Error::Missing),
        ("12345", Error::Malformed),
        ("240000", Error::OutOfRange),
        ("126000", Error::OutOfRange),
        ("120060", Error::OutOfRange),
        ("120000.", Error::Malformed),
        ("120000x5", Error::Malformed),
        ("1200-1", Error::Malformed),
    ] {
        assert_eq!(TimeOfDay::parse(text.as_bytes()), Err(cause), "{text}");
    }
    assert_eq!(TimeOfDay::parse(b"120000.1234567").unwrap().us(), 43_200_123_456);
}

#[test]
fn hex_digits() {
    for byte in 0..=255 {
        let [high, low] = hex::encode(byte);
        assert_eq!(format!("{byte:02X}").as_bytes(), [high, low]);
        assert_eq!(hex::decode(high.to_ascii_lowercase(), low), Ok(byte));
    }
    assert_eq!(hex::decode(b'G', b'0'), Err(Error::Malformed));
    assert_eq!(hex::decode_exact(b"0102", &mut [0; 3]), Err(Error::Malformed));
}

fn outcomes(checksum: Checksum, mut bytes: &[u8]) -> Vec<Result<Vec<u8>, Error>> {
    let mut framer = Framer::new(checksum);
    let mut outcomes = Vec::new();
    while let Some(outcome) = framer.feed(&mut bytes) {
        outcomes.push(outcome.map(|sentence| sentence.body().to_vec()));
    }
    outcomes
}

#[test]
fn line_ends_and_checksums() {
    let good = Ok(b"ACK,8,0,0".to_vec());
    for line in ["$ACK,8,0,0*5D\r\n", "$ACK,8,0,0*5d\r", "$ACK,8,0,0*5D\n", "\r\n\n$ACK,8,0,0*5D\r\n\r\n"] {
        assert_eq!(outcomes(Checksum::Required, line.as_bytes()), vec![good.clone()], "{line:?}");
    }
    // One digit for a value below 16.
    assert_eq!(outcomes(Checksum::Required, b"$OMSTOP,0*6\r\n"), [Ok(b"OMSTOP,0".to_vec())]);
    assert_eq!(outcomes(Checksum::Optional, b"$ACK,8,0,0\r\n"), [good]);
}

#[test]
fn frames_refused_by_cause() {
    let long = format!("${}\r\n$OMSTOP,0*06\r\n", "A".repeat(MAX_BODY + 1));
    let stop = Ok(b"OMSTOP,0".to_vec());
    for (bytes, wanted) in [
        (&b"$ACK,8,0,0*5E\r\n"[..], vec![Err(Error::Checksum)]),
        (b"$ACK,8,0,0\r\n", vec![Err(Error::ChecksumMissing)]),
        (b"$ACK,8,0,0*\r\n", vec![Err(Error::Malformed)]),
        (b"$ACK,8,0,0*5DX\r\n", vec![Err(Error::Malformed)]),
        (b"$ACK,8,0,0*ZZ\r\n", vec![Err(Error::Malformed)]),
        (b"$ACK,8\x07,0*5D\r\n$OMSTOP,0*06\r\n", vec![Err(Error::Framing), stop.clone()]),
        (b"$ACK,8,$OMSTOP,0*06\r\n", vec![Err(Error::Framing), stop.clone()]),
        (long.as_bytes(), vec![Err(Error::Overflow), stop]),
        (b"no sentence at all\r\n", vec![]),
    ] {
        assert_eq!(outcomes(Checksum::Required, bytes), wanted, "{}", String::from_utf8_lossy(bytes));
    }
    assert_eq!(Sentence::from_line(b"ACK", Checksum::Optional), Err(Error::Framing));
    // The longest body is taken.
    let longest = format!("${}\r\n", "A".repeat(MAX_BODY));
    assert_eq!(outcomes(Checksum::Optional, longest.as_bytes())[0].as_ref().unwrap().len(), MAX_BODY);
}
