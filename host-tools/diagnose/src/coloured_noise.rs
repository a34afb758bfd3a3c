//! Noise as sensors and water have it: of each channel its size, a white part and up to two that last, and how much the
//! water shakes the vehicle, estimated beside the effects found.
//!
//! The parts are chosen by likelihood, Σ (ln S + e²) over the blocks that choose, on a grid of shares and time constants:
//! every trial changes all channels at once, and each device keeps the trial under which its own innovations are most
//! likely. No channel's noise grows beyond what its kind of sensor makes ([`SensorKind::most`]), so that what no sensor
//! makes stays in the innovations.
//!
//! [`SensorKind::most`]: backseat_logs::plausible_noise::SensorKind::most

use crate::log_effects::Effects;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::samples::ResidualChannel;
use crate::whitener::{self, Colour, Pass, Residual, Setup};
use backseat_core::state::Z;
use backseat_logs::stats::{autocorrelation, chi_square_tail, ljung_box};
use rayon::prelude::*;

/// Sensors whose noise is estimated together.
pub struct Sensors {
    /// Channels of one device: their noise is of one spectrum, each of its own size. What lasts in one of them alone is
    /// motion.
    devices: &'static [&'static [ResidualChannel]],
    /// Time constants tried at first, s, fastest first.
    taus_s: [f64; 5],
    /// Shares and time constants of a second, slower part, s.
    second: [(f64, f64); 3],
    /// So many seconds from a log's beginning say roughly what their noise is.
    rough_s: f64,
    /// So many say it well enough.
    pub longest_s: f64,
    /// Samples below which a channel's noise is taken as declared.
    fewest: usize,
    /// What a part that lasts must gain in Σ (ln S + e²): two numbers at their cost, 2 ln n.
    least_gain: f64,
    /// Whether they show how much the water shakes the vehicle.
    are_inertial: bool,
}

/// All whose noise may last.
pub const SENSORS: [Sensors; 2] = [
    Sensors {
        devices: &OWN,
        taus_s: [0.7, 2.0, 6.0, 20.0, 60.0],
        // a gyro's zero wanders over minutes
        second: [(0.08, 8.0), (0.08, 25.0), (0.01, 150.0)],
        // ten times the longest time constant: of the first part, and of both
        rough_s: 600.0,
        longest_s: 1800.0,
        fewest: 400,
        least_gain: 18.0,
        are_inertial: true,
    },
    Sensors {
        devices: &POSITIONS,
        // paths, receivers, orbits and the ionosphere wander over minutes
        taus_s: [6.0, 20.0, 60.0, 150.0, 300.0],
        second: [(0.08, 60.0), (0.08, 150.0), (0.08, 300.0)],
        // a reading every ten seconds is seldom: an hour, 150 samples
        rough_s: 1800.0,
        longest_s: 3600.0,
        fewest: 60,
        least_gain: 15.0,
        are_inertial: false,
    },
];
const OWN: [&[ResidualChannel]; 5] = [
    &[ResidualChannel::Depth],
    &[ResidualChannel::Roll, ResidualChannel::Pitch],
    &[ResidualChannel::Heading],
    &[ResidualChannel::P, ResidualChannel::Q, ResidualChannel::R],
    &[ResidualChannel::DvlU, ResidualChannel::DvlV, ResidualChannel::DvlW],
];
const POSITIONS: [&[ResidualChannel]; 4] = [
    &[ResidualChannel::Range],
    &[ResidualChannel::UsblAlong, ResidualChannel::UsblAcross],
    &[ResidualChannel::UsblDown],
    &[ResidualChannel::GnssX, ResidualChannel::GnssY],
];
/// What a second part must gain: χ² of two numbers, by chance once in a hundred. One too many costs less than an effect
/// that is noise.
const SECOND_GAIN: f64 = 9.2;
/// Lags of the test whether noise is other than declared, and its probability.
const LAGS: usize = 20;
const SUSPECTED: f64 = 1e-4;
/// Shares tried at first.
const SHARES: [f64; 2] = [0.15, 0.6];
/// The largest that lasts, of all parts together: of a fix the rest is a tenth of its sigma.
const MOST_LASTING: f64 = 0.99;
/// Factors on a size tried where the whole log takes the place of its beginning.
const LOUDER: [f64; 4] = [0.65, 0.8, 1.25, 1.6];
/// How much quieter than declared a channel may be: a vehicle file declares roll, pitch and heading alike, and a good
/// compass is ten times worse than the good accelerometers beside it. Held at the declared size, the parts that last of a
/// quieter channel take up too much, and innovations are correlated the other way.
const LEAST_SIZE: f64 = 0.1;
/// Fixes err by as much as is declared: what they share for minutes shows only from one surfacing to the next, and a log
/// has few.
const LEAST_OF_FIXES: f64 = 1.0;
/// How much more or less the water may shake the vehicle than is declared, under water and at the surface: beyond it is
/// no turbulence, and more than waves of 1 m and 6 s, √(2 A ω³) = 0.5 m/s²/√Hz for a displacement of variance A.
const MOST_SHAKEN: [f64; 2] = [3.0, 10.0];
/// The time constant that noise may have, over the slowest tried.
const BEYOND: f64 = 1.3;

