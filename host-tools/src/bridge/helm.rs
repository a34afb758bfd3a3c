//! What a helm of MOOS wants of the vehicle, as the board is asked for it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Its variables: degrees from true north, m, m/s.
pub const DESIRED: [&str; 3] = ["DESIRED_HEADING", "DESIRED_DEPTH", "DESIRED_SPEED"];
/// A value counts for so long after it has come: a helm posts several times a second, and one that has died steers no
/// vehicle.
const FRESH: Duration = Duration::from_secs(2);
/// The board is asked no more often; what it takes holds for two seconds.
const PACE: Duration = Duration::from_millis(500);

/// What the board is to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    pub heading_rad: f64,
    pub depth_m: f64,
    pub speed_mps: f64,
    /// When it was made.
    at: Instant,
}

/// The last value of each variable, and when it came.
#[derive(Default)]
pub struct Desired {
    values: [Option<(f64, Instant)>; 3],
    ordered: Option<Instant>,
}

impl Desired {
    /// A value of the variable of this place; none, if it is no number, and then the one before counts no more either.
    pub fn take(&mut self, variable: usize, value: Option<f64>, now: Instant) {
        if let Some(slot) = self.values.get_mut(variable) {
            *slot = value.map(|value| (value, now));
        }
    }

    /// What the board is to be asked for now, if all values are fresh and it was not asked just before.
    pub fn due(&mut self, now: Instant) -> Option<Order> {
        if self.ordered.is_some_and(|at| now.duration_since(at) < PACE) {
            return None;
        }
        let fresh = |value: Option<(f64, Instant)>| value.filter(|(_, at)| now.duration_since(*at) < FRESH);
        let [(heading_deg, _), (depth_m, _), (speed_mps, _)] =
            [fresh(self.values[0])?, fresh(self.values[1])?, fresh(self.values[2])?];
        self.ordered = Some(now);
        Some(Order { heading_rad: heading_deg.to_radians(), depth_m, speed_mps, at: now })
    }
}

/// The last order alone: one that the board was not asked for in its time is worth nothing, and none holds a stop up.
#[derive(Clone, Default)]
pub struct LastOrder(Arc<Mutex<Option<Order>>>);

impl LastOrder {
    /// Takes the place of the one before.
    pub fn set(&self, order: Order) {
        *self.slot() = Some(order);
    }

    /// The order, once, unless it is old.
    pub fn take(&self) -> Option<Order> {
        self.slot().take().filter(|order| order.at.elapsed() < PACE)
    }

    fn slot(&self) -> std::sync::MutexGuard<'_, Option<Order>> {
        // a poisoned lock's data is whole: nothing panics while it is held
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_three_are_to_be_fresh_and_the_board_is_asked_twice_a_second() {
        let begun = Instant::now();
        let at = |ms| begun + Duration::from_millis(ms);
        let mut desired = Desired::default();
        desired.take(0, Some(90.0), at(0));
        desired.take(1, Some(3.0), at(100));
        assert_eq!(desired.due(at(200)), None, "no speed");
        desired.take(2, Some(1.5), at(300));
        let order = desired.due(at(300)).unwrap();
        assert_eq!((order.heading_rad, order.depth_m, order.speed_mps), (std::f64::consts::FRAC_PI_2, 3.0, 1.5));
        assert_eq!(desired.due(at(799)), None);
        assert!(desired.due(at(800)).is_some() && desired.due(at(1999)).is_some());
        assert_eq!(desired.due(at(2500)), None, "the heading has come two seconds before");
        desired.take(0, Some(91.0), at(2500));
        assert_eq!(desired.due(at(2500)), None, "and so has the depth");
        desired.take(1, Some(3.0), at(2500));
        desired.take(2, Some(1.5), at(2500));
        assert!(desired.due(at(2500)).is_some());
        desired.take(2, None, at(2600));
        assert_eq!(desired.due(at(3100)), None, "no number");
    }

    #[test]
    fn an_order_is_taken_once_in_its_time() {
        let (orders, now) = (LastOrder::default(), Instant::now());
        let order = |depth_m, at| Order { heading_rad: 1.0, depth_m, speed_mps: 1.0, at };
        orders.set(order(1.0, now));
        orders.set(order(2.0, now));
        assert_eq!(orders.take().map(|order| order.depth_m), Some(2.0));
        assert_eq!(orders.take(), None);
        if let Some(before) = now.checked_sub(PACE) {
            orders.set(order(3.0, before));
            assert_eq!(orders.take(), None, "old");
        }
    }
}
