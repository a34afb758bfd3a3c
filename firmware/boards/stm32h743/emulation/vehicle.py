"""A vehicle at rest at the surface, at the ports of a machine: a frontseat that answers, an AHRS, a pulse per second.

It obeys no command, so that a mission that has begun stays under way.
"""

import random
import struct

NOON_S = 1_795_176_000  # 2026-11-20 12:00:00 UTC at the machine's time 0
ACKNOWLEDGED = {b"$OMP": 10, b"$OMS": 9, b"$OMSTOP": 1}


def sentence(body):
    total = 0
    for byte in body.encode():
        total ^= byte
    return f"${body}*{total:02X}\r\n".encode()


def fix(second):
    """The position of a second of the day, from noon on."""
    clock = f"12{second // 60:02d}{second % 60:02d}.00"
    return sentence(f"GPRMC,{clock},A,4130.0000,N,07042.0000,W,0.0,0.0,201126,,")


class Vehicle:
    """`deaf`: the frontseat answers requests, and acknowledges no command."""

    def __init__(self, machine):
        self.machine, self.deaf, self.noise = machine, False, random.Random(1)
        self.servo, self.line = "8080808080", bytearray()
        machine.frontseat.on_byte = self.hear
        machine.at(machine.now + 0.05e9, self.measure)
        machine.at((machine.now // 1e9 + 1) * 1e9, self.second)

    def measure(self):
        noise = [self.noise.gauss(0, 0.003) for _ in range(6)]
        body = struct.pack(">B6fI", 0xCF, *noise, int(self.machine.now / 16e3) & 0xFFFFFFFF)
        self.machine.ahrs.feed(body + struct.pack(">H", sum(body) & 0xFFFF))
        self.machine.at(self.machine.now + 0.1e9, self.measure)

    def second(self):
        machine, second = self.machine, round(self.machine.now * 1e-9)
        if machine.tim5.running:
            machine.tim5.edge(3)
        machine.frontseat.feed(fix(second), at=machine.now + 0.2e9)
        machine.at(machine.now + 1e9, self.second)

    def hear(self, byte):
        self.line.append(byte)
        if byte == 0x0A:
            fields = bytes(self.line).split(b"*")[0].split(b",")
            self.line.clear()
            self.answer(fields[0], fields[1:])

    def answer(self, name, fields):
        if name in ACKNOWLEDGED:
            if name == b"$OMP":
                self.servo = fields[0].decode()
            answers = [] if self.deaf else [f"ACK,{ACKNOWLEDGED[name]},0,0"]
        elif name == b"$OSD":
            said = {b"C": "C0.0P0.0R0.0T15.0D0.0", b"P": "OPI,87.5,512.3,61.2,25.9,2.36,502,D,0",
                    b"S": f"OSI,{self.servo},N,1,41.50000,-70.70000,0.0,100.0,N,,P0,0.0,TEST,00:10:00,0.0,0.0,,"}
            answers = [said[field] for field in fields if field in said]
        else:
            answers = []
        for answer in answers:
            self.machine.frontseat.feed(sentence(answer), at=self.machine.now + 20e6)
