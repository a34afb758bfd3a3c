//! Host link and board log: frames of any message, in streams cut anywhere.

use backseat_wire::boardlog::{LogRecord, VALUES};
use backseat_wire::hostlink::{
    Chunk, Decoder, FittingReadings, Frame, FromBoard, FusionTelemetry, ImageId, MAX_CHUNKS, MAX_FRAME, MAX_PPS, Mode,
    ModeReason, ParameterInfo, Port, Refusal, Step, StepDone, Telemetry, ToBoard, Waypoint, encode,
};
use proptest::array::{uniform2, uniform4, uniform12};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use serde::Serialize;

/// Any number but NaN, which is not equal to itself.
fn number() -> impl Strategy<Value = f64> {
    prop::num::f64::ANY.prop_map(|value| if value.is_nan() { -0.0 } else { value })
}

fn port() -> impl Strategy<Value = Port> {
    (0..5_usize).prop_map(|i| Port::ALL[i])
}

fn step() -> impl Strategy<Value = Step> {
    let chunk =
        (port(), any::<u64>(), any::<u16>()).prop_map(|(port, time_us, length)| Chunk { port, time_us, length });
    (any::<u64>(), vec(any::<u64>(), 0..=MAX_PPS), vec(chunk, 0..=MAX_CHUNKS)).prop_map(|(time_us, pps, chunks)| Step {
        time_us,
        pps_us: pps.into_iter().collect(),
        chunks: chunks.into_iter().collect(),
        fittings: FittingReadings { leak: Some(true), supply_v: Some(24.5), ..Default::default() },
    })
}

fn waypoint() -> impl Strategy<Value = Waypoint> {
    uniform4(number()).prop_map(|[x_m, y_m, depth_m, speed_mps]| Waypoint { x_m, y_m, depth_m, speed_mps })
}

fn telemetry() -> impl Strategy<Value = Telemetry> {
    let modes =
        prop::sample::select(vec![Mode::Initialising, Mode::Navigating, Mode::Degraded, Mode::Lost, Mode::Safe]);
    let reasons = prop::sample::select(vec![ModeReason::Nominal, ModeReason::NoFix, ModeReason::Resets]);
    let numbers =
        (uniform12(number()), uniform12(number()), number(), uniform2(number()), number(), uniform4(number()));
    (any::<(u64, u64, Option<u16>, [u32; 4])>(), modes, reasons, numbers).prop_map(
        |((time_us, utc_us, leg, rejected_frames), mode, reason, numbers)| {
            let (state, sigma, cov_xy_m2, current_mps, propeller_radps, fins_rad) = numbers;
            Telemetry {
                time_us,
                utc_us,
                mode,
                reason,
                state,
                sigma,
                cov_xy_m2,
                current_mps,
                propeller_radps,
                fins_rad,
                leg,
                rejected_frames,
                level_m: [sigma[0] as f32, sigma[2] as f32],
            }
        },
    )
}

fn to_board(kind: usize, name: &str, value: f64, index: u16, step: Step, waypoint: Waypoint) -> ToBoard<'_> {
    match kind {
        0 => ToBoard::Hello,
        1 => ToBoard::Step(step),
        2 => ToBoard::ParameterSet { name, value },
        3 => ToBoard::ParameterGet { index },
        4 => ToBoard::MissionBegin { count: index },
        5 => ToBoard::MissionItem { index, waypoint },
        6 => ToBoard::MissionGet { index },
        7 => ToBoard::ParameterStore,
        8 => ToBoard::Helm { heading_rad: value, depth_m: waypoint.depth_m, speed_mps: waypoint.speed_mps },
        _ => ToBoard::Unlock,
    }
}

