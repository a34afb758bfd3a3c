"""Navigate, identify and diagnose torpedo AUVs.

The functions are those of the command ``backseat``, and their numbers are the same to the bit. A first look at a log::

    import backseat
    log = backseat.read("docs/guide/samples/dive.csv.gz")
    found = backseat.diagnose(log)
    print(found.sentence)
    track = backseat.navigate(log, vehicle=found.vehicle).track

Frames are north-east-down and forward-starboard-down at the centre of gravity; units stand in every name (``depth_m``,
``heading_rad``). Tables are dictionaries of numpy arrays of one length, NaN where there is no sample: ``frame()`` of a
log or a result makes a data frame of pandas of them (``polars.DataFrame(log.columns)`` one of polars), and a data frame
goes back in by ``backseat.Log.from_columns(frame)``. ``plot()`` draws by matplotlib. Wrong input raises ``ValueError``
with what is wrong and where, a file that is not there ``FileNotFoundError``.
"""

from __future__ import annotations

import errno
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _backseat

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

__version__: str = _backseat.__version__
__all__ = [
    "Diagnosis", "Flight", "Identification", "Log", "Navigation", "Vehicle",
    "diagnose", "identify", "map", "navigate", "read", "simulate",
]

Table = Dict[str, NDArray[np.float64]]
PathLike = Union[str, "os.PathLike[str]"]


def _table(columns: Sequence[Tuple[str, bytes]]) -> Table:
    return {name: np.frombuffer(data, dtype="<f8") for name, data in columns}


def _frame(table: Table) -> "pandas.DataFrame":
    import pandas

    return pandas.DataFrame(table)


def _figure(count: int, height_in: float) -> Tuple["Figure", Any]:
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(count, 1, sharex=True, squeeze=False, figsize=(9, height_in), layout="constrained")
    return figure, axes[:, 0]


def _file(path: PathLike) -> str:
    """Of a file to be read."""
    if not os.path.exists(path):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(path))
    return os.fspath(path)


def _optional_file(path: Optional[PathLike]) -> Optional[str]:
    return None if path is None else _file(path)


def _fspath(path: Optional[PathLike]) -> Optional[str]:
    return None if path is None else os.fspath(path)


def _write(path: Path, text: str, force: bool) -> None:
    if path.exists() and not force:
        raise ValueError(f"{path}: exists already (force=True replaces it)")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


class Log:
    """A vehicle log in memory: one row a time, and the samples taken then.

    Make one by :func:`read` or :meth:`from_columns`. It cannot be changed; change its columns and make another.
    """

    def __init__(self, inner: "_backseat.Log") -> None:
        self._inner = inner

    @classmethod
    def from_columns(cls, columns: Mapping[str, ArrayLike], name: str = "columns") -> "Log":
        """A log of columns: ``t_s`` in s, never decreasing, and any column of the vehicle log (``depth_m``,
        ``heading_rad``, ``dvl_u_mps`` ...; the guide's page "The log format" has them all). NaN is no sample.

        Takes a dictionary of arrays, or a data frame of pandas or polars. ``name`` stands in reports in place of the
        file's. Raises ``ValueError`` for a column that is unknown or too short, and for times that go back.
        """
        data = {str(key): np.ascontiguousarray(columns[key], dtype="<f8").tobytes() for key in columns}
        if "t_s" not in data:
            raise ValueError("no column t_s: the time of each row in s")
        times = data.pop("t_s")
        return cls(_backseat.Log.from_columns(name, times, list(data.items())))

    @property
    def path(self) -> str:
        """The file it was read from."""
        return self._inner.path

    @property
    def format(self) -> str:
        """Name of the format that was recognised."""
        return self._inner.format

    @property
    def notes(self) -> List[str]:
        """What was recognised, assumed and left out, and what looks odd in its numbers."""
        return self._inner.notes

    @property
    def suspicions(self) -> List[str]:
        """What contradicts units, signs or times; results from such a log should not be trusted."""
        return self._inner.suspicions

    @property
    def columns(self) -> Table:
        """``t_s`` and every column that has samples, in the units of their names; NaN where there is none."""
        return _table(self._inner.columns())

    def frame(self) -> "pandas.DataFrame":
        """Its columns as a data frame; needs pandas."""
        return _frame(self.columns)

    def plot(self, *names: str) -> "Figure":
        """Columns against time, each in a plot of its own, all if none is named; needs matplotlib."""
        columns = self.columns
        names = names or tuple(columns)[1:]
        unknown = [name for name in names if name not in columns]
        if unknown:
            raise ValueError(f"{unknown[0]}: the log has no samples of it; it has {', '.join(list(columns)[1:])}")
        figure, axes = _figure(len(names), 1.8 * len(names))
        for name, ax in zip(names, axes):
            seen = np.isfinite(columns[name])
            ax.plot(columns["t_s"][seen], columns[name][seen], ".", markersize=2)
            ax.set_ylabel(name)
        axes[-1].set_xlabel("t_s")
        return figure

    def __repr__(self) -> str:
        columns = self.columns
        times = columns["t_s"]
        span = times[-1] - times[0] if len(times) else 0.0
        return f"<Log {self.path}: {self.format}, {len(times)} rows, {span:.1f} s, {len(columns) - 1} columns>"


