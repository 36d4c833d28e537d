"""The study: varied values, cases and metrics, from a TOML file that is read strictly, or from Python."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from shaper_fmu.errors import ModelError, StudyError, nearest
from shaper_fmu.master.algorithms import Algorithm, Coupling, SolverMethod
from shaper_fmu.master.batch import Plan
from shaper_fmu.master.metrics import check_metrics, metric_variables
from shaper_fmu.master.run_options import checked_solving
from shaper_fmu.master.signals import Interpolation
from shaper_fmu.metrics.known import GROUP, METRICS, AnyMetric
from shaper_fmu.sweep.plan import KINDS, MOST_RUNS, Points, Sampling, Value
from shaper_fmu.sweep.variation import Vary

RESERVED = ("id", "run", "case", "compared", "status", "reason", "seconds", "attempts")
"""Names that no metric can have: columns of the store, and of what is exported."""

_LONGEST = 1e9
"""Of a time limit [s]: what operating systems wait for is about nine times as long at most."""

_MOST_COLUMNS = 1900
"""SQLite has 2000 at most."""


class Refine(msgspec.Struct, forbid_unknown_fields=True):
    """If a metric crosses `level` between neighbours of a grid, the interval is divided until it is shorter than `width`.

    `level` is the metric's own value, or with the study's reference a share of the reference's value at the same point.
    `width` is in the unit of the start value.
    """

    metric: str
    level: float
    width: float


class Study(msgspec.Struct, forbid_unknown_fields=True, dict=True):
    """A sweep over an SSP system.

    Attributes:
        folder: where the study file lies; `system` is relative to it.
        compare: cases by name: the start values in which they differ.
        reference: the case that the others are related to, in percent.
        stop_when: a variable that ends a run once it has been true for `stop_hold` [s]; at the latest it ends at `stop_time` [s].
        solver, coupling, solver_tolerance: of FMUs of model exchange (see `Simulation.run`).
        time_limit: wall time after which a run counts as hanging [s]; none if it is left out. It needs worker processes.
    """

    name: str
    system: str
    stop_time: float
    step: float
    vary: dict[str, Vary]
    metrics: dict[str, AnyMetric]
    compare: dict[str, dict[str, float | bool | str]] = msgspec.field(default_factory=lambda: {"all": {}})
    plan: Sampling = msgspec.field(default_factory=Sampling)
    algorithm: Algorithm = "jacobi"
    interpolation: Interpolation = "hold"
    reference: str | None = None
    stop_when: str | None = None
    stop_hold: float = 0.0
    time_limit: float | None = None
    refine: Refine | None = None
    solver: SolverMethod = "auto"
    coupling: Coupling = "monolithic"
    solver_tolerance: float | None = None
    folder: str = ""

    @property
    def system_path(self) -> Path:
        """Path of the SSP archive."""
        return Path(self.folder) / self.system

    @cached_property
    def points(self) -> Points:
        """The points at which each case is run. Raises StudyError."""
        return Points(self.vary, self.plan)

    @property
    def count(self) -> int:
        """How many runs there are, before any refinement."""
        return len(self.compare) * self.points.count

    def run(self, number: int) -> tuple[str, tuple[Value, ...]]:
        """The case and the varied values (in the order of `vary`) of a run."""
        case, point = divmod(number, self.points.count)
        return list(self.compare)[case], self.points.point(point)

    def batch_plan(self, start_time: float) -> Plan:
        """The common settings of all runs."""
        return Plan(
            self.stop_time, self.step, start_time, self.algorithm, self.interpolation,
            stop_when=self.stop_when, stop_hold=self.stop_hold,
            solver=self.solver, coupling=self.coupling, solver_tolerance=self.solver_tolerance,
        )  # fmt: skip

    def recorded(self) -> list[str]:
        """The variables that the metrics need."""
        return metric_variables(self.metrics)

    def commands(self) -> list[str]:
        """The commands whose ends metrics wait for."""
        return list(dict.fromkeys(command for m in self.metrics.values() if (command := m.needs().command)))

    def as_json(self) -> str:
        """The study's content; the same text for the same study, wherever its file is."""
        content = _plain(self)
        del content["folder"]
        return json.dumps(content)

    def __repr__(self) -> str:
        from shaper_fmu.sweep.shown import study_text

        return f"<Study {self.name!r}: {study_text(self)}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.sweep.shown import study_facts, varied_table

        return page(f"Study {self.name}", study_facts(self), [varied_table(self)])


