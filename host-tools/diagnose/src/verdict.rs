//! The verdict on a log: one table of rules, read from the top; the first one whose condition holds decides.

/// What the log says about the declared model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// The declared model leaves nothing significant.
    None,
    /// The effects found account for what the declared model leaves.
    Explained,
    /// The effects found account for it, and other entries of the catalogue would as well.
    Ambiguous,
    /// Structure remains that no entry of the catalogue accounts for.
    Unexplained,
    /// What is left on data that judges is more than the sensors can make.
    Implausible,
    /// Too little judges, the model says less than the mean of what was measured, or what judges refutes what was found.
    #[default]
    Undecided,
}

impl Verdict {
    /// As in the JSON object.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Explained => "explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
            Self::Implausible => "implausible",
            Self::Undecided => "undecided",
        }
    }

    /// Whether a result with this word is not to be trusted: exit code 3.
    #[must_use]
    pub const fn is_doubtful(self) -> bool {
        matches!(self, Self::Implausible | Self::Undecided)
    }
}

/// What the verdict depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conditions {
    /// What is left on data that judges, effects and proposed terms included, is more than the sensors can make.
    pub is_implausible: bool,
    /// The position error that is left is more than half of the largest that the sensors can make.
    pub much_is_left: bool,
    /// Too little data judges, or a share of variance above one is unexplained.
    pub is_undecided: bool,
    /// An effect is significant where it was fitted, and the data that judge do not bear it out.
    pub is_refuted: bool,
    /// An entry of a size that this vehicle cannot have is significant.
    pub is_impossible: bool,
    /// Significant terms outside the catalogue remain beside the effects.
    pub structure_remains: bool,
    /// Σ e² is larger than the declared noise makes it.
    pub exceeds_noise: bool,
    /// As many generic terms as effects explain more than the effects do.
    pub generic_terms_fit_better: bool,
    /// The innovations are not white: p below [`LEAST_WHITENESS_P`].
    pub is_coloured: bool,
    /// At least one effect of the catalogue was found.
    pub has_effects: bool,
    /// An entry of another name could stand in for one that was found.
    pub has_alternatives: bool,
}

/// A verdict of "none" is refused below this probability of the held-out innovations under whiteness.
pub const LEAST_WHITENESS_P: f64 = 1e-12;

/// One row of the table.
pub struct VerdictRule {
    /// The condition in words.
    pub condition: &'static str,
    /// The condition.
    pub holds: fn(&Conditions) -> bool,
    /// What follows.
    pub verdict: Verdict,
}

/// The table; its last row always holds.
pub const RULES: [VerdictRule; 12] = [
    rule("what is left is more than the sensors can make", |c| c.is_implausible, Verdict::Implausible),
    rule("significant terms outside the catalogue remain", |c| c.structure_remains, Verdict::Unexplained),
    rule(
        "an entry is significant with a size that this vehicle cannot have",
        |c| c.is_impossible,
        Verdict::Unexplained,
    ),
    rule("the residual is larger than the declared noise", |c| c.exceeds_noise, Verdict::Unexplained),
    rule(
        "the position error that is left is more than half of the most that the sensors make",
        |c| c.much_is_left,
        Verdict::Unexplained,
    ),
    rule(
        "generic terms explain the residual better than the effects found",
        |c| c.has_effects && c.generic_terms_fit_better,
        Verdict::Unexplained,
    ),
    rule(
        "no effect was found and the innovations are not white",
        |c| !c.has_effects && c.is_coloured,
        Verdict::Unexplained,
    ),
    rule(
        "too little of the log judges, or the model says less than the mean of what was measured",
        |c| c.is_undecided,
        Verdict::Undecided,
    ),
    rule(
        "an effect is significant where it was fitted, and the data that judge do not bear it out",
        |c| c.is_refuted,
        Verdict::Undecided,
    ),
    rule("no effect was found", |c| !c.has_effects, Verdict::None),
    rule("another entry could stand in for an effect found", |c| c.has_alternatives, Verdict::Ambiguous),
    rule("effects were found", |_| true, Verdict::Explained),
];

