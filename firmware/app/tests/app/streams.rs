//! The device vectors of the wire crate (provenance in their README) as streams through the app's
//! ports: good and corrupt mixed, cut at random, and what comes out.

use crate::board::{Arrival, Board, Direct, Random, request_all};
use backseat_app::App;
use backseat_wire::ahrs::os5000::Os5000;
use backseat_wire::hostlink::{Port, ToBoard};
use backseat_wire::iver::{FromFrontseat, Units};
use backseat_wire::modem::FromModem;
use backseat_wire::nmea::{Checksum, Sentence};
use backseat_wire::{Counts, Error, hex};
use std::fs;

/// The lines of a vector file, cut into fields.
fn vectors(file: &str) -> Vec<Vec<String>> {
    let path = format!("{}/../wire/tests/vectors/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.map(|line| line.split('\t').map(str::to_owned).collect()).collect()
}

fn bytes_of(digits: &str) -> Vec<u8> {
    let mut bytes = vec![0; digits.len() / 2];
    hex::decode_exact(digits.as_bytes(), &mut bytes).expect("hex digits");
    bytes
}

/// A board that listens to one protocol, and takes a step after each piece.
struct Bench {
    board: Direct,
    time_us: u64,
}

impl Bench {
    fn new(seed: u64, parameters: &[(&str, f64)]) -> Self {
        let mut board = Direct::new(Some(seed));
        request_all(&mut board, &[ToBoard::ParameterBegin]);
        for &(name, value) in parameters {
            request_all(&mut board, &[ToBoard::ParameterSet { name, value }]);
        }
        request_all(&mut board, &[ToBoard::ParameterCommit]);
        Self { board, time_us: 0 }
    }

    fn feed(&mut self, port: Port, bytes: &[u8]) {
        self.time_us += 100_000;
        let arrival = Arrival { port, time_us: self.time_us - 50_000, bytes: bytes.to_vec() };
        self.board.step(self.time_us, &[], &[arrival]);
    }

    fn app(&self) -> &App {
        self.board.app()
    }
}

/// `key=a,b,c` in the decoded column of a vector.
fn values(decoded: &str, key: &str) -> Option<[f64; 3]> {
    let text = decoded.split(' ').find_map(|field| field.strip_prefix(key))?;
    let numbers: Vec<f64> = text.split(',').take(3).filter_map(|number| number.parse().ok()).collect();
    numbers.try_into().ok()
}

/// The printed columns have six or seven decimals of single-precision values.
fn assert_close(found: Option<[f64; 3]>, expected: Option<[f64; 3]>, what: &str) {
    assert_eq!(found.is_some(), expected.is_some(), "{what}: {found:?}");
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 2e-6, "{what}: {found} instead of {expected}");
    }
}

#[test]
fn val_gx3_frames() {
    let mut bench = Bench::new(1, &[("app.ahrs_protocol", 0.0)]);
    let (mut good, mut bad) = (0, 0);
    for vector in vectors("gx3.hex") {
        let (status, decoded) = (vector[0].as_str(), vector[3].as_str());
        bench.feed(Port::Ahrs, &bytes_of(&vector[2]));
        if status == "bad" || decoded.contains("must be rejected") {
            bad += 1;
            continue;
        }
        good += 1;
        let health = bench.app().health();
        if status.starts_with("ok") {
            let sample = health.ahrs().expect("a sample");
            assert_close(sample.rates_radps, values(decoded, "gyr[rad/s]="), decoded);
            assert_close(sample.euler_rad, values(decoded, "roll,pitch,yaw[rad]="), decoded);
        }
    }
    // A false start inside a corrupt frame may still wait for bytes.
    bench.feed(Port::Ahrs, &[0; 200]);
    let health = bench.app().health();
    assert_eq!(health.accepted(Port::Ahrs), good);
    assert!(health.rejected_for(Port::Ahrs, Error::Checksum) >= bad - 1, "{bad} bad frames");
    assert_eq!(health.rejected_for(Port::Ahrs, Error::OutOfRange), 1);
}

