//! Section 5.2: the regulator's gain by the Riccati equation about the current state, against one gain for all.
//!
//! Both steer about the same reference trajectory (5.1) on the same filter's estimate, without a board between them; the
//! gain is all that differs.

use super::steering::scenario_of;
use super::{Kind, Measured, Study, conditions};
use crate::closed_loop::{self, ClosedLoop, SPEED_MPS, STEP_US, across_m, mission_along, start_deep};
use crate::sampled_lqr::SampledLqr;
use anyhow::{Context, anyhow};
use backseat_core::control::allocation::{Datum, Moments, allocate};
use backseat_core::control::limits::Limiter;
use backseat_core::control::lqr::{Lqr, LqrGain, LqrWeights};
use backseat_core::control::mission::Mission;
use backseat_core::control::reference::ReferenceTrajectory;
use backseat_core::control::speed::propeller_radps;
use backseat_core::control::{ControlConfig, LawContext};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::ProcessModel;
use backseat_core::state::{self, PHI, PSI, U, VehicleState, X, Y, wrap_angle};
use backseat_estimation::filter::FilterOptions;
use backseat_logs::stats::{ErrorSummary, rms};

/// Chapter 5's conditions, deep and under way from the start.
pub const RICCATI: Study = Study { name: "riccati", kind: Kind::Own(run) };

/// Where a gain comes from.
#[derive(Clone, Copy, Debug)]
enum Gain {
    /// The board's: the algebraic equation about straight flight.
    Straight,
    /// The discrete equation about the current state, every so many steps.
    Current { every: u64 },
}

const ROWS: [(&str, Gain); 2] =
    [("about straight flight", Gain::Straight), ("about the current state, each second", Gain::Current { every: 10 })];

fn run(seed: u64) -> anyhow::Result<Measured> {
    let mut measured = Measured::default();
    for (row, gain) in ROWS {
        fly(&mut measured, row, gain, seed).with_context(|| row.to_owned())?;
    }
    Ok(measured)
}

/// What steers.
struct Regulator {
    config: ControlConfig,
    model: VehicleModel,
    mission: Mission,
    lqr: Lqr,
    reference: ReferenceTrajectory,
    limiter: Limiter,
    source: Gain,
    gain: LqrGain,
    steps: u64,
    /// States about which the equation had no solution; the gain before stays.
    unsolved: u64,
}

impl Regulator {
    fn new(model: &VehicleModel, mission: Mission, x: &VehicleState, source: Gain) -> anyhow::Result<Self> {
        let config = ControlConfig::REFERENCE;
        let mut lqr = Lqr::new();
        lqr.configure(model, SPEED_MPS).map_err(|error| anyhow!("gain: {error:?}"))?;
        let limiter = Limiter::new(config.limits.within(model.parameters()));
        let mut reference = ReferenceTrajectory::new(limiter);
        reference.start(&mission, x, &limiter).map_err(|error| anyhow!("start: {error:?}"))?;
        let gain = *lqr.gain();
        let model = model.clone();
        Ok(Self { config, model, mission, lqr, reference, limiter, source, gain, steps: 0, unsolved: 0 })
    }

    /// The command for an estimate, and the state that the reference has; `None` once it has finished the mission.
    fn command(&mut self, x: &VehicleState) -> Option<(ActuatorInput, VehicleState)> {
        let period_s = STEP_US as f64 * 1e-6;
        let context =
            LawContext { config: &self.config, model: &self.model, trim: self.lqr.trim(), current_ne_mps: [0.0; 2] };
        let (x_ref, input_ref) = self.reference.step(&context, &self.mission, x, period_s)?;
        // In the axes of the reference's heading.
        let mut relative = *x;
        relative[PSI] = wrap_angle(x[PSI] - x_ref[PSI]);
        if let Gain::Current { every } = self.source
            && self.steps.is_multiple_of(every)
        {
            let sampled = SampledLqr { model: &self.model, weights: LqrWeights::DEFAULT, period_s };
            match sampled.gain_at(&relative, self.limiter.last()) {
                Some(gain) => self.gain = gain,
                None => self.unsolved += 1,
            }
        }
        self.steps += 1;
        let mut error = x - x_ref;
        let (sin, cos) = libm::sincos(x_ref[PSI]);
        (error[X], error[Y]) = (cos * error[X] + sin * error[Y], cos * error[Y] - sin * error[X]);
        error[PHI] = wrap_angle(error[PHI]);
        error[PSI] = relative[PSI];
        let demand = -(self.gain * error);
        let propeller = self.model.propeller();
        let thrust = propeller.thrust(input_ref.propeller_radps, x_ref[U]) + demand[0];
        let moments = Moments { roll_nm: 0.0, pitch_nm: demand[1], yaw_nm: demand[2] };
        let wanted = ActuatorInput {
            propeller_radps: propeller_radps(propeller, thrust.clamp(0.0, self.config.speed.thrust_max_n), x[U]),
            fins_rad: allocate(
                self.config.allocation,
                &self.model,
                &state::velocity(x),
                &moments,
                &Datum::Above(input_ref.fins_rad),
                self.limiter.limits().fin_rad,
            ),
        };
        Some((self.limiter.apply(&wanted, period_s), x_ref))
    }
}

