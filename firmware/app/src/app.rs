//! The state machine: ports in, steps, ports out.

use crate::adaptation::Adaptation;
use crate::command::Commander;
use crate::decode::{AhrsLink, DvlLink, FrontseatLink, ModemLink};
use crate::estimator::Estimator;
use crate::health::{Health, Losses};
use crate::held::Held;
use crate::host::{HOST_RING, Storing, send};
use crate::mission::MissionTransfer;
use crate::modes::{Facts, Modes};
use crate::parameters::{ParameterStore, Settings};
use crate::ring::Ring;
use crate::telemetry;
use crate::time::UtcClock;
use crate::wiggle::Wiggle;
use backseat_core::control::Controller;
use backseat_core::control::mission::MissionStatus;
use backseat_core::dynamics::VehicleModel;
use backseat_wire::Counts;
use backseat_wire::hostlink::{
    self, FromBoard, Health as LinkHealth, Mode, ModeReason, Port, Restart, Step, StepDone, ToBoard,
};

/// Time between two steps, µs.
pub const STEP_US: u64 = 100_000;
/// Attitude or depth may contradict the filter for this long without a mission, µs.
const ASTRAY_US: u64 = 20_000_000;
/// Bytes that may wait for one device port: five steps of commands and requests.
const DEVICE_RING: usize = 512;
/// A buffer of this size holds any sentence to frontseat or modem.
pub(crate) const SENTENCE: usize = 96;

/// The backseat: lives in a static, never moves, never blocks, never reads a clock.
pub struct App {
    decoder: hostlink::Decoder,
    host_counts: Counts,
    pub(crate) host_out: Ring<HOST_RING>,
    announced: Option<Step>,
    pub(crate) backseat: Backseat,
}

/// Everything but the host link.
pub(crate) struct Backseat {
    pub(crate) parameters: ParameterStore,
    pub(crate) transfer: MissionTransfer,
    pub(crate) controller: Controller,
    pub(crate) estimator: Estimator,
    pub(crate) adaptation: Adaptation,
    pub(crate) frontseat: FrontseatLink,
    pub(crate) modes: Modes,
    pub(crate) clock: UtcClock,
    dvl: DvlLink,
    ahrs: AhrsLink,
    modem: ModemLink,
    pub(crate) commander: Commander,
    /// Device ports, in the order of [`Port::DEVICES`].
    out: [Ring<DEVICE_RING>; 4],
    configured: bool,
    /// A mission begins as soon as navigation is valid.
    pub(crate) armed: bool,
    /// The fins are being shown.
    pub(crate) wiggle: Held<Wiggle>,
    pub(crate) storing: Storing,
    pub(crate) last_restart: Held<Restart>,
    pub(crate) stopping: bool,
    /// Time of the last echo that was taken as input.
    pub(crate) echo_us: Option<u64>,
    pub(crate) last_step_us: Option<u64>,
    /// Parameters may be written under way until then.
    pub(crate) unlocked_us: u64,
    /// A key may come until then.
    pub(crate) key_us: u64,
    /// Reset by a fault, and no stored parameters: those in use may not be those of before.
    pub(crate) unconfigured: bool,
    digest: u64,
    pub(crate) losses: Losses,
}

impl Default for App {
    fn default() -> Self {
        Self::new()
    }
}

