//! Decodes a session's bytes: raw samples as rows of a vehicle log, and the board's own records.
//!
//! The board's own links decode the devices, with the parameters in the log and every change of them over the host
//! link. The rows are raw samples at their arrival: the reader applies the installation ([`backseat_estimation::inputs`]). A
//! fix is stored at its own time, a range at its time of arrival.

use crate::monitor::words;
use backseat_app::inputs::installation::mounted;
use backseat_app::inputs::{
    AcousticReport, HeardShip, Packet, PacketProgress, Packets, SensorSample as Sample, Stamp, TURNAROUND_S,
};
use backseat_app::links::Links;
use backseat_app::parameters::{AppSettings, ParameterStore, Settings};
use backseat_app::{LocalFrame, UtcClock};
use backseat_core::dynamics::ActuatorInput;
use backseat_logs::session::{Entry, Event};
use backseat_logs::{Column, LogRow};
use backseat_wire::calendar::DAY_US;
use backseat_wire::hostlink::{
    Crash, Decoder, Estimates, FromBoard, FusionTelemetry, Identification, ImageId, Mode, ModeReason, Naming, Port,
    Restart, Steered, Telemetry, ToBoard,
};

/// A decoded record with its time by the log's clock.
pub struct Found<'a> {
    pub time_us: u64,
    pub what: What<'a>,
}

