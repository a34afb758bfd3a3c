//! Logs without fins and propeller: dead reckoning on logged heading and speed against GNSS.
//!
//! The model: the vehicle moves along its heading with its logged speed (with a DVL: with its velocity over ground). The
//! difference to the fixes is explained by a current, a compass error, a speed scale, places and delays of the sensors.
//! A row is a position of the reckoning against a fix; where a sequence begins is free, so that only what is missing
//! since then counts, and it begins anew wherever the data are used for something else. Readings that the log repeats
//! while the sensor is away are left out.

mod track;

use self::track::{Readings, Track};
use super::layout::Layout;
use super::model::{Entry, LogModel, Measures, OutsideTerm, Row, catalogue_range};
use super::selection::{self, LogModelDiagnosis};
use crate::prepared_log::BLOCK_S;
use crate::remaining::Remaining;
use crate::samples::ResidualChannel;
use backseat_core::navigation::SensorNoise;
use backseat_logs::log::Column;
use backseat_logs::plausible_noise::{Carrier, most_position_error_m};
use backseat_logs::stats::{Z_95, rms};
use backseat_logs::{Log, Truth, VehicleFile};

/// Fewest fixes under way, `SHORTEST_S` apart, that are worth a fit.
pub const FEWEST: usize = 12;
const SHORTEST_S: f64 = 5.0;
/// Time over which a velocity is taken from two fixes, s.
const VELOCITY_S: f64 = 10.0;
/// Half of the time over which a velocity is that of a moment, s. Velocity, heading and fixes that are equally late are no
/// error: over a longer time the velocity's noise would tell them apart.
const MOMENT_S: f64 = 1e-3;
/// Time over which dead reckoning runs on when its position is scored, s.
const RECKONED_S: f64 = 600.0;

/// Columns: current north, east; heading constant, sine, cosine; speed scale; DVL yaw; second harmonic of the heading,
/// sine, cosine; current growing with time, north, east (without a name); delay of the heading; arm of the antenna,
/// ahead, to starboard; arm of the DVL, the same; delay of the DVL; delay of the fixes; sideslip.
const COLUMNS: usize = 19;
const CURRENT: usize = 0;
const HEADING: usize = 2;
const SCALE: usize = 5;
const YAW: usize = 6;
const IRON: usize = 7;
const GROWTH: usize = 9;
const LAG: usize = 11;
const ARM: usize = 12;
const DVL_ARM: usize = 14;
const DVL_DELAY: usize = 16;
const FIX_DELAY: usize = 17;
/// Sway in turns, which is the yaw rate times a length: a vehicle slips outwards.
const SIDESLIP: usize = 18;
/// What a torpedo's sideslip may be, as a length over its own: mean and one sigma. The simulated Iver3 has −0.40; two
/// logs of an Iver2 allow −0.1 to −0.9.
const SLIP: [f64; 2] = [-0.35, 0.35];

type Slopes = [[f64; COLUMNS]; 2];

/// The way over ground since the first of some readings, m, and its derivatives.
#[derive(Clone, Debug)]
struct Reckoned {
    /// Place of the readings.
    of: Option<usize>,
    /// How many spans from one reading to the next it has.
    spans: usize,
    moved_m: [f64; 2],
    by: Slopes,
}

impl Default for Reckoned {
    fn default() -> Self {
        Self { of: None, spans: 0, moved_m: [0.0; 2], by: [[0.0; COLUMNS]; 2] }
    }
}

impl Reckoned {
    fn add(&mut self, (way_m, by): &([f64; 2], Slopes)) {
        for axis in 0..2 {
            self.moved_m[axis] += way_m[axis];
            self.by[axis].iter_mut().zip(&by[axis]).for_each(|(sum, more)| *sum += more);
        }
    }
}

struct DeadReckoning {
    track: Track,
    has_dvl: bool,
    duration_s: f64,
    length_m: f64,
}

impl DeadReckoning {
    /// The true heading, by what the compass read.
    fn heading_rad(&self, read: f64, theta: &[f64]) -> f64 {
        let mut heading = read;
        for _ in 0..4 {
            let ((s1, c1), (s2, c2)) = (heading.sin_cos(), (2.0 * heading).sin_cos());
            let error = theta[HEADING] + theta[HEADING + 1] * s1 + theta[HEADING + 2] * c1;
            heading = read - error - theta[IRON] * s2 - theta[IRON + 1] * c2;
        }
        heading
    }

