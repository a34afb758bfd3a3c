//! Pages whose prose keeps a width.

use backseat_report::markdown::broken;

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
