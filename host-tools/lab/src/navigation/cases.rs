//! Undeclared errors of the vehicle, its sensors and the water.

use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::{Current, Effect, Mission, MissionWaypoint, Scenario};
use std::f64::consts::TAU;

/// One world. Sizes are those of the table; signs and directions are drawn by the seed.
pub struct MissionCase {
    /// As in tables and on the command line.
    pub name: &'static str,
    /// What differs from the mission's defaults.
    pub about: &'static str,
    /// Changes the scenario.
    apply: fn(&mut Scenario, &mut Stream),
    /// The app and the filters may fuse body rates (0.5 degree/s).
    pub rates: bool,
    /// The filters take the DVL, for as long as there is one.
    pub has_dvl: bool,
    /// Errors count from here on, s.
    pub from_s: f64,
    /// The world is as declared: the kinematic filters of the thesis and the bounds are in the table as well.
    pub is_declared: bool,
    /// A dive before this one, in another current, has taught the filters of the vehicle.
    pub is_second_dive: bool,
}

const DEFAULT: MissionCase = MissionCase {
    name: "",
    about: "",
    apply: |_, _| {},
    rates: false,
    has_dvl: false,
    from_s: 0.0,
    is_declared: false,
    is_second_dive: false,
};

/// Speed of the undeclared current, m/s.
const CURRENT_MPS: f64 = 0.15;
/// Period of the rotary tide, s.
const TIDE_S: f64 = 12.4 * 3600.0;
/// What is added to the seed of a dive for that of the second.
const SECOND_SEED: u64 = 1_000_000;
/// When the DVL of a case is lost, s.
const DVL_S: f64 = 1200.0;

/// All, in the order of the table.
pub const CASES: &[MissionCase] = &[
    MissionCase {
        name: "exact",
        about: "truth and filter share the parameters, still water",
        is_declared: true,
        ..DEFAULT
    },
    MissionCase { name: "exact-gyros", about: "exact, with gyro rates of 0.5 degree/s", rates: true, ..DEFAULT },
    MissionCase {
        name: "5%",
        about: "inertia, drag, fins and thrust each 5 % off",
        apply: |s, _| share(s, 0.05),
        ..DEFAULT
    },
    MissionCase { name: "10%", about: "each 10 % off", apply: |s, _| share(s, 0.10), ..DEFAULT },
    MissionCase { name: "20%", about: "each 20 % off", apply: |s, _| share(s, 0.20), ..DEFAULT },
    MissionCase {
        name: "10%+current+heading",
        about: "10 %, a steady current of 0.15 m/s, compass 2 degrees off",
        apply: wrong_current_heading,
        ..DEFAULT
    },
    MissionCase { name: "Y", about: Y_ABOUT, apply: everything, ..DEFAULT },
    MissionCase { name: "Y-second-dive", about: SECOND_ABOUT, apply: everything, is_second_dive: true, ..DEFAULT },
    MissionCase {
        name: "Y-gyros",
        about: "Y, with gyro rates of 0.5 degree/s",
        apply: everything,
        rates: true,
        ..DEFAULT
    },
    MissionCase {
        name: "tide",
        about: "Y with a rotary tide of 0.15 m/s and 12.4 h for its current",
        apply: |s, d| {
            everything(s, d);
            tide(s, d);
        },
        ..DEFAULT
    },
    MissionCase {
        name: "shear",
        about: "Y with a current that changes by 0.1 m/s from the first line to the last",
        apply: |s, d| {
            everything(s, d);
            let [north, east] = direction(d, 0.1 / 900.0);
            s.settings.environment.current.gradient_per_s = [north, east];
        },
        ..DEFAULT
    },
    MissionCase {
        name: "front",
        about: "Y with its current east of the fifth line only",
        apply: |s, d| {
            everything(s, d);
            s.settings.environment.current.front_east_m = Some(450.0);
        },
        ..DEFAULT
    },
    MissionCase {
        name: "late-current",
        about: "10 % and heading; a current of 0.15 m/s sets in after an hour",
        apply: |s, d| {
            wrong_current_heading(s, d);
            s.settings.environment.current.onset_s = 3600.0;
        },
        ..DEFAULT
    },
    MissionCase {
        name: "waves",
        about: "10 %, waves of 0.1 m and 6 s (0.075 m/s at 3 m depth)",
        apply: |s, _| {
            share(s, 0.10);
            effect(s, "waves", &[("amplitude_mps", 0.075), ("period_s", 6.0)]);
        },
        ..DEFAULT
    },
    MissionCase {
        name: "speed-changes",
        about: "10 %, linear drag of 0.3 N s/m, thrust loss of 0.003 N s²/(rad m), legs at 1.0, 1.3 and 0.8 m/s by turns",
        apply: |s, _| {
            share(s, 0.10);
            effect(s, "linear_drag", &[("surge_ns_per_m", 0.3)]);
            effect(s, "thrust_loss", &[("k_n_s2_per_rad_m", 0.003)]);
            speeds(s, [1.0, 1.3, 0.8]);
        },
        ..DEFAULT
    },
    MissionCase {
        name: "d26",
        about: "10 %, cross drag d26 of 20 kg m/rad²",
        apply: |s, d| {
            share(s, 0.10);
            effect(s, "cross_drag", &[("d26", 20.0 * d.sign())]);
        },
        ..DEFAULT
    },
    MissionCase {
        name: "10%-dvl-first",
        about: "10 %, a DVL for the first twenty minutes, then none; errors from then on",
        apply: |s, _| {
            share(s, 0.10);
            s.settings.backseat.dvl = true;
            s.settings.sensors.dvl.until_s = Some(DVL_S);
        },
        has_dvl: true,
        from_s: DVL_S,
        ..DEFAULT
    },
];

