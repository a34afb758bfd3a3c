//! Binary streams and PD6: attitude references, DVLs, the host link.

use crate::finite;
use backseat_wire::ahrs::{AhrsSample, gx3, mip};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::dvl::{DvlSample, pd0, pd4, pd6};
use backseat_wire::hostlink::{self, FromBoard, MAX_FRAME, ToBoard};
use std::f64::consts::FRAC_PI_4;
use std::fmt::Debug;

/// What a decoder makes of `data` and then of `good`: the same wherever the bytes are cut, and at most one outcome a
/// byte.
pub(crate) fn anywhere_cut<T: PartialEq + Debug>(data: &[u8], good: &[u8], run: impl Fn(&[&[u8]]) -> Vec<T>) -> Vec<T> {
    let bytes = [data, good].concat();
    let whole = run(&[&bytes]);
    assert!(whole.len() <= bytes.len());
    // any cut will do, so the data say where
    let sum = data.iter().fold(0_usize, |sum, byte| sum.wrapping_mul(31).wrapping_add(usize::from(*byte)));
    let (first, second) = bytes.split_at(sum % (bytes.len() + 1));
    assert_eq!(run(&[first, second]), whole);
    whole
}

/// All outcomes of a decoder, by its `feed`.
macro_rules! outcomes {
    ($decoder:expr, $parts:expr, |$found:ident| $keep:expr) => {{
        let (mut decoder, mut outcomes) = ($decoder, Vec::new());
        for mut part in $parts.iter().copied() {
            while let Some(outcome) = decoder.feed(&mut part) {
                outcomes.push(outcome.map(|$found| $keep));
            }
            assert!(part.is_empty());
        }
        outcomes
    }};
}

/// So many bytes end any frame that noise began.
fn after_flush(longest: usize, frame: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; longest];
    bytes.extend(frame);
    bytes
}

/// The checksum of GX3 and DVL: no search finds it by itself as often as it gives the rest a try.
fn sum(data: &[u8]) -> u16 {
    data.iter().fold(0, |sum, byte| sum.wrapping_add(u16::from(*byte)))
}

fn ahrs_sample() -> AhrsSample {
    let euler_rad = Some([0.125, -0.25, 1.5]);
    AhrsSample { euler_rad, rates_radps: Some([0.0, 0.5, -0.125]), specific_force_mps2: None, timer_us: None }
}

/// Replies of the 3DM-GX3, and commands to it.
pub fn gx3(data: &[u8]) {
    let AhrsSample { euler_rad, rates_radps, .. } = ahrs_sample();
    let single = |values: Option<[f64; 3]>| values.unwrap_or_default().map(|value| value as f32);
    let mut buffer = [0; gx3::MAX_REPLY];
    let reply = gx3::Reply::euler_rate(single(euler_rad), single(rates_radps), 7);
    let good = after_flush(gx3::MAX_REPLY, reply.emit(&mut buffer).expect("room"));
    let found = anywhere_cut(data, &good, |parts| outcomes!(gx3::Decoder::new(), parts, |answer| answer));
    let (mut attitude, mut timer_us) = (None, 0);
    for answer in found.into_iter().flatten() {
        finite(&answer);
        if let gx3::FromGx3::Data(sample, _) = answer {
            assert!(sample.timer_us.is_some_and(|us| us >= timer_us), "the unrolled timer goes on");
            (attitude, timer_us) = (sample.euler_rad, sample.timer_us.unwrap_or(0));
        }
    }
    assert_eq!(attitude, euler_rad);
    let frame = [data, &sum(data).to_be_bytes()].concat();
    if let Ok(reply) = gx3::Reply::parse(&frame) {
        finite(&reply.sample());
        assert_eq!(reply.emit(&mut buffer), Ok(&frame[..]));
    }
    if let Ok(Some((command, length))) = gx3::ToGx3::parse(data) {
        assert_eq!(command.emit(&mut buffer), Ok(&data[..length]));
    }
}

/// Packets of MicroStrain's MIP.
pub fn mip(data: &[u8]) {
    let mut buffer = [0; mip::MAX_PACKET];
    let good = after_flush(mip::MAX_PACKET, mip::emit_sample(&ahrs_sample(), &mut buffer).expect("room"));
    let run = |parts: &[&[u8]]| {
        outcomes!(mip::Decoder::new(), parts, |packet| {
            assert!(packet.fields().count() <= mip::MAX_PACKET / 2);
            let _ = packet.answer();
            finite(&packet.sample());
            (packet.set, packet.sample())
        })
    };
    let found = anywhere_cut(data, &good, run);
    let attitude = found.last().map(|last| last.map(|(_, sample)| sample.ok().flatten().and_then(|s| s.euler_rad)));
    assert_eq!(attitude, Some(Ok(ahrs_sample().euler_rad)));
    let (first, second) = data.iter().fold((0_u8, 0_u8), |(first, second), byte| {
        let first = first.wrapping_add(*byte);
        (first, second.wrapping_add(first))
    });
    let frame = [data, &[first, second]].concat();
    if let Ok(packet) = mip::Packet::parse(&frame) {
        finite(&packet.sample());
        if let Ok(fields) = packet.fields().collect::<Result<Vec<_>, _>>() {
            assert_eq!(mip::emit(packet.set, &fields, &mut [0; mip::MAX_PACKET]), Ok(&frame[..]));
        }
    }
}

