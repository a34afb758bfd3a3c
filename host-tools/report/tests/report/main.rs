//! The report's structure. What it looks like: open `report-sample.html`, which `sample_report_is_whole` leaves in
//! Cargo's `tmp` folder.

#[path = "../../../../firmware/tests/random.rs"]
mod random;
mod sample;

use std::fs;
use std::path::Path;

use backseat_report::{Provenance, Report, Table, plots};
use plots::{
    Bar, BarPlot, BeforeAfter, Ellipse, ErrorPlot, Histogram, Innovation, InnovationPlot, Scale, TimePlot, TrackPlot,
};
use roxmltree::{Document, ParsingOptions};

fn parse(xml: &str) -> Document<'_> {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    Document::parse_with_options(xml, options).expect("well-formed")
}

/// Every plot of the same numbers, in all of their roles.
fn all_plots(points: &[(f64, f64)], name: &str) -> Vec<String> {
    let series = [(name, points), ("other", points)];
    let ellipses: Vec<_> =
        points.iter().map(|(a, b)| Ellipse { x_m: *a, y_m: *b, xx_m2: *a, xy_m2: *b, yy_m2: *a }).collect();
    let paths: Vec<_> = points.iter().map(|p| (*p, (p.1, p.0))).collect();
    let innovations: Vec<_> = points
        .iter()
        .enumerate()
        .map(|(i, (t_h, value))| Innovation { t_h: *t_h, value: *value, sigma: *value, fused: i % 2 == 0 })
        .collect();
    let band: Vec<_> = points.iter().map(|(t, v)| (*t, *v, v + 1.0)).collect();
    let values: Vec<_> = points.iter().map(|p| p.1).collect();
    let rows: Vec<_> = points.iter().take(60).map(|(a, b)| (name, *a, *b)).collect();
    let bars: Vec<_> = points.iter().take(60).map(|(a, b)| Bar { name, value: *a, interval: Some((*b, *a)) }).collect();
    let mut all = vec![
        plots::track(&TrackPlot {
            truth: Some(points),
            estimates: &series,
            ellipses: &ellipses,
            acoustic_paths: &paths,
            ship: Some(points),
            waypoints: points,
        }),
        plots::time_series(&TimePlot { y_label: name, series: &series, band: Some((name, &band)) }),
        plots::innovations(&InnovationPlot { y_label: name, innovations: &innovations }),
        plots::histogram(&Histogram { x_label: name, values: &values, normal: values.first().map(|v| (*v, *v)) }),
        plots::bars(&BarPlot { x_label: name, bars: &bars, reference: points.first().map(|p| (name, p.0)) }),
    ];
    for scale in [Scale::Linear, Scale::Log] {
        all.push(plots::error_vs_time(&ErrorPlot {
            y_label: name,
            series: &series,
            bound: Some((name, points)),
            scale,
        }));
        all.push(plots::before_after(&BeforeAfter { x_label: name, rows: &rows, scale }));
    }
    all
}

#[test]
fn sample_report_is_whole() {
    let html = sample::report().html();
    let page = parse(&html);
    let count = |tag: &str| {
        page.descendants()
            .filter(|node| node.has_tag_name(tag) || node.has_tag_name(("http://www.w3.org/2000/svg", tag)))
            .count()
    };
    assert_eq!(count("figure"), count("svg"));
    assert_eq!(count("figcaption"), count("figure"));
    assert!(count("table") >= 1);
    let text: String = page.descendants().filter(|n| n.is_text()).filter_map(|n| n.text()).collect();
    for part in ["hil-sim run --seed 7", "0.1.0", "median [m]", "true track", "95 % ellipse"] {
        assert!(text.contains(part), "{part} is missing");
    }
    // The first table stands before the first figure.
    assert!(html.find("<table").unwrap() < html.find("<figure").unwrap());
    // A hundred thousand points in each line, and still a page that opens at once.
    assert!(html.len() < 1_500_000, "{} bytes", html.len());
    fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-sample.html"), &html).unwrap();
}

#[test]
fn page_needs_nothing_from_elsewhere() {
    let html = sample::report().html().replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for reference in ["http:", "https:", "src=", "href=", "url(", "@import", "<link"] {
        assert!(!html.contains(reference), "{reference}");
    }
}

#[test]
fn same_input_gives_the_same_bytes() {
    assert_eq!(sample::report().html(), sample::report().html());
}

#[test]
fn every_colour_of_a_plot_has_a_partner_in_the_dark_theme() {
    let html = sample::report().html();
    for colour in parse(&html).descendants().flat_map(|n| [n.attribute("fill"), n.attribute("stroke")]).flatten() {
        assert!(colour == "none" || html.contains(&format!("[fill=\"{colour}\"]")), "{colour}");
    }
}

#[test]
fn text_is_escaped_everywhere() {
    let nasty = "<b onclick=\"x\">&'\u{0}\u{1b}";
    let mut report = Report::new(nasty, nasty)
        .section(nasty)
        .text(nasty)
        .table(Table::new(nasty, &[nasty]).row([nasty]))
        .provenance(Provenance { command: nasty, seed: Some(1), version: nasty });
    for svg in all_plots(&[(1.0, 2.0), (3.0, 4.0), (5.0, 1.0)], nasty) {
        report = report.figure(nasty, svg);
    }
    let html = report.html();
    assert!(parse(&html).descendants().all(|node| !node.has_tag_name("b")));
    assert!(!html.contains(['\u{0}', '\u{1b}']));
}

