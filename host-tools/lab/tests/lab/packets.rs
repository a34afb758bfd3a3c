//! The ship's reports, worked out from a log as the simulated ship worked them out at sea.

use backseat_lab::packet_navigation::{packets, reports};
use backseat_logs::{Column, Log, LogRow};
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
    let ours = reports(&log, &packets(&log), &scenario.settings.ship, scenario.vehicle.sensors.ship_gnss_m);
    assert_eq!(sent.len(), 3);
    assert_eq!(ours.len(), sent.len());
    for (ours, sent) in ours.iter().zip(&sent) {
        let ours = ours.unwrap();
        assert_eq!((ours.position_m, ours.velocity_mps), (sent.position_m, sent.velocity_mps));
        assert_eq!((ours.position_sigma_m, ours.velocity_sigma_mps), (sent.position_sigma_m, sent.velocity_sigma_mps));
    }
}
