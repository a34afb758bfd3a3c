//! WHOI Micro-Modem 1 and 2.
//!
//! Layout from GobySoft goby3 `mm_driver`, pyacomms, ros_acomms messages and WHOI's libumutil (2009); WHOI's interface
//! guide is not public. `CC` goes to the modem, `CA` and `SN` come from it. The checksum is optional towards the modem.

mod configuration;
mod emit;
mod parse;
mod payload;
mod statistics;

pub use configuration::{Configuration, Wanted};
pub use payload::{Fragment, Payload};
pub use statistics::{ModemTime, ReceptionStatistics};

use crate::Decimal;
use crate::calendar::{DateTime, TimeOfDay};

/// Whether a positive Doppler speed of `$CADOP` and `$CACST` means that the range shrinks. No public source says:
/// calibrate on a known pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DopplerSign {
    /// Positive while closing.
    ClosingPositive,
    /// Positive while opening.
    OpeningPositive,
}

impl DopplerSign {
    /// Range rate (positive: opening) of a Doppler speed, m/s; and the reverse, being its own inverse.
    pub fn range_rate_mps(self, doppler_mps: f64) -> f64 {
        match self {
            Self::ClosingPositive => -doppler_mps,
            Self::OpeningPositive => doppler_mps,
        }
    }
}

/// How firmware encodes the clock mode of `$CACST` and `$CATOA`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockEncoding {
    /// 0 none, 1 clock, 2 pulse per second, 3 both.
    Legacy,
    /// Firmware 2.0.26038 and later: bits 0-1 clock source, bits 2-4 pulse source.
    BitField,
}

/// Clock mode as sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockMode(pub u8);

impl ClockMode {
    /// Whether clock and an external pulse are good, so that one-way travel times may be believed.
    pub const fn is_synchronous(self, encoding: ClockEncoding) -> bool {
        match encoding {
            ClockEncoding::Legacy => self.0 == 3,
            // User or GPS clock, EXT or EXT_SYNC pulse.
            ClockEncoding::BitField => self.0 & 0b11 >= 2 && matches!(self.0 >> 2 & 0b111, 3 | 4),
        }
    }
}

/// Frames per packet and bytes per frame of the data rates 0 to 6; rate 0 is FSK, the others PSK.
pub const RATES: [(u8, u16); 7] = [(1, 32), (3, 64), (3, 64), (2, 256), (2, 256), (8, 256), (6, 32)];