fn from_board<'a>(
    kind: usize,
    name: &'a str,
    numbers: [f64; 4],
    (index, count, digest): (u16, u16, u64),
    telemetry: Telemetry,
    waypoint: Option<Waypoint>,
) -> FromBoard<'a> {
    let [value, min, max, default] = numbers;
    match kind {
        0 => FromBoard::Hello {
            firmware: name,
            parameter_schema: index,
            image: ImageId { build: digest as u32, ..ImageId::default() },
        },
        1 => FromBoard::StepDone(StepDone { time_us: digest, sent: [index, count, 0, u16::MAX], digest }),
        2 => FromBoard::Telemetry(telemetry),
        3 => FromBoard::Fusion(FusionTelemetry {
            sensor: index as u8,
            axis: count as u8,
            outcome: 1,
            time_us: digest,
            innovation: value,
            variance: min,
        }),
        4 => FromBoard::Parameter(ParameterInfo { index, count, name, unit: name, value, min, max, default }),
        5 => FromBoard::Mission { index, count, waypoint },
        6 => FromBoard::Done,
        _ => FromBoard::Refused(Refusal::InvalidSet),
    }
}

/// Frames of a stream cut in two for which `is` holds.
fn found(stream: &[u8], cut: Index, mut is: impl FnMut(&Frame<'_>) -> bool) -> usize {
    let (front, back) = stream.split_at(cut.index(stream.len()));
    let (mut decoder, mut count) = (Decoder::new(), 0);
    for mut part in [front, back] {
        while let Some(outcome) = decoder.feed(&mut part) {
            count += usize::from(outcome.is_ok_and(|frame| is(&frame)));
        }
    }
    count
}

/// Noise, and the frame of a message twice.
fn stream(message: &impl Serialize, noise: &[u8]) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(message, &mut buffer).unwrap();
    [noise, frame, frame].concat()
}

proptest! {
    #[test]
    fn messages_to_the_board(
        kind in 0..10_usize,
        (name, value, index) in ("[ -~]{0,40}", number(), any::<u16>()),
        step in step(),
        waypoint in waypoint(),
        noise in vec(any::<u8>(), 0..40),
        cut: Index,
    ) {
        let message = to_board(kind, &name, value, index, step, waypoint);
        prop_assert_eq!(found(&stream(&message, &noise), cut, |frame| frame.message() == Ok(message.clone())), 2);
    }

    #[test]
    fn messages_from_the_board(
        kind in 0..8_usize,
        (name, numbers, integers) in ("[ -~]{0,40}", uniform4(number()), any::<(u16, u16, u64)>()),
        telemetry in telemetry(),
        waypoint in prop::option::of(waypoint()),
        noise in vec(any::<u8>(), 0..40),
        cut: Index,
    ) {
        let message = from_board(kind, &name, numbers, integers, telemetry, waypoint);
        prop_assert_eq!(found(&stream(&message, &noise), cut, |frame| frame.message() == Ok(message.clone())), 2);
    }

    #[test]
    fn board_log(
        kind in 0..5,
        port in port(),
        (time_us, digest) in any::<(u64, u64)>(),
        bytes in vec(any::<u8>(), 0..=256),
        values in vec(number(), 0..=VALUES),
        noise in vec(any::<u8>(), 0..40),
        cut: Index,
    ) {
        let record = match kind {
            0 => LogRecord::Parameters { first: digest as u16, values: values.into_iter().collect() },
            1 => LogRecord::Received { port, time_us, bytes: &bytes },
            2 => LogRecord::Sent { port, time_us, bytes: &bytes },
            3 => LogRecord::Edge { time_us },
            _ => LogRecord::Step { time_us, digest },
        };
        prop_assert_eq!(found(&stream(&record, &noise), cut, |frame| frame.message() == Ok(record.clone())), 2);
    }

    /// Whatever a good frame holds: what is understood is written as it came.
    #[test]
    fn any_bytes(bytes in vec(any::<u8>(), 0..64)) {
        let mut buffer = [0; 128];
        if let Ok((message, [])) = postcard::take_from_bytes::<ToBoard<'_>>(&bytes) {
            let written = postcard::to_slice(&message, &mut buffer).unwrap();
            let again: ToBoard<'_> = postcard::from_bytes(written).unwrap();
            // not a number is not equal to itself
            prop_assert_eq!(format!("{message:?}"), format!("{again:?}"));
        }
    }
}
