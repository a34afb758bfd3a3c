//! Emulated devices: observations of the world in, bytes on serial lines out, and commands obeyed.
//!
//! Each device speaks its protocol through `backseat_wire`, the same file that the firmware reads
//! with; outside vectors in that crate's tests keep the two from being wrong together.

mod ahrs;
mod dvl;
mod frontseat;
mod geodesy;
mod modem;
mod uart;

pub use dvl::MOUNTING_RAD as DVL_MOUNTING_RAD;
pub use geodesy::LocalFrame;
pub use uart::Arrival;

use crate::observation::Observation;
use crate::scenario::Scenario;
use crate::world::ActuatorTargets;
use ahrs::Ahrs;
use backseat_wire::hostlink::Port;
use dvl::Dvl;
use frontseat::Frontseat;
use modem::Modem;
use uart::Uart;

/// Baud rates of the four device lines, in the order of [`Port::DEVICES`].
const BAUD: [u32; 4] = [19_200, 115_200, 115_200, 19_200];

/// The four devices and the lines from the backseat to them.
pub struct Devices {
    frontseat: Frontseat,
    dvl: Dvl,
    ahrs: Ahrs,
    modem: Modem,
    from_backseat: [Uart; 4],
}

impl Devices {
    /// All devices, powered up at time zero.
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let [frontseat, dvl, ahrs, modem] = BAUD;
        let environment = &scenario.settings.environment;
        let frame = LocalFrame::new(environment.origin_latitude_deg, environment.origin_longitude_deg);
        let start_unix_s = environment.start_unix_s;
        let declination_rad = environment.magnetic_declination_rad;
        Self {
            frontseat: Frontseat::new(frontseat, frame, start_unix_s, declination_rad),
            dvl: Dvl::new(dvl),
            ahrs: Ahrs::new(ahrs, declination_rad),
            modem: Modem::new(modem, frame, start_unix_s, &scenario.settings),
            from_backseat: BAUD.map(Uart::new),
        }
    }

    /// The world was observed.
    pub fn observe(&mut self, observation: &Observation) {
        self.frontseat.observe(observation);
        self.dvl.observe(observation);
        self.ahrs.observe(observation);
        self.modem.observe(observation);
    }

    /// The backseat began to send `bytes` at `time_us`.
    pub fn sent_by_backseat(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        if let Some(line) = self.from_backseat.get_mut(port as usize) {
            line.send(time_us, bytes);
        }
    }

    /// When something next happens by itself or arrives at a device, µs.
    #[must_use]
    pub fn next_us(&self) -> Option<u64> {
        let lines = self.from_backseat.iter().filter_map(Uart::next_us);
        lines.chain(self.frontseat.next_us()).chain(self.modem.next_us()).min()
    }

    /// Lets the devices act up to `now_us`; what fins and propeller are told from then on.
    pub fn run(&mut self, now_us: u64) -> ActuatorTargets {
        while let Some(arrival) = self.from_backseat[Port::Frontseat as usize].pop(now_us) {
            self.frontseat.receive(arrival.time_us, &arrival.bytes);
        }
        while let Some(arrival) = self.from_backseat[Port::Ahrs as usize].pop(now_us) {
            self.ahrs.receive(arrival.time_us, &arrival.bytes);
        }
        while let Some(arrival) = self.from_backseat[Port::Modem as usize].pop(now_us) {
            self.modem.receive(arrival.time_us, &arrival.bytes);
        }
        while self.from_backseat[Port::Dvl as usize].pop(now_us).is_some() {} // it streams, unasked
        self.modem.run(now_us);
        self.frontseat.targets(now_us)
    }

    /// What has arrived at the backseat up to `until_us`, in order of arrival (ties in port order).
    pub fn arrivals(&mut self, until_us: u64) -> Vec<(Port, Arrival)> {
        let mut arrivals = Vec::new();
        for port in Port::DEVICES {
            let line = match port {
                Port::Frontseat => &mut self.frontseat.transmitter,
                Port::Dvl => &mut self.dvl.transmitter,
                Port::Ahrs => &mut self.ahrs.transmitter,
                Port::Modem | Port::Host => &mut self.modem.transmitter,
            };
            while let Some(arrival) = line.pop(until_us) {
                arrivals.push((port, arrival));
            }
        }
        arrivals.sort_by_key(|(_, arrival)| arrival.time_us);
        arrivals
    }
}
