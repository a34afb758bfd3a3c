//! The identification experiment of the thesis' chapter 4, simulated with the simulator's own plant.
//!
//! Inputs at 10 Hz, held from sample to sample (or continuous, [`Between`]), move a vehicle that nothing else disturbs; velocity, rates,
//! roll and pitch are measured at 10 Hz with white noise (Table 4.13). The vehicle is that of the reference numbers
//! (`firmware/core/tests/data/README.md`). The inputs are sums of sines of incommensurate periods, or those of Tables
//! 4.6 and 4.14.
//!
//! It starts deep: open loop, depth wanders by hundreds of metres, and the surface is no part of the experiment.

mod programme;
mod vehicle;

pub use programme::{Motion, OpenLoop, Programme, References};
pub use vehicle::{declared, wrong_prior};

use backseat_core::dynamics::{ActuatorInput, VehicleParameters};
use backseat_core::state::VehicleState;
use backseat_logs::{Column, Log, LogRow, Truth, TruthRow};
use hil_sim::rng::{Source, Stream};
use hil_sim::truth::{Actuators, Parameters, Plant, State, Water, runge_kutta_4};
use std::path::PathBuf;

/// Time between samples, s.
pub const PERIOD_S: f64 = 0.1;

/// Runge-Kutta steps in a period: the fastest motion, roll at 1 Hz, is exact to 1e-8 rad.
const STEPS: u32 = 4;

/// The same where inputs change within a period.
const FINE_STEPS: u32 = 20;

/// Where it starts, m: so deep that open-loop motion cannot reach the surface.
const START_DEPTH_M: f64 = 1.0e5;

/// Standard deviation of the compass, rad; no method uses heading.
const HEADING_NOISE_RAD: f64 = 1.745e-2;

/// One-sigma noise of the measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// u, v, w, m/s.
    pub linear_mps: f64,
    /// p, q, r, rad/s.
    pub angular_radps: f64,
    /// Roll and pitch, rad.
    pub roll_pitch_rad: f64,
}

impl Noise {
    /// Perfect sensors.
    pub const NONE: Self = Self { linear_mps: 0.0, angular_radps: 0.0, roll_pitch_rad: 0.0 };

    /// Table 4.13 with another noise of linear velocity, m/s (the thesis varies it from 0 to 1.4 cm/s).
    #[must_use]
    pub fn table_4_13(linear_mps: f64) -> Self {
        Self { linear_mps, angular_radps: 0.01_f64.to_radians(), roll_pitch_rad: 0.25_f64.to_radians() }
    }
}

/// What the actuators do between the samples of the log, whatever an identification believes. Inputs that depend on the
/// state are held without delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Between {
    /// They move on, and the log merely samples them at 10 Hz; else each sample is held until the next.
    pub continuous: bool,
    /// They come late, s.
    pub delay_s: f64,
}

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experiment {
    /// The inputs.
    pub motion: Motion,
    /// Length, s.
    pub duration_s: f64,
    /// Noise of the sensors.
    pub noise: Noise,
    /// Cross drag [d26, d35] that the declared vehicle does not have.
    pub cross_drag: [f64; 2],
    /// Between samples of the inputs.
    pub between: Between,
}

impl Experiment {
    /// 5000 s of the identification inputs, Table 4.13's noise at this noise of linear velocity (m/s).
    #[must_use]
    pub fn identification(linear_mps: f64) -> Self {
        Self {
            motion: Motion::Sines(Programme::IDENTIFICATION),
            duration_s: 5000.0,
            noise: Noise::table_4_13(linear_mps),
            cross_drag: [0.0; 2],
            between: Between::default(),
        }
    }

    /// 1000 s of other inputs, measured without error: what an estimate has to predict.
    #[must_use]
    pub fn cross_validation() -> Self {
        let motion = Motion::Sines(Programme::VALIDATION);
        Self { motion, duration_s: 1000.0, noise: Noise::NONE, cross_drag: [0.0; 2], between: Between::default() }
    }

