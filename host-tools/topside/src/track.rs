//! Where a vehicle is, as the ship knows it: constant velocity, its own reports, ranges.
//!
//! A report is the output of the vehicle's filter: errors of successive reports are alike, and what the track still
//! knows of the last one is no independent knowledge. The two are therefore joined by covariance intersection (Julier
//! and Uhlmann 1997), which is consistent whatever their correlation. A range that the ship measures itself is
//! independent and updates the track as in any Kalman filter.

use crate::names::Names;
use crate::ship::ShipEstimate;
use backseat_wire::vehicle_state::VehicleState;
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// A range this many sigmas off is not believed.
const GATE_SIGMAS: f64 = 5.0;
/// Weights that covariance intersection tries.
const WEIGHTS: u8 = 20;
/// Sigmas of the level's growth since a report: two tails of 5e-4, as on the board.
const LEVEL_SIGMAS: f64 = 3.3;
/// A report is no better than this per axis, m and m/s: its resolution.
const LEAST_SIGMA: f64 = 0.01;

/// A range to a vehicle and its outcome.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranging {
    /// The vehicle's modem address.
    pub vehicle: u8,
    /// Distance between the transducers, m.
    pub range_m: f64,
    /// By a ping, rather than by a packet's one-way time of flight.
    pub two_way: bool,
    /// Range less the track's; `None` where there is no track yet.
    pub innovation_m: Option<f64>,
    /// It changed the track.
    pub fused: bool,
}

/// A vehicle at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleEstimate {
    /// North, east, m.
    pub position_m: [f64; 2],
    /// North, east over ground, m/s.
    pub velocity_mps: [f64; 2],
    /// Variances north and east, and covariance, m².
    pub covariance_m2: [f64; 3],
}

impl VehicleEstimate {
    /// One sigma along the larger half axis of the error ellipse, m.
    pub fn sigma_m(&self) -> f64 {
        let [a, b, c] = self.covariance_m2;
        libm::sqrt((0.5 * (a + b) + libm::hypot(0.5 * (a - b), c)).max(0.0))
    }
}

/// What is known of one vehicle. Its time is UTC, µs since 1970.
#[derive(Clone, Debug)]
pub struct Track {
    /// The vehicle's modem address.
    pub vehicle: u8,
    /// Density of the acceleration, m²/s³.
    density: f64,
    time_us: u64,
    filter: Option<(Vector4<f64>, Matrix4<f64>)>,
    report: Option<VehicleState>,
    /// Where it said it was, m.
    reported_m: [f64; 2],
    names: Names,
    ranges: u32,
    refused: u32,
}

impl Track {
    /// A vehicle that was never heard.
    pub fn new(vehicle: u8, acceleration_mps2_per_sqrt_hz: f64) -> Self {
        let density = acceleration_mps2_per_sqrt_hz * acceleration_mps2_per_sqrt_hz;
        Self {
            vehicle,
            density,
            time_us: 0,
            filter: None,
            report: None,
            reported_m: [0.0; 2],
            names: Names::NONE,
            ranges: 0,
            refused: 0,
        }
    }

    /// The last report.
    pub fn report(&self) -> Option<&VehicleState> {
        self.report.as_ref()
    }

    /// What the vehicle names of what has changed.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Ranges that changed the track, and those that were refused.
    pub fn ranges(&self) -> [u32; 2] {
        [self.ranges, self.refused]
    }

    /// When the last report or range was valid, UTC µs; `None` before the first.
    pub fn heard_us(&self) -> Option<u64> {
        self.filter.map(|_| self.time_us)
    }

    /// The vehicle at a time not before the last report or range.
    pub fn at(&self, time_us: u64) -> Option<VehicleEstimate> {
        let (x, p) = self.predicted(time_us)?;
        Some(VehicleEstimate {
            position_m: [x[0], x[1]],
            velocity_mps: [x[2], x[3]],
            covariance_m2: [p[(0, 0)], p[(1, 1)], p[(0, 1)]],
        })
    }

