"""The Python package beside the command line: the same numbers to the bit.

    BACKSEAT=target/debug/backseat python -m unittest discover host-tools/python/tests

The notebook needs matplotlib; everything else numpy alone.
"""

import base64
import contextlib
import io
import json
import os
import signal
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

import backseat

ROOT = Path(__file__).resolve().parents[3]
SAMPLES = ROOT / "docs/guide/samples"
DIVE = str(SAMPLES / "dive.csv.gz")
IVER = str(SAMPLES / "iver_survey.csv.gz")
TRIAL = str(SAMPLES / "trial_vehicle.csv.gz")
# What differs from run to run, or is a path of the command line.
OF_THE_RUN = {"wall_s", "report", "track", "vehicle_file"}


def command(*words):
    program = os.environ.get("BACKSEAT", str(ROOT / "target/debug/backseat"))
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 3), done.stderr
    return json.loads(done.stdout)


class SameNumbers(unittest.TestCase):
    def same(self, ours, commands):
        for key in commands.keys() - OF_THE_RUN:
            self.assertEqual(ours[key], commands[key], key)

    def test_navigate(self):
        ours = backseat.navigate(DIVE, model="nominal", dvl=False)
        theirs = command("navigate", DIVE, "--model", "nominal", "--no-dvl", "--json")
        self.same(ours.summary, theirs)
        self.assertEqual(len(ours.summary["digest"]), 16)
        self.assertEqual(ours.track["x_m"][-1], theirs["final"]["x_m"])

    def test_what_the_protection_level_is_told(self):
        ours = backseat.navigate(DIVE, dvl=False, water="strait", receiver_bias_m=3)
        theirs = command("navigate", DIVE, "--no-dvl", "--water", "strait", "--receiver-bias", "3", "--json")
        self.same(ours.summary, theirs)
        self.assertNotEqual(ours.summary["level"], backseat.navigate(DIVE, dvl=False).summary["level"])
        for wrong in ({"water": "sea"}, {"receiver_bias_m": -1}):
            with self.assertRaisesRegex(ValueError, "expected"):
                backseat.navigate(DIVE, **wrong)

    def test_arrays_in_are_the_log(self):
        log = backseat.read(DIVE)
        again = backseat.Log.from_columns(log.columns)
        for name, values in log.columns.items():
            np.testing.assert_array_equal(again.columns[name], values, name)
        digests = {backseat.navigate(given, dvl=False).summary["digest"] for given in (log, again, log.columns)}
        self.assertEqual(len(digests), 1)

    def test_smooth_and_dead_reckoning(self):
        smooth = backseat.navigate(DIVE, model="kinematic", smooth=True)
        self.assertEqual(smooth.track["t_s"].shape, smooth.smoothed["t_s"].shape)
        ours = backseat.navigate(IVER)
        self.same(ours.summary, command("navigate", IVER, "--json"))
        self.assertEqual(list(ours.track), ["t_s", "x_m", "y_m"])

    def test_a_trial_s_logs_are_joined(self):
        log, ship, modem = (SAMPLES / f"trial_{name}" for name in ("vehicle.csv.gz", "ship.nmea.gz", "modem.log"))
        origin = (41.5, -70.7)
        ours = backseat.navigate(log, ship=ship, modem=[modem], origin_deg=origin, dvl=False)
        theirs = command(
            "navigate", log, "--ship", ship, "--modem", modem, "--origin", "41.5,-70.7", "--no-dvl", "--json"
        )
        self.same(ours.summary, theirs)
        one = backseat.navigate(log, ship=ship, modem=modem, origin_deg=origin, dvl=False)
        self.assertEqual(ours.summary["digest"], one.summary["digest"])
        self.assertNotEqual(ours.summary["digest"], backseat.navigate(log, dvl=False).summary["digest"])
        ours = backseat.diagnose(log, ship=ship, modem=modem, origin_deg=origin)
        theirs = command("diagnose", log, "--ship", ship, "--modem", modem, "--origin", "41.5,-70.7", "--json")
        self.same(ours.summary, theirs)
        self.assertIn("72 ranges", " ".join(ours.summary["notes"]))

    def test_what_a_dive_has_taught(self):
        with tempfile.TemporaryDirectory() as folder:
            ours, theirs = Path(folder) / "ours.toml", Path(folder) / "theirs.toml"
            found = backseat.navigate(DIVE, dvl=False, learn=ours)
            command("navigate", DIVE, "--no-dvl", "--learn", theirs, "--json")
            self.assertEqual(ours.read_text(encoding="utf-8"), theirs.read_text(encoding="utf-8"))
            self.assertEqual(found.learnt.to_toml(), backseat.Vehicle.read(ours).to_toml())
            with self.assertRaisesRegex(ValueError, "exists already"):
                backseat.navigate(DIVE, dvl=False, learn=ours)
            with self.assertRaisesRegex(ValueError, "only the robust model learns"):
                backseat.navigate(DIVE, model="nominal", learn=Path(folder) / "none.toml")

    def test_terms_are_taken_out(self):
        with tempfile.TemporaryDirectory() as folder:
            terms = Path(folder) / "terms.toml"
            terms.write_text('[[effect]]\nname = "heading_lag"\nvalues = [1.0]\n', encoding="utf-8")
            ours = backseat.navigate(DIVE, dvl=False, terms=terms)
            self.same(ours.summary, command("navigate", DIVE, "--no-dvl", "--terms", terms, "--json"))
            self.assertNotEqual(ours.summary["digest"], backseat.navigate(DIVE, dvl=False).summary["digest"])

    def test_diagnose_several_logs_or_one_run(self):
        columns = backseat.read(IVER).columns
        half = len(columns["t_s"]) // 2
        table = {**columns, "run": np.repeat([1.0, 2.0], [half, len(columns["t_s"]) - half])}

        def write(file, columns):
            cells = [["" if np.isnan(value) else repr(float(value)) for value in row] for row in zip(*columns.values())]
            rows = [",".join(row) for row in cells]
            file.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
            return file

        with tempfile.TemporaryDirectory() as folder:
            first = write(Path(folder) / "first.csv", {name: values[:half] for name, values in columns.items()})
            second = write(Path(folder) / "second.csv", {name: values[half:] for name, values in columns.items()})
            ours = backseat.diagnose(first, with_=[second])
            self.same(ours.summary, command("diagnose", first, "--with", second, "--json"))
            self.assertNotEqual(ours.summary["before"], backseat.diagnose(first).summary["before"])
            runs = write(Path(folder) / "runs.csv", table)
            self.same(backseat.diagnose(runs, run=2).summary, command("diagnose", runs, "--run", 2, "--json"))
            with self.assertRaisesRegex(ValueError, "there is no run 3"):
                backseat.diagnose(runs, run=3)

    def test_diagnose_a_folder_of_short_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            runs, report = Path(folder) / "runs", Path(folder) / "report"
            command("sim", "short-runs", "--effect", "random", "--seed", 2, "--flown", 3, "--out", runs, "--json")
            ours = backseat.diagnose(runs, report=report)
            theirs = command("diagnose", runs, "--out", Path(folder) / "theirs.toml", "--json")
            self.same(ours.summary, theirs)
            written = [backseat.Vehicle.read(file) for file in (report / "vehicle.toml", Path(folder) / "theirs.toml")]
            self.assertEqual(written[0].parameters, written[1].parameters)
            self.assertIn(ours.sentence[:40], (report / "report.html").read_text(encoding="utf-8"))
            self.assertEqual((ours.residuals, ours.position_errors), ({}, ()))
            with self.assertRaisesRegex(ValueError, "need a log with fixes"):
                backseat.diagnose(runs, dvl=False)
            with self.assertRaisesRegex(ValueError, "no innovations"):
                ours.plot()

    def test_diagnose(self):
        with tempfile.TemporaryDirectory() as folder:
            ours = backseat.diagnose(IVER, report=folder)
            self.same(ours.summary, command("diagnose", IVER, "--json"))
            self.assertIn(ours.sentence[:40], (Path(folder) / "report.html").read_text(encoding="utf-8"))
            written = backseat.Vehicle.read(Path(folder) / "vehicle.toml")
            self.assertEqual(written.parameters, ours.vehicle.parameters)
            with self.assertRaisesRegex(ValueError, "exists already"):
                backseat.diagnose(IVER, report=folder)

    def test_identify(self):
        ours = backseat.identify(DIVE, method="aid")
        self.same(ours.summary, command("identify", DIVE, "--method", "aid", "--json"))

    def test_simulate(self):
        with tempfile.TemporaryDirectory() as folder:
            ours = backseat.simulate(seed=1, minutes=1, out=Path(folder) / "ours")
            # topside in this process, as in the package: what a process says of itself is carried on from second to
            # second, which rounds otherwise
            library = ["--topside", "library"]
            theirs = command(
                "sim", "run", *library, "--seed", 1, "--minutes", 1, "--json", "--out", Path(folder) / "theirs"
            )
            # the command that asks `diagnose` names the folder
            named = {**theirs["naming"], "diagnose": theirs["naming"]["diagnose"].replace("/theirs/", "/ours/")}
            self.same(ours.summary, {**theirs, "naming": named})
            self.assertGreater(len(ours.log.columns["t_s"]), 100)
            self.assertTrue(ours.truth.exists())


