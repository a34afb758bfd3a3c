"""Flash bank 2 with its ECC (RM0433 4), and the backup SRAM. Both keep their bytes when the machine is reset."""

import random

from bus import Device

KEYR, CR, SR, CCR = 0x104, 0x10C, 0x110, 0x114  # of bank 2
LOCK, PG, SER, BER, START = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 7
PROGRAMMING_ERROR, INCONSISTENT, DOUBLE_ECC = 1 << 18, 1 << 21, 1 << 26
WORD, SECTOR = 32, 0x20000


class FlashRegisters(Device):
    """The controller: keys, lock, and what it complains about."""

    name = "FLASH"

    def reset(self):
        self.r = {0x00: 0x37, 0x1C: 3 << 2, 0x0C: 0x31, CR: 0x31}  # brown-out level 3
        self.keys, self.status, self.busy_until, self.part = [], 0, 0.0, {}

    def read(self, offset, size):
        if offset == SR:
            return self.status | (5 if self.machine.now < self.busy_until else 0)
        return super().read(offset, size)

    def write(self, offset, value, size):
        if offset == KEYR:
            self.keys.append(value)
            if self.keys[-2:] == [0x45670123, 0xCDEF89AB]:
                self.r[CR] &= ~LOCK
        elif offset == CR and self.word(CR) & LOCK:
            self.complain("CR written while it is locked")
        elif offset == CR:
            self.r[CR] = value & ~START
            if value & START and value & BER or value & START and value >> 8 & 7 < 6:
                self.complain("what is not the store's is erased")
            elif value & START and value & SER:
                self.machine.store.erase((value >> 8 & 7) - 6)
                self.busy_until = self.machine.now + 1.1e9
        elif offset == CCR:
            self.status &= ~value
        else:
            super().write(offset, value, size)


class Store:
    """Sectors 6 and 7 of bank 2, in words of 32 bytes with one ECC each."""

    BASE, SIZE = 0x081C0000, 2 * SECTOR

    def __init__(self, machine):
        self.machine, self.bytes = machine, bytearray(b"\xff" * self.SIZE)
        self.programmed, self.torn = set(), set()

    def copy(self):
        return bytes(self.bytes), frozenset(self.programmed), frozenset(self.torn)

    def put(self, copied):
        content, programmed, torn = copied
        self.bytes, self.programmed, self.torn = bytearray(content), set(programmed), set(torn)

    def erase(self, sector):
        words = set(range(sector * SECTOR // WORD, (sector + 1) * SECTOR // WORD))
        self.bytes[sector * SECTOR:(sector + 1) * SECTOR] = b"\xff" * SECTOR
        self.programmed -= words
        self.torn -= words

    def read(self, _, offset, size, __):
        machine = self.machine
        if offset // WORD in self.torn:
            machine.flash.status |= DOUBLE_ECC
            if not machine.ignores_bus_faults():
                machine.fault = f"ECC error at {self.BASE + offset:#x}"
        return int.from_bytes(self.bytes[offset:offset + size], "little")

    def write(self, _, offset, size, value, __):
        flash, word = self.machine.flash, offset // WORD
        if flash.word(CR) & LOCK or not flash.word(CR) & PG:
            flash.status |= PROGRAMMING_ERROR
            flash.complain("written without PG")
            return
        if self.machine.now < flash.busy_until:
            flash.complain("written while it is busy")
        if any(at // WORD != word for at in flash.part):
            flash.status |= INCONSISTENT
            flash.complain("a word was left half written")
            flash.part = {}
        flash.part.update({offset + k: value >> 8 * k & 0xFF for k in range(size)})
        if len(flash.part) == WORD:
            if word in self.programmed:
                flash.complain("a word was programmed twice")
            for at, byte in flash.part.items():
                self.bytes[at] &= byte
            self.programmed.add(word)
            flash.part, flash.busy_until = {}, self.machine.now + 100e3


class BackupRam:
    """Whole words alone: a part of one waits in the ECC unit, and a reset loses it."""

    BASE, SIZE = 0x38800000, 0x1000

    def __init__(self, machine):
        self.machine = machine
        self.forget()

    def forget(self):
        """Any bytes, as after a supply that was off."""
        self.bytes = bytearray(random.Random(1).randbytes(self.SIZE))

    def copy(self):
        return bytes(self.bytes)

    def put(self, copied):
        self.bytes = bytearray(copied)

    def check(self, writes, size):
        machine = self.machine
        if not machine.rcc.field(0xE0, 28):
            machine.complain("backup SRAM: no clock")
        if writes and (size != 4 or not machine.pwr.field(0x00, 8)):
            machine.complain("backup SRAM: written in part, or without DBP")

    def read(self, _, offset, size, __):
        self.check(False, size)
        return int.from_bytes(self.bytes[offset:offset + size], "little")

    def write(self, _, offset, size, value, __):
        self.check(True, size)
        self.bytes[offset:offset + size] = value.to_bytes(size, "little")
