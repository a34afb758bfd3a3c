//! The backseat app on a NUCLEO-H743ZI2: Cortex-M7 at 480 MHz, five UARTs, pulse per second.
//!
//! | module | concept |
//! |---|---|
//! | `clocks`, `time` | clock tree; board time and the pulse per second |
//! | `uart`, `memory` | the five ports, as `embedded-io`; memory that DMA reaches |
//! | `flash`, `supply` | sectors of parameters and images, exchange of the banks; reset cause and supply |
//! | `backup`, `watchdog` | records of restart and crashes; watchdog |
//! | `guard` | what the core may reach |
//! | `fittings` | last-resort hardware |
//! | `fault` | what a fault or panic leaves behind |
//! | `vitals` | load, stacks, wrong bits in memory |
//! | `log`, `card` | the board log: into a queue, and from there to a memory card |
//! | `leds` | what the board shows |
//!
//! Three levels: interrupts of the HAL above all; the app, its ports and the watchdog in an
//! executor of their own below them; and in thread mode what may take seconds, flash and card.
#![no_std]
#![no_main]

#[cfg(not(all(target_arch = "arm", target_os = "none")))]
compile_error!("an ARM image: cargo build -p backseat-stm32h743 --profile dist --target thumbv7em-none-eabihf");

mod backup;
mod card;
mod clocks;
mod fault;
mod fittings;
mod flash;
mod guard;
mod leds;
mod log;
mod memory;
mod random;
mod supply;
mod time;
mod uart;
mod vitals;
mod watchdog;

use backseat_app::parameters::Settings;
use backseat_app::store::{ParameterFlash, Response, RestartRecord, Start, kept_crashes, take_last_crash};
use backseat_app::{App, Order, Progress, Pump, StepWatch};
use backseat_app::{Recorder, poll_recorded, record_start};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{Images, Oscillator, Port, Refusal, ResetCause};
use backup::{BackupMemory, CrashSlots};
use card::Card;
use clocks::ClockSource;
use core::arch::asm;
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::peripheral::SCB;
use cortex_m_rt::entry;
use defmt_rtt as _;
use embassy_executor::{Executor, InterruptExecutor};
use embassy_futures::select::{Either3, select3};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::usart::Uart;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_sync::zerocopy_channel::{Channel, Sender};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use fittings::FittedHardware;
use leds::Leds;
use log::Log;
use memory::Memory;
use time::Clock;
use uart::{Interrupts, SerialPort, Transmitter, config};
use vitals::Vitals;
use watchdog::Watchdog;

/// How often the ports are looked at; bytes are stamped as exactly as this.
const TICK: Duration = Duration::from_millis(1);
/// And at least so long there is nothing to do for the app.
const SHORTEST_REST: Duration = Duration::from_micros(20);
/// How often thread mode looks what waits for the card.
const CARD_TICK: Duration = Duration::from_millis(20);
/// How often it looks at the stacks.
const LOOK: Duration = Duration::from_secs(1);
/// From so many resets by a fault on the card is left alone: it may be the cause.
const CARD_RESETS: u32 = 2;
/// An image that is not confirmed by then starts again: at its last start it is the image before it that does.
const TRIAL: Duration = Duration::from_secs(60);
/// The answer to a commit has left by then.
const ANSWERED: Duration = Duration::from_millis(300);
/// Most turns of the pump in a tick; each reads up to 256 bytes a port.
const TURNS: usize = 8;
/// No turn more after so long, µs: the watchdog and the transmitters have their turn, however late the next step is.
const LONGEST_TICK_US: u64 = 50_000;

/// Whether a set was kept, on the way back from thread mode.
static KEPT: Signal<CriticalSectionRawMutex, bool> = Signal::new();

/// To thread mode: what is to be done with the images; and what has become of it.
static ORDERS: Signal<CriticalSectionRawMutex, Order> = Signal::new();
static CARRIED_OUT: Signal<CriticalSectionRawMutex, (Result<(), Refusal>, Images)> = Signal::new();

/// What thread mode keeps in flash of the restart record: a mission is under way.
static UNDER_WAY: AtomicBool = AtomicBool::new(false);

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
unsafe fn CEC() {
    // SAFETY: called from here alone, and enabled by `start`.
    unsafe { EXECUTOR.on_interrupt() }
}

unsafe extern "C" {
    // of memory.x
    static _thread_stack_start: u32;
}

