//! What is varied: catalogue parameters, onsets of events, and generic terms of the equations of motion.
//!
//! A *term* is one column of the whitened regression: how every innovation moves per unit of it.

use crate::log_effects::Effects;
use crate::samples::ResidualChannel;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::{P, Q, R, THETA, U, V, VehicleState, W, X, Z};

/// One cause and the columns that follow from it.
#[derive(Clone, Debug)]
pub struct Regressor {
    /// What changes.
    pub cause: Variation,
    /// From when on each of its columns is present, s; one column each.
    pub onsets_s: Vec<f64>,
}

/// What changes per unit of a term.
#[derive(Clone, Debug)]
pub enum Variation {
    /// The model goes from one set of effects to another, divided by `unit`.
    Effects {
        /// With the term.
        with: Box<Effects>,
        /// Without it.
        without: Box<Effects>,
        /// What the difference is divided by.
        unit: f64,
    },
    /// A monomial of the state acts where no effect of the catalogue is asked.
    GenericTerm(GenericTerm),
}

/// A monomial of state and input that adds to an acceleration, a ground velocity or a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GenericTerm {
    /// Where it adds.
    pub target: Target,
    /// What adds.
    pub factor: Factor,
}

/// Where a generic term acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Body acceleration along u, v, w, p, q, r.
    Acceleration(u8),
    /// Velocity of the water, north or east.
    Water(u8),
    /// What a channel reads.
    Reading(ResidualChannel),
}

/// A term in no catalogue with its value, in units of its target per unit of its factor.
pub type Proposed = (GenericTerm, f64);

/// What proposed terms add to the derivative of the state: accelerations, and the way over ground by the water.
#[must_use]
pub fn motion(proposed: &[Proposed], snapshot: &Snapshot<'_>) -> VehicleState {
    let mut f = VehicleState::zeros();
    for (term, value) in proposed {
        match term.target {
            Target::Acceleration(dof) => f[U + usize::from(dof)] += value * term.factor.value(snapshot),
            Target::Water(axis) => f[X + usize::from(axis)] += value * term.factor.value(snapshot),
            Target::Reading(_) => {}
        }
    }
    f
}

/// What proposed terms add to a reading.
#[must_use]
pub fn reading(proposed: &[Proposed], channel: ResidualChannel, snapshot: &Snapshot<'_>) -> f64 {
    let of = proposed.iter().filter(|(term, _)| term.target == Target::Reading(channel));
    of.map(|(term, value)| value * term.factor.value(snapshot)).sum()
}

/// What a factor may depend on at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// Time as part of the log, 0 to 1.
    pub share: f64,
    /// The estimate.
    pub x: &'a VehicleState,
    /// Sine and cosine of the heading.
    pub heading: (f64, f64),
    /// What was commanded.
    pub input: &'a ActuatorInput,
    /// Length of the acoustic path, m; 0 where no range is read.
    pub distance_m: f64,
}

macro_rules! factors {
    (|$x:ident, $s:ident| $($factor:ident: $name:literal, $symbol:literal, $unit:literal, $swings:expr, $value:expr;)*) => {
        /// A monomial of state, input and time.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)] // they are their names
        pub enum Factor {
            $($factor,)*
        }

        impl Factor {
            /// Its value, of order one where the vehicle does what it usually does.
            #[must_use]
            pub fn value(self, $s: &Snapshot<'_>) -> f64 {
                let $x = $s.x;
                match self {
                    $(Self::$factor => $value,)*
                }
            }

            /// As written in the report, and in equations and files; the unit of its value; whether it moves at the
            /// rate of waves.
            const fn described(self) -> (&'static str, &'static str, &'static str, bool) {
                match self {
                    $(Self::$factor => ($name, $symbol, $unit, $swings),)*
                }
            }
        }
    };
}

/// Whether a factor moves at the rate of waves.
const SWINGS: bool = true;
const SLOW: bool = false;

