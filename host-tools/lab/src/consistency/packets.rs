//! The ship's reports, worked out from a log as the simulated ship worked them out at sea.

use backseat_core::navigation::ShipReport;
use backseat_logs::{Column, Log};
use hil_sim::scenario;
use hil_sim::ship::ShipEstimator;

/// Times of launch, µs, of the packets of a log that were launched after its start. Only the log of a simulator is that
/// plain: the row stands at the time of arrival.
pub(super) fn launches(log: &Log) -> Vec<u64> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let packets = log.rows.iter().filter(|row| row.get(Column::Range).is_some());
    packets.filter_map(|row| row.launch_us().filter(|launch_us| *launch_us >= start_us)).collect()
}

/// The simulated ship's report of its own state in each packet, from its fixes (before the payload's rounding).
pub(super) fn reports(
    log: &Log,
    launches_us: &[u64],
    ship: &scenario::Ship,
    fix_sigma_m: f64,
) -> Vec<Option<ShipReport>> {
    let seconds = |time_us: u64| time_us as f64 * 1e-6;
    let mut estimator = ShipEstimator::new(ship, fix_sigma_m);
    let mut fixes = log.rows.iter().filter_map(|row| Some((row.time_us, row.ship_gnss_m()?))).peekable();
    let mut report = |launch_us: &u64| {
        while let Some((time_us, position_m)) = fixes.next_if(|(time_us, _)| time_us <= launch_us) {
            estimator.fix(seconds(time_us), position_m);
        }
        estimator.report(seconds(*launch_us)).map(|report| ShipReport {
            position_m: report.position_m,
            velocity_mps: report.velocity_mps,
            position_sigma_m: report.position_sigma_m,
            velocity_sigma_mps: report.velocity_sigma_mps,
        })
    };
    launches_us.iter().map(&mut report).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::LogRow;
    use hil_sim::observation::ObservationKind;
    use hil_sim::scenario::Scenario;
    use hil_sim::world::World;

    #[test]
    fn packets_of_the_simulator_are_reproduced_from_its_log() {
        let scenario = Scenario::built_in("survey").unwrap();
        let (mut log, mut sent) = (Log::default(), Vec::new());
        World::new(&scenario).advance(130_000_000, &mut |observation| {
            let mut row = LogRow::new(observation.time_us);
            match &observation.kind {
                ObservationKind::ShipGnss { position_m } => row.set_all(Column::ShipGpsX, position_m),
                ObservationKind::Downlink(packet) => {
                    sent.push(packet.ship);
                    row.set(Column::Tol, packet.tol_us as f64 * 1e-6).set(Column::Range, packet.range_m)
                }
                _ => return,
            };
            log.rows.push(row);
        });
        let ours = reports(&log, &launches(&log), &scenario.settings.ship, scenario.vehicle.sensors.ship_gnss_m);
        assert_eq!(sent.len(), 3);
        assert_eq!(ours.len(), sent.len());
        for (ours, sent) in ours.iter().zip(&sent) {
            let ours = ours.unwrap();
            assert_eq!((ours.position_m, ours.velocity_mps), (sent.position_m, sent.velocity_mps));
            assert_eq!(
                (ours.position_sigma_m, ours.velocity_sigma_mps),
                (sent.position_sigma_m, sent.velocity_sigma_mps)
            );
        }
    }
}
