//! Does the filter's innovation move as a column says? Against a vehicle that has the change, without noise.

extern crate std;

use super::columns::{
    COLUMNS, CURRENT, DEPTH, DRAG, FIN_ANGLE, FIN_COMMAND, FIN_LOST, GYRO, HEADING, PITCH, RANGE, RANGE_SCALE, SHIP,
    THRUST, TRIM_AHEAD, TRIM_STARBOARD, WEIGHT,
};
use super::sensitivities::Sensitivities;
use super::sums::Direction;
use super::{Cause, Naming, Statement};
use crate::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use crate::navigation::filter::cekf::Filter;
use crate::navigation::{
    AcousticPath, InitialState, Measurement, NavigationConfig, Observer, ShipEnd, ShipReport, VehicleEnd,
};
use crate::random::Random;
use crate::state::{P, PHI, PSI, VehicleState, X, Y, Z};
use std::boxed::Box;
use std::vec::Vec;

/// Of the truth.
const STEP_US: u64 = 10_000;

/// No column: a fin that stands at an angle.
const FIN_STANDS: usize = COLUMNS;

/// What changes: a column, by how much, and when, s.
type Change = (usize, f64, f64);

struct World {
    model: VehicleModel,
    x: VehicleState,
    /// What has changed, by columns.
    changed: Vec<(usize, f64)>,
}

impl World {
    /// The vehicle with one more change from now on.
    fn change(&mut self, column: usize, size: f64) {
        self.changed.push((column, size));
        let mut p = VehicleParameters::IVER3;
        let mut shares = [1.0; 4];
        for &(column, size) in &self.changed {
            match column {
                FIN_LOST..FIN_ANGLE => shares[column - FIN_LOST] -= size,
                THRUST => p.beta5_n_s2_per_rad2 *= 1.0 - size,
                DRAG => p.quadratic_diag[0] *= 1.0 + size,
                WEIGHT => p.mass_kg += size,
                TRIM_AHEAD => p.b_cb_to_cg_m[0] += size / p.displaced_mass_kg,
                TRIM_STARBOARD => p.b_cb_to_cg_m[1] += size / p.displaced_mass_kg,
                _ => {}
            }
        }
        self.model = VehicleModel::new(&p).expect("valid");
        self.model.set_fin_effectiveness(&shares);
    }

    fn step(&mut self, input: &ActuatorInput) {
        let mut input = *input;
        for &(column, size) in &self.changed {
            match column {
                FIN_ANGLE..FIN_COMMAND => input.fins_rad[column - FIN_ANGLE] += size,
                FIN_COMMAND..THRUST => input.fins_rad[column - FIN_COMMAND] *= 1.0 - size,
                FIN_STANDS.. => input.fins_rad[column - FIN_STANDS] = size,
                _ => {}
            }
        }
        let h = 1.0e-6 * STEP_US as f64;
        let first = self.model.derivative(&self.x, &input);
        let second = self.model.derivative(&(self.x + first * h), &input);
        self.x += (first + second) * (0.5 * h);
        for axis in 0..2 {
            self.x[X + axis] += self.own(CURRENT + axis) * h;
        }
    }

    /// By how much a column has changed.
    fn own(&self, column: usize) -> f64 {
        self.changed.iter().filter(|(own, _)| *own == column).map(|(_, size)| size).sum()
    }

    fn measurements(&self, t_s: f64) -> [Option<Measurement>; 4] {
        let x = &self.x;
        let own = |column: usize| self.own(column);
        let (sin, cos) = libm::sincos(x[PSI]);
        let heading = own(HEADING) + own(HEADING + 1) * sin + own(HEADING + 2) * cos;
        let depth = Measurement::Depth { z_m: x[Z] + own(DEPTH) };
        let attitude = Measurement::Attitude { euler_rad: [x[PHI], x[PHI + 1] + own(PITCH), x[PSI] + heading] };
        let rates = Measurement::Rates { rates_radps: [x[P], x[P + 1], x[P + 2] + own(GYRO)] };
        // once around in twenty minutes
        let (sin, cos) = libm::sincos(t_s / 190.0);
        let ship_m = [300.0 * cos, 300.0 * sin];
        let path = AcousticPath {
            vehicle: VehicleEnd::Now,
            ship: ShipEnd::Reported(ShipReport {
                position_m: [ship_m[0] + own(SHIP), ship_m[1] + own(SHIP + 1)],
                velocity_mps: [0.0; 2],
                position_sigma_m: 0.1,
                velocity_sigma_mps: 0.01,
            }),
        };
        let true_m = libm::hypot(libm::hypot(x[X] - ship_m[0], x[Y] - ship_m[1]), x[Z]);
        let range = Measurement::Range { path, range_m: true_m * (1.0 + own(RANGE_SCALE)) + own(RANGE) };
        [Some(depth), Some(attitude), Some(rates), (t_s % 20.0 < 0.05).then_some(range)]
    }
}

