//! Which physical effect does the declared model lack?

pub mod bench;
pub mod candidates;
pub mod diagnosis;
pub mod gram;
pub mod linear;
pub mod model;
pub mod noise;
pub mod picture;
pub mod rivals;
pub mod samples;
pub mod scores;
pub mod search;
pub mod statistics;
pub mod structure;
pub mod terms;
pub mod waves;
pub mod whitener;
