//! Board time and the pulse per second, of one timer: TIM5 counts microseconds, and its fourth
//! channel keeps the count at the rising edge on PA3.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Pull};
use embassy_stm32::pac::timer::regs::SrGp16;
use embassy_stm32::pac::timer::vals::FilterValue;
use embassy_stm32::peripherals::{PA3, TIM5};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::low_level::{InputCaptureMode, InputTISelection, Timer};

/// TIM5_CH4 on PA3 (DS12110, table of alternate functions).
const PA3_TIM5: u8 = 2;
const PPS: Channel = Channel::Ch4;
/// The flags of TIM5_SR: a flag is cleared by writing 0, and left by writing 1 (RM0433, TIMx_SR).
const ALL_FLAGS: u32 = 0x1E5F;

/// Board time, µs since start.
pub struct Clock {
    timer: Timer<'static, TIM5>,
    _pin: Flex<'static>,
    /// Time of the last look; looks come at least once in the counter's 71 minutes.
    last_us: u64,
    lost_edges: u32,
}

impl Clock {
    /// Starts at 0.
    pub fn start(timer: Peri<'static, TIM5>, pin: Peri<'static, PA3>) -> Self {
        let mut pin = Flex::new(pin);
        // without a cable the input rests
        pin.set_as_af_unchecked(PA3_TIM5, AfType::input(Pull::Down));
        let mut timer = Timer::new(timer);
        timer.regs_gp32().arr().write_value(u32::MAX);
        timer.set_tick_freq(Hertz(1_000_000));
        timer.set_input_ti_selection(PPS, InputTISelection::Normal);
        // 8 samples at 240 MHz / 8: glitches below 0.27 µs do not count
        timer.set_input_capture_filter(PPS, FilterValue::FDTS_DIV8_N8);
        timer.set_input_capture_mode(PPS, InputCaptureMode::Rising);
        timer.enable_channel(PPS, true);
        timer.reset();
        timer.start();
        Self { timer, _pin: pin, last_us: 0, lost_edges: 0 }
    }

    /// Board time, µs.
    pub fn now_us(&mut self) -> u64 {
        let count = self.timer.regs_gp32().cnt().read();
        self.last_us += u64::from(count.wrapping_sub(self.last_us as u32));
        self.last_us
    }

    /// Board time of an edge of the pulse per second since the last call, µs.
    ///
    /// The timer latches the count at the edge itself, so that nothing depends on how soon it is read: what disciplines
    /// the clock is the captured count, not the time of the look. The latch keeps it until it is read; a second edge
    /// would have to come before that. Looks are 1 ms apart and edges 1000 ms, and where no look comes for 600 ms the
    /// watchdog resets the board: no edge of a pulse per second can be lost. Two between two looks are noise: they
    /// are counted, and not used.
    pub fn take_edge_us(&mut self) -> Option<u64> {
        let registers = self.timer.regs_gp32();
        if !registers.sr().read().ccif(PPS.index()) {
            return None;
        }
        let clear = |flag: fn(&mut SrGp16, usize, bool)| {
            let mut flags = SrGp16(ALL_FLAGS);
            flag(&mut flags, PPS.index(), false);
            registers.sr().write_value(flags);
        };
        // Cleared before the capture is read, so that the flag of an edge that comes now stays.
        clear(SrGp16::set_ccif);
        let captured = self.timer.get_capture_value(PPS);
        if registers.sr().read().ccof(PPS.index()) {
            clear(SrGp16::set_ccof);
            self.lost_edges = self.lost_edges.saturating_add(1);
            return None;
        }
        let now_us = self.now_us();
        now_us.checked_sub(u64::from((now_us as u32).wrapping_sub(captured)))
    }

    /// Edges since start that came too fast to be told apart.
    pub const fn lost_edges(&self) -> u32 {
        self.lost_edges
    }
}
