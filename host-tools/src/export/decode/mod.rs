//! From a session's bytes to what they say: measurements as rows of a vehicle log, and the board's own records.
//!
//! The devices are decoded as the board is set to decode them: with the parameters that stand in the log, and every
//! change of them over the host link.

mod acoustics;
mod devices;

use acoustics::Acoustics;
use backseat_app::LocalFrame;
use backseat_app::parameters::{AppSettings, ParameterStore};
use backseat_core::dynamics::ActuatorInput;
use backseat_data::session::{Entry, Event};
use backseat_data::{Column, LogRow};
use backseat_wire::hostlink::{
    Adoption, Decoder, FromBoard, FusionTelemetry, Identification, Mode, ModeReason, Port, Telemetry, ToBoard,
};
use devices::{Ahrs, Dvl, Frontseat, FrontseatSaid, Modem};

/// A fix whose own time differs by more from when it came is placed by when it came, µs.
const FIX_AGE_US: u64 = 3_000_000;

/// What was found, and when by the log's clock.
pub struct Found<'a> {
    pub time_us: u64,
    pub what: What<'a>,
}

/// What was found.
pub enum What<'a> {
    /// Measurements, at the row's time.
    Measured(&'a LogRow),
    /// A fix of the vehicle's GPS, degrees.
    VehicleFix([f64; 2]),
    /// The ship as it said in a packet, degrees.
    ShipFix([f64; 2]),
    /// The board's record of a step.
    Telemetry(&'a Telemetry),
    /// A scalar fusion of the board.
    Fusion(&'a FusionTelemetry),
    /// What the board identified.
    Identification(&'a Identification),
    /// Something that happens now and then.
    Event(Kind, String),
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Start,
    Mode,
    Adoption,
    Recorder,
    Loss,
}

impl Kind {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Mode => "mode",
            Self::Adoption => "adoption",
            Self::Recorder => "recorder",
            Self::Loss => "loss",
        }
    }
}

/// Decodes a session, entry by entry.
pub struct Decoding {
    parameters: ParameterStore,
    /// The log told them.
    pub parameters_known: bool,
    frontseat: Frontseat,
    dvl: Dvl,
    ahrs: Ahrs,
    modem: Modem,
    acoustics: Acoustics,
    to_board: Decoder,
    from_board: Decoder,
    board: BoardSaid,
    /// UTC less the log's time, µs.
    utc_offset_us: Option<i64>,
}

/// What the board last said.
#[derive(Default)]
struct BoardSaid {
    mode: Option<(Mode, ModeReason)>,
    input: Option<ActuatorInput>,
    /// It has said what it commands: what the frontseat echoes is not needed.
    heard: bool,
}

impl Decoding {
    /// Before the first entry; UTC less the log's time may be known, until the board says better.
    pub fn new(utc_offset_us: Option<i64>) -> Self {
        let parameters = ParameterStore::new();
        let settings = &parameters.active().app;
        Self {
            dvl: Dvl::new(settings),
            ahrs: Ahrs::new(),
            frontseat: Frontseat::new(),
            modem: Modem::new(),
            acoustics: Acoustics::default(),
            to_board: Decoder::new(),
            from_board: Decoder::new(),
            board: BoardSaid::default(),
            parameters,
            parameters_known: false,
            utc_offset_us,
        }
    }

    /// UTC less the log's time, µs, as far as the log has told.
    pub const fn utc_offset_us(&self) -> Option<i64> {
        self.utc_offset_us
    }

    /// Origin of the local frame.
    pub fn frame(&self) -> LocalFrame {
        frame(&self.parameters.active().app)
    }

    /// Takes in one entry of a log.
    pub fn take(&mut self, entry: &Entry, out: &mut dyn FnMut(Found<'_>)) {
        let time_us = entry.time_us;
        let mut say = |kind, text| out(Found { time_us, what: What::Event(kind, text) });
        match &entry.event {
            Event::Received { port: Port::Host, bytes } => self.request(bytes),
            Event::Received { port, bytes } => self.device(*port, time_us, bytes, out),
            Event::Sent { port: Port::Host, bytes } => self.board(time_us, bytes, out),
            Event::Sent { .. } | Event::Edge | Event::Step { .. } => {}
            Event::Parameters(values) => {
                self.parameters_known = true;
                self.parameters.begin();
                for (name, value) in values {
                    // a value of another version's list is left at its default
                    let _ = self.parameters.set(name, *value, false);
                }
                self.commit();
            }
            Event::Oscillator(oscillator) => say(Kind::Recorder, format!("the board's clock counts: {oscillator:?}")),
            Event::Start { firmware, restart, .. } => {
                say(Kind::Start, format!("board started, firmware {firmware}, {:?}", restart.cause));
            }
            Event::Restart => say(Kind::Start, "clock at zero".to_owned()),
            Event::Note(note) => say(Kind::Recorder, note.clone()),
            Event::Lost(records) => say(Kind::Loss, format!("{records} records are missing")),
        }
    }

    /// Parameters that the host sets.
    fn request(&mut self, mut bytes: &[u8]) {
        let mut decoder = std::mem::take(&mut self.to_board);
        while let Some(frame) = decoder.feed(&mut bytes) {
            match frame.and_then(|frame| frame.message()) {
                Ok(ToBoard::ParameterBegin) => self.parameters.begin(),
                Ok(ToBoard::ParameterSet { name, value }) => {
                    // what the board refuses is refused here as well
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
        let taken = self.parameters.commit(|_, _, rebuild| {
            rebuilt = rebuild;
            true
        });
        if taken.is_ok() && rebuilt {
            self.dvl = Dvl::new(&self.parameters.active().app);
            self.ahrs = Ahrs::new();
        }
    }

    fn device(&mut self, port: Port, time_us: u64, bytes: &[u8], out: &mut dyn FnMut(Found<'_>)) {
        let Self { parameters, frontseat, dvl, ahrs, modem, acoustics, board, utc_offset_us, .. } = self;
        let settings = &parameters.active().app;
        match port {
            Port::Dvl => dvl.receive(time_us, bytes, settings, |row| measured(&row, out)),
            Port::Ahrs => ahrs.receive(time_us, bytes, settings, |row| measured(&row, out)),
            Port::Frontseat => frontseat.receive(time_us, bytes, settings, |said| match said {
                FrontseatSaid::Row(row) => measured(&row, out),
                FrontseatSaid::Echo(input) if !board.heard && board.input != Some(input) => {
                    board.input = Some(input);
                    measured(LogRow::new(time_us).set_actuators(&input), out);
                }
                FrontseatSaid::Echo(_) => {}
                FrontseatSaid::Fix { utc_us, position_deg } => {
                    let own_us = utc_offset_us.and_then(|offset_us| utc_us.checked_add_signed(-offset_us));
                    let delayed_us = devices::valid_us(time_us, settings.installation.gnss_delay_s);
                    let time_us = own_us.filter(|us| us.abs_diff(time_us) <= FIX_AGE_US).unwrap_or(delayed_us);
                    let [lat_deg, lon_deg] = position_deg;
                    let position_m = frame(settings).to_local(lat_deg, lon_deg);
                    measured(LogRow::new(time_us).set_all(Column::GpsX, &position_m), out);
                    out(Found { time_us, what: What::VehicleFix(position_deg) });
                }
            }),
            Port::Modem => modem.receive(bytes, settings, |said| {
                let Some(packet) = acoustics.take(&said, time_us, *utc_offset_us, settings) else { return };
                measured(&packet.row, out);
                measured(&packet.ship, out);
                out(Found { time_us: packet.launch_us, what: What::ShipFix(packet.ship_deg) });
            }),
            Port::Host => {}
        }
    }

    fn board(&mut self, time_us: u64, mut bytes: &[u8], out: &mut dyn FnMut(Found<'_>)) {
        while let Some(frame) = self.from_board.feed(&mut bytes) {
            match frame.and_then(|frame| frame.message()) {
                Ok(FromBoard::Telemetry(telemetry)) => {
                    self.board.hear(time_us, &telemetry, out);
                    if telemetry.utc_us != 0 {
                        self.utc_offset_us = telemetry.utc_us.checked_signed_diff(time_us);
                    }
                }
                Ok(FromBoard::Fusion(fusion)) => out(Found { time_us, what: What::Fusion(&fusion) }),
                Ok(FromBoard::Identification(record)) => out(Found { time_us, what: What::Identification(&record) }),
                Ok(FromBoard::Adoption(verdict)) => {
                    out(Found { time_us, what: What::Event(Kind::Adoption, adoption(&verdict)) });
                }
                _ => {}
            }
        }
    }
}

impl BoardSaid {
    fn hear(&mut self, time_us: u64, telemetry: &Telemetry, out: &mut dyn FnMut(Found<'_>)) {
        self.heard = true;
        let mode = (telemetry.mode, telemetry.reason);
        if self.mode.replace(mode) != Some(mode) {
            out(Found { time_us, what: What::Event(Kind::Mode, format!("{:?} ({:?})", mode.0, mode.1)) });
        }
        let Telemetry { propeller_radps, fins_rad, .. } = *telemetry;
        let input = ActuatorInput { propeller_radps, fins_rad };
        if self.input.replace(input) != Some(input) {
            measured(LogRow::new(time_us).set_actuators(&input), out);
        }
        out(Found { time_us, what: What::Telemetry(telemetry) });
    }
}

fn measured(row: &LogRow, out: &mut dyn FnMut(Found<'_>)) {
    if !row.is_empty() {
        out(Found { time_us: row.time_us, what: What::Measured(row) });
    }
}

fn frame(settings: &AppSettings) -> LocalFrame {
    LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg)
}

fn adoption(verdict: &Adoption) -> String {
    let Adoption { event, stretches, error_active, error_other, .. } = verdict;
    format!(
        "{event:?}: error {error_active:.3} of the set in use, {error_other:.3} of the other, {stretches} stretches"
    )
}
