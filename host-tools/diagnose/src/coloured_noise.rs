//! Noise as sensors have it: of each channel a white part and up to two that last, estimated beside the effects found.
//!
//! The parts are chosen by likelihood, Σ (ln S + e²) over the blocks that choose, on a grid of shares and time constants:
//! every trial changes all channels at once, and each channel keeps the trial under which its own innovations are most
//! likely. No channel's noise grows beyond what its kind of sensor makes ([`SensorKind::most`]), so that what no sensor
//! makes stays in the innovations.
//!
//! [`SensorKind::most`]: backseat_logs::plausible_noise::SensorKind::most

use crate::log_effects::Effects;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::samples::ResidualChannel;
use crate::whitener::{self, Colour, Pass, Setup};
use backseat_logs::stats::{autocorrelation, ljung_box};
use rayon::prelude::*;

/// Sensors whose noise is estimated together.
pub struct Sensors {
    channels: &'static [ResidualChannel],
    /// So many seconds from a log's beginning say enough of their noise.
    pub longest_s: f64,
    /// Samples below which a channel's noise is taken as declared.
    fewest: usize,
    /// What a part that lasts must gain in Σ (ln S + e²): three numbers at their cost, 3 ln n.
    least_gain: f64,
}

/// All whose noise may last. GNSS fixes count by their design effect.
pub const SENSORS: [Sensors; 2] = [
    // Of a time constant of a minute, ten; in a log of 10,000 samples.
    Sensors { channels: &OWN, longest_s: 600.0, fewest: 400, least_gain: 27.0 },
    // A reading every ten seconds is seldom: an hour, 150 samples.
    Sensors { channels: &ACOUSTIC, longest_s: 3600.0, fewest: 60, least_gain: 15.0 },
];
const OWN: [ResidualChannel; 10] = [
    ResidualChannel::Depth,
    ResidualChannel::Roll,
    ResidualChannel::Pitch,
    ResidualChannel::Heading,
    ResidualChannel::P,
    ResidualChannel::Q,
    ResidualChannel::R,
    ResidualChannel::DvlU,
    ResidualChannel::DvlV,
    ResidualChannel::DvlW,
];
const ACOUSTIC: [ResidualChannel; 4] =
    [ResidualChannel::Range, ResidualChannel::UsblAlong, ResidualChannel::UsblAcross, ResidualChannel::UsblDown];
/// Lags of the test whether there is anything to estimate, and its probability.
const LAGS: usize = 20;
const SUSPECTED: f64 = 1e-4;
/// Time constants in s and shares tried at first.
const TAUS_S: [f64; 5] = [0.7, 2.0, 6.0, 20.0, 60.0];
const SHARES: [f64; 2] = [0.15, 0.6];

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

    fn is_possible(&self) -> bool {
        let inside = |(share, tau_s): (f64, f64)| (0.0..=0.97).contains(&share) && (0.4..=70.0).contains(&tau_s);
        self.parts.iter().copied().all(inside) && self.parts[0].0 + self.parts[1].0 <= 0.97
    }
}

type Mixtures = [Mixture; ResidualChannel::COUNT];

/// The noise of some channels.
pub struct Noise {
    mixtures: Mixtures,
    channels: Vec<ResidualChannel>,
}

impl Noise {
    /// Puts it in the place of what these channels had.
    pub fn apply(&self, setup: &mut Setup) {
        apply(setup, &self.mixtures, &self.channels);
    }
}

/// Estimates the noise of some sensors beside a set of effects; `None` where none of it lasts. Channels of `kept` stay.
#[must_use]
pub fn estimate(log_data: &PreparedLog, set: &Effects, sensors: &Sensors, kept: &[ResidualChannel]) -> Option<Noise> {
    let base = log_data.pass(set, &[])?;
    let mut suspected = suspected(log_data, &base, sensors);
    suspected.retain(|channel| !kept.contains(channel));
    if suspected.is_empty() {
        return None;
    }
    let mixtures = Search { log_data, set, suspected: &suspected, least_gain: sensors.least_gain }.run()?;
    let lasts = suspected.iter().any(|channel| mixtures[*channel as usize].parts[0].0 > 0.0);
    lasts.then_some(Noise { mixtures, channels: suspected })
}

/// Whether innovations of any channel are not white where nothing judges.
#[must_use]
pub fn is_suspected(log_data: &PreparedLog, pass: &Pass) -> bool {
    SENSORS.iter().any(|sensors| !suspected(log_data, pass, sensors).is_empty())
}

fn suspected(log_data: &PreparedLog, pass: &Pass, sensors: &Sensors) -> Vec<ResidualChannel> {
    let is_suspected = |channel: &ResidualChannel| {
        let seen = |t_s: f64| log_data.split.is_at(DataPart::Seen, t_s);
        let mut own: Vec<_> =
            pass.residuals.iter().filter(|r| r.channel == *channel && r.used && seen(r.t_s)).collect();
        // what lasts, lasts for one transponder
        own.sort_by_key(|r| r.station);
        let e: Vec<f64> = own.into_iter().map(whitener::Residual::normalised).collect();
        e.len() >= sensors.fewest && ljung_box(&autocorrelation(&e, LAGS), e.len(), 0) < SUSPECTED
    };
    sensors.channels.iter().copied().filter(is_suspected).collect()
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
    suspected: &'a [ResidualChannel],
    least_gain: f64,
}

