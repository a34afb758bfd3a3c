//! The five UARTs as the pump wants them: `embedded-io`, never blocking.
//!
//! Reception runs by DMA into a ring, from start on; transmission takes what waits in a pipe and
//! sends it by DMA. The pump looks every millisecond.

use crate::memory::{DmaMemory, STAGE};
use backseat_app::App;
use backseat_wire::hostlink::Port;
use core::convert::Infallible;
use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embassy_stm32::gpio::Pull;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{
    DMA1_CH0, DMA1_CH1, DMA1_CH2, DMA1_CH3, DMA1_CH4, DMA2_CH0, DMA2_CH1, DMA2_CH2, DMA2_CH3, DMA2_CH4, UART4, UART7,
    USART2, USART3, USART6,
};
use embassy_stm32::usart::{self, Config, ConfigError, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{bind_interrupts, dma};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

/// Bytes on their way to a port, as many as a transfer takes; the app's own rings hold the rest.
const PIPE: usize = STAGE;

type Outgoing = Pipe<CriticalSectionRawMutex, PIPE>;

/// Zero bytes; not in DTCM, which is the filter's.
#[unsafe(link_section = ".bss.axisram.outgoing")]
static OUTGOING: [Outgoing; 5] = [const { Pipe::new() }; 5];

bind_interrupts!(pub struct Interrupts {
    USART2 => usart::InterruptHandler<USART2>;
    UART4 => usart::InterruptHandler<UART4>;
    UART7 => usart::InterruptHandler<UART7>;
    USART6 => usart::InterruptHandler<USART6>;
    USART3 => usart::InterruptHandler<USART3>;
    DMA1_STREAM0 => dma::InterruptHandler<DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_STREAM2 => dma::InterruptHandler<DMA1_CH2>;
    DMA1_STREAM3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<DMA1_CH4>;
    DMA2_STREAM0 => dma::InterruptHandler<DMA2_CH0>;
    DMA2_STREAM1 => dma::InterruptHandler<DMA2_CH1>;
    DMA2_STREAM2 => dma::InterruptHandler<DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<DMA2_CH3>;
    DMA2_STREAM4 => dma::InterruptHandler<DMA2_CH4>;
});

/// How a port is set up.
pub fn config(port: Port) -> Config {
    let mut config = Config::default();
    config.baudrate = Port::DEFAULT_BAUD[port as usize];
    // an open input rests instead of filling the ring with noise
    config.rx_pull = Pull::Up;
    config
}

/// Sets all five going; in the order of [`Port::ALL`].
pub fn start(
    uarts: [Result<Uart<'static, Async>, ConfigError>; 5],
    memory: &'static mut DmaMemory,
) -> ([SerialPort; 5], [Transmitter; 5]) {
    let mut rings = memory.receive.iter_mut();
    let mut stages = memory.transmit.iter_mut();
    let mut outgoing = OUTGOING.iter();
    let mut ports = Port::ALL.into_iter();
    let mut transmitters = [const { None }; 5];
    let mut places = transmitters.iter_mut();
    let serial = uarts.map(|uart| {
        // five of everything; baud rates and pins are constants that the HAL takes
        let (transmit, receive) = defmt::unwrap!(uart).split();
        let outgoing = defmt::unwrap!(outgoing.next());
        let mut ring = receive.into_ring_buffered(defmt::unwrap!(rings.next()));
        ring.start_uart();
        let stage = defmt::unwrap!(stages.next());
        *defmt::unwrap!(places.next()) = Some(Transmitter { uart: transmit, outgoing, stage });
        SerialPort { port: defmt::unwrap!(ports.next()), ring, outgoing, next: None, errors: 0 }
    });
    (serial, transmitters.map(|transmitter| defmt::unwrap!(transmitter)))
}

/// Sends what waits for one port.
pub struct Transmitter {
    uart: UartTx<'static, Async>,
    outgoing: &'static Outgoing,
    stage: &'static mut [u8],
}

impl Transmitter {
    /// For ever.
    pub async fn run(&mut self) -> ! {
        loop {
            let count = self.outgoing.read(self.stage).await;
            // DMA transfers to a UART do not fail
            let _ = self.uart.write(&self.stage[..count]).await;
        }
    }
}

/// One port.
pub struct SerialPort {
    port: Port,
    ring: RingBufferedUartRx<'static>,
    outgoing: &'static Outgoing,
    /// A byte that was fetched to see whether there is one.
    next: Option<u8>,
    /// Framing and noise errors, overruns of the UART and of the ring.
    errors: u32,
}

impl SerialPort {
    /// Bytes that are there now.
    fn take(&mut self, bytes: &mut [u8]) -> usize {
        // The ring gives what it has at the first poll, and otherwise would wait for more.
        let outcome = {
            let read = pin!(self.ring.read(bytes));
            read.poll(&mut Context::from_waker(Waker::noop()))
        };
        match outcome {
            Poll::Ready(Ok(count)) => count,
            Poll::Pending => 0,
            Poll::Ready(Err(_)) => {
                self.errors = self.errors.saturating_add(1);
                // The error stopped reception, a millisecond ago at most. After a framing or noise error the DMA has
                // only paused and the ring keeps what it has; after an overrun of the ring itself up to a ring of old
                // bytes may follow once (README, untried).
                self.ring.start_uart();
                0
            }
        }
    }

    /// Forgets what has come.
    pub fn discard(&mut self) {
        self.next = None;
        while self.take(&mut [0; 64]) > 0 {}
    }

    /// Hands the count of receive errors to the app, which tells the host.
    pub fn report(&self, app: &mut App) {
        app.receive_losses(self.port, self.errors);
    }
}

impl ErrorType for SerialPort {
    type Error = Infallible;
}

impl ReadReady for SerialPort {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        if self.next.is_none() {
            let mut byte = [0];
            if self.take(&mut byte) == 1 {
                self.next = Some(byte[0]);
            }
        }
        Ok(self.next.is_some())
    }
}

impl Read for SerialPort {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let Some((first, rest)) = bytes.split_first_mut() else { return Ok(0) };
        match self.next.take() {
            Some(byte) => {
                *first = byte;
                Ok(1 + self.take(rest))
            }
            None => Ok(self.take(bytes)),
        }
    }
}

impl WriteReady for SerialPort {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.outgoing.is_full())
    }
}

impl Write for SerialPort {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(self.outgoing.try_write(bytes).unwrap_or(0))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
