"""Writes a point of a sweep as a parameter set for its system."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shaper_fmu.archives import write_file
from shaper_fmu.errors import StudyError, UsageError
from shaper_fmu.ssp.export import parameter_set
from shaper_fmu.ssp.write import write_parameter_set
from shaper_fmu.sweep.engine import load_stored_system
from shaper_fmu.sweep.store import Store


class NoSuchRunError(StudyError, UsageError):
    """A store has no run of the number that is asked for."""


def write_point(store: Path | str, run: int, path: Path | str) -> dict[str, Any]:
    """Write the start values of one run of a sweep, those of its case and the varied ones, as an .ssv file; and return them.

    Raises StudyError if the store has no such run, or its system has changed since.
    """
    with Store(store) as opened:
        found = next((known for known in opened.iterate() if known.id == run), None)
        if found is None:
            numbers = [known.id for known in opened.iterate()]
            known = f"its runs are {min(numbers)} to {max(numbers)}" if numbers else "no run is done yet"
            raise NoSuchRunError(f"{store}: there is no run {run}; {known}")
        system = load_stored_system(opened).system
        study = opened.study()
    values = {**study.compare[found.compared], **found.varied}
    name = f"{study.name}, run {run} ({found.compared})"
    write_file(Path(path), write_parameter_set(parameter_set(system, values, name)))
    return values
