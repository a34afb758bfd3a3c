//! State that survives a reset, the app's side. The order at start: [`App::restore`], [`App::resume`].

use crate::app::App;
use crate::backseat::{Backseat, configure};
use crate::host::send;
use crate::inputs::installation::body_to_ned;
use crate::parameters::Settings;
use crate::storage::Asked;
use crate::store::{Coasted, Navigation, Response, RestartRecord, coast_m};
use crate::updates::Order;
use backseat_core::parameters::joint_check;
use backseat_core::state::{U, V, W, X, Y};
use backseat_wire::hostlink::{FromBoard, Images, KeptCrash, Refusal, ResetCause, Restart};

impl Backseat {
    /// Takes the set that a memory held; false when it is not valid as a whole and the old one stays.
    fn restore(&mut self, settings: &Settings) -> bool {
        // the set may come from a firmware with other rules
        let fits = joint_check(&settings.vehicle, Some(settings.control.cruise_speed_mps), &settings.learnt).is_ok();
        if !fits || !configure(settings, &mut self.estimator, &mut self.steering) {
            return false;
        }
        self.parameters.restore(settings);
        self.adaptation.restart();
        self.links.configure(&self.parameters.active().app);
        true
    }
}

impl App {
    /// The board has a memory for parameters, and this is the set found there, if any; false when
    /// the set is not valid as a whole and the defaults stay.
    pub fn restore(&mut self, found: Option<&Settings>) -> bool {
        self.backseat.storage.fitted();
        found.is_none_or(|settings| self.backseat.restore(settings))
    }

    /// The set that is to be stored, by the host's wish or because a dive has learnt, until [`Self::stored`]
    /// answers.
    #[must_use]
    pub fn to_store(&self) -> Option<&Settings> {
        self.backseat.storage.is_busy().then(|| self.backseat.parameters.active())
    }

    /// The set of [`Self::to_store`] is kept, or could not be.
    pub fn stored(&mut self, kept: bool) {
        match self.backseat.storage.done() {
            Some(Asked::Host) => {
                let answer = if kept { FromBoard::Done } else { FromBoard::Refused(Refusal::StoreFailed) };
                send(&mut self.host_out, &answer);
            }
            Some(Asked::Learning) => self.backseat.learning.stored(self.backseat.now_us(), kept),
            None => {}
        }
    }

    /// The board has two banks for images of the firmware, and this is what is in them: at start, and after each order.
    pub fn set_images(&mut self, images: Images) {
        self.backseat.updates.set_images(images);
    }

    /// What the board is to do with its images, until [`Self::updated`] answers.
    #[must_use]
    pub fn to_update(&self) -> Option<&Order> {
        self.backseat.updates.order()
    }

    /// The order of [`Self::to_update`] is carried out, or refused. After a commit the board sends what waits, and
    /// resets.
    pub fn updated(&mut self, outcome: Result<(), Refusal>, images: Images) {
        self.set_images(images);
        if self.backseat.updates.done() {
            send(&mut self.host_out, &outcome.map_or_else(FromBoard::Refused, |()| FromBoard::Done));
        }
    }

    /// Crashes before the one that [`Self::resume`] tells, which no card has got yet, the oldest first; before it.
    pub fn earlier_crashes(&mut self, crashes: &[KeptCrash]) {
        let kept = &mut self.backseat.host.earlier_crashes;
        kept.clear();
        // there are as many places as a board keeps
        let _ = kept.extend_from_slice(crashes);
    }

    /// After the start of a board that knows why it was reset. Unless it begins as new, the
    /// frontseat gets neutral fins and stop with the first step.
    pub fn resume(&mut self, restart: Restart, response: &Response) {
        let backseat = &mut self.backseat;
        backseat.host.last_restart.set(restart);
        backseat.host.tell_start(&mut self.host_out);
        match *response {
            Response::Fresh => return,
            Response::Resume { navigation, utc_us } => {
                backseat.unconfigured = backseat.storage.is_fitted() && backseat.parameters.is_default();
                backseat.estimator.resume(navigation);
                if let Some(utc_us) = utc_us {
                    backseat.clock.resume(utc_us);
                }
            }
            Response::Safe => backseat.modes.barred(restart.cause == ResetCause::Watchdog),
        }
        backseat.last_resort.abort();
        backseat.steering.release();
    }

    /// The record to keep after a step: the one before it, updated. `powered_us` is powered time.
    #[must_use]
    pub fn restart_record(&self, last: &RestartRecord, powered_us: u64) -> RestartRecord {
        let Backseat { estimator, clock, parameters, .. } = &self.backseat;
        let navigator = estimator.navigator();
        let known = navigator.is_initialised() && navigator.failure().is_none();
        let navigation = known.then(|| {
            let x = navigator.state();
            let through_water = body_to_ned(x, &[x[U], x[V], x[W]]);
            let current = navigator.current();
            Navigation {
                position_m: [x[X], x[Y]],
                sigma_m: estimator.stated_sigma_m(),
                velocity_mps: [through_water[0] + current[0], through_water[1] + current[1]],
                down_us: 0,
            }
        });
        // a second reset while the filter waits for its sensors loses nothing
        let now_us = self.backseat.now_us();
        let waiting = || {
            let resumed = estimator.resumed?;
            let Coasted { position_m, sigma_m, velocity_mps, .. } =
                resumed.coasted(now_us, coast_m(&parameters.active().vehicle));
            Some(Navigation { position_m, sigma_m, velocity_mps, down_us: 0 })
        };
        let navigation = navigation.or_else(waiting);
        let utc_us = clock.utc_us(now_us).filter(|_| clock.fine);
        let under_way = self.is_under_way() || self.backseat.steering.is_stopping();
        let (sequence, resets) = (last.sequence.wrapping_add(1), last.resets);
        RestartRecord { sequence, powered_us, under_way, resets, navigation, utc_us }
    }
}
