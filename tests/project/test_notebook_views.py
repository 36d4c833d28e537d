"""What objects show of themselves: one line at the prompt, HTML in a notebook, plots; names of others are never HTML."""

from __future__ import annotations

import builtins
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import html
from matplotlib import pyplot

import shaper_fmu
from shaper_fmu import (
    ArgumentError,
    Results,
    ShaperFmuError,
    System,
    compare,
    profile,
    shaper,
    sweep_system,
    tune_plant,
    unity_magnitude_pulses,
)
from shaper_fmu.errors import StudyError
from shaper_fmu.metrics import Residual
from shaper_fmu.notebook.html import MOST_ROWS, table_html
from shaper_fmu.page.blocks import Table
from shaper_fmu.page.figures import COLOURS
from shaper_fmu.public_names import homes
from shaper_fmu.sweep import Store

RUN: dict[str, Any] = {"stop_time": 2.0, "step": 0.01}


def spring(fmus: Path, kind: str) -> System:
    """A spring of 10 rad/s, damping ratio 0.05, after a step that is shaped."""
    system = System("spring")
    system.add("shaper", fmus / "InputShaper.fmu", shaper=kind, natural_frequency=[10.0], damping_ratio=[0.05], command=1.0)
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.connect("shaper.shaped", "plant.force")
    return system


