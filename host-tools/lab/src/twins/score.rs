//! What came of one data set.

use backseat_diagnose::torpedo::Found;
use backseat_diagnose::torpedo::separable::Known;
use hil_sim::dataset::runs::Effect;
use serde::{Deserialize, Serialize};

/// An effect of so many sigmas could be told.
const SEPARABLE: f64 = 3.0;

/// How many sigmas the number of an effect is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sigmas {
    /// From none.
    pub size: f64,
    /// Outside what the textbook leaves open: what is inside is no finding, however well it is known.
    pub outside: f64,
}

/// Which of the two is counted.
pub type Counted = fn(&Sigmas) -> f64;

/// One data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Twin {
    /// Effects hidden, with what they are in words.
    pub hidden: Vec<(String, String)>,
    /// Of these, in their order, by the information of the runs, everything else being free.
    pub sigmas: Vec<Sigmas>,
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
    pub fn of(hidden: &[Effect], found: Result<Vec<Found>, String>, known: &[Known]) -> Self {
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

    /// Whether an effect could be told from all others, by sigmas counted so.
    pub fn is_separable(&self, by: Counted) -> bool {
        self.sigmas.iter().any(|sigmas| by(sigmas) >= SEPARABLE)
    }

    /// How many of those that could be told are named, and how many there are.
    pub fn separable(&self, by: Counted) -> [usize; 2] {
        let told = self.hidden.iter().zip(&self.sigmas).filter(|(_, sigmas)| by(sigmas) >= SEPARABLE);
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

/// Whether a number, of whichever configuration, has this name.
pub fn is_of(known: &Known, name: &str) -> bool {
    known.name.split('[').next() == Some(name)
}

/// An effect by its number in the configuration that knows it worse.
fn in_sigmas(effect: &Effect, known: &[Known]) -> Sigmas {
    let (name, value) = effect.number;
    let size = if name == "gain_top" { value - 1.0 } else { value };
    let of_number = known.iter().filter(|known| is_of(known, name) && known.sigma > 0.0);
    let worse = of_number.max_by(|a, b| a.sigma.total_cmp(&b.sigma));
    worse.map_or(Sigmas { size: 0.0, outside: 0.0 }, |Known { sigma, open: [low, high], .. }| Sigmas {
        size: size.abs() / sigma,
        outside: (low - size).max(size - high).max(0.0) / sigma,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twin_is_judged_by_its_first_name_and_by_what_is_not_there() {
        let twin = |hidden: &[&str], named: &[&str], alike: &[&str]| Twin {
            hidden: hidden.iter().map(|name| ((*name).to_owned(), String::new())).collect(),
            sigmas: [4.0, 2.0].map(|size| Sigmas { size, outside: size - 2.0 })[..hidden.len()].to_vec(),
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
        let (from_none, outside): (Counted, Counted) = (|s| s.size, |s| s.outside);
        assert!(twin(&[], &[], &[]).is_first_right() && !twin(&[], &[], &[]).is_separable(from_none));
        let two = twin(&["fin_gain", "dvl_scale"], &["dvl_scale"], &[]);
        assert!(two.is_separable(from_none) && two.separable(from_none) == [0, 1]);
        assert!(!two.is_separable(outside) && two.separable(outside) == [0, 0]);
    }

    #[test]
    fn an_effect_is_measured_by_the_worse_of_its_configurations() {
        let known = [("buoyancy_kg[0]", 0.1, 0.05), ("buoyancy_kg[1]", 0.2, 0.1), ("gain_top", 0.1, 0.1)];
        let known = known.map(|(name, sigma, open)| Known { name: name.to_owned(), sigma, open: [-open, open] });
        let of = |number| in_sigmas(&Effect { name: "any", number }, &known);
        assert_eq!(of(("buoyancy_kg", -0.5)), Sigmas { size: 2.5, outside: 2.0 });
        let gain = of(("gain_top", 0.6));
        assert!((gain.size - 4.0).abs() < 1e-12 && (gain.outside - 3.0).abs() < 1e-12);
        assert_eq!(of(("gain_top", 1.05)).outside, 0.0);
        assert_eq!(of(("dvl_scale", 0.1)), Sigmas { size: 0.0, outside: 0.0 });
    }
}
