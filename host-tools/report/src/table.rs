//! A table: its header names the units, and cells are ready to be read.

/// A table whose header names the units. Columns that hold only numbers are set flush right.
#[derive(Clone, Debug)]
pub struct Table {
    pub(crate) caption: String,
    pub(crate) header: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table; `header` names each column with its unit, as in `median [m]`.
    pub fn new(caption: impl Into<String>, header: &[&str]) -> Self {
        Self { caption: caption.into(), header: header.iter().map(|h| h.to_string()).collect(), rows: Vec::new() }
    }

    /// Adds a row. Missing cells stay empty.
    pub fn row(mut self, cells: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    /// Number of columns.
    pub(crate) fn columns(&self) -> usize {
        self.rows.iter().map(Vec::len).chain([self.header.len()]).max().unwrap_or(0)
    }

    /// Whether a column holds numbers only.
    pub(crate) fn is_numeric(&self, column: usize) -> bool {
        let mut filled = self.rows.iter().filter_map(|row| row.get(column)).filter(|text| !text.is_empty()).peekable();
        filled.peek().is_some() && filled.all(|text| is_number(text))
    }
}

/// A number, perhaps with a sign, a unit or a deviation, or a dash for none.
fn is_number(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-', '−', '±', '<', '>', '≤', '≥', '~', ' ', '(', '[']);
    digits.starts_with(|c: char| c.is_ascii_digit() || c == '.') || ["–", "—", "-", "NaN", "inf"].contains(&text)
}
