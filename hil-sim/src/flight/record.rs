//! What a flight leaves behind: in memory for scoring, and on disk as it happens.

use crate::observation::{Observation, ObservationKind, ShipReport};
use crate::scenario::{Exchange, Scenario};
use crate::ship::ShipTruth;
use crate::ship_end::ShipEnd;
use crate::truth::{Actuators, VehicleTruth};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::VehicleState;
use backseat_link::ReportedFusion;
use backseat_logs::{Column, DataError, Log, LogRow, LogWriter, TruthRow, TruthWriter};
use backseat_wire::hostlink::{Identification, Mode, ModeReason, Naming, Telemetry};
use std::path::Path;

/// Truth and estimate at one time.
#[derive(Clone, Debug)]
pub struct FlightSample {
    /// The true vehicle.
    pub truth: VehicleTruth,
    /// The true ship.
    pub ship: ShipTruth,
    /// What the backseat reported.
    pub telemetry: Telemetry,
}

/// What a program on the ship knows, beside the truth, at one time.
#[derive(Clone, Copy, Debug)]
pub struct ShipSide {
    /// When, µs.
    pub time_us: u64,
    /// Horizontal error of the ship's own position, m, and the stated sigma per axis.
    pub ship: Option<[f64; 2]>,
    /// Horizontal error of the vehicle's track, m, and its normalised square (mean 2 where the covariance is right).
    pub vehicle: Option<[f64; 2]>,
}

/// The backseat changed its mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModeChange {
    /// When, µs.
    pub time_us: u64,
    /// To this mode.
    pub mode: Mode,
    /// Why.
    pub reason: ModeReason,
}

/// A flight, in memory.
#[derive(Clone, Debug, Default)]
pub struct FlightLog {
    /// The measurements as a vehicle log, before any device rounded them.
    pub log: Log,
    /// Once a second.
    pub samples: Vec<FlightSample>,
    /// What the backseat fused.
    pub fusions: Vec<ReportedFusion>,
    /// What the backseat identified.
    pub identifications: Vec<Identification>,
    /// What the backseat named.
    pub naming: Vec<Naming>,
    /// Vehicle and ship (north, east) at each packet's arrival and launch, m.
    pub packets: Vec<([f64; 2], [f64; 2])>,
    /// Once a second, if there was a program on the ship.
    pub ship_side: Vec<ShipSide>,
    /// Mode changes.
    pub modes: Vec<ModeChange>,
    /// The backseat's running digest after the last step.
    pub digest: u64,
    /// In real time: steps of the backseat that came a whole step late or more.
    pub late_steps: u32,
    /// By how much the latest of them was, s.
    pub latest_step_s: f64,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Time taken, s.
    pub wall_s: f64,
    /// The mission was flown to its end.
    pub finished: bool,
}

/// Streams log and truth to disk, so that what an interrupted flight leaves is readable.
struct Files {
    log: LogWriter,
    truth: TruthWriter,
}

/// Takes down a flight.
pub(super) struct Recorder {
    pub(super) flight: FlightLog,
    files: Option<Files>,
    targets: Option<Actuators>,
    /// Rows to which earlier ones may still come, in order of time.
    rows: Vec<LogRow>,
}

impl Recorder {
    /// Writes `log.csv` and `truth.csv` into `folder`, if given.
    pub(super) fn new(scenario: &Scenario, folder: Option<&Path>) -> Result<Self, DataError> {
        let slots = &scenario.settings.acoustics.slots;
        let both_ways = [(Exchange::TwoWay, Column::TwoWayRange), (Exchange::Uplink, Column::UplinkRange)];
        let both_ways = both_ways
            .into_iter()
            .filter(|(exchange, _)| slots.iter().any(|slot| slot.exchange == *exchange && slot.companion.is_none()));
        let columns: Vec<Column> =
            Column::STANDARD.iter().copied().chain(both_ways.map(|(_, column)| column)).collect();
        let files = folder
            .map(|folder| {
                Ok::<_, DataError>(Files {
                    log: LogWriter::with_columns(&folder.join("log.csv"), &columns)?,
                    truth: TruthWriter::create(&folder.join("truth.csv"))?,
                })
            })
            .transpose()?;
        let mut flight = FlightLog::default();
        flight.log.path = folder.map_or_else(|| "the flight's log".into(), |folder| folder.join("log.csv"));
        Ok(Self { flight, files, targets: None, rows: Vec::new() })
    }

    /// Devices act between two observations: rows come a little out of order.
    fn row(&mut self, row: LogRow) {
        let place = self.rows.partition_point(|earlier| earlier.time_us <= row.time_us);
        self.rows.insert(place, row);
    }

