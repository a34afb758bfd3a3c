//! Long work beside a Python that sees Ctrl-C meanwhile.

use crate::error;
use backseat_logs::interrupt;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// How often Python is asked.
const LOOK: Duration = Duration::from_millis(50);
/// Matrices of a filter pass over the stack; threads have less of it than programs.
const STACK: usize = 16 << 20;

/// Does the work without holding Python; on an interrupt it ends early, and Python gets the interrupt.
pub fn run<T: Send>(py: Python<'_>, work: impl FnOnce() -> anyhow::Result<T> + Send) -> PyResult<T> {
    let (ended, end) = channel::<()>();
    let work = move || {
        // dropped when the work ends, in whatever way
        let _ended = ended;
        work()
    };
    thread::scope(|scope| {
        let worker = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work).map_err(error)?;
        let mut end = end;
        let seen = loop {
            let waited;
            (end, waited) = py.detach(move || {
                let waited = end.recv_timeout(LOOK);
                (end, waited)
            });
            if waited != Err(RecvTimeoutError::Timeout) {
                break Ok(());
            }
            if let Err(interrupt) = py.check_signals() {
                break Err(interrupt);
            }
        };
        interrupt::ask(seen.is_err());
        let result = py.detach(|| worker.join());
        interrupt::ask(false);
        seen?;
        result.unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(error)
    })
}
