//! The ship's end of a simulation with the real topside: GNSS receiver and modem on serial lines, the program behind
//! them, and the water between the two modems.

mod on_ports;
mod program;
mod receiver;

pub use on_ports::{OnPorts, ProgramClock};
pub use program::{InProcess, Known, Program, ProgramError, announced, exchange};

use crate::devices::micro_modem::{Heard, Launch, MicroModem, Sound};
use crate::devices::uart::Uart;
use crate::devices::{Devices, LocalFrame};
use crate::faults::{Fault, FaultKind, PacketFault, SensorFault};
use crate::observation::{Observation, ObservationKind, OneWay, ShipReport};
use crate::scenario::{self, Exchange, Scenario};
use crate::world::World;
use backseat_app::STEP_US;
use backseat_link::Arrival;
use backseat_topside::slots::{self, Airtime, SlotTable};
use backseat_topside::{Config, ConfigError, Port, Topside};
use backseat_wire::modem::{Addresses, ClockEncoding};
use backseat_wire::ship_state::ShipState;
use receiver::Receiver;
use std::collections::VecDeque;

/// Modem address of the ship.
const SHIP: u8 = 1;
/// Baud rates of receiver and modem.
const BAUD: [u32; 2] = [19_200, 19_200];
/// Frames in the water are forgotten after this, µs.
const FORGET_US: u64 = 60_000_000;

/// The first fault that acts in the vehicle's modem while it plays the ship's part, and would do nothing in that of a
/// ship with topside.
#[must_use]
pub fn fault_of_lone_modem(scenario: &Scenario) -> Option<&Fault> {
    use PacketFault::{ClockDrift, ClockStep, Multipath};
    scenario.settings.faults.iter().find(|fault| match fault.kind {
        FaultKind::Packet(Multipath { .. } | ClockStep { .. } | ClockDrift { .. }) => false,
        FaultKind::Packet(_) => true,
        _ => false,
    })
}

/// The first fault of the ship's receiver: it does nothing without topside, which alone hears that.
#[must_use]
pub fn fault_of_receiver(scenario: &Scenario) -> Option<&Fault> {
    let is_receivers = |fault: &&Fault| matches!(fault.kind, FaultKind::Sensor(SensorFault::ShipGnssJump { .. }));
    scenario.settings.faults.iter().find(is_receivers)
}

/// What topside would have been given for a scenario.
///
/// # Errors
/// Slots that overlap, or a value that topside refuses.
pub fn config(scenario: &Scenario) -> Result<Config, ConfigError> {
    let settings = &scenario.settings;
    let (acoustics, environment) = (&settings.acoustics, &settings.environment);
    let period_s = acoustics.period_s.get();
    let first_s = environment.start_unix_s.wrapping_add(acoustics.first_s);
    let slot = |slot: &scenario::Slot| {
        let vehicle = slot.companion.unwrap_or(acoustics.address);
        let exchange = match slot.exchange {
            Exchange::Downlink => slots::Exchange::Downlink,
            Exchange::Uplink => slots::Exchange::Uplink { vehicle },
            Exchange::TwoWay => slots::Exchange::VehiclePing { vehicle },
            Exchange::ShipPing => slots::Exchange::Ping { vehicle },
        };
        slots::Slot { offset_s: first_s.wrapping_add(slot.offset_s) % period_s, exchange }
    };
    let companions = settings.companions.iter().map(|companion| companion.address);
    let slots: Vec<slots::Slot> = acoustics.slots.iter().map(slot).collect();
    let airtime = Airtime {
        packet_s: acoustics.packet_duration_s,
        turnaround_s: acoustics.turnaround_s,
        flight_s: acoustics.max_range_m / environment.sound_speed_mps,
        ..Airtime::REFERENCE
    };
    let config = Config {
        origin_deg: Some([environment.origin_latitude_deg, environment.origin_longitude_deg]),
        address: SHIP,
        key: acoustics.key,
        vehicles: std::iter::once(acoustics.address).chain(companions).collect(),
        slots: SlotTable::new(period_s, &slots, airtime)?,
        transducer_depth_m: settings.ship.transducer_depth_m,
        ship_acceleration_mps2_per_sqrt_hz: settings.ship.estimator_mps2_per_sqrt_hz,
        sound_speed_mps: environment.sound_speed_mps,
        transducer_delay_s: scenario.vehicle.installation.transducer_delay_s,
        range_sigma_m: acoustics.range_sigma_m.unwrap_or(scenario.vehicle.sensors.range_m),
        range_max_m: acoustics.max_range_m,
        clock_encoding: ClockEncoding::BitField,
        ..Config::reference()
    };
    config.check()?;
    Ok(config)
}

/// A vehicle at sea with its modem.
pub struct Craft<'a> {
    /// Modem address.
    pub address: u8,
    /// Where it is.
    pub world: &'a mut World,
    /// Its devices, the modem among them.
    pub devices: &'a mut Devices,
}

