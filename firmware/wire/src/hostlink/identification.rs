//! What the board learns about the vehicle: identified parameters, estimates, faults.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most estimates in one message.
pub const MAX_ESTIMATES: usize = 20;
/// Most causes named at once.
pub const MAX_NAMED: usize = 2;

/// What the identifier does with the motion, and why it rests where it rests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Activity {
    /// Switched off, or its settings are unusable.
    #[default]
    Off,
    /// No mission under way, or navigation is not valid.
    NotUnderWay,
    /// At the surface, where the model does not hold.
    Surfaced,
    /// No velocity from the DVL, or the current that it has to be corrected for is not known well enough.
    NoVelocity,
    /// Attitude or rates are missing.
    NoAttitude,
    /// Its filter fills, or its gains settle.
    Starting,
    /// The estimate moves.
    Adapting,
    /// The laws gave no finite number.
    Diverged,
}

/// What the motion shows of one identified parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Visibility {
    /// Nothing but noise depends on it: it stays where it is.
    #[default]
    Frozen,
    /// Held at its declared value: it is the scale.
    Known,
    /// It adapts, but other parameters explain its effect as well.
    Collinear,
    /// It adapts, and its effect is its own.
    Separate,
}

/// The identified parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identification {
    /// Board time, µs.
    pub time_us: u64,
    /// What the identifier does.
    pub activity: Activity,
    /// Time it has adapted, s.
    pub adapted_s: f64,
    /// θ: m11…m66, d11…d66, w, B1…B3, β1…β5, SI.
    pub theta: [f64; 21],
    /// What the recent motion shows of each.
    pub visibility: [Visibility; 21],
    /// Drifted against its own noise, bit j for θ_j.
    pub drifted: u32,
}

/// What the robust filter estimates of one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Which, by its place in `backseat_core::navigation::ESTIMATE_NAMES`.
    pub place: u8,
    /// Estimate, in its unit.
    pub value: f32,
    /// One sigma.
    pub sigma: f32,
    /// The motion separates it from the prior and from the other estimates. If not, it is used, and is no finding.
    pub separable: bool,
}

/// The estimates of the robust filter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimates {
    /// Board time, µs.
    pub time_us: u64,
    /// Weights of the nominal filter and of the one whose current changes, 0 to 1; the rest is that of the steady current.
    pub weights: [f32; 2],
    /// Dives that it started from.
    pub dives: u16,
    /// Its estimates.
    pub estimates: Vec<Estimate, MAX_ESTIMATES>,
}

/// A cause that the board names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedCause {
    /// Which, by its number in `backseat_core::navigation::naming`.
    pub cause: u8,
    /// What else it could be; 0: nothing.
    pub rival: u8,
    /// Its size, and a second number of those that have two, in the cause's unit.
    pub size: [f32; 2],
    /// One sigma of each.
    pub sigma: [f32; 2],
    /// Board time since when, µs.
    pub since_us: u64,
    /// Its probability among all causes.
    pub probability: f32,
}

/// What a named cause is used for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UsedFor {
    /// It is taken out, or never was in.
    #[default]
    Nothing,
    /// The filter predicts with it.
    Navigation,
    /// The controller steers with it too.
    NavigationAndControl,
}

/// Why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DecisionReason {
    /// It is named with a probability of 90 % or more.
    #[default]
    Sure,
    /// It is in use, and has another size now.
    Resized,
    /// It is named no longer.
    NotNamed,
    /// It has not predicted better in ten minutes: it is not used again.
    NotBetter,
    /// The filter has started again.
    Restarted,
}

/// A decision whether a named cause is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// Board time, µs.
    pub time_us: u64,
    /// The cause, by its number.
    pub cause: u8,
    /// Its size, as it is used.
    pub size: [f32; 2],
    /// For what, from then on.
    pub used_for: UsedFor,
    /// Why.
    pub reason: DecisionReason,
    /// By how much it had predicted better since it was taken, ln of the likelihood ratio.
    pub gain: f32,
}

/// A manoeuvre that is to tell two causes apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Question {
    /// Board time at which it began, µs.
    pub time_us: u64,
    /// The causes, by their numbers.
    pub causes: [u8; 2],
    /// Which, by its number in `backseat_core::control`.
    pub manoeuvre: u8,
    /// By how much it is expected to move ln of their odds.
    pub expected: f32,
    /// ln of the odds of the first over the second, when it began ...
    pub before: f32,
    /// ... and two minutes after its end.
    pub after: Option<f32>,
}

/// What the board states of what has changed in flight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Naming {
    /// Board time of what it rests on, µs.
    pub time_us: u64,
    /// Something has changed that no cause explains.
    pub unexplained: bool,
    /// The causes named, the one named first in front.
    pub named: Vec<NamedCause, MAX_NAMED>,
    /// The last decision whether one is used; none before the first.
    pub decision: Option<Decision>,
    /// The last manoeuvre that was to tell two causes apart; none before the first.
    #[serde(default)]
    pub question: Option<Question>,
}

/// What a dive has learnt of the vehicle went to the board's memory, for the next dive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LearntStored {
    /// Board time, µs.
    pub time_us: u64,
    /// It is kept; `false`: the memory refused it.
    pub kept: bool,
}

/// A fault of the vehicle that the board's fault monitor knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultCause {
    /// A fin (0 top, 1 bottom, 2 port, 3 starboard) lost lift and drag; magnitude: the share lost.
    Fin(u8),
    /// Surge drag has grown: something hangs on the hull; magnitude: relative increase of d11.
    Entanglement,
    /// The propeller pushes less; magnitude: the share of β5 lost.
    Fouling,
    /// Water has come in; magnitude: kg.
    Flooding,
}

/// Where the fault monitor stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultState {
    /// It learns what is normal.
    #[default]
    Learning,
    /// Nothing is wrong.
    Quiet,
    /// Something is wrong; later data have to confirm it.
    Suspicious,
    /// The fault is named.
    Diagnosed,
}

/// What is wrong with the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FaultDiagnosis {
    /// The fault that explains most.
    pub cause: FaultCause,
    /// Another fault that explains nearly as much.
    pub rival: Option<FaultCause>,
    /// See [`FaultCause`].
    pub magnitude: f64,
    /// Moment of the water about y over its weight, kg m, positive ahead of the centre of gravity; 0 of other faults.
    pub moment_kgm: f64,
    /// Probability of this fault against the next best, 0.5 to 1.
    pub confidence: f64,
    /// Board time at which it began to show, µs.
    pub since_us: u64,
}

/// Report of the fault monitor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FaultReport {
    /// Board time, µs.
    pub time_us: u64,
    /// Where it stands.
    pub state: FaultState,
    /// What is wrong, once it is known.
    pub diagnosis: Option<FaultDiagnosis>,
}
