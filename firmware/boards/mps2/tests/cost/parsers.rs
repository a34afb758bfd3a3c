//! One frame of each kind through its decoder.

use crate::feed::{Frames, WORST_STEP};
use crate::measure::count;
use crate::row;
use backseat_wire::ahrs::{AhrsSample, gx3, mip, os5000::Os5000};
use backseat_wire::dvl::{DvlSample, pd0, pd4, pd6};
use backseat_wire::hostlink::{self, FromBoard, FusionTelemetry, Port, Step, Telemetry, ToBoard};
use backseat_wire::iver::{FromFrontseat, Units};
use backseat_wire::modem::FromModem;
use backseat_wire::nmea::{Checksum, Framer, Sentence};
use backseat_wire::ship_state::ShipState;
use core::hint::black_box;

/// Everything.
pub fn measure(frames: &mut Frames) {
    let units = Units::remote_helm(5);
    frames.prepare(10);
    sentences(frames.port(Port::Frontseat), |sentence| FromFrontseat::parse(sentence, &units).is_ok());
    frames.prepare(WORST_STEP);
    sentences(frames.port(Port::Modem), |sentence| FromModem::parse(sentence).is_ok());
    devices();
    ship_state();
    host_link();
}

/// Framing and parsing of each sentence, named by its first field.
fn sentences(bytes: &[u8], parse: impl Fn(&Sentence<'_>) -> bool) {
    let mut rest = bytes;
    while !rest.is_empty() {
        let length = rest.iter().position(|byte| *byte == b'\n').map_or(rest.len(), |at| at + 1);
        let (line, behind) = rest.split_at(length);
        rest = behind;
        let mut framer = Framer::new(Checksum::Required);
        let (parsed, instructions) = count(|| {
            let mut line = black_box(line);
            framer.feed(&mut line).is_some_and(|outcome| outcome.is_ok_and(|sentence| parse(&sentence)))
        });
        assert!(parsed);
        let name = line.split(|byte| matches!(byte, b',' | b'*')).next().unwrap_or_default();
        row("parse", core::str::from_utf8(name).unwrap_or("?"), 0, length, instructions, 0);
    }
}

/// A decoder over one frame.
fn frame(name: &str, bytes: &[u8], mut decode: impl FnMut(&mut &[u8]) -> bool) {
    let (decoded, instructions) = count(|| {
        let mut rest = black_box(bytes);
        decode(&mut rest)
    });
    assert!(decoded);
    row("parse", name, 0, bytes.len(), instructions, 0);
}

fn devices() {
    let mut buffer = [0; 512];
    let sample = DvlSample {
        bottom_mps: Some([1.0, 0.01, -0.02]),
        water_mps: Some([1.0, 0.0, 0.0]),
        altitude_m: Some(20.0),
        error_mps: Some(0.001),
        attitude_rad: Some([0.0, 0.01, 1.0]),
        depth_m: Some(3.0),
        sound_speed_mps: Some(1500.0),
        ..DvlSample::default()
    };
    let bytes = pd0::Ensemble::from_sample(&sample, 1, 0.0).emit(&mut buffer).unwrap_or_default();
    let mut decoder = pd0::Decoder::new();
    frame("PD0", bytes, |rest| {
        decoder.feed(rest).is_some_and(|outcome| outcome.is_ok_and(|e| black_box(e.sample(0.0)).bottom_mps.is_some()))
    });
    let bytes = pd4::Record::from_sample(&sample, true, 0.0).emit(&mut buffer).unwrap_or_default();
    let mut decoder = pd4::Decoder::new();
    frame("PD5", bytes, |rest| {
        decoder.feed(rest).is_some_and(|outcome| outcome.is_ok_and(|r| black_box(r.sample(0.0)).bottom_mps.is_some()))
    });
    // A set is complete when the next one begins.
    let bytes = pd6::emit(&sample, 0.0, &mut buffer).unwrap_or_default();
    let mut decoder = pd6::Decoder::new(0.0);
    frame("PD6 set", bytes, |rest| decoder.feed(rest).is_none_or(|outcome| outcome.is_ok()));
    let reply = gx3::Reply::euler_rate([0.1, 0.2, 0.3], [0.01; 3], 62_500);
    let bytes = reply.emit(&mut buffer).unwrap_or_default();
    let mut decoder = gx3::Decoder::new();
    frame("GX3", bytes, |rest| decoder.feed(rest).is_some_and(|outcome| outcome.is_ok()));
    let sample = AhrsSample { euler_rad: Some([0.1, 0.2, 0.3]), rates_radps: Some([0.01; 3]), ..AhrsSample::default() };
    let bytes = mip::emit_sample(&sample, &mut buffer).unwrap_or_default();
    let mut decoder = mip::Decoder::new();
    frame("MIP", bytes, |rest| {
        decoder.feed(rest).is_some_and(|outcome| outcome.is_ok_and(|packet| packet.sample().is_ok()))
    });
    let sample = Os5000 {
        heading_rad: Some(4.7),
        pitch_rad: Some(0.03),
        roll_rad: Some(-0.01),
        temperature_degc: Some(29.4),
        depth: Some(12.55),
        ..Os5000::default()
    };
    let bytes = sample.emit(&mut buffer).unwrap_or_default();
    let mut framer = Framer::new(Checksum::Required);
    frame("OS5000", bytes, |rest| {
        framer.feed(rest).is_some_and(|outcome| outcome.is_ok_and(|sentence| Os5000::parse(&sentence).is_ok()))
    });
}

fn ship_state() {
    let ship = ShipState {
        source: 1,
        sequence: 0,
        transmit_s: 1_795_176_000,
        position_deg: [41.5, -70.7],
        velocity_mps: [0.5, -0.2],
        position_sigma_m: 0.5,
        velocity_sigma_mps: 0.05,
        transducer_depth_m: 2.0,
    };
    let bytes = ship.emit().unwrap_or_default();
    frame("ship state", &bytes, |rest| ShipState::parse(rest).is_ok());
}

fn host_link() {
    let mut buffer = [0; hostlink::MAX_FRAME];
    let step = ToBoard::Step(Step {
        time_us: 100_000,
        pps_us: Default::default(),
        chunks: Default::default(),
        fittings: Default::default(),
    });
    let bytes = hostlink::encode(&step, &mut buffer).unwrap_or_default();
    let mut decoder = hostlink::Decoder::new();
    frame("host link, step", bytes, |rest| {
        decoder.feed(rest).is_some_and(|outcome| outcome.is_ok_and(|frame| frame.message::<ToBoard<'_>>().is_ok()))
    });
    let fusion = FusionTelemetry { sensor: 0, axis: 0, outcome: 0, time_us: 1, innovation: 0.1, variance: 0.2 };
    emit("host link, fusion (written)", &FromBoard::Fusion(fusion));
    let telemetry = Telemetry {
        time_us: 1,
        utc_us: 1,
        mode: hostlink::Mode::Navigating,
        reason: hostlink::ModeReason::Nominal,
        state: [1.0; 12],
        sigma: [1.0; 12],
        cov_xy_m2: 0.1,
        current_mps: [0.0; 2],
        propeller_radps: 100.0,
        fins_rad: [0.1; 4],
        leg: Some(1),
        rejected_frames: [0; 4],
        level_m: [10.0, 1.0],
    };
    emit("host link, telemetry (written)", &FromBoard::Telemetry(telemetry));
}

fn emit(name: &str, message: &FromBoard<'_>) {
    let mut buffer = [0; hostlink::MAX_FRAME];
    let (length, instructions) = count(|| hostlink::encode(black_box(message), &mut buffer).map_or(0, <[u8]>::len));
    row("parse", name, 0, length, instructions, 0);
}
