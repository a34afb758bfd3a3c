//! A row of the table: what is declared about one parameter, and how it is read and written.

use core::fmt;

/// What a parameter's number means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any number in the range.
    Real,
    /// A whole number in the range: a flag, a choice or a count.
    Whole,
}

/// What may be done to a parameter while a mission runs or is armed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnderWay {
    /// It stays as it is.
    Fixed,
    /// It may change.
    Free,
    /// A limit of safety: it may fall, which is stricter.
    Lower,
    /// A limit of safety: it may rise, which is stricter.
    Higher,
}

impl UnderWay {
    /// Whether a value may take the place of another.
    #[must_use]
    pub fn admits(self, old: f64, new: f64) -> bool {
        match self {
            Self::Fixed => new == old,
            Self::Free => true,
            Self::Lower => new <= old,
            Self::Higher => new >= old,
        }
    }

    /// Whether a change takes effect at once; after any other navigation starts again.
    #[must_use]
    pub fn is_live(self) -> bool {
        self != Self::Fixed
    }
}

/// How the numbers of a key are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    Scalar,
    /// An array of so many.
    Vector(usize),
    /// Rows and columns.
    Matrix(usize, usize),
}

impl Shape {
    /// How many numbers.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "no key is empty")]
    pub const fn len(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vector(length) => length,
            Self::Matrix(rows, columns) => rows * columns,
        }
    }
}

/// What is declared about a key, or about some consecutive elements of it that are alike.
#[derive(Clone, Copy, Debug)]
pub struct Declaration {
    /// Section and key of the vehicle file: `drag.quadratic_diag`.
    pub key: &'static str,
    /// Of the whole key.
    pub shape: Shape,
    /// First element meant.
    pub first: usize,
    /// How many elements.
    pub count: usize,
    /// Unit, "1" for none.
    pub unit: &'static str,
    /// Real or whole.
    pub kind: Kind,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Whether it may change while a mission runs.
    pub under_way: UnderWay,
    /// Symbol in Fossen's notation or the thesis', "" for none. The image of a board has no text for people.
    #[cfg(not(target_os = "none"))]
    pub symbol: &'static str,
    /// What it means, one sentence.
    #[cfg(not(target_os = "none"))]
    pub help: &'static str,
}

impl Declaration {
    /// Whether a value is in the range. NaN is not.
    #[must_use]
    pub fn admits(&self, value: f64) -> bool {
        value >= self.min && value <= self.max && (self.kind == Kind::Real || libm::trunc(value) == value)
    }
}

/// A declaration, and access to its numbers in a struct `S`.
#[derive(Debug)]
pub struct Row<S: 'static> {
    /// What is declared.
    pub declaration: Declaration,
    /// Reads an element of the key; NaN beyond its last.
    pub get: fn(&S, usize) -> f64,
    /// Writes an element of the key; the value was checked before.
    pub set: fn(&mut S, usize, f64),
}

/// How many numbers some rows declare.
#[must_use]
pub const fn count<S>(rows: &[Row<S>]) -> usize {
    let (mut sum, mut i) = (0, 0);
    while i < rows.len() {
        sum += rows[i].declaration.count;
        i += 1;
    }
    sum
}

/// A number outside its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// Section and key of the vehicle file, e.g. `inertia.m_diag`.
    pub key: &'static str,
    /// Element of the key, 0 for scalars; row by row in a matrix (`fins.cp_m`: 3 fin + axis).
    pub index: usize,
    /// The value that was refused.
    pub value: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
}

impl fmt::Display for ParameterError {
    /// Key and index only: formatting of floats is left to the host.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}] is outside its range", self.key, self.index)
    }
}

impl core::error::Error for ParameterError {}

/// Checks every number against its range.
///
/// # Errors
/// The first number outside.
pub fn check<S>(rows: &[Row<S>], values: &S) -> Result<(), ParameterError> {
    check_with(rows, values, |declaration| declaration.min)
}

/// [`check`] with another lower limit of each declaration.
pub(crate) fn check_with<S>(
    rows: &[Row<S>],
    values: &S,
    min: impl Fn(&Declaration) -> f64,
) -> Result<(), ParameterError> {
    for Row { declaration, get, .. } in rows {
        let declaration = Declaration { min: min(declaration), ..*declaration };
        for index in declaration.first..declaration.first + declaration.count {
            let value = get(values, index);
            if !declaration.admits(value) {
                let Declaration { key, min, max, .. } = declaration;
                return Err(ParameterError { key, index, value, min, max });
            }
        }
    }
    Ok(())
}

