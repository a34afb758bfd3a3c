//! The TDMA cycle: who sends when.
//!
//! A cycle begins whenever the seconds since 1970 are a multiple of its period, so that ship and vehicles need no other
//! agreement. A slot is named by the whole second of its cycle at which the packet that carries the range leaves; a
//! data packet is preceded by its cycle-initialisation packet.

use heapless::Vec;

/// Most slots of a cycle.
pub const MAX_SLOTS: usize = 16;
/// Longest cycle, s.
const MAX_PERIOD_S: u32 = 3600;

/// What happens in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// The ship sends its state: a one-way range at every vehicle.
    Downlink,
    /// A vehicle sends its state: a one-way range at the ship.
    Uplink {
        /// Its modem address.
        vehicle: u8,
    },
    /// The ship pings a vehicle: a two-way range at the ship.
    Ping {
        /// Its modem address.
        vehicle: u8,
    },
    /// A vehicle pings the ship: a two-way range at the vehicle.
    VehiclePing {
        /// Its modem address.
        vehicle: u8,
    },
}

impl Exchange {
    /// Name in files and on screens.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Downlink => "downlink",
            Self::Uplink { .. } => "uplink",
            Self::Ping { .. } => "ping",
            Self::VehiclePing { .. } => "vehicle_ping",
        }
    }

    /// The vehicle it is about; a downlink is for all.
    #[must_use]
    pub const fn vehicle(self) -> Option<u8> {
        match self {
            Self::Downlink => None,
            Self::Uplink { vehicle } | Self::Ping { vehicle } | Self::VehiclePing { vehicle } => Some(vehicle),
        }
    }

    const fn starts_at_ship(self) -> bool {
        matches!(self, Self::Downlink | Self::Ping { .. })
    }

    const fn is_ping(self) -> bool {
        matches!(self, Self::Ping { .. } | Self::VehiclePing { .. })
    }
}

/// One slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Launch after the start of the cycle, s.
    pub offset_s: u32,
    /// What happens.
    pub exchange: Exchange,
}

/// How long things take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Airtime {
    /// From the command of a cycle to the launch of its data packet, s.
    pub lead_s: f64,
    /// A data packet, s.
    pub packet_s: f64,
    /// A ping or its reply, s.
    pub ping_s: f64,
    /// From a ping's arrival to its reply, s.
    pub turnaround_s: f64,
    /// Longest flight, s.
    pub flight_s: f64,
}

impl Airtime {
    /// FSK packets of 32 bytes within 3 km.
    pub const REFERENCE: Self = Self { lead_s: 1.5, packet_s: 3.6, ping_s: 0.9, turnaround_s: 1.0, flight_s: 2.0 };

    /// When a slot occupies ship and vehicle, s after its launch, if the sound travels for `flight_s`.
    fn occupied(&self, exchange: Exchange, flight_s: f64) -> [[f64; 2]; 2] {
        let (begins_s, ends_s) = if exchange.is_ping() {
            (0.0, self.turnaround_s + 2.0 * self.ping_s)
        } else {
            (-self.lead_s, self.packet_s)
        };
        let near = [begins_s, if exchange.is_ping() { ends_s + 2.0 * flight_s } else { ends_s }];
        let far = [begins_s + flight_s, ends_s + flight_s];
        if exchange.starts_at_ship() { [near, far] } else { [far, near] }
    }
}

/// A cycle whose slots do not overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct SlotTable {
    period_s: u32,
    /// In order of their offsets.
    slots: Vec<Slot, MAX_SLOTS>,
    airtime: Airtime,
}

impl SlotTable {
    /// One downlink every 30 s.
    #[must_use]
    pub fn reference() -> Self {
        let mut slots = Vec::new();
        // there is room
        let _ = slots.push(Slot { offset_s: 0, exchange: Exchange::Downlink });
        Self { period_s: 30, slots, airtime: Airtime::REFERENCE }
    }

