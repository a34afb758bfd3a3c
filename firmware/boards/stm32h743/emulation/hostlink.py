"""The host link as a PC speaks it (`firmware/wire/src/hostlink`): 0, COBS of (postcard, CRC-32), 0."""

import struct
import zlib
from types import SimpleNamespace

HELLO, STEP, PARAMETER_BEGIN, PARAMETER_SET, PARAMETER_COMMIT, PARAMETER_GET = 0, 1, 2, 3, 4, 5
MISSION_BEGIN, MISSION_ITEM, MISSION_COMMIT, MISSION_START, MISSION_STOP, PARAMETER_STORE, HEALTH_GET = 6, 7, 8, 10, 11, 12, 13
UPDATE_GET, UPDATE_BEGIN, UPDATE_WRITE, UPDATE_COMMIT, UPDATE_CONFIRM, DROP_WEIGHT = 22, 23, 24, 25, 26, 27
UPDATE_CHUNK = 256
HELLO_ANSWER, STEP_DONE, TELEMETRY, PARAMETER, DONE, REFUSED, RESTART, HEALTH, IMAGES, EARLIER_CRASH = 0, 1, 2, 4, 6, 7, 8, 9, 19, 20
UNSAFE, ON_TRIAL = 12, 16
TASKS = ("thread mode", "app", "interrupt")
OSCILLATORS = ("crystal", "internal")
MODES = ("initialising", "navigating", "degraded", "lost", "safe")
REASONS = {0: "nominal", 1: "no fix", 2: "attitude stale", 9: "stopped", 10: "restarted", 11: "resets", 29: "overloaded", 30: "fitting failed", 31: "supply low"}
NOT_FITTED, READY, ACTIVE, WRONG = 0, 2, 3, 4  # of last-resort hardware
LOG_STATES = ("not fitted", "searching", "writing", "failed", "full")


def varint(value):
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out + bytes([value]))


def frame(message):
    plain, out = message + struct.pack("<I", zlib.crc32(message)), bytearray()
    for block in plain.split(b"\0"):
        while len(block) >= 254:
            out += bytes([255]) + block[:254]
            block = block[254:]
        out += bytes([len(block) + 1]) + block
    return b"\0" + bytes(out) + b"\0"


def request(kind, body=b""):
    return frame(varint(kind) + body)


def step(time_us):
    """The lock-step clock: a step without edges and bytes."""
    return request(STEP, varint(time_us) + varint(0) + varint(0) + bytes(4))


def text(value):
    return varint(len(value)) + value.encode()


class Message:
    """Fields of a message, read one after the other."""

    def __init__(self, body):
        self.body, self.at = body, 0

    def integer(self):
        value = shift = 0
        while True:
            byte = self.body[self.at]
            self.at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def integers(self, count):
        return [self.integer() for _ in range(count)]

    def text(self):
        length = self.integer()
        self.at += length
        return self.body[self.at - length:self.at].decode()

    def single(self):
        self.at += 4
        return struct.unpack_from("<f", self.body, self.at - 4)[0]

    def real(self):
        self.at += 8
        return struct.unpack_from("<d", self.body, self.at - 8)[0]


def unstuffed(block):
    """COBS undone; nothing when it is cut."""
    out, at = bytearray(), 0
    while at < len(block):
        code = block[at]
        if at + code > len(block):
            return b""
        out += block[at + 1:at + code]
        at += code
        if code < 255 and at < len(block):
            out.append(0)
    return bytes(out)


def messages(data):
    """(kind, message) of every good frame."""
    for block in bytes(data).split(b"\0"):
        plain = unstuffed(block)
        if len(plain) > 4 and zlib.crc32(plain[:-4]) == int.from_bytes(plain[-4:], "little"):
            message = Message(plain[:-4])
            yield message.integer(), message


def crash_of(message):
    """A crash within a message."""
    names = "build time_us pc lr sp cfsr hfsr address exception line".split()
    crash = SimpleNamespace(**dict(zip(names, message.integers(len(names)))))
    message.at += 24  # the file of a panic
    crash.stack_overflow, task, crash.step, *crash.stacks = message.integers(5)
    crash.task = TASKS[task]
    return crash


