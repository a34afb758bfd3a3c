"""RCC, PWR and EXTI: oscillators, PLL1, the clock tree, reset flags; the supply and its detector (RM0433 7, 6, 20)."""

from bus import Device

CR, CFGR, D1CFGR, D2CFGR, D3CFGR, PLLCKSELR, PLL1DIVR, CIFR, CICR, BDCR, CSR, RSR = (
    0x00, 0x10, 0x18, 0x1C, 0x20, 0x28, 0x30, 0x64, 0x68, 0x70, 0x74, 0xD0)
HSI, HSE, WATCHED, PLL1 = 0, 16, 19, 24
FAILED = 1 << 10  # of CIFR: the clock security system
# (on bit, ready bit, start-up time in ns) of CR
OSCILLATORS = ((0, 2, 2e3), (7, 8, 4e3), (12, 13, 50e3), (16, 17, 2e3), (24, 25, 60e3), (26, 27, 60e3), (28, 29, 60e3))
RESET_FLAGS = {"power": 0x00FE0000, "pin": 1 << 22 | 1 << 17, "watchdog": 1 << 26 | 1 << 22 | 1 << 17,
               "software": 1 << 24 | 1 << 22 | 1 << 17, "brown-out": 1 << 21 | 1 << 22 | 1 << 17}


class Rcc(Device):
    name = "RCC"

    def reset(self):
        self.r = {CR: 1, PLLCKSELR: 0x02020200, 0x2C: 0x01FF0000, PLL1DIVR: 0x01010280, RSR: RESET_FLAGS[self.machine.cause]}
        self.since = {}

    def ready(self, on):
        bit_on, _, start_ns = next(row for row in OSCILLATORS if row[0] == on)
        there = self.field(CR, bit_on) and self.machine.now >= self.since.get(on, 0) + start_ns
        if on == HSE:
            return there and self.machine.hse_from <= self.machine.now < self.machine.hse_until
        if on == PLL1 and self.field(PLLCKSELR, 0, 2) == 2:
            return there and self.ready(HSE)
        return there

    def read(self, offset, size):
        if offset == CR:
            status = sum(1 << row[1] for row in OSCILLATORS)
            return self.word(CR) & ~status | 3 << 14 | sum(self.ready(row[0]) << row[1] for row in OSCILLATORS)
        if offset == CFGR:
            return self.word(CFGR) & ~0x38 | self.field(CFGR, 0, 3) << 3
        if offset in (BDCR, CSR):
            return self.word(offset) | self.field(offset, 0) << 1
        return super().read(offset, size)

    def write(self, offset, value, size):
        before = self.word(offset)
        if offset == CR:
            for on, _, _ in OSCILLATORS:
                if value >> on & 1 and not before >> on & 1:
                    self.since[on] = self.machine.now
            if (value ^ before) >> 18 & 1 and (before | value) >> HSE & 1:
                self.complain("HSEBYP changed while HSE is on, or by the write that switches it on")
        if offset == CICR:
            self.r[CIFR] = self.word(CIFR) & ~value
        if offset == RSR and value >> 16 & 1:
            value = 0
        if offset == PLLCKSELR:
            # The source only while every PLL is off, a divider only while its PLL is: the hardware ignores the rest.
            on = [self.field(CR, 24 + 2 * k) for k in range(3)]
            locked = (3 if any(on) else 0) | sum(0x3F << 4 + 8 * k for k in range(3) if on[k])
            value = value & ~locked | before & locked
        if offset == PLL1DIVR and self.field(CR, PLL1) and value != before:
            self.complain("PLL1DIVR written while PLL1 is on")
        if offset == CFGR and value & 7 == 3 and not self.ready(PLL1):
            self.complain("the core was switched to a PLL that has not locked")
        super().write(offset, value, size)
        if offset in (CR, CFGR, D1CFGR, D2CFGR, D3CFGR, PLLCKSELR):
            self.machine.clocks_changed()

    def lose_external(self):
        """The clock on HSE ends. A watched one is replaced by HSI; without it the core stands still (RM0433 8.5.3)."""
        machine = self.machine
        machine.hse_until = machine.now
        if not self.field(CR, WATCHED):
            machine.now = machine.watchdog.expiry
            return
        self.r[CR] &= ~(1 << HSE | 1 << WATCHED)
        if self.field(PLLCKSELR, 0, 2) == 2:
            self.r[CR] &= ~(1 << PLL1)
            self.r[CFGR] = self.word(CFGR) & ~7
        self.r[CIFR] = self.word(CIFR) | FAILED
        machine.clocks_changed()
        machine.nmi = True

    def source_hz(self):
        """What PLL1 is fed with."""
        hsi = 64e6 / (1 << self.field(CR, 3, 2)) * (1 + self.machine.hsi_ppm * 1e-6)
        return {0: hsi, 1: 4e6, 2: 8e6 * (1 + self.machine.hse_ppm * 1e-6)}.get(self.field(PLLCKSELR, 0, 2), 0)

    def tree(self):
        """Frequencies, Hz."""
        pll1 = self.source_hz() / (self.field(PLLCKSELR, 4, 6) or 1) * (self.field(PLL1DIVR, 0, 9) + 1)
        system = {0: 64e6 / (1 << self.field(CR, 3, 2)), 3: pll1 / (self.field(PLL1DIVR, 9, 7) + 1)}.get(self.field(CFGR, 0, 3), 8e6)
        ahb = lambda bits: 1 if bits < 8 else (2, 4, 8, 16, 64, 128, 256, 512)[bits & 7]
        apb = lambda bits: 1 if bits < 4 else (2, 4, 8, 16)[bits & 3]
        core = system / ahb(self.field(D1CFGR, 8, 4))
        bus = core / ahb(self.field(D1CFGR, 0, 4))
        apb1, apb2 = (apb(self.field(D2CFGR, shift, 3)) for shift in (4, 8))
        return {"core": core, "ahb": bus, "apb1": bus / apb1, "apb2": bus / apb2,
                "timers": bus if apb1 == 1 else 2 * bus / apb1, "pll1_q": pll1 / (self.field(PLL1DIVR, 16, 7) + 1)}


