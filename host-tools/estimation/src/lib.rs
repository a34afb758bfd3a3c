//! A vehicle's log through the flight filter: what the sensors said, brought to the centre of gravity by the board's own
//! code ([`inputs`]), the filter of the board over it ([`filter`]), its smoother, and dead reckoning beside it.

pub mod commands;
pub mod dead_reckoning;
pub mod filter;
pub mod inputs;
pub mod smoother;
pub mod track;