/// Noise of one channel, relative to what is declared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mixture {
    /// One sigma of all parts together.
    size: f64,
    /// Share of the variance and time constant in s of the parts that last; a share of 0: none.
    parts: [(f64, f64); 2],
}

impl Mixture {
    const fn white(size: f64) -> Self {
        Self { size, parts: [(0.0, 1.0); 2] }
    }

    /// Standard deviation of the white part.
    fn white_size(&self) -> f64 {
        self.size * (1.0 - self.parts[0].0 - self.parts[1].0).max(0.0).sqrt()
    }

    fn is_possible(&self, sensors: &Sensors) -> bool {
        let ([fastest_s, .., slow_s], [.., (_, slowest_s)]) = (sensors.taus_s, sensors.second);
        let taus_s = 0.6 * fastest_s..=BEYOND * slowest_s.max(slow_s);
        let inside = |(share, tau_s): (f64, f64)| {
            share == 0.0 || (0.0..=MOST_LASTING).contains(&share) && taus_s.contains(&tau_s)
        };
        self.parts.iter().copied().all(inside) && self.parts[0].0 + self.parts[1].0 <= MOST_LASTING
    }
}

type Mixtures = [Mixture; ResidualChannel::COUNT];

/// The noise of some channels, and of the motion.
pub struct Noise {
    mixtures: Mixtures,
    shaken: Shaken,
    channels: Vec<ResidualChannel>,
}

impl Noise {
    /// Puts it in the place of what these channels, and the motion, had.
    pub fn apply(&self, setup: &mut Setup) {
        apply(setup, &self.mixtures, &self.channels);
        shake(setup, &self.shaken);
    }
}

/// Estimates the noise of some sensors beside a set of effects; `None` where it is as declared. Channels of `kept` stay.
#[must_use]
pub fn estimate(log_data: &PreparedLog, set: &Effects, sensors: &Sensors, kept: &[ResidualChannel]) -> Option<Noise> {
    let base = log_data.pass(set, &[])?;
    let innovations = innovations(log_data, &base, sensors, kept);
    if !innovations.iter().any(|(_, e)| is_other(e)) {
        return None;
    }
    // One filter weighs all channels: each has its noise estimated beside the others'.
    let channels: Vec<ResidualChannel> = innovations.iter().map(|(channel, _)| *channel).collect();
    let first = log_data.first(sensors.rough_s)?;
    let rough = Search { log_data: &first, set, channels: &channels, sensors }.rough()?;
    let best = Search { log_data, set, channels: &channels, sensors }.refined(&rough)?;
    Some(Noise { mixtures: best.mixtures, shaken: best.shaken, channels })
}

/// Whether innovations of any channel are not white, or larger than declared, where nothing judges.
#[must_use]
pub fn is_suspected(log_data: &PreparedLog, pass: &Pass) -> bool {
    let of = |sensors| innovations(log_data, pass, sensors, &[]);
    SENSORS.iter().flat_map(of).any(|(_, e)| is_other(&e))
}

/// Normalised innovations of the channels that have enough of them.
fn innovations(
    log_data: &PreparedLog,
    pass: &Pass,
    sensors: &Sensors,
    kept: &[ResidualChannel],
) -> Vec<(ResidualChannel, Vec<f64>)> {
    let seen = |t_s: f64| log_data.split.is_at(DataPart::Seen, t_s);
    let of = |channel: ResidualChannel| {
        let mut own: Vec<_> = pass.telling().filter(|r| r.channel == channel && seen(r.t_s)).collect();
        // what lasts, lasts for one transponder
        own.sort_by_key(|r| r.station);
        let e: Vec<f64> = own.into_iter().map(Residual::normalised).collect();
        (e.len() >= sensors.fewest).then_some((channel, e))
    };
    sensors.devices.concat().into_iter().filter(|channel| !kept.contains(channel)).filter_map(of).collect()
}

