//! A surface vehicle with two like thrusters and nothing but its speed over ground: what thrust does a command give?
//!
//! On stretches on which both commands are the same the vehicle goes straight:
//!
//! m du/dt = 2 T(c) − d₁ u − d₂ u |u|,   T(c) = slope (min(|c|, saturation) − dead band) sign c above the dead band
//!
//! The plain model is a thrust in proportion to the command (no dead band, saturation 1); its slope and both drags are
//! fitted in any case, because nobody declares them. A hull that makes waves has more than quadratic drag: d₁ is then
//! negative. Each stretch is simulated from its first speed; residuals are those of the simulated speed. Only forces
//! per mass are seen: the slope is that of the mass stated, and grows with the added mass that the statement leaves
//! out.

use backseat_diagnose::found::ParameterEstimate;
use backseat_diagnose::log_models::{self, Entry, Layout, LogModel, LogModelDiagnosis, Measures, OutsideTerm, Row};
use backseat_diagnose::samples::ResidualChannel;
use backseat_logs::log::Column;
use backseat_logs::stats::{Z_95, median, rms};
use backseat_logs::{Log, VehicleFile};

/// Columns: slope, N; linear drag, N s/m; quadratic drag, N s²/m²; dead band; command range lost to saturation; delay
/// of the command, s; then those without a name: thrust lost with speed, N s/m.
const SLOPE: usize = 0;
const DEAD_BAND: usize = 3;
const LOST: usize = 4;
const DELAY: usize = 5;
const WITH_SPEED: usize = 6;
const COLUMNS: usize = 7;
/// Steps of the derivatives by differences.
const STEPS: [f64; COLUMNS] = [1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 0.02, 1e-3];
/// Where a fit starts: the slope of a small thruster; from zero no thrust would leave the drags unseen.
const START: [f64; 3] = [10.0, 1.0, 4.0];
/// Both commands are the same within this.
const SAME: f64 = 1e-3;
/// A command holds no longer than this after the log stops to repeat it, s.
const HOLD_S: f64 = 0.5;
/// Slower than this a coasting vehicle is moved by whatever there is, m/s.
const SLOWEST_MPS: f64 = 0.3;
/// Commands below this do not begin a stretch.
const LEAST_COMMAND: f64 = 0.05;
/// A stretch must last this long to be of use, and residuals are taken this far apart, s.
const SHORTEST_S: f64 = 5.0;
const APART_S: f64 = 0.5;
/// Width over which dead band and saturation bend, so that the thrust has a derivative.
const BEND: f64 = 0.02;
/// A stretch that misses by this many times the median of all is not of this model (somebody held the vehicle).
const MISSED: f64 = 2.5;
const BLOCK_S: f64 = 10.0;
/// Fewest stretches.
const FEWEST: usize = 4;

/// A stretch: times, command, measured speed.
struct Stretch {
    t_s: Vec<f64>,
    command: Vec<f64>,
    speed_mps: Vec<f64>,
}

struct Thruster {
    stretches: Vec<Stretch>,
    mass_kg: f64,
}

/// A ramp that begins at zero, rounded.
fn ramp(x: f64) -> f64 {
    if x > 30.0 * BEND { x } else { BEND * (x / BEND).exp().ln_1p() }
}

/// Share of the slope that a command gives.
fn share(command: f64, dead_band: f64, saturation: f64) -> f64 {
    let size = command.abs();
    (ramp(size - dead_band) - ramp(size - saturation)).copysign(command)
}

impl Stretch {
    fn command_at(&self, t_s: f64) -> f64 {
        let behind = self.t_s.partition_point(|at| *at <= t_s);
        // Before the stretch the thrusters stood still. Between two readings a line, so that a delay has a derivative.
        let Some(before) = behind.checked_sub(1) else { return 0.0 };
        let from = self.command[before];
        let Some(to_s) = self.t_s.get(behind) else { return from };
        from + (self.command[behind] - from) * (t_s - self.t_s[before]) / (to_s - self.t_s[before])
    }

