"""The report of a run: its system as a drawing, commands over what they shape, values of a kind together, runs over each other."""

from __future__ import annotations

import numpy as np
import pytest

from shaper_fmu import System
from shaper_fmu.page.blocks import Drawing, Table, page_text
from shaper_fmu.page.figures import Figure
from shaper_fmu.report.run import run_blocks

HOSTILE = "s<script>x</script>"


def spring(fmus, shaper: str = "zv", name: str = "spring") -> System:
    """A ZV-shaped move of 2 m, as the force on a spring of 100 N/m."""
    system = System(name)
    system.add("profile", fmus / "MotionProfile.fmu", profile="trapezoid", distance=2.0, duration=1.0, max_velocity=4.0)
    system.add("shaper", fmus / "InputShaper.fmu", shaper=shaper, natural_frequency=[np.pi / 0.3, 1, 1, 1], damping_ratio=[0.0] * 4)
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.connect("profile.position", "shaper.command", gain=3.0)
    system.connect("shaper.shaped", "plant.force")
    return system


@pytest.fixture(scope="module")
def blocks(fmus):
    system = spring(fmus)
    return run_blocks(system.simulate(3.0, 0.01), system)


def figures(blocks: list) -> dict[str, Figure]:
    return {block.key: block for block in blocks if isinstance(block, Figure)}


def test_the_system_is_drawn_first(blocks):
    assert isinstance(blocks[0], Drawing)
    for word in ("profile", "shaper", "plant", "MassSpringDamper"):
        assert word in blocks[0].svg
    assert blocks[0].svg in page_text("Run", blocks)


def test_the_command_is_drawn_over_its_reference(blocks):
    """In the shaper's measure, 3 x: an undamped ZV shaper is the mean of it and of what it was half a period, 0.3 s or 30 steps, ago."""
    figure = figures(blocks)["command_1"]
    reference, shaped = figure.lines
    assert (reference.name, shaped.name) == ("profile.position (* 3)", "shaper.shaped")
    assert (reference.y[0], reference.y[-1]) == (0.0, pytest.approx(6.0))
    np.testing.assert_allclose(shaped.y[30:], 0.5 * (reference.y[30:] + reference.y[:-30]), atol=1e-9)


def test_switches_are_apart_from_numbers(blocks):
    switches = figures(blocks)["response_switches"]
    assert {line.name for line in switches.lines} == {"profile.moving", "shaper.settled"}
    assert all(set(line.y) <= {0.0, 1.0} for line in switches.lines)
    assert not any(line.name in ("profile.moving", "shaper.settled") for line in figures(blocks)["response_number"].lines)


def test_runs_are_drawn_over_each_other(fmus):
    runs = {shaper: spring(fmus, shaper).simulate(3.0, 0.01) for shaper in ("none", "zv")}
    found = run_blocks(runs, spring(fmus))
    assert [line.name for line in figures(found)["command_1"].lines] == [
        "profile.position (* 3), none", "shaper.shaped, none", "profile.position (* 3), zv", "shaper.shaped, zv",
    ]  # fmt: skip
    assert {"plant.position, none", "plant.position, zv"} <= {line.name for line in figures(found)["response_m"].lines}
    assert [block.title for block in found if isinstance(block, Table)] == ["Recorded variables, none", "Recorded variables, zv"]


def test_a_systems_name_is_text(fmus):
    system = spring(fmus, name=HOSTILE)
    page = page_text(HOSTILE, run_blocks(system.simulate(0.1, 0.01), system))
    assert "<script>x" not in page
    assert "s&lt;script&gt;x" in page
