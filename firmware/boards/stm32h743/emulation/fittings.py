"""What the image has to do with last-resort hardware; as `scenarios.py`."""

from hostlink import ACTIVE, DONE, DROP_WEIGHT, MISSION_STOP, NOT_FITTED, PARAMETER_STORE, READY, WRONG, Host, varint
from machine import Machine
from scenarios import NEUTRAL, START_S, WAIT_S, begin_mission, checked, close, told
from vehicle import Vehicle

ABORT, DROP, LEAK, SUPPLY = 9, 11, 13, ("C", 0)  # three of port E: the table in src/fittings.rs
RATIO = 11.0  # app.supply_ratio as it is
LAST_V = 20.0


def fitted(image, **parameters):
    """A machine with these parameters of the app stored, in its next start."""
    machine = Machine(image)
    machine.flash.write_ns, machine.flash.erase_ns = 2e3, 20e6
    machine.run_for(START_S)
    host = Host(machine)
    for name, value in parameters.items():
        host.set(f"app.{name}", value)
    answer, _, _ = host.ask(PARAMETER_STORE, within_s=10)
    assert answer == DONE
    machine.reset("pin")
    return machine


def supplied(machine, volts):
    """The vehicle's supply, behind its divider."""
    machine.adc.volts[SUPPLY] = volts / RATIO


DROP, LEAK = 11, 13  # of port E, the table in src/fittings.rs


def last_resort(image, _):
    """Drop weight and leak detector: pins, polarity, readings; the weight falls by command alone where nothing dives."""
    machine = Machine(image)
    machine.run_for(START_S)
    port, host = machine.gpio["E"], Host(machine)
    assert [port.mode(pin) for pin in (DROP, LEAK)] == [3, 3], "pins of what is not fitted are touched"
    assert host.health().fittings == [NOT_FITTED] * 4
    host.set("app.drop_weight", 1)
    host.set("app.leak_detector", 2)
    answer, _, _ = host.ask(PARAMETER_STORE, within_s=10)
    assert answer == DONE
    machine.reset("pin")
    machine.run_for(WAIT_S + 1)
    assert [port.mode(pin) for pin in (DROP, LEAK)] == [1, 0] and not port.is_high(DROP)
    assert host.health().fittings == [NOT_FITTED, READY, READY, NOT_FITTED]
    for release in (1, 0):
        began = machine.now
        answer, _, _ = host.ask(DROP_WEIGHT, varint(release), look_s=0.001)
        assert answer == DONE
        while port.is_high(DROP) != release and machine.now < began + 1e9:
            machine.run_for(0.001)
        machine.measured[f"drop weight {'released' if release else 'at rest'} after the command, s"] = took = (machine.now - began) * 1e-9
        assert took < 0.2, f"{took} s"
    port.outside[LEAK] = 0
    machine.run_for(3)
    assert host.health().fittings == [NOT_FITTED, READY, ACTIVE, NOT_FITTED] and not port.is_high(DROP), "a wet detector at rest"
    del port.outside[LEAK]
    machine.reset("power")
    machine.run_for(WAIT_S)
    assert not port.is_high(DROP) and not machine.faults
    return [machine]


def supply_measured(image, options):
    """A supply that falls under way ends the mission once as many readings say so, no sooner; none begins with it."""
    machine = fitted(image, supply_measured=1, supply_last_v=LAST_V)
    supplied(machine, 24.0)
    _, host = begin_mission(machine)
    health = host.health()
    assert health.fittings == [NOT_FITTED] * 3 + [READY], health
    close(health.supply_v, 24.0, 0.01)
    machine.measured["supply of 24 V read as, V"] = round(health.supply_v, 3)
    supplied(machine, 18.0)  # a load that pulls it down
    machine.run_for(1.5)
    supplied(machine, 24.0)
    machine.run_for(2)
    assert host.mode() == ("navigating", "nominal"), "a dip of 1.5 s is not its end"
    supplied(machine, 19.0)
    fell = machine.now
    machine.run_for(3)
    line = told(machine, fell)
    assert b"$OMSTOP" in line and NEUTRAL in line, line
    times = [time for time, _ in machine.frontseat.sent if time >= fell]
    machine.measured["stop after the supply fell, s"] = took = (times[line.index(b"$OMSTOP")] - fell) * 1e-9
    assert 1.9 < took < 2.3, f"{took} s"
    assert host.mode() == ("safe", "supply low") and host.health().fittings[3] == ACTIVE, host.mode()
    assert host.no_start() == "supply low", "no mission begins with it"
    verdict, found = checked(machine, options)["last resort"]
    assert (verdict, "supply active, 19.0 V" in found) == ("fail", True), found
    supplied(machine, 24.0)
    machine.run_for(3)
    verdict, found = checked(machine, options)["last resort"]
    assert (verdict, "supply ready, 24.0 V" in found) == ("ok", True), found
    return [machine]


def abort_line(image, _):
    """It acts when a mission is ended that was to go on, by a reset too, and rests by command. With a pin that does not
    follow none begins; one that is under way goes on, and the host is told."""
    machine = fitted(image, abort_line=1, supply_measured=1, supply_last_v=LAST_V)
    supplied(machine, 24.0)
    port = machine.gpio["E"]

    def held_high(is_held):
        port.outside[ABORT] = 1
        (port.held.add if is_held else port.held.discard)(ABORT)
        machine.run_for(3)
        return host.health().fittings[0]

    def acts_within(seconds):
        since = machine.now
        while not port.is_high(ABORT) and machine.now < since + 3e9:
            machine.run_for(0.005)
        took = (machine.now - since) * 1e-9
        assert took < seconds, f"after {took} s"
        return took

    vehicle, host = Vehicle(machine), Host(machine)
    machine.run_for(9)
    assert port.mode(ABORT) == 1 and not port.is_high(ABORT) and host.health().fittings[0] == READY
    host.mission(starts=False)
    assert held_high(True) == WRONG, "its pin is high at rest"
    assert host.no_start() == "fitting failed"
    assert held_high(False) == READY
    assert host.no_start() is None
    machine.run_for(1)
    assert host.mode() == ("navigating", "nominal") and told(machine, machine.now - 1e9).count(b"$OMP,") > 8
    assert held_high(True) == WRONG and host.mode() == ("navigating", "nominal"), "a mission under way goes on"
    assert held_high(False) == READY
    supplied(machine, 19.0)
    machine.measured["abort line after the supply fell, s"] = acts_within(2.3)
    supplied(machine, 24.0)
    machine.run_for(3)
    assert host.health().fittings[0] == ACTIVE, "it stays so"
    assert host.no_start() is None
    machine.run_for(1)
    assert not port.is_high(ABORT) and host.mode() == ("navigating", "nominal"), host.mode()
    machine.reset("pin")
    machine.measured["abort line after a reset under way, s"] = acts_within(0.7)
    machine.run_for(3)
    assert host.ask(MISSION_STOP)[0] == DONE
    machine.run_for(0.3)
    assert not port.is_high(ABORT) and host.health().fittings[0] == READY
    return [machine]


ALL = [last_resort, supply_measured, abort_line]
