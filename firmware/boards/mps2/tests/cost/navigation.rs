//! The filter with 24, 26, 34 and 42 states, the same steps the plain way, and what each effect adds.

use crate::dense;
use crate::measure::{Worst, count};
use crate::random::Random;
use crate::row;
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::effects::{CATALOGUE, EffectInfo, EffectSet, ParameterKind, SensorChannel};
use backseat_core::navigation::{
    AcousticPath, CloneId, EffectStates, FusionOutcome, InitialShip, InitialState, Measurement, NavigationConfig,
    Navigator, Priors, ShipEnd, VehicleEnd,
};
use backseat_core::state::VehicleState;
use core::hint::black_box;
use nalgebra::{SMatrix, SVector};

const INPUT: ActuatorInput = ActuatorInput { propeller_radps: 106.8, fins_rad: [0.05, -0.05, 0.008, -0.008] };
const STEP_S: f64 = 0.1;
const STATE: [f64; 12] = [10.0, 20.0, 3.0, 0.01, -0.036, 0.5, 1.0, 0.02, -0.036, 0.001, 0.002, -0.01];
/// How often each is measured; the dearest counts.
const TIMES: usize = 3;

/// With which states, behind the vehicle's and the ship's.
#[derive(Clone, Copy, PartialEq)]
enum Layout {
    /// A clone of the vehicle.
    Plain,
    /// And the current.
    Current,
    /// And another two effects (one of the plant, one of a sensor), and a clone of the ship.
    Everything,
    /// All that the robust filter estimates, and a clone of the vehicle.
    Robust,
}

impl Layout {
    fn effect_states(self) -> EffectStates {
        let current = EffectStates::water_current(0.3, 1.0e-3);
        let more = |states: EffectStates, effect, parameter, sigma| {
            let states = states.with(effect, parameter, sigma, 1.0e-6);
            assert!(states.is_ok());
            states.unwrap_or(EffectStates::NONE)
        };
        match self {
            Self::Plain => EffectStates::NONE,
            Self::Current => current,
            Self::Robust => EffectStates::robust(&Priors::DEFAULT),
            Self::Everything => {
                let with_plant = more(current, "thrust_loss", "k_n_s2_per_rad_m", 1.0e-3);
                more(with_plant, "sound_speed", "ratio", 1.0e-2)
            }
        }
    }
}

/// Everything.
pub fn measure(navigator: &mut Navigator) {
    at::<24, 18, 18>(navigator, Layout::Plain);
    at::<26, 20, 20>(navigator, Layout::Current);
    at::<34, 28, 22>(navigator, Layout::Everything);
    at::<42, 36, 36>(navigator, Layout::Robust);
    CATALOGUE.iter().for_each(|info| effect(navigator, info));
}

/// N states with all clones, `BEFORE` without the vehicle's, `FIRST` without any.
fn at<const N: usize, const BEFORE: usize, const FIRST: usize>(navigator: &mut Navigator, layout: Layout) {
    begin(navigator, EffectSet::NONE, layout.effect_states());
    if layout == Layout::Everything {
        let instructions = count(|| black_box(&mut *navigator).clone_ship().is_ok()).1;
        // six rows with one entry each
        row("clone", "ship", BEFORE, 1, instructions, append::<FIRST, BEFORE>());
        step(navigator);
    }
    let (vehicle, instructions) = count(|| black_box(&mut *navigator).clone_vehicle().ok());
    // three rows with one entry, three with six or eight
    let entries = if layout == Layout::Plain { 7 } else { 9 };
    row("clone", "vehicle", N, entries, instructions, append::<BEFORE, N>());
    let Some(vehicle) = vehicle else { return };
    assert!(navigator.main().dimension() == N);
    for _ in 0..20 {
        step(navigator);
    }
    prediction::<N>(navigator);
    updates::<N>(navigator, layout, vehicle);
    let digest = count(|| black_box(&*navigator).digest_from(0)).1;
    row("digest", "digest", N, 0, digest, 0);
    let instructions = count(|| black_box(&mut *navigator).drop_clone(vehicle)).1;
    row("clone", "vehicle dropped", N, 0, instructions, 0);
}

fn begin(navigator: &mut Navigator, effects: EffectSet, effect_states: EffectStates) {
    let config = NavigationConfig {
        effects,
        effect_states,
        // nothing is rejected
        gate_sigma: 1.0e3,
        ..NavigationConfig::REFERENCE
    };
    let state = VehicleState::from(STATE);
    let sigma = VehicleState::from([3.0, 3.0, 0.1, 0.02, 0.02, 0.02, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01]);
    let ship = InitialShip { state: [600.0, 450.0, 1.2, -1.0, 1.7, 0.003], sigma: [2.0, 2.0, 1.0, 0.5, 0.5, 0.05] };
    let configured =
        VehicleModel::new(&VehicleParameters::IVER3).is_ok_and(|m| navigator.configure(&config, &m).is_ok());
    assert!(configured);
    assert!(navigator.initialise(0, &InitialState { state, sigma }).is_ok());
    assert!(navigator.initialise_ship(&ship).is_ok());
    (0..5).for_each(|_| step(navigator));
}

