//! One account of depth: the depth cell with a slow error, and pitch and speed that check it.
//!
//! ż = v + β: v = −u sin θ is what the nose says; β, its error, is the angle of attack and the AHRS' pitch. The depth
//! cell reads z + b. At the surface, where a fix is received, z is near zero whatever the cell says.

/// Slow errors of an entry.
#[derive(Clone, Copy)]
pub(super) struct Slow {
    /// One sigma of the cell's error at the start of a dive, m.
    pub(super) start_m: f64,
    /// One sigma of the cell's error, m, and its memory, s.
    pub(super) bias_m: f64,
    pub(super) memory_s: f64,
    /// Share of the hours.
    pub(super) rate: f64,
}

/// A pressure cell as its data sheet has it: 0.25 % of 100 m and the weather; and one that drifts, by 3 to 10 mm/s, is
/// wet or was not tared.
pub(super) const CELLS: [Slow; 2] = [
    Slow { start_m: 0.3, bias_m: 0.3, memory_s: 3600.0, rate: 1.0 },
    Slow { start_m: 1.0, bias_m: 15.0, memory_s: 7200.0, rate: 0.01 },
];

/// One sigma of the rate that pitch and speed leave out, m/s, and its memory, s: half a degree of pitch and an angle of
/// attack at 1 to 1.5 m/s.
const RATE_MPS: f64 = 0.02;
const RATE_S: f64 = 900.0;
/// √PSD of depth, m/√s: waves and turns.
const NOISE: f64 = 0.1;
/// One sigma of the depth at which a fix is received, m: the antenna is out of the water.
const SURFACE_M: f64 = 0.3;
/// Squared: a reading counts with so many sigmas at most.
const HUBER: f64 = 9.0;

/// Depth, error of the cell, error of the rate.
#[derive(Clone)]
pub(super) struct Vertical {
    x: [f64; 3],
    p: [[f64; 3]; 3],
}

impl Vertical {
    pub(super) const NEW: Self = Self { x: [0.0; 3], p: [[0.0; 3]; 3] };

    /// Starts at a reading of the cell at the surface.
    pub(super) fn start(&mut self, depth_m: f64, sigma_m: f64, slow: &Slow) {
        let bias = slow.start_m * slow.start_m;
        let rate = RATE_MPS * RATE_MPS;
        self.x = [depth_m, 0.0, 0.0];
        self.p = [[sigma_m * sigma_m + bias, -bias, 0.0], [-bias, bias, 0.0], [0.0, 0.0, rate]];
    }

    pub(super) fn predict(&mut self, step_s: f64, nose_m: f64, slow: &Slow) {
        let Self { x, p } = self;
        x[0] += nose_m + step_s * x[2];
        for j in 0..3 {
            p[0][j] += step_s * p[2][j];
        }
        for row in p.iter_mut() {
            row[0] += step_s * row[2];
        }
        let kept = [1.0, libm::exp(-step_s / slow.memory_s), libm::exp(-step_s / RATE_S)];
        let variance = [0.0, slow.bias_m * slow.bias_m, RATE_MPS * RATE_MPS];
        for i in 0..3 {
            x[i] *= kept[i];
            for j in 0..3 {
                p[i][j] *= kept[i] * kept[j];
            }
            p[i][i] += variance[i] * (1.0 - kept[i] * kept[i]);
        }
        p[0][0] += NOISE * NOISE * step_s;
    }

    /// A reading of the cell.
    pub(super) fn cell(&mut self, depth_m: f64, sigma_m: f64) {
        self.correct([1.0, 1.0, 0.0], depth_m - self.x[0] - self.x[1], sigma_m * sigma_m);
    }

    /// A fix was received.
    pub(super) fn surfaced(&mut self) {
        self.correct([1.0, 0.0, 0.0], -self.x[0], SURFACE_M * SURFACE_M);
    }

    fn correct(&mut self, row: [f64; 3], innovation: f64, variance: f64) {
        let by_state = self.p.map(|of_state| of_state.iter().zip(row).map(|(p, h)| p * h).sum::<f64>());
        let predicted: f64 = by_state.iter().zip(row).map(|(p, h)| p * h).sum();
        let total = (predicted + variance).max(innovation * innovation / HUBER);
        for i in 0..3 {
            let gain = by_state[i] / total;
            self.x[i] += gain * innovation;
            for j in 0..3 {
                self.p[i][j] -= gain * by_state[j];
            }
        }
    }

    /// Distance of a depth from the account's, and one sigma of it, m.
    pub(super) fn apart(&self, depth_m: f64) -> (f64, f64) {
        ((depth_m - self.x[0]).abs(), libm::sqrt(self.p[0][0]))
    }
}
