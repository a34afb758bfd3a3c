//! What the board's drivers say of themselves: received bytes that they lost, the board's own log, its hardware.

use backseat_wire::hostlink::{BoardLog, Hardware, Port};

/// As last reported.
#[derive(Clone, Copy, Debug)]
pub struct Drivers {
    /// So often each port's driver has lost bytes since start, in the order of [`Port::ALL`].
    pub receive_losses: [u32; 5],
    /// The board's own log.
    pub log: BoardLog,
    /// Where the board has some.
    pub hardware: Option<Hardware>,
    /// Not yet reported to the host.
    pub news: bool,
}

impl Drivers {
    pub const NONE: Self = Self { receive_losses: [0; 5], log: BoardLog::NONE, hardware: None, news: false };

    /// A port's driver has lost bytes so often since start.
    pub fn receive_losses(&mut self, port: Port, since_start: u32) {
        if let Some(losses) = self.receive_losses.get_mut(port as usize)
            && *losses != since_start
        {
            *losses = since_start;
            self.news = true;
        }
    }

    /// The board's own log is like this.
    pub fn log(&mut self, log: BoardLog) {
        self.news |= log != self.log;
        self.log = log;
    }

    /// The board's hardware is like this. The host is told at once of what should not happen.
    pub fn hardware(&mut self, hardware: Hardware) {
        let rare = |hardware: Option<Hardware>| hardware.map_or((0, [0; 2]), |h| (h.supply_dips, h.wrong_bits));
        self.news |= rare(Some(hardware)) != rare(self.hardware);
        self.hardware = Some(hardware);
    }
}
