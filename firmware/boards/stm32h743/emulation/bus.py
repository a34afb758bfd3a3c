"""What every peripheral is: a block of registers behind a clock gate."""

NEVER = float("inf")


class Device:
    """Registers kept as words. `gate` is the bit of an RCC register that lets its clock through: (offset, bit)."""

    name = "?"
    gate = None

    def __init__(self, machine, base, size=0x400):
        self.machine, self.base, self.size = machine, base, size
        self.reset()

    def reset(self):
        self.r = {}

    def word(self, offset):
        return self.r.get(offset, 0)

    def field(self, offset, shift, width=1):
        return self.r.get(offset, 0) >> shift & ((1 << width) - 1)

    def read(self, offset, size):
        return self.word(offset & ~3) >> 8 * (offset & 3)

    def write(self, offset, value, size):
        at, shift = offset & ~3, 8 * (offset & 3)
        mask = ((1 << 8 * size) - 1) << shift
        self.r[at] = self.word(at) & ~mask | value << shift & mask

    def complain(self, text):
        self.machine.complain(f"{self.name}: {text}")

    # A device with a time of its own says when it next wants `update`, ns.
    def next_event(self):
        return NEVER

    def update(self):
        pass


class Plain(Device):
    """Registers without behaviour."""

    def __init__(self, machine, base, name, gate=None, initial=None):
        self.name, self.gate, self.initial = name, gate, initial or {}
        super().__init__(machine, base)

    def reset(self):
        self.r = dict(self.initial)
