//! Noise as sensors and the sea make it: white, correlated over a while, and (of sums) walking off.
//!
//! A scalar's error is white noise, plus a first-order Gauss-Markov process (a receiver's wander, waves, eddies), plus,
//! where rows are sums since the beginning of their sequence, a random walk. The three sizes and the correlation time
//! are those of largest likelihood on the data that fit and choose. A Kalman filter whitens by them; its gains are those
//! of the residuals and of their derivatives alike, which makes the fit generalised least squares. Noise that no sensor
//! makes does not pass as noise: what is left on the data that judges is held against [`backseat_logs::plausible_noise`].

use super::layout::Layout;
use super::model::Row;
use crate::samples::ResidualChannel;
use crate::split::DataPart;
use backseat_logs::stats::median;

/// Correlation times that noise may have, s; what is slower is structure.
const MEMORY_S: [f64; 2] = [0.5, 120.0];
/// Innovations beyond this many sigmas are taken as outliers, and after so many in a row the sequence as broken.
pub(super) const OUTLIER: f64 = 6.0;
const BROKEN: usize = 5;
/// Beyond this many sigmas a row counts less (Huber 1964).
pub(super) const HUBER: f64 = 2.5;

/// Noise of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Which.
    pub channel: ResidualChannel,
    /// White part, one sigma in the channel's unit.
    pub white: f64,
    /// Correlated part, one sigma, and its correlation time, s.
    pub slow: f64,
    /// See `slow`.
    pub memory_s: f64,
    /// Random walk, unit/√s; zero where rows are no sums.
    pub walk: f64,
}

/// A whitened row: its place in the list of rows, innovation over its sigma, and the sigma.
pub(super) struct Whitened {
    pub row: usize,
    pub e: f64,
    pub sigma: f64,
    pub slopes: Vec<f64>,
}

impl Noise {
    /// As a note.
    #[must_use]
    pub fn describe(&self) -> String {
        let (name, unit) = (self.channel.name(), self.channel.unit());
        let mut parts = vec![format!("white noise of {:.2e} {unit}", self.white)];
        if self.slow > 0.1 * self.white {
            parts.push(format!("{:.2e} {unit} correlated over {:.0} s", self.slow, self.memory_s));
        }
        if self.walk > 0.0 {
            parts.push(format!("a random walk of {:.2e} {unit}/√s", self.walk));
        }
        format!("{name}: {}, estimated from the log", parts.join(", "))
    }

    /// Runs the filter over a channel's rows, which are in order; `visit` receives place, innovation and its variance,
    /// and the whitened derivatives where there are `slopes`.
    fn filter(
        &self,
        rows: &[ChannelRow],
        slopes: Option<&dyn Fn(usize) -> Vec<f64>>,
        limit: f64,
        mut visit: impl FnMut(usize, f64, f64, &[f64]),
    ) {
        let is_sum = self.walk > 0.0;
        let (white, slow) = (self.white * self.white, self.slow * self.slow);
        // Large against anything measured, small enough for its square to be a number that holds it.
        let unknown = 1e8 * (white + slow + self.walk * self.walk);
        // Values of walk and slow part: of the residual, then of each derivative.
        let mut state: Vec<[f64; 2]> = Vec::new();
        let mut p = [unknown, 0.0, slow];
        let mut last: Option<&ChannelRow> = None;
        let mut bad = 0;
        let (mut values, mut innovations) = (Vec::new(), Vec::new());
        // Most rows are as far apart as the two before.
        let (mut dt_s, mut keep) = (0.0, 1.0);
        for this in rows {
            let ChannelRow { place, row, part } = this;
            values.clear();
            values.push(row.residual);
            values.extend(slopes.map_or_else(Vec::new, |of| of(*place)));
            let follows = |before: &&ChannelRow| before.row.sequence == row.sequence && before.part == *part;
            let before = last.filter(follows).filter(|_| bad < BROKEN);
            let is_first = before.is_none();
            if let Some(before) = before {
                let since_s = (row.t_s - before.row.t_s).max(0.0);
                if since_s != dt_s {
                    (dt_s, keep) = (since_s, (-since_s / self.memory_s).exp());
                }
                state.iter_mut().for_each(|state| state[1] *= keep);
                p = [p[0] + self.walk * self.walk * dt_s, p[1] * keep, p[2] * keep * keep + slow * (1.0 - keep * keep)];
            } else {
                state = vec![[0.0; 2]; values.len()];
                p = [if is_sum { unknown } else { 0.0 }, 0.0, slow];
                bad = 0;
            }
            last = Some(this);
            let variance = p[0] + 2.0 * p[1] + p[2] + white;
            let gain = [(p[0] + p[1]) / variance, (p[1] + p[2]) / variance];
            innovations.clear();
            innovations.extend(values.iter().zip(&state).map(|(value, state)| value - state[0] - state[1]));
            // The first of a sum only says where the sum begins.
            let is_start = is_first && is_sum;
            if !is_start && innovations[0].abs() > limit * variance.sqrt() {
                bad += 1;
                continue;
            }
            bad = 0;
            for (state, innovation) in state.iter_mut().zip(&innovations) {
                state[0] += gain[0] * innovation;
                state[1] += gain[1] * innovation;
            }
            let h = [p[0] + p[1], p[1] + p[2]];
            p = [p[0] - gain[0] * h[0], p[1] - gain[0] * h[1], p[2] - gain[1] * h[1]];
            if !is_start {
                visit(*place, innovations[0], variance, &innovations[1..]);
            }
        }
    }

