//! A vehicle log as the sequence of readings and inputs that the whitener consumes.
//!
//! The ship's part of a range is taken from its own GNSS track (a straight line through the fixes
//! about the launch), so that only the vehicle has states.

use crate::statistics::MOST_COLOURED;
use backseat_core::navigation::SensorNoise;
use backseat_estimation::commands::{Commands, InputLine, InputTiming};
use backseat_logs::log::{Column, LogRow, USBL_ANGLE_SIGMA_RAD, Usbl};
use backseat_logs::plausible_noise::SensorKind;
use backseat_logs::{Log, VehicleFile};

/// Half of the window over which the ship's track about a launch is taken, µs.
const SHIP_WINDOW_US: u64 = 5_000_000;

/// Distance at which the direction of a USBL is given in metres, where no fix states it, m.
const USBL_DISTANCE_M: f64 = 500.0;

macro_rules! channels {
    (|$sensors:ident| $($(#[$doc:meta])* $channel:ident: $name:literal, $unit:literal, $kind:ident, $sigma:expr;)*) => {
        /// Scalar channels of the residual.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum ResidualChannel {
            $(#[doc = concat!($name, ", ", $unit, ".")] $(#[$doc])* $channel,)*
        }

        impl ResidualChannel {
            /// Number of channels.
            pub const COUNT: usize = Self::ALL.len();

            /// All, in order.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$channel),*];

            /// Name in reports.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$channel => $name,)*
                }
            }

            /// Unit of the channel.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self {
                    $(Self::$channel => $unit,)*
                }
            }

            /// The kind of sensor that reads it.
            #[must_use]
            pub const fn sensor(self) -> SensorKind {
                match self {
                    $(Self::$channel => SensorKind::$kind,)*
                }
            }

            /// What the sensor is declared to scatter by in the whitener, in the channel's unit.
            #[must_use]
            pub fn declared_sigma(self, $sensors: &SensorNoise) -> f64 {
                match self {
                    $(Self::$channel => $sigma,)*
                }
            }
        }
    };
}

channels! {
    |sensors|
    Depth: "depth", "m", Depth, sensors.depth_m;
    Roll: "roll", "rad", RollPitch, sensors.attitude_rad;
    Pitch: "pitch", "rad", RollPitch, sensors.attitude_rad;
    Heading: "heading", "rad", Heading, sensors.attitude_rad;
    P: "roll rate", "rad/s", Rates, sensors.rates_radps;
    Q: "pitch rate", "rad/s", Rates, sensors.rates_radps;
    R: "yaw rate", "rad/s", Rates, sensors.rates_radps;
    /// Over ground.
    DvlU: "DVL surge", "m/s", Dvl, sensors.dvl_mps;
    /// Over ground.
    DvlV: "DVL sway", "m/s", Dvl, sensors.dvl_mps;
    /// Over ground.
    DvlW: "DVL heave", "m/s", Dvl, sensors.dvl_mps;
    GnssX: "GNSS north", "m", Gnss, sensors.gnss_m;
    GnssY: "GNSS east", "m", Gnss, sensors.gnss_m;
    Range: "range", "m", Range, sensors.range_m;
    RangeRate: "range rate", "m/s", RangeRate, sensors.range_rate_mps;
    /// Along the measured direction.
    UsblAlong: "USBL along", "m", Range, sensors.range_m;
    /// Across it in the horizontal, to the right.
    UsblAcross: "USBL across", "m", Usbl, USBL_DISTANCE_M * USBL_ANGLE_SIGMA_RAD;
    /// Across it downwards.
    UsblDown: "USBL down", "m", Usbl, USBL_DISTANCE_M * USBL_ANGLE_SIGMA_RAD;
    /// Positive down (reduced models).
    DepthRate: "depth rate", "m/s", DepthRate, sensors.depth_m;
    /// (Reduced models.)
    WaterSpeed: "speed through water", "m/s", WaterSpeed, sensors.dvl_mps;
}

impl ResidualChannel {
    /// The largest factor on the declared noise that this kind of sensor makes.
    #[must_use]
    pub fn most_scale(self, sensors: &SensorNoise) -> f64 {
        (self.sensor().most(sensors) / self.declared_sigma(sensors)).max(1.0)
    }
}

