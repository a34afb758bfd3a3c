//! A signed request as a message carries it; `signing` makes and checks it.

use serde::{Deserialize, Serialize};

/// A request and its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Signed<'a> {
    /// Larger than that of any request before.
    pub counter: u64,
    /// SipHash-2-4.
    pub code: u64,
    /// The request, postcard.
    pub request: &'a [u8],
}
