use crate::vectors::{assert_framed_at_every_split, sentence, sentences};
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::modem::{
    Addresses, ClockEncoding, ClockMode, Data, DopplerSign, FromModem, ModemTime, Payload, PingReply, Received,
    ReceptionStatistics, ToModem,
};
use backseat_wire::nmea::{Checksum, MAX_SENTENCE, Sentence};
use backseat_wire::{Decimal, Error};

const FILE: &str = include_str!("../vectors/micromodem.nmea");
/// No mission needs these.
const UNHANDLED: [&str; 3] = ["$CACMD", "$CACMA", "$CARFP"];

#[test]
fn val_every_vector_is_taken_and_survives_being_written() {
    let mut buffer = [0; MAX_SENTENCE];
    let (mut taken, mut unhandled) = (0, 0);
    for (status, line) in sentences(FILE) {
        let rule = if status == "none" { Checksum::Optional } else { Checksum::Required };
        let parsed = Sentence::from_line(line.as_bytes(), rule).unwrap_or_else(|cause| panic!("{line}: {cause:?}"));
        if UNHANDLED.iter().any(|id| line.starts_with(id)) {
            assert_eq!(FromModem::parse(&parsed), Err(Error::Unhandled), "{line}");
            unhandled += 1;
            continue;
        }
        match (FromModem::parse(&parsed), ToModem::parse(&parsed)) {
            (Ok(message), Err(Error::Unknown)) => {
                let written = message.emit(&mut buffer).unwrap();
                let again = Sentence::from_line(written, Checksum::Required).unwrap();
                assert_eq!(FromModem::parse(&again), Ok(message), "{line}");
            }
            (Err(Error::Unknown), Ok(message)) => {
                let written = message.emit(&mut buffer).unwrap();
                let again = Sentence::from_line(written, Checksum::Required).unwrap();
                assert_eq!(ToModem::parse(&again), Ok(message), "{line}");
            }
            other => panic!("{line}: {other:?}"),
        }
        taken += 1;
    }
    assert_eq!((taken, unhandled), (69, 7));
}

fn statistics(line: &str) -> ReceptionStatistics {
    match FromModem::parse(&sentence(line)) {
        Ok(FromModem::Statistics(statistics)) => statistics,
        other => panic!("{line}: {other:?}"),
    }
}

#[test]
fn val_transmit_statistics_say_when_a_packet_left() {
    // 2025-06-06 23:01:03.000935: a packet on the pulse; the other form has no version
    let lines = [
        "$CAXST,7,20250606,230103.000935,3,0,200,5000,25000,1,0,1,0,0,1,5,2,25000*53",
        "$CAXST,20250606,230103.000935,3,0,200,5000,25000,1,0,1,0,0,1,5,2",
    ];
    for (line, version) in lines.into_iter().zip([Some(7), None]) {
        let parsed = Sentence::from_line(line.as_bytes(), Checksum::Optional).unwrap();
        let Ok(FromModem::TransmitStatistics(s)) = FromModem::parse(&parsed) else { panic!("{line}") };
        assert_eq!((s.version, s.time.unix_us(), s.clock, s.mode), (version, 1_749_250_863_000_935, ClockMode(3), 0));
    }
}

#[test]
fn val_statistics_old_form() {
    let line = "$CACST,0,120001.6667,3,1440,25,0175,0166,75,01,01,01,03,0,001,002,0,1,1,0,150,12,09,-100,-1,220,-0.5,45,10000,2000*49";
    let s = statistics(line);
    assert_eq!((s.version, s.mode, s.clock), (None, 0, ClockMode(3)));
    assert_eq!(s.arrival, ModemTime::OfDay(TimeOfDay::from_us(43_201_666_700)));
    assert_eq!((s.detector, s.spl_db, s.gain), ([Some(1440), Some(25), Some(175)], Some(166), Some(75)));
    assert_eq!((s.rate, s.source, s.destination), (Some(0), Some(1), Some(2)));
    assert_eq!((s.psk_error, s.packet_type, s.frames, s.bad_frames), (Some(0), Some(1), Some(1), Some(0)));
    assert_eq!((s.quality, s.doppler_mps), (Some(220), Some(Decimal::new(-5, 1))));
    assert_eq!((s.noise_db, s.carrier_hz, s.bandwidth_hz), (Some(45), Some(10_000), Some(2_000)));
    // Written, it is the same text.
    let mut buffer = [0; 256];
    let own = FromModem::Statistics(ReceptionStatistics { ..s }).emit(&mut buffer).unwrap();
    assert_eq!(std::str::from_utf8(own).unwrap().replace(",12,9,", ",12,09,").get(..100), line.get(..100));
}

