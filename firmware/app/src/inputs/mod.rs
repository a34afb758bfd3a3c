//! From raw samples to measurements of the centre of gravity, once and in one place.
//!
//! ```text
//! links (board), rows of a log (host)
//!     raw sample: axes of the sensor, at the sensor, stamped with its arrival
//!         │ turned into body axes, delay subtracted                    installation::mounted
//!         v
//!     queue in order of validity, latest samples, packets of the modem  Inputs, Packets
//!         │ moved to the centre of gravity with attitude and rates      installation::measurement
//!         v
//!     Measurement of the filter
//! ```
//!
//! The same code runs on the board and in the host tools. A vehicle log therefore holds raw samples, and every reader
//! applies the [`Installation`] of the vehicle file once.
//!
//! Lever arms are corrected with the filter's attitude and rates. Their errors matter little: with an arm of 0.5 m,
//! 0.5° of attitude is 4 mm, and 1 mrad/s of rate is 0.5 mm/s.

mod actuators;
pub mod installation;
mod packets;
mod queue;
mod sample;

pub use actuators::ActuatorHistory;
pub use packets::{HeardShip, Loss, Packet, PacketProgress, Packets, PeerPacket, TURNAROUND_S};
pub use sample::{AcousticReport, HeardVehicle, SensorSample, Stamp};

use backseat_core::dynamics::ActuatorInput;
use backseat_core::parameters::Installation;
use heapless::Vec;
use queue::Queue;

/// Puts a value at its place, if there is room. Without `Vec::insert`, whose panic the compiler does not rule out where
/// it builds for size.
fn insert<T, const N: usize>(list: &mut Vec<T, N>, place: usize, value: T) {
    if list.push(value).is_ok()
        && let Some(rest @ [_, ..]) = list.get_mut(place..)
    {
        rest.rotate_right(1);
    }
}

/// Latest sample of one source, and when it was valid.
pub type Latest<T> = Option<(u64, T)>;

/// The latest sample of each source, whether fused or not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LatestSamples {
    pub depth_m: Latest<f64>,
    pub euler_rad: Latest<[f64; 3]>,
    pub rates_radps: Latest<[f64; 3]>,
    pub bottom_mps: Latest<[f64; 3]>,
    pub water_mps: Latest<[f64; 3]>,
    pub fix_m: Latest<[f64; 2]>,
}

impl LatestSamples {
    const NONE: Self =
        Self { depth_m: None, euler_rad: None, rates_radps: None, bottom_mps: None, water_mps: None, fix_m: None };
}

/// Samples that wait for the filter, the latest of each source, and the commands of the actuators.
pub(crate) struct Inputs {
    queue: Queue<SensorSample>,
    /// The latest samples handed out, in body axes, at their sensors.
    pub latest: LatestSamples,
    pub actuators: ActuatorHistory,
}

impl Inputs {
    pub const fn new() -> Self {
        Self { queue: Queue::new(), latest: LatestSamples::NONE, actuators: ActuatorHistory::new() }
    }

    /// Forgets everything but the count of drops.
    pub fn clear(&mut self) {
        self.queue.clear();
        self.latest = LatestSamples::NONE;
        self.actuators.clear();
    }

    /// A raw sample.
    pub fn take(&mut self, stamp: Stamp, sample: SensorSample, installation: &Installation) {
        let (time_us, sample) = installation::mounted(stamp, sample, installation);
        self.queue.push(time_us, sample);
    }

    /// The earliest sample that is valid until `to_us`.
    pub fn next_until(&mut self, to_us: u64) -> Option<(u64, SensorSample)> {
        let (time_us, sample) = self.queue.pop_until(to_us)?;
        let latest = &mut self.latest;
        match sample {
            SensorSample::Depth { depth_m } => latest.depth_m = Some((time_us, depth_m)),
            SensorSample::Attitude { euler_rad } => latest.euler_rad = Some((time_us, euler_rad)),
            SensorSample::Rates { rates_radps } => latest.rates_radps = Some((time_us, rates_radps)),
            SensorSample::BottomTrack { velocity_mps } => latest.bottom_mps = Some((time_us, velocity_mps)),
            SensorSample::WaterTrack { velocity_mps } => latest.water_mps = Some((time_us, velocity_mps)),
            SensorSample::Fix { position_m } => latest.fix_m = Some((time_us, position_m)),
            SensorSample::Acoustic(_) => {}
        }
        Some((time_us, sample))
    }

    /// Samples dropped because too many waited.
    pub fn overflows(&self) -> u32 {
        self.queue.dropped
    }

    /// Adds a command that holds from `time_us` on.
    pub fn command(&mut self, time_us: u64, input: &ActuatorInput) {
        self.actuators.push(time_us, input);
    }
}

/// The sample, if it is younger than `age_us`.
pub(crate) fn fresh<T>(latest: Latest<T>, now_us: u64, age_us: u64) -> Option<T> {
    latest.filter(|(time_us, _)| now_us.saturating_sub(*time_us) <= age_us).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_grow_stale() {
        let latest = Some((1_000, 5));
        assert_eq!(fresh(latest, 1_500, 500), Some(5));
        assert_eq!(fresh(latest, 1_501, 500), None);
        assert_eq!(fresh(latest, 900, 500), Some(5));
    }
}