    /// Simulates it; the seed picks the noise.
    #[must_use]
    pub fn run(&self, seed: u64) -> SimulatedExperiment {
        self.simulate(seed, &vehicle::truth(self.cross_drag))
    }

    /// The same with another vehicle in place of the true one, such as an identified one. Its parameters need not be
    /// physical; the states may stop being finite.
    #[must_use]
    pub fn run_of(&self, vehicle: &VehicleParameters, seed: u64) -> SimulatedExperiment {
        self.simulate(seed, &vehicle::plant_of(vehicle))
    }

    /// One period from a sample on, which commands an input.
    fn advance(
        &self,
        plant: &Plant,
        parameters: &Parameters,
        state: &State,
        (sample, now): (u64, &ActuatorInput),
    ) -> State {
        let is_held = self.between == Between::default();
        let steps = if is_held { STEPS } else { FINE_STEPS };
        let step_s = PERIOD_S / f64::from(steps);
        let water = Water::default();
        (0..steps).fold(*state, |state, step| {
            let middle_s = sample as f64 * PERIOD_S + (f64::from(step) + 0.5) * step_s - self.between.delay_s;
            let commanded_s =
                if self.between.continuous { middle_s } else { (middle_s / PERIOD_S).floor() * PERIOD_S }.max(0.0);
            let input = if is_held { *now } else { self.motion.input(commanded_s, &vehicle_state(&state)) };
            let actuators = actuators(parameters, &input);
            runge_kutta_4(&state, step_s, |x| plant.derivative(x, &actuators, &water, &[0.0; 6]))
        })
    }

    fn simulate(&self, seed: u64, parameters: &Parameters) -> SimulatedExperiment {
        let plant = Plant::new(parameters);
        let mut state = State::new([0.0, 0.0, START_DEPTH_M], [0.0; 3], [0.5, 0.0, 0.0], [0.0; 3]);
        let (mut ahrs, mut dvl) = (Stream::new(seed, Source::Ahrs), Stream::new(seed, Source::Dvl));
        let samples = (self.duration_s / PERIOD_S).round() as u64 + 1;
        let log = Log { path: PathBuf::from("simulated experiment"), ..Log::default() };
        let mut run = SimulatedExperiment { log, ..SimulatedExperiment::default() };
        let mut before = None;
        for sample in 0..samples {
            let time_us = sample * 100_000;
            let x = vehicle_state(&state);
            let input = self.motion.input(sample as f64 * PERIOD_S, &x);
            let [then, now] = [before.unwrap_or(input), input]
                .map(|input| plant.acceleration(&state, &actuators(parameters, &input)));
            run.accelerations.push(core::array::from_fn(|axis| 0.5 * (then[axis] + now[axis])));
            before = Some(input);
            run.truth.rows.push(TruthRow { time_us, state: x, current_mps: [0.0; 2] });
            run.log.rows.push(measured(time_us, &x, &input, &self.noise, &mut ahrs, &mut dvl));
            state = self.advance(&plant, parameters, &state, (sample, &input));
        }
        run
    }
}

/// One simulated experiment.
#[derive(Clone, Debug, Default)]
pub struct SimulatedExperiment {
    /// Measurements and commands, 10 Hz.
    pub log: Log,
    /// The true states at the same times.
    pub truth: Truth,
    /// The true accelerations of u, v, w, p, q, r, m/s² and rad/s²: the mean of just before and just after each sample,
    /// between which the inputs change.
    pub accelerations: Vec<[f64; 6]>,
}

impl SimulatedExperiment {
    /// The log with the truth in place of the measurements.
    #[must_use]
    pub fn exact_log(&self) -> Log {
        let mut log = self.log.clone();
        for (row, truth) in log.rows.iter_mut().zip(&self.truth.rows) {
            let x = truth.state.as_slice();
            row.set_all(Column::Roll, &x[3..6]).set_all(Column::P, &x[9..12]).set_all(Column::DvlU, &x[6..9]);
        }
        log
    }
}

