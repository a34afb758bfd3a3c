"""A NUCLEO-H743ZI2: what of the STM32H743 the image uses, at the addresses of RM0433.

What the hardware would not forgive is kept in `complaints`: registers without clock, DMA that cannot reach its memory, wrong
pins or baud rates, flash words written twice.
"""

import heapq
import itertools

from analogue import Adc
from bus import NEVER, Plain
from card import Spi
from clocks import Exti, Pwr, Rcc, Rng
from core import Core, Scs
from elftools.elf.elffile import ELFFile
from protection import Mpu
from serial_ports import Dma, Gpio, Usart
from storage import IMAGE, OTHER, OWN, SECTOR, TRAILER, BackupRam, Banks, FlashRegisters, FlashWindow
from timers import Timer, Watchdog
from unicorn import UC_HOOK_CODE
from unicorn import arm_const as arm

DTCM, DTCM_SIZE, AXI, AXI_SIZE = 0x20000000, 0x20000, 0x24000000, 0x80000
ITCM, ITCM_SIZE, FLASH, FLASH_SIZE = 0, 0x10000, OWN, IMAGE
PAINT = 0xA5
MMIO_NS = 25.0
WINDOWS = ((0x40000000, 0x30000), (0x48021000, 0x1000), (0x52000000, 0xA000), (0x58000000, 0x27000), (0x5C000000, 0x10000),
           (0xE0000000, 0x10000))


