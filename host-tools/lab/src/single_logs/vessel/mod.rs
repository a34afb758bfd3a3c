//! A vessel with propellers and rudders on the surface: surge, sway and yaw by the field's manoeuvring terms.
//!
//! The change of velocity over each window is a sum of the integrals of [`crate::vessel::planar`]'s terms, whose numbers are fitted in any
//! case, because nobody declares them; a term that this log cannot separate from those before it is left out. What
//! still water leaves is explained by a wind: with an anemometer by four coefficients, without one by a steady wind in
//! each run, whose forces come from the windage that the log states. Windows in which somebody held the vessel are left
//! out.

mod terms;
mod windows;

use self::terms::Windage;
use self::windows::Window;
use crate::vessel::model::{AXES, separable as separable_columns};
use crate::vessel::readings::{actuators, length_m};
use backseat_core::navigation::SensorNoise;
use backseat_core::state::wrap_angle;
use backseat_diagnose::found::ParameterEstimate;
use backseat_diagnose::linear;
use backseat_diagnose::log_models::{
    self, Entry, Layout, LogModel, LogModelDiagnosis, MOST_RUNS, Measures, OutsideTerm, Row, Unexplained, WINDS,
    catalogue_range,
};
use backseat_diagnose::normal_equations::NormalEquations;
use backseat_diagnose::remaining::Remaining;
use backseat_diagnose::samples::ResidualChannel;
use backseat_logs::log::Column;
use backseat_logs::stats::median;
use backseat_logs::{Log, VehicleFile};
use std::ops::Range;

const BLOCK_S: f64 = 20.0;
/// Fewest windows of a log, and of a run.
const FEWEST: usize = 30;
const FEWEST_OF_RUN: usize = 8;
/// A term counts if more than this share of it (root mean square) is not in those before it.
const OWN_SHARE: f64 = 0.05;
/// Windows that miss by this many standard deviations (by the median) are not of this model.
const MISSED: f64 = 6.0;
const ROUNDS: usize = 4;
/// Step of a derivative by the wind, m/s.
const STEP_MPS: f64 = 1e-3;
const FASTEST_WIND_MPS: f64 = 20.0;
/// Wind over a pond or a bay on a day of trials, one sigma of each component, m/s.
const USUAL_WIND_MPS: f64 = 3.0;
/// What is known of the anemometer's four coefficients, as a share of what is usual, one sigma.
const USUAL_COEFFICIENT: f64 = 2.0;
const CHANNELS: [ResidualChannel; 3] = [ResidualChannel::DvlU, ResidualChannel::DvlV, ResidualChannel::R];

struct Planar {
    windows: Vec<Window>,
    /// Number of each run in the log.
    runs: Vec<u32>,
    /// Terms used of each axis, with their root mean square over the windows.
    terms: [Vec<(usize, f64)>; 3],
    windage: Option<Windage>,
    has_anemometer: bool,
    length_m: f64,
    guess: Vec<f64>,
}

impl Planar {
    fn new(windows: Vec<Window>, windage: Option<Windage>, has_anemometer: bool, length_m: f64) -> Option<Self> {
        let mut numbers: Vec<u32> = windows.iter().map(|window| window.run).collect();
        numbers.dedup();
        let count = |run: u32| windows.iter().filter(|window| window.run == run).count();
        let runs: Vec<u32> = numbers.into_iter().filter(|run| count(*run) >= FEWEST_OF_RUN).collect();
        let windows: Vec<Window> = windows.into_iter().filter(|window| runs.contains(&window.run)).collect();
        if windows.len() < FEWEST || runs.len() > MOST_RUNS {
            return None;
        }
        let terms = [0, 1, 2].map(|axis| separable(&windows, axis));
        let mut model = Self { windows, runs, terms, windage, has_anemometer, length_m, guess: Vec::new() };
        model.guess = model.first_guess();
        Some(model)
    }

    fn hull(&self, axis: usize) -> Range<usize> {
        let from: usize = self.terms[..axis].iter().map(Vec::len).sum();
        from..from + self.terms[axis].len()
    }

