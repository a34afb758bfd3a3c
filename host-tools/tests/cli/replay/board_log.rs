//! The log of a board's memory card: the board on its own clock, its parameters in flash, reset by its watchdog.

use super::sim::{STEP_US, Sim, difference, replay, scenario};
use backseat_app::store::{Response, RestartRecord};
use backseat_app::{App, Progress, Pump, START_US};
use backseat_app::{Recorder, poll_recorded, record_start};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{MAX_FRAME, Port, ResetCause, ToBoard, encode};
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use hil_sim::flight::board_parameters;
use std::collections::VecDeque;
use std::convert::Infallible;

#[derive(Default)]
struct Log(Vec<u8>);

impl Recorder for Log {
    fn record(&mut self, record: &LogRecord<'_>) {
        self.0.extend_from_slice(encode(record, &mut [0; MAX_FRAME]).unwrap());
    }
}

/// A port that takes a byte count at a time, as a UART's buffer does.
#[derive(Default)]
struct Line {
    to_board: VecDeque<u8>,
    from_board: Vec<u8>,
    room: usize,
}

impl ErrorType for Line {
    type Error = Infallible;
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_board.is_empty())
    }
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.to_board.len());
        for (slot, byte) in buffer.iter_mut().zip(self.to_board.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl WriteReady for Line {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.room > 0)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(self.room);
        self.room -= count;
        self.from_board.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The STM32 board's loop around the app.
struct Board {
    app: Box<App>,
    pump: Pump,
    ports: [Line; 5],
    log: Log,
    time_us: u64,
    /// Steps until the flash has taken the parameters.
    writing: Option<usize>,
}

impl Board {
    fn start(cause: ResetCause, last: Option<&RestartRecord>) -> Self {
        let (mut app, mut log) = (Box::new(App::new()), Log::default());
        let (response, record) = RestartRecord::respond(cause, last);
        assert_eq!(response == Response::Fresh, last.is_none());
        let restart = record.report(cause, None);
        app.restore(None);
        app.resume(restart, &response);
        record_start(&mut log, &app, restart, last.map(RestartRecord::encode).as_ref().map_or(&[], |bytes| bytes));
        Self { app, pump: Pump::new(), ports: Default::default(), log, time_us: 0, writing: None }
    }

    fn poll(&mut self, time_us: u64) {
        loop {
            let stepped_us = self.app.stepped_us();
            let Ok(progress) = poll_recorded(&mut self.pump, &mut self.app, &mut self.ports, &mut self.log, time_us);
            if self.app.stepped_us() != stepped_us {
                self.stepped();
            }
            if progress != Progress::Moved {
                break;
            }
        }
    }

    fn stepped(&mut self) {
        match self.writing {
            Some(0) => {
                self.writing = None;
                self.app.stored(true);
            }
            Some(steps) => self.writing = Some(steps - 1),
            None => self.writing = self.app.to_store().map(|_| 3),
        }
    }

    fn ask(&mut self, message: &ToBoard<'_>) {
        let frame = encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec();
        self.ports[Port::Host as usize].to_board.extend(frame);
    }

    /// Flies in real order: chunks as they come, the app's steps by its own clock, the host's UART at its rate.
    fn fly(&mut self, sim: &mut Sim, steps: u64) {
        for _ in 0..steps {
            let end_us = self.time_us + STEP_US;
            let arrivals = sim.advance(end_us).into_iter();
            let arrivals = arrivals.map(|(port, arrival)| (arrival.time_us, Some((port, arrival.bytes))));
            let ticks = (1..=100).map(|tick| (self.time_us + tick * 1000, None));
            let mut events: Vec<_> = arrivals.chain(ticks).collect();
            events.sort_by_key(|(time_us, _)| *time_us);
            for (time_us, chunk) in events {
                match chunk {
                    Some((port, bytes)) => self.ports[port as usize].to_board.extend(bytes),
                    None => {
                        // 11 bytes a millisecond at 115200 baud
                        self.ports.iter_mut().for_each(|port| port.room = (port.room + 11).min(64));
                        if time_us.is_multiple_of(1_000_000) && !self.pump.is_waiting() {
                            self.app.pps(time_us);
                            self.log.record(&LogRecord::Edge { time_us });
                        }
                        self.poll(time_us + 7);
                    }
                }
            }
            self.time_us = end_us;
            let sent = Port::DEVICES.map(|port| std::mem::take(&mut self.ports[port as usize].from_board));
            sim.sent(end_us, &sent);
        }
    }
}

#[test]
fn a_board_log_is_the_same_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("LOG00001.BSL");
    let scenario = scenario();
    let mut sim = Sim::new(&scenario);
    let mut board = Board::start(ResetCause::PowerOn, None);
    board.fly(&mut sim, 10 + START_US / STEP_US);
    board.ask(&ToBoard::ParameterBegin);
    for (name, value) in &board_parameters(&scenario) {
        board.ask(&ToBoard::ParameterSet { name, value: *value });
    }
    board.ask(&ToBoard::ParameterCommit);
    board.ask(&ToBoard::ParameterStore);
    let waypoints = scenario.settings.waypoints();
    board.fly(&mut sim, 20);
    board.ask(&ToBoard::MissionBegin { count: waypoints.len() as u16 });
    for (index, waypoint) in (0..).zip(&waypoints) {
        board.ask(&ToBoard::MissionItem { index, waypoint: *waypoint });
    }
    board.ask(&ToBoard::MissionCommit);
    board.ask(&ToBoard::MissionStart);
    board.fly(&mut sim, 600);
    assert!(board.app.is_under_way() && board.app.to_store().is_none());
    std::fs::write(&path, &board.log.0).unwrap();

    let digest = format!("{:016x}", board.app.digest());
    let (code, said, stderr) = replay(&path, &[]);
    assert_eq!((code, &said["exact"], &said["digest"]), (0, &true.into(), &digest.into()), "{said}{stderr}");
    assert!(said["steps"].as_u64().unwrap() > 600 && said["notes"].as_array().unwrap().is_empty(), "{said}");
    assert!(said["compared"]["messages"].as_u64().unwrap() > 1000, "{said}");

    // Its watchdog resets it: it carries on from its restart record, and from a log that says so.
    let record = board.app.restart_record(&RestartRecord::default(), board.time_us);
    assert!(record.navigation.is_some());
    let mut board = Board::start(ResetCause::Watchdog, Some(&record));
    board.fly(&mut Sim::new(&scenario), 100);
    let log = &board.log.0;
    let reset = folder.path().join("LOG00002.BSL");
    // the power fails in the middle of a record
    std::fs::write(&reset, &log[..log.len() - 5]).unwrap();
    let (code, said, stderr) = replay(&reset, &[]);
    assert_eq!((code, &said["exact"]), (0, &true.into()), "{said}{stderr}");
    assert!(said["notes"].to_string().contains("cut off"), "{said}");

    // A card that did not keep up: nothing is compared from there on.
    let mut lossy = Log(log.clone());
    lossy.record(&LogRecord::Lost { records: 3 });
    lossy.record(&LogRecord::Step { time_us: board.time_us + STEP_US, digest: 1 });
    std::fs::write(&reset, &lossy.0).unwrap();
    let (code, said, _) = replay(&reset, &[]);
    assert!(code == 0 && said["notes"].to_string().contains("3 records are missing"), "{said}");
    lossy.0.truncate(log.len());
    lossy.record(&LogRecord::Step { time_us: board.time_us + STEP_US, digest: 1 });
    std::fs::write(&reset, &lossy.0).unwrap();
    let (code, said, _) = replay(&reset, &[]);
    assert_eq!((code, difference(&said, "step")[1].as_str()), (1, "step"), "{said}");
}
