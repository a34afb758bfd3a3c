//! The cost table: what the image measured, beside the plain way, the arithmetic that is needed, and the budgets.

use crate::image::Image;
use crate::stack::Stack;
use std::fmt::Write;

/// One row that the image printed.
pub struct Row {
    group: String,
    name: String,
    /// States of the filter (for the worst cycle: its step).
    states: usize,
    /// Entries of a row of H (of a parser: bytes of the frame).
    entries: usize,
    /// Instructions (of the stack: bytes).
    measured: u32,
    dense: u32,
}

impl Row {
    fn parse(line: &str) -> Option<Self> {
        let mut fields = line.split('|');
        let mut next = || fields.next();
        Some(Self {
            group: next()?.to_owned(),
            name: next()?.to_owned(),
            states: next()?.parse().ok()?,
            entries: next()?.parse().ok()?,
            measured: next()?.parse().ok()?,
            dense: next()?.parse().ok()?,
        })
    }

    fn is(&self, group: &str, name: &str) -> bool {
        self.group == group && self.name == name
    }

    fn scalars(&self) -> u32 {
        match self.name.as_str() {
            "attitude" | "rates" | "DVL bottom track" | "DVL water track" => 3,
            "vehicle GNSS" | "ship GNSS" => 2,
            _ => 1,
        }
    }

    fn label(&self) -> String {
        format!("{}, {} states", self.name, self.states)
    }

    /// Floating-point operations; see [`COUNTED`].
    fn operations(&self) -> usize {
        let (n, k) = (self.states, self.entries);
        let pairs = if n == 24 { 3 } else { 5 };
        // of those with 34 one is a parameter of the plant, of those with 42 eight, two fins, ballast, trim and lag
        let of_plant = match n {
            34 => 1,
            42 => 13,
            _ => 0,
        };
        let plant = of_plant * (2 * 12 * (n - 12) + 4 * 78);
        let covariance = 2 * 98 * (n - 12) + 2 * (12 * 98 + 78 * 8 + 23) + 78 + pairs * 2 * n + plant;
        match (self.group.as_str(), self.name.as_str()) {
            ("predict", "covariance propagation") => covariance,
            ("predict", "whole step") => covariance + DISCRETISATION,
            ("predict", _) => DISCRETISATION,
            ("update", _) => self.scalars() as usize * (2 * k * n + 2 * k + n + 2 * n + n * (n + 1)),
            ("clone", "vehicle") => 3 * 2 * (k - 1) * (n - 1),
            _ => 0,
        }
    }
}

/// Series of order 6 over nine columns, its sums at three times, the quadrature; 1,000 for model and Jacobian.
const DISCRETISATION: usize = 9 * 5 * 160 + 96 + 160 + 144 + 2160 + 144 + 3 * (6 * 78 * 2 + 72) + 1000;

const COUNTED: &str = "\
Operations are the additions and multiplications that the mathematics needs with the structure used: of F and Φ only \
entries that can differ from zero, of P one triangle, of H the entries listed. A multiplication and its addition are \
two, a division is one. Propagation: 98 entries of Φ for each state outside the vehicle's block, the block's two \
products, Q, one shear for each position and velocity of ship and current, and with 34 states (the current, thrust_loss \
and sound_speed are estimated) one for the plant's parameter, with 42 (the robust filter) 13. Update of a scalar: P hᵀ, S, K, x and \
one triangle of P; what makes the row of H is not counted. Model and discretisation: a Taylor series of order 6 and \
the quadrature, and about 1,000 for model and Jacobian; sines and roots are not counted.";

/// Limit of a cycle in which no mission is under way, instructions.
const AT_REST: u32 = 3_600_000;

struct Budget {
    what: &'static str,
    limit: u32,
    /// What it is, and its worst row.
    measured: (u32, String),
}

