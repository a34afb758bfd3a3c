//! Requests of the host and their answers.

use crate::backseat::Backseat;
use crate::host::{HOST_RING, send};
use crate::mission::to_wire;
use crate::parameters::{HelmUse, PARAMETER_SCHEMA};
use crate::ring::Ring;
use crate::safety;
use crate::storage::Asked;
use backseat_core::control::HelmCommand;
use backseat_wire::hostlink::{FromBoard, Refusal, ToBoard};
use backseat_wire::ship_state::Key;

/// Parameters stay unlocked this long, µs.
const UNLOCKED_US: u64 = 60_000_000;
/// The key comes within this time of its announcement, µs.
const KEY_US: u64 = 2_000_000;

/// Carries out one request; `Step` belongs to the clock and is no request, and what was signed has been opened.
pub fn answer(backseat: &mut Backseat, request: &ToBoard<'_>, trusted: bool, out: &mut Ring<HOST_RING>) {
    let now_us = backseat.now_us();
    let answer = match *request {
        ToBoard::Step(_) | ToBoard::Signed(_) => return,
        ToBoard::Hello => {
            let firmware = concat!("backseat ", env!("CARGO_PKG_VERSION"));
            FromBoard::Hello { firmware, parameter_schema: PARAMETER_SCHEMA, image: backseat.host.image() }
        }
        ToBoard::ParameterBegin => outcome(may_write(backseat).map(|()| backseat.parameters.begin())),
        ToBoard::ParameterSet { name, value } => {
            let engaged = backseat.steering.is_engaged();
            outcome(may_write(backseat).and_then(|()| backseat.parameters.set(name, value, engaged)))
        }
        ToBoard::ParameterCommit => outcome(may_write(backseat).and_then(|()| backseat.commit())),
        ToBoard::Unlock => {
            backseat.host.unlocked_us = now_us.saturating_add(UNLOCKED_US);
            FromBoard::Done
        }
        ToBoard::KeyBegin => {
            if trusted {
                backseat.host.key_us = now_us.saturating_add(KEY_US);
            }
            FromBoard::Key { set: backseat.parameters.active().app.acoustic_key.is_set() }
        }
        ToBoard::KeySet(key) => outcome(set_key(backseat, key)),
        ToBoard::ParameterGet { index } => match backseat.parameters.info(index) {
            Some(info) => FromBoard::Parameter(info),
            None => FromBoard::Refused(Refusal::UnknownParameter),
        },
        ToBoard::MissionBegin { count } => {
            let begun = begin_mission(backseat, count);
            outcome(note_refused_mission(backseat, begun))
        }
        ToBoard::MissionItem { index, ref waypoint } => {
            let taken = backseat.host.transfer.item(index, waypoint);
            outcome(note_refused_mission(backseat, taken))
        }
        ToBoard::MissionCommit => {
            let committed = commit_mission(backseat);
            outcome(note_refused_mission(backseat, committed))
        }
        ToBoard::MissionGet { index } => {
            let waypoints = backseat.steering.mission().waypoints();
            FromBoard::Mission {
                index,
                count: u16::try_from(waypoints.len()).unwrap_or(u16::MAX),
                waypoint: waypoints.get(usize::from(index)).map(to_wire),
            }
        }
        ToBoard::FenceCorner { index, count, corner_m } => {
            let taken = backseat.host.transfer.corner(index, count, corner_m);
            outcome(note_refused_mission(backseat, taken))
        }
        ToBoard::FenceGet { index } => {
            let corners_m = &backseat.fence.corners_m;
            FromBoard::Fence {
                index,
                count: u8::try_from(corners_m.len()).unwrap_or(u8::MAX),
                corner_m: corners_m.get(usize::from(index)).copied(),
            }
        }
        ToBoard::ChallengeGet => {
            FromBoard::Challenge { challenge: backseat.host.challenge, counter: backseat.host.counter }
        }
        ToBoard::MissionStart => outcome(start(backseat)),
        ToBoard::HealthGet => FromBoard::Health(backseat.link_health()),
        ToBoard::FinWiggle => outcome(wiggle(backseat)),
        ToBoard::MissionStop => {
            backseat.steering.stop();
            backseat.last_resort.calm();
            backseat.modes.stopped();
            FromBoard::Done
        }
        ToBoard::DropWeight { release } => outcome(drop_weight(backseat, release)),
        ToBoard::Helm { heading_rad, depth_m, speed_mps } => {
            outcome(steer(backseat, HelmCommand { heading_rad, depth_m, speed_mps }))
        }
        // answered when the board has written them
        ToBoard::ParameterStore => match store(backseat) {
            Ok(()) => return,
            Err(refusal) => FromBoard::Refused(refusal),
        },
        ToBoard::UpdateGet => match backseat.updates.images() {
            Some(&images) => FromBoard::Images(images),
            None => FromBoard::Refused(Refusal::NoStore),
        },
        ToBoard::UpdateBegin(_) | ToBoard::UpdateWrite { .. } | ToBoard::UpdateCommit | ToBoard::UpdateConfirm => {
            match update(backseat, request) {
                Ok(()) => return,
                Err(refusal) => FromBoard::Refused(refusal),
            }
        }
    };
    send(out, &answer);
    if matches!(request, ToBoard::Hello) {
        backseat.host.tell_start(out);
    }
}

impl Backseat {
    /// No mission is armed or under way, nothing is being stopped, tested or written to flash, and no resets wait for
    /// the operator.
    pub fn is_at_rest(&self) -> bool {
        self.is_still() && !self.modes.barred
    }

