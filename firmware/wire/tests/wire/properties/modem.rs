//! The modem's sentences: integers, decimals, times and bytes, so that everything comes back as it was.

use super::generate::{addresses, decimal, instant, second_of_day, text, time_of_day};
use backseat_wire::calendar::DateTime;
use backseat_wire::modem::{
    Acknowledged, Addresses, ClockMode, Cycle, Data, DataRequest, DataTaken, ErrorReport, Flexible, FlexibleReceived,
    FlexibleTaken, Fragment, FromModem, MAX_FRAGMENTS, ModemTime, Payload, PingReply, PingReply2, Received,
    ReceptionStatistics, Revision, Setting, TimeReport, ToModem, UserBits,
};
use backseat_wire::nmea::{Checksum, Sentence};
use backseat_wire::{Decimal, calendar::TimeOfDay};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

fn sentence(bytes: &[u8]) -> Sentence<'_> {
    Sentence::from_line(bytes.strip_suffix(b"\r\n").unwrap(), Checksum::Required).unwrap()
}

/// What the messages are made of.
#[derive(Clone, Debug)]
struct Parts {
    addresses: Addresses,
    time: TimeOfDay,
    instant: DateTime,
    travel_s: Option<Decimal>,
    decimal: Decimal,
    flag: bool,
    rate: u8,
    numbers: [u8; 3],
    wide: (u16, u32, i16, i32),
    texts: [String; 2],
    bytes: Vec<u8>,
}

fn parts() -> impl Strategy<Value = Parts> {
    let travel = (0..700_000_000_i64).prop_map(|us| Decimal::new(us, 6));
    let times = (addresses(), second_of_day(), instant(1_000_000), option::of(travel), decimal(999_999, 4));
    let rest = (any::<(bool, [u8; 3], (u16, u32, i16, i32))>(), 0..7_u8, [text(), text()], vec(any::<u8>(), 0..64));
    (times, rest).prop_map(
        |((addresses, time, instant, travel_s, decimal), ((flag, numbers, wide), rate, texts, bytes))| Parts {
            addresses,
            time,
            instant,
            travel_s,
            decimal,
            flag,
            rate,
            numbers,
            wide,
            texts,
            bytes,
        },
    )
}

impl Parts {
    fn cycle(&self) -> Cycle {
        Cycle { addresses: self.addresses, rate: self.rate, acknowledge: self.flag, frames: self.numbers[0] }
    }

    fn user_bits(&self) -> UserBits {
        UserBits { addresses: self.addresses, bits: self.wide.0 & 0x1FFF }
    }

