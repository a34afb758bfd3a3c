//! Surge and yaw alone, of a log that knows speed, heading and servo counts but neither propeller speed nor fin angles.
//!
//! u̇ = k n|n| − d2 |u| u − d1 u and ṙ = −(a0 + a1 |u|) r + b |u| u (δ − δ0), ψ̇ = r; n and δ in counts. Forces are not
//! measured: all coefficients are per mass and per inertia, and with a declared vehicle k and b give what a count is
//! worth. The rudder's moment per inertia contains sway, which nothing measures.
//!
//! The fit is an output-error fit over segments of some 20 s, each with its own start.

use backseat_core::dynamics::VehicleParameters;
use backseat_core::state::wrap_angle;
use backseat_identify::IdentifyError;
use backseat_logs::stats::{Z_95, rms};
use backseat_logs::{Column, Log};
use nalgebra::{DMatrix, DVector};

/// Number of coefficients.
pub const COEFFICIENTS: usize = 7;
/// Names of the coefficients.
pub const NAMES: [&str; COEFFICIENTS] = [
    "surge_thrust_per_count2",
    "surge_quadratic_drag",
    "surge_linear_drag",
    "yaw_damping",
    "yaw_damping_by_speed",
    "yaw_per_count",
    "rudder_offset",
];
/// Their units.
pub const UNITS: [&str; COEFFICIENTS] = ["m/s² per count²", "1/m", "1/s", "1/s", "1/m", "rad/m² per count", "count"];

/// Length of a fitted segment, samples.
const SEGMENT: usize = 20;
/// Longer between two samples is a gap, s.
const GAP_S: f64 = 3.0;
/// A speed that keeps its last digit so often is not a measurement but the commanded speed.
const FROZEN: usize = 5;
/// Steps of the integration in one interval.
const STEPS: usize = 5;
/// Where the fit starts, and how far from it the coefficients plausibly lie: those of a two-metre torpedo.
const START: [f64; COEFFICIENTS] = [5.0e-5, 0.1, 0.05, 0.3, 0.3, 2.0e-3, 0.0];
const PLAUSIBLE: [f64; COEFFICIENTS] = [5.0e-4, 1.0, 0.5, 1.0, 2.0, 2.0e-2, 100.0];

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SurgeYawSample {
    time_s: f64,
    /// Not where it is frozen.
    surge_mps: Option<f64>,
    /// Unwrapped.
    heading_rad: f64,
    motor: f64,
    rudder: f64,
}

/// Surge, heading and counts of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurgeYawData {
    samples: Vec<SurgeYawSample>,
}

/// Coefficients with confidence.
#[derive(Clone, Debug, PartialEq)]
pub struct SurgeYawEstimate {
    /// In the order of [`NAMES`].
    pub coefficients: [f64; COEFFICIENTS],
    /// 95 % intervals from the residuals' scatter.
    pub ci95: [[f64; 2]; COEFFICIENTS],
    /// Root mean square residual of speed, m/s, and heading, rad, within the segments.
    pub residual: [f64; 2],
    /// Samples fitted.
    pub samples: usize,
}

/// Errors at one horizon, root mean square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Horizon, s.
    pub horizon_s: f64,
    /// Speed: the model's and that of a speed which stays, m/s.
    pub surge_mps: [f64; 2],
    /// Heading: the model's and that of a yaw rate which stays, rad.
    pub heading_rad: [f64; 2],
    /// Number of predictions.
    pub count: usize,
}

impl SurgeYawData {
    /// Takes it from a log.
    pub fn from_log(log: &Log) -> Self {
        let mut samples: Vec<SurgeYawSample> = Vec::new();
        for row in &log.rows {
            let (Some(speed), Some(heading), Some(motor), Some(rudder)) = (
                row.get(Column::SpeedLog),
                row.get(Column::Heading),
                row.get(Column::PropCount),
                row.get(Column::YawFinCount),
            ) else {
                continue;
            };
            let heading_rad =
                samples.last().map_or(heading, |last| last.heading_rad + wrap_angle(heading - last.heading_rad));
            let time_s = row.time_us as f64 * 1.0e-6;
            if samples.last().is_none_or(|last| time_s > last.time_s) {
                samples.push(SurgeYawSample { time_s, surge_mps: Some(speed), heading_rad, motor, rudder });
            }
        }
        let speeds: Vec<Option<f64>> = samples.iter().map(|sample| sample.surge_mps).collect();
        for from in 0..samples.len() {
            let run = speeds[from..].iter().take_while(|speed| **speed == speeds[from]).count();
            if run >= FROZEN {
                samples[from..from + run].iter_mut().for_each(|sample| sample.surge_mps = None);
            }
        }
        Self { samples }
    }

