//! The board's parameters: the list that the host reads and writes, and the set that is active.
//!
//! What the list reads and writes is [`Settings`], the typed set the app is built from. A set is
//! changed by a transaction of the host link: begin, stage values, commit. Until the commit
//! succeeds the old set stays active.

mod list;
mod settings;

pub use list::{PARAMETERS, Parameter, find};
pub use settings::{
    AhrsProtocol, AppSettings, AttitudeSource, ControlMode, DvlSource, Fitted, FittingSettings, HelmUse, NamingUse,
    Separate, Settings,
};

use crate::held::Held;
use backseat_core::navigation::Learnt;
use backseat_core::parameters::joint_check;
use backseat_wire::hostlink::{ParameterInfo, Refusal};
use backseat_wire::ship_state::Key;

/// Version of the parameter list: grows with every change of a name, unit, place or meaning. A board's log has the
/// values without their names.
pub const PARAMETER_SCHEMA: u16 = 14;

/// The active set and the one a transaction prepares.
#[derive(Clone, Debug)]
pub struct ParameterStore {
    /// The active set, unless it is the defaults.
    changed: Held<Settings>,
    staged: Held<Settings>,
}

impl ParameterStore {
    /// The defaults.
    #[must_use]
    pub const fn new() -> Self {
        Self { changed: Held::none(), staged: Held::none() }
    }

    /// The active set.
    #[must_use]
    pub fn active(&self) -> &Settings {
        self.changed.get().unwrap_or(&Settings::DEFAULT)
    }

    /// Whether nothing was ever restored or set.
    pub(crate) fn is_default(&self) -> bool {
        self.changed.get().is_none()
    }

    /// Makes a set the active one that was checked before.
    pub(crate) fn restore(&mut self, settings: &Settings) {
        self.changed.set(*settings);
        self.staged.clear();
    }

    /// The active set, for changing it.
    fn active_mut(&mut self) -> Option<&mut Settings> {
        if self.changed.get().is_none() {
            self.changed.set(Settings::DEFAULT);
        }
        self.changed.get_mut()
    }

    /// Takes the key of the acoustic payloads, into an open transaction as well.
    pub(crate) fn set_key(&mut self, key: Key) {
        if let Some(active) = self.active_mut() {
            active.app.acoustic_key = key;
        }
        if let Some(staged) = self.staged.get_mut() {
            staged.app.acoustic_key = key;
        }
    }

    /// Keeps what a dive has learnt, unless one of its numbers is not within its range. An open transaction gets it as
    /// well.
    pub(crate) fn learn(&mut self, learnt: &Learnt) -> bool {
        let Some(active) = self.active_mut() else { return false };
        let old = core::mem::replace(&mut active.learnt, *learnt);
        if !PARAMETERS.iter().all(|parameter| parameter.admits(parameter.get(active))) {
            active.learnt = old;
            return false;
        }
        if let Some(staged) = self.staged.get_mut().filter(|staged| staged.learnt == old) {
            staged.learnt = *learnt;
        }
        true
    }

    /// Starts a transaction from the active set; one that was open is forgotten.
    pub fn begin(&mut self) {
        self.staged.set(*self.active());
    }

    /// Stages one value; `engaged`: a mission runs or is armed.
    ///
    /// # Errors
    /// Why not; what was staged before stays staged.
    pub fn set(&mut self, name: &str, value: f64, engaged: bool) -> Result<(), Refusal> {
        if self.staged.get().is_none() {
            return Err(Refusal::Sequence);
        }
        let parameter = find(name).ok_or(Refusal::UnknownParameter)?;
        if engaged && !parameter.under_way.is_live() {
            return Err(Refusal::UnderWay);
        }
        if !parameter.admits(value) {
            return Err(Refusal::OutOfRange);
        }
        if engaged {
            parameter.may_become(parameter.get(self.active()), value)?;
        }
        if let Some(staged) = self.staged.get_mut() {
            parameter.set(staged, value);
        }
        Ok(())
    }

    /// Activates the staged set if its numbers go together and `apply` takes it: the staged set, the active one, and
    /// whether anything but live parameters changed. When it refuses, the old set stays. What was learnt of a vehicle
    /// is forgotten when another one is declared and nothing is said of it. `engaged`: a mission runs or is armed,
    /// which it may not have been when a value was staged.
    ///
    /// # Errors
    /// [`Refusal::Sequence`] without a transaction, [`Refusal::UnderWay`] and [`Refusal::Relaxes`] when engaged,
    /// [`Refusal::Inconsistent`] by [`joint_check`], [`Refusal::InvalidSet`] by `apply`.
    pub fn commit(
        &mut self,
        engaged: bool,
        apply: impl FnOnce(&Settings, &Settings, bool) -> bool,
    ) -> Result<(), Refusal> {
        let active = self.changed.get().unwrap_or(&Settings::DEFAULT);
        let staged = self.staged.get_mut().ok_or(Refusal::Sequence)?;
        if is_another_vehicle(staged, active) && staged.learnt == active.learnt {
            staged.learnt = Learnt::NONE;
        }
        if engaged {
            let refused = PARAMETERS.iter().find_map(|p| p.may_become(p.get(active), p.get(staged)).err());
            if let Some(refusal) = refused {
                self.staged.clear();
                return Err(refusal);
            }
        }
        if let Err(inconsistent) = joint_check(&staged.vehicle, Some(staged.control.cruise_speed_mps), &staged.learnt) {
            self.staged.clear();
            return Err(Refusal::Inconsistent { rule: inconsistent.rule() });
        }
        let rebuild = PARAMETERS.iter().any(|p| !p.under_way.is_live() && p.get(staged) != p.get(active));
        let taken = apply(staged, active, rebuild);
        if taken {
            core::mem::swap(&mut self.changed, &mut self.staged);
        }
        self.staged.clear();
        if taken { Ok(()) } else { Err(Refusal::InvalidSet) }
    }

