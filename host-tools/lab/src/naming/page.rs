//! The page of `cargo lab naming`: the shares, and every flight with what changed and what was said.

use super::Args;
use super::draw::{Change, Kind};
use super::fly::{NamedFlight, Outcome, Said, Statement};
use super::known::{Knowable, NAMED_WITHIN_S};
use crate::intervals::Share;
use backseat_core::effects::FIN_NAMES;
use backseat_core::navigation::naming::Cause;
use backseat_report::markdown::markdown_table;
use std::fmt::Write as _;

fn name(number: u8) -> String {
    let Some(cause) = Cause::from_number(number) else { return "outside".to_owned() };
    let fin = cause.fin().map(|fin| format!(" {}", FIN_NAMES[fin])).unwrap_or_default();
    format!("{}{fin}", cause.name())
}

fn of_kind(flown: &[NamedFlight], kind: Kind) -> Vec<&NamedFlight> {
    flown.iter().filter(|flight| flight.kind == kind).collect()
}

struct Shares {
    significant: Share,
    separable: Share,
    named: Share,
    first: Share,
    first_or_rival: Share,
    sized: Share,
    both: Share,
    both_begun: Share,
    wrong_beside: Share,
    clean: Share,
    none_of_these: Share,
    outside_wrong: Share,
}

impl Shares {
    fn of(flown: &[NamedFlight]) -> Self {
        let [one, two, none, outside] =
            [Kind::One, Kind::Two, Kind::None, Kind::Outside].map(|kind| of_kind(flown, kind));
        let offs: Vec<f64> =
            one.iter().flat_map(|flight| flight.changes.iter().filter_map(|change| flight.off(change))).collect();
        let in_time = |outcome: &Outcome, rival: bool| match outcome {
            Outcome::Right(delay_s) => *delay_s <= NAMED_WITHIN_S,
            Outcome::Rival(delay_s) => rival && *delay_s <= NAMED_WITHIN_S,
            _ => false,
        };
        let significant: Vec<_> = one
            .iter()
            .filter(|flight| flight.knowable.as_ref().is_some_and(|own| own.significant_s.is_some()))
            .collect();
        let separable: Vec<_> = one.iter().filter_map(|flight| Some((flight, flight.named_until_s()?))).collect();
        let begun: Vec<_> = two.iter().filter(|flight| flight.has_all_begun()).collect();
        let changed: Vec<_> = one.iter().chain(&two).collect();
        Self {
            significant: Share { hits: significant.len(), of: one.len() },
            separable: Share { hits: separable.len(), of: significant.len() },
            named: Share::of(&separable, |(flight, until_s)| {
                matches!(flight.outcome(), Outcome::Right(_))
                    && flight.first().is_some_and(|first| first.time_s <= *until_s)
            }),
            first: Share::of(&one, |flight| in_time(&flight.outcome(), false)),
            first_or_rival: Share::of(&one, |flight| in_time(&flight.outcome(), true)),
            sized: Share::of(&offs, |off| off.abs() < 1.96),
            both: Share::of(&two, |flight| flight.names_all()),
            both_begun: Share::of(&begun, |flight| flight.names_all()),
            wrong_beside: Share::of(&changed, |flight| flight.names_a_wrong_one_beside()),
            clean: Share::of(&none, |flight| flight.first().is_some()),
            none_of_these: Share::of(&outside, |flight| flight.ends_unexplained()),
            outside_wrong: Share::of(&outside, |flight| {
                flight.first().is_some_and(|first| !first.unexplained) && !flight.ends_unexplained()
            }),
        }
    }
}

fn said(said: &Said) -> String {
    let rival = if said.rival > 0 { format!(" or {}", name(said.rival)) } else { String::new() };
    format!(
        "{}{rival}, {:.3} ± {:.3}, since {:.1} min",
        name(said.cause),
        said.size,
        1.96 * said.sigma,
        said.since_s / 60.0
    )
}

fn statement(statement: &Statement) -> String {
    let named = statement.named.iter().map(said).collect::<Vec<_>>().join("; ");
    let what = match (statement.unexplained, named.is_empty()) {
        (true, true) => "none of these".to_owned(),
        (true, false) => format!("none of these; nearest {named}"),
        (false, true) => "nothing".to_owned(),
        (false, false) => named,
    };
    format!("{:.1} min: {what}", statement.time_s / 60.0)
}

