//! What leaves: the modem's clock, the packet or the ping of each slot, the abort.

use super::{Outgoing, SECOND_US, Sent, Topside};
use crate::event::Event;
use crate::hold::Hold;
use crate::slots::Exchange;
use backseat_wire::abort::Abort;
use backseat_wire::calendar::DateTime;
use backseat_wire::modem::{Addresses, Cycle, Data, DataRequest, Payload, ToModem};
use backseat_wire::ship_state::{AUTHENTIC_LENGTH, ShipState};
use heapless::Vec;

/// A sentence to the modem: a cycle, or a frame of 32 bytes.
pub(super) const SENTENCE: usize = 128;
/// A slot is missed if its cycle could not begin within this of its time, µs.
const SLOT_LATE_US: u64 = 400_000;
/// A packet that left this long after its second did not leave on the pulse, µs: 7.5 m.
const OFF_PULSE_US: u64 = 5_000;
/// After a packet off the pulse nothing is sent for this long, µs.
const OFF_PULSE_HOLD_US: u64 = 60_000_000;
/// An abort is said in so many downlink slots: of packets that are lost one time in ten, three in a thousand times.
pub const ABORT_PACKETS: u8 = 3;

/// Why no abort is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AbortRefused {
    /// Without a key no vehicle believes it.
    #[error("no abort without a key: set modem.key to the vehicle's app.acoustic_key")]
    NoKey,
    /// The cycle has no slot in which the ship sends.
    #[error("the cycle has no downlink slot, in which an abort could leave")]
    NoDownlink,
    /// No vehicle of this modem address is in the configuration.
    #[error("no vehicle has the modem address {0}")]
    Stranger(u8),
}

/// What an abort still has to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PendingAbort {
    /// Modem address of the vehicle, or that of everybody.
    destination: u8,
    /// Packets that have still to leave.
    left: u8,
}

impl Topside {
    /// Ends the mission of a vehicle, or with [`EVERYBODY`](backseat_wire::abort::EVERYBODY) of all that have the key:
    /// the next [`ABORT_PACKETS`] downlink slots carry the abort in place of the ship's state. It needs no pulse, because
    /// it is no range. It cannot be taken back.
    ///
    /// # Errors
    /// Without a key, without a downlink slot, for a vehicle that is not in the list.
    pub fn abort(&mut self, destination: u8) -> Result<(), AbortRefused> {
        if !self.config.key.is_set() {
            return Err(AbortRefused::NoKey);
        }
        if !self.config.slots.slots().iter().any(|slot| slot.exchange == Exchange::Downlink) {
            return Err(AbortRefused::NoDownlink);
        }
        if destination != backseat_wire::abort::EVERYBODY && !self.config.vehicles.contains(&destination) {
            return Err(AbortRefused::Stranger(destination));
        }
        self.abort = Some(PendingAbort { destination, left: ABORT_PACKETS });
        self.note(Event::AbortAsked { destination });
        Ok(())
    }

    /// To whom an abort is being sent, and how many packets of it have still to leave.
    pub fn aborting(&self) -> Option<(u8, u8)> {
        self.abort.map(|abort| (abort.destination, abort.left))
    }

    /// Whether a downlink may begin: an abort, like a ping, needs no common clock.
    fn may_send(&self, is_abort: bool) -> bool {
        self.hold().is_none_or(|hold: Hold| is_abort && hold.permits_pings())
    }

    /// Sets the modem's clock early in a second: its pulse has the rest.
    pub(super) fn set_modem_clock(&mut self) {
        let unset = self.modem.clock.as_ref().is_some_and(|clock| !clock.is_set());
        if !unset || !self.config.set_modem_clock || !self.modem.is_configured() {
            self.set_clock = false;
            return;
        }
        let Some(utc_us) = self.clock.utc_us(self.now_us) else { return };
        let early = (50_000..300_000).contains(&(utc_us % SECOND_US));
        if early
            && !self.set_clock
            && let Ok(time) = DateTime::from_unix_us(utc_us - utc_us % SECOND_US)
        {
            self.set_clock = true;
            self.send(&ToModem::SetTime { time, mode: 0 });
        }
    }

    pub(super) fn send(&mut self, sentence: &ToModem<'_>) {
        let mut buffer = [0; SENTENCE];
        if let Ok(bytes) = sentence.emit(&mut buffer) {
            self.out.push(bytes);
        }
    }

    /// Begins the next slot when its time has come.
    pub(super) fn begin_slot(&mut self) {
        let Some(utc_us) = self.clock.utc_us(self.now_us) else { return };
        let lead_us = (self.config.slots.airtime().lead_s * 1.0e6) as u64;
        let earliest_s = (utc_us.saturating_sub(SLOT_LATE_US) / SECOND_US).max(self.begun_s + 1);
        let mut from_s = earliest_s;
        // the slots that could begin by now
        while let Some((launch_s, slot)) = self.config.slots.next(from_s) {
            let lead_us = if slot.exchange == Exchange::Downlink { lead_us } else { 0 };
            let begins_us = (launch_s * SECOND_US).saturating_sub(lead_us);
            if launch_s * SECOND_US > utc_us + lead_us.max(SECOND_US) {
                return;
            }
            from_s = launch_s + 1;
            if utc_us < begins_us {
                continue;
            }
            self.begun_s = launch_s;
            if utc_us <= begins_us + SLOT_LATE_US {
                self.begin(slot.exchange, launch_s);
            }
        }
    }

