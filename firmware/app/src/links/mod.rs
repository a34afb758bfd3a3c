//! One link per device port: bytes to raw samples, and the requests to the device.
//!
//! A link knows protocols and units but not the installation: samples are in the sensor's own axes, stamped with their
//! arrival or with the time that the device gives. [`inputs`](crate::inputs) does the rest.

mod ahrs;
mod dvl;
mod frontseat;
mod modem;

pub(crate) use frontseat::FrontseatLink;

use crate::inputs::{Latest, SensorSample, Stamp};
use crate::parameters::AppSettings;
use crate::time::UtcClock;
use ahrs::AhrsLink;
use backseat_core::dynamics::ActuatorInput;
use backseat_wire::Counts;
use backseat_wire::abort::Abort;
use backseat_wire::ahrs::AhrsSample;
use backseat_wire::dvl::DvlSample;
use backseat_wire::hostlink::Port;
use backseat_wire::iver::ServoBytes;
use dvl::DvlLink;
use modem::ModemLink;

/// The four device ports.
pub struct Links {
    pub(crate) frontseat: FrontseatLink,
    dvl: DvlLink,
    ahrs: AhrsLink,
    pub(crate) modem: ModemLink,
}

impl Links {
    /// Before the first byte.
    #[must_use]
    pub const fn new() -> Self {
        Self { frontseat: FrontseatLink::new(), dvl: DvlLink::new(), ahrs: AhrsLink::new(), modem: ModemLink::new() }
    }

    /// Devices whose settings may have changed start afresh; the frontseat is heard on.
    pub fn configure(&mut self, settings: &AppSettings) {
        self.dvl.configure(settings);
        self.ahrs = AhrsLink::new();
        self.modem = ModemLink::new();
    }

    /// Decodes bytes of a device port, the last of which arrived at `time_us`. Labels of UTC go to `clock`, samples to
    /// `sink`. The host port carries none.
    pub fn receive(
        &mut self,
        port: Port,
        time_us: u64,
        bytes: &[u8],
        settings: &AppSettings,
        clock: &mut UtcClock,
        mut sink: impl FnMut(Stamp, SensorSample),
    ) {
        match port {
            Port::Frontseat => self.frontseat.receive(time_us, bytes, settings, clock, &mut sink),
            Port::Dvl => self.dvl.receive(time_us, bytes, settings, &mut sink),
            Port::Ahrs => self.ahrs.receive(time_us, bytes, settings, &mut sink),
            Port::Modem => self.modem.receive(time_us, bytes, settings, clock, &mut sink),
            Port::Host => {}
        }
    }

    /// The last authentic abort, once, whoever it is for.
    pub(crate) fn take_abort(&mut self) -> Option<Abort> {
        self.modem.take_abort()
    }

    /// Requests and configuration that are due, each with its port.
    pub(crate) fn ask(&mut self, now_us: u64, settings: &AppSettings, mut send: impl FnMut(Port, &[u8])) {
        let mut buffer = [0; crate::SENTENCE];
        if let Ok(Some(sentence)) = self.frontseat.request(now_us, settings, &mut buffer) {
            send(Port::Frontseat, sentence);
        }
        if let Some(sentence) = self.modem.configure(now_us, settings, &mut buffer) {
            send(Port::Modem, sentence);
        }
        self.ahrs.ask(now_us, settings.ahrs_protocol, |bytes| send(Port::Ahrs, bytes));
    }

    /// Actuator input of the frontseat's last echo of its servo bytes, and the echo's arrival, µs.
    #[must_use]
    pub fn echo(&self, settings: &AppSettings) -> Option<(u64, ActuatorInput)> {
        self.frontseat.status.echo.map(|(time_us, bytes)| (time_us, actuators_of(&bytes, settings)))
    }

    /// Counters of a port's decoders: frames, and errors inside good frames.
    pub(crate) fn counts(&self, port: Port, settings: &AppSettings) -> [&Counts; 2] {
        static NONE: Counts = Counts::new();
        match port {
            Port::Frontseat => self.frontseat.counts(),
            Port::Dvl => [self.dvl.counts(settings.dvl_source), &NONE],
            Port::Ahrs => self.ahrs.counts(settings.ahrs_protocol),
            Port::Modem => self.modem.counts(),
            Port::Host => [&NONE, &NONE],
        }
    }

    /// Good sentences of frontseat and modem, samples of DVL and AHRS.
    pub(crate) fn accepted(&self, port: Port) -> u32 {
        match port {
            Port::Frontseat => self.frontseat.counts()[1].accepted(),
            Port::Modem => self.modem.counts()[1].accepted(),
            Port::Dvl => self.dvl.samples,
            Port::Ahrs => self.ahrs.samples,
            Port::Host => 0,
        }
    }

    /// Frames that each device port refused, in the order of [`Port::DEVICES`].
    pub(crate) fn rejected(&self, settings: &AppSettings) -> [u32; 4] {
        Port::DEVICES.map(|port| {
            self.counts(port, settings).iter().fold(0_u32, |sum, counts| sum.saturating_add(counts.rejected()))
        })
    }

    pub(crate) fn dvl_sample(&self) -> Option<&DvlSample> {
        self.dvl.last()
    }

    /// The DVL's last altitude, and its arrival, µs.
    pub(crate) fn dvl_altitude_m(&self) -> Latest<f64> {
        self.dvl.altitude_m
    }

    pub(crate) fn ahrs_sample(&self) -> Option<&AhrsSample> {
        self.ahrs.last()
    }
}

/// Actuator input that servo bytes give: the quantised command.
pub(crate) fn actuators_of(bytes: &ServoBytes, settings: &AppSettings) -> ActuatorInput {
    ActuatorInput { propeller_radps: settings.servo.propeller_radps(bytes), fins_rad: settings.servo.fins_rad(bytes) }
}
