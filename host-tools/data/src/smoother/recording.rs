//! A filter that remembers how it came where it is.

use super::{Filtered, Step, Steps};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::{CloneError, CloneId, Fusions, InitialShip, Measurement, NavigationError, Navigator};
use std::ops::{Deref, DerefMut};

/// Calls between two copies of the filter: about a minute of a log.
const STRETCH: usize = 2_000;

/// A call that moves the filter. Inputs and measurements stand in lists of their own: most calls need neither.
#[derive(Clone, Copy, Debug)]
enum Call {
    /// To this time, µs, under the input of this place.
    Predict(u64, usize),
    Fuse(usize),
    CloneShip,
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
    #[must_use]
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

    /// A copy of the filter.
    #[must_use]
    pub fn clone_navigator(&self) -> Box<Navigator> {
        self.navigator.clone()
    }

    /// Number of stretches kept.
    pub(super) fn stretches(&self) -> usize {
        self.copies.len()
    }

    /// Filters one stretch again and returns its steps. What was refused the first time is refused again.
    pub(super) fn repeat(&self, stretch: usize) -> Steps {
        let mut navigator = self.copies[stretch].clone();
        let mut steps = Steps::default();
        for call in self.calls.iter().skip(stretch * STRETCH).take(STRETCH) {
            match *call {
                Call::Predict(to_us, input) => {
                    let _ = navigator.predict_observed(to_us, &self.inputs[input], &mut steps);
                }
                Call::Fuse(index) => {
                    navigator.fuse_observed(&self.measurements[index], &mut steps);
                }
                Call::CloneShip => {
                    let _ = navigator.clone_ship_observed(&mut steps);
                }
                Call::DropClone(id) => navigator.drop_clone_observed(id, &mut steps),
                Call::InitialiseShip(index) => {
                    let _ = navigator.initialise_ship_observed(&self.ships[index], &mut steps);
                }
                Call::Sample => steps.0.push(Step::Sample(Box::new(Filtered::of(&navigator)))),
            }
        }
        let next = self.copies.get(stretch + 1).unwrap_or(&self.navigator);
        debug_assert_eq!(navigator.digest(), next.digest(), "the second pass takes the steps of the first");
        steps
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