/// One sensor's reading at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Depth, m.
    Depth(f64),
    /// φ, θ, ψ, rad.
    Attitude([f64; 3]),
    /// p, q, r, rad/s.
    Rates([f64; 3]),
    /// u, v, w over ground, m/s.
    Dvl([f64; 3]),
    /// A fix of the vehicle.
    Gnss {
        /// North, east, m.
        position_m: [f64; 2],
        /// Factor on its variance, because the fixes about it share a part of their errors: so many of them are worth one
        /// (Kish's design effect).
        alike: f64,
    },
    /// Range, m, and range rate, m/s, of one packet.
    Acoustic {
        /// Range, m.
        range_m: Option<f64>,
        /// Range rate, m/s, where the ship's velocity is known.
        range_rate_mps: Option<f64>,
        /// Ship at launch.
        ship: ShipAtLaunch,
        /// Half of a round trip, which shares no clock, read midway.
        two_way: bool,
    },
    /// A fix by USBL.
    Usbl {
        /// What was measured.
        usbl: Usbl,
        /// The ship's array, or what the vehicle's own array hears.
        ship: ShipAtLaunch,
    },
}

/// The ship's transducer at a packet's launch, or a fixed transponder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipAtLaunch {
    /// North, east, m.
    pub position_m: [f64; 2],
    /// North, east, m/s.
    pub velocity_mps: [f64; 2],
    /// Variance of the position per axis, m².
    pub position_variance_m2: f64,
    /// Variance of the velocity per axis, m²/s².
    pub velocity_variance_m2ps2: f64,
    /// Number and depth, m, of a fixed transponder that stands in the ship's place.
    pub station: Option<(u32, f64)>,
}

impl ShipAtLaunch {
    fn transponder(number: u32, [north, east, down]: [f64; 3]) -> Self {
        Self {
            position_m: [north, east],
            velocity_mps: [0.0; 2],
            position_variance_m2: 0.0,
            velocity_variance_m2ps2: 0.0,
            station: Some((number, down)),
        }
    }
}

/// A reading or a new input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LogEvent {
    /// A sensor's reading.
    Reading(Reading),
    /// What the commanded actuators do from here on.
    Input(InputLine),
}

/// A log in the order of its time.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// (time since the first row in s, what).
    pub events: Vec<(f64, LogEvent)>,
    /// Time of the first row, µs.
    pub start_us: u64,
    /// From the first to the last row, s.
    pub duration_s: f64,
    /// The commands as they were logged.
    pub commands: Commands,
    /// Packets without a usable ship position.
    pub unusable_packets: usize,
}

impl Samples {
    /// Gathers a log's readings; `use_dvl` false leaves the DVL out. Commands are held until the next.
    #[must_use]
    pub fn of(log: &Log, vehicle: &VehicleFile, use_dvl: bool) -> Self {
        let start_us = log.rows.first().map_or(0, |row| row.time_us);
        let seconds = |time_us: u64| (time_us as f64 - start_us as f64) * 1e-6;
        let fixes_s: Vec<f64> =
            log.rows.iter().filter(|row| row.gnss_m().is_some()).map(|row| seconds(row.time_us)).collect();
        let ship: Vec<(u64, [f64; 2])> =
            log.rows.iter().filter_map(|row| Some((row.time_us, row.ship_gnss_m()?))).collect();
        let stations_m = log.stations_m();
        let [mut attitudes, mut angular, mut velocities] = [Repeats::default(); 3];
        let mut samples = Self { start_us, duration_s: log.duration_s(), ..Self::default() };
        for row in &log.rows {
            let t_s = seconds(row.time_us);
            let mut read = |reading| samples.events.push((t_s, LogEvent::Reading(reading)));
            if let Some(z) = row.get(Column::Depth) {
                read(Reading::Depth(z));
            }
            if let Some(euler) = row.attitude_rad().filter(|euler| attitudes.is_new(euler)) {
                read(Reading::Attitude(euler));
            }
            if let Some(rates) = row.rates_radps().filter(|rates| angular.is_new(rates)) {
                read(Reading::Rates(rates));
            }
            if let Some(velocity) = row.dvl_mps().filter(|velocity| use_dvl && velocities.is_new(velocity)) {
                read(Reading::Dvl(velocity));
            }
            if let Some(position_m) = row.gnss_m() {
                read(Reading::Gnss { position_m, alike: design_effect(&fixes_s, t_s) });
            }
            for sound in sounds(row, vehicle.installation.sound_speed_mps) {
                let at_ship = || ship_at(&ship, sound.ship_us, row.ship_at_launch_m(), vehicle.sensors.ship_gnss_m);
                let other = match sound.station {
                    Some(number) => stations_m.get(&number).map(|place_m| ShipAtLaunch::transponder(number, *place_m)),
                    None => at_ship(),
                };
                match other {
                    Some(ship) => {
                        let reading = sound.reading(ship);
                        samples.events.push((seconds(sound.read_us), LogEvent::Reading(reading)));
                    }
                    None => samples.unusable_packets += 1,
                }
            }
        }
        samples.commands = Commands::of(log);
        samples.act(&InputTiming::default());
        samples
    }

