//! Chunks of a bag that are packed by Zstandard: a decoder in Rust, which a build does not wait for as it does for the
//! C library.

use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::{McapError, McapResult};
use ruzstd::decoding::errors::FrameDecoderError;
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::io::Read;

/// Longest header of a frame, bytes: magic number, descriptor, window, dictionary, size (RFC 8878, 3.1.1.1).
const MAX_HEADER: usize = 4 + 1 + 1 + 4 + 8;

/// Unpacks frames block by block, so that no more is held than a frame's window and one block.
pub(super) struct Zstd {
    frame: FrameDecoder,
    /// Behind a frame's header: the length of the check sum behind its last block.
    begun: Option<usize>,
}

impl Zstd {
    pub(super) fn new() -> Self {
        Self { frame: FrameDecoder::new(), begun: None }
    }

    /// Takes in what must be known before bytes come out; the rest of `source`.
    fn advance<'a>(&mut self, mut source: &'a [u8]) -> Result<&'a [u8], FrameDecoderError> {
        while self.frame.can_collect() == 0 {
            let Some(check_sum) = self.begun else {
                let mut behind = source;
                match self.frame.init(&mut behind) {
                    Err(_) if source.len() < MAX_HEADER => break,
                    result => result?,
                }
                let has_check_sum = source.get(4).is_some_and(|descriptor| descriptor & 4 != 0);
                (source, self.begun) = (behind, Some(if has_check_sum { 4 } else { 0 }));
                continue;
            };
            if self.frame.is_finished() {
                self.begun = None;
                continue;
            }
            if !starts_with_block(source, check_sum) {
                break;
            }
            self.frame.decode_blocks(&mut source, BlockDecodingStrategy::UptoBlocks(1))?;
        }
        Ok(source)
    }
}

/// Whether a block is there to its end, with the check sum behind it if it is the last one (RFC 8878, 3.1.1.2).
fn starts_with_block(bytes: &[u8], check_sum: usize) -> bool {
    let Some(&[a, b, c]) = bytes.first_chunk() else { return false };
    let header = u32::from_le_bytes([a, b, c, 0]);
    let is_repeated_byte = header >> 1 & 3 == 1;
    let content = if is_repeated_byte { 1 } else { (header >> 3) as usize };
    bytes.len() >= 3 + content + if header & 1 == 1 { check_sum } else { 0 }
}

