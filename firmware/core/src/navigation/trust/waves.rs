//! What waves do to the readings of depth cell and DVL, and to a filter that learns.
//!
//! Waves move a reading to and fro by more than its noise. Once they have refused a reading of depth cell or DVL, what
//! alternates in its innovations ([`Window::alternating`]) is noise of that sensor, until nothing alternates any more.
//!
//! Smaller waves move the vehicle, and teach a filter that estimates the vehicle's parameters wrong ones. While the depth
//! cell's innovations alternate by more than S explains, the process noise in heave and pitch grows ([`Sea`]).

use super::innovation_window::Window;
use crate::navigation::interface::measurement::Sensor;
use core::f64::consts::{LN_2, LN_10};
use core::ops::Range;

/// Time constant of the windows over depth cell and DVL, s: some periods of a wave, and less than a leg.
pub(crate) const WAVES_S: f64 = 30.0;
/// The same, µs.
const WAVES_US: u64 = 30_000_000;
/// An innovation enters these windows with so many sigmas at most, so that outliers among good readings, less than a
/// quarter of them, do not widen the gate.
const WAVES_CLIP: f64 = 2.0;
/// Largest variance of a reading by waves of 1 m height and 6 s: half of the squared amplitude of 0.5 m, and of its rate
/// of change, 0.5 m/s. What is larger is no wave.
const WAVES_VARIANCE: f64 = 0.125;
/// Time constant of the window over the depth cell's innovations for [`Sea`], s: ten waves.
const SEA_S: f64 = 60.0;
/// The sea's factor doubles in this time while the innovations alternate, s, and halves in the other when they do not.
/// It rises before much is learnt from the waves, and falls slowly, because the noise it adds hides them from the test.
const SEA_RISES_S: f64 = 30.0;
const SEA_FALLS_S: f64 = 600.0;
/// ln of the largest factor, 20: over that of [`crate::navigation::NavigationConfig::noise_factor`] the noise of waves of
/// 0.15 m and 6 s at the vehicle, by √(2 A ω³) m/s²/√Hz for a displacement of variance A and frequency ω.
const SEA_MOST: f64 = LN_10 + LN_2;
/// Scalars of depth cell and DVL.
const WAVED: usize = 4;

/// Factor on the process noise in heave and pitch that the depth cell's innovations ask for.
#[derive(Clone)]
struct Sea {
    window: Window,
    /// ln of the factor: zero at first, as all of a filter that is not initialised.
    log_factor: f64,
    last_us: u64,
}

impl Sea {
    const CALM: Self = Self { window: Window::NEW, log_factor: 0.0, last_us: 0 };

    fn take(&mut self, time_us: u64, innovation: f64, variance: f64) {
        self.window.take(SEA_S, time_us, innovation, variance);
        let since_s = (1.0e-6 * time_us.saturating_sub(self.last_us) as f64).min(1.0);
        self.last_us = time_us;
        let rises = self.window.alternating() > 0.0;
        let change = since_s * LN_2 / if rises { SEA_RISES_S } else { -SEA_FALLS_S };
        self.log_factor = (self.log_factor + change).clamp(0.0, SEA_MOST);
    }
}

/// What waves have done so far.
#[derive(Clone)]
pub(crate) struct Waves {
    /// When waves last refused a reading of depth cell or DVL, µs, as long as some still alternate; 0: no waves.
    refused_us: [u64; 2],
    /// Of depth cell and DVL, by scalar.
    windows: [Window; WAVED],
    sea: Sea,
}

/// Place of a sensor among those that waves move, and its windows.
fn waved(sensor: Sensor) -> Option<(usize, Range<usize>)> {
    match sensor {
        Sensor::Depth => Some((0, 0..1)),
        Sensor::BottomTrack | Sensor::WaterTrack => Some((1, 1..WAVED)),
        _ => None,
    }
}

impl Waves {
    pub(crate) const CALM: Self = Self { refused_us: [0; 2], windows: [Window::NEW; WAVED], sea: Sea::CALM };

    /// Factor on the process noise in heave and pitch.
    pub(crate) fn sea_factor(&self) -> f64 {
        if self.sea.log_factor == 0.0 { 1.0 } else { libm::exp(self.sea.log_factor) }
    }

