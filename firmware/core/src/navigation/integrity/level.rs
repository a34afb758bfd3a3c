//! The level: every account of the table beside the filter that is flown by.

use super::account::{
    Account, BIAS, COURSE, CURRENT, DVL_SCALE, DVL_YAW, FIX, Motion, SCALE, SHIP, SPEED, STATES, Scalar,
};
use super::hypotheses::{Declared, HYPOTHESES, TABLE};
use super::risk::{self, Part};
use super::vertical::{CELLS, Vertical};
use crate::dynamics::Attitude;
use crate::navigation::interface::measurement::ShipReport;
use crate::parameters::SensorNoise;
use crate::state::{self, THETA, U, V, VehicleState, W, X, Y, Z};
use nalgebra::Vector3;

/// The accounts move once in this time, s.
const STEP_S: f64 = 1.0;
/// A gap that is longer is none of this filter's steps, s.
const GAP_S: f64 = 60.0;
/// Depth has changed if it has by so much, m: less is waves.
const DEPTH_STEP_M: f64 = 1.0;
/// One sigma of what a range has beyond its declared noise, m: the turn between arrival and report.
const RANGE_M: f64 = 0.3;
/// One sigma of the velocity through the water within seconds, m/s, as [`super::account`] has it.
const VELOCITY_MPS: f64 = 0.05;
/// Horizontal distance below which a range has no direction, m.
const NEAR_M: f64 = 1.0;

/// What the error exceeds with the declared probability only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Level {
    /// Horizontally, m.
    pub horizontal_m: f64,
    /// In depth, m.
    pub vertical_m: f64,
}

/// What the accounts see of the filter beside them.
#[derive(Clone, Copy, Debug)]
pub struct Followed<'a> {
    /// Its time, µs.
    pub time_us: u64,
    /// Its vehicle.
    pub state: &'a VehicleState,
    /// Noise of the sensors.
    pub sensors: &'a SensorNoise,
    /// Depth of the ship's transducer, m.
    pub ship_transducer_depth_m: f64,
}

/// What the accounts take of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aiding {
    /// Depth of the cell, m.
    Depth(f64),
    /// A fix of the vehicle, m.
    Fix([f64; 2]),
    /// Velocity over ground in body axes, m/s.
    BottomTrack([f64; 3]),
    /// A range to a ship that was reported.
    Range {
        /// By how much the vehicle has moved since, north and east, m.
        since_m: [f64; 2],
        /// The ship.
        ship: ShipReport,
        /// m.
        range_m: f64,
    },
}

/// The accounts, and the level that they give.
#[derive(Clone)]
pub struct ProtectionLevel {
    accounts: [Account; HYPOTHESES],
    depths: [Vertical; CELLS.len()],
    /// When the filter was looked at last, µs; 0: never.
    time_us: u64,
    /// Since the accounts were moved: time, s, way through the water and way of the nose, m.
    since_s: f64,
    through_water_m: [f64; 2],
    nose_m: f64,
    /// Since the last range or fix, s.
    silent_s: f64,
    /// Depth that the current is known at, m.
    depth_m: f64,
    /// One sigma of the ship as the last packet stated it, m.
    ship_m: f64,
    /// A DVL may be taken.
    dvl_due: bool,
    cell_due: bool,
    level: Option<Level>,
}

