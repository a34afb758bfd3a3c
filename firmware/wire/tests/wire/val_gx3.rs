use crate::vectors::{bytes, fed_at, lines};
use backseat_wire::Error;
use backseat_wire::ahrs::gx3::{Command, Decoder, FromGx3, MAX_REPLY, Reply, ToGx3, emit_continuous};

const FILE: &str = include_str!("../vectors/gx3.hex");

/// `key=1,2,3` of a decoded text.
fn decoded(text: &str, key: &str) -> Option<Vec<f64>> {
    let (_, after) = text.split_once(&format!("{key}="))?;
    Some(after.split(' ').next().unwrap().split(',').map(|value| value.parse().unwrap()).collect())
}

#[test]
fn val_every_vector() {
    let (mut taken, mut refused) = (0, 0);
    for columns in lines(FILE) {
        let (status, frame, text) = (columns[0], bytes(columns[2]), columns[3]);
        let mut decoder = Decoder::new();
        let first = decoder.feed(&mut frame.as_slice()).unwrap();
        if status == "bad" {
            assert_eq!((Reply::parse(&frame), first), (Err(Error::Checksum), Err(Error::Checksum)));
            refused += 1;
            continue;
        }
        if text.contains("NaN") {
            assert_eq!(first, Err(Error::OutOfRange));
            refused += 1;
            continue;
        }
        let reply = Reply::parse(&frame).unwrap_or_else(|cause| panic!("{text}: {cause:?}"));
        let Ok(FromGx3::Data(sample, command)) = first else { panic!("{text}: {first:?}") };
        assert_eq!((reply.command, sample.timer_us), (command, Some(0)));
        assert_eq!(decoded(text, "timer").unwrap(), [f64::from(reply.ticks)]);
        for (key, ours) in [
            ("acc[g]", reply.accel_g),
            ("gyr[rad/s]", reply.rate_radps),
            ("mag[G]", reply.mag_gauss),
            ("roll,pitch,yaw[rad]", reply.euler_rad),
        ] {
            let Some(wanted) = decoded(text, key) else { continue };
            // The text has six digits.
            assert!(
                ours.unwrap().iter().zip(&wanted).all(|(a, b)| (f64::from(*a) - b).abs() < 5.1e-7),
                "{text} {ours:?}"
            );
        }
        assert_eq!(reply.emit(&mut [0; MAX_REPLY]).unwrap(), frame, "{text}");
        taken += 1;
    }
    assert_eq!((taken, refused), (25, 3));
}

#[test]
fn val_specific_force_agrees_with_attitude() {
    // Neighbouring recorded CB and CF replies of an instrument at rest: the specific force is minus gravity.
    let reply = |at: usize| Reply::parse(&bytes(lines(FILE).nth(at).unwrap()[2])).unwrap().sample().unwrap();
    let force = reply(4).specific_force_mps2.unwrap();
    let [roll, pitch, _] = reply(5).euler_rad.unwrap();
    let gravity = [-libm::sin(pitch), libm::sin(roll) * libm::cos(pitch), libm::cos(roll) * libm::cos(pitch)];
    for (force, gravity) in force.iter().zip(gravity) {
        // Seconds apart on a buoy: to a hundredth of g.
        assert!((force / 9.80665 + gravity).abs() < 0.01, "{force} {gravity}");
    }
}

