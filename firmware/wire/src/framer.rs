//! Framers over fixed buffers: text lines, and binary frames that are found again after noise.

use crate::{Counts, Error};

/// Collects one line of printable ASCII from a start character to CR or LF.
pub(crate) struct LineBuffer<const N: usize> {
    buffer: [u8; N],
    length: usize,
    state: LineState,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum LineState {
    /// Outside any line, or in what is left of a broken one.
    Idle,
    /// Collecting.
    Inside,
    /// The buffer holds a line that was handed out.
    Done,
}

impl<const N: usize> LineBuffer<N> {
    pub(crate) const fn new() -> Self {
        Self { buffer: [0; N], length: 0, state: LineState::Idle }
    }

    /// Takes a byte; true when it completes the line in [`Self::text`].
    pub(crate) fn push(&mut self, byte: u8, start: u8, counts: &mut Counts) -> Result<bool, Error> {
        if self.state == LineState::Done {
            self.state = LineState::Idle;
        }
        let inside = self.state == LineState::Inside;
        match byte {
            _ if byte == start => {
                self.length = 0;
                self.state = LineState::Inside;
                if inside { Err(Error::Framing) } else { Ok(false) }
            }
            b'\r' | b'\n' if inside => {
                self.state = LineState::Done;
                Ok(true)
            }
            b'\r' | b'\n' => Ok(false),
            _ if !inside => {
                counts.note_skipped(1);
                Ok(false)
            }
            b' '..=b'~' => match self.buffer.get_mut(self.length) {
                Some(slot) => {
                    *slot = byte;
                    self.length += 1;
                    Ok(false)
                }
                None => {
                    self.state = LineState::Idle;
                    Err(Error::Overflow)
                }
            },
            _ => {
                self.state = LineState::Idle;
                Err(Error::Framing)
            }
        }
    }

    /// What stands between start character and line end.
    pub(crate) fn text(&self) -> &[u8] {
        self.buffer.get(..self.length).unwrap_or(&[])
    }
}

/// What the first bytes of a stream are.
pub(crate) enum Verdict<T> {
    /// The beginning of a frame, as far as it goes.
    Incomplete,
    /// A frame of this many bytes, and what it says.
    Frame(usize, T),
    /// No frame begins here.
    Noise,
    /// It looked like a frame but is not one.
    Reject(Error),
}

/// Finds binary frames in a stream: upon failure it goes on one byte further.
pub(crate) struct Window<const N: usize> {
    buffer: [u8; N],
    start: usize,
    end: usize,
    /// Length of the frame that was handed out and is to be dropped.
    handed_out: usize,
    pub(crate) counts: Counts,
}

impl<const N: usize> Window<N> {
    pub(crate) const fn new() -> Self {
        Self { buffer: [0; N], start: 0, end: 0, handed_out: 0, counts: Counts::new() }
    }

    /// Consumes bytes up to the next frame or rejection. `examine` must decide before `N` bytes.
    pub(crate) fn feed<T>(
        &mut self,
        bytes: &mut &[u8],
        examine: impl Fn(&[u8]) -> Verdict<T>,
    ) -> Option<Result<T, Error>> {
        self.start = (self.start + core::mem::take(&mut self.handed_out)).min(self.end);
        loop {
            let pending = self.buffer.get(self.start..self.end).unwrap_or(&[]);
            let verdict = if pending.is_empty() { Verdict::Incomplete } else { examine(pending) };
            match verdict {
                Verdict::Frame(length, content) => {
                    self.counts.note_accepted();
                    self.handed_out = length;
                    return Some(Ok(content));
                }
                Verdict::Noise => {
                    self.counts.note_skipped(1);
                    self.start += 1;
                }
                Verdict::Reject(cause) => {
                    self.counts.note_error(cause);
                    self.start += 1;
                    return Some(Err(cause));
                }
                Verdict::Incomplete => {
                    let (first, rest) = bytes.split_first()?;
                    *bytes = rest;
                    self.append(*first);
                }
            }
        }
    }

    /// The frame that [`Self::feed`] found last.
    pub(crate) fn frame(&self) -> &[u8] {
        self.buffer.get(self.start..self.end).and_then(|pending| pending.get(..self.handed_out)).unwrap_or(&[])
    }

    fn append(&mut self, byte: u8) {
        if self.end == N {
            // Not `copy_within`, which checks its bounds with a panic.
            for to in 0..self.end.saturating_sub(self.start) {
                let moved = self.buffer.get(self.start + to).copied().unwrap_or(0);
                if let Some(slot) = self.buffer.get_mut(to) {
                    *slot = moved;
                }
            }
            (self.start, self.end) = (0, self.end.saturating_sub(self.start));
        }
        match self.buffer.get_mut(self.end) {
            Some(slot) => {
                *slot = byte;
                self.end += 1;
            }
            // A frame that fills the whole buffer undecided: none that `examine` may let happen.
            None => {
                self.counts.note_error(Error::Overflow);
                (self.start, self.end) = (0, 0);
            }
        }
    }
}

/// Sum of bytes modulo 65536: the checksum of PD0, PD4/PD5 and of the 3DM-GX3.
pub(crate) fn sum16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |sum: u16, byte| sum.wrapping_add(u16::from(*byte)))
}

/// The verdict on a whole frame.
pub(crate) fn judged<T>(length: usize, content: Result<T, Error>) -> Verdict<T> {
    match content {
        Ok(content) => Verdict::Frame(length, content),
        Err(cause) => Verdict::Reject(cause),
    }
}

/// `N` bytes at `offset`.
pub(crate) fn at<const N: usize>(bytes: &[u8], offset: usize) -> Result<[u8; N], Error> {
    bytes.get(offset..).and_then(|rest| rest.first_chunk()).copied().ok_or(Error::Offset)
}
