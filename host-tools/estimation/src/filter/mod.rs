//! The flight filter over a vehicle log.
//!
//! Within a row the order is depth, attitude, rates, DVL, ship GNSS, vehicle GNSS; then arrivals
//! (range, range rate, two-way range) and launches (ship or vehicle are cloned) of that time. Actuators hold from their
//! row on. The filter moves exactly to the times of rows, launches and arrivals.

mod acoustics;
mod errors;
mod health;
mod history;
mod options;
mod start;

pub use crate::track::TrackSample;
pub use health::{Health, SensorHealth};
pub use history::{FusedScalar, FusionHistory};
pub use options::{FilterOptions, ShipSource, Start};

use crate::inputs;
use crate::smoother::Recording;
use acoustics::{AcousticEvent, Direction, Flights, Packet, ShipTrack};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::effects::EffectSet;
use backseat_core::navigation::{
    AcousticPath, Consistency, InitialShip, Learnt, Level, Measurement, NavigationConfig, Navigator, ProcessModel,
    ProtectionLevel, Sensor, ShipEnd, StateEstimate, UsblAxes, UsblFix, VehicleEnd,
};
use backseat_core::parameters::Installation;
use backseat_core::state::{VehicleState, X, Y};
use backseat_logs::log::{Column, Log, LogRow, RADPS_PER_RPM, Usbl};
use backseat_logs::{DataError, VehicleFile, interrupt};
use errors::{failed, refused};
use std::time::{Duration, Instant};

/// How one sensor agreed with the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSummary {
    /// Which.
    pub sensor: Sensor,
    /// Scalars fused.
    pub fused: u64,
    /// Scalars rejected: outside the gate, invalid, or their delayed state gone.
    pub rejected: u64,
    /// Mean normalised innovation squared of the fused scalars, 1 if consistent; `None` without any.
    pub nis: Option<f64>,
}

/// What the filter made of a log.
#[derive(Clone, Debug)]
pub struct FilterRun {
    /// The estimate, at the interval asked for and at the end.
    pub track: Vec<TrackSample>,
    /// The protection level at each time of the track, if that was asked for.
    pub levels: Vec<Level>,
    /// The track from the measurements of the whole log, if that was asked for.
    pub smoothed: Option<Vec<TrackSample>>,
    /// One sigma of the ship's velocity, north and east, m/s, at the times of the track from which on the ship is a
    /// state.
    pub ship_velocity_sigma_mps: Vec<(u64, [f64; 2])>,
    /// The augmented states at the end of the log; none of a filter that is not robust.
    pub estimates: Vec<StateEstimate>,
    /// Weights of the nominal filter and of the one whose current changes, at the end.
    pub weights: [f64; 2],
    /// What the log has shown of the vehicle, for the next dive.
    pub learnt: Option<Box<Learnt>>,
    /// Every fusion, in order.
    pub fusions: FusionHistory,
    /// Per sensor that had a measurement.
    pub sensors: Vec<SensorSummary>,
    /// Digest of state and covariance at every sample of the track.
    pub digest: u64,
    /// What could not be used, one line each.
    pub notes: Vec<String>,
    /// Time taken.
    pub wall: Duration,
}

/// Runs the filter over a log from its start to its end.
///
/// # Errors
/// If the log has nothing to start from, lacks the actuators that the dynamic model needs, or the
/// filter refuses or fails (a gap of more than ten minutes, numbers that are not finite).
pub fn run(log: &Log, vehicle: &VehicleFile, options: &FilterOptions) -> Result<FilterRun, DataError> {
    run_watched(log, vehicle, options, |_| {}, |_| {})
}

/// [`run`] with effects that take the place of the declared ones from times on, s since the log's start, ascending.
///
/// # Errors
/// As [`run`]; effects that the filter refuses.
pub fn run_changing(
    log: &Log,
    vehicle: &VehicleFile,
    options: &FilterOptions,
    changes: &[(f64, EffectSet)],
) -> Result<FilterRun, DataError> {
    run_through((log, vehicle, options), changes, |_| {}, |_| {})
}