    fn setting(&self) -> Setting<'_> {
        Setting { name: &self.texts[0], value: &self.texts[1] }
    }

    fn fragments(&self) -> [Option<Fragment<'_>>; MAX_FRAGMENTS] {
        let mut fragments = [None; MAX_FRAGMENTS];
        for (slot, bytes) in fragments.iter_mut().zip(self.bytes.chunks(9)) {
            *slot = Some(Fragment { good: self.flag, payload: Payload::new(bytes) });
        }
        fragments
    }

    fn of_modem(&self, kind: usize) -> FromModem<'_> {
        let Self { addresses, time, instant, travel_s, flag, rate, .. } = *self;
        let [a, b, _] = self.numbers;
        let (bytes, id, quality, number) = self.wide;
        let (acknowledge, payload) = (flag, Payload::new(&self.bytes));
        match kind {
            0 => FromModem::Cycle(self.cycle()),
            1 => FromModem::DataRequest(DataRequest { time, addresses, acknowledge, bytes, frame: a }),
            2 => FromModem::DataTaken(DataTaken { addresses, acknowledge, bytes }),
            3 => FromModem::TransmitBegins { bytes },
            4 => FromModem::TransmitEnded { bytes },
            5 => FromModem::ReceiveBegins { psk: flag },
            6 => FromModem::Received(Received { addresses, acknowledge, frame: a, payload }),
            7 => FromModem::Acknowledged(Acknowledged { addresses, frame: a, acknowledge }),
            8 => FromModem::DataQuality { quality, packet_type: b as i8 },
            9 => FromModem::Doppler(self.decimal),
            10 => FromModem::Message { text: &self.texts[0], number },
            11 => FromModem::Error(ErrorReport { time, module: &self.texts[0], number, text: &self.texts[1] }),
            12 => FromModem::PingSent(addresses),
            13 => FromModem::PingArrived(addresses),
            14 => FromModem::PingReply(PingReply { addresses, travel_s }),
            15 => FromModem::PingReply2(PingReply2 { time: instant, addresses, travel_s }),
            16 => FromModem::Setting(self.setting()),
            17 => FromModem::Clock(instant),
            18 => FromModem::TimeSet { status: a, time: instant },
            19 => FromModem::TimeReport(TimeReport {
                time: instant,
                clock_source: &self.texts[0],
                pps_source: &self.texts[1],
            }),
            20 => FromModem::Revision(Revision { time, identifier: &self.texts[0], version: &self.texts[1] }),
            21 => FromModem::UserBits(self.user_bits()),
            22 => FromModem::FlexibleTaken(FlexibleTaken { error: a, id, destination: b, rate, acknowledge }),
            23 => {
                let fragments = self.fragments();
                FromModem::FlexibleReceived(FlexibleReceived {
                    addresses,
                    rate,
                    acknowledge,
                    mini: fragments,
                    data: fragments,
                })
            }
            _ => FromModem::TravelTimes { travel_s: [travel_s, None, travel_s, None], time },
        }
    }

    fn of_host(&self, kind: usize) -> ToModem<'_> {
        let Self { addresses, instant, flag: acknowledge, rate, .. } = *self;
        let [a, b, _] = self.numbers;
        let payload = Payload::new(&self.bytes);
        match kind {
            0 => ToModem::Cycle(self.cycle()),
            1 => ToModem::Data(Data { addresses, acknowledge, payload }),
            2 => ToModem::Ping(addresses),
            3 => ToModem::UserBits(self.user_bits()),
            4 => ToModem::Configure(self.setting()),
            5 => ToModem::Query { name: &self.texts[0] },
            6 => ToModem::SetClock(instant),
            7 => ToModem::SetTime { time: instant, mode: a },
            8 => ToModem::QueryTime,
            9 => ToModem::Flexible(Flexible { destination: b, rate, acknowledge, payload }),
            _ => ToModem::Reboot { source: a },
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn from_modem(parts in parts(), kind in 0..25_usize) {
        let x = parts.of_modem(kind);
        let mut buffer = [0; 2048];
        prop_assert_eq!(FromModem::parse(&sentence(x.emit(&mut buffer).unwrap())), Ok(x));
    }

    #[test]
    fn to_modem(parts in parts(), kind in 0..11_usize) {
        let x = parts.of_host(kind);
        let mut buffer = [0; 2048];
        prop_assert_eq!(ToModem::parse(&sentence(x.emit(&mut buffer).unwrap())), Ok(x));
    }

    /// Written up to the first value that is missing.
    #[test]
    fn statistics(
        (version, mode) in (option::of(6..=9_u8), 0..=2_u8),
        (of_day, full) in (time_of_day(100), instant(1)),
        clock in 0..=31_u8,
        integers in vec(-9999..=99_999_i32, 23),
        decimals in vec(decimal(9999, 2), 6),
        length in 0..=26_usize,
    ) {
        let arrival = if version.is_some() { ModemTime::Full(full) } else { ModemTime::OfDay(of_day) };
        let mut x = ReceptionStatistics::new(version, mode, arrival, ClockMode(clock));
        let (mut integers, mut decimals, mut left) = (integers.into_iter(), decimals.into_iter(), length);
        let mut present = || {
            let is = left > 0;
            left = left.saturating_sub(1);
            is
        };
        for slot in x.detector.iter_mut().chain([&mut x.spl_db, &mut x.gain]).chain(&mut x.shifts).chain([
            &mut x.rate, &mut x.source, &mut x.destination, &mut x.psk_error, &mut x.packet_type, &mut x.frames, &mut x.bad_frames,
        ]) {
            *slot = integers.next().filter(|_| present());
        }
        for slot in [&mut x.rss_db].into_iter().chain(&mut x.snr_db).chain([&mut x.mse_db]) {
            *slot = decimals.next().filter(|_| present());
        }
        x.quality = integers.next().filter(|_| present());
        x.doppler_mps = decimals.next().filter(|_| present());
        for slot in [&mut x.noise_db, &mut x.carrier_hz, &mut x.bandwidth_hz] {
            *slot = integers.next().filter(|_| present());
        }
        let x = FromModem::Statistics(x);
        let mut buffer = [0; 2048];
        prop_assert_eq!(FromModem::parse(&sentence(x.emit(&mut buffer).unwrap())), Ok(x));
    }
}