factors! {
    |x, s|
    One: "constant", "1", "1", SLOW, 1.0;
    Time: "time", "(t/T - 1/2)", "1", SLOW, s.share - 0.5;
    TimeSquared: "time²", "(t/T - 1/2)^2", "1", SLOW, (s.share - 0.5).powi(2);
    Depth: "depth", "z", "m", SLOW, x[Z];
    Surge: "u", "u", "m/s", SLOW, x[U];
    SurgeSquared: "u|u|", "u|u|", "m²/s²", SLOW, x[U] * x[U].abs();
    Sway: "v", "v", "m/s", SLOW, x[V];
    SwayAbs: "v|v|", "v|v|", "m²/s²", SLOW, x[V] * x[V].abs();
    SwaySquared: "v²", "v^2", "m²/s²", SLOW, x[V] * x[V];
    Heave: "w", "w", "m/s", SWINGS, x[W];
    HeaveAbs: "w|w|", "w|w|", "m²/s²", SWINGS, x[W] * x[W].abs();
    HeaveSquared: "w²", "w^2", "m²/s²", SWINGS, x[W] * x[W];
    RollRate: "p", "p", "rad/s", SWINGS, x[P];
    PitchRate: "q", "q", "rad/s", SWINGS, x[Q];
    YawRate: "r", "r", "rad/s", SLOW, x[R];
    YawRateAbs: "r|r|", "r|r|", "rad²/s²", SLOW, x[R] * x[R].abs();
    PitchRateAbs: "q|q|", "q|q|", "rad²/s²", SWINGS, x[Q] * x[Q].abs();
    SurgeYawRate: "u·r", "u r", "m rad/s²", SLOW, x[U] * x[R];
    SurgePitchRate: "u·q", "u q", "m rad/s²", SWINGS, x[U] * x[Q];
    SurgeHeave: "u·w", "u w", "m²/s²", SWINGS, x[U] * x[W];
    SinHeading: "sin ψ", "sin(psi)", "1", SLOW, s.heading.0;
    CosHeading: "cos ψ", "cos(psi)", "1", SLOW, s.heading.1;
    SinTwoHeading: "sin 2ψ", "sin(2 psi)", "1", SLOW, 2.0 * s.heading.0 * s.heading.1;
    CosTwoHeading: "cos 2ψ", "cos(2 psi)", "1", SLOW, s.heading.1 * s.heading.1 - s.heading.0 * s.heading.0;
    SinPitch: "θ", "theta", "rad", SWINGS, x[THETA];
    Propeller: "n|n|", "1e-4 n|n|", "1e4 rad²/s²", SLOW, s.input.propeller_radps * s.input.propeller_radps.abs() * 1e-4;
    FinTop: "top fin·u²", "top u^2", "rad m²/s²", SWINGS, s.input.fins_rad[0] * x[U] * x[U];
    FinBottom: "bottom fin·u²", "bottom u^2", "rad m²/s²", SWINGS, s.input.fins_rad[1] * x[U] * x[U];
    FinPort: "port fin·u²", "port u^2", "rad m²/s²", SWINGS, s.input.fins_rad[2] * x[U] * x[U];
    FinStarboard: "starboard fin·u²", "starboard u^2", "rad m²/s²", SWINGS, s.input.fins_rad[3] * x[U] * x[U];
    FinSquares: "Σ fin²·u²", "fins^2 u^2", "rad² m²/s²", SWINGS,
        s.input.fins_rad.iter().map(|fin| fin * fin).sum::<f64>() * x[U] * x[U];
    DistanceSquared: "distance²", "distance^2", "m²", SLOW, s.distance_m * s.distance_m;
}

impl Factor {
    /// Whether it moves at the rate of waves.
    #[must_use]
    pub const fn swings(self) -> bool {
        self.described().3
    }

    /// As written in the report.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.described().0
    }

    /// In equations and files.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        self.described().1
    }

    /// Unit of its value; T is the length of the log.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        self.described().2
    }
}

impl Target {
    /// In equations and files: the derivative of a velocity, the velocity of the water, or what is read.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Acceleration(dof) => ["du/dt", "dv/dt", "dw/dt", "dp/dt", "dq/dt", "dr/dt"][usize::from(dof)],
            Self::Water(0) => "current_north",
            Self::Water(_) => "current_east",
            Self::Reading(channel) => channel.name(),
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Acceleration(0..=2) => "m/s²",
            Self::Acceleration(_) => "rad/s²",
            Self::Water(_) => "m/s",
            Self::Reading(channel) => channel.unit(),
        }
    }
}

