//! The deepest stacks of an image by its machine code: what each function takes of them, and who calls whom.
//!
//! A function's frame is the sum of all instructions in it that move the stack pointer down. Calls are branches to
//! other functions. A call through a register may reach every function whose address the caller, one of its own callers
//! or the image's constants hold. Formatting and panics are left out: they end the run, and
//! [`super::no_panic_can_be_reached`] shows that core, wire and app never get there. What cannot be bounded (recursion,
//! a frame of variable size) is an error.
//!
//! An image with executors has two stacks: the app's level and the interrupts above it run on one, thread mode on the
//! other. Only an executor calls tasks, and those that step the app belong to the app's.

use crate::thumb::{Instruction, decode};
use anyhow::{Context, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// What the processor pushes for an exception, floating-point registers and alignment included.
const EXCEPTION: u32 = 108;
/// First vector of a handler; before it are the initial stack pointer and the reset.
const HANDLERS: usize = 2;
/// Vector of the interrupt that cannot be masked, and comes on top of any other.
const NON_MASKABLE: usize = 2;
/// Vectors of faults, which end the run.
const FAULTS: std::ops::Range<usize> = 3..7;
/// Functions that a run does not come back from, by parts of their mangled names.
const ENDS: [&str; 5] = ["4core9panicking", "4core3fmt", "core..fmt..", "rust_begin_unwind", "7failure3end"];
/// The executor of the app's level, an interrupt, and that of thread mode.
const APP_EXECUTOR: &str = "CEC";
const THREAD_EXECUTOR: &str = "16embassy_executor8platform6thread8Executor3run";
/// What an executor calls.
const TASK: &str = "16embassy_executor3raw20TaskStorage$LT$F$GT$4poll";
/// What the app's level does.
const STEP: &str = "12backseat_app3app3App4step";

/// One function.
#[derive(Default)]
struct Function {
    name: String,
    end: u64,
    frame: u32,
    calls: BTreeSet<u64>,
    /// Calls through a register.
    indirect: bool,
    /// Functions whose address it holds.
    holds: BTreeSet<u64>,
}

/// The deepest a stack can get.
pub struct Stack {
    /// Package of its image.
    pub image: &'static str,
    /// Which it is.
    pub what: &'static str,
    /// With the deepest interrupt on top, and on that the one that cannot be masked.
    pub bytes: u32,
    /// 80 % of its room.
    pub limit: u32,
    /// Functions from its first one down, with their frames.
    pub path: Vec<(String, u32)>,
    /// What interrupts take on top of it, their exception frames included.
    pub interrupt: u32,
    /// Functions of the image on a way that call through a register.
    pub indirect: usize,
}

/// Bounds the stacks of an image.
pub fn bounds(image: &'static str, elf: &[u8]) -> anyhow::Result<Vec<Stack>> {
    let file = object::File::parse(elf)?;
    let mut functions = functions(&file)?;
    let starts: BTreeSet<u64> = functions.keys().copied().collect();
    for section in file.sections().filter(|section| section.kind() == object::SectionKind::Text) {
        read_code(&section, &file, &starts, &mut functions)?;
    }
    let constants = constants(&file, &starts)?;
    resolve(&mut functions, &constants);
    let has_executors = give_tasks(&mut functions)?;

    let vectors = section(&file, ".vector_table")?;
    let vectors: Vec<u64> = words(&vectors).map(|word| u64::from(word & !1)).collect();
    let reset = *vectors.get(1).context("no reset vector")?;
    let mut depths = Depths { functions: &functions, known: BTreeMap::new(), under_way: Vec::new() };
    let (mut interrupt, mut non_maskable, mut app) = (0, 0, None);
    for (vector, handler) in
        vectors.iter().enumerate().skip(HANDLERS).filter(|(i, start)| !FAULTS.contains(i) && **start != 0)
    {
        let depth = depths.of(*handler)?;
        if functions[handler].name == APP_EXECUTOR {
            app = Some(*handler);
        } else if vector == NON_MASKABLE {
            non_maskable = depth + EXCEPTION;
        } else {
            interrupt = interrupt.max(depth + EXCEPTION);
        }
    }
    let interrupt = interrupt + non_maskable;
    depths.of(reset)?;
    let limit = |stack: &str| -> anyhow::Result<u32> {
        let symbol = |end: &str| {
            let name = format!("_{stack}_{end}");
            let symbol = file.symbols().find(|symbol| symbol.name() == Ok(&name));
            symbol.map(|symbol| symbol.address()).with_context(|| format!("no {name}: memory.x"))
        };
        Ok(u32::try_from((symbol("start")? - symbol("end")?) * 4 / 5)?)
    };
    let stack = |what, first, interrupt, room| -> anyhow::Result<Stack> {
        let (bytes, path) = (depths.known[&first] + interrupt, depths.path(first));
        let indirect = functions.iter().filter(|(start, f)| f.indirect && depths.known.contains_key(start)).count();
        Ok(Stack { image, what, bytes, limit: limit(room)?, path, interrupt, indirect })
    };
    if !has_executors {
        return Ok(vec![stack("its stack", reset, interrupt, "stack")?]);
    }
    let app = app.context("no interrupt is the app's executor")?;
    // of thread mode's an interrupt takes what the processor pushes, and goes on on the other
    Ok(vec![
        stack("stack of interrupts", app, interrupt, "stack")?,
        stack("stack of thread mode", reset, EXCEPTION, "thread_stack")?,
    ])
}

/// Depths found so far.
struct Depths<'a> {
    functions: &'a BTreeMap<u64, Function>,
    known: BTreeMap<u64, u32>,
    under_way: Vec<u64>,
}