#[test]
fn val_statistics_version_8_as_captured() {
    let s = statistics(
        "$CACST,8,0,20250606230123.348554,06,32767,45,0102,0123,07,00,00,00,00,1,001,000,0,5,1,0,150,26.0,9.48,-100,-6.48,-01,0.01,51,25000,5000,0,-1,-1,00*4A",
    );
    assert_eq!((s.version, s.mode, s.clock), (Some(8), 0, ClockMode(6)));
    // 2025-06-06 23:01:23 UTC.
    assert_eq!(s.arrival.unix_us(0), 1_749_250_883_348_554);
    assert_eq!((s.rate, s.source, s.destination, s.packet_type), (Some(1), Some(1), Some(0), Some(5)));
    assert_eq!(s.snr_db.map(|snr| snr.unwrap().to_f64()), [26.0, 9.48, -100.0]);
    assert_eq!((s.mse_db.unwrap().to_f64(), s.quality), (-6.48, Some(-1)));
    assert_eq!(s.doppler_mps.unwrap().to_f64(), 0.01);
    assert_eq!((s.noise_db, s.carrier_hz, s.bandwidth_hz), (Some(51), Some(25_000), Some(5_000)));
}

#[test]
fn val_statistics_of_any_length() {
    // Published with noise and carrier run together: 27 fields.
    let s = statistics(
        "$CACST,1,153026.0000,0,4105,30,0318,0193,10,00,00,01,01,2,004,004,3,3,3,1,154,09,08,10,-6,000,0.0,4125000,5000*5B",
    );
    assert_eq!((s.mode, s.psk_error, s.doppler_mps), (1, Some(3), Some(Decimal::new(0, 1))));
    assert_eq!((s.noise_db, s.carrier_hz, s.bandwidth_hz), (Some(4_125_000), Some(5_000), None));
    let short = statistics("$CACST,2,120031.0000,3*44");
    assert_eq!((short.mode, short.rate, short.doppler_mps), (2, None, None));
    let short = statistics("$CACST,6,2,20261120120031.000000,03*6A");
    assert_eq!((short.version, short.mode, short.rate), (Some(6), 2, None));
}

#[test]
fn clock_modes() {
    for (mode, legacy, bits) in [
        (0, false, false),
        (3, true, false),
        (6, false, false),
        (0b01110, false, true),
        (0b10011, false, true),
        (0b10001, false, false),
    ] {
        assert_eq!(ClockMode(mode).is_synchronous(ClockEncoding::Legacy), legacy, "{mode}");
        assert_eq!(ClockMode(mode).is_synchronous(ClockEncoding::BitField), bits, "{mode}");
    }
    for (line, synchronous) in
        [("$CATMQ,2026-11-20T12:00:01Z,GPS,EXT_SYNC*3B", true), ("$CATMQ,2026-11-20T12:00:01Z,RTC,RTC*6E", false)]
    {
        let Ok(FromModem::TimeReport(report)) = FromModem::parse(&sentence(line)) else { panic!() };
        assert_eq!(report.is_synchronous(), synchronous);
    }
}

#[test]
fn doppler_sign_is_a_parameter() {
    assert_eq!(DopplerSign::ClosingPositive.range_rate_mps(0.5), -0.5);
    assert_eq!(DopplerSign::OpeningPositive.range_rate_mps(0.5), 0.5);
}

#[test]
fn val_time_of_arrival_finds_its_day() {
    let Ok(FromModem::TimeOfArrival { time, clock }) = FromModem::parse(&sentence("$CATOA,120001.6667,3*46")) else {
        panic!()
    };
    assert_eq!((time.us(), clock), (43_201_666_700, ClockMode(3)));
    let midnight = 1_795_132_800_000_000; // 2026-11-20 00:00:00 UTC
    assert_eq!(time.nearest(midnight + 43_204_000_000), midnight + 43_201_666_700);
    // Reported after midnight, arrived before, and the reverse.
    let late = TimeOfDay::from_us(86_399_000_000);
    assert_eq!(late.nearest(midnight + 2_000_000), midnight - 1_000_000);
    assert_eq!(TimeOfDay::from_us(500_000).nearest(midnight - 1_000_000), midnight + 500_000);
}

