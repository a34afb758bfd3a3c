//! What no input may do, one function a target: cargo-fuzz searches with it, the tracked corpora run through it as a
//! test.
//!
//! Every target asserts more than the absence of a panic. Text: what was parsed is emitted, and the emitted sentence
//! parses and emits as itself. Streams: where a stream is cut makes no difference, a frame yields one outcome a byte at
//! most, everything that was handed in is consumed, and after any noise the next good frame is found. Everywhere: no
//! number from outside is NaN or infinite once it was accepted. Stores: whatever memory holds, a set is whole and in
//! range or refused, and one can be stored. Files: an error or a result, and what was read can be written and read
//! again. The app: after any bytes at any times it flies a mission.

#![forbid(unsafe_code)]

mod app;
mod day;
mod disturbed;
mod false_inputs;
mod files;
mod flight;
mod host;
mod sentences;
mod stores;
mod streams;

pub use app::app;
pub use day::{day, frontseat};
pub use disturbed::fly_disturbed;
pub use files::{board_log, csv_log, importers, scenario, session, vehicle_file};
pub use host::host;
pub use sentences::{framer, gps, iver, modem, os5000};
pub use stores::{parameter_store, restart_record, ship_state};
pub use streams::{gx3, hostlink, mip, pd0, pd4, pd6};

/// A target: a function that panics when an input does what none may.
pub type Target = fn(&[u8]);

/// All targets under the names of their corpora and of their programs in `fuzz_targets`.
pub const TARGETS: [(&str, Target); 24] = [
    ("app", app),
    ("board_log", board_log),
    ("csv_log", csv_log),
    ("day", day),
    ("framer", framer),
    ("frontseat", frontseat),
    ("gps", gps),
    ("gx3", gx3),
    ("host", host),
    ("hostlink", hostlink),
    ("importers", importers),
    ("iver", iver),
    ("mip", mip),
    ("modem", modem),
    ("os5000", os5000),
    ("parameter_store", parameter_store),
    ("pd0", pd0),
    ("pd4", pd4),
    ("pd6", pd6),
    ("restart_record", restart_record),
    ("scenario", scenario),
    ("session", session),
    ("ship_state", ship_state),
    ("vehicle_file", vehicle_file),
];

/// Any number in it is one: none is NaN or infinite.
fn finite<T: std::fmt::Debug>(value: &T) {
    let shown = format!("{value:?}");
    let odd = shown.split(|c: char| !c.is_ascii_alphanumeric()).find(|word| matches!(*word, "NaN" | "inf"));
    assert!(odd.is_none(), "{shown}");
}