def read_study(path: Path | str) -> Study:
    """Read a study file. Raises StudyError with the fault and its line."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    try:
        study = msgspec.toml.decode(text, type=Study)
    except msgspec.DecodeError as error:
        raise StudyError(f"{path}{_located(text, str(error))}{_value_at(text, str(error))}") from None
    study.folder = str(path.parent)
    try:
        check_study(study)
    except (StudyError, ModelError) as error:
        raise StudyError(f"{path}: {error}") from None
    return study


def check_study(study: Study) -> None:
    """Raise StudyError for a study that is invalid for any system."""
    _check_kinds(study)
    content = _plain(study)
    try:
        msgspec.convert(content, Study)  # as it will be read from the store
    except msgspec.ValidationError as error:
        raise StudyError(str(error)) from None
    _check_numbers("", content)
    if not study.compare or not study.vary or not study.metrics:
        raise StudyError("a study needs at least one entry in each of [vary], [compare] and [metrics]")
    if study.plan.kind not in KINDS:
        raise StudyError(f"plan.kind = {study.plan.kind!r} is not one of {', '.join(KINDS)}.{nearest(study.plan.kind, KINDS)}")
    if study.reference is not None and study.reference not in study.compare:
        raise StudyError(f"reference = {study.reference!r} is not one of [compare].{nearest(study.reference, study.compare)}")
    if not 0.0 < study.step <= study.stop_time < float("inf"):
        raise StudyError(f"step = {study.step} and stop_time = {study.stop_time} must be positive, the step the smaller one")
    try:
        checked_solving(study.solver, study.coupling, study.solver_tolerance)
    except ModelError as error:
        raise StudyError(str(error)) from None
    for name, least in (("stop_hold", study.stop_hold >= 0.0), ("time_limit", study.time_limit is None or study.time_limit > 0.0)):
        if not least:
            raise StudyError(f"{name} = {getattr(study, name)} must be positive")
    if study.time_limit is not None and study.time_limit > _LONGEST:
        raise StudyError(f"time_limit = {study.time_limit} is more than {_LONGEST:g} s; leave it out for no limit")
    if study.plan.seed < 0:
        raise StudyError(f"plan.seed = {study.plan.seed} must not be negative")
    for name in ("name", "system", "stop_when"):
        given = getattr(study, name)
        if given is not None and (not given.strip() or "\0" in given):
            raise StudyError(f"{name} = {given!r} must be a text that is not empty, without NUL")
    for name, measure in study.metrics.items():
        for key in measure.fields():
            given = getattr(measure, key)
            if isinstance(given, str) and (not given.strip() or "\0" in given):
                raise StudyError(f"metrics.{name}.{key} = {given!r} must be the name of a variable")
    for name in study.metrics:
        if not re.fullmatch(r"[A-Za-z]\w*", name):
            raise StudyError(f"metric {name!r}: a metric's name has letters, digits and _ only, and begins with a letter")
        if name.lower() in RESERVED:
            raise StudyError(f"metric {name!r}: this name is a column of the store's own; reserved are {', '.join(RESERVED)}")
    if len(study.vary) + len(study.metrics) > _MOST_COLUMNS:
        raise StudyError(f"{len(study.vary)} start values and {len(study.metrics)} metrics are more than {_MOST_COLUMNS} columns")
    check_metrics(study.metrics)
    if study.refine is not None:
        _check_refine(study, study.refine)
    # factors may be of the system's own value, which is not known yet
    known = not any(one.factors is not None and one.nominal is None for one in study.vary.values())
    if known and study.count > MOST_RUNS:
        message = f"{study.points.count} points of {len(study.compare)} cases are {study.count} runs"
        raise StudyError(f"plan: {message}, too many ({MOST_RUNS} at most)")


def _plain(study: Study) -> dict[str, Any]:
    """The study as dictionaries, lists, numbers and texts; NumPy's, which Python code may give, as Python's."""
    return msgspec.to_builtins(study, enc_hook=_plain_number)


def _plain_number(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise StudyError(f"{value!r} is nothing that a study can hold")


def _check_kinds(study: Study) -> None:
    """Raise an error for an object that is not a metric, or whose study could be run but not read again."""
    check_metrics(study.metrics)
    for name, measure in study.metrics.items():
        kind = type(measure)
        if METRICS.get(kind.kind()) is not kind:
            message = f"metric {name!r} is of the class {kind.__name__} of {kind.__module__}, which no entry point of {GROUP} names"
            raise StudyError(f"{message}: who reads the store would not find it (see docs/extending.md)")


def _check_numbers(where: str, value: object) -> None:
    """Raise StudyError for inf and NaN, which no part of a study can use."""
    if isinstance(value, float) and not math.isfinite(value):
        raise StudyError(f"{where} = {value} must be a finite number")
    if isinstance(value, dict | list):
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            _check_numbers(f"{where}.{key}" if where else str(key), one)


def _check_refine(study: Study, refine: Refine) -> None:
    if refine.metric not in study.metrics:
        raise StudyError(f"refine.metric = {refine.metric!r} is not one of [metrics].{nearest(refine.metric, study.metrics)}")
    if study.plan.kind != "grid" or not refine.width > 0.0 or not refine.level > 0.0:
        raise StudyError("refine needs a plan of the kind grid, and a level and a width above 0")


def _located(text: str, message: str) -> str:
    """msgspec's message with the line of the fault, and the nearest key for an unknown one."""
    unknown = re.search(r"unknown field `([^`]+)`(?: - at `\$([^`]*)`)?", message)
    if unknown:
        known = _fields_at(unknown[2] or "")
        message += nearest(unknown[1], known).replace(" Did", ". Did", 1) if known else ""
        return f", line {_line_of(text, unknown[1])}: {message}"
    place = re.search(r"at `\$([^`]*)`", message)
    if place:
        keys = re.findall(r"[A-Za-z_]\w*", place[1])
        return f", line {_line_of(text, keys[-1])}: {message}" if keys else f": {message}"
    return f": {message}"


