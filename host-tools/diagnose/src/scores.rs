//! Before and after, on held-out data: prediction over several horizons, navigation, whiteness.

use crate::log_effects::{Effects, PathAt};
use crate::model::Model;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::proposal;
use crate::regressors::{self, Proposed, Snapshot};
use crate::samples::{LogEvent, Reading, ResidualChannel};
use crate::split::Split;
use crate::statistics::{self, NoiseColour};
use crate::whitener::{Pass, Residual};
use backseat_core::dynamics::Attitude;
use backseat_core::effects::{EffectSet, SensorChannel, Step};
use backseat_core::navigation::{LONGEST_HOLD_S, ProcessModel, models};
use backseat_core::state::{self, P, PHI, PSI, U, VehicleState, X, Y, Z, wrap_angle};
use backseat_estimation::filter::{self, FilterOptions, FilterRun};
use backseat_logs::log::Column;
use backseat_logs::stats::{autocorrelation, rms};
use backseat_logs::{DataError, Log, Truth, VehicleFile};
use nalgebra::Vector3;

/// Horizons of prediction, s.
pub const HORIZONS_S: [f64; 3] = [2.0, 10.0, 60.0];
/// The horizon of `velocity_rmse_mps`, as its place in [`HORIZONS_S`].
pub const VELOCITY_HORIZON: usize = 1;
/// Time between two predictions, s.
const EVERY_S: f64 = 15.0;
/// Samples from which on an autocorrelation is known to 0.05 (one sigma).
const LEAST_FOR_CORRELATION: usize = 400;
/// Lags of the whiteness test.
const LAGS: usize = 20;
/// Fixes until this long after the first one are used; later ones are withheld and compared with, s.
const FIXES_USED_S: f64 = 30.0;
/// Channels that are predicted: body velocity, attitude, rates, depth.
pub const PREDICTED: [ResidualChannel; 10] = [
    ResidualChannel::DvlU,
    ResidualChannel::DvlV,
    ResidualChannel::DvlW,
    ResidualChannel::Roll,
    ResidualChannel::Pitch,
    ResidualChannel::Heading,
    ResidualChannel::P,
    ResidualChannel::Q,
    ResidualChannel::R,
    ResidualChannel::Depth,
];

/// How one channel's innovations look on the held-out blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Whiteness {
    /// Which.
    pub channel: ResidualChannel,
    /// Samples.
    pub count: usize,
    /// Mean normalised innovation squared; 1 if consistent.
    pub nis: f64,
    /// Ljung and Box: probability under whiteness, or under modestly coloured noise where there is a `colour`.
    pub p: f64,
    /// Coloured part of the noise, where whiteness fails and a modest share explains it.
    pub colour: Option<NoiseColour>,
    /// Autocorrelation at lags from 1.
    pub correlation: Vec<f64>,
}

impl Whiteness {
    /// In a sentence, where a share of the noise is coloured.
    #[must_use]
    pub fn colour_note(&self) -> Option<String> {
        let colour = self.colour?;
        Some(format!(
            "{}: {:.0} % of the innovations' variance is taken as coloured sensor noise (correlation {:.2} from one sample to \
             the next)",
            self.channel.name(),
            100.0 * colour.share,
            colour.decay
        ))
    }
}

/// Everything that is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Scores {
    /// Velocity predicted over ten seconds, against the DVL (the truth, where it is given and there is no DVL).
    pub velocity_rmse_mps: Option<f64>,
    /// Horizontal position of the flight filter, against the truth or the withheld fixes.
    pub position_rmse_m: Option<f64>,
    /// What the position is compared with.
    pub position_against: Option<&'static str>,
    /// Smallest p of all channels, times their number.
    pub innovation_whiteness_p: f64,
    /// Largest autocorrelation of any channel with at least 400 samples, if there is one.
    pub max_autocorrelation: Option<f64>,
    /// By channel.
    pub whiteness: Vec<Whiteness>,
    /// Root mean square of prediction minus reading, of each channel of [`PREDICTED`] at each horizon.
    pub prediction: Vec<[Option<f64>; HORIZONS_S.len()]>,
    /// (time in s, horizontal error in m), all of the log; not a number where a dead reckoning begins anew.
    pub position_errors: Vec<(f64, f64)>,
    /// Track of the flight filter, north and east in m; of a log without fins and propeller that of dead reckoning, where
    /// it was asked for.
    pub track: Vec<(f64, f64)>,
    /// Share of the variance of each acceleration that is not explained (models of manoeuvring).
    pub unexplained_variance: Vec<(&'static str, f64)>,
}