class Machine(Core):
    """`hse_from`: when the clock on HSE comes, ns. `hse_ppm`, `hsi_ppm`: by how much the oscillators are fast. `up_us`: board
    time at power-on, as if the board had run for that long."""

    def __init__(self, image, hse_from=0.0, hse_ppm=0.0, hsi_ppm=0.0, card=None, up_us=0):
        self.hse_from, self.hse_until, self.hse_ppm, self.hsi_ppm, self.card = hse_from, NEVER, hse_ppm, hsi_ppm, card
        self.up_us = up_us
        self.now, self.cause, self.spin_ns, self.longest_gap, self.cycles = 0.0, "power", 2000.0, 0.0, 1
        self.longest_allowed_gap = 0.3e9  # between two feeds: the watchdog resets after 0.6 s
        self.most_stack = dict.fromkeys(("interrupts", "thread"), 0)
        self.sequence = itertools.count()
        self.complaints, self.measured, self.resets, self.faults, self.events = {}, {}, [], [], []
        self.operation = lambda kind, span_ns: None  # told when flash or card begin to write
        self.tree = {"core": 64e6, "timers": 64e6}
        with open(image, "rb") as file:
            elf = ELFFile(file)
            text = elf.get_section_by_name(".text")
            self.build_core((text["sh_addr"], text.data()))
            self.map_memory(elf)
            self.symbols = {symbol.name: symbol.entry for symbol in elf.get_section_by_name(".symtab").iter_symbols()}
            self.stacks = {name: [self.symbols[f"{prefix}_{edge}"]["st_value"] for edge in ("end", "start")]
                           for name, prefix in (("interrupts", "_stack"), ("thread", "_thread_stack"))}
        self.build_devices()
        self.reset("power")

    def map_memory(self, elf):
        self.banks = Banks(self)
        memory = (ITCM, ITCM_SIZE), (FLASH, FLASH_SIZE), (DTCM, DTCM_SIZE), (AXI, AXI_SIZE)
        for base, size in memory:
            self.uc.mem_map(base, size)
        for base, size in memory[2:]:
            self.uc.mem_write(base, bytes([PAINT]) * size)
        for segment in elf.iter_segments():
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                self.uc.mem_write(segment["p_paddr"], segment.data())
                self.image_bytes = segment["p_paddr"] - FLASH + segment["p_filesz"]  # of the last one
                self.banks.physical[0].load(segment["p_paddr"] - FLASH, segment.data())
        for base, size in WINDOWS:
            self.uc.mmio_map(base, size, self.read, base, self.write, base)
        self.backup = BackupRam(self)
        windows = [FlashWindow(self, 0, IMAGE, TRAILER), FlashWindow(self, 1, 0, OTHER - OWN),
                   FlashWindow(self, 0, 6 * SECTOR, 2 * SECTOR)]
        for part in (self.backup, *windows):
            self.uc.mmio_map(part.BASE, part.SIZE, part.read, None, part.write, None)
        parts = [(part.BASE, part.SIZE) for part in (self.backup, *windows[:2])]  # the last is read alone
        self.mpu = Mpu(self, memory, [*WINDOWS[:-1], *parts])  # the core's own registers are always within reach

    def build_devices(self):
        self.active, self.slice.limit = [], 0
        self.scs, self.rcc, self.pwr = Scs(self, 0xE000E000, 0x1000), Rcc(self, 0x58024400), Pwr(self, 0x58024800)
        self.flash, self.watchdog = FlashRegisters(self, 0x52002000, 0x1000), Watchdog(self, 0x58004800)
        self.gpio = {port: Gpio(self, 0x58020000 + 0x400 * k, port) for k, port in enumerate("ABCDEFGH")}
        self.tim2 = Timer(self, 0x40000000, "TIM2", 28, (0xE8, 0))
        self.tim5 = Timer(self, 0x40000C00, "TIM5", 50, (0xE8, 3), self.up_us)
        self.mux = Plain(self, 0x40020800, "DMAMUX1")
        self.dmas = [Dma(self, 0x40020000, "DMA1", 0, (11, 12, 13, 14, 15, 16, 17, 47), (0xD8, 0)),
                     Dma(self, 0x40020400, "DMA2", 8, (56, 57, 58, 59, 60, 68, 69, 70), (0xD8, 1))]
        # receive pin, transmit pin, DMA requests, the device's baud rate: the README's wiring table
        self.frontseat = Usart(self, 0x40004400, "USART2", 38, (0xE8, 17), "apb1", ("D", 6, 7), ("D", 5, 7), (43, 44), 19200)
        self.dvl = Usart(self, 0x40004C00, "UART4", 52, (0xE8, 19), "apb1", ("D", 0, 8), ("D", 1, 8), (63, 64), 115200)
        self.ahrs = Usart(self, 0x40007800, "UART7", 82, (0xE8, 30), "apb1", ("E", 7, 7), ("E", 8, 7), (79, 80), 115200)
        self.modem = Usart(self, 0x40011400, "USART6", 71, (0xF0, 5), "apb2", ("C", 7, 7), ("C", 6, 7), (71, 72), 19200)
        self.host = Usart(self, 0x40004800, "USART3", 39, (0xE8, 18), "apb1", ("D", 9, 7), ("D", 8, 7), (45, 46), 115200)
        self.usarts = [self.frontseat, self.dvl, self.ahrs, self.modem, self.host]
        self.sources = [self.tim2, self.tim5, self.watchdog, *self.usarts]
        self.exti, self.adc = Exti(self, 0x58000000), Adc(self, 0x40022000)
        others = [self.exti, self.adc, Plain(self, 0x52009000, "RAMECC1"), Plain(self, 0x58000400, "SYSCFG", (0xF4, 1)), Plain(self, 0x5C001000, "DBGMCU", None, {0: 0x20036450}),
                  Spi(self, 0x40013000), Rng(self, 0x48021800)]
        self.devices = [self.scs, self.rcc, self.pwr, self.flash, self.mux, *self.gpio.values(), *self.dmas, *self.sources, *others]
        self.pages = {page: device for device in self.devices
                      for page in range(device.base >> 10, (device.base + device.size) >> 10)}

    def reset(self, cause):
        """As `clocks.RESET_FLAGS` names it."""
        if self.now:
            self.resets.append((self.now, cause))
            self.most_stack = {name: self.stack_used(name) for name in self.stacks}
        self.cause = cause
        for device in (*self.devices, self.mpu):
            device.reset()
        for usart in self.usarts:
            usart.incoming.clear()
        self.clocks_changed()
        self.reset_core()

    @property
    def store(self):
        """The bank that does not run: parameters are written to it, and images."""
        return self.banks.seen(1)

    def complain(self, text):
        self.complaints.setdefault(text, self.now)

    # The bus.
    def device(self, address):
        self.account()
        self.now += MMIO_NS
        device = self.pages.get(address >> 10)
        if device is None:
            self.complain(f"nothing at {address:#x}")
        elif device.gate and not self.rcc.field(*device.gate):
            device.complain("no clock")
        else:
            return device
        return None

    def read(self, _, offset, size, base):
        device = self.device(base + offset)
        return device.read(base + offset - device.base, size) & ((1 << 8 * size) - 1) if device else 0

    def write(self, _, offset, size, value, base):
        device = self.device(base + offset)
        if device:
            device.write(base + offset - device.base, value, size)

    def pins_changed(self, port):
        if self.card and port == "D":
            self.card.select(not self.gpio["D"].is_high(14))

    def clocks_changed(self):
        timers = (self.tim2, self.tim5)
        for timer in timers:
            timer.rebase()
        self.tree = self.rcc.tree()
        for timer in timers:
            timer.configured()
        self.reschedule()

    def symbol(self, path):
        """Address and size of what Rust's mangled path ends in."""
        found = [entry for name, entry in self.symbols.items() if f"{path}17h" in name and entry["st_size"]]
        assert len(found) == 1, f"{len(found)} symbols {path}"
        return found[0]["st_value"], found[0]["st_size"]

    def stick(self, path):
        """From now on until a reset the function never ends; the time when it begins goes into `stuck`."""
        self.stuck = []
        address, _ = self.symbol(path)
        self.hook_entry(address & ~1, self.stuck)

    def overflow(self, path, stack):
        """From now on until a reset the function finds its stack full."""
        (address, _), (end, _), resets = self.symbol(path), self.stacks[stack], len(self.resets)

        def fill(uc, *_):
            if len(self.resets) == resets:
                uc.reg_write(arm.UC_ARM_REG_SP, end + 64)

        self.uc.hook_add(UC_HOOK_CODE, fill, None, address & ~1, address & ~1)
        self.uc.ctl_flush_tb()

    # Time.
    def at(self, time, action):
        heapq.heappush(self.events, (time, next(self.sequence), action))

    def next_event(self):
        return min([source.next_event() for source in self.sources] + [self.events[0][0] if self.events else NEVER])

    def update(self):
        for source in self.sources:
            source.update()
        while self.events and self.events[0][0] <= self.now:
            heapq.heappop(self.events)[-1]()

    def run_for(self, seconds):
        self.run(self.now + seconds * 1e9)

    def cut(self, chance, at, remembers):
        """The supply was lost at a time, within whatever was written then."""
        for writes in (self.flash, self.card):
            if writes:
                writes.cut(chance, at)
        self.lose_supply(remembers)

    def lose_supply(self, remembers):
        """The supply is switched off and on; whether a battery keeps the backup SRAM meanwhile."""
        if not remembers:
            self.backup.forget()
        if self.card:
            self.card.lose_supply()
        self.reset("power")

    # What it looks like from outside.
    def paint(self, name):
        """Whatever was written to the stack until now does not count."""
        end, start = self.stacks[name]
        self.uc.mem_write(end, bytes([PAINT]) * (start - end))
        self.most_stack[name] = 0

    def stack_marked(self, name):
        """Bytes of a stack that were written since it was last painted, which the image does at each start."""
        end, start = self.stacks[name]
        memory = bytes(self.uc.mem_read(end, start - end))
        return len(memory.lstrip(bytes([PAINT])))

    def stack_used(self, name):
        """Bytes of a stack that were ever written."""
        return max(self.stack_marked(name), self.most_stack[name])