/// Gives thread mode its own stack; the one that the core starts on is the interrupts', the app's among them.
#[entry]
fn main() -> ! {
    guard::start();
    // SAFETY: nothing on the stack that is left behind is used again, and `thread` does not return.
    unsafe {
        asm!(
            "msr PSP, {stack}",
            "msr CONTROL, {own}",
            "isb",
            "b {thread}",
            stack = in(reg) &raw const _thread_stack_start,
            own = in(reg) 2,
            thread = sym thread,
            options(noreturn)
        )
    }
}

extern "C" fn thread() -> ! {
    let mut executor = Executor::new();
    // SAFETY: this frame is never left.
    let executor: &'static mut Executor = unsafe { core::mem::transmute(&mut executor) };
    executor.run(|spawner| spawner.spawn(defmt::unwrap!(start_and_store())))
}

/// Starts the board, then does what may take seconds.
#[embassy_executor::task]
async fn start_and_store() {
    let mut watchdog = Watchdog::start();
    let mut images = flash::images(fault::build());
    if images.start() == Start::Return {
        exchange_and_reset();
    }
    watchdog.feed();
    vitals::paint_stacks();
    let cause = supply::reset_cause();
    let oscillator = clocks::external();
    let p = embassy_stm32::init(clocks::config(oscillator));
    // SAFETY: nothing in this program writes code.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.SCB.enable_icache();
    let mut clock = Clock::start(p.TIM5, p.PA3);
    defmt::info!("backseat-stm32h743 {=str}, clock: {}, reset by {}", env!("CARGO_PKG_VERSION"), oscillator, cause);
    let source = ClockSource::new(oscillator);
    supply::start();

    let mut backup = BackupMemory::take();
    let mut crashes = CrashSlots::open();
    let crash = take_last_crash(&mut crashes);
    // a fault resets the board by software
    let cause = crash.map_or(cause, |_| if cause == ResetCause::Software { ResetCause::Fault } else { cause });
    let Memory { dma, log, app, pump, settings, to_store, card } = defmt::unwrap!(memory::take());
    let mut store = defmt::unwrap!(ParameterFlash::in_two_banks(flash::parameter_sets()));
    let mut marked = store.is_under_way();
    // without a battery at VBAT backup SRAM forgets with the supply, and flash does not
    let last = backup.read().or_else(|| marked.then(RestartRecord::lost_under_way));
    let (response, record) = RestartRecord::respond(cause, last.as_ref());
    backup.write(&record);
    UNDER_WAY.store(record.under_way, Ordering::Relaxed);
    let restart = record.report(cause, crash);
    defmt::info!("{=u32} resets by a fault since power-on", restart.resets);
    if let Some(crash) = &crash {
        defmt::error!("before: {}", crash);
    }
    watchdog.feed();

    let [stored] = &mut *settings;
    let found = store.load(stored);
    match found {
        Ok(sequence) => defmt::info!("parameter set {=u32}", sequence),
        Err(causes) => defmt::warn!("default parameters, copies are {}", causes),
    }
    if !app.restore(found.is_ok().then_some(&*stored)) {
        defmt::error!("the stored parameters do not fit together: defaults");
    }
    app.set_image(fault::build(), flash::image_crc(|| watchdog.feed()));
    let known = images.report();
    defmt::info!("images: {}", known);
    let mut on_trial = known.trial.is_some();
    app.set_images(known);
    let challenge = random::number();
    if challenge == 0 {
        defmt::error!("no random number: requests signed in one start of the board can be replayed in another");
    }
    app.set_challenge(challenge);
    app.set_oscillator(oscillator);
    tell_crashes(app, &crashes, crash.is_some());
    app.resume(restart, &response);
    if response != Response::Fresh {
        pump.start_at_once(clock.now_us());
    }
    let (mut log, mut records) = Log::new(log);
    record_start(&mut log, app, restart, last.map(|last| last.encode()).as_ref().map_or(&[], |bytes| bytes));
    log.record(&LogRecord::Oscillator { time_us: 0, oscillator });

    // the README's pin table, in the order of the ports; the last one is the ST-LINK's virtual COM port
    let uarts = [
        Uart::new(p.USART2, p.PD6, p.PD5, p.DMA2_CH0, p.DMA1_CH0, Interrupts, config(Port::Frontseat)),
        Uart::new(p.UART4, p.PD0, p.PD1, p.DMA2_CH1, p.DMA1_CH1, Interrupts, config(Port::Dvl)),
        Uart::new(p.UART7, p.PE7, p.PE8, p.DMA2_CH2, p.DMA1_CH2, Interrupts, config(Port::Ahrs)),
        Uart::new(p.USART6, p.PC7, p.PC6, p.DMA2_CH3, p.DMA1_CH3, Interrupts, config(Port::Modem)),
        Uart::new(p.USART3, p.PD9, p.PD8, p.DMA2_CH4, p.DMA1_CH4, Interrupts, config(Port::Host)),
    ];
    let (ports, transmitters) = uart::start(uarts, dma);
    let fittings = FittedHardware::new(app, p.PE9, p.PE11, p.PE13, (p.ADC1, p.PC0));
    let leds = Leds::new(p.PB0, p.PE1, p.PB14);
    let start_us = clock.now_us();
    defmt::info!("started in {=u64} us", start_us);

    interrupt::CEC.set_priority(Priority::P6);
    let spawner = EXECUTOR.start(interrupt::CEC);
    for transmitter in transmitters {
        spawner.spawn(defmt::unwrap!(transmit(transmitter)));
    }
    // what was loaded from flash is done with: from now on the place of a set on its way to thread mode
    let (to_store, mut from_app) = to_store.write(Channel::new(settings)).split();
    let mut vitals = Vitals::new();
    app.hardware(vitals.report(clock.lost_edges()));
    let board = Board {
        app,
        pump,
        ports,
        log,
        source,
        clock,
        watchdog,
        steps: StepWatch::new(start_us),
        vitals,
        backup,
        fittings,
        leds,
        powered_us: record.powered_us,
        record,
        to_store,
        storing: false,
        renewing: false,
        warning: restart.resets > 0,
    };
    spawner.spawn(defmt::unwrap!(run(board)));

    let mut looked = Instant::now();
    let card = card.write(if restart.resets < CARD_RESETS {
        Card::new(p.SPI1, p.PA5, p.PA6, p.PB5, p.PD14)
    } else {
        Card::Absent
    });
    loop {
        // First: what the host waits for.
        let next = with_timeout(CARD_TICK, select3(from_app.receive(), supply::FALLS.wait(), ORDERS.wait())).await;
        let under_way = UNDER_WAY.load(Ordering::Relaxed);
        if under_way != marked {
            marked = under_way;
            if let Err(error) = store.mark_under_way(under_way) {
                defmt::error!("under way {=bool} not kept: {}", under_way, error);
            }
        }
        match next {
            Ok(Either3::First(settings)) => {
                let kept = store.save(settings);
                from_app.receive_done();
                match kept {
                    Ok(sequence) => defmt::info!("parameter set {=u32} kept", sequence),
                    Err(error) => defmt::error!("parameters not kept: {}", error),
                }
                KEPT.signal(kept.is_ok());
                // a new copy begins without marks
                marked = store.is_under_way();
            }
            Ok(Either3::Second(())) => card.save(&mut records),
            Ok(Either3::Third(order)) => {
                let outcome = order.carry_out(&mut images);
                let known = images.report();
                on_trial = known.trial.is_some();
                CARRIED_OUT.signal((outcome, known));
                if order == Order::Commit && outcome.is_ok() {
                    card.save(&mut records);
                    Timer::after(ANSWERED).await;
                    exchange_and_reset();
                }
            }
            Err(_) => {}
        }
        if on_trial && Instant::now() > Instant::MIN + TRIAL {
            defmt::error!("not confirmed");
            SCB::sys_reset();
        }
        card.serve(&mut records);
        log::tell(card.state());
        if looked.elapsed() >= LOOK {
            looked = Instant::now();
            vitals::look_at_stacks();
        }
    }
}