    /// Cross terms of sway and yaw, two each.
    fn cross(&self) -> usize {
        self.hull(2).end
    }

    fn arm(&self) -> usize {
        self.cross() + 4
    }

    /// Four coefficients, or two for each run.
    fn wind(&self) -> Range<usize> {
        let count = match (self.windage, self.has_anemometer) {
            (None, _) => 0,
            (Some(_), true) => 4,
            (Some(_), false) => 2 * self.runs.len(),
        };
        self.arm() + 2..self.arm() + 2 + count
    }

    /// For the first guess only: |w| w of each run, in which the forces ahead and to the side are linear.
    fn squares(&self) -> Range<usize> {
        let from = self.wind().end;
        from..from + if self.has_anemometer { 0 } else { self.wind().len() }
    }

    /// What the wind does over a window, by axis.
    fn wind_change(&self, window: &Window, wind_mps: [f64; 2]) -> [f64; 3] {
        let Some(windage) = self.windage else { return [0.0; 3] };
        let [ahead, side, yaw, turning] = windage.terms(wind_mps, window.heading_rad, window.velocity);
        [ahead, side, yaw + turning].map(|rate| rate * window.length_s)
    }

    fn rows_of(&self, window: &Window, theta: &[f64]) -> Vec<Row> {
        let mut slopes = vec![vec![0.0; self.columns()]; 3];
        let mut predicted = [0.0; 3];
        for axis in 0..3 {
            for (column, (term, size)) in self.hull(axis).zip(&self.terms[axis]) {
                slopes[axis][column] = window.terms[axis][*term] / size;
            }
        }
        for (place, cross) in window.cross.iter().enumerate() {
            slopes[1][self.cross() + place] = *cross;
            slopes[2][self.cross() + 2 + place] = *cross;
        }
        if let (true, Some([ahead, side, yaw, turning])) = (!self.wind().is_empty() && self.has_anemometer, window.wind)
        {
            let from = self.wind().start;
            slopes[0][from] = ahead;
            slopes[1][from + 1] = side;
            slopes[2][from + 2] = yaw;
            slopes[2][from + 3] = turning;
        }
        let run = self.runs.iter().position(|run| *run == window.run);
        if let (Some(run), Some(windage), false) = (run, self.windage, self.has_anemometer) {
            let (sin, cos) = window.heading_rad.sin_cos();
            let [ahead, side, ..] = windage.factors.map(|factor| factor * window.length_s);
            let square = self.squares().start + 2 * run;
            (slopes[0][square], slopes[0][square + 1]) = (ahead * cos, ahead * sin);
            (slopes[1][square], slopes[1][square + 1]) = (-side * sin, side * cos);
        }
        for axis in 0..3 {
            predicted[axis] = slopes[axis].iter().zip(theta).map(|(slope, value)| slope * value).sum();
        }
        if let (Some(run), Some(_), false) = (run, self.windage, self.has_anemometer) {
            let from = self.wind().start + 2 * run;
            let wind = [theta[from], theta[from + 1]];
            let at = self.wind_change(window, wind);
            for place in 0..2 {
                let side = |step: f64| {
                    let mut moved = wind;
                    moved[place] += step;
                    self.wind_change(window, moved)
                };
                let (up, down) = (side(STEP_MPS), side(-STEP_MPS));
                for axis in 0..3 {
                    slopes[axis][from + place] = (up[axis] - down[axis]) / (2.0 * STEP_MPS);
                }
            }
            for axis in 0..3 {
                predicted[axis] += at[axis];
            }
        }
        let mut rows: Vec<Row> = slopes
            .into_iter()
            .enumerate()
            .map(|(axis, slopes)| Row {
                t_s: window.t_s,
                channel: CHANNELS[axis],
                sequence: window.run,
                residual: window.change[axis] - predicted[axis],
                slopes,
            })
            .collect();
        if let Some((missing, by_arm)) = window.way {
            for (axis, channel) in [ResidualChannel::GnssX, ResidualChannel::GnssY].into_iter().enumerate() {
                let mut slopes = vec![0.0; self.columns()];
                slopes[self.arm()..self.arm() + 2].copy_from_slice(&by_arm[axis]);
                let around: f64 = (0..2).map(|place| by_arm[axis][place] * theta[self.arm() + place]).sum();
                let residual = missing[axis] - around;
                rows.push(Row { t_s: window.t_s, channel, sequence: window.run, residual, slopes });
            }
        }
        rows
    }

