//! State and covariance of the mixture, and their digest.

use super::Navigator;
use crate::navigation::algebra::digest::Digest;
#[cfg(doc)]
use crate::navigation::filter::cekf::Filter;
use crate::navigation::filter::vertical::is_steep;
use crate::state::{PHI, PSI, VEHICLE_STATES, VehicleState, X, Y};
use nalgebra::{SMatrix, Vector2};

impl Navigator {
    /// x_v.
    #[must_use]
    pub fn state(&self) -> &VehicleState {
        &self.state
    }

    /// Current [north, east], m/s: estimated, or as the effect set says.
    #[must_use]
    pub fn current(&self) -> [f64; 2] {
        let main = Vector2::from(self.main.current());
        let mut current = main;
        for member in self.others.iter().filter(|member| member.runs) {
            current += (Vector2::from(member.filter.current()) - main) * member.weight;
        }
        current.into()
    }

    /// State `i`, those behind the vehicle's as the main filter has them; 0 beyond the last.
    #[must_use]
    pub fn state_at(&self, i: usize) -> f64 {
        self.state.as_slice().get(i).copied().unwrap_or_else(|| self.main.state_at(i))
    }

    /// Variance of state `i` (vehicle states come first); 0 beyond the last. See [`Self::covariance`].
    #[must_use]
    pub fn variance(&self, i: usize) -> f64 {
        self.covariance(i, i)
    }

    /// Covariance of states `i` and `j`; 0 beyond the last. That of vehicle states is that of the mixture; that of the
    /// position covers both position solutions while ranges are unconfirmed, which P itself does
    /// not ([`Filter::unconfirmed_sigma`]); that of a steep attitude is the main filter's.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let main = self.main.covariance(i, j);
        let turns = (PHI..=PSI).contains(&i) || (PHI..=PSI).contains(&j);
        if i.max(j) >= VEHICLE_STATES
            || turns && is_steep(self.main.state())
            || !self.others.iter().any(|member| member.runs)
        {
            return main;
        }
        let (mut sum, mut own_weight, mut mean_i, mut mean_j) = (0.0, 1.0, 0.0, 0.0);
        for member in self.others.iter().filter(|member| member.runs) {
            let (w, a, b) = (member.weight, member.offset_from(&self.main, i), member.offset_from(&self.main, j));
            sum += w * (member.filter.covariance(i, j) + a * b);
            own_weight -= w;
            mean_i += w * a;
            mean_j += w * b;
        }
        own_weight * main + sum - mean_i * mean_j
    }

    /// Copies the vehicle's covariance.
    pub fn vehicle_covariance(&self, out: &mut SMatrix<f64, 12, 12>) {
        for j in 0..VEHICLE_STATES {
            for i in 0..VEHICLE_STATES {
                out[(i, j)] = self.covariance(i, j);
            }
        }
    }

    /// √(σx² + σy²) of the vehicle (DRMS), m.
    #[must_use]
    pub fn horizontal_sigma_m(&self) -> f64 {
        libm::sqrt(self.variance(X) + self.variance(Y))
    }

    /// 64-bit digest of time, state and covariance, bit for bit (NaN canonicalised).
    #[must_use]
    pub fn digest(&self) -> u64 {
        self.digest_from(Digest::START)
    }

    /// The digest continued from an earlier one: `running = navigator.digest_from(running)` at
    /// every step covers every step.
    #[must_use]
    pub fn digest_from(&self, running: u64) -> u64 {
        let mut running = self.main.digest_from(running);
        for member in self.others.iter().filter(|member| member.runs) {
            let mut digest = Digest::from(member.filter.digest_from(running));
            digest.number(member.log_ratio);
            running = digest.finish();
        }
        running
    }
}
