//! Parts that many messages have.

use backseat_wire::Decimal;
use backseat_wire::calendar::{DateTime, TimeOfDay};
use backseat_wire::modem::Addresses;
use proptest::prelude::*;

pub fn addresses() -> impl Strategy<Value = Addresses> {
    (0..=127_u8, 0..=127_u8).prop_map(|(source, destination)| Addresses { source, destination })
}

/// To the whole second.
pub fn second_of_day() -> impl Strategy<Value = TimeOfDay> {
    (0..86_400_u64).prop_map(|s| TimeOfDay::from_us(s * 1_000_000))
}

/// To so many µs.
pub fn time_of_day(unit_us: u64) -> impl Strategy<Value = TimeOfDay> {
    (0..86_400_000_000 / unit_us).prop_map(move |units| TimeOfDay::from_us(units * unit_us))
}

/// From 1970 to 2399, to so many µs.
pub fn instant(unit_us: u64) -> impl Strategy<Value = DateTime> {
    (0..157_000_u64 * 86_400 * (1_000_000 / unit_us))
        .prop_filter_map("a day of the years 1970 to 2399", move |units| DateTime::from_unix_us(units * unit_us).ok())
}

/// A number as the modem writes it.
pub fn decimal(limit: i64, scale: u8) -> impl Strategy<Value = Decimal> {
    (-limit..=limit, 0..=scale).prop_map(|(mantissa, scale)| Decimal::new(mantissa, scale))
}

/// Text that a field can hold.
pub fn text() -> impl Strategy<Value = String> {
    "[ -#%-)+-~&&[^,]]{1,12}"
}

/// A number on the grid of its wire format.
pub fn grid(min: i64, max: i64, unit: f64) -> impl Strategy<Value = f64> {
    (min..=max).prop_map(move |count| count as f64 * unit)
}
