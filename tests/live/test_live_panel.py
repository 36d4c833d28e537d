"""The live panel of reports: it begins with the design, and its numbers are those of closed forms and of `shaper`."""

from __future__ import annotations

import math

import pytest
from browser import browser, needs_chromium
from command_line import typed

from shaper_fmu import shaper
from shaper_fmu.errors import BuildError
from shaper_fmu.live import panel
from shaper_fmu.live.identified_modes import IdentifiedModes
from shaper_fmu.live.panel import NO_COMPILER, live_panel
from shaper_fmu.page.blocks import Live, Text


def a_panel(**more) -> list:
    given = {
        "kind": "zvd", "believed": [(10.0, 0.05)], "tolerance": 0.05, "frequencies": [(9.0, 10.0, 11.0)], "dampings": [(0.05, 0.05, 0.05)],
    }  # fmt: skip
    return live_panel(**{**given, **more})


def test_the_modes_swing_as_the_formula_says():
    """A unit step's response of each mode: 1 - exp(-zeta w t) (cos wd t + zeta / sqrt(1 - zeta^2) sin wd t)."""
    modes = ((10.0, 0.05, 0.7), (23.0, 0.2, 0.3))
    plant = IdentifiedModes()
    plant.modes, plant.command = 2, 1.0
    for i, (w, zeta, part) in enumerate(modes):
        plant.natural_frequency[i], plant.damping_ratio[i], plant.share[i] = w, zeta, part
    plant.initialize(0.0)
    for k in range(1, 40):
        plant.step(0.03 * (k - 1), 0.03)
        t, expected = 0.03 * k, 0.0
        for w, zeta, part in modes:
            root = math.sqrt(1.0 - zeta * zeta)
            swing = math.cos(root * w * t) + zeta / root * math.sin(root * w * t)
            expected += part * (1.0 - math.exp(-zeta * w * t) * swing)
        assert plant.response == pytest.approx(expected, abs=1e-12)


@needs_chromium
def test_a_design_is_loaded_and_its_numbers_are_those_of_python(tmp_path):
    done = typed("design", "zvd", "-w", "10", "--damping-ratio", "0.05", "--plot", "page.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = tmp_path / "page.html"
    assert page.stat().st_size < 1_000_000
    found = shaper("zvd", 10.0, 0.05)
    with browser(tmp_path) as chromium:
        chromium.open(page.as_uri())
        chromium.run("document.querySelector('details.live').open = true; document.querySelector('.live iframe').scrollIntoView()")
        chromium.until("document.querySelector('.live iframe').contentWindow.live?.result")
        chromium.run("globalThis.inner = document.querySelector('.live iframe').contentWindow.live; 0")
        assert chromium.run("inner.state.shaper") == "zvd"
        assert chromium.run("inner.result.design.delay") == pytest.approx(list(found.delays), abs=1e-12)
        assert chromium.run("inner.result.design.amplitude") == pytest.approx(list(found.amplitudes), abs=1e-12)
        for w in (10.0, 9.1):
            chromium.run(f"inner.change({{ parameters: [{w}, 0.05] }}, true)")
            assert chromium.run("inner.result.curves.true") == pytest.approx([found.residual_vibration(w, 0.05)], abs=1e-9)
        assert (chromium.console, chromium.requests) == ([], [])


def test_there_is_none_where_the_sliders_do_not_reach():
    assert a_panel(kind="si") == []
    assert a_panel(believed=[(1000.0, 0.05)]) == []
    assert a_panel(frequencies=[(9.0, 10.0, 11.0)] * 5, dampings=[(0.0, 0.0, 0.0)] * 5) == []


def test_without_a_compiler_the_page_says_so(monkeypatch):
    def refuse(*_: object) -> None:
        raise BuildError("no compiler")

    assert isinstance(a_panel()[0], Live)
    monkeypatch.setattr(panel, "panel_data", refuse)
    assert a_panel() == [Text(NO_COMPILER)]
