//! Emulated devices: observations of the world in, bytes on serial lines out, and commands obeyed.
//!
//! Each device speaks its protocol through `backseat_wire`, the same file that the firmware reads
//! with; outside vectors in that crate's tests keep the two from being wrong together.

mod agenda;
mod ahrs;
mod dvl;
mod frontseat;
mod geodesy;
pub mod micro_modem;
mod modem;
pub mod uart;

pub use dvl::MOUNTING_RAD as DVL_MOUNTING_RAD;
pub use frontseat::calibration;
pub use geodesy::LocalFrame;

use crate::faults::{Direction, FaultyLine, FrontseatFaults, PacketFaults, SensorFaults};
use crate::observation::Observation;
use crate::scenario::Scenario;
use crate::truth::Actuators;
use ahrs::Ahrs;
use backseat_link::Arrival;
use backseat_wire::hostlink::{MAX_CHUNKS, Port};
use dvl::Dvl;
use frontseat::Frontseat;
use micro_modem::MicroModem;
use modem::Modem;
use uart::Uart;

/// Baud rates of the four device lines, in the order of [`Port::DEVICES`].
const BAUD: [u32; 4] = [19_200, 115_200, 115_200, 19_200];

/// The vehicle's modem.
enum VehicleModem {
    /// It plays the ship's part as well.
    Alone(Box<Modem>),
    /// There is another modem at the ship.
    Paired(Box<MicroModem>),
}

/// The four devices and the lines from the backseat to them.
pub struct Devices {
    frontseat: Frontseat,
    dvl: Dvl,
    ahrs: Ahrs,
    modem: VehicleModem,
    from_backseat: [Uart; 4],
    sensor_faults: SensorFaults,
    packet_faults: PacketFaults,
    /// To the backseat and from it.
    lines: [[FaultyLine; 4]; 2],
}

impl Devices {
    /// All devices, powered up at time zero.
    pub fn new(scenario: &Scenario) -> Self {
        let [frontseat, dvl, ahrs, modem] = BAUD;
        let settings = &scenario.settings;
        let environment = &settings.environment;
        let (faults, seed) = (&settings.faults, settings.seed);
        let sensor_faults = SensorFaults::new(faults, seed);
        let packet_faults = PacketFaults::new(faults, seed, environment.sound_speed_mps);
        let lines = [Direction::ToBackseat, Direction::FromBackseat].map(|direction| {
            Port::DEVICES.map(|port| FaultyLine::new(faults, seed, port, direction, BAUD[port as usize]))
        });
        let frame = LocalFrame::new(environment.origin_latitude_deg, environment.origin_longitude_deg);
        let start_unix_s = environment.start_unix_s;
        let declination_rad = environment.magnetic_declination_rad;
        Self {
            frontseat: Frontseat::new(
                frontseat,
                frontseat::calibration(scenario.vehicle.parameters.omega_max_radps),
                frame,
                start_unix_s,
                declination_rad,
                FrontseatFaults::new(faults, seed),
            ),
            dvl: Dvl::new(dvl),
            ahrs: Ahrs::new(ahrs, declination_rad, sensor_faults.rollover_us()),
            modem: VehicleModem::Alone(Box::new(Modem::new(
                modem,
                frame,
                start_unix_s,
                settings,
                packet_faults.clone(),
            ))),
            from_backseat: BAUD.map(Uart::new),
            sensor_faults,
            packet_faults,
            lines,
        }
    }

    /// From now on the vehicle's modem only does what the backseat says, with another one at the ship.
    pub fn pair_modem(&mut self, start_unix_s: u32, packet_duration_s: f64, pulse: bool) {
        let [.., baud] = BAUD;
        self.modem = VehicleModem::Paired(Box::new(MicroModem::new(baud, start_unix_s, packet_duration_s, pulse)));
    }

    /// The vehicle's modem, if there is another one at the ship.
    pub fn micro_modem(&mut self) -> Option<&mut MicroModem> {
        match &mut self.modem {
            VehicleModem::Paired(modem) => Some(modem),
            VehicleModem::Alone(_) => None,
        }
    }

