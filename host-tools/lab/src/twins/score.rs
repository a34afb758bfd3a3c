//! What came of one data set.

use backseat_diagnose::torpedo::Found;
use hil_sim::dataset::runs::Effect;
use serde::{Deserialize, Serialize};

/// One data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Twin {
    /// Effects hidden, with what they are in words.
    pub hidden: Vec<(String, String)>,
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
    /// Compares what is named with what is hidden.
    pub fn of(hidden: &[Effect], found: Result<Vec<Found>, String>) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twin_is_judged_by_its_first_name_and_by_what_is_not_there() {
        let twin = |hidden: &[&str], named: &[&str], alike: &[&str]| Twin {
            hidden: hidden.iter().map(|name| ((*name).to_owned(), String::new())).collect(),
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
        assert!(twin(&[], &[], &[]).is_first_right());
    }
}
