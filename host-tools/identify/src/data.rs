//! The log as the methods need it: every channel at every 0.1 s, in stretches without gaps.

use crate::declared_effects::EffectRemoval;
use crate::options::IdentifyError;
use crate::sample::{PERIOD_S, PeriodInput, Sample};
use backseat_core::dynamics::{ActuatorInput, Attitude};
use backseat_core::effects::{EffectSet, SensorChannel};
use backseat_core::state::wrap_angle;
use backseat_estimation::commands::{Commands, InputTiming};
use backseat_logs::{Log, LogRow, interrupt};
use nalgebra::{Vector3, Vector6};
use std::ops::Range;

/// The same in µs.
const PERIOD_US: u64 = 100_000;
/// Longest time between two samples of a channel that is interpolated across, µs.
const LONGEST_US: u64 = 1_000_000;
/// Lines of input that are looked at for one period: commands at up to 500 Hz, each actuator at times of its own.
const MOST_LINES: usize = 256;
/// Shorter stretches say nothing, samples.
const SHORTEST: usize = 600;

/// A log at 10 Hz.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdentificationData {
    /// All samples, in order of time.
    pub samples: Vec<Sample>,
    /// Stretches without gaps, as ranges of `samples`.
    pub stretches: Vec<Range<usize>>,
    /// What was assumed or left out, one line each.
    pub notes: Vec<String>,
}

impl IdentificationData {
    /// Resamples a log: attitude, rates and DVL linearly interpolated, commands held ([`LoggedInputs::act`] for other
    /// timing). DVL velocity is over ground; what the water does, and all else that sensors and actuators are declared
    /// to do beyond the vehicle's parameters, is in `effects`.
    ///
    /// # Errors
    /// If the log lacks a channel, or has no minute without a gap in any.
    pub fn from_log(log: &Log, effects: &EffectSet) -> Result<Self, IdentifyError> {
        let removal = EffectRemoval::new(effects, log.rows.first().map_or(0, |row| row.time_us));
        let inputs = LoggedInputs::of(log, effects);
        let attitude = channel(log, &removal, SensorChannel::Attitude, LogRow::attitude_rad);
        let rates = channel(log, &removal, SensorChannel::Rates, LogRow::rates_radps);
        let dvl = channel(log, &removal, SensorChannel::Dvl, LogRow::dvl_mps);
        let current = removal.water();
        for (is_empty, name) in [
            (attitude.is_empty(), "attitude (roll_rad, pitch_rad, heading_rad)"),
            (rates.is_empty(), "body rates (p_radps, q_radps, r_radps)"),
            (dvl.is_empty(), "DVL velocity (dvl_u_mps, dvl_v_mps, dvl_w_mps)"),
            (inputs.commands.is_incomplete(), "commands (prop_rpm, fin_top_rad … fin_starboard_rad)"),
        ] {
            if is_empty {
                return Err(IdentifyError::Missing(name));
            }
        }
        let first = [attitude[0].0, rates[0].0, dvl[0].0, inputs.first_us()].into_iter().max().unwrap_or(0);
        let last = [&attitude, &rates, &dvl].iter().filter_map(|c| Some(c.last()?.0)).min().unwrap_or(0);
        let mut data = Self::default();
        let mut at = [0_usize; 3];
        let mut stretch = 0;
        for time_us in (first.div_ceil(PERIOD_US) * PERIOD_US..=last).step_by(PERIOD_US as usize) {
            let sample = interpolated(&attitude, &mut at[0], time_us, true)
                .zip(interpolated(&rates, &mut at[1], time_us, false))
                .zip(interpolated(&dvl, &mut at[2], time_us, false));
            let Some(((attitude, rates), dvl)) = sample else {
                data.close(&mut stretch);
                continue;
            };
            let attitude = Vector3::from(attitude);
            let water = Attitude::new(&attitude).rotation().transpose() * Vector3::new(current[0], current[1], 0.0);
            let [u, v, w] = core::array::from_fn(|axis| dvl[axis] - water[axis]);
            let [p, q, r] = rates;
            let velocity = Vector6::new(u, v, w, p, q, r);
            let input = PeriodInput::held(ActuatorInput::default());
            data.samples.push(Sample { time_us, attitude, velocity, input });
        }
        data.close(&mut stretch);
        inputs.act(&InputTiming::default(), &mut data.samples);
        if data.stretches.is_empty() {
            return Err(IdentifyError::TooShort);
        }
        let kept: usize = data.stretches.iter().map(ExactSizeIterator::len).sum();
        data.notes.push(format!(
            "{:.0} s in {} stretches without gaps of 1 s",
            kept as f64 * PERIOD_S,
            data.stretches.len()
        ));
        let taken = removal.names();
        if !taken.is_empty() {
            data.notes.push(format!("declared effects removed from the log: {}", taken.join(", ")));
        }
        Ok(data)
    }

