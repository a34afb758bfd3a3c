//! Gates on the ARM images of `firmware/boards/mps2`: no panic, the same numbers, and what they cost.

mod image;

/// core, wire and app link with a panic handler that does not exist.
#[test]
fn no_panic_can_be_reached() {
    if image::ready(&[image::Need::Target]) {
        image::build("nopanic").unwrap_or_else(|error| panic!("{error:#}"));
    }
}
