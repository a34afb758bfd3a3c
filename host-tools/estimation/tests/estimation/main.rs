//! The flight filter and its smoother over a log, against independent numbers.

mod mini_run;
mod smoother;