    /// Ends a stretch that began at `stretch`; drops it if it is short.
    fn close(&mut self, stretch: &mut usize) {
        if self.samples.len() - *stretch >= SHORTEST {
            self.stretches.push(*stretch..self.samples.len());
        } else {
            self.samples.truncate(*stretch);
        }
        *stretch = self.samples.len();
    }

    /// The samples of every stretch.
    pub fn stretches(&self) -> impl Iterator<Item = &[Sample]> {
        self.stretches.iter().map(|range| &self.samples[range.clone()])
    }

    /// Every sample, and what fins and propeller did since the one before; the first's is its own.
    pub fn with_input_since(&self) -> impl Iterator<Item = (&Sample, ActuatorInput)> {
        let before = self.samples.first().into_iter().chain(&self.samples);
        self.samples.iter().zip(before.map(|sample| sample.input.mean()))
    }

    /// Time covered, s.
    pub fn duration_s(&self) -> f64 {
        self.samples.len() as f64 * PERIOD_S
    }

    /// The first share of the samples and the rest.
    pub fn split(&self, share: f64) -> [Self; 2] {
        let cut = (self.samples.len() as f64 * share.clamp(0.0, 1.0)) as usize;
        [0..cut, cut..self.samples.len()].map(|part| {
            let mut data = Self { notes: self.notes.clone(), ..Self::default() };
            for range in &self.stretches {
                let (from, to) = (range.start.max(part.start), range.end.min(part.end));
                if to > from && to - from >= SHORTEST.min(range.len()) {
                    let start = data.samples.len();
                    data.samples.extend_from_slice(&self.samples[from..to]);
                    data.stretches.push(start..data.samples.len());
                }
            }
            data
        })
    }
}

/// The commands of a log, and what is declared to come between them and the actuators.
#[derive(Clone, Debug)]
pub struct LoggedInputs {
    commands: Commands,
    effects: EffectSet,
    start_us: u64,
}

impl LoggedInputs {
    /// Of a log.
    #[must_use]
    pub fn of(log: &Log, effects: &EffectSet) -> Self {
        let start_us = log.rows.first().map_or(0, |row| row.time_us);
        Self { commands: Commands::of(log), effects: *effects, start_us }
    }

    /// The commands as they were sampled.
    pub fn commands(&self) -> &Commands {
        &self.commands
    }

    fn first_us(&self) -> u64 {
        self.start_us + (self.commands.first_s() * 1e6).round() as u64
    }

    /// Sets what the actuators do in the period of each sample, if they follow their commands with this timing.
    pub fn act(&self, timing: &InputTiming, samples: &mut [Sample]) {
        let lines = self.commands.lines(timing);
        let mut removal = EffectRemoval::new(&self.effects, self.start_us);
        let mut at = 0;
        for sample in samples {
            interrupt::check();
            let from_s = (sample.time_us - self.start_us) as f64 * 1e-6;
            while lines.get(at + 1).is_some_and(|next| next.from_s <= from_s) {
                at += 1;
            }
            let input = PeriodInput::of(&lines[at..lines.len().min(at + MOST_LINES)], from_s);
            sample.input = input.changed(|mean| removal.input(sample.time_us, mean));
        }
    }
}

