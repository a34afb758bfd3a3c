//! Prints the digest of every item of [`exercise::vectors`]; a host test prints the same.
#![no_std]
#![no_main]

#[path = "bare.rs"]
mod bare;
#[path = "exercise/mod.rs"]
mod exercise;
#[path = "slot.rs"]
mod slot;

use cortex_m_rt::entry;
use exercise::vectors::{self, Objects};
use slot::Slot;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    semihosting::eprintln!("{info}");
    semihosting::process::exit(101)
}

static INITIAL: Objects = Objects::new();

// SAFETY: a slot needs no initial value.
#[unsafe(link_section = ".axisram.objects")]
static OBJECTS: Slot<Objects> = Slot::new();

#[entry]
fn main() -> ! {
    // SAFETY: `main` is entered once, and the objects hold no references.
    let objects = unsafe { OBJECTS.fill(&INITIAL) };
    vectors::run(objects, &mut |name, digest| semihosting::println!("{digest:016x} {name}"));
    semihosting::process::exit(0)
}
