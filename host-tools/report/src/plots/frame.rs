//! The frame that all plots share: legend on top (so that it covers no data), mesh, axes, and the canvas in between.
//!
//! `SUB` appears wherever a size goes to plotters; the page scales the result.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;
use super::svg;
use crate::lettering::{FONT, SUB, WIDTH, clean, shortened, text_width};
use crate::palette::{AXIS, GRID, Ink, TEXT};

const LEGEND_ROW: i32 = 26;
const LEGEND_SWATCH: i32 = 30;
const MARGIN_RIGHT: i32 = 22;
const MARGIN_TOP: i32 = 10;
const AXIS_TITLE: i32 = 26;
const X_LABELS: i32 = 46;
/// Drawing into a string cannot fail: plotters' errors are those of files and fonts.
const IN_MEMORY: &str = "an SVG in memory has no file and no font to fail on";

type Plane = Cartesian2d<Axis, Axis>;

/// How an entry of the legend looks.
#[derive(Clone, Copy, Debug)]
pub(super) enum Mark {
    Line { width: f64, opacity: f64 },
    Band,
    Dot,
    Ring,
    Cross,
    Square,
    Ellipse,
}

/// An entry of the legend.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub name: String,
    pub ink: Ink,
    pub mark: Mark,
}

impl Key {
    pub fn new(name: impl Into<String>, ink: Ink, mark: Mark) -> Self {
        Self { name: name.into(), ink, mark }
    }
}

/// Frame of a plot before anything is drawn in it.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub x: Axis,
    pub y: Axis,
    /// Room at the left for the tick labels and the title of the y axis: see [`left_margin`].
    pub left: i32,
    pub legend: Vec<Key>,
    /// Height of the canvas without legend and axes.
    pub height: i32,
    /// What a reader hears who cannot see the figure.
    pub description: String,
    /// Nothing to draw: the frame says so.
    pub empty: bool,
}

impl Frame {
    /// Size of the canvas in pixels.
    pub fn canvas_size(&self) -> (f64, f64) {
        (f64::from(WIDTH - self.left - MARGIN_RIGHT), f64::from(self.height))
    }

    /// Width and height of what one pixel covers, in units of the axes.
    pub fn pixel(&self) -> (f64, f64) {
        let (width, height) = self.canvas_size();
        ((self.x.high - self.x.low) / width, (self.y.high - self.y.low) / height)
    }

    /// Draws the frame and, unless it is empty, what `paint` puts on its canvas.
    pub fn draw(&self, paint: impl FnOnce(&Canvas<'_, '_>)) -> String {
        let rows = legend_rows(&self.legend);
        let top = MARGIN_TOP + rows.len() as i32 * LEGEND_ROW;
        let height = top + self.height + X_LABELS;
        let mut text = String::new();
        {
            let root =
                SVGBackend::with_string(&mut text, ((WIDTH * SUB) as u32, (height * SUB) as u32)).into_drawing_area();
            for (row, keys) in rows.iter().enumerate() {
                draw_legend_row(&root, keys, 2 + row as i32 * LEGEND_ROW + LEGEND_ROW / 2);
            }
            let mut chart = ChartBuilder::on(&root)
                .margin_top(top * SUB)
                .margin_right(MARGIN_RIGHT * SUB)
                .x_label_area_size(X_LABELS * SUB)
                .y_label_area_size(self.left * SUB)
                .build_cartesian_2d(self.x.clone(), self.y.clone())
                .expect(IN_MEMORY);
            chart
                .configure_mesh()
                .bold_line_style(stroke(GRID, 1.0, 1.0))
                .max_light_lines(0)
                .axis_style(stroke(AXIS, 1.2, 1.0))
                .label_style(font(TEXT))
                .axis_desc_style(font(TEXT))
                .set_all_tick_mark_size(4 * SUB)
                .x_desc(shortened(&clean(&self.x.title), self.canvas_size().0))
                .y_desc(shortened(&clean(&self.y.title), self.canvas_size().1))
                .draw()
                .expect(IN_MEMORY);
            let canvas = Canvas { area: chart.plotting_area(), pixel: self.pixel() };
            if self.empty {
                let middle = ((self.x.low + self.x.high) / 2.0, (self.y.low + self.y.high) / 2.0);
                canvas.text("no data", middle, HPos::Center);
            } else {
                paint(&canvas);
            }
            root.present().expect(IN_MEMORY);
        }
        let (left, right) = (self.left, WIDTH - MARGIN_RIGHT);
        let scales = svg::scale("x", (left, right), &self.x) + &svg::scale("y", (top + self.height, top), &self.y);
        svg::finish(&text, &clean(&self.description), &scales)
    }
}

/// Room that an axis takes at the left.
pub(super) fn left_margin(y: &Axis) -> i32 {
    let longest = y.ticks.iter().map(|(_, text)| text_width(text)).fold(0.0, f64::max);
    let title = if y.title.is_empty() { 0 } else { AXIS_TITLE };
    longest.ceil() as i32 + 14 + title
}

/// What lies between the axes. Positions are in units of the axes, sizes in pixels.
pub(super) struct Canvas<'a, 'b> {
    area: &'a DrawingArea<SVGBackend<'b>, Plane>,
    pub pixel: (f64, f64),
}

