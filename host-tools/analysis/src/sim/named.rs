//! What the board named in the flight, beside what the simulator injected.

use super::flown::{Flown, VEHICLE};
use backseat_core::navigation::naming::Cause;
use backseat_link::named::{self, cause_name};
use backseat_report::Table;
use backseat_wire::hostlink::Naming;
use hil_sim::scenario::Scenario;
use serde_json::{Value, json};

/// Each statement that names others than the one before, as it was first; behind them the last one.
fn statements(all: &[Naming]) -> Vec<&Naming> {
    let mut kept: Vec<&Naming> = Vec::new();
    for naming in all {
        if named::is_new(kept.last().copied(), naming) {
            kept.push(naming);
        }
    }
    kept.extend(all.last().filter(|last| kept.last().is_some_and(|kept| kept != last)));
    kept
}

/// What the scenario has that the vehicle file does not say.
fn injected(scenario: &Scenario) -> Vec<String> {
    let settings = &scenario.settings;
    let effects = settings.effects.as_slice().iter().map(|effect| with_board_name(effect.name(), effect.to_string()));
    let faults = settings.faults.iter().map(|fault| {
        let text = fault.to_string();
        let name = text.split_whitespace().next().unwrap_or_default().to_owned();
        with_board_name(&name, text)
    });
    let current = settings.environment.current;
    let flows = (current.north_mps, current.east_mps) != (0.0, 0.0) && !settings.backseat.current_state;
    let current = flows.then(|| {
        let (north, east, onset) = (current.north_mps, current.east_mps, current.onset_s);
        let onset = if onset > 0.0 { format!(",onset_s={onset}") } else { String::new() };
        format!("water_current:north_mps={north},east_mps={east}{onset}")
    });
    effects.chain(faults).chain(current).collect()
}

/// The board has the catalogue's words; those of the simulator's faults differ.
fn with_board_name(name: &str, text: String) -> String {
    let board = match name {
        "fouling" => "thrust_lost",
        "entanglement" => "drag_change",
        "flooding" => "weight_change",
        "heading_jump" => "heading_bias",
        "depth_jump" => "depth_bias",
        "ship_gnss_jump" => "ship_position",
        _ => return text,
    };
    format!("{text} (on board: {board})")
}

/// The table of what was named; `None` where nothing was, and nothing injected.
pub fn table(flown: &Flown) -> Option<Table> {
    let injected = injected(&flown.scenario);
    let statements = statements(&flown.flight.naming);
    if injected.is_empty() && statements.is_empty() {
        return None;
    }
    let truth = if injected.is_empty() { "nothing".to_owned() } else { injected.join("; ") };
    let caption = format!("What the board named in flight. Injected, and not known to it: {truth}");
    let header = ["at [min]", "what has changed", "size (95 % interval)", "since [min]", "probability", "or"];
    let mut table = Table::new(caption, &header);
    let minutes = |us: u64| format!("{:.1}", us as f64 / 6.0e7);
    let said = |at: &Naming, what: &str| {
        [minutes(at.time_us), what.to_owned(), String::new(), String::new(), String::new(), String::new()]
    };
    if statements.is_empty() {
        table = table.row(["", "nothing", "", "", "", ""]);
    }
    let mut decided_us = None;
    for naming in statements {
        if let Some(decision) = naming.decision.filter(|decision| decided_us != Some(decision.time_us)) {
            decided_us = Some(decision.time_us);
            table = table.row(said(naming, &named::decided(&decision)));
        }
        if naming.unexplained {
            let words = if naming.named.is_empty() { "none of these" } else { "none of these; nearest:" };
            table = table.row(said(naming, words));
        } else if naming.named.is_empty() {
            table = table.row(said(naming, "nothing any longer"));
        }
        for own in &naming.named {
            let Some(cause) = Cause::from_number(own.cause) else { continue };
            table = table.row([
                minutes(naming.time_us),
                cause_name(cause),
                named::sizes(cause, own),
                minutes(own.since_us),
                format!("{:.2}", own.probability),
                Cause::from_number(own.rival).map(cause_name).unwrap_or_default(),
            ]);
        }
    }
    Some(table)
}

/// The command that asks the same of the flight's log.
pub fn command(flown: &Flown) -> String {
    let file = |name: &str| backseat_report::word(&flown.folder.join(name));
    let no_dvl = if flown.scenario.settings.backseat.dvl { "" } else { " --no-dvl" };
    format!("backseat diagnose {} --vehicle {}{no_dvl}", file("log.csv"), file(VEHICLE))
}

/// The same as values.
pub fn json(flown: &Flown) -> Value {
    let said = |naming: &&Naming| {
        let Value::Object(mut object) = named::object(naming) else { return Value::Null };
        object.insert("time_s".to_owned(), json!(naming.time_us as f64 * 1e-6));
        Value::Object(object)
    };
    json!({
        "stated": statements(&flown.flight.naming).iter().map(said).collect::<Vec<_>>(),
        "injected": injected(&flown.scenario),
        "diagnose": command(flown),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_wire::hostlink::NamedCause;
    use hil_sim::scenario::Request;

    #[test]
    fn the_first_of_each_statement_and_the_last_are_kept() {
        let naming = |time_us, causes: &[u8]| Naming {
            time_us,
            unexplained: false,
            named: causes.iter().map(|cause| NamedCause { cause: *cause, ..NamedCause::default() }).collect(),
            decision: None,
            question: None,
        };
        let all = [naming(1, &[2]), naming(2, &[2]), naming(3, &[2, 13]), naming(4, &[2, 13]), naming(5, &[2, 13])];
        let kept = |all: &[Naming]| statements(all).iter().map(|naming| naming.time_us).collect::<Vec<_>>();
        assert_eq!((kept(&all), kept(&all[..3]), kept(&[])), (vec![1, 3, 5], vec![1, 3], vec![]));
    }

    #[test]
    fn what_is_injected_is_told_with_the_boards_name() {
        let mut scenario = Scenario::built_in("survey").unwrap();
        assert!(injected(&scenario).is_empty());
        let request = Request::parse("fouling:share=0.8,time_s=600").unwrap();
        for effect in Request::resolve(&[request], 1, 1000.0) {
            scenario.settings.effects.push(effect);
        }
        scenario.settings.environment.current.north_mps = 0.1;
        let expected =
            ["fouling:share=0.8,time_s=600 (on board: thrust_lost)", "water_current:north_mps=0.1,east_mps=0"];
        assert_eq!(injected(&scenario), expected);
    }
}
