//! The flight filter fed by packets, as on the board.

use super::packets::Packet;
use anyhow::anyhow;
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::{
    AcousticPath, InitialState, Measurement, NavigationConfig, Navigator, ShipEnd, ShipReport, VehicleEnd,
};
use backseat_core::state::{VehicleState, X, Y};
use backseat_estimation::filter::TrackSample;
use backseat_logs::{Column, Log, LogRow};
use hil_sim::scenario;
use hil_sim::ship::ShipEstimator;

/// The simulated ship's report of its own state in each packet, from these fixes (before the payload's rounding).
#[must_use]
pub fn reports(log: &Log, packets: &[Packet], ship: &scenario::Ship, fix_sigma_m: f64) -> Vec<Option<ShipReport>> {
    let seconds = |time_us: u64| time_us as f64 * 1e-6;
    let mut estimator = ShipEstimator::new(ship, fix_sigma_m);
    let mut fixes = log.rows.iter().filter_map(|row| Some((row.time_us, row.ship_gnss_m()?))).peekable();
    let mut report = |packet: &Packet| {
        while let Some((time_us, position_m)) = fixes.next_if(|(time_us, _)| *time_us <= packet.launch_us) {
            estimator.fix(seconds(time_us), position_m);
        }
        estimator.report(seconds(packet.launch_us)).map(|report| ShipReport {
            position_m: report.position_m,
            velocity_mps: report.velocity_mps,
            position_sigma_m: report.position_sigma_m,
            velocity_sigma_mps: report.velocity_sigma_mps,
        })
    };
    packets.iter().map(&mut report).collect()
}

/// The flight filter, each packet's ship state taken as independent.
pub struct PacketFed {
    navigator: Box<Navigator>,
    use_range_rate: bool,
}

impl PacketFed {
    /// From a prior at a time, µs.
    ///
    /// # Errors
    /// A configuration or prior that the filter refuses.
    pub fn new(
        time_us: u64,
        initial: &InitialState,
        config: &NavigationConfig,
        model: &VehicleModel,
        use_range_rate: bool,
    ) -> anyhow::Result<Self> {
        let mut navigator = Box::new(Navigator::new());
        navigator.configure(config, model).map_err(|error| anyhow!("{error:?}"))?;
        navigator.initialise(time_us, initial).map_err(|error| anyhow!("{error:?}"))?;
        Ok(Self { navigator, use_range_rate })
    }

    fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> anyhow::Result<()> {
        self.navigator.predict(to_us, input).map_err(|error| anyhow!("{error:?}"))
    }

    fn fuse(&mut self, row: &LogRow) {
        let measurements = [
            row.get(Column::Depth).map(|z_m| Measurement::Depth { z_m }),
            row.attitude_rad().map(|euler_rad| Measurement::Attitude { euler_rad }),
            row.rates_radps().map(|rates_radps| Measurement::Rates { rates_radps }),
            row.gnss_m().map(|position_m| Measurement::VehicleGnss { position_m }),
        ];
        for measurement in measurements.iter().flatten() {
            self.navigator.fuse(measurement);
        }
    }

    fn arrive(&mut self, report: ShipReport, row: &LogRow) {
        let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(report) };
        if let Some(range_m) = row.get(Column::Range) {
            self.navigator.fuse(&Measurement::Range { path, range_m });
        }
        if let Some(range_rate_mps) = row.get(Column::RangeRate).filter(|_| self.use_range_rate) {
            self.navigator.fuse(&Measurement::RangeRate { path, range_rate_mps });
        }
    }

    fn sample(&self) -> TrackSample {
        let navigator = &self.navigator;
        TrackSample {
            time_us: navigator.time_us(),
            state: *navigator.state(),
            sigma: VehicleState::from_fn(|i, _| navigator.variance(i).sqrt()),
            cov_xy_m2: navigator.covariance(X, Y),
            current_mps: navigator.current(),
        }
    }
}

/// Leads the filter through a log, in the order of [`backseat_estimation::filter`]; the estimate at every row time.
///
/// # Errors
/// The filter has failed.
pub fn track(
    log: &Log,
    packets: &[Packet],
    reports: &[Option<ShipReport>],
    mut filter: PacketFed,
) -> anyhow::Result<Vec<TrackSample>> {
    let mut input = ActuatorInput::default();
    let mut launches = packets.iter().map(|packet| packet.launch_us).peekable();
    let mut arrivals = packets.iter().zip(reports).peekable();
    let mut track = Vec::with_capacity(log.rows.len());
    let mut first = 0;
    for instant in log.rows.chunk_by(|a, b| a.time_us == b.time_us) {
        let time_us = instant[0].time_us;
        // The centralized filter stops at each launch for its clone.
        while let Some(launch_us) = launches.next_if(|launch_us| *launch_us <= time_us) {
            filter.predict(launch_us, &input)?;
        }
        filter.predict(time_us, &input)?;
        for row in instant {
            filter.fuse(row);
            input = row.actuators().unwrap_or(input);
        }
        let next = first + instant.len();
        while let Some((packet, report)) = arrivals.next_if(|(packet, _)| packet.row < next) {
            report.iter().for_each(|report| filter.arrive(*report, &log.rows[packet.row]));
        }
        first = next;
        track.push(filter.sample());
    }
    Ok(track)
}
