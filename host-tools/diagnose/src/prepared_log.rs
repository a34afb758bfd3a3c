//! One log made ready: passes over it, and refined fits.

use crate::candidates::{Instance, Scope, own_terms, set_of};
use crate::linear;
use crate::log_effects::Effects;
use crate::noise;
use crate::normal_equations::NormalEquations;
use crate::regressors::Regressor;
use crate::samples::{ResidualChannel, Samples};
pub use crate::split::{DataPart, FORECAST_SHARE, Split};
use crate::timing;
use crate::whitener::{self, Pass, Residual, Setup};
use backseat_core::navigation::SurfaceNoise;
use backseat_core::parameters::ProcessNoise;
use backseat_estimation::commands::InputTiming;
use backseat_estimation::inputs;
use backseat_logs::log::Column;
use backseat_logs::{Log, VehicleFile};
use std::collections::BTreeSet;

/// Length of a block, s: longer than the coloured part of most residuals, short against a log.
pub const BLOCK_S: f64 = 20.0;
/// A longer log than three hours has longer blocks: each keeps the squares and products of some hundred columns.
const MOST_BLOCKS: f64 = 600.0;
/// A log, its declared model, and what every pass has in common.
pub struct PreparedLog {
    /// Noise, scales and outliers.
    pub setup: Setup,
    /// Readings and inputs.
    pub samples: Samples,
    /// When the inputs act.
    pub timing: InputTiming,
    /// What the log can say.
    pub scope: Scope,
    /// Scale of each channel's noise before any wave is found.
    pub own_scale: [f64; ResidualChannel::COUNT],
    /// Innovations of the declared model.
    pub declared: Pass,
    /// What each block is used for.
    pub split: Split,
    /// Scale of each channel's noise before noise that lasts was looked for.
    pub declared_scale: [f64; ResidualChannel::COUNT],
    /// Noise of the motion, as the vehicle file has it; and at the surface.
    pub declared_noise: (ProcessNoise, SurfaceNoise),
    /// Effects beside which noise that lasts was estimated last.
    pub noise_beside: Vec<&'static str>,
    /// Whether noise that lasts was looked for.
    pub is_noise_estimated: bool,
    /// Onsets and ends found under the declared noise, s: of a quieter sensor the search from coarse times misses a jump.
    pub event_times_s: Vec<f64>,
    /// Effects beside which the timing of the inputs was chosen last.
    timed_beside: Vec<&'static str>,
}

/// Effects fitted together.
#[derive(Clone, Debug)]
pub struct JointFit {
    /// With their values.
    pub instances: Vec<Instance>,
    /// Σ e² of the blocks fitted.
    pub square: f64,
    /// Σ e² of all blocks but those that judge.
    pub seen_square: f64,
    /// One sigma of every size, in order.
    pub sigmas: Vec<f64>,
    /// The last pass; its first columns are the sizes.
    pub pass: Pass,
}

impl JointFit {
    /// One sigma of every size of an effect.
    #[must_use]
    pub fn sigmas_of(&self, place: usize) -> &[f64] {
        let from = self.instances[..place].iter().map(|instance| instance.sizes.len()).sum::<usize>();
        &self.sigmas[from..from + self.instances[place].sizes.len()]
    }
}