    /// Lets the actuators follow their commands with this timing.
    pub fn act(&mut self, timing: &InputTiming) {
        self.events.retain(|(_, event)| !matches!(event, LogEvent::Input(_)));
        let lines = self.commands.lines(timing);
        self.events.extend(lines.into_iter().map(|line| (line.from_s, LogEvent::Input(line))));
        // Arrivals may lie between rows; the sort is stable: what was read at the time of a command was read before it.
        self.events.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
}

/// What a row measured by sound: when the vehicle's end is read, and when the ship's end was where it counts.
struct Sound {
    read_us: u64,
    ship_us: u64,
    /// The fixed transponder in the ship's place.
    station: Option<u32>,
    measured: Measured,
}

enum Measured {
    Packet { range_m: Option<f64>, range_rate_mps: Option<f64>, two_way: bool },
    Fix(Usbl),
}

impl Sound {
    fn reading(&self, ship: ShipAtLaunch) -> Reading {
        match self.measured {
            Measured::Packet { range_m, range_rate_mps, two_way } => {
                // Without the ship's velocity there is no range rate.
                let range_rate_mps = range_rate_mps.filter(|_| ship.velocity_variance_m2ps2.is_finite());
                Reading::Acoustic { range_m, range_rate_mps, ship, two_way }
            }
            Measured::Fix(usbl) => Reading::Usbl { usbl, ship },
        }
    }
}

fn sounds(row: &LogRow, sound_speed_mps: f64) -> impl Iterator<Item = Sound> {
    let arrival_us = match row.arrival_us() {
        Some(us) if us.abs_diff(row.time_us) >= 50_000 => us,
        _ => row.time_us,
    };
    let flight_us = move |range_m: f64| (range_m.max(0.0) / sound_speed_mps * 1e6) as u64;
    let left_us = move |flight_us: u64| row.launch_us().unwrap_or(arrival_us.saturating_sub(flight_us)).min(arrival_us);
    let (range_m, range_rate_mps) = (row.get(Column::Range), row.get(Column::RangeRate));
    let packet = (range_m.is_some() || range_rate_mps.is_some()).then(|| Sound {
        read_us: arrival_us,
        ship_us: row.launch_us().unwrap_or(arrival_us.saturating_sub(flight_us(range_m.unwrap_or(0.0)))),
        station: row.station(),
        measured: Measured::Packet { range_m, range_rate_mps, two_way: false },
    });
    // A vehicle at constant velocity is at half of both ways when it is midway; its turns change that by centimetres.
    let round_trip = row.get(Column::TwoWayRange).map(|range_m| {
        let launch_us = left_us(2 * flight_us(range_m));
        let midway_us = launch_us + (arrival_us - launch_us) / 2;
        let measured = Measured::Packet { range_m: Some(range_m), range_rate_mps: None, two_way: true };
        Sound {
            read_us: midway_us,
            ship_us: arrival_us.saturating_sub(flight_us(range_m)),
            station: row.station(),
            measured,
        }
    });
    let fix = row.usbl().map(|usbl| {
        let launch_us = left_us(flight_us(usbl.range_m));
        let (read_us, ship_us) = if usbl.on_vehicle { (arrival_us, launch_us) } else { (launch_us, arrival_us) };
        Sound { read_us, ship_us, station: row.station().filter(|_| usbl.on_vehicle), measured: Measured::Fix(usbl) }
    });
    packet.into_iter().chain(round_trip).chain(fix)
}

/// Readings that are written again say nothing new: a driver that is asked more often than its sensor measures, or a
/// sensor that missed a measurement.
#[derive(Clone, Copy, Default)]
struct Repeats {
    last: Option<[f64; 3]>,
    in_a_row: usize,
}

impl Repeats {
    /// Whether a reading is not the last one again. Three numbers that stay the same for longer are what was measured: a
    /// vehicle at rest, or a log without noise.
    fn is_new(&mut self, reading: &[f64; 3]) -> bool {
        const MOST_IN_A_ROW: usize = 9;
        self.in_a_row = if self.last == Some(*reading) { self.in_a_row + 1 } else { 0 };
        self.last = Some(*reading);
        !(1..=MOST_IN_A_ROW).contains(&self.in_a_row)
    }
}

/// Errors of GNSS fixes last (multipath, the ionosphere): fixes closer than this share a part of them, s.
const LASTING_S: f64 = 20.0;

/// The share of their variance that lasts. What of a noise may be coloured though it is declared white is tolerated up to
/// a fifth; how much it is two or three surfaced runs do not tell, and the middle is what is to be expected.
const LASTING_SHARE: f64 = 0.5 * MOST_COLOURED;

/// Until their noise is estimated: how many fixes about `t_s` are worth one independent fix. The design effect of a cluster of n, 1 + (n - 1) ρ (Kish
/// 1965), where ρ is the share of the variance that they have in common. The scatter of blocks finds the colour of
/// other sensors; fixes stand in the few blocks of a surfaced run or two, which have no scatter.
fn design_effect(fixes_s: &[f64], t_s: f64) -> f64 {
    let first = fixes_s.partition_point(|fix_s| *fix_s <= t_s - LASTING_S);
    let last = fixes_s.partition_point(|fix_s| *fix_s < t_s + LASTING_S);
    1.0 + LASTING_SHARE * (last - first).saturating_sub(1) as f64
}

/// A straight line through the ship's fixes about the launch; without fixes the packet's position.
fn ship_at(fixes: &[(u64, [f64; 2])], launch_us: u64, told_m: Option<[f64; 2]>, sigma_m: f64) -> Option<ShipAtLaunch> {
    let first = fixes.partition_point(|fix| fix.0 + SHIP_WINDOW_US < launch_us);
    let last = fixes.partition_point(|fix| fix.0 <= launch_us + SHIP_WINDOW_US);
    let window = &fixes[first..last];
    let count = window.len() as f64;
    let seconds = |time_us: u64| (time_us as f64 - launch_us as f64) * 1e-6;
    let mean_s = window.iter().map(|fix| seconds(fix.0)).sum::<f64>() / count;
    let spread: f64 = window.iter().map(|fix| (seconds(fix.0) - mean_s).powi(2)).sum();
    if window.len() < 3 || spread <= 0.0 {
        let position_m = told_m?;
        return Some(ShipAtLaunch {
            position_m,
            velocity_mps: [0.0; 2],
            position_variance_m2: sigma_m * sigma_m,
            velocity_variance_m2ps2: f64::INFINITY,
            station: None,
        });
    }
    let line = |axis: usize| {
        let mean = window.iter().map(|fix| fix.1[axis]).sum::<f64>() / count;
        let slope = window.iter().map(|fix| (seconds(fix.0) - mean_s) * fix.1[axis]).sum::<f64>() / spread;
        (mean - slope * mean_s, slope)
    };
    let ((x, vx), (y, vy)) = (line(0), line(1));
    let variance = sigma_m * sigma_m;
    Some(ShipAtLaunch {
        position_m: [x, y],
        velocity_mps: [vx, vy],
        position_variance_m2: variance * (1.0 / count + mean_s * mean_s / spread),
        velocity_variance_m2ps2: variance / spread,
        station: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_written_again_is_left_out_and_a_steady_one_is_not() {
        let mut repeats = Repeats::default();
        let new: Vec<bool> = [[1.0; 3], [1.0; 3], [2.0; 3], [1.0; 3]].iter().map(|r| repeats.is_new(r)).collect();
        assert_eq!(new, [true, false, true, true]);
        let steady = [[1.0; 3]; 20].map(|reading| repeats.is_new(&reading));
        assert!(steady[19], "{steady:?}");
    }

    /// A lone fix is worth one; among 38 others within 20 s, 1 + 38 ρ of them are, at the end of a run half as many.
    #[test]
    fn val_fixes_that_share_their_errors() {
        assert_eq!(design_effect(&[0.0, 100.0], 100.0), 1.0);
        let run: Vec<f64> = (0..80).map(f64::from).collect();
        assert!((design_effect(&run, 40.0) - (1.0 + 38.0 * LASTING_SHARE)).abs() < 1e-12); // rounding
        assert!((design_effect(&run, 0.0) - (1.0 + 19.0 * LASTING_SHARE)).abs() < 1e-12);
    }
}
