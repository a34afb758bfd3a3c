//! Last-resort hardware: how it stands, and the release of the drop weight on the bench.

use super::line::{CheckLine, Verdict};
use crate::monitor::words;
use backseat_link::board::{Board, reason};
use backseat_wire::hostlink::{FittingState, Fittings};
use std::time::Duration;

/// The board takes a command with its next step; a release has moved by then.
const HELD: Duration = Duration::from_secs(2);

/// What is fitted and how it stands; what is not fitted is counted.
pub fn line(fittings: &Fittings) -> CheckLine {
    const WHAT: &str = "last resort";
    let of = |wanted: fn(FittingState) -> bool| {
        let named = Fittings::NAMES.into_iter().zip(fittings.states);
        named.filter(move |(_, state)| wanted(*state)).collect::<Vec<_>>()
    };
    let (fitted, missing) =
        (of(|state| state != FittingState::NotFitted), of(|state| state == FittingState::NotFitted));
    let mut found = vec![format!("{} of {} fitted", fitted.len(), fittings.states.len())];
    found.extend(fitted.iter().map(|(name, state)| match (*name, *state) {
        ("supply", FittingState::Ready | FittingState::Active) => {
            format!("{name} {}, {:.1} V", words::fitting(*state), fittings.supply_v)
        }
        _ => format!("{name} {}", words::fitting(*state)),
    }));
    if !missing.is_empty() {
        found.push(format!("not fitted: {}", missing.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")));
    }
    let verdict = match fitted.as_slice() {
        [] => Verdict::Note,
        all => Verdict::of(all.iter().all(|(_, state)| *state == FittingState::Ready)),
    };
    CheckLine::new(verdict, WHAT, found.join("; "))
}

/// Releases the weight, looks whether the pin follows, and lets the output rest again.
pub fn drop_weight(board: &mut Board) -> anyhow::Result<CheckLine> {
    const WHAT: &str = "drop weight";
    let mut seen = Vec::new();
    for release in [true, false] {
        if let Err(refusal) = board.drop_weight(release)? {
            return Ok(CheckLine::new(Verdict::Fail, WHAT, format!("refused: {}", reason(refusal))));
        }
        board.listen(HELD)?;
        let [_, state, ..] = board.health()?.fittings.states;
        seen.push(state);
    }
    let follows = seen == [FittingState::Active, FittingState::Ready];
    let found = format!("{}, then {}: did it fall?", words::fitting(seen[0]), words::fitting(seen[1]));
    Ok(CheckLine::new(Verdict::of(follows), WHAT, found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use FittingState::{Active, NotFitted, Ready, Silent, Wrong};

    #[test]
    fn what_is_not_fitted_is_counted_and_what_is_fitted_has_to_be_ready() {
        let none = "0 of 4 fitted; not fitted: abort line, drop weight, leak detector, supply";
        assert_eq!(line(&Fittings::default()), CheckLine::new(Verdict::Note, "last resort", none));
        for (states, verdict) in [
            ([NotFitted, Ready, Ready, NotFitted], Verdict::Pass),
            ([Ready; 4], Verdict::Pass),
            ([NotFitted, Ready, Active, NotFitted], Verdict::Fail),
            ([NotFitted, Wrong, Ready, NotFitted], Verdict::Fail),
            ([Silent, Ready, Ready, Ready], Verdict::Fail),
        ] {
            assert_eq!(line(&Fittings { states, ..Fittings::default() }).verdict, verdict, "{states:?}");
        }
    }
}
