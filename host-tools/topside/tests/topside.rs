//! The ship's half against a scripted receiver and a scripted modem: what it sends, when, and when it does not.

use backseat_topside::slots::{Airtime, Exchange, Slot, SlotTable};
use backseat_topside::{AbortRefused, Config, Event, Hold, Port, Topside};
use backseat_wire::Decimal;
use backseat_wire::abort::Abort;
use backseat_wire::calendar::{DateTime, TimeOfDay};
use backseat_wire::gps::{Gst, Rmc};
use backseat_wire::modem::{
    Addresses, ClockMode, DataRequest, FromModem, ModemTime, Payload, PingReply, Received, ReceptionStatistics,
    Revision, TimeReport, ToModem, TransmitStatistics,
};
use backseat_wire::named::Named;
use backseat_wire::nmea::{Checksum, MAX_SENTENCE, Sentence};
use backseat_wire::ship_state::{Key, ShipState};
use backseat_wire::vehicle_state::{AUTHENTIC_LENGTH, VehicleState};

/// 2025-06-03 12:00:00 UTC, a multiple of 30 s.
const NOON_S: u64 = 1_748_952_000;
const SECOND_US: u64 = 1_000_000;
/// The caller's clock is at this when it is noon.
const START_US: u64 = 777_000_000;

/// Receiver, modem and the ship's half between them.
struct Sea {
    topside: Topside,
    now_us: u64,
    /// Every sentence to the modem, with the seconds after noon.
    sent: Vec<(f64, String)>,
    events: Vec<Event>,
    gnss: bool,
    pulse: &'static str,
    clock: &'static str,
    /// The modem's clock is ahead by this, s.
    ahead_s: i64,
    /// The packet leaves so late, µs.
    late_us: u64,
    /// Answers settings and cycles.
    answers: bool,
    garble: bool,
}

impl Sea {
    fn new(config: Config) -> Self {
        Self {
            topside: Topside::new(config).unwrap(),
            now_us: 0,
            sent: Vec::new(),
            events: Vec::new(),
            gnss: true,
            pulse: "EXT",
            clock: "GPS",
            ahead_s: 0,
            late_us: 0,
            answers: true,
            garble: false,
        }
    }

    fn utc_us(&self) -> u64 {
        NOON_S * SECOND_US + self.now_us
    }

    fn local_us(&self) -> u64 {
        START_US + self.now_us
    }

    /// The modem says something.
    fn say(&mut self, message: &FromModem<'_>) {
        let mut buffer = [0; MAX_SENTENCE];
        let bytes = message.emit(&mut buffer).unwrap().to_vec();
        self.topside.receive(Port::Modem, self.local_us(), &bytes);
    }

    /// The ship moves north at 2 m/s from 41.5 N 70.7 W; a minute of latitude there is 1851.2 m.
    fn fix(&mut self) {
        let seconds = (self.now_us / SECOND_US) as f64;
        let mut buffer = [0; 128];
        let utc = DateTime::from_unix_us(self.utc_us() / SECOND_US * SECOND_US).unwrap();
        let rmc = Rmc {
            utc: Some(utc),
            valid: true,
            position_deg: Some([41.5 + 2.0 * seconds / 1851.2 / 60.0, -70.7]),
            speed_mps: Some(2.0),
            course_rad: Some(0.0),
            variation_rad: None,
        };
        let gst = Gst { time: Some(utc.time), sigma_m: Some([0.4, 0.4]) };
        let mut bytes = gst.emit(&mut buffer).unwrap().to_vec();
        bytes.extend_from_slice(rmc.emit(&mut buffer).unwrap());
        if self.garble {
            bytes.iter_mut().for_each(|byte| *byte ^= 0x55);
        }
        self.topside.receive(Port::Gnss, self.local_us(), &bytes);
    }

    /// Fixes come 0.2 s after their second; the modem answers at once.
    fn run(&mut self, seconds: f64) {
        let end_us = self.now_us + (seconds * 1e6) as u64;
        while self.now_us < end_us {
            self.now_us += 50_000;
            if self.gnss && self.now_us % SECOND_US == 200_000 {
                self.fix();
            }
            if self.now_us.is_multiple_of(100_000) {
                self.topside.step(self.local_us());
            }
            self.exchange();
        }
        while let Some((_, event)) = self.topside.next_event() {
            self.events.push(event);
        }
    }

