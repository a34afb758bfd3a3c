//! Commands to the actuators: the controller's, the fin check on the bench, the hand-back to the frontseat.

use crate::SENTENCE;
use crate::command::{Commander, Unanswered};
use crate::consequences::Fins;
use crate::held::Held;
use crate::links::actuators_of;
use crate::parameters::{AppSettings, ControlMode};
use crate::telemetry;
use crate::time::{STEP_US, micros};
use crate::wiggle::Wiggle;
use backseat_core::control::mission::{Mission, MissionStatus, Waypoint};
use backseat_core::control::trackline::Segment;
use backseat_core::control::{Aside, ControlConfig, ControlError, Controller, HelmCommand};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::state::VehicleState;
use backseat_wire::hostlink::Steered;
use backseat_wire::iver::ServoBytes;
use heapless::Vec;

/// What the host steers holds for so long, µs: it says it twice a second, so that three may be lost, and a vehicle that
/// nobody steers any more goes six metres at most.
const HELM_US: u64 = 2_000_000;
/// How often it is told while the host steers the same, µs.
const STEERED_US: u64 = 10_000_000;
/// An echo of the motor that differs more from the command shows that somebody else commands it. The propeller's rate
/// and the echo's age cause smaller differences, except in the first second.
const MOTOR_COUNTS: u8 = 16;
/// Neutral of the modes' end of a mission, of the operator's stop, of a wiggle's end, and the step's own command.
const MOST_SENTENCES: usize = 4;

/// Output of a step: bytes to send, and the actuator commands that follow from them.
#[derive(Default)]
pub struct Orders {
    /// To the frontseat, in this order.
    pub sentences: Vec<Vec<u8, SENTENCE>, MOST_SENTENCES>,
    /// Actuator command, and the time from which on it holds, µs.
    pub actuators: Option<(u64, ActuatorInput)>,
    /// The frontseat never acknowledged the stop.
    pub stop_unanswered: bool,
}

impl Orders {
    fn send(&mut self, sentence: &[u8]) {
        // sentences fit, and there are never more
        if let Ok(sentence) = Vec::from_slice(sentence) {
            let _ = self.sentences.push(sentence);
        }
    }
}

/// The vehicle as steering needs it.
pub struct Situation<'a> {
    /// Time of the step, µs.
    pub now_us: u64,
    /// The vehicle now.
    pub x: &'a VehicleState,
    /// Current north and east, m/s.
    pub current_mps: [f64; 2],
    /// When the frontseat last acknowledged a stop, µs.
    pub stop_acknowledged_us: Option<u64>,
}

/// Controller, mission and the commands under way.
pub struct Steering {
    controller: Controller,
    commander: Commander,
    /// A mission begins as soon as navigation is valid.
    pub armed: bool,
    /// When it was armed last, µs.
    pub armed_us: u64,
    /// The fin check is under way.
    wiggle: Held<Wiggle>,
    /// The vehicle waits at the surface: neutral with every step, so that the frontseat does not go on.
    holding: bool,
    /// The mission was ended, and its way back is flown.
    pub returning: bool,
    /// The frontseat gets control back with the next step.
    stopping: bool,
    /// When it last got it, µs.
    stopped_us: u64,
    /// Arrival of the last echo that was heard, µs.
    echo_us: Option<u64>,
    /// The echoed motor is not the commanded one since then, µs.
    pub disobeyed_since_us: Option<u64>,
    /// What the host steers instead of the leg, and until when, µs.
    helm: Held<(HelmCommand, u64)>,
    /// What the host was told last that it steers.
    told: Held<HelmCommand>,
}

impl Steering {
    pub const fn new() -> Self {
        Self {
            controller: Controller::new(),
            commander: Commander::new(),
            armed: false,
            armed_us: 0,
            wiggle: Held::none(),
            holding: false,
            returning: false,
            stopping: false,
            stopped_us: 0,
            echo_us: None,
            disobeyed_since_us: None,
            helm: Held::none(),
            told: Held::none(),
        }
    }

    /// Forgets everything but controller and mission.
    pub fn restart(&mut self) {
        self.controller.stop();
        self.commander = Commander::new();
        self.armed = false;
        self.wiggle.clear();
        self.holding = false;
        self.returning = false;
        self.stopping = false;
        self.stopped_us = 0;
        self.echo_us = None;
        self.disobeyed_since_us = None;
        self.helm.clear();
    }

    /// Builds the controller.
    ///
    /// # Errors
    /// The error of the controller.
    pub fn configure(&mut self, config: &ControlConfig, model: &VehicleModel) -> Result<(), ControlError> {
        self.controller.configure(config, model)
    }

