//! The terms of surge, sway and yaw acceleration, and of the wind.
//!
//! After the field's modular model (Yasukawa and Yoshimura 2015), each force a sum of terms: hull: u|u|, v r, r², v²
//! ahead; u v, u r, v|v|, r|r| to the side and in yaw; propeller: thrust a n|n| − b |n| u, where wake and thrust
//! deduction are in a and b, and its sideways force n|n|; rudder: the inflow behind a propeller is a mix of u and n, so
//! that the normal force goes with (u², n u, n²) sin δ; what sway and yaw rate add to its angle has the form of the
//! hull's terms and is in them. Added masses and inertias only scale the numbers, so that each acceleration has numbers
//! of its own.

use backseat_data::VehicleFile;

/// One reading of a vessel.
#[derive(Clone, Debug, Default)]
pub(super) struct Reading {
    pub t_s: f64,
    /// Surge, sway, m/s, and yaw rate, rad/s.
    pub velocity: [f64; 3],
    pub heading_rad: f64,
    /// Speed of each propeller, rps, or its command.
    pub propellers: Vec<f64>,
    /// Angle of each rudder, rad.
    pub rudders: Vec<f64>,
    pub position_m: Option<[f64; 2]>,
    /// Measured true wind, towards north and east, m/s.
    pub wind_mps: Option<[f64; 2]>,
}

/// Terms of one axis: 0 surge, 1 sway, 2 yaw.
pub(super) fn of_axis(axis: usize, reading: &Reading) -> Vec<f64> {
    let [u, v, r] = reading.velocity;
    let squares: Vec<f64> = reading.propellers.iter().map(|n| n * n.abs()).collect();
    let count = squares.len().max(1) as f64;
    let race = squares.iter().sum::<f64>() / count;
    let mean = reading.propellers.iter().sum::<f64>() / count;
    let mut terms =
        if axis == 0 { vec![u * u.abs(), v * r, r * r, v * v] } else { vec![u * v, u * r, v * v.abs(), r * r.abs()] };
    for (n, square) in reading.propellers.iter().zip(&squares) {
        terms.push(*square);
        if axis == 0 {
            terms.push(n.abs() * u);
        }
    }
    for angle in &reading.rudders {
        let sin = angle.sin();
        if axis == 0 {
            terms.extend([race * sin * sin, u * u * sin * sin]);
        } else {
            terms.extend([u * u.abs() * sin, mean * u * sin, race * sin]);
        }
    }
    terms
}

/// Terms of sway and yaw that a hull may need beside those.
pub(super) fn cross(reading: &Reading) -> [f64; 2] {
    let [_, v, r] = reading.velocity;
    [v * r.abs(), r * v.abs()]
}

/// What a wind does to a vessel: accelerations for each (m/s)² of its four terms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Windage {
    /// Ahead by |w| w ahead, to starboard by |w| w to starboard, yaw by the same, yaw by the product of both.
    pub factors: [f64; 4],
}

impl Windage {
    /// Coefficients for a wind from ahead and from the side, the middle of the ranges in Fossen (2011, section 8.1).
    pub(super) const FRONT: f64 = 0.7;
    pub(super) const SIDE: f64 = 0.825;
    /// Where the side force acts, share of the length abaft the centre of gravity, and C_N = −this · sin 2γ, which
    /// turns the bow away from the wind: found with the anemometer on nine runs of a tanker's model in 2020.
    pub(super) const ABAFT: f64 = 0.05;
    pub(super) const TURNING: f64 = 0.04;

    /// By areas, length and mass; added masses of 5 % ahead, 85 % to the side and 80 % of the inertia, as slender ships
    /// have.
    pub(super) fn new([front_m2, side_m2]: [f64; 2], length_m: f64, mass_kg: f64) -> Self {
        /// Half the density of air, kg/m³.
        const HALF_DENSITY: f64 = 0.6125;
        let inertia = 1.8 * mass_kg * (0.25 * length_m).powi(2);
        let turning = HALF_DENSITY * side_m2 * length_m / inertia;
        Self {
            factors: [
                HALF_DENSITY * Self::FRONT * front_m2 / (1.05 * mass_kg),
                HALF_DENSITY * Self::SIDE * side_m2 / (1.85 * mass_kg),
                -turning * Self::SIDE * Self::ABAFT,
                -turning * 2.0 * Self::TURNING,
            ],
        }
    }

    /// The four terms in a wind towards north and east, less those in still air, which belong to the hull.
    pub(super) fn terms(self, wind_mps: [f64; 2], heading_rad: f64, [u, v, _]: [f64; 3]) -> [f64; 4] {
        let (sin, cos) = heading_rad.sin_cos();
        let of = |[north, east]: [f64; 2]| {
            let (ahead, starboard) = (north * cos + east * sin - u, east * cos - north * sin - v);
            let speed = ahead.hypot(starboard);
            [speed * ahead, speed * starboard, speed * starboard, ahead * starboard]
        };
        let (there, still) = (of(wind_mps), of([0.0; 2]));
        [0, 1, 2, 3].map(|i| self.factors[i] * (there[i] - still[i]))
    }
}

/// Length of the vessel, m: of the log, or of the vehicle file.
pub(super) fn length_m(log: &backseat_data::Log, vehicle: &VehicleFile) -> f64 {
    let stated = log.column(backseat_data::log::Column::Length).next();
    stated.map_or(vehicle.parameters.length_m, |(_, length_m)| length_m)
}