/// Something that sees the filter of the vehicle as declared.
trait Watch {
    type Seen: Observer;
    /// The change is about to begin.
    fn begin(&mut self, filter: &Filter);
    fn will_fuse(&mut self, filter: &Filter, measurement: &Measurement, t_s: f64) -> &mut Self::Seen;
    fn will_predict(&mut self, filter: &Filter, input: &ActuatorInput, t_s: f64) -> &mut Self::Seen;
    /// Behind a step of 0.1 s.
    fn step(&mut self, _: &Filter) {}
}

impl Watch for Sensitivities {
    type Seen = Self;

    fn begin(&mut self, filter: &Filter) {
        self.keep_onset(filter.time_us(), [1.0; COLUMNS]);
    }

    fn will_fuse(&mut self, filter: &Filter, measurement: &Measurement, t_s: f64) -> &mut Self {
        Self::will_fuse(self, filter, measurement, t_s / 3600.0, true);
        self
    }

    fn will_predict(&mut self, filter: &Filter, input: &ActuatorInput, t_s: f64) -> &mut Self {
        let x = *filter.state();
        Self::will_predict(self, filter, &x, input, t_s / 3600.0);
        self
    }
}

impl Watch for Naming {
    type Seen = Sensitivities;

    fn begin(&mut self, _: &Filter) {}

    fn will_fuse(&mut self, filter: &Filter, measurement: &Measurement, _: f64) -> &mut Sensitivities {
        Self::will_fuse(self, Some(filter), measurement)
    }

    fn will_predict(&mut self, filter: &Filter, input: &ActuatorInput, _: f64) -> &mut Sensitivities {
        let x = *filter.state();
        Self::will_predict(self, Some(filter), &x, input)
    }

    fn step(&mut self, filter: &Filter) {
        Self::step(self, Some(filter));
    }
}

/// As the sensors of the reference have it.
fn add_noise(random: &mut Random, measurement: &mut Measurement) {
    let sensors = NavigationConfig::REFERENCE.sensors;
    match measurement {
        Measurement::Depth { z_m } => *z_m += sensors.depth_m * random.normal(),
        Measurement::Attitude { euler_rad } => {
            euler_rad.iter_mut().for_each(|angle| *angle += sensors.attitude_rad * random.normal());
        }
        Measurement::Rates { rates_radps } => {
            rates_radps.iter_mut().for_each(|rate| *rate += sensors.rates_radps * random.normal());
        }
        Measurement::Range { range_m, .. } => *range_m += sensors.range_m * random.normal(),
        _ => {}
    }
}