    fn begin(&mut self, exchange: Exchange, launch_s: u64) {
        let source = self.config.address;
        match exchange {
            Exchange::Downlink if self.may_send(self.abort.is_some()) => {
                let Ok(transmit_s) = u32::try_from(launch_s) else { return };
                self.sequence = self.sequence.wrapping_add(1);
                let abort = self.abort.map(|abort| abort.destination);
                self.outgoing = Some(Outgoing { transmit_s, sequence: self.sequence, abort, answered: false });
                let addresses = Addresses { source, destination: self.config.destination };
                let rate = self.config.rate;
                self.send(&ToModem::Cycle(Cycle { addresses, rate, acknowledge: false, frames: 1 }));
            }
            Exchange::Ping { vehicle } if self.may_send(true) => {
                self.send(&ToModem::Ping(Addresses { source, destination: vehicle }));
                let utc_us = self.clock.utc_us(self.now_us).unwrap_or(launch_s * SECOND_US);
                self.ping = Some((vehicle, utc_us));
                self.note(Event::PingSent { vehicle });
            }
            _ => {}
        }
    }

    /// The modem asks for the frame that leaves on its next pulse.
    pub(super) fn answer(&mut self, request: &DataRequest) {
        let Some(outgoing) = self.outgoing.filter(|outgoing| !outgoing.answered) else { return };
        if request.addresses.source != self.config.address {
            return;
        }
        if let Some(destination) = outgoing.abort {
            self.answer_abort(request, outgoing, destination);
            return;
        }
        let slot_us = u64::from(outgoing.transmit_s) * SECOND_US;
        let leaves_s = (request.time.nearest(slot_us) / SECOND_US + 1) as u32;
        if leaves_s != outgoing.transmit_s {
            self.outgoing = None;
            self.note(Event::AskedOffTime { transmit_s: outgoing.transmit_s, leaves_s });
            return;
        }
        // a pulse may have been lost since the cycle began
        let Some(state) = self.ship_state(&outgoing).filter(|_| self.may_send(false)) else { return };
        let key = &self.config.key;
        let payload: Result<Vec<u8, AUTHENTIC_LENGTH>, _> = if key.is_set() {
            state.emit_authentic(key).map(|bytes| bytes.into_iter().collect())
        } else {
            state.emit().map(|bytes| bytes.into_iter().collect())
        };
        let Ok(payload) = payload else { return };
        self.hand_over(request, outgoing, &payload);
        self.last_sent = Some(Sent { state, time_us: self.now_us });
        self.sent = self.sent.saturating_add(1);
        self.note(Event::Sent { transmit_s: outgoing.transmit_s, sequence: outgoing.sequence });
    }

    /// The abort names the second of its slot whatever the modem's clock says: a vehicle takes it for a minute.
    fn answer_abort(&mut self, request: &DataRequest, outgoing: Outgoing, destination: u8) {
        let transmit_s = outgoing.transmit_s;
        let Ok(payload) = (Abort { destination, transmit_s }).emit_authentic(&self.config.key) else { return };
        self.hand_over(request, outgoing, &payload);
        let left = self.abort.map_or(0, |abort| abort.left.saturating_sub(1));
        self.abort = (left > 0).then_some(PendingAbort { destination, left });
        self.note(Event::AbortSent { destination, transmit_s, left });
    }

    fn hand_over(&mut self, request: &DataRequest, outgoing: Outgoing, payload: &[u8]) {
        let addresses = request.addresses;
        self.send(&ToModem::Data(Data { addresses, acknowledge: false, payload: Payload::new(payload) }));
        self.outgoing = Some(Outgoing { answered: true, ..outgoing });
    }

    fn ship_state(&self, outgoing: &Outgoing) -> Option<ShipState> {
        let ship = self.ship_at(u64::from(outgoing.transmit_s) * SECOND_US)?;
        let (latitude, longitude) = self.frame?.to_geodetic(ship.position_m);
        Some(ShipState {
            source: self.config.address,
            sequence: outgoing.sequence,
            transmit_s: outgoing.transmit_s,
            position_deg: [latitude, longitude],
            velocity_mps: ship.velocity_mps,
            position_sigma_m: ship.sigma_m(),
            velocity_sigma_mps: ship.velocity_sigma_mps[0].max(ship.velocity_sigma_mps[1]),
            transducer_depth_m: self.config.transducer_depth_m,
        })
    }

    /// The modem says when the packet left.
    pub(super) fn left(&mut self, left_us: u64) {
        let Some(outgoing) = self.outgoing.filter(|outgoing| outgoing.answered) else { return };
        self.outgoing = None;
        let named_us = u64::from(outgoing.transmit_s) * SECOND_US;
        let by_us = left_us as i64 - named_us as i64;
        if by_us.unsigned_abs() > OFF_PULSE_US {
            self.off_pulse = Some((by_us as f64 * 1.0e-6, self.now_us.saturating_add(OFF_PULSE_HOLD_US)));
            self.modem.configure_again(self.now_us);
        }
    }
}