/// [`run`], calling `progress` with the number of rows done now and then, and showing the filter to `observe` after
/// everything that happened at each time.
///
/// # Errors
/// As [`run`].
pub fn run_watched(
    log: &Log,
    vehicle: &VehicleFile,
    options: &FilterOptions,
    progress: impl FnMut(usize),
    observe: impl FnMut(&Navigator),
) -> Result<FilterRun, DataError> {
    run_through((log, vehicle, options), &[], progress, observe)
}

fn run_through(
    (log, vehicle, options): (&Log, &VehicleFile, &FilterOptions),
    changes: &[(f64, EffectSet)],
    mut progress: impl FnMut(usize),
    mut observe: impl FnMut(&Navigator),
) -> Result<FilterRun, DataError> {
    let began = Instant::now();
    let log = &*inputs::at_centre(log, &vehicle.installation);
    let mut pass = Pass::new(log, vehicle, options)?;
    let first_row = pass.start(vehicle)?;
    let rows = &log.rows;
    let start_us = rows.first().map_or(0, |row| row.time_us);
    let mut changes = changes.iter().peekable();
    for (index, row) in rows.iter().enumerate().skip(first_row) {
        if index % 4096 == 0 {
            interrupt::check();
            progress(index);
        }
        while let Some((_, effects)) = changes.next_if(|(t_s, _)| start_us as f64 + t_s * 1e6 <= row.time_us as f64) {
            pass.change_effects(effects)?;
        }
        pass.acoustics_before(row.time_us)?;
        pass.move_to(row.time_us)?;
        pass.fuse_row(row);
        pass.hold_actuators(row);
        // Rows of one time are one instant: packets and track come after the last of them.
        let last_of_its_time = rows.get(index + 1).is_none_or(|next| next.time_us > row.time_us);
        if last_of_its_time {
            pass.acoustics_until(row.time_us)?;
            pass.sample(index + 1 == rows.len());
            observe(&pass.navigator);
        }
    }
    let mut run = pass.finish();
    run.wall = began.elapsed();
    Ok(run)
}

/// One pass of the filter over a log.
struct Pass<'a> {
    log: &'a Log,
    installation: Installation,
    options: &'a FilterOptions,
    navigator: Recording,
    protection: ProtectionLevel,
    input: ActuatorInput,
    flights: Flights,
    ship_track: Option<ShipTrack>,
    /// Packets without a known position of the ship.
    unusable: usize,
    /// Range rates without a known velocity of the ship.
    unusable_rates: usize,
    consistency: Consistency,
    next_sample_us: u64,
    run: FilterRun,
}

impl<'a> Pass<'a> {
    fn new(log: &'a Log, vehicle: &VehicleFile, options: &'a FilterOptions) -> Result<Self, DataError> {
        let fail = |message: String| DataError::file(&log.path, message);
        if options.navigation.process_model == ProcessModel::Dynamic {
            let missing = Column::ALL[..5].iter().find(|column| !log.has(**column));
            if let Some(column) = missing {
                let name = column.name();
                return Err(fail(format!(
                    "the dynamic model needs {name}, which has no samples; the kinematic model does not"
                )));
            }
        }
        let model = VehicleModel::new(&vehicle.parameters).map_err(|e| fail(e.to_string()))?;
        let mut navigator = Recording::new(Box::new(Navigator::new()));
        navigator.configure(&options.navigation, &model).map_err(|e| refused(log, e))?;
        let ship_track =
            (options.ship == ShipSource::Packet).then(|| ShipTrack::of(log, options.navigation.sensors.ship_gnss_m));
        let run = FilterRun {
            track: Vec::new(),
            levels: Vec::new(),
            smoothed: None,
            ship_velocity_sigma_mps: Vec::new(),
            estimates: Vec::new(),
            weights: [0.0; 2],
            learnt: None,
            fusions: FusionHistory::default(),
            sensors: Vec::new(),
            digest: 0,
            notes: Vec::new(),
            wall: Duration::ZERO,
        };
        Ok(Self {
            log,
            installation: vehicle.installation,
            options,
            navigator,
            protection: ProtectionLevel::new(),
            input: ActuatorInput::default(),
            flights: Flights::of(log),
            ship_track,
            unusable: 0,
            unusable_rates: 0,
            consistency: Consistency::new(),
            next_sample_us: 0,
            run,
        })
    }

