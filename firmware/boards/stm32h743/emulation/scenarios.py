"""What the image has to do, one function a scenario; each gets the path of the image and gives the machines it ran."""

import json
import math
import os
import pathlib
import pty
import subprocess
import tempfile
import tty
import zlib

from card import Card
from hostlink import (DONE, HEALTH_GET, MISSION_START, ON_TRIAL, PARAMETER_STORE, REFUSED, STEP_DONE, TELEMETRY,
                      UPDATE_COMMIT, UPDATE_CONFIRM, Host, messages, request, step)
from core import ENDLESS
from machine import AXI, DTCM, DTCM_SIZE, FLASH, Machine
from storage import IMAGE, WORD
from unicorn import arm_const as arm
from vehicle import Vehicle

NEUTRAL = b"$OMP,8080808080,00"
START_S = 0.2  # until the image answers a host
APP = 16 + 94  # the exception that runs it, CEC's
WAIT_S = 2.2  # for a lock-step clock after power-on, and a little
EARLIER_CRASH_LOGGED = 9  # a kind of record of the board log
HASTE = 8  # of the lines in lock-step: the board, which waits for each byte, waits less; no bit of a flight depends on it


def close(value, expected, tolerance):
    assert abs(value - expected) <= tolerance, f"{value}, not {expected}"


def clock_tree(image, _):
    machine = Machine(image)
    machine.run_for(0.1)
    for name, hz in {"core": 480e6, "ahb": 240e6, "apb1": 120e6, "apb2": 120e6, "timers": 240e6}.items():
        close(machine.tree[name], hz, 1)
    close(machine.tim5.per_ns() * 1e9, 1e6, 1)
    watchdog = machine.watchdog
    assert watchdog.started < 5e6, "the watchdog starts before the clocks are touched"
    assert watchdog.first_feed - watchdog.started < 0.5 * watchdog.period(), "the first feed is late"
    close(watchdog.period(), 0.601e9, 1e6)
    filter_at, filter_bytes = machine.symbol("6memory6FILTER")
    (end, start), (thread_end, _) = machine.stacks.values()
    assert start <= filter_at and filter_at + filter_bytes <= DTCM + DTCM_SIZE, f"the filter is at {filter_at:#x}"
    assert (end, thread_end) == (DTCM, AXI), "below a stack is memory: what overflows would overwrite it"
    machine.measured["filter in DTCM, bytes"] = filter_bytes
    machine.run_for(START_S)
    content = bytes(machine.banks.physical[0].bytes[:machine.image_bytes])
    build = int.from_bytes(content[content.index(NOTE) + len(NOTE):][:4], "big")
    assert Host(machine).image() == [build, zlib.crc32(content)], "the image does not know itself"
    return [machine]


def external_clock(image, _):
    """Never, 60 ms and 1.5 s after power-on: the image runs, says from what, and changes over."""
    machines = []
    for hse_from_s, for_s, expected in ((math.inf, WAIT_S, "internal"), (0.06, 0.2, "crystal"), (1.5, 1.6, "crystal")):
        machine = Machine(image, hse_from=hse_from_s * 1e9)
        machine.run_for(for_s)
        close(machine.tree["core"], 480e6, 1)
        assert Host(machine).health().oscillator == expected, f"HSE from {hse_from_s} s"
        machines.append(machine)
    return machines


def told(machine, since_ns):
    """What the frontseat has got since then."""
    return bytes(byte for time, byte in machine.frontseat.sent if time >= since_ns)


def neutral_after(machine, since_ns):
    """How late the frontseat has got neutral fins, s."""
    line = told(machine, since_ns)
    assert NEUTRAL in line, f"no neutral fins: {line}"
    times = [time for time, _ in machine.frontseat.sent if time >= since_ns]
    return (times[line.index(NEUTRAL) + len(NEUTRAL)] - since_ns) * 1e-9