/// The noise of a working AHRS is in its last bits. A reading that stands still for longer than a second is refused, and
/// with it the attitude grows stale.
#[test]
fn an_ahrs_that_repeats_itself_is_refused() {
    let mut bench = Bench::new(1, &[("app.ahrs_protocol", 0.0)]);
    let frames: Vec<Vec<String>> = vectors("gx3.hex").into_iter().filter(|vector| vector[0] == "ok").collect();
    for _ in 0..20 {
        bench.feed(Port::Ahrs, &bytes_of(&frames[0][2]));
    }
    let repeated = |bench: &Bench| bench.app().health().rejected_for(Port::Ahrs, Error::Repeated);
    // ten frames a second, and twenty: from the twelfth on
    assert_eq!(repeated(&bench), 9);
    let other = frames.iter().find(|frame| frame[3] != frames[0][3]).expect("another reading");
    bench.feed(Port::Ahrs, &bytes_of(&other[2]));
    assert_eq!(repeated(&bench), 9);
}

/// The same where attitude and rates come in packets of their own.
#[test]
fn a_mip_device_that_repeats_itself_is_refused() {
    let mut bench = Bench::new(2, &[("app.ahrs_protocol", 1.0)]);
    let packets = vectors("mip.hex");
    let of = |set: &str| {
        let is = |vector: &&Vec<String>| vector[0] == "ok" && vector[3].starts_with(set) && vector[3].contains("05=");
        bytes_of(&packets.iter().find(is).expect("a packet of the set")[2])
    };
    let (sensor, filter) = (of("set 80"), of("set 82"));
    for _ in 0..10 {
        bench.feed(Port::Ahrs, &sensor);
        bench.feed(Port::Ahrs, &filter);
    }
    // each five times a second, and ten times: from the seventh on
    assert_eq!(bench.app().health().rejected_for(Port::Ahrs, Error::Repeated), 8);
}

#[test]
fn val_mip_packets() {
    let mut bench = Bench::new(2, &[("app.ahrs_protocol", 1.0)]);
    let mut samples = 0;
    for vector in vectors("mip.hex") {
        let (status, decoded) = (vector[0].as_str(), vector[3].as_str());
        bench.feed(Port::Ahrs, &bytes_of(&vector[2]));
        let expected = if decoded.starts_with("set 80") {
            [values(decoded, "05="), values(decoded, "0C=")]
        } else if decoded.starts_with("set 82") {
            [None, values(decoded, "05=")]
        } else {
            [None, None]
        };
        let health = bench.app().health();
        if status == "ok" && expected != [None, None] {
            samples += 1;
            let sample = health.ahrs().expect("a sample");
            assert_close(sample.rates_radps, expected[0], decoded);
            assert_close(sample.euler_rad, expected[1], decoded);
        }
    }
    let health = bench.app().health();
    assert!(health.accepted(Port::Ahrs) > samples, "{samples} recorded and one synthetic");
    // NaN, a filter that is not valid, a field beyond its packet
    assert_eq!(health.rejected_for(Port::Ahrs, Error::OutOfRange), 1);
    assert_eq!(health.rejected_for(Port::Ahrs, Error::Invalid), 1);
    assert_eq!(health.rejected_for(Port::Ahrs, Error::Offset), 1);
}