impl ProtectionLevel {
    /// Before the filter is initialised.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            accounts: [Account::NEW; HYPOTHESES],
            depths: [Vertical::NEW; CELLS.len()],
            time_us: 0,
            since_s: 0.0,
            through_water_m: [0.0; 2],
            nose_m: 0.0,
            silent_s: 0.0,
            depth_m: 0.0,
            ship_m: 0.0,
            dvl_due: false,
            cell_due: false,
            level: None,
        }
    }

    /// Starts with the filter, at a place with one sigma per axis, m.
    pub fn start(&mut self, followed: &Followed<'_>, sigma_m: f64, declared: &Declared) {
        let x = followed.state;
        for (account, entry) in self.accounts.iter_mut().zip(&TABLE) {
            account.start([x[X], x[Y]], sigma_m, &entry.nuisances(declared));
        }
        for (depth, slow) in self.depths.iter_mut().zip(&CELLS) {
            depth.start(x[Z], followed.sensors.depth_m, slow);
        }
        (self.since_s, self.through_water_m, self.nose_m, self.silent_s) = (0.0, [0.0; 2], 0.0, 0.0);
        (self.time_us, self.depth_m, self.ship_m) = (followed.time_us, x[Z], 0.0);
        self.state_level(x, declared);
    }

    /// The level; `None` before the start.
    #[must_use]
    pub fn level(&self) -> Option<Level> {
        self.level
    }

    /// Follows the filter to its present time.
    pub fn follow(&mut self, followed: &Followed<'_>, declared: &Declared) {
        if self.level.is_none() {
            return;
        }
        self.gather(followed);
        if self.since_s >= STEP_S {
            self.advance(followed.state[Z], declared);
            (self.dvl_due, self.cell_due) = (true, true);
            self.state_level(followed.state, declared);
        }
    }

    /// Takes what the filter is about to fuse.
    pub fn take(&mut self, followed: &Followed<'_>, aiding: &Aiding, declared: &Declared) {
        if self.level.is_none() {
            return;
        }
        self.gather(followed);
        let sensors = followed.sensors;
        match *aiding {
            Aiding::Depth(z_m) if self.cell_due => {
                self.cell_due = false;
                self.depths.iter_mut().for_each(|depth| depth.cell(z_m, sensors.depth_m));
            }
            Aiding::Fix(position_m) => {
                self.advance(followed.state[Z], declared);
                self.fix(position_m, sensors.gnss_m, declared);
            }
            Aiding::BottomTrack(velocity_mps) if self.dvl_due => {
                self.dvl_due = false;
                self.bottom_track(followed.state, velocity_mps, sensors.dvl_mps, declared);
            }
            Aiding::Range { since_m, ship, range_m } => {
                self.advance(followed.state[Z], declared);
                self.range(followed, since_m, &ship, range_m, declared);
            }
            _ => {}
        }
    }

    /// Sums the way since the last look.
    fn gather(&mut self, followed: &Followed<'_>) {
        let step_s = 1.0e-6 * followed.time_us.saturating_sub(self.time_us) as f64;
        self.time_us = followed.time_us;
        if step_s > 0.0 && step_s < GAP_S {
            let x = followed.state;
            let [north_mps, east_mps] = through_water(x);
            self.since_s += step_s;
            self.silent_s += step_s;
            self.through_water_m[0] += step_s * north_mps;
            self.through_water_m[1] += step_s * east_mps;
            self.nose_m -= step_s * x[U] * libm::sin(x[THETA]);
        }
    }

    /// Moves the accounts to the last look.
    fn advance(&mut self, depth_m: f64, declared: &Declared) {
        if self.since_s <= 0.0 {
            return;
        }
        let changed_m = depth_m - self.depth_m;
        let changed_m = if changed_m.abs() > DEPTH_STEP_M { changed_m } else { 0.0 };
        self.depth_m += changed_m;
        let declared = &self.with_ship(declared);
        let motion = Motion { step_s: self.since_s, through_water_m: self.through_water_m, depth_m: changed_m };
        for (account, entry) in self.accounts.iter_mut().zip(&TABLE) {
            account.predict(&motion, &entry.nuisances(declared));
        }
        for (depth, slow) in self.depths.iter_mut().zip(&CELLS) {
            depth.predict(self.since_s, self.nose_m, slow);
        }
        (self.since_s, self.through_water_m, self.nose_m) = (0.0, [0.0; 2], 0.0);
    }

    fn fix(&mut self, position_m: [f64; 2], sigma_m: f64, declared: &Declared) {
        for (account, entry) in self.accounts.iter_mut().zip(&TABLE) {
            let priors = entry.nuisances(declared);
            for (i, position_m) in position_m.iter().enumerate() {
                let mut row = [0.0; STATES];
                row[i & 1] = 1.0;
                row[FIX.start + (i & 1)] = 1.0;
                let innovation = position_m - account.x[i & 1] - account.x[FIX.start + (i & 1)];
                account.evidence += account.correct(&Scalar { row, innovation, variance: sigma_m * sigma_m }, &priors);
            }
        }
        self.silent_s = 0.0;
        self.depths.iter_mut().for_each(Vertical::surfaced);
    }

    /// Velocity over ground: in axes by the measured heading it is that of the account, turned back by its course's
    /// error and by the DVL's yaw.
    fn bottom_track(&mut self, x: &VehicleState, velocity_mps: [f64; 3], sigma_mps: f64, declared: &Declared) {
        let over_ground = Attitude::new(&state::attitude(x)).rotation() * Vector3::from(velocity_mps);
        let [n, e] = through_water(x);
        let variance = sigma_mps * sigma_mps + VELOCITY_MPS * VELOCITY_MPS;
        for (account, entry) in self.accounts.iter_mut().zip(&TABLE).filter(|(_, entry)| !entry.without_dvl) {
            let priors = entry.nuisances(declared);
            for axis in 0..2 {
                let y = &account.x;
                let (s, h) = (y[SPEED.start], y[COURSE.start]);
                let (gn, ge) = (n + s * n - h * e + y[CURRENT.start], e + s * e + h * n + y[CURRENT.start + 1]);
                let (d, turn) = (y[DVL_SCALE.start], h + y[DVL_YAW.start]);
                let mut row = [0.0; STATES];
                row[CURRENT.start + axis] = 1.0;
                // by speed, course, scale and yaw
                let (predicted, by) = if axis == 0 {
                    (gn + d * gn + turn * ge, [n, ge - e, gn, ge])
                } else {
                    (ge + d * ge - turn * gn, [e, n - gn, ge, -gn])
                };
                [row[SPEED.start], row[COURSE.start], row[DVL_SCALE.start], row[DVL_YAW.start]] = by;
                let measured = if axis == 0 { over_ground.x } else { over_ground.y };
                let _ = account.correct(&Scalar { row, innovation: measured - predicted, variance }, &priors);
            }
        }
    }

    fn range(
        &mut self,
        followed: &Followed<'_>,
        since_m: [f64; 2],
        ship: &ShipReport,
        range_m: f64,
        declared: &Declared,
    ) {
        let down_m = followed.state[Z] - followed.ship_transducer_depth_m;
        let stated = ship.position_sigma_m * ship.position_sigma_m;
        let noise = followed.sensors.range_m * followed.sensors.range_m + RANGE_M * RANGE_M + stated;
        // what a packet states of the ship may be as slow as a receiver's error: antenna, arm, datum
        self.state_ship(declared, ship.position_sigma_m);
        let declared = &self.with_ship(declared);
        let scalar = |account: &Account| {
            let x = &account.x;
            let n = x[0] - since_m[0] - ship.position_m[0] + x[SHIP.start];
            let e = x[1] - since_m[1] - ship.position_m[1] + x[SHIP.start + 1];
            let ground_m = libm::hypot(n, e);
            let distance_m = libm::hypot(ground_m, down_m);
            let mut row = [0.0; STATES];
            [row[0], row[1]] = [n / distance_m, e / distance_m];
            [row[SHIP.start], row[SHIP.start + 1]] = [row[0], row[1]];
            (row[BIAS.start], row[SCALE.start]) = (1.0, distance_m);
            // a circle is not its tangent: as `sources::range` has it
            let across = account.variance_along([-e / ground_m, n / ground_m]);
            let curvature_m = (across / distance_m).min(distance_m);
            let predicted_m = (1.0 + x[SCALE.start]) * distance_m + x[BIAS.start] + 0.5 * curvature_m;
            let variance = noise + 0.5 * curvature_m * curvature_m;
            (ground_m >= NEAR_M).then_some(Scalar { row, innovation: range_m - predicted_m, variance })
        };
        // what no entry of the table makes is no range: an echo, a packet that was jammed and sent again
        let explained = |account: &Account| scalar(account).is_none_or(|scalar| account.explains(&scalar));
        if !self.accounts.iter().any(explained) {
            return;
        }
        for (account, entry) in self.accounts.iter_mut().zip(&TABLE) {
            if let Some(scalar) = scalar(account) {
                account.evidence += account.correct(&scalar, &entry.nuisances(declared));
            }
        }
        self.silent_s = 0.0;
    }

    /// What is declared, with a ship that is known no better than its last packet stated.
    fn with_ship(&self, declared: &Declared) -> Declared {
        let [vehicle_m, receiver_m] = declared.receivers_m;
        Declared { receivers_m: [vehicle_m, receiver_m.max(self.ship_m)], ..*declared }
    }

    /// A packet states one sigma of the ship, m.
    fn state_ship(&mut self, declared: &Declared, stated_m: f64) {
        let [_, before_m] = self.with_ship(declared).receivers_m;
        self.ship_m = stated_m;
        let more = stated_m * stated_m - before_m * before_m;
        if more > 0.0 {
            self.accounts.iter_mut().for_each(|account| account.widen_ship(more));
        }
    }

    fn state_level(&mut self, x: &VehicleState, declared: &Declared) {
        let mut horizontal = [Part::NONE; HYPOTHESES];
        let probabilities =
            risk::probabilities(self.accounts.each_ref().map(|account| account.evidence), self.silent_s);
        for ((part, account), probability) in horizontal.iter_mut().zip(&self.accounts).zip(probabilities) {
            let (apart_m, sigmas_m) = account.apart([x[X], x[Y]]);
            *part = Part { apart_m, sigmas_m, probability };
        }
        let mut vertical = [Part::NONE; CELLS.len()];
        for ((part, depth), slow) in vertical.iter_mut().zip(&self.depths).zip(&CELLS) {
            let (apart_m, sigma_m) = depth.apart(x[Z]);
            *part = Part { apart_m, sigmas_m: [sigma_m, 0.0], probability: slow.rate };
        }
        let level_m = |parts: &[Part]| risk::level_m(parts, declared.probability_per_hour);
        self.level = Some(Level { horizontal_m: level_m(&horizontal), vertical_m: level_m(&vertical) });
    }
}