/// A decoded record.
pub enum What<'a> {
    /// Measurements, at the row's time.
    Measured(&'a LogRow),
    /// A fix of the vehicle's GPS, degrees.
    VehicleFix([f64; 2]),
    /// The ship's position as sent in a packet, degrees.
    ShipFix([f64; 2]),
    /// The board's record of a step.
    Telemetry(&'a Telemetry),
    /// A scalar fusion of the board.
    Fusion(&'a FusionTelemetry),
    /// Parameters that the board identified.
    Identification(&'a Identification),
    /// The estimates of its robust filter.
    Estimates(&'a Estimates),
    /// An event.
    Event(EventKind, String),
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    Start,
    Mode,
    Learnt,
    Fault,
    Naming,
    Helm,
    Recorder,
    Loss,
}

impl EventKind {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Mode => "mode",
            Self::Learnt => "learnt",
            Self::Fault => "fault",
            Self::Naming => "naming",
            Self::Helm => "helm",
            Self::Recorder => "recorder",
            Self::Loss => "loss",
        }
    }
}

/// Decodes a session, entry by entry.
pub struct Decoding {
    parameters: ParameterStore,
    /// The log has them.
    pub parameters_known: bool,
    links: Box<Links>,
    packets: Packets,
    /// When the vehicle's ping left, µs.
    ping_us: Option<u64>,
    /// When the ship was where the last row of its places has it, µs.
    ship_us: Option<u64>,
    clock: UtcClock,
    to_board: Decoder,
    from_board: Decoder,
    board: BoardRecords,
    /// Of the last start.
    image: Option<ImageId>,
    crashes: Crashes,
}

/// What the board has told of crashes: each comes again with each answer to `Hello`.
#[derive(Default)]
struct Crashes {
    told: Vec<Crash>,
    /// A board's own log, which has them besides.
    are_logged: bool,
}

impl Crashes {
    fn is_new(&mut self, crash: &Crash) -> bool {
        let is_new = !self.are_logged && !self.told.contains(crash);
        if is_new {
            self.told.push(*crash);
        }
        is_new
    }
}

/// The board's last records.
#[derive(Default)]
struct BoardRecords {
    mode: Option<(Mode, ModeReason)>,
    naming: Option<Naming>,
    steered: bool,
    input: Option<ActuatorInput>,
    /// Telemetry has the commands: the frontseat's echo is not needed.
    heard: bool,
}

impl Decoding {
    /// Before the first entry; UTC less the log's time may be known, until the board says better.
    pub fn new(utc_offset_us: Option<u64>) -> Self {
        let parameters = ParameterStore::new();
        let mut links = Box::new(Links::new());
        links.configure(&parameters.active().app);
        Self {
            parameters,
            parameters_known: false,
            links,
            packets: Packets::new(),
            ping_us: None,
            ship_us: None,
            clock: utc_offset_us.map_or(UtcClock::new(), |utc_us| UtcClock::synchronised(0, utc_us)),
            to_board: Decoder::new(),
            from_board: Decoder::new(),
            board: BoardRecords::default(),
            image: None,
            crashes: Crashes::default(),
        }
    }

    /// UTC at the log's time zero, µs, as far as the log has it.
    pub fn utc_offset_us(&self) -> Option<u64> {
        self.clock.utc_us(0)
    }

    /// The parameters in use, as far as the log has them.
    pub fn settings(&self) -> &Settings {
        self.parameters.active()
    }

    /// Takes in one entry of a log.
    pub fn take(&mut self, entry: &Entry, out: &mut dyn FnMut(Found<'_>)) {
        let time_us = entry.time_us;
        let mut say = |kind, text| out(Found { time_us, what: What::Event(kind, text) });
        match &entry.event {
            Event::Received { port: Port::Host, bytes } => self.request(bytes),
            Event::Received { port, bytes } => self.device(*port, time_us, bytes, out),
            Event::Sent { port: Port::Host, bytes } => self.board(time_us, bytes, out),
            Event::Sent { .. } | Event::Edge | Event::Fittings(_) | Event::Step { .. } => {}
            Event::Parameters(values) => {
                self.parameters_known = true;
                self.parameters.begin();
                for (name, value) in values {
                    // a value of another version's list is left at its default
                    let _ = self.parameters.set(name, *value, false);
                }
                self.commit();
            }
            Event::Oscillator(oscillator) => {
                say(EventKind::Recorder, format!("the board's clock counts: {oscillator:?}"))
            }
            Event::Start { firmware, image, restart, .. } => {
                self.crashes.are_logged = true;
                let other = self.image.replace(*image).filter(|before| before != image);
                let other = other.map_or(String::new(), |before| format!("; another image than before: {before}"));
                let crash = restart.crash.map_or(String::new(), |crash| format!("; before: {crash}"));
                let cause = restart.cause;
                say(EventKind::Start, format!("board started, firmware {firmware} ({image}), {cause:?}{crash}{other}"));
            }
            Event::Restart => say(EventKind::Start, "clock at zero".to_owned()),
            Event::Note(note) => say(EventKind::Recorder, note.clone()),
            Event::Lost(records) => say(EventKind::Loss, format!("{records} records are missing")),
        }
    }

    /// Parameters that the host sets.
    fn request(&mut self, mut bytes: &[u8]) {
        let mut decoder = std::mem::take(&mut self.to_board);
        while let Some(frame) = decoder.feed(&mut bytes) {
            match frame.and_then(|frame| frame.message::<ToBoard<'_>>()).and_then(ToBoard::unsigned) {
                Ok(ToBoard::ParameterBegin) => self.parameters.begin(),
                Ok(ToBoard::ParameterSet { name, value }) => {
                    // the board's own checks apply here as well
                    let _ = self.parameters.set(name, value, false);
                }
                Ok(ToBoard::ParameterCommit) => self.commit(),
                _ => {}
            }
        }
        self.to_board = decoder;
    }

    fn commit(&mut self) {
        let mut rebuilt = false;
        let taken = self.parameters.commit(false, |_, _, rebuild| {
            rebuilt = rebuild;
            true
        });
        if taken.is_ok() && rebuilt {
            self.links.configure(&self.parameters.active().app);
        }
    }

    fn device(&mut self, port: Port, time_us: u64, bytes: &[u8], out: &mut dyn FnMut(Found<'_>)) {
        let Self { parameters, links, packets, ping_us, ship_us, clock, board, .. } = self;
        let settings = &parameters.active().app;
        let mut samples = Vec::new();
        links.receive(port, time_us, bytes, settings, clock, |stamp, sample| samples.push((stamp, sample)));
        for (stamp, sample) in samples {
            if let Sample::Acoustic(report) = &sample {
                match *report {
                    AcousticReport::PingSent => *ping_us = Some(time_us),
                    AcousticReport::PingReply { travel_s: Some(travel_s) } => {
                        if let Some(ping_us) = ping_us.take() {
                            two_way_row(ping_us, travel_s, packets.heard_ship(), settings, out);
                        }
                    }
                    _ => {}
                }
                match follow(packets, report, time_us, clock, settings) {
                    PacketProgress::Complete(_, packet) => {
                        packet_rows(&packet, out);
                        *ship_us = packets.heard_ship().map(|heard| heard.time_us);
                    }
                    // a packet that gives no range says where the ship is all the same
                    PacketProgress::Lost => {
                        let unsaid = packets.heard_ship().filter(|heard| *ship_us != Some(heard.time_us));
                        if let Some(heard) = unsaid {
                            *ship_us = Some(heard.time_us);
                            let mut row = LogRow::new(heard.time_us);
                            measured(row.set_all(Column::ShipGpsX, &heard.report.position_m), out);
                        }
                    }
                    _ => {}
                }
                continue;
            }
            let row = row_of(stamp, &sample, settings);
            if let Sample::Fix { position_m } = sample {
                let (lat_deg, lon_deg) = frame(settings).to_geodetic(position_m);
                out(Found { time_us: row.time_us, what: What::VehicleFix([lat_deg, lon_deg]) });
            }
            measured(&row, out);
        }
        if port == Port::Frontseat
            && let Some((_, input)) = links.echo(settings)
            && !board.heard
            && board.input.replace(input) != Some(input)
        {
            measured(LogRow::new(time_us).set_actuators(&input), out);
        }
    }

    fn board(&mut self, time_us: u64, mut bytes: &[u8], out: &mut dyn FnMut(Found<'_>)) {
        let say = |out: &mut dyn FnMut(Found<'_>), kind, text| out(Found { time_us, what: What::Event(kind, text) });
        while let Some(frame) = self.from_board.feed(&mut bytes) {
            match frame.and_then(|frame| frame.message()) {
                Ok(FromBoard::Telemetry(telemetry)) => {
                    self.board.hear(time_us, &telemetry, out);
                    if telemetry.utc_us != 0 {
                        self.clock = UtcClock::synchronised(time_us, telemetry.utc_us);
                    }
                }
                Ok(FromBoard::Hello { firmware, image, .. }) if self.image.replace(image) != Some(image) => {
                    let firmware = backseat_link::printable(firmware);
                    say(out, EventKind::Start, format!("{firmware} ({image})"));
                }
                Ok(FromBoard::Restart(Restart { crash: Some(crash), .. })) if self.crashes.is_new(&crash) => {
                    say(out, EventKind::Start, format!("before its start: {crash}"));
                }
                Ok(FromBoard::EarlierCrash(crash)) if self.crashes.is_new(&crash.crash) => {
                    say(out, EventKind::Start, format!("an earlier crash: {crash}"));
                }
                Ok(FromBoard::Fusion(fusion)) => out(Found { time_us, what: What::Fusion(&fusion) }),
                Ok(FromBoard::Identification(record)) => out(Found { time_us, what: What::Identification(&record) }),
                Ok(FromBoard::Estimates(record)) => out(Found { time_us, what: What::Estimates(&record) }),
                Ok(FromBoard::LearntStored(stored)) => {
                    say(out, EventKind::Learnt, words::learnt(&stored).1.to_owned());
                }
                Ok(FromBoard::Naming(naming)) => {
                    if backseat_link::named::is_new(self.board.naming.as_ref(), &naming) {
                        say(out, EventKind::Naming, words::naming(&naming).1);
                    }
                    self.board.naming = Some(naming);
                }
                Ok(FromBoard::Steered(Steered { by_host, .. })) if self.board.steered != by_host.is_some() => {
                    self.board.steered = by_host.is_some();
                    say(out, EventKind::Helm, words::steered(by_host.as_ref()));
                }
                Ok(FromBoard::Fault(report)) => say(out, EventKind::Fault, words::fault(&report).1),
                _ => {}
            }
        }
    }
}

impl BoardRecords {
    fn hear(&mut self, time_us: u64, telemetry: &Telemetry, out: &mut dyn FnMut(Found<'_>)) {
        self.heard = true;
        let mode = (telemetry.mode, telemetry.reason);
        if self.mode.replace(mode) != Some(mode) {
            out(Found { time_us, what: What::Event(EventKind::Mode, format!("{:?} ({:?})", mode.0, mode.1)) });
        }
        let Telemetry { propeller_radps, fins_rad, .. } = *telemetry;
        let input = ActuatorInput { propeller_radps, fins_rad };
        if self.input.replace(input) != Some(input) {
            measured(LogRow::new(time_us).set_actuators(&input), out);
        }
        out(Found { time_us, what: What::Telemetry(telemetry) });
    }
}

/// A raw sample as a row. A fix that does not name its own time is placed by the delay of the receiver.
fn row_of(stamp: Stamp, sample: &Sample, settings: &AppSettings) -> LogRow {
    let time_us = match (stamp, sample) {
        (Stamp::Arrival(_), Sample::Fix { .. }) => mounted(stamp, *sample, &settings.installation).0,
        (Stamp::Arrival(time_us) | Stamp::Own(time_us), _) => time_us,
    };
    let mut row = LogRow::new(time_us);
    match sample {
        Sample::Depth { depth_m } => row.set(Column::Depth, *depth_m),
        Sample::Attitude { euler_rad } => row.set_all(Column::Roll, euler_rad),
        Sample::Rates { rates_radps } => row.set_all(Column::P, rates_radps),
        Sample::BottomTrack { velocity_mps } => row.set_all(Column::DvlU, velocity_mps),
        Sample::Fix { position_m } => row.set_all(Column::GpsX, position_m),
        // a vehicle log has no column for water track
        Sample::WaterTrack { .. } | Sample::Acoustic(_) => &mut row,
    };
    row
}

/// Takes a report of the modem. Without UTC the packet stands where the modem reported its start.
fn follow(
    packets: &mut Packets,
    report: &AcousticReport,
    time_us: u64,
    clock: &UtcClock,
    settings: &AppSettings,
) -> PacketProgress {
    if let (None, AcousticReport::Statistics { arrival, .. }, Some(start_us)) =
        (clock.utc_us(time_us), report, packets.began_us())
    {
        // of the modem's clock only the time of day counts
        let provisional = UtcClock::synchronised(start_us, arrival.unix_us(DAY_US));
        return packets.take(report, time_us, &provisional, settings);
    }
    packets.take(report, time_us, clock, settings)
}

/// The range at its time of arrival with the ship's position at the launch, the only ones that the vehicle's log has.
fn packet_rows(packet: &Packet, out: &mut dyn FnMut(Found<'_>)) {
    let toa_us = packet.start_us.saturating_add_signed(packet.bridge_us);
    let tol_us = toa_us.saturating_add_signed(-packet.flight_us);
    let position_m = packet.ship.position_m;
    let mut row = LogRow::new(toa_us);
    row.set(Column::Range, packet.range_m)
        .set(Column::RangeRate, packet.range_rate_mps.unwrap_or(f64::NAN))
        .set(Column::Tol, tol_us as f64 * 1e-6)
        .set(Column::Toa, toa_us as f64 * 1e-6)
        .set_all(Column::ShipX, &position_m);
    measured(&row, out);
    measured(LogRow::new(tol_us).set_all(Column::ShipGpsX, &position_m), out);
    out(Found { time_us: tol_us, what: What::ShipFix(packet.ship_deg) });
}

/// Half of a ping's round trip at the arrival of the answer, with the ship's place at its answer as its last packet and
/// its velocity have it.
fn two_way_row(
    ping_us: u64,
    travel_s: f64,
    ship: Option<&HeardShip>,
    settings: &AppSettings,
    out: &mut dyn FnMut(Found<'_>),
) {
    let installation = &settings.installation;
    let range_m = installation.sound_speed_mps * (travel_s - installation.transducer_delay_s);
    if !(0.0..=settings.range_max_m).contains(&range_m) {
        return;
    }
    let after_us = |seconds: f64| ping_us.saturating_add((seconds * 1e6) as u64);
    let (answer_us, arrival_us) = (after_us(travel_s + TURNAROUND_S), after_us(2.0 * travel_s + TURNAROUND_S));
    let mut row = LogRow::new(arrival_us);
    row.set(Column::TwoWayRange, range_m)
        .set(Column::Tol, ping_us as f64 * 1e-6)
        .set(Column::Toa, arrival_us as f64 * 1e-6);
    if let Some(ship) = ship.and_then(|ship| ship.moved_on(answer_us)) {
        row.set_all(Column::ShipX, &ship.position_m);
    }
    measured(&row, out);
}

fn measured(row: &LogRow, out: &mut dyn FnMut(Found<'_>)) {
    if !row.is_empty() {
        out(Found { time_us: row.time_us, what: What::Measured(row) });
    }
}

/// The local frame of these parameters.
pub fn frame(settings: &AppSettings) -> LocalFrame {
    LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg)
}
