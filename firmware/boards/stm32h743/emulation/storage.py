"""Two banks of flash with their ECC and their exchange (RM0433 4), and the backup SRAM. All of it outlasts a reset."""

import random

from bus import Device

KEYR, CR, SR, CCR, SET = 0x04, 0x0C, 0x10, 0x14, 0x100  # of the bank that runs; a set further those of the other one
OPTKEYR, OPTCR, OPTSR_CUR, OPTSR_PRG = 0x08, 0x18, 0x1C, 0x20
LOCK, PG, SER, BER, START = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 7
OPTION_LOCK, OPTION_START, SWAP = 1 << 0, 1 << 1, 1 << 31
PROGRAMMING_ERROR, INCONSISTENT, DOUBLE_ECC = 1 << 18, 1 << 21, 1 << 26
WORD, SECTOR, BANK = 32, 0x20000, 0x100000
OWN, OTHER = 0x08000000, 0x08100000
IMAGE, TRAILER = 0xBF000, 0x1000  # of a bank: what the core runs as memory, and the marks behind it
BROWN_OUT = 3 << 2


class FlashRegisters(Device):
    """The controller: keys, lock, options, and what it complains about. Numbers of banks are 0 the own, 1 the other."""

    name = "FLASH"
    erase_ns, write_ns, option_ns = 1.1e9, 100e3, 50e6

    def reset(self):
        banks = self.machine.banks
        banks.exchange()
        swap = SWAP if banks.swapped else 0
        self.r = {0x00: 0x37, OPTCR: OPTION_LOCK | swap, OPTSR_CUR: BROWN_OUT | swap, OPTSR_PRG: BROWN_OUT | swap,
                  CR: 0x31, SET + CR: 0x31}
        self.keys, self.status, self.busy_until, self.part, self.under_way = {}, [0, 0], [0.0, 0.0, 0.0], {}, {}

    def read(self, offset, size):
        bank = offset // SET
        if offset in (SR, SET + SR):
            return self.status[bank] | (5 if self.machine.now < self.busy_until[bank] else 0)
        if offset == OPTSR_CUR:
            return self.word(offset) | (self.machine.now < self.busy_until[2])
        return super().read(offset, size)

    def begin(self, place, kind, span_ns, interrupted):
        """An operation in bank 0 or 1, or of the options (2); `interrupted` does to the flash what a cut in it leaves."""
        now = self.machine.now
        self.busy_until[place] = now + span_ns
        self.under_way[place] = now, interrupted
        self.machine.operation(kind, span_ns)

    def cut(self, chance, at):
        """The supply was lost at a time: what was under way then is not done, half done or just done."""
        for place, (begun, interrupted) in self.under_way.items():
            if begun <= at < self.busy_until[place]:
                interrupted(chance)

    def unlocked_by(self, register, value, keys):
        self.keys[register] = [*self.keys.get(register, []), value][-2:]
        return self.keys[register] == keys

    def write(self, offset, value, size):
        bank, register = offset // SET, offset % SET
        if register == KEYR:
            if self.unlocked_by(offset, value, [0x45670123, 0xCDEF89AB]):
                self.r[SET * bank + CR] &= ~LOCK
        elif register == CR and self.word(offset) & LOCK:
            self.complain("CR written while it is locked")
        elif register == CR:
            self.r[offset] = value & ~START
            if value & START and (value & BER or bank == 0):
                self.complain("the bank that runs is erased, or a whole one")
            elif value & START and value & SER:
                self.begin(bank, "erase", self.erase_ns, self.machine.store.erase(value >> 8 & 7))
        elif register == CCR:
            self.status[bank] &= ~value
        elif offset == OPTKEYR:
            if self.unlocked_by(offset, value, [0x08192A3B, 0x4C5D6E7F]):
                self.r[OPTCR] &= ~OPTION_LOCK
        elif offset in (OPTCR, OPTSR_PRG) and self.word(OPTCR) & OPTION_LOCK:
            self.complain("options written while they are locked")
        elif offset == OPTCR:
            self.r[OPTCR] = value & OPTION_LOCK | self.word(OPTCR) & SWAP
            if value & OPTION_START:
                wanted = self.word(OPTSR_PRG)
                if wanted & ~SWAP != BROWN_OUT:
                    self.complain("an option other than the exchange of the banks is written")
                banks, before = self.machine.banks, self.machine.banks.option
                banks.option = bool(wanted & SWAP)
                self.r[OPTSR_CUR] = wanted
                self.begin(2, "option", self.option_ns, lambda chance: banks.choose(chance.choice([before, banks.option])))
        else:
            super().write(offset, value, size)