    /// The way over ground between two times, m, and its derivatives.
    fn way(&self, readings: &Readings, [from_s, to_s]: [f64; 2], theta: &[f64]) -> ([f64; 2], Slopes) {
        let dt_s = to_s - from_s;
        let mut by: Slopes = [[0.0; COLUMNS]; 2];
        if dt_s == 0.0 {
            return ([0.0; 2], by);
        }
        // What holds now is read a delay later.
        let late = |column: usize| readings.between([from_s + theta[column], to_s + theta[column]]);
        let [[.., heading_rad], [.., read_turned_rad]] = late(LAG);
        let psi = self.heading_rad(heading_rad, theta);
        let (sin, cos) = psi.sin_cos();
        let (sin2, cos2) = (2.0 * psi).sin_cos();
        let of_turn = theta[HEADING + 1] * cos - theta[HEADING + 2] * sin;
        let of_turn = of_turn + 2.0 * (theta[IRON] * cos2 - theta[IRON + 1] * sin2);
        let turned_rad = read_turned_rad / (1.0 + of_turn);
        let (ahead, starboard) = ([cos, sin], [-sin, cos]);
        let scale = 1.0 + theta[SCALE];
        let (yaw_sin, yaw_cos) = theta[YAW].sin_cos();
        let in_body =
            |[mu, mv, _]: [f64; 3]| [mu * yaw_cos - mv * yaw_sin, mu * yaw_sin + mv * yaw_cos].map(|v| v / scale);
        let [[u, v], change] = late(DVL_DELAY).map(in_body);
        let way = [0, 1].map(|axis| (u * ahead[axis] + v * starboard[axis]) * dt_s);
        let across = [-way[1], way[0]];
        let since_middle = to_s / self.duration_s - 0.5;
        let mut moved = way;
        for axis in 0..2 {
            let turn = [turned_rad * starboard[axis], -turned_rad * ahead[axis]];
            let slopes = &mut by[axis];
            slopes[CURRENT + axis] = dt_s;
            slopes[GROWTH + axis] = since_middle * dt_s;
            // True heading is measured less bias: the way turns back by it.
            let harmonics = [(HEADING, 1.0), (HEADING + 1, sin), (HEADING + 2, cos), (IRON, sin2), (IRON + 1, cos2)];
            for (column, factor) in harmonics {
                slopes[column] = -factor * across[axis];
            }
            slopes[SCALE] = -way[axis] / scale;
            slopes[YAW] = across[axis];
            slopes[LAG] = turned_rad / dt_s * across[axis];
            // Of a DVL's arm the reckoning has too much.
            slopes[DVL_ARM] = -turn[0];
            slopes[DVL_ARM + 1] = -turn[1];
            slopes[SIDESLIP] = turn[0];
            slopes[DVL_DELAY] = change[0] * ahead[axis] + change[1] * starboard[axis];
            let more = theta[CURRENT + axis] + since_middle * theta[GROWTH + axis];
            moved[axis] += more * dt_s + (theta[SIDESLIP] - theta[DVL_ARM]) * turn[0] - theta[DVL_ARM + 1] * turn[1];
        }
        (moved, by)
    }
}

impl LogModel for DeadReckoning {
    fn columns(&self) -> usize {
        COLUMNS
    }

