//! The board over its host port, as the commands need it.

mod declared;
mod refusal;
mod update;

pub use crate::port_name::PortName;
pub use declared::{Declared, Effect, number};
pub use refusal::{mode_reason, reason};

use crate::{BackseatError, Client, Serial, printable};
use anyhow::{Context, anyhow, bail};
use backseat_core::control::mission::MAX_WAYPOINTS;
use backseat_core::parameters::Inconsistent;
use backseat_report::console::Progress;
use backseat_wire::hostlink::{
    FromBoard, Health, ImageId, KeptCrash, MAX_FENCE_CORNERS, Refusal, Restart, Telemetry, ToBoard, Waypoint,
};
use backseat_wire::ship_state::Key;
use std::time::{Duration, Instant, SystemTime};

/// More parameters than any list will have: a device that claims more is no board, and would keep us for ever.
const MAX_PARAMETERS: usize = 4096;
/// Asking for this waypoint and those after it is only a way to be answered.
const FIRST_NONCE: u16 = 0x8000;
const _: () = assert!(MAX_WAYPOINTS < FIRST_NONCE as usize);

/// Who answers.
#[derive(Clone, Debug)]
pub struct Identity {
    /// Version of its firmware.
    pub firmware: String,
    /// Version of its parameter list.
    pub schema: u16,
    /// Which image it runs.
    pub image: ImageId,
    /// Its last start, if it knows.
    pub restart: Option<Restart>,
    /// Crashes before it that no card has got, the oldest first.
    pub earlier_crashes: Vec<KeptCrash>,
}

/// A board that answers.
pub struct Board {
    client: Client<Serial>,
    port: PortName,
    /// Who answered.
    pub identity: Identity,
}

/// A parameter that the board refused to take.
struct Refused {
    name: String,
    value: f64,
    refusal: Refusal,
}

impl Board {
    /// Opens the port and waits until what comes in is the answer to what was asked: whatever an earlier program
    /// left unread on the line comes before it. What changes a flight is signed by `key`.
    pub fn connect(port: &PortName, key: Key) -> anyhow::Result<Self> {
        let mut client = Client::new(Serial::host(port)?);
        client.sign_with(key);
        let moment = SystemTime::UNIX_EPOCH.elapsed().map_or(0, |elapsed| elapsed.subsec_micros() as u16);
        let nonce = FIRST_NONCE | moment;
        let mut hello = None;
        let (mut restart, mut earlier_crashes) = (None, Vec::new());
        let answered = (|| {
            client.send(&ToBoard::Hello)?;
            client.send(&ToBoard::MissionGet { index: nonce })?;
            client.receive(|message| match message {
                FromBoard::Hello { firmware, parameter_schema, image } => {
                    hello = Some((printable(firmware), parameter_schema, image));
                    None
                }
                FromBoard::Restart(last) => {
                    restart = Some(last);
                    // an answer that another program had asked for may come before
                    earlier_crashes.clear();
                    None
                }
                FromBoard::EarlierCrash(crash) => {
                    earlier_crashes.push(crash);
                    None
                }
                FromBoard::Mission { index, .. } => (index == nonce).then_some(()),
                _ => None,
            })
        })();
        answered.map_err(|error| match error {
            BackseatError::Silent { .. } => anyhow!("{port}: no data received; check cable, power and baud rate"),
            BackseatError::Unanswered { .. } => anyhow!("{port}: data received, but not from a backseat's host port"),
            error => anyhow!("{port}: {error}"),
        })?;
        let (firmware, schema, image) =
            hello.with_context(|| format!("{port}: the board answers, but does not identify itself"))?;
        Ok(Self {
            client,
            port: port.clone(),
            identity: Identity { firmware, schema, image, restart, earlier_crashes },
        })
    }

    fn failed(&self, error: &BackseatError) -> anyhow::Error {
        match error {
            BackseatError::Refused { request, refusal } => anyhow!("the board refused {request}: {}", reason(*refusal)),
            BackseatError::Silent { seconds, .. } | BackseatError::Unanswered { seconds } => {
                anyhow!("{}: the board no longer answers (waited {seconds} s)", self.port)
            }
            error => anyhow!("{}: connection lost ({error})", self.port),
        }
    }

    /// Sends a request that is carried out or refused.
    fn request(&mut self, message: &ToBoard<'_>) -> anyhow::Result<Result<(), Refusal>> {
        match self.client.request(message, String::new) {
            Ok(()) => Ok(Ok(())),
            Err(BackseatError::Refused { refusal, .. }) => Ok(Err(refusal)),
            Err(error) => Err(self.failed(&error)),
        }
    }

    /// The same; a refusal is an error that names `what`.
    fn demand(&mut self, message: &ToBoard<'_>, what: &str) -> anyhow::Result<()> {
        self.request(message)?.map_err(|refusal| anyhow!("the board refused {what}: {}", reason(refusal)))
    }