class Vehicles(unittest.TestCase):
    def test_numbers_and_text(self):
        vehicle = backseat.Vehicle()
        heavier = vehicle.replace({"vehicle.mass_kg": vehicle.parameters["vehicle.mass_kg"] + 0.125})
        self.assertEqual(heavier.parameters["vehicle.mass_kg"] - vehicle.parameters["vehicle.mass_kg"], 0.125)
        self.assertEqual(backseat.Vehicle.from_toml(heavier.to_toml()).parameters, heavier.parameters)
        self.assertTrue(vehicle.check()["flies"])


class WrongInput(unittest.TestCase):
    def test_errors_say_what_is_wrong(self):
        scenario = ROOT / "hil-sim/scenarios/survey.toml"
        light = backseat.Vehicle().replace({"vehicle.displaced_mass_kg": 60.0})
        dive = backseat.read(DIVE).columns
        mirrored = backseat.Log.from_columns({**dive, "pitch_rad": -dive["pitch_rad"]})
        for call, message in [
            (lambda: backseat.Log.from_columns({"depth_m": [1.0]}), "no column t_s"),
            (lambda: backseat.Log.from_columns({"t_s": [0.0], "depth_ft": [1.0]}), "depth_ft: a vehicle log has no such"),
            (lambda: backseat.Log.from_columns({"t_s": [0.0, 1.0], "depth_m": [1.0]}), "depth_m has 1 values, t_s has 2"),
            (lambda: backseat.Log.from_columns({"t_s": [1.0, 0.0]}), "sort the rows by time"),
            (lambda: backseat.Log.from_columns({"t_s": [float("nan")]}), "expected seconds"),
            (lambda: backseat.navigate(mirrored), "refused, for it contradicts physics: pitch_rad .* .force=True takes it"),
            (lambda: backseat.diagnose(mirrored), "refused, for it contradicts physics"),
            (lambda: backseat.navigate(DIVE, model="quick"), "expected robust, nominal, thesis or kinematic"),
            (lambda: backseat.identify(DIVE, method="magic"), "output-error"),
            (lambda: backseat.Vehicle().replace({"vehicle.mass": 1.0}), "vehicle.mass"),
            (lambda: backseat.Vehicle().replace({"vehicle.mass_kg": -1.0}), "mass_kg"),
            (lambda: backseat.simulate(effects=["gremlins"]), "gremlins"),
            (lambda: backseat.simulate(minutes=-1), "minutes -1: expected a positive number"),
            (lambda: backseat.identify(DIVE, current_mps=(0.1,)), "expected two numbers, north and east"),
            (lambda: backseat.read(SAMPLES / "other_maker.csv.gz"), "a mapping of its columns .backseat.map drafts one"),
            (lambda: backseat.read(scenario), "a scenario, not a log .simulate flies it"),
            (lambda: backseat.map(SAMPLES / "trial_modem.log"), "needs no mapping of its columns"),
            (lambda: backseat.navigate(DIVE, terms=scenario), "unknown field"),
            (lambda: backseat.navigate(TRIAL, ship=SAMPLES / "trial_ship.nmea.gz"), "origin_deg states that"),
            (lambda: backseat.navigate(IVER, model="nominal"), "the kinematic model does not"),
            (lambda: backseat.simulate(vehicle=light), "does not fly: .*force=True flies it"),
        ]:
            with self.assertRaisesRegex(ValueError, message) as raised:
                call()
            self.assertNotRegex(str(raised.exception), r"--[a-z]|\bbackseat [a-z]", "the command line's words")
        for call in (lambda: backseat.read("no_such.csv"), lambda: backseat.navigate("no_such.csv"), lambda: backseat.map("no_such.csv")):
            with self.assertRaisesRegex(FileNotFoundError, "no_such.csv"):
                call()


