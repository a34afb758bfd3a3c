//! What a hull may need beside the model's terms, and what a wind does to it.

use crate::vessel::readings::Reading;

/// Terms of sway and yaw that a hull may need beside those of the model.
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
