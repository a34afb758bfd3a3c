"""The Cortex-M7: Unicorn runs its instructions; NVIC, exceptions, sleep and time are here.

Time is virtual: instructions are estimated from the size of the blocks that run, at one a cycle of the clock that the image
has set up, or at `cycles` for each. There are no wait states and no caches.
"""

import ctypes
import os
import re
import struct
import subprocess
import tempfile

import protection
from bus import Device
from unicorn import UC_ARCH_ARM, UC_ERR_EXCEPTION, UC_HOOK_BLOCK, UC_HOOK_CODE, UC_HOOK_INTR, UC_HOOK_MEM_READ_INVALID, UC_HOOK_MEM_WRITE_INVALID, UC_MEM_WRITE_PROT, UC_MEM_WRITE_UNMAPPED, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm
from unicorn.unicorn_py3.unicorn import uclib

BYTES_PER_INSTRUCTION = 2.7
LONGEST_SLICE_NS, SHORTEST_SLICE_NS, MASKED_SLICE_NS = 200e3, 50, 400
NMI, HARD_FAULT, RETURN_TRAP = 2, 3, 8
STACKING_REFUSED = 1 << 4  # MSTKERR, of the memory protection
ENDLESS = 0x1F000000  # a loop, where instructions may lie
STACKED = "R0 R1 R2 R3 R12 LR".split(), "D0 D1 D2 D3 D4 D5 D6 D7 FPSCR".split()
FRAME = struct.Struct("<8I8QII")
HINTS = {0x20: "wfe", 0x30: "wfi", 0x40: "sev"}

# A hook for every block is too slow in Python.
COUNTER = """
#include <stdint.h>
struct slice { int64_t executed, limit; };
int uc_emu_stop(void *);
void on_block(void *uc, uint64_t address, uint32_t size, struct slice *slice)
{ (void)address; if (slice->executed >= slice->limit) uc_emu_stop(uc); else slice->executed += size; }
"""


class Slice(ctypes.Structure):
    _fields_ = [("executed", ctypes.c_int64), ("limit", ctypes.c_int64)]


class Registers:
    """Some registers at once: Unicorn's own functions for them take most of the time of an interrupt."""

    def __init__(self, uc, names):
        self.uc, self.count = uc._uch, len(names)
        self.numbers = (ctypes.c_int * self.count)(*(getattr(arm, f"UC_ARM_REG_{name}") for name in names))
        self.values = (ctypes.c_uint64 * self.count)()
        self.places = (ctypes.c_void_p * self.count)(*(ctypes.addressof(self.values) + 8 * k for k in range(self.count)))

    def read(self):
        uclib.uc_reg_read_batch(self.uc, self.numbers, self.places, self.count)
        return self.values

    def write(self, values):
        self.values[:] = values
        uclib.uc_reg_write_batch(self.uc, self.numbers, self.places, self.count)


def compiled_counter():
    ctypes.CDLL(uclib._name, mode=ctypes.RTLD_GLOBAL)
    with tempfile.TemporaryDirectory() as folder:
        library = os.path.join(folder, "counter.so")
        command = ["cc", "-O2", "-shared", "-fPIC", "-x", "c", "-o", library, "-"]
        subprocess.run(command, input=COUNTER.encode(), check=True)
        return ctypes.CDLL(library)


def make_double_precision():
    """Unicorn 2.1.4 gives its Cortex-M7 the single-precision FPU; the H743 has the double one (MVFR0, in the heap)."""
    single = re.escape(struct.pack("<3I", 0x10110021, 0x11000011, 0x00000040))
    found = 0
    with open("/proc/self/maps") as maps, open("/proc/self/mem", "rb", 0) as memory:
        for line in maps.read().splitlines():
            if line.endswith("[heap]"):
                first, last = (int(part, 16) for part in line.split()[0].split("-"))
                memory.seek(first)
                for match in re.finditer(single, memory.read(last - first)):
                    ctypes.memmove(first + match.start(), struct.pack("<I", 0x10110221), 4)
                    found += 1
    if not found:
        raise RuntimeError("this Unicorn has no FPU that can be made double precision")