    /// Beyond this distance from [`Self::at`] the vehicle is with the probability only of the level that it reported, m:
    /// that level, how far the track is from the report, and what a report loses with time. `None` where nothing bounds
    /// it.
    pub fn level_at(&self, time_us: u64) -> Option<f64> {
        let report = self.report?;
        let level_m = report.level_m[0]?;
        let (x, _) = self.predicted(time_us)?;
        let dt = (time_us as f64 * 1.0e-6 - f64::from(report.transmit_s)).max(0.0);
        let [[north, east], [u, v]] = [self.reported_m, report.velocity_mps];
        let apart_m = libm::hypot(x[0] - north - dt * u, x[1] - east - dt * v);
        let walked = report.velocity_sigma_mps * dt;
        let variance = walked * walked + self.density * dt * dt * dt / 3.0;
        Some(level_m + apart_m + LEVEL_SIGMAS * libm::sqrt(variance))
    }

    /// The vehicle said at its transmit second where it was, in local coordinates; an older one than the track is kept
    /// but not used. Whether it names other causes than the one before.
    pub fn report_heard(&mut self, state: &VehicleState, position_m: [f64; 2]) -> bool {
        let time_us = u64::from(state.transmit_s) * 1_000_000;
        (self.report, self.reported_m) = (Some(*state), position_m);
        let names_others = self.names.take(state.named, state.transmit_s);
        if self.filter.is_some() && time_us < self.time_us {
            return names_others;
        }
        let z = Vector4::new(position_m[0], position_m[1], state.velocity_mps[0], state.velocity_mps[1]);
        let square = |sigma: f64| sigma.max(LEAST_SIGMA) * sigma.max(LEAST_SIGMA);
        let velocity = square(state.velocity_sigma_mps);
        let least = LEAST_SIGMA * LEAST_SIGMA;
        let [north, cross, east] = state.position_covariance_m2();
        let mut r = Matrix4::from_diagonal(&Vector4::new(north.max(least), east.max(least), velocity, velocity));
        (r[(0, 1)], r[(1, 0)]) = (cross, cross);
        self.filter = Some(match self.predicted(time_us) {
            Some((x, p)) => intersection(&x, &p, &z, &r).unwrap_or((z, r)),
            None => (z, r),
        });
        self.time_us = time_us;
        names_others
    }

    /// A distance between the transducers, with the ship at its end of the path and the vehicle at `time_us` at its
    /// own.
    pub fn range_measured(
        &mut self,
        time_us: u64,
        range_m: f64,
        sigma_m: f64,
        ship: &ShipEstimate,
        ship_depth_m: f64,
        two_way: bool,
    ) -> Ranging {
        let mut ranging = Ranging { vehicle: self.vehicle, range_m, two_way, innovation_m: None, fused: false };
        if !range_m.is_finite() || time_us < self.time_us {
            return ranging;
        }
        let Some((x, p)) = self.predicted(time_us) else { return ranging };
        let depth_m = self.report.map_or(ship_depth_m, |report| report.depth_m);
        let offset = Vector2::new(x[0] - ship.position_m[0], x[1] - ship.position_m[1]);
        let distance_m = libm::hypot(offset.norm(), depth_m - ship_depth_m);
        if distance_m < 1.0 {
            return ranging;
        }
        let h = offset / distance_m;
        let innovation_m = range_m - distance_m;
        ranging.innovation_m = Some(innovation_m);
        let block: Matrix2<f64> = p.fixed_view::<2, 2>(0, 0).into();
        let along = h.dot(&(block * h));
        let [north, east] = ship.position_sigma_m;
        let ship_variance = h[0] * h[0] * north * north + h[1] * h[1] * east * east;
        let s = along + sigma_m * sigma_m + ship_variance;
        if !innovation_m.is_finite() || innovation_m * innovation_m > GATE_SIGMAS * GATE_SIGMAS * s {
            self.refused = self.refused.saturating_add(1);
            return ranging;
        }
        let row = Vector4::new(h[0], h[1], 0.0, 0.0);
        let gain = p * row / s;
        let p = p - gain * gain.transpose() * s;
        self.filter = Some((x + gain * innovation_m, (p + p.transpose()) * 0.5));
        self.time_us = time_us;
        self.ranges = self.ranges.saturating_add(1);
        ranging.fused = true;
        ranging
    }