    /// Simulated speed at every time.
    fn simulate(&self, theta: &[f64], mass_kg: f64) -> Vec<f64> {
        let slope = START[SLOPE] + theta[SLOPE];
        let (linear, quadratic) = (START[1] + theta[1], START[2] + theta[2]);
        let few = self.speed_mps.len().min(5);
        let mut speed = self.speed_mps[..few].iter().sum::<f64>() / few as f64;
        let mut speeds = vec![speed];
        for pair in self.t_s.windows(2) {
            let h_s = pair[1] - pair[0];
            let share =
                share(self.command_at(0.5 * (pair[0] + pair[1]) - theta[DELAY]), theta[DEAD_BAND], 1.0 - theta[LOST]);
            let force = |u: f64| 2.0 * (slope - theta[WITH_SPEED] * u) * share - linear * u - quadratic * u * u.abs();
            let half = speed + 0.5 * h_s * force(speed) / mass_kg;
            // Bounded, so that a wild trial of the fit stays a number.
            speed = (speed + h_s * force(half) / mass_kg).clamp(-20.0, 20.0);
            speeds.push(speed);
        }
        speeds
    }
}

impl Thruster {
    /// Rows of one stretch, the sequence of this number.
    fn rows_of(&self, sequence: u32, stretch: &Stretch, theta: &[f64]) -> Vec<Row> {
        let simulated = stretch.simulate(theta, self.mass_kg);
        let moved: Vec<Vec<f64>> = (0..COLUMNS)
            .map(|column| {
                let side = |sign: f64| {
                    let mut theta = theta.to_vec();
                    theta[column] += sign * STEPS[column];
                    stretch.simulate(&theta, self.mass_kg)
                };
                let (up, down) = (side(1.0), side(-1.0));
                up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * STEPS[column])).collect()
            })
            .collect();
        let mut next_s = stretch.t_s[0] + APART_S;
        let mut rows = Vec::new();
        for (i, t_s) in stretch.t_s.iter().enumerate() {
            if *t_s >= next_s {
                next_s = t_s + APART_S;
                let slopes = moved.iter().map(|by| by[i]).collect();
                let residual = stretch.speed_mps[i] - simulated[i];
                rows.push(Row { t_s: *t_s, channel: ResidualChannel::WaterSpeed, sequence, residual, slopes });
            }
        }
        rows
    }

    /// Leaves out stretches that miss by far.
    fn without_missed(&mut self, theta: &[f64]) -> usize {
        let missed: Vec<f64> = self
            .stretches
            .iter()
            .map(|stretch| {
                let residuals: Vec<f64> = self.rows_of(0, stretch, theta).iter().map(|row| row.residual).collect();
                rms(&residuals).unwrap_or(0.0)
            })
            .collect();
        let limit = MISSED * median(&missed).unwrap_or(f64::INFINITY);
        let before = self.stretches.len();
        let mut each = missed.iter();
        self.stretches.retain(|_| each.next().is_some_and(|missed| *missed < limit));
        before - self.stretches.len()
    }
}

impl LogModel for Thruster {
    fn columns(&self) -> usize {
        COLUMNS
    }

    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        (0..).zip(&self.stretches).flat_map(|(sequence, stretch)| self.rows_of(sequence, stretch, theta)).collect()
    }

    fn calibrated(&self) -> Vec<usize> {
        vec![SLOPE, 1, 2]
    }

    fn entries(&self) -> Vec<Entry> {
        vec![("thrust_curve", vec![DEAD_BAND, LOST]), ("input_delay", vec![DELAY])]
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        vec![("thrust that falls with speed", vec![WITH_SPEED])]
    }

    fn guess(&self) -> Vec<f64> {
        let mut guess = vec![0.0; COLUMNS];
        (guess[DEAD_BAND], guess[LOST], guess[DELAY]) = (0.1, 0.25, 0.2);
        guess
    }

    /// A log that works its way up to full command has its largest commands at the end.
    fn forecast_share(&self) -> f64 {
        0.0
    }

    fn block_s(&self) -> f64 {
        BLOCK_S
    }

    fn measures(&self, rows: &[Row], _layout: &Layout) -> Measures {
        let velocity = rows.iter().map(|row| (row.t_s, row.residual)).collect();
        Measures { velocity, ..Measures::default() }
    }
}

