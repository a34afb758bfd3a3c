//! From the bytes of the device ports to events of the estimator.

mod ahrs;
mod dvl;
mod frontseat;
mod modem;

pub use ahrs::AhrsLink;
pub use dvl::DvlLink;
pub use frontseat::FrontseatLink;
pub use modem::ModemLink;

/// Arrival time less a delay.
fn validity_us(arrival_us: u64, delay_s: f64) -> u64 {
    arrival_us.saturating_sub(micros(delay_s))
}

/// Seconds as whole microseconds; negative and NaN give 0.
pub fn micros(seconds: f64) -> u64 {
    libm::round(seconds * 1e6) as u64
}