    /// Initialises the filter; returns the row to go on with.
    fn start(&mut self, vehicle: &VehicleFile) -> Result<usize, DataError> {
        let (time_us, initial, ship, next_row) = match self.options.start {
            Some(Start { vehicle, ship }) => (self.log.rows.first().map_or(0, |row| row.time_us), vehicle, ship, 0),
            None => {
                let start = start::first_fix(self.log, vehicle, self.options)?;
                (start.time_us, start.initial, None, start.next_row)
            }
        };
        for row in &self.log.rows[..next_row] {
            self.hold_actuators(row);
        }
        self.navigator.set_epoch(self.log.rows.first().map_or(0, |row| row.time_us));
        self.navigator.initialise(time_us, &initial).map_err(|e| failed(self.log, &self.navigator, e))?;
        self.navigator.start_from(&self.options.learnt);
        if let Some(declared) = &self.options.level {
            self.protection.start(&self.navigator.followed(), self.options.navigation.sensors.gnss_m, declared);
        }
        if let Some(ship) = ship {
            self.navigator.initialise_ship(&ship).map_err(|e| failed(self.log, &self.navigator, e))?;
        }
        if self.options.smooth {
            self.navigator.keep();
        }
        // What was launched or arrived before the start is lost.
        while time_us > 0 && self.flights.next_until(time_us - 1).is_some() {}
        Ok(next_row)
    }

    /// Adopts other effects; state and covariance stay.
    fn change_effects(&mut self, effects: &EffectSet) -> Result<(), DataError> {
        let config = NavigationConfig { effects: *effects, ..*self.navigator.config() };
        self.navigator.reconfigure(&config).map_err(|e| refused(self.log, e))
    }

    fn move_to(&mut self, time_us: u64) -> Result<(), DataError> {
        self.navigator.predict(time_us, &self.input).map_err(|e| failed(self.log, &self.navigator, e))?;
        if let Some(declared) = &self.options.level {
            self.protection.follow(&self.navigator.followed(), declared);
        }
        Ok(())
    }

    fn hold_actuators(&mut self, row: &LogRow) {
        if let Some(rpm) = row.get(Column::PropRpm) {
            self.input.propeller_radps = rpm * RADPS_PER_RPM;
        }
        for (fin, column) in self.input.fins_rad.iter_mut().zip(&Column::ALL[Column::FinTop as usize..]) {
            *fin = row.get(*column).unwrap_or(*fin);
        }
    }

    fn fuse(&mut self, measurement: &Measurement) {
        if let (Some(declared), Some(aiding)) = (&self.options.level, self.navigator.aiding(measurement)) {
            self.protection.take(&self.navigator.followed(), &aiding, declared);
        }
        for record in self.navigator.fuse(measurement).iter() {
            self.consistency.add(record);
            self.run.fusions.push(record);
        }
    }

    fn fuse_row(&mut self, row: &LogRow) {
        if let Some(z_m) = row.get(Column::Depth) {
            self.fuse(&Measurement::Depth { z_m });
        }
        if let Some(euler_rad) = row.attitude_rad() {
            self.fuse(&Measurement::Attitude { euler_rad });
        }
        if let Some(rates_radps) = row.rates_radps().filter(|_| self.options.use_rates) {
            self.fuse(&Measurement::Rates { rates_radps });
        }
        if let Some(velocity_mps) = row.dvl_mps().filter(|_| self.options.use_dvl) {
            self.fuse(&Measurement::BottomTrack { velocity_mps });
        }
        if let Some(position_m) = row.ship_gnss_m().filter(|_| self.options.ship == ShipSource::Centralized) {
            self.fuse_ship(position_m);
        }
        if let Some(position_m) = row.gnss_m() {
            self.fuse(&Measurement::VehicleGnss { position_m });
        }
    }