/// Whether innovations are not white, or larger than declared.
fn is_other(e: &[f64]) -> bool {
    let square: f64 = e.iter().map(|e| e * e).sum();
    ljung_box(&autocorrelation(e, LAGS), e.len(), 0) < SUSPECTED || chi_square_tail(square, e.len()) < SUSPECTED
}

/// Sets the noise of `channels`.
fn apply(setup: &mut Setup, noise: &Mixtures, channels: &[ResidualChannel]) {
    setup.colours.retain(|colour| !channels.contains(&colour.channel));
    for channel in channels {
        let mixture = &noise[*channel as usize];
        setup.scale[*channel as usize] = mixture.white_size();
        let sigma = channel.declared_sigma(&setup.sensors) * mixture.size;
        let parts = mixture.parts.iter().filter(|(share, _)| *share > 0.0);
        let colour =
            |(share, tau_s): &(f64, f64)| Colour { channel: *channel, sigma: sigma * share.sqrt(), tau_s: *tau_s };
        setup.colours.extend(parts.map(colour));
    }
}

struct Search<'a> {
    log_data: &'a PreparedLog,
    set: &'a Effects,
    channels: &'a [ResidualChannel],
    sensors: &'a Sensors,
}

/// Noise of all channels, with its cost.
#[derive(Clone, Copy)]
struct Best {
    mixtures: Mixtures,
    /// Factors on the declared noise of the motion.
    shaken: Shaken,
    cost: Costs,
}

/// Factors in surge, sway, heave, roll, pitch and yaw; under water, and at the surface, where waves push.
type Shaken = [[f64; 6]; 2];

/// Makes the noise of the motion more or less by these factors.
fn shake(setup: &mut Setup, factors: &Shaken) {
    let noises = [&mut setup.noise, &mut setup.surface.noise];
    for (noise, factors) in noises.into_iter().zip(factors) {
        let declared = noise.linear_mps2_per_sqrt_hz.iter_mut().chain(&mut noise.angular_radps2_per_sqrt_hz);
        declared.zip(factors).for_each(|(noise, factor)| *noise *= factor);
    }
}

/// Σ (ln S + e²).
#[derive(Clone, Copy)]
struct Costs {
    /// Of each channel's innovations that waves do not move.
    own: [f64; ResidualChannel::COUNT],
    /// Of all innovations.
    all: f64,
}

impl Costs {
    /// Of all innovations that waves do not move.
    fn telling(&self) -> f64 {
        self.own.iter().sum()
    }
}

