//! Common data representation of the OMG (CDR, little and big endian), as ROS 2 writes it.

/// A message that is read from its beginning on; every value is `None` behind the end.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_little: bool,
}

impl<'a> Cdr<'a> {
    pub(super) fn new(message: &'a [u8]) -> Option<Self> {
        let (head, bytes) = message.split_at_checked(4)?;
        Some(Self { bytes, at: 0, is_little: head[1] & 1 == 1 })
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes: [u8; N] = self.bytes.get(self.at..self.at.checked_add(N)?)?.try_into().ok()?;
        self.at += N;
        if !self.is_little {
            bytes.reverse();
        }
        Some(bytes)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    pub(super) fn short(&mut self) -> Option<i16> {
        self.take().map(i16::from_le_bytes)
    }

    pub(super) fn int(&mut self) -> Option<i32> {
        self.take().map(i32::from_le_bytes)
    }

    pub(super) fn float(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    pub(super) fn double(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    pub(super) fn doubles(&mut self, count: usize) -> Option<Vec<f64>> {
        (0..count).map(|_| self.double()).collect()
    }

    /// Number of elements that follow.
    pub(super) fn length(&mut self) -> Option<usize> {
        usize::try_from(self.int()?).ok()
    }

    /// A text without the zero at its end.
    pub(super) fn string(&mut self) -> Option<&'a [u8]> {
        let length = self.length()?;
        let text = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(text.strip_suffix(&[0]).unwrap_or(text))
    }

    /// The stamp of a header, µs since its clock began.
    pub(super) fn header_us(&mut self) -> Option<i64> {
        let (seconds, nanoseconds) = (self.int()?, self.int()? as u32);
        self.string()?; // frame_id
        Some(i64::from(seconds) * 1_000_000 + i64::from(nanoseconds) / 1000)
    }
}