impl App {
    /// Default parameters, no mission, nothing received. Every byte is zero, so that a static of it takes no flash.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            decoder: hostlink::Decoder::new(),
            host_counts: Counts::new(),
            host_out: Ring::new(),
            announced: None,
            backseat: Backseat {
                parameters: ParameterStore::new(),
                transfer: MissionTransfer::new(),
                controller: Controller::new(),
                estimator: Estimator::new(),
                adaptation: Adaptation::new(),
                frontseat: FrontseatLink::new(),
                modes: Modes::new(),
                clock: UtcClock::new(),
                dvl: DvlLink::new(),
                ahrs: AhrsLink::new(),
                modem: ModemLink::new(),
                commander: Commander::new(),
                out: [const { Ring::new() }; 4],
                configured: false,
                armed: false,
                wiggle: Held::none(),
                storing: Storing::Never,
                last_restart: Held::none(),
                stopping: false,
                echo_us: None,
                last_step_us: None,
                unlocked_us: 0,
                key_us: 0,
                unconfigured: false,
                digest: 0,
                losses: Losses::new(),
            },
        }
    }

    /// Forgets everything but parameters and mission, as a power-up would.
    pub fn restart(&mut self) {
        self.backseat.restart();
    }

    /// Bytes that came in on `port`; `time_us` is the arrival of the last of them. How a stream is
    /// cut into pieces makes no difference.
    pub fn receive(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        let backseat = &mut self.backseat;
        let Backseat { parameters, estimator, clock, frontseat, dvl, ahrs, modem, .. } = backseat;
        let settings = &parameters.active().app;
        match port {
            Port::Frontseat => frontseat.receive(time_us, bytes, settings, clock, estimator),
            Port::Dvl => dvl.receive(time_us, bytes, settings, estimator),
            Port::Ahrs => ahrs.receive(time_us, bytes, settings, estimator),
            Port::Modem => modem.receive(time_us, bytes, settings, clock, estimator),
            Port::Host => {
                let mut rest = bytes;
                while let Some(outcome) = self.decoder.feed(&mut rest) {
                    let Ok(frame) = outcome else { continue };
                    match self.host_counts.note(frame.message::<ToBoard<'_>>()) {
                        Ok(ToBoard::Step(step)) => self.announced = Some(step),
                        Ok(request) => backseat.request(&request, &mut self.host_out),
                        Err(_) => {}
                    }
                }
            }
        }
    }

    /// An edge of the pulse-per-second input.
    pub fn pps(&mut self, time_us: u64) {
        self.backseat.clock.edge(time_us);
    }

    /// Navigates, steers and reports; every 0.1 s. A step that is not after the last does nothing.
    pub fn step(&mut self, time_us: u64) {
        if self.backseat.step(time_us) {
            self.backseat.report(time_us, &mut self.host_out);
        }
    }

    /// Bytes that wait to be sent on `port`, oldest first (a part of them where the ring wraps).
    #[must_use]
    pub fn transmit(&self, port: Port) -> &[u8] {
        self.backseat.ring(port).map_or(self.host_out.front(), Ring::front)
    }

    /// The first `count` bytes of [`Self::transmit`] were handed to the port.
    pub fn transmitted(&mut self, port: Port, count: usize) {
        match self.backseat.ring_mut(port) {
            Some(ring) => ring.consume(count),
            None => self.host_out.consume(count),
        }
    }

    /// How many bytes wait to be sent on `port`.
    #[must_use]
    pub fn waiting(&self, port: Port) -> usize {
        self.backseat.ring(port).map_or(self.host_out.len(), Ring::len)
    }

    /// The lock-step clock message that came in on the host port, once.
    pub fn take_announced(&mut self) -> Option<Step> {
        self.announced.take()
    }

    /// Queues the answer to a lock-step clock message.
    pub fn answer_step(&mut self, done: StepDone) {
        send(&mut self.host_out, &FromBoard::StepDone(done));
    }

    /// Running digest of filter state and covariance.
    #[must_use]
    pub fn digest(&self) -> u64 {
        self.backseat.digest
    }

    /// The active parameters.
    #[must_use]
    pub fn parameters(&self) -> &Settings {
        self.backseat.parameters.active()
    }

    /// Mode and its reason, as the last step's telemetry has them.
    #[must_use]
    pub fn mode(&self) -> (Mode, ModeReason) {
        self.backseat.modes.present()
    }

    /// Counters of what was received, refused and dropped.
    #[must_use]
    pub fn health(&self) -> Health<'_> {
        Health::new(self)
    }

    /// The key may be on its way: what the host port receives is not for any log.
    pub(crate) fn expects_key(&self) -> bool {
        self.backseat.expects_key()
    }

    pub(crate) fn estimator(&self) -> &Estimator {
        &self.backseat.estimator
    }

    pub(crate) fn dvl(&self) -> &DvlLink {
        &self.backseat.dvl
    }

    pub(crate) fn ahrs(&self) -> &AhrsLink {
        &self.backseat.ahrs
    }

    pub(crate) fn clock(&self) -> &UtcClock {
        &self.backseat.clock
    }

    pub(crate) fn unsent(&self, port: Port) -> u32 {
        self.backseat.ring(port).map_or(self.host_out.dropped(), Ring::dropped)
    }

    pub(crate) fn accepted(&self, port: Port) -> u32 {
        if port == Port::Host { self.host_counts.accepted() } else { self.backseat.accepted(port) }
    }

    /// What a port's decoders counted: frames, and what was wrong inside good frames.
    pub(crate) fn counts(&self, port: Port) -> [&Counts; 2] {
        match port {
            Port::Host => [self.decoder.counts(), &self.host_counts],
            _ => self.backseat.counts(port),
        }
    }
}

