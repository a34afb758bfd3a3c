//! What follows from a cause that the board names: whether it enters the filter and the controller, and when it is taken
//! out again.
//!
//! A cause is used once it is stated with a probability of [`SURE`], alone or with another beside it, and the operator
//! permits it. It stays in use for as long as it is stated and has predicted better: what the nominal filter's innovations
//! say of it is summed from the decision on, and if after [`TRIAL_US`] they are not better explained with it than without,
//! it is taken out and not used again in this dive. One cause is used at a time, the first that can be.

use crate::held::Held;
use crate::parameters::{NamingUse, Settings};
use backseat_core::dynamics::{FINS, VehicleModel};
use backseat_core::navigation::naming::{Cause, Named, Statement};
use backseat_wire::hostlink::{Decision, DecisionReason, UsedFor};

/// Least probability of a cause that is used.
pub const SURE: f64 = 0.9;
/// Its size is known well enough so long after it began, µs.
const SETTLED_US: u64 = 180_000_000;
/// A cause has to have predicted better for so long after the decision, µs: ten minutes.
const TRIAL_US: u64 = 600_000_000;
/// Its size is taken anew when it has changed by this share of itself.
const RESIZED: f64 = 0.2;
/// A fin is used as lost only from this share on: less is within what the filter's own states hold.
const LEAST_LOST: f64 = 0.2;

/// A cause in use.
#[derive(Clone, Copy)]
struct Used {
    cause: Cause,
    size: [f64; 2],
    since_us: u64,
}

/// What is to be done.
pub enum Change {
    /// Use it from now on.
    Take(Named),
    /// It is another size.
    Resize(Named),
    /// Use none.
    Drop,
}

/// Decides, and remembers what was decided.
pub struct Consequences {
    used: Held<Used>,
    /// Causes that have not predicted better, by their numbers.
    refused: u32,
    decision: Held<Decision>,
    /// What is named, until it is reported.
    pub told: Held<Statement>,
}

impl Consequences {
    pub const fn new() -> Self {
        Self { used: Held::none(), refused: 0, decision: Held::none(), told: Held::none() }
    }

    /// The last decision.
    pub fn decision(&self) -> Option<Decision> {
        self.decision.get().copied()
    }

    /// Something is used.
    pub fn is_used(&self) -> bool {
        self.used.get().is_some()
    }

    /// The filter has started again, with the vehicle as declared.
    pub fn restart(&mut self, time_us: u64) {
        if let Some(used) = self.used.take() {
            self.decide(time_us, used.cause, used.size, UsedFor::Nothing, DecisionReason::Restarted, 0.0);
        }
    }

    /// What follows from a statement; `gain`: by how much the cause in use has predicted better since the decision, ln
    /// of the likelihood ratio.
    pub fn judge(&mut self, statement: &Statement, gain: Option<f64>, permitted: NamingUse) -> Option<Change> {
        let time_us = statement.time_us;
        let can = |named: &&Named| {
            let refused = self.refused >> u32::from(named.cause.number()) & 1 != 0;
            let is_settled = time_us.saturating_sub(named.since_us) >= SETTLED_US;
            is_usable(named, permitted) && is_sure(named) && is_settled && !statement.unexplained && !refused
        };
        let Some(used) = self.used.get().copied() else {
            let named = *statement.named.iter().flatten().find(can)?;
            return Some(self.take(time_us, &named, permitted));
        };
        let gain = gain.unwrap_or(0.0);
        // of a fin it may turn out that it stands rather than being lost: it is broken all the same
        let of_the_same = |named: &&Named| named.cause.is_of_the_same(used.cause);
        let Some(named) = statement.named.iter().flatten().find(of_the_same) else {
            return Some(self.drop(time_us, &used, DecisionReason::NotNamed, gain));
        };
        if time_us.saturating_sub(used.since_us) >= TRIAL_US && gain <= 0.0 {
            self.refused |= 1 << u32::from(used.cause.number());
            return Some(self.drop(time_us, &used, DecisionReason::NotBetter, gain));
        }
        if named.cause != used.cause {
            return can(&named).then(|| self.take(time_us, named, permitted));
        }
        let [before, now] = [used.size[0], named.size[0]];
        if (now - before).abs() <= RESIZED * before.abs() {
            return None;
        }
        self.used.set(Used { size: named.size, ..used });
        self.decide(time_us, named.cause, named.size, permitted.used_for(), DecisionReason::Resized, gain);
        Some(Change::Resize(*named))
    }