/// What no card has got yet; not the last one, where that is told as what ended the run before. Its bytes are not to stay
/// in the caller's frame.
#[inline(never)]
fn tell_crashes(app: &mut App, crashes: &CrashSlots, last_is_told: bool) {
    let mut earlier = kept_crashes(crashes);
    if last_is_told {
        earlier.pop();
    }
    app.earlier_crashes(&earlier);
}

/// Starts the image of the other bank.
fn exchange_and_reset() {
    match flash::exchange_banks() {
        Ok(()) => SCB::sys_reset(),
        Err(error) => defmt::error!("the banks stay as they are: {}", error),
    }
}

#[embassy_executor::task(pool_size = 5)]
async fn transmit(mut transmitter: Transmitter) {
    transmitter.run().await;
}

#[embassy_executor::task]
async fn run(mut board: Board) {
    let mut due = Instant::now();
    loop {
        board.tick();
        // What was missed is not made up for, and the transmitters of this level have their turn.
        due = (due + TICK).max(Instant::now() + SHORTEST_REST);
        Timer::at(due).await;
    }
}

/// What belongs to the app's level.
struct Board {
    app: &'static mut App,
    pump: &'static mut Pump,
    ports: [SerialPort; 5],
    log: Log,
    source: ClockSource,
    clock: Clock,
    watchdog: Watchdog,
    steps: StepWatch,
    vitals: Vitals,
    backup: BackupMemory,
    fittings: FittedHardware,
    /// As it was last written.
    record: RestartRecord,
    leds: Leds,
    /// Powered time at this start, µs.
    powered_us: u64,
    /// A set to store, on its way to thread mode.
    to_store: Sender<'static, CriticalSectionRawMutex, Settings>,
    /// Thread mode has a set to store.
    storing: bool,
    /// Thread mode has an order of an update.
    renewing: bool,
    /// The board was reset by a fault, or could not keep its parameters.
    warning: bool,
}

