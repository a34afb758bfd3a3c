//! Which state stands where: vehicle 12 | effects | ship 6 | other vehicles 2 each | delayed states 6 each.

use crate::navigation::interface::effect_states::MAX_EFFECTS;
use crate::navigation::interface::measurement::CloneId;
use crate::state::VEHICLE_STATES;

/// Most augmented states that change the acceleration.
pub(crate) const PLANT_STATES: usize = 16;
/// Ship states [x y ψ ẋ ẏ ψ̇].
pub(crate) const SHIP_STATES: usize = 6;
/// States of one clone: the ship's six, or the vehicle's position and velocity over ground.
pub(crate) const CLONE_STATES: usize = 6;
/// States of another vehicle: how far north and east its statement is off.
pub(crate) const PEER_STATES: usize = 2;
/// Other vehicles at most: a team of six.
pub(crate) const PEERS: usize = 5;
/// Clones held at most.
pub(crate) const CLONES: usize = 2;
/// Most states at one time: 54. A filter that has the ship among its states has room for two other vehicles.
pub(crate) const N_MAX: usize = VEHICLE_STATES + MAX_EFFECTS + PEERS * PEER_STATES + CLONES * CLONE_STATES;
/// States behind the vehicle's.
pub(crate) const TAIL: usize = N_MAX - VEHICLE_STATES;
/// First effect state.
pub(crate) const EFFECTS: usize = VEHICLE_STATES;

/// Places inside the ship block and the ship clone.
pub(crate) const SHIP_VELOCITY: usize = 3;
/// Velocity inside the vehicle clone, behind the position.
pub(crate) const CLONE_VELOCITY: usize = 3;

/// Whose delayed state a clone is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CloneKind {
    Vehicle = 1, // an Option's None is zero
    Ship,
}

#[derive(Clone, Copy)]
struct Slot {
    kind: CloneKind,
    generation: u32,
    at: usize,
}

/// The blocks in use.
#[derive(Clone)]
pub(crate) struct Layout {
    effects: usize,
    current: bool,
    current_rate: bool,
    ship: bool,
    /// Modem addresses.
    peers: [Option<u8>; PEERS],
    slots: [Option<Slot>; CLONES],
    /// Number of clones ever taken; no reset clears it, so that an old id never becomes valid again.
    generation: u32,
}

impl Layout {
    pub(crate) const fn new() -> Self {
        Self {
            effects: 0,
            current: false,
            current_rate: false,
            ship: false,
            peers: [None; PEERS],
            slots: [None; CLONES],
            generation: 0,
        }
    }

    /// Vehicle and effects only; a current's two states are the first of these, its rates the next.
    pub(crate) fn reset(&mut self, effects: usize, current: bool, current_rate: bool) {
        self.effects = effects.min(MAX_EFFECTS);
        self.current = current && self.effects > 1;
        self.current_rate = self.current && current_rate && self.effects > 3;
        self.ship = false;
        self.peers = [None; PEERS];
        self.slots = [None; CLONES];
    }

    /// Number of states.
    pub(crate) fn len(&self) -> usize {
        let clones = self.slots.iter().flatten().count();
        (self.clones_begin() + clones * CLONE_STATES).min(N_MAX)
    }

    fn clones_begin(&self) -> usize {
        let peers = self.peers.iter().flatten().count();
        EFFECTS + self.effects + usize::from(self.ship) * SHIP_STATES + peers * PEER_STATES
    }

    /// Whether so many further states leave room for every clone.
    pub(crate) fn has_room(&self, count: usize) -> bool {
        self.clones_begin() + count + CLONES * CLONE_STATES <= N_MAX
    }

    /// Where the states of the vehicle with this modem address stand, if it has any.
    pub(crate) fn peer(&self, address: u8) -> Option<usize> {
        let place = self.peers.iter().position(|peer| *peer == Some(address))?;
        Some(self.ship_place() + usize::from(self.ship) * SHIP_STATES + place * PEER_STATES)
    }

    /// Makes room for the states of another vehicle, behind those that have some, and says where, if there is any.
    pub(crate) fn add_peer(&mut self, address: u8) -> Option<usize> {
        let at = self.clones_begin();
        let place = self.peers.iter().position(Option::is_none).filter(|_| self.has_room(PEER_STATES))?;
        *self.peers.get_mut(place)? = Some(address);
        self.shift_clones(|at| at + PEER_STATES);
        Some(at)
    }

    /// Whether there are delayed states.
    pub(crate) fn has_clones(&self) -> bool {
        self.slots.iter().any(Option::is_some)
    }

    /// Where the current's two states stand, if they are estimated.
    pub(crate) fn current(&self) -> Option<usize> {
        self.current.then_some(EFFECTS)
    }

    /// Where the rates of the current stand, if they are estimated.
    pub(crate) fn current_rate(&self) -> Option<usize> {
        self.current_rate.then_some(EFFECTS + 2)
    }

    /// Where the ship stands, if it is known.
    pub(crate) fn ship(&self) -> Option<usize> {
        self.ship.then_some(EFFECTS + self.effects)
    }

    /// Where the ship stands or would stand.
    pub(crate) fn ship_place(&self) -> usize {
        EFFECTS + self.effects
    }

    pub(crate) fn set_ship(&mut self, known: bool) {
        if known && !self.ship {
            self.shift_clones(|at| at + SHIP_STATES);
        } else if self.ship && !known {
            self.shift_clones(|at| at - SHIP_STATES);
        }
        self.ship = known;
    }

    fn shift_clones(&mut self, to: impl Fn(usize) -> usize) {
        for slot in self.slots.iter_mut().flatten() {
            slot.at = to(slot.at);
        }
    }

    /// Whether another clone fits.
    pub(crate) fn has_free_slot(&self) -> bool {
        self.slots.iter().any(Option::is_none)
    }

    /// Registers a clone whose states were appended at `at`.
    pub(crate) fn add_clone(&mut self, kind: CloneKind, at: usize) -> Option<CloneId> {
        let (index, slot) = self.slots.iter_mut().enumerate().find(|(_, slot)| slot.is_none())?;
        self.generation = self.generation.wrapping_add(1);
        *slot = Some(Slot { kind, generation: self.generation, at });
        Some(CloneId { slot: index as u8, generation: self.generation })
    }

    fn slot(&self, id: CloneId) -> Option<Slot> {
        self.slots.get(usize::from(id.slot)).copied().flatten().filter(|slot| slot.generation == id.generation)
    }

    /// Where a clone stands; `None` when it was dropped or is of the other kind.
    pub(crate) fn clone_at(&self, id: CloneId, kind: CloneKind) -> Option<usize> {
        self.slot(id).filter(|slot| slot.kind == kind).map(|slot| slot.at)
    }

    /// The first clone of one kind.
    pub(crate) fn any_clone(&self, kind: CloneKind) -> Option<CloneId> {
        let mut slots = self.slots.iter().enumerate();
        slots.find_map(|(index, slot)| {
            slot.filter(|slot| slot.kind == kind).map(|slot| CloneId { slot: index as u8, generation: slot.generation })
        })
    }

    /// Forgets a clone and says where its states stood; those behind it move up.
    pub(crate) fn remove_clone(&mut self, id: CloneId) -> Option<usize> {
        let at = self.slot(id)?.at;
        *self.slots.get_mut(usize::from(id.slot))? = None;
        self.shift_clones(|other| if other > at { other - CLONE_STATES } else { other });
        Some(at)
    }
}
