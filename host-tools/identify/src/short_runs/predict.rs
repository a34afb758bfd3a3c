//! Open-loop predictions against what was measured: root mean squares by run and channel.

use super::model::{Reading, RunModel};
use super::recording::{Run, Wanted, Window, windows};
use super::start::measured_state;
use backseat_core::state::{VehicleState, wrap_angle};

/// What is predicted: name, factor from SI to its unit.
pub const CHANNELS: [(&str, f64); 6] = [
    ("roll_deg", 180.0 / std::f64::consts::PI),
    ("pitch_deg", 180.0 / std::f64::consts::PI),
    ("yaw_deg", 180.0 / std::f64::consts::PI),
    ("depth_m", 1.0),
    ("u_mps", 1.0),
    ("v_mps", 1.0),
];

/// Measured less predicted, SI, in the order of [`CHANNELS`]; `None` where nothing was measured.
#[must_use]
pub fn errors(run: &Run, window: Window, readings: &[Option<Reading>]) -> Vec<[Option<f64>; CHANNELS.len()]> {
    let samples = &run.samples[window.first..=window.last];
    samples
        .iter()
        .zip(readings)
        .map(|(sample, reading)| {
            let Some(reading) = reading else {
                // a diverged prediction is wrong by as much as can be
                return [Some(1.5), Some(1.0), Some(3.0), Some(10.0), Some(2.0), Some(1.0)];
            };
            let attitude = |axis: usize| Some(sample.attitude_rad[axis] - reading.attitude_rad[axis]);
            let velocity = |axis: usize| Some(sample.dvl_mps?[axis] - reading.dvl_mps?[axis]);
            [
                attitude(0).map(wrap_angle),
                attitude(1),
                attitude(2),
                Some(sample.depth_m - reading.depth_m),
                velocity(0),
                velocity(1),
            ]
        })
        .collect()
}

/// Sums of squares of one run, or of several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squares {
    sums: [f64; CHANNELS.len()],
    counts: [f64; CHANNELS.len()],
    /// Windows.
    pub windows: usize,
}

impl Squares {
    /// Adds the errors of a window, the start left out.
    pub fn add(&mut self, errors: &[[Option<f64>; CHANNELS.len()]]) {
        self.windows += 1;
        for row in errors.iter().skip(1) {
            for (channel, error) in row.iter().enumerate() {
                if let Some(error) = error {
                    self.sums[channel] += error * error;
                    self.counts[channel] += 1.0;
                }
            }
        }
    }

    /// Both together.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        for channel in 0..CHANNELS.len() {
            self.sums[channel] += other.sums[channel];
            self.counts[channel] += other.counts[channel];
        }
        self.windows += other.windows;
        self
    }

    /// Root mean square of a channel in its unit.
    pub fn rms(&self, channel: usize) -> Option<f64> {
        let count = self.counts[channel];
        (count > 0.0).then(|| (self.sums[channel] / count).sqrt() * CHANNELS[channel].1)
    }
}

/// Predictions from the measured state over windows of a length, powered and submerged, of each run.
#[must_use]
pub fn open_loop(runs: &[Run], models: &[RunModel], length_s: f64) -> Vec<Squares> {
    let wanted = Wanted { depth_m: 0.5, powered: true, speed_mps: 0.0 };
    let mut squares = vec![Squares::default(); runs.len()];
    for window in windows(runs, wanted, length_s, length_s) {
        let run = &runs[window.run];
        let Some(model) = models.get(run.configuration).or_else(|| models.first()) else { continue };
        let readings = model.predict(run, window, &start_of(model, run, window));
        squares[window.run].add(&errors(run, window, &readings));
    }
    squares
}

/// The state a prediction starts from.
#[must_use]
pub fn start_of(model: &RunModel, run: &Run, window: Window) -> VehicleState {
    measured_state(run, window.first, &model.dvl())
}
