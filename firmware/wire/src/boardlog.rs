//! The board log: what a board received, when it stepped and what it sent, to be read back after a
//! dive.
//!
//! A log is a row of [`hostlink`](crate::hostlink) frames, each one [`LogRecord`]: read it with
//! [`hostlink::Decoder`](crate::hostlink::Decoder). A log that the power cut off is good up to the
//! cut. Received bytes, edges and steps, in this order and with these times, are all that the app
//! sees: handed to an app that starts from [`LogRecord::Start`] and [`LogRecord::Parameters`], they
//! give the same digests again.

use crate::hostlink::{FittingReadings, ImageId, KeptCrash, Oscillator, Port, Restart};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Values in one [`LogRecord::Parameters`].
pub const VALUES: usize = 32;

/// One record; times are board time, µs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LogRecord<'a> {
    /// The board started; its time begins at 0.
    Start {
        /// Firmware version.
        firmware: &'a str,
        /// Version of the parameter list.
        parameter_schema: u16,
        /// Which image ran.
        image: ImageId,
        /// Why it started.
        restart: Restart,
        /// The restart record that was found, as it was stored; empty when there was none.
        record: &'a [u8],
    },
    /// Values of the set that was active at start, in the order of the list.
    Parameters {
        /// Index of the first one.
        first: u16,
        /// As many as fit.
        values: Vec<f64, VALUES>,
    },
    /// Bytes handed to the app.
    Received {
        /// From which port.
        port: Port,
        /// When they were read.
        time_us: u64,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// Bytes the app handed to a port: commands, and to the host telemetry and answers.
    Sent {
        /// To which port.
        port: Port,
        /// When.
        time_us: u64,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// An edge of the pulse per second.
    Edge {
        /// When it came.
        time_us: u64,
    },
    /// The app took a step.
    Step {
        /// Its time.
        time_us: u64,
        /// Running digest of filter state and covariance after it.
        digest: u64,
    },
    /// Records before this one are missing, because the card did not keep up.
    Lost {
        /// How many.
        records: u32,
    },
    /// The board's clock counts another oscillator from here on. At start it is a crystal.
    Oscillator {
        /// From when on.
        time_us: u64,
        /// Which.
        oscillator: Oscillator,
    },
    /// What last-resort hardware reads from here on; where none is fitted, nothing.
    Fittings {
        /// From when on.
        time_us: u64,
        /// What.
        readings: FittingReadings,
    },
    /// After the start: an earlier crash that no card has got yet.
    EarlierCrash(KeptCrash),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hostlink::{Decoder, MAX_FRAME, ResetCause, encode};
    extern crate std;
    use std::vec::Vec as StdVec;

    #[test]
    fn records_come_back_and_a_cut_costs_the_last_one() {
        let bytes: StdVec<u8> = (0..=255).collect();
        let restart = Restart { cause: ResetCause::Watchdog, resets: 2, safe: false, crash: None };
        let image = ImageId { build: 7, crc: 8, commit: 9, parameters: 10 };
        let records = [
            LogRecord::Start { firmware: "backseat 0.1.0", parameter_schema: 1, image, restart, record: &[0; 112] },
            LogRecord::Parameters { first: 32, values: (0..VALUES).map(|i| i as f64 - 0.5).collect() },
            LogRecord::Received { port: Port::Dvl, time_us: 7, bytes: &bytes },
            LogRecord::Sent { port: Port::Host, time_us: u64::MAX, bytes: &[] },
            LogRecord::Edge { time_us: 250_000 },
            LogRecord::Step { time_us: 300_000, digest: 0x0123_4567_89AB_CDEF },
            LogRecord::Lost { records: 3 },
            LogRecord::Oscillator { time_us: 400_000, oscillator: Oscillator::Internal },
            LogRecord::Fittings {
                time_us: 500_000,
                readings: FittingReadings { leak: Some(true), supply_v: Some(22.5), ..Default::default() },
            },
            LogRecord::EarlierCrash(KeptCrash { overwritten: 3, ..KeptCrash::default() }),
        ];
        let mut log = StdVec::new();
        for record in &records {
            log.extend_from_slice(encode(record, &mut [0; MAX_FRAME]).expect("every record fits a frame"));
        }
        for cut in [0, 1] {
            let (mut decoder, mut rest) = (Decoder::new(), &log[..log.len() - cut]);
            let mut found = 0;
            while let Some(frame) = decoder.feed(&mut rest) {
                assert_eq!(frame.and_then(|frame| frame.message::<LogRecord<'_>>()).as_ref(), Ok(&records[found]));
                found += 1;
            }
            assert_eq!(found, records.len() - cut);
        }
    }
}