const Y_ABOUT: &str = "10 % + current + heading, hard iron 1 degree, servo lag 0.2 s, fins 1 degree off in yaw and \
                       pitch, buoyancy 0.1 kg, centre of gravity 2 mm ahead or astern";

const SECOND_ABOUT: &str =
    "The vehicle of Y in another current, after a dive in the first one from which the robust filter starts";

impl MissionCase {
    /// The second dive of the mission of one seed: another current and other noise. What was learnt is not in it.
    pub fn second_dive(&self, seed: u64, minutes: Option<f64>) -> anyhow::Result<Scenario> {
        let mut scenario = self.scenario(seed, minutes)?;
        scenario.settings.backseat.wrong_seed = Some(seed);
        scenario.settings.seed = seed + SECOND_SEED;
        let [north_mps, east_mps] = direction(&mut Stream::new(scenario.settings.seed, Source::Study), CURRENT_MPS);
        set_current(&mut scenario, Current { north_mps, east_mps, ..still() });
        Ok(scenario)
    }

    /// The mission of one seed.
    pub fn scenario(&self, seed: u64, minutes: Option<f64>) -> anyhow::Result<Scenario> {
        let mut scenario = Scenario::built_in("survey")?;
        let settings = &mut scenario.settings;
        settings.seed = seed;
        settings.backseat.range_rate = false;
        settings.backseat.rates = self.rates;
        (self.apply)(&mut scenario, &mut Stream::new(seed, Source::Study));
        if let Some(minutes) = minutes {
            scenario.settings.duration_s = scenario.settings.duration_s.min(60.0 * minutes);
        }
        Ok(scenario)
    }
}

/// A vector of this length in a direction that is drawn.
fn direction(draw: &mut Stream, size: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(TAU * draw.uniform());
    [size * cos, size * sin]
}

fn share(scenario: &mut Scenario, share: f64) {
    scenario.settings.backseat.wrong_share = share;
}

fn effect(scenario: &mut Scenario, name: &str, values: &[(&str, f64)]) {
    let effect = Effect::new(name, values).expect("the simulator has this effect");
    scenario.settings.effects.push(effect);
}

fn still() -> Current {
    Current::default()
}

fn set_current(scenario: &mut Scenario, current: Current) {
    scenario.settings.environment.current = current;
}

fn wrong_current_heading(scenario: &mut Scenario, draw: &mut Stream) {
    share(scenario, 0.10);
    let [north_mps, east_mps] = direction(draw, CURRENT_MPS);
    set_current(scenario, Current { north_mps, east_mps, ..still() });
    effect(scenario, "heading_bias", &[("const_rad", draw.sign() * 2.0_f64.to_radians())]);
}

fn everything(scenario: &mut Scenario, draw: &mut Stream) {
    let degree = 1.0_f64.to_radians();
    wrong_current_heading(scenario, draw);
    let [sin, cos] = direction(draw, degree);
    effect(scenario, "heading_bias", &[("sin_rad", sin), ("cos_rad", cos)]);
    effect(scenario, "fin_lag", &[("s", 0.2)]);
    // In yaw top and bottom have opposite offsets, in pitch port and starboard.
    for first in [1.0, 3.0] {
        let sign = draw.sign();
        effect(scenario, "fin_bias", &[("fin", first), ("rad", sign * degree)]);
        effect(scenario, "fin_bias", &[("fin", first + 1.0), ("rad", -sign * degree)]);
    }
    effect(scenario, "buoyancy_offset", &[("kg", 0.1 * draw.sign())]);
    scenario.settings.plant.cg_offset_m[0] += 0.002 * draw.sign();
}

fn tide(scenario: &mut Scenario, draw: &mut Stream) {
    let tide_phase_rad = TAU * draw.uniform();
    let current = Current { tide_mps: CURRENT_MPS, tide_period_s: TIDE_S, tide_phase_rad, ..still() };
    set_current(scenario, current);
}

/// The legs at these speeds by turns.
fn speeds(scenario: &mut Scenario, speeds_mps: [f64; 3]) {
    let lines = scenario.settings.lines();
    let waypoints = scenario.settings.waypoints();
    let is_line = |x_m: f64, y_m: f64| lines.iter().any(|line| line.to_m == [x_m, y_m]);
    let legs = waypoints.iter().zip(speeds_mps.iter().cycle()).map(|(w, speed_mps)| MissionWaypoint {
        x_m: w.x_m,
        y_m: w.y_m,
        depth_m: w.depth_m,
        speed_mps: *speed_mps,
        scored: is_line(w.x_m, w.y_m),
    });
    scenario.settings.mission = Mission::Waypoints(legs.collect());
}
