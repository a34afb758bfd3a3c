//! Channels of a log at rest, and the vehicle file's numbers that they are for.

use super::allan;
use backseat_core::state::wrap_angle;
use backseat_logs::stats::{mean, rms, standard_deviation};
use backseat_logs::{Column, Log};

/// Fewest readings: sigma of 30 is known to 13 %.
pub const FEWEST: usize = 30;
/// A sigma this many times the white part is more than noise.
const DRIFT: f64 = 1.5;

/// A column, its name, its unit, whether it is an angle, and the vehicle file's number.
type Known = (Column, &'static str, &'static str, bool, &'static str);

const KNOWN: [Known; 16] = [
    (Column::Depth, "depth", "m", false, "sensors.depth_m"),
    (Column::Roll, "roll", "rad", true, "sensors.attitude_rad"),
    (Column::Pitch, "pitch", "rad", true, "sensors.attitude_rad"),
    (Column::Heading, "heading", "rad", true, "sensors.heading_rad"),
    (Column::P, "p", "rad/s", false, "sensors.rates_radps"),
    (Column::Q, "q", "rad/s", false, "sensors.rates_radps"),
    (Column::R, "r", "rad/s", false, "sensors.rates_radps"),
    (Column::DvlU, "dvl u", "m/s", false, "sensors.dvl_mps"),
    (Column::DvlV, "dvl v", "m/s", false, "sensors.dvl_mps"),
    (Column::DvlW, "dvl w", "m/s", false, "sensors.dvl_mps"),
    (Column::Range, "range", "m", false, "sensors.range_m"),
    (Column::RangeRate, "range rate", "m/s", false, "sensors.range_rate_mps"),
    (Column::GpsX, "gnss north", "m", false, "sensors.gnss_m"),
    (Column::GpsY, "gnss east", "m", false, "sensors.gnss_m"),
    (Column::ShipGpsX, "ship north", "m", false, "sensors.ship_gnss_m"),
    (Column::ShipGpsY, "ship east", "m", false, "sensors.ship_gnss_m"),
];

/// A channel at rest.
pub struct Channel {
    pub name: &'static str,
    pub unit: &'static str,
    /// The vehicle file's number.
    key: &'static str,
    /// Readings; angles continuous.
    pub values: Vec<f64>,
    pub rate_hz: f64,
    pub mean: f64,
    /// Standard deviation of all readings.
    pub sigma: f64,
    /// Allan deviation at the interval between readings: sigma without what changes slowly.
    pub white: f64,
    /// Averaging time, s, and Allan deviation.
    pub allan: Vec<(f64, f64)>,
}

impl Channel {
    fn of(log: &Log, &(column, name, unit, is_angle, key): &Known) -> Option<Self> {
        let mut readings: Vec<(u64, f64)> =
            log.rows.iter().filter_map(|row| Some((row.time_us, row.get(column)?))).collect();
        readings.dedup_by_key(|(time_us, _)| *time_us);
        if readings.len() < FEWEST {
            return None;
        }
        if is_angle {
            let first = readings[0].1;
            readings.iter_mut().for_each(|(_, angle)| *angle = first + wrap_angle(*angle - first));
        }
        let values: Vec<f64> = readings.iter().map(|(_, value)| *value).collect();
        let allan = allan::deviations(&readings);
        Some(Self {
            name,
            unit,
            key,
            rate_hz: 1.0 / allan::interval_s(&readings)?,
            mean: mean(&values)?,
            sigma: standard_deviation(&values)?,
            white: allan.first()?.1,
            values,
            allan,
        })
    }

    /// What is wrong with it as a noise.
    pub fn note(&self) -> Option<String> {
        let name = self.name;
        if self.white == 0.0 {
            return Some(format!("{name}: no scatter; the vehicle file keeps its number"));
        }
        let is_slow = self.sigma > DRIFT * self.white;
        is_slow.then(|| {
            format!(
                "{name}: sigma is {:.1} times its white part: it drifts, or the vehicle moved",
                self.sigma / self.white
            )
        })
    }
}

/// A number of the vehicle file.
pub struct Sensor {
    pub key: &'static str,
    /// Root mean square of the white parts of its channels.
    pub sigma: f64,
}

/// Every channel with enough readings.
pub fn of(log: &Log) -> Vec<Channel> {
    KNOWN.iter().filter_map(|known| Channel::of(log, known)).collect()
}

/// The vehicle file's numbers; without those of channels that do not scatter.
pub fn sensors(channels: &[Channel]) -> Vec<Sensor> {
    let mut keys: Vec<&'static str> = channels.iter().map(|channel| channel.key).collect();
    keys.dedup();
    let sensor = |key: &'static str| {
        let of_key = channels.iter().filter(|channel| channel.key == key && channel.white > 0.0);
        let white: Vec<f64> = of_key.map(|channel| channel.white).collect();
        rms(&white).map(|sigma| Sensor { key, sigma })
    };
    keys.into_iter().filter_map(sensor).collect()
}
