//! Short runs of a torpedo as a laboratory's control computer logs them: 2 Hz, a minute of power at most, a Doppler
//! log once a second whose reading is repeated in the row between, four commanded fins and the motor's speed, two days
//! between which the vehicle's configuration changes.
//!
//! The vehicle is the simulator's own. Its coefficients differ from the textbook's by some 10 %, and what else it does
//! that nobody declares is drawn by the seed and told in a file of its own.

mod control;
mod files;
mod hidden;

pub use files::write;
pub use hidden::{Effect, Hidden, Wanted};

use crate::rng::{Source, Stream};
use crate::truth::{Actuators, State, Vehicle, Water};
use control::{Command, Law};

/// Time between rows, s.
pub const ROW_S: f64 = 0.5;
/// Steps of the vehicle between two rows.
const STEPS: usize = 25;
/// The motor turns so much faster than the propeller.
const GEAR: f64 = 6.0;
/// The motor under power, rpm.
const MOTOR_RPM: f64 = 8100.0;
/// Before the motor starts, s.
const IDLE_S: f64 = 4.0;
/// After it stops, s.
const COAST_S: f64 = 12.0;
/// Configurations.
const CONFIGURATIONS: usize = 2;
/// One sigma of an angle, rad, of the depth, m, and of the Doppler log, m/s.
const SIGMA: [f64; 3] = [0.0009, 0.02, 0.07];

/// One row of a run.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// As the computer writes it, s: its clock is late by turns.
    pub time_s: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Roll, pitch, heading, rad.
    pub attitude_rad: [f64; 3],
    /// What the Doppler log says of the bottom: ahead, to starboard and down negated, m/s; none before its first reading.
    pub doppler_mps: Option<[f64; 3]>,
    /// What was commanded.
    pub command: Command,
    /// Wanted heading, rad, and depth, m, while under control.
    pub target: Option<[f64; 2]>,
    /// Speed of the motor, rpm.
    pub motor_rpm: f64,
    /// Specific force negated, m/s².
    pub gravity_mps2: [f64; 3],
}

/// One run.
#[derive(Clone, Debug)]
pub struct SimulatedRun {
    /// Year, month, day, hour, minute, second.
    pub label: String,
    /// Place of its configuration.
    pub configuration: usize,
    /// Gains of its controller.
    pub law: Law,
    /// Its rows.
    pub rows: Vec<Row>,
}

/// Flies `flown` runs of each configuration; the same seed gives the same bits.
#[must_use]
pub fn simulate(wanted: Wanted, seed: u64, flown: usize) -> (Vec<SimulatedRun>, Hidden) {
    let hidden = Hidden::draw(wanted, seed);
    let mut random = Stream::new(seed, Source::Mission);
    let mut runs = Vec::new();
    for configuration in 0..CONFIGURATIONS {
        for number in 0..flown {
            let label = format!("202209{}{:02}{:02}00", 13 + 2 * configuration, 8 + number / 10, 6 * (number % 10));
            let law = Law::of(configuration, number);
            let rows = fly(&hidden, &law, configuration, seed, runs.len() as u64, &mut random);
            runs.push(SimulatedRun { label, configuration, law, rows });
        }
    }
    (runs, hidden)
}

/// Distinct seeds for the noise of each run.
fn seed_of(seed: u64, run: u64) -> u64 {
    seed.wrapping_mul(1009).wrapping_add(run)
}

