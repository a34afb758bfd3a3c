//! The board's dynamics with the terms of short runs, and what the sensors of such a run read.

use super::recording::{Run, RunSample, Window};
use backseat_core::dynamics::{ActuatorInput, ParameterError, VehicleModel, VehicleParameters};
use backseat_core::state::{P, PHI, PSI, Q, R, THETA, U, V, VehicleState, W, Z};
use backseat_logs::short_runs::{COMMON, OF_CONFIGURATION};
use nalgebra::Vector3;

/// Longest step of the integration, s: the roll damping of fins at 2 m/s has a time constant of 0.1 s.
const STEP_S: f64 = 0.125;
/// Times that differ by less are one, s.
const SHORTEST_S: f64 = 1e-9;
/// Beyond these a run has diverged: pitch in rad, rates in rad/s, speed in m/s.
const MOST: [f64; 3] = [1.5, 12.0, 12.0];

/// Places in [`COMMON`].
pub(crate) mod common {
    pub(crate) const FIN_DELAY: usize = 0;
    pub(crate) const PROPELLER_DELAY: usize = 1;
    pub(crate) const ATTITUDE_DELAY: usize = 2;
    pub(crate) const AHRS_TILT: usize = 3;
}

/// How the DVL reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dvl {
    /// s.
    pub delay_s: f64,
    /// Turn about the vertical, rad.
    pub yaw_rad: f64,
    /// It reads (1 + scale) times the velocity.
    pub scale: f64,
}

impl Dvl {
    /// Surge, sway, heave as it reads them, m/s.
    fn reading(&self, x: &VehicleState) -> [f64; 3] {
        let (sin, cos) = self.yaw_rad.sin_cos();
        [cos * x[U] + sin * x[V], cos * x[V] - sin * x[U], x[W]].map(|v| v * (1.0 + self.scale))
    }
}

/// What predicts one configuration's runs.
#[derive(Clone, Debug)]
pub struct RunModel {
    vehicle: VehicleModel,
    terms: [f64; COMMON.len()],
    dvl: Dvl,
}

/// What the sensors of a sample read by the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Roll, pitch, heading, rad.
    pub attitude_rad: [f64; 3],
    /// m.
    pub depth_m: f64,
    /// Surge, sway, heave, m/s; `None` before the first that the prediction reaches.
    pub dvl_mps: Option<[f64; 3]>,
}

/// What a configuration adds to the plant.
pub fn add_to_plant(plant: &mut VehicleParameters, of_configuration: &[f64; OF_CONFIGURATION.len()]) {
    let [k_uu, m_uu, n_uu, b_x_m, b_y_m, buoyancy_kg, rudder_gain] = of_configuration;
    plant.moment_uu.iter_mut().zip([k_uu, m_uu, n_uu]).for_each(|(moment, add)| *moment += add);
    plant.b_cb_to_cg_m[0] += b_x_m;
    plant.b_cb_to_cg_m[1] += b_y_m;
    plant.displaced_mass_kg += buoyancy_kg;
    plant.fins[..2].iter_mut().for_each(|rudder| rudder.gain += rudder_gain);
}

