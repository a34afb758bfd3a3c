//! Seeded random streams, one per source of randomness.
//!
//! Each source draws from its own ChaCha stream of the scenario's seed, so that switching one
//! sensor off, or changing its rate, leaves every other source's numbers as they were.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Who draws. The discriminant is the ChaCha stream: never renumber, or tracked results change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Process disturbance of the vehicle.
    Disturbance = 0,
    /// Depth sensor.
    Depth = 1,
    /// Attitude and rates.
    Ahrs = 2,
    /// Doppler log.
    Dvl = 3,
    /// GNSS of the vehicle.
    VehicleGnss = 4,
    /// GNSS of the ship.
    ShipGnss = 5,
    /// The ship's wander.
    Ship = 6,
    /// Noise of acoustic ranges and range rates.
    Acoustics = 7,
    /// Which packets are lost.
    PacketLoss = 8,
    /// Which effects there are and how large.
    Effects = 9,
    /// Phases and direction of the waves.
    Waves = 10,
    /// Ranges that are no ranges.
    Outliers = 11,
    /// Density of the water.
    Ctd = 12,
    /// Mission of a data set.
    Mission = 13,
    /// Coloured part of the disturbance.
    DisturbanceColour = 14,
    /// Coloured part of the depth.
    DepthColour = 15,
    /// Coloured part of the attitude.
    AttitudeColour = 16,
    /// Coloured part of the Doppler log.
    DvlColour = 17,
    /// Coloured part of the vehicle's GNSS.
    VehicleGnssColour = 18,
    /// Coloured part of the rates.
    RatesColour = 19,
    /// Speed over ground of the ship's GNSS receiver.
    ShipGnssVelocity = 20,
    /// What a study draws beside the simulation: which world a seed means.
    Study = 21,
    /// How the noise of a log's sensors is made up ([`crate::noise::NoiseKind::Mixed`]).
    NoiseMixture = 22,
    /// Which readings of a log are lost or repeated.
    Readings = 23,
    /// Fixes by USBL and ranges to transponders of a data set.
    Positioning = 24,
    /// Which of these are no direct path.
    PositioningOutliers = 25,
    /// Coloured part of acoustic ranges.
    AcousticsColour = 26,
    /// Coloured part of fixes by USBL.
    UsblColour = 27,
    /// Coloured part of ranges to transponders.
    TransponderColour = 28,
}

/// The random numbers of one source.
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of `source` under `seed`.
    pub fn new(seed: u64, source: Source) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(source as u64);
        Self(rng)
    }

    /// The stream of a scenario's fault of this index.
    #[must_use]
    pub fn of_fault(seed: u64, index: u64) -> Self {
        /// Beyond every [`Source`].
        const FIRST: u64 = 1000;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(FIRST + index);
        Self(rng)
    }

    /// A standard normal number.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Independent normal numbers of the given standard deviation.
    pub fn normals<const N: usize>(&mut self, sigma: f64) -> [f64; N] {
        core::array::from_fn(|_| sigma * self.normal())
    }

    /// A number within [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.random()
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.uniform() < 0.5 { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_one_seed_are_repeatable_and_different() {
        let draw = |seed, source| Stream::new(seed, source).normals::<4>(1.0);
        assert_eq!(draw(7, Source::Depth), draw(7, Source::Depth));
        assert_ne!(draw(7, Source::Depth), draw(7, Source::Ahrs));
        assert_ne!(draw(7, Source::Depth), draw(8, Source::Depth));
    }
}
