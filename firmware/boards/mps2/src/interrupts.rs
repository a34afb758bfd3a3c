//! Vector table, and the loop's sleep.

use crate::{clock, uart};
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

/// Interrupts of the machine that are used.
#[derive(Clone, Copy)]
#[repr(u16)]
enum Interrupt {
    Uart0Receive = 0,
    Uart0Transmit = 1,
    Uart1Receive = 2,
    Uart1Transmit = 3,
    Uart2Receive = 4,
    Uart2Transmit = 5,
    Timer0 = 8,
    Timer1 = 9,
    Uart3Receive = 18,
    Uart3Transmit = 19,
    Uart4Receive = 20,
    Uart4Transmit = 21,
}

impl Interrupt {
    const ALL: [Self; 12] = [
        Self::Uart0Receive,
        Self::Uart0Transmit,
        Self::Uart1Receive,
        Self::Uart1Transmit,
        Self::Uart2Receive,
        Self::Uart2Transmit,
        Self::Timer0,
        Self::Timer1,
        Self::Uart3Receive,
        Self::Uart3Transmit,
        Self::Uart4Receive,
        Self::Uart4Transmit,
    ];
}

// SAFETY: the numbers are the machine's, and do not change.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

type Handler = unsafe extern "C" fn();

unsafe extern "C" {
    /// cortex-m-rt's name for [`crate::failure`]'s handler of all else.
    safe fn DefaultHandler();
}

/// The machine's part of the vector table.
// SAFETY: name and section are what cortex-m-rt's linker script expects.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".vector_table.interrupts")]
static __INTERRUPTS: [Handler; 32] = {
    let mut table: [Handler; 32] = [DefaultHandler; 32];
    table[Interrupt::Uart0Receive as usize] = receive::<0>;
    table[Interrupt::Uart0Transmit as usize] = transmit::<0>;
    table[Interrupt::Uart1Receive as usize] = receive::<1>;
    table[Interrupt::Uart1Transmit as usize] = transmit::<1>;
    table[Interrupt::Uart2Receive as usize] = receive::<2>;
    table[Interrupt::Uart2Transmit as usize] = transmit::<2>;
    table[Interrupt::Uart3Receive as usize] = receive::<3>;
    table[Interrupt::Uart3Transmit as usize] = transmit::<3>;
    table[Interrupt::Uart4Receive as usize] = receive::<4>;
    table[Interrupt::Uart4Transmit as usize] = transmit::<4>;
    table[Interrupt::Timer0 as usize] = wrapped;
    table[Interrupt::Timer1 as usize] = alarm;
    table
};

extern "C" fn receive<const UART: usize>() {
    uart::on_receive(UART);
    WOKEN.store(true, Ordering::Relaxed);
}

extern "C" fn transmit<const UART: usize>() {
    uart::on_transmit(UART);
    WOKEN.store(true, Ordering::Relaxed);
}

extern "C" fn wrapped() {
    clock::on_wrap();
}

extern "C" fn alarm() {
    clock::on_alarm();
    WOKEN.store(true, Ordering::Relaxed);
}

/// Something happened since [`begin`].
static WOKEN: AtomicBool = AtomicBool::new(false);

/// Lets all of [`Interrupt`] through; what they touch has to be set up.
pub fn enable() {
    for interrupt in Interrupt::ALL {
        // SAFETY: no critical section is built on masked interrupts here.
        unsafe { NVIC::unmask(interrupt) };
    }
}

/// What happens from here on ends the next [`wait`].
pub fn begin() {
    WOKEN.store(false, Ordering::Relaxed);
}

/// Sleeps until an interrupt has come since [`begin`].
///
/// WFI, not WFE: QEMU runs on through WFE, which costs it time. With interrupts disabled it still
/// wakes, so that none slips in between the look and the sleep.
pub fn wait() {
    cortex_m::interrupt::free(|_| {
        if !WOKEN.load(Ordering::Relaxed) {
            cortex_m::asm::wfi();
        }
    });
}
