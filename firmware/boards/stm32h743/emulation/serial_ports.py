"""USARTs with their FIFO (RM0433 48), DMA1, DMA2 and DMAMUX1 (15 to 17), GPIO (11)."""

from collections import deque

from bus import NEVER, Device

CR1, CR3, BRR, ISR, ICR, RDR, TDR = 0x00, 0x08, 0x0C, 0x1C, 0x20, 0x24, 0x28
FRAMING, OVERRUN, IDLE, RXNE, TC, TXE = 0x02, 0x08, 0x10, 0x20, 0x40, 0x80
HALF, COMPLETE, TRANSFER_ERROR = 0x10, 0x20, 0x08


class Gpio(Device):
    def __init__(self, machine, base, port):
        self.name, self.port, self.gate = "GPIO" + port, port, (0xE0, ord(port) - ord("A"))
        self.outside = {}  # levels that something puts at pins
        self.held = set()  # pins at which that is stronger than an output
        super().__init__(machine, base)

    def reset(self):
        self.r = {0x00: {"A": 0xABFFFFFF, "B": 0xFFFFFEBF}.get(self.port, 0xFFFFFFFF)}

    def write(self, offset, value, size):
        if offset == 0x18:  # BSRR: setting wins
            offset, value = 0x14, self.word(0x14) & ~(value >> 16) | value & 0xFFFF
        super().write(offset, value, size)
        if offset == 0x14:
            self.machine.pins_changed(self.port)

    def read(self, offset, size):
        if offset & ~3 == 0x10:  # IDR: what an output drives, what lies at an input, else its pull
            return sum(self.level(pin) << pin for pin in range(16)) >> 8 * (offset & 3)
        return super().read(offset, size)

    def level(self, pin):
        if self.mode(pin) == 1 and pin not in self.held:
            return self.is_high(pin)
        return self.outside.get(pin, self.field(0x0C, 2 * pin, 2) == 1)

    def is_high(self, pin):
        return bool(self.field(0x14, pin))

    def mode(self, pin):
        """0 input, 1 output, 2 alternate function, 3 analogue."""
        return self.field(0x00, 2 * pin, 2)

    def function(self, pin):
        """The alternate function of a pin, or `None`."""
        return self.field(0x20 + 4 * (pin // 8), 4 * (pin % 8), 4) if self.field(0x00, 2 * pin, 2) == 2 else None


class Stream:
    """One DMA stream, of bytes."""

    def __init__(self, dma, number):
        self.dma, self.number = dma, number
        self.r, self.flags, self.reload, self.position = [0, 0, 0, 0, 0, 0x21], 0, 0, 0  # CR, NDTR, PAR, M0AR, M1AR, FCR

    def enabled(self):
        return self.r[0] & 1

    def request(self):
        return self.dma.machine.mux.field(4 * (self.dma.first + self.number), 0, 7)

    def write(self, index, value):
        before, self.r[index] = self.r[index], value
        if index == 1:
            self.reload = value
            if self.enabled():
                self.complain("NDTR written while it is enabled")
        if index:
            return
        if value & ~before & 1:
            self.start()
        elif before & ~value & 1 and self.r[1]:
            self.raise_flag(COMPLETE)  # RM0433: an interruption ends it as well
        elif before & value & 1 and (before ^ value) & ~0x1F:
            self.complain("CR changed while it is enabled")
        self.line()

    def start(self):
        self.position = 0
        address = self.r[3]
        if self.flags & COMPLETE:
            self.complain("enabled with TCIF set")
        if not (0x24000000 <= address < 0x24080000 or 0x30000000 <= address < 0x30048000 or 0x08000000 <= address < 0x08200000):
            self.complain(f"no way to {address:#x}")
            self.r[0] &= ~1
            self.raise_flag(TRANSFER_ERROR)
        usart = next((u for u in self.dma.machine.usarts if u.base <= self.r[2] < u.base + 0x400), None)
        if usart is None or self.request() not in usart.requests:
            self.complain(f"request {self.request()} is not of the peripheral at {self.r[2]:#x}")
            return
        if not self.r[0] >> 20 & 1:
            self.complain("TRBUFF is not set for a USART (erratum ES0392 2.3.1)")
        usart.service()

    def next_address(self):
        address = self.r[3] + (self.position if self.r[0] >> 10 & 1 else 0)
        self.position += 1
        self.r[1] -= 1
        if self.r[1] == self.reload // 2:
            self.raise_flag(HALF)
        if self.r[1] == 0:
            if self.r[0] >> 8 & 1:
                self.r[1], self.position = self.reload, 0
            else:
                self.r[0] &= ~1
            self.raise_flag(COMPLETE)
        return address

    def raise_flag(self, flag):
        self.flags |= flag
        self.line()

    def line(self):
        enabled = self.r[0] << 1 & 0x3C
        self.dma.machine.line(self.dma.irqs[self.number], bool(self.flags & enabled))

    def complain(self, text):
        self.dma.complain(f"stream {self.number}: {text}")


class Dma(Device):
    SHIFT = (0, 6, 16, 22)

    def __init__(self, machine, base, name, first, irqs, gate):
        self.name, self.first, self.irqs, self.gate = name, first, irqs, gate
        super().__init__(machine, base)

    def reset(self):
        self.streams = [Stream(self, number) for number in range(8)]

    def group(self, offset):
        return list(zip(self.SHIFT, self.streams[4 * (offset // 4 % 2):]))

    def read(self, offset, size):
        if offset < 0x10:
            return sum(stream.flags << shift for shift, stream in self.group(offset)) if offset < 8 else 0
        return self.streams[(offset - 0x10) // 0x18].r[(offset - 0x10) % 0x18 // 4]

    def write(self, offset, value, size):
        if offset >= 0x10:
            self.streams[(offset - 0x10) // 0x18].write((offset - 0x10) % 0x18 // 4, value)
        elif offset >= 8:
            for shift, stream in self.group(offset):
                stream.flags &= ~(value >> shift & 0x3D)
                stream.line()


class Usart(Device):
    """`sent` is what left the pin, with its time; `feed` is what the device at the other end says, at its `baud`.

    `haste`: bytes pass so many times as fast as the baud rate says.
    """

    def __init__(self, machine, base, name, irq, gate, bus, rx, tx, requests, baud):
        self.name, self.irq, self.gate, self.bus, self.rx_pin, self.tx_pin = name, irq, gate, bus, rx, tx
        self.requests, self.device_baud = requests, baud
        self.sent, self.incoming, self.on_byte, self.haste = [], deque(), None, 1
        super().__init__(machine, base)

    def reset(self):
        self.r, self.flags = {}, TC
        self.received, self.queued, self.shifting = deque(), deque(), None
        self.shifted_at = self.idle_at = NEVER
        self.streams = {}

    def depth(self):
        return 16 if self.field(CR1, 29) else 1

    def baud(self):
        return self.machine.tree[self.bus] / self.word(BRR) if self.word(BRR) else 0

    def byte_ns(self, baud):
        return 10e9 / (baud * self.haste)

    def stream(self, request):
        """The stream that serves a request, if it is enabled."""
        known = self.streams.get(request)
        if known is None or not (known.enabled() and known.request() == request):
            streams = (s for dma in self.machine.dmas for s in dma.streams)
            known = self.streams[request] = next((s for s in streams if s.enabled() and s.request() == request), None)
        return known

    def status(self):
        return self.flags | (RXNE if self.received else 0) | (TXE if len(self.queued) < self.depth() else 0)

    def line(self):
        status, c1, c3 = self.status(), self.word(CR1), self.word(CR3)
        wanted = status & c1 & (IDLE | TC | TXE | RXNE)
        overrun, error = status & OVERRUN and c1 & RXNE, status & 0xE and c3 & 1
        self.machine.line(self.irq, bool(wanted or overrun or error))

    def service(self):
        """Lets DMA move what it may."""
        if self.field(CR3, 6) and self.received:
            stream = self.stream(self.requests[0])
            while stream and stream.enabled() and self.received:
                self.machine.uc.mem_write(stream.next_address(), bytes([self.received.popleft()]))
        if self.field(CR3, 7) and self.word(CR1) & 9 == 9 and len(self.queued) < self.depth():
            stream = self.stream(self.requests[1])
            while stream and stream.enabled() and len(self.queued) < self.depth():
                self.queued.append(self.machine.uc.mem_read(stream.next_address(), 1)[0])
        self.shift(self.machine.now)
        self.line()

    def shift(self, at):
        if self.shifting is None and self.queued and self.word(CR1) & 9 == 9:
            self.shifting, self.shifted_at = self.queued.popleft(), at + self.byte_ns(self.baud())
            self.flags &= ~TC
            self.machine.reschedule()

    def next_event(self):
        return min(self.incoming[0][0] if self.incoming else NEVER, self.shifted_at, self.idle_at)

    def update(self):
        now = self.machine.now
        if now < self.next_event():
            return
        while self.shifted_at <= now:
            at, byte = self.shifted_at, self.shifting
            self.shifting, self.shifted_at = None, NEVER
            self.emit(at, byte)
            self.service()
            if self.shifting is None:
                self.flags |= TC
            else:
                self.shifted_at = at + self.byte_ns(self.baud())
        while self.incoming and self.incoming[0][0] <= now:
            self.arrive(*self.incoming.popleft())
        if self.idle_at <= now:
            self.idle_at = NEVER
            self.flags |= IDLE
        self.line()

    def check_pin(self, pin):
        port, number, function = pin
        if self.machine.gpio[port].function(number) != function:
            self.complain(f"P{port}{number} does not have function {function}")

    def emit(self, at, byte):
        self.check_pin(self.tx_pin)
        self.sent.append((at, byte))
        if self.on_byte:
            self.on_byte(byte)

    def arrive(self, at, byte, error):
        if self.word(CR1) & 5 != 5:
            return
        self.check_pin(self.rx_pin)
        if abs(self.baud() / self.device_baud - 1) > 0.02:
            self.complain(f"{self.baud():.0f} baud, the device has {self.device_baud}")
        self.flags |= error
        if len(self.received) >= self.depth():
            self.flags |= OVERRUN
        else:
            self.received.append(byte)
        self.idle_at = at + self.byte_ns(self.device_baud)
        self.service()

    def feed(self, data, at=None, error=0):
        """Bytes from the device, one after the other from a time on, ns."""
        time = max(self.machine.now if at is None else at, self.incoming[-1][0] if self.incoming else 0)
        for byte in data:
            time += self.byte_ns(self.device_baud)
            self.incoming.append((time, byte, error))
        self.machine.reschedule()

    def read(self, offset, size):
        if offset == ISR:
            return self.status() | self.field(CR1, 3) << 21 | self.field(CR1, 2) << 22
        if offset == RDR:
            byte = self.received.popleft() if self.received else 0
            self.service()
            return byte
        return super().read(offset, size)

    def write(self, offset, value, size):
        if offset == ICR:
            if self.flags & value:
                self.flags &= ~value
                self.line()
            return
        if offset == CR1 and value == self.word(CR1):
            return
        if offset == BRR and self.field(CR1, 0):
            self.complain("BRR written while it is enabled")
        if offset == TDR:
            self.queued.append(value & 0xFF)
        super().write(offset, value, size)
        if offset in (CR1, CR3, TDR):
            self.service()
