//! What goes to the actuators: the controller's commands, the bench's wiggle, the hand-back to the frontseat.

use crate::app::{Backseat, SENTENCE};
use crate::command::{Unanswered, input_of};
use crate::decode::micros;
use crate::parameters::ControlMode;
use backseat_core::control::mission::MissionStatus;
use backseat_wire::hostlink::Port;

/// An echo of the motor that is further from the command shows another's command: what the propeller's rate and the
/// echo's age make is less but in the first second.
const MOTOR_COUNTS: u8 = 16;

impl Backseat {
    /// While the frontseat steers, its echo says what the actuators do.
    pub(crate) fn hear_echo(&mut self) {
        let app = &self.parameters.active().app;
        let own = self.under_way() && app.control_mode == ControlMode::Direct;
        let Some((time_us, bytes)) = self.frontseat.echo().filter(|(us, _)| self.echo_us != Some(*us)) else { return };
        self.echo_us = Some(time_us);
        if own {
            // Somebody at the frontseat may steer by hand, whatever it acknowledges. The motor is told a steady speed.
            let obeys = bytes.motor.abs_diff(self.commander.sent().motor) <= MOTOR_COUNTS;
            self.frontseat.note_obedience(time_us, obeys);
        } else {
            let input = input_of(&bytes, app);
            self.estimator.command(time_us, &input);
            self.adaptation.command(time_us, &input);
        }
    }

    /// Ends a mission: neutral now, `$OMSTOP` until it is acknowledged.
    pub(crate) fn hand_back(&mut self, now_us: u64) {
        self.controller.stop();
        self.send_neutral(now_us);
        self.frontseat.await_stop();
        self.commander.stop(now_us);
    }

    /// The operator's stop; the bytes go out with the next step.
    pub(crate) fn stop(&mut self) {
        self.controller.stop();
        self.modes.stopped();
        self.armed = false;
        self.wiggle.clear();
        self.stopping = true;
    }

    fn send_neutral(&mut self, now_us: u64) {
        self.send_fins([0.0; 4], now_us);
    }

    /// Fins with the propeller stopped.
    fn send_fins(&mut self, fins_rad: [f64; 4], now_us: u64) {
        let mut buffer = [0; SENTENCE];
        if let Ok(sentence) = self.commander.fins(fins_rad, &self.parameters.active().app, &mut buffer) {
            self.push(Port::Frontseat, sentence);
        }
        self.command_sent(now_us);
    }

    /// Tells the filter what was sent, as the servo bytes have it.
    fn command_sent(&mut self, now_us: u64) {
        let app = &self.parameters.active().app;
        let effective_us = now_us.saturating_add(micros(app.actuator_delay_s));
        let input = input_of(&self.commander.sent(), app);
        self.estimator.command(effective_us, &input);
        self.adaptation.command(effective_us, &input);
    }

    /// What the actuators are to do from now on.
    pub(crate) fn steer(&mut self, now_us: u64) {
        if core::mem::take(&mut self.stopping) {
            self.hand_back(now_us);
        }
        if let Some(wiggle) = self.wiggle.get_mut() {
            if let Some(fins_rad) = wiggle.fins_rad(now_us) {
                self.send_fins(fins_rad, now_us);
                return;
            }
            self.wiggle.clear();
            self.hand_back(now_us);
        }
        let mut buffer = [0; SENTENCE];
        if self.under_way() {
            let navigator = self.estimator.navigator();
            let command = self.controller.command(now_us, navigator.state(), navigator.current());
            if !matches!(command.status, MissionStatus::Leg(_)) {
                // The last waypoint: the frontseat carries on when the command's timeout lapses.
                self.send_neutral(now_us);
                return;
            }
            let app = &self.parameters.active().app;
            let direct = app.control_mode == ControlMode::Direct;
            if let Ok(Some(sentence)) = self.commander.steer(&command, app, &mut buffer) {
                self.push(Port::Frontseat, sentence);
            }
            if direct {
                self.command_sent(now_us);
            }
            return;
        }
        let acknowledged = self.frontseat.stop_acknowledged();
        let app = &self.parameters.active().app;
        match self.commander.stopping(now_us, acknowledged, app, &mut buffer) {
            Ok(Some(sentence)) => self.push(Port::Frontseat, sentence),
            Ok(None) => {}
            Err(Unanswered) => self.modes.stop_unanswered(),
        }
    }
}