    fn take(&mut self, time_us: u64, named: &Named, permitted: NamingUse) -> Change {
        self.used.set(Used { cause: named.cause, size: named.size, since_us: time_us });
        self.decide(time_us, named.cause, named.size, permitted.used_for(), DecisionReason::Sure, 0.0);
        Change::Take(*named)
    }

    fn drop(&mut self, time_us: u64, used: &Used, reason: DecisionReason, gain: f64) -> Change {
        self.used.clear();
        self.decide(time_us, used.cause, used.size, UsedFor::Nothing, reason, gain);
        Change::Drop
    }

    fn decide(
        &mut self,
        time_us: u64,
        cause: Cause,
        size: [f64; 2],
        used_for: UsedFor,
        reason: DecisionReason,
        gain: f64,
    ) {
        let size = size.map(|size| size as f32);
        let cause = cause.number();
        self.decision.set(Decision { time_us, cause, size, used_for, reason, gain: gain as f32 });
    }
}

/// It is sure, or only in which way its fin is broken is not.
fn is_sure(named: &Named) -> bool {
    named.probability >= SURE || named.rival.is_some_and(|rival| rival.is_of_the_same(named.cause))
}

impl NamingUse {
    /// What a cause that is sure is used for.
    pub const fn used_for(self) -> UsedFor {
        match self {
            Self::Off | Self::Name => UsedFor::Nothing,
            Self::Navigate => UsedFor::Navigation,
            Self::All => UsedFor::NavigationAndControl,
        }
    }
}

/// The filter takes broken fins: what is left open of the rest it estimates itself. The controller takes what changes
/// its trim and its propeller too.
fn is_usable(named: &Named, permitted: NamingUse) -> bool {
    match named.cause {
        Cause::FinLost(_) => permitted.used_for() != UsedFor::Nothing && named.size[0] >= LEAST_LOST,
        Cause::FinStuck(_) => permitted.used_for() != UsedFor::Nothing,
        Cause::ThrustLost | Cause::DragGrown | Cause::WeightChanged | Cause::TrimAhead => permitted == NamingUse::All,
        _ => false,
    }
}

/// Shares of lift and drag that fins have, and angles at which they stand, rad.
pub type Fins = ([f64; FINS], [Option<f64>; FINS]);

/// Fins that are whole.
pub const WHOLE: Fins = ([1.0; FINS], [None; FINS]);

/// The fins with a cause; `None`: it is not of fins.
pub fn fins_with(named: &Named) -> Option<Fins> {
    let (mut shares, mut stands_rad) = WHOLE;
    let fin = named.cause.fin()?;
    match named.cause {
        Cause::FinLost(_) => *shares.get_mut(fin)? = (1.0 - named.size[0]).clamp(0.0, 1.0),
        Cause::FinStuck(_) => *stands_rad.get_mut(fin)? = Some(named.size[0]),
        _ => return None,
    }
    Some((shares, stands_rad))
}