    /// Winds by linear least squares on |w| w; coefficients at what is usual.
    fn first_guess(&self) -> Vec<f64> {
        let mut guess = vec![0.0; self.columns()];
        if self.has_anemometer {
            guess[self.wind()].fill(1.0);
            return guess;
        }
        let hull: Vec<usize> = self.hull(0).chain(self.hull(1)).collect();
        let free: Vec<usize> = hull.iter().copied().chain(self.squares()).collect();
        let rows: Vec<Row> =
            self.windows.iter().flat_map(|window| self.rows_of(window, &guess).into_iter().take(2)).collect();
        let sum = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>();
        let information = (0..free.len())
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| sum(&|row| row.slopes[free[i]] * row.slopes[free[j]]))
            .collect();
        let score = free.iter().map(|column| sum(&|row| row.slopes[*column] * row.residual)).collect();
        let all: Vec<usize> = (0..free.len()).collect();
        let squares = linear::fit(&NormalEquations::new(information, score), &all, &[])
            .map(|fit| fit.theta[hull.len()..].to_vec());
        let winds = squares.unwrap_or_else(|| vec![1.0; self.squares().len()]);
        for (pair, from) in winds.chunks_exact(2).zip(self.wind().step_by(2)) {
            let root = pair[0].hypot(pair[1]).sqrt().clamp(0.3, FASTEST_WIND_MPS);
            (guess[from], guess[from + 1]) = (pair[0] / root, pair[1] / root);
        }
        guess
    }

    /// Leaves out windows that miss by far; returns how many.
    fn without_missed(&mut self, theta: &[f64]) -> usize {
        let residuals: Vec<[f64; 3]> = self
            .windows
            .iter()
            .map(|window| {
                let rows = self.rows_of(window, theta);
                [0, 1, 2].map(|axis| rows[axis].residual.abs())
            })
            .collect();
        let limits = [0, 1, 2].map(|axis| {
            let of_axis: Vec<f64> = residuals.iter().map(|residual| residual[axis]).collect();
            MISSED * 1.4826 * median(&of_axis).unwrap_or(f64::INFINITY)
        });
        let before = self.windows.len();
        let mut each = residuals.iter();
        self.windows.retain(|_| each.next().is_some_and(|residual| (0..3).all(|axis| residual[axis] < limits[axis])));
        before - self.windows.len()
    }
}

/// Terms of an axis that the windows tell apart, in their order, with their root mean squares.
fn separable(windows: &[Window], axis: usize) -> Vec<(usize, f64)> {
    let count = windows.first().map_or(0, |window| window.terms[axis].len());
    let column = |term: usize| windows.iter().map(|window| window.terms[axis][term]).collect();
    separable_columns(&(0..count).map(column).collect::<Vec<Vec<f64>>>(), OWN_SHARE)
}

