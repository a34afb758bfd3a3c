//! The host link's state: queue of messages, permissions.

use crate::held::Held;
use crate::mission::MissionTransfer;
use crate::ring::Ring;
use backseat_wire::hostlink::{FromBoard, MAX_FRAME, Refusal, Restart, encode};

/// Bytes that may wait for the host: some twenty steps of telemetry.
pub const HOST_RING: usize = 8192;

/// Queues one message to the host.
pub fn send(out: &mut Ring<HOST_RING>, message: &FromBoard<'_>) {
    let mut buffer = [0; MAX_FRAME];
    // every message fits a frame
    if let Ok(frame) = encode(message, &mut buffer) {
        out.push(frame);
    }
}

/// Announcements and permissions of the host.
pub struct Host {
    /// A mission on its way in.
    pub transfer: MissionTransfer,
    /// Why there is no mission: the last one was refused.
    pub mission_refused: Held<Refusal>,
    /// Parameters may be written under way until then.
    pub unlocked_us: u64,
    /// A key may come until then.
    pub key_us: u64,
    /// Why the board started.
    pub last_restart: Held<Restart>,
    /// Which image this is, for `Hello`.
    pub build: u32,
}

impl Host {
    pub const fn new() -> Self {
        Self {
            transfer: MissionTransfer::new(),
            mission_refused: Held::none(),
            unlocked_us: 0,
            key_us: 0,
            last_restart: Held::none(),
            build: 0,
        }
    }

    /// Permissions end.
    pub fn restart(&mut self) {
        (self.unlocked_us, self.key_us) = (0, 0);
    }

    /// The host may be sending the key: its bytes are not logged.
    pub fn expects_key(&self, now_us: u64) -> bool {
        now_us < self.key_us
    }
}
