"""SPI1 as a master of bytes (RM0433 50), and a microSD card on it with a FAT16 volume (SD physical layer 7)."""

import struct
from collections import deque

from bus import Device

CFG1, TXDR, RXDR, STATUS = 0x08, 0x20, 0x30, 0x14


class Spi(Device):
    name, gate = "SPI1", (0xF0, 12)

    def reset(self):
        self.r, self.received = {}, deque()

    def read(self, offset, size):
        if offset == STATUS:
            return 0x100A | (0x2001 if self.received else 0)
        if offset == RXDR:
            return self.received.popleft() if self.received else 0
        return super().read(offset, size)

    def write(self, offset, value, size):
        if offset != TXDR:
            super().write(offset, value, size)
            return
        if not self.field(0x00, 0):
            self.complain("data written while it is disabled")
        hz = self.machine.tree["pll1_q"] / (2 << self.field(CFG1, 28, 3))
        self.machine.now += 8e9 / hz
        card = self.machine.card
        self.received.append(card.exchange(self.machine, value & 0xFF, hz) if card else 0xFF)


def crc(data, polynomial, width):
    value, top = 0, 1 << width - 1
    for byte in data:
        for k in range(8):
            carry = bool(value & top) != bool(byte << k & 0x80)
            value = value << 1 & (1 << width) - 1 ^ (polynomial if carry else 0)
    return value


CRC16 = [crc([byte], 0x1021, 16) for byte in range(256)]


def crc16(data):
    value = 0
    for byte in data:
        value = value << 8 & 0xFFFF ^ CRC16[value >> 8 ^ byte]
    return value


class Volume:
    """64 MB with one partition: FAT16, clusters of 2 kB."""

    SECTORS, START, CLUSTER, FAT, ROOT = 131072, 2048, 4, 127, 512

    def __init__(self):
        count = self.SECTORS - self.START
        self.bytes = bytearray(512 * self.SECTORS)
        self.bytes[446:462] = struct.pack("<B3xB3xII", 0, 0x06, self.START, count)
        boot = struct.pack("<3s8sHBHBHHBHHHIIBBBI11s8s", b"\xeb\x3c\x90", b"MSDOS5.0", 512, self.CLUSTER, 1, 2, self.ROOT, 0,
                           0xF8, self.FAT, 63, 255, self.START, count, 0x80, 0, 0x29, 1, b"NO NAME    ", b"FAT16   ")
        base = 512 * self.START
        self.bytes[base:base + len(boot)] = boot
        self.bytes[510:512] = self.bytes[base + 510:base + 512] = b"\x55\xaa"
        for k in range(2):
            at = base + 512 * (1 + k * self.FAT)
            self.bytes[at:at + 4] = b"\xf8\xff\xff\xff"

    def leave(self, size):
        """All but so many bytes are taken, by no file."""
        free, base = size // (512 * self.CLUSTER), 512 * self.START
        for k in range(2):
            at = base + 512 * (1 + k * self.FAT) + 4 + 2 * free
            end = base + 512 * (1 + (k + 1) * self.FAT)
            self.bytes[at:end] = b"\xff" * (end - at)

    def block(self, number):
        return slice(512 * number, 512 * number + 512)

    def files(self):
        """Name and content of every file in the root directory."""
        base = 512 * self.START
        root = base + 512 * (1 + 2 * self.FAT)
        data, size = root + 32 * self.ROOT, 512 * self.CLUSTER
        chain = struct.unpack_from(f"<{256 * self.FAT}H", self.bytes, base + 512)
        found = {}
        for entry in (self.bytes[root + 32 * k:root + 32 * k + 32] for k in range(self.ROOT)):
            if entry[0] in (0, 0xE5) or entry[11] & 8:
                continue
            cluster, length = struct.unpack_from("<HI", entry, 26)
            content = bytearray()
            while 2 <= cluster < 0xFFF0:
                at = data + (cluster - 2) * size
                content += self.bytes[at:at + size]
                cluster = chain[cluster]
            found[f"{entry[:8].decode().strip()}.{entry[8:11].decode().strip()}"] = bytes(content[:length])
        return found


