//! The board log: inputs of the app, in the order in which it received them.

use crate::app::App;
use crate::parameters::{PARAMETER_SCHEMA, PARAMETERS};
use crate::pump::{PortFailure, Progress, Pump};
use backseat_wire::boardlog::{LogRecord, VALUES};
use backseat_wire::hostlink::{Port, Restart};
use core::cell::RefCell;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

/// Takes records; never waits.
pub trait Recorder {
    /// One record.
    fn record(&mut self, record: &LogRecord<'_>);
}

/// Records why the board started and what it starts with; `record` is the restart record as found.
pub fn record_start<R: Recorder>(recorder: &mut R, app: &App, restart: Restart, record: &[u8]) {
    let (firmware, image) = (env!("CARGO_PKG_VERSION"), app.image());
    recorder.record(&LogRecord::Start { firmware, parameter_schema: PARAMETER_SCHEMA, image, restart, record });
    for crash in app.earlier() {
        recorder.record(&LogRecord::EarlierCrash(*crash));
    }
    for (first, parameters) in (0..).step_by(VALUES).zip(PARAMETERS.chunks(VALUES)) {
        let values = parameters.iter().map(|parameter| parameter.get(app.parameters())).collect();
        recorder.record(&LogRecord::Parameters { first, values });
    }
}

/// [`Pump::poll`], recorded. Under the host's clock nothing is recorded: the host has every input.
///
/// # Errors
/// Those of the pump.
pub fn poll_recorded<P, R>(
    pump: &mut Pump,
    app: &mut App,
    ports: &mut [P; 5],
    recorder: &mut R,
    now_us: u64,
) -> Result<Progress, PortFailure<P::Error>>
where
    P: Read + ReadReady + Write + WriteReady,
    R: Recorder,
{
    if pump.is_lockstep() {
        return pump.poll(app, ports, now_us);
    }
    let stepped_us = app.stepped_us();
    let expects_key = app.expects_key();
    let shared = RefCell::new(&mut *recorder);
    let mut which = Port::ALL.into_iter();
    let mut recorded = ports.each_mut().map(|driver| Recorded {
        driver,
        // there are as many ports as names
        port: which.next().unwrap_or(Port::Host),
        recorder: &shared,
        time_us: now_us,
        expects_key,
    });
    let progress = pump.poll(app, &mut recorded, now_us)?;
    if let Some(time_us) = app.stepped_us().filter(|us| Some(*us) != stepped_us) {
        recorder.record(&LogRecord::Step { time_us, digest: app.digest() });
    }
    Ok(progress)
}

/// A port whose bytes are recorded.
struct Recorded<'a, 'r, P, R> {
    driver: &'a mut P,
    port: Port,
    recorder: &'a RefCell<&'r mut R>,
    time_us: u64,
    /// The host's bytes may hold the key of the acoustic payloads.
    expects_key: bool,
}

impl<P, R: Recorder> Recorded<'_, '_, P, R> {
    fn record(&self, record: &LogRecord<'_>) {
        // free: a recorder holds no ports
        if let Ok(mut recorder) = self.recorder.try_borrow_mut() {
            recorder.record(record);
        }
    }
}

impl<P: ErrorType, R> ErrorType for Recorded<'_, '_, P, R> {
    type Error = P::Error;
}

impl<P: ReadReady, R> ReadReady for Recorded<'_, '_, P, R> {
    fn read_ready(&mut self) -> Result<bool, P::Error> {
        self.driver.read_ready()
    }
}

impl<P: Read, R: Recorder> Read for Recorded<'_, '_, P, R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, P::Error> {
        let count = self.driver.read(buffer)?;
        let secret = self.expects_key && self.port == Port::Host;
        if let Some(bytes) = buffer.get(..count).filter(|bytes| !bytes.is_empty() && !secret) {
            self.record(&LogRecord::Received { port: self.port, time_us: self.time_us, bytes });
        }
        Ok(count)
    }
}

impl<P: WriteReady, R> WriteReady for Recorded<'_, '_, P, R> {
    fn write_ready(&mut self) -> Result<bool, P::Error> {
        self.driver.write_ready()
    }
}

impl<P: Write, R: Recorder> Write for Recorded<'_, '_, P, R> {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, P::Error> {
        let count = self.driver.write(buffer)?;
        if let Some(bytes) = buffer.get(..count).filter(|bytes| !bytes.is_empty()) {
            self.record(&LogRecord::Sent { port: self.port, time_us: self.time_us, bytes });
        }
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), P::Error> {
        self.driver.flush()
    }
}