class Results(unittest.TestCase):
    """What a notebook shows of them."""

    def test_ctrl_c_ends_the_work(self):
        # a shell's background commands ignore it
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        dive = backseat.read(DIVE)
        with tempfile.TemporaryDirectory() as folder:
            works = [lambda: backseat.simulate(minutes=100_000, out=f"{folder}/run")]
            methods = ("auto", "aid", "aid-online", "iv", "output-error")
            works += [lambda method=method: backseat.identify(dive, method=method) for method in methods]
            began_s = time.process_time()
            backseat.identify(dive, method="aid-online")
            whole_s = time.process_time() - began_s
            for work in works:
                pressed_s = []

                def press():
                    pressed_s.append(time.process_time())
                    os.kill(os.getpid(), signal.SIGINT)

                threading.Timer(0.2, press).start()
                with self.assertRaises(KeyboardInterrupt):
                    work()
                # of the processor, however busy the machine is: a small part of the shortest method's work
                self.assertLess(time.process_time() - pressed_s[0], whole_s / 4)
        # what comes next is not ended
        self.assertEqual(len(backseat.navigate(DIVE, dvl=False).summary["digest"]), 16)

    def test_a_line_and_figures(self):
        os.environ["MPLBACKEND"] = "Agg"
        log = backseat.read(IVER)
        found = backseat.diagnose(log)
        navigation = backseat.navigate(DIVE, dvl=False)
        for result, part in ((log, "columns>"), (navigation, "trust ok>"), (found, f"<Diagnosis {found.verdict}: {found.sentence}>")):
            self.assertIn(part, repr(result))
            self.assertLess(len(repr(result)), 200)
        self.assertEqual(found.verdict, found.summary["verdict"])
        self.assertEqual(len(log.plot("depth_m", "heading_rad").axes), 2)
        self.assertEqual(len(navigation.plot().axes), 2)
        self.assertEqual(len(found.plot().axes), 1 + len(found.residuals))
        with self.assertRaisesRegex(ValueError, "depth_ft"):
            log.plot("depth_ft")

    def test_frames(self):
        log = backseat.read(DIVE)
        frame = log.frame()
        self.assertEqual(list(frame.columns), list(log.columns))
        np.testing.assert_array_equal(backseat.Log.from_columns(frame).columns["depth_m"], log.columns["depth_m"])

    def test_a_draft_of_a_mapping(self):
        with tempfile.TemporaryDirectory() as folder:
            table, mapping = Path(folder) / "table.csv", Path(folder) / "map.toml"
            table.write_text("Time (s),Depth (ft)\n" + "".join(f"{k},{3 + k / 10}\n" for k in range(50)), encoding="utf-8")
            draft = backseat.map(table)
            mapping.write_text(draft["map"], encoding="utf-8")
            depth_m = backseat.read(table, mapping).columns["depth_m"]
            self.assertAlmostEqual(depth_m[0], 3 * 0.3048)


