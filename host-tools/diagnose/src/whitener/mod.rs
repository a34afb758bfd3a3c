//! Whitening by the filter: innovations of the declared model, and how they move with each term.
//!
//! An extended Kalman filter of the vehicle's twelve states runs over the log. Its normalised
//! innovations e are white if the model is right, so that least squares on them is generalised
//! least squares on the data: coloured residuals are weighed as they should be. Beside the state run its
//! derivatives by every term (a column each): between measurements by the same Jacobian as the
//! covariance, at a measurement by the same gain. Hence one pass gives ∂e/∂θ of all terms.
//!
//! Nothing is gated: with a wrong model a gate locks out good ranges. Isolated outliers are
//! flagged beforehand and skipped in every pass alike.

mod colour;
mod matrix;
mod measure;
mod step;

pub use colour::Colour;

use crate::log_effects::Effects;
use crate::model::Model;
use crate::normal_equations::{BlockEquations, BlockEquationsBuilder};
use crate::regressors::{Proposed, Regressor, Target, Variation};
use crate::samples::{LogEvent, Reading, ResidualChannel, Samples};
use backseat_core::dynamics::VehicleParameters;
use backseat_core::navigation::{LONGEST_HOLD_S, ProcessNoise, SensorNoise, SurfaceNoise};
use backseat_core::parameters::Installation;
use backseat_core::state::{PSI, VehicleState};
use backseat_estimation::commands::InputLine;
use backseat_logs::interrupt;
use colour::ColourStates;
use wide::f64x4;

/// Longest step of the filter, s.
pub const STEP_S: f64 = 0.1;

/// Columns that move together: their derivatives lie in the cache meanwhile.
const LANES: usize = 8;
type Lanes = matrix::Row<2>;
const NONE: Lanes = [f64x4::ZERO; 2];

/// What every pass over one log has in common.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Declared plant.
    pub parameters: VehicleParameters,
    /// Process noise of the dynamic model.
    pub noise: ProcessNoise,
    /// Process noise near the surface.
    pub surface: SurfaceNoise,
    /// Sensor noise.
    pub sensors: SensorNoise,
    /// Where the acoustic transducers sit; the rest of it was applied to the log.
    pub installation: Installation,
    /// Factor of each channel's noise on the declared one.
    pub scale: [f64; ResidualChannel::COUNT],
    /// Factor on that of the readings that waves move.
    pub swing: [f64; ResidualChannel::COUNT],
    /// Noise that lasts, beside the white noise.
    pub colours: Vec<Colour>,
    /// Acoustic readings (by their place among all) whose range is passed over.
    pub outliers: Vec<bool>,
    /// Length of a block, s.
    pub block_s: f64,
    /// Terms in no catalogue that are part of the model, with their values.
    pub proposed: Vec<Proposed>,
}

impl Setup {
    /// The declared vehicle with a set of effects; `None` where they are impossible for it.
    #[must_use]
    pub fn model(&self, set: &Effects) -> Option<Model> {
        Model::new(&self.parameters, self.installation.sound_speed_mps, set)
    }
}

/// One normalised innovation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Time since the log's start, s.
    pub t_s: f64,
    /// Which scalar.
    pub channel: ResidualChannel,
    /// Innovation, in the channel's unit.
    pub innovation: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Factor in its variance on the sensor's, because readings about it share a part of their errors; 1 for most.
    pub alike: f64,
    /// Whether the filter used it.
    pub used: bool,
    /// The fixed transponder at its other end.
    pub station: Option<u32>,
    /// Whether waves at the surface move what its sensor reads.
    pub is_moved_by_waves: bool,
}

impl Residual {
    /// Innovation over its standard deviation.
    #[must_use]
    pub fn normalised(&self) -> f64 {
        self.innovation / self.sigma
    }
}

/// The estimate at one time, for plots and generic terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// Time since the log's start, s.
    pub t_s: f64,
    /// State.
    pub x: VehicleState,
    /// Commanded actuators.
    pub input: InputLine,
}

