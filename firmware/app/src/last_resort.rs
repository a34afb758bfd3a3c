//! Last-resort hardware: when the abort line is active and the drop weight falls, and whether all of it is ready.
//!
//! Of what is not fitted nothing is asked, and nothing follows. The weight falls once the vehicle has dived in a
//! mission, or after one that was ended, for one of these reasons; the first three are confirmed by as many readings as
//! a parameter says:
//!
//! | reason | when |
//! |---|---|
//! | leak | the board's own detector or the frontseat's is wet |
//! | depth | deeper than the largest depth and a margin |
//! | supply | below its last level |
//! | no ascent | the mission was ended, and the vehicle has not come up for a while |
//!
//! At rest and at the surface it falls by command alone. What has fallen stays so until the operator lets the output
//! rest.

use crate::held::Held;
use crate::parameters::FittingSettings;
use backseat_wire::hostlink::{FittingReadings, FittingState, Fittings, ModeReason, ReleaseReason};

/// Readings hold for so many steps.
const FRESH_STEPS: u8 = 10;
/// Deeper the vehicle has dived, m ...
const DIVED_M: f64 = 1.0;
/// ... until it is shallower than this.
const SURFACED_M: f64 = 0.5;
/// Less is no ascent, m: waves and noise.
const ASCENT_M: f64 = 0.5;
/// No vehicle of this class has more, V.
const SUPPLY_MOST_V: f32 = 100.0;

/// What counts once so many readings have said so, and until as many have said otherwise.
#[derive(Clone, Copy, Debug)]
struct Confirmed {
    readings: u8,
    holds: bool,
}

impl Confirmed {
    const NO: Self = Self { readings: 0, holds: false };

    fn look(&mut self, is: bool, enough: u8) {
        self.readings = if is { self.readings.saturating_add(1).min(enough) } else { self.readings.saturating_sub(1) };
        self.holds = if self.holds { self.readings > 0 } else { self.readings >= enough };
    }
}

/// The vehicle in this step.
#[derive(Clone, Copy, Debug)]
pub struct LastResortFacts {
    pub now_us: u64,
    /// Of the pressure sensor while it is heard, else the filter's; `None` without either, m.
    pub depth_m: Option<f64>,
    /// The largest that is allowed, m.
    pub depth_max_m: f64,
    /// The frontseat reports a leak.
    pub frontseat_leak: bool,
    pub under_way: bool,
}

/// Readings, what they confirm, and what is commanded.
pub struct LastResort {
    readings: Held<FittingReadings>,
    /// They hold for so many steps.
    fresh: u8,
    leak: Confirmed,
    deep: Confirmed,
    supply_low: Confirmed,
    /// Of abort line and drop weight: the pin does not follow.
    stuck: [Confirmed; 2],
    /// The vehicle is under water, in a mission or after its end.
    dived: bool,
    /// A mission was ended that was to go on.
    aborts: bool,
    /// The least depth since then, m, and when it was reached, µs.
    ascent: Held<(f64, u64)>,
    released: Held<ReleaseReason>,
}

impl LastResort {
    pub const fn new() -> Self {
        Self {
            readings: Held::none(),
            fresh: 0,
            leak: Confirmed::NO,
            deep: Confirmed::NO,
            supply_low: Confirmed::NO,
            stuck: [Confirmed::NO; 2],
            dived: false,
            aborts: false,
            ascent: Held::none(),
            released: Held::none(),
        }
    }

    /// The hardware was read; its outputs as of [`Self::outputs`].
    pub fn read(&mut self, readings: FittingReadings, settings: &FittingSettings) {
        let pins = [readings.abort_line, readings.drop_weight];
        let outputs = self.outputs();
        for ((stuck, pin), wanted) in self.stuck.iter_mut().zip(pins).zip(outputs) {
            stuck.look(pin.is_some_and(|pin| pin != wanted), settings.readings);
        }
        let low = |volts: f32| f64::from(volts) < settings.supply_last_v;
        self.supply_low.look(settings.supply && readings.supply_v.is_some_and(low), settings.readings);
        self.readings.set(readings);
        self.fresh = FRESH_STEPS;
    }

    /// What is commanded: the abort line is active; the weight falls.
    pub fn outputs(&self) -> [bool; 2] {
        [self.aborts, self.released.get().is_some()]
    }