class Notebook(unittest.TestCase):
    FILE = ROOT / "docs/guide/from_log_to_cause.ipynb"

    def outputs(self, cell, names):
        """What a cell prints and draws, as a notebook keeps it."""
        from matplotlib import pyplot

        outputs, printed = [], io.StringIO()

        def keep_text():
            if printed.getvalue():
                text = printed.getvalue().splitlines(keepends=True)
                outputs.append({"name": "stdout", "output_type": "stream", "text": text})
            printed.seek(0)
            printed.truncate()

        def show():
            keep_text()
            for number in pyplot.get_fignums():
                picture = io.BytesIO()
                pyplot.figure(number).savefig(picture, dpi=60, bbox_inches="tight", metadata={"Software": None})
                data = {"image/png": base64.b64encode(picture.getvalue()).decode() + "\n"}
                outputs.append({"data": data, "metadata": {}, "output_type": "display_data"})
            pyplot.close("all")

        with contextlib.redirect_stdout(printed), mock.patch("matplotlib.pyplot.show", show):
            exec("".join(cell["source"]), names)
        keep_text()
        return outputs

    def test_its_cells_run_and_name_the_cause(self):
        os.environ["MPLBACKEND"] = "Agg"
        notebook = json.loads(self.FILE.read_text(encoding="utf-8"))
        cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
        names = {}
        here = os.getcwd()
        os.chdir(self.FILE.parent)  # a kernel starts in the notebook's folder
        try:
            found = [self.outputs(cell, names) for cell in cells]
        finally:
            os.chdir(here)
        if os.environ.get("BACKSEAT_WRITE_NOTEBOOK"):
            for count, (cell, outputs) in enumerate(zip(cells, found), start=1):
                cell.update(execution_count=count, outputs=outputs)
            self.FILE.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        for count, (cell, outputs) in enumerate(zip(cells, found), start=1):
            self.assertEqual(cell["execution_count"], count)
            # pictures differ by the version of what draws them
            stored, run = ([(one["output_type"], one.get("text")) for one in of] for of in (cell["outputs"], outputs))
            self.assertEqual(stored, run, "BACKSEAT_WRITE_NOTEBOOK=1 stores the outputs of this run: read their diff")
            pictures = [output["data"]["image/png"] for output in cell["outputs"] if "data" in output]
            self.assertTrue(all(base64.b64decode(picture).startswith(b"\x89PNG") for picture in pictures))
        self.assertEqual([effect["name"] for effect in names["found"].summary["effects"]], ["fin_bias"])
        before, after = names["before"].summary["rejected"], names["after"].summary["rejected"]
        self.assertGreater(before["rates"], 100)
        self.assertLess(after["rates"], 10)


if __name__ == "__main__":
    unittest.main()
