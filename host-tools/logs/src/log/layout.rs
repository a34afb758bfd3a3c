//! Numbers at fixed places of binary messages, by the letters that Python's `struct` has for them.

/// Bytes of a number; 0 for what is none.
pub(crate) const fn size(code: u8) -> usize {
    match code {
        b'b' | b'B' => 1,
        b'h' | b'H' => 2,
        b'i' | b'I' | b'f' => 4,
        b'q' | b'Q' | b'd' => 8,
        _ => 0,
    }
}

/// The number at the beginning of the bytes; `None` if they are too few, or the letter means none.
pub(crate) fn number(code: u8, bytes: &[u8], is_big_endian: bool) -> Option<f64> {
    fn take<const N: usize>(bytes: &[u8], is_big_endian: bool) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = bytes.get(..N)?.try_into().ok()?;
        if is_big_endian {
            bytes.reverse();
        }
        Some(bytes)
    }
    Some(match code {
        b'b' => f64::from(i8::from_le_bytes(take(bytes, is_big_endian)?)),
        b'B' => f64::from(u8::from_le_bytes(take(bytes, is_big_endian)?)),
        b'h' => f64::from(i16::from_le_bytes(take(bytes, is_big_endian)?)),
        b'H' => f64::from(u16::from_le_bytes(take(bytes, is_big_endian)?)),
        b'i' => f64::from(i32::from_le_bytes(take(bytes, is_big_endian)?)),
        b'I' => f64::from(u32::from_le_bytes(take(bytes, is_big_endian)?)),
        b'f' => f64::from(f32::from_le_bytes(take(bytes, is_big_endian)?)),
        b'q' => i64::from_le_bytes(take(bytes, is_big_endian)?) as f64,
        b'Q' => u64::from_le_bytes(take(bytes, is_big_endian)?) as f64,
        b'd' => f64::from_le_bytes(take(bytes, is_big_endian)?),
        _ => return None,
    })
}

/// Numbers one behind the other, each with its name: `q` that repeats as `q[0]`, `q[1]` stands so in the table. What is
/// behind the end is zero, as MAVLink leaves zeros at the end out.
pub(crate) fn numbers<'a>(fields: &'a [(String, u8)], payload: &[u8], is_big_endian: bool) -> Vec<(&'a str, f64)> {
    let mut at = 0;
    let mut values = Vec::with_capacity(fields.len());
    for (name, code) in fields {
        let code = *code;
        let mut bytes = [0; 8];
        let rest = payload.get(at..).unwrap_or_default();
        let count = rest.len().min(size(code)).min(8);
        bytes[..count].copy_from_slice(&rest[..count]);
        values.extend(number(code, &bytes, is_big_endian).map(|value| (name.as_str(), value)));
        at += size(code);
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against `struct.pack` of Python.
    #[test]
    fn val_numbers() {
        assert_eq!(number(b'h', &[0xfe, 0xff], false), Some(-2.0));
        assert_eq!(number(b'H', &[0x01, 0x02], true), Some(258.0));
        assert_eq!(number(b'f', &[0, 0, 0xc0, 0x3f], false), Some(1.5)); // struct.pack("<f", 1.5)
        assert_eq!(number(b'd', &[0x3f, 0xf8, 0, 0, 0, 0, 0, 0], true), Some(1.5));
        assert_eq!(number(b'i', &[1, 2, 3], false), None);
        assert_eq!(
            numbers(&[("a".to_owned(), b'B'), ("b".to_owned(), b'H')], &[7, 1], false),
            [("a", 7.0), ("b", 1.0)]
        );
    }
}
