//! Markdown of the pages: tables, and prose of limited width.

use comfy_table::{Table, presets};

/// A Markdown table with this header.
pub fn markdown_table<T: Into<String>>(header: impl IntoIterator<Item = T>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN).set_header(header.into_iter().map(Into::into).collect::<Vec<String>>());
    table
}

/// Longest line of prose.
const WIDTH: usize = 118;

/// A page with its paragraphs and list items broken to lines of `WIDTH`; tables, headings and code stay as they are.
pub fn wrapped(page: &str) -> String {
    let (mut out, mut paragraph, mut fenced) = (String::new(), String::new(), false);
    for line in page.lines() {
        let is_item = line.starts_with("- ") || line.starts_with("* ");
        let is_verbatim = fenced
            || line.is_empty()
            || line.starts_with(['|', '#', '!', '<'])
            || line.starts_with("```")
            || line.starts_with("    ");
        if (is_item || is_verbatim) && !paragraph.is_empty() {
            break_paragraph(&mut out, &std::mem::take(&mut paragraph));
        }
        fenced ^= line.starts_with("```");
        if is_verbatim {
            out += line;
            out.push('\n');
        } else {
            paragraph += line.trim_start();
            paragraph.push(' ');
        }
    }
    break_paragraph(&mut out, &paragraph);
    out
}

/// One paragraph; a list item hangs under its first word.
fn break_paragraph(out: &mut String, paragraph: &str) {
    let indent = if paragraph.starts_with("- ") || paragraph.starts_with("* ") { 2 } else { 0 };
    if !paragraph.is_empty() {
        out.push_str(&broken(paragraph, WIDTH, indent));
        out.push('\n');
    }
}

/// Words in lines of this width, those after the first begun with so many blanks; a longer word stands alone.
pub(crate) fn broken(text: &str, line_width: usize, indent: usize) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_is_wrapped_and_nothing_else() {
        let word = "word ".repeat(60);
        let page =
            format!("# {word}\n\n{word}\n`code` starts this.\n- {word}\n- item\n\n| {word}|\n\n```\n{word}\n```\n");
        let wrapped = wrapped(&page);
        for line in wrapped.lines().filter(|line| line.chars().count() > WIDTH) {
            assert!(line.starts_with(['#', '|']) || line.trim() == word.trim(), "{line}");
        }
        assert!(wrapped.contains("word `code` starts this.\n- word") && wrapped.contains("\n  word"), "{wrapped}");
        assert!(wrapped.contains("\n- item\n\n|"), "{wrapped}");
        assert_eq!(page.split_whitespace().collect::<Vec<_>>(), wrapped.split_whitespace().collect::<Vec<_>>());
    }
}