impl GenericTerm {
    /// The term of a dictionary with these symbols.
    #[must_use]
    pub fn find(target: &str, factor: &str) -> Option<Self> {
        let all = dictionary(&[true; ResidualChannel::COUNT]);
        all.into_iter().find(|term| term.target.symbol() == target && term.factor.symbol() == factor)
    }

    /// As written in the report.
    #[must_use]
    pub fn name(&self) -> String {
        let target = match self.target {
            Target::Acceleration(dof) => {
                ["surge force", "sway force", "heave force", "roll moment", "pitch moment", "yaw moment"]
                    [usize::from(dof)]
            }
            Target::Water(0) => "northward water velocity",
            Target::Water(_) => "eastward water velocity",
            Target::Reading(channel) => channel.name(),
        };
        let kind = if matches!(self.target, Target::Reading(_)) { " reading" } else { "" };
        format!("{target}{kind} ∝ {}", self.factor.name())
    }
}

/// The dictionary of generic terms for a log with these channels.
#[must_use]
pub fn dictionary(present: &[bool; ResidualChannel::COUNT]) -> Vec<GenericTerm> {
    use Factor::*;
    let mut terms = Vec::new();
    let mut add = |target: Target, factors: &[Factor]| {
        terms.extend(factors.iter().map(|factor| GenericTerm { target, factor: *factor }));
    };
    let fins = [FinTop, FinBottom, FinPort, FinStarboard];
    let surge = [One, Time, Depth, Surge, SurgeSquared, SwaySquared, HeaveSquared, Propeller, YawRateAbs, FinSquares];
    let sway = [One, Time, Sway, SwayAbs, SwaySquared, SurgeYawRate, YawRateAbs, Propeller, SurgeSquared];
    let heave = [
        &[One, Time, Depth, Heave, HeaveAbs, HeaveSquared][..],
        &[SurgePitchRate, PitchRateAbs, SurgeSquared, SurgeHeave],
    ];
    let roll = [One, Time, RollRate, Propeller, SurgeSquared, Sway, SurgeYawRate];
    let pitch =
        [&[One, Time, Depth, Heave, HeaveAbs][..], &[PitchRate, PitchRateAbs, SurgeSquared, SurgeHeave, SinPitch]];
    let yaw = [One, Time, Sway, SwayAbs, YawRate, YawRateAbs, SurgeSquared, Propeller];
    add(Target::Acceleration(0), &surge);
    let others: [&[Factor]; 5] = [&sway, &heave.concat(), &roll, &pitch.concat(), &yaw];
    for (dof, factors) in (1..).zip(others) {
        add(Target::Acceleration(dof), factors);
        add(Target::Acceleration(dof), &fins);
    }
    for axis in 0..2 {
        add(Target::Water(axis), &[Time, TimeSquared, Depth]);
    }
    let readings: [(ResidualChannel, &[Factor]); 11] = [
        (ResidualChannel::Depth, &[Time, SinPitch, SurgeSquared]),
        (ResidualChannel::Roll, &[One, Time]),
        (ResidualChannel::Pitch, &[Time, PitchRate]),
        (ResidualChannel::Heading, &[Time, YawRate, Propeller, SinTwoHeading, CosTwoHeading]),
        (ResidualChannel::P, &[Time]),
        (ResidualChannel::Q, &[Time]),
        (ResidualChannel::R, &[Time, YawRate]),
        (ResidualChannel::DvlU, &[One, PitchRate, YawRate]),
        (ResidualChannel::DvlV, &[One, RollRate, YawRate]),
        (ResidualChannel::DvlW, &[One, RollRate, PitchRate]),
        (ResidualChannel::Range, &[DistanceSquared]),
    ];
    for (channel, factors) in readings {
        if present[channel as usize] {
            add(Target::Reading(channel), factors);
        }
    }
    terms
}