def hard_fault(image, _):
    """The board starts again at once, sends neutral fins and tells where it was, and in what; a programmer's reset is no fault."""
    machine = Machine(image)
    Vehicle(machine)  # hears the stop
    host = Host(machine)
    for task, exception in (("thread mode", 0), ("app", APP)):
        host.poll()
        machine.run_for(WAIT_S)
        while machine.exception() != exception:
            machine.run_for(2e-6)
        faulted, at, used = machine.now, machine.pc, [machine.stack_marked(stack) for stack in machine.stacks]
        steps = [kind for kind, _ in host.poll()].count(TELEMETRY)
        resets = len(machine.resets)
        machine.hard_fault("injected")
        machine.run_for(1)
        machine.measured[f"neutral fins after a fault in {task}, s"] = took = neutral_after(machine, faulted)
        assert took < 0.3, f"{took} s"
        assert [cause for _, cause in machine.resets[resets:]] == ["software"], machine.resets
        resets, crash = host.last_crash()
        assert (resets, crash.pc, crash.task, crash.exception) == (1, at, task, exception), f"{crash}, not {task} at {at:#x}"
        # the telemetry of the last one may be on the line
        assert 0 <= crash.step - steps <= 1, f"step {crash.step}, {steps} were told"
        # the fault's own frame may be the deepest
        assert all(0 <= told - seen < 128 for told, seen in zip(crash.stacks, used)), f"stacks {crash.stacks}, seen {used}"
        for _ in range(3):
            machine.reset("software")
            machine.run_for(START_S)
            assert host.last_start() == (0, None), "a programmer's reset counts as a fault"
    return [machine]


def under_way(image, **options):
    """A machine whose mission has begun, with its vehicle and host."""
    machine = Machine(image, **options)
    return machine, *begin_mission(machine)


def begin_mission(machine, after_s=9):
    """Of a machine that has just started: its vehicle and host."""
    vehicle, host = Vehicle(machine), Host(machine)
    machine.run_for(after_s)
    host.mission()
    machine.run_for(1)
    line = told(machine, machine.now - 1e9)
    assert line.count(b"$OMP") > 3, f"the mission does not begin: {line}"
    return vehicle, host


def clock_lost(image, _):
    """The clock on HSE ends under way: the mission goes on from the internal oscillator, and the host is told."""
    machine, _, host = under_way(image)
    machine.rcc.lose_external()
    lost = machine.now
    machine.run_for(1)
    close(machine.tree["core"], 480e6, 1)
    close(told(machine, lost).count(b"$OMP"), 10, 1)
    assert host.health().oscillator == "internal"
    assert not machine.resets, machine.resets
    return [machine]


def supply_falls(image, _):
    """The detector's interrupt closes the log before the supply is gone; a dip is counted, and no flash written in it."""
    machine = Machine(image, card=Card())
    machine.run_for(4.73)
    machine.pwr.supply(is_low=True)
    machine.run_for(0.03)
    steps = [message.integer() for kind, message in messages(machine.card.volume.files()["LOG00000.BSL"]) if kind == 5]
    machine.measured["of the log missing when the supply fell, s"] = missing = 4.73 - steps[-1] * 1e-6
    assert missing < 0.15, f"{missing} s"
    host = Host(machine)
    answer, _, _ = host.ask(PARAMETER_STORE)
    assert answer == REFUSED, "flash is written while the supply is low"
    machine.pwr.supply(is_low=False)
    assert host.health().supply_dips == 1
    answer, _, _ = host.ask(PARAMETER_STORE)
    assert answer == DONE and not machine.resets
    return [machine]


def stuck_step(image, _):
    """A navigation step that does not end is reset within the watchdog's time, whatever clock runs and the host sends."""
    machines = []
    for lock_step in (False, True):
        machine = Machine(image)
        if lock_step:
            machine.run_for(START_S)
            host = Host(machine)
            for time_us in (0, 100_000):
                machine.host.feed(step(time_us))
                machine.run_for(0.05)
            assert [kind for kind, _ in host.poll()].count(STEP_DONE) == 2, "it is under the host's clock"
        else:
            machine.run_for(WAIT_S)
        machine.stick("3App4step")
        for time_us in range(200_000, 1_000_000, 100_000):
            machine.host.feed(step(time_us) + request(HEALTH_GET))
            machine.run_for(0.1)
        assert [cause for _, cause in machine.resets] == ["watchdog"], machine.resets
        machine.measured["reset after a step got stuck, s"] = took = (machine.resets[0][0] - machine.stuck[0]) * 1e-9
        assert took < 0.63, f"reset after {took} s"
        machines.append(machine)
    return machines


