//! The filter that the vehicle navigates by: one, or a bank of three.
//!
//! The robust filter estimates the unknowns of the vehicle, with a current that changes steadily, as in a tide, and a
//! weight and a trim that walk, as in a hull that takes in water. Where everything is as declared its states cost half of
//! the accuracy, and where nothing changes the changes cost a quarter. The bank runs two more filters beside it: the
//! nominal one, and a robust one whose current, weight and trim are steady. The main filter is the one that allows most,
//! because its innovations decide which measurements are used and which sensor is suspect. The weight w_i is proportional
//! to the likelihood of filter i's innovations of ranges and fixes, each counted with three sigmas at most so that no
//! outlier decides; its logarithm is forgotten slowly ([`Evidence`]). Only these count, because they measure the
//! position: a nominal filter with a wrong model contradicts them long before it contradicts compass and depth sensor,
//! and those have so many innovations that they would outweigh the ranges. The estimate is the mixture: x = Σ w_i x_i,
//! P = Σ w_i (P_i + (x_i − x)(x_i − x)ᵀ).
//!
//! A member that fails loses its weight; so does one that refuses a sensor of the vehicle which the main filter uses,
//! as long as it does. All states behind the vehicle's are those of the robust filter.

mod mixture;

use super::evidence::{Evidence, MEMORY_S};
use crate::dynamics::{ActuatorInput, FINS, VehicleModel};
use crate::navigation::algebra::observer::Observer;
use crate::navigation::filter::cekf::Filter;
use crate::navigation::filter::vertical::is_steep;
use crate::navigation::integrity::{Aiding, Followed};
use crate::navigation::interface::config::{NavigationConfig, ProcessModel};
use crate::navigation::interface::effect_states::EffectStates;
use crate::navigation::interface::error::{CloneError, ConfigError, NavigationError};
use crate::navigation::interface::initial::{InitialShip, InitialState};
use crate::navigation::interface::measurement::{AcousticPath, CloneId, Fusions, Measurement, ShipEnd};
use crate::navigation::trust::integrity::MixtureOffset;
use crate::parameters::{Learnt, ProcessNoise};
use crate::state::{PHI, PSI, VEHICLE_STATES, VehicleState, X, Y, Z, wrap_angle};
use core::f64::consts::PI;
use nalgebra::ArrayStorage;

/// The navigation filter. Some 100 kB: lives in a static, never passed by value; a host may copy it.
///
/// State and covariance of the vehicle are the mixture's. What only one filter has (augmented states, ship, innovation
/// monitor, configuration) is the main filter's: see [`Self::main`].
#[derive(Clone)]
pub struct Navigator {
    main: Filter,
    others: [Member; OTHERS],
    /// The mixture.
    state: VehicleState,
}

/// ln of the prior odds of the others against the main filter. Most water changes by less than a tide's rate within a
/// dive: odds of ten to one for a current that does not.
const PRIOR: [f64; OTHERS] = [2.3, 2.3];

/// Filters beside the main one: [`NOMINAL`] and [`STEADY`].
const OTHERS: usize = 2;
/// The vehicle as declared.
const NOMINAL: usize = 0;
/// As the main filter, with steady current, weight and trim.
const STEADY: usize = 1;
/// The main filter.
const MAIN: usize = OTHERS;

/// Filters of a bank.
pub const MEMBERS: usize = 1 + OTHERS;

/// A filter of the bank, for a smoother.
pub struct BankMember<'a> {
    /// The filter.
    pub filter: &'a Filter,
    /// ln of the likelihood ratio of ranges and fixes so far, this filter's over the main one's: see [`Evidence`].
    pub log_ratio: f64,
    /// ln of its prior odds against the main filter.
    pub log_prior: f64,
}

/// A filter beside the main one.
#[derive(Clone)]
struct Member {
    filter: Filter,
    /// It follows the main filter.
    runs: bool,
    /// ln of the likelihood ratio of ranges and fixes, this filter's over the main one's: see [`Evidence`].
    log_ratio: f64,
    weight: f64,
}

impl Member {
    const NEW: Self = Self { filter: Filter::new(), runs: false, log_ratio: 0.0, weight: 0.0 };

