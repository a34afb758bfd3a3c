//! Refusals in words.

use backseat_wire::hostlink::Refusal;

/// Why the board does not do it.
pub const fn reason(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::UnknownParameter => "it has no such parameter",
        Refusal::OutOfRange => "a number is outside its range",
        Refusal::Sequence => "items out of order, too many of them, or some missing",
        Refusal::UnderWay => "a mission runs or waits to begin (backseat mission stop)",
        Refusal::InvalidSet => "the numbers are in range one by one, but not valid together",
        Refusal::NotReady => "not now: navigation is lost, parameters are being stored, or the fins are being shown",
        Refusal::NoStore => "it has no memory for them, or is busy with it",
        Refusal::Locked => "a mission runs or waits to begin: --unlock takes what may change under way",
        Refusal::StoreFailed => "its memory refused; what was stored before is still there",
    }
}