/// What the modem sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromModem<'a> {
    /// `$CACYC`: a cycle begins, here or heard from another modem.
    Cycle(Cycle),
    /// `$CADRQ`: give me a frame.
    DataRequest(DataRequest),
    /// `$CATXD`: the frame was taken.
    DataTaken(DataTaken),
    /// `$CATXP`: transmission begins.
    TransmitBegins {
        /// Bytes.
        bytes: u16,
    },
    /// `$CATXF`: transmission ended.
    TransmitEnded {
        /// Bytes.
        bytes: u16,
    },
    /// `$CARXP`: a packet begins to arrive.
    ReceiveBegins {
        /// PSK rather than FSK.
        psk: bool,
    },
    /// `$CARXD`: a frame was received.
    Received(Received<'a>),
    /// `$CAACK`: a frame was acknowledged.
    Acknowledged(Acknowledged),
    /// `$CADQF`: data quality factor, 0 to 255; FSK above 200 is healthy.
    DataQuality {
        /// Factor.
        quality: i16,
        /// Packet type as in `$CACST`.
        packet_type: i8,
    },
    /// `$CADOP`: relative speed, m/s; sign by [`DopplerSign`].
    Doppler(Decimal),
    /// `$CACST`: reception statistics, with the time of arrival.
    Statistics(ReceptionStatistics),
    /// `$CAXST`: transmit statistics, with the time of the transmission.
    TransmitStatistics(TransmitStatistics),
    /// `$CATOA`: time of arrival, ahead of its data.
    TimeOfArrival {
        /// Time.
        time: TimeOfDay,
        /// Clock mode.
        clock: ClockMode,
    },
    /// `$CAMSG`, such as `BAD_CRC`.
    Message {
        /// What.
        text: &'a str,
        /// Its number.
        number: i32,
    },
    /// `$CAERR`.
    Error(ErrorReport<'a>),
    /// `$CAMPC`: echo of a ping command.
    PingSent(Addresses),
    /// `$CAMPA`: a ping arrived.
    PingArrived(Addresses),
    /// `$CAMPR`: the reply to a ping.
    PingReply(PingReply),
    /// `$CACMR`: the reply to a Micro-Modem 2 ping.
    PingReply2(PingReply2),
    /// `$CACFG`: a setting as it now is.
    Setting(Setting<'a>),
    /// `$CACLK`: clock, no finer than the second.
    Clock(DateTime),
    /// `$CATMS`: answer to a time set.
    TimeSet {
        /// 0 good.
        status: u8,
        /// The time.
        time: DateTime,
    },
    /// `$CATMQ`: the time and its sources.
    TimeReport(TimeReport<'a>),
    /// `$CAREV`: revision, or `INIT` after a reboot.
    Revision(Revision<'a>),
    /// `$CAMUA`: user bits arrived.
    UserBits(UserBits),
    /// `$CATDP`: a flexible data packet was taken or refused.
    FlexibleTaken(FlexibleTaken),
    /// `$CARDP`: a flexible data packet arrived.
    FlexibleReceived(FlexibleReceived<'a>),
    /// `$SNTTA`: one-way travel times of up to four transponders, s.
    TravelTimes {
        /// Transponders A to D.
        travel_s: [Option<Decimal>; 4],
        /// When.
        time: TimeOfDay,
    },
}

/// What the host sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToModem<'a> {
    /// `$CCCYC`: begin a cycle.
    Cycle(Cycle),
    /// `$CCTXD`: a frame to send.
    Data(Data<'a>),
    /// `$CCMPC`: ping.
    Ping(Addresses),
    /// `$CCMUC`: send user bits.
    UserBits(UserBits),
    /// `$CCCFG`: configure.
    Configure(Setting<'a>),
    /// `$CCCFQ`: query a setting.
    Query {
        /// Its name.
        name: &'a str,
    },
    /// `$CCCLK`: set the clock to a whole second (sent 50 to 100 ms after the second before).
    SetClock(DateTime),
    /// `$CCTMS`: set the clock of a Micro-Modem 2.
    SetTime {
        /// To this, no finer than the second.
        time: DateTime,
        /// Mode, 0: at once.
        mode: u8,
    },
    /// `$CCTMQ`: ask for the clock.
    QueryTime,
    /// `$CCTDP`: send a flexible data packet.
    Flexible(Flexible<'a>),
    /// `$CCMSC,id,id,0`: reboot.
    Reboot {
        /// Own address.
        source: u8,
    },
}

/// Source and destination, 0 to 127.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Addresses {
    /// From.
    pub source: u8,
    /// To; 0 or 127 as the site broadcasts.
    pub destination: u8,
}

/// A data cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cycle {
    /// Who transmits data, and to whom.
    pub addresses: Addresses,
    /// Data rate, 0 to 6, see [`RATES`].
    pub rate: u8,
    /// Acknowledgement wanted (unused by most firmware).
    pub acknowledge: bool,
    /// Frames.
    pub frames: u8,
}

/// `$CADRQ`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataRequest {
    /// When the modem asked; with SNV 1 the packet leaves on the next pulse.
    pub time: TimeOfDay,
    /// From and to.
    pub addresses: Addresses,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
    /// Most bytes.
    pub bytes: u16,
    /// Frame, from 1.
    pub frame: u8,
}

/// `$CCTXD`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Data<'a> {
    /// From and to.
    pub addresses: Addresses,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
    /// The bytes, perhaps none.
    pub payload: Payload<'a>,
}

/// `$CATXD`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataTaken {
    /// From and to.
    pub addresses: Addresses,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
    /// Bytes taken.
    pub bytes: u16,
}

/// `$CARXD`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received<'a> {
    /// From and to.
    pub addresses: Addresses,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
    /// Frame, from 1.
    pub frame: u8,
    /// The bytes.
    pub payload: Payload<'a>,
}

/// `$CAACK`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acknowledged {
    /// From and to.
    pub addresses: Addresses,
    /// Frame, from 1.
    pub frame: u8,
    /// Acknowledgement.
    pub acknowledge: bool,
}