/// A data packet in the water.
struct InWater {
    /// Place of the vehicle that sends it, or to which it goes.
    craft: usize,
    launch_us: u64,
    addresses: Addresses,
    frame: Vec<u8>,
}

/// Receiver, modem and program on the ship.
pub struct ShipEnd {
    receiver: Receiver,
    modem: MicroModem,
    from_program: Uart,
    program: Box<dyn Program>,
    /// When the program was given what it has not answered yet, µs.
    given_us: Option<u64>,
    frame: LocalFrame,
    next_step_us: u64,
    packet_us: u64,
    in_water: VecDeque<InWater>,
}

impl ShipEnd {
    /// All powered up at time zero, with this program.
    pub fn new(scenario: &Scenario, program: Box<dyn Program>) -> Self {
        let settings = &scenario.settings;
        let environment = &settings.environment;
        let frame = LocalFrame::new(environment.origin_latitude_deg, environment.origin_longitude_deg);
        let [gnss, modem] = BAUD;
        let sigma_m = settings.sensors.ship_gnss.sigma_m.unwrap_or(scenario.vehicle.sensors.ship_gnss_m);
        Self {
            receiver: Receiver::new(gnss, frame, environment.start_unix_s, settings.seed, sigma_m),
            modem: MicroModem::new(modem, environment.start_unix_s, settings.acoustics.packet_duration_s, true),
            from_program: Uart::new(modem),
            program,
            given_us: None,
            frame,
            next_step_us: 0,
            packet_us: (settings.acoustics.packet_duration_s * 1e6) as u64,
            in_water: VecDeque::new(),
        }
    }

    /// With topside in this process.
    ///
    /// # Errors
    /// As [`config`].
    pub fn with_topside(scenario: &Scenario) -> Result<Self, ConfigError> {
        Ok(Self::new(scenario, Box::new(InProcess::new(Topside::new(config(scenario)?)?))))
    }

    /// The program.
    pub fn program(&self) -> &dyn Program {
        &*self.program
    }

    /// Packets that the ship's modem did not hear because another one was under way.
    pub fn missed(&self) -> u32 {
        self.modem.missed()
    }

    /// When something next happens here by itself, µs, once the program has [answered](Self::settle).
    pub fn next_us(&self) -> u64 {
        let lines = [&self.receiver.transmitter, &self.modem.transmitter, &self.from_program];
        let lines = lines.into_iter().filter_map(Uart::next_us);
        lines.chain(self.modem.next_us()).fold(self.next_step_us, u64::min)
    }

    /// The world of one of the vehicles was sensed; packets reach the modems.
    pub fn observe(&mut self, craft: usize, observation: &Observation, sensed: &mut Craft<'_>) {
        let time_us = observation.time_us;
        let Craft { address, world, devices } = sensed;
        match &observation.kind {
            // every world has the same ship
            ObservationKind::ShipGnss { position_m } if craft == 0 => {
                self.receiver.fix(time_us, *position_m, world.ship().velocity_mps)
            }
            ObservationKind::Downlink(packet) => {
                if let (Some(heard), Some(modem)) = (self.heard(craft, time_us, packet), devices.micro_modem()) {
                    modem.hear_data(&heard);
                }
            }
            ObservationKind::Uplink(packet) => {
                if let Some(heard) = self.heard(craft, time_us, packet) {
                    self.modem.hear_data(&heard);
                }
            }
            ObservationKind::TwoWay(ping) => {
                if let Some(modem) = devices.micro_modem() {
                    let addresses = Addresses { source: SHIP, destination: *address };
                    modem.hear_reply(time_us, addresses, ping.one_way_time_s);
                }
            }
            ObservationKind::ShipTwoWay(ping) => {
                let addresses = Addresses { source: *address, destination: SHIP };
                self.modem.hear_reply(ping.reply_us, addresses, ping.one_way_time_s);
            }
            _ => {}
        }
    }

    /// The packet that was sent at that time, as the other side hears it.
    fn heard(&mut self, craft: usize, arrival_us: u64, packet: &OneWay) -> Option<Heard> {
        let OneWay { tol_us, toa_us, end_us, range_rate_mps, .. } = *packet;
        let place = self.in_water.iter().position(|packet| (packet.craft, packet.launch_us) == (craft, tol_us))?;
        let InWater { addresses, frame, .. } = self.in_water.remove(place)?;
        Some(Heard { arrival_us, toa_us, end_us, range_rate_mps, addresses, frame })
    }