    /// Repeats a call of the main filter; a member that refuses it is stopped.
    fn follow(&mut self, step: impl FnOnce(&mut Filter) -> bool) {
        if self.runs {
            self.runs = step(&mut self.filter);
        }
    }

    /// Its vehicle state `i` minus the main filter's. Near the vertical, where one attitude has many roll and heading
    /// angles, the bank's are those of the main filter.
    fn offset_from(&self, main: &Filter, i: usize) -> f64 {
        let difference = self.filter.state_at(i) - main.state_at(i);
        match i {
            PHI..=PSI if is_steep(main.state()) => 0.0,
            PSI => wrap_angle(difference),
            _ => difference,
        }
    }
}

impl Navigator {
    /// Empty: configure and initialise it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            main: Filter::new(),
            others: [const { Member::NEW }; OTHERS],
            state: VehicleState::from_array_storage(ArrayStorage([[0.0; VEHICLE_STATES]; 1])),
        }
    }

    /// Adopts a configuration and a vehicle and forgets everything else.
    ///
    /// # Errors
    /// The first value out of range, or a vehicle that its effects do not fit; the filter is then as it was.
    pub fn configure(&mut self, config: &NavigationConfig, model: &VehicleModel) -> Result<(), ConfigError> {
        with_config(MAIN, config, |own| self.main.configure(own, model))?;
        for (k, member) in self.others.iter_mut().enumerate() {
            member.runs = false;
            if config.bank {
                with_config(k, config, |own| member.filter.configure(own, model))?;
            }
        }
        self.mix();
        Ok(())
    }

    /// Adopts new numbers while running; state and covariance stay.
    ///
    /// # Errors
    /// A value out of range, effect states that come or go, or effects that do not fit the vehicle; the filter is then
    /// as it was.
    pub fn reconfigure(&mut self, config: &NavigationConfig) -> Result<(), ConfigError> {
        if config.bank != self.main.config().bank {
            return Err(ConfigError::LayoutChange);
        }
        with_config(MAIN, config, |own| self.main.reconfigure(own))?;
        let mut others = self.others.iter_mut().enumerate().filter(|_| config.bank);
        others.try_for_each(|(k, member)| with_config(k, config, |own| member.filter.reconfigure(own)))
    }

    /// Time that the effects' onsets and drifts count from, µs of the filter's time; 0 unless set.
    pub fn set_epoch(&mut self, epoch_us: u64) {
        self.main.set_epoch(epoch_us);
        self.others.iter_mut().for_each(|member| member.filter.set_epoch(epoch_us));
    }

    /// Changes the process model and its noise while running.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set_process_model(&mut self, model: ProcessModel, noise: &ProcessNoise) -> Result<(), ConfigError> {
        self.others.iter_mut().try_for_each(|member| member.filter.set_process_model(model, noise))?;
        self.main.set_process_model(model, noise)
    }

    /// Starts (or starts again) at `time_us` (2.3.1.2); ship, clones and a failure are forgotten.
    ///
    /// # Errors
    /// Not configured, or a value that is not finite (sigma: not positive).
    pub fn initialise(&mut self, time_us: u64, initial: &InitialState) -> Result<(), NavigationError> {
        self.main.initialise(time_us, initial)?;
        let bank = self.main.config().bank;
        for member in &mut self.others {
            member.runs = bank && member.filter.initialise(time_us, initial).is_ok();
            member.log_ratio = 0.0;
        }
        self.mix();
        Ok(())
    }

    /// Starts from what identification or earlier dives have learnt of the vehicle: call it after [`Self::initialise`],
    /// before the first prediction. The nominal filter stays with the declaration.
    pub fn start_from(&mut self, learnt: &Learnt) {
        self.main.start_from(learnt);
        if let Some(steady) = self.others.get_mut(STEADY) {
            steady.filter.start_from(learnt);
        }
    }

    /// Takes fins as broken from now on, the nominal filter apart: the shares of lift and drag that they have, 1 for a
    /// whole fin, and the angles at which they stand, rad.
    pub fn set_fins(&mut self, shares: &[f64; FINS], stands_rad: &[Option<f64>; FINS]) {
        self.main.set_fins(shares, stands_rad);
        if let Some(steady) = self.others.get_mut(STEADY) {
            steady.filter.set_fins(shares, stands_rad);
        }
        self.mix();
    }

    /// Makes the ship known (again) at the filter's present time; ship clones are forgotten.
    ///
    /// # Errors
    /// Not initialised, or a value that is not finite (sigma: not positive).
    pub fn initialise_ship(&mut self, ship: &InitialShip) -> Result<(), NavigationError> {
        self.main.initialise_ship(ship, &mut ())?;
        self.follow(|filter| filter.initialise_ship(ship, &mut ()).is_ok());
        Ok(())
    }

    /// Moves the filter to `to_us` under an input that is constant since the last call; see [`crate::navigation::MAX_GAP_US`].
    ///
    /// # Errors
    /// See [`NavigationError`]; a refused call leaves the filter as it was, a failure is kept.
    pub fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> Result<(), NavigationError> {
        self.predict_observed(to_us, input, &mut ())
    }

    /// [`Self::predict`], showing each step of the nominal filter to `observer`.
    ///
    /// # Errors
    /// As [`Self::predict`].
    pub fn predict_observed(
        &mut self,
        to_us: u64,
        input: &ActuatorInput,
        observer: &mut impl Observer,
    ) -> Result<(), NavigationError> {
        let gap_s = 1.0e-6 * to_us.saturating_sub(self.main.time_us()) as f64;
        self.main.predict(to_us, input, &mut ())?;
        if self.main.is_alone() {
            self.doubt(gap_s);
        }
        let [nominal, others @ ..] = &mut self.others;
        nominal.follow(|filter| filter.predict(to_us, input, observer).is_ok());
        others.iter_mut().for_each(|member| member.follow(|filter| filter.predict(to_us, input, &mut ()).is_ok()));
        self.mix();
        Ok(())
    }

    /// Fuses one measurement; returns the outcome of each of its scalars in the main filter.
    pub fn fuse(&mut self, measurement: &Measurement) -> Fusions {
        self.fuse_observed(measurement, &mut ())
    }

    /// [`Self::fuse`], showing each scalar that the nominal filter uses to `observer`.
    pub fn fuse_observed(&mut self, measurement: &Measurement, observer: &mut impl Observer) -> Fusions {
        let fusions = self.main.fuse(measurement, &mut ());
        for (k, member) in self.others.iter_mut().enumerate().filter(|(_, member)| member.runs) {
            let other = if k == NOMINAL {
                member.filter.fuse(measurement, observer)
            } else {
                member.filter.fuse(measurement, &mut ())
            };
            if let Some(evidence) = Evidence::new(measurement.sensor(), &other, &fusions) {
                member.log_ratio = evidence.beside(member.log_ratio);
            }
            member.runs = member.filter.failure().is_none();
        }
        self.mix();
        fusions
    }

    /// Repeats a call of the main filter on the other members; a member that refuses it is stopped.
    fn follow(&mut self, mut step: impl FnMut(&mut Filter) -> bool) {
        self.others.iter_mut().for_each(|member| member.follow(&mut step));
    }

    /// Since the last fix the position rests on another vehicle's packets too.
    #[must_use]
    pub fn leans(&self) -> bool {
        let mut others = self.others.iter().filter(|member| member.runs);
        self.main.leans() || others.any(|member| member.filter.leans())
    }

    /// The filter of the vehicle as declared, while it runs.
    #[must_use]
    pub fn nominal(&self) -> Option<&Filter> {
        let member = &self.others[NOMINAL];
        member.runs.then_some(&member.filter)
    }

    /// Takes a delayed state of the vehicle at the filter's present time.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_vehicle(&mut self) -> Result<CloneId, CloneError> {
        self.clone_vehicle_observed(&mut ())
    }

    /// [`Self::clone_vehicle`], showing the nominal filter's to `observer`.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_vehicle_observed(&mut self, observer: &mut impl Observer) -> Result<CloneId, CloneError> {
        let id = self.main.clone_vehicle(&mut ())?;
        let [nominal, others @ ..] = &mut self.others;
        nominal.follow(|filter| filter.clone_vehicle(observer) == Ok(id));
        others.iter_mut().for_each(|member| member.follow(|filter| filter.clone_vehicle(&mut ()) == Ok(id)));
        Ok(id)
    }

    /// Takes a delayed state of the ship at the filter's present time.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_ship(&mut self) -> Result<CloneId, CloneError> {
        let id = self.main.clone_ship(&mut ())?;
        self.follow(|filter| filter.clone_ship(&mut ()) == Ok(id));
        Ok(id)
    }

    /// Forgets a delayed state; a stale id does nothing.
    pub fn drop_clone(&mut self, id: CloneId) {
        self.drop_clone_observed(id, &mut ());
    }

    /// [`Self::drop_clone`], showing the nominal filter's to `observer`.
    pub fn drop_clone_observed(&mut self, id: CloneId, observer: &mut impl Observer) {
        self.main.drop_clone(id, &mut ());
        let [nominal, others @ ..] = &mut self.others;
        nominal.filter.drop_clone(id, observer);
        others.iter_mut().for_each(|member| member.filter.drop_clone(id, &mut ()));
    }

    /// Odds against a change of the water fade to even ones as fast as evidence is forgotten: nobody is heard who would
    /// tell of a change. What speaks for one stays.
    #[cold]
    fn doubt(&mut self, gap_s: f64) {
        for (member, prior) in self.others.iter_mut().zip(PRIOR) {
            member.log_ratio -= (member.log_ratio + prior).max(0.0) * -libm::expm1(-gap_s / MEMORY_S);
        }
    }

    fn mix(&mut self) {
        let evidence = |(member, prior): (&Member, f64)| {
            let counts = member.runs && member.filter.refused() & !self.main.refused() == 0;
            if counts { member.log_ratio + prior } else { f64::NEG_INFINITY }
        };
        let most = self.others.iter().zip(PRIOR).map(evidence).fold(0.0, f64::max);
        let mut sum = libm::exp(-most);
        for (member, prior) in self.others.iter_mut().zip(PRIOR) {
            member.weight = libm::exp(evidence((member, prior)) - most);
            sum += member.weight;
        }
        self.state = *self.main.state();
        for member in &mut self.others {
            member.weight /= sum;
        }
        for member in self.others.iter().filter(|member| member.runs) {
            for i in 0..VEHICLE_STATES {
                self.state[i] += member.weight * member.offset_from(&self.main, i);
            }
        }
        if self.state[PSI].abs() > PI {
            self.state[PSI] = wrap_angle(self.state[PSI]);
        }
    }

    /// The filters that run, the main one first.
    #[must_use]
    pub fn members(&self) -> [Option<BankMember<'_>>; MEMBERS] {
        let mut members = [const { None }; MEMBERS];
        let main = (true, BankMember { filter: &self.main, log_ratio: 0.0, log_prior: 0.0 });
        let others = self.others.iter().zip(PRIOR).map(|(member, log_prior)| {
            (member.runs, BankMember { filter: &member.filter, log_ratio: member.log_ratio, log_prior })
        });
        for (place, (runs, member)) in members.iter_mut().zip(core::iter::once(main).chain(others)) {
            *place = runs.then_some(member);
        }
        members
    }

    /// The main filter: the member that allows most, whose innovations decide which measurements are used. Its augmented
    /// states, its ship, its innovation monitor and its configuration stand for the whole bank. Its `state`, `covariance`
    /// and `current` are its own, not the mixture's: take these from the [`Navigator`].
    #[must_use]
    pub fn main(&self) -> &Filter {
        &self.main
    }

    /// Time of all filters, µs.
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.main.time_us()
    }

    /// Whether state and covariance mean anything: the main filter's do.
    #[must_use]
    pub fn is_initialised(&self) -> bool {
        self.main.is_initialised()
    }

    /// How the main filter failed, if it did; the bank then refuses everything until initialised again.
    #[must_use]
    pub fn failure(&self) -> Option<NavigationError> {
        self.main.failure()
    }

    /// The configuration as the main filter uses it.
    #[must_use]
    pub fn config(&self) -> &NavigationConfig {
        self.main.config()
    }

    /// By how much the main filter's prediction of a depth or a range differs from the mixture's; call it before the
    /// measurement is fused.
    #[must_use]
    pub fn mixture_offset(&self, measurement: &Measurement) -> MixtureOffset {
        let (main, x) = (&self.main, self.state());
        let more = |i, j| self.covariance(i, j) - main.propagated_covariance(i, j);
        match measurement {
            Measurement::Depth { .. } => MixtureOffset { predicted_m: main.state()[Z] - x[Z], variance_m2: more(Z, Z) },
            Measurement::Range { path: AcousticPath { ship: ShipEnd::Reported(ship), .. }, .. } => {
                let [north_m, east_m] = ship.position_m;
                let distance_m = |x: &VehicleState| libm::hypot(x[X] - north_m, x[Y] - east_m);
                let [n, e] = [x[X] - north_m, x[Y] - east_m].map(|d| d / distance_m(x).max(1.0));
                let variance_m2 = n * n * more(X, X) + 2.0 * n * e * more(X, Y) + e * e * more(Y, Y);
                MixtureOffset { predicted_m: distance_m(main.state()) - distance_m(x), variance_m2 }
            }
            _ => MixtureOffset::default(),
        }
    }

    /// Weights of the nominal filter and of the one whose current changes, 0 to 1; 0 without a bank.
    #[must_use]
    pub fn weights(&self) -> [f64; 2] {
        let [nominal, steady] = [NOMINAL, STEADY].map(|k| self.others[k].weight);
        if self.main.config().bank { [nominal, 1.0 - nominal - steady] } else { [0.0; 2] }
    }

    /// What the protection level sees of it.
    #[must_use]
    pub fn followed(&self) -> Followed<'_> {
        let config = self.config();
        let (sensors, ship_transducer_depth_m) = (&config.sensors, config.ship_transducer_depth_m);
        Followed { time_us: self.time_us(), state: &self.state, sensors, ship_transducer_depth_m }
    }

    /// What the protection level takes of a measurement that is about to be fused; `None`: nothing.
    #[must_use]
    pub fn aiding(&self, measurement: &Measurement) -> Option<Aiding> {
        match *measurement {
            Measurement::Depth { z_m } => Some(Aiding::Depth(z_m)),
            Measurement::VehicleGnss { position_m } => Some(Aiding::Fix(position_m)),
            Measurement::BottomTrack { velocity_mps } => Some(Aiding::BottomTrack(velocity_mps)),
            Measurement::Range { path, range_m } => self.ranged(&[path], range_m),
            // half of a round trip: the vehicle on the average of both ways
            Measurement::TwoWayRange { outward, back, range_m } => self.ranged(&[outward, back], range_m),
            _ => None,
        }
    }

    fn ranged(&self, paths: &[AcousticPath], range_m: f64) -> Option<Aiding> {
        let now = self.main.state();
        let share = 1.0 / paths.len() as f64;
        let mut since_m = [0.0; 2];
        let mut reported = None;
        for path in paths {
            let [north_m, east_m] = self.main.vehicle_end_m(&path.vehicle)?;
            reported = Some(self.main.ship_end(&path.ship)?);
            since_m = [since_m[0] + share * (now[X] - north_m), since_m[1] + share * (now[Y] - east_m)];
        }
        reported.map(|ship| Aiding::Range { since_m, ship, range_m })
    }

    /// Model, Jacobian and discretisation of one step of the main filter. For the cost table only.
    #[doc(hidden)]
    pub fn discretise(&mut self, step_s: f64, input: &ActuatorInput) {
        self.main.discretise(step_s, input);
    }

    /// State and covariance of the main filter over the step last discretised. For the cost table only.
    #[doc(hidden)]
    pub fn propagate(&mut self, step_s: f64) {
        self.main.propagate(step_s);
    }
}

/// The configuration of a member of the bank. Not inlined: each copy would take a kilobyte of stack.
#[inline(never)]
fn with_config<T>(k: usize, config: &NavigationConfig, adopt: impl FnOnce(&NavigationConfig) -> T) -> T {
    // in place, for the same reason
    let mut member = *config;
    match k {
        NOMINAL => (member.effect_states, member.noise_factor) = (EffectStates::NONE, [1.0; 6]),
        STEADY => member.effect_states.be_steady(),
        _ if config.bank => member.effect_states.add_tide(),
        _ => {}
    }
    adopt(&member)
}
