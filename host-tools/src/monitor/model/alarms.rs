//! What is wrong now.

use super::{Model, Severity, words};

use backseat_core::navigation::Sensor;
use backseat_wire::hostlink::{FittingState, Fittings, LogState, Mode, Port};

/// Telemetry that is later than this is missing, s.
const SILENT_S: f64 = 1.0;
/// A sensor is silent after as many of its intervals, and no sooner than this, s.
const INTERVALS: f64 = 3.5;
const SENSOR_SILENT_S: f64 = 2.0;
/// Rejections in a row that are no chance any more.
const ROW: u32 = 3;

/// Something wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alarm {
    pub severity: Severity,
    pub text: String,
}

/// Everything wrong, the worst first.
pub fn of(model: &Model, now_us: u64) -> Vec<Alarm> {
    let mut alarms = Vec::new();
    let mut raise = |severity, text: String| alarms.push(Alarm { severity, text });
    let heard = link(model, now_us, &mut raise);
    if let Some(record) = &model.telemetry
        && record.mode != Mode::Navigating
        && !words::intended(record.mode, record.reason)
    {
        raise(words::severity(record.mode), words::mode(record.mode, record.reason));
    }
    if model.restart.is_some_and(|restart| restart.safe) {
        raise(Severity::Critical, "reset too often by faults".into());
    }
    if let Some(starts) = model.trial {
        raise(Severity::Warning, format!("image on trial, start {starts}: no mission starts"));
    }
    // nothing is known of a silent board
    if heard {
        sensors(model, now_us, &mut raise);
        ports(model, &mut raise);
        fittings(model, &mut raise);
        board(model, &mut raise);
    }
    let drifted = model.identified().iter().filter(|p| p.drifted).map(|p| p.name).collect::<Vec<_>>();
    if !drifted.is_empty() {
        raise(Severity::Warning, format!("drifted: {}", drifted.join(", ")));
    }
    alarms.sort_by_key(|alarm| std::cmp::Reverse(alarm.severity));
    alarms
}

/// Whether the board is heard.
fn link(model: &Model, now_us: u64, raise: &mut impl FnMut(Severity, String)) -> bool {
    if let Some(since_us) = model.away_since_us {
        let seconds = now_us.saturating_sub(since_us) / 1_000_000;
        raise(Severity::Critical, format!("port gone for {seconds} s; waiting for it"));
        return false;
    }
    let heard = match model.silence_s(now_us) {
        None => {
            raise(Severity::Warning, "no telemetry yet; check cable, power and baud rate".into());
            false
        }
        Some(seconds) if seconds > SILENT_S => {
            raise(Severity::Critical, format!("no telemetry for {seconds:.0} s"));
            false
        }
        Some(_) => true,
    };
    if let Some(per_s) = model.link.broken_rate.per_s().filter(|per_s| *per_s > 0.0) {
        raise(Severity::Warning, format!("{per_s:.1} broken frames a second on this link"));
    }
    heard
}

fn sensors(model: &Model, now_us: u64, raise: &mut impl FnMut(Severity, String)) {
    let board_us = model.board_us(now_us);
    for source in model.sources.iter() {
        let name = source.sensor.name();
        if source.in_a_row >= ROW {
            raise(Severity::Warning, format!("{name} rejected {} times in a row", source.in_a_row));
        }
        // Fixes end where the water begins.
        let may_pause = matches!(source.sensor, Sensor::VehicleGnss | Sensor::ShipGnss);
        if let (Some(age_s), Some(interval_s), false) = (source.age_s(board_us), source.interval_s(), may_pause)
            && age_s > (INTERVALS * interval_s).max(SENSOR_SILENT_S)
        {
            raise(Severity::Warning, format!("{name} silent for {age_s:.0} s"));
        }
    }
}

/// Last-resort hardware that has acted, or could not act.
fn fittings(model: &Model, raise: &mut impl FnMut(Severity, String)) {
    let Some(fittings) = model.health.as_ref().map(|health| health.fittings) else { return };
    for (name, state) in Fittings::NAMES.into_iter().zip(fittings.states) {
        if !matches!(state, FittingState::NotFitted | FittingState::Ready) {
            raise(Severity::Critical, format!("{name} {}", words::fitting(state)));
        }
    }
    if let Some(reason) = fittings.released {
        raise(Severity::Critical, format!("drop weight released: {}", words::release(reason)));
    }
}

/// What the board itself is short of, or has lost.
fn board(model: &Model, raise: &mut impl FnMut(Severity, String)) {
    let Some(health) = &model.health else { return };
    let log_required = model.settings().is_none_or(|settings| settings.app.log_required);
    if log_required && matches!(health.log.state, LogState::Failed | LogState::Full) {
        raise(Severity::Warning, format!("board log: {}", words::log_state(health.log.state)));
    }
    let Some(hardware) = &health.hardware else { return };
    let [_corrected, lost] = hardware.wrong_bits;
    if lost > 0 {
        raise(Severity::Critical, format!("{lost} wrong bits in the board's memory, not corrected"));
    }
    if hardware.is_loaded() {
        raise(Severity::Warning, format!("load of the board {:.0} %", 0.1 * f64::from(hardware.load_permille)));
    }
    for (name, stack) in ["interrupts", "thread mode"].into_iter().zip(hardware.stacks) {
        if stack.is_narrow() {
            raise(Severity::Warning, format!("stack of {name} used {} of {} bytes", stack.used, stack.room));
        }
    }
}

fn ports(model: &Model, raise: &mut impl FnMut(Severity, String)) {
    if model.losses_rate.per_s().is_some_and(|per_s| per_s > 0.0) {
        raise(Severity::Warning, "the board loses received bytes".into());
    }
    let Some(settings) = model.settings() else { return };
    for (port, rate) in Port::DEVICES.into_iter().zip(&model.port_rates) {
        let needed = match port {
            Port::Frontseat => true,
            Port::Ahrs => settings.app.attitude_source == backseat_app::parameters::AttitudeSource::Ahrs,
            Port::Dvl => {
                settings.app.use_dvl && settings.app.dvl_source != backseat_app::parameters::DvlSource::Frontseat
            }
            // silent between packets
            Port::Modem | Port::Host => false,
        };
        if needed && rate.per_s() == Some(0.0) {
            raise(Severity::Warning, format!("nothing on the {} port", port.name()));
        }
    }
}
