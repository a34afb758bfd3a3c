//! Carries out what follows from a cause that is named.

use super::Backseat;
use crate::consequences::{self, Change, WHOLE};
use crate::estimator::Estimator;
use crate::parameters::{NamingUse, Settings};
use crate::steering::Steering;
use backseat_core::control::trackline::Segment;
use backseat_core::dynamics::VehicleModel;
use backseat_core::navigation::naming::Named;
use backseat_wire::hostlink::{Mode, ModeReason};

impl Backseat {
    /// What follows from what is named.
    #[inline(never)]
    pub(super) fn draw_consequences(&mut self, now_us: u64) {
        let Self { estimator, consequences, parameters, steering, .. } = self;
        let settings = parameters.active();
        if !estimator.navigator().is_initialised() && consequences.is_used() {
            consequences.restart(now_us);
            return use_cause(None, settings, estimator, steering);
        }
        let Some(statement) = estimator.take_statement() else { return };
        consequences.told.set(statement);
        match consequences.judge(&statement, estimator.naming().gain(), settings.app.naming) {
            Some(Change::Take(named)) => {
                use_cause(Some(&named), settings, estimator, steering);
                estimator.judge_use_of(Some(&named));
            }
            Some(Change::Resize(named)) => use_cause(Some(&named), settings, estimator, steering),
            Some(Change::Drop) => {
                use_cause(None, settings, estimator, steering);
                estimator.judge_use_of(None);
            }
            None => {}
        }
    }

    /// The leg that may be departed from: one of the mission itself, with nominal navigation.
    pub fn line(&self) -> Option<(u16, Segment)> {
        let is_nominal = self.modes.present() == (Mode::Navigating, ModeReason::Nominal);
        self.steering.line().filter(|_| is_nominal && !self.steering.returning)
    }

    /// Departs from the leg: as the host steers, else to tell two causes apart.
    pub(super) fn depart(&mut self, now_us: u64) {
        let line = self.line();
        self.steering.hold_helm(now_us, line.is_some());
        self.separate(now_us, line.filter(|_| self.steering.helm().is_none()));
    }

    /// Asks the water which of two causes it is, and flies what was asked.
    #[inline(never)]
    fn separate(&mut self, now_us: u64, line: Option<(u16, Segment)>) {
        let Self { estimator, consequences, separation, parameters, steering, inputs, .. } = self;
        let settings = &parameters.active().app;
        let naming = estimator.naming();
        if let (Some((leg, segment)), true) = (&line, separation.may_ask(now_us, settings))
            && let Some(causes) = naming.undecided()
        {
            let (filter, x) = (estimator.navigator().nominal(), &estimator.output);
            let input = inputs.actuators.at(now_us);
            let gain = |manoeuvre| naming.expected_gain(manoeuvre, filter, x, input);
            separation.ask(now_us, (*leg, segment), x, settings.separate, causes, naming.log_odds(causes), gain);
        }
        let flown = separation.step(now_us, line.map(|(leg, _)| leg), |causes| naming.log_odds(causes));
        steering.set_aside(flown.aside);
        if flown.is_news
            && let Some(statement) = naming.statement()
        {
            consequences.told.set(statement);
        }
    }
}

/// Lets filter and controller use a cause, or none; the controller only as far as that is permitted.
#[inline(never)] // the model is not to stay on the stack under a step
fn use_cause(named: Option<&Named>, settings: &Settings, estimator: &mut Estimator, steering: &mut Steering) {
    let fins = named.and_then(consequences::fins_with);
    estimator.set_fins(&fins.unwrap_or(WHOLE));
    if settings.app.naming != NamingUse::All {
        return;
    }
    if fins.is_none() {
        let vehicle = named.and_then(|named| consequences::vehicle_with(named, settings));
        if let Some(model) = vehicle.or_else(|| VehicleModel::new(&settings.vehicle).ok()) {
            steering.set_model(&model);
        }
    }
    steering.set_fins(&fins.unwrap_or(WHOLE));
}
