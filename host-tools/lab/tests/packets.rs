//! The decentralized information filter against the centralized filter, on `nav_mini_run.csv` (provenance:
//! `firmware/core/tests/data/README.md`): 300 s, eight packets, no DVL, dynamic model, range and range rate.

use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::navigation::{
    AcousticPath, InitialShip, InitialState, Measurement, Navigator, ProcessModel, ShipEnd, VehicleEnd,
};
use backseat_core::state::{PSI, VehicleState, wrap_angle};
use backseat_estimation::filter::{self, FilterOptions, Start};
use backseat_lab::packet_navigation::{
    Deif, DeifError, DeifRun, Delta, OWN, Packet, PacketArrival, deltas, lose, packets, reports, walk,
};
use backseat_logs::{Column, Log, LogRow, VehicleFile};
use hil_sim::observation::ObservationKind;
use hil_sim::scenario::Scenario;
use hil_sim::world::World;
use nalgebra::{SMatrix, SVector};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn vectors(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/core/tests/data").join(name)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The log, and the start that `init_note` of the vectors describes; nothing is gated.
fn mini_run(model: ProcessModel, with_current: bool) -> (Log, FilterOptions) {
    let log = Log::read(&vectors("nav_mini_run.csv")).unwrap();
    let text = std::fs::read_to_string(vectors("nav_vectors.json")).unwrap();
    let mini = &serde_json::from_str::<Value>(&text).unwrap()["mini_run"];
    let fixes: Vec<[f64; 2]> = log.rows.iter().filter_map(|row| row.ship_gnss_m()).take(6).collect();
    let velocity = [0, 1].map(|axis: usize| (fixes[5][axis] - fixes[0][axis]) / 5.0);
    let mut options = FilterOptions::new(&VehicleFile::reference(), model);
    options.use_dvl = false;
    options.track_interval_us = 0;
    options.navigation.gate_sigma = 1e3;
    options.navigation.range_curvature = 1e6; // the information filter is of first order
    if with_current {
        options.navigation.effect_states = FilterOptions::water_current();
    }
    options.start = Some(Start {
        vehicle: InitialState {
            state: VehicleState::from_column_slice(&numbers(&mini["init_x"])),
            sigma: VehicleState::from_column_slice(&numbers(&mini["init_sd"])),
        },
        ship: Some(InitialShip {
            state: [fixes[0][0], fixes[0][1], 0.0, velocity[0], velocity[1], 0.0],
            sigma: [0.5, 0.5, 0.1, 0.15, 0.15, 0.01],
        }),
    });
    (log, options)
}

fn model() -> VehicleModel {
    VehicleModel::new(&VehicleParameters::IVER3).unwrap()
}

/// The centralized filter's mean and covariance of vehicle and current at each arrival.
fn centralized_arrivals(log: &Log, options: &FilterOptions) -> Vec<PacketArrival> {
    let start = options.start.unwrap();
    let mut navigator = Box::new(Navigator::new());
    navigator.configure(&options.navigation, &model()).unwrap();
    navigator.initialise(0, &start.vehicle).unwrap();
    navigator.initialise_ship(&start.ship.unwrap()).unwrap();
    let launches = packets(log);
    let (mut input, mut clone, mut arrivals) = (ActuatorInput::default(), None, Vec::new());
    // In this log no two rows share a time, and every launch has a row.
    for row in &log.rows {
        navigator.predict(row.time_us, &input).unwrap();
        input = row.actuators().unwrap_or(input);
        let mut measurements = Vec::new();
        measurements.extend(row.get(Column::Depth).map(|z_m| Measurement::Depth { z_m }));
        measurements.extend(row.attitude_rad().map(|euler_rad| Measurement::Attitude { euler_rad }));
        measurements.extend(row.rates_radps().map(|rates_radps| Measurement::Rates { rates_radps }));
        measurements.extend(row.ship_gnss_m().map(|position_m| Measurement::ShipGnss { position_m }));
        measurements.extend(row.gnss_m().map(|position_m| Measurement::VehicleGnss { position_m }));
        if let Some(range_m) = row.get(Column::Range) {
            let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Delayed(clone.unwrap()) };
            measurements.push(Measurement::Range { path, range_m });
            let range_rate_mps = row.get(Column::RangeRate).unwrap();
            measurements.push(Measurement::RangeRate { path, range_rate_mps });
        }
        for measurement in &measurements {
            navigator.fuse(measurement);
        }
        if row.get(Column::Range).is_some() {
            navigator.drop_clone(clone.take().unwrap());
            let n = navigator.main().dimension() - 6;
            // Where no current is estimated the information filter has zero with unit variance.
            let own = |i: usize| i < n.min(OWN);
            let mean = SVector::<f64, OWN>::from_fn(|i, _| if own(i) { navigator.state_at(i) } else { 0.0 });
            let covariance = SMatrix::<f64, OWN, OWN>::from_fn(|i, j| match (own(i) && own(j), i == j) {
                (true, _) => navigator.covariance(i, j),
                (false, diagonal) => f64::from(u8::from(diagonal)),
            });
            arrivals.push(PacketArrival { time_us: row.time_us, moments: (mean, covariance) });
        }
        if launches.iter().any(|packet| packet.launch_us == row.time_us) {
            clone = Some(navigator.clone_ship().unwrap());
        }
    }
    arrivals
}

