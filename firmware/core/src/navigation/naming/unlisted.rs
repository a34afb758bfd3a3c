//! Ranges that are wrong in a way of their own: none of the causes is it, whatever its size.
//!
//! What is known of such an error is only what it looks like: the innovations of ranges scatter more than declared (echoes),
//! or what one shows is still there minutes later (a ship that wanders, a compass that turns slowly). Each is a model of
//! the noise, a white part of variance w and one of variance b that dies away with a time constant τ, whose likelihood a
//! scalar Kalman filter sums up. Something began where one model held before and a worse one since: over all models i, j
//! and times t₀, with ℓ(t) the logarithm of the likelihood until t,
//!
//!   B = Σ Δt π_i exp(ℓ_i(t₀) + ℓ_j(t) − ℓ_j(t₀)) / Σ π_i exp ℓ_i(t).
//!
//! Ranges that have been so from the start are no change: in the denominator any model may have held all the time.

/// Their variances, white and lasting, those of the declared noise first; a later one may follow on those before it.
const MODELS: [Model; 5] = [
    Model { white: 1.0, lasting: 0.0, follows: 0 },
    Model { white: 2.0, lasting: 0.0, follows: 1 },
    Model { white: 1.0, lasting: 1.0, follows: 1 },
    Model { white: 4.0, lasting: 0.0, follows: 3 },
    Model { white: 1.0, lasting: 3.0, follows: 3 },
];
/// Time constant of what lasts, s: a few ranges, and less than a line.
const LASTS_S: f64 = 400.0;
/// Probability that ranges are not as declared from the start, in one way or another.
const FROM_START: f64 = 1.0e-5;

struct Model {
    white: f64,
    lasting: f64,
    /// How many of the models may have held before it.
    follows: usize,
}

/// How well a model predicts, and since when.
#[derive(Clone, Copy)]
struct Track {
    /// What lasts, and its variance.
    mean: f64,
    variance: f64,
    /// ℓ.
    likelihood: f64,
    /// ln Σ Δt π_i exp(ℓ_i(t₀) − ℓ(t₀)), Δt in hours.
    began: f64,
}

/// The innovations of ranges.
pub(super) struct Unlisted {
    tracks: [Track; MODELS.len()],
    /// When the last one came; 0: none yet.
    last_us: u64,
}

/// What they say.
#[derive(Clone, Copy)]
pub(super) struct Odds {
    /// ln B.
    pub(super) against_no_change: f64,
    /// The same against ranges with the declared noise, as the causes are weighed.
    pub(super) against_declared: f64,
    /// They scatter, and nothing lasts.
    pub(super) is_scatter: bool,
}

/// ln(eᵃ + eᵇ).
fn log_add(a: f64, b: f64) -> f64 {
    let (large, small) = if a > b { (a, b) } else { (b, a) };
    if small == f64::NEG_INFINITY { large } else { large + libm::log1p(libm::exp(small - large)) }
}

/// ln π of a model.
fn log_prior(place: usize) -> f64 {
    if place == 0 { 0.0 } else { libm::log(FROM_START / (MODELS.len() - 1) as f64) }
}

impl Unlisted {
    /// All bytes zero: restart it.
    pub(super) const NONE: Self =
        Self { tracks: [Track { mean: 0.0, variance: 0.0, likelihood: 0.0, began: 0.0 }; MODELS.len()], last_us: 0 };

    pub(super) fn restart(&mut self) {
        *self = Self::NONE;
        for (track, model) in self.tracks.iter_mut().zip(&MODELS) {
            (track.variance, track.began) = (model.lasting, f64::NEG_INFINITY);
        }
    }

    /// ln Σ π_i exp ℓ_i of the first so many models.
    fn held(&self, models: usize) -> f64 {
        let tracks = self.tracks.iter().take(models).enumerate();
        tracks.map(|(i, track)| log_prior(i) + track.likelihood).fold(f64::NEG_INFINITY, log_add)
    }

