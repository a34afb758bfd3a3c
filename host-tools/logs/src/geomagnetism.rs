//! The declination of the compass by the International Geomagnetic Reference Field, IGRF-14.
//!
//! V = a Σ_n (a/r)^(n+1) Σ_m (g cos mλ + h sin mλ) P_n^m(cos θ) in Schmidt's normalisation, B = −∇V, at the ellipsoid.
//! Degrees to 10 of 13: the rest, the crust and magnetic storms turn the needle by some tenths of a degree.

use std::f64::consts::FRAC_PI_2;

/// Degree, order (negative of h), and coefficients at the years of the first row, nT.
const TABLE: &str = include_str!("geomagnetism_igrf14.txt");
const DEGREE: usize = 10;
/// Radius of the model's sphere, and axes of the ellipsoid WGS 84, km.
const SPHERE_KM: f64 = 6371.2;
const AXES_KM: [f64; 2] = [6378.137, 6356.752];

/// Declination at sea level, rad, positive east; `None` outside the years 2000 to 2030.
#[must_use]
pub fn declination_rad(latitude_deg: f64, longitude_deg: f64, year: f64) -> Option<f64> {
    let [north, east] = field_nt(latitude_deg, longitude_deg, year)?;
    Some(east.atan2(north))
}

/// North and east part of the field, nT.
fn field_nt(latitude_deg: f64, longitude_deg: f64, year: f64) -> Option<[f64; 2]> {
    let mut rows = TABLE.lines().filter(|line| !line.starts_with('#'));
    let years: Vec<f64> = numbers(rows.next()?);
    let place = years.windows(2).position(|pair| (pair[0]..=pair[1]).contains(&year))?;
    let share = (year - years[place]) / (years[place + 1] - years[place]);
    let (latitude, longitude) = (latitude_deg.to_radians(), longitude_deg.to_radians());
    // From the ellipsoid's normal to the centre's.
    let [a2, b2] = AXES_KM.map(|axis| axis * axis);
    let normal = a2 / (a2 * latitude.cos().powi(2) + b2 * latitude.sin().powi(2)).sqrt();
    let (x, z) = (normal * latitude.cos(), normal * b2 / a2 * latitude.sin());
    let (radius_km, geocentric) = (x.hypot(z), z.atan2(x));
    let (p, dp) = legendre((FRAC_PI_2 - geocentric).sin_cos());
    let (mut north, mut east, mut down) = (0.0, 0.0, 0.0);
    for row in rows.map(numbers) {
        let (n, order) = (row[0] as usize, row[1]);
        let (m, value) = (order.abs() as usize, row[2 + place] + share * (row[3 + place] - row[2 + place]));
        let (sin, cos) = (m as f64 * longitude).sin_cos();
        let (along, across) = if order < 0.0 { (sin, -cos) } else { (cos, sin) };
        let far = value * (SPHERE_KM / radius_km).powi(n as i32 + 2);
        north += far * along * dp[n][m];
        east += far * across * m as f64 * p[n][m] / geocentric.cos();
        down -= far * along * (n + 1) as f64 * p[n][m];
    }
    let (sin, cos) = (geocentric - latitude).sin_cos();
    Some([north * cos - down * sin, east])
}

/// Numbers of a row that has nothing else.
fn numbers(row: &str) -> Vec<f64> {
    row.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

type Functions = [[f64; DEGREE + 1]; DEGREE + 1];

/// P_n^m(cos θ) and its derivative by θ, by recursion over the degree.
fn legendre((sin, cos): (f64, f64)) -> (Functions, Functions) {
    let (mut p, mut dp) = ([[0.0; DEGREE + 1]; DEGREE + 1], [[0.0; DEGREE + 1]; DEGREE + 1]);
    p[0][0] = 1.0;
    for n in 1..=DEGREE {
        let k = if n == 1 { 1.0 } else { (1.0 - 0.5 / n as f64).sqrt() };
        p[n][n] = k * sin * p[n - 1][n - 1];
        dp[n][n] = k * (sin * dp[n - 1][n - 1] + cos * p[n - 1][n - 1]);
        for m in 0..n {
            let root = |n: usize| (n * n - m * m) as f64;
            let odd = (2 * n - 1) as f64;
            let (before, slope) = if n > m + 1 { (p[n - 2][m], dp[n - 2][m]) } else { (0.0, 0.0) };
            let less = root(n - 1).sqrt();
            p[n][m] = (odd * cos * p[n - 1][m] - less * before) / root(n).sqrt();
            dp[n][m] = (odd * (cos * dp[n - 1][m] - sin * p[n - 1][m]) - less * slope) / root(n).sqrt();
        }
    }
    (p, dp)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test values of NOAA's World Magnetic Model 2020, another model of the same field; the poles are where a tenth of a
    /// per cent of the field is most of a degree.
    /// From the README of the coefficients of the World Magnetic Model 2020 (NOAA and British Geological Survey, 10
    /// December 2019). They are of 66, 18, 6 and 63 km of height, from which to the sea the declination changes by less than
    /// 0.06 degrees (ppigrf).
    #[test]
    fn val_test_values_of_the_world_magnetic_model() {
        for (latitude, longitude, year, expected) in [
            (14.0, 143.0, 2020.0, 0.12),
            (0.0, 21.0, 2020.0, 1.05),
            (-36.0, -137.0, 2020.5, 20.16),
            (26.0, 81.0, 2020.5, 0.43),
        ] {
            let found = declination_rad(latitude, longitude, year).unwrap().to_degrees();
            assert!((found - expected).abs() < 0.3, "{latitude} {longitude} {year}: {found}");
        }
    }

    /// By the program ppigrf 2.1.0 of IAGA, all thirteen degrees.
    #[test]
    fn val_another_program() {
        for (latitude, longitude, year, expected) in [
            (25.91, -80.14, 2022.764, -7.115),
            (33.74, -118.12, 2022.433, 11.588),
            (54.745, 15.10, 2016.475, 4.328),
            (-33.9, 18.4, 2012.5, -24.616),
            (70.0, -50.0, 2027.0, -26.857),
            (-45.0, 170.5, 2005.0, 24.079),
            (80.0, 0.0, 2020.0, -1.315),
            (0.0, 120.0, 2020.0, 0.147),
            (-80.0, 240.0, 2020.0, 69.327),
        ] {
            let found = declination_rad(latitude, longitude, year).unwrap().to_degrees();
            assert!((found - expected).abs() < 0.3, "{latitude} {longitude} {year}: {found}");
        }
        assert_eq!(declination_rad(0.0, 0.0, 1999.0), None);
    }
}
