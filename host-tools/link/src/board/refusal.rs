//! Refusals in words.

use backseat_core::parameters::Inconsistent;
use backseat_wire::hostlink::Refusal;

/// Why the board does not do it.
#[must_use]
pub fn reason(refusal: Refusal) -> String {
    let text = match refusal {
        Refusal::UnknownParameter => "it has no such parameter",
        Refusal::OutOfRange => "a number is outside its range",
        Refusal::Sequence => "items arrived out of order, there are too many, or some are missing",
        Refusal::UnderWay => "a mission runs or is armed; stop it first (backseat mission stop)",
        Refusal::InvalidSet => "the filter or the controller cannot be built from these numbers",
        Refusal::NotReady => "not now: navigation is lost, parameters are being stored, or the fins are being tested",
        Refusal::NoStore => "it has no flash for parameters, or is still writing them",
        Refusal::Locked => "a mission runs or is armed; --unlock admits the parameters that may change under way",
        Refusal::StoreFailed => "writing its flash failed; the set stored before is still there",
        Refusal::Inconsistent { rule } => match Inconsistent::of_rule(rule) {
            Some(inconsistent) => return inconsistent.to_string(),
            None => "parameters do not go together (by a rule of newer firmware than this program)",
        },
    };
    text.to_owned()
}