impl LogModel for Planar {
    fn columns(&self) -> usize {
        self.squares().end
    }

    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        self.windows.iter().flat_map(|window| self.rows_of(window, theta)).collect()
    }

    fn calibrated(&self) -> Vec<usize> {
        (0..self.cross()).collect()
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        if !self.wind().is_empty() {
            entries.push(("wind", self.wind().collect()));
        }
        if self.windows.iter().any(|window| window.way.is_some()) {
            entries.push(("gnss_lever_arm", vec![self.arm(), self.arm() + 1]));
        }
        entries
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        let from = self.cross();
        vec![("products of sway and yaw rate", (from..from + 4).collect())]
    }

    fn guess(&self) -> Vec<f64> {
        self.guess.clone()
    }

    /// Nobody can forecast the wind of a run that was not seen.
    fn forecast_share(&self) -> f64 {
        0.0
    }

    fn runs(&self) -> Vec<[f64; 2]> {
        let span = |run: &u32| {
            let own = self.windows.iter().filter(|window| window.run == *run);
            own.fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], window| {
                [from.min(window.t_s), to.max(window.t_s + window.length_s)]
            })
        };
        self.runs.iter().map(span).collect()
    }

    /// The wind, weakly; coefficients about what is usual.
    fn prior(&self, column: usize) -> Option<[f64; 2]> {
        match (self.wind().contains(&column), self.has_anemometer) {
            (true, false) => Some([0.0, USUAL_WIND_MPS]),
            (true, true) => Some([0.0, USUAL_COEFFICIENT]),
            _ => None,
        }
    }

    fn limits(&self, entry: &'static str, place: usize) -> [f64; 2] {
        match entry {
            "gnss_lever_arm" => [-self.length_m, self.length_m],
            // of each run's wind, or of a coefficient in shares of what is usual
            _ => catalogue_range(entry, place % 2),
        }
    }

    fn block_s(&self) -> f64 {
        BLOCK_S
    }

    /// What the model says of an acceleration, against its mean: a share above one says less than nothing.
    fn remaining(&self, _: &[Row], _: &Layout, _: &SensorNoise) -> Vec<Remaining> {
        Vec::new()
    }

    fn measures(&self, rows: &[Row], _layout: &Layout) -> Measures {
        let mut measures = Measures::default();
        let mut unexplained = AXES.map(|name| Unexplained { name, values: Vec::new() });
        let mut own = rows.iter().filter(|row| CHANNELS.contains(&row.channel));
        for window in &self.windows {
            for (axis, row) in own.by_ref().take(3).enumerate() {
                let rate = |change: f64| change / window.length_s;
                unexplained[axis].values.push((row.t_s, rate(row.residual), rate(window.change[axis])));
                if axis < 2 {
                    measures.velocity.push((row.t_s, row.residual));
                }
            }
        }
        measures.unexplained = unexplained.to_vec();
        measures
    }
}

/// Whether a log holds surge, sway, yaw rate and heading, a propeller and a rudder.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    let [propellers, rudders] = actuators(log);
    let needed = [Column::DvlU, Column::DvlV, Column::R, Column::Heading];
    needed.into_iter().all(|column| log.has(column)) && !propellers.is_empty() && !rudders.is_empty()
}

/// Diagnoses a manoeuvring vessel; `None` if it is under way too rarely.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let stated = |column| log.column(column).next().map(|(_, value)| value);
    let length_m = length_m(log, vehicle).0;
    let mass_kg = stated(Column::Mass).unwrap_or(vehicle.parameters.mass_kg);
    let areas = stated(Column::WindageFront).zip(stated(Column::WindageSide));
    let windage = areas.map(|(front, side)| Windage::new([front, side], length_m, mass_kg));
    let windows = windows::cut(log, length_m, windage);
    let has_anemometer = !windows.is_empty() && windows.iter().all(|window| window.wind.is_some());
    let (model, mut found, missed) = without_missed(&windows, windage, has_anemometer, log, vehicle)?;
    restate(&model, &mut found);
    let of_axis = |axis: usize| model.terms[axis].len();
    let mut notes = vec![format!(
        "declared model: surge, sway and yaw by hull, propeller and rudder in still air, {} + {} + {} numbers always fitted; {} \
         windows of {:.1} s in {} runs, {missed} left out that it does not explain (somebody held the vessel)",
        of_axis(0),
        of_axis(1),
        of_axis(2),
        model.windows.len(),
        model.windows.first().map_or(0.0, |window| window.length_s),
        model.runs.len()
    )];
    if windage.is_none() {
        notes.push("the log states no windage (windage_front_m2, windage_side_m2): a wind cannot be sized".to_owned());
    } else {
        notes.push(
            "a current is not tested: velocities over ground alone do not separate it from a steady wind".to_owned(),
        );
    }
    if has_anemometer {
        notes.extend(without_anemometer(&windows, windage, log, vehicle));
    }
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

