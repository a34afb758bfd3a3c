//! Navigation of each run without its DVL, which is kept as the judge.
//!
//! The way is that of the DVL's readings, each held until the next and turned by the measured attitude. A model goes the
//! same way by the readings that it expects at the same rows: by its own speed, as late and as much too large as it has
//! found the DVL to be. So neither a DVL's scale nor its delay passes for a drift of the model.

use backseat_core::state::{P, PHI, PSI, Q, R, THETA, U, V, VehicleState, W, Z};
use backseat_identify::short_runs::recording::{Wanted, stretches};
use backseat_identify::short_runs::start::measured_state;
use backseat_identify::short_runs::{Run, RunModel};

/// Shorter stretches do not count, s.
const LEAST_S: f64 = 10.0;
/// Ways that are judged: by two models, and by speed per propeller speed.
pub const WAYS: usize = 3;

/// What stretches say; sums over them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drift {
    /// Way by the DVL, m.
    pub distance_m: f64,
    /// Distance of the ends of the way from those of the DVL's, m.
    pub drift_m: [f64; WAYS],
    /// By how much a way ends further ahead than the DVL's, seen from where both began, m.
    pub ahead_m: [f64; WAYS],
    /// The same to the right.
    pub right_m: [f64; WAYS],
}

impl Drift {
    /// Both together.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        self.distance_m += other.distance_m;
        for way in 0..WAYS {
            self.drift_m[way] += other.drift_m[way];
            self.ahead_m[way] += other.ahead_m[way];
            self.right_m[way] += other.right_m[way];
        }
        self
    }

    /// One stretch: the ends of the DVL's way and of the others from its start, north and east, m.
    fn of(distance_m: f64, judge: [f64; 2], ways: [[f64; 2]; WAYS]) -> Self {
        let mut drift = Self { distance_m, ..Self::default() };
        let length_m = judge[0].hypot(judge[1]).max(1e-9);
        let [north, east] = judge.map(|component| component / length_m);
        for (way, end) in ways.into_iter().enumerate() {
            let [to_north, to_east] = [end[0] - judge[0], end[1] - judge[1]];
            drift.drift_m[way] = to_north.hypot(to_east);
            drift.ahead_m[way] = to_north * north + to_east * east;
            drift.right_m[way] = to_east * north - to_north * east;
        }
        drift
    }
}

/// Speed over propeller speed of runs, m, by least squares.
#[must_use]
pub fn speed_per_radps<'a>(runs: impl Iterator<Item = &'a Run>) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for sample in runs.flat_map(|run| &run.samples) {
        if let Some([u, ..]) = sample.dvl_mps
            && sample.is_powered()
            && sample.depth_m > 0.5
        {
            above += u * sample.input.propeller_radps;
            below += sample.input.propeller_radps.powi(2);
        }
    }
    if below > 0.0 { above / below } else { 0.0 }
}

/// The drift over a run's powered and submerged stretches; `None`: there is none.
#[must_use]
pub fn drift(run: &Run, models: [&RunModel; 2], speed_per_radps: f64) -> Option<Drift> {
    let wanted = Wanted { depth_m: 0.5, powered: true, speed_mps: 0.0 };
    let long = stretches(run, wanted).into_iter().filter(|(first, last)| {
        let [from_s, to_s] = [*first, *last].map(|index| run.samples[index].t_s);
        to_s - from_s >= LEAST_S
    });
    let all = long.map(|(first, last)| over(run, [first, last], models, speed_per_radps));
    all.reduce(|sum, one| sum.plus(&one)).filter(|drift| drift.distance_m > 0.0)
}

fn over(run: &Run, [first, last]: [usize; 2], models: [&RunModel; 2], speed_per_radps: f64) -> Drift {
    let mut trails = models.map(|model| vec![(run.samples[first].t_s, measured_state(run, first, &model.dvl()))]);
    let (mut judge, mut ways, mut distance_m) = ([0.0; 2], [[0.0; 2]; WAYS], 0.0);
    let mut held: Option<([f64; 2], [[f64; 2]; WAYS])> = None;
    for index in first..last {
        let (here, next) = (&run.samples[index], &run.samples[index + 1]);
        let h_s = next.t_s - here.t_s;
        if let Some([u, v, _]) = here.dvl_mps {
            let expected = |model: usize| models[model].dvl_of(&trails[model], here.t_s);
            let simple = [speed_per_radps * here.input.propeller_radps, 0.0];
            held = Some(([u, v], [expected(0), expected(1), simple]));
        }
        let attitude = measured_state(run, index, &models[1].dvl());
        if let Some((measured, expected)) = held {
            let step = |[u, v]: [f64; 2]| {
                let (sin, cos) = attitude[PSI].sin_cos();
                let ahead = u * attitude[THETA].cos();
                [(ahead * cos - v * sin) * h_s, (ahead * sin + v * cos) * h_s]
            };
            let add = |sum: &mut [f64; 2], by: [f64; 2]| *sum = [sum[0] + by[0], sum[1] + by[1]];
            add(&mut judge, step(measured));
            distance_m += step(measured)[0].hypot(step(measured)[1]);
            ways.iter_mut().zip(expected).for_each(|(way, expected)| add(way, step(expected)));
        }
        for (trail, model) in trails.iter_mut().zip(models) {
            let mut state = trail[trail.len() - 1].1;
            [PHI, THETA, PSI, Z, P, Q, R].into_iter().for_each(|place| state[place] = attitude[place]);
            trail.push((next.t_s, limited(model.carried(run, &state, [here.t_s, next.t_s]))));
        }
    }
    Drift::of(distance_m, judge, ways)
}

/// Speeds that no model may leave: a wrong one is to drift, not to overflow.
fn limited(mut state: VehicleState) -> VehicleState {
    for place in [U, V, W] {
        state[place] = state[place].clamp(-5.0, 5.0);
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_is_seen_from_where_both_began() {
        // to the east; the first way is a metre short, the second a metre to the left, the third as the judge's
        let drift = Drift::of(10.0, [0.0, 10.0], [[0.0, 9.0], [1.0, 10.0], [0.0, 10.0]]);
        assert_eq!(
            (drift.drift_m, drift.ahead_m, drift.right_m),
            ([1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0])
        );
        let both = drift.plus(&drift);
        assert_eq!((both.distance_m, both.right_m[1]), (20.0, -2.0));
    }
}