impl Search<'_> {
    fn start(&self, mixtures: Mixtures, shaken: Shaken) -> Option<Best> {
        Some(Best { mixtures, shaken, cost: self.cost(&mixtures, shaken)? })
    }

    /// White noise of the size that is most likely, and noise with one part that lasts.
    fn rough(&self) -> Option<[Best; 2]> {
        let scale = &self.log_data.setup.scale;
        let mut best = self.start(std::array::from_fn(|channel| Mixture::white(scale[channel])), [[1.0; 6]; 2])?;
        self.resize(&mut best, &[0.12, 0.18, 0.28, 0.42, 0.65, 0.8, 1.25, 1.6]);
        self.resize(&mut best, &[0.75, 0.84, 0.92, 1.09, 1.19, 1.3]);
        self.resize(&mut best, &[0.96, 1.04]);
        let white = best;
        let grid = SHARES
            .iter()
            .flat_map(|share| self.sensors.taus_s.map(|tau_s| move |m: &Mixture| with_part(m, 0, |_| (*share, tau_s))));
        self.improve(&mut best, &grid.collect::<Vec<_>>());
        self.improve(&mut best, &[0.08, 0.35, 0.8, 0.93, 0.98].map(|share| shared(0, share)));
        self.resize(&mut best, &[0.75, 0.87, 1.15, 1.35, 1.6]);
        self.improve(&mut best, &[0.6, 1.6].map(slower));
        self.shake(&mut best, [&[0.4, 0.65, 1.5, 2.5], &[0.5, 2.0, 4.0]]);
        self.resize(&mut best, &[0.8, 0.9, 1.1, 1.25]);
        Some([white, best])
    }

    /// Each with a second part where it has one, and with none where it has none.
    fn refined(&self, [white, one]: &[Best; 2]) -> Option<Best> {
        let mut one = self.start(one.mixtures, one.shaken)?;
        // What a log begins with need not be as loud as the rest.
        self.resize(&mut one, &LOUDER);
        let mut best = one;
        // Alone the first part stands for both: beside a slower one it is faster.
        let second = |(second_share, tau_s): (f64, f64), faster: f64| {
            move |m: &Mixture| match m.parts[0] {
                (share, first_s) if share > 0.0 => {
                    Mixture { parts: [(share, faster * first_s), (second_share, tau_s)], ..*m }
                }
                _ => *m,
            }
        };
        let slow = self.sensors.second.into_iter().flat_map(|part| [0.4, 1.0].map(|faster| second(part, faster)));
        self.improve(&mut best, &slow.collect::<Vec<_>>());
        self.improve(&mut best, &[0.01, 0.04, 0.15, 0.25].map(|share| shared(1, share)));
        self.undo_small_gains(&mut best, &one.mixtures, SECOND_GAIN);
        self.improve(&mut best, &[0.3, 0.55, 1.8, 3.3].map(louder));
        self.shake(&mut best, [&[0.75, 1.3]; 2]);
        self.resize(&mut best, &[0.9, 1.1]);
        self.improve(&mut best, &[0.6, 0.77, 1.3, 1.7].map(slower));
        self.improve(&mut best, &[0.7, 0.85, 1.2, 1.4].map(louder));
        let mut white = self.start(white.mixtures, best.shaken)?;
        self.resize(&mut white, &LOUDER);
        self.resize(&mut white, &[0.93, 1.07]);
        self.undo_small_gains(&mut best, &white.mixtures, self.sensors.least_gain);
        Some(best)
    }

    /// Puts each device back to what it was before, where all channels together have gained too little by it since: beside
    /// what the others are now, its own innovations before say nothing.
    fn undo_small_gains(&self, best: &mut Best, before: &Mixtures, least_gain: f64) {
        for device in self.sensors.devices {
            let mut mixtures = best.mixtures;
            for channel in device.iter().filter(|channel| self.channels.contains(channel)) {
                mixtures[*channel as usize] = before[*channel as usize];
            }
            if mixtures != best.mixtures
                && let Some(cost) = self.cost(&mixtures, best.shaken)
                && cost.telling() - best.cost.telling() < least_gain
            {
                (best.mixtures, best.cost) = (mixtures, cost);
            }
        }
    }

    /// Puts the noise of channels, and its cost, into the best.
    fn take(&self, best: &mut Best, mixtures: &Mixtures, cost: &Costs, channels: &[ResidualChannel]) {
        for channel in channels.iter().filter(|channel| self.channels.contains(channel)) {
            let at = *channel as usize;
            (best.mixtures[at], best.cost.own[at]) = (mixtures[at], cost.own[at]);
        }
    }

    /// Lets each channel take the factor on its size that makes its innovations most likely.
    fn resize(&self, best: &mut Best, factors: &[f64]) {
        let sized = |factor: f64| move |m: &Mixture| Mixture { size: factor * m.size, ..*m };
        let alone: Vec<&[ResidualChannel]> = self.channels.iter().map(std::slice::from_ref).collect();
        self.change(best, &alone, &factors.iter().map(|factor| sized(*factor)).collect::<Vec<_>>());
    }

    /// Lets each noise of the motion take the factor that makes all innovations most likely.
    fn shake(&self, best: &mut Best, factors: [&[f64]; 2]) {
        let surface_m = self.log_data.setup.surface.depth_m;
        let has_surfaced = self.log_data.declared.trace.iter().any(|trace| trace.x[Z] < surface_m);
        let waters = if has_surfaced { 2 } else { 1 };
        for (water, place) in (0..waters).flat_map(|water| (0..6).map(move |place| (water, place))) {
            if !self.sensors.are_inertial {
                break;
            }
            let most = MOST_SHAKEN[water];
            let trial = |factor: &f64| {
                let mut shaken = best.shaken;
                shaken[water][place] = (factor * shaken[water][place]).clamp(1.0 / most, most);
                Some((shaken, self.cost(&best.mixtures, shaken)?))
            };
            let trials: Vec<_> = factors[water].par_iter().filter_map(trial).collect();
            for (shaken, cost) in trials {
                if cost.all < best.cost.all {
                    (best.shaken, best.cost) = (shaken, cost);
                }
            }
        }
    }

    /// Lets each device take the change of its spectrum that makes its innovations most likely.
    fn improve(&self, best: &mut Best, changes: &[impl Fn(&Mixture) -> Mixture]) {
        self.change(best, self.sensors.devices, changes);
    }

    /// Lets channels take, those of a group together, the change that makes their innovations most likely.
    fn change(&self, best: &mut Best, groups: &[&[ResidualChannel]], changes: &[impl Fn(&Mixture) -> Mixture]) {
        let sensors = &self.log_data.setup.sensors;
        let trial = |change: &dyn Fn(&Mixture) -> Mixture| {
            let mut trial = best.mixtures;
            for channel in self.channels {
                let at = *channel as usize;
                let mut changed = change(&trial[at]);
                let is_fix = matches!(channel, ResidualChannel::GnssX | ResidualChannel::GnssY);
                let least = if is_fix { LEAST_OF_FIXES } else { LEAST_SIZE };
                changed.size = changed.size.clamp(least, channel.most_scale(sensors));
                if changed.is_possible(self.sensors) {
                    trial[at] = changed;
                }
            }
            trial
        };
        let trials: Vec<Mixtures> = changes.iter().map(|change| trial(change)).collect();
        let costs: Vec<_> = trials.par_iter().map(|trial| self.cost(trial, best.shaken)).collect();
        let before = best.mixtures;
        for channels in groups {
            let sum = |cost: &Costs| channels.iter().map(|channel| cost.own[*channel as usize]).sum::<f64>();
            for (trial, cost) in trials.iter().zip(&costs) {
                if let Some(cost) = cost.filter(|cost| sum(cost) < sum(&best.cost)) {
                    self.take(best, trial, &cost, channels);
                }
            }
        }
        // Each took its best beside the others' trial; beside the others' best it may stand otherwise.
        if best.mixtures != before
            && let Some(cost) = self.cost(&best.mixtures, best.shaken)
        {
            best.cost = cost;
        }
    }

    /// Σ (ln S + e²) over the blocks that choose.
    fn cost(&self, noise: &Mixtures, factors: Shaken) -> Option<Costs> {
        let mut setup = self.log_data.setup.clone();
        apply(&mut setup, noise, self.channels);
        shake(&mut setup, &factors);
        let pass = whitener::run(&setup, &self.log_data.samples, self.set, &[])?;
        let is_seen = |r: &&Residual| self.log_data.split.is_at(DataPart::Seen, r.t_s);
        let of = |r: &Residual| 2.0 * r.sigma.ln() + r.normalised().powi(2);
        let all = pass.residuals.iter().filter(|r| r.used).filter(is_seen).map(of).sum();
        let mut own = [0.0; ResidualChannel::COUNT];
        for r in pass.telling().filter(is_seen) {
            own[r.channel as usize] += of(r);
        }
        Some(Costs { own, all })
    }
}

