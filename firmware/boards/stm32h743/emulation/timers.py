"""TIM2 and TIM5 (RM0433 42), and the independent watchdog (46)."""

from bus import NEVER, Device

CR1, DIER, SR, EGR, CCMR1, CCER, CNT, PSC, ARR, CCR1 = 0x00, 0x0C, 0x10, 0x14, 0x18, 0x20, 0x24, 0x28, 0x2C, 0x34


class Timer(Device):
    """Counts up, from `first` on where it is set to 0; compare and capture on four channels."""

    def __init__(self, machine, base, name, irq, gate, first=0):
        self.name, self.irq, self.gate, self.first = name, irq, gate, first
        super().__init__(machine, base)

    def reset(self):
        self.r = {ARR: 0xFFFFFFFF}
        self.divider, self.count, self.since, self.looked, self.flags = 1, 0, 0.0, 0, 0
        self.configured()

    def per_ns(self):
        return self.machine.tree["timers"] / self.divider * 1e-9

    def now(self):
        return self.count + int((self.machine.now - self.since) * self.rate + 1e-6) if self.running else self.count

    def rebase(self, count=None):
        """Goes on from here: with another rate, or from another count."""
        if count is not None:
            self.looked = count
        self.count, self.since = (self.now() if count is None else count), self.machine.now
        self.configured()

    def captures(self, channel):
        return self.field(CCMR1 + 4 * (channel // 2), 8 * (channel % 2), 2) == 1

    def configured(self):
        """Keeps what is asked for at every look; `marks` are the counts at which a flag rises: (its bit, count)."""
        self.rate, self.running, self.period = self.per_ns(), self.field(CR1, 0), self.word(ARR) + 1
        marks = [(0, 0)] + [(1 + c, self.word(CCR1 + 4 * c)) for c in range(4) if not self.captures(c)]
        self.marks = [(bit, at) for bit, at in marks if at < self.period]
        self.due = self.after(self.looked, self.marks)
        self.alarm = None

    def after(self, count, marks):
        """The first count behind another one at which a mark stands."""
        return min((((count - at) // self.period + 1) * self.period + at for _, at in marks), default=NEVER)

    def update(self):
        now = self.now()
        if now >= self.due:
            for bit, at in self.marks:
                if (now - at) // self.period > (self.looked - at) // self.period:
                    self.flags |= 1 << bit
            self.due, self.alarm = self.after(now, self.marks), None
            self.line()
        self.looked = now

    def line(self):
        self.machine.line(self.irq, bool(self.flags & self.word(DIER) & 0x5F))

    def next_event(self):
        if self.alarm is None:
            asked = [(bit, at) for bit, at in self.marks if self.field(DIER, bit) and not self.flags >> bit & 1]
            at = self.after(self.now(), asked) if self.running else NEVER
            self.alarm = self.since + (at - self.count) / self.rate + 1
        return self.alarm

    def read(self, offset, size):
        self.update()
        if offset == CNT:
            # Thread mode that looks at the time waits for it: let it pass quickly.
            if not self.machine.active:
                self.machine.now += self.machine.spin_ns
            return self.now() % self.period
        if offset == SR:
            return self.flags
        channel = (offset - CCR1) // 4
        if 0 <= channel < 4 and self.captures(channel):
            self.flags &= ~(2 << channel)
            self.alarm = None
            self.line()
        return super().read(offset, size)

    def write(self, offset, value, size):
        self.update()
        if offset == SR:
            self.flags &= value
        elif offset == EGR:
            if value & 1:
                self.divider = self.word(PSC) + 1
                self.rebase(self.first)
                self.flags |= not self.field(CR1, 2)
        elif offset == CNT:
            self.rebase(value or self.first)
        else:
            if offset == CR1:
                self.rebase()
            super().write(offset, value, size)
        if offset != SR:
            self.configured()
            self.update()
        self.alarm = None
        self.line()
        if self.next_event() < self.machine.slice_end:
            self.machine.reschedule()

    def edge(self, channel):
        """A rising edge at the pin of a channel, 0 to 3."""
        self.update()
        if not (self.field(CR1, 0) and self.captures(channel) and self.field(CCER, 4 * channel)):
            self.complain(f"edge, but channel {channel + 1} does not capture")
            return
        if self.flags & 2 << channel:
            self.flags |= 0x200 << channel
        self.r[CCR1 + 4 * channel] = self.now() % self.period
        self.flags |= 2 << channel
        self.line()


class Watchdog(Device):
    """Cannot be stopped. Prescaler and reload take effect six cycles of its clock after they are written."""

    name, HZ = "IWDG1", 32e3
    KEY, PRESCALER, RELOAD, STATUS = 0x0, 0x4, 0x8, 0xC

    def reset(self):
        self.r = {self.RELOAD: 0xFFF}
        self.old, self.unlocked, self.expiry = {}, False, NEVER
        self.started = self.first_feed = self.fed = None

    def settled(self, offset):
        before, from_ns = self.old.get(offset, (0, 0))
        return self.word(offset) if self.machine.now >= from_ns else before

    def period(self):
        return (self.settled(self.RELOAD) + 1) * (4 << min(self.settled(self.PRESCALER), 6)) / self.HZ * 1e9

    def read(self, offset, size):
        if offset == self.STATUS:
            return sum(bit for register, bit in ((self.PRESCALER, 1), (self.RELOAD, 2))
                       if self.machine.now < self.old.get(register, (0, 0))[1])
        return super().read(offset, size)

    def write(self, offset, value, size):
        now = self.machine.now
        if offset == self.KEY:
            self.unlocked = value == 0x5555
            if value == 0xCCCC:
                self.started, self.expiry = now, now + self.period()
            if value == 0xAAAA and self.started is not None:
                if self.fed is not None:
                    self.machine.longest_gap = max(self.machine.longest_gap, now - self.fed)
                self.first_feed = self.first_feed or now
                self.fed, self.expiry = now, now + self.period()
            return
        if not self.unlocked:
            self.complain(f"register {offset:#x} written while locked")
            return
        self.old[offset] = (self.settled(offset), now + 6 / self.HZ * 1e9)
        self.r[offset] = value

    def next_event(self):
        return self.expiry

    def update(self):
        if self.machine.now >= self.expiry:
            self.machine.want_reset = "watchdog"