class Exti(Device):
    """Line 16, the detector's, to its interrupt."""

    name = "EXTI"
    RISING, MASK, PENDING, DETECTOR = 0x00, 0x80, 0x88, 16

    def write(self, offset, value, size):
        if offset == self.PENDING:
            value = self.word(offset) & ~value
        super().write(offset, value, size)
        self.line()

    def rises(self):
        if self.field(self.RISING, self.DETECTOR):
            self.r[self.PENDING] = self.word(self.PENDING) | 1 << self.DETECTOR
            self.line()

    def line(self):
        self.machine.line(1, bool(self.word(self.PENDING) & self.word(self.MASK) & 1 << self.DETECTOR))


class Pwr(Device):
    """Every voltage scale is ready at once. `is_low`: the supply is below the detector's threshold."""

    name = "PWR"

    def reset(self):
        self.r = {0x00: 0xF000C000, 0x0C: 0x6, 0x18: 0x4000}
        self.is_low = False

    def supply(self, is_low):
        if is_low and not self.is_low and self.field(0x00, 4):
            self.machine.exti.rises()
        self.is_low = is_low

    def read(self, offset, size):
        return super().read(offset, size) | (1 << 13 if offset in (0x04, 0x18) else 0) | (1 << 4 if offset == 0x04 and self.is_low else 0)


class Rng(Device):
    """Numbers that are ready at once, and the same in each run (RM0433 34)."""

    name, gate = "RNG", (0xDC, 6)
    CR, SR, DR, ON = 0x00, 0x04, 0x08, 4

    def reset(self):
        self.r, self.last = {}, 0x2545F491

    def read(self, offset, size):
        on = self.word(self.CR) & self.ON and self.machine.rcc.ready(12)
        if offset == self.SR:
            return 1 if on else 0
        if offset == self.DR and on:
            self.last = self.last * 1664525 + 1013904223 & 0xFFFFFFFF
            return self.last
        return super().read(offset, size)
