"""What the image has to do at many moments, chosen at random: power cuts, resets under way."""

import itertools
import random
import zlib
from collections import Counter

from card import Card
from hostlink import DONE, PARAMETER_STORE, UPDATE_COMMIT, UPDATE_CONFIRM, Host, messages, unstuffed
from machine import Machine
from moments import at, counted, in_a_copy, scattered
from scenarios import HASTE, NEUTRAL, START_S, another, close, neutral_after, told, under_way

MASS = "vehicle.mass_kg"
LOG_S = 4.0  # from power-on until the directory of the card knows of steps in a log
MOST_CYCLES = 100  # an instruction: a step of 1.3 million then takes 0.27 s, nearly three periods
LOG_LOST_S = 1.2  # of a log that a power cut may cost


def start_again(machine, chance, moment, start_s=START_S, off=lambda: None):
    """The supply is lost and comes back; every other time it is lost once more while the board starts. How often it was."""
    machine.cut(chance, moment, remembers=chance.random() < 0.5)
    off()
    again = chance.random() < 0.5
    if again:
        machine.run_for(chance.uniform(0, start_s))
        machine.cut(chance, machine.now, remembers=chance.random() < 0.5)
    machine.run_for(start_s)
    return 1 + again


def cuts_in_update(image, count, seed):
    """A whole image starts: the one before until the exchange is asked for, the new one after it; the parameters stay."""
    machine = Machine(image)
    machine.host.haste, machine.flash.erase_ns = HASTE, 20e6
    machine.run_for(START_S)
    host = Host(machine)
    mass = host.parameter(MASS) + 0.5
    host.set(MASS, mass)
    assert host.ask(PARAMETER_STORE)[0] == DONE
    first, new = host.build(), 2
    contents = {first: bytes(machine.banks.physical[0].bytes[:machine.image_bytes]), new: another(machine, new)}
    may_run, confirmed = {first}, False

    def procedure():
        nonlocal may_run, confirmed
        host.send_image(contents[new], new)
        may_run = {first, new}
        assert host.ask(UPDATE_COMMIT)[0] == DONE
        machine.run_for(2 * START_S)
        assert host.build() == new
        may_run = {new}
        assert host.ask(UPDATE_CONFIRM)[0] == DONE
        confirmed = True
        machine.run_for(START_S)

    def trial(chance, moment):
        lost = start_again(machine, chance, moment)
        build, crc = host.image()
        # a confirmation that was cut counts as a start, and two more use the trial up
        used_up = lost == 2 and not confirmed
        assert build in may_run or used_up and build == first, f"image {build} runs, of {may_run}"
        assert crc == zlib.crc32(contents[build]), "the image that runs is not whole"
        on_trial, _ = host.images()
        assert on_trial in ((None,) if confirmed or build == first else (None, 1, 2, 3)), f"on trial: {on_trial}"
        close(host.parameter(MASS), mass, 0)
        assert not machine.complaints and not machine.faults, (machine.complaints, machine.faults)
        return "image of before" if build == first else "new image"

    results = scattered(machine, procedure, count, seed, trial)
    machine.measured[f"{count} power cuts in an update"] = summary(results)
    return machine


def cuts_in_store(image, count, seed):
    """The set of before or the new one; once the store is acknowledged the new one."""
    machine = Machine(image)
    machine.host.haste = HASTE
    machine.run_for(START_S)
    host = Host(machine)
    first, results = host.parameter(MASS), []
    may_hold = [first]

    def procedure():
        nonlocal may_hold
        host.set(MASS, may_hold[-1] + 0.5)
        may_hold = [may_hold[-1], may_hold[-1] + 0.5]
        assert host.ask(PARAMETER_STORE)[0] == DONE
        may_hold = may_hold[1:]
        machine.run_for(0.1)

    def trial(chance, moment):
        start_again(machine, chance, moment)
        mass = host.parameter(MASS)
        assert mass in may_hold, f"{mass} kg, of {may_hold}"
        assert not machine.complaints and not machine.faults, (machine.complaints, machine.faults)
        return "set of before" if mass < may_hold[-1] else "new set"

    rounds = min(4, count)  # each place of a set is written twice
    for number in range(rounds):
        share = count * (number + 1) // rounds - count * number // rounds
        results += scattered(machine, procedure, share, f"{seed} {number}", trial)
    machine.measured[f"{count} power cuts in a store"] = summary(results)
    return machine


def whole(log):
    """Times of the steps in a log, s, of which only the last frame may be cut."""
    frames = [part for part in log.split(b"\0") if part]
    good = [len(plain) > 4 and zlib.crc32(plain[:-4]) == int.from_bytes(plain[-4:], "little") for plain in map(unstuffed, frames)]
    assert all(good[:-1]), f"frame {good.index(False)} of {len(good)} is bad"
    return [message.integer() * 1e-6 for kind, message in messages(log) if kind == 5]


