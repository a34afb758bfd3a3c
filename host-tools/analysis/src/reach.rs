//! What a protection level can reach: alert limits below it, said before the start.
//!
//! The board's own accounts, fed with a dive in which nothing is wrong: lines of a kilometre at 1 m/s, a ship on a circle
//! of 600 m at 2 m/s, a range every 30 s. Their estimate is the truth; what is left is what the declaration leaves open.

use backseat_app::parameters::{self, Settings};
use backseat_core::navigation::{Aiding, Declared, Followed, ProtectionLevel, SensorNoise, ShipReport};
use backseat_core::state::{PSI, U, VehicleState, X, Y, Z};
use backseat_logs::stats::{median, percentile};
use std::f64::consts::TAU;

/// What is flown with.
#[derive(Clone, Copy, Debug)]
pub struct FlightSetup {
    /// Of the level.
    pub declared: Declared,
    /// Alert limits horizontally and in depth, m; 0: none.
    pub alerts_m: [f64; 2],
    /// Noise of the sensors.
    pub sensors: SensorNoise,
    /// Acoustic ranges are used.
    pub ranges: bool,
    /// A DVL is.
    pub dvl: bool,
}

impl FlightSetup {
    /// By a board's parameters; those that are left out have their defaults.
    pub fn by<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let mut settings = Box::new(Settings::DEFAULT);
        for (name, value) in values {
            if let Some(parameter) = parameters::find(name) {
                parameter.set(&mut settings, value);
            }
        }
        let app = &settings.app;
        Self {
            declared: Declared {
                area: app.water_area,
                receivers_m: [app.receiver_bias_m; 2],
                probability_per_hour: app.level_probability_per_hour,
            },
            alerts_m: [app.alert_horizontal_m, app.alert_depth_m],
            sensors: settings.navigation.sensors,
            ranges: app.use_range,
            dvl: app.use_dvl,
        }
    }
}

/// The level in a dive of an hour of which nothing is wrong, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// In the best tenth of the time, horizontally and in depth.
    pub best_m: [f64; 2],
    /// In half of it.
    pub median_m: [f64; 2],
}

/// Time of the dive, and of its part that counts: the first minutes rest on the fix, s.
const DIVE_S: u32 = 3600;
const COUNTS_S: u32 = 900;
const DEPTH_M: f64 = 10.0;

/// The level that can be stated.
#[must_use]
pub fn reach(flown: &FlightSetup) -> Reach {
    let mut level = ProtectionLevel::new();
    let mut x = VehicleState::zeros();
    x[U] = 1.0;
    let mut levels_m = [Vec::new(), Vec::new()];
    for second in 0..DIVE_S {
        let time_s = f64::from(second);
        x[PSI] = if (second / 1000).is_multiple_of(2) { 0.0 } else { TAU / 2.0 };
        x[X] += x[PSI].cos();
        x[Z] = DEPTH_M;
        let followed = Followed {
            time_us: 1_000_000 * u64::from(second + 1),
            state: &x,
            sensors: &flown.sensors,
            ship_transducer_depth_m: 0.0,
        };
        if second == 0 {
            level.start(&followed, flown.sensors.gnss_m, &flown.declared);
            continue;
        }
        level.take(&followed, &Aiding::Depth(DEPTH_M), &flown.declared);
        if flown.dvl {
            level.take(&followed, &Aiding::BottomTrack([x[U], 0.0, 0.0]), &flown.declared);
        }
        if flown.ranges && second % 30 == 0 {
            let (sin, cos) = (time_s * 2.0 / 600.0).sin_cos();
            let ship_m = [500.0 + 600.0 * cos, 600.0 * sin];
            let range_m = (x[X] - ship_m[0]).hypot(x[Y] - ship_m[1]).hypot(DEPTH_M);
            let ship = ShipReport {
                position_m: ship_m,
                velocity_mps: [0.0; 2],
                position_sigma_m: flown.sensors.ship_gnss_m,
                velocity_sigma_mps: 0.1,
            };
            level.take(&followed, &Aiding::Range { since_m: [0.0; 2], ship, range_m }, &flown.declared);
        }
        level.follow(&followed, &flown.declared);
        if let (true, Some(stated)) = (second >= COUNTS_S, level.level()) {
            levels_m[0].push(stated.horizontal_m);
            levels_m[1].push(stated.vertical_m);
        }
    }
    let of = |part: &dyn Fn(&[f64]) -> Option<f64>| [0, 1].map(|i| part(&levels_m[i]).unwrap_or(f64::INFINITY));
    Reach { best_m: of(&|levels| percentile(levels, 0.1)), median_m: of(&|levels| median(levels)) }
}

