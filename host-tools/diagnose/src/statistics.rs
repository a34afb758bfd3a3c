//! Whiteness of a sequence that may hold modestly coloured noise.

use backseat_logs::stats::ljung_box;

/// Largest share of the variance that is taken as coloured sensor noise; what is more is structure.
pub(crate) const MOST_COLOURED: f64 = 0.2;
/// Probability under whiteness below which a sequence may be taken as white noise plus coloured noise.
const SUSPECTED: f64 = 1e-6;

/// White noise of which a share is a first-order Gauss-Markov process: autocorrelation `share` · `decay`^k at lag k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseColour {
    /// Share of the variance.
    pub share: f64,
    /// Correlation of the process from one sample to the next.
    pub decay: f64,
}

/// Probability of the autocorrelations under whiteness. Sensor noise is often modestly coloured (a settling filter,
/// waves at a pressure port): where whiteness fails, white noise with at most a fifth of first-order Gauss-Markov noise
/// is tried, and the probability is that of what it leaves.
#[must_use]
pub fn whiteness(correlation: &[f64], count: usize) -> (f64, Option<NoiseColour>) {
    let white = ljung_box(correlation, count, 0);
    let Some(colour) = noise_colour(correlation).filter(|_| white < SUSPECTED) else { return (white, None) };
    let mut term = colour.share;
    let left: Vec<f64> = correlation
        .iter()
        .map(|r| {
            term *= colour.decay;
            r - term
        })
        .collect();
    let coloured = ljung_box(&left, count, 2);
    if coloured > white { (coloured, Some(colour)) } else { (white, None) }
}

/// The share and decay that fit autocorrelations at lags from 1 best; `None` if that is no modest share.
fn noise_colour(correlation: &[f64]) -> Option<NoiseColour> {
    const DECAYS: u32 = 100;
    let fit = |decay: f64| {
        let (mut product, mut square, mut power, mut term) = (0.0, 0.0, 0.0, 1.0);
        for r in correlation {
            term *= decay;
            product += r * term;
            square += term * term;
            power += r * r;
        }
        (power - product * product / square, NoiseColour { share: product / square, decay })
    };
    let fits = (1..DECAYS).map(|k| fit(f64::from(k) / f64::from(DECAYS)));
    let (_, best) = fits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.share > 0.0 && best.share <= MOST_COLOURED).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::stats::autocorrelation;
    use hil_sim::rng::{Source, Stream};

    #[test]
    fn modestly_coloured_noise_passes_and_strongly_coloured_noise_does_not() {
        let mut stream = Stream::new(5, Source::Readings);
        for (share, passes) in [(0.1, true), (0.5, false)] {
            let (mut process, decay) = (0.0, 0.93_f64);
            let e: Vec<f64> = (0..9000)
                .map(|_| {
                    process = decay * process + (1.0 - decay * decay).sqrt() * stream.normal();
                    f64::sqrt(1.0 - share) * stream.normal() + f64::sqrt(share) * process
                })
                .collect();
            let (p, colour) = whiteness(&autocorrelation(&e, 20), e.len());
            assert_eq!((p > 1e-12, colour.is_some()), (passes, passes), "{share}: {p} {colour:?}");
        }
    }

    #[test]
    fn whiteness_is_told_from_colour() {
        // Uniform numbers, and the same summed over two.
        let mut stream = Stream::new(1, Source::Readings);
        let white: Vec<f64> = (0..2000).map(|_| stream.uniform() - 0.5).collect();
        let coloured: Vec<f64> = white.windows(2).map(|w| w[0] + w[1]).collect();
        assert!(ljung_box(&autocorrelation(&white, 20), white.len(), 0) > 0.01);
        assert!(ljung_box(&autocorrelation(&coloured, 20), coloured.len(), 0) < 1e-6);
    }
}