def cuts_in_log(image, count, seed):
    """Every log on the card can be read to its end, little of it is missing, and the next start has a log of its own."""
    machine, _, _ = under_way(image, card=Card())

    def trial(chance, moment):
        began, left = machine.now, []
        lost = start_again(machine, chance, moment, LOG_S, lambda: left.append(machine.card.volume.files()["LOG00000.BSL"]))
        missing = began * 1e-9 - whole(left[0])[-1]
        assert missing < LOG_LOST_S, f"{missing} s of the log are missing"
        files = machine.card.volume.files()
        assert files.pop("LOG00000.BSL") == left[0], "the log of before has changed"
        # after two resets under way the card is left alone: it may be their cause
        assert lost == 2 or whole(files[max(files)]), f"no new log: {list(files)}"
        assert all(whole(log) is not None for log in files.values())
        assert not machine.complaints and not machine.faults, (machine.complaints, machine.faults)
        return missing

    results = scattered(machine, lambda: machine.run_for(5), count, seed, trial)
    worst = max((missing for _, missing, wrong in results if not wrong), default=0)
    machine.measured[f"{count} power cuts while the log is written"] = f"{counted(results)}, at most {worst:.2f} s of it missing"
    return machine


def summary(results):
    """How many went wrong, and what the others came to."""
    ends = Counter(end for _, end, wrong in results if not wrong)
    return ", ".join([counted(results), *(f"{end} {times}" for end, times in sorted(ends.items()))])


def power_cuts(image, options):
    """Half of them in updates, a quarter each while parameters are stored and the log is written."""
    quarter = options.trials // 4
    return [cuts_in_update(image, options.trials - 2 * quarter, options.seed), cuts_in_store(image, quarter, options.seed),
            cuts_in_log(image, quarter, options.seed)]


def wedge(machine):
    """A step does not end: the watchdog resets."""
    machine.stick("3App4step")
    resets = len(machine.resets)
    while len(machine.resets) == resets:
        machine.run_for(0.01)
    return machine.stuck[0]


RESETS = {
    "pin": lambda machine: machine.reset("pin"),
    "power, battery at VBAT": lambda machine: machine.lose_supply(remembers=True),
    "power, no battery": lambda machine: machine.lose_supply(remembers=False),
    "brown-out": lambda machine: machine.reset("brown-out"),
    "programmer": lambda machine: machine.reset("software"),
    "fault": lambda machine: machine.hard_fault("injected"),
    "watchdog": wedge,
}


def reset_under_way(image, options):
    """Whatever resets the board under way: neutral fins and stop, at once; of two resets as well; until the stop is heard."""
    machine, vehicle, _ = under_way(image)

    def trial(name):
        vehicle.deaf, slowest = True, 0
        for span, reset in ((0.1, RESETS[name]), (0.7, RESETS["pin" if name == "watchdog" else name])):  # it bounces
            since = machine.now
            since = reset(machine) or since
            machine.run_for(span)
            slowest = max(slowest, neutral_after(machine, since))
            assert slowest < 0.7 and b"$OMSTOP" in told(machine, since), f"{slowest} s, {told(machine, since)}"
        assert not machine.complaints, machine.complaints
        return slowest

    chance, results = random.Random(options.seed), {name: [] for name in RESETS}
    each = max(1, options.trials // 10)
    for name in [*RESETS] * each:
        at(machine, machine.now + chance.uniform(0, 2e9), lambda name=name: results[name].append((name, *in_a_copy(trial, name))))
    machine.run_for(2.01)
    for name, these in results.items():
        counted(these)
        machine.measured[f"neutral fins after {name}, at most of {each}, s"] = max(took for _, took, _ in these)
    vehicle.deaf = False
    machine.reset("pin")
    machine.run_for(3)
    for remembers in (True, False):
        since = machine.now
        machine.lose_supply(remembers)
        machine.run_for(1)
        assert b"$OMP" not in told(machine, since), f"the stop was heard, and a start is a new one: {told(machine, since)}"
    return [machine]


def overrun(image, options):
    """Each instruction takes so many cycles, from a moment under way on: the mission goes on, or ends with neutral fins, stop,
    a named reason and no more resets than three. While it resets three times the host hears nothing for five seconds."""
    machine, _, host = under_way(image)

    def trial(cycles):
        began, machine.cycles = machine.now, cycles
        machine.run_for(30)
        (mode, reason), line, resets = host.mode(within_s=6.0), told(machine, began), len(machine.resets)
        stopped = NEUTRAL in line and b"$OMSTOP" in line
        assert stopped == (reason in ("overloaded", "resets")), f"{mode}, {reason}, {line[-200:]}"
        assert resets <= 3 and not machine.complaints, (machine.resets, machine.complaints)
        return f"{mode}, {reason}, resets {resets}"

    count = min(options.trials, MOST_CYCLES)
    each = sorted({1 + round((MOST_CYCLES - 1) * number / max(1, count - 1)) for number in range(count)})
    results = [(f"{cycles} cycles an instruction", *in_a_copy(trial, cycles)) for cycles in each]
    verdict = counted(results).split(" (")[0]
    for end, these in itertools.groupby(zip(each, results), lambda pair: pair[1][1]):
        tried = [cycles for cycles, _ in these]
        machine.measured[f"{tried[0]} to {tried[-1]} cycles an instruction ({len(tried)} tried)"] = end
    machine.measured["overruns"] = verdict
    return [machine]


ALL = [power_cuts, reset_under_way, overrun]