/// What is wrong with alert limits: one sentence for each below what can be reached.
#[must_use]
pub fn unreachable(flown: &FlightSetup) -> Vec<String> {
    let alerts_m = flown.alerts_m;
    if alerts_m.iter().all(|alert_m| *alert_m <= 0.0) {
        return Vec::new();
    }
    let Reach { best_m, median_m } = reach(flown);
    let names = ["app.alert_horizontal_m", "app.alert_depth_m"];
    let aided = match (flown.ranges, flown.dvl) {
        (true, true) => "with ranges and a DVL",
        (true, false) => "with ranges",
        (false, true) => "with a DVL and no ranges",
        (false, false) => "without ranges",
    };
    (0..2)
        .filter(|i| alerts_m[*i] > 0.0 && alerts_m[*i] < median_m[*i])
        .map(|i| {
            let mend = if i == 0 {
                "the larger limit, app.water_area if it is a lake, app.receiver_bias_m if the receivers are better, or a \
                 DVL"
            } else {
                "a larger limit, or a shorter dive: nothing on board sees a slow drift of the only cell"
            };
            format!(
                "{} = {} m is less than can be reached: {aided}, as receivers and water are declared, the protection \
                 level is {:.1} m at best and {:.1} m in the median of an hour in which nothing is wrong; under way the \
                 vehicle would be degraded. Mend: {mend}",
                names[i], alerts_m[i], best_m[i], median_m[i]
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::navigation::{Area, NavigationConfig};

    fn flown(area: Area, dvl: bool, ranges: bool) -> FlightSetup {
        let declared = Declared { area, receivers_m: [1.5; 2], ..Declared::DEFAULT };
        FlightSetup { declared, alerts_m: [0.0; 2], sensors: NavigationConfig::REFERENCE.sensors, ranges, dvl }
    }

    /// 1.5 m of the ship's receiver per axis at 1e-3 are 5.6 m, which nothing undercuts; calm water and a DVL make it
    /// smaller, silence larger.
    #[test]
    fn val_the_reach_follows_the_declaration() {
        let [coast, lake, dvl] = [(Area::Coast, false), (Area::Lake, false), (Area::Coast, true)]
            .map(|(area, dvl)| reach(&flown(area, dvl, true)).median_m[0]);
        assert!(lake > 5.6 && lake < coast && dvl < coast, "{lake} {coast} {dvl}");
        assert!(reach(&flown(Area::Coast, false, false)).median_m[0] > 2.0 * coast);
    }

    #[test]
    fn a_limit_that_cannot_be_kept_is_named() {
        let flown = flown(Area::Coast, false, true);
        let said = unreachable(&FlightSetup { alerts_m: [2.0, 0.1], ..flown });
        assert!(
            said[0].starts_with("app.alert_horizontal_m = 2 m") && said[1].contains("app.alert_depth_m"),
            "{said:?}"
        );
        assert!(
            unreachable(&flown).is_empty() && unreachable(&FlightSetup { alerts_m: [1.0e3; 2], ..flown }).is_empty()
        );
        let board =
            FlightSetup::by([("app.water_area", 0.0), ("app.alert_horizontal_m", 30.0), ("app.use_range", 1.0)]);
        assert_eq!(
            (board.declared.area, board.alerts_m, board.declared.receivers_m),
            (Area::Lake, [30.0, 0.0], [1.5; 2])
        );
    }
}