    /// The first share, and the rest.
    pub fn split(&self, share: f64) -> [Self; 2] {
        let cut = (self.samples.len() as f64 * share) as usize;
        [&self.samples[..cut], &self.samples[cut..]].map(|part| Self { samples: part.to_vec() })
    }

    /// Runs of samples without a gap and with a measured speed.
    fn runs(&self) -> Vec<&[SurgeYawSample]> {
        let fits = |pair: &[SurgeYawSample; 2]| {
            pair.iter().all(|sample| sample.surge_mps.is_some()) && pair[1].time_s - pair[0].time_s < GAP_S
        };
        self.samples.chunk_by(|a, b| fits(&[*a, *b])).filter(|run| run.len() > 3).collect()
    }

    /// Fits the coefficients.
    ///
    /// # Errors
    /// If too little was measured, or the data do not determine the parameters.
    pub fn fit(&self) -> Result<SurgeYawEstimate, IdentifyError> {
        let segments: Vec<&[SurgeYawSample]> =
            self.runs().into_iter().flat_map(|run| run.chunks(SEGMENT)).filter(|s| s.len() > 5).collect();
        if segments.len() < 5 {
            return Err(IdentifyError::Degenerate(
                "surge and yaw: less than 100 s of measured speed without gaps".into(),
            ));
        }
        let unknowns = COEFFICIENTS + 3 * segments.len();
        let mut x = DVector::zeros(unknowns);
        x.as_mut_slice()[..COEFFICIENTS].copy_from_slice(&START);
        for (index, segment) in segments.iter().enumerate() {
            let [u, psi, r] = start(segment, 1);
            x.as_mut_slice()[COEFFICIENTS + 3 * index..][..3].copy_from_slice(&[u, psi, r]);
        }
        let mut sigma = [0.05, 0.05];
        let mut damping = 1.0e-2;
        let mut covariance = DMatrix::zeros(unknowns, unknowns);
        for _ in 0..40 {
            let (matrix, right, cost) = normal(&segments, &x, sigma);
            let mut damped = matrix.clone();
            for i in 0..unknowns {
                damped[(i, i)] *= 1.0 + damping;
            }
            let Some(factor) = damped.cholesky() else {
                return Err(IdentifyError::Degenerate(
                    "surge and yaw: the data do not determine the parameters".into(),
                ));
            };
            let mut next = &x + factor.solve(&right);
            // Drag and thrust oppose and drive.
            for j in 0..5 {
                next[j] = next[j].max(0.0);
            }
            let [squares, count] = residuals(&segments, &next);
            let trial = squares[0] / (sigma[0] * sigma[0]) + squares[1] / (sigma[1] * sigma[1]) + prior_cost(&next);
            if trial < cost {
                x = next;
                damping = (damping * 0.2_f64).max(1.0e-9);
                sigma = core::array::from_fn(|i| (squares[i] / count[i]).sqrt().max(1.0e-4));
            } else {
                damping *= 10.0;
                if damping > 1.0e6 {
                    break;
                }
            }
        }
        let (matrix, ..) = normal(&segments, &x, sigma);
        if let Some(factor) = matrix.cholesky() {
            covariance = factor.inverse();
        }
        let coefficients = core::array::from_fn(|j| x[j]);
        let ci95 = core::array::from_fn(|j| {
            let reach = Z_95 * covariance[(j, j)].max(0.0).sqrt();
            [x[j] - reach, x[j] + reach]
        });
        let samples = segments.iter().map(|segment| segment.len()).sum();
        Ok(SurgeYawEstimate { coefficients, ci95, residual: sigma, samples })
    }

    /// Predicts over a horizon from every fifth sample, from what was measured until then.
    pub fn predict(&self, coefficients: &[f64; COEFFICIENTS], horizon_s: f64) -> Option<Prediction> {
        let mut errors: [Vec<f64>; 4] = Default::default();
        for run in self.runs() {
            for from in (2..run.len()).step_by(5) {
                let [_, _, r] = start(&run[from - 2..], 2);
                let now = &run[from..];
                let until = now.iter().take_while(|s| s.time_s <= now[0].time_s + horizon_s + 0.5).count();
                let last = &now[until - 1];
                if last.time_s < now[0].time_s + horizon_s - 0.5 {
                    continue;
                }
                let first = now[0];
                let state = [first.surge_mps?, first.heading_rad, r];
                let end = *simulate(coefficients, state, &now[..until]).last()?;
                let speed = last.surge_mps?;
                let elapsed = last.time_s - first.time_s;
                errors[0].push(end[0] - speed);
                errors[1].push(state[0] - speed);
                errors[2].push(wrap_angle(end[1] - last.heading_rad));
                errors[3].push(wrap_angle(first.heading_rad + r * elapsed - last.heading_rad));
            }
        }
        let count = errors[0].len();
        let [a, b, c, d] = errors.map(|values| rms(&values));
        Some(Prediction { horizon_s, surge_mps: [a?, b?], heading_rad: [c?, d?], count })
    }
}

