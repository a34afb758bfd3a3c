//! A million bytes that are nothing, or nearly something, for every decoder: nothing panics, and what is found again is
//! good.

use crate::random::Random;
use crate::vectors::{bytes, lines};
use backseat_wire::ahrs::os5000::Os5000;
use backseat_wire::ahrs::{gx3, mip};
use backseat_wire::dvl::{pd0, pd4, pd6};
use backseat_wire::hostlink::{self, FromBoard, MAX_FRAME, ToBoard};
use backseat_wire::iver::{FromFrontseat, ToFrontseat, Units};
use backseat_wire::modem::{FromModem, ToModem};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::ShipState;

const LENGTH: usize = 1_000_000;

/// Frames with damaged, missing and inserted bytes, between runs of noise.
fn damaged(frames: &[Vec<u8>], seed: u64) -> Vec<u8> {
    let mut noise = Random(seed);
    let mut stream = Vec::with_capacity(LENGTH);
    while stream.len() < LENGTH {
        for byte in &frames[noise.below(frames.len())] {
            match noise.below(400) {
                0 => stream.push(noise.word() as u8),
                1 => {}
                2 => stream.push(byte ^ (1 << noise.below(8))),
                _ => stream.push(*byte),
            }
        }
        for _ in 0..noise.below(20) {
            stream.push(noise.word() as u8);
        }
    }
    stream
}

/// Feeds everything in parts of random length.
fn soak<D>(decoder: &mut D, stream: &[u8], mut feed: impl FnMut(&mut D, &mut &[u8]) -> bool) {
    let (mut noise, mut rest) = (Random(99), stream);
    while !rest.is_empty() {
        let (mut part, next) = rest.split_at(rest.len().min(1 + noise.below(700)));
        rest = next;
        while feed(decoder, &mut part) {}
        assert!(part.is_empty());
    }
}

#[test]
fn text_sentences() {
    let vectors = [
        include_str!("../vectors/iver3.nmea"),
        include_str!("../vectors/micromodem.nmea"),
        include_str!("../vectors/gps.nmea"),
        include_str!("../vectors/os5000.nmea"),
    ];
    // Without checksums, so that damage reaches the parsers.
    let frames: Vec<Vec<u8>> = vectors
        .into_iter()
        .flat_map(lines)
        .map(|columns| format!("{}\r\n", columns[2].split('*').next().unwrap()).into_bytes())
        .collect();
    let stream = damaged(&frames, 1);
    let (units, mut buffer) = (Units::remote_helm(5), [0; 1024]);
    let (mut framer, mut understood) = (Framer::new(Checksum::Optional), 0);
    soak(&mut framer, &stream, |framer, part| {
        let Some(outcome) = framer.feed(part) else { return false };
        let Ok(sentence) = outcome else { return true };
        let from = FromFrontseat::parse(&sentence, &units);
        let to = ToFrontseat::parse(&sentence, &units);
        let from_modem = FromModem::parse(&sentence);
        let to_modem = ToModem::parse(&sentence);
        let compass = Os5000::parse(&sentence);
        understood +=
            u32::from(from.is_ok() || to.is_ok() || from_modem.is_ok() || to_modem.is_ok() || compass.is_ok());
        // Whatever was understood can be written, or is refused.
        let _ = from.map(|message| message.emit(&units, &mut buffer).is_ok());
        let _ = to.map(|message| message.emit(&units, &mut buffer).is_ok());
        let _ = from_modem.map(|message| message.emit(&mut buffer).is_ok());
        let _ = to_modem.map(|message| message.emit(&mut buffer).is_ok());
        let _ = compass.map(|message| message.emit(&mut buffer).is_ok());
        true
    });
    assert!(understood > 5_000, "{understood}");
    assert!(framer.counts().rejected() > 1_000 && framer.counts().skipped_bytes() > 1_000);
}

