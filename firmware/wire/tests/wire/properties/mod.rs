//! What holds for every message: what was written reads back as it was, and writing what was read settles at once.
//!
//! "Settles": whatever bytes were understood, writing them gives a form that reads and writes as itself from then on.

mod binary;
mod generate;
mod links;
mod modem;
mod text;
