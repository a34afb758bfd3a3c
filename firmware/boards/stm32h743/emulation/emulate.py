"""Runs the image of the board on an emulated STM32H743, scenario by scenario; --help."""

import argparse
import multiprocessing
import pathlib
import shlex
import sys
import time
import traceback

import scenarios

LONGEST_GAP_S = 0.3  # the watchdog resets after 0.6


def fly(job):
    """Name, what is wrong if anything, what was measured, processor time."""
    name, options = job
    began = time.process_time()
    lines, wrong = [], None
    try:
        for machine in getattr(scenarios, name)(options.image, options):
            used, size = machine.stack_used()
            lines.append(f"{machine.now * 1e-9:.1f} s of its time, stack {used} of {size} bytes,"
                         f" longest time between two feeds {machine.longest_gap * 1e-6:.1f} ms")
            lines += [f"{what}: {value:.3f}" if isinstance(value, float) else f"{what}: {value}" for what, value in machine.measured.items()]
            assert not machine.complaints, f"the hardware would not bear: {machine.complaints}"
            assert machine.longest_gap < LONGEST_GAP_S * 1e9 or machine.faults, "the watchdog was fed late"
            assert used <= options.stack, f"stack: {used} bytes, limit {options.stack}"
    except AssertionError as error:
        wrong = str(error) or traceback.format_exc()
    except Exception:
        wrong = traceback.format_exc()
    return name, wrong, lines, time.process_time() - began


def main():
    names = [scenario.__name__ for scenario in scenarios.ALL]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("image", type=pathlib.Path, help="ELF file")
    parser.add_argument("scenario", nargs="*", help=f"of {', '.join(names)}; all without")
    parser.add_argument("--simulator", type=shlex.split, default=["target/release/backseat", "sim", "run"])
    parser.add_argument("--minutes", type=float, default=1, help="of the lock-step flight")
    parser.add_argument("--seed", type=int, default=1, help="of the lock-step flight")
    parser.add_argument("--stack", type=int, default=24 * 1024, help="limit, bytes")
    options = parser.parse_args()
    unknown = set(options.scenario) - set(names)
    if unknown:
        parser.error(f"no scenario {', '.join(sorted(unknown))}")
    jobs = [(name, options) for name in names if not options.scenario or name in options.scenario]
    failed = 0
    # A process each, and not a copy of this one: the emulator looks for the FPU's feature register in its own heap.
    with multiprocessing.get_context("spawn").Pool(min(len(jobs), multiprocessing.cpu_count()), maxtasksperchild=1) as pool:
        for name, wrong, lines, cpu_s in pool.imap_unordered(fly, jobs, chunksize=1):
            failed += wrong is not None
            print(f"{'FAIL' if wrong else 'ok':4}  {name}, {cpu_s:.0f} s of this computer's time", *(f"      {line}" for line in lines), sep="\n")
            if wrong:
                print(f"      {wrong}")
            sys.stdout.flush()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