/// Builds filter and controller from settings; false when one of them refuses.
pub(crate) fn configure(settings: &Settings, estimator: &mut Estimator, controller: &mut Controller) -> bool {
    let Ok(model) = VehicleModel::new(&settings.vehicle) else { return false };
    estimator.configure(settings, &model).is_ok() && controller.configure(&settings.control, &model).is_ok()
}

impl Backseat {
    fn ring(&self, port: Port) -> Option<&Ring<DEVICE_RING>> {
        self.out.get(port as usize)
    }

    fn ring_mut(&mut self, port: Port) -> Option<&mut Ring<DEVICE_RING>> {
        self.out.get_mut(port as usize)
    }

    pub(crate) fn push(&mut self, port: Port, bytes: &[u8]) {
        if let Some(ring) = self.ring_mut(port) {
            ring.push(bytes);
        }
    }

    fn counts(&self, port: Port) -> [&Counts; 2] {
        static NONE: Counts = Counts::new();
        let app = &self.parameters.active().app;
        match port {
            Port::Frontseat => self.frontseat.counts(),
            Port::Dvl => [self.dvl.counts(app.dvl_source), &NONE],
            Port::Ahrs => self.ahrs.counts(app.ahrs_protocol),
            Port::Modem => self.modem.counts(),
            Port::Host => [&NONE, &NONE],
        }
    }

    fn accepted(&self, port: Port) -> u32 {
        match port {
            Port::Frontseat => self.frontseat.counts()[1].accepted(),
            Port::Modem => self.modem.counts()[1].accepted(),
            Port::Dvl => self.dvl.samples(),
            Port::Ahrs => self.ahrs.samples(),
            Port::Host => 0,
        }
    }

    fn rejected(&self) -> [u32; 4] {
        Port::DEVICES
            .map(|port| self.counts(port).iter().fold(0_u32, |sum, counts| sum.saturating_add(counts.rejected())))
    }

    /// The counters that the host link carries.
    pub(crate) fn health(&self) -> LinkHealth {
        LinkHealth {
            accepted_frames: Port::DEVICES.map(|port| self.accepted(port)),
            rejected_frames: self.rejected(),
            pps_edges: self.clock.edges(),
            synchronised: self.clock.is_fine(),
            receive_losses: self.losses.since_start(),
        }
    }

    fn restart(&mut self) {
        self.reset_links();
        self.frontseat = FrontseatLink::new();
        self.modes = Modes::new();
        self.clock = UtcClock::new();
        self.commander = Commander::new();
        self.controller.stop();
        self.estimator.reset();
        self.adaptation.restart();
        self.out.iter_mut().for_each(Ring::clear);
        self.configured = false;
        self.armed = false;
        self.wiggle.clear();
        self.stopping = false;
        self.echo_us = None;
        self.last_step_us = None;
        (self.unlocked_us, self.key_us) = (0, 0);
        self.digest = 0;
    }

    /// Devices whose settings may have changed start afresh.
    pub(crate) fn reset_links(&mut self) {
        self.dvl.configure(&self.parameters.active().app);
        self.ahrs = AhrsLink::new();
        self.modem = ModemLink::new();
    }