    /// Position of each fix less that of the reckoning when it was taken, m.
    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        let mut rows = Vec::with_capacity(2 * self.track.fixes.len());
        let mut reckoned = Reckoned::default();
        // The derivatives by the delays leave the way in turns of slip and arms out, by both alike.
        let mut without_turns = theta.to_vec();
        [SIDESLIP, DVL_ARM, DVL_ARM + 1].into_iter().for_each(|column| without_turns[column] = 0.0);
        for fix in &self.track.fixes {
            let readings = &self.track.readings[fix.readings];
            if reckoned.of != Some(fix.readings) {
                reckoned = Reckoned { of: Some(fix.readings), ..Reckoned::default() };
            }
            let taken_s = fix.t_s - theta[FIX_DELAY];
            while let Some(span_s) = readings.span(reckoned.spans).filter(|[_, to_s]| *to_s <= taken_s) {
                reckoned.add(&self.way(readings, span_s, theta));
                reckoned.spans += 1;
            }
            let mut here = reckoned.clone();
            here.add(&self.way(readings, [readings.time_s(reckoned.spans), taken_s], theta));
            let (moment_m, _) = self.way(readings, [taken_s - MOMENT_S, taken_s + MOMENT_S], &without_turns);
            let (sin, cos) = self.heading_rad(readings.heading_rad(taken_s + theta[LAG]), theta).sin_cos();
            let by_arm = [[cos, -sin], [sin, cos]];
            for (axis, channel) in [ResidualChannel::GnssX, ResidualChannel::GnssY].into_iter().enumerate() {
                let mut slopes = here.by[axis].to_vec();
                (slopes[ARM], slopes[ARM + 1]) = (by_arm[axis][0], by_arm[axis][1]);
                slopes[FIX_DELAY] = -moment_m[axis] / (2.0 * MOMENT_S);
                let off = by_arm[axis][0] * theta[ARM] + by_arm[axis][1] * theta[ARM + 1];
                let residual = fix.at_m[axis] - here.moved_m[axis] - off;
                rows.push(Row { t_s: fix.t_s, channel, sequence: fix.sequence, residual, slopes });
            }
        }
        rows
    }

    /// Without a measured sway the vehicle's own sideslip in turns is a number that nobody declares.
    fn calibrated(&self) -> Vec<usize> {
        if self.has_dvl { Vec::new() } else { vec![SIDESLIP] }
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries = vec![
            ("water_current", vec![CURRENT, CURRENT + 1]),
            ("heading_bias", vec![HEADING, HEADING + 1, HEADING + 2]),
            ("dvl_scale", vec![SCALE]),
            ("heading_lag", vec![LAG]),
            ("gnss_lever_arm", vec![ARM, ARM + 1]),
            ("gnss_delay", vec![FIX_DELAY]),
            ("dvl_delay", vec![DVL_DELAY]),
        ];
        // heading bias and soft iron are five numbers
        if self.track.directions() >= 5 {
            entries.push(("soft_iron", vec![IRON, IRON + 1]));
        }
        if self.has_dvl {
            entries.push(("dvl_misalignment", vec![YAW]));
            entries.push(("dvl_lever_arm", vec![DVL_ARM, DVL_ARM + 1]));
        }
        entries
    }

    fn outside_catalogue(&self) -> Vec<OutsideTerm> {
        vec![("a current that grows with time", vec![GROWTH, GROWTH + 1])]
    }

    /// Of a delay longer than the velocity keeps its value the slope at none says nothing.
    fn starts(&self) -> Vec<(usize, &'static [f64])> {
        const DELAYS_S: &[f64] = &[0.5, 1.0, 1.5, 2.5, 4.0];
        [LAG, FIX_DELAY, DVL_DELAY].map(|column| (column, DELAYS_S)).to_vec()
    }

    /// What is equally late is no error: the least late is on time. Effects are judged one by one by derivatives, which hold
    /// only near the delays that they leave.
    fn of_those_alike(&self, mut theta: Vec<f64>) -> Vec<f64> {
        let delays = [LAG, FIX_DELAY, DVL_DELAY];
        let least_s = delays.map(|column| theta[column]).into_iter().fold(f64::INFINITY, f64::min);
        delays.into_iter().for_each(|column| theta[column] -= least_s);
        theta
    }

    fn runs(&self) -> Vec<[f64; 2]> {
        self.track.runs.clone()
    }

    fn prior(&self, column: usize) -> Option<[f64; 2]> {
        let arms = [ARM, ARM + 1, DVL_ARM, DVL_ARM + 1];
        match column {
            SIDESLIP => Some(SLIP.map(|share| share * self.length_m)),
            _ if arms.contains(&column) => Some([0.0, self.length_m]),
            _ => None,
        }
    }

    /// No arm is longer than the vehicle, and no sensor is early.
    fn limits(&self, entry: &'static str, place: usize) -> [f64; 2] {
        let [low, high] = catalogue_range(entry, place);
        match entry {
            "gnss_lever_arm" | "dvl_lever_arm" => [-self.length_m, self.length_m],
            "heading_lag" | "dvl_delay" | "gnss_delay" => [0.0, high],
            _ => [low, high],
        }
    }

    /// At one speed u an antenna x further aft, fixes or headings x/u late and a slip of so much more are the same way.
    fn at_odds(&self, theta: &[f64], sigmas: &[f64]) -> Option<String> {
        if self.has_dvl {
            return None;
        }
        let [mean, sigma] = SLIP.map(|share| share * self.length_m);
        let (slip, half) = (theta[SIDESLIP], Z_95 * sigmas[SIDESLIP]);
        let [low, high] = [mean - Z_95 * sigma, mean + Z_95 * sigma];
        let outwards = slip + half < low;
        (outwards || slip - half > high).then(|| {
            let causes = if outwards {
                "fixes that are late, or an antenna further aft"
            } else {
                "a heading that is late, or an antenna further ahead"
            };
            format!(
                "sway in turns of {slip:.2} (±{half:.2}) m times the yaw rate is fitted, where a torpedo of {:.1} m slips by \
                 {low:.2} to {high:.2} m: one of {causes}. At one speed they are the same; turns at half and at full speed \
                 would separate them",
                self.length_m
            )
        })
    }

    fn is_summed(&self, _channel: ResidualChannel) -> bool {
        true
    }

    fn events(&self) -> Vec<&'static str> {
        vec!["water_current", "heading_bias", "dvl_scale"]
    }

    fn block_s(&self) -> f64 {
        BLOCK_S
    }

    /// Velocity missing between fixes some seconds apart, and the position lost since the reckoning last began.
    fn measures(&self, rows: &[Row], layout: &Layout) -> Measures {
        let has_truth = self.track.fixes.iter().any(|fix| fix.truth_m.is_some());
        let mut measures = Measures::default();
        for reckoned in self.reckoned(rows, layout, has_truth) {
            // A line of the errors breaks where the reckoning begins anew.
            measures.position.extend(reckoned.first().map(|(t_s, ..)| (*t_s, f64::NAN)));
            let mut last: Option<(f64, [f64; 2])> = None;
            for (t_s, lost_m, _) in reckoned {
                if t_s.is_finite() && lost_m != [0.0; 2] {
                    measures.position.push((t_s, lost_m[0].hypot(lost_m[1])));
                }
                match last {
                    Some((before_s, before)) if t_s - before_s >= VELOCITY_S => {
                        let rate = |axis: usize| (lost_m[axis] - before[axis]) / (t_s - before_s);
                        measures.velocity.extend([(t_s, rate(0)), (t_s, rate(1))]);
                        last = Some((t_s, lost_m));
                    }
                    None => last = Some((t_s, lost_m)),
                    Some(_) => {}
                }
            }
        }
        measures.against = Some(if has_truth {
            "truth, dead reckoning of each stretch by itself"
        } else {
            "GNSS fixes, dead reckoning of each stretch by itself"
        });
        measures
    }

    /// The position lost, beside what fixes and drift may make of the way run.
    fn remaining(&self, rows: &[Row], layout: &Layout, sensors: &SensorNoise) -> Vec<Remaining> {
        let carrier = if self.has_dvl { Carrier::BottomTrack } else { Carrier::WaterSpeed };
        let judged: Vec<(f64, f64)> = self
            .reckoned(rows, layout, false)
            .into_iter()
            .flatten()
            .filter(|(t_s, ..)| layout.is_judged(*t_s))
            .map(|(_, lost_m, run_m)| (lost_m[0].hypot(lost_m[1]), most_position_error_m(carrier, run_m, sensors)))
            .collect();
        let (left, most): (Vec<f64>, Vec<f64>) = judged.into_iter().unzip();
        let what = "position error of dead reckoning".to_owned();
        let both = rms(&left).zip(rms(&most));
        both.map(|(left, most)| Remaining { what, unit: "m", left, most }).into_iter().collect()
    }
}

