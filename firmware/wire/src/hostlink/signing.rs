//! Requests that change a flight, signed by the key that ship and vehicle share.
//!
//! The code is SipHash-2-4 by the key over `host`, challenge (u64), counter (u64), both little-endian, and the request's
//! postcard bytes. The challenge is the board's of this start, so that nothing recorded before is taken again; the
//! counter only grows, so that nothing is taken twice. No acoustic payload begins with `h`: what is signed for one
//! channel is worth nothing on the other.

use super::messages::ToBoard;
use super::signed::Signed;
use super::{Frame, MAX_MESSAGE};
use crate::Error;
use crate::packet::Key;

const DOMAIN: &[u8] = b"host";

impl<'a> Signed<'a> {
    /// Signs a request into `buffer`; [`MAX_MESSAGE`] bytes always do.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn new(
        request: &ToBoard<'_>,
        key: &Key,
        challenge: u64,
        counter: u64,
        buffer: &'a mut [u8],
    ) -> Result<Self, Error> {
        let request = postcard::to_slice(request, buffer).map_err(|_| Error::BufferFull)?;
        Ok(Self { counter, code: code(key, challenge, counter, request), request })
    }

    /// Whether the code is right.
    #[must_use]
    pub fn is_authentic(&self, key: &Key, challenge: u64) -> bool {
        // compared whole: its time reveals nothing
        self.code == code(key, challenge, self.counter, self.request)
    }

    /// The request, whoever signed it.
    ///
    /// # Errors
    /// [`Error::Malformed`] when it is none, or another signed one.
    pub fn request(&self) -> Result<ToBoard<'a>, Error> {
        match Frame::new(self.request).message()? {
            ToBoard::Signed(_) => Err(Error::Malformed),
            request => Ok(request),
        }
    }
}

fn code(key: &Key, challenge: u64, counter: u64, request: &[u8]) -> u64 {
    key.hash_of([DOMAIN, &challenge.to_le_bytes(), &counter.to_le_bytes(), request])
}

impl<'a> ToBoard<'a> {
    /// Whether a board with a key takes this only [`Signed`]: all but questions, of which `KeyBegin` is one.
    #[must_use]
    pub const fn changes_a_flight(&self) -> bool {
        !matches!(
            self,
            Self::Hello
                | Self::ParameterGet { .. }
                | Self::MissionGet { .. }
                | Self::FenceGet { .. }
                | Self::HealthGet
                | Self::KeyBegin
                | Self::ChallengeGet
                | Self::UpdateGet
                | Self::Signed(_)
        )
    }

    /// What is asked for, signed or not; for whoever reads a log.
    ///
    /// # Errors
    /// [`Error::Malformed`] when what was signed is no request.
    pub fn unsigned(self) -> Result<Self, Error> {
        match self {
            Self::Signed(signed) => signed.request(),
            request => Ok(request),
        }
    }
}

// the largest request, a step, signed
const _: () = assert!(481 + 1 + 10 + 10 + 2 <= MAX_MESSAGE);