/// Worst difference of a mean in units of its sigma, and of a covariance as a correlation.
fn worst(ours: &[PacketArrival], theirs: &[PacketArrival]) -> [f64; 2] {
    assert_eq!(ours.len(), theirs.len());
    let mut worst = [0.0_f64; 2];
    for (a, b) in ours.iter().zip(theirs) {
        assert_eq!(a.time_us, b.time_us);
        let ((x, p), (x_ref, p_ref)) = (&a.moments, &b.moments);
        for i in 0..OWN {
            let difference = x[i] - x_ref[i];
            let difference = if i == PSI { wrap_angle(difference) } else { difference };
            worst[0] = worst[0].max(difference.abs() / p_ref[(i, i)].sqrt());
            for j in 0..OWN {
                let scale = (p_ref[(i, i)] * p_ref[(j, j)]).sqrt();
                worst[1] = worst[1].max((p[(i, j)] - p_ref[(i, j)]).abs() / scale);
            }
        }
    }
    worst
}

struct Case {
    name: &'static str,
    model: ProcessModel,
    with_current: bool,
    /// Packets, counted from the first, that nobody receives.
    lost: &'static [usize],
}

/// Both filters over the mini run, the information filter at the centralized filter's linearisation
/// points or at its own; worst differences and number of arrivals.
fn compare(case: &Case, same_points: bool, change: impl Fn(&Delta) -> Delta) -> ([f64; 2], usize) {
    let (log, options) = mini_run(case.model, case.with_current);
    let launches = packets(&log);
    let lost: Vec<Packet> = case.lost.iter().map(|&index| launches[index]).collect();
    let log = lose(&log, &lost);
    let received = packets(&log);
    let start = options.start.unwrap();
    let run = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    let deltas = deltas(&log, start.ship.as_ref(), &options.navigation, &launches, &received).unwrap();
    let deltas: Vec<Delta> = deltas.iter().map(change).collect();
    let deif = Deif::new(0, &start.vehicle, &options.navigation, &model());
    let mut deif = DeifRun::new(deif, &deltas, same_points.then_some(&run.track[..]), true);
    walk(&log, &received, &mut deif).unwrap();
    (worst(&deif.arrivals, &centralized_arrivals(&log, &options)), deif.arrivals.len())
}

const DYNAMIC: [Case; 4] = [
    Case { name: "still water", model: ProcessModel::Dynamic, with_current: false, lost: &[] },
    Case { name: "current states", model: ProcessModel::Dynamic, with_current: true, lost: &[] },
    Case { name: "third, sixth lost", model: ProcessModel::Dynamic, with_current: false, lost: &[2, 5] },
    Case { name: "current, first two, fifth lost", model: ProcessModel::Dynamic, with_current: true, lost: &[0, 1, 4] },
];

#[test]
fn val_information_filter_equals_centralized_filter_at_each_arrival() {
    for case in &DYNAMIC {
        let ([mean, covariance], arrivals) = compare(case, true, |delta| *delta);
        assert_eq!(arrivals, 8 - case.lost.len());
        // Not rounding but the flight filter's discretisation, whose series and quadrature end early; the
        // information filter's do not. Measured 1.3e-8 and 3e-7. The next test is free of that.
        assert!(mean < 1e-7 && covariance < 1e-6, "{}: {mean:e} {covariance:e}", case.name);
    }
}

#[test]
fn val_equal_to_rounding_where_both_discretise_exactly() {
    for case in &DYNAMIC {
        let case = Case { model: ProcessModel::Kinematic, ..*case };
        let ([mean, covariance], _) = compare(&case, true, |delta| *delta);
        // Rounding of some 4000 steps, measured 1e-10 and 2e-11.
        assert!(mean < 1e-9 && covariance < 1e-9, "{}: {mean:e} {covariance:e}", case.name);
    }
}

#[test]
fn own_linearisation_points_differ_in_second_order() {
    for case in &DYNAMIC {
        let ([mean, covariance], _) = compare(case, false, |delta| *delta);
        // Between arrivals the centralized filter follows the ship's fixes, by far less than a sigma of any state
        // that the model's Jacobian depends on: what that leaves is of second order, yet far above rounding.
        assert!((1e-7..1e-3).contains(&mean) && covariance < 1e-4, "{}: {mean:e} {covariance:e}", case.name);
    }
}

#[test]
fn thirty_two_bits_are_enough() {
    let ([mean, covariance], _) = compare(&DYNAMIC[0], true, Delta::rounded);
    // 24 bits of coordinates of 1.2 km are 0.07 mm, against sigmas from 0.2 m; the information itself is good to
    // 6e-8, less than what the discretisations differ by.
    assert!((1e-7..1e-3).contains(&mean) && covariance < 1e-6, "{mean:e} {covariance:e}");
}

#[test]
fn a_delta_that_continues_from_a_lost_packet_is_refused() {
    let (log, options) = mini_run(ProcessModel::Dynamic, false);
    let start = options.start.unwrap();
    let launches = packets(&log);
    // The ship believes that all were received.
    let deltas = deltas(&log, start.ship.as_ref(), &options.navigation, &launches, &launches).unwrap();
    let mut deif = Deif::new(0, &start.vehicle, &options.navigation, &model());
    assert_eq!(deif.receive(&deltas[1]), Err(DeifError::OtherOrigin));
    deif.receive(&deltas[0]).unwrap();
    let before = deif.moments().unwrap();
    assert_eq!(deif.receive(&deltas[2]), Err(DeifError::OtherOrigin));
    assert_eq!(deif.receive(&deltas[0]), Err(DeifError::OtherOrigin));
    assert_eq!(deif.moments().unwrap(), before);
    deif.receive(&deltas[1]).unwrap();
}

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