impl Depths<'_> {
    /// The deepest way from a function whose depth is known.
    fn path(&self, first: u64) -> Vec<(String, u32)> {
        let mut path = Vec::new();
        let mut next = Some(first);
        while let Some(function) = next.and_then(|start| self.functions.get(&start)) {
            path.push((format!("{:#}", rustc_demangle::demangle(&function.name)), function.frame));
            next = function.calls.iter().copied().max_by_key(|callee| self.known.get(callee));
        }
        path
    }

    fn of(&mut self, start: u64) -> anyhow::Result<u32> {
        if let Some(depth) = self.known.get(&start) {
            return Ok(*depth);
        }
        let function = self.functions.get(&start).with_context(|| format!("no function at {start:#x}"))?;
        if let Some(at) = self.under_way.iter().position(|other| *other == start) {
            let names: Vec<_> = self.under_way[at..].iter().map(|start| &*self.functions[start].name).collect();
            bail!("recursion: {}", names.join(" -> "));
        }
        self.under_way.push(start);
        let mut deepest = 0;
        for callee in &function.calls {
            deepest = deepest.max(self.of(*callee)?);
        }
        self.under_way.pop();
        let depth = function.frame + deepest;
        self.known.insert(start, depth);
        Ok(depth)
    }
}

/// Every function of the symbol table, by its start.
fn functions(file: &object::File<'_>) -> anyhow::Result<BTreeMap<u64, Function>> {
    let mut functions = BTreeMap::new();
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.is_definition()) {
        let name = symbol.name()?;
        if name.starts_with('$') {
            continue;
        }
        let start = symbol.address() & !1;
        let entry = functions.entry(start).or_insert_with(Function::default);
        entry.end = entry.end.max(start + symbol.size());
        if entry.name.is_empty() || symbol.size() > 0 {
            entry.name = name.to_owned();
        }
    }
    // Assembly without a size reaches to the next symbol.
    let starts: Vec<u64> = functions.keys().copied().collect();
    for pair in starts.windows(2) {
        if let Some(function) = functions.get_mut(&pair[0]).filter(|function| function.end <= pair[0]) {
            function.end = pair[1];
        }
    }
    Ok(functions)
}

fn section(file: &object::File<'_>, name: &str) -> anyhow::Result<Vec<u8>> {
    Ok(file.section_by_name(name).with_context(|| format!("no section {name}"))?.data()?.to_vec())
}

fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word))
}

/// Functions that constants and initial values point to.
fn constants(file: &object::File<'_>, starts: &BTreeSet<u64>) -> anyhow::Result<BTreeSet<u64>> {
    let mut found = BTreeSet::new();
    for name in [".rodata", ".data"] {
        found.extend(words(&section(file, name)?).filter_map(|word| function_at(word, starts)));
    }
    Ok(found)
}

/// The function that a word points to, if it does: code addresses are odd.
fn function_at(word: u32, starts: &BTreeSet<u64>) -> Option<u64> {
    let start = u64::from(word & !1);
    (word & 1 == 1 && starts.contains(&start)).then_some(start)
}

