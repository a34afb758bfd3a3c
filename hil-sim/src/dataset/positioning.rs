//! USBL of the ship and transponders on the bottom, seen from where vehicle and ship really were.
//!
//! Every ten seconds the vehicle sends. The ship's array hears it and measures range, bearing and elevation; four
//! transponders answer it, and the vehicle times the round trips. Sound goes along straight lines at the true speed; what
//! is logged is by the declared one. Of outliers, which come by the effect `range_outliers`, there are more the longer the
//! path.

use super::{COMMAND_US, Spec};
use crate::noise::{Colour, Colouring, SensorClass};
use crate::rng::{Source, Stream};
use crate::scenario::Scenario;
use crate::scenario::effects::AcousticChannel;
use backseat_logs::{Column, LogRow};

/// Time between two pings, µs, and that of the first.
const PERIOD_US: u64 = 10_000_000;
const FIRST_US: u64 = 5_000_000;
/// One sigma of the direction, rad: half a degree.
const ANGLE_SIGMA_RAD: f64 = 0.0087;
/// How far outside of what is flown the transponders stand, m.
const BESIDE_M: f64 = 80.0;
/// Path of which the declared share are outliers, m.
const OUTLIER_PATH_M: f64 = 300.0;
/// Mean of the size of an outlier, m.
const OUTLIER_M: f64 = 40.0;

/// Where both vessels were at one command.
pub(super) struct Place {
    /// The vehicle's transducer, m.
    pub vehicle_m: [f64; 3],
    /// The ship, m.
    pub ship_m: [f64; 2],
}

pub(super) struct Positioning<'a> {
    spec: &'a Spec,
    channel: AcousticChannel,
    declared_speed_mps: f64,
    ship_transducer_depth_m: f64,
    /// One sigma of a range and of the ship's fixes, m.
    sigma_m: [f64; 2],
    bottom_m: f64,
    places: Vec<Place>,
    noise: Stream,
    outliers: Stream,
    /// Factor on every standard deviation.
    size: f64,
    /// Of range, bearing and elevation.
    usbl_colouring: Option<Colouring<3>>,
    /// Of the ranges to each transponder.
    transponder_colouring: Option<Colouring<4>>,
}

impl<'a> Positioning<'a> {
    /// `None`: neither is wanted.
    pub fn new(spec: &'a Spec, scenario: &Scenario, places: Vec<Place>, seed: u64) -> Option<Self> {
        let (settings, sensors) = (&scenario.settings, &scenario.vehicle.sensors);
        let mixture = spec.noise.mixture(SensorClass::Acoustic, Colour::ACOUSTIC, seed);
        (spec.usbl || spec.lbl).then(|| Self {
            spec,
            channel: scenario.physics().channel,
            declared_speed_mps: settings.environment.sound_speed_mps,
            ship_transducer_depth_m: settings.ship.transducer_depth_m,
            sigma_m: [sensors.range_m, sensors.ship_gnss_m],
            bottom_m: settings.environment.bottom_depth_m,
            places,
            noise: Stream::new(seed, Source::Positioning),
            outliers: Stream::new(seed, Source::PositioningOutliers),
            size: mixture.size,
            usbl_colouring: mixture.colouring(seed, Source::UsblColour),
            transponder_colouring: mixture.colouring(seed, Source::TransponderColour),
        })
    }

    /// Adds its rows to a log.
    pub fn log(mut self, rows: &mut Vec<LogRow>) {
        let stations_m = self.stations();
        if self.spec.lbl {
            for (number, [north, east]) in (1..).zip(stations_m) {
                let mut row = LogRow::new(0);
                row.set(Column::Station, f64::from(number)).set_all(Column::StationX, &[north, east, self.bottom_m]);
                rows.push(row);
            }
        }
        let end_us = (self.places.len() as u64).saturating_sub(1) * COMMAND_US;
        // the last round trip needs time to come back
        for time_us in (FIRST_US..end_us.saturating_sub(PERIOD_US)).step_by(PERIOD_US as usize) {
            if self.spec.usbl {
                rows.push(self.fix(time_us));
            }
            if self.spec.lbl {
                let white = self.noise.normals(self.size);
                let mix = |colouring: &mut Colouring<4>| colouring.mix(white, self.size, time_us);
                let errors = self.transponder_colouring.as_mut().map_or(white, mix);
                let ends = stations_m.into_iter().zip(errors).enumerate();
                rows.extend(ends.map(|(station, (place, error))| self.round_trip(time_us, station, place, error)));
            }
        }
        rows.sort_by_key(|row| row.time_us);
    }

    /// Declared places of the transponders: the corners of a rectangle around what is flown, north and east, m.
    fn stations(&self) -> [[f64; 2]; 4] {
        let of = |axis: usize| {
            let all = self.places.iter().map(move |place| place.vehicle_m[axis]);
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
        };
        let ([south, north], [west, east]) = (of(0), of(1));
        let (south, north, west, east) = (south - BESIDE_M, north + BESIDE_M, west - BESIDE_M, east + BESIDE_M);
        [[north, east], [south, east], [south, west], [north, west]].map(|place| place.map(f64::round))
    }