    /// A cycle of `period_s` seconds.
    ///
    /// # Errors
    /// A cycle without slots or with too many, a slot outside it, two that overlap at the ship or at a vehicle, with
    /// sound that travels for any time up to the longest.
    pub fn new(period_s: u32, slots: &[Slot], airtime: Airtime) -> Result<Self, SlotError> {
        if period_s == 0 || period_s > MAX_PERIOD_S {
            return Err(SlotError::Period(period_s));
        }
        if slots.is_empty() || slots.len() > MAX_SLOTS {
            return Err(SlotError::Count(slots.len()));
        }
        let times = [airtime.lead_s, airtime.packet_s, airtime.ping_s, airtime.turnaround_s, airtime.flight_s];
        if !times.iter().all(|time| (0.0..=60.0).contains(time)) {
            return Err(SlotError::Airtime);
        }
        let mut sorted: Vec<Slot, MAX_SLOTS> = Vec::new();
        for slot in slots {
            if slot.offset_s >= period_s {
                return Err(SlotError::Outside { offset_s: slot.offset_s, period_s });
            }
            // there is room
            let _ = sorted.push(*slot);
        }
        sorted.sort_unstable_by_key(|slot| slot.offset_s);
        let period = f64::from(period_s);
        for (index, first) in sorted.iter().enumerate() {
            for second in sorted.iter().skip(index + 1) {
                check(first, second, f64::from(second.offset_s - first.offset_s), period, &airtime)?;
            }
            check(first, first, period, period, &airtime)?;
        }
        Ok(Self { period_s, slots: sorted, airtime })
    }

    /// Length of the cycle, s.
    pub const fn period_s(&self) -> u32 {
        self.period_s
    }

    /// The slots in the order of their offsets.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// How long things take.
    pub const fn airtime(&self) -> &Airtime {
        &self.airtime
    }

    /// The next launch at or after `from_s` (seconds since 1970), and its slot.
    pub fn next(&self, from_s: u64) -> Option<(u64, Slot)> {
        let period_s = u64::from(self.period_s);
        let within = from_s % period_s;
        let cycle = from_s - within;
        let later = self.slots.iter().find(|slot| u64::from(slot.offset_s) >= within);
        match later {
            Some(slot) => Some((cycle + u64::from(slot.offset_s), *slot)),
            None => self.slots.first().map(|slot| (cycle + period_s + u64::from(slot.offset_s), *slot)),
        }
    }
}

/// Whether two slots, the second `gap_s` after the first, or each and the other in the next cycle overlap anywhere.
fn check(first: &Slot, second: &Slot, gap_s: f64, period_s: f64, airtime: &Airtime) -> Result<(), SlotError> {
    // Two vehicles are at different distances; what one vehicle hears has travelled the same way.
    let vehicles = (first.exchange.vehicle(), second.exchange.vehicle());
    let apart = matches!(vehicles, (Some(a), Some(b)) if a != b);
    for (place, at_ship) in [(0, true), (1, false)] {
        if !at_ship && apart {
            continue;
        }
        for near in [0.0, airtime.flight_s] {
            for far in if apart { [0.0, airtime.flight_s] } else { [near; 2] } {
                let spans = |exchange, flight_s| airtime.occupied(exchange, flight_s).get(place).copied();
                let (Some(a), Some(b)) = (spans(first.exchange, near), spans(second.exchange, far)) else { continue };
                // the second after the first, and the first of the next cycle after the second
                let back_s = b[1] - a[0] - if gap_s < period_s { period_s - gap_s } else { period_s };
                let overlap_s = (a[1] - b[0] - gap_s).max(back_s);
                // a tenth of a millisecond of rounding
                if overlap_s > 1.0e-4 {
                    let flight_s = near.max(far);
                    return Err(SlotError::Overlap { first: *first, second: *second, overlap_s, at_ship, flight_s });
                }
            }
        }
    }
    Ok(())
}