    /// A depth was used.
    pub(crate) fn learn_sea(&mut self, time_us: u64, innovation: f64, variance: f64) {
        self.sea.take(time_us, innovation, variance);
    }

    /// Waves have refused readings of this sensor.
    pub(crate) fn have_refused(&self, sensor: Sensor) -> bool {
        self.refused_us != [0; 2] && waved(sensor).is_some_and(|(place, _)| self.refused_us.get(place) != Some(&0))
    }

    /// Variance of a reading by waves, of each scalar: the water moves in circles, so that whichever axis of a DVL has
    /// seen them least sees them most after a turn or a dive.
    pub(crate) fn variance(&self, sensor: Sensor) -> f64 {
        let windows = waved(sensor).and_then(|(_, windows)| self.windows.get(windows));
        let most = windows.into_iter().flatten().map(Window::alternating).fold(0.0, f64::max);
        most.min(WAVES_VARIANCE)
    }

    /// Whether there are waves, by the innovations of depth cell or DVL, that move the readings of this sensor.
    pub(crate) fn move_readings(&self, sensor: Sensor) -> bool {
        let seen = |sensor| self.have_refused(sensor) && self.variance(sensor) > 0.0;
        waved(sensor).is_some() && (self.sea.log_factor > 0.0 || seen(Sensor::Depth) || seen(Sensor::BottomTrack))
    }

    /// A reading was refused: from now on what alternates counts as noise of depth cell or DVL.
    pub(crate) fn begin(&mut self, sensor: Sensor, time_us: u64) {
        let Some((place, windows)) = waved(sensor) else { return };
        let before = self.refused_us.get_mut(place).map(|us| core::mem::replace(us, time_us.max(1)));
        if before == Some(0) {
            self.windows.get_mut(windows).into_iter().flatten().for_each(|window| *window = Window::NEW);
        }
    }

    /// A scalar in waves, used or refused; `variance` is S with what the waves add to it.
    pub(crate) fn learn(&mut self, sensor: Sensor, axis: usize, time_us: u64, innovation: f64, variance: f64) {
        let Some((place, windows)) = waved(sensor) else { return };
        let most = WAVES_CLIP * libm::sqrt(variance);
        let without = variance - self.variance(sensor);
        let Some(windows) = self.windows.get_mut(windows) else { return };
        if let Some(window) = windows.get_mut(axis) {
            window.take(WAVES_S, time_us, innovation.max(-most).min(most), without);
        }
        let calm = windows.iter().all(|window| window.alternating() == 0.0);
        if let Some(us) = self.refused_us.get_mut(place).filter(|us| calm && time_us > us.saturating_add(WAVES_US)) {
            *us = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Depth innovations of ten minutes at 7 Hz: noise of one sigma, and a wave beside it or not.
    fn after(amplitude: f64) -> Waves {
        let (mut waves, mut random) = (Waves::CALM, Random(1));
        for k in 0..4200_u32 {
            // uniform, of unit variance
            let noise = random.within(libm::sqrt(3.0));
            let time_s = f64::from(k) / 7.0;
            waves.learn_sea((1e6 * time_s) as u64, noise + amplitude * libm::sin(1.05 * time_s), 1.0);
        }
        waves
    }

    #[test]
    fn waves_raise_the_noise_and_noise_does_not() {
        assert_eq!(after(0.0).sea_factor(), 1.0);
        // a wave of one sigma has half of the noise's variance
        assert!((after(1.0).sea_factor() - 20.0).abs() < 1e-9);
        // one that is not significant in ten periods is none
        assert_eq!(after(0.2).sea_factor(), 1.0);
    }

    #[test]
    fn the_noise_falls_by_half_in_ten_calm_minutes() {
        let mut waves = after(1.0);
        // the window forgets the wave in some minutes
        for k in 0..8400_u32 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            waves.learn_sea(600_000_000 + u64::from(k) * 142_857, sign, 1.0);
        }
        // 20 halved twice, and the minutes until then
        assert!((4.9..7.5).contains(&waves.sea_factor()), "{}", waves.sea_factor());
    }
}
