//! State and covariance as numbers: where each state stands, and how a step and a scalar update move them.

pub(super) mod covariance;
pub(super) mod digest;
pub(super) mod discretisation;
pub(super) mod estimate;
pub(super) mod layout;
pub(super) mod observation;
pub(super) mod observer;
pub(super) mod propagation;
pub(super) mod row;