impl Decompressor for Zstd {
    fn next_read_size(&self) -> usize {
        0
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        let rest = self.advance(src).map_err(|error| McapError::DecompressionError(error.to_string()))?;
        let wrote = self.frame.read(dst).map_err(McapError::Io)?;
        Ok(DecompressResult { consumed: src.len() - rest.len(), wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        *self = Self::new();
        Ok(())
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unpacks what comes in parts of `step` bytes, into room for `room`.
    fn unpacked(packed: &[u8], step: usize, room: usize, size: usize) -> McapResult<Vec<u8>> {
        let (mut zstd, mut out, mut from, mut to) = (Zstd::new(), Vec::new(), 0, step);
        while out.len() < size {
            let source = &packed[from..to.min(packed.len())];
            let mut part = vec![0; room.min(size - out.len())];
            let DecompressResult { consumed, wrote } = zstd.decompress(source, &mut part)?;
            if (consumed, wrote) == (0, 0) {
                if to >= packed.len() {
                    break;
                }
                to += step;
            }
            from += consumed;
            out.extend(&part[..wrote]);
        }
        Ok(out)
    }

    /// Frames of the reference program, 1.5.4: `seq -s, 1000 1099 | zstd -19 -c`, then
    /// `head -c 300000 /dev/zero | zstd -c`, each with its check sum.
    #[test]
    fn val_frames_of_the_reference_program() {
        let numbers: Vec<String> = (1000..1100).map(|number| number.to_string()).collect();
        let text = format!("{}\n", numbers.join(","));
        let whole = [text.as_bytes(), &[0; 300_000]].concat();
        let packed = [NUMBERS, ZEROS].concat();
        for (step, room) in [(1, 1), (1, 1 << 20), (7, 1000), (1 << 16, 1 << 16)] {
            let size = if room == 1 { 1000 } else { whole.len() };
            assert!(unpacked(&packed, step, room, size).unwrap() == whole[..size], "{step} {room}");
        }
        assert!(unpacked(&packed[..20], 7, 1000, text.len()).unwrap().len() < text.len());
        assert!(unpacked(&[0; 100], 7, 1000, 10).is_err());
    }

    const NUMBERS: &[u8] = &[
        0x28, 0xb5, 0x2f, 0xfd, 0x04, 0x68, 0xa5, 0x06, 0x00, 0x46, 0x1f, 0x34, 0x0b, 0xa0, 0xd5, 0x1a, 0x24, 0x49,
        0x22, 0xe4, 0x7f, 0x70, 0x2a, 0x06, 0x29, 0x00, 0x31, 0x00, 0x31, 0x00, 0x8d, 0xe0, 0x89, 0xe0, 0x85, 0xe0,
        0x1d, 0x3c, 0x83, 0x17, 0xec, 0x9d, 0x3d, 0xb3, 0x57, 0xf6, 0xc8, 0xde, 0xd8, 0x13, 0x7b, 0x61, 0xef, 0x3d,
        0xf7, 0x02, 0xbd, 0xa3, 0x67, 0xf4, 0x8a, 0x1e, 0xd1, 0x1b, 0x7a, 0x42, 0x2f, 0xe8, 0xad, 0xa7, 0x1e, 0x05,
        0xc3, 0x3b, 0xc3, 0x33, 0xc3, 0x2b, 0xc3, 0x23, 0xc3, 0x1b, 0xc3, 0x13, 0xc3, 0x0b, 0xc3, 0x7b, 0x78, 0x0e,
        0x2f, 0x10, 0xde, 0x11, 0x9e, 0x11, 0x5e, 0x11, 0x1e, 0x11, 0xde, 0x10, 0x9e, 0x10, 0x5e, 0x10, 0xde, 0xc2,
        0x53, 0x78, 0x41, 0xf0, 0x4e, 0xf0, 0x4c, 0xf0, 0x4a, 0xf0, 0x48, 0xf0, 0x0d, 0xe3, 0x09, 0xe3, 0x05, 0xe3,
        0x6d, 0x3c, 0x8d, 0x17, 0x14, 0xef, 0x14, 0xcf, 0x14, 0xaf, 0x14, 0x8f, 0x14, 0x6f, 0x14, 0x4f, 0x14, 0x2f,
        0x14, 0xef, 0xe2, 0x59, 0xbc, 0x80, 0x78, 0x87, 0x78, 0x86, 0x78, 0x85, 0x78, 0x84, 0x78, 0x83, 0x78, 0x82,
        0x78, 0x81, 0x78, 0x13, 0x4f, 0xe2, 0x01, 0x40, 0x10, 0x78, 0x27, 0xf0, 0x4c, 0xe0, 0x95, 0xc0, 0x23, 0x81,
        0x37, 0x02, 0x4f, 0x04, 0x5e, 0x08, 0xbc, 0x03, 0xcf, 0xc0, 0x0b, 0x8e, 0x77, 0x8e, 0x67, 0x8e, 0x57, 0x8e,
        0x47, 0x8e, 0x37, 0x8e, 0x27, 0x8e, 0x17, 0x8e, 0xf7, 0xf1, 0x3c, 0x5e, 0x60, 0xbc, 0x63, 0x3c, 0x63, 0xbc,
        0x62, 0x3c, 0x62, 0x3c, 0x00, 0x98, 0x23, 0xa0, 0x42,
    ];
    const ZEROS: &[u8] = &[
        0x28, 0xb5, 0x2f, 0xfd, 0x04, 0x58, 0x54, 0x00, 0x00, 0x10, 0x00, 0x00, 0x01, 0x00, 0xfb, 0xff, 0x39, 0xc0,
        0x02, 0x02, 0x00, 0x10, 0x00, 0x03, 0x9f, 0x04, 0x00, 0x2d, 0x28, 0xde, 0x26,
    ];
}