/// Fits, leaves out what misses by far, and fits again.
fn without_missed(
    windows: &[Window],
    windage: Option<Windage>,
    has_anemometer: bool,
    log: &Log,
    vehicle: &VehicleFile,
) -> Option<(Planar, LogModelDiagnosis, usize)> {
    let length_m = length_m(log, vehicle).0;
    let mut model = Planar::new(windows.to_vec(), windage, has_anemometer, length_m)?;
    let mut found = log_models::run(&model, log, vehicle)?;
    let mut missed = 0;
    for _ in 0..ROUNDS {
        let more = model.without_missed(&found.theta[1]);
        if more == 0 {
            break;
        }
        missed += more;
        model = Planar::new(model.windows, windage, has_anemometer, length_m)?;
        found = log_models::run(&model, log, vehicle)?;
    }
    Some((model, found, missed))
}

/// The wind in numbers that a reader knows: wind of each run, or coefficients.
fn restate(model: &Planar, found: &mut LogModelDiagnosis) {
    let of = |column: usize| (found.theta[1][column], found.sigmas[column]);
    let from = model.wind().start;
    let values = if model.has_anemometer {
        let usual = [
            ("front_coefficient", Windage::FRONT),
            ("side_coefficient", Windage::SIDE),
            ("side_force_abaft", Windage::ABAFT),
            ("turning_coefficient", Windage::TURNING),
        ];
        let value = |(place, (name, usual)): (usize, (&'static str, f64))| {
            let (factor, sigma) = of(from + place);
            ParameterEstimate::size(name, "1", factor * usual, sigma * usual)
        };
        if model.wind().is_empty() { Vec::new() } else { usual.into_iter().enumerate().map(value).collect() }
    } else {
        let value = |(place, column): (usize, usize)| {
            let (value, sigma) = of(column);
            let number = model.runs[place / 2] as usize;
            ParameterEstimate::size(WINDS[place % 2][(number - 1).min(MOST_RUNS - 1)], "m/s", value, sigma)
        };
        model.wind().enumerate().map(value).collect()
    };
    for effect in &mut found.diagnosis.effects {
        if effect.instance.candidate.effect == "wind" {
            effect.values.clone_from(&values);
        }
    }
}

/// The wind of each run from the motion alone, beside the measured one.
fn without_anemometer(windows: &[Window], windage: Option<Windage>, log: &Log, vehicle: &VehicleFile) -> Vec<String> {
    let Some((model, found, _)) = without_missed(windows, windage, false, log, vehicle) else { return Vec::new() };
    if found.diagnosis.effects.iter().all(|effect| effect.instance.candidate.effect != "wind") {
        return vec!["without the anemometer no wind is found".to_owned()];
    }
    let mut notes = Vec::new();
    for (place, run) in model.runs.iter().enumerate() {
        let from = model.wind().start + 2 * place;
        let [north, east] = [found.theta[1][from], found.theta[1][from + 1]];
        let measured: Vec<[f64; 2]> =
            model.windows.iter().filter(|window| window.run == *run).filter_map(|window| window.measured_mps).collect();
        let count = measured.len().max(1) as f64;
        let mean = [0, 1].map(|axis| measured.iter().map(|wind| wind[axis]).sum::<f64>() / count);
        let speed = measured.iter().map(|wind| wind[0].hypot(wind[1])).sum::<f64>() / count;
        let turned = wrap_angle(east.atan2(north) - mean[1].atan2(mean[0])).to_degrees();
        notes.push(format!(
            "run {run}, wind from the motion alone: {north:.2} north, {east:.2} east m/s; measured in the mean {:.2}, {:.2} m/s: \
             direction {turned:+.0} degrees, speed {:.2} of the mean speed {speed:.2} m/s",
            mean[0],
            mean[1],
            north.hypot(east) / speed.max(f64::MIN_POSITIVE)
        ));
    }
    notes
}

#[cfg(test)]
mod tests;
