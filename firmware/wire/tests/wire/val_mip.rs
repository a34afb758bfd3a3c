use crate::vectors::{bytes, lines};
use backseat_wire::Error;
use backseat_wire::ahrs::AhrsSample;
use backseat_wire::ahrs::mip::{
    Answer, Decoder, Field, MAX_PACKET, Packet, emit, emit_answer, emit_format, emit_sample, emit_stream, set,
};

const FILE: &str = include_str!("../vectors/mip.hex");

fn vector(text: &str) -> Vec<u8> {
    bytes(lines(FILE).find(|columns| columns[3].starts_with(text)).unwrap()[2])
}

#[test]
fn val_every_vector() {
    let (mut packets, mut samples, mut refused) = (0, 0, 0);
    for columns in lines(FILE) {
        let (frame, text) = (bytes(columns[2]), columns[3]);
        let packet = Packet::parse(&frame).unwrap_or_else(|cause| panic!("{text}: {cause:?}"));
        packets += 1;
        let cause = if text.contains("NaN") {
            Some(Error::OutOfRange)
        } else if text.contains("valid=0") {
            Some(Error::Invalid)
        } else if text.contains("exceeds payload") {
            Some(Error::Offset)
        } else {
            None
        };
        if let Some(cause) = cause {
            assert_eq!(packet.sample(), Err(cause), "{text}");
            refused += 1;
            continue;
        }
        let sample = packet.sample().unwrap_or_else(|cause| panic!("{text}: {cause:?}"));
        samples += usize::from(sample.is_some());
        if text.starts_with("set 8") {
            assert_decoded(&sample.unwrap_or_default(), text);
        }
        let fields: Vec<Field<'_>> = packet.fields().map(Result::unwrap).collect();
        assert_eq!(emit(packet.set, &fields, &mut [0; MAX_PACKET]).unwrap(), frame, "{text}");
    }
    assert_eq!((packets, samples, refused), (38, 13, 3));
}

/// `set 80: D5=282809000000 ns 04=x,y,z …`, seven digits.
fn assert_decoded(sample: &AhrsSample, text: &str) {
    for token in text.split(' ').skip(2) {
        let Some((key, values)) = token.split_once('=') else { continue };
        let values: Vec<f64> = values.split(',').filter_map(|value| value.parse().ok()).collect();
        let (ours, unit) = match (text.starts_with("set 82"), key) {
            (_, "D5") => {
                assert_eq!(sample.timer_us, Some((values[0] / 1e3) as u64), "{text}");
                continue;
            }
            (false, "04") => (sample.specific_force_mps2, 9.80665),
            (false, "05") => (sample.rates_radps, 1.0),
            (false, "0C") | (true, "05") => (sample.euler_rad, 1.0),
            _ => continue,
        };
        let near = ours.unwrap().iter().zip(&values).all(|(a, b)| (a / unit - b).abs() < 5.1e-8 * (1.0 + b.abs()));
        assert!(near, "{text} {ours:?}");
    }
}

#[test]
fn val_commands_and_answers_are_the_published_bytes() {
    let mut buffer = [0; 64];
    assert_eq!(emit_format(10, &mut buffer).unwrap(), vector("0C/08 set IMU format"));
    assert_eq!(emit_stream(true, &mut buffer).unwrap(), vector("0C/11 enable"));
    let ping = emit(set::BASE, &[Field { descriptor: 1, data: &[] }], &mut buffer).unwrap();
    assert_eq!(ping, vector("ping command"));
    for (text, command, code) in [("ACK of 0C/30", 0x30, 0), ("ACK 0C/08", 0x08, 0), ("NACK 0C/08", 0x08, 3)] {
        let answer = Answer { command, code };
        let frame = vector(text);
        assert_eq!(Packet::parse(&frame).unwrap().answer(), Some(answer));
        assert_eq!(emit_answer(set::THREE_DM, answer, &mut buffer).unwrap(), frame);
    }
    assert_eq!(Packet::parse(&vector("two fields")).unwrap().fields().count(), 2);
    assert_eq!(emit(1, &[Field { descriptor: 1, data: &[0; 254] }], &mut [0; 300]), Err(Error::Length));
}

#[test]
fn emulated_sensor_says_what_it_measured() {
    let sample = AhrsSample {
        euler_rad: Some([0.5, -0.25, 2.0]),
        rates_radps: Some([0.125, 0.0, -0.5]),
        specific_force_mps2: Some([0.0, 0.0, -9.80665]),
        timer_us: Some(123_456_789),
    };
    let mut buffer = [0; MAX_PACKET];
    let packet = Packet::parse(emit_sample(&sample, &mut buffer).unwrap()).unwrap();
    assert_eq!(packet.sample(), Ok(Some(sample)));
}

#[test]
fn val_stream_at_every_split_with_corrupt_packets_and_noise() {
    let mut stream = Vec::new();
    for (index, columns) in lines(FILE).enumerate() {
        stream.extend(b"\x75\x75\x65noise\x75");
        let mut frame = bytes(columns[2]);
        stream.extend(&frame);
        if index % 5 == 0 {
            let middle = frame.len() / 2;
            frame[middle] ^= 0x10;
            stream.extend(&frame);
        }
    }
    stream.extend([0; MAX_PACKET]);
    let feed = |split| {
        let mut decoder = Decoder::new();
        let mut found: Vec<(u8, Vec<u8>)> = Vec::new();
        for mut part in [&stream[..split], &stream[split..]] {
            while let Some(outcome) = decoder.feed(&mut part) {
                let Ok(packet) = outcome else { continue };
                found.push((packet.set, packet.fields().flatten().flat_map(|field| field.data.to_vec()).collect()));
            }
        }
        (found, *decoder.counts())
    };
    let (found, counts) = feed(0);
    assert_eq!((found.len(), counts.accepted()), (38, 38));
    assert!(counts.of(Error::Checksum) >= 8);
    for split in 0..=stream.len() {
        assert_eq!(feed(split), (found.clone(), counts), "split at {split}");
    }
}

#[test]
fn fields_end_at_the_first_that_does_not_fit() {
    for payload in [&[0x00, 0x01][..], &[0x01, 0x01], &[0x03, 0x01], &[0x02]] {
        let mut frame = vec![0x75, 0x65, 0x80, payload.len() as u8];
        frame.extend(payload);
        let (mut first, mut second) = (0_u8, 0_u8);
        for byte in &frame {
            first = first.wrapping_add(*byte);
            second = second.wrapping_add(first);
        }
        frame.extend([first, second]);
        let packet = Packet::parse(&frame).unwrap();
        assert_eq!(packet.fields().collect::<Vec<_>>(), [Err(Error::Offset)], "{payload:?}");
    }
}
