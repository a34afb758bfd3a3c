//! An image of the firmware, as cargo builds it.

use anyhow::{Context, bail, ensure};
use backseat_wire::hostlink::{CRC, Image};
use object::Endianness;
use object::elf::{EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use std::path::Path;

/// Where an image for the STM32H743 begins, and the room it has (`memory.x`).
const FLASH: u32 = 0x0800_0000;
const ROOM: usize = 764 * 1024;
/// Of a flash that was erased.
const ERASED: u8 = 0xFF;

/// What goes into flash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FirmwareImage {
    /// From the start of the bank on.
    pub bytes: Vec<u8>,
    /// First four bytes of the build ID (`readelf -n IMAGE`).
    pub build: u32,
}

impl FirmwareImage {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// When it cannot be read, or is no image for the STM32H743.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let file = std::fs::read(path).with_context(|| path.display().to_string())?;
        Self::parse(&file).with_context(|| path.display().to_string())
    }

    /// The same of the file's bytes.
    ///
    /// # Errors
    /// When they are no image for the STM32H743.
    pub fn parse(file: &[u8]) -> anyhow::Result<Self> {
        let expected = "expected the ELF file of the board's image: backseat-VERSION-stm32h743.elf of a release";
        let Ok(elf) = ElfFile32::<Endianness>::parse(file) else { bail!("no ELF file of a 32-bit chip; {expected}") };
        let header: &FileHeader32<Endianness> = elf.elf_header();
        let endian = elf.endian();
        let mut bytes = Vec::new();
        for part in elf.elf_program_headers().iter().filter(|part| part.p_type(endian) == PT_LOAD) {
            let (at, content) = (part.p_paddr(endian), part.data(endian, file).unwrap_or_default());
            if content.is_empty() {
                continue;
            }
            let place = at.checked_sub(FLASH).map_or(usize::MAX, |place| place as usize);
            let is_ours = header.e_machine(endian) == EM_ARM && place < 2 * 1024 * 1024;
            ensure!(is_ours, "an image for another chip: it has bytes for {at:#010x}; {expected}");
            let end = place + content.len();
            ensure!(end <= ROOM, "too large: it ends {} bytes behind the {ROOM} of a bank", end - ROOM);
            bytes.resize(bytes.len().max(end), ERASED);
            bytes[place..end].copy_from_slice(content);
        }
        let build = build_of(&bytes).with_context(|| format!("it has no build ID; {expected}"))?;
        Ok(Self { bytes, build })
    }

    /// As the board is told of it.
    pub fn announced(&self) -> Image {
        Image { length: self.bytes.len() as u32, crc: CRC.checksum(&self.bytes), build: self.build }
    }
}

/// As the board finds it: in the note that the linker has put into flash (ELF: lengths of name and ID, kind 3, name).
fn build_of(bytes: &[u8]) -> Option<u32> {
    const NAME_LENGTH: [u8; 4] = [4, 0, 0, 0];
    const KIND_AND_NAME: [u8; 8] = *b"\x03\0\0\0GNU\0";
    let note = bytes.windows(20).find(|note| note.starts_with(&NAME_LENGTH) && note[8..16] == KIND_AND_NAME)?;
    note.last_chunk().map(|id| u32::from_be_bytes(*id))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ELF file whose segments are for these addresses.
    fn elf(machine: u16, segments: &[(u32, &[u8])]) -> Vec<u8> {
        let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0".to_vec();
        file.extend(machine.to_le_bytes());
        for word in [1, 0, 52, 0, 0] {
            file.extend(u32::to_le_bytes(word));
        }
        for half in [52, 32, segments.len() as u16, 40, 0, 0] {
            file.extend(half.to_le_bytes());
        }
        let mut begin = 52 + 32 * segments.len() as u32;
        for (at, content) in segments {
            let length = content.len() as u32;
            for word in [1, begin, 0x2000_0000, *at, length, length, 4, 4] {
                file.extend(word.to_le_bytes());
            }
            begin += length;
        }
        segments.iter().for_each(|(_, content)| file.extend(*content));
        file
    }

    const NOTE: &[u8] = b"\x04\0\0\0\x14\0\0\0\x03\0\0\0GNU\0\xAB\x01\x02\x03";

    #[test]
    fn segments_lie_where_flash_has_them() {
        let image = FirmwareImage::parse(&elf(40, &[(FLASH + 6, NOTE), (FLASH, &[1, 2, 3])])).unwrap();
        assert_eq!((&image.bytes[..7], image.build), (&[1, 2, 3, 255, 255, 255, 4][..], 0xAB01_0203));
        assert_eq!(image.announced().length, 26);
    }

    #[test]
    fn what_is_no_image_for_this_chip_is_refused() {
        let refusal = |file: &[u8]| format!("{:#}", FirmwareImage::parse(file).unwrap_err());
        assert!(refusal(b"UM\n").starts_with("no ELF file"));
        assert!(refusal(&elf(40, &[(0, NOTE)])).starts_with("an image for another chip: it has bytes for 0x00000000"));
        assert!(refusal(&elf(243, &[(FLASH, NOTE)])).starts_with("an image for another chip"));
        assert!(refusal(&elf(40, &[(FLASH, &[1; ROOM + 3])])).starts_with("too large: it ends 3 bytes"));
        assert!(refusal(&elf(40, &[(FLASH, &[1; 40])])).starts_with("it has no build ID"));
    }
}