impl SurgeYawEstimate {
    /// What a count is worth if this were the declared vehicle: rad/s of the propeller, rad of the rudder.
    pub fn counts(&self, vehicle: &VehicleParameters) -> [f64; 2] {
        let [k, _, _, _, _, b, _] = self.coefficients;
        let propeller = (k * vehicle.m_diag[0] / vehicle.beta5_n_s2_per_rad2).max(0.0).sqrt();
        // Top and bottom fin together, per rad and squared speed.
        let per_fin = 0.5 * vehicle.rho_kg_per_m3 * vehicle.fin_area_m2 * vehicle.cl[0];
        let moment: f64 = vehicle.fins.iter().take(2).map(|fin| per_fin * fin.cp_m[0].abs()).sum();
        [propeller, b.abs() * vehicle.m_diag[5] / moment]
    }
}

/// Speed, heading and yaw rate at the sample `at`; the rate is that of the samples around it (`at` 1) or before (`at`
/// 2).
fn start(samples: &[SurgeYawSample], at: usize) -> [f64; 3] {
    let first = samples[0];
    let Some(last) = samples.get(2).or(samples.last()) else { return [0.0; 3] };
    let rate = (last.heading_rad - first.heading_rad) / (last.time_s - first.time_s).max(0.1);
    let here = if at == 1 { &first } else { last };
    [here.surge_mps.unwrap_or(0.0), here.heading_rad, rate]
}

fn derivative(c: &[f64; COEFFICIENTS], [u, _, r]: [f64; 3], sample: &SurgeYawSample) -> [f64; 3] {
    let [k, d2, d1, a0, a1, b, offset] = *c;
    let n = sample.motor;
    [
        k * n * n.abs() - (d2 * u.abs() + d1) * u,
        r,
        -(a0 + a1 * u.abs()) * r + b * u.abs() * u * (sample.rudder - offset),
    ]
}

/// The states at the samples; counts are held between them.
fn simulate(c: &[f64; COEFFICIENTS], start: [f64; 3], samples: &[SurgeYawSample]) -> Vec<[f64; 3]> {
    let moved = |x: [f64; 3], slope: [f64; 3], by: f64| core::array::from_fn(|i| x[i] + slope[i] * by);
    let mut x = start;
    let mut states = vec![x];
    for pair in samples.windows(2) {
        let dt = (pair[1].time_s - pair[0].time_s) / STEPS as f64;
        for _ in 0..STEPS {
            // The midpoint rule: time constants are seconds, dt a fifth of one.
            let middle: [f64; 3] = moved(x, derivative(c, x, &pair[0]), 0.5 * dt);
            x = moved(x, derivative(c, middle, &pair[0]), dt);
        }
        states.push(x);
    }
    states
}

/// Weighted residuals of one segment: speed and heading of every sample.
fn segment_residuals(c: &[f64; COEFFICIENTS], start: [f64; 3], segment: &[SurgeYawSample]) -> Vec<[f64; 2]> {
    simulate(c, start, segment)
        .iter()
        .zip(segment)
        .map(|(x, sample)| [sample.surge_mps.map_or(0.0, |speed| speed - x[0]), sample.heading_rad - x[1]])
        .collect()
}

fn unpack(x: &DVector<f64>, segment: usize) -> ([f64; COEFFICIENTS], [f64; 3]) {
    (core::array::from_fn(|j| x[j]), core::array::from_fn(|j| x[COEFFICIENTS + 3 * segment + j]))
}

fn residuals(segments: &[&[SurgeYawSample]], x: &DVector<f64>) -> [[f64; 2]; 2] {
    let (mut squares, mut count) = ([0.0; 2], [0.0; 2]);
    for (index, segment) in segments.iter().enumerate() {
        let (c, start) = unpack(x, index);
        for residual in segment_residuals(&c, start, segment) {
            for i in 0..2 {
                squares[i] += residual[i] * residual[i];
                count[i] += 1.0;
            }
        }
    }
    [squares, count]
}

fn prior_cost(x: &DVector<f64>) -> f64 {
    (0..COEFFICIENTS).map(|j| ((x[j] - START[j]) / PLAUSIBLE[j]).powi(2)).sum()
}

