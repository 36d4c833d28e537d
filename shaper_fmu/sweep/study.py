"""The study: what varies, what is compared, what is measured. A TOML file, read strictly."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from shaper_fmu.errors import StudyError, nearest
from shaper_fmu.master.algorithms import Algorithm


class Vary(msgspec.Struct, forbid_unknown_fields=True):
    """Values of one start value: a list, or `points` from `low` to `high`, evenly spaced; and the nominal one."""

    nominal: float
    values: list[float] | None = None
    low: float | None = None
    high: float | None = None
    points: int = 21

    def grid(self) -> list[float]:
        """The values in rising order, the nominal one among them."""
        if self.values is not None:
            chosen = self.values
        elif self.low is not None and self.high is not None and self.points >= 2:
            chosen = [float(f"{value:.12g}") for value in np.linspace(self.low, self.high, self.points)]
        else:
            raise StudyError("vary: give values, or low and high with at least 2 points")
        others = [value for value in chosen if abs(value - self.nominal) > 1e-11 * abs(self.nominal)]
        return sorted([*others, self.nominal])


class Residual(msgspec.Struct, forbid_unknown_fields=True, tag="residual", tag_field="kind"):
    """Residual amplitude of `output` after the last change of `command`."""

    output: str
    command: str


class Peak(msgspec.Struct, forbid_unknown_fields=True, tag="peak", tag_field="kind"):
    """Largest magnitude of `output` over the run."""

    output: str


class Study(msgspec.Struct, forbid_unknown_fields=True):
    """A sweep over an SSP system. `folder` is where the study file lies; `system` is relative to it.

    `reference` names the compared case that the others are related to, in percent.
    """

    name: str
    system: str
    stop_time: float
    step: float
    vary: dict[str, Vary]
    compare: dict[str, dict[str, float | bool | str]]
    metrics: dict[str, Residual | Peak]
    algorithm: Algorithm = "jacobi"
    reference: str | None = None
    folder: str = ""

    @property
    def system_path(self) -> Path:
        """Where the SSP archive lies."""
        return Path(self.folder) / self.system

    def plan(self) -> list[tuple[str, dict[str, Any]]]:
        """All runs in their order: the compared case's name and the start values that are varied."""
        grids = [[(name, value) for value in vary.grid()] for name, vary in self.vary.items()]
        return [(case, dict(point)) for case in self.compare for point in itertools.product(*grids)]

    def recorded(self) -> list[str]:
        """The variables that the metrics need."""
        names = [n for m in self.metrics.values() for n in ([m.output, m.command] if isinstance(m, Residual) else [m.output])]
        return list(dict.fromkeys(names))

    def as_json(self) -> str:
        """The study's content, the same text for the same study wherever it lies."""
        content = msgspec.to_builtins(self)
        del content["folder"]
        return json.dumps(content)


def read_study(path: Path | str) -> Study:
    """Read a study file. Raises StudyError that tells what is wrong and where."""
    path = Path(path)
    try:
        study = msgspec.toml.decode(path.read_bytes(), type=Study)
        study.folder = str(path.parent)
        study.plan()
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror or error}") from None
    except (msgspec.DecodeError, StudyError) as error:
        raise StudyError(f"{path}: {error}") from None
    if study.reference is not None and study.reference not in study.compare:
        raise StudyError(
            f"{path}: reference = {study.reference!r} is not one of [compare].{nearest(study.reference, study.compare)}"
        )
    if not (0.0 < study.step <= study.stop_time < float("inf")):
        raise StudyError(
            f"{path}: step = {study.step} and stop_time = {study.stop_time} must be positive, the step the smaller one"
        )
    if not study.compare or not study.vary or not study.metrics:
        raise StudyError(f"{path}: a study needs at least one entry in each of [vary], [compare] and [metrics]")
    return study