/// After how many minutes it is significant, and told apart.
fn knowable((change, own): (&Change, &Knowable)) -> String {
    let minutes = |time_s: f64| (time_s - change.time_s) / 60.0;
    let Some(significant_s) = own.significant_s else { return format!("no: {:.1} sigmas", own.sigmas) };
    let apart = match own.separable_s {
        Some(time_s) if time_s > significant_s => format!(", apart {:.1}", minutes(time_s)),
        Some(_) => String::new(),
        None => format!(", not from {}", name(own.rival)),
    };
    format!("{:.1} min{apart}", minutes(significant_s))
}

/// The page in Markdown.
pub fn page(flown: &[NamedFlight], args: &Args) -> String {
    let shares = Shares::of(flown);
    let last = args.seed + args.runs - 1;
    let mut text = format!(
        "# Does the board name what changes?\n\nMade by `cargo lab naming --runs {} --seed {} --minutes {}`: {} flights of \
         the default survey without a DVL, closed loop,\nseeds {} to {last}. A cause is drawn at 10 to 90 minutes. Shares \
         with 95 % intervals (Wilson). What\n*significant* and *told apart* mean: [what could be known]\
         (../method/naming.md#what-could-be-known).\n\n",
        args.runs,
        args.seed,
        args.minutes,
        flown.len(),
        args.seed
    );
    let rows = [
        ("one cause: significant by the end, three sigmas for one who knows it", shares.significant),
        ("of these: told apart from the nearest other within 20 minutes", shares.separable),
        ("of these: named first within 20 minutes of being significant", shares.named),
        ("one cause: named first within 20 minutes of its onset", shares.first),
        ("the same, first or as the rival of the first", shares.first_or_rival),
        ("size within its 95 % interval, where the right cause is named last", shares.sized),
        ("two causes: both named, first or as rival", shares.both),
        ("of those in which both began five minutes before the end", shares.both_begun),
        ("one cause or two: beside a name one that is not there", shares.wrong_beside),
        ("none: a false cause", shares.clean),
        ("outside the table: *none of these* at the end", shares.none_of_these),
        ("outside the table: a name, not *none of these* at the end", shares.outside_wrong),
    ];
    let mut table = markdown_table(["", "flights"]);
    for (what, share) in rows {
        table.add_row([what.to_owned(), share.text()]);
    }
    let _ = writeln!(text, "{table}");
    text.push_str(
        "\n## Every flight\n\n*Could be known*: minutes after the onset until it is significant, and \
         told apart if that is later.\nThe first statement, and the last.\n\n",
    );
    let mut table =
        markdown_table(["seed", "changed", "could be known", "first", "first statement", "last statement", "minutes"]);
    for flight in flown {
        let changes = flight.changes.iter().map(|change| match change.cause {
            0 => format!("{} at {:.1} min", change.text.replace('\n', " ").trim(), change.time_s / 60.0),
            cause => format!("{} {:.3} at {:.1} min", name(cause), change.size[0], change.time_s / 60.0),
        });
        let changes = changes.collect::<Vec<_>>().join("; ");
        let outcome = match flight.outcome() {
            Outcome::Right(delay_s) => format!("right, {:.1} min", delay_s / 60.0),
            Outcome::Rival(delay_s) => format!("rival, {:.1} min", delay_s / 60.0),
            Outcome::Wrong if flight.changes.is_empty() => "false".to_owned(),
            Outcome::Wrong => "other".to_owned(),
            Outcome::Unexplained => "none of these".to_owned(),
            Outcome::Silent => "silent".to_owned(),
        };
        let shown = |found: Option<&Statement>| found.map(statement).unwrap_or_default();
        table.add_row([
            flight.number.to_string(),
            if changes.is_empty() { "none".to_owned() } else { changes },
            flight.changes.first().zip(flight.knowable.as_ref()).map(knowable).unwrap_or_default(),
            outcome,
            shown(flight.first()),
            shown(flight.statements.last()),
            format!("{:.0}{}", flight.ended_s / 60.0, if flight.finished { "" } else { ", not finished" }),
        ]);
    }
    let _ = writeln!(text, "{table}");
    text
}