impl PreparedLog {
    /// Makes a log ready; `None` where the filter cannot start (no fix, no attitude).
    #[must_use]
    pub fn new(log: &Log, vehicle: &VehicleFile, use_dvl: bool) -> Option<Self> {
        let log = &*inputs::at_centre(log, &vehicle.installation);
        let mut samples = Samples::of(log, vehicle, use_dvl);
        let mut setup = Setup {
            parameters: vehicle.parameters,
            noise: vehicle.noise,
            surface: SurfaceNoise::DYNAMIC,
            sensors: vehicle.sensors,
            installation: vehicle.installation,
            scale: [1.0; ResidualChannel::COUNT],
            swing: [1.0; ResidualChannel::COUNT],
            colours: Vec::new(),
            outliers: Vec::new(),
            block_s: BLOCK_S.max(samples.duration_s / MOST_BLOCKS),
            proposed: Vec::new(),
        };
        let set = Effects::from(vehicle.effects.set);
        let split = Split::of_one_run(samples.duration_s, setup.block_s, FORECAST_SHARE);
        let (timing, pass) = timing::choose((&setup, &split), &samples, &set, &InputTiming::default())?;
        samples.act(&timing);
        let mut declared = pass.or_else(|| whitener::run(&setup, &samples, &set, &[]))?;
        let seen: Vec<Residual> =
            declared.residuals.iter().filter(|r| split.is_at(DataPart::Seen, r.t_s)).copied().collect();
        setup.scale = noise::scales(&seen, &setup.sensors);
        let is_scaled = setup.scale.iter().any(|scale| *scale > 1.0);
        // An outlier bends what follows it, so that its neighbours look wrong: look again without it.
        for attempt in 0..2 {
            let flags = noise::flags(&samples, &noise::outliers(&declared.residuals, &split));
            let is_same = flags == setup.outliers || (setup.outliers.is_empty() && !flags.contains(&true));
            if is_same && (attempt > 0 || !is_scaled) {
                break;
            }
            setup.outliers = flags;
            declared = whitener::run(&setup, &samples, &set, &[])?;
        }
        let heard: BTreeSet<u32> = declared.residuals.iter().filter_map(|residual| residual.station).collect();
        let scope = Scope {
            stations: heard.into_iter().collect(),
            present: present(&declared),
            has_density: log.has(Column::WaterDensity),
            duration_s: samples.duration_s,
            declared: set,
        };
        let (own_scale, declared_noise) = (setup.scale, (setup.noise, setup.surface));
        Some(Self {
            own_scale,
            setup,
            samples,
            timing,
            scope,
            declared,
            split,
            declared_scale: own_scale,
            declared_noise,
            noise_beside: Vec::new(),
            is_noise_estimated: false,
            event_times_s: Vec::new(),
            timed_beside: Vec::new(),
        })
    }

    /// Its first seconds, with the use of their blocks.
    #[must_use]
    pub fn first(&self, longest_s: f64) -> Option<Self> {
        let mut samples = self.samples.clone();
        samples.events.retain(|(t_s, _)| *t_s <= longest_s);
        let declared = whitener::run(&self.setup, &samples, &self.scope.declared, &[])?;
        Some(Self {
            setup: self.setup.clone(),
            split: self.split.clone(),
            timed_beside: self.timed_beside.clone(),
            event_times_s: self.event_times_s.clone(),
            noise_beside: self.noise_beside.clone(),
            samples,
            declared,
            scope: self.scope.clone(),
            ..*self
        })
    }

    /// Looks again when the inputs act, with these effects, if it was not done beside all of them; whether that is not as
    /// before.
    pub fn retime(&mut self, beside: &[Instance]) -> Option<bool> {
        let effects: Vec<&'static str> = beside.iter().map(|instance| instance.candidate.effect).collect();
        if !effects.is_empty() && effects.iter().all(|effect| self.timed_beside.contains(effect)) {
            return Some(false);
        }
        self.timed_beside = effects;
        let set = set_of(&self.scope.declared, beside);
        let (timing, _) = timing::choose((&self.setup, &self.split), &self.samples, &set, &self.timing)?;
        if timing == self.timing {
            return Some(false);
        }
        self.act(timing)?;
        Some(true)
    }