/// Scores of a pass with its effects.
///
/// # Errors
/// If the flight filter refuses the log or the effects.
pub fn of(
    log_data: &PreparedLog,
    pass: &Pass,
    set: &Effects,
    log: &Log,
    vehicle: &VehicleFile,
    truth: Option<&Truth>,
    use_dvl: bool,
) -> Result<Scores, DataError> {
    let whiteness = whiteness(log_data, pass, DataPart::Judge);
    let prediction = predictions(log_data, pass, set);
    let innovation_whiteness_p = whiteness_p(&whiteness);
    let corrected = set.corrected(proposal::corrected(log, &pass.proposed));
    let run = navigate(&corrected, vehicle, set, truth, use_dvl)?;
    let seconds = |time_us: u64| (time_us as f64 - log_data.samples.start_us as f64) * 1e-6;
    let (against, errors) = match truth {
        Some(truth) => ("truth", against_truth(&run, truth)),
        None => ("withheld GNSS fixes", against_fixes(&run, &corrected)),
    };
    let position_errors: Vec<(f64, f64)> = errors.iter().map(|(time_us, e)| (seconds(*time_us), *e)).collect();
    let held: Vec<f64> = position_errors.iter().filter(|(t_s, _)| log_data.is_judged(*t_s)).map(|(_, e)| *e).collect();
    let velocities: Vec<f64> = (0..3).filter_map(|axis| prediction[axis][VELOCITY_HORIZON]).collect();
    let velocity_rmse_mps = if velocities.len() == 3 {
        rms(&velocities)
    } else {
        truth.and_then(|truth| velocity_against(&run, truth, |time_us| log_data.is_judged(seconds(time_us))))
    };
    Ok(Scores {
        velocity_rmse_mps,
        position_rmse_m: rms(&held),
        position_against: (!held.is_empty()).then_some(against),
        innovation_whiteness_p,
        max_autocorrelation: max_autocorrelation(&whiteness),
        whiteness,
        prediction,
        position_errors,
        track: run.track.iter().map(|sample| (sample.state[0], sample.state[1])).collect(),
        unexplained_variance: Vec::new(),
    })
}

/// Largest autocorrelation of the channels that have enough samples.
pub(crate) fn max_autocorrelation(whiteness: &[Whiteness]) -> Option<f64> {
    let enough = whiteness.iter().filter(|w| w.count >= LEAST_FOR_CORRELATION);
    enough.flat_map(|w| &w.correlation).map(|r| r.abs()).max_by(f64::total_cmp)
}

/// Root mean square of the position's errors where data judge between those that were fitted, and in the forecast.
#[must_use]
pub fn position_by_part(split: &Split, scores: &Scores) -> [Option<f64>; 2] {
    [false, true].map(|forecast| {
        let wanted = |t_s: f64| split.is_at(DataPart::Judge, t_s) && split.is_at(DataPart::Forecast, t_s) == forecast;
        let of = scores.position_errors.iter().filter(|(t_s, error)| error.is_finite() && wanted(*t_s));
        rms(&of.map(|(_, error)| *error).collect::<Vec<_>>())
    })
}

/// Whiteness of each channel on a part of the log; sequences stay in their order of time.
#[must_use]
pub fn whiteness(log_data: &PreparedLog, pass: &Pass, part: DataPart) -> Vec<Whiteness> {
    ResidualChannel::ALL
        .into_iter()
        .filter_map(|channel| {
            let held = pass.telling().filter(|r| r.channel == channel && log_data.split.is_at(part, r.t_s));
            let e: Vec<f64> = independent(held).map(Residual::normalised).collect();
            let count = e.len();
            let nis = e.iter().map(|e| e * e).sum::<f64>() / count as f64;
            let correlation = autocorrelation(&e, LAGS.min(count / 4));
            let (p, colour) = statistics::whiteness(&correlation, count);
            (count > 8).then_some(Whiteness { channel, count, nis, p, colour, correlation })
        })
        .collect()
}

/// Of readings that share a part of their errors, which are not white, as many as they are worth.
fn independent<'a>(residuals: impl Iterator<Item = &'a Residual>) -> impl Iterator<Item = &'a Residual> {
    let mut worth = 0.0;
    residuals.filter(move |r| {
        worth += 1.0 / r.alike;
        let counts = worth >= 1.0;
        worth -= f64::from(u8::from(counts));
        counts
    })
}

/// Smallest p of all channels, times the number of channels that are long enough to be tested.
#[must_use]
pub fn whiteness_p(whiteness: &[Whiteness]) -> f64 {
    let tested = whiteness.iter().filter(|w| w.count > 2 * LAGS).count().max(1) as f64;
    (whiteness.iter().map(|w| w.p).fold(1.0, f64::min) * tested).min(1.0)
}

