//! One extended Kalman filter: time update, measurement update, delayed states and the states that it estimates beside
//! the vehicle's motion.

mod alone;
pub(super) mod cekf;
mod cloning;
mod effects;
pub(super) mod estimates;
mod fusion;
mod learnt;
mod peers;
pub(super) mod prediction;
#[cfg(test)]
mod tests;
pub(super) mod vertical;