impl Board {
    fn tick(&mut self) {
        let from_us = self.clock.now_us();
        if clocks::take_lost() {
            self.counts(from_us, Oscillator::Internal);
            defmt::error!("the clock on HSE has ended: internal oscillator");
        }
        if !self.app.is_under_way() && self.source.change_over() {
            let time_us = self.clock.now_us();
            self.counts(time_us, Oscillator::Crystal);
            defmt::info!("the clock on HSE has come: changed over");
        }
        let edge_us = self.clock.take_edge_us();
        if let Some(time_us) = edge_us.filter(|_| !self.pump.is_lockstep()) {
            self.app.pps(time_us);
            self.log.record(&LogRecord::Edge { time_us });
        }
        // two seconds of it would overflow a ring
        if self.pump.is_waiting() {
            let [devices @ .., _host] = &mut self.ports;
            devices.iter_mut().for_each(SerialPort::discard);
        }
        for _ in 0..TURNS {
            let time_us = self.clock.now_us();
            let Ok(progress) = poll_recorded(self.pump, self.app, &mut self.ports, &mut self.log, time_us);
            if self.steps.look(self.app, time_us) {
                self.vitals.stepped(self.clock.now_us() - time_us);
                self.stepped();
            }
            if progress != Progress::Moved || self.clock.now_us() - from_us > LONGEST_TICK_US {
                break;
            }
        }
        self.renew();
        let now_us = self.clock.now_us();
        if self.steps.is_in_time(self.pump, now_us) {
            self.watchdog.feed();
        }
        self.vitals.worked(from_us, now_us);
    }

    /// Hands orders of an update to thread mode, and its answers back: each millisecond, as there are thousands.
    fn renew(&mut self) {
        if let Some((outcome, images)) = CARRIED_OUT.try_take() {
            self.renewing = false;
            self.app.updated(outcome, images);
        }
        if let Some(order) = self.app.to_update()
            && !self.renewing
        {
            self.renewing = true;
            ORDERS.signal(order.clone());
        }
    }

    /// What board time is counted by from now on.
    fn counts(&mut self, time_us: u64, oscillator: Oscillator) {
        self.app.set_oscillator(oscillator);
        self.log.record(&LogRecord::Oscillator { time_us, oscillator });
    }

    fn stepped(&mut self) {
        fault::stepped();
        let now_us = self.clock.now_us();
        // under the host's clock nothing is at sea
        if !self.pump.is_lockstep() {
            self.record = self.app.restart_record(&self.record, self.powered_us + now_us);
            self.backup.write(&self.record);
            UNDER_WAY.store(self.record.under_way, Ordering::Relaxed);
        }
        if let Some(readings) = self.fittings.exchange(self.app, self.pump.is_lockstep()) {
            self.app.fittings(readings);
            self.log.record(&LogRecord::Fittings { time_us: now_us, readings });
        }
        if let Some(kept) = KEPT.try_take() {
            self.storing = false;
            self.warning |= !kept;
            self.app.stored(kept);
        }
        if let Some(settings) = self.app.to_store()
            && !self.storing
            && let Some(place) = self.to_store.try_send()
        {
            self.storing = true;
            *place = *settings;
            self.to_store.send_done();
        }
        self.leds.show(self.app, now_us, self.warning);
        self.ports.iter().for_each(|port| port.report(self.app));
        self.app.board_log(self.log.report());
        self.app.hardware(self.vitals.report(self.clock.lost_edges()));
    }
}
