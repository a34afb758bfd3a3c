//! Work that a person breaks off: Python's Ctrl-C. Long loops look here; a command ends with its process instead.

use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Carried by the unwinding that ends the work.
#[derive(Debug)]
pub struct Interrupted;

/// Whether the work is to end: all of this process.
pub fn ask(end: bool) {
    ASKED.store(end, Ordering::Relaxed);
}

/// Ends the work by unwinding to whoever asked for it, if it is to end.
pub fn check() {
    if ASKED.load(Ordering::Relaxed) {
        panic::resume_unwind(Box::new(Interrupted));
    }
}
