//! Surge, sway and yaw of a vessel with propellers and rudders on the surface.
//!
//! After the field's modular model (Yasukawa and Yoshimura 2015), each acceleration a sum of terms: hull: u|u|, v r, r²,
//! v² ahead; u v, u r, v|v|, r|r| to the side and in yaw; propeller: thrust a n|n| − b |n| u, where wake and thrust
//! deduction are in a and b, and its sideways force n|n|; rudder: the inflow behind a propeller is a mix of u and n, so
//! that the normal force goes with (u², n u, n²) sin δ; what sway and yaw rate add to its angle has the form of the
//! hull's terms and is in them. Added masses and inertias only scale the numbers, so that each acceleration has numbers
//! of its own.

/// What a vessel does at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Manoeuvre<'a> {
    /// Surge and sway, m/s, and yaw rate, rad/s.
    pub velocity: [f64; 3],
    /// Speed of each propeller, rps, or its command.
    pub propellers: &'a [f64],
    /// Angle of each rudder, rad.
    pub rudders: &'a [f64],
}

impl Manoeuvre<'_> {
    fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        self.propellers.iter().map(|n| of(*n)).sum::<f64>() / self.propellers.len().max(1) as f64
    }

    /// n|n| of propeller `i`.
    fn thrust(&self, i: usize) -> f64 {
        self.propellers.get(i).map_or(0.0, |n| n * n.abs())
    }

    /// sin δ of rudder `i`.
    fn rudder(&self, i: usize) -> f64 {
        self.rudders.get(i).map_or(0.0, |angle| libm::sin(*angle))
    }

    /// Mean n|n|: the race in which rudders stand.
    fn race(&self) -> f64 {
        self.mean(|n| n * n.abs())
    }
}

/// Part of the vessel that a term belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Hull.
    Hull,
    /// Propeller of this place.
    Propeller(usize),
    /// Rudder of this place.
    Rudder(usize),
}

/// A term of an acceleration.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Its factors: u, v, r, n (propeller), d (sin δ); `uu` is u|u| ahead.
    pub name: &'static str,
    /// Whose.
    pub part: Part,
    /// Unit of its coefficient for a linear acceleration.
    unit: &'static str,
    value: fn(&Manoeuvre<'_>, usize) -> f64,
}

impl Term {
    /// Its value, the coefficient left out.
    #[must_use]
    pub fn value(&self, of: &Manoeuvre<'_>) -> f64 {
        let (Part::Propeller(place) | Part::Rudder(place)) = self.part else { return (self.value)(of, 0) };
        (self.value)(of, place)
    }

    /// Unit of its coefficient; `axis`: 0 surge, 1 sway, 2 yaw.
    #[must_use]
    pub const fn unit(&self, axis: usize) -> &'static str {
        match (axis, self.unit.as_bytes()) {
            (0 | 1, _) => self.unit,
            (_, b"m") => "1",
            (_, b"1") => "1/m",
            _ => "1/m²",
        }
    }
}

/// Names, units and laws of the terms of hull, each propeller and each rudder.
type Law = (&'static str, &'static str, fn(&Manoeuvre<'_>, usize) -> f64);

const AHEAD: [&[Law]; 3] = [
    &[
        ("uu", "1/m", |m, _| m.velocity[0] * m.velocity[0].abs()),
        ("vr", "1", |m, _| m.velocity[1] * m.velocity[2]),
        ("rr", "m", |m, _| m.velocity[2] * m.velocity[2]),
        ("vv", "1/m", |m, _| m.velocity[1] * m.velocity[1]),
    ],
    &[
        ("nn", "m", |m, i| m.thrust(i)),
        ("nu", "1", |m, i| m.propellers.get(i).map_or(0.0, |n| n.abs() * m.velocity[0])),
    ],
    &[
        ("nndd", "m", |m, i| m.race() * m.rudder(i) * m.rudder(i)),
        ("uudd", "1/m", |m, i| m.velocity[0] * m.velocity[0] * m.rudder(i) * m.rudder(i)),
    ],
];
const ASIDE: [&[Law]; 3] = [
    &[
        ("uv", "1/m", |m, _| m.velocity[0] * m.velocity[1]),
        ("ur", "1", |m, _| m.velocity[0] * m.velocity[2]),
        ("vv", "1/m", |m, _| m.velocity[1] * m.velocity[1].abs()),
        ("rr", "m", |m, _| m.velocity[2] * m.velocity[2].abs()),
    ],
    &[("nn", "m", |m, i| m.thrust(i))],
    &[
        ("uud", "1/m", |m, i| m.velocity[0] * m.velocity[0].abs() * m.rudder(i)),
        ("nud", "1", |m, i| m.mean(|n| n) * m.velocity[0] * m.rudder(i)),
        ("nnd", "m", |m, i| m.race() * m.rudder(i)),
    ],
];

/// Terms of surge (0), sway (1) or yaw (2) acceleration of a vessel with so many propellers and rudders.
pub fn terms(axis: usize, [propellers, rudders]: [usize; 2]) -> impl Iterator<Item = Term> {
    let [hull, propeller, rudder] = if axis == 0 { AHEAD } else { ASIDE };
    let of = |part| move |&(name, unit, value): &Law| Term { name, part, unit, value };
    let hull = hull.iter().map(of(Part::Hull));
    let propellers = (0..propellers).flat_map(move |i| propeller.iter().map(of(Part::Propeller(i))));
    hull.chain(propellers).chain((0..rudders).flat_map(move |i| rudder.iter().map(of(Part::Rudder(i)))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen in a mirror, a vessel turns and slips the other way and goes ahead as before: each term has that symmetry,
    /// but for the sideways force of a propeller, which turns the other way in a mirror.
    #[test]
    fn val_terms_are_those_of_a_symmetric_vessel() {
        let (propellers, rudders) = ([3.0, 5.0], [0.2, -0.1]);
        let there = Manoeuvre { velocity: [0.7, 0.1, -0.2], propellers: &propellers, rudders: &rudders };
        let mirrored_rudders = rudders.map(|angle| -angle);
        let mirrored = Manoeuvre { velocity: [0.7, -0.1, 0.2], rudders: &mirrored_rudders, ..there };
        for (axis, sign) in [(0, 1.0), (1, -1.0), (2, -1.0)] {
            assert_eq!(terms(axis, [2, 2]).count(), 12);
            for term in terms(axis, [2, 2]).filter(|term| axis == 0 || !matches!(term.part, Part::Propeller(_))) {
                assert_eq!(term.value(&mirrored), sign * term.value(&there), "{term:?}");
            }
        }
    }

    #[test]
    fn val_coefficients_have_the_units_of_an_acceleration() {
        // in units twice as long, an acceleration has half its number, and a coefficient as its unit says
        let scaled = |unit: &str| match unit {
            "m" => 0.5,
            "1/m" => 2.0,
            "1/m²" => 4.0,
            _ => 1.0,
        };
        let (propellers, rudders) = ([3.0], [0.2]);
        let there = Manoeuvre { velocity: [0.8, 0.1, -0.2], propellers: &propellers, rudders: &rudders };
        let longer = Manoeuvre { velocity: [0.4, 0.05, -0.2], ..there };
        for (axis, acceleration) in [(0, 0.5), (1, 0.5), (2, 1.0)] {
            for term in terms(axis, [1, 1]) {
                let there = acceleration * term.value(&there);
                let longer = scaled(term.unit(axis)) * term.value(&longer);
                assert!((there - longer).abs() < 1e-15 * there.abs().max(1.0), "{axis} {term:?}: {there} {longer}");
            }
        }
    }
}
