//! What came of one data set.

use backseat_diagnose::torpedo::Found;
use hil_sim::dataset::runs::Effect;
use serde::{Deserialize, Serialize};

/// An effect of so many sigmas could be told.
const SEPARABLE: f64 = 3.0;

/// One data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Twin {
    /// Effects hidden, with what they are in words.
    pub hidden: Vec<(String, String)>,
    /// Of these, in their order: size over its sigma by the information of the runs, everything else being free.
    pub sigmas: Vec<f64>,
    /// Effects named, strongest first.
    pub named: Vec<String>,
    /// Why the data set is refused: nothing is named then.
    pub refused: Option<String>,
    /// Of the first named: those that it is said to be like.
    pub alike: Vec<String>,
    /// Numbers of what is hidden and named that the diagnosis gives, and those inside their interval.
    pub sized: usize,
    /// Inside.
    pub covered: usize,
}

impl Twin {
    /// Compares what is named with what is hidden; `known` is how well each number could be known.
    pub fn of(hidden: &[Effect], found: Result<Vec<Found>, String>, known: &[(String, f64)]) -> Self {
        let (found, refused) = match found {
            Ok(found) => (found, None),
            Err(why) => (Vec::new(), Some(why)),
        };
        let (mut sized, mut covered) = (0, 0);
        for effect in hidden {
            let (name, value) = effect.number;
            let of = found.iter().filter(|found| found.entry.name == effect.name).flat_map(|found| &found.parameters);
            // one of each configuration stands as `buoyancy_kg[1]`; what configurations differ by is no number of its own
            for parameter in of.filter(|one| one.name.split('[').next() == Some(name)) {
                let [low, high] = parameter.ci95;
                sized += 1;
                covered += usize::from((low..=high).contains(&value));
            }
        }
        let words = |effect: &Effect| (effect.name.to_owned(), format!("{} {:.3}", effect.number.0, effect.number.1));
        let first = found.first().map_or(&[][..], |found| &found.alike);
        Self {
            hidden: hidden.iter().map(words).collect(),
            sigmas: hidden.iter().map(|effect| in_sigmas(effect, known)).collect(),
            named: found.iter().map(|found| found.entry.name.to_owned()).collect(),
            refused,
            alike: first.iter().map(|(name, _)| (*name).to_owned()).collect(),
            sized,
            covered,
        }
    }

    fn is_hidden(&self, name: &str) -> bool {
        self.hidden.iter().any(|(hidden, _)| hidden == name)
    }

    /// Whether an effect could be told from all others.
    pub fn is_separable(&self) -> bool {
        self.sigmas.iter().any(|sigmas| *sigmas >= SEPARABLE)
    }

    /// How many of those that could be told are named, and how many there are.
    pub fn separable(&self) -> [usize; 2] {
        let told = self.hidden.iter().zip(&self.sigmas).filter(|(_, sigmas)| **sigmas >= SEPARABLE);
        told.fold([0; 2], |[named, of], ((name, _), _)| [named + usize::from(self.named.contains(name)), of + 1])
    }

    /// Whether the first effect that is named is there, or rightly none is.
    pub fn is_first_right(&self) -> bool {
        self.named.first().map_or(self.hidden.is_empty(), |name| self.is_hidden(name))
    }

    /// The same, or the first is said to be like one that is there.
    pub fn is_first_right_or_alike(&self) -> bool {
        self.is_first_right() || self.alike.iter().any(|name| self.is_hidden(name))
    }

    /// How many of the effects hidden are named.
    pub fn found(&self) -> usize {
        self.hidden.iter().filter(|(hidden, _)| self.named.contains(hidden)).count()
    }

    /// Effects that are named and not there.
    pub fn false_alarms(&self) -> impl Iterator<Item = &String> {
        self.named.iter().filter(|name| !self.is_hidden(name))
    }
}

/// Size of an effect over the larger sigma of its number in the two configurations.
fn in_sigmas(effect: &Effect, known: &[(String, f64)]) -> f64 {
    let (name, value) = effect.number;
    let (name, size) = match name {
        "gain_top" => (name, 1.0 - value),
        _ => (name, value),
    };
    let of_number = known.iter().filter(|(known, _)| known.split('[').next() == Some(name));
    let sigma = of_number.map(|(_, sigma)| *sigma).fold(0.0, f64::max);
    if sigma > 0.0 { size.abs() / sigma } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twin_is_judged_by_its_first_name_and_by_what_is_not_there() {
        let twin = |hidden: &[&str], named: &[&str], alike: &[&str]| Twin {
            hidden: hidden.iter().map(|name| ((*name).to_owned(), String::new())).collect(),
            sigmas: [4.0, 2.0][..hidden.len()].to_vec(),
            named: named.iter().map(|name| (*name).to_owned()).collect(),
            alike: alike.iter().map(|name| (*name).to_owned()).collect(),
            refused: None,
            sized: 0,
            covered: 0,
        };
        let right = twin(&["fin_gain"], &["fin_gain"], &[]);
        assert!(right.is_first_right() && right.found() == 1 && right.false_alarms().count() == 0);
        let second = twin(&["fin_gain"], &["dvl_delay", "fin_gain"], &["fin_gain"]);
        assert!(!second.is_first_right() && second.is_first_right_or_alike() && second.false_alarms().count() == 1);
        assert!(!twin(&["fin_gain"], &[], &[]).is_first_right());
        assert!(twin(&[], &[], &[]).is_first_right() && !twin(&[], &[], &[]).is_separable());
        let two = twin(&["fin_gain", "dvl_scale"], &["dvl_scale"], &[]);
        assert!(two.is_separable() && two.separable() == [0, 1]);
    }

    #[test]
    fn an_effect_is_measured_by_the_worse_of_its_configurations() {
        let known =
            [("buoyancy_kg[0]".to_owned(), 0.1), ("buoyancy_kg[1]".to_owned(), 0.2), ("gain_top".to_owned(), 0.1)];
        let of = |number| in_sigmas(&Effect { name: "any", number }, &known);
        assert_eq!(of(("buoyancy_kg", -0.5)), 2.5);
        assert!((of(("gain_top", 0.6)) - 4.0).abs() < 1e-12);
        assert_eq!(of(("dvl_scale", 0.1)), 0.0);
    }
}