    fn exchange(&mut self) {
        loop {
            let bytes = self.topside.transmit(Port::Modem).to_vec();
            if bytes.is_empty() {
                return;
            }
            self.topside.transmitted(Port::Modem, bytes.len());
            for line in String::from_utf8(bytes).unwrap().lines() {
                self.sent.push((self.now_us as f64 * 1e-6, line.to_owned()));
                if self.answers {
                    self.obey(line);
                }
            }
        }
    }

    fn obey(&mut self, line: &str) {
        let sentence = Sentence::from_line(line.as_bytes(), Checksum::Required).unwrap();
        let modem_us = self.utc_us().saturating_add_signed(self.ahead_s * 1_000_000);
        let pulse_us = (modem_us / SECOND_US + 1) * SECOND_US;
        match ToModem::parse(&sentence).unwrap() {
            ToModem::Configure(setting) => self.say(&FromModem::Setting(setting)),
            ToModem::QueryTime => {
                let report = TimeReport {
                    time: DateTime::from_unix_us(modem_us / SECOND_US * SECOND_US).unwrap(),
                    clock_source: self.clock,
                    pps_source: self.pulse,
                };
                self.say(&FromModem::TimeReport(report));
            }
            ToModem::SetTime { time, .. } => {
                self.clock = "USER_CMD";
                self.ahead_s = (time.unix_us() / SECOND_US) as i64 - (self.utc_us() / SECOND_US) as i64;
                self.say(&FromModem::TimeSet { status: 0, time });
            }
            ToModem::Cycle(cycle) => {
                // the cycle takes a second
                self.now_us += 900_000;
                let modem_us = modem_us + 900_000;
                let time = TimeOfDay::from_us(modem_us);
                let addresses = cycle.addresses;
                self.say(&FromModem::DataRequest(DataRequest {
                    time,
                    addresses,
                    acknowledge: false,
                    bytes: 32,
                    frame: 1,
                }));
            }
            ToModem::Data(_) => {
                let time = DateTime::from_unix_us(pulse_us + self.late_us).unwrap();
                let left = TransmitStatistics { version: Some(7), time, clock: ClockMode(3), mode: 0 };
                self.say(&FromModem::TransmitStatistics(left));
            }
            _ => {}
        }
    }

    fn sentences(&self, id: &str) -> Vec<(f64, String)> {
        self.sent.iter().filter(|(_, line)| line.starts_with(id)).cloned().collect()
    }

    fn held(&self) -> Option<&Hold> {
        self.events.iter().rev().find_map(|event| match event {
            Event::Hold(hold) => Some(hold.as_ref()),
            _ => None,
        })?
    }
}

fn payload(line: &str) -> Vec<u8> {
    let sentence = Sentence::from_line(line.as_bytes(), Checksum::Required).unwrap();
    match ToModem::parse(&sentence) {
        Ok(ToModem::Data(data)) => data.payload.bytes().collect(),
        other => panic!("{line}: {other:?}"),
    }
}

#[test]
fn val_the_packet_says_where_the_ship_is_at_its_second() {
    let mut sea = Sea::new(Config { origin_deg: Some([41.5, -70.7]), ..Config::reference() });
    sea.run(125.0);
    assert_eq!(sea.held(), None);
    // Cycles begin 1.5 s before their slots at 30, 60, 90 and 120 s; the modem is asked first for its settings.
    let cycles: Vec<f64> = sea.sentences("$CCCYC,0,1,127,0,0,1").iter().map(|(at, _)| *at).collect();
    assert_eq!(cycles, [28.5, 58.5, 88.5, 118.5]);
    assert_eq!(sea.sentences("$CCCFG").len(), 6);
    let packets = sea.sentences("$CCTXD");
    assert_eq!(packets.len(), 4);
    for ((_, line), transmit_s) in packets.iter().zip([30, 60, 90, 120]) {
        let state = ShipState::parse(&payload(line)).unwrap();
        assert_eq!(u64::from(state.transmit_s), NOON_S + transmit_s);
        // 2 m/s north from the start; 1e-7 degree is 1 cm, and fixes are written to 2 mm
        let north_m = (state.position_deg[0] - 41.5) * 60.0 * 1851.2;
        assert!((north_m - 2.0 * transmit_s as f64).abs() < 0.05, "{north_m} {transmit_s}");
        assert!((state.velocity_mps[0] - 2.0).abs() < 0.02 && state.velocity_mps[1].abs() < 0.02, "{state:?}");
        assert!((0.1..=0.5).contains(&state.position_sigma_m), "{state:?}");
    }
}