const fn rule(condition: &'static str, holds: fn(&Conditions) -> bool, verdict: Verdict) -> VerdictRule {
    VerdictRule { condition, holds, verdict }
}

/// The first rule that holds.
#[must_use]
pub fn decide(conditions: &Conditions) -> &'static VerdictRule {
    RULES.iter().find(|rule| (rule.holds)(conditions)).unwrap_or(&RULES[RULES.len() - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least that makes each row decide.
    fn rows() -> [Conditions; RULES.len()] {
        let nothing = Conditions::default();
        [
            Conditions { is_implausible: true, ..nothing },
            Conditions { structure_remains: true, ..nothing },
            Conditions { is_impossible: true, ..nothing },
            Conditions { exceeds_noise: true, ..nothing },
            Conditions { much_is_left: true, ..nothing },
            Conditions { generic_terms_fit_better: true, has_effects: true, ..nothing },
            Conditions { is_coloured: true, ..nothing },
            Conditions { is_undecided: true, ..nothing },
            Conditions { is_refuted: true, ..nothing },
            nothing,
            Conditions { has_effects: true, has_alternatives: true, ..nothing },
            Conditions { has_effects: true, ..nothing },
        ]
    }

    #[test]
    fn each_row_decides_by_its_own_condition() {
        for (rule, conditions) in RULES.iter().zip(&rows()) {
            assert_eq!(decide(conditions).condition, rule.condition);
        }
    }

    #[test]
    fn a_row_above_outranks_every_row_below() {
        let both = |a: &Conditions, b: &Conditions| Conditions {
            is_implausible: a.is_implausible || b.is_implausible,
            much_is_left: a.much_is_left || b.much_is_left,
            is_undecided: a.is_undecided || b.is_undecided,
            is_refuted: a.is_refuted || b.is_refuted,
            is_impossible: a.is_impossible || b.is_impossible,
            structure_remains: a.structure_remains || b.structure_remains,
            exceeds_noise: a.exceeds_noise || b.exceeds_noise,
            generic_terms_fit_better: a.generic_terms_fit_better || b.generic_terms_fit_better,
            is_coloured: a.is_coloured || b.is_coloured,
            has_effects: a.has_effects || b.has_effects,
            has_alternatives: a.has_alternatives || b.has_alternatives,
        };
        for (i, (rule, above)) in RULES.iter().zip(&rows()).enumerate() {
            for below in rows().iter().skip(i + 1) {
                let together = both(above, below);
                if (rule.holds)(&together) {
                    let decided = RULES.iter().position(|rule| rule.condition == decide(&together).condition);
                    assert!(decided <= Some(i), "{}: {together:?}", rule.condition);
                }
            }
        }
    }

    #[test]
    fn nothing_good_is_said_of_coloured_innovations_or_beyond_the_floor() {
        for bits in 0..2048_u16 {
            let bit = |place: u16| bits & (1 << place) != 0;
            let conditions = Conditions {
                structure_remains: bit(0),
                exceeds_noise: bit(1),
                generic_terms_fit_better: bit(2),
                is_coloured: bit(3),
                has_effects: bit(4),
                has_alternatives: bit(5),
                is_implausible: bit(6),
                is_undecided: bit(7),
                is_refuted: bit(8),
                is_impossible: bit(9),
                much_is_left: bit(10),
            };
            let verdict = decide(&conditions).verdict;
            let is_left = conditions.is_coloured || conditions.is_impossible;
            assert!(verdict != Verdict::None || !(is_left || conditions.has_effects), "{conditions:?}");
            let is_good = matches!(verdict, Verdict::None | Verdict::Explained | Verdict::Ambiguous);
            let is_doubtful = conditions.is_undecided || conditions.is_refuted;
            let too_much_is_left = conditions.is_implausible || conditions.much_is_left;
            assert!(!(is_good && (is_doubtful || too_much_is_left)), "{conditions:?}");
        }
    }
}
