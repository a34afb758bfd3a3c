"""What the image has to do whatever comes in at its lines; as `scenarios.py`."""

import itertools
import random
import re

from card import Card
from hostlink import MISSION_BEGIN, MISSION_ITEM, Host, messages, request, step, varint
from machine import Machine
from scenarios import WAIT_S, close, under_way
from vehicle import NOON_S, fix


def pulse_per_second(image, _):
    """A crystal 50 ppm fast: UTC follows the edges, on the board's own clock; two at once are counted, and not used."""
    machine = Machine(image, hse_ppm=50)
    for second in range(3, 9):
        def edge(second=second):
            machine.tim5.edge(3)
            machine.frontseat.feed(fix(second), at=machine.now + 0.2e9)
        machine.at(second * 1e9, edge)
    machine.run_for(7.5)
    host, timer, errors = Host(machine), machine.tim5, []

    def compare(seconds):
        for time_us, utc_us in host.telemetry(seconds):
            true_s = (timer.since + (time_us - timer.count) / timer.per_ns()) * 1e-9
            errors.append(utc_us * 1e-6 - NOON_S - true_s)

    compare(1)
    for _ in range(3):
        timer.edge(3)
        timer.edge(3)
        machine.run_for(0.01)
    compare(0.3)
    assert errors and max(map(abs, errors)) < 60e-6, f"UTC is off by up to {max(map(abs, errors)):.6f} s"
    machine.measured["UTC error with a crystal 50 ppm fast, µs"] = max(map(abs, errors)) * 1e6
    health = host.health()
    assert health.synchronised and (health.edges, health.lost_edges) == (6, 3), health
    return [machine]


def babbling_lines(image, _):
    """One device sends noise without a pause, another one bytes with framing errors."""
    machine = Machine(image)
    machine.run_for(WAIT_S)
    noise = random.Random(1)
    machine.dvl.feed(noise.randbytes(2 * 11520))
    machine.ahrs.feed(noise.randbytes(2 * 11520), error=0x02)
    close(len(Host(machine).telemetry(2)), 20, 1)
    health = Host(machine).health()
    assert health.losses[2] > 0, "framing errors are counted"
    assert not machine.resets
    return [machine]


def host_flood(image, options):
    """On its own clock, with a card, while the counter of board time wraps: a host that sends noise, half missions and steps
    of another clock without a pause. Commands stay a tenth of a second apart, and the log has every step."""
    machine, _, host = under_way(image, card=Card(), up_us=2**32 - 12_000_000)
    began, chance = machine.now, random.Random(options.seed)
    floods = (lambda: chance.randbytes(1152),
              lambda: request(MISSION_BEGIN, varint(8)) + request(MISSION_ITEM, varint(0) + chance.randbytes(32)),
              lambda: b"".join(step(chance.randrange(2**33)) for _ in range(40)))
    for _ in range(60):
        machine.host.feed(chance.choice(floods)())
        machine.run_for(0.1)
    sent = [(time, byte) for time, byte in machine.frontseat.sent if time >= began]
    commands = [sent[found.start()][0] * 1e-6 for found in re.finditer(rb"\$OMP", bytes(byte for _, byte in sent))]
    apart = [after - before for before, after in itertools.pairwise(commands)]
    machine.measured["commands apart under a flood, ms"] = f"{min(apart):.1f} to {max(apart):.1f}"
    # 5 ms: the app's tick of 1 ms, and what of a request is before it on the line, 0.5 ms a byte
    assert len(apart) > 55 and 95 < min(apart) and max(apart) < 105, apart
    machine.host.incoming.clear()
    assert host.mode() == ("navigating", "nominal") and not machine.resets, (host.mode(), machine.resets)
    steps = [message.integer() for kind, message in messages(machine.card.volume.files()["LOG00000.BSL"]) if kind == 5]
    assert steps[0] < 2**32 < steps[-1], "board time does not wrap"
    assert all(abs(after - before - 100_000) < 5_000 for before, after in itertools.pairwise(steps)), steps
    return [machine]


ALL = [pulse_per_second, babbling_lines, host_flood]