class Card:
    """Answers as a card of high capacity does; busy for a while after each block written."""

    BUSY_NS = 800e3

    def __init__(self):
        self.volume = Volume()
        self.selected, self.idle, self.application = False, True, False
        self.clocks, self.polls, self.block, self.busy_until = 0, 0, None, 0.0
        self.command, self.answer, self.data = bytearray(), deque(), None
        self.fastest_unidentified_hz = 0.0
        self.pulled = False
        self.under_way = 0.0, None  # since when a block is written, and what a cut does to it

    def cut(self, chance, at):
        """The supply was lost at a time: of a block that was written then any part is there."""
        begun, interrupted = self.under_way
        if begun <= at < self.busy_until:
            interrupted(chance)

    def lose_supply(self):
        """What it holds stays."""
        volume = self.volume
        self.__init__()
        self.volume = volume

    def pull(self):
        """Out of its socket."""
        self.lose_supply()
        self.pulled = True

    def put_back(self):
        self.pulled = False

    def select(self, on):
        self.selected = on

    def exchange(self, machine, byte, hz):
        if self.pulled:
            return 0xFF
        if self.idle:
            self.fastest_unidentified_hz = max(self.fastest_unidentified_hz, hz)
            if hz > 400e3:
                machine.complain(f"SD: {hz / 1e3:.0f} kHz before it is identified")
        if not self.selected:
            self.clocks += 8
            return 0xFF
        if self.block is not None:
            return self.receive(machine, byte)
        reply = self.answer.popleft() if self.answer else 0x00 if machine.now < self.busy_until else 0xFF
        if self.command or byte & 0xC0 == 0x40:
            self.command.append(byte)
            if len(self.command) == 6:
                self.answer.clear()
                self.execute(machine, self.command[0] & 0x3F, int.from_bytes(self.command[1:5], "big"))
                self.command.clear()
        return reply

    def receive(self, machine, byte):
        """A block that is written."""
        if self.answer:
            return self.answer.popleft()
        if self.data is None:
            if byte == 0xFE:
                self.data = bytearray()
            return 0xFF
        self.data.append(byte)
        if len(self.data) == 514:
            good = crc16(self.data[:512]) == int.from_bytes(self.data[512:], "big")
            if good:
                self.put(machine, self.volume.block(self.block), self.data[:512])
            else:
                machine.complain("SD: wrong CRC of a block")
            self.answer.append(0xE5 if good else 0xEB)
            self.block, self.data, self.busy_until = None, None, machine.now + self.BUSY_NS
        return 0xFF

    def put(self, machine, block, content):
        volume, before = self.volume, bytes(self.volume.bytes[block])

        def interrupted(chance):
            there = chance.randint(0, len(before))
            volume.bytes[block] = content[:there] + before[there:]

        volume.bytes[block] = content
        self.under_way = machine.now, interrupted
        machine.operation("block", self.BUSY_NS)

    def execute(self, machine, number, argument):
        r1 = int(self.idle)
        application, self.application = self.application, number == 55
        reply = bytes([r1])
        if number == 0:
            if self.clocks < 74:
                machine.complain(f"SD: {self.clocks} clocks before the first command, 74 are required")
            self.idle, reply = True, b"\x01"
        elif number == 8:
            reply += struct.pack(">I", 0x100 | argument & 0xFF)
        elif application and number == 41:
            self.polls += 1
            self.idle = self.polls <= 3
            reply = bytes([int(self.idle)])
        elif number == 58:
            reply += b"\xc0\xff\x80\x00"
        elif number == 9:
            csd = bytearray.fromhex("400e00325b590000" "007f800a40000100")
            csd[7:10] = (self.volume.SECTORS // 1024 - 1).to_bytes(3, "big")
            csd[15] = crc(csd[:15], 0x09, 7) << 1 | 1
            reply += b"\xff\xfe" + csd + crc16(csd).to_bytes(2, "big")
        elif number == 13:
            reply += b"\x00"
        elif number == 17:
            content = bytes(self.volume.bytes[self.volume.block(argument)])
            reply += b"\xff\xfe" + content + crc16(content).to_bytes(2, "big")
        elif number == 24:
            self.block, self.data = argument, None
        elif number not in (55, 59):
            reply = bytes([r1 | 4])
        self.answer.extend(b"\xff" + reply)