    fn predicted(&self, time_us: u64) -> Option<(Vector4<f64>, Matrix4<f64>)> {
        let (x, p) = self.filter?;
        let dt = time_us.saturating_sub(self.time_us) as f64 * 1.0e-6;
        let mut f = Matrix4::identity();
        (f[(0, 2)], f[(1, 3)]) = (dt, dt);
        let mut q = Matrix4::zeros();
        for axis in 0..2 {
            q[(axis, axis)] = self.density * dt * dt * dt / 3.0;
            q[(axis, axis + 2)] = self.density * dt * dt * 0.5;
            q[(axis + 2, axis)] = self.density * dt * dt * 0.5;
            q[(axis + 2, axis + 2)] = self.density * dt;
        }
        Some((f * x, f * p * f.transpose() + q))
    }
}

/// Covariance intersection of two estimates of the same state: P⁻¹ = ω A⁻¹ + (1 − ω) B⁻¹, with the ω of least trace of
/// the position.
fn intersection(
    a: &Vector4<f64>,
    pa: &Matrix4<f64>,
    b: &Vector4<f64>,
    pb: &Matrix4<f64>,
) -> Option<(Vector4<f64>, Matrix4<f64>)> {
    let (ia, ib) = (pa.try_inverse()?, pb.try_inverse()?);
    let mut best: Option<(f64, Vector4<f64>, Matrix4<f64>)> = None;
    for step in 0..=WEIGHTS {
        let weight = f64::from(step) / f64::from(WEIGHTS);
        let Some(p) = (ia * weight + ib * (1.0 - weight)).try_inverse() else { continue };
        let trace = p[(0, 0)] + p[(1, 1)];
        if best.is_none_or(|(least, ..)| trace < least) {
            let x = p * (ia * a * weight + ib * b * (1.0 - weight));
            best = Some((trace, x, (p + p.transpose()) * 0.5));
        }
    }
    best.map(|(_, x, p)| (x, p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_wire::ellipse::Ellipse;
    use backseat_wire::named::Named;

    const STATE: VehicleState = VehicleState {
        source: 2,
        transmit_s: 1000,
        position_deg: [0.0; 2],
        velocity_mps: [1.0, 0.0],
        depth_m: 30.0,
        position_sigma_m: 2.0,
        ellipse: Ellipse::CIRCLE,
        leans: true,
        velocity_sigma_mps: 0.1,
        heading_rad: 0.0,
        level_m: [Some(20.0), Some(1.0)],
        mode: 0,
        synchronous: true,
        named: Named::NOTHING,
    };
    const SHIP: ShipEstimate = ShipEstimate {
        position_m: [0.0, 0.0],
        velocity_mps: [0.0; 2],
        position_sigma_m: [0.0; 2],
        velocity_sigma_mps: [0.0; 2],
    };

    /// Dead reckoning of 10 s at 1 m/s; variance 4 + 10² · 0.01 + q · 10³ / 3 with q = 0.0001.
    #[test]
    fn val_between_reports_it_moves_on_and_grows() {
        let mut track = Track::new(2, 0.01);
        assert_eq!(track.at(0), None);
        track.report_heard(&STATE, [100.0, -50.0]);
        let estimate = track.at(1_010_000_000).unwrap();
        assert_eq!(estimate.position_m, [110.0, -50.0]);
        let expected = 4.0 + 1.0 + 1.0e-4 * 1000.0 / 3.0;
        assert!((estimate.covariance_m2[0] - expected).abs() < 1e-9 && estimate.covariance_m2[2].abs() < 1e-12);
        assert!((estimate.sigma_m() - expected.sqrt()).abs() < 1e-9);
    }

    /// 20 m told; after 10 s 3.3 · √(0.1² · 10² + q · 10³ / 3) more; and what a range moves the track by.
    #[test]
    fn val_the_level_is_the_reports_and_grows() {
        let mut track = Track::new(2, 0.01);
        assert_eq!(track.level_at(0), None);
        track.report_heard(&STATE, [400.0, 0.0]);
        assert!((track.level_at(1_000_000_000).unwrap() - 20.0).abs() < 1e-9);
        let grown = 20.0 + 3.3 * (1.0 + 1.0e-4 * 1000.0 / 3.0_f64).sqrt();
        assert!((track.level_at(1_010_000_000).unwrap() - grown).abs() < 1e-9);
        let distance = 400.0_f64.hypot(30.0);
        track.range_measured(1_000_000_000, distance + 1.5, 1.0, &SHIP, 0.0, false);
        let moved = track.at(1_000_000_000).unwrap().position_m[0] - 400.0;
        assert!((track.level_at(1_000_000_000).unwrap() - 20.0 - moved).abs() < 1e-9 && moved > 1.0);
        track.report_heard(&VehicleState { transmit_s: 1001, level_m: [None; 2], ..STATE }, [401.0, 0.0]);
        assert_eq!(track.level_at(1_002_000_000), None);
    }

    /// The vehicle 400 m north and 30 m down of a ship at the surface: 401.123 m. A range of sigma 1 against 2 m along
    /// the path: the scalar Kalman filter by hand.
    #[test]
    fn val_a_range_is_fused_along_its_path() {
        let mut track = Track::new(2, 0.01);
        track.report_heard(&STATE, [400.0, 0.0]);
        let distance = 400.0_f64.hypot(30.0);
        let ranging = track.range_measured(1_000_000_000, distance + 1.5, 1.0, &SHIP, 0.0, false);
        assert!(ranging.fused && (ranging.innovation_m.unwrap() - 1.5).abs() < 1e-9);
        let h = 400.0 / distance;
        let s = 4.0 * h * h + 1.0;
        let estimate = track.at(1_000_000_000).unwrap();
        assert!((estimate.position_m[0] - (400.0 + 4.0 * h / s * 1.5)).abs() < 1e-9, "{estimate:?}");
        assert!((estimate.covariance_m2[0] - (4.0 - 16.0 * h * h / s)).abs() < 1e-9);
        assert!((estimate.covariance_m2[1] - 4.0).abs() < 1e-9);
        // multipath of 60 m, an older range, and no number are not
        for (time_us, range_m) in [(1_000_000_000, distance + 60.0), (1, distance), (1_000_000_000, f64::NAN)] {
            assert!(!track.range_measured(time_us, range_m, 1.0, &SHIP, 0.0, false).fused);
        }
        assert_eq!(track.ranges(), [1, 1]);
    }

    /// The same report heard ten times over is one report: covariance intersection does not count it twice.
    #[test]
    fn val_a_repeated_report_adds_no_knowledge() {
        let mut track = Track::new(2, 1.0e-6);
        for second in 0..10 {
            track.report_heard(&VehicleState { transmit_s: 1000 + second, ..STATE }, [f64::from(second), 0.0]);
        }
        let estimate = track.at(1_009_000_000).unwrap();
        // never better than one report of 2 m
        assert!(estimate.covariance_m2[0] >= 4.0 - 1e-9 && estimate.covariance_m2[0] < 4.1, "{estimate:?}");
        assert!((estimate.position_m[0] - 9.0).abs() < 1e-6);
        // one from before changes nothing
        track.report_heard(&VehicleState { transmit_s: 1003, ..STATE }, [77.0, 0.0]);
        assert_eq!(track.at(1_009_000_000).unwrap(), estimate);
    }
}
