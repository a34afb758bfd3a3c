"""Runs the image of the board on an emulated STM32H743, scenario by scenario; --help."""

import argparse
import multiprocessing
import pathlib
import resource
import shlex
import sys
import traceback

import fittings
import lines
import logs
import scenarios
import trials

SCENARIOS = {scenario.__name__: scenario for scenario in (*scenarios.ALL, *logs.ALL, *fittings.ALL, *lines.ALL, *trials.ALL)}
STACK_SHARE = 0.8  # of its room that a stack may ever take
REPORT = """# The image on an emulated STM32H743

Written by `firmware/boards/stm32h743/emulation/run --report docs/results/emulation.md`; do not edit. What each scenario
asks for is in `firmware/boards/stm32h743/emulation/README.md`. Time is the emulated board's:
one cycle an instruction, no wait states.

| scenario | time, s | stack of interrupts, bytes | stack of thread mode, bytes | longest time between two feeds, ms | measured | wrong |
|---|--:|--:|--:|--:|---|---|
"""


def shown(measured):
    return "; ".join(f"{what} {value:.3g}" if isinstance(value, float) else f"{what} {value}" for what, value in measured.items())


def processor_s():
    """Processor time of this process and of what it started: copies at a moment, the simulator."""
    return sum(used.ru_utime + used.ru_stime for used in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


def fly(job):
    """Name, what is wrong if anything, a table's row for each machine, processor time."""
    name, options = job
    began = processor_s()
    rows, wrong = [], None
    try:
        for machine in SCENARIOS[name](options.image, options):
            used, gap_ms = [machine.stack_used(stack) for stack in machine.stacks], machine.longest_gap * 1e-6
            rows.append(f"| {name} | {machine.now * 1e-9:.1f} | {used[0]} | {used[1]} | {gap_ms:.1f} | {shown(machine.measured)} |")
            assert not machine.complaints, f"the hardware would not bear: {machine.complaints}"
            assert machine.longest_gap < machine.longest_allowed_gap, "the watchdog was fed late"
            for (stack, (end, start)), bytes_used in zip(machine.stacks.items(), used):
                assert bytes_used <= STACK_SHARE * (start - end), f"stack of {stack}: {bytes_used} of {start - end} bytes"
    except AssertionError as error:
        wrong = str(error) or traceback.format_exc()
    except Exception:
        wrong = traceback.format_exc()
    verdict = (wrong or "").replace("\n", " ").replace("|", "/")
    return name, wrong, [f"{row} {verdict} |" for row in rows], processor_s() - began


def main():
    names = list(SCENARIOS)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("image", type=pathlib.Path, help="ELF file")
    parser.add_argument("scenario", nargs="*", help=f"of {', '.join(names)}; all without")
    parser.add_argument("--simulator", type=shlex.split, default=["target/release/backseat", "sim", "run"])
    parser.add_argument("--minutes", type=float, default=1, help="of the lock-step flight")
    parser.add_argument("--seed", type=int, default=1, help="of the lock-step flight, and of what is random")
    parser.add_argument("--trials", type=int, default=8, help="power cuts, and speeds of an overrun; ten times the resets of a kind")
    parser.add_argument("--report", type=pathlib.Path, help="Markdown file to write")
    options = parser.parse_intermixed_args()
    unknown = set(options.scenario) - set(names)
    if unknown:
        parser.error(f"no scenario {', '.join(sorted(unknown))}")
    jobs = [(name, options) for name in names if not options.scenario or name in options.scenario]
    failed, table = 0, {}
    # A process each, and not a copy of this one: the emulator looks for the FPU's feature register in its own heap.
    with multiprocessing.get_context("spawn").Pool(min(len(jobs), multiprocessing.cpu_count()), maxtasksperchild=1) as pool:
        for name, wrong, rows, cpu_s in pool.imap_unordered(fly, jobs, chunksize=1):
            failed += wrong is not None
            table[name] = rows
            print(f"{'FAIL' if wrong else 'ok':4}  {name}, {cpu_s:.0f} s of this computer's time", *rows, sep="\n", flush=True)
            if wrong:
                print(f"      {wrong}", flush=True)
    if options.report:
        options.report.write_text(REPORT + "".join(f"{row}\n" for name in names for row in table.get(name, [])))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
