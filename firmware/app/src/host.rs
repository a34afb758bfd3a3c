//! Requests of the host link and their answers.

use crate::app::Backseat;
use crate::mission::to_wire;
use crate::parameters::PARAMETER_SCHEMA;
use crate::ring::Ring;
use crate::wiggle::Wiggle;
use backseat_core::control::mission::MissionStatus;
use backseat_wire::hostlink::{FromBoard, MAX_FRAME, Refusal, ToBoard, encode};
use backseat_wire::ship_state::Key;

/// Bytes that may wait for the host: some twenty steps of telemetry.
pub const HOST_RING: usize = 8192;

/// Parameters stay unlocked this long, µs.
const UNLOCKED_US: u64 = 60_000_000;
/// The key comes within this time of its announcement, µs.
const KEY_US: u64 = 2_000_000;

/// Queues one message to the host.
pub fn send(out: &mut Ring<HOST_RING>, message: &FromBoard<'_>) {
    let mut buffer = [0; MAX_FRAME];
    // every message fits a frame
    if let Ok(frame) = encode(message, &mut buffer) {
        out.push(frame);
    }
}

/// Where a request to store the parameters stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storing {
    /// The board has no memory for them.
    Never,
    /// Nothing to do.
    Idle,
    /// The board is to write them.
    Waiting,
    /// The board is to write an adopted vehicle; nobody waits for an answer.
    Adopted,
}

impl Backseat {
    /// Carries out one request; `Step` belongs to the clock and is no request.
    pub fn request(&mut self, request: &ToBoard<'_>, out: &mut Ring<HOST_RING>) {
        let answer = match *request {
            ToBoard::Step(_) => return,
            ToBoard::Hello => {
                let firmware = concat!("backseat ", env!("CARGO_PKG_VERSION"));
                FromBoard::Hello { firmware, parameter_schema: PARAMETER_SCHEMA }
            }
            ToBoard::ParameterBegin => answer(self.may_write().map(|()| self.parameters.begin())),
            ToBoard::ParameterSet { name, value } => {
                let under_way = self.under_way();
                answer(self.may_write().and_then(|()| self.parameters.set(name, value, under_way)))
            }
            ToBoard::ParameterCommit => answer(self.may_write().and_then(|()| self.commit())),
            ToBoard::Unlock => {
                self.unlocked_us = self.now_us().saturating_add(UNLOCKED_US);
                FromBoard::Done
            }
            ToBoard::KeyBegin => {
                self.key_us = self.now_us().saturating_add(KEY_US);
                FromBoard::Key { set: self.parameters.active().app.acoustic_key.is_set() }
            }
            ToBoard::KeySet(key) => answer(self.set_key(key)),
            ToBoard::ParameterGet { index } => match self.parameters.info(index) {
                Some(info) => FromBoard::Parameter(info),
                None => FromBoard::Refused(Refusal::UnknownParameter),
            },
            ToBoard::MissionBegin { count } => answer(self.transfer.begin(count)),
            ToBoard::MissionItem { index, ref waypoint } => answer(self.transfer.item(index, waypoint)),
            ToBoard::MissionCommit => answer(self.commit_mission()),
            ToBoard::MissionGet { index } => {
                let waypoints = self.controller.mission().waypoints();
                FromBoard::Mission {
                    index,
                    count: u16::try_from(waypoints.len()).unwrap_or(u16::MAX),
                    waypoint: waypoints.get(usize::from(index)).map(to_wire),
                }
            }
            ToBoard::MissionStart => answer(self.start()),
            ToBoard::HealthGet => FromBoard::Health(self.health()),
            ToBoard::FinWiggle => answer(self.wiggle()),
            ToBoard::AdoptionRevert => answer(self.revert_adoption()),
            ToBoard::MissionStop => {
                self.stop();
                FromBoard::Done
            }
            ToBoard::ParameterStore => match self.ask_store() {
                // answered when the board has written them
                Ok(()) => return,
                Err(refusal) => FromBoard::Refused(refusal),
            },
        };
        send(out, &answer);
        if let (ToBoard::Hello, Some(restart)) = (request, self.last_restart.get()) {
            send(out, &FromBoard::Restart(*restart));
        }
    }

