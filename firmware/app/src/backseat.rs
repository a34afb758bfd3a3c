//! Everything but the host link: the components, and the one place where their decisions are carried out.
//!
//! ```text
//! bytes ─> links ─> inputs ─> estimator ─┬─> modes, safety > end of a mission ─┐
//!           │ ^                          ├─> steering ───> sentences, input ─┼─> Backseat::step applies
//!           │ └── requests               ├─> adaptation                       │
//!           └─> echo ─> steering         └─> telemetry
//! ```
//! Components know the components to their left at most, own their state and return decisions.

mod acting;
mod ending;

use crate::adaptation::Adaptation;
use crate::consequences::Consequences;
use crate::drivers::Drivers;
use crate::estimator::{Estimator, FilterPlace};
use crate::host::{HOST_RING, Host, report};
use crate::inputs::Inputs;
use crate::inputs::installation::horizon_us;
use crate::last_resort::LastResort;
use crate::late::LateSteps;
use crate::learning::Learning;
use crate::links::Links;
use crate::modes::{ModeFacts, Modes};
use crate::parameters::{ParameterStore, Settings};
use crate::ring::Ring;
use crate::safety::{Fence, Observed, SafetyMonitor};
use crate::separation::Separation;
use crate::steering::{Orders, Situation, Steering};
use crate::storage::{Asked, Storage};
use crate::telemetry;
use crate::time::{STEP_US, UtcClock};
use crate::updates::Updates;
use crate::uplink::Uplink;
use backseat_core::dynamics::VehicleModel;
use backseat_core::state::Z;
use backseat_wire::hostlink::{self, FromBoard, Port, Refusal};

/// Attitude or depth may contradict the filter for this long without a mission, µs; then it starts anew.
const CONTRADICTION_US: u64 = 20_000_000;
/// Time between two reports of the robust filter's estimates, µs.
const ESTIMATES_US: u64 = 10_000_000;
/// Deeper than this the vehicle is under water, m.
const SUBMERGED_M: f64 = 1.0;
/// Bytes that may wait for one device port: five steps of commands and requests.
const DEVICE_RING: usize = 512;

/// The components.
pub struct Backseat {
    pub parameters: ParameterStore,
    pub storage: Storage,
    pub updates: Updates,
    pub clock: UtcClock,
    pub links: Links,
    pub inputs: Inputs,
    pub estimator: Estimator,
    pub adaptation: Adaptation,
    pub consequences: Consequences,
    pub separation: Separation,
    pub learning: Learning,
    pub modes: Modes,
    pub steering: Steering,
    pub safety: SafetyMonitor,
    pub last_resort: LastResort,
    /// Of the stored mission.
    pub fence: Fence,
    pub uplink: Uplink,
    pub host: Host,
    pub drivers: Drivers,
    /// Bytes to the device ports, in the order of [`Port::DEVICES`].
    out: [Ring<DEVICE_RING>; 4],
    state: StepState,
    /// Reset by a fault without stored parameters: those in use may differ from those before the reset.
    pub unconfigured: bool,
}

/// State that a restart clears.
#[derive(Clone, Copy, Debug)]
struct StepState {
    /// Filter and controller are built from the active parameters.
    configured: bool,
    last_step_us: Option<u64>,
    /// Steps a whole step late or more, and the latest of them, µs.
    late: LateSteps,
    digest: u64,
}

impl StepState {
    const NONE: Self = Self { configured: false, last_step_us: None, late: LateSteps::NONE, digest: 0 };
}

impl Backseat {
    pub const fn new(filter: FilterPlace) -> Self {
        Self {
            parameters: ParameterStore::new(),
            storage: Storage::new(),
            updates: Updates::new(),
            clock: UtcClock::new(),
            links: Links::new(),
            inputs: Inputs::new(),
            estimator: Estimator::new(filter),
            adaptation: Adaptation::new(),
            consequences: Consequences::new(),
            separation: Separation::new(),
            learning: Learning::new(),
            modes: Modes::new(),
            steering: Steering::new(),
            safety: SafetyMonitor::new(),
            last_resort: LastResort::new(),
            fence: Fence::new(),
            uplink: Uplink::new(),
            host: Host::new(),
            drivers: Drivers::NONE,
            out: [const { Ring::new() }; 4],
            state: StepState::NONE,
            unconfigured: false,
        }
    }

    /// Forgets everything but parameters and mission.
    pub fn restart(&mut self) {
        self.links = Links::new();
        self.links.configure(&self.parameters.active().app);
        self.clock.restart();
        self.inputs.clear();
        self.estimator.reset();
        self.adaptation.restart();
        self.consequences = Consequences::new();
        self.separation = Separation::new();
        self.learning = Learning::new();
        self.modes = Modes::new();
        self.steering.restart();
        self.safety.restart();
        self.last_resort = LastResort::new();
        self.uplink = Uplink::new();
        self.host.restart();
        self.out.iter_mut().for_each(Ring::clear);
        self.state = StepState::NONE;
    }