#[test]
fn a_key_signs_every_packet() {
    let key = Key::new([9; 16]);
    let mut sea = Sea::new(Config { key, ..Config::reference() });
    sea.run(35.0);
    let packets = sea.sentences("$CCTXD");
    assert_eq!(packets.len(), 1);
    assert!(ShipState::parse_authentic(&payload(&packets[0].1), &key).is_ok());
}

/// Each mistake is named within a few seconds, and no cycle is ever begun.
#[test]
fn what_is_wrong_is_named_before_anything_is_sent() {
    type HoldCase = (fn(&mut Sea), &'static str, &'static str);
    let cases: [HoldCase; 8] = [
        (|sea| sea.gnss = false, "gnss_silent", "GNSS port: nothing arrives"),
        (|sea| sea.garble = true, "gnss_noise", "baud rate"),
        (|sea| sea.pulse = "NONE", "no_pulse", "no external pulse per second"),
        (|sea| sea.ahead_s = 3, "clock_differs", "3 s ahead of GNSS"),
        (|sea| sea.ahead_s = -7, "clock_differs", "-7 s ahead of GNSS"),
        (|sea| sea.answers = false, "modem_silent", "modem port: nothing arrives"),
        (
            |sea| sea.topside = Topside::new(Config { ship_sigma_max_m: 0.1, ..Config::reference() }).unwrap(),
            "ship_uncertain",
            "waiting for GNSS",
        ),
        (
            |sea| {
                sea.clock = "RTC";
                sea.topside = Topside::new(Config { set_modem_clock: false, ..Config::reference() }).unwrap();
            },
            "modem_clock_unset",
            "its clock is not set",
        ),
    ];
    for (break_it, name, words) in cases {
        let mut sea = Sea::new(Config::reference());
        break_it(&mut sea);
        sea.run(65.0);
        let hold = sea.held().unwrap_or_else(|| panic!("{name}"));
        assert!(hold.name() == name && hold.to_string().contains(words), "{name}: {hold}");
        assert!(sea.sentences("$CCCYC").is_empty() && sea.sentences("$CCTXD").is_empty(), "{name}");
    }
}

#[test]
fn swapped_ports_and_a_receiver_without_rmc_are_named() {
    let hold = |gnss: &[u8], modem: &[u8]| {
        let mut topside = Topside::new(Config::reference()).unwrap();
        for step in 0..200_u64 {
            topside.receive(Port::Gnss, START_US + step * 100_000, gnss);
            topside.receive(Port::Modem, START_US + step * 100_000, modem);
            topside.step(START_US + step * 100_000);
        }
        topside.hold().unwrap()
    };
    let gga = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n";
    let dqf = b"$CADQF,234,1*55\r\n";
    assert_eq!(hold(dqf, gga), Hold::GnssIsModem);
    assert_eq!(hold(gga, gga), Hold::ModemIsGnss);
    assert_eq!(hold(gga, dqf), Hold::GnssNoRmc);
}

#[test]
fn a_modem_that_nobody_set_is_set_from_gnss() {
    let mut sea = Sea::new(Config::reference());
    (sea.clock, sea.ahead_s) = ("RTC", -100_000);
    sea.run(35.0);
    assert_eq!(sea.sentences("$CCTMS").len(), 1);
    assert_eq!((sea.ahead_s, sea.sentences("$CCTXD").len()), (0, 1));
}

#[test]
fn a_lost_pulse_stops_one_way_ranges_and_a_restarted_modem_is_set_up_again() {
    let mut sea = Sea::new(Config::reference());
    sea.run(40.0);
    assert_eq!(sea.sentences("$CCTXD").len(), 1);
    sea.pulse = "NONE";
    sea.run(60.0);
    assert_eq!((sea.sentences("$CCTXD").len(), sea.held()), (1, Some(&Hold::NoPulse)));
    sea.pulse = "EXT_SYNC";
    sea.run(30.0);
    assert_eq!((sea.sentences("$CCTXD").len(), sea.held()), (2, None));
    let before = sea.sentences("$CCCFG").len();
    let time = TimeOfDay::from_us(sea.utc_us());
    sea.say(&FromModem::Revision(Revision { time, identifier: "INIT", version: "2.0.35490" }));
    sea.run(30.0);
    assert_eq!((sea.sentences("$CCCFG").len() - before, sea.sentences("$CCTXD").len()), (6, 3));
    assert!(sea.events.contains(&Event::ModemRestarted));
}

