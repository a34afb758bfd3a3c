//! Sensors at rest, as a report.

use super::Bench;
use super::channels::Channel;
use crate::provenance;
use backseat_report::plots::{self, Histogram, Scale, XyPlot};
use backseat_report::{Report, Table};
use serde_json::{Map, Value, json};

/// Averaging times shown in a table: the first 1, 4, 16 … intervals of each channel.
const SHOWN: usize = 6;

/// The report of sensors at rest; who writes a vehicle file or a page adds notes of them.
pub fn report(bench: &Bench) -> Report {
    let Bench { log, channels, sensors } = bench;
    let notes: Vec<String> = channels.iter().filter_map(Channel::note).collect();
    let header = ["channel", "readings", "rate [Hz]", "mean", "sigma", "white", "unit"];
    let table = channels.iter().fold(Table::new("Noise by channel", &header), |table, channel| {
        table.row([
            channel.name.to_owned(),
            channel.values.len().to_string(),
            format!("{:.2}", channel.rate_hz),
            format!("{:.5}", channel.mean),
            short(channel.sigma),
            short(channel.white),
            channel.unit.to_owned(),
        ])
    });
    let allan =
        channels.iter().fold(Table::new("Allan deviation", &["channel", "at averaging times"]), |table, channel| {
            let at = |(tau, deviation): &(f64, f64)| format!("{} at {tau:.3} s", short(*deviation));
            let shown: Vec<String> = channel.allan.iter().step_by(2).take(SHOWN).map(at).collect();
            table.row([channel.name.to_owned(), shown.join(", ")])
        });
    let of_file =
        sensors.iter().fold(Table::new("Numbers of the vehicle file", &["number", "sigma"]), |table, sensor| {
            table.row([sensor.key.to_owned(), short(sensor.sigma)])
        });
    let answer = format!("Noise of {} channels at rest: {log}.", channels.len());
    let mut report = provenance::of(Report::new("Sensors at rest", answer), None)
        .values(json(bench, &notes))
        .table(table)
        .table(of_file)
        .table(allan)
        .notes(&notes)
        .on_page();
    for channel in channels {
        let label = format!("{} [{}]", channel.name, channel.unit);
        report = report
            .section(channel.name)
            .figure("Histogram, and the normal density of mean and sigma.", histogram(channel, &label))
            .figure("Allan deviation.", allan_figure(channel, &label));
    }
    report.everywhere()
}

fn histogram(channel: &Channel, label: &str) -> String {
    let normal = Some((channel.mean, channel.sigma));
    plots::histogram(&Histogram { x_label: label, values: &channel.values, normal })
}

fn allan_figure(channel: &Channel, label: &str) -> String {
    // White noise averages out with the root of time.
    let first = channel.allan.first().copied().unwrap_or((1.0, 0.0));
    let white: Vec<(f64, f64)> =
        channel.allan.iter().map(|(tau, _)| (*tau, first.1 * (first.0 / tau).sqrt())).collect();
    plots::xy(&XyPlot {
        x_label: "averaging time [s]",
        y_label: label,
        series: &[("Allan deviation", channel.allan.as_slice()), ("white noise", white.as_slice())],
        reference: None,
        x_scale: Scale::Log,
        y_scale: Scale::Log,
    })
}

/// Three significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        let digits = if value == 0.0 { 0 } else { (2.0 - value.abs().log10().floor()).max(0.0) as usize };
        return format!("{value:.digits$}");
    }
    format!("{value:.2e}")
}

fn json(bench: &Bench, notes: &[String]) -> Value {
    let channels: Vec<Value> = bench
        .channels
        .iter()
        .map(|channel| {
            let allan: Vec<Value> =
                channel.allan.iter().map(|(tau, sigma)| json!({"tau_s": tau, "deviation": sigma})).collect();
            json!({
                "name": channel.name, "unit": channel.unit, "readings": channel.values.len(), "rate_hz": channel.rate_hz,
                "mean": channel.mean, "sigma": channel.sigma, "white": channel.white, "allan": allan,
            })
        })
        .collect();
    let sensors: Map<String, Value> =
        bench.sensors.iter().map(|sensor| (sensor.key.to_owned(), json!(sensor.sigma))).collect();
    json!({"channels": channels, "sensors": sensors, "notes": notes})
}
