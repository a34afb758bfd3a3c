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

/// A monomial of state, input and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // they are their names
pub enum Factor {
    One,
    Time,
    TimeSquared,
    Depth,
    Surge,
    SurgeSquared,
    Sway,
    SwayAbs,
    SwaySquared,
    Heave,
    HeaveAbs,
    HeaveSquared,
    RollRate,
    PitchRate,
    YawRate,
    YawRateAbs,
    PitchRateAbs,
    SurgeYawRate,
    SurgePitchRate,
    SurgeHeave,
    SinHeading,
    CosHeading,
    SinTwoHeading,
    CosTwoHeading,
    SinPitch,
    Propeller,
    Fin(u8),
    FinSquares,
    DistanceSquared,
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

impl Factor {
    /// Its value, of order one where the vehicle does what it usually does.
    #[must_use]
    pub fn value(self, s: &Snapshot<'_>) -> f64 {
        let x = s.x;
        let (sin, cos) = s.heading;
        match self {
            Self::One => 1.0,
            Self::Time => s.share - 0.5,
            Self::TimeSquared => (s.share - 0.5).powi(2),
            Self::Depth => x[Z],
            Self::Surge => x[U],
            Self::SurgeSquared => x[U] * x[U].abs(),
            Self::Sway => x[V],
            Self::SwayAbs => x[V] * x[V].abs(),
            Self::SwaySquared => x[V] * x[V],
            Self::Heave => x[W],
            Self::HeaveAbs => x[W] * x[W].abs(),
            Self::HeaveSquared => x[W] * x[W],
            Self::RollRate => x[P],
            Self::PitchRate => x[Q],
            Self::YawRate => x[R],
            Self::YawRateAbs => x[R] * x[R].abs(),
            Self::PitchRateAbs => x[Q] * x[Q].abs(),
            Self::SurgeYawRate => x[U] * x[R],
            Self::SurgePitchRate => x[U] * x[Q],
            Self::SurgeHeave => x[U] * x[W],
            Self::SinHeading => sin,
            Self::CosHeading => cos,
            Self::SinTwoHeading => 2.0 * sin * cos,
            Self::CosTwoHeading => cos * cos - sin * sin,
            Self::SinPitch => x[THETA],
            Self::Propeller => s.input.propeller_radps * s.input.propeller_radps.abs() * 1e-4,
            Self::Fin(fin) => s.input.fins_rad[usize::from(fin)] * x[U] * x[U],
            Self::FinSquares => s.input.fins_rad.iter().map(|fin| fin * fin).sum::<f64>() * x[U] * x[U],
            Self::DistanceSquared => s.distance_m * s.distance_m,
        }
    }

    /// Whether it moves at the rate of waves.
    #[must_use]
    pub fn swings(self) -> bool {
        matches!(
            self,
            Self::Heave
                | Self::HeaveAbs
                | Self::HeaveSquared
                | Self::RollRate
                | Self::PitchRate
                | Self::PitchRateAbs
                | Self::SurgePitchRate
                | Self::SurgeHeave
                | Self::SinPitch
                | Self::Fin(_)
                | Self::FinSquares
        )
    }

    /// As written in the report.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "constant",
            Self::Time => "time",
            Self::TimeSquared => "time²",
            Self::Depth => "depth",
            Self::Surge => "u",
            Self::SurgeSquared => "u|u|",
            Self::Sway => "v",
            Self::SwayAbs => "v|v|",
            Self::SwaySquared => "v²",
            Self::Heave => "w",
            Self::HeaveAbs => "w|w|",
            Self::HeaveSquared => "w²",
            Self::RollRate => "p",
            Self::PitchRate => "q",
            Self::YawRate => "r",
            Self::YawRateAbs => "r|r|",
            Self::PitchRateAbs => "q|q|",
            Self::SurgeYawRate => "u·r",
            Self::SurgePitchRate => "u·q",
            Self::SurgeHeave => "u·w",
            Self::SinHeading => "sin ψ",
            Self::CosHeading => "cos ψ",
            Self::SinTwoHeading => "sin 2ψ",
            Self::CosTwoHeading => "cos 2ψ",
            Self::SinPitch => "θ",
            Self::Propeller => "n|n|",
            Self::Fin(0) => "top fin·u²",
            Self::Fin(1) => "bottom fin·u²",
            Self::Fin(2) => "port fin·u²",
            Self::Fin(_) => "starboard fin·u²",
            Self::FinSquares => "Σ fin²·u²",
            Self::DistanceSquared => "distance²",
        }
    }
}