    /// Whitened rows of the channel; `slopes` gives the derivatives of the row at a place.
    pub(super) fn whiten(&self, rows: &[Row], layout: &Layout, slopes: &dyn Fn(usize) -> Vec<f64>) -> Vec<Whitened> {
        let own = of_channel(rows.iter(), layout, self.channel);
        // Far from a fit every row would be an outlier: then the limit is of what they scatter.
        let mut sizes = Vec::new();
        self.filter(&own, None, f64::INFINITY, |_, innovation, variance, _| {
            sizes.push(innovation.abs() / variance.sqrt());
        });
        let limit = OUTLIER * (1.482_602 * median(&sizes).unwrap_or(0.0)).max(1.0);
        let mut whitened = Vec::new();
        self.filter(&own, Some(slopes), limit, |row, innovation, variance, slopes| {
            let sigma = variance.sqrt();
            let slopes = slopes.iter().map(|slope| slope / sigma).collect();
            whitened.push(Whitened { row, e: innovation / sigma, sigma, slopes });
        });
        whitened
    }

    /// −2 ln of the likelihood of rows of the data that fit and choose; outliers cost as much as the limit.
    fn cost(&self, channels: &[Vec<ChannelRow>]) -> f64 {
        let mut cost = 0.0;
        for rows in channels {
            let mut used = 0;
            self.filter(rows, None, OUTLIER, |_, innovation, variance, _| {
                cost += loss(innovation / variance.sqrt()) + variance.ln();
                used += 1;
            });
            let lost = rows.len().saturating_sub(used) as f64;
            cost += lost * loss(OUTLIER);
        }
        cost
    }
}

/// Huber's: the square of a normalised innovation, beyond the limit a line.
pub(super) fn loss(e: f64) -> f64 {
    let size = e.abs();
    if size < HUBER { size * size } else { HUBER * (2.0 * size - HUBER) }
}

/// A row of one channel.
struct ChannelRow<'a> {
    /// Place in the list of all rows.
    place: usize,
    row: &'a Row,
    /// What its time is used for, see [`Layout::use_of`].
    part: u8,
}

/// Rows of a channel.
fn of_channel<'a>(
    rows: impl Iterator<Item = &'a Row>,
    layout: &Layout,
    channel: ResidualChannel,
) -> Vec<ChannelRow<'a>> {
    let own = rows.enumerate().filter(|(_, row)| row.channel == channel);
    own.map(|(place, row)| ChannelRow { place, row, part: layout.use_of(row.t_s) }).collect()
}

