"""The memory protection unit (ARMv7-M manual, B3.5): what the image's own writes to its registers permit."""

from unicorn import UC_CTL_IO_WRITE, UC_CTL_TLB_FLUSH, UC_PROT_ALL, UC_PROT_EXEC, UC_PROT_NONE, UC_PROT_READ, UC_PROT_WRITE

TYPE, CTRL, RNR, RBAR, RASR, END = 0xD90, 0xD94, 0xD98, 0xD9C, 0xDA0, 0xDA4
ENABLE, BACKGROUND = 1 << 0, 1 << 2
REGIONS = 16
PAGE = 0x1000  # Unicorn's
READ_WRITE = UC_PROT_READ | UC_PROT_WRITE
PRIVILEGED = {0: UC_PROT_NONE, 1: READ_WRITE, 2: READ_WRITE, 3: READ_WRITE, 5: UC_PROT_READ, 6: UC_PROT_READ, 7: UC_PROT_READ}


class Mpu:
    """`memory`: (address, size) of what instructions can reach as memory; `devices`: of what a function answers for."""

    def __init__(self, machine, memory, devices):
        self.machine, self.memory, self.devices = machine, memory, devices
        self.reset()

    def reset(self):
        self.control, self.number, self.regions = 0, 0, [(0, 0)] * REGIONS
        self.apply()

    def read(self, offset):
        base, attributes = self.regions[self.number]
        return {TYPE: REGIONS << 8, CTRL: self.control, RNR: self.number, RBAR: base | self.number, RASR: attributes}[offset]

    def write(self, offset, value):
        if offset == CTRL:
            self.control = value
        elif offset == RNR:
            self.number = value % REGIONS
        elif offset == RBAR:
            self.number = value % REGIONS if value & 1 << 4 else self.number
            self.regions[self.number] = value & ~0x1F, self.regions[self.number][1]
        elif offset == RASR:
            self.regions[self.number] = self.regions[self.number][0], value
        # not in the middle of a block
        self.machine.at(self.machine.now, self.apply)

    def permitted(self, address):
        """Of the region with the highest number that holds the address; where it ends, or the next one begins."""
        permitted, ends = UC_PROT_ALL if not self.control & ENABLE or self.control & BACKGROUND else UC_PROT_NONE, 1 << 32
        for base, attributes in self.regions if self.control & ENABLE else ():
            size = 2 << (attributes >> 1 & 0x1F)
            if not attributes & 1:
                continue
            if base % size or size < PAGE or attributes >> 8 & 0xFF:
                self.machine.complain(f"MPU: region {base:#x} of {size:#x} bytes is not aligned, small or in parts")
            if base <= address < base + size:
                permitted = PRIVILEGED[attributes >> 24 & 7] | (0 if attributes & 1 << 28 else UC_PROT_EXEC)
            ends = min([ends] + [edge for edge in (base, base + size) if edge > address])
        return permitted, ends

    def apply(self):
        for base, size in self.memory:
            at = base
            while at < base + size:
                permitted, ends = self.permitted(at)
                ends = min(ends, base + size)
                self.machine.uc.mem_protect(at, ends - at, permitted)
                at = ends
        self.machine.uc.ctl(UC_CTL_TLB_FLUSH, UC_CTL_IO_WRITE)  # or what was permitted once stays permitted
        for base, size in self.devices:
            permitted, ends = self.permitted(base)
            if permitted & READ_WRITE != READ_WRITE or ends < base + size:
                self.machine.complain(f"MPU: what the image uses at {base:#x} is out of reach")
