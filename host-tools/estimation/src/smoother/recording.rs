//! A filter that remembers how it came where it is.

use super::{Filtered, Mark, Step, Steps, Stretch};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::{
    CloneError, CloneId, Evidence, Filter, Fusions, InitialShip, MEMBERS, Measurement, NavigationError, Navigator,
};
use std::ops::{Deref, DerefMut};

/// Calls between two copies of the filter: a minute or two of a log.
const STRETCH: usize = 4_000;

/// A call that moves the filter. Inputs and measurements stand in lists of their own: most calls need neither.
#[derive(Clone, Copy, Debug)]
enum Call {
    /// To this time, µs, under the input of this place.
    Predict(u64, usize),
    Fuse(usize),
    CloneShip,
    CloneVehicle,
    DropClone(CloneId),
    InitialiseShip(usize),
    /// The estimate of this time is to be smoothed.
    Sample,
}

/// A filter in use, and what it takes to repeat its way.
pub struct Recording {
    navigator: Box<Navigator>,
    /// Whether anything is kept.
    keeps: bool,
    calls: Vec<Call>,
    inputs: Vec<ActuatorInput>,
    measurements: Vec<Measurement>,
    ships: Vec<InitialShip>,
    /// The filter before every stretch of calls.
    copies: Vec<Box<Navigator>>,
}

impl Recording {
    /// A filter of which nothing is kept yet.
    pub fn new(navigator: Box<Navigator>) -> Self {
        Self {
            navigator,
            keeps: false,
            calls: Vec::new(),
            inputs: Vec::new(),
            measurements: Vec::new(),
            ships: Vec::new(),
            copies: Vec::new(),
        }
    }

    /// Keeps every call from now on.
    pub fn keep(&mut self) {
        self.keeps = true;
    }

    fn note(&mut self, call: impl FnOnce(&mut Self) -> Call) {
        if self.keeps {
            if self.calls.len().is_multiple_of(STRETCH) {
                self.copies.push(self.navigator.clone());
            }
            let call = call(self);
            self.calls.push(call);
        }
    }

    /// [`Navigator::predict`].
    ///
    /// # Errors
    /// As there.
    pub fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> Result<(), NavigationError> {
        self.note(|this| {
            if this.inputs.last() != Some(input) {
                this.inputs.push(*input);
            }
            Call::Predict(to_us, this.inputs.len() - 1)
        });
        self.navigator.predict(to_us, input)
    }

    /// [`Navigator::fuse`].
    pub fn fuse(&mut self, measurement: &Measurement) -> Fusions {
        self.note(|this| {
            this.measurements.push(*measurement);
            Call::Fuse(this.measurements.len() - 1)
        });
        self.navigator.fuse(measurement)
    }

    /// [`Navigator::clone_ship`].
    ///
    /// # Errors
    /// As there.
    pub fn clone_ship(&mut self) -> Result<CloneId, CloneError> {
        self.note(|_| Call::CloneShip);
        self.navigator.clone_ship()
    }

    /// [`Navigator::clone_vehicle`].
    ///
    /// # Errors
    /// As there.
    pub fn clone_vehicle(&mut self) -> Result<CloneId, CloneError> {
        self.note(|_| Call::CloneVehicle);
        self.navigator.clone_vehicle()
    }

    /// [`Navigator::drop_clone`].
    pub fn drop_clone(&mut self, id: CloneId) {
        self.note(|_| Call::DropClone(id));
        self.navigator.drop_clone(id);
    }

    /// [`Navigator::initialise_ship`].
    ///
    /// # Errors
    /// As there.
    pub fn initialise_ship(&mut self, ship: &InitialShip) -> Result<(), NavigationError> {
        self.note(|this| {
            this.ships.push(*ship);
            Call::InitialiseShip(this.ships.len() - 1)
        });
        self.navigator.initialise_ship(ship)
    }

    /// Marks the present time as one whose estimate is to be smoothed.
    pub fn sample(&mut self) {
        self.note(|_| Call::Sample);
    }

    /// Number of stretches kept.
    pub(super) fn stretches(&self) -> usize {
        self.copies.len()
    }

    /// Filters one stretch again, with every filter of the bank that runs all the way. What was refused the first time
    /// is refused again.
    pub(super) fn repeat(&self, stretch: usize) -> [Option<Stretch>; MEMBERS] {
        let before = self.copies[stretch].members();
        let after = self.copies.get(stretch + 1).unwrap_or(&self.navigator).members();
        // What the main filter made of every measurement that counts.
        let mut main = Vec::new();
        // The sensors that it refused, at every sample.
        let mut main_refused = Vec::new();
        std::array::from_fn(|k| {
            let (member, end) = (before[k].as_ref()?, after[k].as_ref()?);
            let mut filter = Box::new(member.filter.clone());
            let mut out = Stretch { steps: Steps::default(), log_prior: member.log_prior, evidence: Vec::new() };
            let (mut log_ratio, mut others) = (member.log_ratio, main.clone().into_iter());
            let mut refusals = main_refused.clone().into_iter();
            for call in self.calls.iter().skip(stretch * STRETCH).take(STRETCH) {
                match *call {
                    Call::Fuse(index) => {
                        let measurement = &self.measurements[index];
                        let fusions = filter.fuse(measurement, &mut out.steps);
                        let sensor = measurement.sensor();
                        if k == 0 && Evidence::counts(sensor) {
                            main.push(fusions);
                        } else if let Some(main) = Evidence::counts(sensor).then(|| others.next()).flatten()
                            && let Some(evidence) = Evidence::new(sensor, &fusions, &main)
                        {
                            log_ratio = evidence.beside(log_ratio);
                            out.evidence.push(Mark::Evidence(evidence));
                        }
                    }
                    Call::Sample => {
                        out.steps.0.push(Step::Sample(Box::new(Filtered::of(&filter))));
                        let refused = filter.refused();
                        if k == 0 {
                            main_refused.push(refused);
                        }
                        let counts = refused & !refusals.next().unwrap_or(refused) == 0;
                        out.evidence.push(Mark::Sample(if counts { log_ratio } else { f64::NEG_INFINITY }));
                    }
                    ref call => self.move_filter(call, &mut filter, &mut out.steps),
                }
            }
            debug_assert_eq!(filter.digest(), end.filter.digest(), "the second pass takes the steps of the first");
            Some(out)
        })
    }

    /// Repeats a call that is no fusion.
    fn move_filter(&self, call: &Call, filter: &mut Filter, steps: &mut Steps) {
        match *call {
            Call::Predict(to_us, input) => {
                let _ = filter.predict(to_us, &self.inputs[input], steps);
            }
            Call::CloneShip => {
                let _ = filter.clone_ship(steps);
            }
            Call::CloneVehicle => {
                let _ = filter.clone_vehicle(steps);
            }
            Call::DropClone(id) => filter.drop_clone(id, steps),
            Call::InitialiseShip(index) => {
                let _ = filter.initialise_ship(&self.ships[index], steps);
            }
            Call::Fuse(_) | Call::Sample => {}
        }
    }
}

impl Deref for Recording {
    type Target = Navigator;

    fn deref(&self) -> &Navigator {
        &self.navigator
    }
}

impl DerefMut for Recording {
    fn deref_mut(&mut self) -> &mut Navigator {
        &mut self.navigator
    }
}