/// What a pass gave.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// Innovations in order.
    pub residuals: Vec<Residual>,
    /// The estimate once a second.
    pub trace: Vec<Trace>,
    /// Normal equations of the columns, by blocks.
    pub normal: BlockEquations,
    /// Terms in no catalogue that were part of the model.
    pub proposed: Vec<Proposed>,
}

impl Pass {
    /// The innovations that say how good the model is: without those that waves move, of which it knows nothing. A channel
    /// of which most are so is judged by them all the same.
    pub fn telling(&self) -> impl Iterator<Item = &Residual> {
        let mut balance = [0_i64; ResidualChannel::COUNT];
        for r in self.residuals.iter().filter(|r| r.used) {
            balance[r.channel as usize] += if r.is_moved_by_waves { 1 } else { -1 };
        }
        self.residuals.iter().filter(move |r| r.used && (!r.is_moved_by_waves || balance[r.channel as usize] > 0))
    }
}

/// Runs the filter with `set` over a log; columns follow from `terms` in order.
///
/// `None` if the effects are impossible for this vehicle or the numbers leave the finite.
#[must_use]
pub fn run(setup: &Setup, samples: &Samples, set: &Effects, terms: &[Regressor]) -> Option<Pass> {
    interrupt::check();
    let mut filter = Filter::new(setup, samples, set, terms)?;
    let columns = filter.columns();
    let mut residuals = Vec::with_capacity(3 * samples.events.len());
    let mut trace = Vec::new();
    let mut blocks = Vec::new();
    rayon::in_place_scope(|scope| {
        let mut builder = BlockEquationsBuilder::new(columns, setup.block_s, scope);
        for (t_s, event) in &samples.events {
            filter.begin_anew_after_silence(*t_s);
            match event {
                LogEvent::Input(input) => {
                    if filter.is_started() {
                        filter.predict(*t_s);
                    }
                    filter.input = *input;
                }
                LogEvent::Reading(reading) => {
                    if !filter.start(*t_s, reading) {
                        continue;
                    }
                    filter.predict(*t_s);
                    filter.fuse(reading, &mut residuals, &mut builder);
                }
            }
            if filter.is_started() && trace.last().is_none_or(|last: &Trace| *t_s >= last.t_s + 1.0) {
                trace.push(Trace { t_s: *t_s, x: filter.x, input: filter.input });
            }
        }
        blocks = builder.finish();
    });
    filter.x.iter().all(|x| x.is_finite()).then(|| Pass {
        residuals,
        trace,
        normal: BlockEquations::collect(columns, blocks),
        proposed: setup.proposed.clone(),
    })
}

/// A term made ready: models with and without it, and where its columns stand.
struct Prepared {
    kind: Kind,
    /// First column.
    first: usize,
    onsets_s: Vec<f64>,
}

enum Kind {
    Effects {
        with: Box<Model>,
        without: Option<Box<Model>>,
        unit: f64,
        in_process: bool,
        channels: Vec<backseat_core::effects::SensorChannel>,
        water: bool,
    },
    GenericTerm {
        target: Target,
        factor: crate::regressors::Factor,
    },
}

/// State, covariance and derivatives of one pass.
struct Filter<'a> {
    setup: &'a Setup,
    model: Model,
    terms: Vec<Prepared>,
    columns: usize,
    /// Where each column stands in `slopes` and `row`, in groups of [`LANES`]: by its onset, so that those that have begun
    /// come first.
    place: Vec<usize>,
    /// Onsets in that order, s.
    starts_s: Vec<f64>,
    /// Columns that have begun; the others are zero.
    live: usize,
    duration_s: f64,
    t_s: f64,
    x: VehicleState,
    /// Symmetric.
    p: matrix::Square,
    input: InputLine,
    /// Noise that lasts.
    colours: ColourStates,
    /// ∂x/∂θ and ∂n/∂θ of each group of columns in turn: 12 lines, and one for each colour.
    slopes: Vec<Lanes>,
    /// ∂ν/∂θ of the scalar under way, by the same groups.
    row: Vec<Lanes>,
    /// Gain of each line of `slopes`.
    gains: Vec<f64>,
    /// `row` in the order of the columns.
    ordered: Vec<f64>,
    /// What each effect adds to the three scalars under way, per unit of its term.
    direct: Vec<[f64; 3]>,
    /// Whether any term depends on the heading's sine and cosine.
    has_monomials: bool,
    start: Option<Start>,
    acoustic_index: usize,
}

