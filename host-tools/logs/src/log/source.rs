//! Where a column of a log of messages was read from.

/// A number of a message: (number + offset) · scale is the column's value.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// As a mapping names it: `ATT.Roll`, or `NAV_ROLL` of a message with one number.
    pub name: String,
    /// To the unit of the column.
    pub scale: f64,
    /// Added before, in the unit of the number.
    pub offset: f64,
}