/// Whether a log holds the commands of two thrusters and a velocity over ground.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    [Column::ThrusterLeft, Column::ThrusterRight, Column::RefNorth, Column::RefEast]
        .into_iter()
        .all(|column| log.has(column))
}

/// Diagnoses the thrust of a log; `None` if both thrusters hardly ever run alike.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let mass_kg = log.column(Column::Mass).next().map_or(vehicle.parameters.mass_kg, |(_, mass_kg)| mass_kg);
    let mut model = Thruster { stretches: stretches(log), mass_kg };
    if model.stretches.len() < FEWEST {
        return None;
    }
    let first = log_models::run(&model, log, vehicle)?;
    let missed = model.without_missed(&first.theta[1]);
    let mut found = if missed == 0 { first } else { log_models::run(&model, log, vehicle)? };
    restate(&mut found);
    let (theta, sigmas) = (&found.theta[1], &found.sigmas);
    let of = |name: &str, column: usize, unit: &str| {
        format!("{name} {:.2} (±{:.2}) {unit}", START[column] + theta[column], Z_95 * sigmas[column])
    };
    let length_s: f64 = model.stretches.iter().map(|stretch| stretch.t_s[stretch.t_s.len() - 1] - stretch.t_s[0]).sum();
    let mut notes = vec![
        format!(
            "declared model: thrust in proportion to the command, mass {mass_kg} kg. {} stretches with both commands alike, {length_s:.0} s; \
             {missed} left out that no thrust explains. Each is simulated from its first speed",
            model.stretches.len(),
        ),
        format!(
            "always fitted: {}, {}, {}. Forces are in proportion to the mass stated: an added mass of 10 % raises them by 10 %",
            of("slope of one thruster", SLOPE, "N"),
            of("linear drag", 1, "N s/m"),
            of("quadratic drag", 2, "N s^2/m^2")
        ),
    ];
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

/// The thrust curve in the catalogue's numbers.
fn restate(found: &mut LogModelDiagnosis) {
    let (theta, sigmas) = (&found.theta[1], &found.sigmas);
    let numbers = [
        ("dead_band", "1", theta[DEAD_BAND], sigmas[DEAD_BAND]),
        ("slope_n", "N", START[SLOPE] + theta[SLOPE], sigmas[SLOPE]),
        ("saturation", "1", 1.0 - theta[LOST], sigmas[LOST]),
    ];
    for effect in &mut found.diagnosis.effects {
        if effect.instance.candidate.effect == "thrust_curve" {
            effect.values =
                numbers.map(|(name, unit, value, sigma)| ParameterEstimate::size(name, unit, value, sigma)).to_vec();
            effect.instance.sizes = numbers.map(|(_, _, value, _)| value).to_vec();
        }
    }
}