#[test]
fn val_data_both_ways() {
    let bytes: Vec<u8> = (0..2).flat_map(|_| (0..16).map(|byte| byte * 0x11)).collect();
    let line = "$CARXD,1,2,0,1,00112233445566778899AABBCCDDEEFF00112233445566778899AABBCCDDEEFF*62";
    let addresses = Addresses { source: 1, destination: 2 };
    let received =
        FromModem::Received(Received { addresses, acknowledge: false, frame: 1, payload: Payload::new(&bytes) });
    assert_eq!(FromModem::parse(&sentence(line)), Ok(received));
    let mut buffer = [0; MAX_SENTENCE];
    assert_eq!(received.emit(&mut buffer).unwrap(), format!("{line}\r\n").as_bytes());
    let data = ToModem::Data(Data { addresses, acknowledge: false, payload: Payload::new(&bytes) });
    let line = "$CCTXD,1,2,0,00112233445566778899AABBCCDDEEFF00112233445566778899AABBCCDDEEFF*7B";
    assert_eq!(data.emit(&mut buffer).unwrap(), format!("{line}\r\n").as_bytes());
    let Ok(ToModem::Data(again)) = ToModem::parse(&sentence(line)) else { panic!() };
    assert_eq!(again.payload.copy_to(&mut [0; 32]).unwrap(), bytes);
    assert_eq!(again.payload.copy_to(&mut [0; 31]), Err(Error::BufferFull));
    // The longest frame fits.
    let long = [0xA5; 256];
    let data = ToModem::Data(Data { addresses, acknowledge: false, payload: Payload::new(&long) });
    let written = data.emit(&mut buffer).unwrap();
    assert_eq!(ToModem::parse(&Sentence::from_line(written, Checksum::Required).unwrap()), Ok(data));
}

#[test]
fn val_ping_replies() {
    let reply = |line: &str| FromModem::parse(&sentence(line)).unwrap().emit(&mut [0; 96]).map(<[u8]>::to_vec);
    assert_eq!(reply("$CAMPR,2,1,0.0101*7C").unwrap(), b"$CAMPR,2,1,0.0101*7C\r\n");
    let missed = FromModem::PingReply(PingReply { addresses: Addresses { source: 2, destination: 1 }, travel_s: None });
    assert_eq!(FromModem::parse(&sentence("$CAMPR,2,1*4E")), Ok(missed));
    let line = "$CACMR,PNR,2025-05-29T15:09:05.461473,1,0,0.001997,6.3,7.65,1,0,*41";
    let Ok(FromModem::PingReply2(reply)) = FromModem::parse(&sentence(line)) else { panic!() };
    assert_eq!((reply.addresses.source, reply.travel_s.unwrap().to_f64()), (1, 0.001_997));
    assert_eq!(reply.time.unix_us() % 60_000_000, 5_461_473);
}

#[test]
fn val_flexible_fragments() {
    let line = "$CARDP,1,2,1,0,0,1;4;DEADBEEF,0;3;010203*5C";
    let Ok(FromModem::FlexibleReceived(packet)) = FromModem::parse(&sentence(line)) else { panic!() };
    let mini = packet.mini[0].unwrap();
    assert!(mini.good && mini.payload == Payload::new(&[0xDE, 0xAD, 0xBE, 0xEF]));
    let data = packet.data[0].unwrap();
    assert!(!data.good && data.payload.bytes().eq([1, 2, 3]));
    assert_eq!((packet.mini[1], packet.data[1]), (None, None));
}

#[test]
fn refused_by_cause() {
    for (line, cause) in [
        ("$CARXD,1,2,0,1,001", Error::Malformed),
        ("$CARXD,1,2,0,1,0G", Error::Malformed),
        ("$CARXD,1,128,0,1,00", Error::OutOfRange),
        ("$CACYC,0,1,2,7,0,1", Error::OutOfRange),
        ("$CACYC,0,1,2", Error::Missing),
        ("$CACST", Error::Missing),
        ("$CACST,3,120000,0", Error::OutOfRange),
        ("$CACST,0,126000,0", Error::OutOfRange),
        ("$CACST,8,0,20251306230123.3,06", Error::OutOfRange),
        ("$CACST,0,120000,0,1,2,x", Error::Malformed),
        ("$CATOA,1200,3", Error::Malformed),
        ("$CAMPR,2,1,-0.5", Error::OutOfRange),
        ("$CAMPR,2,1,999999.0", Error::OutOfRange),
        ("$CAMUA,1,2,ffff", Error::OutOfRange),
        ("$CARDP,1,2,1,0,0,1;4;DEAD,", Error::Length),
        ("$CARDP,1,2,1,0,0,1;4,", Error::Missing),
        ("$CATMQ,2026-11-20 12:00:01Z,GPS,EXT", Error::Malformed),
        ("$CARXP,2", Error::Malformed),
        ("$CANEW,1", Error::Unknown),
    ] {
        assert_eq!(FromModem::parse(&sentence(line)).unwrap_err(), cause, "{line}");
    }
}

#[test]
fn framed_at_every_split() {
    let lines: Vec<&str> = sentences(FILE).into_iter().map(|(_, line)| line).collect();
    for lines in lines.chunks(16) {
        assert_framed_at_every_split(lines);
    }
}