/// `$CAERR,time,module,number,text` or `$CAERR,time,DATA_TIMEOUT,frame`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorReport<'a> {
    /// When.
    pub time: TimeOfDay,
    /// Module, or `DATA_TIMEOUT`.
    pub module: &'a str,
    /// Number or frame.
    pub number: i32,
    /// Explanation, perhaps none.
    pub text: &'a str,
}

/// `$CAXST,version,date,time,clock,mode,…`; later fields are not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransmitStatistics {
    /// Leading version number, `None` in the oldest form.
    pub version: Option<u8>,
    /// When the transmission began.
    pub time: DateTime,
    /// Clock mode.
    pub clock: ClockMode,
    /// 0 good.
    pub mode: u8,
}

/// `$CAMPR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PingReply {
    /// From the replier to the requester.
    pub addresses: Addresses,
    /// One-way travel time of the round trip, s; `None` when missed.
    pub travel_s: Option<Decimal>,
}

/// `$CACMR,PNR,time,source,destination,travel,…`; later fields differ by firmware and are not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PingReply2 {
    /// When.
    pub time: DateTime,
    /// From and to.
    pub addresses: Addresses,
    /// One-way travel time, s; `None` when missed.
    pub travel_s: Option<Decimal>,
}

/// A name and its value, as text: most are integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting<'a> {
    /// `SNV`, `psk.packet.mod_hdr_version`.
    pub name: &'a str,
    /// Value.
    pub value: &'a str,
}

/// `$CATMQ`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeReport<'a> {
    /// The time.
    pub time: DateTime,
    /// `NONE`, `RTC`, `USER_CMD`, `GPS`.
    pub clock_source: &'a str,
    /// `NONE`, `RTC`, `EXT`, `EXT_SYNC`.
    pub pps_source: &'a str,
}

impl TimeReport<'_> {
    /// Whether the clock was set from outside and runs on an external pulse.
    pub fn is_synchronous(&self) -> bool {
        !matches!(self.clock_source, "NONE" | "RTC" | "") && matches!(self.pps_source, "EXT" | "EXT_SYNC")
    }
}

/// `$CAREV`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Revision<'a> {
    /// When.
    pub time: TimeOfDay,
    /// `AUV`, `COPROC`; `INIT` after a reboot: configure again.
    pub identifier: &'a str,
    /// Version.
    pub version: &'a str,
}

/// `$CCMUC`, `$CAMUA`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UserBits {
    /// From and to.
    pub addresses: Addresses,
    /// 13 bits.
    pub bits: u16,
}

/// `$CCTDP`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flexible<'a> {
    /// To.
    pub destination: u8,
    /// Data rate.
    pub rate: u8,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
    /// The bytes.
    pub payload: Payload<'a>,
}

/// `$CATDP`; later fields are not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlexibleTaken {
    /// 0 good.
    pub error: u8,
    /// Number of the packet.
    pub id: u32,
    /// To.
    pub destination: u8,
    /// Data rate.
    pub rate: u8,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
}

/// Most fragments of each kind that a flexible data packet may bring.
pub const MAX_FRAGMENTS: usize = 8;

/// `$CARDP`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlexibleReceived<'a> {
    /// From and to.
    pub addresses: Addresses,
    /// Data rate.
    pub rate: u8,
    /// Acknowledgement wanted.
    pub acknowledge: bool,
    /// Mini-packet fragments.
    pub mini: [Option<Fragment<'a>>; MAX_FRAGMENTS],
    /// Data fragments.
    pub data: [Option<Fragment<'a>>; MAX_FRAGMENTS],
}
