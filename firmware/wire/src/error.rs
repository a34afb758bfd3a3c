//! One flat error for the crate, and counters by cause.

/// Why bytes were not taken, or could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// Longer than the decoder's buffer or than the protocol allows.
    Overflow,
    /// Checksum or CRC differs.
    Checksum,
    /// Checksum is mandatory here and absent.
    ChecksumMissing,
    /// A byte that cannot stand there: frame broken off, control character, misplaced delimiter.
    Framing,
    /// A length or count field contradicts the frame.
    Length,
    /// An offset or field reaches beyond its frame.
    Offset,
    /// No sentence, record or version of this protocol.
    Unknown,
    /// Of this protocol, but nothing a mission needs.
    Unhandled,
    /// A mandatory field is missing or blank.
    Missing,
    /// A field is not of its format.
    Malformed,
    /// A value is not finite or physically impossible.
    OutOfRange,
    /// The sender itself marks the content as invalid.
    Invalid,
    /// The output buffer is too small.
    BufferFull,
    /// Not from whom it says: the authentication code is missing or wrong.
    Forged,
    /// The reading before, bit by bit, for longer than the noise of a working sensor allows.
    Repeated,
}

impl Error {
    /// All causes, in the order of their discriminants.
    pub const ALL: [Self; 15] = [
        Self::Overflow,
        Self::Checksum,
        Self::ChecksumMissing,
        Self::Framing,
        Self::Length,
        Self::Offset,
        Self::Unknown,
        Self::Unhandled,
        Self::Missing,
        Self::Malformed,
        Self::OutOfRange,
        Self::Invalid,
        Self::BufferFull,
        Self::Forged,
        Self::Repeated,
    ];
}

/// What a decoder has seen since it was made; counters saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    accepted: u32,
    skipped_bytes: u32,
    by_cause: [u32; Error::ALL.len()],
}

impl Counts {
    /// Nothing seen.
    pub const fn new() -> Self {
        Self { accepted: 0, skipped_bytes: 0, by_cause: [0; Error::ALL.len()] }
    }

    /// Counts an outcome and hands it on.
    pub fn note<T>(&mut self, outcome: Result<T, Error>) -> Result<T, Error> {
        match &outcome {
            Ok(_) => self.accepted = self.accepted.saturating_add(1),
            Err(cause) => self.note_error(*cause),
        }
        outcome
    }

    /// Counts an error.
    pub fn note_error(&mut self, cause: Error) {
        if let Some(count) = self.by_cause.get_mut(cause as usize) {
            *count = count.saturating_add(1);
        }
    }

    pub(crate) fn note_accepted(&mut self) {
        self.accepted = self.accepted.saturating_add(1);
    }

    pub(crate) fn note_skipped(&mut self, bytes: usize) {
        self.skipped_bytes = self.skipped_bytes.saturating_add(bytes as u32);
    }

    /// Frames or sentences accepted.
    pub const fn accepted(&self) -> u32 {
        self.accepted
    }

    /// Bytes that belonged to no frame.
    pub const fn skipped_bytes(&self) -> u32 {
        self.skipped_bytes
    }

    /// Rejections of one cause.
    pub fn of(&self, cause: Error) -> u32 {
        self.by_cause.get(cause as usize).copied().unwrap_or(0)
    }

    /// All rejections; [`Error::Unhandled`] is none.
    pub fn rejected(&self) -> u32 {
        Error::ALL
            .into_iter()
            .filter(|cause| *cause != Error::Unhandled)
            .fold(0, |sum, cause| sum.saturating_add(self.of(cause)))
    }
}