/// Stretches of like commands, from a command on until the vehicle has nearly come to rest.
fn stretches(log: &Log) -> Vec<Stretch> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let (mut found, mut open): (Vec<Stretch>, Option<Stretch>) = (Vec::new(), None);
    let mut held: Option<(f64, [f64; 2])> = None;
    let close = |open: &mut Option<Stretch>, found: &mut Vec<Stretch>| {
        if let Some(stretch) = open.take() {
            let is_long =
                stretch.t_s.last().zip(stretch.t_s.first()).is_some_and(|(last, first)| last - first > SHORTEST_S);
            if is_long {
                found.push(stretch);
            }
        }
    };
    for row in &log.rows {
        let t_s = (row.time_us - start_us) as f64 * 1e-6;
        if let (Some(left), Some(right)) = (row.get(Column::ThrusterLeft), row.get(Column::ThrusterRight)) {
            held = Some((t_s, [left, right]));
        }
        let (Some(north), Some(east)) = (row.get(Column::RefNorth), row.get(Column::RefEast)) else { continue };
        let [left, right] = held.filter(|(at_s, _)| t_s - at_s < HOLD_S).map_or([0.0; 2], |(_, commands)| commands);
        let (command, speed) = (0.5 * (left + right), north.hypot(east));
        let is_straight = (left - right).abs() < SAME && command >= 0.0;
        let goes_on =
            is_straight && if open.is_some() { command > 0.0 || speed > SLOWEST_MPS } else { command > LEAST_COMMAND };
        if !goes_on {
            close(&mut open, &mut found);
            continue;
        }
        let stretch =
            open.get_or_insert_with(|| Stretch { t_s: Vec::new(), command: Vec::new(), speed_mps: Vec::new() });
        if stretch.t_s.last().is_none_or(|last| t_s > *last) {
            stretch.t_s.push(t_s);
            stretch.command.push(command);
            stretch.speed_mps.push(speed);
        }
    }
    close(&mut open, &mut found);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::LogRow;
    use hil_sim::rng::{Source, Stream};

    /// Half a minute each at several commands, and coasting; 30 kg, dead band 0.15, 20 N a unit, flat from 0.65 on, and
    /// 0.3 s late, with the equations of a Heun step of 10 ms of its own.
    fn log() -> Log {
        let (mut log, mut random, mut speed) = (Log::default(), Stream::new(5, Source::Study), 0.0_f64);
        let mut noise = || random.uniform() - 0.5;
        let levels = [0.2, 0.5, 0.9, 0.3, 0.7, 0.4, 1.0, 0.6, 0.3, 0.8, 0.5, 0.9, 0.25, 0.6, 0.4, 1.0];
        let command = |t: f64| {
            let (leg, along) = ((t / 60.0).floor(), t % 60.0);
            if t >= 0.0 && along < 30.0 { levels[leg as usize % levels.len()] } else { 0.0 }
        };
        for k in 0..9600_u64 {
            let t = 0.1 * k as f64;
            let mut row = LogRow::new(k * 100_000);
            row.set_all(Column::RefNorth, &[0.6 * speed + 0.01 * noise(), 0.8 * speed + 0.01 * noise()]);
            row.set_all(Column::ThrusterLeft, &[command(t), command(t)]).set(Column::Mass, 30.0);
            log.rows.push(row);
            for step in 0..10 {
                let c = command(t + 0.01 * f64::from(step) - 0.3);
                let thrust = if c > 0.15 { 20.0 * (c.min(0.65) - 0.15) } else { 0.0 };
                speed += 0.01 * (2.0 * thrust - 1.0 * speed - 6.0 * speed * speed.abs()) / 30.0;
            }
        }
        log
    }

    #[test]
    #[ignore = "a quarter of a minute: .ci/nightly"]
    fn val_dead_band_slope_saturation_and_delay() {
        let log = log();
        assert!(is_for(&log));
        let found = run(&log, &VehicleFile::reference()).unwrap();
        let effects = &found.diagnosis.effects;
        let value = |name: &str| effects.iter().find(|e| e.instance.candidate.effect == name).map(|e| e.values.clone());
        let curve = value("thrust_curve").unwrap_or_else(|| panic!("{effects:?}"));
        for (estimate, truth) in curve.iter().zip([0.15, 20.0, 0.65]) {
            assert!((estimate.value / truth - 1.0).abs() < 0.03, "{curve:?}"); // the bend of BEND is a tenth of the band
        }
        let delay = value("input_delay").unwrap_or_else(|| panic!("{effects:?}"));
        assert!((delay[0].value - 0.3).abs() < 0.06, "{delay:?}");
        let [before, after] = found.scores;
        assert!(after.velocity_rmse_mps.unwrap() < 0.15 * before.velocity_rmse_mps.unwrap());
    }
}
