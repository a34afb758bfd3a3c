//! The page: what of the effects put in is named, and how well it is sized.

use super::Done;
use super::score::Scored;
use crate::intervals::Share;
use crate::wrap::wrapped;
use backseat_report::markdown::markdown_table;
use std::fmt::Write as _;

/// The page; `refused` are logs with what speaks against each.
pub fn markdown(logs: &[(String, Done)], refused: &[(String, String)], seed: Option<u64>) -> String {
    let all: Vec<&Scored> = logs.iter().flat_map(|(_, done)| &done.scored).collect();
    let mut page = String::from("# Effects of known size in recorded logs\n\n");
    let _ = writeln!(
        page,
        "Made by `cargo lab injections DIR{}` (version {}), where DIR has the logs below. {} effects of known size are put into \
         the columns of {} logs by exact changes: what the sensor would have read. Each is diagnosed as `backseat diagnose` \
         does. The truth is what was put in, and of an entry that the log was found to hold as it was recorded, that size as \
         well.\n",
        seed.map_or_else(String::new, |seed| format!(" --seed {seed}")),
        env!("CARGO_PKG_VERSION"),
        all.len(),
        logs.len()
    );
    page += "*Beyond 3 sigma*: the size is three times its standard deviation or more, with all other entries and the \
             noise as it was found fitted beside it: what the log itself can say. *Named*: it is among the effects named, whatever the verdict. *Intervals*: of the sizes of what is \
             named, and how many of the 95 % intervals hold the truth; a log may hold some of an entry that is not significant by \
             itself, and the second line counts that estimate to the truth. *Wrongly explained*: the verdict is `explained`, and \
             a name is neither what was put in nor what the log itself holds. Brackets are 95 % intervals of shares.\n\n";
    let mut table = markdown_table(["", "asked", "found"]);
    let beyond: Vec<&&Scored> = all.iter().filter(|scored| scored.is_beyond()).collect();
    let sum = |of: fn(&Scored) -> usize| all.iter().map(|scored| of(scored)).sum();
    let of = sum(|scored| scored.intervals);
    let [hold, with_own] = [sum(|scored| scored.hold), sum(|scored| scored.hold_with_own)];
    let named = beyond.iter().filter(|scored| scored.is_named).count();
    let wrong = all.iter().filter(|scored| scored.is_wrong).count();
    table.add_row(["injections", "at least 120", &all.len().to_string()]);
    table.add_row(["beyond 3 sigma: named", "85 %", &Share { hits: named, of: beyond.len() }.text()]);
    table.add_row(["95 % intervals that hold the truth", "93 to 97 %", &Share { hits: hold, of }.text()]);
    table.add_row(["the same, with what the log itself may hold", "-", &Share { hits: with_own, of }.text()]);
    table.add_row(["wrongly explained", "at most 2 %", &Share { hits: wrong, of: all.len() }.text()]);
    let _ = writeln!(page, "{table}\n\n## By log\n");
    let mut table = markdown_table(HEADER.map(|head| if head.is_empty() { "log" } else { head }));
    for (name, done) in logs {
        table.add_row(row(name, &done.scored.iter().collect::<Vec<_>>()));
    }
    let _ = writeln!(page, "{table}\n");
    for (name, Done { base, .. }) in logs {
        let named = if base.named.is_empty() { "nothing".to_owned() } else { base.named.join(", ") };
        let _ = writeln!(
            page,
            "- {name}, {:.0} s, as it was recorded: {}; named is {named}",
            base.duration_s, base.verdict
        );
    }
    for (name, what) in refused {
        let _ = writeln!(page, "- {name}: refused by `backseat info`, nothing was put in: {what}");
    }
    let _ = writeln!(page, "\n## By effect\n");
    let mut table = markdown_table(HEADER.map(|head| if head.is_empty() { "put in" } else { head }));
    let kind = |scored: &Scored| {
        let effect = scored.effect.clone().unwrap_or_else(|| "a cause in no entry".to_owned());
        if scored.from_middle { format!("{effect}, from the middle on") } else { effect }
    };
    let mut kinds: Vec<String> = all.iter().map(|scored| kind(scored)).collect();
    kinds.sort();
    kinds.dedup();
    for name in kinds {
        table.add_row(row(&name, &all.iter().copied().filter(|scored| kind(scored) == name).collect::<Vec<_>>()));
    }
    let _ = writeln!(page, "{table}\n");
    page += &list("Beyond 3 sigma, and not named", logs, |scored| scored.is_beyond() && !scored.is_named);
    page += &list("Wrongly explained", logs, |scored| scored.is_wrong);
    page +=
        &list("Named, with an interval that does not hold the truth", logs, |scored| scored.hold < scored.intervals);
    wrapped(&page)
}

const HEADER: [&str; 8] = [
    "",
    "put in",
    "beyond 3 sigma",
    "named of these",
    "named of all",
    "intervals",
    "hold the truth",
    "wrongly explained",
];

fn row(name: &str, scored: &[&Scored]) -> Vec<String> {
    let count = |of: &dyn Fn(&Scored) -> bool| scored.iter().filter(|scored| of(scored)).count().to_string();
    let sum = |of: fn(&Scored) -> usize| scored.iter().map(|scored| of(scored)).sum::<usize>().to_string();
    vec![
        name.to_owned(),
        scored.len().to_string(),
        count(&Scored::is_beyond),
        count(&|scored| scored.is_beyond() && scored.is_named),
        count(&|scored| scored.is_named),
        sum(|scored| scored.intervals),
        sum(|scored| scored.hold),
        count(&|scored| scored.is_wrong),
    ]
}

fn list(title: &str, logs: &[(String, Done)], choose: impl Fn(&Scored) -> bool) -> String {
    let mut text = format!("## {title}\n\n");
    let mut is_empty = true;
    for (log, done) in logs {
        for scored in done.scored.iter().filter(|scored| choose(scored)) {
            is_empty = false;
            let named = if scored.named.is_empty() { "nothing".to_owned() } else { scored.named.join(", ") };
            let sigmas = scored.sigmas.map_or_else(String::new, |sigmas| format!(" ({sigmas:.1} sigma)"));
            let listed = if scored.is_listed { ", which lists it" } else { "" };
            let _ = writeln!(text, "- {log}, {}{sigmas}: {}, {named}{listed}", scored.name, scored.verdict);
        }
    }
    if is_empty {
        text += "None.\n";
    }
    text + "\n"
}