fn fly(measured: &mut Measured, row: &str, source: Gain, seed: u64) -> anyhow::Result<()> {
    let mut scenario = scenario_of(&conditions::C, seed)?;
    start_deep(&mut scenario.settings);
    let (lines, end_us) = (scenario.settings.lines(), (scenario.settings.duration_s * 1e6) as u64);
    let vehicle = &scenario.vehicle;
    let model = VehicleModel::new(&vehicle.parameters).map_err(|error| anyhow!("vehicle: {error}"))?;
    let config = FilterOptions::new(vehicle, ProcessModel::Dynamic).navigation;
    let mut sea = ClosedLoop::new(&scenario, vehicle, &model, &config)?;
    let start = VehicleState::from_column_slice(&sea.world.truth().state);
    let mut regulator = Regulator::new(&model, mission_along(&lines)?, &start, source)?;
    let (mut across, mut depth, mut from_reference, mut navigation) = (vec![], vec![], vec![], vec![]);
    let (mut fins, mut fin_steps, mut before) = (vec![], vec![], [0.0; 4]);
    let finished = closed_loop::fly(&mut sea, STEP_US..=end_us, |time_us, sea| {
        let estimate = *sea.navigator.state();
        let Some((input, x_ref)) = regulator.command(&estimate) else { return Ok(None) };
        let truth = sea.world.truth().state;
        fins.extend(input.fins_rad);
        fin_steps.extend(input.fins_rad.iter().zip(before).map(|(now, then)| now - then));
        before = input.fins_rad;
        from_reference.push((estimate[X] - x_ref[X]).hypot(estimate[Y] - x_ref[Y]));
        if time_us.is_multiple_of(1_000_000) {
            navigation.push((estimate[X] - truth[X]).hypot(estimate[Y] - truth[Y]));
            if let Some(across_m) = across_m(&lines, &truth) {
                across.push(across_m.abs());
                depth.push((truth[2] - conditions::C.lines.depth_m).abs());
            }
        }
        Ok(Some(input))
    })?;
    let across = ErrorSummary::of(&across).context("no line was flown")?;
    measured.set(row, "cross_median_m", across.median_m);
    measured.set(row, "cross_p95_m", across.p95_m);
    measured.set(row, "cross_max_m", across.max_m);
    let summary = |values: &[f64]| ErrorSummary::of(values).map_or([f64::NAN; 3], |s| [s.median_m, s.p95_m, s.max_m]);
    measured.set(row, "depth_p95_m", summary(&depth)[1]);
    let [_, p95, max] = summary(&from_reference);
    measured.set(row, "reference_p95_m", p95);
    measured.set(row, "reference_max_m", max);
    measured.set(row, "fins_deg", rms(&fins).unwrap_or(f64::NAN).to_degrees());
    measured.set(row, "fin_steps_deg", rms(&fin_steps).unwrap_or(f64::NAN).to_degrees());
    let [median, p95, _] = summary(&navigation);
    measured.set(row, "navigation_median_m", median);
    measured.set(row, "navigation_p95_m", p95);
    measured.set(row, "unsolved", regulator.unsolved as f64);
    measured.set(row, "finished", f64::from(u8::from(finished)));
    Ok(())
}
