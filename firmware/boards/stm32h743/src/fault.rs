//! How a run ends that the firmware itself spoils: what happened goes to backup SRAM, and the board starts again at once.

use crate::backup;
use backseat_app::store::encode_crash;
use backseat_wire::hostlink::Crash;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

unsafe extern "C" {
    // of memory.x: the note with the build ID; its first twelve bytes are sizes and type, the next four `GNU`
    static _build_id: [u32; 5];
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

fn end(crash: &Crash) -> ! {
    let crash = Crash { build: build(), time_us: pac::TIM5.cnt().read(), ..*crash };
    backup::write_crash(&encode_crash(&crash));
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let (file, line) = info.location().map_or(("", 0), |place| (place.file(), place.line()));
    defmt::error!("panic at {=str}:{=u32}", file, line);
    // SAFETY: this register can be read at any time.
    let exception = number(unsafe { &*SCB::PTR }.icsr.read());
    end(&Crash { exception, ..Crash::at(file, line) })
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: these registers can be read at any time.
    let scb = unsafe { &*SCB::PTR };
    let (cfsr, hfsr) = (scb.cfsr.read(), scb.hfsr.read());
    // bit 7: the address is that of the memory protection; else that of the bus, valid or not
    let address = if cfsr & 1 << 7 != 0 { scb.mmfar.read() } else { scb.bfar.read() };
    let sp = core::ptr::from_ref(frame) as u32;
    defmt::error!("hard fault at {=u32:#010x}", frame.pc());
    let exception = number(frame.xpsr());
    end(&Crash { pc: frame.pc(), lr: frame.lr(), sp, cfsr, hfsr, address, exception, ..Crash::default() })
}