    /// Whether fins, or all inputs, that act the other way, held or moving on between samples, fit better with these effects fitted
    /// again: a lag of the fins takes up the half sample between the two, so that [`PreparedLog::retime`] does not see it.
    /// Beside a pure delay the two fit alike, and the timing stays as it is.
    pub fn retime_beside_lag(&mut self, instances: &[Instance]) -> Option<bool> {
        /// Two models with as many numbers: Σ e² lower by this is a likelihood ratio of exp(7), 1,000 to 1.
        const LEAST: f64 = 14.0;
        if self.samples.commands.is_incomplete()
            || !instances.iter().any(|instance| instance.candidate.is_lag() && !instance.candidate.is_pure_delay())
        {
            return Some(false);
        }
        let before = self.timing;
        let mut best = (self.fit(instances, DataPart::Seen)?.seen_square - LEAST, before);
        for other in [timing::fins_turned(before), before.map(timing::turned)] {
            self.act(other)?;
            if let Some(joint) = self.fit(instances, DataPart::Seen).filter(|joint| joint.seen_square < best.0) {
                best = (joint.seen_square, other);
            }
        }
        self.act(best.1)?;
        Some(best.1 != before)
    }

    fn act(&mut self, timing: InputTiming) -> Option<()> {
        self.timing = timing;
        self.samples.act(&timing);
        self.declared = self.pass(&self.scope.declared, &[])?;
        Some(())
    }

    /// Whether a block belongs to a part.
    #[must_use]
    pub fn is_in(&self, part: DataPart, block: usize) -> bool {
        self.split.is_in(part, block)
    }

    /// Whether a time judges.
    #[must_use]
    pub fn is_judged(&self, t_s: f64) -> bool {
        self.split.is_at(DataPart::Judge, t_s)
    }

    /// Whether a block is one of those that choose effects.
    pub fn seen(&self) -> impl Fn(usize) -> bool + '_ {
        |block| self.is_in(DataPart::Seen, block)
    }

    /// Σ e² of the blocks that choose effects.
    #[must_use]
    pub fn seen_square(&self, pass: &Pass) -> f64 {
        pass.normal.square(self.seen())
    }

    /// Runs the filter with a set of effects and columns.
    #[must_use]
    pub fn pass(&self, set: &Effects, terms: &[Regressor]) -> Option<Pass> {
        whitener::run(&self.setup, &self.samples, set, terms)
    }

    /// Fits the sizes of all instances together on a part, by Gauss and Newton from their present values.
    #[must_use]
    pub fn fit(&self, instances: &[Instance], part: DataPart) -> Option<JointFit> {
        const MOST_STEPS: usize = 12;
        /// Where a step must be halved more often, the model is no better than its derivative.
        const MOST_HALVINGS: usize = 2;
        /// A step below this many sigmas changes nothing that matters.
        const SMALL: f64 = 0.1;
        /// What Σ e² may rise by the rounding of a step and still be no worse.
        const ROUNDING: f64 = 0.05;
        /// Where a step is worse that promised less, half a sigma, nothing is left to be gained.
        const VAIN: f64 = 0.25;
        let mut now = instances.to_vec();
        let mut best: Option<JointFit> = None;
        let mut halvings = 0;
        let mut promised = f64::INFINITY;
        for _ in 0..=MOST_STEPS {
            let trial = self.evaluate(&now, part);
            let Some((joint, step)) =
                trial.filter(|(joint, _)| best.as_ref().is_none_or(|best| joint.square <= best.square + ROUNDING))
            else {
                // Worse, or impossible: half-way back.
                halvings += 1;
                if best.is_some() && (halvings > MOST_HALVINGS || promised < VAIN) {
                    break;
                }
                for (instance, good) in now.iter_mut().zip(&best.as_ref()?.instances) {
                    for (size, good) in instance.sizes.iter_mut().zip(&good.sizes) {
                        *size = 0.5 * (*size + good);
                    }
                }
                continue;
            };
            let mut largest = 0.0_f64;
            promised = step.as_ref().map_or(0.0, |step| step.gain);
            if let Some(step) = step {
                let sizes = now.iter_mut().flat_map(|instance| &mut instance.sizes);
                for ((size, moved), sigma) in sizes.zip(step.to).zip(&joint.sigmas) {
                    largest = largest.max((moved - *size).abs() / sigma.max(f64::MIN_POSITIVE));
                    *size = moved;
                }
            }
            let gained = best.as_ref().map_or(f64::INFINITY, |best: &JointFit| best.square - joint.square);
            best = Some(joint);
            halvings = 0;
            if largest < SMALL || gained < ROUNDING {
                break;
            }
        }
        best
    }

    /// Fits all effects of a joint fit but one, from where its derivatives say that the others move without it.
    #[must_use]
    pub fn fit_without(&self, joint: &JointFit, place: usize, part: DataPart) -> Option<JointFit> {
        let sum = joint.pass.normal.sum(|block| self.is_in(part, block));
        let mut left = joint.instances.clone();
        left[place].sizes.fill(0.0);
        let to = step(&sum, &joint.instances, Some(place)).map(|step| step.to);
        for (size, to) in left.iter_mut().flat_map(|instance| &mut instance.sizes).zip(to.into_iter().flatten()) {
            *size = to;
        }
        left.remove(place);
        self.fit(&left, part)
    }

    /// One pass at these values, and the step that it suggests.
    fn evaluate(&self, now: &[Instance], part: DataPart) -> Option<(JointFit, Option<LinearStep>)> {
        let set = set_of(&self.scope.declared, now);
        let own: Vec<Regressor> = now.iter().flat_map(|instance| own_terms(instance, &set)).collect();
        let sizes = own.len();
        let pass = self.pass(&set, &own)?;
        let sum = pass.normal.sum(|block| self.is_in(part, block));
        let free: Vec<usize> = (0..sizes).collect();
        let covariance =
            linear::fit(&sum, &free, &[]).map_or_else(|| vec![f64::INFINITY; sizes * sizes], |fit| fit.covariance);
        let at = linear::Fit { gain: 0.0, theta: vec![0.0; sizes], covariance };
        let sigmas = linear::sigmas(&pass.normal, |block| self.is_in(part, block), &free, &at, &[]);
        let seen_square = self.seen_square(&pass);
        let to = step(&sum, now, None);
        Some((JointFit { instances: now.to_vec(), square: sum.square, seen_square, sigmas, pass }, to))
    }
}