#[test]
fn an_outage_of_gnss_is_bridged_and_then_stops_the_packets() {
    let mut sea = Sea::new(Config::reference());
    sea.run(65.0);
    assert_eq!(sea.sentences("$CCTXD").len(), 2);
    sea.gnss = false;
    sea.run(60.0);
    // a silent receiver is announced, and nothing more is sent
    assert_eq!((sea.sentences("$CCTXD").len(), sea.held()), (2, Some(&Hold::GnssSilent)));
    sea.gnss = true;
    sea.run(60.0);
    assert_eq!((sea.sentences("$CCTXD").len() > 2, sea.held()), (true, None));
}

#[test]
fn a_packet_off_the_pulse_stops_those_after_it() {
    let mut sea = Sea::new(Config::reference());
    sea.late_us = 340_000;
    sea.run(85.0);
    assert_eq!(sea.sentences("$CCTXD").len(), 1);
    assert!(matches!(sea.held(), Some(Hold::OffPulse { by_s }) if (by_s - 0.34).abs() < 1e-6), "{:?}", sea.held());
    sea.late_us = 0;
    sea.run(40.0);
    assert_eq!(sea.sentences("$CCTXD").len(), 2);
}

#[test]
fn an_uplink_and_its_range_make_a_track_and_a_ping_renews_it() {
    let slots = [
        Slot { offset_s: 0, exchange: Exchange::Uplink { vehicle: 2 } },
        Slot { offset_s: 8, exchange: Exchange::Ping { vehicle: 2 } },
    ];
    let key = Key::new([1; 16]);
    let slots = SlotTable::new(30, &slots, Airtime::REFERENCE).unwrap();
    let mut sea = Sea::new(Config { slots, key, origin_deg: Some([41.5, -70.7]), ..Config::reference() });
    sea.run(64.0);
    // The ship stands at 120 m north at 60 s; the vehicle 500 m north of the origin at 30 m depth.
    let north_deg = 41.5 + 500.0 / 1851.2 / 60.0;
    let mut state = VehicleState {
        source: 2,
        transmit_s: (NOON_S + 60) as u32,
        position_deg: [north_deg, -70.7],
        velocity_mps: [1.0, 0.0],
        depth_m: 30.0,
        position_sigma_m: 5.0,
        ellipse: backseat_wire::ellipse::Ellipse::CIRCLE,
        leans: true,
        velocity_sigma_mps: 0.1,
        heading_rad: 0.0,
        level_m: [Some(20.0), Some(1.0)],
        mode: 3,
        synchronous: true,
        named: Named { cause: 2, rival: 6, is_sure: true, size: [23, 0], ..Named::NOTHING },
    };
    let addresses = Addresses { source: 2, destination: 1 };
    let send = |sea: &mut Sea, state: &VehicleState, key: &Key, flight_us: u64, clock: ClockMode| {
        let mut buffer = [0; AUTHENTIC_LENGTH];
        let frame = state.emit(key, &mut buffer).unwrap().to_vec();
        sea.say(&FromModem::Received(Received {
            addresses,
            acknowledge: false,
            frame: 1,
            payload: Payload::new(&frame),
        }));
        let arrival = DateTime::from_unix_us(u64::from(state.transmit_s) * SECOND_US + flight_us).unwrap();
        let statistics = ReceptionStatistics::complete(Some(8), 0, ModemTime::Full(arrival), clock);
        sea.say(&FromModem::Statistics(statistics));
    };
    // a range that is 4 m longer than the report, of sqrt(380^2 + 30^2) m at 1500 m/s; the ship is 0.5 m further at its
    // arrival
    let flight_us = ((379.5_f64.hypot(30.0) + 4.0) / 1500.0 * 1e6) as u64;
    let synchronous = ClockMode(3 | 3 << 2);
    send(&mut sea, &state, &key, flight_us, synchronous);
    sea.run(1.0);
    let range_m = sea.events.iter().find_map(|event| match event {
        Event::Uplink { range_m, .. } => *range_m,
        _ => None,
    });
    assert!((range_m.unwrap() - 379.5_f64.hypot(30.0) - 4.0).abs() < 0.01, "{range_m:?}");
    let track = &sea.topside.tracks()[0];
    let estimate = track.at((NOON_S + 60) * SECOND_US).unwrap();
    // 5 m against 1 m and the ship's 0.2 m: nearly all of the 4 m is taken up
    assert!((estimate.position_m[0] - 503.8).abs() < 0.3, "{estimate:?}");
    // the ping at 68 s says what there would be by the report's speed
    let expected = 508.0 + 3.8 + 0.9 - 2.0 * 69.0;
    sea.run(3.5);
    assert_eq!(sea.sentences("$CCMPC,1,2").len(), 3, "at 8, 38 and 68 s");
    let travel_s = Decimal::from_f64(f64::hypot(expected, 30.0) / 1500.0, 4).unwrap();
    sea.say(&FromModem::PingReply(PingReply { addresses, travel_s: Some(travel_s) }));
    sea.run(0.2);
    let pinged = sea.events.iter().rev().find_map(|event| match event {
        Event::Range(ranging) if ranging.two_way => Some(*ranging),
        _ => None,
    });
    assert!(pinged.is_some_and(|ranging| ranging.fused && ranging.innovation_m.unwrap().abs() < 1.0), "{pinged:?}");
    // forged, of a stranger, and without a clock that is worth a range
    let count = |sea: &Sea, forged| {
        sea.events.iter().filter(|event| matches!(event, Event::Refused { forged: f, .. } if *f == forged)).count()
    };
    state.transmit_s += 30;
    send(&mut sea, &state, &Key::new([2; 16]), flight_us, synchronous);
    send(&mut sea, &VehicleState { source: 9, ..state }, &key, flight_us, synchronous);
    send(&mut sea, &VehicleState { synchronous: false, ..state }, &key, flight_us, synchronous);
    sea.run(1.0);
    assert_eq!((count(&sea, true), count(&sea, false)), (1, 1));
    assert!(matches!(sea.events.last(), Some(Event::Uplink { range_m: None, .. })), "{:?}", sea.events.last());
    // what the vehicle names is told once, and shown for as long as it is named
    let told: Vec<&Event> = sea.events.iter().filter(|event| matches!(event, Event::Named { .. })).collect();
    assert_eq!(told, [&Event::Named { vehicle: 2, named: state.named }]);
    let names: Vec<_> = sea.topside.tracks()[0].names().iter().collect();
    assert_eq!(names, [(state.named, state.transmit_s - 30)]);
}

