//! Losses of received bytes, as the board's drivers count them.

use backseat_wire::hostlink::Port;

/// So often each port's driver has lost bytes.
#[derive(Clone, Copy, Debug)]
pub struct ReceiveLosses {
    /// In the order of [`Port::ALL`].
    pub since_start: [u32; 5],
    /// Not yet reported to the host.
    pub news: bool,
}

impl ReceiveLosses {
    pub const NONE: Self = Self { since_start: [0; 5], news: false };

    /// A port's driver has lost bytes so often since start.
    pub fn note(&mut self, port: Port, since_start: u32) {
        if let Some(losses) = self.since_start.get_mut(port as usize)
            && *losses != since_start
        {
            *losses = since_start;
            self.news = true;
        }
    }
}
