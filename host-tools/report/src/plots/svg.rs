//! From plotters' SVG to the page's: smaller, of no fixed size, and with a description.

use super::axis::Axis;
use crate::lettering::{SUB, clean, escape};
use std::fmt::Write as _;

/// What the page needs to read values off a figure: pixels and values at the two ends of an axis, and its title.
pub(super) fn scale(name: &str, (from, to): (i32, i32), axis: &Axis) -> String {
    let log = if axis.is_log { format!(" data-{name}-log=\"\"") } else { String::new() };
    let title = escape(&clean(&axis.title));
    let (from, to) = (from * SUB, to * SUB);
    format!(" data-{name}=\"{from} {to} {} {}\"{log} data-{name}-title=\"{title}\"", axis.low, axis.high)
}

/// A run of circles of one kind becomes one path of dots; other elements lose what they need not say.
pub(super) fn finish(text: &str, description: &str, scales: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let Some((x, y, look)) = disc(line) else {
            match line.strip_prefix("<svg ") {
                Some(attributes) => open(&mut out, attributes, description, scales),
                None => out.push_str(&line.replace(" opacity=\"1\"", "").replace(" \"/>", "\"/>")),
            }
            // Line ends inside of a text element would be seen as blanks.
            if line.starts_with('<') && !line.starts_with("<text") {
                out.push('\n');
            }
            continue;
        };
        let _ = write!(out, "<path d=\"M{x} {y}h0");
        while let Some((x, y, _)) = lines.peek().and_then(|next| disc(next)).filter(|(.., other)| *other == look) {
            let _ = write!(out, "M{x} {y}h0");
            lines.next();
        }
        let diameter = 2 * look.radius.parse::<u32>().unwrap_or(1);
        let _ = write!(
            out,
            "\" fill=\"none\" stroke=\"{}\" stroke-width=\"{diameter}\" stroke-linecap=\"round\"",
            look.fill
        );
        let _ = if look.opacity == "1" { write!(out, "/>") } else { write!(out, " opacity=\"{}\"/>", look.opacity) };
        out.push('\n');
    }
    out
}

fn open(out: &mut String, attributes: &str, description: &str, scales: &str) {
    let view = attribute(attributes, "viewBox").unwrap_or_default();
    let label = escape(description);
    let _ = write!(
        out,
        "<svg viewBox=\"{view}\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{label}\"{scales}>"
    );
}

/// How a filled circle looks.
#[derive(PartialEq, Eq)]
struct Look<'a> {
    radius: &'a str,
    opacity: &'a str,
    fill: &'a str,
}

fn disc(line: &str) -> Option<(&str, &str, Look<'_>)> {
    let attributes = line.strip_prefix("<circle ")?;
    let fill = attribute(attributes, "fill").filter(|fill| *fill != "none")?;
    let look = Look { radius: attribute(attributes, "r")?, opacity: attribute(attributes, "opacity")?, fill };
    Some((attribute(attributes, "cx")?, attribute(attributes, "cy")?, look))
}

pub(super) fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    let mut rest = attributes;
    while let Some((key, tail)) = rest.split_once("=\"") {
        let (value, after) = tail.split_once('"')?;
        if key.trim() == name {
            return Some(value);
        }
        rest = after;
    }
    None
}