@pytest.fixture(scope="module")
def objects(fmus: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """One of each kind."""
    store = tmp_path_factory.mktemp("store") / "spring.sqlite"
    metrics = {"left": Residual(output="plant.position", command="shaper.shaped")}
    cases = {"unshaped": {"shaper.shaper": "none"}, "ZV": {}}
    sweep_system(spring(fmus, "zv"), store, vary={"plant.stiffness": [81.0, 100.0, 121.0]}, metrics=metrics, compare=cases, **RUN)
    tuning = tune_plant(
        fmus / "OverheadCrane.fmu", "trolley_acceleration", ["swing_angle"], spread={"initial_rope_length": 0.1}, amplitude=0.2
    )
    with Store(store) as opened:
        yield {
            "system": spring(fmus, "zv"),
            "unshaped": spring(fmus, "none").simulate(**RUN),
            "zv": spring(fmus, "zv").simulate(**RUN),
            "sequence": shaper("zvd", 10.0, 0.05),
            "profile": profile("s_curve", 1.0, max_velocity=1.0, max_acceleration=2.0),
            "pulses": unity_magnitude_pulses("zv", 10.0),
            "tuning": tuning,
            "choice": tuning.choice,
            "store": opened,
            "study": opened.study(),
        }  # fmt: skip


KINDS = ("system", "unshaped", "sequence", "profile", "pulses", "tuning", "choice", "store", "study")


@pytest.mark.parametrize("name", KINDS)
def test_an_object_shows_itself_in_a_line_and_in_html(objects: dict[str, Any], name: str) -> None:
    text, page = repr(objects[name]), objects[name]._repr_html_()
    assert len(text) < 400
    assert "\n" not in text
    parsed = html.fragment_fromstring(page)
    assert parsed.tag == "div"
    assert not parsed.xpath("//script")
    assert len(page) < 30_000
    assert "e+300" not in page


def test_lines_tell_what_counts(objects: dict[str, Any]) -> None:
    assert repr(objects["system"]) == "<System 'spring': shaper, plant; 1 connection>"
    assert repr(objects["unshaped"]).startswith("<Results: 201 points from 0 to 2 s; shaper.shaped, ")
    assert repr(objects["profile"]) == "<Profile s_curve: 1 m in 2 s>"
    half = math.pi / (10.0 * math.sqrt(1.0 - 0.05**2))  # of the damped period
    assert repr(objects["sequence"]).startswith(f"<ImpulseSequence: 3 impulses in {2.0 * half:.5g} s, ")
    assert repr(objects["tuning"]).startswith("<Tuning: tuned, OverheadCrane.fmu, trolley_acceleration -> swing_angle: ")
    assert "; 6 of 6 done>" in repr(objects["store"])


@pytest.mark.parametrize("name", ["unshaped", "sequence", "profile", "pulses", "tuning", "choice", "store"])
def test_plots_are_in_the_project_s_colours(objects: dict[str, Any], name: str) -> None:
    axes = np.atleast_1d(objects[name].plot())
    assert all(one.get_xlabel() and one.lines for one in axes)
    assert axes[0].lines[0].get_color() in COLOURS
    pyplot.close("all")


def test_what_is_plotted_is_what_was_recorded(objects: dict[str, Any]) -> None:
    axes = compare({"unshaped": objects["unshaped"], "ZV": objects["zv"]}).plot("plant.position")
    for line, name in zip(axes.lines, ("unshaped", "zv"), strict=True):
        np.testing.assert_array_equal(line.get_xdata(), objects[name].time)
        np.testing.assert_array_equal(line.get_ydata(), objects[name]["plant.position"])
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["plant.position, unshaped", "plant.position, ZV"]
    _, given = pyplot.subplots()
    assert objects["unshaped"].plot("plant.position", given) is given
    pyplot.close("all")


def test_the_sensitivity_is_that_of_singer_and_seering(objects: dict[str, Any]) -> None:
    """Undamped, ZV leaves V = |cos(pi r / 2)|."""
    line = shaper("zv", 10.0).plot_sensitivity(10.0).lines[0]
    np.testing.assert_allclose(line.get_ydata(), 100.0 * np.abs(np.cos(0.5 * np.pi * line.get_xdata())), atol=1e-9)
    pyplot.close("all")


def test_results_are_a_mapping(objects: dict[str, Any]) -> None:
    results: Results = objects["zv"]
    assert list(results) == list(results.keys()) == list(results.values)
    assert len(results) == len(dict(results))
    assert "plant.position" in results
    assert "plant.positio" not in results
    assert all(results[name] is column for name, column in results.items())
    assert Results(np.zeros(0), {})  # an empty one is a result, too
    assert repr(Results(np.zeros(0), {})) == "<Results: no points; no variables>"


def test_pandas_gets_every_number_and_unit(objects: dict[str, Any]) -> None:
    frame = objects["zv"].to_pandas()
    assert frame.index.name == "time"
    np.testing.assert_array_equal(frame["plant.position"].to_numpy(), objects["zv"]["plant.position"])
    assert frame.attrs["units"]["plant.position"] == "m"
    both = compare({"unshaped": objects["unshaped"], "ZV": objects["zv"]}).to_pandas()
    np.testing.assert_array_equal(both["ZV", "plant.position"].to_numpy(), objects["zv"]["plant.position"])


def test_a_missing_package_is_named(objects: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    whole = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.split(".")[0] in ("matplotlib", "pandas"):
            raise ImportError(name)
        return whole(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ShaperFmuError, match=r"needs the package matplotlib: pip install 'shaper-fmu\[plot\]'"):
        objects["sequence"].plot()
    with pytest.raises(ShaperFmuError, match=r"needs the package pandas: pip install 'shaper-fmu\[pandas\]'"):
        objects["zv"].to_pandas()


def test_names_are_text_and_never_html() -> None:
    evil = "<script>alert(1)</script>"
    results = Results(np.array([0.0, 1.0]), {evil: np.array([0.0, 2.0])}, units={evil: evil}, notes=(evil,))
    for page in (results._repr_html_(), compare({evil: results})._repr_html_()):
        assert "<script" not in page
        assert html.fragment_fromstring(page).text_content().count(evil) >= 2


def test_a_long_table_counts_what_it_leaves_out() -> None:
    page = table_html(Table("", ["n"], [[str(n)] for n in range(MOST_ROWS + 7)]))
    assert page.count("<tr>") == MOST_ROWS + 1
    assert "... and 7 more" in page


def test_what_cannot_be_plotted_is_said(objects: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match=r"there is no metric .lef.\. Did you mean .left."):
        objects["store"].plot("lef")
    with pytest.raises(ArgumentError, match="there is nothing to plot"):
        Results(np.zeros(1), {"a": np.zeros(1)}).plot()


def test_the_prompt_completes_all_public_names() -> None:
    assert set(dir(shaper_fmu)) >= {*homes("shaper_fmu"), *shaper_fmu.__all__, "sweep", "tune", "info"}
    assert all(getattr(shaper_fmu, name) is not None for name in dir(shaper_fmu))