#[test]
fn dvl_ensembles_and_records() {
    let frames: Vec<Vec<u8>> = lines(include_str!("../vectors/pd0.hex")).map(|columns| bytes(columns[3])).collect();
    let (mut decoder, mut found) = (pd0::Decoder::new(), 0);
    soak(&mut decoder, &damaged(&frames, 2), |decoder, part| match decoder.feed(part) {
        None => false,
        Some(outcome) => {
            found += u32::from(outcome.map(|ensemble| ensemble.sample(0.1)).is_ok());
            true
        }
    });
    // 314 frames are whole on average; a damaged length takes what follows along
    assert!(found > 200, "{found}");

    let frames: Vec<Vec<u8>> = lines(include_str!("../vectors/pd4.hex")).map(|columns| bytes(columns[3])).collect();
    let (mut decoder, mut found) = (pd4::Decoder::new(), 0);
    soak(&mut decoder, &damaged(&frames, 3), |decoder, part| match decoder.feed(part) {
        None => false,
        Some(outcome) => {
            found += u32::from(outcome.map(|record| record.sample(0.1)).is_ok());
            true
        }
    });
    assert!(found > 5_000, "{found}");

    let frames: Vec<Vec<u8>> =
        include_str!("../vectors/pd6.txt").lines().map(|line| format!("{line}\r\n").into_bytes()).collect();
    let (mut decoder, mut found) = (pd6::Decoder::new(0.1), 0);
    soak(&mut decoder, &damaged(&frames, 4), |decoder, part| match decoder.feed(part) {
        None => false,
        Some(outcome) => {
            found += u32::from(outcome.is_ok());
            true
        }
    });
    assert!(found > 1_000, "{found}");
}

#[test]
fn ahrs_replies_and_packets() {
    let frames: Vec<Vec<u8>> = lines(include_str!("../vectors/gx3.hex")).map(|columns| bytes(columns[2])).collect();
    let (mut decoder, mut found) = (gx3::Decoder::new(), 0);
    soak(&mut decoder, &damaged(&frames, 5), |decoder, part| match decoder.feed(part) {
        None => false,
        Some(outcome) => {
            found += u32::from(outcome.is_ok());
            true
        }
    });
    assert!(found > 8_000, "{found}");

    let frames: Vec<Vec<u8>> = lines(include_str!("../vectors/mip.hex")).map(|columns| bytes(columns[2])).collect();
    let (mut decoder, mut found) = (mip::Decoder::new(), 0);
    soak(&mut decoder, &damaged(&frames, 6), |decoder, part| match decoder.feed(part) {
        None => false,
        Some(outcome) => {
            found += u32::from(outcome.is_ok_and(|packet| packet.sample().is_ok() || packet.answer().is_some()));
            true
        }
    });
    assert!(found > 5_000, "{found}");
}

#[test]
fn host_link_and_ship_state() {
    let mut buffer = [0; MAX_FRAME];
    let frames: Vec<Vec<u8>> =
        [ToBoard::Hello, ToBoard::MissionGet { index: 3 }, ToBoard::ParameterSet { name: "m", value: 0.0 }]
            .iter()
            .map(|message| hostlink::encode(message, &mut buffer).unwrap().to_vec())
            .collect();
    let (mut decoder, mut found) = (hostlink::Decoder::new(), 0);
    soak(&mut decoder, &damaged(&frames, 7), |decoder, part| match decoder.feed(part) {
        None => false,
        Some(outcome) => {
            found += u32::from(outcome.is_ok_and(|frame| frame.message::<ToBoard<'_>>().is_ok()));
            true
        }
    });
    assert!(found > 10_000, "{found}");

    // Postcard itself, on bytes that passed no CRC.
    let mut noise = Random(8);
    for _ in 0..20_000 {
        let bytes: Vec<u8> = (0..noise.below(64)).map(|_| noise.word() as u8).collect();
        let _ = postcard::from_bytes::<ToBoard<'_>>(&bytes).is_ok();
        let _ = postcard::from_bytes::<FromBoard<'_>>(&bytes).is_ok();
        let _ = ShipState::parse(&bytes).is_ok();
    }
}
