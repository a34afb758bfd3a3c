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

/// What a helm wants of the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// To hold this instead of the leg.
    Hold { heading_rad: f64, depth_m: f64, speed_mps: f64 },
    /// Its all-stop, a speed of zero: to end the mission, where the helm steers.
    Stop,
}

/// A wish, and when the board is to be asked for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    pub wish: Wish,
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

    /// What the board is to be asked for now, if what it takes is fresh and it was not asked just before.
    pub fn due(&mut self, now: Instant) -> Option<Order> {
        if self.ordered.is_some_and(|at| now.duration_since(at) < PACE) {
            return None;
        }
        let [heading_deg, depth_m, speed_mps] =
            self.values.map(|value| value.filter(|(_, at)| now.duration_since(*at) < FRESH).map(|(value, _)| value));
        let speed_mps = speed_mps?;
        let wish = if speed_mps == 0.0 {
            Wish::Stop
        } else {
            Wish::Hold { heading_rad: heading_deg?.to_radians(), depth_m: depth_m?, speed_mps }
        };
        self.ordered = Some(now);
        Some(Order { wish, at: now })
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
        let wish = Wish::Hold { heading_rad: std::f64::consts::FRAC_PI_2, depth_m: 3.0, speed_mps: 1.5 };
        assert_eq!(desired.due(at(300)).map(|order| order.wish), Some(wish));
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

    /// A helm posts it once: it is asked for again, in case the port is taken, while it is fresh.
    #[test]
    fn a_speed_of_zero_is_an_all_stop_whatever_the_others_are() {
        let begun = Instant::now();
        let at = |ms| begun + Duration::from_millis(ms);
        let mut desired = Desired::default();
        desired.take(2, Some(0.0), at(0));
        for ms in [0, 500, 1000, 1500] {
            assert_eq!(desired.due(at(ms)), Some(Order { wish: Wish::Stop, at: at(ms) }));
            assert_eq!(desired.due(at(ms + 100)), None);
        }
        assert_eq!(desired.due(at(2000)), None);
    }

    #[test]
    fn an_order_is_taken_once_in_its_time() {
        let (orders, now) = (LastOrder::default(), Instant::now());
        let order = |depth_m, at| Order { wish: Wish::Hold { heading_rad: 1.0, depth_m, speed_mps: 1.0 }, at };
        orders.set(order(1.0, now));
        orders.set(order(2.0, now));
        assert_eq!(orders.take(), Some(order(2.0, now)));
        assert_eq!(orders.take(), None);
        if let Some(before) = now.checked_sub(PACE) {
            orders.set(order(3.0, before));
            assert_eq!(orders.take(), None, "old");
        }
    }
}