/// Noise of every channel, from residuals of the data that fit and choose; north and east of one receiver have the same.
/// `free` is the number of columns that were fitted to them.
pub(super) fn estimate(
    rows: &[Row],
    layout: &Layout,
    is_summed: impl Fn(ResidualChannel) -> bool,
    free: usize,
) -> Vec<Noise> {
    let seen: Vec<&Row> = rows.iter().filter(|row| layout.is_in(DataPart::Seen, layout.block(row.t_s))).collect();
    let mut found: Vec<Noise> = Vec::new();
    let share = 1.0 - (free as f64 / seen.len().max(1) as f64).min(0.5);
    for channel in ResidualChannel::ALL {
        let has = rows.iter().any(|row| row.channel == channel);
        let pair = match channel {
            ResidualChannel::GnssX => vec![ResidualChannel::GnssX, ResidualChannel::GnssY],
            ResidualChannel::GnssY if found.iter().any(|noise| noise.channel == ResidualChannel::GnssX) => {
                let same = found.iter().find(|noise| noise.channel == ResidualChannel::GnssX).copied();
                found.extend(same.map(|noise| Noise { channel, ..noise }));
                continue;
            }
            _ => vec![channel],
        };
        if !has {
            continue;
        }
        let of_seen = |channel: &ResidualChannel| of_channel(seen.iter().copied(), layout, *channel);
        let channels: Vec<Vec<ChannelRow>> = pair.iter().map(of_seen).collect();
        let mut noise = of_largest_likelihood(channel, &channels, is_summed(channel));
        let widen = share.sqrt();
        (noise.white, noise.slow, noise.walk) = (noise.white / widen, noise.slow / widen, noise.walk / widen);
        found.push(noise);
    }
    found
}

/// Searches the four numbers by ever smaller steps of their logarithms, one after the other.
fn of_largest_likelihood(channel: ResidualChannel, channels: &[Vec<ChannelRow>], is_sum: bool) -> Noise {
    let residuals: Vec<f64> = channels.iter().flatten().map(|own| own.row.residual).collect();
    let steps: Vec<f64> = channels
        .iter()
        .flat_map(|rows| rows.windows(2))
        .filter(|pair| pair[0].row.sequence == pair[1].row.sequence)
        .map(|pair| (pair[1].row.residual - pair[0].row.residual).abs())
        .collect();
    let spread = |of: &[f64]| 1.482_602 * median(of).unwrap_or(0.0);
    let middle = median(&residuals).unwrap_or(0.0);
    // A mean that nothing explains yet is part of what has to be allowed for, or every row would be an outlier.
    let all = spread(&residuals.iter().map(|e| (e - middle).abs()).collect::<Vec<_>>()).hypot(middle).max(1e-9);
    // No sensor is a thousand times better than its class may be.
    let least = (1e-3 * spread(&steps)).max(1e-3 * channel.sensor().of_class());
    let size = if is_sum { spread(&steps).max(1e-6) } else { all };
    // Few rows determine one number.
    if residuals.len() < 40 {
        let few = (residuals.iter().map(|e| e * e).sum::<f64>() / residuals.len().max(1) as f64).sqrt();
        let white = if is_sum { size } else { all.max(few) };
        let walk = if is_sum { size } else { 0.0 };
        return Noise { channel, white: white.max(1e-9), slow: 0.0, memory_s: 1.0, walk };
    }
    let of = |x: &[f64; 4]| Noise {
        channel,
        white: x[0].exp().max(least),
        slow: x[1].exp(),
        memory_s: x[2].exp().clamp(MEMORY_S[0], MEMORY_S[1]),
        walk: if is_sum { x[3].exp().max(1e-3 * least) } else { 0.0 },
    };
    let mut best: Option<(f64, [f64; 4])> = None;
    let narrow = spread(&steps).min(size).max(least);
    for (size, memory_s) in [(size, 3.0_f64), (size, 30.0), (narrow, 3.0), (narrow, 30.0)] {
        let mut x = [(0.7 * size).ln(), (0.5 * size).ln(), memory_s.ln(), (0.3 * size).ln()];
        let mut cost = of(&x).cost(channels);
        let mut step = 1.0;
        while step > 0.05 {
            let mut moved = false;
            for place in 0..if is_sum { 4 } else { 3 } {
                for sign in [1.0, -1.0] {
                    let mut trial = x;
                    trial[place] += sign * step;
                    let fresh = of(&trial).cost(channels);
                    if fresh < cost - 1e-3 {
                        (x, cost, moved) = (trial, fresh, true);
                        break;
                    }
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        if best.is_none_or(|(other, _)| cost < other) {
            best = Some((cost, x));
        }
    }
    best.map_or(Noise { channel, white: all, slow: 0.0, memory_s: 1.0, walk: 0.0 }, |(_, x)| of(&x))
}