    fn fuse_ship(&mut self, position_m: [f64; 2]) {
        if self.navigator.main().ship_state().is_some() {
            self.fuse(&Measurement::ShipGnss { position_m });
        } else {
            // Refused only if the fix is not finite; the next one will do.
            let _ = self.navigator.initialise_ship(&InitialShip::from_fix(position_m, &self.options.navigation));
        }
    }

    /// Launches and arrivals between rows.
    fn acoustics_before(&mut self, time_us: u64) -> Result<(), DataError> {
        match time_us.checked_sub(1) {
            Some(until_us) => self.acoustics_until(until_us),
            None => Ok(()),
        }
    }

    fn acoustics_until(&mut self, until_us: u64) -> Result<(), DataError> {
        while let Some((time_us, event, index)) = self.flights.next_until(until_us) {
            self.move_to(time_us)?;
            match event {
                AcousticEvent::LeavesShip if self.ship_track.is_none() => {
                    self.flights.packets[index].ship = self.navigator.clone_ship().ok();
                }
                AcousticEvent::LeavesShip => {}
                AcousticEvent::LeavesVehicle => {
                    let shared = self.flights.clone_of_launch(index);
                    self.flights.packets[index].vehicle = shared.or_else(|| self.navigator.clone_vehicle().ok());
                }
                AcousticEvent::Arrival => {
                    self.arrive(index);
                    let Packet { ship, vehicle, .. } = self.flights.packets[index];
                    let vehicle = vehicle.filter(|clone| !self.flights.is_shared(*clone));
                    for clone in [ship, vehicle].into_iter().flatten() {
                        self.navigator.drop_clone(clone);
                    }
                }
            }
        }
        Ok(())
    }

    /// The ship's end of a path, and whether its velocity is known.
    fn ship_end(&self, packet: &Packet) -> Option<(ShipEnd, bool)> {
        if let Some(station) = packet.station {
            let place_m = self.flights.stations_m.get(&station)?;
            return Some((ShipEnd::Transponder(*place_m), true));
        }
        match (&self.ship_track, packet.ship) {
            (Some(track), _) => {
                let (report, velocity_known) = track.report(packet.ship_us, packet.ship_m?);
                Some((ShipEnd::Reported(report), velocity_known))
            }
            (None, Some(clone)) => Some((ShipEnd::Delayed(clone), true)),
            // an uplink arrives where the ship is now
            (None, None) => {
                let at_ship = packet.direction == Direction::Uplink && self.navigator.main().ship_state().is_some();
                at_ship.then_some((ShipEnd::Now, true))
            }
        }
    }

    fn arrive(&mut self, index: usize) {
        let packet = self.flights.packets[index];
        let left = packet.vehicle.map(|clone| VehicleEnd::Delayed { clone, bridge_s: 0.0 });
        let vehicle = if packet.direction == Direction::Uplink { left } else { Some(VehicleEnd::Now) };
        let (Some((ship, velocity_known)), Some(vehicle)) = (self.ship_end(&packet), vehicle) else {
            self.unusable += 1;
            return;
        };
        let path = AcousticPath { vehicle, ship };
        if let Some(range_m) = packet.range_m.filter(|_| self.options.use_range) {
            let range_m = self.range_at_centre_m(range_m, &packet);
            match (packet.direction, left) {
                (Direction::TwoWay, Some(left)) => {
                    let outward = AcousticPath { vehicle: left, ship };
                    self.fuse(&Measurement::TwoWayRange { outward, back: path, range_m });
                }
                (Direction::TwoWay, None) => self.unusable += 1,
                _ => self.fuse(&Measurement::Range { path, range_m }),
            }
        }
        if let Some(usbl) = packet.usbl.filter(|_| self.options.use_range) {
            let fix = inputs::usbl_at_centre(&usbl, self.navigator.state(), &self.installation);
            let range_sigma_m = fix.range_sigma_m.unwrap_or(self.options.navigation.sensors.range_m);
            let axes = if fix.on_vehicle { UsblAxes::Body } else { UsblAxes::Level };
            let Usbl { range_m, bearing_rad, elevation_rad, angle_sigma_rad, .. } = fix;
            let fix = UsblFix { axes, range_m, bearing_rad, elevation_rad, range_sigma_m, angle_sigma_rad };
            self.fuse(&Measurement::Usbl { path, fix });
        }
        if let Some(range_rate_mps) = packet.range_rate_mps.filter(|_| self.options.use_range_rate) {
            if velocity_known {
                self.fuse(&Measurement::RangeRate { path, range_rate_mps });
            } else {
                self.unusable_rates += 1;
            }
        }
    }