/// Of each stretch that is reckoned by itself: time, position lost and way run since it began.
type Stretches = Vec<Vec<(f64, [f64; 2], f64)>>;

impl DeadReckoning {
    fn reckoned(&self, rows: &[Row], layout: &Layout, against_truth: bool) -> Stretches {
        let mut all: Stretches = Vec::new();
        let mut began: Option<(u32, u8, f64, [f64; 2], f64)> = None;
        for (pair, fix) in rows.chunks_exact(2).zip(&self.track.fixes) {
            let off = match (against_truth, fix.truth_m) {
                (true, Some(truth)) => [0, 1].map(|axis| truth[axis] - fix.at_m[axis]),
                (true, None) => continue,
                (false, _) => [0.0; 2],
            };
            let error = [0, 1].map(|axis| pair[axis].residual + off[axis]);
            let part = layout.use_of(fix.t_s);
            match began {
                Some((sequence, of, from_s, first, from_m))
                    if sequence == fix.sequence && of == part && fix.t_s - from_s <= RECKONED_S =>
                {
                    let lost_m = [0, 1].map(|axis| error[axis] - first[axis]);
                    if let Some(stretch) = all.last_mut() {
                        stretch.push((fix.t_s, lost_m, fix.distance_m - from_m));
                    }
                }
                _ => {
                    began = Some((fix.sequence, part, fix.t_s, error, fix.distance_m));
                    all.push(Vec::new());
                }
            }
        }
        all
    }
}

