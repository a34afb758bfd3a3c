//! 4.3.2.3: ordinary, total and nullspace least squares in one degree of freedom, surge.
//!
//! m u̇ + d |u| u = β ω |ω|, open loop; u is measured with white noise, differentiated and low-passed, ω is known. The
//! scale is m, so the unknowns are d/m and β/m.

use super::{Kind, Measured, Study};
use hil_sim::rng::{Source, Stream};
use nalgebra::{Matrix3, Vector2, Vector3};
use std::f64::consts::TAU;

/// Three ways to solve the same equation.
pub const LEAST_SQUARES: Study = Study { name: "least-squares", kind: Kind::Own(run) };

/// Time between samples, s, and their number.
const PERIOD_S: f64 = 0.1;
const SAMPLES: usize = 20_000;
/// d/m (1/m) and β/m (m): the reference vehicle's surge, its fins' drag included.
const DRAG: f64 = 0.1;
const THRUST: f64 = 1.3e-5;
/// Samples of the sliding mean before and after the differences.
const SMOOTH: usize = 10;

fn run(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for (name, noise) in [("0 cm/s", 0.0), ("0.3 cm/s", 0.003), ("0.6 cm/s", 0.006), ("1.4 cm/s", 0.014)] {
        let rows = rows(seed, noise);
        for (method, [drag, thrust]) in [("OLS", ordinary(&rows)), ("TLS", total(&rows)), ("NBLS", nullspace(&rows))] {
            let row = format!("{method}, {name}");
            measured.set(&row, "drag_percent", 100.0 * (drag / DRAG - 1.0));
            measured.set(&row, "thrust_percent", 100.0 * (thrust / THRUST - 1.0));
        }
    }
    Ok(measured)
}

/// [u̇, |u| u, ω |ω|] at every sample.
fn rows(seed: u64, noise_mps: f64) -> Vec<Vector3<f64>> {
    let mut random = Stream::new(seed, Source::Dvl);
    let phase = TAU * random.uniform();
    let (mut u, mut measured, mut thrust) = (0.8, Vec::with_capacity(SAMPLES), Vec::with_capacity(SAMPLES));
    for k in 0..SAMPLES {
        let t = k as f64 * PERIOD_S;
        let omega: f64 = 110.0 + 40.0 * (TAU * t / 97.0 + phase).sin() + 15.0 * (TAU * t / 41.0).sin();
        measured.push(u + noise_mps * random.normal());
        thrust.push(omega * omega.abs());
        // Held for the period, as commands are.
        let slope = |u: f64| THRUST * omega * omega.abs() - DRAG * u.abs() * u;
        let (k1, h) = (slope(u), PERIOD_S);
        let k2 = slope(u + 0.5 * h * k1);
        let k3 = slope(u + 0.5 * h * k2);
        u += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(u + h * k3));
    }
    // The value at a sample is the mean of the commands before and after it.
    let held: Vec<f64> = (0..SAMPLES).map(|k| 0.5 * (thrust[k.saturating_sub(1)] + thrust[k])).collect();
    let (speed, thrust) = (smooth(&smooth(&measured)), smooth(&smooth(&held)));
    let inside = 2 * SMOOTH + 1..SAMPLES - 2 * SMOOTH - 1;
    inside
        .map(|k| {
            let acceleration = (speed[k + 1] - speed[k - 1]) / (2.0 * PERIOD_S);
            Vector3::new(acceleration, speed[k].abs() * speed[k], thrust[k])
        })
        .collect()
}

/// Mean of the samples around each; all signals pass through the same, so that linear relations survive.
fn smooth(values: &[f64]) -> Vec<f64> {
    let mean = |k: usize| {
        let window = &values[k.saturating_sub(SMOOTH)..(k + SMOOTH + 1).min(values.len())];
        window.iter().sum::<f64>() / window.len() as f64
    };
    (0..values.len()).map(mean).collect()
}

fn normal(rows: &[Vector3<f64>]) -> Matrix3<f64> {
    rows.iter().map(|row| row * row.transpose()).sum()
}

/// The acceleration alone is in error: u̇ explained by the other two.
fn ordinary(rows: &[Vector3<f64>]) -> [f64; 2] {
    let n = normal(rows);
    let solution = n.fixed_view::<2, 2>(1, 1).lu().solve(&Vector2::new(n[(0, 1)], n[(0, 2)]));
    solution.map_or([f64::NAN; 2], |x| [-x[0], x[1]])
}

/// All three are in error, by as much, each in its own unit as it stands.
fn total(rows: &[Vector3<f64>]) -> [f64; 2] {
    direction(&normal(rows), &Vector3::repeat(1.0))
}

/// The direction that the rows shrink most, all three in error in proportion to their size.
fn nullspace(rows: &[Vector3<f64>]) -> [f64; 2] {
    let n = normal(rows);
    direction(&n, &n.diagonal().map(f64::sqrt))
}

fn direction(normal: &Matrix3<f64>, length: &Vector3<f64>) -> [f64; 2] {
    let scaled = Matrix3::from_fn(|i, j| normal[(i, j)] / (length[i] * length[j]));
    let eigen = scaled.symmetric_eigen();
    let theta = eigen.eigenvectors.column(eigen.eigenvalues.imin()).component_div(length);
    [theta[1] / theta[0], -theta[2] / theta[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_without_noise_all_three_find_the_truth() {
        let rows = rows(1, 0.0);
        for [drag, thrust] in [ordinary(&rows), total(&rows), nullspace(&rows)] {
            // The sliding mean does not commute with |u| u, at the level of 1e-3 for these periods.
            assert!((drag / DRAG - 1.0).abs() < 5e-3 && (thrust / THRUST - 1.0).abs() < 5e-3, "{drag} {thrust}");
        }
    }
}