    /// Lets the ship act up to `now_us`, and all modems send into the water. The program's answer is waited for by
    /// [`Self::settle`]: until then it works beside whatever else does.
    ///
    /// # Errors
    /// A program that has ended.
    pub fn run(&mut self, now_us: u64, crafts: &mut [Craft<'_>]) -> Result<(), ProgramError> {
        while let Some(Arrival { time_us, bytes }) = self.from_program.pop(now_us) {
            self.modem.receive(time_us, &bytes);
        }
        for launch in self.modem.run(now_us) {
            self.ship_sends(&launch, crafts);
        }
        for craft in 0..crafts.len() {
            let launches = crafts[craft].devices.micro_modem().map(|modem| modem.run(now_us));
            for launch in launches.unwrap_or_default() {
                self.vehicle_sends(&launch, craft, crafts);
            }
        }
        let mut arrivals = Vec::new();
        for (port, uart) in [(Port::Gnss, &mut self.receiver.transmitter), (Port::Modem, &mut self.modem.transmitter)] {
            arrivals.extend(std::iter::from_fn(|| uart.pop(now_us)).map(|arrival| (port, arrival)));
        }
        arrivals.sort_by_key(|(_, arrival)| arrival.time_us);
        let steps = now_us >= self.next_step_us;
        if steps {
            self.next_step_us = now_us - now_us % STEP_US + STEP_US;
        }
        self.program.give(now_us, &arrivals, steps)?;
        self.given_us = Some(now_us);
        Ok(())
    }

    /// Waits for what the program makes of what it was given.
    ///
    /// # Errors
    /// A program that has ended.
    pub fn settle(&mut self) -> Result<(), ProgramError> {
        let Some(given_us) = self.given_us.take() else { return Ok(()) };
        let sent = self.program.take()?;
        if !sent.is_empty() {
            self.from_program.send(given_us, &sent);
        }
        Ok(())
    }

    fn ship_sends(&mut self, launch: &Launch, crafts: &mut [Craft<'_>]) {
        for (index, Craft { address, world, devices }) in crafts.iter_mut().enumerate() {
            match &launch.sound {
                Sound::Cycle(cycle) => {
                    if let Some(modem) = devices.micro_modem() {
                        modem.hear_cycle(launch.time_us + world.flight_us(), *cycle);
                    }
                }
                Sound::Data(addresses, frame) => {
                    let report = ShipState::parse(frame).map_or(ShipReport::NONE, |state| ShipReport {
                        position_m: self.frame.to_metres(state.position_deg),
                        velocity_mps: state.velocity_mps,
                        position_sigma_m: state.position_sigma_m,
                        velocity_sigma_mps: state.velocity_sigma_mps,
                    });
                    world.transmit(Exchange::Downlink, report);
                    self.remember(index, launch.time_us, *addresses, frame);
                }
                Sound::Ping(addresses) if addresses.destination == *address => {
                    world.transmit(Exchange::ShipPing, ShipReport::NONE);
                }
                Sound::Ping(_) => {}
            }
        }
    }

    /// The ship hears a vehicle, and so do the other vehicles.
    fn vehicle_sends(&mut self, launch: &Launch, sender: usize, crafts: &mut [Craft<'_>]) {
        let sound = match &launch.sound {
            Sound::Data(addresses, frame) => Sound::Data(*addresses, crafts[sender].world.misstated(frame, self.frame)),
            other => other.clone(),
        };
        let source = crafts[sender].world.source();
        for listener in (0..crafts.len()).filter(|listener| *listener != sender) {
            let Craft { world, devices, .. } = &mut crafts[listener];
            let (Some(modem), Some(heard)) = (devices.micro_modem(), world.hear_vehicle(&source)) else { continue };
            match &sound {
                Sound::Cycle(cycle) => modem.hear_cycle(heard.arrival_us, *cycle),
                Sound::Data(addresses, frame) => modem.hear_data(&Heard {
                    arrival_us: heard.arrival_us,
                    toa_us: heard.toa_us,
                    end_us: heard.arrival_us + self.packet_us,
                    range_rate_mps: heard.range_rate_mps,
                    addresses: *addresses,
                    frame: frame.clone(),
                }),
                // the modem says nothing of a ping that is for another
                Sound::Ping(_) => {}
            }
        }
        let world = &mut *crafts[sender].world;
        let arrival_us = launch.time_us + world.flight_us();
        match &sound {
            Sound::Cycle(cycle) => self.modem.hear_cycle(arrival_us, *cycle),
            Sound::Data(addresses, frame) => {
                world.transmit(Exchange::Uplink, ShipReport::NONE);
                self.remember(sender, launch.time_us, *addresses, frame);
            }
            Sound::Ping(addresses) => {
                world.transmit(Exchange::TwoWay, ShipReport::NONE);
                self.modem.hear_ping(arrival_us, *addresses);
            }
        }
    }

    fn remember(&mut self, craft: usize, launch_us: u64, addresses: Addresses, frame: &[u8]) {
        self.in_water.retain(|packet| packet.launch_us + FORGET_US > launch_us);
        self.in_water.push_back(InWater { craft, launch_us, addresses, frame: frame.to_vec() });
    }
}