    fn at(&self, time_s: f64) -> ([f64; 3], [f64; 2]) {
        let step_s = COMMAND_US as f64 * 1e-6;
        let last = self.places.len() - 2;
        let place = ((time_s / step_s) as usize).min(last);
        let share = time_s / step_s - place as f64;
        let (a, b) = (&self.places[place], &self.places[place + 1]);
        let vehicle = core::array::from_fn(|i| a.vehicle_m[i] + share * (b.vehicle_m[i] - a.vehicle_m[i]));
        (vehicle, core::array::from_fn(|i| a.ship_m[i] + share * (b.ship_m[i] - a.ship_m[i])))
    }

    /// Travel time of a path that arrives where `end` is then, s.
    fn flight_s(&self, left_s: f64, from_m: [f64; 3], end: impl Fn(f64) -> [f64; 3]) -> f64 {
        let speed_mps = self.declared_speed_mps / (1.0 + self.channel.sound_speed_ratio);
        let mut flight_s = 0.0;
        for _ in 0..4 {
            flight_s = distance(from_m, end(left_s + flight_s)) / speed_mps;
        }
        flight_s
    }

    fn outlier_m(&mut self, path_m: f64) -> f64 {
        let [hit, size] = core::array::from_fn(|_| self.outliers.uniform());
        let share = self.channel.outlier_share * path_m / OUTLIER_PATH_M;
        // a later path
        if hit < share { 5.0 - OUTLIER_M * libm::log1p(-size) } else { 0.0 }
    }

    /// What the ship's USBL measures of a ping that the vehicle sends at a time.
    fn fix(&mut self, time_us: u64) -> LogRow {
        let left_s = time_us as f64 * 1e-6;
        let (vehicle_m, _) = self.at(left_s);
        let depth_m = self.ship_transducer_depth_m;
        let array = |time_s: f64| {
            let (_, [x, y]) = self.at(time_s);
            [x, y, depth_m]
        };
        let flight_s = self.flight_s(left_s, vehicle_m, array);
        let ship_m = array(left_s + flight_s);
        let [north, east, down] = core::array::from_fn(|i| vehicle_m[i] - ship_m[i]);
        let outlier_m = self.outlier_m(self.declared_speed_mps * flight_s);
        let white = self.noise.normals(self.size);
        let errors = self.usbl_colouring.as_mut().map_or(white, |colouring| colouring.mix(white, self.size, time_us));
        let [range_sigma_m, ship_sigma_m] = self.sigma_m;
        let (arrival_s, range_m) = (left_s + flight_s, self.declared_speed_mps * flight_s + outlier_m);
        let elevation_rad = libm::atan2(-down, libm::hypot(north, east));
        // the same error across the direction both ways: a bearing counts less where one looks down
        let bearing_error_rad = ANGLE_SIGMA_RAD * errors[1] / libm::cos(elevation_rad).max(0.01);
        let bearing_rad = libm::atan2(east, north) + bearing_error_rad + self.channel.usbl_turn_rad;
        let mut row = LogRow::new((arrival_s * 1e6).round() as u64);
        let measured = [range_m + range_sigma_m * errors[0], bearing_rad, elevation_rad + ANGLE_SIGMA_RAD * errors[2]];
        row.set_all(Column::UsblRange, &measured);
        row.set(Column::UsblRangeSigma, range_sigma_m).set(Column::UsblAngleSigma, ANGLE_SIGMA_RAD);
        let factor = self.spec.noise.factor() * ship_sigma_m;
        let told = [0, 1].map(|axis: usize| ship_m[axis] + factor * self.noise.normal());
        row.set(Column::Tol, left_s).set(Column::Toa, arrival_s).set_all(Column::ShipX, &told);
        row
    }

    /// What the vehicle measures of a transponder's answer to its ping.
    fn round_trip(&mut self, time_us: u64, station: usize, declared_m: [f64; 2], error: f64) -> LogRow {
        let off = if self.channel.misplaced == station + 1 { self.channel.misplaced_m } else { [0.0; 2] };
        let place_m = [declared_m[0] + off[0], declared_m[1] + off[1], self.bottom_m];
        let left_s = time_us as f64 * 1e-6;
        let out_s = self.flight_s(left_s, self.at(left_s).0, |_| place_m);
        let back_s = self.flight_s(left_s + out_s, place_m, |time_s| self.at(time_s).0);
        let path_m = 0.5 * self.declared_speed_mps * (out_s + back_s);
        let range_m = path_m + self.outlier_m(path_m) + self.sigma_m[0] * error;
        let arrival_s = left_s + out_s + back_s;
        let mut row = LogRow::new((arrival_s * 1e6).round() as u64);
        row.set(Column::TwoWayRange, range_m).set(Column::Station, (station + 1) as f64);
        row.set(Column::Tol, left_s).set(Column::Toa, arrival_s);
        row
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::sqrt((0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum())
}
