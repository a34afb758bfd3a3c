//! How a run ends that the firmware itself spoils: what happened goes to backup SRAM, and the board starts again at once.

use crate::backup::CrashSlots;
use crate::vitals;
use backseat_app::store::keep_crash;
use backseat_wire::hostlink::{Crash, Task};
use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::SCB;
use embassy_stm32::{interrupt, pac};

unsafe extern "C" {
    // of memory.x: the note with the build ID; its first twelve bytes are sizes and type, the next four `GNU`
    static _build_id: [u32; 5];
    static _stack_start: u32;
    // of cortex-m-rt: the code
    static __stext: u32;
    static __etext: u32;
}

/// Exception that runs the app.
const APP: u16 = 16 + interrupt::CEC as u16;
/// CFSR (B3.2.15): the memory protection, or the bus, has refused an exception its frame.
const FRAME_REFUSED: u32 = 1 << 4 | 1 << 12;
/// Of an exception's frame, bytes: R0 to R3, R12, LR, PC, xPSR.
const FRAME: usize = 32;
/// A stack pointer that is so far below its stack has left it by an overflow, bytes.
const BELOW: usize = 0x1_0000;
/// Words of a full stack, from its end on, among which a return address is looked for.
const NEAR_THE_END: usize = 64;

/// Steps since start.
static STEPS: AtomicU32 = AtomicU32::new(0);

/// The app has taken a step.
pub fn stepped() {
    STEPS.fetch_add(1, Ordering::Relaxed);
}

/// First four bytes of the image's build ID, as `readelf -n` shows them.
pub fn build() -> u32 {
    // SAFETY: the linker puts the note there.
    u32::from_be(unsafe { (&raw const _build_id).read() }[4])
}

/// Number of the active exception in ICSR or xPSR.
fn number(register: u32) -> u16 {
    (register & 0x1FF) as u16
}

fn end(crash: Crash) -> ! {
    let task = match crash.exception {
        0 => Task::Thread,
        APP => Task::App,
        _ => Task::Interrupt,
    };
    let (step, stacks, time_us) = (STEPS.load(Ordering::Relaxed), vitals::stacks_used(), pac::TIM5.cnt().read());
    keep_crash(&mut CrashSlots::open(), &Crash { build: build(), time_us, task, step, stacks, ..crash });
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let (file, line) = info.location().map_or(("", 0), |place| (place.file(), place.line()));
    // SAFETY: this register can be read at any time.
    let exception = number(unsafe { &*SCB::PTR }.icsr.read());
    end(Crash { exception, ..Crash::at(file, line) })
}

/// Every fault ends here, a full stack too: the core enters the handler although it could not write the frame, and the
/// first use of that stack would lock it up. So the handler begins anew at the start of the interrupts' stack, which
/// nobody returns to. In the vector table by its name.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, MSP",
        "mrs r1, PSP",
        "mov r2, lr",
        "movw r3, #:lower16:{stack}",
        "movt r3, #:upper16:{stack}",
        "msr MSP, r3",
        "b {faulted}",
        stack = sym _stack_start,
        faulted = sym faulted,
    )
}

/// Of both stack pointers and EXC_RETURN (B1.5.8).
extern "C" fn faulted(msp: usize, psp: usize, exc_return: u32) -> ! {
    // SAFETY: these registers can be read at any time.
    let scb = unsafe { &*SCB::PTR };
    let (cfsr, hfsr) = (scb.cfsr.read(), scb.hfsr.read());
    // bit 7: the address is that of the memory protection; else that of the bus, valid or not
    let address = if cfsr & 1 << 7 != 0 { scb.mmfar.read() } else { scb.bfar.read() };
    let [interrupts, thread] = vitals::stacks();
    // bit 2: the frame is on thread mode's; bit 3: it was thread mode that was interrupted
    let (sp, [stack_end, stack_start]) = if exc_return & 1 << 2 != 0 { (psp, thread) } else { (msp, interrupts) };
    let in_app = exc_return & 1 << 3 == 0;
    let crash = Crash { sp: sp as u32, cfsr, hfsr, address, ..Crash::default() };
    let whole = cfsr & FRAME_REFUSED == 0 && sp >= stack_end && sp <= stack_start - FRAME && sp.is_multiple_of(4);
    if whole {
        // SAFETY: the frame is within the stack, and nothing but this handler runs any more; its own stack begins above.
        let [.., lr, pc, xpsr] = unsafe { (sp as *const [u32; FRAME / 4]).read_volatile() };
        end(Crash { pc, lr, exception: number(xpsr), ..crash })
    }
    let stack_overflow = cfsr & FRAME_REFUSED != 0 || (stack_end - BELOW..stack_end).contains(&sp);
    // without a frame nothing says which interrupt it was; the app is the one with deep calls
    let exception = if in_app { APP } else { 0 };
    end(Crash { stack_overflow, exception, lr: return_address(stack_end), ..crash })
}

/// What looks like one, next to the end of a stack; 0: nothing does.
fn return_address(stack_end: usize) -> u32 {
    let code = (&raw const __stext as u32)..(&raw const __etext as u32);
    let words = (0..NEAR_THE_END).map(|at| stack_end + 4 * at);
    // SAFETY: a stack is readable; what a word holds is of no matter.
    let mut words = words.map(|place| unsafe { (place as *const u32).read_volatile() });
    words.find(|word| word & 1 == 1 && code.contains(word)).unwrap_or(0)
}