/// A row of the table: `row!(KIND "key", "symbol", "unit", [min, max], "help", where)`.
///
/// | kind | number | `where` |
/// |---|---|---|
/// | `real` | one | path of the field |
/// | `vector[first, count of length]` | elements of an array | path of the field |
/// | `elements[shape, first, count]` | elements of anything | two closures, (struct, element) and (struct, element, value) |
/// | `whole` | a count | path of the field |
/// | `choice` | the place of the field's value in a list; has neither symbol, unit nor range | path of the field, the list |
/// | `flag` | 0 no, 1 yes; as `choice` | path of the field |
///
/// Before the kind: `live`, may change while a mission runs; `at_most` or `at_least`, a limit of safety that may only
/// become stricter then.
#[macro_export]
macro_rules! row {
    (@ $live:ident real $key:literal, $symbol:literal, $unit:literal, $range:expr, $help:literal, $($path:tt)+) => {
        $crate::row!(
            @ $live elements[$crate::parameters::Shape::Scalar, 0, 1] $key, $symbol, $unit, $range, $help,
            |s, _| s.$($path)+,
            |s, _, value| s.$($path)+ = value
        )
    };
    (
        @ $live:ident vector[$first:literal, $count:literal of $length:literal]
        $key:literal, $symbol:literal, $unit:literal, $range:expr, $help:literal, $($path:tt)+
    ) => {
        $crate::row!(
            @ $live elements[$crate::parameters::Shape::Vector($length), $first, $count]
            $key, $symbol, $unit, $range, $help,
            |s, i| s.$($path)+.get(i).copied().unwrap_or(f64::NAN),
            |s, i, value| if let Some(place) = s.$($path)+.get_mut(i) { *place = value; }
        )
    };
    (@ $live:ident elements[$shape:expr, $first:literal, $count:literal] $($rest:tt)+) => {
        $crate::row!(@ $live, $crate::parameters::Kind::Real, $shape, $first, $count, $($rest)+)
    };
    (@ $live:ident whole $key:literal, $symbol:literal, $unit:literal, $range:expr, $help:literal, $($path:tt)+) => {
        $crate::row!(
            @ $live, $crate::parameters::Kind::Whole, $crate::parameters::Shape::Scalar, 0, 1,
            $key, $symbol, $unit, $range, $help,
            |s, _| f64::from(s.$($path)+),
            |s, _, value| s.$($path)+ = value as _
        )
    };
    (@ $live:ident choice $key:literal, $help:literal, $($path:ident).+, [$($variant:expr),+]) => {
        $crate::row!(
            @ $live, $crate::parameters::Kind::Whole, $crate::parameters::Shape::Scalar, 0, 1,
            $key, "", "1", [0.0, [$($variant),+].len() as f64 - 1.0], $help,
            |s, _| [$($variant),+].iter().position(|v| *v == s.$($path).+).unwrap_or(0) as f64,
            |s, _, value| if let Some(v) = [$($variant),+].get(value as usize) { s.$($path).+ = *v; }
        )
    };
    (@ $live:ident flag $key:literal, $help:literal, $($path:ident).+) => {
        $crate::row!(@ $live choice $key, $help, $($path).+, [false, true])
    };
    (
        @ $live:ident, $kind:expr, $shape:expr, $first:literal, $count:literal,
        $key:literal, $symbol:literal, $unit:literal, $range:expr, $help:literal, $get:expr, $set:expr
    ) => {
        $crate::parameters::Row {
            declaration: $crate::parameters::Declaration {
                key: $key,
                shape: $shape,
                first: $first,
                count: $count,
                unit: $unit,
                kind: $kind,
                min: $range[0],
                max: $range[1],
                under_way: $crate::parameters::UnderWay::$live,
                #[cfg(not(target_os = "none"))]
                symbol: $symbol,
                #[cfg(not(target_os = "none"))]
                help: $help,
            },
            get: $get,
            set: $set,
        }
    };
    // from `declared`
    ([$($row:tt)+] $($rest:tt)+) => { $crate::row!($($row)+, $($rest)+) };
    (live $($rest:tt)+) => { $crate::row!(@ Free $($rest)+) };
    (at_most $($rest:tt)+) => { $crate::row!(@ Lower $($rest)+) };
    (at_least $($rest:tt)+) => { $crate::row!(@ Higher $($rest)+) };
    ($($rest:tt)+) => { $crate::row!(@ Fixed $($rest)+) };
}
