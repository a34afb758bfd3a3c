//! The configuration file of `backseat topside`.

use anyhow::anyhow;
use backseat_topside::slots::{Airtime, Exchange, Slot, SlotTable};
use backseat_topside::{Config, MAX_VEHICLES};
use backseat_wire::modem::ClockEncoding;
use backseat_wire::ship_state::Key;
use hil_sim::scenario::from_toml;
use serde::Deserialize;
use std::path::Path;

/// The file as it is written; what is left out has the default of the library.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    ports: Ports,
    #[serde(default)]
    ship: Ship,
    #[serde(default)]
    modem: Modem,
    #[serde(rename = "vehicle")]
    vehicles: Vec<Vehicle>,
    cycle: Cycle,
}

/// `[ports]`: serial devices, PATH or PATH:BAUD.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ports {
    /// GNSS receiver (NMEA RMC, and GGA, GST, HDT if there are any).
    pub gnss: String,
    /// Micro-Modem.
    pub modem: String,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Ship {
    origin_deg: Option<[f64; 2]>,
    antenna_to_transducer_m: Option<[f64; 2]>,
    transducer_depth_m: Option<f64>,
    arm_sigma_m: Option<f64>,
    datum_sigma_m: Option<f64>,
    fix_sigma_m: Option<f64>,
    velocity_sigma_mps: Option<f64>,
    acceleration_mps2_per_sqrt_hz: Option<f64>,
    sigma_max_m: Option<f64>,
    gnss_latency_s: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Modem {
    address: Option<u8>,
    destination: Option<u8>,
    rate: Option<u8>,
    key: Option<String>,
    sound_speed_mps: Option<f64>,
    delay_s: Option<f64>,
    range_sigma_m: Option<f64>,
    range_max_m: Option<f64>,
    legacy_clock: bool,
    set_clock: Option<bool>,
}

/// `[[vehicle]]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Modem address.
    pub address: u8,
    /// For the screen.
    pub name: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Cycle {
    period_s: u32,
    packet_s: Option<f64>,
    lead_s: Option<f64>,
    ping_s: Option<f64>,
    turnaround_s: Option<f64>,
    #[serde(rename = "slot")]
    slots: Vec<FileSlot>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSlot {
    at_s: u32,
    exchange: Kind,
    vehicle: Option<u8>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Downlink,
    Uplink,
    Ping,
    VehiclePing,
}

/// A file, read and checked.
pub struct Read {
    /// Devices.
    pub ports: Ports,
    /// Names of the vehicles.
    pub vehicles: Vec<Vehicle>,
    /// For the library.
    pub config: Config,
    /// The text, for the session log; without the key.
    pub text: String,
}

/// Reads a configuration file.
pub fn read(path: &Path) -> anyhow::Result<Read> {
    let text = backseat_logs::settings::read(path)?;
    let file: File = from_toml(&text, path)?;
    let config = assemble(&file).map_err(|error| anyhow!("{}: {error:#}", path.display()))?;
    let without_key = |line: &&str| !line.trim_start().starts_with("key");
    let text = text.lines().filter(without_key).map(|line| format!("{line}\n")).collect();
    Ok(Read { ports: file.ports, vehicles: file.vehicles, config, text })
}

fn assemble(file: &File) -> anyhow::Result<Config> {
    let (ship, modem, default) = (&file.ship, &file.modem, Config::reference());
    let sound_speed_mps = modem.sound_speed_mps.unwrap_or(default.sound_speed_mps);
    let range_max_m = modem.range_max_m.unwrap_or(default.range_max_m);
    let usual = Airtime::REFERENCE;
    let airtime = Airtime {
        lead_s: file.cycle.lead_s.unwrap_or(usual.lead_s),
        packet_s: file.cycle.packet_s.unwrap_or(usual.packet_s),
        ping_s: file.cycle.ping_s.unwrap_or(usual.ping_s),
        turnaround_s: file.cycle.turnaround_s.unwrap_or(usual.turnaround_s),
        flight_s: range_max_m / sound_speed_mps,
    };
    let slots: Vec<Slot> = file.cycle.slots.iter().map(slot).collect::<anyhow::Result<_>>()?;
    let addresses: Vec<u8> = file.vehicles.iter().map(|vehicle| vehicle.address).collect();
    let config = Config {
        origin_deg: ship.origin_deg,
        address: modem.address.unwrap_or(default.address),
        destination: modem.destination.unwrap_or(default.destination),
        rate: modem.rate.unwrap_or(default.rate),
        key: modem
            .key
            .as_deref()
            .map_or(Ok(Key::NONE), str::parse)
            .map_err(|_| anyhow!("modem.key: expected 32 hexadecimal digits"))?,
        slots: SlotTable::new(file.cycle.period_s, &slots, airtime)?,
        vehicles: heapless_vehicles(&addresses)?,
        antenna_to_transducer_m: ship.antenna_to_transducer_m.unwrap_or(default.antenna_to_transducer_m),
        transducer_depth_m: ship.transducer_depth_m.unwrap_or(default.transducer_depth_m),
        arm_sigma_m: ship.arm_sigma_m.unwrap_or(default.arm_sigma_m),
        datum_sigma_m: ship.datum_sigma_m.unwrap_or(default.datum_sigma_m),
        fix_sigma_m: ship.fix_sigma_m.unwrap_or(default.fix_sigma_m),
        velocity_sigma_mps: ship.velocity_sigma_mps.unwrap_or(default.velocity_sigma_mps),
        ship_acceleration_mps2_per_sqrt_hz: ship
            .acceleration_mps2_per_sqrt_hz
            .unwrap_or(default.ship_acceleration_mps2_per_sqrt_hz),
        vehicle_acceleration_mps2_per_sqrt_hz: default.vehicle_acceleration_mps2_per_sqrt_hz,
        sound_speed_mps,
        transducer_delay_s: modem.delay_s.unwrap_or(default.transducer_delay_s),
        range_sigma_m: modem.range_sigma_m.unwrap_or(default.range_sigma_m),
        range_max_m,
        ship_sigma_max_m: ship.sigma_max_m.unwrap_or(default.ship_sigma_max_m),
        gnss_latency_s: ship.gnss_latency_s.unwrap_or(default.gnss_latency_s),
        clock_encoding: if modem.legacy_clock { ClockEncoding::Legacy } else { ClockEncoding::BitField },
        set_modem_clock: modem.set_clock.unwrap_or(default.set_modem_clock),
    };
    config.check()?;
    Ok(config)
}

fn heapless_vehicles(addresses: &[u8]) -> anyhow::Result<backseat_topside::Vehicles> {
    backseat_topside::Vehicles::from_slice(addresses)
        .map_err(|_| anyhow!("{} vehicles: expected at most {MAX_VEHICLES}", addresses.len()))
}

fn slot(slot: &FileSlot) -> anyhow::Result<Slot> {
    let at_s = slot.at_s;
    let vehicle = || slot.vehicle.ok_or_else(|| anyhow!("the slot at {at_s} s: vehicle is missing"));
    let exchange = match slot.exchange {
        Kind::Downlink if slot.vehicle.is_some() => {
            return Err(anyhow!("the slot at {at_s} s: a downlink is for every vehicle; leave vehicle out"));
        }
        Kind::Downlink => Exchange::Downlink,
        Kind::Uplink => Exchange::Uplink { vehicle: vehicle()? },
        Kind::Ping => Exchange::Ping { vehicle: vehicle()? },
        Kind::VehiclePing => Exchange::VehiclePing { vehicle: vehicle()? },
    };
    Ok(Slot { offset_s: at_s, exchange })
}
