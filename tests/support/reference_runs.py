"""The systems in ssp/ and their reference results."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.parameter_sets import parameter_set_problems

SYSTEMS = Path(__file__).parents[2] / "ssp"


def assert_agrees_with_reference(archive: Path, experiment: tuple[float, float], tolerance: float) -> dict[str, np.ndarray]:
    """Run an archive as it says and compare with the reference.csv of its folder in ssp/, which has every n-th row of such a run.

    `experiment` is the stop time and step that it must tell [s]. Returns the reference's columns by name.
    """
    loaded = load_ssp(archive)
    assert parameter_set_problems(loaded) == []
    stop_time, step = loaded.structure.stop_time, loaded.structure.step_size
    assert (stop_time, step) == experiment
    assert stop_time is not None
    assert step is not None
    with (SYSTEMS / archive.stem / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = dict(zip(header, np.array(rows, float).T, strict=True))
    assert len(expected) > 2
    assert (SYSTEMS / archive.stem / "reference.csv").stat().st_size <= 100_000
    results = loaded.system.simulate(stop_time, step, record=header[1:])
    every = round((len(results.time) - 1) / (len(rows) - 1))
    np.testing.assert_allclose(results.time[::every], expected[header[0]], rtol=0.0, atol=1e-12)
    for name in header[1:]:
        np.testing.assert_allclose(results[name][::every], expected[name], rtol=1e-11, atol=tolerance, err_msg=name)
    return expected