class Vehicle:
    """A vehicle file: parameters, noise, installation, safety limits and effects.

    ``Vehicle()`` is the built-in reference vehicle. It cannot be changed; :meth:`replace` makes another.
    """

    def __init__(self, inner: Optional["_backseat.Vehicle"] = None) -> None:
        self._inner = _backseat.Vehicle.reference() if inner is None else inner

    @classmethod
    def read(cls, path: PathLike) -> "Vehicle":
        """Reads a vehicle file, TOML."""
        return cls(_backseat.Vehicle.read(_file(path)))

    @classmethod
    def from_toml(cls, text: str) -> "Vehicle":
        """A vehicle from the text of its file."""
        return cls(_backseat.Vehicle.parse(text))

    @property
    def name(self) -> str:
        """Its name."""
        return self._inner.name

    @property
    def parameters(self) -> Dict[str, float]:
        """Every number by its key, such as ``vehicle.mass_kg``; the guide's page "Parameters" has units and ranges."""
        return dict(self._inner.parameters())

    def replace(self, parameters: Mapping[str, float]) -> "Vehicle":
        """A copy with other numbers. Raises ``ValueError`` for a key that is unknown or a number out of its range."""
        return Vehicle(self._inner.with_parameters([(key, float(value)) for key, value in parameters.items()]))

    def to_toml(self, source: str = "Written by the Python package backseat") -> str:
        """The text of its file; ``source`` becomes the comment on top."""
        return self._inner.to_toml(source)

    def write(self, path: PathLike, source: str = "Written by the Python package backseat", force: bool = False) -> None:
        """Writes its file, which `backseat` and the board's `params import` read."""
        self._inner.write(os.fspath(path), source, force)

    def check(self, speed_mps: float = 1.0) -> Dict[str, Any]:
        """What ``backseat vehicle check --json`` says: speeds, turn, dive, stability, and whether it flies."""
        return json.loads(self._inner.check(speed_mps))

    def __repr__(self) -> str:
        return f"<Vehicle {self.name}>"


@dataclass(frozen=True, repr=False)
class Navigation:
    """What :func:`navigate` gives."""

    summary: Dict[str, Any]
    """The JSON object of ``backseat navigate --json``: error, nis, rejected, trust, doubts, estimates, digest ..."""
    track: Table
    """The estimate once a second: ``t_s``, the state, the current and the sigmas of the position."""
    smoothed: Optional[Table]
    """The same from the measurements of the whole log, if that was asked for."""
    learnt: Optional[Vehicle]
    """The vehicle with what the robust model has learnt of it, for the next dive; no other model learns anything."""

    @property
    def is_trusted(self) -> bool:
        """Whether nothing speaks against the result."""
        return self.summary["trust"] == "ok"

    def frame(self) -> "pandas.DataFrame":
        """The track as a data frame; needs pandas."""
        return _frame(self.track)

    def plot(self) -> "Figure":
        """The track, north against east, and its two sigmas against time; needs matplotlib."""
        from matplotlib import pyplot

        figure, axes = pyplot.subplots(1, 2, figsize=(11, 5), layout="constrained")
        for name, table in (("forward", self.track), ("smoothed", self.smoothed)):
            if table is None:
                continue
            axes[0].plot(table["y_m"], table["x_m"], label=name)
            if "sigma_x_m" in table:
                axes[1].plot(table["t_s"], 2 * np.hypot(table["sigma_x_m"], table["sigma_y_m"]), label=name)
        axes[0].set(xlabel="east [m]", ylabel="north [m]", aspect="equal", title=f"trust: {self.summary['trust']}")
        axes[1].set(xlabel="t_s", ylabel="two sigmas of the position [m]")
        axes[0].legend()
        return figure

    def __repr__(self) -> str:
        summary = self.summary
        return f"<Navigation {summary['configuration']}: {len(self.track['t_s'])} s, trust {summary['trust']}>"