class Scs(Device):
    """System control space: NVIC and SCB."""

    name = "SCS"
    ICSR, VTOR, AIRCR, CCR, CFSR, MMFAR, STIR = 0xD04, 0xD08, 0xD0C, 0xD14, 0xD28, 0xD34, 0xF00

    def reset(self):
        self.r = {0xD00: 0x411FC271, self.AIRCR: 0xFA050000, self.CCR: 0x40200, self.VTOR: 0x08000000}
        self.enabled = self.pending = self.level = 0
        self.priority = [0] * 256

    def read(self, offset, size):
        shift = 8 * (offset & 0x1C)
        if 0x100 <= offset < 0x1A0:
            return self.enabled >> shift & 0xFFFFFFFF
        if 0x200 <= offset < 0x2A0:
            return (self.pending | self.level) >> shift & 0xFFFFFFFF
        if 0x400 <= offset < 0x4F0:
            return int.from_bytes(bytes(self.priority[offset - 0x400:offset - 0x400 + size]), "little")
        if protection.TYPE <= offset < protection.END:
            return self.machine.mpu.read(offset)
        return self.machine.exception() if offset == self.ICSR else super().read(offset, size)

    def write(self, offset, value, size):
        bits = value << 8 * (offset & 0x1C)
        if 0x100 <= offset < 0x120:
            self.enabled |= bits
        elif 0x180 <= offset < 0x1A0:
            self.enabled &= ~bits
        elif 0x200 <= offset < 0x220:
            self.pending |= bits
        elif 0x280 <= offset < 0x2A0:
            self.pending &= ~bits
        elif 0x400 <= offset < 0x4F0:
            for k in range(size):
                self.priority[offset - 0x400 + k] = value >> 8 * k & 0xF0
        elif offset == self.STIR:
            self.pending |= 1 << (value & 0x1FF)
        elif offset == self.AIRCR:
            if value >> 16 == 0x05FA and value & 4:
                self.machine.want_reset = "software"
        elif protection.TYPE <= offset < protection.END:
            self.machine.mpu.write(offset, value)
        elif offset == self.CFSR:
            self.r[offset] = self.word(offset) & ~value
        else:
            super().write(offset, value, size)
        self.machine.reschedule()

    def waiting(self):
        """The most urgent interrupt that is pending and enabled."""
        todo, best = self.pending & self.enabled, None
        while todo:
            irq = (todo & -todo).bit_length() - 1
            if best is None or self.priority[irq] < self.priority[best]:
                best = irq
            todo &= todo - 1
        return best