type Readings = Vec<(u64, [f64; 3])>;

fn channel(
    log: &Log,
    removal: &EffectRemoval<'_>,
    sensor: SensorChannel,
    get: impl Fn(&LogRow) -> Option<[f64; 3]>,
) -> Readings {
    let samples = log.rows.iter().filter_map(|row| Some((row.time_us, get(row)?)));
    samples.map(|(time_us, measured)| (time_us, removal.reading(sensor, time_us, measured))).collect()
}

/// Value at a time between two samples; `from` is where the last search ended.
fn interpolated(channel: &Readings, from: &mut usize, time_us: u64, are_angles: bool) -> Option<[f64; 3]> {
    while channel.get(*from + 1).is_some_and(|(next_us, _)| *next_us <= time_us) {
        *from += 1;
    }
    let (before_us, before) = channel.get(*from)?;
    if *before_us == time_us {
        return Some(*before);
    }
    let (after_us, after) = channel.get(*from + 1)?;
    if *before_us > time_us || after_us - before_us > LONGEST_US {
        return None;
    }
    let share = (time_us - before_us) as f64 / (after_us - before_us) as f64;
    Some(core::array::from_fn(|axis| {
        let change = after[axis] - before[axis];
        before[axis] + share * if are_angles { wrap_angle(change) } else { change }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::Column;

    fn row(time_us: u64, value: f64) -> LogRow {
        let mut row = LogRow::new(time_us);
        row.set_all(Column::Roll, &[value; 3]).set_all(Column::P, &[value; 3]).set_all(Column::DvlU, &[value; 3]);
        row.set_actuators(&ActuatorInput { propeller_radps: value, fins_rad: [value; 4] });
        row
    }

    #[test]
    fn channels_are_interpolated_commands_held_and_gaps_cut() {
        // 5 Hz, a gap of 2 s in the middle.
        let times = (0..4000).chain(4010..8000).map(|k| k * 200_000);
        let log = Log { rows: times.map(|t| row(t, t as f64 * 1.0e-9)).collect(), ..Log::default() };
        let data = IdentificationData::from_log(&log, &EffectSet::NONE).unwrap();
        assert_eq!(data.stretches.len(), 2);
        let sample = &data.samples[101];
        assert_eq!(sample.time_us, 10_100_000);
        assert!((sample.velocity[5] - 0.0101).abs() < 1e-12);
        assert!((sample.input.mean().fins_rad[1] - 0.0100).abs() < 1e-12);
        assert_eq!(data.samples[data.stretches[1].start].time_us, 802_000_000);
        let [first, rest] = data.split(0.8);
        assert_eq!(first.samples.len() + rest.samples.len(), data.samples.len());
    }

    #[test]
    fn a_current_is_taken_out_in_body_axes() {
        let mut log = Log { rows: (0..700).map(|k| row(k * 100_000, 0.0)).collect(), ..Log::default() };
        for row in &mut log.rows {
            row.set(Column::Heading, std::f64::consts::FRAC_PI_2).set(Column::DvlU, 1.0);
        }
        let data =
            IdentificationData::from_log(&log, &EffectSet::NONE.with("water_current", &[0.2, 0.3]).unwrap()).unwrap();
        let v = data.samples[0].velocity;
        // Heading east: the east current pushes ahead, the north one to port.
        assert!((v[0] - 0.7).abs() < 1e-12 && (v[1] - 0.2).abs() < 1e-12, "{v}");
    }

    #[test]
    fn val_declared_effects_are_taken_out() {
        use backseat_core::effects::parameters;
        let set = |list: &[(&str, &[f64])]| {
            list.iter().fold(EffectSet::NONE, |set, (name, values)| set.with(name, values).unwrap())
        };
        let effects = set(&[
            ("water_current", &[0.1, 0.2]),
            ("dvl_scale", &[0.05]),
            ("dvl_misalignment", &[0.1, -0.05]),
            ("pitch_sensor", &[0.02, 0.1]),
            ("gyro_bias", &[0.01, 0.0, -0.01]),
            ("heading_bias", &[0.3, 0.1, -0.1]),
            ("fin_bias", &[3.0, 0.07]),
            ("thrust_decay", &[0.2]),
        ]);
        // Turned by 0.5 rad and pitched by 0.2, 1.5 m/s ahead: read through every effect, each written out here.
        let (pitch, heading, v, time_us) = (0.2_f64, 0.5_f64, [1.5, 0.1, -0.05], 40_000_000);
        let rotation = Attitude::new(&Vector3::new(0.0, pitch, heading)).rotation();
        let ground = Vector3::from(v) + rotation.transpose() * Vector3::new(0.1, 0.2, 0.0);
        let scaled = ground * 1.05;
        let yawed = nalgebra::Rotation3::from_euler_angles(0.0, 0.0, 0.1).inverse() * scaled;
        let turned = nalgebra::Rotation3::from_euler_angles(0.0, -0.05, 0.0).inverse() * yawed;
        let mut log = Log { rows: (0..700).map(|k| row(k * 100_000, 0.0)).collect(), ..Log::default() };
        for row in &mut log.rows {
            let compass = heading + 0.3 + 0.1 * heading.sin() - 0.1 * heading.cos();
            row.set_all(Column::Roll, &[0.0, 1.1 * pitch + 0.02, compass]).set_all(Column::P, &[0.03, 0.0, 0.0]);
            row.set_all(Column::DvlU, turned.as_slice());
            row.set_actuators(&ActuatorInput { propeller_radps: 100.0, fins_rad: [0.0; 4] });
        }
        let data = IdentificationData::from_log(&log, &effects).unwrap();
        let sample = data.samples.iter().find(|sample| sample.time_us == time_us).unwrap();
        let found = [sample.attitude.y, sample.attitude.z].into_iter().chain(sample.velocity.iter().copied());
        for (found, truth) in found.zip([pitch, heading, v[0], v[1], v[2], 0.02, 0.0, 0.01]) {
            // The fixed point's rounds.
            assert!((found - truth).abs() < 1e-9, "{found} instead of {truth}");
        }
        assert_eq!(sample.input.mean().fins_rad, [0.0, 0.0, 0.07, 0.0]);
        assert!((sample.input.mean().propeller_radps - 100.0 * (1.0 - 0.2 * 40.0 / 3600.0)).abs() < 1e-9);

        // Of the plant's, what does not begin at some time becomes part of the parameters.
        let mut effects = set(&[("linear_drag", &[2.0]), ("drag_change", &[5.0, 100.0, 0.0]), ("dvl_scale", &[0.05])]);
        let mut vehicle = backseat_logs::VehicleFile::reference().parameters;
        let before = vehicle.linear_surge_ns_per_m;
        assert_eq!(crate::declared_effects::fold_into_plant(&mut vehicle, &mut effects), ["drag_change"]);
        assert_eq!(vehicle.linear_surge_ns_per_m, before + 2.0);
        assert_eq!(effects, set(&[("drag_change", &[5.0, 100.0, 0.0]), ("dvl_scale", &[0.05])]));
        assert_eq!(parameters().filter(|id| effects.get(*id) != 0.0).count(), 3);
    }

    #[test]
    fn what_is_missing_is_named() {
        let log = Log { rows: vec![LogRow::new(0)], ..Log::default() };
        let message = IdentificationData::from_log(&log, &EffectSet::NONE).unwrap_err().to_string();
        assert!(message.contains("attitude"), "{message}");
    }
}
