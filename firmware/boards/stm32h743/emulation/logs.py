"""What the image has to do with its log and the card that takes it; as `scenarios.py`."""

from card import Card
from hostlink import DONE, MISSION_STOP, PARAMETER_STORE, Host, messages
from machine import Machine
from scenarios import START_S, begin_mission, checked, close, told


def log_card(image, _):
    """With a card a log is written; without one the parameters are stored in time all the same."""
    with_card = Machine(image, card=Card())
    with_card.run_for(4)
    files = with_card.card.volume.files()
    assert list(files) == ["LOG00000.BSL"], files.keys()
    kinds = [kind for kind, _ in messages(files["LOG00000.BSL"])]
    assert kinds[0] == 0 and kinds.count(5) > 5, f"a start and its steps are in the log: {kinds}"
    at = with_card.pc
    with_card.hard_fault("injected")
    with_card.run_for(1.5)
    files = with_card.card.volume.files()
    crashes = files.get("CRASHES.TXT", b"").decode()
    assert crashes.startswith(f"before LOG00001: fault at {at:#010x}") and crashes.endswith("\r\n"), f"{list(files)}, {crashes}"
    with_card.measured["card before it is identified, kHz"] = with_card.card.fastest_unidentified_hz * 1e-3
    without = Machine(image)
    without.run_for(0.3)
    answer, _, without.measured["params store while a card is looked for, s"] = Host(without).ask(PARAMETER_STORE, within_s=4)
    assert answer == DONE
    return [with_card, without]


def card_pulled(image, _):
    """A card that is pulled and put back: the host is told, and the log goes on in its file; not on another card."""
    machine = Machine(image, card=Card())
    machine.run_for(4)
    host, card = Host(machine), machine.card
    assert host.health().log == "writing"
    card.pull()
    machine.run_for(2)
    assert host.health().log == "failed"
    card.put_back()
    machine.run_for(10)
    health = host.health()
    assert health.log == "writing", health
    machine.run_for(1.2)
    files = card.volume.files()
    assert list(files) == ["LOG00000.BSL"], files.keys()
    steps = [message.integer() for kind, message in messages(files["LOG00000.BSL"]) if kind == 5]
    gap = max(after - before for before, after in zip(steps, steps[1:])) * 1e-6
    assert steps[-1] > 15e6, f"the log ends at {steps[-1]} us"
    machine.measured["longest gap of a log whose card was out for 2 s, s"] = gap
    machine.measured["records lost meanwhile"] = health.lost_records
    card.pull()
    machine.run_for(2)
    machine.card = Card()
    machine.run_for(10)
    assert host.health().log == "failed" and not machine.card.volume.files(), "it writes to another card"
    assert not machine.resets
    return [machine]


def card_full(image, options):
    """A card without room: the log ends, as whole records, and the host is told why; the mission goes on, and the board waits
    for nothing. Before one it is no go, unless the parameters say that a mission does without a log."""
    machine = Machine(image, card=Card())
    machine.card.volume.leave(96 * 1024)
    _, host = begin_mission(machine)
    began = machine.now
    assert host.health().log == "writing"
    while host.health().log == "writing" and machine.now < began + 30e9:
        machine.run_for(0.2)
    full = machine.now
    machine.run_for(12)  # it is tried again
    health = host.health()
    assert health.log == "full" and health.lost_records > 0, health
    assert host.mode() == ("navigating", "nominal") and not machine.resets
    close(told(machine, full).count(b"$OMP,") / ((machine.now - full) * 1e-9), 10, 0.2)
    assert health.late == [0, 0], f"steps came late: {health.late}"
    files = machine.card.volume.files()
    steps = [message.integer() for kind, message in messages(files["LOG00000.BSL"]) if kind == 5]
    assert list(files) == ["LOG00000.BSL"], files.keys()
    assert host.ask(MISSION_STOP)[0] == DONE
    machine.run_for(2)
    for required, expected in ((1, "fail"), (0, "note")):
        host.set("app.log_required", required)
        verdict, found = checked(machine, options)["board log"]
        assert (verdict, "the card is full" in found) == (expected, True), (verdict, found)
    machine.measured["log on a card with room for 96 KiB, KiB"] = round(len(files["LOG00000.BSL"]) / 1024, 1)
    machine.measured["its last step before the host was told, s"] = full * 1e-9 - steps[-1] * 1e-6
    return [machine]


ALL = [log_card, card_pulled, card_full]
