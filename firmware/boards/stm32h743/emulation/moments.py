"""A machine at many moments: at each a copy of this process tries something; the machine itself does not know of it."""

import os
import pickle
import random
import traceback

is_copy = False


def at(machine, moment, action):
    """Not in a copy: those that are to come are the machine's own."""
    machine.at(moment, lambda: is_copy or action())


def in_a_copy(trial, *arguments):
    """What a trial gives in a copy of this process, which ends with it, or what is wrong; the machine here stays as it is."""
    global is_copy
    reading, writing = os.pipe()
    if os.fork() == 0:
        is_copy = True
        try:
            result = trial(*arguments), None
        except AssertionError as error:
            result = None, str(error) or traceback.format_exc()
        except BaseException:
            result = None, traceback.format_exc()
        with open(writing, "wb") as file:
            pickle.dump(result, file)
        os._exit(0)
    os.close(writing)
    with open(reading, "rb") as file:
        result = pickle.load(file)
    os.wait()
    return result


def scattered(machine, procedure, count, seed, trial):
    """Runs a procedure; at `count` moments of it a copy tries `trial(chance, moment)`. Gives (kind of moment, result, wrong).

    A moment is any time, or one while flash or card write, every kind of writing as often as the others: some last 0.1 ms.
    """
    def rehearsed():
        operations, began = [], machine.now
        machine.operation = lambda kind, _: operations.append(kind)
        procedure()
        return operations, machine.now - began

    rehearsal, wrong = in_a_copy(rehearsed)
    assert not wrong, wrong
    operations, span_ns = rehearsal
    chance = random.Random(seed)
    kinds, planned, results, begun = ["any time", *sorted(set(operations))], {}, [], 0

    def plan(kind, moment):
        def here():
            machine.operation = lambda *_: None
            return trial(random.Random(f"{seed} {len(results)}"), moment)
        at(machine, moment, lambda: results.append((kind, *in_a_copy(here))))

    for number in range(count):
        kind = kinds[number % len(kinds)]
        if kind == "any time":
            plan(kind, machine.now + chance.random() * span_ns)
        else:
            number = chance.choice([k for k, other in enumerate(operations) if other == kind])
            planned.setdefault(number, []).append(chance.random())

    def operation(kind, span_ns):
        nonlocal begun
        for share in planned.pop(begun, ()):
            plan(kind, machine.now + share * span_ns)
        begun += 1

    machine.operation = operation
    procedure()
    machine.operation = lambda *_: None
    return results


def counted(results):
    """How many went wrong, with the exact interval of Clopper and Pearson where none did; raises where one did."""
    wrong = [f"{kind}: {what}" for kind, _, what in results if what]
    assert not wrong, f"{len(wrong)} of {len(results)} are wrong: {wrong[0]}"
    return f"0 of {len(results)} wrong (95 %: 0 to {100 * (1 - 0.025 ** (1 / len(results))):.2g} %)"