def stack_overflow(image, _):
    """Either stack, when it is full, faults before anything is overwritten, and leaves a record; neutral fins soon after."""
    machines = []
    for stack, path, task in (("interrupts", "3App4step", "app"), ("thread", "4card4Card4look", "thread mode")):
        machine = Machine(image)
        Vehicle(machine)
        if stack == "interrupts":
            machine.run_for(WAIT_S)
        machine.overflow(path, stack)
        machine.run_for(1)
        assert machine.faults and [cause for _, cause in machine.resets] == ["software"], (machine.faults, machine.resets)
        machine.measured[f"neutral fins after an overflow in {task}, s"] = took = neutral_after(machine, machine.faults[0][0])
        assert took < 0.3, f"{took} s"
        resets, crash = Host(machine).last_crash()
        assert (resets, crash.stack_overflow, crash.task) == (1, 1, task), crash
        end, start = machine.stacks[stack]
        assert crash.sp < end and crash.stacks[list(machine.stacks).index(stack)] > start - end - 128, crash
        machine.paint(stack)
        machines.append(machine)
    return machines


def crashes_in_a_row(image, _):
    """Crashes that no card takes are kept and told, and are written as soon as one does; of too many the oldest make room."""
    machine = Machine(image, card=Card())
    Vehicle(machine)
    machine.run_for(4)
    host, places = Host(machine), []

    def crash(count):
        for _ in range(count):
            places.append(machine.pc)
            machine.hard_fault("injected")
            machine.run_for(0.15)

    machine.card.pull()
    crash(3)
    machine.card.put_back()
    machine.run_for(3)
    assert "CRASHES.TXT" not in machine.card.volume.files(), "the card is left alone"
    resets, last = host.last_crash()
    told = [crash.pc for crash in host.earlier_crashes()] + [last.pc]
    assert (resets, told) == (3, places), f"{resets} {told}, not {places}"
    machine.reset("pin")
    machine.run_for(4)
    files = machine.card.volume.files()
    lines = files["CRASHES.TXT"].decode().splitlines()
    assert len(lines) == 3 and all(f"fault at {at:#010x}" in line for at, line in zip(places, lines)), lines
    logged = [kind for kind, _ in messages(files[max(name for name in files if name.endswith(".BSL"))])]
    assert logged.count(EARLIER_CRASH_LOGGED) == 3, logged
    machine.reset("pin")
    machine.run_for(START_S)
    assert host.last_crash() == (0, None) and not host.earlier_crashes(), "they are kept although the card has them"
    places.clear()
    machine.card.pull()
    crash(11)
    machine.run_for(3)
    told = [(crash.pc, crash.overwritten) for crash in host.earlier_crashes()]
    assert told == [(at, max(0, k - 7)) for k, at in enumerate(places)][3:10] and host.last_crash()[1].pc == places[10], told
    machine.measured["crashes told of 11"] = len(told) + 1
    return [machine]


LOAD, STORE = (ENDLESS + 0x10, b"\x01\x68"), (ENDLESS + 0x20, b"\x01\x60")  # where, ldr r1, [r0]; where, str r1, [r0]
LOOP = b"\xfe\xe7"
WILD = {
    "a read of address 0": (LOAD, 0x0),
    "a write behind a null pointer": (STORE, 0x40),
    "a write to the image": (STORE, FLASH + 0x1000),
    "a write below the stack of interrupts": (STORE, DTCM - 4),
    "a write below the stack of thread mode": (STORE, AXI - 4),
    "a read of what no memory is": (LOAD, 0x60000000),
    "an instruction in DTCM": (None, DTCM + 0x8000),
    "an instruction in AXI SRAM": (None, AXI + 0x8000),
}


