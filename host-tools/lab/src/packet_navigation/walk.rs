//! A vehicle log in order of time, as vehicle and ship process it.

use super::deif::{Deif, DeifError, Moments};
use super::information::NotPositive;
use super::ship::{Delta, ShipInformation};
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::{InitialShip, NavigationConfig};
use backseat_core::state::{VehicleState, X, Y};
use backseat_estimation::filter::TrackSample;
use backseat_logs::{Column, Log, LogRow};

/// A packet that arrived: its row in the log and its times. Only the log of a simulator is that plain: the row
/// stands at the time of arrival.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet {
    /// Index of its row.
    pub row: usize,
    /// Time of launch, µs.
    pub launch_us: u64,
}

/// The packets of a log that were launched after its start.
#[must_use]
pub fn packets(log: &Log) -> Vec<Packet> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let packet = |(row, at): (usize, &LogRow)| {
        let launch_us = at.launch_us().filter(|launch_us| *launch_us >= start_us)?;
        at.get(Column::Range).map(|_| Packet { row, launch_us })
    };
    log.rows.iter().enumerate().filter_map(packet).collect()
}

/// The same log with these packets not received.
#[must_use]
pub fn lose(log: &Log, lost: &[Packet]) -> Log {
    let mut log = log.clone();
    for packet in lost {
        let row = &mut log.rows[packet.row];
        for column in [Column::Range, Column::RangeRate, Column::Tol, Column::Toa, Column::ShipX, Column::ShipY] {
            row.set(column, f64::NAN);
        }
    }
    log
}

/// The deltas in the ship's packets. It sends packets at all of `launches` and learns which of them were `received`.
/// Without a prior it starts from its first fix.
///
/// # Errors
/// Numbers that are not finite.
pub fn deltas(
    log: &Log,
    prior: Option<&InitialShip>,
    config: &NavigationConfig,
    launches: &[Packet],
    received: &[Packet],
) -> Result<Vec<Delta>, NotPositive> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let mut ship = prior.map(|prior| ShipInformation::new(start_us, prior, config));
    let mut fixes = log.rows.iter().filter_map(|row| Some((row.time_us, row.ship_gnss_m()?))).peekable();
    let mut deltas = Vec::with_capacity(received.len());
    for packet in launches {
        while let Some((time_us, position_m)) = fixes.next_if(|(time_us, _)| *time_us <= packet.launch_us) {
            match &mut ship {
                Some(ship) => ship.fix(time_us, position_m)?,
                None => {
                    let prior = InitialShip::from_fix(position_m, config);
                    ship = Some(ShipInformation::new(time_us, &prior, config));
                }
            }
        }
        let Some(ship) = &mut ship else { continue };
        let delta = ship.launch(packet.launch_us)?;
        if received.contains(packet) {
            // The acknowledgement may come any time before the next launch.
            ship.acknowledged();
            deltas.push(delta);
        }
    }
    Ok(deltas)
}

/// A filter on the vehicle that receives packets.
pub trait OnVehicle {
    /// Moves to a time.
    ///
    /// # Errors
    /// The filter has failed.
    fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> anyhow::Result<()>;
    /// Fuses the vehicle's own sensors.
    fn fuse(&mut self, row: &LogRow);
    /// Fuses a packet with its range and range rate.
    ///
    /// # Errors
    /// The filter has failed.
    fn arrive(&mut self, packet: &Packet, row: &LogRow) -> anyhow::Result<()>;
    /// The estimate after all measurements of one time.
    ///
    /// # Errors
    /// The filter has failed.
    fn sample(&mut self) -> anyhow::Result<TrackSample>;
}

/// Leads a filter through a log, in the order of [`backseat_estimation::filter`]; the estimate at every row time.
///
/// # Errors
/// The filter has failed.
pub fn walk(log: &Log, packets: &[Packet], filter: &mut impl OnVehicle) -> anyhow::Result<Vec<TrackSample>> {
    let mut input = ActuatorInput::default();
    let mut launches = packets.iter().map(|packet| packet.launch_us).peekable();
    let mut arrivals = packets.iter().peekable();
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
        while let Some(packet) = arrivals.next_if(|packet| packet.row < next) {
            filter.arrive(packet, &log.rows[packet.row])?;
        }
        first = next;
        track.push(filter.sample()?);
    }
    Ok(track)
}

/// Estimate of vehicle and current right after a packet.
#[derive(Clone, Debug)]
pub struct PacketArrival {
    /// Time of arrival, µs.
    pub time_us: u64,
    /// Mean and covariance.
    pub moments: Moments,
}

/// The information filter on its way through a log.
pub struct DeifRun<'a> {
    deif: Deif,
    deltas: std::slice::Iter<'a, Delta>,
    points: Option<&'a [TrackSample]>,
    use_range_rate: bool,
    /// After each packet.
    pub arrivals: Vec<PacketArrival>,
}

impl<'a> DeifRun<'a> {
    /// Linearises the vehicle's model at its own estimate, or at `points` where they are given.
    #[must_use]
    pub fn new(deif: Deif, deltas: &'a [Delta], points: Option<&'a [TrackSample]>, use_range_rate: bool) -> Self {
        Self { deif, deltas: deltas.iter(), points, use_range_rate, arrivals: Vec::new() }
    }
}

impl OnVehicle for DeifRun<'_> {
    fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> anyhow::Result<()> {
        Ok(self.deif.predict(to_us, input)?)
    }

    fn fuse(&mut self, row: &LogRow) {
        self.deif.fuse(row);
    }

    fn arrive(&mut self, _: &Packet, row: &LogRow) -> anyhow::Result<()> {
        let delta = self.deltas.next().ok_or(DeifError::OtherOrigin)?;
        self.deif.receive(delta)?;
        if let Some(range_m) = row.get(Column::Range) {
            self.deif.range(range_m)?;
        }
        if let Some(range_rate_mps) = row.get(Column::RangeRate).filter(|_| self.use_range_rate) {
            self.deif.range_rate(range_rate_mps)?;
        }
        self.arrivals.push(PacketArrival { time_us: self.deif.time_us(), moments: self.deif.moments()? });
        Ok(())
    }

    fn sample(&mut self) -> anyhow::Result<TrackSample> {
        let (mean, covariance) = self.deif.moments()?;
        let time_us = self.deif.time_us();
        let state: VehicleState = mean.fixed_rows::<12>(0).into_owned();
        let shared = self.points.and_then(|points| {
            let at = points.partition_point(|sample| sample.time_us < time_us);
            points.get(at).filter(|sample| sample.time_us == time_us).map(|sample| sample.state)
        });
        self.deif.linearise_at(&shared.unwrap_or(state));
        Ok(TrackSample {
            time_us,
            state,
            sigma: VehicleState::from_fn(|i, _| covariance[(i, i)].sqrt()),
            cov_xy_m2: covariance[(X, Y)],
            current_mps: [mean[12], mean[13]],
        })
    }
}