@dataclass(frozen=True, repr=False)
class Identification:
    """What :func:`identify` gives."""

    summary: Dict[str, Any]
    """The JSON object of ``backseat identify --json``: parameters with value and ci95, validation, steps ..."""
    vehicle: Optional[Vehicle]
    """The vehicle with the identified parameters; ``None`` if no step predicted the held-out data better."""

    def __repr__(self) -> str:
        found = "nothing better than the prior" if self.vehicle is None else f"vehicle {self.vehicle.name}"
        return f"<Identification {self.summary['method']}: {found}, trust {self.summary['trust']}>"


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """What :func:`diagnose` gives."""

    sentence: str
    """The answer in one sentence."""
    summary: Dict[str, Any]
    """The JSON object of ``backseat diagnose --json``: verdict, effects with intervals, before and after ..."""
    vehicle: Vehicle
    """The declared vehicle with the effects found."""
    residuals: Dict[str, Table]
    """Innovations by channel with its unit: ``t_s``, ``before``, ``after``, and ``sigma`` as the declared model has it;
    none of short runs, which are predicted."""
    position_errors: Tuple[Table, ...]
    """``t_s`` and ``error_m`` against fixes or truth, before and after; empty of short runs."""

    @property
    def verdict(self) -> str:
        """"explained", "ambiguous", "none", "unexplained", "undecided" or "implausible"."""
        return self.summary["verdict"]

    def plot(self) -> "Figure":
        """Position errors and the innovations of every channel, before and after; needs matplotlib."""
        if not self.residuals:
            raise ValueError("short runs have no innovations to draw: diagnose(..., report=FOLDER) draws predictions")
        errors = [table for table in self.position_errors if len(table["t_s"])]
        figure, axes = _figure(bool(errors) + len(self.residuals), 2.2 * (bool(errors) + len(self.residuals)))
        for when, table in zip(("before", "after"), self.position_errors):
            if errors:
                axes[0].plot(table["t_s"], table["error_m"], label=when)
        if errors:
            axes[0].set_ylabel("position error [m]")
        for (name, table), ax in zip(self.residuals.items(), axes[bool(errors):]):
            for when in ("before", "after"):
                ax.plot(table["t_s"], table[when], ".", markersize=2, label=when)
            ax.set_ylabel(name)
        axes[0].legend()
        axes[-1].set_xlabel("t_s")
        figure.suptitle(self.sentence)
        return figure

    def __repr__(self) -> str:
        return f"<Diagnosis {self.verdict}: {self.sentence}>"


@dataclass(frozen=True, repr=False)
class Flight:
    """What :func:`simulate` gives."""

    summary: Dict[str, Any]
    """The JSON object of ``backseat sim run --json``: errors, cross_track_m, nis, ending, digest ..."""
    folder: Path
    """Where log.csv, truth.csv, session.mcap and report.html are."""

    @property
    def log(self) -> Log:
        """The log as the vehicle has it."""
        return read(self.folder / "log.csv")

    @property
    def truth(self) -> Path:
        """The truth, for ``navigate(..., truth=...)``."""
        return self.folder / "truth.csv"

    def __repr__(self) -> str:
        return f"<Flight {self.folder}: {self.summary['ending']}>"


def _log(log: Union[Log, PathLike, Mapping[str, ArrayLike]], force: bool) -> "_backseat.Log":
    if isinstance(log, Log):
        inner = log._inner
    elif isinstance(log, (str, os.PathLike)):
        inner = read(log)._inner
    else:
        inner = Log.from_columns(log)._inner
    if inner.suspicions and not force:
        reasons = "; ".join(inner.suspicions)
        raise ValueError(f"{inner.path}: refused, for it contradicts physics: {reasons} (force=True takes it as it is)")
    return inner


def _trial(
    ship: Optional[PathLike], modem: Union[PathLike, Sequence[PathLike]], origin_deg: Optional[Tuple[float, float]]
) -> "_backseat.TrialLogs":
    modems = [modem] if isinstance(modem, (str, os.PathLike)) else modem
    return _optional_file(ship), [_file(path) for path in modems], origin_deg