impl Canvas<'_, '_> {
    pub fn line(&self, points: Vec<(f64, f64)>, ink: Ink, width: f64, opacity: f64) {
        match points[..] {
            [] => {}
            [point] => self.dot(point, ink, width.max(3.0), opacity),
            _ => self.area.draw(&PathElement::new(points, stroke(ink, width, opacity))).expect(IN_MEMORY),
        }
    }

    pub fn area(&self, outline: Vec<(f64, f64)>, ink: Ink, opacity: f64) {
        if outline.len() > 2 {
            self.area.draw(&Polygon::new(outline, fill(ink, opacity))).expect(IN_MEMORY);
        }
    }

    pub fn bar(&self, corner: (f64, f64), opposite: (f64, f64), ink: Ink, opacity: f64) {
        self.area.draw(&Rectangle::new([corner, opposite], fill(ink, opacity))).expect(IN_MEMORY);
    }

    pub fn dot(&self, at: (f64, f64), ink: Ink, radius: f64, opacity: f64) {
        self.area.draw(&Circle::new(at, sub(radius), fill(ink, opacity))).expect(IN_MEMORY);
    }

    pub fn ring(&self, at: (f64, f64), ink: Ink, radius: f64) {
        self.area.draw(&Circle::new(at, sub(radius), stroke(ink, 2.0, 1.0))).expect(IN_MEMORY);
    }

    pub fn cross(&self, at: (f64, f64), ink: Ink) {
        self.area.draw(&Cross::new(at, sub(4.0), stroke(ink, 1.8, 1.0))).expect(IN_MEMORY);
    }

    pub fn square(&self, (x, y): (f64, f64), ink: Ink) {
        let (dx, dy) = (4.0 * self.pixel.0, 4.0 * self.pixel.1);
        let outline = vec![(x - dx, y - dy), (x + dx, y - dy), (x + dx, y + dy), (x - dx, y + dy), (x - dx, y - dy)];
        self.line(outline, ink, 2.0, 1.0);
    }

    pub fn text(&self, text: &str, at: (f64, f64), side: HPos) {
        let style = font(TEXT).pos(Pos::new(side, VPos::Center));
        self.area.draw(&Text::new(clean(text), at, style)).expect(IN_MEMORY);
    }
}

/// Arranges the legend in rows that fit.
fn legend_rows(legend: &[Key]) -> Vec<Vec<(i32, Key)>> {
    let mut rows: Vec<Vec<(i32, Key)>> = Vec::new();
    let mut x = WIDTH;
    for key in legend {
        let name = shortened(&clean(&key.name), f64::from(WIDTH - LEGEND_SWATCH - 20));
        let width = LEGEND_SWATCH + text_width(&name).ceil() as i32 + 16;
        if x + width > WIDTH {
            rows.push(Vec::new());
            x = 8;
        }
        if let Some(row) = rows.last_mut() {
            row.push((x, Key { name, ..key.clone() }));
        }
        x += width;
    }
    rows
}

fn draw_legend_row(root: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>, keys: &[(i32, Key)], y: i32) {
    let at = |x: i32, dy: i32| (x * SUB, (y + dy) * SUB);
    for (x, key) in keys {
        let x = *x;
        let middle = at(x + 11, 0);
        let swatch = match key.mark {
            Mark::Line { width, opacity } => {
                root.draw(&PathElement::new(vec![at(x, 0), at(x + 22, 0)], stroke(key.ink, width, opacity)))
            }
            Mark::Band => root.draw(&Rectangle::new([at(x, -6), at(x + 22, 6)], fill(key.ink, BAND))),
            Mark::Dot => root.draw(&Circle::new(middle, sub(4.0), fill(key.ink, 1.0))),
            Mark::Ring => root.draw(&Circle::new(middle, sub(5.0), stroke(key.ink, 2.0, 1.0))),
            Mark::Cross => root.draw(&Cross::new(middle, sub(4.5), stroke(key.ink, 1.8, 1.0))),
            Mark::Square => {
                let corners = [(7, -4), (15, -4), (15, 4), (7, 4), (7, -4)];
                root.draw(&PathElement::new(corners.map(|(dx, dy)| at(x + dx, dy)).to_vec(), stroke(key.ink, 2.0, 1.0)))
            }
            Mark::Ellipse => root.draw(&Circle::new(middle, sub(7.0), stroke(key.ink, 1.5, 1.0))),
        };
        swatch.expect(IN_MEMORY);
        let style = font(TEXT).pos(Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(key.name.clone(), at(x + LEGEND_SWATCH, 0), style)).expect(IN_MEMORY);
    }
}

/// Opacity of bands.
pub(super) const BAND: f64 = 0.25;

fn sub(size: f64) -> i32 {
    (size * f64::from(SUB)).round() as i32
}

fn rgb(ink: Ink) -> RGBColor {
    let [_, red, green, blue] = ink.light.to_be_bytes();
    RGBColor(red, green, blue)
}

fn stroke(ink: Ink, width: f64, opacity: f64) -> ShapeStyle {
    rgb(ink).mix(opacity).stroke_width(sub(width) as u32)
}

fn fill(ink: Ink, opacity: f64) -> ShapeStyle {
    rgb(ink).mix(opacity).filled()
}

fn font(ink: Ink) -> TextStyle<'static> {
    // plotters' SVG divides the size of a font by 1.24.
    ("sans-serif", FONT * 1.24 * f64::from(SUB)).into_font().color(&rgb(ink))
}