    /// One parameter as the host link shows it.
    #[must_use]
    pub fn info(&self, index: u16) -> Option<ParameterInfo<'static>> {
        let parameter = PARAMETERS.get(usize::from(index))?;
        Some(ParameterInfo {
            index,
            count: u16::try_from(PARAMETERS.len()).unwrap_or(u16::MAX),
            name: parameter.name,
            unit: parameter.unit,
            value: parameter.get(self.active()),
            min: parameter.min,
            max: parameter.max,
            default: parameter.default(),
        })
    }
}

/// Whether what was learnt with one set means something else in the other.
fn is_another_vehicle(one: &Settings, other: &Settings) -> bool {
    one.vehicle != other.vehicle
        || one.navigation.effects != other.navigation.effects
        || one.app.installation.ahrs_turn_rad != other.app.installation.ahrs_turn_rad
        || one.app.servo != other.app.servo
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_round_trips_and_stays_itself() {
        for (i, parameter) in PARAMETERS.iter().enumerate() {
            assert!(parameter.min <= parameter.max, "{}", parameter.name);
            assert!(parameter.admits(parameter.default()), "{}: {}", parameter.name, parameter.default());
            assert!(!parameter.help.is_empty() && !parameter.unit.is_empty());
            assert!(PARAMETERS.iter().skip(i + 1).all(|other| other.name != parameter.name), "{}", parameter.name);
            for value in [parameter.min, parameter.max] {
                let mut settings = Settings::DEFAULT;
                parameter.set(&mut settings, value);
                assert_eq!(parameter.get(&settings), value, "{}", parameter.name);
                for other in PARAMETERS.iter().filter(|other| other.name != parameter.name) {
                    assert_eq!(other.get(&settings), other.default(), "{} moves {}", parameter.name, other.name);
                }
            }
        }
    }

    #[test]
    fn a_transaction_is_all_or_nothing() {
        let mut store = ParameterStore::new();
        assert_eq!(store.set("vehicle.mass_kg", 40.0, false), Err(Refusal::Sequence));
        assert_eq!(store.commit(false, |_, _, _| true), Err(Refusal::Sequence));
        store.begin();
        assert_eq!(store.set("vehicle.mass_kg", 40.0, false), Ok(()));
        assert_eq!(store.set("vehicle.mass", 40.0, false), Err(Refusal::UnknownParameter));
        for absurd in [-1.0, 1e9, f64::NAN, f64::INFINITY] {
            assert_eq!(store.set("vehicle.mass_kg", absurd, false), Err(Refusal::OutOfRange));
        }
        assert_eq!(store.set("app.use_range", 0.5, false), Err(Refusal::OutOfRange));
        // a broken transfer: the next one begins without a commit
        assert_eq!(store.active().vehicle.mass_kg, 38.0);
        store.begin();
        assert_eq!(store.set("vehicle.displaced_mass_kg", 38.2, false), Ok(()));
        assert_eq!(store.commit(false, |_, _, rebuild| rebuild), Ok(()));
        assert_eq!((store.active().vehicle.mass_kg, store.active().vehicle.displaced_mass_kg), (38.0, 38.2));
        store.begin();
        assert_eq!(store.set("vehicle.mass_kg", 40.0, false), Ok(()));
        assert_eq!(store.commit(false, |_, _, _| false), Err(Refusal::InvalidSet));
        assert_eq!(store.active().vehicle.mass_kg, 38.0);
        store.begin();
        assert_eq!(store.set("vehicle.b_cb_to_cg_m[2]", -0.01, false), Ok(()));
        assert!(matches!(store.commit(false, |_, _, _| true), Err(Refusal::Inconsistent { .. })));
        assert_eq!(store.commit(false, |_, _, _| true), Err(Refusal::Sequence));
    }

    #[test]
    fn under_way_only_what_is_safe() {
        let mut store = ParameterStore::new();
        store.begin();
        assert_eq!(store.set("vehicle.mass_kg", 39.0, true), Err(Refusal::UnderWay));
        assert_eq!(store.set("installation.sound_speed_mps", 1480.0, true), Ok(()));
        assert_eq!(store.commit(false, |_, _, rebuild| !rebuild), Ok(()));
        assert_eq!(store.active().app.installation.sound_speed_mps, 1480.0);
    }

    #[test]
    fn info_lists_all() {
        let store = ParameterStore::new();
        let count = u16::try_from(PARAMETERS.len()).unwrap();
        assert_eq!(store.info(count), None);
        let last = store.info(count - 1).unwrap();
        assert_eq!((last.count, last.value), (count, last.default));
    }
}
