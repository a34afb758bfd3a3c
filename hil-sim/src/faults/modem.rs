//! Faults of acoustic packets.

use super::{Active, Fault, FaultKind, PacketFault, active};
use crate::observation::{Observation, ObservationKind, OneWay};

/// How a packet comes out of the modem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delivery {
    /// Its data and statistics are late by this, µs.
    pub delay_us: u64,
    /// All of it is repeated after this, µs.
    pub again_us: Option<u64>,
    /// Another modem's.
    pub source: Option<u8>,
    /// Added to the second of its launch, s.
    pub second_offset_s: i32,
    /// It is authenticated with a key that is not the ship's.
    pub forged: bool,
    /// Its payload is that of the packet before.
    pub replayed: bool,
    /// It is an abort for this address.
    pub abort: Option<u8>,
}

/// Distorts packets.
#[derive(Clone, Debug)]
pub struct PacketFaults {
    faults: Vec<Active<PacketFault>>,
    declared_speed_mps: f64,
}

impl PacketFaults {
    /// Those of a scenario in which everybody declares this sound speed.
    pub fn new(faults: &[Fault], seed: u64, declared_speed_mps: f64) -> Self {
        let pick = |kind: &FaultKind| if let FaultKind::Packet(fault) = kind { Some(*fault) } else { None };
        Self { faults: active(faults, seed, pick), declared_speed_mps }
    }

    /// Replaced measurements of the modem and contents of the packet.
    pub fn distort(&mut self, observation: &mut Observation) {
        let time_us = observation.time_us;
        let ObservationKind::Downlink(packet) = &mut observation.kind else { return };
        for Active { what, fault, random } in &mut self.faults {
            if !fault.acts(time_us) {
                continue;
            }
            let speed_mps = self.declared_speed_mps;
            match *what {
                PacketFault::Multipath { share, extra_m } => {
                    // Both drawn for every packet, so that the share does not change the sizes.
                    let [hit, size] = core::array::from_fn(|_| random.uniform());
                    if hit < share {
                        lengthen(packet, size * extra_m / speed_mps, speed_mps);
                    }
                }
                PacketFault::ClockStep { offset_s } => lengthen(packet, offset_s, speed_mps),
                PacketFault::ClockDrift { rate } => {
                    lengthen(packet, rate * (time_us - fault.from_us) as f64 * 1e-6, speed_mps);
                }
                PacketFault::ShipPosition { offset_m, share } if share >= 1.0 || random.uniform() < share => {
                    shift(packet, offset_m);
                }
                PacketFault::ShipWander(wander) => shift(packet, wander.offset_m(time_us - fault.from_us)),
                _ => {}
            }
        }
    }

    /// How a packet that begins to arrive at `time_us` comes out of the modem.
    pub fn delivery(&self, time_us: u64) -> Delivery {
        let mut delivery = Delivery::default();
        for Active { what, fault, .. } in &self.faults {
            if !fault.acts(time_us) {
                continue;
            }
            match *what {
                PacketFault::Late { delay_us } => delivery.delay_us += delay_us,
                PacketFault::Duplicated { delay_us } => delivery.again_us = Some(delay_us),
                PacketFault::WrongSource { address } => delivery.source = Some(address),
                PacketFault::WrongSecond { offset_s } => delivery.second_offset_s += offset_s,
                PacketFault::Forged => delivery.forged = true,
                PacketFault::Replayed => delivery.replayed = true,
                PacketFault::Abort { address } => delivery.abort = Some(address),
                _ => {}
            }
        }
        delivery
    }
}

/// The ship's place as it reports it.
fn shift(packet: &mut OneWay, offset_m: [f64; 2]) {
    for (place, offset) in packet.ship.position_m.iter_mut().zip(offset_m) {
        *place += offset;
    }
}

/// Time of arrival and range as a clock that is ahead measures them.
fn lengthen(packet: &mut OneWay, by_s: f64, speed_mps: f64) {
    packet.toa_us = packet.toa_us.saturating_add_signed((by_s * 1e6).round() as i64);
    packet.range_m += by_s * speed_mps;
}