/// What has been read before the filter can start.
#[derive(Default)]
struct Start {
    fix: Option<[f64; 2]>,
    euler: Option<[f64; 3]>,
    depth: Option<f64>,
    dvl: Option<[f64; 3]>,
    waits_for_dvl: bool,
}

impl<'a> Filter<'a> {
    fn new(setup: &'a Setup, samples: &Samples, set: &Effects, terms: &[Regressor]) -> Option<Self> {
        let model = setup.model(set)?;
        let mut prepared = Vec::with_capacity(terms.len());
        let mut columns = 0;
        for term in terms {
            let kind = match &term.cause {
                Variation::GenericTerm(generic) => Kind::GenericTerm { target: generic.target, factor: generic.factor },
                Variation::Effects { with, without, unit } => {
                    let with = Box::new(setup.model(with)?);
                    let without = if **without == *set { None } else { Some(Box::new(setup.model(without)?)) };
                    let before = without.as_ref().map_or(set, |without| without.set());
                    let (channels, in_process) = with.set().differences(before);
                    let water = !with.has_water_of(without.as_deref().unwrap_or(&model));
                    Kind::Effects { with, without, unit: *unit, in_process: in_process || water, channels, water }
                }
            };
            prepared.push(Prepared { kind, first: columns, onsets_s: term.onsets_s.clone() });
            columns += term.onsets_s.len();
        }
        let onsets_s: Vec<f64> = terms.iter().flat_map(|term| term.onsets_s.iter().copied()).collect();
        let mut order: Vec<usize> = (0..columns).collect();
        order.sort_by(|a, b| onsets_s[*a].total_cmp(&onsets_s[*b]));
        let mut place = vec![0; columns];
        for (at, column) in order.iter().enumerate() {
            place[*column] = at;
        }
        let has_monomials = prepared.iter().any(|term| matches!(term.kind, Kind::GenericTerm { .. }));
        let has_dvl = samples.events.iter().any(|(_, event)| matches!(event, LogEvent::Reading(Reading::Dvl(_))));
        let groups = columns.div_ceil(LANES);
        let colours = ColourStates::new(&setup.colours, samples);
        let lines = 12 + colours.count();
        Some(Self {
            setup,
            model,
            terms: prepared,
            columns,
            place,
            starts_s: order.iter().map(|column| onsets_s[*column]).collect(),
            live: 0,
            duration_s: samples.duration_s,
            t_s: 0.0,
            x: VehicleState::zeros(),
            p: matrix::ZERO,
            input: InputLine::default(),
            colours,
            slopes: vec![NONE; groups * lines],
            row: vec![NONE; groups],
            gains: Vec::with_capacity(lines),
            ordered: vec![0.0; columns],
            direct: Vec::with_capacity(terms.len()),
            has_monomials: has_monomials || !setup.proposed.is_empty(),
            start: Some(Start { waits_for_dvl: has_dvl, ..Start::default() }),
            acoustic_index: 0,
        })
    }

    fn columns(&self) -> usize {
        self.columns
    }

    /// Groups of columns of which some have begun.
    fn live_groups(&self) -> usize {
        self.live.div_ceil(LANES)
    }

    /// Lines of a group: those of the state, and of each colour.
    fn lines(&self) -> usize {
        12 + self.colours.count()
    }