fn step(navigator: &mut Navigator) {
    assert!(navigator.predict(navigator.time_us() + 100_000, &INPUT).is_ok());
}

/// A covariance of N states as good as any.
fn any_covariance<const N: usize>() -> SMatrix<f64, N, N> {
    let mut random = Random(1);
    let mut p = SMatrix::<f64, N, N>::identity();
    for i in 0..N {
        for j in 0..i {
            p[(i, j)] = random.within(0.02);
            p[(j, i)] = p[(i, j)];
        }
    }
    p
}

fn append<const N: usize, const L: usize>() -> u32 {
    let mut t = SMatrix::<f64, L, N>::zeros();
    t.fixed_view_mut::<N, N>(0, 0).fill_with_identity();
    let p = any_covariance::<N>();
    count(|| dense::append(black_box(&p), black_box(&t))).1
}

fn prediction<const N: usize>(navigator: &mut Navigator) {
    let (mut whole, mut model, mut covariance) = (Worst(0), Worst(0), Worst(0));
    for _ in 0..TIMES {
        let to_us = navigator.time_us() + 100_000;
        whole.count(|| black_box(&mut *navigator).predict(to_us, black_box(&INPUT)).is_ok());
        model.count(|| black_box(&mut *navigator).discretise(black_box(STEP_S), black_box(&INPUT)));
        covariance.count(|| black_box(&mut *navigator).propagate(black_box(STEP_S)));
    }
    let Ok(vehicle) = VehicleModel::new(&VehicleParameters::IVER3) else { return };
    let x = VehicleState::from(STATE);
    let psd = [9e-6, 4e-6, 4e-6, 9e-6, 1e-6, 1e-6];
    let ((phi_v, q_v), dense_model) = count(|| {
        let f = black_box(&vehicle).linearise(black_box(&x), black_box(&INPUT)).F();
        dense::van_loan(&f, black_box(&psd), black_box(STEP_S))
    });
    let mut p = any_covariance::<N>();
    let (mut phi, mut q) = (SMatrix::<f64, N, N>::identity(), SMatrix::<f64, N, N>::zeros());
    phi.fixed_view_mut::<12, 12>(0, 0).copy_from(&phi_v);
    q.fixed_view_mut::<12, 12>(0, 0).copy_from(&q_v);
    let dense_covariance = count(|| dense::propagate(black_box(&mut p), black_box(&phi), black_box(&q))).1;
    row("predict", "model, Jacobian and discretisation", N, 0, model.0, dense_model);
    row("predict", "covariance propagation", N, 0, covariance.0, dense_covariance);
    row("predict", "whole step", N, 0, whole.0, dense_model + dense_covariance);
}

fn updates<const N: usize>(navigator: &mut Navigator, layout: Layout, vehicle: CloneId) {
    let current = if layout == Layout::Plain { 0 } else { 2 };
    let sensor = if layout == Layout::Everything { 1 } else { 0 };
    let now = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
    let delayed = AcousticPath { vehicle: VehicleEnd::Delayed { clone: vehicle, bridge_s: 0.4 }, ship: ShipEnd::Now };
    // the plain way of the robust filter's states is more than the 128 kB of stack hold
    let dense = if layout == Layout::Robust { [0; 3] } else { [one::<N, 1>(), one::<N, 2>(), one::<N, 3>()] };
    // of its three rows the heading's has three entries more
    let attitude = if layout == Layout::Robust { 2 } else { 1 };
    let bottom = if layout == Layout::Plain { 1 } else { 1 + 3 + 2 };
    // name, entries of each row of H, measurement
    let all = [
        ("depth", 1, Measurement::Depth { z_m: 3.0 }),
        ("attitude", attitude, Measurement::Attitude { euler_rad: [0.01, -0.03, 0.5] }),
        ("rates", 1, Measurement::Rates { rates_radps: [0.0, 0.0, -0.01] }),
        ("DVL bottom track", bottom, Measurement::BottomTrack { velocity_mps: [1.0, 0.0, 0.0] }),
        ("DVL water track", 1, Measurement::WaterTrack { velocity_mps: [1.0, 0.0, 0.0] }),
        ("vehicle GNSS", 1, Measurement::VehicleGnss { position_m: [12.0, 21.0] }),
        ("ship GNSS", 1, Measurement::ShipGnss { position_m: [597.0, 455.0] }),
        ("range", 5 + sensor, Measurement::Range { path: now, range_m: 730.0 }),
        ("range, delayed", 8 + sensor, Measurement::Range { path: delayed, range_m: 730.0 }),
        ("range rate", 13 + current, Measurement::RangeRate { path: now, range_rate_mps: -0.9 }),
        ("range rate, delayed", 10, Measurement::RangeRate { path: delayed, range_rate_mps: -0.9 }),
        ("two-way range", 11 + sensor, Measurement::TwoWayRange { outward: delayed, back: now, range_m: 730.0 }),
    ];
    for (name, entries, measurement) in all {
        let mut worst = Worst(0);
        for _ in 0..TIMES {
            let fused = worst.count(|| {
                let fusions = black_box(&mut *navigator).fuse(black_box(&measurement));
                fusions.iter().all(|record| record.outcome == FusionOutcome::Fused)
            });
            assert!(fused);
            step(navigator);
        }
        row("update", name, N, entries, worst.0, dense[measurement.scalars() - 1]);
    }
}