    /// The range of the centre of gravity; the ship stands where the packet says, or where the filter has it now.
    fn range_at_centre_m(&self, range_m: f64, packet: &Packet) -> f64 {
        let depth_m = self.options.navigation.ship_transducer_depth_m;
        let station = packet.station.and_then(|station| self.flights.stations_m.get(&station));
        let of_ship = || packet.ship_m.or(self.navigator.main().ship_state().map(|[x, y, ..]| [x, y]));
        let other = station.map(|&[x, y, z]| ([x, y], z)).or_else(|| of_ship().map(|ship_m| (ship_m, depth_m)));
        let Some((ship_m, depth_m)) = other else {
            return range_m;
        };
        inputs::range_at_centre_m(range_m, self.navigator.state(), &self.installation, ship_m, depth_m)
    }

    fn sample(&mut self, is_last: bool) {
        let time_us = self.navigator.time_us();
        if time_us < self.next_sample_us && !is_last {
            return;
        }
        self.next_sample_us = time_us + self.options.track_interval_us;
        self.navigator.sample();
        let navigator = &self.navigator;
        self.run.digest = navigator.digest_from(self.run.digest);
        if let Some(sigma) = navigator.main().ship_velocity_sigma_mps() {
            self.run.ship_velocity_sigma_mps.push((time_us, sigma));
        }
        self.run.levels.extend(self.protection.level());
        self.run.track.push(TrackSample {
            time_us,
            state: *navigator.state(),
            sigma: VehicleState::from_fn(|i, _| navigator.variance(i).sqrt()),
            cov_xy_m2: navigator.covariance(X, Y),
            current_mps: navigator.current(),
        });
    }

    fn finish(mut self) -> FilterRun {
        self.run.smoothed = self.options.smooth.then(|| self.navigator.smooth());
        if self.options.is_robust() {
            self.run.estimates = self.navigator.main().estimates().collect();
            self.run.weights = self.navigator.weights();
            self.run.learnt = self.navigator.main().learnt(self.options.learnt.dives.saturating_add(1)).map(Box::new);
        }
        if self.unusable > 0 {
            let count = self.unusable;
            self.run
                .notes
                .push(format!("{count} packets not used: the ship, the vehicle at their launch, or the place of their transponder is not known"));
        }
        if self.unusable_rates > 0 {
            let count = self.unusable_rates;
            self.run
                .notes
                .push(format!("{count} range rates not used: the ship's velocity at their launch is not known"));
        }
        let left_out = self.consistency.tally(Sensor::RangeRate).position_uncertain;
        if left_out > 0 {
            let within_m = self.navigator.config().range_rate_within_m;
            self.run.notes.push(format!(
                "{left_out} range rates not used: the position was uncertain by more than {within_m} m, and they turn with the \
                 bearing"
            ));
        }
        for sensor in Sensor::ALL {
            let tally = self.consistency.tally(sensor);
            let rejected = u64::from(tally.rejected) + u64::from(tally.invalid);
            let fused = u64::from(tally.count);
            if fused + rejected > 0 {
                self.run.sensors.push(SensorSummary { sensor, fused, rejected, nis: tally.mean() });
            }
        }
        self.run
    }
}
