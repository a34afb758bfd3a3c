//! Hexadecimal digits; either case is read, upper case is written.

use crate::Error;

const DIGITS: [u8; 16] = *b"0123456789ABCDEF";

/// The two digits of a byte.
pub fn encode(byte: u8) -> [u8; 2] {
    let digit = |nibble: u8| DIGITS.get(usize::from(nibble & 0x0F)).copied().unwrap_or(b'0');
    [digit(byte >> 4), digit(byte)]
}

/// The value of one digit.
pub fn digit(character: u8) -> Result<u8, Error> {
    match character {
        b'0'..=b'9' => Ok(character - b'0'),
        b'a'..=b'f' => Ok(character - b'a' + 10),
        b'A'..=b'F' => Ok(character - b'A' + 10),
        _ => Err(Error::Malformed),
    }
}

/// The byte of two digits.
pub fn decode(high: u8, low: u8) -> Result<u8, Error> {
    Ok(digit(high)? << 4 | digit(low)?)
}

/// Fills `bytes` from exactly twice as many digits.
pub fn decode_exact(text: &[u8], bytes: &mut [u8]) -> Result<(), Error> {
    if text.len() != bytes.len() * 2 {
        return Err(Error::Malformed);
    }
    for (pair, byte) in text.chunks_exact(2).zip(bytes) {
        let [high, low] = pair else { return Err(Error::Malformed) };
        *byte = decode(*high, *low)?;
    }
    Ok(())
}
