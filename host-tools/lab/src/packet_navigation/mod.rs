//! `cargo lab packet-navigation`: what the vehicle loses when the ship's state arrives in packets.
//!
//! Two filters over one log: *centralized* ([`backseat_estimation::filter`]), which has every GNSS fix of the ship and
//! clones the ship at launch; and *packet-fed* ([`PacketFed`]), to which position and velocity of the ship at launch
//! come in the packet, their error taken as independent of everything, as on the board.

mod command;
mod packet_fed;
mod packets;

pub use command::{Args, run};
pub use packet_fed::{PacketFed, reports, track};
pub use packets::{Packet, lose, packets, thin_fixes};
