//! What a panic or a fault leaves behind: a record in memory that a reset does not clear, a line
//! on standard error, and an exit code.

use core::cell::UnsafeCell;
use core::fmt::Write;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use heapless::String;

/// Says that a record was written.
const MAGIC: u32 = 0xbac5_ea7f;
/// Longer texts are cut.
const TEXT: usize = 160;

/// Exit codes of the image.
#[derive(Clone, Copy)]
#[repr(u32)]
enum ExitCode {
    Panic = 101,
    Fault = 102,
    UnexpectedInterrupt = 103,
}

/// The record.
#[repr(C)]
struct Record {
    magic: u32,
    cause: u32,
    length: u32,
    text: [u8; TEXT],
}

#[repr(transparent)]
struct Slot(UnsafeCell<MaybeUninit<Record>>);

// SAFETY: written with interrupts disabled just before the end, read before they are enabled.
unsafe impl Sync for Slot {}

/// Not cleared at start.
// SAFETY: any bytes are a valid `MaybeUninit`.
#[unsafe(link_section = ".uninit.failure")]
static SLOT: Slot = Slot(UnsafeCell::new(MaybeUninit::uninit()));

/// Logs the failure that ended the last run, once.
pub fn report_last() {
    let slot = SLOT.0.get().cast::<Record>();
    // SAFETY: every field is valid whatever its bits; at power-up the memory holds anything.
    // Volatile, so that the compiler does not argue from the missing write.
    let record = unsafe { slot.read_volatile() };
    if record.magic != MAGIC {
        return;
    }
    // SAFETY: as above.
    unsafe { (&raw mut (*slot).magic).write_volatile(0) };
    let text = record.text.get(..record.length as usize).unwrap_or_default();
    defmt::error!("the last run ended with {=u32}: {=str}", record.cause, core::str::from_utf8(text).unwrap_or("?"));
}

/// Leaves the record and ends the run.
fn end(cause: ExitCode, text: &String<TEXT>) -> ! {
    cortex_m::interrupt::disable();
    let mut record = Record { magic: MAGIC, cause: cause as u32, length: text.len() as u32, text: [0; TEXT] };
    record.text[..text.len()].copy_from_slice(text.as_bytes());
    // SAFETY: interrupts are disabled and nothing comes after this.
    unsafe { SLOT.0.get().cast::<Record>().write_volatile(record) };
    semihosting::eprintln!("backseat-mps2: {text}");
    semihosting::process::exit(cause as i32)
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let mut text = String::new();
    if let Some(location) = info.location() {
        let _ = write!(text, "panic at {location}: ");
    }
    // cut when it is longer
    let _ = write!(text, "{}", info.message());
    end(ExitCode::Panic, &text)
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: these registers can be read at any time.
    let scb = unsafe { &*SCB::PTR };
    let mut text = String::new();
    let _ = write!(
        text,
        "hard fault at {:#010x} (lr {:#010x}), cfsr {:#x}, hfsr {:#x}, bfar {:#010x}",
        frame.pc(),
        frame.lr(),
        scb.cfsr.read(),
        scb.hfsr.read(),
        scb.bfar.read()
    );
    end(ExitCode::Fault, &text)
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    let mut text = String::new();
    let _ = write!(text, "unexpected interrupt {number}");
    end(ExitCode::UnexpectedInterrupt, &text)
}