#[test]
fn odd_input_draws_a_frame() {
    let nan = f64::NAN;
    let cases: [&[(f64, f64)]; 12] = [
        &[],
        &[(nan, nan)],
        &[(0.0, nan), (nan, 0.0), (f64::INFINITY, 1.0)],
        &[(1.0, 2.0)],
        &[(0.0, 0.0)],
        &[(1.0, 1.0), (1.0, 1.0), (1.0, 1.0)],
        &[(0.0, 1.0), (nan, nan), (1.0, 2.0)],
        &[(-1e300, 1e300), (1e300, -1e300)],
        &[(1e99, -1e99), (-1e99, 1e99)],
        &[(5e-324, 5e-324), (1e-300, -1e-300)],
        &[(1e9, 1e9), (1e9 + 1e-7, 1e9 + 1e-7)],
        &[(3.0, -1.0), (1.0, -2.0), (2.0, 0.0)],
    ];
    for points in cases {
        for svg in all_plots(points, "name") {
            let root = parse(&svg);
            assert!(root.root_element().attribute("viewBox").is_some());
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}: {svg}");
        }
    }
    for svg in all_plots(&[], "name").iter().chain(&all_plots(&[(nan, nan)], "name")) {
        assert!(svg.contains("no data"), "{svg}");
    }
}

#[test]
fn hundred_thousand_points_stay_small() {
    // Noise is the worst case: nothing of it can be left out without being seen.
    let mut noise = random::Random(3);
    let points: Vec<_> = (0..100_000).map(|i| (f64::from(i) / 36_000.0, noise.normal())).collect();
    for svg in all_plots(&points[..], "noise").iter().take(4) {
        assert!(svg.len() < 200_000, "{} bytes", svg.len());
    }
}

#[test]
fn spikes_survive_decimation() {
    let mut points: Vec<_> = (0..100_000).map(|i| (f64::from(i) / 36_000.0, 1.0)).collect();
    points[61_803].1 = 9.0;
    let svg = plots::time_series(&TimePlot { y_label: "value [m]", series: &[("line", &points)], band: None });
    let page = parse(&svg);
    let line = page.descendants().filter_map(|n| n.attribute("points")).max_by_key(|p| p.len()).unwrap();
    let heights: Vec<i32> = line.split_whitespace().filter_map(|p| p.split_once(',')?.1.parse().ok()).collect();
    // In quarter pixels the spike spans most of the canvas of 270 pixels.
    assert!(heights.iter().max().unwrap() - heights.iter().min().unwrap() > 800);
}

#[test]
fn north_is_up_and_both_axes_have_one_scale() {
    // 300 m to the north, then 200 m to the east.
    let line = [(0.0, 0.0), (300.0, 0.0), (300.0, 200.0)];
    let svg = plots::track(&TrackPlot { estimates: &[("estimate", &line)], ..TrackPlot::default() });
    let page = parse(&svg);
    let drawn =
        page.descendants().filter_map(|n| n.attribute("points")).find(|p| p.split_whitespace().count() == 3).unwrap();
    let p: Vec<(f64, f64)> = drawn
        .split_whitespace()
        .filter_map(|p| p.split_once(','))
        .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
        .collect();
    let up = p[0].1 - p[1].1;
    let right = p[2].0 - p[1].0;
    assert!(up > 0.0 && right > 0.0);
    // Rounded to quarter pixels and to a whole height of the frame.
    assert!((up / 300.0 / (right / 200.0) - 1.0).abs() < 0.01, "{up} {right}");
}

#[test]
fn earlier_results_are_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    let report = Report::new("title", "verdict");
    report.write(&path).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), report.html());
    assert_eq!(report.write(&path).unwrap_err().kind(), std::io::ErrorKind::AlreadyExists);
}

/// Three plots in two columns: each whole, inside the picture and clear of the others.
#[test]
fn a_sheet_paints_over_none_of_its_plots() {
    let points: Vec<(f64, f64)> = (0..50).map(|i| (f64::from(i), f64::from(i % 7))).collect();
    let plots = all_plots(&points, "name");
    let picture = plots::sheet(&[&plots[..1], &plots[1..3]]);
    let document = parse(&picture);
    let root = document.root_element();
    let number = |node: &roxmltree::Node<'_, '_>, name: &str| node.attribute(name).unwrap().parse::<i32>().unwrap();
    let places: Vec<[i32; 4]> = root
        .children()
        .filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "svg")))
        .map(|node| {
            let [x, y, width, height] = ["x", "y", "width", "height"].map(|name| number(&node, name));
            assert_eq!(node.attribute("viewBox").unwrap(), format!("0 0 {width} {height}"));
            [x, y, x + width, y + height]
        })
        .collect();
    assert_eq!(places.len(), 3);
    let view: Vec<i32> = root.attribute("viewBox").unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
    for (i, a) in places.iter().enumerate() {
        assert!(a[0] >= 0 && a[1] >= 0 && a[2] <= view[2] && a[3] <= view[3], "{a:?} in {view:?}");
        for b in &places[i + 1..] {
            assert!(a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1], "{a:?} over {b:?}");
        }
    }
}