fn dvl_sample() -> DvlSample {
    let (bottom_mps, altitude_m) = (Some([1.5, 0.25, -0.125]), Some(12.0));
    DvlSample { bottom_mps, altitude_m, error_mps: Some(0.0), ..DvlSample::default() }
}

/// The velocity of the good frame, to the millimetre per second of the wire and the rounding of two rotations.
fn sees_the_bottom(sample: &DvlSample) {
    let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1.5e-3);
    assert!(sample.bottom_mps.zip(dvl_sample().bottom_mps).is_some_and(|(a, b)| close(a, b)), "{sample:?}");
}

/// PD0 ensembles.
pub fn pd0(data: &[u8]) {
    let mut buffer = [0; pd0::MAX_ENSEMBLE];
    let last = pd0::Ensemble::from_sample(&dvl_sample(), 3, FRAC_PI_4);
    let good = after_flush(pd0::MAX_ENSEMBLE, last.emit(&mut buffer).expect("room"));
    let found = anywhere_cut(data, &good, |parts| outcomes!(pd0::Decoder::new(), parts, |ensemble| ensemble));
    assert_eq!(found.last(), Some(&Ok(last)));
    let summed = pd0::Ensemble::parse(&[data, &sum(data).to_le_bytes()].concat());
    for ensemble in found.into_iter().flatten().chain(summed) {
        finite(&ensemble.sample(FRAC_PI_4));
        // blocks that nobody needs and odd sizes are left out: the same after that
        assert_eq!(pd0::Ensemble::parse(ensemble.emit(&mut buffer).expect("room")), Ok(ensemble));
    }
    sees_the_bottom(&last.sample(FRAC_PI_4));
}

/// PD4 and PD5 records.
pub fn pd4(data: &[u8]) {
    let mut buffer = [0; pd4::MAX_RECORD];
    let last = pd4::Record::from_sample(&dvl_sample(), true, FRAC_PI_4);
    let good = after_flush(pd4::MAX_RECORD, last.emit(&mut buffer).expect("room"));
    let found = anywhere_cut(data, &good, |parts| outcomes!(pd4::Decoder::new(), parts, |record| record));
    assert_eq!(found.last(), Some(&Ok(last)));
    for record in found.into_iter().flatten() {
        finite(&record.sample(FRAC_PI_4));
    }
    let frame = [data, &sum(data).to_le_bytes()].concat();
    if let Ok(record) = pd4::Record::parse(&frame) {
        finite(&record.sample(FRAC_PI_4));
        assert_eq!(record.emit(&mut buffer), Ok(&frame[..]));
    }
    sees_the_bottom(&last.sample(FRAC_PI_4));
}

/// PD6 lines.
pub fn pd6(data: &[u8]) {
    let emit = |sample: &DvlSample| pd6::emit(sample, FRAC_PI_4, &mut [0; pd6::MAX_SET]).map(<[u8]>::to_vec);
    let run = |parts: &[&[u8]]| outcomes!(pd6::Decoder::new(FRAC_PI_4), parts, |sample| sample);
    let good = [&b"\r\n"[..], &emit(&dvl_sample()).expect("room")].concat();
    let found = anywhere_cut(data, &good, run);
    let last = found.last().and_then(|last| last.ok()).expect("the set after the noise");
    sees_the_bottom(&last);
    for sample in found.into_iter().flatten() {
        finite(&sample);
        let set = emit(&sample).expect("what was parsed can be written");
        let again = run(&[&set]);
        assert!(matches!(again[..], [Ok(_)]), "{}: {again:?}", set.escape_ascii());
    }
}

/// The host link: frames in a stream, and messages in a frame, of either side and of the board's log.
pub fn hostlink(data: &[u8]) {
    let mut buffer = [0; MAX_FRAME];
    let good = hostlink::encode(&ToBoard::HealthGet, &mut buffer).expect("room");
    let run = |parts: &[&[u8]]| {
        outcomes!(hostlink::Decoder::new(), parts, |frame| {
            let to = frame.message::<ToBoard<'_>>().is_ok();
            (to, frame.message::<FromBoard<'_>>().is_ok(), frame.message::<LogRecord<'_>>().is_ok())
        })
    };
    let found = anywhere_cut(data, good, run);
    assert!(matches!(found.last(), Some(Ok((true, _, _)))));
    // what a frame with a right CRC may hold: any bytes
    macro_rules! survives {
        ($message:ty) => {
            if let Ok((message, [])) = postcard::take_from_bytes::<$message>(data)
                && let Ok(mut frame) = hostlink::encode(&message, &mut buffer)
            {
                let mut decoder = hostlink::Decoder::new();
                let frame = decoder.feed(&mut frame).expect("one frame").expect("a good one");
                let again: $message = frame.message().expect("its message");
                // as text, where a NaN equals itself
                assert_eq!(format!("{again:?}"), format!("{message:?}"));
            }
        };
    }
    survives!(ToBoard<'_>);
    survives!(FromBoard<'_>);
    survives!(LogRecord<'_>);
}
