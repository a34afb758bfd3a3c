//! Delayed states: taken, dropped, forgotten.
//!
//! The thesis delays the whole 18-state vector. What a later measurement needs of it is less: of the
//! ship its six states; of the vehicle position and velocity over ground, v = R ν + c, formed at the
//! clone with its exact Jacobian. Ranges are then the same to rounding. So is a range rate with the delayed velocity
//! linearised at the clone; linearising it again after later corrections differs in second order only.

use super::cekf::Filter;
use crate::dynamics::Attitude;
use crate::navigation::algebra::covariance::ROWS;
use crate::navigation::algebra::layout::{CLONE_STATES, CLONE_VELOCITY, CloneKind, SHIP_STATES, SHIP_VELOCITY};
use crate::navigation::algebra::observer::{Appended, LinearStep, Observer};
use crate::navigation::algebra::row::Row;
use crate::navigation::interface::error::CloneError;
use crate::navigation::interface::measurement::{CloneId, ShipEnd, ShipReport, VehicleEnd};
use crate::navigation::sources::acoustic::{ground_velocity, push_ground_velocity};
use crate::state::{self, X};
use nalgebra::Vector3;

impl Filter {
    /// Takes a delayed state of the vehicle at the filter's present time.
    /// Each step is shown to `observer`.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_vehicle(&mut self, observer: &mut impl Observer) -> Result<CloneId, CloneError> {
        self.check_clone()?;
        let attitude = Attitude::new(&state::attitude(&self.x.vehicle));
        let velocity = ground_velocity(&self.x, &attitude);
        let mut values = [0.0; CLONE_STATES];
        let mut rows = [Row::EMPTY; CLONE_STATES];
        for i in 0..CLONE_VELOCITY {
            values[i] = self.x.get(X + i);
            rows[i] = Row::unit(X + i);
            values[CLONE_VELOCITY + i] = velocity[i];
            push_ground_velocity(&self.x, &attitude, &Vector3::ith(i, 1.0), &mut rows[CLONE_VELOCITY + i]);
        }
        self.append(CloneKind::Vehicle, &values, &rows, observer)
    }

    /// Takes a delayed state of the ship at the filter's present time.
    /// Each step is shown to `observer`.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_ship(&mut self, observer: &mut impl Observer) -> Result<CloneId, CloneError> {
        self.check_clone()?;
        let at = self.x.layout.ship().ok_or(CloneError::NoShip)?;
        let rows = core::array::from_fn(|i| Row::unit(at + i));
        self.append(CloneKind::Ship, &self.x.block(at), &rows, observer)
    }

    /// Forgets a delayed state; a stale id does nothing.
    pub fn drop_clone(&mut self, id: CloneId, observer: &mut impl Observer) {
        let n = self.dimension();
        if let Some(at) = self.x.layout.remove_clone(id) {
            self.p.remove(n, at, CLONE_STATES);
            self.w = [0.0; ROWS];
            self.x.remove(n, at, CLONE_STATES);
            observer.observe(&LinearStep::Remove { at, count: CLONE_STATES });
        }
    }

    /// Where the vehicle's end of an acoustic path was, as far as the filter knows now, m; `None`: its clone was dropped.
    #[must_use]
    pub(crate) fn vehicle_end_m(&self, end: &VehicleEnd) -> Option<[f64; 2]> {
        match *end {
            VehicleEnd::Now => Some(self.x.block::<2>(X)),
            VehicleEnd::Delayed { clone, bridge_s } => {
                let at = self.x.clone_at(clone, CloneKind::Vehicle)?;
                let ([x_m, y_m], [x_mps, y_mps]) = (self.x.block::<2>(at), self.x.block::<2>(at + CLONE_VELOCITY));
                Some([x_m + x_mps * bridge_s, y_m + y_mps * bridge_s])
            }
        }
    }

    /// The ship's end of an acoustic path, of a ship that is a state as a packet would report it; `None`: it was dropped,
    /// or there is none: a transponder is no ship, nor is another
    /// vehicle.
    #[must_use]
    pub(crate) fn ship_end(&self, end: &ShipEnd) -> Option<ShipReport> {
        let at = match *end {
            ShipEnd::Reported(report) => return Some(report),
            ShipEnd::Delayed(clone) => self.x.clone_at(clone, CloneKind::Ship)?,
            ShipEnd::Now => self.x.layout.ship()?,
            ShipEnd::Transponder(_) | ShipEnd::Peer(_) => return None,
        };
        let sigma = |i: usize| libm::sqrt(self.variance(i).max(self.variance(i + 1)));
        Some(ShipReport {
            position_m: self.x.block::<2>(at),
            velocity_mps: self.x.block::<2>(at + SHIP_VELOCITY),
            position_sigma_m: sigma(at),
            velocity_sigma_mps: sigma(at + SHIP_VELOCITY),
        })
    }

    pub(super) fn forget_ship(&mut self, observer: &mut impl Observer) {
        while let Some(id) = self.x.layout.any_clone(CloneKind::Ship) {
            self.drop_clone(id, observer);
        }
        if let Some(at) = self.x.layout.ship() {
            let n = self.dimension();
            self.p.remove(n, at, SHIP_STATES);
            self.w = [0.0; ROWS];
            self.x.remove(n, at, SHIP_STATES);
            self.x.layout.set_ship(false);
            observer.observe(&LinearStep::Remove { at, count: SHIP_STATES });
        }
    }

    fn check_clone(&self) -> Result<(), CloneError> {
        if !self.is_initialised() {
            Err(CloneError::NotInitialised)
        } else if !self.x.layout.has_free_slot() {
            Err(CloneError::Full)
        } else {
            Ok(())
        }
    }

    fn append(
        &mut self,
        kind: CloneKind,
        values: &[f64; CLONE_STATES],
        rows: &[Row; CLONE_STATES],
        observer: &mut impl Observer,
    ) -> Result<CloneId, CloneError> {
        let at = self.dimension();
        for (i, row) in rows.iter().enumerate() {
            self.p.append(at + i, row, &mut self.w);
        }
        self.x.set_tail(at, values);
        observer.observe(&LinearStep::Append(Appended { at, rows }));
        self.x.layout.add_clone(kind, at).ok_or(CloneError::Full)
    }
}
