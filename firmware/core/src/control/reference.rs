//! Reference trajectory of (5.1): the model, flown by the PD law along the mission beside the vehicle.
//!
//! It turns as the vehicle can turn, within its limits, so that a regulator about it has small errors at the corners
//! as well, and it gives the actuators that belong to each state.

use super::limits::Limiter;
use super::mission::{Mission, MissionError, MissionStatus, Progress};
use super::{LawContext, attitude_law};
use crate::dynamics::ActuatorInput;
use crate::state::{self, VehicleState};

/// Integration step, s: a seventh of the shortest time constant (roll, 5.3 rad/s and well damped) and far inside
/// the stability of the method.
const STEP_S: f64 = 0.05;
/// Most steps of one call; a longer gap is not made up.
const MAX_STEPS: u8 = 4;
/// Distance from the vehicle at which the reference starts again from it, m.
const MAX_DISTANCE_M: f64 = 10.0;

/// The reference vehicle.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceTrajectory {
    x: VehicleState,
    progress: Progress,
    limiter: Limiter,
}

impl ReferenceTrajectory {
    /// Not started.
    #[must_use]
    pub const fn new(limiter: Limiter) -> Self {
        Self {
            x: VehicleState::from_array_storage(nalgebra::ArrayStorage([[0.0; 12]])),
            progress: Progress::new(),
            limiter,
        }
    }

    /// Starts at the vehicle's state with its actuators.
    ///
    /// # Errors
    /// As [`Progress::start`].
    pub fn start(&mut self, mission: &Mission, x: &VehicleState, limiter: &Limiter) -> Result<(), MissionError> {
        self.x = *x;
        self.limiter = *limiter;
        self.progress.start(mission, [x[state::X], x[state::Y]])
    }

    /// x_ref and u_ref `dt_s` later; `None` once it has finished the mission.
    ///
    /// Costs at most four steps of RK4. Starts again from `vehicle` when it got more than 10 m away.
    pub fn step(
        &mut self,
        context: &LawContext<'_>,
        mission: &Mission,
        vehicle: &VehicleState,
        dt_s: f64,
    ) -> Option<(VehicleState, ActuatorInput)> {
        let distance = libm::hypot(self.x[state::X] - vehicle[state::X], self.x[state::Y] - vehicle[state::Y]);
        // Not `distance >`: a reference that is not finite starts again as well.
        if !(distance <= MAX_DISTANCE_M && self.x.iter().all(|x| x.is_finite())) {
            self.x = *vehicle;
        }
        let mut left_s = dt_s;
        for _ in 0..MAX_STEPS {
            let h = left_s.min(STEP_S);
            if h <= 0.0 {
                break;
            }
            left_s -= h;
            self.progress.update(mission, &self.x, context.config.turn_radius_m);
            let Some(segment) = self.progress.segment() else { break };
            let wanted = attitude_law(context, &self.x, segment);
            let input = self.limiter.apply(&wanted, h);
            self.x = advance(context, &self.x, &input, h);
        }
        matches!(self.progress.status(), MissionStatus::Leg(_)).then_some((self.x, *self.limiter.last()))
    }
}

/// One step of RK4 over ground.
fn advance(context: &LawContext<'_>, x: &VehicleState, input: &ActuatorInput, h: f64) -> VehicleState {
    let f = |x: &VehicleState| {
        let mut rate = context.model.derivative(x, input);
        rate[state::X] += context.current_ne_mps[0];
        rate[state::Y] += context.current_ne_mps[1];
        rate
    };
    let k1 = f(x);
    let k2 = f(&(x + k1 * (0.5 * h)));
    let k3 = f(&(x + k2 * (0.5 * h)));
    let k4 = f(&(x + k3 * h));
    x + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)
}