impl Factor {
    /// In equations and files.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::One => "1",
            Self::Time => "(t/T - 1/2)",
            Self::TimeSquared => "(t/T - 1/2)^2",
            Self::Depth => "z",
            Self::SurgeSquared => "u|u|",
            Self::SwaySquared => "v^2",
            Self::HeaveSquared => "w^2",
            Self::SurgeYawRate => "u r",
            Self::SurgePitchRate => "u q",
            Self::SurgeHeave => "u w",
            Self::SinHeading => "sin(psi)",
            Self::CosHeading => "cos(psi)",
            Self::SinTwoHeading => "sin(2 psi)",
            Self::CosTwoHeading => "cos(2 psi)",
            Self::SinPitch => "theta",
            Self::Propeller => "1e-4 n|n|",
            Self::Fin(0) => "top u^2",
            Self::Fin(1) => "bottom u^2",
            Self::Fin(2) => "port u^2",
            Self::Fin(_) => "starboard u^2",
            Self::FinSquares => "fins^2 u^2",
            Self::DistanceSquared => "distance^2",
            _ => self.name(),
        }
    }

    /// Unit of its value; T is the length of the log.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::One
            | Self::Time
            | Self::TimeSquared
            | Self::SinHeading
            | Self::CosHeading
            | Self::SinTwoHeading
            | Self::CosTwoHeading => "1",
            Self::Depth => "m",
            Self::Surge | Self::Sway | Self::Heave => "m/s",
            Self::SurgeSquared
            | Self::SwayAbs
            | Self::SwaySquared
            | Self::HeaveAbs
            | Self::HeaveSquared
            | Self::SurgeHeave => "m²/s²",
            Self::RollRate | Self::PitchRate | Self::YawRate => "rad/s",
            Self::YawRateAbs | Self::PitchRateAbs => "rad²/s²",
            Self::SurgeYawRate | Self::SurgePitchRate => "m rad/s²",
            Self::SinPitch => "rad",
            Self::Propeller => "1e4 rad²/s²",
            Self::Fin(_) => "rad m²/s²",
            Self::FinSquares => "rad² m²/s²",
            Self::DistanceSquared => "m²",
        }
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
    use Factor as F;
    let mut terms = Vec::new();
    let mut add = |target: Target, factors: &[F]| {
        terms.extend(factors.iter().map(|factor| GenericTerm { target, factor: *factor }));
    };
    let fins = [F::Fin(0), F::Fin(1), F::Fin(2), F::Fin(3)];
    let surge = [
        F::One,
        F::Time,
        F::Depth,
        F::Surge,
        F::SurgeSquared,
        F::SwaySquared,
        F::HeaveSquared,
        F::Propeller,
        F::YawRateAbs,
        F::FinSquares,
    ];
    add(Target::Acceleration(0), &surge);
    let sway = [
        F::One,
        F::Time,
        F::Sway,
        F::SwayAbs,
        F::SwaySquared,
        F::SurgeYawRate,
        F::YawRateAbs,
        F::Propeller,
        F::SurgeSquared,
    ];
    add(Target::Acceleration(1), &sway);
    add(Target::Acceleration(1), &fins);
    let heave = [
        F::One,
        F::Time,
        F::Depth,
        F::Heave,
        F::HeaveAbs,
        F::HeaveSquared,
        F::SurgePitchRate,
        F::PitchRateAbs,
        F::SurgeSquared,
        F::SurgeHeave,
    ];
    add(Target::Acceleration(2), &heave);
    add(Target::Acceleration(2), &fins);
    let roll = [F::One, F::Time, F::RollRate, F::Propeller, F::SurgeSquared, F::Sway, F::SurgeYawRate];
    add(Target::Acceleration(3), &roll);
    add(Target::Acceleration(3), &fins);
    let pitch = [
        F::One,
        F::Time,
        F::Depth,
        F::Heave,
        F::HeaveAbs,
        F::PitchRate,
        F::PitchRateAbs,
        F::SurgeSquared,
        F::SurgeHeave,
        F::SinPitch,
    ];
    add(Target::Acceleration(4), &pitch);
    add(Target::Acceleration(4), &fins);
    let yaw = [F::One, F::Time, F::Sway, F::SwayAbs, F::YawRate, F::YawRateAbs, F::SurgeSquared, F::Propeller];
    add(Target::Acceleration(5), &yaw);
    add(Target::Acceleration(5), &fins);
    for axis in 0..2 {
        add(Target::Water(axis), &[F::Time, F::TimeSquared, F::Depth]);
    }
    let readings: [(ResidualChannel, &[F]); 11] = [
        (ResidualChannel::Depth, &[F::Time, F::SinPitch, F::SurgeSquared]),
        (ResidualChannel::Roll, &[F::One, F::Time]),
        (ResidualChannel::Pitch, &[F::Time, F::PitchRate]),
        (ResidualChannel::Heading, &[F::Time, F::YawRate, F::Propeller, F::SinTwoHeading, F::CosTwoHeading]),
        (ResidualChannel::P, &[F::Time]),
        (ResidualChannel::Q, &[F::Time]),
        (ResidualChannel::R, &[F::Time, F::YawRate]),
        (ResidualChannel::DvlU, &[F::One, F::PitchRate, F::YawRate]),
        (ResidualChannel::DvlV, &[F::One, F::RollRate, F::YawRate]),
        (ResidualChannel::DvlW, &[F::One, F::RollRate, F::PitchRate]),
        (ResidualChannel::Range, &[F::DistanceSquared]),
    ];
    for (channel, factors) in readings {
        if present[channel as usize] {
            add(Target::Reading(channel), factors);
        }
    }
    terms
}
