//! Histograms and Allan deviations as a page.

use super::channels::{Channel, Sensor};
use super::short;
use backseat_report::plots::{self, Histogram, Scale, XyPlot};
use backseat_report::{Provenance, Report, Table};

pub fn html(log: &str, channels: &[Channel], sensors: &[Sensor]) -> String {
    let verdict = format!("Noise of {} channels at rest.", channels.len());
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
    let of_file =
        sensors.iter().fold(Table::new("Numbers of the vehicle file", &["number", "sigma"]), |table, sensor| {
            table.row([sensor.key.to_owned(), short(sensor.sigma)])
        });
    let mut report = Report::new("Sensors at rest", verdict).text(log).table(table).table(of_file);
    for channel in channels {
        let label = format!("{} [{}]", channel.name, channel.unit);
        let values = &channel.values;
        let histogram = Histogram { x_label: &label, values, normal: Some((channel.mean, channel.sigma)) };
        // White noise averages out with the root of time.
        let first = channel.allan.first().copied().unwrap_or((1.0, 0.0));
        let white: Vec<(f64, f64)> =
            channel.allan.iter().map(|(tau, _)| (*tau, first.1 * (first.0 / tau).sqrt())).collect();
        let allan = XyPlot {
            x_label: "averaging time [s]",
            y_label: &label,
            series: &[("Allan deviation", channel.allan.as_slice()), ("white noise", white.as_slice())],
            reference: None,
            x_scale: Scale::Log,
            y_scale: Scale::Log,
        };
        report = report
            .section(channel.name)
            .figure("Histogram, and the normal density of mean and sigma.", plots::histogram(&histogram))
            .figure("Allan deviation.", plots::xy(&allan));
    }
    let command = backseat_analysis::provenance::command();
    report.provenance(Provenance { command: &command, seed: None, version: env!("CARGO_PKG_VERSION") }).html()
}