/// Runs the model alone from the filter's estimate and compares with what was read then, on held-out blocks.
pub fn predictions(log_data: &PreparedLog, pass: &Pass, set: &Effects) -> Vec<[Option<f64>; HORIZONS_S.len()]> {
    let mut squares = vec![[(0.0, 0_u32); HORIZONS_S.len()]; PREDICTED.len()];
    let Some(model) = log_data.setup.model(set) else {
        return vec![[None; HORIZONS_S.len()]; PREDICTED.len()];
    };
    let events = &log_data.samples.events;
    let share = |t_s: f64| t_s / log_data.samples.duration_s.max(1.0);
    let mut next_s = 0.0;
    for trace in &pass.trace {
        let longest = HORIZONS_S[HORIZONS_S.len() - 1];
        if trace.t_s < next_s || !log_data.is_judged(trace.t_s) || trace.t_s + longest > log_data.samples.duration_s {
            continue;
        }
        next_s = trace.t_s + EVERY_S;
        let (mut x, mut t_s, mut input, mut model) = (trace.x, trace.t_s, trace.input, model.clone());
        for (at_s, event) in &events[events.partition_point(|(at_s, _)| *at_s <= trace.t_s)..] {
            let ahead = at_s - trace.t_s;
            if ahead > longest + 0.5 {
                break;
            }
            while t_s < *at_s {
                let h_s = (at_s - t_s).min(0.1);
                let commanded = input.at(t_s + 0.5 * h_s);
                let moved = model.actuate(&Step { t_s, h_s }, &commanded);
                let derivative = |x: &VehicleState| {
                    let snapshot = Snapshot {
                        share: share(t_s),
                        x,
                        heading: x[PSI].sin_cos(),
                        input: &commanded,
                        distance_m: 0.0,
                    };
                    model.derivative(t_s, x, &moved) + regressors::motion(&pass.proposed, &snapshot)
                };
                // Heun's step: its error over a minute is far below any sensor's noise.
                let k1 = derivative(&x);
                let k2 = derivative(&(x + k1 * h_s));
                let mean = (k1 + k2) * 0.5;
                x += mean * h_s;
                model.follow(&Step { t_s, h_s }, &mean, &x);
                t_s += h_s.max(1e-9);
            }
            match event {
                LogEvent::Input(new) => input = *new,
                LogEvent::Reading(reading) => {
                    // Readings of half a second about a horizon are its sample.
                    let Some(horizon) = HORIZONS_S.iter().position(|h| (ahead - h).abs() <= 0.5) else { continue };
                    let commanded = input.at(*at_s);
                    let snapshot = Snapshot {
                        share: share(*at_s),
                        x: &x,
                        heading: x[PSI].sin_cos(),
                        input: &commanded,
                        distance_m: 0.0,
                    };
                    for (channel, error) in errors(&model, *at_s, (&pass.proposed, &snapshot), reading) {
                        if let Some(place) = PREDICTED.iter().position(|c| *c == channel) {
                            let (sum, count) = &mut squares[place][horizon];
                            *sum += error * error;
                            *count += 1;
                        }
                    }
                }
            }
        }
    }
    let mean = |(sum, count): (f64, u32)| (count > 0).then(|| (sum / f64::from(count)).sqrt());
    squares.into_iter().map(|row| row.map(mean)).collect()
}

