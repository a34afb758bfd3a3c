use backseat_wire::Error;
use backseat_wire::hostlink::{
    BoardLog, Chunk, Decoder, Fittings, FromBoard, FusionTelemetry, Hardware, Health, Held, ImageId, KeptCrash,
    LogState, MAX_CHUNKS, MAX_FRAME, MAX_PPS, Mode, ModeReason, Oscillator, ParameterInfo, Port, Refusal,
    ReleaseReason, Stack, Steered, Step, StepDone, Telemetry, ToBoard, Waypoint, encode,
};

fn largest_step() -> ToBoard<'static> {
    let mut step = Step {
        time_us: u64::MAX,
        pps_us: heapless::Vec::new(),
        chunks: heapless::Vec::new(),
        fittings: Default::default(),
    };
    for _ in 0..MAX_PPS {
        step.pps_us.push(u64::MAX).unwrap();
    }
    for _ in 0..MAX_CHUNKS {
        step.chunks.push(Chunk { port: Port::Host, time_us: u64::MAX, length: u16::MAX }).unwrap();
    }
    ToBoard::Step(step)
}

fn telemetry() -> FromBoard<'static> {
    FromBoard::Telemetry(Telemetry {
        time_us: u64::MAX,
        utc_us: u64::MAX,
        mode: Mode::Navigating,
        reason: ModeReason::Nominal,
        state: [-0.1; 12],
        sigma: [1.0; 12],
        cov_xy_m2: f64::MAX,
        current_mps: [0.15, 0.0],
        propeller_radps: 100.0,
        fins_rad: [0.1; 4],
        leg: Some(u16::MAX),
        rejected_frames: [u32::MAX; 4],
        level_m: [12.5, f32::INFINITY],
    })
}

