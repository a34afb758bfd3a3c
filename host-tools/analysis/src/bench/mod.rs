//! Noise of every sensor, from a log of a vehicle at rest (Tables 4.2 to 4.4).

mod allan;
mod channels;
mod report;

use anyhow::{anyhow, bail};
use backseat_logs::log::Column;
use backseat_logs::stats::percentile;
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
    /// The vehicle moves; or no channel has enough readings.
    pub fn of(log: &Log) -> anyhow::Result<Self> {
        let path = log.path.display().to_string();
        if let Some(how) = moves(log) {
            bail!("{path}: {how}: noise is measured where the vehicle lies still");
        }
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

/// Faster than tides and moorings make it, m/s, and deeper than a float or a tide does, m.
const MOVING: (f64, f64) = (0.2, 2.0);

/// How the vehicle moves, if it does.
fn moves(log: &Log) -> Option<String> {
    let of = |column| log.column(column).map(|(_, value)| value).collect::<Vec<f64>>();
    let speeds: Vec<f64> = of(Column::DvlU).into_iter().map(f64::abs).collect();
    let depths = of(Column::Depth);
    let speed = percentile(&speeds, 0.5).filter(|speed_mps| *speed_mps > MOVING.0);
    let dive = percentile(&depths, 0.99).zip(percentile(&depths, 0.01)).map(|(deep, high)| deep - high);
    match (speed, dive.filter(|dive_m| *dive_m > MOVING.1)) {
        (Some(speed_mps), _) => Some(format!("the vehicle moves at {speed_mps:.1} m/s (dvl_u_mps, median)")),
        (None, Some(dive_m)) => Some(format!("depth_m changes by {dive_m:.1} m")),
        (None, None) => None,
    }
}
