//! The posterior Cramér-Rao bound of the plane problem, apart from the filter's code.
//!
//! Dead reckoning errs by what is not known of the vehicle and the water. Its error of the position is linear in these
//! unknowns θ, along the true track and to first order:
//!
//!   e(t) = e₀ + s ∫ Rv dt + δ ∫ J Rv dt + ∫ δc dt,        J = a quarter turn,
//!
//! s the share by which the speed is wrong, δ the constant of the compass, δc the current less its prior mean. With
//! e(t) = G(t) θ, θ ~ N(0, Π), ranges n·e + v of the unit vector n from the ship, and fixes e + v, all that was measured
//! up to t leaves the covariance G (Π⁻¹ + Σ Hᵀ R⁻¹ H)⁻¹ Gᵀ. The problem is linear and Gaussian: no estimator's mean
//! squared error is less, if it has nothing but these. Noise of attitude and velocity is left out (metres in five hours),
//! and so is what depth and attitude tell of the speed in dives and turns.

use super::aids::{FIX_SIGMA_M, RANGE_SIGMA_M};
use super::worlds::{CURRENT_MPS, HEADING_RAD, SHARE, TIDE_S, Water};
use backseat_logs::log::{Column, Log};
use hil_sim::flight::FlightSample;
use nalgebra::{SMatrix, SVector, Vector2};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Start 2, speed, heading, mean current 2, tide in phase 2, tide a quarter behind 2.
const UNKNOWNS: usize = 10;
type Information = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Gradient = SMatrix<f64, 2, UNKNOWNS>;

/// What is known of the water before the dive.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Mean current, one sigma per axis, m/s.
    pub mean_mps: f64,
    /// Tide of a period that is known, one sigma per axis and quadrature, m/s.
    pub tide_mps: f64,
}

/// One sigma per axis of a current of this speed in any direction, m/s.
const SIGMA_MPS: f64 = CURRENT_MPS * FRAC_1_SQRT_2;

impl Prior {
    /// As the water is drawn.
    pub fn drawn(water: Water) -> Self {
        match water {
            Water::Steady => Self { mean_mps: SIGMA_MPS, tide_mps: 0.0 },
            Water::Tide => Self { mean_mps: 0.0, tide_mps: SIGMA_MPS },
        }
    }

    /// The water may have both.
    pub const BOTH: Self = Self { mean_mps: SIGMA_MPS, tide_mps: SIGMA_MPS };
}

/// Least root mean square error (DRMS) at the end of a flight, m.
pub fn bound(samples: &[FlightSample], log: &Log, prior: Prior) -> f64 {
    // σ of the thrust and of the drag are both the share; the speed goes with the root of their ratio.
    let speed = SHARE * FRAC_1_SQRT_2;
    let (mean, tide) = (prior.mean_mps.max(1e-9), prior.tide_mps.max(1e-9));
    let sigma = [100.0, 100.0, speed, HEADING_RAD, mean, mean, tide, tide, tide, tide];
    let mut information = Information::from_diagonal(&SVector::from(sigma.map(|sigma: f64| sigma.powi(-2))));
    let mut rows = log.rows.iter().peekable();
    let (mut through_m, mut before_us) = ([0.0; 2], 0);
    let mut at_end = Gradient::zeros();
    for sample in samples {
        let truth = &sample.truth;
        let step_s = (truth.time_us - before_us) as f64 * 1e-6;
        before_us = truth.time_us;
        for (i, through) in through_m.iter_mut().enumerate() {
            *through += (truth.velocity_ned_mps[i] - truth.current_mps[i]) * step_s;
        }
        at_end = gradient(through_m, truth.time_us as f64 * 1e-6);
        while let Some(row) = rows.next_if(|row| row.time_us <= truth.time_us) {
            let ship_m = (row.get(Column::ShipX), row.get(Column::ShipY));
            if let (Some(_), (Some(x), Some(y))) = (row.get(Column::Range), ship_m) {
                let [dx, dy, dz] = [truth.state[0] - x, truth.state[1] - y, truth.state[2]];
                let r = dx.hypot(dy).hypot(dz);
                let h = at_end.row(0) * (dx / r) + at_end.row(1) * (dy / r);
                information += h.transpose() * h / (RANGE_SIGMA_M * RANGE_SIGMA_M);
            }
            if row.get(Column::GpsX).is_some() {
                information += at_end.transpose() * at_end / (FIX_SIGMA_M * FIX_SIGMA_M);
            }
        }
    }
    let covariance = information.cholesky().map(|factor| at_end * factor.solve(&at_end.transpose()));
    covariance.map_or(f64::NAN, |covariance| covariance.trace().sqrt())
}

/// G.
fn gradient([north_m, east_m]: [f64; 2], time_s: f64) -> Gradient {
    let omega = TAU / TIDE_S;
    let (sin, cos) = libm::sincos(omega * time_s);
    let mut g = Gradient::zeros();
    g.fixed_view_mut::<2, 2>(0, 0).fill_with_identity();
    g.set_column(2, &Vector2::new(north_m, east_m));
    g.set_column(3, &Vector2::new(-east_m, north_m));
    for (first, integral_s) in [(4, time_s), (6, sin / omega), (8, (1.0 - cos) / omega)] {
        g.fixed_view_mut::<2, 2>(0, first).fill_diagonal(integral_s);
    }
    g
}