#[test]
fn val_pd0_ensembles() {
    let mut bench = Bench::new(3, &[("app.dvl_source", 0.0)]);
    let path = format!("{}/../wire/tests/vectors/pd0_expected.json", env!("CARGO_MANIFEST_DIR"));
    let expected: serde_json::Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let (mut good, mut velocities) = (0, 0);
    for vector in vectors("pd0.hex") {
        let expected = &expected[&vector[0]];
        bench.feed(Port::Dvl, &bytes_of(&vector[3]));
        let health = bench.app().health();
        if vector[1] == "bad" || expected["reject"] == true || expected["fixed"].is_null() {
            continue;
        }
        good += 1;
        let sample = health.dvl().expect("a sample");
        let speed = expected["variable"]["sound_speed_mps"].as_f64();
        assert_eq!(sample.sound_speed_mps, speed, "{}", vector[0]);
        let bottom = &expected["bottom"];
        let ranges: Vec<f64> = (0..4).filter_map(|i| bottom["range_cm"][i].as_f64()).filter(|r| *r > 0.0).collect();
        let altitude = (!ranges.is_empty()).then(|| ranges.iter().sum::<f64>() / ranges.len() as f64 / 100.0);
        assert_eq!(sample.altitude_m, altitude, "{}", vector[0]);
        // Recorded ensembles are in earth axes; only those in instrument axes can be body velocities.
        let axes = expected["fixed"]["coord_byte"].as_u64().unwrap() >> 3 & 3;
        let mmps: Vec<f64> = (0..3).filter_map(|i| bottom["vel_mmps"][i].as_f64()).collect();
        if axes == 1 && mmps.iter().all(|v| *v > -32768.0) {
            velocities += 1;
            let [x, y, z] = [mmps[0], mmps[1], mmps[2]].map(|v| v / 1000.0);
            // PD0 gives the bottom's velocity; beam 3 (y) forward, x starboard, z up
            assert_eq!(sample.bottom_mps, Some([-y, -x, z]), "{}", vector[0]);
        } else {
            assert_eq!(sample.bottom_mps, None, "{}", vector[0]);
        }
    }
    let health = bench.app().health();
    assert!(velocities >= 2);
    // the header without blocks may count as a good ensemble that says nothing
    assert!((good..=good + 1).contains(&health.accepted(Port::Dvl)), "{}", health.accepted(Port::Dvl));
    assert!(health.rejected_for(Port::Dvl, Error::Checksum) >= 1);
    assert!(health.rejected_for(Port::Dvl, Error::Offset) >= 1);
}

#[test]
fn val_pd4_and_pd5_records() {
    let mut bench = Bench::new(4, &[("app.dvl_source", 1.0)]);
    let mut check = |name: &str, bottom_mps: Option<[f64; 3]>| {
        let vector = vectors("pd4.hex").into_iter().find(|vector| vector[0] == name).expect("the vector");
        bench.feed(Port::Dvl, &bytes_of(&vector[3]));
        let health = bench.app().health();
        assert_eq!(health.dvl().expect("a sample").bottom_mps, bottom_mps, "{name}");
        (health.accepted(Port::Dvl), health.rejected_for(Port::Dvl, Error::Checksum))
    };
    let forward = Some([1.25, 0.012, 0.004]);
    assert_eq!(check("pd4_fwd", forward), (1, 0));
    assert_eq!(check("pd4_badsum", forward), (1, 1));
    assert_eq!(check("pd4_lost", None), (2, 1));
    assert_eq!(check("pd5_fwd", forward), (3, 1));
    assert_eq!(check("pd4_3beam", Some([0.9, 0.005, 0.0])).0, 4);
    assert_eq!(check("pd4_truncated", Some([0.9, 0.005, 0.0])).0, 4);
    // the truncated record must not swallow the one behind it
    assert_eq!(check("pd4_fwd", forward).0, 5);
}

#[test]
fn val_pd6_lines() {
    let mut bench = Bench::new(5, &[("app.dvl_source", 2.0)]);
    let path = format!("{}/../wire/tests/vectors/pd6.txt", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).unwrap().replace('\n', "\r\n");
    let mut seen = Vec::new();
    for set in text.split("\r\n## ").skip(1) {
        let lines = set.split_once("\r\n").expect("a heading").1;
        bench.feed(Port::Dvl, format!("{lines}\r\n").as_bytes());
        let health = bench.app().health();
        seen.push((health.accepted(Port::Dvl), health.dvl().copied()));
    }
    let altitude = |i: usize| seen[i].1.expect("a sample").altitude_m;
    assert_eq!((seen[0].1.unwrap().bottom_mps, altitude(0)), (None, None));
    assert_eq!(seen[1].1.unwrap().bottom_mps, Some([0.0; 3]));
    assert_eq!(altitude(1), Some(0.55));
    // block 3: an emulator's; block 4: 1.25 m/s forward at 10.4 m
    let full = seen[3].1.unwrap();
    assert_eq!((full.bottom_mps.map(|v| v[0]), full.altitude_m), (Some(1.25), Some(10.4)));
    assert_eq!(seen[4].1.unwrap().bottom_mps, None);
    assert_eq!(seen[5].0, seen[4].0, "malformed lines make no sample");
    assert!(bench.app().health().rejected(Port::Dvl) >= 5);
}

