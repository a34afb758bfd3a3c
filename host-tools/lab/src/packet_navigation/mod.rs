//! Packet against centralized: what the vehicle loses when the ship's state arrives in packets.
//!
//! Three filters over one log:
//! 1. *centralized* ([`backseat_estimation::filter`]): every GNSS fix of the ship, the ship cloned at launch;
//! 2. *packet-fed* ([`PacketFed`]): position and velocity of the ship at launch come in the packet and
//!    their error is taken as independent of everything, as on the board;
//! 3. *decentralized extended information filter* ([`Deif`]; 2.3.1.1 of the thesis; Webster, Walls, Whitcomb
//!    and Eustice, IEEE Trans. Robotics 29(4), 2013): the packet brings what the ship has *learnt* since an
//!    earlier launch, and the vehicle adds that to what it knows.
//!
//! # Why the third equals the first
//! Given the ship's states s₀ … s_k at the launches, everything the ship measures is independent of the vehicle
//! and of every range, and by the Markov property
//!   p(fixes, s₁ … s_k) = p(s₁, fixes to launch 1) · Π p(s_i, fixes of interval i | s_{i−1}).
//! The factor of interval i is a Gaussian in (s_{i−1}, s_i) alone: the *delta* (Λ, η), to which the ship's prior
//! and all earlier fixes contribute nothing. The first packet has no predecessor: it carries the ship's prior
//! and all fixes so far, with s₀ integrated out. Ranges couple x with s_i; they live on the vehicle only,
//! and the ship's knowledge never needs them, although the centralized filter's estimate of the ship improves
//! by them: the vehicle keeps s_{i−1} *with* its correlation to x until the next delta takes over. Hence at a time of
//! arrival both filters hold the same density, provided that
//! - a delta covers the interval from launch to launch exactly: a fix at the launch belongs before it;
//! - the ship model is linear (it is), so that its information does not depend on a linearisation point, and the
//!   vehicle's model is linearised at the same points (below);
//! - neither filter rejects a measurement: there is no gate here, and the centralized filter's is opened;
//! - no fix falls between launch and arrival; if one does, it reaches the vehicle one packet later.
//!
//! Between arrivals the centralized filter knows more: fixes after the launch correct the ship and,
//! by correlation, the vehicle. That moves its linearisation points, so that a DEIF that linearises at its own
//! estimate agrees to second order only; with the same points it agrees to rounding. [`study()`] shows both.
//!
//! # Lost packets
//! A delta continues from the last launch whose packet the ship *knows* to have been received
//! ([`Delta::origin_us`]): the ship keeps two sums, since that launch and since the last one, and drops the former when
//! an acknowledgement comes. After a loss the next delta covers both intervals; nothing is resent. The vehicle refuses
//! a delta that continues from another launch than the one it holds. (If the acknowledgement itself can be lost, the
//! vehicle must hold every launch it received until a packet continues from a later one.)

mod bits;
mod command;
mod deif;
mod discretisation;
mod information;
mod packet_fed;
mod quantised;
mod ship;
mod study;
mod walk;

pub use command::{Args, run};
pub use deif::{ALL, Deif, DeifError, Moments, OWN};
pub use information::{Information, NotPositive, Step};
pub use packet_fed::{PacketFed, reports};
pub use quantised::{HEADER, Layout, Unsendable};
pub use ship::{Delta, NUMBERS, STATES, ShipInformation};
pub use study::{Difference, Judged, METHODS, Method, study, thin_fixes};
pub use walk::{DeifRun, OnVehicle, Packet, PacketArrival, deltas, lose, packets, walk};