class Core:
    """What `machine.Machine` builds on: `sources`, `next_event`, `update` and `bus` are its own."""

    def build_core(self, code):
        """`code`: (address, bytes) of the instructions, to find those that sleep."""
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M7)
        self.slice, self.counter = Slice(), compiled_counter()
        hook = ctypes.c_size_t()
        uclib.uc_hook_add(self.uc._uch, ctypes.byref(hook), UC_HOOK_BLOCK, ctypes.cast(self.counter.on_block, ctypes.c_void_p),
                          ctypes.cast(ctypes.byref(self.slice), ctypes.c_void_p), ctypes.c_uint64(1), ctypes.c_uint64(0))
        self.uc.hook_add(UC_HOOK_INTR, self.on_trap)
        self.uc.hook_add(UC_HOOK_MEM_READ_INVALID | UC_HOOK_MEM_WRITE_INVALID, self.on_refusal)
        for match in re.finditer(rb"[\x20\x30\x40]\xbf", code[1]):
            if match.start() % 2 == 0:
                at = code[0] + match.start()
                self.uc.hook_add(UC_HOOK_CODE, self.on_hint, HINTS[match[0][0]], at, at)
        self.uc.mem_map(ENDLESS, 0x1000)
        self.uc.mem_write(ENDLESS, b"\xfe\xe7")
        self.uc.emu_start(ENDLESS | 1, 0, count=1)  # builds the CPU
        make_double_precision()
        self.masks = Registers(self.uc, ("FAULTMASK", "PRIMASK", "BASEPRI"))
        self.program_counter = Registers(self.uc, ("PC",))
        self.saved = Registers(self.uc, (*STACKED[0], *STACKED[1], "SP", "XPSR"))
        self.entered = Registers(self.uc, ("SP", "LR", "XPSR", "IPSR"))
        self.restored = Registers(self.uc, (*STACKED[0], *STACKED[1], "SP", "XPSR", "IPSR"))

    def reset_core(self):
        self.active, self.event, self.fault, self.want_reset, self.nmi = [], False, None, None, False
        stack, start = struct.unpack("<II", self.uc.mem_read(0x08000000, 8))
        for register in "PRIMASK FAULTMASK BASEPRI CONTROL IPSR".split():
            self.uc.reg_write(getattr(arm, f"UC_ARM_REG_{register}"), 0)
        for register in (arm.UC_ARM_REG_MSP, arm.UC_ARM_REG_SP):
            self.uc.reg_write(register, stack)
        self.pc = start & ~1

    # Hooks.
    def on_trap(self, uc, number, _):
        self.trap = number
        uc.emu_stop()

    def on_refusal(self, uc, access, address, *_):
        """Of a read or a write that the memory protection refuses the address is kept."""
        wanted = protection.UC_PROT_WRITE if access in (UC_MEM_WRITE_PROT, UC_MEM_WRITE_UNMAPPED) else protection.UC_PROT_READ
        if not self.mpu.permitted(address)[0] & wanted:
            self.scs.r.update({Scs.CFSR: 0x82, Scs.MMFAR: address & 0xFFFFFFFF})
        return False

    def hook_entry(self, address, times):
        """Whoever comes to an address stays there until the next reset."""
        resets = len(self.resets)

        def stay(uc, *_):
            if len(self.resets) == resets:
                times.append(self.now)
                uc.reg_write(arm.UC_ARM_REG_PC, ENDLESS | 1)
                uc.emu_stop()

        self.uc.hook_add(UC_HOOK_CODE, stay, None, address, address)
        self.uc.ctl_flush_tb()

    def on_hint(self, uc, address, _, kind):
        if kind == "sev":
            self.event = True
        else:
            self.hint = kind, address
            uc.emu_stop()

    # Exceptions.
    def line(self, irq, high):
        bit = 1 << irq
        if high and not self.scs.level & bit:
            self.scs.level |= bit
            self.scs.pending |= bit
            self.reschedule()
        elif not high:
            self.scs.level &= ~bit

    def reschedule(self):
        """Ends the present slice at its next block."""
        self.slice.limit, self.slice_end = 0, 0.0

    def exception(self):
        return self.active[-1][0] if self.active else 0

    def ignores_bus_faults(self):
        return self.uc.reg_read(arm.UC_ARM_REG_FAULTMASK) and self.scs.field(Scs.CCR, 8)

    def running_priority(self):
        faults, all_but_faults, base = self.masks.read()
        if faults:
            return -1
        masked = 0 if all_but_faults else base & 0xF0 or 256
        return min([masked] + [priority for _, priority in self.active])

    def deliver(self):
        """Enters the most urgent interrupt, if it may; whether one waits that may not."""
        irq = self.scs.waiting()
        if irq is None:
            return False
        if self.scs.priority[irq] >= self.running_priority():
            return True
        self.scs.pending &= ~(1 << irq)
        self.enter(16 + irq, self.scs.priority[irq])
        return False

    def enter(self, number, priority):
        *core, sp, xpsr = (value & 0xFFFFFFFF for value in self.saved.read())
        doubles = self.saved.values[len(STACKED[0]):-3]
        frame, xpsr = (sp - FRAME.size) & ~7, xpsr | 1 << 24 | (1 << 9 if sp & 4 else 0)
        try:
            self.uc.mem_write(frame, FRAME.pack(*core[:len(STACKED[0])], self.pc, xpsr, *doubles, core[-1], 0))
        except UcError:
            # no stack to enter it: that is a fault, whose handler is entered without a frame (B1.5.12)
            self.scs.r[Scs.CFSR] = self.scs.word(Scs.CFSR) | STACKING_REFUSED
            if number != HARD_FAULT:
                self.faults.append((self.now, f"no stack for exception {number}"))
                number, priority = HARD_FAULT, -1
        thread = 0xFFFFFFED if self.uc.reg_read(arm.UC_ARM_REG_CONTROL) & 2 else 0xFFFFFFE9
        # in this order: from handler mode on SP is the main stack's
        self.entered.write((frame, 0xFFFFFFE1 if self.active else thread, 1 << 24 | number, number))
        self.active.append((number, priority))
        vector = self.scs.word(Scs.VTOR) + 4 * number
        self.pc = struct.unpack("<I", self.uc.mem_read(vector, 4))[0] & ~1
        self.event = True

    def leave(self):
        number, _ = self.active.pop()
        self.uc.reg_write(arm.UC_ARM_REG_IPSR, self.exception())  # in thread mode SP is that mode's
        sp = self.uc.reg_read(arm.UC_ARM_REG_SP)
        values = FRAME.unpack(self.uc.mem_read(sp, FRAME.size))
        above = sp + FRAME.size + (4 if values[7] >> 9 & 1 else 0)
        self.restored.write((*values[:6], *values[8:17], above, values[7] & ~(1 << 9), self.exception()))
        self.pc, self.event = values[6] & ~1, True
        self.scs.pending |= self.scs.level & (1 << number - 16 if number >= 16 else 0)

    def hard_fault(self, why):
        self.faults.append((self.now, why))
        try:
            if self.exception() in (NMI, HARD_FAULT):
                raise UcError(UC_ERR_EXCEPTION)
            self.enter(HARD_FAULT, -1)
        except UcError:  # in a fault
            self.now = self.watchdog.expiry  # locked up

    # Time.
    def run(self, until):
        """Until a time, ns."""
        while self.now < until:
            self.update()
            if self.want_reset:
                self.reset(self.want_reset)
            if self.nmi and self.exception() not in (NMI, HARD_FAULT):
                self.nmi = False
                self.enter(NMI, -2)
            masked = self.deliver()
            span = min(self.next_event(), until) - self.now
            shortest = (MASKED_SLICE_NS if masked else SHORTEST_SLICE_NS) * self.cycles
            span = shortest if masked else max(min(span, LONGEST_SLICE_NS), shortest)
            before = self.pc
            self.slice_of(span)
            if self.pc == before == ENDLESS:
                self.now = min(self.next_event(), until)
            if self.fault:
                self.hard_fault(self.fault)
                self.fault = None
            elif self.trap == RETURN_TRAP:
                self.leave()
            elif self.trap is not None:
                self.hard_fault(f"trap {self.trap}")
            elif self.hint:
                kind, address = self.hint
                self.pc = address + 2
                if kind == "wfe" and self.event:
                    self.event = False
                else:
                    self.sleep(until)

    def slice_of(self, span):
        """Runs for about this long, ns."""
        self.per_ns = self.tree["core"] * 1e-9 * BYTES_PER_INSTRUCTION / self.cycles
        self.trap = self.hint = None
        self.slice.executed, self.slice.limit = 0, max(8, int(span * self.per_ns))
        self.accounted, self.slice_end = 0, self.now + span
        try:
            self.uc.emu_start(self.pc | 1, 0xFFFFFFF0)
            self.pc = self.program_counter.read()[0] & ~1
        except UcError as error:
            self.pc = self.uc.reg_read(arm.UC_ARM_REG_PC) & ~1
            if self.pc & 0xFFFFFF00 == 0xFFFFFF00:
                self.trap = RETURN_TRAP
            else:
                self.fault = f"{error} at {self.pc:#x}"
        self.account()

    def account(self):
        """Time goes on by what was executed since the last call."""
        executed = self.slice.executed
        self.now += (executed - self.accounted) / self.per_ns
        self.accounted = executed

    def sleep(self, until):
        while self.now < until and not (self.want_reset or self.nmi) and self.scs.waiting() is None:
            self.now = max(self.now, min(self.next_event(), until))
            self.update()