    /// The normalised innovation of a range, three at most.
    #[inline(never)]
    pub(super) fn take(&mut self, time_us: u64, e: f64) {
        let since_us = if self.last_us == 0 { 0 } else { time_us.saturating_sub(self.last_us) };
        self.last_us = time_us;
        let since_s = 1.0e-6 * since_us as f64;
        let kept = libm::exp(-since_s / LASTS_S);
        let before: [f64; MODELS.len()] = core::array::from_fn(|j| self.held(MODELS.get(j).map_or(0, |m| m.follows)));
        for ((track, model), before) in self.tracks.iter_mut().zip(&MODELS).zip(before) {
            if since_us > 0 {
                track.began = log_add(track.began, libm::log(since_s / 3600.0) + before - track.likelihood);
            }
            track.mean *= kept;
            track.variance = kept * kept * track.variance + (1.0 - kept * kept) * model.lasting;
            let (total, left) = (track.variance + model.white, e - track.mean);
            track.likelihood -= 0.5 * (left * left / total + libm::log(total));
            let gain = track.variance / total;
            track.mean += gain * left;
            track.variance *= 1.0 - gain;
        }
    }

    /// What all ranges until now say.
    pub(super) fn odds(&self) -> Odds {
        let since = |track: &Track| track.began + track.likelihood;
        let of = |scatters: bool| {
            let tracks = self.tracks.iter().zip(&MODELS).filter(|(_, model)| (model.lasting == 0.0) == scatters);
            tracks.map(|(track, _)| since(track)).fold(f64::NEG_INFINITY, log_add)
        };
        let (scatter, lasting) = (of(true), of(false));
        let number = libm::log((MODELS.len() - 1) as f64);
        let all = log_add(scatter, lasting) - number;
        let declared = self.tracks.first().map_or(0.0, |track| track.likelihood);
        Odds {
            against_no_change: all - self.held(MODELS.len()),
            against_declared: all - declared,
            is_scatter: scatter > lasting,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Ranges every 30 s for two hours; what they are off by after the first 40 minutes, in sigmas.
    fn odds(seed: u64, mut off: impl FnMut(f64, &mut Random) -> f64) -> Odds {
        let (mut random, mut unlisted) = (Random(seed), Unlisted::NONE);
        unlisted.restart();
        for k in 1..240_u64 {
            let time_s = 30.0 * k as f64;
            let off = if time_s > 2400.0 { off(time_s, &mut random) } else { 0.0 };
            unlisted.take(30_000_000 * k, (random.normal() + off).clamp(-3.0, 3.0));
        }
        unlisted.odds()
    }

    #[test]
    fn white_ranges_say_nothing() {
        // by Ville's inequality ln B exceeds ln 100 with a chance of 2 h / 100 at some time in a flight
        let loud = (0..100).filter(|seed| odds(*seed, |_, _| 0.0).against_no_change > libm::log(100.0)).count();
        assert!(loud <= 6, "{loud} of 100");
    }

    #[test]
    fn echoes_scatter_and_a_ship_that_wanders_lasts() {
        for seed in 0..10 {
            // every second one; the filter has followed their mean
            let echoes = odds(seed, |_, random| if random.uniform() < 0.5 { 1.8 } else { -1.8 });
            assert!(echoes.against_no_change > 11.0 && echoes.is_scatter, "{}", echoes.against_no_change);
            let wandering = odds(seed, |time_s, _| 1.8 * libm::sin(time_s / 200.0));
            assert!(wandering.against_declared > 11.0 && !wandering.is_scatter, "{}", wandering.against_declared);
        }
    }

    #[test]
    fn what_was_so_from_the_start_is_no_change() {
        for seed in 0..10 {
            let mut random = Random(seed);
            let mut unlisted = Unlisted::NONE;
            unlisted.restart();
            for k in 1..240_u64 {
                unlisted.take(30_000_000 * k, (1.7 * random.normal()).clamp(-3.0, 3.0));
            }
            let odds = unlisted.odds();
            assert!(odds.against_declared > 11.0 && odds.against_no_change < 11.0, "{}", odds.against_no_change);
        }
    }
}
