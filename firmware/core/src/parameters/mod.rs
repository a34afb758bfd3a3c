//! Everything that is declared about a vehicle, as plain numbers.

mod installation;

pub use installation::Installation;