def _vehicle(vehicle: Union[None, Vehicle, PathLike]) -> Optional["_backseat.Vehicle"]:
    if vehicle is None or isinstance(vehicle, Vehicle):
        return None if vehicle is None else vehicle._inner
    return Vehicle.read(vehicle)._inner


def read(path: PathLike, mapping: Optional[PathLike] = None) -> Log:
    """Reads a log of any format that ``backseat info`` knows, or any other table by a column mapping.

    ``mapping`` is a file that ``backseat map`` drafts. Look at ``suspicions`` of the result before you use it.
    """
    return Log(_backseat.Log.read(_file(path), _optional_file(mapping)))


def map(table: PathLike) -> Dict[str, Any]:
    """Drafts the column mapping of another maker's table, as ``backseat map``.

    ``map`` of the result is the text: read it, write it to a file, and give that to :func:`read`. ``checks`` says what
    physics could not prove, ``doubts`` what contradicts, ``unused`` which columns it did not take.
    """
    return json.loads(_backseat.map(_file(table)))


def navigate(
    log: Union[Log, PathLike, Mapping[str, ArrayLike]],
    vehicle: Union[None, Vehicle, PathLike] = None,
    *,
    model: Optional[str] = None,
    truth: Optional[PathLike] = None,
    dvl: bool = True,
    range_rate: bool = True,
    current: bool = False,
    packet: bool = False,
    smooth: bool = False,
    water: str = "coast",
    receiver_bias_m: float = 1.5,
    ship: Optional[PathLike] = None,
    modem: Union[PathLike, Sequence[PathLike]] = (),
    origin_deg: Optional[Tuple[float, float]] = None,
    terms: Optional[PathLike] = None,
    learn: Optional[PathLike] = None,
    report: Optional[PathLike] = None,
    force: bool = False,
) -> Navigation:
    """Runs the navigation filter over a log, as ``backseat navigate``.

    ``vehicle``: the built-in reference if left out. ``model``: "robust", "nominal", "thesis" or "kinematic"; the best that the log
    supports if left out. ``dvl``, ``range_rate``: whether to use them. ``current``: estimate a steady water current as
    well (the robust model always does). ``packet``: take the ship from the packets alone instead of its GNSS.
    ``smooth``: the best estimate of each time from the whole log as well. ``truth``: a CSV to compare with. For the
    protection level, ``water``: "lake", "coast" or "strait", how much the current may change; ``receiver_bias_m``: one
    sigma per axis of the slow errors of the receivers of vehicle and ship.

    ``ship``: the log of the ship's GNSS (NMEA with RMC and GGA), ``modem``: that of the vehicle's modem, of the ship's,
    or of both, joined by time; ``origin_deg``: latitude and longitude of the origin of a vehicle's log that has
    positions in metres alone. ``terms``: a file of terms that :func:`diagnose` proposed, taken out of the readings.
    ``learn``: a file for the vehicle with what this dive has shown of it. ``report``: a folder for report.html. ``force``:
    take a log that contradicts physics, which is refused otherwise, and write over files that are there.
    """
    switches = [not dvl, not range_rate, current, packet, smooth]
    text, track, smoothed, page, found = _backseat.navigate(
        _log(log, force), _vehicle(vehicle), _optional_file(truth), model, switches, (water, float(receiver_bias_m)),
        _trial(ship, modem, origin_deg), _optional_file(terms), report is not None,
    )
    learnt = None if found is None else Vehicle(found[0])
    if learn is not None:
        if learnt is None or found is None:
            raise ValueError("only the robust model learns anything of the vehicle, of a log with fins and propeller")
        learnt.write(learn, found[1], force)
    if report is not None:
        _write(Path(report) / "report.html", page, force)
    return Navigation(json.loads(text), _table(track), None if smoothed is None else _table(smoothed), learnt)