/// Reading minus prediction, scalar by scalar.
fn errors(
    model: &Model,
    t_s: f64,
    (proposed, snapshot): (&[Proposed], &Snapshot<'_>),
    reading: &Reading,
) -> Vec<(ResidualChannel, f64)> {
    let x = snapshot.x;
    let at = |i: usize| [x[i], x[i + 1], x[i + 2]];
    let (sensor, first, truth, measured): (_, _, _, &[f64]) = match reading {
        Reading::Depth(z) => (SensorChannel::Depth, ResidualChannel::Depth, [x[Z], 0.0, 0.0], std::slice::from_ref(z)),
        Reading::Attitude(euler) => (SensorChannel::Attitude, ResidualChannel::Roll, at(PHI), euler),
        Reading::Rates(rates) => (SensorChannel::Rates, ResidualChannel::P, at(P), rates),
        Reading::Dvl(velocity) => {
            let attitude = Attitude::new(&state::attitude(x));
            let current = models::bottom_track(&attitude, &model.water_mps(t_s).into()).current_in_body;
            let through = at(U);
            let water = regressors::motion(proposed, snapshot);
            let rotation = attitude.rotation();
            let current = [0, 1, 2].map(|i| current[i] + rotation[(0, i)] * water[X] + rotation[(1, i)] * water[Y]);
            (SensorChannel::Dvl, ResidualChannel::DvlU, [0, 1, 2].map(|i| through[i] + current[i]), velocity)
        }
        Reading::Gnss { .. } | Reading::Acoustic { .. } | Reading::Usbl { .. } => return Vec::new(),
    };
    let predicted = model.read(t_s, sensor, truth, (x, PathAt::default())).0;
    let error = |(i, measured): (usize, &f64)| {
        let channel = ResidualChannel::ALL[first as usize + i];
        let difference = measured - predicted[i] - regressors::reading(proposed, channel, snapshot);
        (channel, if sensor == SensorChannel::Attitude { wrap_angle(difference) } else { difference })
    };
    measured.iter().enumerate().map(error).collect()
}

/// The flight filter with these effects. Without a truth, later fixes are withheld from it.
fn navigate(
    log: &Log,
    vehicle: &VehicleFile,
    set: &Effects,
    truth: Option<&Truth>,
    use_dvl: bool,
) -> Result<FilterRun, DataError> {
    let mut augmented = vehicle.clone();
    augmented.effects.set = set.board;
    for (declared, more) in augmented.installation.transducer_arm_m.iter_mut().zip(set.transducer_arm_m()) {
        *declared += more;
    }
    let mut options = FilterOptions::new(&augmented, ProcessModel::Dynamic);
    options.use_dvl = use_dvl;
    let set = set.beyond_readings();
    let changes: Vec<(f64, EffectSet)> = set.change_times_s().iter().map(|t_s| (*t_s, set.board_at(*t_s))).collect();
    if truth.is_some() {
        return filter::run_changing(log, &augmented, &options, &changes);
    }
    let mut blind = log.clone();
    let first = log.rows.iter().find(|row| row.gnss_m().is_some()).map_or(0, |row| row.time_us);
    let last = first + (FIXES_USED_S * 1e6) as u64;
    for row in blind.rows.iter_mut().filter(|row| row.time_us > last) {
        row.set(Column::GpsX, f64::NAN).set(Column::GpsY, f64::NAN);
    }
    filter::run_changing(&blind, &augmented, &options, &changes)
}

fn against_truth(run: &FilterRun, truth: &Truth) -> Vec<(u64, f64)> {
    let error =
        |s: &filter::TrackSample| Some((s.time_us, truth.horizontal_error_m(s.time_us, s.state[0], s.state[1])?));
    run.track.iter().filter_map(error).collect()
}

fn against_fixes(run: &FilterRun, log: &Log) -> Vec<(u64, f64)> {
    let first = log.rows.iter().find(|row| row.gnss_m().is_some()).map_or(0, |row| row.time_us);
    let last = first + (FIXES_USED_S * 1e6) as u64;
    // Behind a silence the track is where a guess and ranges put it, and says nothing of the model.
    let silence_us = (LONGEST_HOLD_S * 1e6) as u64;
    let silent = log.rows.windows(2).find(|pair| pair[1].time_us - pair[0].time_us > silence_us);
    let until = silent.map_or(u64::MAX, |pair| pair[0].time_us);
    let mut errors = Vec::new();
    for row in log.rows.iter().filter(|row| row.time_us > last && row.time_us <= until) {
        let Some(fix) = row.gnss_m() else { continue };
        let after = run.track.partition_point(|s| s.time_us < row.time_us);
        let (Some(b), Some(a)) = (run.track.get(after), after.checked_sub(1).map(|i| &run.track[i])) else { continue };
        let share = (row.time_us - a.time_us) as f64 / (b.time_us - a.time_us).max(1) as f64;
        let at = |axis: usize| a.state[axis] + share * (b.state[axis] - a.state[axis]);
        errors.push((row.time_us, (at(0) - fix[0]).hypot(at(1) - fix[1])));
    }
    errors
}

/// Velocity over ground of the flight filter against the truth, root mean square of the two horizontal components.
fn velocity_against(run: &FilterRun, truth: &Truth, choose: impl Fn(u64) -> bool) -> Option<f64> {
    let over_ground = |x: &VehicleState, current: [f64; 2]| {
        let rotation = Attitude::new(&state::attitude(x)).rotation();
        let v: Vector3<f64> = rotation * Vector3::new(x[U], x[U + 1], x[U + 2]);
        [v.x + current[0], v.y + current[1]]
    };
    let errors: Vec<f64> = run
        .track
        .iter()
        .filter(|s| choose(s.time_us))
        .filter_map(|s| {
            let true_row = truth.at(s.time_us)?;
            let (a, b) = (over_ground(&s.state, s.current_mps), over_ground(&true_row.state, true_row.current_mps));
            Some([a[0] - b[0], a[1] - b[1]])
        })
        .flatten()
        .filter(|error| error.is_finite())
        .collect();
    rms(&errors)
}
