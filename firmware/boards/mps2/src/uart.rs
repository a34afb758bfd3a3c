//! The five UARTs as the pump wants them: `embedded-io`, never blocking.

use backseat_app::App;
use backseat_wire::hostlink::Port;
use core::cell::RefCell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};
use critical_section::Mutex;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::ConstStaticCell;
use volatile_register::RW;

/// Received bytes that may wait for the loop: 0.17 s at 115,200 baud, more than a lock-step brings.
const QUEUE: usize = 2048;
/// Smallest divider that QEMU takes for "on"; it enforces no rate.
const DIVIDER: u32 = 16;

const STATE_TRANSMIT_FULL: u32 = 1 << 0;
const STATE_RECEIVE_FULL: u32 = 1 << 1;
const STATE_RECEIVE_OVERRUN: u32 = 1 << 3;
const CONTROL_TRANSMIT: u32 = 1 << 0;
const CONTROL_RECEIVE: u32 = 1 << 1;
const CONTROL_TRANSMIT_INTERRUPT: u32 = 1 << 2;
const CONTROL_RECEIVE_INTERRUPT: u32 = 1 << 3;
const CONTROL: u32 = CONTROL_TRANSMIT | CONTROL_RECEIVE | CONTROL_RECEIVE_INTERRUPT;
const INTERRUPT_TRANSMIT: u32 = 1 << 0;
const INTERRUPT_RECEIVE: u32 = 1 << 1;

/// CMSDK APB UART.
#[repr(C)]
struct Registers {
    data: RW<u32>,
    /// Overruns are cleared by writing 1.
    state: RW<u32>,
    control: RW<u32>,
    /// Read: raised interrupts; write 1: clear.
    interrupt: RW<u32>,
    divider: RW<u32>,
}

/// In the order of [`Port::ALL`].
const BASES: [usize; 5] = [0x4000_4000, 0x4000_5000, 0x4000_6000, 0x4000_7000, 0x4000_9000];

fn registers(uart: usize) -> &'static Registers {
    // SAFETY: the machine has a UART there, always; access is volatile, and reads and writes of
    // whole registers cannot tear.
    unsafe { &*(BASES[uart] as *const Registers) }
}

fn write(register: &RW<u32>, value: u32) {
    // SAFETY: no value of a UART's register touches memory.
    unsafe { register.write(value) };
}

static QUEUES: [ConstStaticCell<Queue<u8, QUEUE>>; 5] = [const { ConstStaticCell::new(Queue::new()) }; 5];
static RECEIVERS: [Mutex<RefCell<Option<Producer<'static, u8>>>>; 5] = [const { Mutex::new(RefCell::new(None)) }; 5];
/// Bytes lost because they were not fetched in time.
static OVERRUNS: [AtomicU32; 5] = [const { AtomicU32::new(0) }; 5];

/// What [`start`] hands out.
pub struct Uarts {
    /// In the order of [`Port::ALL`].
    pub ports: [Uart; 5],
    /// Watches over them.
    pub overruns: Overruns,
}

/// Sets up all five; their interrupts have to be enabled after this.
pub fn start() -> Uarts {
    let ports = core::array::from_fn(|uart| {
        let (producer, received) = QUEUES[uart].take().split();
        critical_section::with(|cs| RECEIVERS[uart].borrow_ref_mut(cs).replace(producer));
        write(&registers(uart).divider, DIVIDER);
        write(&registers(uart).control, CONTROL);
        Uart { uart, received }
    });
    Uarts { ports, overruns: Overruns(()) }
}

/// One port.
pub struct Uart {
    uart: usize,
    received: Consumer<'static, u8>,
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.received.ready())
    }
}

impl Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let mut count = 0;
        for place in buffer {
            let Some(byte) = self.received.dequeue() else { break };
            *place = byte;
            count += 1;
        }
        Ok(count)
    }
}

impl Uart {
    /// Forgets what has come.
    pub fn discard(&mut self) {
        while self.received.dequeue().is_some() {}
    }

    fn is_full(&self) -> bool {
        registers(self.uart).state.read() & STATE_TRANSMIT_FULL != 0
    }
}

impl WriteReady for Uart {
    /// When it is not, an interrupt tells when it is.
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        if !self.is_full() {
            return Ok(true);
        }
        write(&registers(self.uart).control, CONTROL | CONTROL_TRANSMIT_INTERRUPT);
        // It may have become empty just before the interrupt was enabled.
        Ok(!self.is_full())
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let mut count = 0;
        for &byte in bytes {
            if self.is_full() {
                break;
            }
            write(&registers(self.uart).data, u32::from(byte));
            count += 1;
        }
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A byte has come; there may be more behind it.
pub fn on_receive(uart: usize) {
    let registers = registers(uart);
    write(&registers.interrupt, INTERRUPT_RECEIVE);
    critical_section::with(|cs| {
        let mut receiver = RECEIVERS[uart].borrow_ref_mut(cs);
        let Some(receiver) = receiver.as_mut() else { return };
        let mut lost = 0;
        loop {
            let state = registers.state.read();
            if state & STATE_RECEIVE_OVERRUN != 0 {
                write(&registers.state, STATE_RECEIVE_OVERRUN);
                lost += 1;
            }
            if state & STATE_RECEIVE_FULL == 0 {
                break;
            }
            // Bits above the byte read as 0.
            lost += u32::from(receiver.enqueue(registers.data.read() as u8).is_err());
        }
        if lost != 0 {
            let overruns = &OVERRUNS[uart];
            overruns.store(overruns.load(Ordering::Relaxed).saturating_add(lost), Ordering::Relaxed);
        }
    });
}

/// There is room for a byte: the loop goes on by itself.
pub fn on_transmit(uart: usize) {
    write(&registers(uart).control, CONTROL);
    write(&registers(uart).interrupt, INTERRUPT_TRANSMIT);
}

/// Tells of lost bytes.
pub struct Overruns(());

impl Overruns {
    /// Hands the counts to the app, which tells the host.
    pub fn report(&self, app: &mut App) {
        for (lost, port) in OVERRUNS.iter().zip(Port::ALL) {
            app.receive_losses(port, lost.load(Ordering::Relaxed));
        }
    }
}
