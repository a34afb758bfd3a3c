//! Which physical effect does the declared model lack?

pub mod gram;
pub mod model;
pub mod samples;
pub mod terms;
pub mod whitener;