/// A step on normal equations about present sizes.
struct LinearStep {
    /// By how much Σ e² falls by it.
    gain: f64,
    /// Every size behind it, inside its bounds.
    to: Vec<f64>,
}

/// The step that lowers Σ e² most; with all sizes of the effect `without` at zero. `None` where the data do not determine it.
fn step(equations: &NormalEquations, now: &[Instance], without: Option<usize>) -> Option<LinearStep> {
    let (mut bounded, mut fixed, mut to) = (Vec::new(), Vec::new(), Vec::new());
    for (place, instance) in now.iter().enumerate() {
        for (size, [low, high]) in instance.sizes.iter().zip(instance.candidate.bounds()) {
            match without == Some(place) {
                true => fixed.push((to.len(), -size)),
                false => bounded.push((to.len(), [low - size, high - size])),
            }
            to.push(*size);
        }
    }
    let (fit, left, at) = linear::fit_within(equations, &[], &bounded, &fixed)?;
    let free = left.into_iter().zip(fit.theta);
    free.chain(at).for_each(|(column, step)| to[column] += step);
    // What is held at a bound is there to the last digit.
    let bounds = now.iter().flat_map(|instance| instance.candidate.bounds());
    for (to, [low, high]) in to.iter_mut().zip(bounds) {
        *to = to.clamp(low, high);
    }
    Some(LinearStep { gain: fit.gain, to })
}

/// Which channels have samples.
#[must_use]
pub fn present(pass: &Pass) -> [bool; ResidualChannel::COUNT] {
    let mut present = [false; ResidualChannel::COUNT];
    for residual in &pass.residuals {
        present[residual.channel as usize] = true;
    }
    present
}
