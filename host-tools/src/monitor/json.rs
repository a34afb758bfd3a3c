//! The view as JSON, one object a line.

use super::model::{Model, Severity, words};
use backseat_core::effects::parameters;
use backseat_link::named;
use backseat_logs::STATE_COLUMNS;
use backseat_logs::session::EstimatesRow;
use backseat_wire::hostlink::{FaultReport, Fittings, Hardware, Port, Telemetry, Visibility};
use serde_json::{Map, Value, json};

/// What is known now; of the events, those after the first `seen`. And how many there are.
pub fn object(model: &Model, now_us: u64, seen: u64) -> (Value, u64) {
    let (events, count) = model.journal.since(seen);
    let entry = |severity: Severity, text: &str| json!({"severity": severity.name(), "text": text});
    let events: Vec<Value> = events
        .map(|event| json!({"when": event.when, "severity": event.severity.name(), "text": event.text}))
        .collect();
    let alarms: Vec<Value> = model.alarms(now_us).iter().map(|alarm| entry(alarm.severity, &alarm.text)).collect();
    let record = model.telemetry.as_ref();
    let value = json!({
        "time_s": record.map(|record| record.time_us as f64 * 1e-6),
        "utc_s": record.filter(|record| record.utc_us > 0).map(|record| record.utc_us as f64 * 1e-6),
        "firmware": model.firmware,
        "trial_start": model.trial,
        "resets": model.restart.map(|restart| restart.resets),
        "crashes": model.crash_texts(),
        "mode": record.map(|record| words::mode_name(record.mode)),
        "reason": record.map(|record| words::reason(record.reason)),
        "leg": record.and_then(|record| record.leg),
        "helm": model.helm(),
        "waypoints": model.mission.len(),
        "navigation": model.position().map(navigation),
        "ship": model.ship,
        "propeller_radps": record.map(|record| record.propeller_radps),
        "fins_rad": record.map(|record| record.fins_rad),
        "sensors": sensors(model, now_us),
        "gate_sigmas": model.gate_sigmas(),
        "effects": effects(model),
        "identification": identification(model),
        "estimates": model.estimates.as_ref().map(EstimatesRow::from),
        "fault": model.fault.as_ref().map_or(Value::Null, fault),
        "naming": model.naming.as_ref().map_or(Value::Null, named::object),
        "ports": ports(model),
        "link": link(model, now_us),
        "alarms": alarms,
        "events": events,
    });
    (value, count)
}

fn navigation(record: &Telemetry) -> Value {
    let named = |values: &[f64; 12]| {
        STATE_COLUMNS.iter().zip(values).map(|(name, value)| ((*name).to_owned(), json!(value))).collect::<Map<_, _>>()
    };
    let [current_n, current_e] = record.current_mps;
    json!({
        "state": named(&record.state),
        "sigma": named(&record.sigma),
        "cov_xy_m2": record.cov_xy_m2, "level_horizontal_m": record.level_m[0], "level_depth_m": record.level_m[1],
        "current_n_mps": current_n,
        "current_e_mps": current_e,
    })
}

fn sensors(model: &Model, now_us: u64) -> Value {
    let board_us = model.board_us(now_us);
    let of = |source: &super::model::SourceHistory| {
        let value = json!({
            "rate_hz": source.rate_hz(board_us),
            "age_s": source.age_s(board_us),
            "worst_sigmas": source.worst(board_us).map(|(sigmas, _)| sigmas),
            "rms_sigmas": source.rms_sigmas(),
            "fused": source.fused,
            "rejected": source.rejected,
            "rejected_in_a_row": source.in_a_row,
        });
        (source.sensor.name().to_owned(), value)
    };
    Value::Object(model.sources.iter().map(of).collect())
}

/// Parameters of the catalogue that are not zero, and the current where it is estimated.
fn effects(model: &Model) -> Value {
    let Some(settings) = model.settings() else { return Value::Null };
    let mut effects = Map::new();
    for id in parameters() {
        let value = settings.navigation.effects.get(id);
        if value != 0.0 {
            effects.insert(format!("{}.{}", id.effect().name, id.info().name), json!(value));
        }
    }
    Value::Object(effects)
}

