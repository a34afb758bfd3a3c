//! How a command ended.

use std::process::ExitCode;

/// What a command that succeeded has to say about its result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Done: exit code 0.
    Done,
    /// Done, but the result is not to be trusted: exit code 3.
    Doubtful,
}

impl Outcome {
    /// [`Outcome::Doubtful`] if so.
    pub const fn doubtful_if(is_doubtful: bool) -> Self {
        if is_doubtful { Self::Doubtful } else { Self::Done }
    }

    pub fn exit_code(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Doubtful => ExitCode::from(3),
        }
    }
}

impl From<()> for Outcome {
    fn from((): ()) -> Self {
        Self::Done
    }
}