class Host:
    """A PC at the host port of a machine."""

    def __init__(self, machine):
        self.machine, self.read = machine, 0
        self.inbox = []

    def poll(self):
        """Messages since the last look."""
        sent = self.machine.host.sent
        data = bytes(byte for _, byte in sent[self.read:])
        end = data.rfind(b"\0") + 1
        self.read += end
        return list(messages(data[:end]))

    def ask(self, kind, body=b"", answers=(DONE, REFUSED), within_s=5.0, look_s=0.02):
        """The answer to a request, and after how long it came, s."""
        self.poll()
        self.machine.host.feed(request(kind, body))
        asked = self.machine.now
        while self.machine.now < asked + within_s * 1e9:
            self.machine.run_for(look_s)
            for answer, message in self.poll():
                if answer in answers:
                    return answer, message, (self.machine.now - asked) * 1e-9
        raise AssertionError(f"request {kind} was not answered within {within_s} s")

    def health(self):
        _, message, _ = self.ask(HEALTH_GET, answers=(HEALTH,))
        accepted, rejected = message.integers(4), message.integers(4)
        edges, synchronised, losses = message.integer(), bool(message.integer()), message.integers(5)
        health = SimpleNamespace(accepted=accepted, rejected=rejected, edges=edges, synchronised=synchronised, losses=losses,
                                 oscillator=OSCILLATORS[message.integer()], log=LOG_STATES[message.integer()],
                                 lost_records=message.integer(), late=message.integers(2))
        assert message.integer(), "the board says nothing of its hardware"
        health.supply_dips, health.brown_out_level, *health.wrong_bits = message.integers(4)
        health.longest_step_us, health.load_permille, health.lost_edges, *health.stacks = message.integers(7)
        _refused, *health.fittings = message.integers(5)
        health.supply_v = message.single()
        return health

    def telemetry(self, seconds):
        """Board time and UTC, µs, of each record."""
        self.poll()
        self.machine.run_for(seconds)
        return [message.integers(2) for kind, message in self.poll() if kind == TELEMETRY]

    def mode(self, within_s=2.0):
        """The last step's mode and reason."""
        self.poll()
        self.machine.run_for(within_s)
        records = [message for kind, message in self.poll() if kind == TELEMETRY]
        assert records, f"no telemetry within {within_s} s"
        _time_us, _utc_us, mode, reason = records[-1].integers(4)
        return MODES[mode], REASONS.get(reason, reason)

    def parameter(self, name):
        """Its value; the list is asked from the beginning."""
        index, count = 0, 1
        while index < count:
            _, message, _ = self.ask(PARAMETER_GET, varint(index), answers=(PARAMETER, REFUSED))
            index, count = message.integer() + 1, message.integer()
            found, _, value = message.text(), message.text(), message.real()
            if found == name:
                return value
        raise AssertionError(f"the board has no {name}")

    def set(self, name, value):
        for kind, body in ((PARAMETER_BEGIN, b""), (PARAMETER_SET, text(name) + struct.pack("<d", value)), (PARAMETER_COMMIT, b"")):
            answer, _, _ = self.ask(kind, body)
            assert answer == DONE, f"{name} was refused"

    def mission(self, depth_m=3.0, starts=True):
        """Loads one leg to the north, and starts it."""
        leg = varint(0) + struct.pack("<4d", 100.0, 0.0, depth_m, 1.0)
        for kind, body in ((MISSION_BEGIN, varint(1)), (MISSION_ITEM, leg), (MISSION_COMMIT, b"")):
            answer, refusal, _ = self.ask(kind, body)
            assert answer == DONE, f"request {kind} was refused: {refusal.integer()}"
        if starts:
            assert (why := self.no_start()) is None, f"the mission does not begin: {why}"

    def no_start(self):
        """Why the mission that is stored does not begin; nothing where it does."""
        answer, refusal, _ = self.ask(MISSION_START)
        if answer == REFUSED:
            why, reason = refusal.integers(2)
            assert why == UNSAFE, f"refused for {why}"
            return REASONS.get(reason, reason)
        return None

    def image(self):
        """Build ID and CRC-32 of the image that runs, as `Hello` tells them."""
        _, message, _ = self.ask(HELLO, answers=(HELLO_ANSWER,))
        message.text()
        return message.integers(3)[1:]

    def build(self):
        return self.image()[0]

    def images(self):
        """Start number of the image that runs, if it is on trial; of the other bank's image build, starts, confirmed."""
        _, message, _ = self.ask(UPDATE_GET, answers=(IMAGES,))
        trial = message.integers(2)[1] if message.body[message.at] else message.integer() or None
        if not message.integer():
            return trial, None
        _length, _crc, build, starts, confirmed = message.integers(5)
        return trial, (build, starts, bool(confirmed))

    def send_image(self, content, build):
        """Writes an image, as far as the answer to the last request."""
        begin = varint(len(content)) + varint(zlib.crc32(content)) + varint(build)
        assert self.ask(UPDATE_BEGIN, begin)[0] == DONE, "the image is refused"
        for at in range(0, len(content), UPDATE_CHUNK):
            part = content[at:at + UPDATE_CHUNK]
            answer, refusal, _ = self.ask(UPDATE_WRITE, varint(at) + varint(len(part)) + part, look_s=0.002)
            assert answer == DONE, f"byte {at} on is refused: {refusal.integer()}"

    def last_start(self):
        """As the answer to `Hello` tells it: resets by a fault since power-on, address of a crash (none: nothing)."""
        resets, crash = self.last_crash()
        return resets, crash and crash.pc

    def last_crash(self):
        """As the answer to `Hello` tells it: resets by a fault since power-on, and the crash before."""
        _, message, _ = self.ask(HELLO, answers=(RESTART,))
        _cause, resets, _safe, crashed = message.integers(4)
        return resets, crash_of(message) if crashed else None

    def earlier_crashes(self):
        """As the answer to `Hello` tells them: those before, which no card has got; the last field of each says how many
        before it were not kept."""
        self.poll()
        self.machine.host.feed(request(HELLO))
        self.machine.run_for(0.5)
        crashes = []
        for kind, message in self.poll():
            if kind == RESTART:
                crashes.clear()  # of an answer before
            elif kind == EARLIER_CRASH:
                crashes.append(crash_of(message))
                crashes[-1].overwritten = message.integer()
        return crashes