#[test]
fn every_message_survives() {
    let waypoint = Waypoint { x_m: 1000.0, y_m: -100.0, depth_m: 3.0, speed_mps: 1.0 };
    let to_board = [
        ToBoard::Hello,
        largest_step(),
        ToBoard::ParameterBegin,
        ToBoard::ParameterSet { name: "drag.quadratic_diag.0", value: 3.0 },
        ToBoard::ParameterCommit,
        ToBoard::ParameterGet { index: 7 },
        ToBoard::MissionBegin { count: 20 },
        ToBoard::MissionItem { index: 3, waypoint },
        ToBoard::MissionCommit,
        ToBoard::MissionGet { index: 3 },
        ToBoard::MissionStart,
        ToBoard::MissionStop,
        ToBoard::FenceCorner { index: 31, count: 32, corner_m: [-100_000.0, 0.1] },
        ToBoard::FenceGet { index: 31 },
        ToBoard::DropWeight { release: true },
        ToBoard::Helm { heading_rad: -0.1, depth_m: 3.0, speed_mps: f64::MAX },
    ];
    let info = ParameterInfo {
        index: 1,
        count: 90,
        name: "propeller.beta5_n_s2_per_rad2",
        unit: "N s2/rad2",
        value: 3.0e-4,
        min: 0.0,
        max: 1.0,
        default: 3.0e-4,
    };
    let from_board = [
        FromBoard::Hello {
            firmware: "0.1.0",
            parameter_schema: 1,
            image: ImageId { build: 0xAB, crc: u32::MAX, commit: 0, parameters: 7 },
        },
        FromBoard::StepDone(StepDone { time_us: 100_000, sent: [0, 1, 2, 65_535], digest: u64::MAX }),
        telemetry(),
        FromBoard::Fusion(FusionTelemetry {
            sensor: 7,
            axis: 0,
            outcome: 1,
            time_us: 1,
            innovation: -2.0,
            variance: 1.5,
        }),
        FromBoard::Parameter(info),
        FromBoard::Mission { index: 0, count: 0, waypoint: None },
        FromBoard::Fence { index: 31, count: 32, corner_m: Some([-100_000.0, 0.1]) },
        FromBoard::Done,
        FromBoard::Refused(Refusal::UnderWay),
        FromBoard::Refused(Refusal::NotPermitted),
        FromBoard::Health(Health {
            accepted_frames: [1, 2, 3, u32::MAX],
            rejected_frames: [0; 4],
            pps_edges: 7,
            synchronised: true,
            oscillator: Oscillator::Internal,
            receive_losses: [0, 1, 300, 70_000, u32::MAX],
            log: BoardLog { state: LogState::Failed, lost_records: 300 },
            late_steps: 2,
            latest_step_us: 479_000,
            hardware: Some(Hardware { stacks: [Stack { used: 7, room: u32::MAX }; 2], ..Hardware::default() }),
            refused_requests: 9,
            fittings: Fittings { released: Some(ReleaseReason::NoAscent), ..Fittings::default() },
        }),
        FromBoard::EarlierCrash(KeptCrash { overwritten: u32::MAX, ..KeptCrash::default() }),
        FromBoard::Steered(Steered {
            time_us: u64::MAX,
            by_host: Some(Held { heading_rad: -1.5, depth_m: 300.0, speed_mps: 3.0 }),
        }),
        FromBoard::Steered(Steered { time_us: 0, by_host: None }),
    ];
    let mut stream = Vec::new();
    let mut buffer = [0; MAX_FRAME];
    to_board.iter().for_each(|message| stream.extend(encode(message, &mut buffer).unwrap()));
    stream.extend(b"noise between frames");
    from_board.iter().for_each(|message| stream.extend(encode(message, &mut buffer).unwrap()));
    for split in (0..stream.len()).step_by(5) {
        let (mut decoder, mut index) = (Decoder::new(), 0);
        for mut part in [&stream[..split], &stream[split..]] {
            while let Some(outcome) = decoder.feed(&mut part) {
                let Ok(frame) = outcome else { continue };
                match to_board.get(index) {
                    Some(wanted) => assert_eq!(&frame.message::<ToBoard<'_>>().unwrap(), wanted),
                    None => assert_eq!(frame.message::<FromBoard<'_>>().unwrap(), from_board[index - to_board.len()]),
                }
                index += 1;
            }
        }
        let all = to_board.len() + from_board.len();
        assert_eq!((index, decoder.counts().rejected()), (all, 1), "split at {split}");
    }
}

#[test]
fn sizes() {
    let mut buffer = [0; MAX_FRAME];
    // 485 bytes of postcard (each integer at its longest), CRC 4, COBS codes 2, delimiters 2.
    assert_eq!(encode(&largest_step(), &mut buffer).unwrap().len(), 493);
    assert!(encode(&telemetry(), &mut buffer).unwrap().len() < 330);
    assert_eq!(encode(&largest_step(), &mut [0; 480]), Err(Error::BufferFull));
    assert_eq!(encode(&ToBoard::Hello, &mut [0; 3]), Err(Error::BufferFull));
    let long = "x".repeat(800);
    assert_eq!(encode(&ToBoard::ParameterSet { name: &long, value: 0.0 }, &mut [0; 2000]), Err(Error::BufferFull));
}

#[test]
fn a_frame_is_these_bytes() {
    // Message 00; CRC-32 of one zero byte is D202EF8D (`python3 -c "import zlib; print(hex(zlib.crc32(b'\\0')))"`).
    let mut buffer = [0; 32];
    let frame = encode(&ToBoard::Hello, &mut buffer).unwrap();
    assert_eq!(frame, [0x00, 0x01, 0x05, 0x8D, 0xEF, 0x02, 0xD2, 0x00]);
}

#[test]
fn long_runs_without_a_zero() {
    // Names of every length around the block size of 254.
    for length in 230..520 {
        let name: String = (0..length).map(|at| char::from(b'a' + (at % 26) as u8)).collect();
        let message = ToBoard::ParameterSet { name: &name, value: 1.0 / 3.0 };
        let mut buffer = [0; MAX_FRAME];
        let mut bytes = encode(&message, &mut buffer).unwrap();
        assert!(bytes[1..bytes.len() - 1].iter().all(|byte| *byte != 0));
        let mut decoder = Decoder::new();
        let frame = decoder.feed(&mut bytes).unwrap().unwrap();
        assert_eq!(frame.message::<ToBoard<'_>>(), Ok(message), "{length}");
    }
}

#[test]
fn refused_by_cause() {
    let mut buffer = [0; 32];
    let good = encode(&ToBoard::ParameterGet { index: 5 }, &mut buffer).unwrap().to_vec();
    let cause = |bytes: &[u8]| {
        let (mut decoder, mut bytes) = (Decoder::new(), bytes);
        let cause = decoder.feed(&mut bytes).unwrap().unwrap_err();
        assert_eq!((decoder.counts().of(cause), decoder.counts().rejected()), (1, 1));
        cause
    };
    let mut flipped = good.clone();
    flipped[4] ^= 1;
    assert_eq!(cause(&flipped), Error::Checksum);
    assert_eq!(cause(&[0, 9, 1, 2, 0]), Error::Framing);
    assert_eq!(cause(&[0, 3, 1, 2, 0]), Error::Length);
    assert_eq!(cause(&[1; 2_000]), Error::Overflow);
    // A frame in order that is no such message.
    let mut decoder = Decoder::new();
    let frame = decoder.feed(&mut good.as_slice()).unwrap().unwrap();
    assert_eq!(frame.message::<FromBoard<'_>>(), Err(Error::Malformed));
    assert_eq!(frame.message::<ToBoard<'_>>(), Ok(ToBoard::ParameterGet { index: 5 }));
    // After an overflow the next frame is found.
    let mut stream = vec![7; 2_000];
    stream.extend(&good);
    let (mut decoder, mut bytes) = (Decoder::new(), stream.as_slice());
    assert_eq!(decoder.feed(&mut bytes).unwrap(), Err(Error::Overflow));
    assert!(decoder.feed(&mut bytes).unwrap().is_ok());
}
