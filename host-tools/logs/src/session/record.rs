//! One record of an MCAP file.

use mcap::McapError;
use mcap::records::{Record, op};

/// [`mcap::parse_record`], which panics (0.26) on an attachment that ends before its CRC.
pub(super) fn parse_record(opcode: u8, body: &[u8]) -> Result<Record<'_>, McapError> {
    fn after_text(body: &[u8]) -> Option<&[u8]> {
        let (length, rest) = body.split_first_chunk()?;
        rest.get(u32::from_le_bytes(*length) as usize..)
    }
    // two times, two texts, the length of the data; data and CRC
    let rest = || body.get(16..).and_then(after_text).and_then(after_text)?.get(8..);
    if opcode == op::ATTACHMENT && rest().is_none_or(|data| data.len() < 4) {
        return Err(McapError::UnexpectedEof);
    }
    mcap::parse_record(opcode, body)
}
