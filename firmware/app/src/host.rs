//! The host link's state: queue of messages, permissions.

use crate::held::Held;
use crate::mission::MissionTransfer;
use crate::ring::Ring;
use crate::store::{CRASHES, FINGERPRINT};
use backseat_wire::hostlink::{FromBoard, ImageId, KeptCrash, MAX_FRAME, Refusal, Restart, Signed, ToBoard, encode};
use backseat_wire::ship_state::Key;
use heapless::Vec;

/// Bytes that may wait for the host: some twenty steps of telemetry.
pub const HOST_RING: usize = 8192;
/// Those of them that only answers may take: who asks is answered, however long nobody has read what the board reports.
const FOR_ANSWERS: usize = 1024;

/// First four bytes of the commit that this release was made from (`.ci/release`); 0: no release.
pub const COMMIT: u32 = match option_env!("BACKSEAT_COMMIT") {
    Some(digits) => match u32::from_str_radix(digits, 16) {
        Ok(commit) => commit,
        Err(_) => panic!("BACKSEAT_COMMIT: expected the first eight digits of a commit"),
    },
    None => 0,
};

/// Queues the answer to a request of the host.
pub fn send(out: &mut Ring<HOST_RING>, message: &FromBoard<'_>) {
    queue(out, message, 0);
}

/// Queues what the host did not ask for.
pub fn report(out: &mut Ring<HOST_RING>, message: &FromBoard<'_>) {
    queue(out, message, FOR_ANSWERS);
}

fn queue(out: &mut Ring<HOST_RING>, message: &FromBoard<'_>, spare: usize) {
    let mut buffer = [0; MAX_FRAME];
    // every message fits a frame
    if let Ok(frame) = encode(message, &mut buffer) {
        out.push_sparing(frame, spare);
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
    /// Crashes before the last that no card has got, the oldest first.
    pub earlier_crashes: Vec<KeptCrash, CRASHES>,
    /// Build ID and CRC-32 of the image that runs.
    pub build: u32,
    pub crc: u32,
    /// Another at each start of the board: what was signed for an earlier one is worth nothing.
    pub challenge: u64,
    /// Of the last signed request that was taken.
    pub counter: u64,
    /// Requests refused since start.
    pub refused: u32,
}

/// A request, and whether it may do all that its kind may: it is signed, or there is no key.
pub type Trusted<'a> = (ToBoard<'a>, bool);

impl Host {
    pub const fn new() -> Self {
        Self {
            transfer: MissionTransfer::new(),
            mission_refused: Held::none(),
            unlocked_us: 0,
            key_us: 0,
            last_restart: Held::none(),
            earlier_crashes: Vec::new(),
            build: 0,
            crc: 0,
            challenge: 0,
            counter: 0,
            refused: 0,
        }
    }

    /// The image that runs.
    pub fn image(&self) -> ImageId {
        ImageId { build: self.build, crc: self.crc, commit: COMMIT, parameters: FINGERPRINT }
    }

    /// Why the board started, and what ended it before.
    pub fn tell_start(&self, out: &mut Ring<HOST_RING>) {
        if let Some(&restart) = self.last_restart.get() {
            send(out, &FromBoard::Restart(restart));
            self.earlier_crashes.iter().for_each(|crash| send(out, &FromBoard::EarlierCrash(*crash)));
        }
    }

    /// What a message asks for, if its sender may ask for it. With a key, what changes a flight has to be signed; a
    /// request that was taken is not taken again, be it replayed by whomever.
    #[inline(never)] // two messages at once on the stack, and no more of it
    pub fn admit<'a>(&mut self, message: ToBoard<'a>, key: &Key) -> Result<Trusted<'a>, Refusal> {
        let admitted = match message {
            ToBoard::Signed(signed) => self.open(&signed, key),
            request if key.is_set() && request.changes_a_flight() => Err(Refusal::Unsigned),
            request => Ok((request, !key.is_set())),
        };
        if admitted.is_err() {
            self.refused = self.refused.saturating_add(1);
        }
        admitted
    }

    fn open<'a>(&mut self, signed: &Signed<'a>, key: &Key) -> Result<Trusted<'a>, Refusal> {
        if key.is_set() && (signed.counter <= self.counter || !signed.is_authentic(key, self.challenge)) {
            return Err(Refusal::Forged);
        }
        self.counter = self.counter.max(signed.counter);
        signed.request().map(|request| (request, true)).map_err(|_| Refusal::Forged)
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
