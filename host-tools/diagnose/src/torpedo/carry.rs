//! Navigation of each run without its DVL, which is kept as the judge: the drift of the model's velocity, turned by the
//! measured attitude, against the way that the DVL says.

use backseat_core::state::{P, PHI, PSI, Q, R, THETA, U, V, VehicleState, W, X, Y, Z};
use backseat_identify::short_runs::recording::{Wanted, stretches};
use backseat_identify::short_runs::start::measured_state;
use backseat_identify::short_runs::{Run, RunModel};

/// Shorter stretches do not count, s.
const LEAST_S: f64 = 10.0;

/// What a run's stretches say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drift {
    /// Way by the DVL, m.
    pub distance_m: f64,
    /// Distance of the ends of the way by the first model, by the second, and by speed per propeller speed, m.
    pub drift_m: [f64; 3],
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
    let mut all = Drift::default();
    for (first, last) in stretches(run, wanted) {
        if run.samples[last].t_s - run.samples[first].t_s < LEAST_S {
            continue;
        }
        let dvl = models[1].dvl();
        let mut states = [measured_state(run, first, dvl); 2];
        let (mut judge, mut simple) = ([0.0; 2], [0.0; 2]);
        let mut measured_mps = [states[0][U], 0.0];
        for index in first..last {
            let (here, next) = (&run.samples[index], &run.samples[index + 1]);
            let h_s = next.t_s - here.t_s;
            if let Some([u, v, _]) = here.dvl_mps {
                measured_mps = [u, v];
            }
            let attitude = measured_state(run, index, dvl);
            let step = |[u, v]: [f64; 2]| {
                let (sin, cos) = attitude[PSI].sin_cos();
                let ahead = u * attitude[THETA].cos();
                [(ahead * cos - v * sin) * h_s, (ahead * sin + v * cos) * h_s]
            };
            let add = |sum: &mut [f64; 2], by: [f64; 2]| *sum = [sum[0] + by[0], sum[1] + by[1]];
            add(&mut judge, step(measured_mps));
            all.distance_m += step(measured_mps)[0].hypot(step(measured_mps)[1]);
            add(&mut simple, step([speed_per_radps * here.input.propeller_radps, 0.0]));
            for (state, model) in states.iter_mut().zip(models) {
                [PHI, THETA, PSI, Z, P, Q, R].into_iter().for_each(|place| state[place] = attitude[place]);
                *state = limited(model.carried(run, state, [here.t_s, next.t_s]));
            }
        }
        for (model, state) in states.iter().enumerate() {
            all.drift_m[model] += (state[X] - judge[0]).hypot(state[Y] - judge[1]);
        }
        all.drift_m[2] += (simple[0] - judge[0]).hypot(simple[1] - judge[1]);
    }
    (all.distance_m > 0.0).then_some(all)
}

/// Speeds that no model may leave: a wrong one is to drift, not to overflow.
fn limited(mut state: VehicleState) -> VehicleState {
    for place in [U, V, W] {
        state[place] = state[place].clamp(-5.0, 5.0);
    }
    state
}
