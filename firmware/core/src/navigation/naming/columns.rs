//! What a cause does to the filter, per unit: a force, a velocity of the water, or a shift of readings.
//!
//! A column is one number θ that the declared vehicle takes as zero. Causes are made of one column or two.

use crate::dynamics::{ActuatorInput, Attitude, FINS, VehicleModel};
use crate::navigation::interface::measurement::{Measurement, Sensor, ShipEnd};
use crate::state::{self, PSI, VehicleState, X, Y};
use nalgebra::Vector6;

/// How many there are.
pub(super) const COLUMNS: usize = 32;

/// Share of its lift and drag that a fin has lost, of each fin.
pub(super) const FIN_LOST: usize = 0;
/// Angle by which a fin stands off, rad.
pub(super) const FIN_ANGLE: usize = FIN_LOST + FINS;
/// Share of its command that a fin does not follow.
pub(super) const FIN_COMMAND: usize = FIN_ANGLE + FINS;
/// Share of the thrust that is lost.
pub(super) const THRUST: usize = FIN_COMMAND + FINS;
/// The same, growing, per hour.
pub(super) const THRUST_RAMP: usize = THRUST + 1;
/// Growth of the drag ahead, as a share of the declared.
pub(super) const DRAG: usize = THRUST_RAMP + 1;
/// Weight, kg.
pub(super) const WEIGHT: usize = DRAG + 1;
/// Its moment: kg m ahead of the centre of gravity.
pub(super) const TRIM_AHEAD: usize = WEIGHT + 1;
/// kg m to starboard.
pub(super) const TRIM_STARBOARD: usize = TRIM_AHEAD + 1;
/// Current, north and east, m/s.
pub(super) const CURRENT: usize = TRIM_STARBOARD + 1;
/// Compass: constant, times sine, times cosine of the heading, rad.
pub(super) const HEADING: usize = CURRENT + 2;
/// Pitch sensor, rad.
pub(super) const PITCH: usize = HEADING + 3;
/// Gyro about the vertical axis, rad/s.
pub(super) const GYRO: usize = PITCH + 1;
/// Pressure sensor, m.
pub(super) const DEPTH: usize = GYRO + 1;
/// The same, growing, m an hour.
pub(super) const DEPTH_RAMP: usize = DEPTH + 1;
/// Range, m: clock, delay.
pub(super) const RANGE: usize = DEPTH_RAMP + 1;
/// The same, growing, m an hour.
pub(super) const RANGE_RAMP: usize = RANGE + 1;
/// The same, as a share of the range: sound speed.
pub(super) const RANGE_SCALE: usize = RANGE_RAMP + 1;
/// Place of the ship, reported minus true, north and east, m.
pub(super) const SHIP: usize = RANGE_SCALE + 1;

const _: () = assert!(SHIP + 2 == COLUMNS);

/// One sigma of what is there from the start and is no change: nobody knows a vehicle better.
pub(super) const DECLARED_SIGMA: [f64; COLUMNS] = {
    let mut sigma = [0.05; COLUMNS];
    let mut fin = 0;
    while fin < FINS {
        sigma[FIN_ANGLE + fin] = 0.0175;
        fin += 1;
    }
    sigma[THRUST] = 0.1;
    sigma[THRUST_RAMP] = 0.01;
    sigma[DRAG] = 0.1;
    sigma[WEIGHT] = 0.1;
    sigma[TRIM_AHEAD] = 0.075;
    sigma[TRIM_STARBOARD] = 0.03;
    sigma[CURRENT] = 0.3;
    sigma[CURRENT + 1] = 0.3;
    sigma[HEADING] = 0.035;
    sigma[HEADING + 1] = 0.0175;
    sigma[HEADING + 2] = 0.0175;
    sigma[PITCH] = 0.0175;
    sigma[GYRO] = 0.002;
    sigma[DEPTH] = 0.1;
    sigma[DEPTH_RAMP] = 0.05;
    sigma[RANGE] = 1.0;
    sigma[RANGE_RAMP] = 0.5;
    sigma[RANGE_SCALE] = 0.003;
    sigma[SHIP] = 1.5;
    sigma[SHIP + 1] = 1.5;
    sigma
};

