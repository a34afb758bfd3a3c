//! What breaks under way: the parameters of the vehicle as they are at a time.

use super::{Parameters, Shift};

/// A factor from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// What the quantity is multiplied with.
    pub factor: f64,
    /// From when on, s.
    pub time_s: f64,
}

impl Step {
    /// Nothing breaks.
    pub const NONE: Self = Self { factor: 1.0, time_s: f64::INFINITY };

    fn at(&self, time_s: f64) -> f64 {
        if time_s >= self.time_s { self.factor } else { 1.0 }
    }
}

/// Water that enters a compartment; the hull displaces what it did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flooding {
    /// What the compartment holds, kg.
    pub kg: f64,
    /// How fast it fills, kg/s.
    pub kg_per_s: f64,
    /// The compartment ahead of the centre of gravity, m.
    pub x_m: f64,
    /// From when on, s.
    pub time_s: f64,
}

impl Flooding {
    /// Dry.
    pub const NONE: Self = Self { kg: 0.0, kg_per_s: 0.0, x_m: 0.0, time_s: f64::INFINITY };

    /// Water inside, kg.
    pub fn kg_at(&self, time_s: f64) -> f64 {
        if time_s > self.time_s { (self.kg_per_s * (time_s - self.time_s)).min(self.kg) } else { 0.0 }
    }
}

/// All faults. The default is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faults {
    /// A compartment takes water.
    pub flooding: Flooding,
    /// Lift and drag of top, bottom, port, starboard.
    pub fins: [Step; 4],
    /// Quadratic surge drag.
    pub drag: Step,
    /// Thrust.
    pub thrust: Step,
    /// A weight that was dropped, kg in water.
    pub dropped_kg: f64,
    /// What it gains in buoyancy for a while, kg.
    pub lift_kg: Shift,
    /// By how much its centre of gravity moves ahead for a while, as an angle about the centre of buoyancy, rad.
    pub trim_rad: Shift,
    /// What the propeller loses with speed for a while, N s²/(rad m).
    pub advance_n_s2_per_rad_m: Shift,
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            flooding: Flooding::NONE,
            fins: [Step::NONE; 4],
            drag: Step::NONE,
            thrust: Step::NONE,
            dropped_kg: 0.0,
            lift_kg: Shift::default(),
            trim_rad: Shift::default(),
            advance_n_s2_per_rad_m: Shift::default(),
        }
    }
}

impl Faults {
    /// Water inside less the weight that was dropped or that something lifts, kg.
    fn gained_kg(&self, time_s: f64) -> f64 {
        self.flooding.kg_at(time_s) - self.dropped_kg - self.lift_kg.at(time_s)
    }

    /// Numbers that are the same as long as the vehicle is.
    pub(super) fn key(&self, time_s: f64) -> [f64; 9] {
        let [top, bottom, port, starboard] = self.fins.map(|fin| fin.at(time_s));
        let [drag, thrust] = [self.drag, self.thrust].map(|step| step.at(time_s));
        let [trim, advance] = [self.trim_rad, self.advance_n_s2_per_rad_m].map(|shift| shift.at(time_s));
        [self.gained_kg(time_s), trim, top, bottom, port, starboard, drag, thrust, advance]
    }

    /// The vehicle as it is at a time.
    ///
    /// Water adds its mass to the three masses and its moment about the centre of gravity to the restoring one; the
    /// centre of gravity that moments are taken about and the inertias stay where they were, which a kilogram in 38
    /// allows. A weight that is dropped hung at the centre of gravity.
    pub fn applied(&self, parameters: &Parameters, time_s: f64) -> Parameters {
        let mut p = *parameters;
        let kg = self.gained_kg(time_s);
        p.mass_kg += kg;
        for mass in &mut p.inertia[..3] {
            *mass += kg;
        }
        p.cb_to_cg_m[0] += self.flooding.kg_at(time_s) * self.flooding.x_m / p.displaced_mass_kg;
        let ([x, _, z], trim_rad) = (p.cb_to_cg_m, self.trim_rad.at(time_s));
        if trim_rad != 0.0 {
            p.cb_to_cg_m[0] = z * libm::tan(libm::atan2(x, z) + trim_rad);
        }
        for (fin, step) in p.fins.iter_mut().zip(&self.fins) {
            fin.area_m2 *= step.at(time_s);
        }
        p.quadratic_drag[0] *= self.drag.at(time_s);
        p.thrust_n_s2_per_rad2 *= self.thrust.at(time_s);
        p.advance_n_s2_per_rad_m += self.advance_n_s2_per_rad_m.at(time_s);
        p
    }
}