#[test]
fn val_attitude_of_the_matrix() {
    let vector = |name: &str| bytes(lines(FILE).find(|columns| columns[3].starts_with(name)).unwrap()[2]);
    for name in ["C5", "C8", "CC"] {
        let sample = Reply::parse(&vector(name)).unwrap().sample().unwrap();
        assert_eq!(sample.euler_rad, Some([0.0; 3]), "{name}");
    }
    let (roll, pitch, yaw) = (0.3_f64, -0.4_f64, 2.5_f64);
    let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(roll), libm::sincos(pitch), libm::sincos(yaw));
    // Rows of (Rz Ry Rx)^T.
    let matrix = [
        [cp * cy, cp * sy, -sp],
        [sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp],
        [cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp],
    ];
    let mut entries = matrix.as_flattened().iter().map(|entry| *entry as f32);
    let matrix = std::array::from_fn(|_| entries.next().unwrap());
    let reply = Reply { command: Command::Matrix, matrix: Some(matrix), ..Reply::euler_rate([0.0; 3], [0.0; 3], 0) };
    let angles = reply.sample().map(|sample| sample.euler_rad);
    // Angles given go before the matrix.
    assert_eq!(angles, Ok(Some([0.0; 3])));
    let [r, p, y] = Reply { euler_rad: None, ..reply }.sample().unwrap().euler_rad.unwrap();
    assert!((r - roll).abs() < 1e-6 && (p - pitch).abs() < 1e-6 && (y - yaw).abs() < 1e-6);
}

#[test]
fn val_timer_rolls_over_and_is_reset() {
    let stream = |source: &str| -> Vec<u8> {
        lines(FILE).filter(|columns| columns[1].contains(source)).flat_map(|columns| bytes(columns[2])).collect()
    };
    let times = |stream: &[u8]| {
        let (mut decoder, mut bytes, mut times) = (Decoder::new(), stream, Vec::new());
        while let Some(outcome) = decoder.feed(&mut bytes) {
            let FromGx3::Data(sample, _) = outcome.unwrap() else { panic!() };
            times.push(sample.timer_us.unwrap());
        }
        (times, decoder.timer_resets())
    };
    // The edited timers step from 4294961296 over 0 (6000 ticks) to 6250, each tick 16 us.
    assert_eq!(times(&stream("rollover")), (vec![0, 96_000, 196_000], 0));
    assert_eq!(times(&stream("timer_reset")), (vec![0, 0, 100_000], 1));
    let recorded = stream("stc/resource/20131209_103919.3dmgx3.log");
    assert_eq!(times(&recorded), (vec![0, 100_000, 200_000], 0));
}

#[test]
fn val_stream_at_every_split_with_corrupt_frames_and_noise() {
    let mut stream = Vec::new();
    for columns in lines(FILE) {
        stream.extend(b"\xCB\xCF\x00noise\xC4");
        stream.extend(bytes(columns[2]));
    }
    stream.extend([0; MAX_REPLY]);
    let feed = |split| fed_at(Decoder::new(), &stream, split, Decoder::feed, |decoder| *decoder.counts());
    let (found, counts) = feed(0);
    assert_eq!((found.len(), counts.accepted(), counts.of(Error::OutOfRange)), (25, 25, 1));
    assert!(counts.of(Error::Checksum) >= 2);
    for split in 0..=stream.len() {
        assert_eq!(feed(split), (found.clone(), counts), "split at {split}");
    }
}

#[test]
fn commands_are_these_bytes() {
    let mut buffer = [0; 8];
    for (command, bytes) in [
        (ToGx3::Continuous(Command::EulerRate), &[0xC4, 0xC1, 0x29, 0xCF][..]),
        (ToGx3::Poll(Command::AccelRateMag), &[0xCB]),
        (ToGx3::Stop, &[0xFA]),
    ] {
        assert_eq!(command.emit(&mut buffer).unwrap(), bytes);
        assert_eq!(ToGx3::parse(bytes), Ok(Some((command, bytes.len()))));
        for part in 0..bytes.len() {
            assert_eq!(ToGx3::parse(&bytes[..part]), Ok(None));
        }
    }
    assert_eq!(ToGx3::parse(&[0xC4, 0xC1, 0x28]), Err(Error::Unknown));
    assert_eq!(ToGx3::parse(&[0x00]), Err(Error::Unknown));
    let acknowledgement = emit_continuous(0xCF, 1_000_000, &mut buffer).unwrap();
    assert_eq!(acknowledgement, [0xC4, 0xCF, 0x00, 0x0F, 0x42, 0x40, 0x02, 0x24]);
    let mut bytes = acknowledgement;
    assert_eq!(Decoder::new().feed(&mut bytes), Some(Ok(FromGx3::Continuous(0xCF))));
}