def guard(image, _):
    """What the memory protection refuses resets the board at once, and the host is told the address."""
    machine = Machine(image)
    Vehicle(machine)
    for what, (instruction, address) in WILD.items():
        machine.lose_supply(remembers=False)
        machine.run_for(START_S)
        faults = len(machine.faults)
        at, code = instruction or (address, b"")
        machine.uc.mem_write(at, code + LOOP)
        machine.uc.reg_write(arm.UC_ARM_REG_R0, address)
        machine.pc = at
        machine.run_for(1)  # the stop is acknowledged
        assert len(machine.faults) == faults + 1 and machine.resets[-1][1] == "software", f"{what}: {machine.faults[faults:]}"
        resets, crash = Host(machine).last_crash()
        told = crash.pc if instruction is None else crash.address
        assert (resets, crash.pc, told) == (1, at, address), f"{what}: {crash}"
    machine.measured["accesses refused"] = len(WILD)
    return [machine]


def parameter_store(image, _):
    """Outlasts a reset; a store that the power cut interrupts leaves the set before."""
    machine = Machine(image)
    machine.run_for(START_S)
    host = Host(machine)
    before = host.parameter("vehicle.mass_kg")
    host.set("vehicle.mass_kg", before + 0.5)
    answer, _, machine.measured["params store, s"] = host.ask(PARAMETER_STORE, within_s=10)
    assert answer == DONE and machine.store.programmed
    machine.reset("pin")
    machine.run_for(START_S)
    close(host.parameter("vehicle.mass_kg"), before + 0.5, 0)
    host.set("vehicle.mass_kg", before + 1)
    written = set(machine.store.programmed)
    machine.host.feed(request(PARAMETER_STORE))
    while len(machine.store.programmed - written) < 20:
        machine.run_for(0.001)
    machine.store.torn.add(max(machine.store.programmed - written))
    machine.reset("power")
    machine.run_for(START_S)
    close(host.parameter("vehicle.mass_kg"), before + 0.5, 0)
    assert not machine.faults, machine.faults
    return [machine]


NOTE = b"\x04\0\0\0\x14\0\0\0\x03\0\0\0GNU\0"
UNDEFINED = b"\x00\xde"  # an instruction


def another(machine, build, broken=None):
    """The image of this machine with another build ID; the function named cannot be executed."""
    content = bytearray(machine.banks.physical[0].bytes[:IMAGE].rstrip(b"\xff"))
    at = content.index(NOTE) + len(NOTE)
    content[at:at + 4] = build.to_bytes(4, "big")
    if broken:
        at = (machine.symbol(broken)[0] & ~1) - FLASH
        content[at:at + 2] = UNDEFINED
    return bytes(content)


