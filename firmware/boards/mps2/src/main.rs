//! The backseat app on QEMU's `mps2-an500`: a Cortex-M7 with five UARTs.
//!
//! | module | concept |
//! |---|---|
//! | `uart` | the five ports, as `embedded-io` |
//! | `clock` | board time and the alarm for the next step |
//! | `interrupts` | vector table and what wakes the loop |
//! | `slot` | a place in the larger RAM |
//! | `store` | parameters, in RAM that a reset leaves alone |
//! | `failure` | what a panic or a fault leaves behind |
#![no_std]
#![no_main]

#[cfg(not(all(target_arch = "arm", target_os = "none")))]
compile_error!("an ARM image: cargo build -p backseat-mps2 --profile dist --target thumbv7em-none-eabihf");

mod clock;
mod failure;
mod interrupts;
mod slot;
mod store;
mod uart;

use backseat_app::{App, Progress, Pump};
use clock::Clock;
use cortex_m_rt::entry;
use defmt_semihosting as _;
use slot::Slot;
use static_cell::ConstStaticCell;
use store::Store;
use uart::{Uart, Uarts};

/// In flash: by value the first app would pass over the stack.
static NEW: App = App::new();
/// In the larger RAM, as on the real board.
// SAFETY: a slot needs no initial value.
#[unsafe(link_section = ".axisram.app")]
static APP: Slot<App> = Slot::new();
static PUMP: ConstStaticCell<Pump> = ConstStaticCell::new(Pump::new());

#[entry]
fn main() -> ! {
    // SAFETY: `main` is entered once, and an app holds no reference to itself.
    let (app, pump) = (unsafe { APP.fill(&NEW) }, PUMP.take());
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