/// The counts of sentences parsed one by one, to compare with the same as a stream.
fn counts_of(lines: &[String], parse: impl Fn(&Sentence<'_>) -> Result<(), Error>, checksum: Checksum) -> Counts {
    let mut counts = Counts::new();
    for line in lines {
        let _ = counts.note(Sentence::from_line(line.as_bytes(), checksum).and_then(|sentence| parse(&sentence)));
    }
    counts
}

fn assert_stream(port: Port, parameters: &[(&str, f64)], lines: &[String], expected: &Counts) -> Bench {
    let mut bench = Bench::new(port as u64 + 10, parameters);
    let mut random = Random(99);
    for line in lines {
        // noise between the sentences, as of a modem that wakes up
        let noise: Vec<u8> = (0..random.below(12)).map(|_| random.word() as u8).filter(|byte| *byte != b'$').collect();
        bench.feed(port, &[noise.as_slice(), line.as_bytes(), b"\r\n"].concat());
    }
    let health = bench.app().health();
    assert_eq!(health.accepted(port), expected.accepted());
    for cause in Error::ALL {
        assert_eq!(health.rejected_for(port, cause), expected.of(cause), "{cause:?}");
    }
    bench
}

fn sentences(file: &str) -> Vec<String> {
    vectors(file).into_iter().map(|vector| vector[2].clone()).collect()
}

#[test]
fn frontseat_sentences() {
    let units = Units::remote_helm(5);
    let mut lines = sentences("iver3.nmea");
    lines.extend(sentences("gps.nmea"));
    // one digit of each turned: the checksum must catch it
    let corrupt: Vec<String> = lines.iter().map(|line| line.replacen('1', "7", 1)).collect();
    lines.extend(corrupt);
    let parse = |sentence: &Sentence<'_>| FromFrontseat::parse(sentence, &units).map(drop);
    let expected = counts_of(&lines, parse, Checksum::Required);
    assert!(expected.accepted() > 20 && expected.of(Error::Checksum) > 20, "{expected:?}");
    let bench = assert_stream(Port::Frontseat, &[("app.compass_depth_unit", 1.0)], &lines, &expected);
    // the only $C of the file: 3.2 feet
    let depth_m = bench.app().health().depth_m().expect("a depth");
    assert!((depth_m - 3.2 * 0.3048).abs() < 1e-12, "{depth_m}");
}

#[test]
fn a_fix_lands_in_the_local_frame() {
    let mut bench = Bench::new(6, &[("app.origin_lat_deg", 41.535_608), ("app.origin_lon_deg", -70.673_046)]);
    let line = &sentences("gps.nmea")[0];
    bench.feed(Port::Frontseat, format!("{line}\r\n").as_bytes());
    // The vector is valid after the arrival less the delay, so that the next step sees it.
    bench.feed(Port::Frontseat, b"");
    let [north_m, east_m] = bench.app().health().fix_m().expect("a fix");
    // 4132.1365 N is 41.5356083 and 07040.3828 W is -70.6730467: within a tenth of a metre of the origin
    assert!(north_m.abs() < 0.1 && east_m.abs() < 0.1, "{north_m} {east_m}");
}

#[test]
fn modem_sentences() {
    let lines = sentences("micromodem.nmea");
    let parse = |sentence: &Sentence<'_>| FromModem::parse(sentence).map(drop);
    let mut expected = counts_of(&lines, parse, Checksum::Optional);
    assert!(expected.accepted() > 30, "{expected:?}");
    // The data frames of the file hold no ship state.
    for frame in lines.iter().filter(|line| line.starts_with("$CARXD")) {
        let digits = frame.split([',', '*']).nth(5).unwrap();
        let outcome = backseat_wire::ship_state::ShipState::parse(&bytes_of(digits));
        expected.note_error(outcome.expect_err("no ship state"));
    }
    assert_stream(Port::Modem, &[], &lines, &expected);
}

#[test]
fn os5000_sentences() {
    let lines = sentences("os5000.nmea");
    let parse = |sentence: &Sentence<'_>| Os5000::parse(sentence).map(drop);
    let expected = counts_of(&lines, parse, Checksum::Required);
    assert!(expected.accepted() >= 5, "{expected:?}");
    let bench = assert_stream(Port::Ahrs, &[("app.ahrs_protocol", 2.0)], &lines, &expected);
    let sample = bench.app().health().ahrs().copied().expect("a sample");
    assert!(sample.rates_radps.is_none());
}
