//! What keeps the ship from sending, and when that is announced.

use super::{SECOND_US, Topside};
use crate::event::Event;
use crate::gnss::Traffic;
use crate::hold::Hold;
use crate::modem::ClockHealth;

/// A GNSS receiver that was not heard for this long is silent, µs.
const GNSS_SILENT_US: u64 = 5_000_000;
/// So is a modem, which is asked for its clock every 5 s.
const MODEM_SILENT_US: u64 = 12_000_000;
/// A clock report older than this says nothing, µs.
const CLOCK_AGE_US: u64 = 16_000_000;
/// A reason is announced when it has lasted for this long, µs.
const ANNOUNCE_US: u64 = 3_000_000;
/// Modem's clock less GNSS time that whole seconds and late sentences explain, µs.
const CLOCK_AHEAD_US: i64 = 600_000;
const CLOCK_BEHIND_US: i64 = -1_600_000;

impl Topside {
    /// What keeps the ship from sending its state, the first thing to be mended first.
    pub fn hold(&self) -> Option<Hold> {
        let recent = |heard_us: Option<u64>, age_us: u64| {
            // a port that is just open has had no time
            let since = heard_us.or(self.first_us).unwrap_or(self.now_us);
            self.now_us.saturating_sub(since) <= age_us
        };
        let wrong = |traffic: &Traffic, age_us: u64, holds: [Hold; 3]| {
            let [silent, noise, stranger] = holds;
            match traffic {
                _ if !recent(traffic.byte_us, age_us) => Some(silent),
                _ if !recent(traffic.sentence_us, age_us) => Some(noise),
                Traffic { stranger_us: Some(us), .. } if recent(Some(*us), age_us) => Some(stranger),
                _ => None,
            }
        };
        let (gnss, modem) = (&self.gnss, &self.modem);
        wrong(&gnss.traffic, GNSS_SILENT_US, [Hold::GnssSilent, Hold::GnssNoise, Hold::GnssIsModem])
            .or_else(|| {
                wrong(&modem.traffic, MODEM_SILENT_US, [Hold::ModemSilent, Hold::ModemNoise, Hold::ModemIsGnss])
            })
            .or_else(|| (!recent(gnss.rmc_us, GNSS_SILENT_US)).then_some(Hold::GnssNoRmc))
            .or_else(|| (!modem.is_configured()).then_some(Hold::ModemUnconfigured))
            .or_else(|| self.hold_of_ship())
            .or_else(|| self.hold_of_clock())
    }

    fn hold_of_ship(&self) -> Option<Hold> {
        let Some(utc_us) = self.clock.utc_us(self.now_us) else { return Some(Hold::GnssNoFix) };
        match self.ship_at(utc_us) {
            None => Some(Hold::GnssNoFix),
            Some(ship) if ship.sigma_m() > self.config.ship_sigma_max_m => {
                Some(Hold::ShipUncertain { sigma_m: ship.sigma_m() })
            }
            Some(_) => None,
        }
    }

    fn hold_of_clock(&self) -> Option<Hold> {
        let fresh = |clock: &&ClockHealth| self.now_us.saturating_sub(clock.time_us) <= CLOCK_AGE_US;
        let Some(clock) = self.modem.clock.as_ref().filter(fresh) else { return Some(Hold::ModemClockUnknown) };
        if !clock.has_pulse() {
            return Some(Hold::NoPulse);
        }
        if !clock.is_set() {
            return Some(Hold::ModemClockUnset);
        }
        if let Some(utc_us) = self.clock.utc_us(clock.time_us) {
            let ahead_us = (clock.utc_s * SECOND_US) as i64 - utc_us as i64;
            if !(CLOCK_BEHIND_US..=CLOCK_AHEAD_US).contains(&ahead_us) {
                return Some(Hold::ClockDiffers { by_s: (ahead_us + 1_000_000).div_euclid(1_000_000) });
            }
        }
        self.off_pulse.map(|(by_s, _)| Hold::OffPulse { by_s })
    }

    pub(super) fn announce(&mut self) {
        let hold = self.hold();
        let name = |hold: &Option<Hold>| hold.as_ref().map(Hold::name);
        if name(&hold) != name(&self.hold_since.0) {
            self.hold_since = (hold, self.now_us);
        }
        let lasts = hold.is_none() || self.now_us.saturating_sub(self.hold_since.1) >= ANNOUNCE_US;
        if lasts && name(&hold) != name(&self.announced) {
            self.announced = hold;
            self.note(Event::Hold(hold));
        }
    }
}
