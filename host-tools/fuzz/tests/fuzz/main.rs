//! The targets over the tracked corpora, over random input, and against the ARM image.

mod corpus;
mod differential;
mod random;
mod search;
