//! The app inside this process, on ports in memory: no operating system in between, for studies of
//! many flights. The same app, pump and host link as on any board.

use crate::faults::Flash;
use backseat_app::parameters::{PARAMETER_SCHEMA, PARAMETERS, Parameter, Settings};
use backseat_app::store::{ParameterFlash, RestartRecord};
use backseat_app::{App, Health, Progress, Pump};
use backseat_core::navigation::naming::Naming;
use backseat_link::{BackseatError, Ports, Reset};
use backseat_logs::session::Event;
use backseat_wire::hostlink::{ImageId, Port};
use std::collections::VecDeque;
use std::convert::Infallible;

/// A serial port in memory.
#[derive(Debug, Default)]
pub struct Memory {
    /// Bytes that the board has not read yet.
    pub to_board: VecDeque<u8>,
    /// Bytes that it has written.
    pub from_board: Vec<u8>,
}

impl embedded_io::ErrorType for Memory {
    type Error = Infallible;
}

impl embedded_io::Read for Memory {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.to_board.len());
        for (slot, byte) in buffer.iter_mut().zip(self.to_board.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl embedded_io::ReadReady for Memory {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_board.is_empty())
    }
}

impl embedded_io::Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.from_board.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl embedded_io::WriteReady for Memory {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}

/// The app in this process.
pub struct InProcess {
    app: Box<App>,
    pump: Pump,
    ports: [Memory; 5],
    /// What outlasts a reset.
    flash: Flash,
    record: RestartRecord,
}

impl InProcess {
    /// As after power-up, with nothing in its memory.
    pub fn new() -> Self {
        let mut app = Box::new(App::new());
        app.restore(None);
        let (ports, flash, record) = Default::default();
        Self { app, pump: Pump::new(), ports, flash, record }
    }

    /// What was received, refused and dropped since the last start.
    pub fn health(&self) -> Health<'_> {
        self.app.health()
    }

    /// What the app knows of what has changed.
    pub fn naming(&mut self) -> &mut Naming {
        self.app.naming()
    }

    /// Lets the app work until it has nothing left to do.
    fn run(&mut self) {
        // Time zero: the lock-step clock is the only one here.
        while let Ok(Progress::Moved) = self.pump.poll(&mut self.app, &mut self.ports, 0) {
            if let Some(settings) = self.app.to_store().copied() {
                let kept = self.with_flash(|flash| flash.save(&settings).is_ok());
                self.app.stored(kept == Some(true));
            }
        }
    }

    fn with_flash<T>(&mut self, act: impl FnOnce(&mut ParameterFlash<Flash>) -> T) -> Option<T> {
        let mut store = ParameterFlash::new(std::mem::take(&mut self.flash)).ok()?;
        let outcome = act(&mut store);
        self.flash = store.release();
        Some(outcome)
    }

    /// Starts again, as the STM32H743 board does; what the log of its card would say of it.
    fn start_again(&mut self, Reset { cause, corrupted }: Reset) -> Vec<Event> {
        let powered_us = self.record.powered_us + self.app.stepped_us().unwrap_or(0);
        let last = self.app.restart_record(&self.record, powered_us);
        self.flash.corrupt(corrupted);
        let (response, record) = RestartRecord::respond(cause, Some(&last));
        let mut started = vec![Event::Start {
            firmware: env!("CARGO_PKG_VERSION").to_owned(),
            parameter_schema: PARAMETER_SCHEMA,
            image: ImageId::default(),
            restart: record.report(cause, None),
            record: last.encode().to_vec(),
        }];
        self.record = record;
        let mut stored = Settings::DEFAULT;
        let found = self.with_flash(|flash| flash.load(&mut stored).is_ok()) == Some(true);
        *self = Self { flash: std::mem::take(&mut self.flash), record, ..Self::new() };
        self.app.restore(found.then_some(&stored));
        self.app.resume(record.report(cause, None), &response);
        if found {
            let value = |parameter: &Parameter| (parameter.name.to_owned(), parameter.get(&stored));
            started.push(Event::Parameters(PARAMETERS.iter().map(value).collect()));
        }
        started
    }
}

impl Ports for InProcess {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.ports[port as usize].to_board.extend(bytes);
        Ok(())
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.poll(port, received)?;
        if received.is_empty() { Err(BackseatError::Silent { port, seconds: 0 }) } else { Ok(()) }
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        if self.ports[port as usize].from_board.is_empty() {
            self.run();
        }
        received.append(&mut self.ports[port as usize].from_board);
        Ok(())
    }

    fn reset(&mut self, reset: Reset) -> Result<Vec<Event>, BackseatError> {
        Ok(self.start_again(reset))
    }
}
