//! Requests to write the active parameters to the board's memory.

use backseat_wire::hostlink::Refusal;

/// State of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Request {
    /// The board has no memory for parameters.
    NoMemory,
    /// Nothing to do.
    Idle,
    /// The board is to write them, and the host waits for the answer.
    ByHost,
    /// The board is to write what a dive has learnt.
    Learnt,
}

/// Origin of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// The host, which waits for an answer.
    Host,
    /// The end of a dive.
    Learning,
}

/// The board's memory, as the app sees it.
#[derive(Debug)]
pub struct Storage(Request);

impl Storage {
    /// No memory.
    pub const fn new() -> Self {
        Self(Request::NoMemory)
    }

    /// The board has a memory.
    pub fn fitted(&mut self) {
        self.0 = Request::Idle;
    }

    pub fn is_fitted(&self) -> bool {
        self.0 != Request::NoMemory
    }

    /// Ready for a request.
    pub fn is_idle(&self) -> bool {
        self.0 == Request::Idle
    }

    /// The board is writing, or about to.
    pub fn is_busy(&self) -> bool {
        matches!(self.0, Request::ByHost | Request::Learnt)
    }

    /// The active set is to be written.
    ///
    /// # Errors
    /// No memory, or busy.
    pub fn request(&mut self, asked: Asked) -> Result<(), Refusal> {
        if !self.is_idle() {
            return Err(Refusal::NoStore);
        }
        self.0 = match asked {
            Asked::Host => Request::ByHost,
            Asked::Learning => Request::Learnt,
        };
        Ok(())
    }

    /// The board is done; returns the origin of the request.
    pub fn done(&mut self) -> Option<Asked> {
        let asked = match self.0 {
            Request::NoMemory | Request::Idle => return None,
            Request::ByHost => Asked::Host,
            Request::Learnt => Asked::Learning,
        };
        self.0 = Request::Idle;
        Some(asked)
    }
}
