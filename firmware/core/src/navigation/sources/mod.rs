//! The aiding sources: h(x), H(x) and R of one measurement each.

pub(super) mod acoustic;
pub(super) mod attitude;
pub(super) mod depth;
pub(super) mod dvl;
pub mod models;
pub(super) mod range;
pub(super) mod range_rate;
pub(super) mod rates;
pub(super) mod ship_gnss;
pub(super) mod two_way;
pub(super) mod usbl;
pub(super) mod vehicle_gnss;
