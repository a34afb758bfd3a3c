//! What the ship's half has to be given.

use crate::modem::MAX_RATE;
use crate::slots::{Exchange, SlotError, SlotTable};
use backseat_wire::modem::ClockEncoding;
use backseat_wire::ship_state::Key;
use heapless::Vec;

/// Most vehicles that one ship follows.
pub const MAX_VEHICLES: usize = 6;
/// Largest modem address.
const MAX_ADDRESS: u8 = 127;

/// Modem addresses.
pub type Vehicles = Vec<u8, MAX_VEHICLES>;

/// Ship, modem, slots and vehicles.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Latitude and longitude of the local frame's origin, degrees; the first fix if it is left out.
    pub origin_deg: Option<[f64; 2]>,
    /// The ship's modem address.
    pub address: u8,
    /// To whom downlinks are addressed: a vehicle, or the address that everybody hears.
    pub destination: u8,
    /// Data rate of the downlinks, 0 (FSK) to [`MAX_RATE`].
    pub rate: u8,
    /// Packets carry, and uplinks need, the authentication code of this key, if it is set.
    pub key: Key,
    /// The cycle.
    pub slots: SlotTable,
    /// Modem addresses of the vehicles.
    pub vehicles: Vehicles,
    /// From the GNSS antenna to the transducer, forward and starboard, m.
    pub antenna_to_transducer_m: [f64; 2],
    /// Depth of the transducer, m.
    pub transducer_depth_m: f64,
    /// One sigma per axis of antenna and lever arm, as they were measured, m: part of the sigma that packets state.
    pub arm_sigma_m: f64,
    /// One sigma per axis between the receiver's datum and the vehicle's, m: likewise.
    pub datum_sigma_m: f64,
    /// One sigma of a fix per axis, m, as long as no `$GPGST` says it.
    pub fix_sigma_m: f64,
    /// One sigma of the speed over ground per axis, m/s; 0: `$GPRMC`'s speed is not used.
    pub velocity_sigma_mps: f64,
    /// Acceleration that the ship's filter allows for, m/s²/√Hz.
    pub ship_acceleration_mps2_per_sqrt_hz: f64,
    /// Acceleration that the vehicles' filters allow for, m/s²/√Hz.
    pub vehicle_acceleration_mps2_per_sqrt_hz: f64,
    /// Speed of sound, m/s.
    pub sound_speed_mps: f64,
    /// What modems and hardware add to a time of flight, s.
    pub transducer_delay_s: f64,
    /// One sigma of a range, m.
    pub range_sigma_m: f64,
    /// Longest range that is believed, m.
    pub range_max_m: f64,
    /// A ship that is known less well than this (one sigma per axis) sends nothing, m.
    pub ship_sigma_max_m: f64,
    /// From a UTC second to the arrival of the `$GPRMC` that names it, s.
    pub gnss_latency_s: f64,
    /// How the modem's firmware encodes its clock mode.
    pub clock_encoding: ClockEncoding,
    /// Set the modem's clock by `$CCTMS` where it was set by nobody.
    pub set_modem_clock: bool,
}

impl Config {
    /// A ship with one vehicle, addresses 1 and 2, that sends every 30 s.
    #[must_use]
    pub fn reference() -> Self {
        let mut vehicles = Vec::new();
        // there is room
        let _ = vehicles.push(2);
        Self {
            origin_deg: None,
            address: 1,
            destination: MAX_ADDRESS,
            rate: 0,
            key: Key::NONE,
            slots: SlotTable::reference(),
            vehicles,
            antenna_to_transducer_m: [0.0; 2],
            transducer_depth_m: 0.0,
            arm_sigma_m: 0.0,
            datum_sigma_m: 0.0,
            fix_sigma_m: 1.5,
            velocity_sigma_mps: 0.1,
            ship_acceleration_mps2_per_sqrt_hz: 0.02,
            vehicle_acceleration_mps2_per_sqrt_hz: 0.1,
            sound_speed_mps: 1500.0,
            transducer_delay_s: 0.0,
            range_sigma_m: 1.0,
            range_max_m: 3000.0,
            ship_sigma_max_m: 20.0,
            gnss_latency_s: 0.2,
            clock_encoding: ClockEncoding::BitField,
            set_modem_clock: true,
        }
    }

