//! Frames of the host link: `00`, COBS of (postcard message, CRC-32 little-endian), `00`.
//!
//! The leading delimiter parts a frame from noise before it; empty frames are nothing. COBS is our own, because
//! postcard's can panic.

use crate::framer::at;
use crate::{Counts, Error};
use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Deserialize, Serialize};

/// Longest message, in postcard bytes: a `Step` with all its chunks has at most 481.
pub const MAX_MESSAGE: usize = 768;
/// A buffer of this size holds any frame.
pub const MAX_FRAME: usize = MAX_MESSAGE + 16;

/// The CRC of every frame, and of all that a board keeps: its table is in an image once.
pub static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const CRC_BYTES: usize = 4;
/// Where the plain bytes are put, far enough behind that COBS can be written in front of them: delimiter, and a code
/// byte for each 254 bytes begun.
const PLAIN_AT: usize = 1 + (MAX_MESSAGE + CRC_BYTES).div_ceil(254) + 1;

/// Writes one message as a frame.
///
/// # Errors
/// [`Error::BufferFull`] when buffer or [`MAX_MESSAGE`] do not suffice; [`MAX_FRAME`] bytes always do.
pub fn encode<'b, T: Serialize>(message: &T, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let room = buffer.len().saturating_sub(PLAIN_AT + CRC_BYTES).min(MAX_MESSAGE);
    let plain = buffer.get_mut(PLAIN_AT..PLAIN_AT + room).ok_or(Error::BufferFull)?;
    let plain = postcard::to_slice(message, plain).map_err(|_| Error::BufferFull)?;
    let (crc, crc_at) = (CRC.checksum(plain), PLAIN_AT + plain.len());
    let end = crc_at + CRC_BYTES;
    buffer.get_mut(crc_at..end).ok_or(Error::BufferFull)?.copy_from_slice(&crc.to_le_bytes());
    let length = stuff(buffer, end)?;
    buffer.get(..length).ok_or(Error::BufferFull)
}

/// COBS of `buffer[PLAIN_AT..end]`, between delimiters, to the front of the same buffer. Gives its length.
fn stuff(buffer: &mut [u8], end: usize) -> Result<usize, Error> {
    let put = |at: usize, byte: u8, buffer: &mut [u8]| {
        *buffer.get_mut(at).ok_or(Error::BufferFull)? = byte;
        Ok::<(), Error>(())
    };
    let (mut code_at, mut write, mut code) = (1, 2, 1_u8);
    put(0, 0, buffer)?;
    for read in PLAIN_AT..end {
        let byte = buffer.get(read).copied().ok_or(Error::BufferFull)?;
        if byte != 0 {
            put(write, byte, buffer)?;
            write += 1;
            code += 1;
        }
        if byte == 0 || code == u8::MAX {
            put(code_at, code, buffer)?;
            (code_at, write, code) = (write, write + 1, 1);
        }
    }
    put(code_at, code, buffer)?;
    put(write, 0, buffer)?;
    Ok(write + 1)
}

/// A frame whose CRC was verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a>(&'a [u8]);

impl<'a> Frame<'a> {
    /// Of a message that came in another way.
    pub(super) const fn new(message: &'a [u8]) -> Self {
        Self(message)
    }

    /// The message, borrowing its text from the decoder.
    ///
    /// # Errors
    /// [`Error::Malformed`] when it is no such message, or more than one.
    pub fn message<T: Deserialize<'a>>(&self) -> Result<T, Error> {
        match postcard::take_from_bytes(self.0) {
            Ok((message, [])) => Ok(message),
            _ => Err(Error::Malformed),
        }
    }
}

/// Finds frames in a byte stream.
///
/// ```
/// use backseat_wire::hostlink::{Decoder, MAX_FRAME, ToBoard, encode};
/// let mut buffer = [0; MAX_FRAME];
/// let mut bytes = encode(&ToBoard::ParameterSet { name: "drag", value: 3.0 }, &mut buffer).unwrap();
/// let mut decoder = Decoder::new();
/// while let Some(outcome) = decoder.feed(&mut bytes) {
///     let message: ToBoard = outcome.and_then(|frame| frame.message()).unwrap();
///     assert_eq!(message, ToBoard::ParameterSet { name: "drag", value: 3.0 });
/// }
/// ```
pub struct Decoder {
    buffer: [u8; MAX_MESSAGE + CRC_BYTES],
    length: usize,
    /// Bytes that the present block still has.
    block: u8,
    /// A zero stands before the next block.
    zero: bool,
    state: State,
    counts: Counts,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// After a delimiter.
    Empty,
    /// In a frame.
    Inside,
    /// In a frame that was refused.
    Skipping,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self {
            buffer: [0; MAX_MESSAGE + CRC_BYTES],
            length: 0,
            block: 0,
            zero: false,
            state: State::Empty,
            counts: Counts::new(),
        }
    }

    /// Consumes bytes up to the next frame or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Frame<'_>, Error>> {
        loop {
            let (byte, rest) = bytes.split_first()?;
            *bytes = rest;
            match self.push(*byte) {
                Ok(false) => {}
                Ok(true) => break,
                Err(cause) => {
                    self.counts.note_error(cause);
                    return Some(Err(cause));
                }
            }
        }
        let outcome = check(self.buffer.get(..self.length).unwrap_or(&[]));
        Some(self.counts.note(outcome))
    }

    /// Takes a byte; true when it ends a frame.
    fn push(&mut self, byte: u8) -> Result<bool, Error> {
        match (self.state, byte) {
            (State::Empty, 0) => return Ok(false),
            (State::Skipping, 0) => {
                self.state = State::Empty;
                return Ok(false);
            }
            (State::Inside, 0) => {
                self.state = State::Empty;
                return if self.block == 0 { Ok(true) } else { Err(Error::Framing) };
            }
            (State::Skipping, _) => return Ok(false),
            (State::Empty, code) => {
                (self.length, self.block, self.zero) = (0, code - 1, code < u8::MAX);
                self.state = State::Inside;
                return Ok(false);
            }
            (State::Inside, code) if self.block == 0 => {
                let zero = core::mem::replace(&mut self.zero, code < u8::MAX);
                self.block = code - 1;
                if !zero {
                    return Ok(false);
                }
                self.append(0)?;
            }
            (State::Inside, byte) => {
                self.block -= 1;
                self.append(byte)?;
            }
        }
        Ok(false)
    }

    fn append(&mut self, byte: u8) -> Result<(), Error> {
        let Some(slot) = self.buffer.get_mut(self.length) else {
            self.state = State::Skipping;
            return Err(Error::Overflow);
        };
        *slot = byte;
        self.length += 1;
        Ok(())
    }

    /// Frames whose CRC was right, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }
}

fn check(plain: &[u8]) -> Result<Frame<'_>, Error> {
    let length = plain.len().checked_sub(CRC_BYTES).ok_or(Error::Length)?;
    let message = plain.get(..length).ok_or(Error::Length)?;
    if CRC.checksum(message) == u32::from_le_bytes(at(plain, length)?) {
        Ok(Frame(message))
    } else {
        Err(Error::Checksum)
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