    fn readings(&self) -> FittingReadings {
        self.readings.get().copied().filter(|_| self.fresh > 0).unwrap_or_default()
    }

    /// The board's own detector is wet.
    fn is_wet(&self, settings: &FittingSettings) -> bool {
        settings.leak.is_fitted() && self.readings().leak == Some(true)
    }

    /// A leak is confirmed; without a detector of its own the frontseat's is no matter of the board's.
    pub fn leaks(&self, settings: &FittingSettings) -> bool {
        settings.leak.is_fitted() && self.leak.holds
    }

    /// The supply is below its last level.
    pub fn is_supply_low(&self) -> bool {
        self.supply_low.holds
    }

    /// Looks at a step, before its limits are judged.
    pub fn observe(&mut self, facts: &LastResortFacts, settings: &FittingSettings) {
        self.fresh = self.fresh.saturating_sub(1);
        let depth_m = facts.depth_m.unwrap_or(0.0);
        self.leak.look(facts.frontseat_leak || self.is_wet(settings), settings.readings);
        self.deep.look(depth_m > facts.depth_max_m + settings.depth_margin_m, settings.readings);
        if facts.depth_m.is_some() {
            let threshold_m = if self.dived { SURFACED_M } else { DIVED_M };
            self.dived = (facts.under_way || self.aborts) && depth_m > threshold_m;
        }
    }

    /// A mission was ended that was to go on: the vehicle is to rise.
    pub fn abort(&mut self) {
        self.aborts = true;
        self.ascent.clear();
    }

    /// The operator has stopped the vehicle or starts a mission.
    pub fn calm(&mut self) {
        (self.aborts, self.dived) = (false, false);
    }

    /// The operator's own command.
    pub fn command(&mut self, release: bool) {
        self.released.clear();
        if release {
            self.released.set(ReleaseReason::Commanded);
        }
    }

    /// Whether the weight has to fall, after the step's limits were judged.
    pub fn decide(&mut self, facts: &LastResortFacts, settings: &FittingSettings) {
        if !self.dived || !(facts.under_way || self.aborts) {
            return self.ascent.clear();
        }
        let reason = if self.leak.holds {
            ReleaseReason::Leak
        } else if self.deep.holds {
            ReleaseReason::TooDeep
        } else if self.supply_low.holds {
            ReleaseReason::SupplyLow
        } else if self.aborts && self.does_not_rise(facts, settings) {
            ReleaseReason::NoAscent
        } else {
            return;
        };
        if settings.drop_weight.is_fitted() && self.released.get().is_none() {
            self.released.set(reason);
        }
    }

    fn does_not_rise(&mut self, facts: &LastResortFacts, settings: &FittingSettings) -> bool {
        // without a depth it cannot be seen to rise
        let depth_m = facts.depth_m.unwrap_or(f64::INFINITY);
        let (least_m, since_us) = self.ascent.get().copied().unwrap_or((f64::INFINITY, facts.now_us));
        if depth_m < least_m - ASCENT_M || self.ascent.get().is_none() {
            self.ascent.set((depth_m, facts.now_us));
            return false;
        }
        let waited_s = facts.now_us.saturating_sub(since_us) as f64 * 1e-6;
        settings.no_ascent_s > 0.0 && waited_s >= settings.no_ascent_s
    }

    /// The test before a dive.
    ///
    /// # Errors
    /// What speaks against it.
    pub fn test(&self, settings: &FittingSettings) -> Result<(), ModeReason> {
        let [abort_line, states @ ..] = self.report(settings).states;
        // an abort line that is active since the last mission rests again with this one
        if abort_line == FittingState::Silent || abort_line == FittingState::Wrong {
            return Err(ModeReason::FittingFailed);
        }
        match states {
            [FittingState::NotFitted | FittingState::Ready, FittingState::Active, _] => Err(ModeReason::Leak),
            [FittingState::NotFitted | FittingState::Ready, _, FittingState::Active] => Err(ModeReason::SupplyLow),
            _ if states.iter().all(|state| matches!(state, FittingState::NotFitted | FittingState::Ready)) => Ok(()),
            _ => Err(ModeReason::FittingFailed),
        }
    }