/// ∂v̇/∂θ of the columns that are forces.
pub(super) fn accelerations(
    model: &VehicleModel,
    x: &VehicleState,
    input: &ActuatorInput,
    hours: f64,
) -> [Vector6<f64>; CURRENT] {
    let v = state::velocity(x);
    let down = Attitude::new(&state::attitude(x)).down();
    let plant = model.parameters();
    let mut wrench = [Vector6::zeros(); CURRENT];
    let fins = model.fin_wrenches(&v, &input.fins_rad);
    let by_angle = model.fin_wrenches_by_delta(&v, &input.fins_rad);
    for i in 0..FINS {
        wrench[FIN_LOST + i] = -fins[i];
        wrench[FIN_ANGLE + i] = by_angle[i];
        wrench[FIN_COMMAND + i] = by_angle[i] * -input.fins_rad[i];
    }
    let thrust_n = model.propeller().thrust(input.propeller_radps, v[0]);
    wrench[THRUST][0] = -thrust_n;
    wrench[THRUST_RAMP][0] = -thrust_n * hours;
    wrench[DRAG][0] = -plant.quadratic_diag[0] * v[0] * v[0].abs();
    let g = plant.g_mps2;
    let [x_n, y_n, z_n] = [down.x * g, down.y * g, down.z * g];
    wrench[WEIGHT] = Vector6::new(x_n, y_n, z_n, 0.0, 0.0, 0.0);
    wrench[TRIM_AHEAD] = Vector6::new(0.0, 0.0, 0.0, 0.0, -z_n, y_n);
    wrench[TRIM_STARBOARD] = Vector6::new(0.0, 0.0, 0.0, z_n, 0.0, -x_n);
    wrench.map(|wrench| model.acceleration_of(&wrench))
}

/// ∂z/∂θ of each scalar of a measurement: (scalar, column, slope).
pub(super) struct Shifts {
    entries: [(u8, u8, f64); 5],
    len: usize,
}

impl Shifts {
    pub(super) const NONE: Self = Self { entries: [(0, 0, 0.0); 5], len: 0 };

    fn push(&mut self, axis: u8, column: usize, slope: f64) {
        if let Some(entry) = self.entries.get_mut(self.len) {
            *entry = (axis, column as u8, slope);
            self.len += 1;
        }
    }

    /// Columns and slopes of one scalar.
    pub(super) fn of(&self, axis: u8) -> impl Iterator<Item = (usize, f64)> + '_ {
        let entries = self.entries.iter().take(self.len).filter(move |(own, ..)| *own == axis);
        entries.map(|&(_, column, slope)| (usize::from(column), slope))
    }

    /// Of a measurement that is about to be fused.
    pub(super) fn new(measurement: &Measurement, x: &VehicleState, hours: f64) -> Self {
        let mut shifts = Self::NONE;
        match (measurement.sensor(), measurement) {
            (Sensor::Depth, _) => {
                shifts.push(0, DEPTH, 1.0);
                shifts.push(0, DEPTH_RAMP, hours);
            }
            (Sensor::Attitude, _) => {
                let (sin, cos) = libm::sincos(x[PSI]);
                shifts.push(1, PITCH, 1.0);
                shifts.push(2, HEADING, 1.0);
                shifts.push(2, HEADING + 1, sin);
                shifts.push(2, HEADING + 2, cos);
            }
            (Sensor::Rates, _) => shifts.push(2, GYRO, 1.0),
            (_, Measurement::Range { path, range_m }) => {
                shifts.push(0, RANGE, 1.0);
                shifts.push(0, RANGE_RAMP, hours);
                shifts.push(0, RANGE_SCALE, *range_m);
                if let ShipEnd::Reported(ship) = path.ship {
                    let [north_m, east_m] = ship.position_m;
                    let distance_m = if *range_m > 1.0 { *range_m } else { 1.0 };
                    shifts.push(0, SHIP, (x[X] - north_m) / distance_m);
                    shifts.push(0, SHIP + 1, (x[Y] - east_m) / distance_m);
                }
            }
            _ => {}
        }
        shifts
    }
}