/// Why slots do not make a cycle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SlotError {
    /// Length of the cycle.
    #[error("a cycle of {0} s: expected 1 to {MAX_PERIOD_S} s")]
    Period(u32),
    /// Number of slots.
    #[error("{0} slots: expected 1 to {MAX_SLOTS}")]
    Count(usize),
    /// A duration is negative, not a number or absurd.
    #[error("durations of packets and flights: expected 0 to 60 s each")]
    Airtime,
    /// A slot outside its cycle.
    #[error("the slot at {offset_s} s is outside the cycle of {period_s} s")]
    Outside {
        /// The slot, s.
        offset_s: u32,
        /// The cycle, s.
        period_s: u32,
    },
    /// Two slots, or a slot and itself in the next cycle.
    #[error(
        "the slots at {} s ({}) and {} s ({}) overlap by {overlap_s:.1} s at the {} when sound travels for {flight_s:.2} s: \
         move them apart, or declare shorter packets or a shorter longest range",
        .first.offset_s,
        .first.exchange.name(),
        .second.offset_s,
        .second.exchange.name(),
        if *.at_ship { "ship" } else { "vehicle" }
    )]
    Overlap {
        /// One.
        first: Slot,
        /// The other.
        second: Slot,
        /// By so much, s.
        overlap_s: f64,
        /// At the ship rather than at the vehicle.
        at_ship: bool,
        /// With sound that travels for so long, s.
        flight_s: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const AIRTIME: Airtime = Airtime { lead_s: 1.5, packet_s: 3.0, ping_s: 0.9, turnaround_s: 1.0, flight_s: 0.4 };

    /// Table 3.3 of the thesis.
    fn cycle_at_sea() -> [Slot; 5] {
        let slot = |offset_s, exchange| Slot { offset_s, exchange };
        [
            slot(0, Exchange::Uplink { vehicle: 2 }),
            slot(5, Exchange::Downlink),
            slot(10, Exchange::Downlink),
            slot(15, Exchange::Downlink),
            slot(20, Exchange::VehiclePing { vehicle: 2 }),
        ]
    }

    #[test]
    fn val_the_cycle_of_the_thesis_fits_within_600_m() {
        // The uplink ends at the ship 3.0 s + 0.4 s after its launch; the ship begins the next slot 1.5 s before 5 s.
        let table = SlotTable::new(30, &cycle_at_sea(), AIRTIME).unwrap();
        let launches: std::vec::Vec<_> = (0..6)
            .scan(1_748_952_001_u64, |from_s, _| {
                let (launch_s, slot) = table.next(*from_s).unwrap();
                *from_s = launch_s + 1;
                Some((launch_s - 1_748_952_000, slot.exchange.name()))
            })
            .collect();
        // 1748952000 is a multiple of 30
        let expected = [
            (5, "downlink"),
            (10, "downlink"),
            (15, "downlink"),
            (20, "vehicle_ping"),
            (30, "uplink"),
            (35, "downlink"),
        ];
        assert_eq!(launches, expected);
    }

    #[test]
    fn what_overlaps_is_refused_with_both_slots() {
        // 0.2 s of flight more: 3.6 s after the launch, 0.1 s into the next slot
        let airtime = Airtime { flight_s: 0.6, ..AIRTIME };
        let text = SlotTable::new(30, &cycle_at_sea(), airtime).unwrap_err().to_string();
        assert!(
            text.starts_with("the slots at 0 s (uplink) and 5 s (downlink) overlap by 0.1 s at the ship"),
            "{text}"
        );
        // a ping of 0.9 s, 1 s, 0.9 s and twice 2 s is over after 6.8 s
        let far = Airtime { flight_s: 2.0, ..AIRTIME };
        let ping = Slot { offset_s: 0, exchange: Exchange::Ping { vehicle: 2 } };
        let after = |offset_s| SlotTable::new(30, &[ping, Slot { offset_s, exchange: Exchange::Downlink }], far);
        assert!(after(8).is_err() && after(9).is_ok());
        // the last slot runs into the next cycle
        let late =
            [Slot { offset_s: 28, exchange: Exchange::Downlink }, Slot { offset_s: 0, exchange: Exchange::Downlink }];
        assert!(matches!(SlotTable::new(30, &late, AIRTIME), Err(SlotError::Overlap { .. })));
        // one slot against itself
        assert!(SlotTable::new(4, &late[1..], AIRTIME).is_err() && SlotTable::new(5, &late[1..], AIRTIME).is_ok());
        // the same second twice
        let twice = [late[1], Slot { offset_s: 0, exchange: Exchange::Uplink { vehicle: 2 } }];
        assert!(matches!(SlotTable::new(30, &twice, AIRTIME), Err(SlotError::Overlap { .. })));
        assert!(matches!(SlotTable::new(30, &[late[1]; 2], AIRTIME), Err(SlotError::Overlap { .. })));
    }

    #[test]
    fn cycles_without_sense_are_refused() {
        let slot = Slot { offset_s: 30, exchange: Exchange::Downlink };
        assert_eq!(SlotTable::new(30, &[slot], AIRTIME), Err(SlotError::Outside { offset_s: 30, period_s: 30 }));
        assert_eq!(SlotTable::new(30, &[], AIRTIME), Err(SlotError::Count(0)));
        assert_eq!(SlotTable::new(0, &[slot], AIRTIME), Err(SlotError::Period(0)));
        let airtime = Airtime { packet_s: f64::NAN, ..AIRTIME };
        assert_eq!(SlotTable::new(60, &[slot], airtime), Err(SlotError::Airtime));
    }

    #[test]
    fn two_vehicles_at_different_distances_are_kept_apart_at_the_ship() {
        let uplinks = |gap| {
            [
                Slot { offset_s: 0, exchange: Exchange::Uplink { vehicle: 2 } },
                Slot { offset_s: gap, exchange: Exchange::Uplink { vehicle: 3 } },
            ]
        };
        // the first far away ends at 3.0 + 0.6, the second close by begins 1.5 s before its slot
        let airtime = Airtime { flight_s: 0.6, ..AIRTIME };
        assert!(SlotTable::new(30, &uplinks(5), airtime).is_err() && SlotTable::new(30, &uplinks(6), airtime).is_ok());
    }
}