    /// For the host.
    pub fn report(&self, settings: &FittingSettings) -> Fittings {
        let readings = self.readings();
        let state = |fitted: bool, read: bool, wrong: bool, active: bool| match (fitted, read) {
            (false, _) => FittingState::NotFitted,
            (true, false) => FittingState::Silent,
            (true, true) if wrong => FittingState::Wrong,
            (true, true) if active => FittingState::Active,
            (true, true) => FittingState::Ready,
        };
        let ([aborts, falls], [abort_stuck, drop_stuck]) = (self.outputs(), self.stuck.map(|stuck| stuck.holds));
        let supply_v = readings.supply_v.unwrap_or(0.0);
        let no_supply = !(0.0..SUPPLY_MOST_V).contains(&supply_v);
        Fittings {
            states: [
                state(settings.abort_line.is_fitted(), readings.abort_line.is_some(), abort_stuck, aborts),
                state(settings.drop_weight.is_fitted(), readings.drop_weight.is_some(), drop_stuck, falls),
                state(settings.leak.is_fitted(), readings.leak.is_some(), false, self.is_wet(settings)),
                state(settings.supply, readings.supply_v.is_some(), no_supply, self.supply_low.holds),
            ],
            supply_v,
            aborts,
            released: self.released.get().copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Fitted;

    const ALL: FittingSettings = FittingSettings {
        abort_line: Fitted::High,
        drop_weight: Fitted::High,
        leak: Fitted::Low,
        supply: true,
        readings: 5,
        supply_last_v: 20.0,
        no_ascent_s: 30.0,
        ..FittingSettings::NONE
    };
    const DRY: FittingReadings =
        FittingReadings { abort_line: Some(false), drop_weight: Some(false), leak: Some(false), supply_v: Some(24.0) };
    const AT_DEPTH: LastResortFacts =
        LastResortFacts { now_us: 0, depth_m: Some(10.0), depth_max_m: 100.0, frontseat_leak: false, under_way: true };

    /// So many steps; pins follow their commands.
    fn run(
        own: &mut LastResort,
        facts: LastResortFacts,
        inputs: FittingReadings,
        settings: &FittingSettings,
        steps: u64,
    ) {
        for step in 0..steps {
            let [abort_line, drop_weight] = own.outputs().map(Some);
            own.read(FittingReadings { abort_line, drop_weight, ..inputs }, settings);
            let facts = LastResortFacts { now_us: facts.now_us + 100_000 * step, ..facts };
            own.observe(&facts, settings);
            own.decide(&facts, settings);
        }
    }

    fn released(facts: LastResortFacts, inputs: FittingReadings, steps: u64, aborted: bool) -> Option<ReleaseReason> {
        let mut own = LastResort::new();
        run(&mut own, AT_DEPTH, DRY, &ALL, 20);
        if aborted {
            own.abort();
        }
        run(&mut own, facts, inputs, &ALL, steps);
        own.report(&ALL).released
    }

    #[test]
    fn each_reason_releases_the_weight_once_it_is_confirmed() {
        let wet = FittingReadings { leak: Some(true), ..DRY };
        let low = FittingReadings { supply_v: Some(19.0), ..DRY };
        let deep = LastResortFacts { depth_m: Some(200.0), ..AT_DEPTH };
        let frontseat = LastResortFacts { frontseat_leak: true, ..AT_DEPTH };
        let ended = LastResortFacts { under_way: false, ..AT_DEPTH };
        for (facts, inputs, aborted, steps, reason) in [
            (AT_DEPTH, wet, false, 5, ReleaseReason::Leak),
            (frontseat, DRY, false, 5, ReleaseReason::Leak),
            (deep, DRY, false, 5, ReleaseReason::TooDeep),
            (AT_DEPTH, low, false, 5, ReleaseReason::SupplyLow),
            (ended, DRY, true, 301, ReleaseReason::NoAscent),
        ] {
            assert_eq!(released(facts, inputs, steps - 1, aborted), None, "{reason:?}");
            assert_eq!(released(facts, inputs, steps, aborted), Some(reason));
        }
    }

    #[test]
    fn nothing_falls_on_deck_nor_where_nothing_is_fitted_nor_under_the_frontseat() {
        let wet = FittingReadings { leak: Some(true), supply_v: Some(3.0), ..DRY };
        let deck = LastResortFacts { depth_m: Some(0.2), under_way: false, ..AT_DEPTH };
        let frontseat = LastResortFacts { under_way: false, ..AT_DEPTH };
        let surface = LastResortFacts { depth_m: Some(0.3), ..AT_DEPTH };
        for facts in [deck, frontseat, surface] {
            let mut own = LastResort::new();
            run(&mut own, facts, wet, &ALL, 1000);
            assert_eq!(own.outputs(), [false; 2], "{facts:?}");
        }
        let mut own = LastResort::new();
        own.abort();
        run(&mut own, deck, wet, &ALL, 1000);
        assert_eq!(own.outputs(), [true, false], "an aborted vehicle on deck");
        let mut own = LastResort::new();
        run(&mut own, AT_DEPTH, wet, &FittingSettings::NONE, 1000);
        assert_eq!(own.report(&FittingSettings::NONE), Fittings { supply_v: 3.0, ..Fittings::default() });
        assert_eq!(own.test(&FittingSettings::NONE), Ok(()));
    }

    #[test]
    fn a_reading_now_and_then_is_no_leak_and_a_vehicle_that_rises_keeps_its_weight() {
        let mut own = LastResort::new();
        run(&mut own, AT_DEPTH, DRY, &ALL, 20);
        for step in 0..1000_u64 {
            let inputs = FittingReadings { leak: Some(step % 3 == 0), ..DRY };
            run(&mut own, LastResortFacts { now_us: step * 100_000, ..AT_DEPTH }, inputs, &ALL, 1);
        }
        own.abort();
        for step in 0..900_u64 {
            // a decimetre a second
            let depth_m = Some(10.0 - 0.01 * step as f64);
            let facts = LastResortFacts { now_us: step * 100_000, depth_m, under_way: false, ..AT_DEPTH };
            run(&mut own, facts, DRY, &ALL, 1);
        }
        assert_eq!(own.outputs(), [true, false]);
    }

    #[test]
    fn a_dive_begins_only_with_all_that_is_fitted() {
        let after = |inputs: FittingReadings| {
            let mut own = LastResort::new();
            for _ in 0..10 {
                own.read(inputs, &ALL);
                own.observe(&LastResortFacts { under_way: false, depth_m: Some(0.1), ..AT_DEPTH }, &ALL);
            }
            (own.test(&ALL), own.report(&ALL).states)
        };
        use FittingState::{Active, Ready, Silent, Wrong};
        for (inputs, test, states) in [
            (DRY, Ok(()), [Ready; 4]),
            (FittingReadings { leak: Some(true), ..DRY }, Err(ModeReason::Leak), [Ready, Ready, Active, Ready]),
            (FittingReadings { leak: None, ..DRY }, Err(ModeReason::FittingFailed), [Ready, Ready, Silent, Ready]),
            (
                FittingReadings { drop_weight: Some(true), ..DRY },
                Err(ModeReason::FittingFailed),
                [Ready, Wrong, Ready, Ready],
            ),
            (
                FittingReadings { supply_v: Some(19.9), ..DRY },
                Err(ModeReason::SupplyLow),
                [Ready, Ready, Ready, Active],
            ),
            (
                FittingReadings { supply_v: Some(f32::NAN), ..DRY },
                Err(ModeReason::FittingFailed),
                [Ready, Ready, Ready, Wrong],
            ),
        ] {
            assert_eq!(after(inputs), (test, states), "{inputs:?}");
        }
        let mut own = LastResort::new();
        run(&mut own, AT_DEPTH, DRY, &ALL, 1);
        assert_eq!(own.test(&ALL), Ok(()));
        own.command(true);
        run(&mut own, AT_DEPTH, DRY, &ALL, 1);
        assert_eq!(own.test(&ALL), Err(ModeReason::FittingFailed), "the weight is gone");
        own.command(false);
        run(&mut own, AT_DEPTH, DRY, &ALL, 2);
        assert_eq!(own.test(&ALL), Ok(()));
        for _ in 0..20 {
            own.observe(&AT_DEPTH, &ALL);
        }
        assert_eq!(own.report(&ALL).states, [Silent; 4], "no reading for a second");
    }
}
