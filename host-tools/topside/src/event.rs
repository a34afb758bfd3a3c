//! What happened: for logs and screens, in order.

use crate::hold::Hold;
use crate::track::Ranging;
use backseat_wire::named::Named;
use backseat_wire::vehicle_state::VehicleState;

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// What keeps the ship from sending has changed.
    Hold(Option<Hold>),
    /// A packet with the ship's state left.
    Sent {
        /// Its second, since 1970.
        transmit_s: u32,
        /// Its number.
        sequence: u8,
    },
    /// A packet that was due did not leave: the modem did not ask for it in time.
    NotSent {
        /// Its second, since 1970.
        transmit_s: u32,
    },
    /// The modem asked for data at another time than the slot's.
    AskedOffTime {
        /// The second of the slot, since 1970.
        transmit_s: u32,
        /// The second at which the packet would leave by the modem's clock.
        leaves_s: u32,
    },
    /// A vehicle's uplink was heard.
    Uplink {
        /// What it says.
        state: VehicleState,
        /// Distance by its time of flight, m; `None` without a common clock.
        range_m: Option<f64>,
    },
    /// A vehicle names other causes than before.
    Named {
        /// The vehicle's modem address.
        vehicle: u8,
        /// What its last packet names.
        named: Named,
    },
    /// A range to a vehicle, and what its track made of it.
    Range(Ranging),
    /// A ping was sent.
    PingSent {
        /// To this vehicle.
        vehicle: u8,
    },
    /// A vehicle pinged.
    PingHeard {
        /// Its modem address.
        vehicle: u8,
    },
    /// A minipacket was heard: 13 bits that mean nothing to this program.
    Minipacket {
        /// From this address.
        source: u8,
        /// Its bits.
        bits: u16,
    },
    /// A packet that is no uplink of a known vehicle, or is broken or forged.
    Refused {
        /// From this address.
        source: u8,
        /// Its authentication code is wrong or missing.
        forged: bool,
    },
    /// The mission of a vehicle is to be ended.
    AbortAsked {
        /// Its modem address, or that of everybody.
        destination: u8,
    },
    /// An abort left.
    AbortSent {
        /// To this modem address, or to everybody.
        destination: u8,
        /// Its second, since 1970.
        transmit_s: u32,
        /// So many packets of it are still to leave.
        left: u8,
    },
    /// The ship's receiver says, five times in a row, that the ship is elsewhere.
    ShipJumped {
        /// So far from where it was expected, m.
        by_m: f64,
    },
    /// The fixes of the ship's receiver move and its speed over ground does not, or otherwise.
    ShipWalked {
        /// By so much, m.
        by_m: f64,
    },
    /// The modem started again and gets its settings anew.
    ModemRestarted,
}