/// Normal equations with sensitivities by differences, and the cost.
fn normal(segments: &[&[SurgeYawSample]], x: &DVector<f64>, sigma: [f64; 2]) -> (DMatrix<f64>, DVector<f64>, f64) {
    const LOCAL: usize = COEFFICIENTS + 3;
    let n = x.len();
    let (mut matrix, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut cost = prior_cost(x);
    for j in 0..COEFFICIENTS {
        matrix[(j, j)] += PLAUSIBLE[j].powi(-2);
        right[j] += (START[j] - x[j]) * PLAUSIBLE[j].powi(-2);
    }
    let steps: [f64; LOCAL] = core::array::from_fn(|j| 1.0e-5 * PLAUSIBLE.get(j).copied().unwrap_or(1.0));
    for (index, segment) in segments.iter().enumerate() {
        let (c, start) = unpack(x, index);
        let base = segment_residuals(&c, start, segment);
        let columns: Vec<Vec<[f64; 2]>> = (0..LOCAL)
            .map(|j| {
                let (mut c, mut start) = (c, start);
                if j < COEFFICIENTS {
                    c[j] += steps[j]
                } else {
                    start[j - COEFFICIENTS] += steps[j]
                }
                segment_residuals(&c, start, segment)
            })
            .collect();
        let place = |j: usize| if j < COEFFICIENTS { j } else { COEFFICIENTS + 3 * index + j - COEFFICIENTS };
        for (k, residual) in base.iter().enumerate() {
            for output in 0..2 {
                let weight = sigma[output].powi(-2);
                let slope: [f64; LOCAL] =
                    core::array::from_fn(|j| -(columns[j][k][output] - residual[output]) / steps[j]);
                cost += weight * residual[output] * residual[output];
                for i in 0..LOCAL {
                    right[place(i)] += weight * slope[i] * residual[output];
                    for j in 0..LOCAL {
                        matrix[(place(i), place(j))] += weight * slope[i] * slope[j];
                    }
                }
            }
        }
    }
    for i in 0..n {
        matrix[(i, i)] += 1.0e-9;
    }
    (matrix, right, cost)
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::LogRow;

    #[test]
    fn coefficients_of_a_simulated_log_come_back() {
        let truth = [6.0e-5, 0.12, 0.02, 0.2, 0.4, -3.0e-3, 6.0];
        let samples: Vec<SurgeYawSample> = (0..900)
            .map(|k| {
                let t = f64::from(k);
                SurgeYawSample {
                    time_s: t,
                    surge_mps: Some(0.0),
                    heading_rad: 0.0,
                    motor: 35.0 + 15.0 * (t / 60.0).sin().signum(),
                    rudder: 40.0 * (t / 9.0).sin() + 20.0 * (t / 23.0).sin(),
                }
            })
            .collect();
        let states = simulate(&truth, [0.3, 0.0, 0.0], &samples);
        let rows = samples.iter().zip(&states).enumerate().map(|(k, (sample, x))| {
            // Noise of 1 cm/s and 0.2 degrees that repeats, so that the test does.
            let wobble = |period: f64| (k as f64 * period).sin();
            let mut row = LogRow::new((sample.time_s * 1.0e6) as u64);
            row.set(Column::SpeedLog, x[0] + 0.014 * wobble(2.3))
                .set(Column::Heading, wrap_angle(x[1] + 0.005 * wobble(1.7)))
                .set(Column::PropCount, sample.motor)
                .set(Column::YawFinCount, sample.rudder);
            row
        });
        let log = Log { rows: rows.collect(), ..Log::default() };
        let [first, rest] = SurgeYawData::from_log(&log).split(0.6);
        let fit = first.fit().unwrap();
        // Noise of a hundredth of the signal: thrust, rudder and damping to some percent.
        for j in [0, 5] {
            assert!((fit.coefficients[j] / truth[j] - 1.0).abs() < 0.1, "{}: {:?}", NAMES[j], fit.coefficients);
        }
        let prediction = rest.predict(&fit.coefficients, 10.0).unwrap();
        assert!(prediction.surge_mps[0] < 0.03 && prediction.heading_rad[0] < 0.3 * prediction.heading_rad[1]);
    }

    #[test]
    fn a_frozen_speed_is_no_measurement() {
        let rows = (0..20).map(|k| {
            let mut row = LogRow::new(k * 1_000_000);
            let speed = if k < 10 { 0.5 } else { 0.5 + 0.01 * k as f64 };
            row.set(Column::SpeedLog, speed).set(Column::Heading, 0.0);
            row.set(Column::PropCount, 20.0).set(Column::YawFinCount, 0.0);
            row
        });
        let data = SurgeYawData::from_log(&Log { rows: rows.collect(), ..Log::default() });
        assert_eq!(data.samples.iter().filter(|sample| sample.surge_mps.is_some()).count(), 10);
    }
}