fn budgets(rows: &[Row], images: &[Image; 2], stacks: &[Stack]) -> Vec<Budget> {
    let worst = |group: &str, name: Option<&str>| {
        let rows = rows.iter().filter(|row| row.group == group && name.is_none_or(|name| row.name == name));
        let worst = rows.max_by_key(|row| row.measured / row.scalars()).expect("the image measures it");
        let label = if worst.states > 0 && group != "cycle" { worst.label() } else { worst.name.clone() };
        (worst.measured / worst.scalars(), label)
    };
    let budget = |what, limit, measured| Budget { what, limit, measured };
    let stack_limit = images[0].stack_limit;
    let mut budgets = vec![
        // For the robust filter's 42 states; a tenth of 480 MHz at two cycles an instruction for the whole cycle.
        budget("covariance propagation", 60_000, worst("predict", Some("covariance propagation"))),
        budget(
            "model, Jacobian and discretisation",
            45_000,
            worst("predict", Some("model, Jacobian and discretisation")),
        ),
        budget("scalar update", 10_000, worst("update", None)),
        budget("10 Hz cycle: 10 % of 480 MHz at 2 cycles an instruction", 2_400_000, worst("cycle", Some("worst"))),
        budget("cycle at rest: 15 % of 480 MHz at 2 cycles an instruction", AT_REST, worst("cycle", Some("first"))),
        budget("cycle at rest: 15 % of 480 MHz at 2 cycles an instruction", AT_REST, worst("cycle", Some("commit"))),
        budget("stack, bytes, painted", stack_limit, (worst("stack", None).0, "cost".to_owned())),
    ];
    // 80 % of each stack's room
    budgets.extend(stacks.iter().map(|Stack { what, bytes, limit, image, .. }| {
        budget("stack, bytes, bound by the call graph", *limit, (*bytes, format!("{image}, {what}")))
    }));
    for Image { name, flash, dtcm, axi, .. } in images {
        for (what, share) in [("flash, bytes", flash), ("DTCM without stack, bytes", dtcm), ("AXI SRAM, bytes", axi)] {
            budgets.push(budget(what, share.limit, (share.taken, (*name).to_owned())));
        }
    }
    budgets
}

/// What is over budget.
pub fn violations(rows: &[Row], images: &[Image; 2], stacks: &[Stack]) -> Vec<String> {
    let over = |budget: Budget| {
        let (measured, of) = budget.measured;
        (measured > budget.limit).then(|| format!("{}: {measured} ({of}), limit {}", budget.what, budget.limit))
    };
    budgets(rows, images, stacks).into_iter().filter_map(over).collect()
}

/// The rows of a run.
pub fn rows(text: &str) -> Vec<Row> {
    text.lines().filter_map(Row::parse).collect()
}

