//! Tables in Markdown, and prose of limited width.

use comfy_table::{Table, presets};

/// A Markdown table with this header.
pub fn markdown_table<T: Into<String>>(header: impl IntoIterator<Item = T>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN).set_header(header.into_iter().map(Into::into).collect::<Vec<String>>());
    table
}

/// Words in lines of this width, those after the first begun with so many blanks; a longer word stands alone.
pub fn broken(text: &str, line_width: usize, indent: usize) -> String {
    let (mut out, mut width) = (String::with_capacity(text.len()), 0);
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if width > 0 && width + 1 + length > line_width {
            out.push('\n');
            out.extend(std::iter::repeat_n(' ', indent));
            width = indent;
        } else if width > 0 {
            out.push(' ');
            width += 1;
        }
        out.push_str(word);
        width += length;
    }
    out
}
