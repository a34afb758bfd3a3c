//! Board time: TIMER0 runs freely, TIMER1 wakes the loop.

use core::cell::Cell;
use critical_section::Mutex;
use volatile_register::RW;

/// Clock of both timers, ticks a microsecond.
const TICKS_PER_US: u64 = 25;
const ENABLE: u32 = 1 << 0;
const INTERRUPT: u32 = 1 << 3;
const RELOAD: u32 = u32::MAX;
/// TIMER0 starts over every 172 s.
const WRAP_TICKS: u64 = 1 << 32;

/// CMSDK APB timer: counts down, raises its interrupt at 0 and starts over from `reload`.
#[repr(C)]
struct Timer {
    control: RW<u32>,
    value: RW<u32>,
    reload: RW<u32>,
    /// Read: the interrupt is raised; write 1: clear it.
    interrupt: RW<u32>,
}

fn timer0() -> &'static Timer {
    // SAFETY: the machine has a timer there, always; access is volatile, and reads and writes of
    // whole registers cannot tear.
    unsafe { &*(0x4000_0000 as *const Timer) }
}

fn timer1() -> &'static Timer {
    // SAFETY: as above.
    unsafe { &*(0x4000_1000 as *const Timer) }
}

impl Timer {
    fn write(register: &RW<u32>, value: u32) {
        // SAFETY: no value of a timer's register touches memory.
        unsafe { register.write(value) };
    }
}

static WRAPS: Mutex<Cell<u32>> = Mutex::new(Cell::new(0));

/// Time since start, and the alarm.
pub struct Clock {
    armed: bool,
}

impl Clock {
    /// Starts both timers' interrupts and TIMER0.
    pub fn start() -> Self {
        Timer::write(&timer0().value, RELOAD);
        Timer::write(&timer0().reload, RELOAD);
        Timer::write(&timer0().control, ENABLE | INTERRUPT);
        Self { armed: false }
    }

    /// Time since start, µs.
    pub fn now_us(&self) -> u64 {
        critical_section::with(|cs| {
            let ticks = RELOAD - timer0().value.read();
            // Started over, and the interrupt has not been served yet.
            let pending = timer0().interrupt.read() & 1 != 0 && ticks < RELOAD / 2;
            let wraps = u64::from(WRAPS.borrow(cs).get()) + u64::from(pending);
            (wraps * WRAP_TICKS + u64::from(ticks)) / TICKS_PER_US
        })
    }

    /// Raises an interrupt at `alarm_us`, or earlier when that is far away; `None`: at no time.
    pub fn wake_at(&mut self, alarm_us: Option<u64>) {
        if self.armed {
            Timer::write(&timer1().control, 0);
        }
        self.armed = alarm_us.is_some();
        if let Some(alarm_us) = alarm_us {
            // a tick more, so that the alarm is not early
            let ticks =
                alarm_us.saturating_sub(self.now_us()).saturating_mul(TICKS_PER_US).saturating_add(TICKS_PER_US);
            let ticks = u32::try_from(ticks).unwrap_or(u32::MAX);
            Timer::write(&timer1().reload, ticks);
            Timer::write(&timer1().value, ticks);
            Timer::write(&timer1().control, ENABLE | INTERRUPT);
        }
    }
}

/// TIMER0 has started over.
pub fn on_wrap() {
    critical_section::with(|cs| {
        Timer::write(&timer0().interrupt, 1);
        let wraps = WRAPS.borrow(cs);
        wraps.set(wraps.get().wrapping_add(1));
    });
}

/// TIMER1 has run down, and is stopped: by itself it would go on with the same interval. An alarm set a moment before its
/// time would then interrupt every few microseconds, and leave the loop no time to set another.
pub fn on_alarm() {
    Timer::write(&timer1().control, 0);
    Timer::write(&timer1().interrupt, 1);
}
