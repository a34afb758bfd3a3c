//! The backseat app as a Linux process on pseudo-terminals or serial ports.
//!
//! [`run`] opens the five ports, and then pumps: it sleeps in the kernel until a port is ready or
//! the next step is due. There is no other thread and no busy waiting.

mod line;
mod port;
mod store;

pub use store::{FileError, FileFlash, SECTOR};

use anyhow::{Context, Result, anyhow, bail};
use backseat_app::parameters::Settings;
use backseat_app::store::ParameterFlash;
use backseat_app::{App, Progress, Pump};
use backseat_wire::hostlink::Port;
use line::PtyLine;
use mio::{Events, Poll, Token};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A serial port to open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortSettings {
    /// Device, e.g. `/dev/ttyUSB0` or `/dev/pts/3`.
    pub path: PathBuf,
    /// Baud rate; a pseudo-terminal ignores it.
    pub baud: u32,
}

/// The five ports of the backseat.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostPorts {
    /// In the order of [`Port::ALL`]: frontseat, DVL, AHRS, modem, host.
    pub ports: [PortSettings; 5],
    /// Where parameters are kept; none: they are not.
    pub store: Option<PathBuf>,
    /// [`App::set_challenge`]; 0 in a simulation, which is the same each time.
    pub challenge: u64,
}

/// How often the stop flag is looked at while nothing happens.
const STOP_INTERVAL: Duration = Duration::from_millis(100);
/// How long a mission that is handed back before the end has for it: two steps, and the line.
const LAST_WORDS: Duration = Duration::from_millis(500);

impl HostPorts {
    /// These devices, in the order of [`Port::ALL`], at [`Port::DEFAULT_BAUD`].
    #[must_use]
    pub fn new(paths: [PathBuf; 5]) -> Self {
        let mut baud = Port::DEFAULT_BAUD.into_iter();
        Self {
            ports: paths.map(|path| PortSettings { path, baud: baud.next().unwrap_or(115_200) }),
            store: None,
            challenge: 0,
        }
    }
}

/// Runs the backseat on these ports until `stop` is set (looked at every 0.1 s). Before it ends a mission under way is
/// handed back: neutral fins and stop.
///
/// On its own clock a port that vanishes is opened again, once a second; what it vanished and came back for is said on
/// standard error. A frontseat that was gone under way hears neutral and stop first.
///
/// # Errors
/// A port that cannot be opened at the start; one that vanishes under a simulator's clock; all of them gone; a store
/// that cannot be opened: one line that names it.
pub fn run(ports: &HostPorts, stop: &AtomicBool) -> Result<()> {
    let mut app = Box::new(App::new());
    app.set_challenge(ports.challenge);
    let mut store = ports.store.as_deref().map(|path| open_store(path, &mut app)).transpose()?;
    let mut poll = Poll::new().context("cannot poll")?;
    let mut lines = open(ports, &poll)?;
    let mut events = Events::with_capacity(16);
    let mut pump = Pump::new();
    let start = Instant::now();
    let mut ends = None;
    let mut owed = false;
    loop {
        if ends.is_none() && stop.load(Ordering::Relaxed) {
            if pump.is_lockstep() || app.lends_clock() {
                return Ok(());
            }
            app.hand_back();
            ends = Some(Instant::now() + LAST_WORDS);
        }
        if ends.is_some_and(|ends| Instant::now() >= ends) {
            return Ok(());
        }
        let Ok(progress) = pump.poll(&mut app, &mut lines, micros(start));
        keep(&mut app, store.as_mut());
        look_after(&mut lines, &mut app, &pump, &poll, &mut owed)?;
        let Progress::IdleUntil(until_us) = progress else { continue };
        let wait = until_us.map_or(STOP_INTERVAL, |us| Duration::from_micros(us.saturating_sub(micros(start))));
        // The kernel's timeout has milliseconds; rounded up by mio, so that a step is never polled for.
        match poll.poll(&mut events, Some(wait.min(STOP_INTERVAL))) {
            Err(error) if error.kind() != std::io::ErrorKind::Interrupted => return Err(error).context("cannot poll"),
            _ => {}
        }
        for event in &events {
            let Token(i) = event.token();
            let Some(line) = lines.get_mut(i) else { continue };
            // The pump would only notice at its next read or write.
            if event.is_read_closed() || event.is_error() {
                line.close("hung up");
            } else {
                line.set_ready(event.is_readable(), event.is_writable());
            }
        }
    }
}

/// Ports that have vanished, and those that come back. `owed`: the frontseat vanished under way.
fn look_after(lines: &mut [PtyLine; 5], app: &mut App, pump: &Pump, poll: &Poll, owed: &mut bool) -> Result<()> {
    for (i, line) in lines.iter_mut().enumerate() {
        if let Some(lost) = line.lost.take() {
            if pump.is_lockstep() {
                bail!("{lost}");
            }
            eprintln!("backseat-host: {lost}; it is tried again every second");
            *owed |= i == Port::Frontseat as usize && !app.lends_clock();
        }
        if line.reopen(poll.registry()) {
            eprintln!("backseat-host: {} is back", line.label());
            // Without its sensors the mission ended long ago, and nobody heard the stop.
            if i == Port::Frontseat as usize && std::mem::take(owed) && !app.is_under_way() {
                app.hand_back();
            }
        }
    }
    if !lines.iter().any(PtyLine::is_open) {
        bail!("every port has vanished");
    }
    Ok(())
}

fn micros(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX)
}

fn open(ports: &HostPorts, poll: &Poll) -> Result<[PtyLine; 5]> {
    let mut lines = Vec::new();
    for (i, (settings, name)) in ports.ports.iter().zip(Port::NAMES).enumerate() {
        let opened = PtyLine::open(settings, i, poll.registry());
        let path = settings.path.display();
        lines.push(opened.with_context(|| format!("{name}: cannot open {path} as a serial port"))?);
    }
    lines.try_into().map_err(|_| anyhow!("five ports are needed"))
}

/// Opens the parameter store and starts with the set found there.
fn open_store(path: &Path, app: &mut App) -> Result<ParameterFlash<FileFlash>> {
    let flash = FileFlash::open(path).with_context(|| format!("store: cannot open {}", path.display()))?;
    let mut store = ParameterFlash::new(flash).map_err(|_| anyhow!("store: two copies do not fit"))?;
    let mut settings = Settings::DEFAULT;
    let found = store.load(&mut settings).is_ok();
    if !app.restore(found.then_some(&settings)) {
        eprintln!("backseat-host: {}: the stored parameters do not go together; the defaults are used", path.display());
    }
    Ok(store)
}

/// Writes the parameters that are to be kept.
fn keep(app: &mut App, store: Option<&mut ParameterFlash<FileFlash>>) {
    if let (Some(settings), Some(store)) = (app.to_store().copied(), store) {
        let kept = store.save(&settings);
        if let Err(error) = &kept {
            eprintln!("backseat-host: store: {error:?}");
        }
        app.stored(kept.is_ok());
    }
}

// `Port` as an index is the order of `Port::ALL`.
const _: () = assert!(Port::Frontseat as usize == 0 && Port::Host as usize == 4);
