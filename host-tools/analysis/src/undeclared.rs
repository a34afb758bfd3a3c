//! A flight in an undeclared world, from its own measurements.
//!
//! A steady current carries vehicle and ship along: their positions and fixes drift, and ranges and what the vehicle
//! measures in its own frame stay as they are (but for 0.1 m of a range while the sound travels). Only the velocities
//! of the DVL would change; they are left out. A compass that is off reads every heading wrong. Each parameter of the
//! declared vehicle is too high or too low.

use backseat_core::state::{X, Y};
use backseat_logs::{Column, Log, Truth, VehicleFile};
use hil_sim::flight::FlightLog;
use hil_sim::scenario::{Scenario, perturbed};

/// Current north and east, m/s: 0.15 m/s towards 037 degrees.
const CURRENT_MPS: [f64; 2] = [0.12, 0.09];
/// Compass, measured minus true, rad.
const HEADING_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Share by which every parameter is wrong.
const WRONG_SHARE: f64 = 0.10;

/// Measurements but for the DVL, truth, and the vehicle as it is declared to the filter.
#[must_use]
pub fn undeclared(scenario: &Scenario, flight: &FlightLog, truth: &Truth) -> (Log, Truth, VehicleFile) {
    let (mut log, mut truth) = (flight.log.clone(), truth.clone());
    for row in &mut log.rows {
        let [north, east] = drift(row.time_us);
        let mut add = |column, change: f64| {
            if let Some(value) = row.get(column) {
                row.set(column, value + change);
            }
        };
        for (north_column, east_column) in
            [(Column::GpsX, Column::GpsY), (Column::ShipGpsX, Column::ShipGpsY), (Column::ShipX, Column::ShipY)]
        {
            add(north_column, north);
            add(east_column, east);
        }
        add(Column::Heading, HEADING_RAD);
    }
    for row in &mut truth.rows {
        let [north, east] = drift(row.time_us);
        row.state[X] += north;
        row.state[Y] += east;
        (0..2).for_each(|i| row.current_mps[i] += CURRENT_MPS[i]);
    }
    let parameters = perturbed(&scenario.vehicle.parameters, WRONG_SHARE, scenario.settings.seed);
    (log, truth, VehicleFile { parameters, ..scenario.vehicle.clone() })
}

fn drift(time_us: u64) -> [f64; 2] {
    CURRENT_MPS.map(|speed| speed * time_us as f64 * 1e-6)
}