    /// Lets in the columns whose onset has come.
    fn wake(&mut self) {
        while self.starts_s.get(self.live).is_some_and(|start| *start <= self.t_s) {
            self.live += 1;
        }
    }

    /// Sine and cosine of the heading, where a monomial may need them.
    fn heading(&self) -> (f64, f64) {
        if self.has_monomials { self.x[PSI].sin_cos() } else { (0.0, 0.0) }
    }

    fn is_started(&self) -> bool {
        self.start.is_none()
    }

    /// Inputs hold for so long only: behind a longer silence it begins anew, at the next fix.
    fn begin_anew_after_silence(&mut self, t_s: f64) {
        if self.is_started() && t_s - self.t_s > LONGEST_HOLD_S {
            self.start = Some(Start::default());
            self.p = matrix::ZERO;
            self.slopes.fill(NONE);
            self.colours.forget();
        }
    }

    /// Gathers what it needs to begin; `true` once it runs.
    fn start(&mut self, t_s: f64, reading: &Reading) -> bool {
        let Some(start) = &mut self.start else { return true };
        match *reading {
            Reading::Depth(z) => start.depth = Some(z),
            Reading::Attitude(euler) => start.euler = Some(euler),
            Reading::Dvl(velocity) => start.dvl = Some(velocity),
            Reading::Gnss { position_m, .. } => start.fix = Some(position_m),
            Reading::Acoustic { .. } | Reading::Usbl { .. } => {
                self.acoustic_index += 1;
                return false;
            }
            Reading::Rates(_) => {}
        }
        let (Some(fix), Some(euler)) = (start.fix, start.euler) else { return false };
        // A log whose DVL finds the bottom late starts without it.
        if start.waits_for_dvl && start.dvl.is_none() && t_s < 10.0 {
            return false;
        }
        let velocity = start.dvl.unwrap_or([0.5, 0.0, 0.0]);
        let depth = start.depth.unwrap_or(0.0);
        // What was read here is read again by the filter: the start must know next to nothing.
        let values = [[fix[0], fix[1], depth], euler, velocity, [0.0; 3]];
        let gnss = 3.0 * self.setup.sensors.gnss_m;
        let sigmas = [[gnss, gnss, 1.0], [0.2; 3], [0.5; 3], [0.2; 3]];
        for block in 0..4 {
            for axis in 0..3 {
                let i = 3 * block + axis;
                self.x[i] = values[block][axis];
                *matrix::at_mut(&mut self.p[i], i) = sigmas[block][axis] * sigmas[block][axis];
            }
        }
        self.t_s = t_s;
        self.start = None;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residual(t_s: f64, channel: ResidualChannel, is_moved_by_waves: bool) -> Residual {
        let (innovation, sigma, alike) = (0.0, 1.0, 1.0);
        Residual { t_s, channel, innovation, sigma, alike, used: true, station: None, is_moved_by_waves }
    }

    /// Of the depths that were used one is moved by waves, of the DVL two of three.
    #[test]
    fn what_waves_move_does_not_tell_unless_it_is_most_of_its_channel() {
        let of = |channel, waves: [bool; 3]| {
            waves.into_iter().zip([1.0, 2.0, 3.0]).map(move |(w, t_s)| residual(t_s, channel, w))
        };
        let mut residuals: Vec<Residual> = of(ResidualChannel::Depth, [true, false, false]).collect();
        residuals.extend(of(ResidualChannel::DvlU, [true, true, false]));
        residuals[1].used = false;
        residuals.push(residual(4.0, ResidualChannel::Depth, false));
        let pass = Pass { residuals, ..Pass::default() };
        let telling: Vec<_> = pass.telling().map(|r| (r.channel, r.t_s)).collect();
        let (depth, dvl) = (ResidualChannel::Depth, ResidualChannel::DvlU);
        assert_eq!(telling, [(depth, 3.0), (dvl, 1.0), (dvl, 2.0), (dvl, 3.0), (depth, 4.0)]);
    }
}