fn has_dvl(log: &Log) -> bool {
    log.has(Column::DvlU) && log.has(Column::DvlV)
}

/// Fixes under way, some seconds apart.
fn count(track: &Track) -> usize {
    let mut last: Option<(u32, f64)> = None;
    let mut count = 0;
    for fix in &track.fixes {
        match last {
            Some((sequence, t_s)) if sequence == fix.sequence && fix.t_s - t_s < SHORTEST_S => continue,
            Some((sequence, _)) if sequence == fix.sequence => count += 1,
            _ => {}
        }
        last = Some((fix.sequence, fix.t_s));
    }
    count
}

/// Whether a log holds heading, speed and fixes under way, enough of them for [`run`].
#[must_use]
pub fn is_for(log: &Log) -> bool {
    count(&track::of(log, has_dvl(log), None)) >= FEWEST
}

/// Diagnoses a log on heading and speed alone; `None` if it has too few fixes, headings or speeds.
///
/// `use_dvl` false leaves the DVL's velocity out: its surge then serves as nothing, the logged speed is used.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile, use_dvl: bool, truth: Option<&Truth>) -> Option<LogModelDiagnosis> {
    let has_dvl = use_dvl && has_dvl(log);
    let track = track::of(log, has_dvl, truth);
    if count(&track) < FEWEST {
        return None;
    }
    let held = track.held.clone();
    let duration_s = log.duration_s().max(1.0);
    let model = DeadReckoning { track, has_dvl, duration_s, length_m: vehicle.parameters.length_m };
    let mut found = selection::run(&model, log, vehicle)?;
    let name = if has_dvl { "the DVL's velocity" } else { "the logged speed" };
    let mut notes = vec![format!(
        "the log has no fin angles and propeller speed: the declared model is dead reckoning on the logged heading and {name}, \
         which begins anew wherever the log is used for something else. Only effects on the horizontal position can be tested"
    )];
    if !has_dvl {
        notes.push(format!(
            "sway in turns of {:.2} (±{:.2}) m times the yaw rate is always fitted, for a torpedo slips outwards (negative): \
             at one speed an antenna ahead or aft, late fixes and a late heading look like it",
            found.theta[1][SIDESLIP],
            Z_95 * found.sigmas[SIDESLIP]
        ));
    }
    for [from_s, to_s] in held {
        notes.push(format!(
            "{name} does not change at all from {from_s:.0} s to {to_s:.0} s: these readings are held, not measured, and are \
             left out"
        ));
    }
    if has_dvl {
        notes.push(
            "DVL bottom track includes the current: a water_current found here is a difference between DVL and fixes that is \
             constant in NED"
                .to_owned(),
        );
    } else {
        notes.push("dvl_scale and dvl_delay mean here the scale and the delay of the logged speed".to_owned());
    }
    notes.push(
        "wind and waves move a vehicle at the surface too: a current found there includes their drift".to_owned(),
    );
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

#[cfg(test)]
mod tests;