fn thousands(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// docs/results/cost.md.
pub fn markdown(rows: &[Row], images: &[Image; 2], stacks: &[Stack]) -> String {
    let mut out = String::from(HEADER);
    out.push_str("| budget | limit | measured | worst | |\n|---|--:|--:|---|---|\n");
    for budget in budgets(rows, images, stacks) {
        let (measured, of) = &budget.measured;
        let verdict = match measured.checked_sub(budget.limit) {
            Some(over @ 1..) => format!("**over by {:.0} %**", 100.0 * f64::from(over) / f64::from(budget.limit)),
            _ => format!("{:.0} %", 100.0 * f64::from(*measured) / f64::from(budget.limit)),
        };
        let (limit, measured) = (thousands(budget.limit.into()), thousands((*measured).into()));
        writeln!(out, "| {} | {limit} | {measured} | {of} | {verdict} |", budget.what).unwrap();
    }
    navigation(&mut out, rows);
    effects(&mut out, rows);
    plain(&mut out, rows);
    stack(&mut out, stacks);
    out.push_str(FOOTER);
    out
}

fn effects(out: &mut String, rows: &[Row]) {
    out.push_str("\n## What an effect adds, instructions\n\n");
    out.push_str(
        "To a step of the process, and to the measurement that it changes (all scalars of one; depth where it changes none).\n\
         Fixed: a value of the effect set; states: its parameters estimated.\n\n",
    );
    out.push_str("| effect | as | step | measurement |\n|---|---|--:|--:|\n");
    for row in rows.iter().filter(|row| row.group == "effect") {
        let form = match row.states {
            0 => "fixed".to_owned(),
            1 => "1 state".to_owned(),
            n => format!("{n} states"),
        };
        // a difference of two counts, each to the timer's tick
        let rounded = |count: u32| thousands(u64::from((count + 5) / 10) * 10);
        let (step, measurement) = (rounded(row.measured), rounded(row.dense));
        writeln!(out, "| {} | {form} | {step} | {measurement} |", row.name).unwrap();
    }
}

fn navigation(out: &mut String, rows: &[Row]) {
    writeln!(out, "\n## Navigation, instructions\n\n{COUNTED}\n").unwrap();
    out.push_str("Scalars are fused one after another; the dense update takes a measurement's scalars at once.\n\n");
    out.push_str("| step | states | entries of H | instructions | a scalar | dense | dense / ours | operations | instructions / operation |\n");
    out.push_str("|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for row in rows.iter().filter(|row| ["predict", "update", "clone", "digest"].contains(&row.group.as_str())) {
        let (operations, measured) = (row.operations(), row.measured);
        let blank = |there: bool, text: String| if there { text } else { String::new() };
        let kind = if row.group == "clone" { "clone: " } else { "" };
        writeln!(
            out,
            "| {kind}{} | {} | {} | {} | {} | {} | {} | {} | {} |",
            row.name,
            row.states,
            blank(row.group == "update", row.entries.to_string()),
            thousands(measured.into()),
            blank(row.group == "update", thousands((measured / row.scalars()).into())),
            blank(row.dense > 0, thousands(row.dense.into())),
            blank(row.dense > 0, format!("{:.1}", f64::from(row.dense) / f64::from(measured))),
            blank(operations > 0, thousands(operations as u64)),
            blank(operations > 0, format!("{:.1}", f64::from(measured) / operations as f64)),
        )
        .unwrap();
    }
}

fn plain(out: &mut String, rows: &[Row]) {
    out.push_str("\n## Control, instructions (the dearest of many)\n\n| | |\n|---|--:|\n");
    for row in rows.iter().filter(|row| row.group == "control") {
        let slices = if row.entries > 0 { format!(" (of {})", row.entries) } else { String::new() };
        writeln!(out, "| {}{slices} | {} |", row.name, thousands(row.measured.into())).unwrap();
    }
    out.push_str("\n## Identification, instructions (the dearest of many)\n\n| | |\n|---|--:|\n");
    for row in rows.iter().filter(|row| row.group == "identification") {
        writeln!(out, "| {} | {} |", row.name, thousands(row.measured.into())).unwrap();
    }
    out.push_str("\n## One frame through framer and parser, instructions\n\n| frame | bytes | |\n|---|--:|--:|\n");
    for row in rows.iter().filter(|row| row.group == "parse") {
        let name = if row.name.starts_with("$C") && row.name.contains('P') { "$C" } else { &row.name };
        writeln!(out, "| {name} | {} | {} |", row.entries, thousands(row.measured.into())).unwrap();
    }
    out.push_str("\n## A whole cycle of 0.1 s behind its pump, instructions\n\n| | |\n|---|--:|\n");
    for (name, words) in [
        ("worst", "under way: the dearest of 101 s"),
        ("mean", "under way: mean"),
        ("first", "first one: trim and gain are solved at once, before navigation has begun"),
        ("commit", "commit of parameters that rebuild filter and controller"),
    ] {
        for row in rows.iter().filter(|row| row.is("cycle", name)) {
            writeln!(out, "| {words} | {} |", thousands(row.measured.into())).unwrap();
        }
    }
    out.push_str(
        "\nAll sensors at 10 Hz (DVL with bottom and water track), robust filter and its bank, range and range\n\
         rate of a packet with the vehicle's state cloned, identification, LQR about the reference trajectory, telemetry.\n\n\
         The first cycle and a commit solve the regulator's gain at once (above), as the answer to a commit says whether the\n\
         new parameters have one; under way it is solved in slices. They may take 15 % of a cycle, 15 ms: no mission is under\n\
         way then, and while one is, a commit is refused. The next step is due 100 ms after the last, each receive ring holds\n\
         178 ms of its line, and the watchdog waits 600 ms.\n",
    );
}

fn stack(out: &mut String, stacks: &[Stack]) {
    out.push_str(
        "\n## Stack\n\n\
         Painted before and read after the voyage above, mission and parameter transfer included. And bounded, to 80 % of\n\
         the room: the test reads from each image's machine code what each function takes and calls, and follows every way,\n\
         with the deepest interrupt on top (they have one priority, so one at a time), and on that the one that cannot be\n\
         masked. There is no recursion and no frame of variable size, or the test fails. A call through a pointer counts as one of every function whose address the\n\
         caller, its callers or the image's constants hold; of tasks, as one of every task of that executor. Panics end the\n\
         run and are not followed. The deepest way of each, with what each function takes:\n",
    );
    for Stack { image, what, path, interrupt, indirect, .. } in stacks {
        writeln!(
            out,
            "\n{image}, {what}; interrupts on top {interrupt} bytes; {indirect} functions of the image call by pointer:\n"
        )
        .unwrap();
        for (name, bytes) in path.iter().filter(|(_, bytes)| *bytes > 0) {
            writeln!(out, "- {} {name}", thousands((*bytes).into())).unwrap();
        }
    }
}

const HEADER: &str = "\
# What it costs on the board

Written by `BACKSEAT_WRITE_COST=1 cargo test -p hil-sim --test target`; do not edit. The same test without the variable
is the gate: it fails when a budget is exceeded, or when a number is more than 10 % off this table.

Measured on the ARM image `firmware/boards/mps2/tests/cost` in QEMU, mps2-an500, `-icount`:
instructions of a Cortex-M7 with double precision, repeatable to the timer's tick. No cycles: caches, flash wait states
and dual issue are the real board's. Limits of flash and memory are those of `memory.x`. The stack of the STM32H743's
image is painted in its [emulation](emulation.md).

";

const FOOTER: &str = "
## When the panic gate fails

`nopanic` links core, wire and app with a panic handler that does not exist; \"undefined symbol: a_panic_can_be_reached\"
says that an input can reach a panic. To see where, link it all the same and look for the callers of `core::panicking`:

    cargo rustc -p backseat-mps2 --bin nopanic --profile dist --target thumbv7em-none-eabihf -- \\
        -C link-arg=--warn-unresolved-symbols
    llvm-objdump -d --mcpu=cortex-m7 target/thumbv7em-none-eabihf/dist/nopanic |
        grep -e '[0-9a-zE]E>:$' -e 'bl.*panicking' | grep -B1 'bl.*panicking'
";

/// Lines whose numbers are more than a tenth away from the tracked table's.
pub fn drift(tracked: &str, now: &str) -> Vec<String> {
    let numbers = |line: &str| -> Vec<f64> {
        line.split('|').filter_map(|cell| cell.trim().replace(',', "").parse().ok()).collect()
    };
    let name = |line: &str| line.split('|').nth(1).map(str::to_owned);
    let mut tracked = tracked.lines();
    let mut changed = Vec::new();
    for line in now.lines() {
        let old = tracked.next().unwrap_or_default();
        let (a, b) = (numbers(old), numbers(line));
        let same = a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 0.1 * a.abs().max(b.abs()));
        if !same || name(old) != name(line) {
            changed.push(format!("was {old}\nis  {line}"));
        }
    }
    changed
}
