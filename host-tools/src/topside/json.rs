//! What topside knows, as JSON: the line of `--json` and the message of the session log.

use backseat_link::named;
use backseat_topside::slots::Slot;
use backseat_topside::track::Track;
use backseat_topside::{Event, Topside};
use backseat_wire::abort::EVERYBODY;
use backseat_wire::vehicle_state::VehicleState;
use serde_json::{Value, json};

/// Everything at `time_us` of the program's clock; `events` since the last.
pub fn object(topside: &Topside, time_us: u64, events: &[Value]) -> Value {
    let utc_us = topside.utc_us(time_us);
    let hold = topside.hold();
    let ship = utc_us.and_then(|utc_us| topside.ship_at(utc_us));
    let degrees = |position_m| topside.frame().map(|frame| frame.to_geodetic(position_m));
    let slot = |slot: &Slot| json!({"at_s": slot.offset_s, "exchange": slot.exchange.name(), "vehicle": slot.exchange.vehicle()});
    json!({
        "utc_s": utc_us.map(|us| us as f64 * 1e-6),
        "sending": hold.is_none(),
        "hold": hold.map(|hold| json!({"name": hold.name(), "text": hold.to_string()})),
        "ship": ship.map(|ship| json!({
            "position_m": ship.position_m,
            "position_deg": degrees(ship.position_m),
            "velocity_mps": ship.velocity_mps,
            "position_sigma_m": ship.position_sigma_m,
            "velocity_sigma_mps": ship.velocity_sigma_mps,
            "heading_rad": topside.heading_rad(),
        })),
        "gnss": {"satellites": topside.satellites().0, "quality": topside.satellites().1, "refused": topside.refused_fixes()},
        "modem": topside.modem_clock().map(|clock| json!({
            "configured": topside.modem_is_configured(),
            "clock": clock.clock.as_str(),
            "pulse": clock.pulse.as_str(),
            "age_s": time_us.saturating_sub(clock.time_us) as f64 * 1e-6,
        })),
        "cycle": {"period_s": topside.config().slots.period_s(), "slots": topside.config().slots.slots().iter().map(slot).collect::<Vec<_>>()},
        "sent": topside.sent(),
        "last_sent_s": topside.last_sent().map(|sent| sent.state.transmit_s),
        "abort": topside.aborting().map(|(destination, left)| json!({"destination": destination, "packets_left": left})),
        "vehicles": topside.tracks().iter().map(|track| vehicle(track, utc_us)).collect::<Vec<_>>(),
        "events": events,
    })
}

fn vehicle(track: &Track, utc_us: Option<u64>) -> Value {
    let estimate = utc_us.and_then(|utc_us| track.at(utc_us));
    let age = |heard_us: u64| utc_us.map(|utc_us| (utc_us as f64 - heard_us as f64) * 1e-6);
    let [ranges, refused] = track.ranges();
    json!({
        "address": track.vehicle,
        "position_m": estimate.map(|e| e.position_m),
        "velocity_mps": estimate.map(|e| e.velocity_mps),
        "covariance_m2": estimate.map(|e| e.covariance_m2),
        "sigma_m": estimate.map(|e| e.sigma_m()),
        "level_horizontal_m": utc_us.and_then(|utc_us| track.level_at(utc_us)),
        "age_s": track.heard_us().and_then(age),
        "report": track.report().map(report),
        "named": track.names().iter().map(|(named, since_s)| named::told_object(&named, since_s)).collect::<Vec<_>>(),
        "ranges": ranges,
        "ranges_refused": refused,
    })
}

fn report(state: &VehicleState) -> Value {
    json!({
        "transmit_s": state.transmit_s,
        "position_deg": state.position_deg,
        "velocity_mps": state.velocity_mps,
        "depth_m": state.depth_m,
        "position_sigma_m": state.position_sigma_m,
        "position_covariance_m2": state.position_covariance_m2(),
        "leans": state.leans,
        "heading_rad": state.heading_rad,
        "level_horizontal_m": state.level_m[0],
        "level_depth_m": state.level_m[1],
        "mode": state.mode,
        "synchronous": state.synchronous,
    })
}

/// An event in words, and whether it is a trouble.
pub fn words(event: &Event) -> (bool, String) {
    match event {
        Event::Hold(None) => (false, "all is well: the ship sends".to_owned()),
        Event::Hold(Some(hold)) => (true, hold.to_string()),
        Event::Sent { transmit_s, sequence } => (false, format!("packet {sequence} leaves at {transmit_s}")),
        Event::NotSent { transmit_s } => {
            (true, format!("the packet of {transmit_s} did not leave: the modem did not ask for it"))
        }
        Event::AskedOffTime { transmit_s, leaves_s } => {
            (true, format!("the packet of {transmit_s} would leave at {leaves_s} by the modem's clock: not sent"))
        }
        Event::Uplink { state, range_m } => {
            let range = range_m.map_or("no range".to_owned(), |range_m| format!("range {range_m:.1} m"));
            let [level, depth] = state.level_m.map(level);
            let text = format!("depth {:.1} m, {range}, level {level}, in depth {depth}", state.depth_m);
            (false, format!("vehicle {}: {text}", state.source))
        }
        Event::Named { vehicle, named } => (named.cause != 0, format!("vehicle {vehicle}: {}", named::told(named))),
        Event::Range(ranging) => {
            let kind = if ranging.two_way { "ping" } else { "uplink" };
            let off = ranging.innovation_m.map_or("no track yet".to_owned(), |m| format!("{m:+.1} m off the track"));
            let refused = if ranging.fused { "" } else { ", not used" };
            let trouble = !ranging.fused && ranging.innovation_m.is_some();
            (trouble, format!("vehicle {}: {:.1} m by {kind}, {off}{refused}", ranging.vehicle, ranging.range_m))
        }
        Event::PingSent { vehicle } => (false, format!("ping to vehicle {vehicle}")),
        Event::Minipacket { source, bits } => {
            (false, format!("minipacket from {source}: 13 bits, {bits:04x}; not used"))
        }
        Event::PingHeard { vehicle } => (false, format!("vehicle {vehicle} pings")),
        Event::Refused { source, forged: true } => (true, format!("a packet from {source} with a wrong key: not used")),
        Event::Refused { source, forged: false } => {
            (true, format!("a packet from {source} that is no uplink of a known vehicle"))
        }
        Event::AbortAsked { destination } => (true, format!("abort for {}: waits for its slot", whom(*destination))),
        Event::AbortSent { destination, transmit_s, left } => {
            (true, format!("abort for {} leaves at {transmit_s}; {left} more to come", whom(*destination)))
        }
        Event::ShipJumped { by_m } => (
            true,
            format!("the ship's GNSS jumped by {by_m:.1} m: packets state that much more uncertainty, less with time"),
        ),
        Event::ShipWalked { by_m } => (
            true,
            format!(
                "the ship's GNSS fixes moved by {by_m:.1} m that its speed over ground does not have: packets state that \
                 much more uncertainty, less with time"
            ),
        ),
        Event::ModemRestarted => (true, "the modem started again: its settings are sent again".to_owned()),
    }
}

/// A protection level in words.
pub fn level(level_m: Option<f64>) -> String {
    level_m.map_or("none".to_owned(), |level_m| format!("{level_m:.1} m"))
}

fn whom(destination: u8) -> String {
    if destination == EVERYBODY { "every vehicle".to_owned() } else { format!("vehicle {destination}") }
}
