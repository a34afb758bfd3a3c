//! Sizes of figures and of the writing in them.

/// Parts of a pixel: plotters rounds to whole pixels, so everything is drawn on a grid of quarter pixels.
pub const SUB: i32 = 4;
/// Width of every figure.
pub const WIDTH: i32 = 640;
/// Size of the writing, pixels of a figure of [`WIDTH`].
pub const FONT: f64 = 15.0;
/// On a phone the page enlarges the writing. The layout leaves room for this size.
pub const PHONE_FONT: f64 = 18.5;
/// On a wide page the figure grows, and the writing need not.
pub const WIDE_FONT: f64 = 10.0;

/// A size of writing in the units of the SVG.
pub fn units(font: f64) -> f64 {
    font * f64::from(SUB)
}

/// Width that some writing takes on a phone, for a wide font: every system has its own.
pub fn text_width(text: &str) -> f64 {
    let share = |c: char| match c {
        'i' | 'j' | 'l' | 't' | 'f' | 'r' | ' ' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | '(' | ')' | '[' | ']'
        | '-' => 0.38,
        'm' | 'w' | '%' | '@' | '×' | '±' => 0.93,
        c if c.is_uppercase() => 0.7,
        _ => 0.61,
    };
    text.chars().map(share).sum::<f64>() * PHONE_FONT
}

/// Cuts writing that does not fit.
pub fn shortened(text: &str, room: f64) -> String {
    if text_width(text) <= room {
        return text.into();
    }
    let mut kept = String::new();
    for c in text.chars() {
        kept.push(c);
        if text_width(&kept) + text_width("…") > room {
            kept.pop();
            break;
        }
    }
    kept.push('…');
    kept
}

/// One line without characters that XML cannot hold; plotters itself escapes the rest.
pub fn clean(text: &str) -> String {
    text.chars().map(|c| if c == '\n' || c == '\t' { ' ' } else { printable(c) }).collect()
}

/// The character, or a replacement for one that XML cannot hold.
pub fn printable(c: char) -> char {
    match c {
        '\n' | '\t' => c,
        '\u{fffe}' | '\u{ffff}' => char::REPLACEMENT_CHARACTER,
        c if c.is_control() => char::REPLACEMENT_CHARACTER,
        c => c,
    }
}

/// Text as it may stand in the page; control characters, which neither HTML nor XML can hold, become U+FFFD.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            _ => out.push(printable(c)),
        }
    }
    out
}