/// The vehicle with a cause, for trim and propeller; its fins apart.
pub fn vehicle_with(named: &Named, settings: &Settings) -> Option<VehicleModel> {
    let mut vehicle = settings.vehicle;
    let [size, beside] = named.size;
    // centre of buoyancy to centre of gravity: what moves the weight ahead moves it
    let mut ahead = |moment_kg_m: f64| {
        let [x, ..] = &mut vehicle.b_cb_to_cg_m;
        *x += moment_kg_m / vehicle.displaced_mass_kg;
    };
    match named.cause {
        Cause::ThrustLost => {
            vehicle.beta5_n_s2_per_rad2 *= 1.0 - size;
            vehicle.advance_n_s2_per_rad_m *= 1.0 - size;
        }
        Cause::DragGrown => {
            let [surge, ..] = &mut vehicle.quadratic_diag;
            *surge *= 1.0 + size;
        }
        Cause::WeightChanged => {
            ahead(beside);
            vehicle.mass_kg += size;
        }
        Cause::TrimAhead => ahead(size),
        _ => return None,
    }
    VehicleModel::new(&vehicle).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(cause: Cause, size: f64, probability: f64) -> Named {
        Named { cause, size: [size, 0.0], sigma: [0.05; 2], since_us: 0, probability, rival: None }
    }

    fn told(minutes: u64, named: Option<Named>) -> Statement {
        Statement { time_us: minutes * 60_000_000, named: [named, None], unexplained: false }
    }

    #[test]
    fn what_is_sure_and_permitted_is_used_and_taken_back_when_it_predicts_no_better() {
        let fin = named(Cause::FinLost(1), 0.8, 0.95);
        for permitted in [NamingUse::Off, NamingUse::Name] {
            assert!(Consequences::new().judge(&told(10, Some(fin)), None, permitted).is_none());
        }
        let mut own = Consequences::new();
        let unsure = Named { probability: 0.89, ..fin };
        assert!(own.judge(&told(10, Some(unsure)), None, NamingUse::All).is_none());
        assert!(own.judge(&told(2, Some(fin)), None, NamingUse::All).is_none(), "its size is not known yet");
        let open = Statement { unexplained: true, ..told(10, Some(fin)) };
        assert!(own.judge(&open, None, NamingUse::All).is_none());
        assert!(
            matches!(own.judge(&told(11, Some(fin)), None, NamingUse::All), Some(Change::Take(taken)) if taken == fin)
        );
        let decision = own.decision().unwrap();
        assert_eq!((decision.used_for, decision.reason), (UsedFor::NavigationAndControl, DecisionReason::Sure));
        // worse within the trial, another size, and no better after it
        assert!(own.judge(&told(15, Some(fin)), Some(-5.0), NamingUse::All).is_none());
        let more = named(Cause::FinLost(1), 1.0, 0.95);
        assert!(matches!(own.judge(&told(16, Some(more)), Some(1.0), NamingUse::All), Some(Change::Resize(_))));
        assert!(own.judge(&told(20, Some(more)), Some(3.0), NamingUse::All).is_none());
        assert!(matches!(own.judge(&told(21, Some(more)), Some(0.0), NamingUse::All), Some(Change::Drop)));
        assert_eq!(own.decision().unwrap().reason, DecisionReason::NotBetter);
        assert!(own.judge(&told(22, Some(more)), None, NamingUse::All).is_none(), "not again");
        let other = named(Cause::FinStuck(1), 0.02, 1.0);
        assert!(own.judge(&told(23, Some(other)), None, NamingUse::Navigate).is_some() && own.is_used());
        // none of these, the nearest still of that fin; and then it is lost, as far as can be told
        let open = Statement { unexplained: true, ..told(24, Some(named(Cause::FinLost(1), 0.9, 1.0))) };
        assert!(own.judge(&open, Some(1.0), NamingUse::Navigate).is_none());
        assert!(matches!(own.judge(&told(24, None), Some(9.0), NamingUse::Navigate), Some(Change::Drop)));
        assert_eq!(own.decision().unwrap().reason, DecisionReason::NotNamed);
    }

    #[test]
    fn the_controller_alone_takes_thrust_and_weight() {
        let settings = Settings::DEFAULT;
        let thrust = named(Cause::ThrustLost, 0.2, 1.0);
        assert!(Consequences::new().judge(&told(9, Some(thrust)), None, NamingUse::Navigate).is_none());
        assert!(Consequences::new().judge(&told(9, Some(thrust)), None, NamingUse::All).is_some());
        let beta5 = vehicle_with(&thrust, &settings).unwrap().parameters().beta5_n_s2_per_rad2;
        assert!((beta5 / settings.vehicle.beta5_n_s2_per_rad2 - 0.8).abs() < 1e-12);
        let flooded = Named { size: [0.1, 0.05], ..named(Cause::WeightChanged, 0.0, 1.0) };
        let heavy = *vehicle_with(&flooded, &settings).unwrap().parameters();
        assert!((heavy.mass_kg - settings.vehicle.mass_kg - 0.1).abs() < 1e-12);
        let moved = heavy.b_cb_to_cg_m[0] - settings.vehicle.b_cb_to_cg_m[0];
        assert!((moved * heavy.displaced_mass_kg - 0.05).abs() < 1e-12);
        assert_eq!(fins_with(&thrust), None);
        assert_eq!(fins_with(&named(Cause::FinLost(2), 0.75, 1.0)), Some(([1.0, 1.0, 0.25, 1.0], [None; 4])));
        let standing = ([1.0; 4], [Some(-0.03), None, None, None]);
        assert_eq!(fins_with(&named(Cause::FinStuck(0), -0.03, 1.0)), Some(standing));
    }
}