impl RunModel {
    /// From parameters, terms, and what the configuration adds to the parameters.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn new(
        parameters: &VehicleParameters,
        terms: [f64; COMMON.len()],
        of_configuration: &[f64; OF_CONFIGURATION.len()],
        dvl: Dvl,
    ) -> Result<Self, ParameterError> {
        let mut parameters = *parameters;
        add_to_plant(&mut parameters, of_configuration);
        Ok(Self { vehicle: VehicleModel::new(&parameters)?, terms, dvl })
    }

    /// How the DVL reads.
    pub const fn dvl(&self) -> Dvl {
        self.dvl
    }

    /// The dynamics.
    pub const fn vehicle(&self) -> &VehicleModel {
        &self.vehicle
    }

    fn step(&self, x: &VehicleState, h_s: f64, input: &ActuatorInput) -> VehicleState {
        let rate = |x: &VehicleState| self.vehicle.derivative(x, input);
        let a = rate(x);
        let b = rate(&(x + a * (0.5 * h_s)));
        let c = rate(&(x + b * (0.5 * h_s)));
        let d = rate(&(x + c * h_s));
        x + (a + (b + c) * 2.0 + d) * (h_s / 6.0)
    }

    /// The readings of every sample of a window from the state at its first; `None` where it diverged.
    pub fn predict(&self, run: &Run, window: Window, start: &VehicleState) -> Vec<Option<Reading>> {
        let samples = &run.samples[window.first..=window.last];
        let mut trail: Vec<(f64, VehicleState)> = vec![(samples[0].t_s, *start)];
        let mut reached = samples.len();
        for (place, pair) in samples.windows(2).enumerate() {
            let mut x = trail[trail.len() - 1].1;
            for [from_s, to_s] in self.steps(run, [pair[0].t_s, pair[1].t_s]) {
                x = self.step(&x, to_s - from_s, &self.input(run, 0.5 * (from_s + to_s)));
                trail.push((to_s, x));
            }
            let speed = x.fixed_rows::<3>(U).norm();
            let rates = x.fixed_rows::<3>(P).norm();
            if !(x[THETA].abs() < MOST[0] && rates < MOST[1] && speed < MOST[2]) {
                reached = place + 1;
                break;
            }
        }
        // after the integration: what is early is read from a state that comes after its row
        let reading =
            |(place, sample): (usize, &RunSample)| (place < reached).then(|| self.reading(run, &trail, sample.t_s));
        samples.iter().enumerate().map(reading).collect()
    }

    /// Motion over a step with the attitude and rates that were measured at its start, not the model's own: what a
    /// navigator does without a DVL.
    pub fn carried(&self, run: &Run, x: &VehicleState, span_s: [f64; 2]) -> VehicleState {
        let steps = self.steps(run, span_s);
        steps.fold(*x, |x, [from_s, to_s]| self.step(&x, to_s - from_s, &self.input(run, 0.5 * (from_s + to_s))))
    }

    /// Steps of the integration over a span, from and to, s. One ends wherever a fin's command comes into force: with a
    /// step across it, what stalls and saturates would be asked of an angle that the fin never has, and the cost of a fit
    /// would have a minimum at each delay that is a whole number of steps.
    fn steps(&self, run: &Run, [from_s, to_s]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        let fin_s = self.terms[common::FIN_DELAY];
        let mut at_s = from_s;
        let pieces = core::iter::from_fn(move || {
            let next = run.samples.partition_point(|sample| sample.t_s + fin_s <= at_s + SHORTEST_S);
            let until_s = run.samples.get(next).map_or(to_s, |sample| (sample.t_s + fin_s).min(to_s));
            let piece = (at_s < to_s).then_some([at_s, until_s]);
            at_s = until_s;
            piece
        });
        pieces.flat_map(|[from_s, to_s]| {
            let steps = ((to_s - from_s) / STEP_S - SHORTEST_S).ceil().max(1.0);
            let at = move |step: usize| from_s + (to_s - from_s) * (step as f64 / steps);
            (0..steps as usize).map(move |step| [at(step), at(step + 1)])
        })
    }

    /// What the sensors read at a time.
    fn reading(&self, run: &Run, trail: &[(f64, VehicleState)], t_s: f64) -> Reading {
        let at = |t_s: f64| interpolated(trail, t_s);
        let attitude_s = t_s - self.terms[common::ATTITUDE_DELAY];
        let x = at(attitude_s);
        let mut attitude_rad = [x[PHI], x[THETA], x[PSI]];
        let tilt = self.terms[common::AHRS_TILT];
        if tilt != 0.0 {
            let [roll, pitch] = self.apparent(&x, &self.input(run, attitude_s));
            attitude_rad[0] += tilt * (roll - x[PHI]);
            attitude_rad[1] += tilt * (pitch - x[THETA]);
        }
        let depth_m = at(t_s)[Z];
        let dvl_s = t_s - self.dvl.delay_s;
        let dvl_mps = (dvl_s >= trail[0].0 - SHORTEST_S && t_s > trail[0].0).then(|| self.dvl.reading(&at(dvl_s)));
        Reading { attitude_rad, depth_m, dvl_mps }
    }

    /// Surge and sway that the DVL reads at a time, by a trail of states; of its start before that, m/s.
    pub fn dvl_of(&self, trail: &[(f64, VehicleState)], t_s: f64) -> [f64; 2] {
        let [u, v, _] = self.dvl.reading(&interpolated(trail, t_s - self.dvl.delay_s));
        [u, v]
    }

    /// Roll and pitch of the specific force, as accelerometers have them.
    fn apparent(&self, x: &VehicleState, input: &ActuatorInput) -> [f64; 2] {
        let rate = self.vehicle.derivative(x, input);
        let g = self.vehicle.parameters().g_mps2;
        let velocity = Vector3::new(x[U], x[V], x[W]);
        let rates = Vector3::new(x[P], x[Q], x[R]);
        let acceleration = Vector3::new(rate[U], rate[V], rate[W]) + rates.cross(&velocity);
        let (sin_roll, cos_roll) = x[PHI].sin_cos();
        let (sin_pitch, cos_pitch) = x[THETA].sin_cos();
        let gravity = Vector3::new(-sin_pitch, sin_roll * cos_pitch, cos_roll * cos_pitch) * g;
        let felt = gravity - acceleration;
        [felt.y.atan2(felt.z), (-felt.x).atan2(felt.y.hypot(felt.z))]
    }

    /// Input at a time: fins hold, the propeller's speed moves on between rows.
    fn input(&self, run: &Run, t_s: f64) -> ActuatorInput {
        let fins_rad = run.samples[sample_at(run, t_s - self.terms[common::FIN_DELAY])].input.fins_rad;
        let propeller_radps = interpolated_speed(run, t_s - self.terms[common::PROPELLER_DELAY]);
        ActuatorInput { propeller_radps, fins_rad }
    }
}

/// Index of the last sample at or before a time; the first before all.
fn sample_at(run: &Run, t_s: f64) -> usize {
    run.samples.partition_point(|sample| sample.t_s <= t_s).saturating_sub(1)
}

/// Propeller speed between rows.
fn interpolated_speed(run: &Run, t_s: f64) -> f64 {
    let index = sample_at(run, t_s);
    let here = &run.samples[index];
    let Some(next) = run.samples.get(index + 1).filter(|next| next.t_s > here.t_s) else {
        return here.input.propeller_radps;
    };
    let share = ((t_s - here.t_s) / (next.t_s - here.t_s)).clamp(0.0, 1.0);
    here.input.propeller_radps + share * (next.input.propeller_radps - here.input.propeller_radps)
}

/// The state at a time of a trail; its start before it, and on along its last step after it.
fn interpolated(trail: &[(f64, VehicleState)], t_s: f64) -> VehicleState {
    let next = trail.partition_point(|(time_s, _)| *time_s <= t_s).min(trail.len() - 1);
    if next == 0 {
        return trail[0].1;
    }
    let ((before_s, before), (next_s, after)) = (&trail[next - 1], &trail[next]);
    let share = (t_s - before_s) / (next_s - before_s);
    before + (after - before) * share
}
