//! The declared table: what may be wrong, how often, by how much, and where the number comes from.
//!
//! A nuisance is a Gauss-Markov process: a standard deviation and the time after which it is forgotten. `rate` is the
//! share of the hours under way in which an entry holds, and the rate an hour at which it begins; no fleet has published
//! such rates, so they are judgements.

use super::account::{BIAS, COURSE, CURRENT, DVL_SCALE, DVL_YAW, FIX, Nuisance, Priors, SCALE, SHIP, SPEED};
use core::ops::Range;

/// Where the vehicle dives: how much the water changes within an hour, or within five metres of depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Area {
    /// A lake or a basin.
    Lake,
    /// Open coast.
    #[default]
    Coast,
    /// A strait or an estuary.
    Strait,
}

impl Area {
    /// One sigma of the current per axis, m/s. Lakes: wind-driven currents of 2 to 3 % of the wind (G. E. Hutchinson, A
    /// Treatise on Limnology, 1957); coast: a tidal stream with an amplitude of half a knot; strait: of a knot and a
    /// half.
    const fn current_mps(self) -> f64 {
        match self {
            Self::Lake => 0.05,
            Self::Coast => 0.2,
            Self::Strait => 0.5,
        }
    }
}

/// What is declared for a mission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Declared {
    /// Where it is flown.
    pub area: Area,
    /// One sigma per axis of the slow errors of the vehicle's and of the ship's receiver, m.
    pub receivers_m: [f64; 2],
    /// Probability in an hour that the error exceeds the level.
    pub probability_per_hour: f64,
}

impl Declared {
    /// Open coast, receivers without a slow error, once in a thousand hours.
    pub const DEFAULT: Self = Self { area: Area::Coast, receivers_m: [0.0; 2], probability_per_hour: 1.0e-3 };
    /// Before anything is declared: all zero, and so are its bytes.
    pub const NONE: Self = Self { area: Area::Lake, receivers_m: [0.0; 2], probability_per_hour: 0.0 };
}

const fn nuisance(states: Range<usize>, sigma: f64, memory_s: f64) -> Nuisance {
    Nuisance { states: (states.start, states.end), sigma, memory_s }
}

/// An hour, s.
const HOUR: f64 = 3600.0;
/// What is declared of a healthy vehicle; the current's and the receivers' sigmas are those of [`Declared`].
pub(super) const HEALTHY: [Nuisance; 9] = [
    // the water, as long as nothing happens: another within weeks, by 1 cm/s in an hour at an open coast
    nuisance(CURRENT, 1.0, 480.0 * HOUR),
    // speed through the water at given turns of the propeller: 3 % by drag of fouling and load
    nuisance(SPEED, 0.03, 24.0 * HOUR),
    // compass after swinging: 1 degree (data sheets of OS5000 and 3DM-GX3: 0.5 to 2 degrees)
    nuisance(COURSE, 0.02, 12.0 * HOUR),
    // receivers: a slow error in tens of minutes (ionosphere, orbit: GPS SPS Performance Standard, 2020)
    nuisance(SHIP, 1.0, 1200.0),
    nuisance(FIX, 1.0, 1200.0),
    // delay of modem and clock: 0.7 ms
    nuisance(BIAS, 1.0, HOUR),
    // sound speed from a cast or a formula: 0.3 %, 4 to 5 m/s
    nuisance(SCALE, 0.003, 3.0 * HOUR),
    // DVL: 0.2 to 0.5 % and a degree (data sheets; yaw as mounted: J. C. Kinsey and L. L. Whitcomb, 2007)
    nuisance(DVL_SCALE, 0.005, 3.0 * HOUR),
    nuisance(DVL_YAW, 0.02, 3.0 * HOUR),
];

/// An entry of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis {
    /// What is wrong.
    pub name: &'static str,
    /// Share of the hours in which it is, before anything is measured.
    pub rate: f64,
    /// What is larger than of a healthy vehicle.
    pub larger: &'static [Nuisance],
    /// The DVL is not believed.
    pub without_dvl: bool,
}

/// How many there are.
pub const HYPOTHESES: usize = 8;

/// The table. The first is the healthy vehicle.
pub(super) const TABLE: [Hypothesis; HYPOTHESES] = [
    Hypothesis { name: "healthy", rate: 1.0, larger: &[], without_dvl: false },
    // a current that turns with the tides, over days in the mean: by 4 cm/s in an hour at an open coast
    Hypothesis { name: "tide", rate: 0.1, larger: &[nuisance(CURRENT, 1.0, 48.0 * HOUR)], without_dvl: false },
    // antenna or lever arm 1 to 10 m, datum up to 100 m (NAD27 to WGS 84), a receiver that is spoofed
    Hypothesis { name: "ship", rate: 0.01, larger: &[nuisance(SHIP, 40.0, 100.0 * HOUR)], without_dvl: false },
    // reflected paths of tens of metres, a step or a drift of a clock of ppm, a profile that bends rays
    Hypothesis {
        name: "range",
        rate: 0.01,
        larger: &[nuisance(BIAS, 20.0, 20.0 * HOUR), nuisance(SCALE, 0.015, 100.0 * HOUR)],
        without_dvl: false,
    },
    // fixes by reflections, a spoofer who draws off by 0.3 m/s for 100 s, repeated fixes
    Hypothesis { name: "fix", rate: 0.01, larger: &[nuisance(FIX, 30.0, 300.0)], without_dvl: false },
    // a front, a current that sets in or turns: the area's current is another within an hour; fouling, a lost blade, a
    // battery that sags
    Hypothesis {
        name: "water",
        rate: 0.01,
        larger: &[nuisance(CURRENT, 1.0, HOUR), nuisance(SPEED, 0.1, HOUR)],
        without_dvl: false,
    },
    // a compass beside iron or a motor's leads: 5 degrees
    Hypothesis { name: "compass", rate: 0.01, larger: &[nuisance(COURSE, 0.09, 12.0 * HOUR)], without_dvl: false },
    // lock on something that moves, a wrong sound speed at the transducer
    Hypothesis { name: "dvl", rate: 0.01, larger: &[nuisance(COURSE, 0.1, HOUR)], without_dvl: true },
];

impl Hypothesis {
    /// Sigma and memory of each state of its account but the position's.
    pub(super) fn nuisances(&self, declared: &Declared) -> Priors {
        let mut priors = Priors::NONE;
        for nuisance in &HEALTHY {
            let [vehicle_m, ship_m] = declared.receivers_m;
            let sigma = match nuisance.states.0 {
                start if start == CURRENT.start => declared.area.current_mps(),
                start if start == SHIP.start => ship_m,
                start if start == FIX.start => vehicle_m,
                _ => nuisance.sigma,
            };
            priors.set(&Nuisance { sigma, ..*nuisance }, false);
        }
        for nuisance in self.larger {
            let is_current = nuisance.states.0 == CURRENT.start;
            let sigma = if is_current { declared.area.current_mps() } else { nuisance.sigma };
            priors.set(&Nuisance { sigma, ..*nuisance }, true);
        }
        priors
    }
}