    /// The same, whatever waits for the operator.
    pub fn is_still(&self) -> bool {
        let steering = &self.steering;
        !(steering.is_engaged() || steering.is_stopping() || steering.is_wiggling() || self.writes_flash())
    }

    /// Parameters or an image.
    pub fn writes_flash(&self) -> bool {
        self.storage.is_busy() || self.updates.is_busy()
    }
}

fn outcome(outcome: Result<(), Refusal>) -> FromBoard<'static> {
    match outcome {
        Ok(()) => FromBoard::Done,
        Err(refusal) => FromBoard::Refused(refusal),
    }
}

/// Refuses writing under way and while a mission waits to begin, unless parameters were unlocked.
fn may_write(backseat: &Backseat) -> Result<(), Refusal> {
    let locked = backseat.steering.is_engaged() && backseat.now_us() >= backseat.host.unlocked_us;
    if locked { Err(Refusal::Locked) } else { Ok(()) }
}

/// No mission is under way or waits to begin.
fn at_rest(backseat: &Backseat) -> Result<(), Refusal> {
    if backseat.steering.is_engaged() { Err(Refusal::UnderWay) } else { Ok(()) }
}

fn set_key(backseat: &mut Backseat, key: Key) -> Result<(), Refusal> {
    at_rest(backseat)?;
    if !backseat.host.expects_key(backseat.now_us()) {
        return Err(Refusal::Sequence);
    }
    backseat.host.key_us = 0;
    backseat.parameters.set_key(key);
    Ok(())
}

/// Flash is never erased under way.
fn store(backseat: &mut Backseat) -> Result<(), Refusal> {
    at_rest(backseat)?;
    if backseat.steering.is_wiggling() {
        return Err(Refusal::NotReady);
    }
    backseat.storage.request(Asked::Host)
}

/// Has the board renew its firmware; answered when that is done. At rest alone: flash is written, and the last of it
/// resets the board.
#[inline(never)] // its bytes are not to stay on the stack
fn update(backseat: &mut Backseat, request: &ToBoard<'_>) -> Result<(), Refusal> {
    if backseat.steering.is_engaged() {
        return Err(Refusal::UnderWay);
    }
    if backseat.updates.images().is_none() {
        return Err(Refusal::NoStore);
    }
    if !backseat.is_still() {
        return Err(Refusal::NotReady);
    }
    backseat.updates.request(request)
}

fn commit_mission(backseat: &mut Backseat) -> Result<(), Refusal> {
    at_rest(backseat)?;
    let (mission, fence) = backseat.host.transfer.commit()?;
    safety::check_mission(mission, fence, &backseat.parameters.active().app.safety).map_err(Refusal::Unsafe)?;
    backseat.steering.set_mission(mission);
    backseat.fence.clone_from(fence);
    Ok(())
}

/// Opens a transfer. The operator wants another mission: at rest the stored one is forgotten, so that it is never flown
/// in the place of one that was refused or did not arrive.
fn begin_mission(backseat: &mut Backseat, count: u16) -> Result<(), Refusal> {
    if at_rest(backseat).is_ok() {
        backseat.steering.clear_mission();
        backseat.fence.clear();
        backseat.host.mission_refused.clear();
    }
    backseat.host.transfer.begin(count)
}

/// Remembers why there is no mission.
fn note_refused_mission(backseat: &mut Backseat, taken: Result<(), Refusal>) -> Result<(), Refusal> {
    if let Err(refusal) = taken {
        backseat.host.mission_refused.set(refusal);
    }
    taken
}

/// Moves the fins one after the other, unless a mission needs them.
fn wiggle(backseat: &mut Backseat) -> Result<(), Refusal> {
    at_rest(backseat)?;
    if backseat.writes_flash() {
        return Err(Refusal::NotReady);
    }
    backseat.steering.wiggle();
    Ok(())
}

/// Releases the weight, or lets its output rest again.
fn drop_weight(backseat: &mut Backseat, release: bool) -> Result<(), Refusal> {
    if !backseat.parameters.active().app.fittings.drop_weight.is_fitted() {
        return Err(Refusal::NotReady);
    }
    if !release {
        at_rest(backseat)?;
    }
    backseat.last_resort.command(release);
    backseat.drivers.news = true;
    Ok(())
}

/// The host steers instead of the leg that is flown.
fn steer(backseat: &mut Backseat, helm: HelmCommand) -> Result<(), Refusal> {
    let settings = &backseat.parameters.active().app;
    if settings.helm == HelmUse::Never || !backseat.steering.can_depart() {
        return Err(Refusal::NotPermitted);
    }
    if backseat.line().is_none() {
        return Err(Refusal::NotReady);
    }
    safety::check_helm(&helm, &settings.safety)?;
    backseat.steering.take_helm(helm, backseat.now_us());
    Ok(())
}

/// Arms the stored mission: it begins with the first step at which navigation is valid.
fn start(backseat: &mut Backseat) -> Result<(), Refusal> {
    if backseat.steering.under_way() {
        return Err(Refusal::UnderWay);
    }
    if backseat.updates.is_on_trial() {
        return Err(Refusal::OnTrial);
    }
    if backseat.steering.mission().waypoints().is_empty() {
        return Err(backseat.host.mission_refused.get().copied().unwrap_or(Refusal::Sequence));
    }
    backseat.safety.may_start(&backseat.observed()).map_err(Refusal::Unsafe)?;
    if !backseat.modes.may_arm() || backseat.writes_flash() || backseat.steering.is_wiggling() {
        return Err(Refusal::NotReady);
    }
    backseat.links.frontseat.forget_refusal();
    backseat.modes.started();
    backseat.last_resort.calm();
    backseat.steering.arm(backseat.now_us());
    Ok(())
}