    /// Bytes of a device port.
    pub fn receive(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        let Self { parameters, clock, links, inputs, .. } = self;
        let settings = &parameters.active().app;
        links.receive(port, time_us, bytes, settings, clock, |stamp, sample| {
            inputs.take(stamp, sample, &settings.installation);
        });
    }

    pub fn ring(&self, port: Port) -> Option<&Ring<DEVICE_RING>> {
        self.out.get(port as usize)
    }

    pub fn ring_mut(&mut self, port: Port) -> Option<&mut Ring<DEVICE_RING>> {
        self.out.get_mut(port as usize)
    }

    /// Running digest of filter state and covariance.
    pub fn digest(&self) -> u64 {
        self.state.digest
    }

    pub fn last_step_us(&self) -> Option<u64> {
        self.state.last_step_us
    }

    /// Time of the last step, µs; 0 before the first.
    pub fn now_us(&self) -> u64 {
        self.state.last_step_us.unwrap_or(0)
    }

    /// One step; false when it is not after the last.
    pub fn step(&mut self, now_us: u64) -> bool {
        if self.state.last_step_us.is_some_and(|last_us| now_us <= last_us) {
            return false;
        }
        let since_last_us = self.state.last_step_us.map_or(0, |last_us| now_us - last_us);
        self.drivers.news |= self.state.late.note(since_last_us);
        self.state.last_step_us = Some(now_us);
        let rests = self.modes.rests;
        if !self.state.configured && !rests {
            // the active set was checked when it was committed; the defaults are valid
            self.state.configured = configure(self.parameters.active(), &mut self.estimator, &mut self.steering);
        }
        let failed = self.navigate(now_us, rests);
        self.draw_consequences(now_us);
        let mut orders = Orders::default();
        self.judge(now_us, failed, &mut orders);
        self.depart(now_us);
        self.steer(now_us, &mut orders);
        self.carry_out(&orders);
        self.ask(now_us);
        self.call(now_us);
        self.adapt();
        self.learn();
        self.store();
        true
    }

    /// The filter's part of the step, unless it rests; whether it failed.
    #[inline(never)]
    fn navigate(&mut self, now_us: u64, rests: bool) -> bool {
        let Self { parameters, links, inputs, estimator, steering, .. } = self;
        let settings = parameters.active();
        if let Some((time_us, input)) = steering.hear_echo(links.frontseat.status.echo, &settings.app) {
            inputs.command(time_us, &input);
        }
        estimator.declare(&settings.app, links.frontseat.status.hdop);
        let failed = !rests && estimator.step(now_us, inputs, settings, &self.clock).is_err();
        // Before it is initialised the filter holds an old state, or none.
        if estimator.navigator().is_initialised() {
            self.state.digest = estimator.navigator().digest_from(self.state.digest);
        }
        failed
    }

    /// The mode of the step, and what follows from it.
    #[inline(never)]
    fn judge(&mut self, now_us: u64, failed: bool, orders: &mut Orders) {
        let last_facts = self.last_resort_facts(now_us);
        let facts = self.facts(now_us, failed);
        let settings = &self.parameters.active().app;
        let reported = self.last_resort.report(&settings.fittings);
        self.last_resort.observe(&last_facts, &settings.fittings);
        if self.modes.update(now_us, &facts, settings) {
            self.last_resort.abort();
            self.steering.hand_back(now_us, settings, orders);
        }
        self.apply_abort(now_us, orders);
        if self.modes.ready() && self.steering.armed {
            match self.safety.may_start(&self.observed()) {
                Ok(()) => self.steering.begin(&self.estimator.output),
                Err(reason) => {
                    self.steering.disarm();
                    self.modes.ended_by(reason);
                }
            }
        }
        self.apply_safety(now_us, orders);
        self.decide_last_resort(&last_facts, &reported);
        // No mission relies on it, and it contradicts its sensors: it starts again from them.
        let since_us = self.estimator.unsteerable_since_us();
        let contradicts = since_us.is_some_and(|us| now_us.saturating_sub(us) > CONTRADICTION_US);
        let idle = !self.steering.under_way();
        if failed || (contradicts && idle && self.estimator.has_fix(self.horizon_us(now_us), &self.inputs)) {
            self.state.configured = false;
        }
    }