/// The plain update by M scalars.
fn one<const N: usize, const M: usize>() -> u32 {
    let mut random = Random(2);
    let (mut x, mut p) = (SVector::<f64, N>::zeros(), any_covariance::<N>());
    let h = SMatrix::<f64, M, N>::from_fn(|_, _| random.within(1.0));
    let (r, innovation) = (SMatrix::<f64, M, M>::identity(), SVector::<f64, M>::repeat(0.1));
    let (done, instructions) = count(|| {
        dense::update(black_box(&mut x), black_box(&mut p), black_box(&h), black_box(&r), black_box(&innovation))
    });
    assert!(done);
    instructions
}

/// What one effect adds to a step and to the measurement it changes most, fixed and (where it can) as states.
fn effect(navigator: &mut Navigator, info: &'static EffectInfo) {
    let mut values = [0.0; 4];
    for (value, parameter) in values.iter_mut().zip(info.parameters) {
        *value = match parameter.kind {
            ParameterKind::Size => 0.01 * parameter.max,
            ParameterKind::Onset | ParameterKind::End => 0.0,
            ParameterKind::Fin | ParameterKind::Shape | ParameterKind::Transponder => parameter.min,
        };
    }
    let Some(values) = values.get(..info.parameters.len()) else { return };
    let Ok(fixed) = EffectSet::NONE.with(info.name, values) else { return };
    let mut states = EffectStates::NONE;
    for parameter in info.parameters.iter().filter(|_| info.hooks.may_be_state()) {
        states = states.with(info.name, parameter.name, 0.01 * parameter.max, 1.0e-6).unwrap_or(states);
    }
    let without = step_and_update(navigator, info, EffectSet::NONE, EffectStates::NONE);
    let mut added = |effects, states: EffectStates| {
        let (with_step, with_update) = step_and_update(navigator, info, effects, states);
        (with_step.saturating_sub(without.0), with_update.saturating_sub(without.1))
    };
    let (in_step, in_update) = added(fixed, EffectStates::NONE);
    row("effect", info.name, 0, 0, in_step, in_update);
    if !states.is_empty() {
        let (in_step, in_update) = added(EffectSet::NONE, states);
        row("effect", info.name, states.len(), 0, in_step, in_update);
    }
}

/// Instructions of a step and of the measurement that an effect changes.
fn step_and_update(
    navigator: &mut Navigator,
    info: &EffectInfo,
    effects: EffectSet,
    states: EffectStates,
) -> (u32, u32) {
    let now = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
    let noisy = |channel| info.hooks.variance.is_some_and(|variance| variance(&[1.0, 1.0], channel) > 0.0);
    let gated = |channel| info.hooks.gate_sigma.is_some_and(|gate| gate(&[1.0], channel).is_some());
    let acts = |channel| {
        info.hooks.measure.is_some_and(|measure| measure.channels.contains(&channel))
            || noisy(channel)
            || gated(channel)
    };
    let measurement = if acts(SensorChannel::Attitude) {
        Measurement::Attitude { euler_rad: [0.01, -0.03, 0.5] }
    } else if acts(SensorChannel::Rates) {
        Measurement::Rates { rates_radps: [0.0, 0.0, -0.01] }
    } else if acts(SensorChannel::Range) {
        Measurement::Range { path: now, range_m: 730.0 }
    } else if acts(SensorChannel::Dvl) || info.hooks.water.is_some() {
        Measurement::BottomTrack { velocity_mps: [1.0, 0.0, 0.0] }
    } else {
        Measurement::Depth { z_m: 3.0 }
    };
    begin(navigator, effects, states);
    let (mut in_step, mut in_update) = (Worst(0), Worst(0));
    for _ in 0..TIMES {
        let to_us = navigator.time_us() + 100_000;
        in_step.count(|| black_box(&mut *navigator).predict(to_us, black_box(&INPUT)).is_ok());
        in_update.count(|| black_box(&mut *navigator).fuse(black_box(&measurement)).iter().count());
    }
    (in_step.0, in_update.0)
}
