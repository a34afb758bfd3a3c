//! Prints the digest of every item of [`exercise::vectors`]; a host test prints the same.
#![no_std]
#![no_main]

#[path = "../bare.rs"]
mod bare;
#[path = "../exercise/mod.rs"]
mod exercise;

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use cortex_m_rt::entry;
use exercise::vectors::{self, Objects};

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    semihosting::eprintln!("{info}");
    semihosting::process::exit(101)
}

struct Slot(UnsafeCell<MaybeUninit<Objects>>);

// SAFETY: only `main` uses it, and there are no interrupts.
unsafe impl Sync for Slot {}

/// In the larger RAM, which is not initialised at start: filter and controller stand here twice, once in the app.
// SAFETY: any bytes are a valid `MaybeUninit`.
#[unsafe(link_section = ".axisram.objects")]
static OBJECTS: Slot = Slot(UnsafeCell::new(MaybeUninit::uninit()));

static INITIAL: Objects = Objects::new();

#[entry]
fn main() -> ! {
    // SAFETY: `main` is entered once, and this is the only reference. Copied from flash: by value it would pass
    // over the stack.
    let objects = unsafe {
        OBJECTS.0.get().cast::<Objects>().copy_from_nonoverlapping(&raw const INITIAL, 1);
        &mut *OBJECTS.0.get().cast::<Objects>()
    };
    vectors::run(objects, &mut |name, digest| semihosting::println!("{digest:016x} {name}"));
    semihosting::process::exit(0)
}