/// Flies turns for `minutes` with these changes, the first of which the watch is told.
fn fly(changes: &[Change], minutes: u64, mut noise: Option<Random>, watch: &mut impl Watch) {
    let model = VehicleModel::new(&VehicleParameters::IVER3).expect("valid");
    let config = NavigationConfig { surface: None, ..NavigationConfig::REFERENCE };
    let mut filter = Box::new(Filter::new());
    filter.configure(&config, &model).expect("valid");
    let x = VehicleState::from([0.0, 0.0, 5.0, 0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let sigma = VehicleState::from([1.5, 1.5, 0.06, 0.02, 0.02, 0.02, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01]);
    filter.initialise(0, &InitialState { state: x, sigma }).expect("finite");
    let mut world = World { model, x, changed: Vec::new() };
    let mut input = ActuatorInput { propeller_radps: 100.0, fins_rad: [0.0; 4] };
    for k in 0..minutes * 6000 {
        let t_s = 1.0e-6 * (k * STEP_US) as f64;
        if k % 10 == 0 {
            if let Some(&(column, size, onset_s)) = changes.get(world.changed.len())
                && t_s >= onset_s
            {
                if world.changed.is_empty() {
                    watch.begin(&filter);
                }
                world.change(column, size);
            }
            for mut measurement in world.measurements(t_s).into_iter().flatten() {
                if let Some(noise) = &mut noise {
                    add_noise(noise, &mut measurement);
                }
                let seen = watch.will_fuse(&filter, &measurement, t_s);
                filter.fuse(&measurement, seen);
            }
            // turns, and a pilot in pitch and depth who is not calm
            let x = world.x;
            let rudder = 0.06 * libm::sin(t_s / 20.0);
            let elevator = (0.3 * x[PHI + 1] + 0.6 * x[P + 1] - 0.05 * (x[Z] - 5.0)).clamp(-0.2, 0.2)
                + 0.03 * libm::sin(t_s / 7.0);
            input.fins_rad = [rudder, -rudder, -elevator, elevator];
        }
        world.step(&input);
        if k % 10 == 9 {
            let seen = watch.will_predict(&filter, &input, t_s);
            filter.predict((k + 1) * STEP_US, &input, seen).expect("predicts");
            watch.step(&filter);
        }
    }
}

/// By how much the scores are off what the column says, over their size.
fn wrong_share(column: usize, size: f64) -> f64 {
    let mut watch = Box::new(Sensitivities::new());
    watch.watches = true;
    fly(&[(column, size, 300.0)], 13, None, &mut *watch);
    watch.hold();
    let onset = watch.onsets().first().expect("kept");
    let direction: Direction = [(column, 1.0), (0, 0.0)];
    let squares = onset.between(&watch.sums, &direction, &direction);
    assert!(squares > 1.0, "column {column} is not seen: {squares}");
    onset.score(&watch.sums, &direction) / (squares * size) - 1.0
}

/// What is stated after half an hour with a change at about ten minutes.
fn stated(column: usize, size: f64, onset_s: f64) -> Statement {
    let mut naming = Box::new(Naming::new());
    fly(&[(column, size, onset_s)], 30, Some(Random(7)), &mut *naming);
    naming.statement().expect("blocks were closed")
}

#[test]
fn val_what_changed_is_named_with_its_size() {
    let cases = [
        (FIN_LOST, 0.6, Cause::FinLost(0)),
        (FIN_LOST + 3, 0.5, Cause::FinLost(3)),
        (FIN_ANGLE + 1, 0.03, Cause::FinSlipped(1)),
        (WEIGHT, 0.1, Cause::WeightChanged),
        (TRIM_STARBOARD, 0.02, Cause::TrimStarboard),
        (CURRENT, 0.15, Cause::CurrentChanged),
        (PITCH, 0.03, Cause::PitchOffset),
        (GYRO, 0.006, Cause::GyroOffset),
    ];
    let mut wrong = Vec::new();
    for (column, size, cause) in cases {
        let statement = stated(column, size, 600.0);
        let [Some(named), None] = statement.named else {
            wrong.push(std::format!("{cause:?}: {statement:?}"));
            continue;
        };
        let late_s = 1.0e-6 * named.since_us as f64 - 600.0;
        let off = (named.size[0] - size).abs() / named.sigma[0];
        if named.cause != cause || statement.unexplained || off > 3.0 || late_s.abs() > 130.0 {
            wrong.push(std::format!("{cause:?} {size}: {statement:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A weak cause is still stated when a strong one follows, and one that is no stronger than what of the first is not linear
/// is found behind it.
#[test]
fn val_two_causes_are_named_one_after_the_other() {
    let cases = [
        [(CURRENT, 0.2, 600.0), (FIN_STANDS + 3, 0.04, 2400.0)],
        [(FIN_LOST + 3, 0.6, 600.0), (THRUST, 0.25, 1500.0)],
        [(FIN_STANDS, 0.03, 600.0), (WEIGHT, 0.1, 1800.0)],
    ];
    let causes = [
        [Cause::FinStuck(3), Cause::CurrentChanged],
        [Cause::FinLost(3), Cause::ThrustLost],
        [Cause::FinStuck(0), Cause::WeightChanged],
    ];
    for (changes, causes) in cases.iter().zip(causes) {
        let mut naming = Box::new(Naming::new());
        fly(changes, 50, Some(Random(7)), &mut *naming);
        let statement = naming.statement().expect("blocks were closed");
        let [Some(one), Some(other)] = statement.named else { panic!("{causes:?}: {statement:?}") };
        let is = |cause: Cause| one.cause == cause || other.cause == cause || other.rival == Some(cause);
        assert!(causes.into_iter().all(is), "{causes:?}: {statement:?}");
    }
}

/// Blocks end at 600.1 and 620.1 s.
#[test]
fn val_a_size_does_not_depend_on_when_within_a_block_it_began() {
    for onset_s in [600.0, 604.0, 612.0, 617.0] {
        let Some(named) = stated(FIN_STANDS + 2, 0.03, onset_s).named[0] else { panic!("{onset_s} s: nothing") };
        assert_eq!(named.cause, Cause::FinStuck(2), "{onset_s} s");
        assert!((named.size[0] / 0.03 - 1.0).abs() < 0.1, "{onset_s} s: {:?}", named.size);
    }
}

/// Uses what is named first, its size times a factor.
struct Used {
    naming: Box<Naming>,
    factor: f64,
    is_used: bool,
}

impl Watch for Used {
    type Seen = Sensitivities;

    fn begin(&mut self, _: &Filter) {}

    fn will_fuse(&mut self, filter: &Filter, measurement: &Measurement, t_s: f64) -> &mut Sensitivities {
        Watch::will_fuse(&mut *self.naming, filter, measurement, t_s)
    }

    fn will_predict(&mut self, filter: &Filter, input: &ActuatorInput, t_s: f64) -> &mut Sensitivities {
        Watch::will_predict(&mut *self.naming, filter, input, t_s)
    }

    fn step(&mut self, filter: &Filter) {
        self.naming.step(Some(filter));
        if let Some(Statement { named: [Some(mut named), _], .. }) = self.naming.take_statement()
            && !self.is_used
        {
            named.size = named.size.map(|size| self.factor * size);
            self.naming.follow(Some(&named));
            self.is_used = true;
        }
    }
}

#[test]
fn val_a_right_cause_predicts_better_and_a_wrong_one_worse() {
    for (factor, better) in [(1.0, true), (-1.0, false), (3.0, false)] {
        let mut watch = Used { naming: Box::new(Naming::new()), factor, is_used: false };
        fly(&[(FIN_LOST, 0.6, 600.0)], 25, Some(Random(7)), &mut watch);
        let gain = watch.naming.gain().expect("it is used, and its onset kept");
        assert!(if better { gain > 20.0 } else { gain < -20.0 }, "{factor}: {gain}");
        watch.naming.follow(None);
        assert_eq!(watch.naming.gain(), None);
    }
}

#[test]
fn val_who_is_told_the_cause_tells_a_lost_fin_from_others_but_thrust_not_from_drag() {
    for (column, size, cause, apart) in
        [(FIN_LOST, 0.6, Cause::FinLost(0), true), (THRUST, 0.2, Cause::ThrustLost, false)]
    {
        let mut naming = Box::new(Naming::new());
        fly(&[(column, size, 600.0)], 30, Some(Random(7)), &mut *naming);
        let [Some(named), None] = naming.statement().expect("blocks were closed").named else { panic!("{cause:?}") };
        let known = |size: f64| naming.known(cause, [size, 0.0], named.since_us).expect("its onset is kept");
        assert!(known(size).sigmas > 10.0, "{cause:?}: {:?}", known(size));
        assert_eq!(known(size).log_odds > libm::log(100.0), apart, "{cause:?}: {:?}", known(size));
        // of rounding
        assert!((known(2.0 * size).sigmas / known(size).sigmas - 2.0).abs() < 1.0e-6);
        assert_eq!(naming.known(cause, [size, 0.0], named.since_us + 1), None);
    }
}

#[test]
fn val_drag_and_thrust_at_one_speed_are_each_others_rival() {
    let statement = stated(THRUST, 0.2, 600.0);
    let [Some(named), None] = statement.named else { panic!("{statement:?}") };
    let both = [Some(named.cause), named.rival];
    assert!(both.contains(&Some(Cause::ThrustLost)) && both.contains(&Some(Cause::DragGrown)), "{statement:?}");
}

#[test]
fn val_of_a_vehicle_as_declared_nothing_is_named() {
    for seed in 1..4 {
        let mut naming = Box::new(Naming::new());
        fly(&[], 30, Some(Random(seed)), &mut *naming);
        let statement = naming.statement().expect("blocks were closed");
        assert_eq!(statement.named, [None; 2]);
        assert!(!statement.unexplained);
    }
}

#[test]
fn val_innovations_move_as_the_columns_say() {
    let sizes = [
        (FIN_LOST, 0.05),
        (FIN_LOST + 3, 0.05),
        (FIN_ANGLE + 1, 0.003),
        (FIN_COMMAND + 2, 0.05),
        (THRUST, 0.01),
        (DRAG, 0.01),
        (WEIGHT, 0.01),
        (TRIM_AHEAD, 0.001),
        (TRIM_STARBOARD, 0.001),
        (CURRENT, 0.01),
        (CURRENT + 1, 0.01),
        (HEADING, 0.005),
        (HEADING + 1, 0.005),
        (HEADING + 2, 0.005),
        (PITCH, 0.003),
        (GYRO, 0.001),
        (DEPTH, 0.02),
        (RANGE, 1.0),
        (RANGE_SCALE, 0.003),
        (SHIP, 1.0),
        (SHIP + 1, 1.0),
    ];
    let mut wrong = Vec::new();
    for (column, size) in sizes {
        let share = wrong_share(column, size);
        if share.abs() > 0.03 {
            wrong.push((column, share));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