    /// Steers another vehicle than declared, or the declared one again; its fins are whole.
    pub fn set_model(&mut self, model: &VehicleModel) {
        self.controller.set_model(model);
    }

    /// Steers with these fins.
    pub fn set_fins(&mut self, (shares, stands_rad): &Fins) {
        self.controller.set_fins(shares, stands_rad);
    }

    pub fn mission(&self) -> &Mission {
        self.controller.mission()
    }

    pub fn set_mission(&mut self, mission: &Mission) {
        self.controller.set_mission(mission);
    }

    pub fn clear_mission(&mut self) {
        self.controller.clear_mission();
    }

    /// Where the leg ends.
    pub fn leg_target(&self) -> Option<&Waypoint> {
        self.mission().waypoints().get(usize::from(self.leg()?))
    }

    /// Leg of the mission that is being flown.
    pub fn leg(&self) -> Option<u16> {
        match self.controller.status() {
            MissionStatus::Leg(leg) => Some(leg),
            MissionStatus::Idle | MissionStatus::Finished => None,
        }
    }

    /// Leg of the mission, and its line, where the law of control can depart from it.
    pub fn line(&self) -> Option<(u16, Segment)> {
        let leg = self.leg().filter(|_| self.can_depart())?;
        Some((leg, *self.controller.segment()?))
    }

    /// The law of control can depart from a leg.
    pub fn can_depart(&self) -> bool {
        self.controller.can_go_aside()
    }

    /// The host steers instead of the leg, for a while.
    pub fn take_helm(&mut self, helm: HelmCommand, now_us: u64) {
        self.helm.set((helm, now_us.saturating_add(HELM_US)));
    }

    /// What the host steers.
    pub fn helm(&self) -> Option<&HelmCommand> {
        self.helm.get().map(|(helm, _)| helm)
    }

    /// Holds what the host steers for as long as it holds and nothing speaks against it; else the leg is flown again.
    pub fn hold_helm(&mut self, now_us: u64, may: bool) {
        if self.helm.get().is_some_and(|(_, until_us)| !may || now_us >= *until_us) {
            self.helm.clear();
        }
        self.controller.set_helm(self.helm().copied());
    }

    /// Who steers, where that is news.
    pub fn take_steered(&mut self, now_us: u64) -> Option<Steered> {
        let helm = self.helm().copied().filter(|_| self.under_way());
        if helm == self.told.get().copied() && (helm.is_none() || now_us % STEERED_US >= STEP_US) {
            return None;
        }
        self.told.clear();
        helm.into_iter().for_each(|helm| self.told.set(helm));
        Some(telemetry::steered(now_us, helm))
    }

    /// Departs from the leg, or follows it again.
    pub fn set_aside(&mut self, aside: Option<Aside>) {
        self.controller.set_aside(aside);
    }

    /// A mission is being flown.
    pub fn under_way(&self) -> bool {
        self.leg().is_some()
    }

    /// A mission is being flown or waits to begin.
    pub fn is_engaged(&self) -> bool {
        self.under_way() || self.armed
    }

    /// The frontseat is being given control, and has not acknowledged it.
    pub fn is_stopping(&self) -> bool {
        self.stopping || self.holding || self.commander.is_stopping()
    }

    /// The fin check is under way.
    pub fn is_wiggling(&self) -> bool {
        self.wiggle.get().is_some()
    }

    /// The mission begins with the first step at which navigation is valid.
    pub fn arm(&mut self, now_us: u64) {
        self.disobeyed_since_us = None;
        self.helm.clear();
        self.holding = false;
        self.armed = true;
        self.armed_us = now_us;
    }

    /// The mission does not begin.
    pub fn disarm(&mut self) {
        self.armed = false;
    }

    /// Navigation is valid: an armed mission begins. It is not the one that was stopped a moment before.
    pub fn begin(&mut self, x: &VehicleState) {
        if self.armed {
            // an empty mission was refused when it was armed
            self.armed = self.controller.start(x).is_err();
            self.stopping &= self.armed;
        }
    }

    /// Starts the fin check, which ends by itself.
    pub fn wiggle(&mut self) {
        self.wiggle.set(Wiggle::default());
    }

    /// Ends mission and fin check; the bytes go out with the next step.
    pub fn stop(&mut self) {
        self.controller.stop();
        self.armed = false;
        self.holding = false;
        self.wiggle.clear();
        self.stopping = true;
    }

    /// Ends the mission and waits: neutral with every step, the frontseat does not take over.
    pub fn hold(&mut self) {
        self.controller.stop();
        self.holding = true;
    }