impl Search<'_> {
    fn run(&self) -> Option<Mixtures> {
        let scale = &self.log_data.setup.scale;
        let white: Mixtures = std::array::from_fn(|channel| Mixture::white(scale[channel]));
        let plain = self.cost(&white)?;
        let mut best = (white, plain);
        let first = |share: f64, tau_s: f64| move |m: &Mixture| Mixture { parts: [(share, tau_s), (0.0, 1.0)], ..*m };
        let grid: Vec<_> = SHARES.iter().flat_map(|share| TAUS_S.map(|tau_s| first(*share, tau_s))).collect();
        self.improve(&mut best, &grid);
        let share = |share: f64| {
            move |m: &Mixture| with_part(m, 0, |(old, tau_s)| (if old > 0.0 { share } else { 0.0 }, tau_s))
        };
        self.improve(&mut best, &[0.08, 0.35, 0.8, 0.93].map(share));
        self.improve(&mut best, &[0.75, 0.87, 1.15, 1.35, 1.6].map(sized));
        self.improve(&mut best, &[0.6, 1.6].map(slower));
        let second = |share: f64, tau_s: f64| {
            move |m: &Mixture| with_part(m, 1, |_| if m.parts[0].0 > 0.0 { (share, tau_s) } else { (0.0, 1.0) })
        };
        let one = best;
        self.improve(&mut best, &[1.0, 5.0, 20.0, 50.0].map(|tau_s| second(0.12, tau_s)));
        // A second part must be worth its numbers too.
        for channel in self.suspected {
            let at = *channel as usize;
            if one.1[at] - best.1[at] < self.least_gain {
                (best.0[at], best.1[at]) = (one.0[at], one.1[at]);
            }
        }
        self.improve(&mut best, &[0.1, 0.2, 0.4, 0.6, 0.8].map(share));
        self.improve(&mut best, &[0.9, 1.1].map(sized));
        self.improve(&mut best, &[0.77, 1.3].map(slower));
        for channel in self.suspected {
            let at = *channel as usize;
            if plain[at] - best.1[at] < self.least_gain {
                best.0[at] = white[at];
            }
        }
        Some(best.0)
    }

    /// Lets each suspected channel take the change that makes its innovations most likely.
    fn improve(
        &self,
        best: &mut (Mixtures, [f64; ResidualChannel::COUNT]),
        changes: &[impl Fn(&Mixture) -> Mixture + Sync],
    ) {
        let sensors = &self.log_data.setup.sensors;
        let trial = |change: &(dyn Fn(&Mixture) -> Mixture + Sync)| {
            let mut trial = best.0;
            for channel in self.suspected {
                let at = *channel as usize;
                let mut changed = change(&best.0[at]);
                // Data are not trusted more than they were declared.
                changed.size = changed.size.clamp(1.0, channel.most_scale(sensors));
                if changed.is_possible() {
                    trial[at] = changed;
                }
            }
            trial
        };
        let trials: Vec<Mixtures> = changes.iter().map(|change| trial(change)).collect();
        let costs: Vec<_> = trials.par_iter().map(|trial| self.cost(trial)).collect();
        let before = best.0;
        for channel in self.suspected {
            let at = *channel as usize;
            for (trial, cost) in trials.iter().zip(&costs) {
                if let Some(cost) = cost.filter(|cost| cost[at] < best.1[at]) {
                    (best.0[at], best.1[at]) = (trial[at], cost[at]);
                }
            }
        }
        // Each took its best beside the others' trial; beside the others' best it may stand otherwise.
        if best.0 != before
            && let Some(cost) = self.cost(&best.0)
        {
            best.1 = cost;
        }
    }

    /// Σ (ln S + e²) of each channel over the blocks that choose.
    fn cost(&self, noise: &Mixtures) -> Option<[f64; ResidualChannel::COUNT]> {
        let mut setup = self.log_data.setup.clone();
        apply(&mut setup, noise, self.suspected);
        let pass = whitener::run(&setup, &self.log_data.samples, self.set, &[])?;
        let mut cost = [0.0; ResidualChannel::COUNT];
        for r in pass.residuals.iter().filter(|r| r.used && self.log_data.split.is_at(DataPart::Seen, r.t_s)) {
            cost[r.channel as usize] += 2.0 * r.sigma.ln() + r.normalised().powi(2);
        }
        Some(cost)
    }
}

fn with_part(mixture: &Mixture, place: usize, change: impl Fn((f64, f64)) -> (f64, f64)) -> Mixture {
    let mut changed = *mixture;
    changed.parts[place] = change(changed.parts[place]);
    changed
}

fn sized(factor: f64) -> impl Fn(&Mixture) -> Mixture {
    move |m: &Mixture| Mixture { size: factor * m.size, ..*m }
}

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
    SENSORS.iter().flat_map(|sensors| sensors.channels).copied().filter_map(of).collect()
}