fn identification(model: &Model) -> Value {
    let Some(record) = model.identification() else { return Value::Null };
    let visibility = |visibility| match visibility {
        Visibility::Frozen => "frozen",
        Visibility::Known => "known",
        Visibility::Collinear => "collinear",
        Visibility::Separate => "separate",
    };
    let parameters = model.identified().into_iter().map(|p| {
        let value = json!({
            "value": p.value,
            "change": p.change,
            "visibility": visibility(p.visibility),
            "drifted": p.drifted,
        });
        (p.name.to_owned(), value)
    });
    json!({
        "activity": words::activity(record.activity),
        "adapted_s": record.adapted_s,
        "parameters": parameters.collect::<Map<_, _>>(),
    })
}

fn fault(report: &FaultReport) -> Value {
    let diagnosis = report.diagnosis.as_ref().map(|diagnosis| {
        json!({
            "cause": words::cause(diagnosis.cause),
            "rival": diagnosis.rival.map(words::cause),
            "magnitude": diagnosis.magnitude,
            "confidence": diagnosis.confidence,
            "since_s": diagnosis.since_us as f64 * 1e-6,
        })
    });
    json!({ "state": words::fault_state(report.state), "diagnosis": diagnosis })
}

fn ports(model: &Model) -> Value {
    let Some(health) = &model.health else { return Value::Null };
    let of = |(i, name): (usize, &&str)| {
        let value = json!({
            "good_per_s": model.port_rates.get(i).and_then(super::model::Meter::per_s),
            "good": health.accepted_frames.get(i),
            "refused": health.rejected_frames.get(i),
            "receive_losses": health.receive_losses[i],
        });
        ((*name).to_owned(), value)
    };
    let mut ports: Map<String, Value> = Port::NAMES.iter().enumerate().map(of).collect();
    ports.insert("pps_edges".into(), json!(health.pps_edges));
    ports.insert("synchronised".into(), json!(health.synchronised));
    ports.insert("late_steps".into(), json!(health.late_steps));
    ports.insert("refused_requests".into(), json!(health.refused_requests));
    ports.insert("latest_step_s".into(), json!(f64::from(health.latest_step_us) * 1e-6));
    ports.insert("oscillator".into(), json!(words::oscillator(health.oscillator)));
    let log = json!({"state": words::log_state(health.log.state), "lost_records": health.log.lost_records});
    ports.insert("board_log".into(), log);
    ports.insert("last_resort".into(), fittings(&health.fittings));
    ports.insert("hardware".into(), health.hardware.as_ref().map_or(Value::Null, hardware));
    Value::Object(ports)
}

fn fittings(fittings: &Fittings) -> Value {
    let [abort_line, drop_weight, leak_detector, supply] = fittings.states.map(words::fitting);
    json!({
        "abort_line": abort_line,
        "drop_weight": drop_weight,
        "leak_detector": leak_detector,
        "supply": supply,
        "supply_v": fittings.supply_v,
        "released": fittings.released.map(words::release),
    })
}

fn hardware(hardware: &Hardware) -> Value {
    let stacks = hardware.stacks.map(|stack| json!({"used_bytes": stack.used, "room_bytes": stack.room}));
    json!({
        "supply_dips": hardware.supply_dips,
        "brown_out_level": hardware.brown_out_level,
        "wrong_bits_corrected": hardware.wrong_bits[0],
        "wrong_bits_lost": hardware.wrong_bits[1],
        "lost_edges": hardware.lost_edges,
        "longest_step_s": f64::from(hardware.longest_step_us) * 1e-6,
        "load": f64::from(hardware.load_permille) * 1e-3,
        "stack_of_interrupts": stacks[0],
        "stack_of_thread_mode": stacks[1],
    })
}

fn link(model: &Model, now_us: u64) -> Value {
    let link = &model.link;
    json!({
        "connected": model.away_since_us.is_none(),
        "silence_s": model.silence_s(now_us),
        "bytes": link.bytes,
        "bytes_per_s": link.byte_rate.per_s(),
        "frames": link.frames,
        "broken_frames": link.broken,
        "unknown_frames": link.unknown,
        "telemetry_records": link.records,
        "telemetry_per_s": link.record_rate.per_s(),
        "gaps": link.gaps,
        "missing_records": link.missing,
    })
}