    /// Nothing will be observed any more up to this time, µs: the rows up to there are complete.
    pub(super) fn complete_to(&mut self, time_us: u64) -> Result<(), DataError> {
        let complete = self.rows.partition_point(|row| row.time_us <= time_us);
        for row in self.rows.drain(..complete) {
            if let Some(files) = &mut self.files {
                files.log.write(&row)?;
            }
            self.flight.log.rows.push(row);
        }
        Ok(())
    }

    pub(super) fn observe(&mut self, observation: &Observation, vehicle: &VehicleTruth) {
        let mut row = LogRow::new(observation.time_us);
        match &observation.kind {
            ObservationKind::Downlink(packet) if packet.ship == ShipReport::NONE => return,
            ObservationKind::Uplink(packet) => {
                packet.log(row.set(Column::UplinkRange, packet.range_m));
            }
            ObservationKind::TwoWay(ping) => {
                row.set(Column::TwoWayRange, ping.range_m)
                    .set(Column::Tol, ping.tol_us as f64 * 1e-6)
                    .set(Column::Toa, observation.time_us as f64 * 1e-6);
            }
            kind => {
                if !kind.log(|| &mut row) {
                    return;
                }
            }
        }
        if let ObservationKind::Downlink(packet) = &observation.kind {
            let [x, y, ..] = vehicle.state;
            self.flight.packets.push(([x, y], packet.ship.position_m));
        }
        self.row(row);
    }

    /// Fins and propeller as commanded from `time_us` on; whether that is new.
    pub(super) fn actuators(&mut self, time_us: u64, targets: Actuators) -> bool {
        if self.targets == Some(targets) {
            return false;
        }
        self.targets = Some(targets);
        let input = ActuatorInput { propeller_radps: targets.propeller_radps, fins_rad: targets.fins_rad };
        let mut row = LogRow::new(time_us);
        row.set_actuators(&input);
        self.row(row);
        true
    }

    /// Once a second.
    pub(super) fn sample(&mut self, sample: FlightSample) -> Result<(), DataError> {
        let truth = &sample.truth;
        if let Some(files) = &mut self.files {
            files.truth.write(&TruthRow {
                time_us: truth.time_us,
                state: VehicleState::from_column_slice(&truth.state),
                current_mps: truth.current_mps,
            })?;
        }
        let Telemetry { mode, reason, .. } = sample.telemetry;
        if self.flight.modes.last().is_none_or(|last| (last.mode, last.reason) != (mode, reason)) {
            self.flight.modes.push(ModeChange { time_us: truth.time_us, mode, reason });
        }
        self.flight.samples.push(sample);
        Ok(())
    }

    /// Once a second: how good is what the ship knows?
    pub(super) fn ship_side(
        &mut self,
        scenario: &Scenario,
        time_us: u64,
        end: Option<&ShipEnd>,
        vehicle: &VehicleTruth,
        ship: &ShipTruth,
    ) {
        let utc_us = u64::from(scenario.settings.environment.start_unix_s) * 1_000_000 + time_us;
        let address = scenario.settings.acoustics.address;
        let Some(known) = end.and_then(|end| end.program().knows(utc_us, address)) else { return };
        let ship = known.ship.map(|estimate| {
            let [n, e] = [0, 1].map(|i| estimate.position_m[i] - ship.position_m[i]);
            [libm::hypot(n, e), estimate.sigma_m()]
        });
        let vehicle = known.vehicle.map(|estimate| {
            // its transducer: where the uplink says it is
            let [x, y, _] = vehicle.position_at(scenario.settings.installation.transducer_arm_m);
            let [n, e] = [estimate.position_m[0] - x, estimate.position_m[1] - y];
            let [a, b, c] = estimate.covariance_m2;
            [libm::hypot(n, e), (b * n * n - 2.0 * c * n * e + a * e * e) / (a * b - c * c)]
        });
        self.flight.ship_side.push(ShipSide { time_us, ship, vehicle });
    }

    pub(super) fn finish(mut self) -> Result<FlightLog, DataError> {
        self.complete_to(u64::MAX)?;
        if let Some(files) = self.files {
            files.log.finish()?;
            files.truth.finish()?;
        }
        Ok(self.flight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stay_in_order_when_a_packet_is_observed_after_a_later_command() {
        let mut recorder = Recorder::new(&Scenario::built_in("survey").unwrap(), None).unwrap();
        recorder.row(LogRow::new(100));
        recorder.row(LogRow::new(118));
        recorder.complete_to(110).unwrap();
        recorder.row(LogRow::new(112));
        recorder.complete_to(120).unwrap();
        recorder.row(LogRow::new(130));
        let times: Vec<u64> = recorder.finish().unwrap().log.rows.iter().map(|row| row.time_us).collect();
        assert_eq!(times, [100, 112, 118, 130]);
    }
}