def identify(
    log: Union[Log, PathLike, Mapping[str, ArrayLike]],
    vehicle: Union[None, Vehicle, PathLike] = None,
    *,
    method: str = "auto",
    validate: Union[None, Log, PathLike, Mapping[str, ArrayLike]] = None,
    scale: str = "m11",
    cross_drag: bool = False,
    current_mps: Optional[Tuple[float, float]] = None,
    report: Optional[PathLike] = None,
    force: bool = False,
) -> Identification:
    """Identifies the vehicle's parameters from a log with fins, propeller, attitude, rates and DVL velocity, as
    ``backseat identify``.

    ``vehicle``: the prior; the built-in reference if left out. ``method``: "auto", "aid", "aid-online", "iv"
    or "output-error". ``validate``: another log to be judged on; the last fifth of the same if left out. ``scale``:
    the parameter taken as known, "m11" or "beta5". ``current_mps``: water current north and east; the vehicle file's if
    left out. ``report``: a folder for report.html and vehicle.toml. ``force``: as for :func:`navigate`.
    """
    text, found, page = _backseat.identify(
        _log(log, force), _vehicle(vehicle), None if validate is None else _log(validate, force), method, scale, cross_drag,
        [] if current_mps is None else [float(value) for value in current_mps], report is not None,
    )
    identified = None if found is None else Vehicle(found)
    if report is not None:
        _write(Path(report) / "report.html", page, force)
        if identified is not None:
            identified.write(Path(report) / "vehicle.toml", force=force)
    return Identification(json.loads(text), identified)


def diagnose(
    log: Union[Log, PathLike, Mapping[str, ArrayLike]],
    vehicle: Union[None, Vehicle, PathLike] = None,
    *,
    truth: Optional[PathLike] = None,
    dvl: bool = True,
    with_: Sequence[Union[Log, PathLike, Mapping[str, ArrayLike]]] = (),
    run: Optional[int] = None,
    ship: Optional[PathLike] = None,
    modem: Union[PathLike, Sequence[PathLike]] = (),
    origin_deg: Optional[Tuple[float, float]] = None,
    report: Optional[PathLike] = None,
    force: bool = False,
) -> Diagnosis:
    """Finds which physical effect the declared vehicle lacks, and how large it is, as ``backseat diagnose``.

    ``vehicle``: the declared vehicle; the built-in reference if left out. ``truth``: a CSV to compare positions with.
    ``with_``: logs of the same time base, joined to the first; runs join by their labels. ``run``: one run alone, of a
    table that holds several, counted from 1. ``ship``, ``modem``, ``origin_deg``: what a trial leaves behind, as for
    :func:`navigate`. ``report``: a folder for report.html and vehicle.toml, and for proposed_terms.toml if terms were
    proposed. ``force``: as for :func:`navigate`.

    ``log`` may be a folder of short runs of a torpedo without fixes; ``truth``, ``dvl`` and the figures need fixes.
    """
    if report is not None:
        Path(report).mkdir(parents=True, exist_ok=True)
    text, sentence, vehicle_found, page, figures = _backseat.diagnose(
        _log(log, force), _vehicle(vehicle), _optional_file(truth), not dvl, [_log(other, force) for other in with_], run,
        _trial(ship, modem, origin_deg), _fspath(report), force,
    )
    found = Vehicle(vehicle_found)
    summary = json.loads(text)
    if report is not None:
        _write(Path(report) / "report.html", page, force)
        if summary["effects"] or "coefficients" in summary:
            found.write(Path(report) / "vehicle.toml", force=force)
    tables = {name: _table(columns) for name, columns in figures}
    names = [f"position error {when} [m]" for when in ("before", "after")]
    errors = tuple(tables.pop(name) for name in names if name in tables)
    return Diagnosis(sentence, summary, found, tables, errors)


def simulate(
    scenario: Optional[PathLike] = None,
    *,
    vehicle: Union[None, Vehicle, PathLike] = None,
    seed: Optional[int] = None,
    minutes: Optional[float] = None,
    effects: Sequence[str] = (),
    random_effect: bool = False,
    out: Optional[PathLike] = None,
    force: bool = False,
) -> Flight:
    """Flies a mission in the simulator as fast as possible, as ``backseat sim run``; the backseat runs in this process.

    ``scenario``: a file, or a built-in one ("survey", the default, "survey_current", ...). ``effects``: what the vehicle
    does and its file does not say, ``"NAME"`` or ``"NAME:parameter=value,..."``. ``out``: folder of the results; a new one
    in ``out/`` if left out. ``force``: fly a vehicle that does not fly.
    """
    wanted = [*effects, *(["random"] if random_effect else [])]
    text, where = _backseat.simulate(_fspath(scenario), _vehicle(vehicle), seed, minutes, wanted, _fspath(out), force)
    return Flight(json.loads(text), Path(where))
