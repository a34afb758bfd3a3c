//! From the modem's sentences to ranges.

use super::devices::ModemSaid;
use super::frame;
use backseat_app::parameters::AppSettings;
use backseat_data::{Column, LogRow};
use backseat_wire::modem::ModemTime;
use backseat_wire::ship_state::ShipState;

/// The packet under way.
#[derive(Default)]
pub struct Acoustics {
    ship: Option<ShipState>,
    arrival: Option<(ModemTime, Option<f64>)>,
    last_transmit_s: Option<u32>,
}

/// A complete packet.
pub struct Packet {
    /// At its time of arrival.
    pub row: LogRow,
    /// The ship at its launch: all that a log of the vehicle knows of the ship's track.
    pub ship: LogRow,
    pub launch_us: u64,
    pub ship_deg: [f64; 2],
}

impl Acoustics {
    /// Takes what the modem says at `time_us`; the packet that it completes.
    pub fn take(
        &mut self,
        said: &ModemSaid,
        time_us: u64,
        utc_offset_us: Option<i64>,
        settings: &AppSettings,
    ) -> Option<Packet> {
        match *said {
            ModemSaid::Begins | ModemSaid::Bad => (self.ship, self.arrival) = (None, None),
            ModemSaid::Ship(ship) => self.ship = Some(ship).filter(|ship| ship.source == settings.ship_address),
            ModemSaid::Arrival(arrival, range_rate_mps) => self.arrival = Some((arrival, range_rate_mps)),
        }
        let (ship, (arrival, range_rate_mps)) = (self.ship?, self.arrival?);
        (self.ship, self.arrival) = (None, None);
        if self.last_transmit_s.replace(ship.transmit_s) == Some(ship.transmit_s) {
            return None;
        }
        // Of the modem's own clock only the time of day is sure; the ship's second has the date.
        let tol_utc_us = u64::from(ship.transmit_s) * 1_000_000;
        let toa_utc_us = arrival.unix_us(tol_utc_us);
        let flight_s =
            toa_utc_us.checked_signed_diff(tol_utc_us)? as f64 * 1e-6 - settings.installation.transducer_delay_s;
        let range_m = settings.installation.sound_speed_mps * flight_s;
        if !(0.0..=settings.range_max_m).contains(&range_m) {
            return None;
        }
        let log_us = |utc_us: u64| utc_offset_us.and_then(|offset_us| utc_us.checked_add_signed(-offset_us));
        // Without UTC the packet stands where its last sentence came.
        let toa_us = log_us(toa_utc_us).unwrap_or(time_us);
        let tol_us = log_us(tol_utc_us).unwrap_or_else(|| time_us.saturating_sub((flight_s * 1e6) as u64));
        let [lat_deg, lon_deg] = ship.position_deg;
        let position_m = frame(settings).to_local(lat_deg, lon_deg);
        let (mut row, mut track) = (LogRow::new(toa_us), LogRow::new(tol_us));
        row.set(Column::Range, range_m)
            .set(Column::RangeRate, range_rate_mps.unwrap_or(f64::NAN))
            .set(Column::Tol, tol_us as f64 * 1e-6)
            .set(Column::Toa, toa_us as f64 * 1e-6)
            .set_all(Column::ShipX, &position_m);
        track.set_all(Column::ShipGpsX, &position_m);
        Some(Packet { row, ship: track, launch_us: tol_us, ship_deg: ship.position_deg })
    }
}