def update(image, _):
    """A new image is started on trial and confirmed; one that crashes comes back, in the other direction; parameters stay."""
    machine = Machine(image)
    machine.host.haste, machine.flash.write_ns, machine.flash.erase_ns = HASTE, 2e3, 20e6
    machine.run_for(START_S)
    host = Host(machine)
    mass = host.parameter("vehicle.mass_kg") + 0.5
    host.set("vehicle.mass_kg", mass)
    assert host.ask(PARAMETER_STORE)[0] == DONE
    assert host.images() == (None, None)
    host.send_image(another(machine, 2), 2)
    assert host.ask(UPDATE_COMMIT)[0] == DONE
    machine.run_for(1)
    assert machine.banks.swapped and host.build() == 2, "the new image runs"
    assert host.images() == (1, None), "it is on trial, and the one before was no update's"
    answer, refusal, _ = host.ask(MISSION_START)
    assert (answer, refusal.integer()) == (REFUSED, ON_TRIAL)
    machine.banks.seen(0).torn.add(IMAGE // WORD + 1)  # the supply was lost while its start was marked
    machine.lose_supply(remembers=False)
    machine.run_for(START_S)
    assert host.images() == (2, None)
    close(host.parameter("vehicle.mass_kg"), mass, 0)
    assert host.ask(UPDATE_CONFIRM)[0] == DONE
    for _ in range(4):
        machine.reset("pin")
        machine.run_for(START_S)
    assert (host.build(), host.images()) == (2, (None, None))
    host.send_image(another(machine, 3, broken="3App4step"), 3)
    assert host.ask(UPDATE_COMMIT)[0] == DONE
    asked, faults = machine.now, len(machine.faults)
    while not machine.banks.swapped or machine.now < asked + 0.5e9:
        machine.run_for(0.1)
        assert machine.now < asked + 20e9, "the board does not return"
    machine.measured["back from an image that crashes, s"] = (machine.now - asked) * 1e-9
    assert len(machine.faults) == faults + 3, machine.faults[faults:]
    machine.run_for(START_S)
    assert (host.build(), host.images()) == (2, (None, (3, 3, False)))
    close(host.parameter("vehicle.mass_kg"), mass, 0)
    return [machine]


def run_at(usarts, machine, command, accepted=(0,)):
    """What a program prints that this computer runs at pseudo-terminals of these ports, and ends with a code that is accepted;
    `command` of their paths."""
    ports = []
    for usart in usarts:
        ours, theirs = pty.openpty()
        tty.setraw(ours)
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        ports.append((usart, ours, os.ttyname(theirs), waiting := bytearray()))
        usart.on_byte, usart.haste = waiting.append, HASTE
    arguments = command([path for _, _, path, _ in ports])
    # its board is as slow as this computer is busy: what counts is what the board comes to
    environment = {**os.environ, "BACKSEAT_SLOWNESS": "100"}
    with subprocess.Popen(arguments, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        while program.poll() is None:
            machine.run_for(0.002)
            for usart, descriptor, _, waiting in ports:
                try:
                    usart.feed(os.read(descriptor, 4096))
                except BlockingIOError:
                    pass
                if waiting:
                    del waiting[:os.write(descriptor, waiting)]
        output, errors = program.communicate()
    assert program.returncode in accepted, errors
    return output


def checked(machine, options):
    """Verdict and finding of each line of `backseat check`. The rest of what it looks at has no device here, so that it fails."""
    command = lambda paths: [options.simulator[0], "check", *paths, "--json"]
    said = json.loads(run_at([machine.host], machine, command, accepted=(1,)))
    machine.host.haste, machine.host.on_byte = 1, None
    return {line["check"]: (line["verdict"], line["found"]) for line in said["checks"]}


def update_command(image, options):
    """`backseat update` as its user starts it: the new image runs and is confirmed."""
    machine = Machine(image)
    machine.flash.write_ns, machine.flash.erase_ns = 2e3, 20e6
    machine.run_for(START_S)
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "new.elf")
        content = bytearray(image.read_bytes())
        at = content.index(NOTE) + len(NOTE)
        content[at:at + 4] = (2).to_bytes(4, "big")
        file.write_bytes(content)
        said = json.loads(run_at([machine.host], machine, lambda paths: [options.simulator[0], "update", *paths, file, "--json"]))
    assert (said["build"], said["trial_start"]) == ("00000002", None), said
    machine.reset("pin")
    machine.run_for(START_S)
    assert machine.banks.swapped and Host(machine).images() == (None, None)
    return [machine]


def lock_step(image, options):
    """The simulator flies it at its own clock: the digest of state and covariance is that of the app on this computer."""
    machine = Machine(image)
    flight = [*options.simulator, "--minutes", str(options.minutes), "--seed", str(options.seed), "--json"]
    wanted = subprocess.run([*flight, "--backseat", "host"], capture_output=True, check=True, text=True).stdout
    machine.run_for(START_S)  # what comes earlier is lost
    output = run_at(machine.usarts, machine, lambda paths: [*flight, "--backseat", ",".join(paths)])
    digests = [json.loads(text)["digest"] for text in (wanted, output)]
    assert digests[0] == digests[1], f"digest of the app here {digests[0]}, of the image {digests[1]}"
    machine.measured[f"digest of {options.minutes} minutes with seed {options.seed}"] = digests[1]
    return [machine]


ALL = [lock_step, clock_tree, external_clock, hard_fault, clock_lost, supply_falls, stuck_step, stack_overflow, crashes_in_a_row, guard, parameter_store, update, update_command]