    fn now_us(&self) -> u64 {
        self.last_step_us.unwrap_or(0)
    }

    /// Under way, and when a mission waits to begin, nothing is written by mistake.
    fn may_write(&self) -> Result<(), Refusal> {
        let locked = (self.under_way() || self.armed) && self.now_us() >= self.unlocked_us;
        if locked { Err(Refusal::Locked) } else { Ok(()) }
    }

    /// The key may be on its way: nothing that comes from the host is logged.
    pub fn expects_key(&self) -> bool {
        self.now_us() < self.key_us
    }

    fn set_key(&mut self, key: Key) -> Result<(), Refusal> {
        if self.under_way() || self.armed {
            return Err(Refusal::UnderWay);
        }
        if !self.expects_key() {
            return Err(Refusal::Sequence);
        }
        self.key_us = 0;
        self.parameters.set_key(key);
        Ok(())
    }

    /// Flash is never erased under way.
    fn ask_store(&mut self) -> Result<(), Refusal> {
        if self.under_way() || self.armed {
            return Err(Refusal::UnderWay);
        }
        if self.wiggle.get().is_some() {
            return Err(Refusal::NotReady);
        }
        if self.storing != Storing::Idle {
            return Err(Refusal::NoStore);
        }
        self.storing = Storing::Waiting;
        Ok(())
    }

    /// The board is writing, or about to.
    pub fn is_storing(&self) -> bool {
        matches!(self.storing, Storing::Waiting | Storing::Adopted)
    }

    /// A mission is being flown.
    pub fn under_way(&self) -> bool {
        matches!(self.controller.status(), MissionStatus::Leg(_))
    }

    /// Activates the staged parameters. When more than live ones changed, navigation starts again
    /// and waits for a fix.
    fn commit(&mut self) -> Result<(), Refusal> {
        let Self { parameters, estimator, controller, .. } = self;
        let mut rebuilt = false;
        parameters.commit(|settings, old, rebuild| {
            rebuilt = rebuild;
            let taken = !rebuild || super::app::configure(settings, estimator, controller);
            if !taken {
                // the old set was valid
                super::app::configure(old, estimator, controller);
            }
            taken
        })?;
        self.unconfigured = false;
        if rebuilt {
            // what came before may be in other units
            self.estimator.reset();
            self.adaptation.restart();
            self.reset_links();
        }
        Ok(())
    }

    fn commit_mission(&mut self) -> Result<(), Refusal> {
        if self.under_way() {
            return Err(Refusal::UnderWay);
        }
        self.controller.set_mission(self.transfer.commit()?);
        Ok(())
    }

    /// Shows the fins, unless they are needed; they come to rest by themselves.
    fn wiggle(&mut self) -> Result<(), Refusal> {
        if self.under_way() || self.armed {
            return Err(Refusal::UnderWay);
        }
        if self.is_storing() {
            return Err(Refusal::NotReady);
        }
        self.wiggle.set(Wiggle::default());
        Ok(())
    }

    /// Arms the stored mission: it begins with the first step at which navigation is valid.
    fn start(&mut self) -> Result<(), Refusal> {
        if self.under_way() {
            return Err(Refusal::UnderWay);
        }
        if self.controller.mission().waypoints().is_empty() {
            return Err(Refusal::Sequence);
        }
        if !self.modes.may_arm() || self.is_storing() || self.wiggle.get().is_some() {
            return Err(Refusal::NotReady);
        }
        self.frontseat.forget_refusal();
        self.modes.started();
        self.armed = true;
        Ok(())
    }
}

fn answer(outcome: Result<(), Refusal>) -> FromBoard<'static> {
    match outcome {
        Ok(()) => FromBoard::Done,
        Err(refusal) => FromBoard::Refused(refusal),
    }
}