/// Velocity through the water, north and east, m/s.
fn through_water(x: &VehicleState) -> [f64; 2] {
    let velocity = Attitude::new(&state::attitude(x)).rotation() * Vector3::new(x[U], x[V], x[W]);
    [velocity.x, velocity.y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::interface::config::NavigationConfig;

    /// North of the ship's circle at 1 m/s; what is wrong with it.
    #[derive(Clone, Copy, Default)]
    struct Wrong {
        ship_m: [f64; 2],
        range_m: f64,
        current_mps: [f64; 2],
        depth_mps: f64,
        /// No ranges from here on, s.
        silent_s: f64,
        /// One sigma that the ship states of itself; 0: 0.5, m.
        stated_m: f64,
        /// Ranges from here on are sent again a second late, s.
        replayed_s: f64,
    }

    /// Largest error over level, horizontally and in depth, and the last level, of an estimate that believes the fix,
    /// the cell and the still water; the ship goes around it every 15 minutes.
    fn fly(wrong: Wrong, duration_s: u32) -> ([f64; 2], Level) {
        let sensors = NavigationConfig::REFERENCE.sensors;
        let declared = Declared { receivers_m: [1.5; 2], ..Declared::DEFAULT };
        let mut level = ProtectionLevel::new();
        let (mut estimate, mut truth) = (VehicleState::zeros(), [0.0; 3]);
        estimate[U] = 1.0;
        let mut worst = [0.0_f64; 2];
        for second in 1..=duration_s {
            let time_s = f64::from(second);
            estimate[X] += 1.0;
            truth =
                [truth[0] + 1.0 + wrong.current_mps[0], truth[1] + wrong.current_mps[1], truth[2] + wrong.depth_mps];
            // a controller that believes the cell holds its depth, nose down
            estimate[THETA] = -libm::asin(wrong.depth_mps);
            let followed = Followed {
                time_us: 1_000_000 * u64::from(second),
                state: &estimate,
                sensors: &sensors,
                ship_transducer_depth_m: 0.0,
            };
            if second == 1 {
                level.start(&followed, sensors.gnss_m, &declared);
                continue;
            }
            level.take(&followed, &Aiding::Depth(estimate[Z]), &declared);
            if second % 30 == 0 && (wrong.silent_s == 0.0 || time_s < wrong.silent_s) {
                let (sin, cos) = libm::sincos(core::f64::consts::TAU * time_s / 900.0);
                let place = [truth[0] + 400.0 * cos, truth[1] + 400.0 * sin];
                let [north, east] = [truth[0] - place[0], truth[1] - place[1]];
                let replayed = wrong.replayed_s > 0.0 && time_s >= wrong.replayed_s;
                let late_m = if replayed { 1500.0 } else { 0.0 };
                let range_m = libm::hypot(libm::hypot(north, east), truth[2]) + wrong.range_m + late_m;
                let ship = ShipReport {
                    position_m: [place[0] + wrong.ship_m[0], place[1] + wrong.ship_m[1]],
                    velocity_mps: [0.0; 2],
                    position_sigma_m: if wrong.stated_m > 0.0 { wrong.stated_m } else { 0.5 },
                    velocity_sigma_mps: 0.1,
                };
                level.take(&followed, &Aiding::Range { since_m: [0.0; 2], ship, range_m }, &declared);
            }
            level.follow(&followed, &declared);
            let stated = level.level().unwrap();
            let error_m = libm::hypot(estimate[X] - truth[0], estimate[Y] - truth[1]);
            worst[0] = worst[0].max(error_m / stated.horizontal_m);
            worst[1] = worst[1].max((estimate[Z] - truth[2]).abs() / stated.vertical_m);
        }
        (worst, level.level().unwrap())
    }

    /// Whatever the estimate does, here nothing at all, the level covers its error, for as long as it lasts.
    #[test]
    fn val_the_level_covers_an_estimate_that_is_wrong() {
        let cases = [
            Wrong::default(),
            Wrong { ship_m: [30.0, -20.0], ..Wrong::default() },
            Wrong { range_m: 15.0, ..Wrong::default() },
            Wrong { current_mps: [0.1, -0.15], ..Wrong::default() },
            Wrong { current_mps: [0.1, 0.1], silent_s: 900.0, ..Wrong::default() },
            Wrong { depth_mps: 0.005, ..Wrong::default() },
        ];
        for (case, wrong) in cases.into_iter().enumerate() {
            let (worst, _) = fly(wrong, 2700);
            assert!(worst[0] < 1.0 && worst[1] < 1.0, "case {case}: {worst:?}");
        }
    }

    /// A ship's offset is seen by nothing but the first fix: the level does not forget the contradiction.
    #[test]
    fn a_contradiction_is_not_forgotten() {
        let [before, after] = [1800, 5400]
            .map(|duration_s| fly(Wrong { ship_m: [60.0, 0.0], ..Wrong::default() }, duration_s).1.horizontal_m);
        assert!(before > 60.0 && after > 60.0, "{before} m, {after} m");
    }

    /// Antenna, arm and datum of the ship: a level of a ship that states 10 m is as large as they demand, and of one that
    /// states it no longer it falls.
    #[test]
    fn val_what_the_ship_states_of_itself_is_in_the_level() {
        let [known, vague] =
            [0.5, 10.0].map(|stated_m| fly(Wrong { stated_m, ..Wrong::default() }, 2700).1.horizontal_m);
        // 3.7 sigmas of a circle at 1e-3
        assert!(vague > 30.0 && known < 30.0, "{known} m, {vague} m");
    }

    /// A packet that is jammed and sent again a second later says 1500 m too much, which nothing in the table does: it
    /// is silence.
    #[test]
    fn val_a_range_that_nothing_explains_is_silence() {
        let silent = fly(Wrong { silent_s: 900.0, ..Wrong::default() }, 1500).1.horizontal_m;
        let replayed = fly(Wrong { replayed_s: 900.0, ..Wrong::default() }, 1500).1.horizontal_m;
        // a range of the last second puts the level off to the next: 0.2 m of growth
        assert!((replayed - silent).abs() < 0.5, "{replayed} m, {silent} m");
    }

    /// Silence costs: without ranges the level grows without end.
    #[test]
    fn a_level_without_ranges_grows() {
        let silent = |silent_s| fly(Wrong { silent_s, ..Wrong::default() }, 1800).1.horizontal_m;
        assert!(silent(600.0) > 2.0 * silent(0.0), "{} m, {} m", silent(600.0), silent(0.0));
    }
}