def _value_at(text: str, message: str) -> str:
    """The whole key of msgspec's message, which leaves out names, and the value; nothing for other errors."""
    place = re.search(r"at `\$([^`]*)`", message)
    if not place or "unknown field" in message:
        return ""
    root: Any = msgspec.toml.decode(text)
    key, node, kept = "", root, (lambda inner: inner)
    for part in re.findall(r"\[\.\.\.\]|\[\d+\]|[^.\[\]]+", place[1]):
        if part == "[...]":
            entries = node.items() if isinstance(node, dict) else enumerate(node)
            found = next((name for name, one in entries if _raises(kept(_alone(node, name, one)), message)), None)
            if found is None:
                return ""
        else:
            found = int(part[1:-1]) if part[0] == "[" else part
            if found not in (node if isinstance(node, dict) else range(len(node))):
                return ""
        key += f"[{found}]" if isinstance(found, int) else f"{'.' if key else ''}{found}"
        kept = _within(kept, node, found)
        node = node[found]
    return f"; {key} = {node!r:.80}"


def _alone(node: Any, name: Any, one: Any) -> Any:
    return {name: one} if isinstance(node, dict) else [one]


def _within(kept: Callable[[Any], Any], node: Any, found: Any) -> Callable[[Any], Any]:
    """The whole content as a function of the entry `found` of `node`."""
    if isinstance(node, dict):
        return lambda inner: kept({**node, found: inner})
    return lambda inner: kept([inner])


def _raises(content: Any, message: str) -> bool:
    """Whether msgspec raises this message for the content."""
    try:
        msgspec.convert(content, Study)
    except msgspec.ValidationError as error:
        return str(error) == message
    return False


def _line_of(text: str, key: str) -> int:
    """The first line that sets this key, or has it in a heading; 1 if none does."""
    pattern = re.compile(rf'(^|[\[.{{,\s"])"?{re.escape(key)}"?\s*(=|\]|\.)')
    return next((i for i, line in enumerate(text.splitlines(), 1) if pattern.search(line)), 1)


def _fields_at(place: str) -> list[str]:
    """The keys that are known where msgspec found an unknown one."""
    if place == "":
        return list(Study.__struct_fields__)
    kinds: dict[str, tuple[str, ...]] = {".vary": Vary.__struct_fields__, ".plan": Sampling.__struct_fields__}
    kinds[".refine"] = Refine.__struct_fields__
    measures = (key for metric in METRICS.values() for key in metric.fields())
    kinds[".metrics"] = tuple(dict.fromkeys(measures))
    return list(next((fields for start, fields in kinds.items() if place.startswith(start)), ()))