fn with_part(mixture: &Mixture, place: usize, change: impl Fn((f64, f64)) -> (f64, f64)) -> Mixture {
    let mut changed = *mixture;
    changed.parts[place] = change(changed.parts[place]);
    changed
}

/// The share of a part that is there.
fn shared(place: usize, share: f64) -> impl Fn(&Mixture) -> Mixture {
    move |m: &Mixture| with_part(m, place, |(old, tau_s)| (if old > 0.0 { share } else { 0.0 }, tau_s))
}

/// The variance of the first part, beside which the others keep theirs.
fn louder(factor: f64) -> impl Fn(&Mixture) -> Mixture {
    move |m: &Mixture| {
        let [(first, first_s), (second, second_s)] = m.parts;
        let whole = 1.0 + (factor - 1.0) * first;
        let parts = [(factor * first / whole, first_s), (second / whole, second_s)];
        Mixture { size: m.size * whole.sqrt(), parts }
    }
}

/// The time constant of the first part.
fn slower(factor: f64) -> impl Fn(&Mixture) -> Mixture {
    move |m: &Mixture| with_part(m, 0, |(share, tau_s)| (share, if share > 0.0 { factor * tau_s } else { tau_s }))
}

/// In a sentence for each channel whose noise lasts.
#[must_use]
pub fn notes(setup: &Setup) -> Vec<String> {
    let of = |channel: ResidualChannel| {
        let lasting: Vec<&Colour> = setup.colours.iter().filter(|colour| colour.channel == channel).collect();
        let white = channel.declared_sigma(&setup.sensors) * setup.scale[channel as usize];
        let parts: Vec<String> =
            lasting.iter().map(|colour| format!("{:.2e} over {:.1} s", colour.sigma, colour.tau_s)).collect();
        (!parts.is_empty()).then(|| {
            let (name, unit) = (channel.name(), channel.unit());
            format!("{name}: noise of {white:.2e} {unit}, and noise that lasts: {} (one sigma)", parts.join(", "))
        })
    };
    SENSORS.iter().flat_map(|sensors| sensors.devices.concat()).filter_map(of).collect()
}
