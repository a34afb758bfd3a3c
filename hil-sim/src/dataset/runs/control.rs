//! The control computer: proportional laws of heading, depth and, in the later configuration, roll.

/// What it commands: angles as it counts them, rad (+rudder: nose to starboard, +elevator: nose up).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Upper and lower rudder.
    pub rudders_rad: [f64; 2],
    /// Port and starboard elevator.
    pub elevators_rad: [f64; 2],
    /// The motor is on.
    pub is_powered: bool,
}

/// Gains and dead bands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Elevator per depth, deg/m.
    pub depth_p: f64,
    /// Depth within which the elevator is let be, m.
    pub depth_band_m: f64,
    /// Heading within which the rudder is let be, deg.
    pub heading_band_deg: f64,
    /// Rudder's difference per roll; none in the earlier configuration.
    pub roll_p: Option<f64>,
}

/// Stops, rad.
const MOST_RAD: [f64; 2] = [0.506, core::f64::consts::FRAC_PI_6];
/// Roll that is let be, rad.
const ROLL_BAND_RAD: f64 = 0.05;

impl Law {
    /// Of a run of a configuration.
    pub(super) fn of(configuration: usize, number: usize) -> Self {
        Self {
            depth_p: [2.5, 2.0, 3.0][number % 3],
            depth_band_m: [0.5, 1.0][configuration],
            heading_band_deg: [2.5, 5.0][configuration],
            roll_p: [None, Some(if number.is_multiple_of(2) { 0.25 } else { 0.5 })][configuration],
        }
    }

    /// From roll, pitch, heading, rad, depth, m, and the target's heading, rad, and depth, m.
    pub(super) fn command(&self, attitude: [f64; 3], depth_m: f64, target: [f64; 2], is_powered: bool) -> Command {
        let error = libm::remainder(target[0] - attitude[2], core::f64::consts::TAU);
        let steer = if error.abs() < self.heading_band_deg.to_radians() || !is_powered { 0.0 } else { error };
        let level = match self.roll_p {
            Some(gain) if attitude[0].abs() > ROLL_BAND_RAD && is_powered => gain * attitude[0],
            _ => 0.0,
        };
        let deep = depth_m - target[1];
        let elevator = if deep.abs() < self.depth_band_m { 0.0 } else { (self.depth_p * deep).to_radians() };
        let elevator = elevator.clamp(-MOST_RAD[1], MOST_RAD[1]);
        let rudders_rad = [steer + level, steer - level].map(|angle| angle.clamp(-MOST_RAD[0], MOST_RAD[0]));
        Command { rudders_rad, elevators_rad: [elevator; 2], is_powered }
    }
}
