//! Several plots as one picture.

use super::svg::attribute;
use crate::lettering::SUB;
use crate::palette;
use std::fmt::Write as _;

/// Room around every plot, pixels.
const MARGIN: i32 = 12 * SUB;

/// That of the dark theme's page (`style.css`).
const DARK_SHEET: &str = "#14181D";

/// A picture of its own, SVG, light or dark as the reader's screen: `columns` of plots side by side, each centred in height.
pub fn sheet(columns: &[&[String]]) -> String {
    let column_height = |column: &[String]| column.iter().map(|plot| size(plot).1 + 2 * MARGIN).sum::<i32>();
    let height = columns.iter().map(|column| column_height(column)).max().unwrap_or_default();
    let (mut body, mut x) = (String::new(), 0);
    for column in columns {
        let mut y = (height - column_height(column)) / 2;
        for plot in *column {
            let (width, plot_height) = size(plot);
            let place =
                format!("<svg x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{plot_height}\" ", x + MARGIN, y + MARGIN);
            body += &plot.replacen("<svg ", &place, 1);
            y += plot_height + 2 * MARGIN;
        }
        x += column.iter().map(|plot| size(plot).0).max().unwrap_or_default() + 2 * MARGIN;
    }
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {x} {height}\" width=\"{}\" height=\"{}\" stroke-linejoin=\"round\">\n\
         <style>@media (prefers-color-scheme: dark) {{\n  .sheet {{ fill: {DARK_SHEET} }}\n{}}}</style>\n\
         <rect class=\"sheet\" width=\"{x}\" height=\"{height}\" fill=\"#FFFFFF\"/>\n{body}</svg>",
        x / SUB,
        height / SUB,
        palette::dark_rules(),
    );
    out
}

/// Width and height of a plot of this module.
fn size(plot: &str) -> (i32, i32) {
    let view = plot.strip_prefix("<svg ").and_then(|attributes| attribute(attributes, "viewBox")).unwrap_or_default();
    let mut numbers = view.split(' ').skip(2).map(|number| number.parse().unwrap_or_default());
    (numbers.next().unwrap_or_default(), numbers.next().unwrap_or_default())
}