#[test]
fn an_abort_is_refused_without_a_key_and_replaces_the_state_in_three_slots() {
    let key = Key::new([9; 16]);
    let mut sea = Sea::new(Config::reference());
    assert_eq!(sea.topside.abort(2), Err(AbortRefused::NoKey));
    let ping = [Slot { offset_s: 0, exchange: Exchange::Ping { vehicle: 2 } }];
    let slots = SlotTable::new(30, &ping, Airtime::REFERENCE).unwrap();
    let mut silent = Topside::new(Config { key, slots, ..Config::reference() }).unwrap();
    assert_eq!(silent.abort(2), Err(AbortRefused::NoDownlink));

    let mut sea = Sea::new(Config { key, ..Config::reference() });
    assert_eq!(sea.topside.abort(9), Err(AbortRefused::Stranger(9)));
    sea.run(35.0);
    assert_eq!(sea.topside.abort(2), Ok(()));
    // no pulse: no range leaves, but the abort does
    sea.pulse = "NONE";
    sea.run(90.0);
    sea.pulse = "EXT";
    sea.run(30.0);
    let packets: Vec<Vec<u8>> = sea.sentences("$CCTXD").iter().map(|(_, line)| payload(line)).collect();
    assert_eq!(packets.len(), 5);
    for (packet, at_s) in packets.iter().zip([30, 60, 90, 120, 150]) {
        let transmit_s = (NOON_S + at_s) as u32;
        let abort = Abort::parse_authentic(packet, &key);
        let state = ShipState::parse_authentic(packet, &key);
        if (60..=120).contains(&at_s) {
            assert_eq!((abort, state.is_err()), (Ok(Abort { destination: 2, transmit_s }), true), "{at_s}");
        } else {
            assert!(abort.is_err() && state.is_ok_and(|state| state.transmit_s == transmit_s), "{at_s}");
        }
    }
    let sent = sea.events.iter().filter(|event| matches!(event, Event::AbortSent { destination: 2, .. })).count();
    assert_eq!((sent, sea.topside.aborting()), (3, None));
}

/// The recorded minipacket of `firmware/wire/tests/vectors`: shown, and used for nothing.
#[test]
fn a_minipacket_is_shown_and_moves_no_track() {
    let mut sea = Sea::new(Config::reference());
    sea.run(5.0);
    let local_us = sea.local_us();
    sea.topside.receive(Port::Modem, local_us, b"$CAMUA,1,2,1fab*20\r\n");
    sea.events.clear();
    sea.run(1.0);
    assert!(sea.events.contains(&Event::Minipacket { source: 1, bits: 0x1fab }), "{:?}", sea.events);
    assert!(!sea.events.iter().any(|event| matches!(event, Event::Range(_) | Event::Refused { .. })));
}
