//! Refusals in words.

use backseat_wire::hostlink::Refusal;

/// Why the board does not do it.
pub const fn reason(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::UnknownParameter => "it has no such parameter",
        Refusal::OutOfRange => "a number is outside its range",
        Refusal::Sequence => "items arrived out of order, there are too many, or some are missing",
        Refusal::UnderWay => "a mission runs or is armed; stop it first (backseat mission stop)",
        Refusal::InvalidSet => "the numbers are in range one by one, but not valid together",
        Refusal::NotReady => "not now: navigation is lost, parameters are being stored, or the fins are being tested",
        Refusal::NoStore => "it has no flash for parameters, or is still writing them",
        Refusal::Locked => "a mission runs or is armed; --unlock admits the parameters that may change under way",
        Refusal::StoreFailed => "writing its flash failed; the set stored before is still there",
    }
}
