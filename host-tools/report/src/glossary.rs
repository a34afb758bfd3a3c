//! Terms of the guide's glossary, explained under the mouse wherever a table or a caption uses one.

use super::lettering::escape;
use std::sync::LazyLock;

/// Terms and the first paragraph on each, longest first, so that `RMS/DRMS` is found before `RMS`.
static TERMS: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
    let page = include_str!("../../../docs/guide/glossary.md");
    let entries = page.split("\n### ").skip(1).filter_map(|entry| entry.split_once('\n'));
    let mut terms: Vec<_> = entries
        .flat_map(|(heading, text)| {
            let meaning = text.split("\n\n").next().unwrap_or_default().replace(['\n', '*'], " ");
            heading.split(", ").map(move |term| (term, meaning.trim().to_owned()))
        })
        .collect();
    terms.sort_by_key(|(term, _)| std::cmp::Reverse(term.len()));
    terms
});

/// Text for the page, each term of the glossary with its explanation.
pub fn explained(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let (mut rest, mut in_word) = (text, false);
    while let Some(c) = rest.chars().next() {
        let found = TERMS.iter().find(|(term, _)| !in_word && begins_with(rest, term));
        let length = found.map_or(c.len_utf8(), |(term, _)| term.len());
        let (part, after) = rest.split_at(length);
        match found {
            Some((_, meaning)) => {
                out += &format!("<abbr title=\"{}\">{}</abbr>", escape(meaning), escape(part));
            }
            None => out += &escape(part),
        }
        in_word = found.is_some() || c.is_alphanumeric();
        rest = after;
    }
    out
}

fn begins_with(text: &str, term: &str) -> bool {
    text.get(..term.len()).is_some_and(|start| start.eq_ignore_ascii_case(term))
        && !text[term.len()..].starts_with(char::is_alphanumeric)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_terms_are_explained_and_nothing_else() {
        let page = explained("mean ANEES <1>, RMS/DRMS, TOA");
        assert!(page.starts_with("mean <abbr title=\"Average NEES"), "{page}");
        assert!(page.contains("\">RMS/DRMS</abbr>") && page.contains("\">TOA</abbr>"), "{page}");
        assert!(page.contains("&lt;1&gt;"), "{page}");
        assert_eq!(explained("degate aids µ [m]"), "degate aids µ [m]");
    }
}
