//! The five UARTs as the pump wants them: `embedded-io`, never blocking.
//!
//! Reception runs by DMA into a ring, from start on; transmission takes what waits in a pipe and
//! sends it by DMA. The pump looks every millisecond.

use crate::memory::DmaMemory;
use backseat_wire::hostlink::Port;
use core::convert::Infallible;
use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{self, Config, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{Peri, bind_interrupts, dma, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

/// Baud rates, in the order of [`Port::ALL`]: frontseat, DVL, AHRS, modem, host.
const BAUD: [u32; 5] = [19_200, 115_200, 115_200, 19_200, 115_200];
/// Bytes on their way to a port; the app's own rings hold the rest.
const PIPE: usize = 256;

type Outgoing = Pipe<CriticalSectionRawMutex, PIPE>;

static OUTGOING: [Outgoing; 5] = [const { Pipe::new() }; 5];

bind_interrupts!(struct Interrupts {
    USART2 => usart::InterruptHandler<peripherals::USART2>;
    UART4 => usart::InterruptHandler<peripherals::UART4>;
    UART7 => usart::InterruptHandler<peripherals::UART7>;
    USART6 => usart::InterruptHandler<peripherals::USART6>;
    USART3 => usart::InterruptHandler<peripherals::USART3>;
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_STREAM2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM1 => dma::InterruptHandler<peripherals::DMA2_CH1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    DMA2_STREAM4 => dma::InterruptHandler<peripherals::DMA2_CH4>;
});

/// What the UARTs need of the chip; pins in the README's table.
pub struct Resources {
    pub usart2: Peri<'static, peripherals::USART2>,
    pub uart4: Peri<'static, peripherals::UART4>,
    pub uart7: Peri<'static, peripherals::UART7>,
    pub usart6: Peri<'static, peripherals::USART6>,
    pub usart3: Peri<'static, peripherals::USART3>,
    pub frontseat: (Peri<'static, peripherals::PD6>, Peri<'static, peripherals::PD5>),
    pub dvl: (Peri<'static, peripherals::PD0>, Peri<'static, peripherals::PD1>),
    pub ahrs: (Peri<'static, peripherals::PE7>, Peri<'static, peripherals::PE8>),
    pub modem: (Peri<'static, peripherals::PC7>, Peri<'static, peripherals::PC6>),
    pub host: (Peri<'static, peripherals::PD9>, Peri<'static, peripherals::PD8>),
    pub receive: (
        Peri<'static, peripherals::DMA1_CH0>,
        Peri<'static, peripherals::DMA1_CH1>,
        Peri<'static, peripherals::DMA1_CH2>,
        Peri<'static, peripherals::DMA1_CH3>,
        Peri<'static, peripherals::DMA1_CH4>,
    ),
    pub transmit: (
        Peri<'static, peripherals::DMA2_CH0>,
        Peri<'static, peripherals::DMA2_CH1>,
        Peri<'static, peripherals::DMA2_CH2>,
        Peri<'static, peripherals::DMA2_CH3>,
        Peri<'static, peripherals::DMA2_CH4>,
    ),
}

/// Sets up all five; in the order of [`Port::ALL`].
pub fn start(resources: Resources, memory: &'static mut DmaMemory) -> ([SerialPort; 5], [Transmitter; 5]) {
    let Resources { usart2, uart4, uart7, usart6, usart3, frontseat, dvl, ahrs, modem, host, receive, transmit } =
        resources;
    let config = |port: Port| {
        let mut config = Config::default();
        config.baudrate = BAUD[port as usize];
        // an open input rests instead of filling the ring with noise
        config.rx_pull = embassy_stm32::gpio::Pull::Up;
        config
    };
    let uarts = [
        Uart::new(usart2, frontseat.0, frontseat.1, transmit.0, receive.0, Interrupts, config(Port::Frontseat)),
        Uart::new(uart4, dvl.0, dvl.1, transmit.1, receive.1, Interrupts, config(Port::Dvl)),
        Uart::new(uart7, ahrs.0, ahrs.1, transmit.2, receive.2, Interrupts, config(Port::Ahrs)),
        Uart::new(usart6, modem.0, modem.1, transmit.3, receive.3, Interrupts, config(Port::Modem)),
        Uart::new(usart3, host.0, host.1, transmit.4, receive.4, Interrupts, config(Port::Host)),
    ];
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
        SerialPort { port: defmt::unwrap!(ports.next()), ring, outgoing, next: None, errors: 0, reported: 0 }
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
    /// Framing, noise and overrun errors.
    errors: u32,
    reported: u32,
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
                // The error stopped reception, a millisecond ago at most; the ring keeps what it has.
                self.ring.start_uart();
                0
            }
        }
    }

    /// Logs receive errors since the last call.
    pub fn report(&mut self) {
        if self.errors != self.reported {
            self.reported = self.errors;
            defmt::warn!("{}: {=u32} receive errors since start", self.port, self.errors);
        }
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
