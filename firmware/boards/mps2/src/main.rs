//! The backseat app on QEMU's `mps2-an500`: a Cortex-M7 with five UARTs.
//!
//! | module | concept |
//! |---|---|
//! | `uart` | the five ports, as `embedded-io` |
//! | `clock` | board time and the alarm for the next step |
//! | `interrupts` | vector table and what wakes the loop |
//! | `store` | parameters, in RAM that a reset leaves alone |
//! | `failure` | what a panic or a fault leaves behind |
#![no_std]
#![no_main]

#[cfg(not(all(target_arch = "arm", target_os = "none")))]
compile_error!("an ARM image: cargo build -p backseat-mps2 --profile dist --target thumbv7em-none-eabihf");

mod clock;
mod failure;
mod interrupts;
mod store;
mod uart;

use backseat_app::{App, Progress, Pump};
use clock::Clock;
use cortex_m_rt::entry;
use defmt_semihosting as _;
use static_cell::ConstStaticCell;
use store::Store;
use uart::{Uart, Uarts};

/// In the larger RAM, as on the real board. A new app is zero bytes alone, and of another one this section refuses to be
/// assembled.
#[unsafe(link_section = ".bss.axisram.app")]
static APP: ConstStaticCell<App> = ConstStaticCell::new(App::new());
static PUMP: ConstStaticCell<Pump> = ConstStaticCell::new(Pump::new());

unsafe extern "C" {
    // of memory.x, around the sections `.bss.axisram`
    static mut _axi_zero_start: u64;
    static mut _axi_zero_end: u64;
}

#[entry]
fn main() -> ! {
    // SAFETY: before anything there is used.
    unsafe {
        let zero = &raw mut _axi_zero_start;
        zero.write_bytes(0, (&raw mut _axi_zero_end).offset_from_unsigned(zero));
    }
    let (app, pump) = (APP.take(), PUMP.take());
    let mut clock = Clock::start();
    let Uarts { mut ports, overruns } = uart::start();
    interrupts::enable();
    // The simulator takes the first it hears as "ports are open".
    defmt::info!("backseat-mps2 {=str}", env!("CARGO_PKG_VERSION"));
    failure::report_last();
    let mut store = Store::open(app);
    loop {
        interrupts::begin();
        let Ok(progress) = pump.poll(app, &mut ports, clock.now_us());
        if pump.is_waiting() {
            // two seconds of it would overflow a queue
            let [devices @ .., _host] = &mut ports;
            devices.iter_mut().for_each(Uart::discard);
        }
        store.serve(app);
        overruns.report(app);
        if let Progress::IdleUntil(until_us) = progress {
            clock.wake_at(until_us);
            interrupts::wait();
        }
    }
}