    /// Checks what the types leave open.
    ///
    /// # Errors
    /// The first value that cannot be used.
    pub fn check(&self) -> Result<(), ConfigError> {
        let addresses = [self.address, self.destination];
        if let Some(address) = addresses.iter().chain(&self.vehicles).find(|address| **address > MAX_ADDRESS) {
            return Err(ConfigError::Address(*address));
        }
        if self.vehicles.contains(&self.address) {
            return Err(ConfigError::OwnAddress(self.address));
        }
        let twice = |address: &&u8| self.vehicles.iter().filter(|other| other == address).count() > 1;
        if let Some(address) = self.vehicles.iter().find(twice) {
            return Err(ConfigError::Twice(*address));
        }
        if self.rate > MAX_RATE {
            return Err(ConfigError::Rate(self.rate));
        }
        for slot in self.slots.slots() {
            let vehicle = match slot.exchange {
                Exchange::Downlink => continue,
                Exchange::Uplink { vehicle } | Exchange::Ping { vehicle } | Exchange::VehiclePing { vehicle } => {
                    vehicle
                }
            };
            if !self.vehicles.contains(&vehicle) {
                return Err(ConfigError::UnknownVehicle { offset_s: slot.offset_s, vehicle });
            }
        }
        let range = |name, value: f64, min: f64, max: f64| {
            if value >= min && value <= max { Ok(()) } else { Err(ConfigError::Range { name, value, min, max }) }
        };
        if let Some([latitude, longitude]) = self.origin_deg {
            range("latitude of the origin", latitude, -85.0, 85.0)?;
            range("longitude of the origin", longitude, -180.0, 180.0)?;
        }
        for arm_m in self.antenna_to_transducer_m {
            range("antenna to transducer", arm_m, -200.0, 200.0)?;
        }
        range("transducer depth", self.transducer_depth_m, 0.0, 25.5)?;
        range("sigma of antenna and lever arm", self.arm_sigma_m, 0.0, 100.0)?;
        range("sigma of the datum", self.datum_sigma_m, 0.0, 1000.0)?;
        range("sigma of a fix", self.fix_sigma_m, 1.0e-3, 100.0)?;
        range("sigma of the speed over ground", self.velocity_sigma_mps, 0.0, 10.0)?;
        range("acceleration of the ship", self.ship_acceleration_mps2_per_sqrt_hz, 1.0e-6, 10.0)?;
        range("acceleration of the vehicles", self.vehicle_acceleration_mps2_per_sqrt_hz, 1.0e-6, 10.0)?;
        range("sound speed", self.sound_speed_mps, 1300.0, 1700.0)?;
        range("transducer delay", self.transducer_delay_s, -1.0, 1.0)?;
        range("sigma of a range", self.range_sigma_m, 1.0e-3, 1000.0)?;
        range("longest range", self.range_max_m, 10.0, 20_000.0)?;
        range("largest sigma of the ship", self.ship_sigma_max_m, 0.01, 1000.0)?;
        range("GNSS latency", self.gnss_latency_s, 0.0, 0.9)
    }
}

/// Why a configuration cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// No modem address.
    #[error("modem address {0}: expected 0 to {MAX_ADDRESS}")]
    Address(u8),
    /// A vehicle has the ship's address.
    #[error("modem address {0} is both the ship's and a vehicle's")]
    OwnAddress(u8),
    /// A vehicle is named twice.
    #[error("two vehicles have the modem address {0}")]
    Twice(u8),
    /// No data rate that is sent.
    #[error("data rate {0}: expected 0 (FSK) to {MAX_RATE} (PSK)")]
    Rate(u8),
    /// A slot of a vehicle that is not in the list.
    #[error("the slot at {offset_s} s is for vehicle {vehicle}, which is not in the list of vehicles")]
    UnknownVehicle {
        /// The slot, s.
        offset_s: u32,
        /// Its vehicle.
        vehicle: u8,
    },
    /// A number outside its range.
    #[error("{name}: {value} is outside {min} to {max}")]
    Range {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
        /// Least.
        min: f64,
        /// Most.
        max: f64,
    },
    /// The slots.
    #[error(transparent)]
    Slots(#[from] SlotError),
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn what_cannot_be_used_is_refused_by_name() {
        assert_eq!(Config::reference().check(), Ok(()));
        let broken = |change: fn(&mut Config)| {
            let mut config = Config::reference();
            change(&mut config);
            config.check().unwrap_err().to_string()
        };
        assert!(broken(|c| c.address = 128).contains("128"));
        assert!(broken(|c| c.address = 2).contains("both the ship's and a vehicle's"));
        assert!(broken(|c| c.vehicles.push(2).unwrap()).contains("two vehicles"));
        assert!(broken(|c| c.rate = 6).contains("data rate 6"));
        assert!(broken(|c| c.sound_speed_mps = f64::NAN).contains("sound speed: NaN"));
        assert!(broken(|c| c.origin_deg = Some([91.0, 0.0])).contains("latitude"));
        let ping = |c: &mut Config| {
            let slot = crate::slots::Slot { offset_s: 3, exchange: Exchange::Ping { vehicle: 9 } };
            c.slots = SlotTable::new(30, &[slot], *c.slots.airtime()).unwrap();
        };
        assert!(broken(ping).contains("slot at 3 s is for vehicle 9"));
    }
}