    /// What is sensed of an observation, faults included.
    #[must_use]
    pub fn sensed(&mut self, observation: &Observation) -> Observation {
        let mut sensed = *observation;
        self.sensor_faults.distort(&mut sensed);
        self.packet_faults.distort(&mut sensed);
        sensed
    }

    /// The world was sensed.
    pub fn observe(&mut self, observation: &Observation) {
        self.frontseat.observe(observation);
        self.dvl.observe(observation);
        self.ahrs.observe(observation);
        if let VehicleModem::Alone(modem) = &mut self.modem {
            modem.observe(observation);
        }
    }

    /// The backseat began to send `bytes` at `time_us`.
    pub fn sent_by_backseat(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        if let Some(line) = self.from_backseat.get_mut(port as usize) {
            line.send(time_us, bytes);
        }
    }

    /// When something next happens by itself or arrives at a device, µs.
    pub fn next_us(&self) -> Option<u64> {
        let lines = self.from_backseat.iter().filter_map(Uart::next_us);
        let modem = match &self.modem {
            VehicleModem::Alone(modem) => modem.next_us(),
            VehicleModem::Paired(modem) => modem.next_us(),
        };
        lines.chain(self.frontseat.next_us()).chain(modem).min()
    }

    /// Lets the devices act up to `now_us`; returns the commands of fins and propeller from then on.
    pub fn run(&mut self, now_us: u64) -> Actuators {
        let [_, from_backseat] = &mut self.lines;
        for (port, (uart, line)) in Port::DEVICES.into_iter().zip(self.from_backseat.iter_mut().zip(from_backseat)) {
            for Arrival { time_us, bytes } in line.pass(std::iter::from_fn(|| uart.pop(now_us)).collect(), now_us) {
                match port {
                    Port::Frontseat => self.frontseat.receive(time_us, &bytes),
                    Port::Ahrs => self.ahrs.receive(time_us, &bytes),
                    Port::Modem => match &mut self.modem {
                        VehicleModem::Alone(modem) => modem.receive(time_us, &bytes),
                        VehicleModem::Paired(modem) => modem.receive(time_us, &bytes),
                    },
                    Port::Dvl | Port::Host => {} // it streams, unasked
                }
            }
        }
        // a paired one is run by what joins the two
        if let VehicleModem::Alone(modem) = &mut self.modem {
            modem.run(now_us);
        }
        self.frontseat.targets(now_us)
    }

    /// What has arrived at the backseat up to `until_us`, in order of arrival (ties in port order).
    pub fn arrivals(&mut self, until_us: u64) -> Vec<(Port, Arrival)> {
        let mut arrivals = Vec::new();
        let [to_backseat, _] = &mut self.lines;
        for (port, line) in Port::DEVICES.into_iter().zip(to_backseat) {
            let uart = match port {
                Port::Frontseat => &mut self.frontseat.transmitter,
                Port::Dvl => &mut self.dvl.transmitter,
                Port::Ahrs => &mut self.ahrs.transmitter,
                Port::Modem | Port::Host => match &mut self.modem {
                    VehicleModem::Alone(modem) => &mut modem.transmitter,
                    VehicleModem::Paired(modem) => &mut modem.transmitter,
                },
            };
            let frames = line.pass(std::iter::from_fn(|| uart.pop(until_us)).collect(), until_us);
            arrivals.extend(joined(frames).into_iter().map(|arrival| (port, arrival)));
        }
        arrivals.sort_by_key(|(_, arrival)| arrival.time_us);
        arrivals
    }
}

/// No more than a port's part of what a lock-step can announce: a babbling port's bytes go in larger pieces.
fn joined(mut frames: Vec<Arrival>) -> Vec<Arrival> {
    const MOST: usize = MAX_CHUNKS / 4;
    let size = frames.len().div_ceil(MOST);
    if size <= 1 {
        return frames;
    }
    let pieces = frames.chunks_mut(size).map(|piece| Arrival {
        time_us: piece.last().map_or(0, |last| last.time_us),
        bytes: piece.iter_mut().flat_map(|frame| std::mem::take(&mut frame.bytes)).collect(),
    });
    pieces.collect()
}