fn vehicle_state(state: &State) -> VehicleState {
    let parts = [state.position_m(), state.euler_rad(), state.velocity_mps(), state.rates_radps()];
    VehicleState::from_iterator(parts.into_iter().flatten())
}

fn measured(
    time_us: u64,
    x: &VehicleState,
    input: &ActuatorInput,
    noise: &Noise,
    ahrs: &mut Stream,
    dvl: &mut Stream,
) -> LogRow {
    let x = x.as_slice();
    let noisy = |from: usize, sigma: [f64; 3], stream: &mut Stream| -> [f64; 3] {
        core::array::from_fn(|axis| x[from + axis] + sigma[axis] * stream.normal())
    };
    let heading = if *noise == Noise::NONE { 0.0 } else { HEADING_NOISE_RAD };
    let mut row = LogRow::new(time_us);
    row.set_actuators(input)
        .set_all(Column::Roll, &noisy(3, [noise.roll_pitch_rad, noise.roll_pitch_rad, heading], ahrs))
        .set_all(Column::P, &noisy(9, [noise.angular_radps; 3], ahrs))
        .set_all(Column::DvlU, &noisy(6, [noise.linear_mps; 3], dvl));
    row
}

/// What the actuators do of a command, at once.
fn actuators(parameters: &Parameters, input: &ActuatorInput) -> Actuators {
    let limit = parameters.fin_max_rad;
    Actuators {
        propeller_radps: input.propeller_radps.clamp(-parameters.propeller_max_radps, parameters.propeller_max_radps),
        fins_rad: input.fins_rad.map(|fin| fin.clamp(-limit, limit)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::dynamics::VehicleModel;

    #[test]
    fn val_the_declared_vehicle_moves_as_the_true_one() {
        // Two models written apart, 100 s of open loop from the same state.
        let run = Experiment { duration_s: 100.0, ..Experiment::cross_validation() }.run(1);
        let model = VehicleModel::new(&declared()).expect("valid");
        let mut x = run.truth.rows[0].state;
        for (row, truth) in run.log.rows.iter().zip(&run.truth.rows) {
            // Position and heading apart: everything that feeds back. Runge-Kutta at 25 ms on either side.
            assert!((x - truth.state).rows(3, 9).amax() < 1.0e-6, "{} s", truth.time_us as f64 * 1.0e-6);
            let input = row.actuators().expect("all five");
            for _ in 0..STEPS {
                let dt = PERIOD_S / f64::from(STEPS);
                let k1 = model.derivative(&x, &input);
                let k2 = model.derivative(&(x + k1 * (0.5 * dt)), &input);
                let k3 = model.derivative(&(x + k2 * (0.5 * dt)), &input);
                let k4 = model.derivative(&(x + k3 * dt), &input);
                x += (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0);
            }
            x[5] = backseat_core::state::wrap_angle(x[5]);
        }
    }

    #[test]
    fn the_noise_is_as_asked_for_and_picked_by_the_seed() {
        let experiment = Experiment { duration_s: 500.0, ..Experiment::identification(0.012) };
        let (run, other) = (experiment.run(1), experiment.run(2));
        assert_ne!(run.log.rows, other.log.rows);
        assert_eq!(run.truth.rows, other.truth.rows);
        assert_eq!(run.log.rows, experiment.run(1).log.rows);
        let spread = |column: Column, state: usize| {
            let square = |(row, truth): (&LogRow, &TruthRow)| {
                let error = row.get(column).expect("a sample") - truth.state[state];
                error * error
            };
            let sum: f64 = run.log.rows.iter().zip(&run.truth.rows).map(square).sum();
            (sum / run.log.rows.len() as f64).sqrt()
        };
        // 5001 samples: the standard deviation is known to 1 %, five of which are allowed.
        for (column, state, sigma) in
            [(Column::DvlV, 7, 0.012), (Column::Q, 10, 1.745_329e-4), (Column::Roll, 3, 4.363_323e-3)]
        {
            assert!((spread(column, state) / sigma - 1.0).abs() < 0.05, "{}", column.name());
        }
    }
}