class Bank:
    """Words of 32 bytes with one ECC each."""

    def __init__(self):
        self.bytes, self.programmed, self.torn = bytearray(b"\xff" * BANK), set(), set()

    def copy(self):
        return bytes(self.bytes), frozenset(self.programmed), frozenset(self.torn)

    def put(self, copied):
        content, programmed, torn = copied
        self.bytes, self.programmed, self.torn = bytearray(content), set(programmed), set(torn)

    def load(self, at, content):
        """By a programmer."""
        self.bytes[at:at + len(content)] = content
        self.programmed |= set(range(at // WORD, (at + len(content) - 1) // WORD + 1))

    def erase(self, sector):
        """What a cut in it does: a word is as it was, erased, or neither."""
        span = slice(sector * SECTOR, (sector + 1) * SECTOR)
        words = set(range(span.start // WORD, span.stop // WORD))
        before, programmed, torn = self.bytes[span], self.programmed & words, self.torn & words
        self.bytes[span] = b"\xff" * SECTOR
        self.programmed -= words
        self.torn -= words

        def interrupted(chance):
            for word in sorted(programmed):
                left = chance.choice(["as it was", "erased", "torn"])
                if left != "erased":
                    self.programmed.add(word)
                if left == "as it was":
                    at = word * WORD
                    self.bytes[at:at + WORD] = before[at - span.start:at - span.start + WORD]
                if left == "torn" or left == "as it was" and word in torn:
                    self.torn.add(word)
        return interrupted

    def program(self, word, content):
        """What a cut in it does: the word is erased still, torn, or there."""
        for at, byte in content.items():
            self.bytes[at] &= byte
        self.programmed.add(word)

        def interrupted(chance):
            left = chance.choice(["erased", "torn", "there"])
            if left == "torn":
                self.torn.add(word)
            elif left == "erased":
                self.bytes[word * WORD:(word + 1) * WORD] = b"\xff" * WORD
                self.programmed.discard(word)
        return interrupted


class Banks:
    """Both, and which of them runs: what the option says takes effect at a reset."""

    def __init__(self, machine):
        self.machine, self.physical, self.option, self.swapped = machine, (Bank(), Bank()), False, None

    def exchange(self):
        if self.swapped != self.option:
            self.swapped = self.option
            if any(word < IMAGE // WORD for word in self.seen(0).torn):
                self.machine.complain("an image with a torn word runs")
            self.machine.uc.mem_write(OWN, bytes(self.seen(0).bytes[:IMAGE]))
            self.machine.uc.ctl_flush_tb()

    def choose(self, option):
        self.option = option

    def seen(self, number):
        """0 the one that runs, 1 the other."""
        return self.physical[number ^ bool(self.swapped)]


class FlashWindow:
    """A part of a bank as the core reads and writes it."""

    def __init__(self, machine, number, first, size):
        self.machine, self.number, self.first = machine, number, first
        self.BASE, self.SIZE = (OWN, OTHER)[number] + first, size

    def read(self, _, offset, size, __):
        machine, bank, at = self.machine, self.machine.banks.seen(self.number), self.first + offset
        if at // WORD in bank.torn:
            machine.flash.status[self.number] |= DOUBLE_ECC
            if not machine.ignores_bus_faults():
                machine.fault = f"ECC error at {self.BASE + offset:#x}"
        return int.from_bytes(bank.bytes[at:at + size], "little")

    def write(self, _, offset, size, value, __):
        flash, bank, at = self.machine.flash, self.machine.banks.seen(self.number), self.first + offset
        word, control = at // WORD, flash.word(SET * self.number + CR)
        if control & LOCK or not control & PG:
            flash.status[self.number] |= PROGRAMMING_ERROR
            flash.complain("written without PG")
            return
        if self.machine.now < flash.busy_until[self.number]:
            flash.complain("written while it is busy")
        if any(begun // WORD != word for begun in flash.part):
            flash.status[self.number] |= INCONSISTENT
            flash.complain("a word was left half written")
            flash.part = {}
        flash.part.update({at + k: value >> 8 * k & 0xFF for k in range(size)})
        if len(flash.part) == WORD:
            if word in bank.programmed:
                flash.complain("a word was programmed twice")
            interrupted, flash.part = bank.program(word, flash.part), {}
            flash.begin(self.number, "mark" if IMAGE <= at < IMAGE + TRAILER else "word", flash.write_ns, interrupted)
            if self.number == 0:
                self.machine.now += flash.write_ns  # the core waits for its next instruction


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
