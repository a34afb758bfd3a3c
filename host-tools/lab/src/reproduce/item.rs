//! A table or figure of the thesis: rows and columns of one of our studies, beside what is printed.

use super::printed;
use super::studies::Study;

/// Tables, figures or sections of the thesis, by number.
#[derive(Clone, Copy, Debug)]
pub struct Covers {
    /// `table`, `figure` or `section`.
    pub kind: &'static str,
    pub chapter: u32,
    /// First and last number within the chapter.
    pub numbers: [u32; 2],
}

impl Covers {
    /// Whether this is one of them, as in `table-4.16`.
    pub fn holds(&self, asked: &str) -> bool {
        let number = asked.strip_prefix(self.kind).and_then(|rest| rest.strip_prefix('-'));
        let Some((chapter, number)) = number.and_then(|text| text.split_once('.')) else { return false };
        let [first, last] = self.numbers;
        chapter.parse() == Ok(self.chapter) && number.parse().is_ok_and(|number| (first..=last).contains(&number))
    }
}

/// One measured quantity of an item.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Key within a row of the study.
    pub key: &'static str,
    /// Header with the unit.
    pub header: &'static str,
    /// A claim that holds (1) or does not (0): shown as a count.
    pub is_claim: bool,
}

/// A row of numbers that others reported, in the order of the item's columns; NaN where there is none.
#[derive(Clone, Copy, Debug)]
pub struct Reported {
    pub name: &'static str,
    pub values: &'static [f64],
}

/// What the thesis prints of an item's rows.
#[derive(Clone, Copy, Debug)]
pub enum Printed {
    /// No number.
    Nothing,
    /// Numbers of some rows.
    Values(&'static [Reported]),
    /// Numbers of some rows, below which the text says that the results stay.
    Below(&'static [Reported]),
    /// An error table, by its number.
    Errors(&'static str),
}

impl Printed {
    /// Numbers of a row, in the order of the columns; NaN where there is none.
    pub fn of(&self, row: &str) -> Option<Vec<f64>> {
        match self {
            Self::Nothing => None,
            Self::Values(rows) | Self::Below(rows) => {
                rows.iter().find(|reported| reported.name == row).map(|reported| reported.values.to_vec())
            }
            Self::Errors(table) => printed::errors(table, row),
        }
    }
}

/// Curves of an item's rows over time, medians over the ensemble.
#[derive(Clone, Copy, Debug)]
pub struct Curves {
    /// Prefix of the curves' keys: `prefix/row`.
    pub prefix: &'static str,
    pub y_label: &'static str,
    pub is_log: bool,
}

/// A table or figure.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    pub id: &'static str,
    pub title: &'static str,
    pub covers: &'static [Covers],
    /// What the thesis shows there and says of it.
    pub thesis: &'static str,
    /// The printed conditions, and in brackets what is ours because the thesis does not say.
    pub conditions: &'static str,
    pub study: &'static Study,
    /// Rows of the study.
    pub rows: &'static [&'static str],
    pub columns: &'static [Column],
    /// The thesis' numbers.
    pub printed: Printed,
    /// Results of an independent implementation of the thesis' equations.
    pub independent: &'static [Reported],
    pub curves: &'static [Curves],
    /// One line on why ours and theirs differ, or how to read the item.
    pub differs: &'static str,
}

impl Item {
    /// Whether an argument names it: by its own name, or by a table or figure that it covers.
    pub fn is_meant_by(&self, asked: &str) -> bool {
        self.id == asked || self.covers.iter().any(|covers| covers.holds(asked))
    }
}

/// A column of plain numbers.
pub const fn column(key: &'static str, header: &'static str) -> Column {
    Column { key, header, is_claim: false }
}

/// A column that counts the runs in which a claim holds.
pub const fn claim(key: &'static str, header: &'static str) -> Column {
    Column { key, header, is_claim: true }
}

pub const fn tables(chapter: u32, numbers: [u32; 2]) -> Covers {
    Covers { kind: "table", chapter, numbers }
}

pub const fn figures(chapter: u32, numbers: [u32; 2]) -> Covers {
    Covers { kind: "figure", chapter, numbers }
}
