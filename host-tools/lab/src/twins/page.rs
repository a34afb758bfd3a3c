//! The page: shares with their intervals, and every data set.

use super::score::{Counted, Twin};
use crate::intervals::Share;
use crate::wrap::wrapped;
use backseat_diagnose::torpedo::entries::ENTRIES;
use backseat_report::markdown::markdown_table;
use std::collections::BTreeMap;
use std::fmt::Write as _;

pub fn markdown(twins: &[Twin], first_seed: u64, flown: usize) -> String {
    let mut page = String::from("# Simulated twins of a torpedo's runs\n\n");
    let _ = writeln!(
        page,
        "Made by `cargo lab twins` (version {}): {} data sets of {flown} runs in each of two configurations, 30 to 60 s of \
         power each, logged at 2 Hz as an Iver2's control computer does, with a DVL once a second. The vehicle is the \
         simulator's, its coefficients differ from the textbook's by 10 % (one sigma). One or two effects are hidden, in each \
         fifth data set none. `diagnose` reads the folder and never sees what is hidden. Brackets are 95 % intervals of \
         shares.\n",
        env!("CARGO_PKG_VERSION"),
        twins.len(),
    );
    let with: Vec<&Twin> = twins.iter().filter(|twin| !twin.hidden.is_empty()).collect();
    let without: Vec<&Twin> = twins.iter().filter(|twin| twin.hidden.is_empty()).collect();
    let share = |of: &[&Twin], is: &dyn Fn(&Twin) -> bool| {
        Share { hits: of.iter().filter(|twin| is(twin)).count(), of: of.len() }.text()
    };
    let hidden: usize = with.iter().map(|twin| twin.hidden.len()).sum();
    let found: usize = with.iter().map(|twin| twin.found()).sum();
    let sum = |of: fn(&Twin) -> usize| twins.iter().map(of).sum::<usize>();
    let absent = twins.len() * ENTRIES.len() - hidden;
    let alarms = sum(|twin| twin.false_alarms().count());
    let mut table = markdown_table(["", "asked", "found"]);
    table.add_row(["first cause is one of those hidden", "95 %", &share(&with, &|twin| twin.is_first_right())]);
    let counts: [(&str, Counted); 2] = [("is 3 sigmas from none", |s| s.size), ("could be told", |s| s.outside)];
    for (what, by) in counts {
        let told: Vec<&Twin> = with.iter().copied().filter(|twin| twin.is_separable(by)).collect();
        let what = format!("the same where one of them {what}");
        table.add_row([&what, "95 %", &share(&told, &|twin| twin.is_first_right())]);
    }
    table.add_row(["or is said to be like one", "-", &share(&with, &|twin| twin.is_first_right_or_alike())]);
    table.add_row(["hidden effects that are named", "-", &Share { hits: found, of: hidden }.text()]);
    for (what, by) in counts {
        let [named, of] = with.iter().map(|twin| twin.separable(by)).fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
        let what = format!("of these each that {what}");
        table.add_row([&what, "-", &Share { hits: named, of }.text()]);
    }
    table.add_row([
        "nothing hidden, nothing named",
        "99 %",
        &share(&without, &|twin| twin.named.is_empty() && twin.refused.is_none()),
    ]);
    table.add_row(["entries that are not there and named", "below 1 %", &Share { hits: alarms, of: absent }.text()]);
    let all: Vec<&Twin> = twins.iter().collect();
    table.add_row(["data sets that are refused", "-", &share(&all, &|twin| twin.refused.is_some())]);
    let covered = Share { hits: sum(|twin| twin.covered), of: sum(|twin| twin.sized) };
    table.add_row(["95 % intervals that hold the number hidden", "93 to 97 %", &covered.text()]);
    let _ = writeln!(page, "{table}\n\n## By effect\n");
    let mut by_name: BTreeMap<&str, [usize; 4]> = BTreeMap::new();
    for twin in twins {
        for (name, _) in &twin.hidden {
            let row = by_name.entry(name).or_default();
            row[0] += 1;
            row[1] += usize::from(twin.named.contains(name));
            row[2] += usize::from(twin.named.first() == Some(name));
        }
        for name in twin.false_alarms() {
            by_name.entry(name).or_default()[3] += 1;
        }
    }
    let mut table = markdown_table(["effect", "hidden", "named", "named first", "named and not there"]);
    for (name, counts) in by_name {
        table.add_row([name.to_owned()].into_iter().chain(counts.map(|count| count.to_string())).collect::<Vec<_>>());
    }
    let _ = writeln!(
        page,
        "{table}\n\n## Each data set\n\nIn parentheses how many sigmas the size of what is hidden is from none, and outside \
         what the textbook leaves open of it (a DVL's scale by 2 %, say: that is no finding, however well it is known). From \
         3 outside on an effect counts as one that could be told. Sigmas are by the information of the runs, everything that \
         is asked being free, at the fit which has what is hidden and nothing else.\n"
    );
    let mut table = markdown_table(["seed", "hidden", "named, strongest first", "first right"]);
    for (seed, twin) in (first_seed..).zip(twins) {
        let each = twin.hidden.iter().zip(&twin.sigmas);
        let hidden: Vec<String> =
            each.map(|((name, number), s)| format!("{name}: {number} ({:.1}, {:.1})", s.size, s.outside)).collect();
        let first = match (twin.is_first_right(), twin.is_first_right_or_alike()) {
            (true, _) => "yes",
            (false, true) => "said to be like it",
            _ => "no",
        };
        let or_nothing = |list: &[String]| if list.is_empty() { "-".to_owned() } else { list.join(", ") };
        let named = twin.refused.as_ref().map_or_else(|| or_nothing(&twin.named), |why| format!("refused: {why}"));
        table.add_row([seed.to_string(), or_nothing(&hidden), named, first.to_owned()]);
    }
    let _ = writeln!(page, "{table}");
    wrapped(&page)
}