/// Frames, calls and addresses held of the functions of one section.
fn read_code(
    section: &object::Section<'_, '_>,
    file: &object::File<'_>,
    starts: &BTreeSet<u64>,
    functions: &mut BTreeMap<u64, Function>,
) -> anyhow::Result<()> {
    let base = section.address();
    let bytes = section.data()?;
    let half = |address: u64| -> Option<u16> {
        let at = usize::try_from(address.checked_sub(base)?).ok()?;
        Some(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
    };
    let word = |address: u64| Some(u32::from(half(address)?) | u32::from(half(address + 2)?) << 16);
    // Where code ends and data begins inside functions.
    let marks: BTreeMap<u64, bool> = file
        .symbols()
        .filter_map(|symbol| Some((symbol.address(), symbol.name().ok()?.to_owned())))
        .filter(|(_, name)| name.starts_with("$t") || name.starts_with("$d"))
        .map(|(address, name)| (address, name.starts_with("$d")))
        .collect();
    let owner = |address: u64| starts.range(..=address).next_back().copied();
    let end = base + section.size();
    for (&start, function) in functions.range_mut(base..end) {
        let mut halves = BTreeMap::new();
        let mut at = start;
        while at < function.end.min(end) {
            if marks.range(..=at).next_back().is_some_and(|(_, data)| *data) {
                at += 2;
                continue;
            }
            let first = half(at).context("code ends inside a function")?;
            let (instruction, length) = decode(first, half(at + 2).unwrap_or(0), at);
            match instruction {
                Instruction::Down(bytes) => function.frame += bytes,
                Instruction::DownByRegister => bail!("{}: a frame of variable size", function.name),
                Instruction::Call(target) => {
                    function.calls.extend(owner(target));
                }
                // A tail call, unless it stays inside.
                Instruction::Branch(target) if !(start..function.end).contains(&target) => {
                    function.calls.extend(owner(target));
                }
                Instruction::CallRegister => function.indirect = true,
                Instruction::MoveLow(register, low) => {
                    halves.insert(register, low);
                }
                Instruction::MoveHigh(register, high) => {
                    let low = halves.get(&register).copied().unwrap_or(0);
                    function.holds.extend(function_at(u32::from(high) << 16 | u32::from(low), starts));
                }
                Instruction::Load(address) => {
                    function.holds.extend(word(address).and_then(|word| function_at(word, starts)));
                }
                Instruction::Branch(_) | Instruction::Other => {}
            }
            at += length;
        }
    }
    ensure!(!functions.is_empty(), "no functions");
    Ok(())
}

/// Gives calls through registers their possible ends, and cuts off what ends the run.
fn resolve(functions: &mut BTreeMap<u64, Function>, constants: &BTreeSet<u64>) {
    let ends: BTreeSet<u64> = functions
        .iter()
        .filter(|(_, function)| ENDS.iter().any(|part| function.name.contains(part)))
        .map(|(start, _)| *start)
        .collect();
    let mut callers: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for (start, function) in &*functions {
        for callee in &function.calls {
            callers.entry(*callee).or_default().insert(*start);
        }
    }
    let tasks: BTreeSet<u64> = named(functions, TASK).collect();
    let held: BTreeMap<u64, BTreeSet<u64>> = functions.iter().map(|(start, f)| (*start, f.holds.clone())).collect();
    for (start, function) in functions.iter_mut() {
        if function.indirect {
            let around = callers.get(start).into_iter().flatten().chain([start]);
            let held = around.flat_map(|around| held.get(around)).flatten();
            function.calls.extend(held.chain(constants).filter(|start| !tasks.contains(start)));
        }
        function.calls.retain(|callee| !ends.contains(callee));
    }
}

fn named<'a>(functions: &'a BTreeMap<u64, Function>, part: &'a str) -> impl Iterator<Item = u64> + 'a {
    functions.iter().filter(move |(_, function)| function.name.contains(part)).map(|(start, _)| *start)
}

/// Gives each executor its tasks; false when the image has none.
fn give_tasks(functions: &mut BTreeMap<u64, Function>) -> anyhow::Result<bool> {
    let tasks: Vec<u64> = named(functions, TASK).collect();
    if tasks.is_empty() {
        return Ok(false);
    }
    let step = named(functions, STEP).next().context("no function steps the app")?;
    let steps = |task: &u64| {
        let (mut seen, mut ahead) = (BTreeSet::new(), vec![*task]);
        while let Some(start) = ahead.pop() {
            if seen.insert(start) {
                ahead.extend(functions.get(&start).into_iter().flat_map(|function| &function.calls));
            }
        }
        seen.contains(&step)
    };
    let (app, others): (Vec<u64>, Vec<u64>) = tasks.iter().partition(|task| steps(task));
    ensure!(app.len() == 1, "{} tasks step the app", app.len());
    // a task that does not step may be of either
    for (executor, tasks) in [(APP_EXECUTOR, &tasks), (THREAD_EXECUTOR, &others)] {
        let start = named(functions, executor).next().with_context(|| format!("no function {executor}"))?;
        functions
            .get_mut(&start)
            .filter(|function| function.indirect)
            .context("an executor that calls nothing")?
            .calls
            .extend(tasks);
    }
    Ok(true)
}
