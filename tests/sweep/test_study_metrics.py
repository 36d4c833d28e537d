"""Metrics in studies: every known one in a file, in Python, in a store and in the loop; what is none is refused."""

from __future__ import annotations

import math
from typing import Any, get_type_hints

import numpy as np
import pytest

from shaper_fmu import Final, Peak, Residual, SettlingTime, Study
from shaper_fmu.errors import ModelError, StudyError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.known import METRICS
from shaper_fmu.metrics.metric import Metric
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import check_study, read_study
from shaper_fmu.sweep.variation import Vary

W = 2.0 * math.pi
TEXTS = {"command": "shaper.shaped", "rate": "plant.velocity"}


def example(kind: str) -> Metric:
    """A metric of this kind, by the names and types of its fields."""
    metric = METRICS[kind]
    types = get_type_hints(metric)
    told: dict[str, Any] = {key: TEXTS.get(key, "plant.position") if types[key] is str else 1.5 for key in metric.fields()}
    return metric(**told)


def study_of(metrics: dict[str, Any], **more: Any) -> Study:
    told = {"name": "n", "system": "s.ssp", "stop_time": 1.0, "step": 0.1, "vary": {"plant.mass": Vary(values=[1.0, 2.0])}}
    return Study(**{**told, **more}, metrics=metrics)


def test_all_metrics_are_those_of_the_documented_kinds():
    """Kinds are in people's files: none may go."""
    assert {"final", "peak", "overshoot", "effort", "residual", "envelope", "settling_time"} <= set(METRICS)


@pytest.mark.parametrize("kind", METRICS)
def test_a_study_in_python_is_that_of_the_file_and_of_the_store(tmp_path, kind):
    metric = example(kind)
    study = study_of({"m": metric})
    check_study(study)
    keys = "".join(f"{key} = {getattr(metric, key)!r}\n" for key in reversed(metric.fields()))
    (tmp_path / "study.toml").write_text(
        f'name = "n"\nsystem = "s.ssp"\nstop_time = 1.0\nstep = 0.1\n[vary."plant.mass"]\nvalues = [1.0, 2.0]\n'
        f'[metrics.m]\n{keys}kind = "{kind}"\n'
    )
    read = read_study(tmp_path / "study.toml")
    assert read.metrics == study.metrics
    assert read.as_json() == study.as_json()
    with Store(tmp_path / "s.sqlite", study):
        pass
    with Store(tmp_path / "s.sqlite") as store:
        assert store.study().metrics == study.metrics


def test_the_text_of_a_study_is_that_of_stores_written_before():
    """As 0.1.0's stores had it while studies had classes of their own: a store goes on only with the same text."""
    written = study_of({"m": example("envelope"), "n": example("settling_time")}).as_json()
    assert (
        '"metrics": {"m": {"kind": "envelope", "output": "plant.position", "command": "shaper.shaped", "rate": "plant.velocity", '
        '"natural_frequency": 1.5, "rest": 1.5}, "n": {"kind": "settling_time", "output": "plant.position", "target": 1.5, '
        '"tolerance": 1.5}}, "compare"'
    ) in written


@pytest.mark.parametrize("kind", METRICS)
def test_a_batch_gives_what_single_runs_do(fmus, kind):
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[W], command=W * W)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, damping=0.5)
    system.connect("shaper.shaped", "plant.force")
    metrics, varied = {"m": example(kind)}, [{"plant.stiffness": factor * W * W} for factor in (0.8, 1.3)]
    with Simulation(system, record=[], metrics=metrics) as simulation:
        single = [simulation.run(2.0, 0.01, start_values=values).metrics for values in varied]
    with Batch(system, Plan(2.0, 0.01), metrics, ["plant.stiffness"]) as batch:
        assert [batch.run(values) for values in varied] == single


def test_numbers_of_numpy_are_those_of_python():
    metrics = {"m": SettlingTime("plant.position", np.float64(1.5), np.float64(1.5))}
    study = study_of(metrics, stop_time=np.float64(1.0), vary={"plant.mass": Vary(values=np.array([1.0, 2.0]))})  # pyright: ignore[reportArgumentType]
    check_study(study)
    assert study.as_json() == study_of({"m": example("settling_time")}).as_json()


class Own(Metric, tag="own_metric", frozen=True):
    """A metric that no entry point names."""

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return gathered["last"]


@pytest.mark.parametrize(
    ("metric", "error", "words"),
    [
        ("peak", ModelError, "metric 'm' is 'peak'; use Effort"),
        (Peak, ModelError, "metric 'm' is <class .*; use Effort"),
        (Own("plant.position"), StudyError, "Own of .*, which no entry point of shaper_fmu.metrics names"),
        (Final(object()), StudyError, "is nothing that a study can hold"),  # pyright: ignore[reportArgumentType]
        (Residual("plant.position", 7), StudyError, "Expected `str`, got `int`.*command"),  # pyright: ignore[reportArgumentType]
    ],
)
def test_what_no_study_can_hold_is_refused(metric, error, words):
    with pytest.raises(error, match=words):
        check_study(study_of({"m": metric}))
