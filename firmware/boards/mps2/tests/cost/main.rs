//! What everything costs on the target, in instructions. Prints one row a line,
//! `group|name|states|entries|instructions|dense`, which a host test turns into docs/results/cost.md.
#![no_std]
#![no_main]

#[path = "../bare.rs"]
mod bare;
mod control;
mod cycle;
mod dense;
#[path = "../exercise/feed.rs"]
mod feed;
mod identification;
mod measure;
#[path = "../exercise/motion.rs"]
mod motion;
mod navigation;
mod parsers;
#[path = "../../../../tests/random.rs"]
mod random;
#[path = "../slot.rs"]
mod slot;

use backseat_app::{App, Pump};
use backseat_core::control::Controller;
use backseat_core::identification::Identifier;
use backseat_core::navigation::Navigator;
use cortex_m_rt::entry;
use feed::Frames;
use slot::Slot;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    semihosting::eprintln!("{info}");
    semihosting::process::exit(101)
}

/// What is too big for the stack.
struct Objects {
    navigator: Navigator,
    controller: Controller,
    identifier: Identifier,
    app: App,
    pump: Pump,
    frames: Frames,
}

static INITIAL: Objects = Objects {
    navigator: Navigator::new(),
    controller: Controller::new(),
    identifier: Identifier::new(),
    app: App::new(),
    pump: Pump::new(),
    frames: Frames::new(),
};

// SAFETY: a slot needs no initial value.
#[unsafe(link_section = ".axisram.objects")]
static OBJECTS: Slot<Objects> = Slot::new();

/// One row; `dense` is what the plain way costs, 0 where there is none.
fn row(group: &str, name: &str, states: usize, entries: usize, instructions: u32, dense: u32) {
    semihosting::println!("{group}|{name}|{states}|{entries}|{instructions}|{dense}");
}

#[entry]
fn main() -> ! {
    // SAFETY: `main` is entered once, and the objects hold no references.
    let Objects { navigator, controller, identifier, app, pump, frames } = unsafe { OBJECTS.fill(&INITIAL) };
    measure::start();
    measure::paint();
    cycle::measure(app, pump, frames);
    row("stack", "bytes", 0, 0, measure::stack_used(), 0);
    navigation::measure(navigator);
    control::measure(controller);
    identification::measure(identifier);
    parsers::measure(frames);
    semihosting::process::exit(0)
}