    /// Ends the mission: neutral now and no stop, so that the frontseat goes on when the command lapses.
    pub fn lapse(&mut self, now_us: u64, settings: &AppSettings, orders: &mut Orders) {
        self.controller.stop();
        self.send_fins([0.0; 4], now_us, settings, orders);
    }

    /// Ends the mission and flies straight to a place; the mission is forgotten. False when there is no way.
    pub fn return_to(&mut self, place: Waypoint, x: &VehicleState) -> bool {
        let under_way = self.controller.set_single_leg(place).is_ok() && self.controller.start(x).is_ok();
        self.returning = under_way;
        under_way
    }

    /// The frontseat gets control with the next step.
    pub fn release(&mut self) {
        self.stopping = true;
    }

    /// The frontseat's echo of its servo bytes. While the frontseat steers it says what the actuators do, from its
    /// arrival on.
    pub fn hear_echo(
        &mut self,
        echo: Option<(u64, ServoBytes)>,
        settings: &AppSettings,
    ) -> Option<(u64, ActuatorInput)> {
        let (time_us, bytes) = echo.filter(|(us, _)| self.echo_us != Some(*us))?;
        self.echo_us = Some(time_us);
        if !(self.under_way() && settings.control_mode == ControlMode::Direct) {
            return Some((time_us, actuators_of(&bytes, settings)));
        }
        // Somebody may steer by hand at the frontseat although it acknowledges commands. The motor has a steady speed.
        let obeys = bytes.motor.abs_diff(self.commander.sent().motor) <= MOTOR_COUNTS;
        self.disobeyed_since_us = if obeys { None } else { self.disobeyed_since_us.or(Some(time_us)) };
        None
    }

    /// Ends a mission: neutral now, `$OMSTOP` until it is acknowledged.
    pub fn hand_back(&mut self, now_us: u64, settings: &AppSettings, orders: &mut Orders) {
        self.controller.stop();
        if core::mem::take(&mut self.returning) {
            self.controller.clear_mission();
        }
        self.send_fins([0.0; 4], now_us, settings, orders);
        self.stopped_us = now_us;
        self.commander.stop(now_us);
    }

    /// Fins with the propeller stopped.
    fn send_fins(&mut self, fins_rad: [f64; 4], now_us: u64, settings: &AppSettings, orders: &mut Orders) {
        let mut buffer = [0; SENTENCE];
        if let Ok(sentence) = self.commander.fins(fins_rad, settings, &mut buffer) {
            orders.send(sentence);
        }
        self.commanded(now_us, settings, orders);
    }

    /// Actuator input that the servo bytes sent give.
    fn commanded(&self, now_us: u64, settings: &AppSettings, orders: &mut Orders) {
        let effective_us = now_us.saturating_add(micros(settings.actuator_delay_s));
        orders.actuators = Some((effective_us, actuators_of(&self.commander.sent(), settings)));
    }

    /// The command of a step.
    pub fn steer(&mut self, situation: &Situation<'_>, settings: &AppSettings, orders: &mut Orders) {
        let now_us = situation.now_us;
        if core::mem::take(&mut self.stopping) {
            self.hand_back(now_us, settings, orders);
        }
        if let Some(wiggle) = self.wiggle.get_mut() {
            if let Some(fins_rad) = wiggle.fins_rad(now_us) {
                self.send_fins(fins_rad, now_us, settings, orders);
                return;
            }
            self.wiggle.clear();
            self.hand_back(now_us, settings, orders);
        }
        let mut buffer = [0; SENTENCE];
        if self.under_way() {
            let command = self.controller.command(now_us, situation.x, situation.current_mps);
            if !matches!(command.status, MissionStatus::Leg(_)) && self.returning {
                self.hand_back(now_us, settings, orders);
                return;
            }
            if !matches!(command.status, MissionStatus::Leg(_)) {
                // The last waypoint: the frontseat carries on when the command's timeout lapses.
                self.send_fins([0.0; 4], now_us, settings, orders);
                return;
            }
            if let Ok(Some(sentence)) = self.commander.steer(&command, settings, &mut buffer) {
                orders.send(sentence);
            }
            if settings.control_mode == ControlMode::Direct {
                self.commanded(now_us, settings, orders);
            }
            return;
        }
        if self.holding {
            self.send_fins([0.0; 4], now_us, settings, orders);
            return;
        }
        let acknowledged = situation.stop_acknowledged_us.is_some_and(|us| us > self.stopped_us);
        match self.commander.stopping(now_us, acknowledged, settings, &mut buffer) {
            Ok(Some(sentence)) => orders.send(sentence),
            Ok(None) => {}
            Err(Unanswered) => orders.stop_unanswered = true,
        }
    }
}
