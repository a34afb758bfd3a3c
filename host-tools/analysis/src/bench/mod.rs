//! Noise of every sensor, from a log of a vehicle at rest (Tables 4.2 to 4.4).

mod allan;
mod channels;
mod report;

use anyhow::{anyhow, bail};
use backseat_logs::{Log, VehicleFile};
pub use channels::{Channel, Sensor};
pub use report::report;

/// The noise of a log.
pub struct Bench {
    /// The log's path.
    pub log: String,
    /// Every channel with enough readings.
    pub channels: Vec<Channel>,
    /// Numbers of the vehicle file.
    pub sensors: Vec<Sensor>,
}

impl Bench {
    /// Measures a log of a vehicle at rest.
    ///
    /// # Errors
    /// No channel has enough readings.
    pub fn of(log: &Log) -> anyhow::Result<Self> {
        let path = log.path.display().to_string();
        let channels = channels::of(log);
        if channels.is_empty() {
            let fewest = channels::FEWEST;
            bail!("{path}: no sensor has {fewest} readings or more: a log of some minutes at rest is needed");
        }
        Ok(Self { log: path, sensors: channels::sensors(&channels), channels })
    }

    /// The vehicle with these sensors.
    ///
    /// # Errors
    /// A number that a vehicle file refuses.
    pub fn applied(&self, vehicle: &VehicleFile) -> anyhow::Result<VehicleFile> {
        let mut vehicle = vehicle.clone();
        let found = self.sensors.iter().map(|sensor| (sensor.key, sensor.sigma));
        vehicle.apply(found).map_err(|error| anyhow!("{}: {error}", self.log))?;
        Ok(vehicle)
    }
}
