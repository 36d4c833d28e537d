"""Arguments of the wrong kind, as they are easily given in Python: the message tells what is right."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest

from shaper_fmu import (
    Results,
    ShaperFmuError,
    System,
    build_fmu,
    compare,
    profile,
    requirements_for,
    run_study,
    shaper,
    sweep_system,
    tune_plant,
)
from shaper_fmu.metrics import Residual
from shaper_fmu.sweep import Store

LEFT = Residual(output="plant.position", command="shaper.shaped")


def spring(fmus: Path) -> System:
    """A spring behind a ZV shaper."""
    system = System("spring")
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[10.0])
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.connect("shaper.shaped", "plant.force")
    return system


def tuned(fmus: Path, *arguments: Any, **options: Any) -> Any:
    return tune_plant(fmus / "OverheadCrane.fmu", *arguments, **options)


def swept(fmus: Path, **options: Any) -> Any:
    wanted: dict[str, Any] = {"vary": {"plant.stiffness": [80.0]}, "metrics": {"left": LEFT}, "stop_time": 1.0, "step": 0.01}
    return sweep_system(spring(fmus), fmus / "never.sqlite", **{**wanted, **options})


def ran(fmus: Path) -> Results:
    return spring(fmus).simulate(0.1, 0.01)


INPUT, OUTPUT, LENGTH = "trolley_acceleration", "swing_angle", "initial_rope_length"
SLIPS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "an output alone": (lambda f: tuned(f, INPUT, OUTPUT), "a list of names is needed, such as outputs=['swing_angle']"),
    "a share as text": (lambda f: tuned(f, INPUT, [OUTPUT], spread={LENGTH: "10%"}), "spread of initial_rope_length = '10%': a text where a number is needed; did you mean 0.1?"),
    "10 for 10 %": (lambda f: tuned(f, INPUT, [OUTPUT], spread={LENGTH: 10}), "did you mean 10 % (0.1)?"),
    "a list of parameters": (lambda f: tuned(f, INPUT, [OUTPUT], spread=[LENGTH]), 'such as {"mass": 0.1} for 10 %'),
    "a list of inputs": (lambda f: tuned(f, [INPUT], [OUTPUT]), "the name of one input is needed"),
    "no input": (lambda f: tuned(f), "Known: trolley_acceleration, hoist_speed"),
    "requirements as a dictionary": (lambda f: tuned(f, INPUT, [OUTPUT], requirements={"tolerance": 0.05}), "such as requirements_for(spread)"),
    "start values as a list": (lambda f: tuned(f, INPUT, [OUTPUT], start_values=["mass"]), 'start_values = [\'mass\']: names with values are needed'),
    "an amplitude as text": (lambda f: tuned(f, INPUT, [OUTPUT], amplitude="0.2"), "did you mean 0.2?"),
    "a requirement as an option": (lambda f: tuned(f, INPUT, [OUTPUT], tolerance=0.05), "requirements=requirements_for(spread, tolerance=...)"),
    "an experiment's option misspelt": (lambda f: tuned(f, INPUT, [OUTPUT], exitation="step"), "Did you mean 'excitation'?"),
    "an instance for its variable": (lambda f: spring(f).connect("shaper", "plant"), "'shaper' is an instance: name one of its variables, as in 'shaper."),
    "too short for one limit": (lambda f: profile("trapezoid", 0.1, 0.1, max_velocity=0.1), "max_acceleration = no limit; the shortest possible duration is 1 s"),
    "a requirement misspelt": (lambda f: requirements_for({}, tolerence=0.05), "Did you mean 'tolerance'?"),
    "5 for 5 %": (lambda f: requirements_for({}, tolerance=5), "0 < tolerance < 1"),
    "a tolerance as text": (lambda f: requirements_for({}, tolerance="5%"), "did you mean 0.05?"),
    "a kind alone": (lambda f: requirements_for({}, kinds="zv"), "kinds=['zv']"),
    "a frequency as text": (lambda f: shaper("zv", cast("Any", "10")), "natural_frequency = '10': a text where a number is needed; did you mean 10?"),
    "a kind in capitals": (lambda f: shaper("ZV", 10.0), "Did you mean 'zv'?"),
    "a result misspelt": (lambda f: ran(f)["plant.postion"], "Did you mean 'plant.position'?"),
    "a result by number": (lambda f: ran(f)[cast("Any", 0)], "such as results['shaper.shaped']"),
    "a plot misspelt": (lambda f: ran(f).plot("position"), "Did you mean 'plant.position'?"),
    "nothing to plot": (lambda f: ran(f).plot([]), "there is nothing to plot"),
    "axes too many": (lambda f: ran(f).plot("plant.position", axes=[1, 2]), "2 are given, and 1 are needed"),
    "runs without names": (lambda f: compare(cast("Any", [ran(f)])), '{"unshaped": a, "ZV": b}'),
    "a run's file": (lambda f: compare({"a": cast("Any", "run.csv")}), "give what System.simulate has returned"),
    "a time as text": (lambda f: spring(f).simulate(cast("Any", "1"), 0.01), "stop_time = '1'"),
    "metrics as a list": (lambda f: spring(f).simulate(1.0, 0.01, metrics=[LEFT]), "metrics = [Residual"),
    "a variation as a number": (lambda f: swept(f, vary={"plant.stiffness": 100.0}), "a list of values is needed"),
    "a variation as text": (lambda f: swept(f, vary={"plant.stiffness": "10%"}), "or Vary(low=..., high=..., points=...)"),
    "variations as a list": (lambda f: swept(f, vary=["plant.stiffness"]), '{"plant.mass": [0.9, 1.0, 1.1]}'),
    "a metric as text": (lambda f: swept(f, metrics={"left": "residual"}), "use Effort, Envelope"),
    "a metric alone": (lambda f: swept(f, metrics=LEFT), "names with values are needed"),
    "cases as a list": (lambda f: swept(f, compare=["zv"]), '{"ZV": {"shaper.shaper": "zv"}'),
    "one case without a name": (lambda f: swept(f, compare={"shaper.shaper": "zv"}), "such as compare={"),
    "an option misspelt": (lambda f: swept(f, referense="zv"), "Did you mean 'reference'?"),
    "a study's path": (lambda f: run_study(cast("Any", "study.toml"), "never.sqlite"), "read_study('study.toml')"),
    "a component's name": (lambda f: build_fmu(cast("Any", "OverheadCrane"), f), "find_component('MassSpringDamper')"),
    "no store": (lambda f: Store(f / "never.sqlite"), "run 'shaper-fmu sweep' first"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_told_with_what_is_right(fmus: Path, slip: str) -> None:
    call, told = SLIPS[slip]
    with pytest.raises(ShaperFmuError) as error:
        call(fmus)
    assert told in str(error.value)
    assert not (fmus / "never.sqlite").exists()


def test_a_folder_is_no_file_to_write(fmus: Path, tmp_path: Path) -> None:
    (tmp_path / "runs.csv").mkdir()
    with pytest.raises(IsADirectoryError, match=r"a folder, where a file shall be written: .*runs\.csv"):
        ran(fmus).to_csv(tmp_path / "runs.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["runs.csv"]