    /// What the limits of safety are judged by.
    pub fn observed(&self) -> Observed<'_> {
        let Self { parameters, clock, links, inputs, estimator, steering, fence, last_resort, modes, .. } = self;
        let (settings, degraded) = (&parameters.active().app, modes.is_degraded());
        Observed { settings, clock, links, inputs, estimator, steering, fence, last_resort, degraded }
    }

    /// The filter's time at `now_us`.
    fn horizon_us(&self, now_us: u64) -> u64 {
        now_us.saturating_sub(horizon_us(&self.parameters.active().app.installation))
    }

    fn facts(&self, now_us: u64, failed: bool) -> ModeFacts {
        let navigator = self.estimator.navigator();
        let samples = &self.inputs.latest;
        let frontseat = &self.links.frontseat;
        let age = |time_us: Option<u64>| time_us.map(|us| now_us.saturating_sub(us));
        // a sample is fused when the horizon reaches it
        let sample_age = |time_us: Option<u64>| time_us.map(|us| self.horizon_us(now_us).saturating_sub(us));
        let initialised = !failed && navigator.is_initialised();
        ModeFacts {
            failed,
            initialised,
            attitude_age_us: sample_age(samples.euler_rad.map(|(us, _)| us)),
            depth_age_us: sample_age(samples.depth_m.map(|(us, _)| us)),
            frontseat_age_us: age(frontseat.status.last_us),
            refused_us: age(frontseat.status.refused_since_us.or(self.steering.disobeyed_since_us)),
            position_sigma_m: if initialised { self.estimator.stated_sigma_m() } else { f64::INFINITY },
            level_m: self.estimator.level().map_or([f64::INFINITY; 2], |level| [level.horizontal_m, level.vertical_m]),
            resumed: self.unconfigured || self.estimator.resumed.is_some(),
            suspect: self.estimator.is_suspect(),
            unsteerable_us: age(self.estimator.unsteerable_since_us()),
            overloaded: self.state.late.is_overloaded(),
            mission: self.steering.under_way(),
        }
    }

    #[inline(never)]
    fn steer(&mut self, now_us: u64, orders: &mut Orders) {
        let situation = Situation {
            now_us,
            x: &self.estimator.output,
            current_mps: self.estimator.navigator().current(),
            stop_acknowledged_us: self.links.frontseat.status.stop_acknowledged_us,
        };
        self.steering.steer(&situation, &self.parameters.active().app, orders);
    }

    fn carry_out(&mut self, orders: &Orders) {
        let [to_frontseat, ..] = &mut self.out;
        orders.sentences.iter().for_each(|sentence| to_frontseat.push(sentence));
        if let Some((time_us, input)) = &orders.actuators {
            self.inputs.command(*time_us, input);
        }
        if orders.stop_unanswered {
            self.modes.stop_unanswered();
        }
    }

    /// Requests and configuration that are due.
    #[inline(never)]
    fn ask(&mut self, now_us: u64) {
        let Self { links, parameters, out, .. } = self;
        links.ask(now_us, &parameters.active().app, |port, bytes| {
            if let Some(ring) = out.get_mut(port as usize) {
                ring.push(bytes);
            }
        });
    }

    /// The vehicle's slots of the acoustic cycle.
    #[inline(never)]
    fn call(&mut self, now_us: u64) {
        let Self { uplink, links, parameters, estimator, clock, modes, out, .. } = self;
        let settings = &parameters.active().app;
        let mut buffer = [0; crate::SENTENCE];
        let sentence = match links.modem.take_request() {
            Some(request) => {
                let (mode, _) = modes.present();
                let synchronous = links.modem.synchronous && clock.carries_ranges(now_us);
                uplink.answer(&request, now_us, (clock, synchronous, mode as u8), estimator, settings, &mut buffer)
            }
            None => uplink.due(now_us, clock, settings, &mut buffer),
        };
        if let (Some(sentence), Some(ring)) = (sentence, out.get_mut(Port::Modem as usize)) {
            ring.push(sentence);
        }
    }

    /// One step of the identifier.
    #[inline(never)]
    fn adapt(&mut self) {
        let Self { adaptation, inputs, estimator, parameters, steering, .. } = self;
        adaptation.step(steering.under_way(), inputs, estimator.navigator(), parameters.active());
    }

    /// At the end of a dive, keeps what the filter has learnt of the vehicle; not from a filter that contradicts its
    /// sensors, nor of a vehicle with a fault, which is another after its repair.
    #[inline(never)]
    fn learn(&mut self) {
        let Self { learning, steering, estimator, adaptation, consequences, parameters, .. } = self;
        let submerged = estimator.output[Z] > SUBMERGED_M;
        if !learning.ends(steering.under_way(), submerged)
            || estimator.is_doubted()
            || estimator.resumed.is_some()
            || adaptation.has_fault()
            || consequences.is_used()
        {
            return;
        }
        let dives = parameters.active().learnt.dives.saturating_add(1);
        if let Some(learnt) = estimator.navigator().main().learnt(dives)
            && parameters.learn(&learnt)
        {
            learning.kept();
        }
    }

    /// Flash is never erased under way: what was learnt is stored when no mission is.
    fn store(&mut self) {
        if self.steering.is_engaged() || self.steering.is_wiggling() || !self.storage.is_idle() {
            return;
        }
        if self.learning.take_to_store() {
            // idle a line ago
            let _ = self.storage.request(Asked::Learning);
        }
    }

    /// Telemetry of the step: each fusion, then the step itself.
    #[inline(never)]
    pub fn report(&mut self, now_us: u64, out: &mut Ring<HOST_RING>) {
        if core::mem::take(&mut self.drivers.news) {
            report(out, &FromBoard::Health(self.link_health()));
        }
        for record in &self.estimator.records {
            report(out, &FromBoard::Fusion(telemetry::fusion(record)));
        }
        if let Some(ship) = self.estimator.take_ship() {
            report(out, &FromBoard::Ship(telemetry::ship(now_us, &ship)));
        }
        let record = telemetry::record(
            now_us,
            self.clock.utc_us(now_us),
            self.modes.present(),
            &self.estimator,
            self.inputs.actuators.at(now_us),
            self.steering.leg(),
            self.links.rejected(&self.parameters.active().app),
        );
        report(out, &FromBoard::Telemetry(record));
        if let Some(steered) = self.steering.take_steered(now_us) {
            report(out, &FromBoard::Steered(steered));
        }
        if let Some(identification) = self.adaptation.report(now_us) {
            report(out, &FromBoard::Identification(identification));
        }
        if let Some(stored) = self.learning.take_report() {
            report(out, &FromBoard::LearntStored(stored));
        }
        if let Some(fault) = self.adaptation.fault_report(now_us) {
            report(out, &FromBoard::Fault(fault));
        }
        if let Some(statement) = self.consequences.told.take() {
            let (decision, question) = (self.consequences.decision(), self.separation.question());
            report(out, &FromBoard::Naming(telemetry::naming(&statement, decision, question)));
        }
        self.report_estimates(now_us, out);
    }

    #[inline(never)]
    fn report_estimates(&self, now_us: u64, out: &mut Ring<HOST_RING>) {
        if now_us % ESTIMATES_US >= STEP_US {
            return;
        }
        let dives = self.parameters.active().learnt.dives;
        if let Some(estimates) = telemetry::estimates(now_us, self.estimator.navigator(), dives) {
            report(out, &FromBoard::Estimates(estimates));
        }
    }

    /// The counters that the host link carries.
    pub fn link_health(&self) -> hostlink::Health {
        hostlink::Health {
            accepted_frames: Port::DEVICES.map(|port| self.links.accepted(port)),
            rejected_frames: self.links.rejected(&self.parameters.active().app),
            pps_edges: self.clock.edges,
            synchronised: self.clock.fine,
            receive_losses: self.drivers.receive_losses,
            oscillator: self.clock.oscillator,
            log: self.drivers.log,
            late_steps: self.state.late.count,
            latest_step_us: self.state.late.latest_us,
            hardware: self.drivers.hardware,
            refused_requests: self.host.refused,
            fittings: self.last_resort.report(&self.parameters.active().app.fittings),
        }
    }

    /// Activates the staged parameters. When more than live ones changed, navigation starts again and waits for a fix.
    ///
    /// # Errors
    /// The set is refused as a whole; the old one stays.
    pub fn commit(&mut self) -> Result<(), Refusal> {
        let Self { parameters, estimator, steering, .. } = self;
        let mut rebuilt = false;
        parameters.commit(steering.is_engaged(), |settings, old, rebuild| {
            rebuilt = rebuild;
            let taken = !rebuild || configure(settings, estimator, steering);
            if !taken {
                // the old set was valid
                configure(old, estimator, steering);
            }
            taken
        })?;
        self.unconfigured = false;
        if rebuilt {
            // earlier samples may be in other units
            self.inputs.clear();
            self.estimator.reset();
            self.adaptation.restart();
            self.links.configure(&self.parameters.active().app);
        }
        Ok(())
    }
}

/// Builds filter and controller from settings; false when one of them refuses.
#[inline(never)]
pub fn configure(settings: &Settings, estimator: &mut Estimator, steering: &mut Steering) -> bool {
    let Ok(model) = VehicleModel::new(&settings.vehicle) else { return false };
    estimator.configure(settings, &model).is_ok() && steering.configure(&settings.control, &model).is_ok()
}
