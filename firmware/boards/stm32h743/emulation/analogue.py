"""ADC1 (RM0433 25): single conversions of 16 bits, single-ended."""

from bus import NEVER, Device

ISR, CR, CFGR, SMPR1, SMPR2, PCSEL, SQR1, DR, COMMON_CCR = 0x00, 0x08, 0x0C, 0x14, 0x18, 0x1C, 0x30, 0x40, 0x308
READY, EOC, EOS = 1 << 0, 1 << 2, 1 << 3
ENABLE, DISABLE, START, STOP, REGULATOR, DEEP_POWER_DOWN, CALIBRATE = 1 << 0, 1 << 1, 1 << 2, 1 << 4, 1 << 28, 1 << 29, 1 << 31
KERNEL = 0x58, 16, 2  # of RCC, D3CCIPR: its clock
PER_HZ = 64e6  # HSI, which is what the image takes
SAMPLES = 1.5, 2.5, 8.5, 16.5, 32.5, 64.5, 387.5, 810.5  # cycles
CONVERSION = 8.5  # cycles of 16 bits
DIVIDERS = 1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256
REFERENCE_V, FULL_SCALE = 3.3, 1 << 16
REGULATOR_NS, CALIBRATION_CYCLES, START_NS = 10e3, 16384, 1e3
PINS = {10: ("C", 0)}  # of a channel


class Adc(Device):
    """`volts` is what lies at each pin, V."""

    name, gate = "ADC1", (0xD8, 5)

    def __init__(self, machine, base):
        self.volts = {}
        super().__init__(machine, base)

    def reset(self):
        self.r = {CR: DEEP_POWER_DOWN}
        self.status, self.ready_at, self.calibrated_at, self.done_at, self.powered_at = 0, NEVER, 0.0, NEVER, NEVER

    def hz(self):
        if self.machine.rcc.field(*KERNEL) != 2:
            self.complain("its clock is none that the image sets up")
        return PER_HZ / DIVIDERS[min(self.field(COMMON_CCR, 18, 4), 11)] / 2  # revision V halves it

    def advance(self):
        now = self.machine.now
        if now >= self.ready_at:
            self.status, self.ready_at = self.status | READY, NEVER
        if now >= self.calibrated_at:
            self.r[CR] = self.word(CR) & ~CALIBRATE
        if now >= self.done_at:
            self.status, self.done_at = self.status | EOC | EOS, NEVER
            self.r[CR] &= ~START
            self.r[DR] = self.convert()

    def convert(self):
        channel = self.field(SQR1, 6, 5)
        port, pin = PINS.get(channel, (None, None))
        if port is None or self.machine.gpio[port].mode(pin) != 3 or not self.field(PCSEL, channel):
            self.complain(f"channel {channel} is not an analogue pin that is selected")
        if self.field(CFGR, 2, 3) or self.field(SQR1, 0, 4):
            self.complain("not one conversion of 16 bits")
        return min(max(int(self.volts.get((port, pin), 0.0) / REFERENCE_V * FULL_SCALE), 0), FULL_SCALE - 1)

    def read(self, offset, size):
        self.advance()
        if offset == ISR:
            return self.status
        if offset == DR:
            self.status &= ~EOC
        return super().read(offset, size)

    def write(self, offset, value, size):
        self.advance()
        now, before = self.machine.now, self.word(CR)
        if offset == ISR:
            self.status &= ~value
            return
        if offset != CR:
            super().write(offset, value, size)
            return
        if value & DEEP_POWER_DOWN and value & REGULATOR:
            self.complain("its regulator in deep power down")
        if value & ~before & REGULATOR:
            self.powered_at = now + REGULATOR_NS
        if value & ~before & CALIBRATE:
            if now < self.powered_at or before & ENABLE:
                self.complain("calibrated while its regulator starts, or while it is on")
            self.calibrated_at = now + CALIBRATION_CYCLES / self.hz() * 1e9
        if value & ~before & ENABLE:
            if before & CALIBRATE or now < self.powered_at:
                self.complain("switched on before it is calibrated")
            self.ready_at = now + START_NS
        if value & START and not before & START:
            if not before & ENABLE or self.ready_at != NEVER:
                self.complain("started before it is on")
            sample = SAMPLES[self.field(*self.sample_time())]
            self.done_at = now + (sample + CONVERSION) / self.hz() * 1e9
        super().write(offset, value & ~(DISABLE | STOP), size)

    def sample_time(self):
        channel = self.field(SQR1, 6, 5)
        return (SMPR1, 3 * channel, 3) if channel < 10 else (SMPR2, 3 * (channel - 10), 3)