fn fly(hidden: &Hidden, law: &Law, configuration: usize, seed: u64, run: u64, random: &mut Stream) -> Vec<Row> {
    let seed = seed_of(seed, run);
    let [mut ahrs, mut depth, mut dvl] = [Source::Ahrs, Source::Depth, Source::Dvl].map(|of| Stream::new(seed, of));
    let powered_s = 30.0 + 30.0 * random.uniform();
    let heading = core::f64::consts::TAU * random.uniform();
    let turn = random.sign() * (0.4 + 0.6 * random.uniform());
    let start = State::new([0.0, 0.0, 1.2], [0.0, 0.0, heading], [0.3, 0.0, 0.0], [0.0; 3]);
    let step_s = ROW_S / STEPS as f64;
    let undeclared = hidden.undeclared(configuration);
    let mut vehicle = Vehicle::with(&hidden.parameters, &undeclared, start, step_s, seed);
    let rows = ((IDLE_S + powered_s + COAST_S) / ROW_S) as usize;
    let stop = ((IDLE_S + powered_s) / ROW_S) as usize;
    let start = (IDLE_S / ROW_S) as usize;
    // a command of a row is issued this much after the row's time, in whole steps; negative: before it is logged
    let late = (hidden.command_late_s / step_s).round() as i64;
    let doppler_late = (hidden.doppler_late_s / step_s).round() as usize;
    let (mut log, mut past, mut issued) = (Vec::new(), Vec::new(), Command::default());
    let mut doppler = None;
    let mut earlier: Option<([f64; 3], f64)> = None;
    for row in 0..rows {
        let under_power = (start..stop).contains(&row);
        let target = [heading + if row > start + (stop - start) / 2 { turn } else { 0.0 }, 3.0];
        // the computer works on the readings of the row before
        let command = match earlier {
            Some((attitude, depth)) => law.command(attitude, depth, target, under_power),
            None => Command::default(),
        };
        let state = *vehicle.state();
        let euler = state.euler_rad();
        let attitude_rad = core::array::from_fn(|axis| euler[axis] + SIGMA[0] * ahrs.normal());
        let depth_m = state.position_m()[2] + SIGMA[1] * depth.normal();
        if row % 2 == 1 {
            let then = past.get(past.len().saturating_sub(1 + doppler_late)).unwrap_or(&state);
            doppler = Some(hidden.doppler(then, dvl.normals(SIGMA[2])));
        }
        let speed = vehicle.actuators().propeller_radps;
        let motor_rpm = if under_power { MOTOR_RPM + 30.0 * random.normal() } else { speed.min(0.0) };
        let before = state.velocity_mps();
        for step in 0..STEPS as i64 {
            // a command that is due before its own row is the next row's, which is known from this row's readings
            if step == late.max(0) {
                issued = if late >= 0 { command } else { issued };
            }
            if late < 0 && step == STEPS as i64 + late {
                let next = (start..stop).contains(&(row + 1));
                issued = law.command(attitude_rad, depth_m, target, next);
            }
            let on = if issued.is_powered { MOTOR_RPM / GEAR * core::f64::consts::TAU / 60.0 } else { 0.0 };
            vehicle.step(&Actuators { propeller_radps: on, fins_rad: hidden.fins(&issued) }, &Water::default());
            past.push(*vehicle.state());
        }
        let after = vehicle.state().velocity_mps();
        let (sr, cr) = libm::sincos(euler[0]);
        let (sp, cp) = libm::sincos(euler[1]);
        let down = [-sp, sr * cp, cr * cp];
        let rate: [f64; 3] = core::array::from_fn(|axis| (after[axis] - before[axis]) / ROW_S);
        let gravity_mps2 = core::array::from_fn(|axis| 9.81 * down[axis] - rate[axis] + 0.15 * ahrs.normal());
        log.push(Row {
            time_s: 8.0 + ROW_S * row as f64 + if row % 2 == 1 { 0.1 } else { 0.0 },
            depth_m,
            attitude_rad,
            doppler_mps: doppler,
            command,
            target: under_power.then_some(target),
            motor_rpm,
            gravity_mps2,
        });
        earlier = Some((attitude_rad, depth_m));
    }
    log
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_runs_that_dive_and_turn() {
        let [(runs, hidden), (again, _)] = [simulate(Wanted::Random, 3, 2), simulate(Wanted::Random, 3, 2)];
        assert_eq!(format!("{runs:?}"), format!("{again:?}"));
        assert_eq!(runs.len(), 4);
        assert!(!hidden.effects.is_empty());
        for run in &runs {
            let deepest = run.rows.iter().map(|row| row.depth_m).fold(0.0, f64::max);
            assert!((2.0..9.0).contains(&deepest), "{}: {deepest}", run.label);
            assert!(run.rows.iter().all(|row| row.attitude_rad[1].abs() < 1.0));
            let fastest = run.rows.iter().filter_map(|row| row.doppler_mps).map(|v| -v[0]).fold(0.0, f64::max);
            assert!((1.0..2.5).contains(&fastest), "{}: {fastest}", run.label);
        }
        assert!(simulate(Wanted::None, 3, 2).1.effects.is_empty());
    }
}
