//! The targets over the tracked corpora, over random input, and against the ARM image.

mod corpus;
mod differential;
mod duration;
#[path = "../../../../firmware/tests/random.rs"]
mod random;
mod search;