    fn ask<T>(&mut self, message: &ToBoard<'_>, take: impl FnMut(FromBoard<'_>) -> Option<T>) -> anyhow::Result<T> {
        let answer = self.client.send(message).and_then(|()| self.client.receive(take));
        answer.map_err(|error| self.failed(&error))
    }

    /// All parameters, in the board's order.
    pub fn parameters(&mut self) -> anyhow::Result<Vec<Declared>> {
        let mut progress = None;
        let mut parameters: Vec<Declared> = Vec::new();
        loop {
            let index = u16::try_from(parameters.len())?;
            let known_here = self.identity.schema == backseat_app::parameters::PARAMETER_SCHEMA;
            let (parameter, count) = self
                .ask(&ToBoard::ParameterGet { index }, |message| match message {
                    FromBoard::Parameter(info) if info.index == index => {
                        Some(Some((Declared::new(&info, known_here), usize::from(info.count))))
                    }
                    FromBoard::Refused(_) => Some(None),
                    _ => None,
                })?
                .with_context(|| format!("{}: the board does not describe its parameter {index}", self.port))?;
            if count > MAX_PARAMETERS {
                bail!("{}: it claims to have {count} parameters; no board has more than {MAX_PARAMETERS}", self.port);
            }
            parameters.push(parameter);
            progress.get_or_insert_with(|| Progress::new("parameters", count)).set(parameters.len());
            if parameters.len() >= count {
                return Ok(parameters);
            }
        }
    }

    /// Sets parameters as one transaction: all of them, or none; the error then names each refused one with its range.
    ///
    /// Under way only if they are unlocked first.
    pub fn set_parameters(
        &mut self,
        values: &[(String, f64)],
        declared: &[Declared],
        unlock: bool,
    ) -> anyhow::Result<()> {
        let progress = Progress::new("parameters", values.len());
        let mut refused = Vec::new();
        if unlock {
            self.demand(&ToBoard::Unlock, "to unlock its parameters")?;
        }
        self.demand(&ToBoard::ParameterBegin, "to take parameters")?;
        for (done, (name, value)) in values.iter().enumerate() {
            progress.set(done);
            if let Err(refusal) = self.request(&ToBoard::ParameterSet { name, value: *value })? {
                refused.push(Refused { name: name.clone(), value: *value, refusal });
            }
        }
        drop(progress);
        if refused.is_empty() {
            let Err(refusal) = self.request(&ToBoard::ParameterCommit)? else { return Ok(()) };
            let value = |name: &str| {
                let new = values.iter().rev().find(|(of, _)| of == name).map(|(_, value)| *value);
                new.or_else(|| {
                    declared.iter().find(|parameter| parameter.name == name).map(|parameter| parameter.value)
                })
            };
            let why = match refusal {
                Refusal::Inconsistent { rule } => {
                    Inconsistent::of_rule(rule).map(|of| of.with_values(value).to_string())
                }
                _ => None,
            };
            bail!(
                "the board refused the set as a whole and keeps the old one: {}",
                why.unwrap_or_else(|| reason(refusal))
            );
        }
        let refused: Vec<String> = refused.iter().map(|refused| refused.describe(declared)).collect();
        bail!("the board refused these and keeps the old set: {}", refused.join("; "))
    }

    /// Sets the key of acoustic payloads and signed requests; none switches authentication off. What follows is signed
    /// by it.
    pub fn set_key(&mut self, key: Key) -> anyhow::Result<()> {
        let set = self.client.set_key(key);
        set.map_err(|error| self.failed(&error))?;
        self.client.sign_with(key);
        Ok(())
    }

    /// Whether there is a key.
    pub fn has_key(&mut self) -> anyhow::Result<bool> {
        let has = self.client.has_key();
        has.map_err(|error| self.failed(&error))
    }

    /// Has the active set written to the board's memory.
    pub fn store_parameters(&mut self) -> anyhow::Result<Result<(), Refusal>> {
        self.request(&ToBoard::ParameterStore)
    }

    /// The stored mission.
    pub fn mission(&mut self) -> anyhow::Result<Vec<Waypoint>> {
        let mut waypoints = Vec::new();
        loop {
            let wanted = u16::try_from(waypoints.len())?;
            let (waypoint, count) = self.ask(&ToBoard::MissionGet { index: wanted }, |message| match message {
                FromBoard::Mission { index, count, waypoint } if index == wanted => Some((waypoint, count)),
                _ => None,
            })?;
            let Some(waypoint) = waypoint else { return Ok(waypoints) };
            waypoints.push(waypoint);
            if wanted + 1 >= count {
                return Ok(waypoints);
            }
        }
    }

    /// The corners of the stored mission's fence, north and east, m; none without a polygon.
    pub fn fence(&mut self) -> anyhow::Result<Vec<[f64; 2]>> {
        let mut corners_m = Vec::new();
        loop {
            let wanted = u8::try_from(corners_m.len())?;
            let corner_m = self.ask(&ToBoard::FenceGet { index: wanted }, |message| match message {
                FromBoard::Fence { index, corner_m, .. } if index == wanted => Some(corner_m),
                _ => None,
            })?;
            let Some(corner_m) = corner_m else { return Ok(corners_m) };
            corners_m.push(corner_m);
        }
    }

    /// Replaces mission and fence, whole or not at all.
    pub fn set_mission(&mut self, waypoints: &[Waypoint], corners_m: &[[f64; 2]]) -> anyhow::Result<()> {
        let (count, corners) = (waypoints.len(), corners_m.len());
        let sent = self.client.set_fenced_mission(waypoints, corners_m);
        match sent {
            Err(BackseatError::Refused { .. }) if corners > MAX_FENCE_CORNERS => {
                bail!(
                    "a fence of {corners} corners; a board stores {MAX_FENCE_CORNERS} at most, and has no mission now"
                )
            }
            Err(BackseatError::Refused { .. }) if count > MAX_WAYPOINTS => {
                bail!("{count} waypoints; a board stores {MAX_WAYPOINTS} at most, and has no mission now")
            }
            Err(error @ BackseatError::Refused { refusal: Refusal::Unsigned | Refusal::Forged, .. }) => {
                Err(self.failed(&error))
            }
            Err(BackseatError::Refused { request, refusal }) => {
                bail!("the board refused {request}: {}; it has no mission now", reason(refusal))
            }
            sent => sent.map_err(|error| self.failed(&error)),
        }
    }

    /// Starts the mission.
    pub fn start_mission(&mut self) -> anyhow::Result<()> {
        match self.request(&ToBoard::MissionStart)? {
            Err(Refusal::Sequence) => bail!("the board refused to start: it has no mission (backseat mission put)"),
            Err(refusal) => bail!("the board refused to start: {}", reason(refusal)),
            Ok(()) => Ok(()),
        }
    }

    /// Neutral fins, propeller off, frontseat in charge.
    pub fn stop_mission(&mut self) -> anyhow::Result<()> {
        self.demand(&ToBoard::MissionStop, "to stop")
    }

    /// Has the vehicle hold a true heading, rad, a depth, m, and a speed through the water, m/s, instead of the leg that
    /// it flies, for two seconds.
    pub fn helm(&mut self, heading_rad: f64, depth_m: f64, speed_mps: f64) -> anyhow::Result<()> {
        match self.request(&ToBoard::Helm { heading_rad, depth_m, speed_mps })? {
            Err(Refusal::NotReady) => {
                bail!("the board refused to be steered: no leg of its mission is flown, or its mode is not nominal")
            }
            Err(refusal) => bail!("the board refused to be steered: {}", reason(refusal)),
            Ok(()) => Ok(()),
        }
    }

    /// The counters.
    pub fn health(&mut self) -> anyhow::Result<Health> {
        self.ask(&ToBoard::HealthGet, |message| match message {
            FromBoard::Health(counters) => Some(counters),
            _ => None,
        })
    }

    /// Moves the fins one after the other, with the propeller stopped.
    pub fn wiggle(&mut self) -> anyhow::Result<Result<(), Refusal>> {
        self.request(&ToBoard::FinWiggle)
    }

    /// Releases the drop weight, or lets its output rest again.
    pub fn drop_weight(&mut self, release: bool) -> anyhow::Result<Result<(), Refusal>> {
        self.request(&ToBoard::DropWeight { release })
    }

    /// The telemetry that comes in this time.
    pub fn listen(&mut self, time: Duration) -> anyhow::Result<Vec<Telemetry>> {
        let begun = Instant::now();
        let mut records = Vec::new();
        while begun.elapsed() < time {
            std::thread::sleep(Duration::from_millis(20));
            let outcome = self.client.drain(|message| {
                if let FromBoard::Telemetry(record) = message {
                    records.push(record);
                }
            });
            outcome.map_err(|error| self.failed(&error))?;
        }
        Ok(records)
    }
}

impl Refused {
    fn describe(&self, declared: &[Declared]) -> String {
        let Self { name, value, refusal } = self;
        let declared = declared.iter().find(|parameter| parameter.name == *name);
        match (refusal, declared) {
            (Refusal::OutOfRange, Some(parameter)) => format!("{name} = {value}: expected {}", parameter.admitted()),
            (Refusal::UnknownParameter, _) => format!("{name}: this board has no such parameter"),
            (Refusal::UnderWay, _) => format!("{name}: cannot change while a mission runs"),
            (refusal, _) => format!("{name} = {value}: {}", reason(*refusal)),
        }
    }
}