    /// One step; false when it is not after the last.
    fn step(&mut self, now_us: u64) -> bool {
        if self.last_step_us.is_some_and(|last_us| now_us <= last_us) {
            return false;
        }
        self.last_step_us = Some(now_us);
        if !self.configured {
            // the active set was checked when it was committed; the defaults are valid
            self.configured = configure(self.parameters.active(), &mut self.estimator, &mut self.controller);
        }
        self.hear_echo();
        let failed = self.estimator.step(now_us, self.parameters.active(), &self.clock).is_err();
        // Before it is initialised the filter holds what was before, or nothing.
        if self.estimator.navigator().is_initialised() {
            self.digest = self.estimator.navigator().digest_from(self.digest);
        }
        if self.modes.update(now_us, &self.facts(now_us, failed), &self.parameters.active().app) {
            self.hand_back(now_us);
        }
        if self.armed && self.modes.ready() {
            // an empty mission was refused when it was armed
            self.armed = self.controller.start(self.estimator.navigator().state()).is_err();
        }
        // Nobody relies on it, and it does not agree with its sensors: it starts again from them.
        let astray = self.estimator.unsteerable_since_us().is_some_and(|us| now_us.saturating_sub(us) > ASTRAY_US);
        if failed || (astray && !self.under_way() && self.estimator.has_fix(now_us)) {
            self.configured = false;
        }
        self.steer(now_us);
        self.ask(now_us);
        self.adapt(now_us);
        true
    }

    fn facts(&self, now_us: u64, failed: bool) -> Facts {
        let navigator = self.estimator.navigator();
        let samples = self.estimator.samples();
        let age = |time_us: Option<u64>| time_us.map(|us| now_us.saturating_sub(us));
        let initialised = !failed && navigator.is_initialised();
        Facts {
            failed,
            initialised,
            attitude_age_us: age(samples.euler_rad.map(|(us, _)| us)),
            depth_age_us: age(samples.depth_m.map(|(us, _)| us)),
            frontseat_age_us: age(self.frontseat.last_us()),
            refused_us: age(self.frontseat.refused_since_us()),
            position_sigma_m: if initialised { navigator.horizontal_sigma_m() } else { f64::INFINITY },
            resumed: self.unconfigured || self.estimator.resumed().is_some(),
            suspect: self.estimator.is_suspect(),
            unsteerable_us: age(self.estimator.unsteerable_since_us()),
            mission: self.under_way(),
        }
    }

    /// Requests and configuration that are due.
    fn ask(&mut self, now_us: u64) {
        let mut buffer = [0; SENTENCE];
        let Self { frontseat, modem, ahrs, parameters, out: [to_frontseat, _, to_ahrs, to_modem], .. } = self;
        let app = &parameters.active().app;
        if let Ok(Some(sentence)) = frontseat.request(now_us, app, &mut buffer) {
            to_frontseat.push(sentence);
        }
        if let Some(sentence) = modem.configure(now_us, app, &mut buffer) {
            to_modem.push(sentence);
        }
        ahrs.ask(now_us, app.ahrs_protocol, |bytes| to_ahrs.push(bytes));
    }

    /// Telemetry of the step: each fusion, then the step itself.
    fn report(&mut self, now_us: u64, out: &mut Ring<HOST_RING>) {
        if self.losses.take_news() {
            send(out, &FromBoard::Health(self.health()));
        }
        for record in self.estimator.records() {
            send(out, &FromBoard::Fusion(telemetry::fusion(record)));
        }
        if let Some(ship) = self.estimator.take_ship() {
            send(out, &FromBoard::Ship(telemetry::ship(now_us, &ship)));
        }
        let leg = match self.controller.status() {
            MissionStatus::Leg(leg) => Some(leg),
            MissionStatus::Idle | MissionStatus::Finished => None,
        };
        let utc_us = self.clock.utc_us(now_us);
        let record = telemetry::record(
            now_us,
            utc_us,
            self.modes.present(),
            &self.estimator,
            self.estimator.input(),
            leg,
            self.rejected(),
        );
        send(out, &FromBoard::Telemetry(record));
        if let Some(identification) = self.adaptation.report(now_us) {
            send(out, &FromBoard::Identification(identification));
        }
        while let Some(verdict) = self.adaptation.adoptions.take_verdict() {
            send(out, &FromBoard::Adoption(verdict));
        }
    }
}
