"""`shaper-fmu reproduce`: what it prints and writes, and how it exits."""

from __future__ import annotations

import re
import types
from html.parser import HTMLParser

import numpy as np
import pytest
from command_line import typed
from test_cli import PNG
from typer.testing import CliRunner

from shaper_fmu import System, fmu_path
from shaper_fmu.cli import reproduce as cli_reproduce
from shaper_fmu.cli.main import app
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.reproduce.claims import Claim, Reproduction


class Headings(HTMLParser):
    """The cells of a page's first table."""

    def __init__(self):
        super().__init__()
        self.cells: list[str] = []
        self.open = self.done = False

    def handle_starttag(self, tag, attrs):
        self.open = tag in ("td", "th") and not self.done

    def handle_endtag(self, tag):
        self.open = False
        self.done = self.done or tag == "table"

    def handle_data(self, data):
        if self.open:
            self.cells.append(data)


def paper(damping: float):
    """A paper whose study is one run of a plant with this damping [N.s/m]."""

    def reproduce(update) -> Reproduction:
        system = System()
        system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), force=100.0, damping=damping)
        results = system.simulate(1.0, 0.5)
        update(1, 1)
        last = results["plant.position"][-1]
        claim = Claim("[red] it rests at 2 m", f"{last:.3f} m", "not reproduced", "1 % of <what> it says")
        figure = Figure("run", "Run", "time [s]", "position [m]", [Line("x", results.time, np.asarray(results["plant.position"]))])
        return Reproduction("small", "A small paper", "Nobody 2000", [claim], [figure])

    return reproduce


@pytest.fixture
def small(monkeypatch):
    """Two papers in the place of the real ones: one that runs, one whose run fails."""
    for name, damping in (("small", 1.0), ("faulty", -1.0)):
        module = types.ModuleType(f"shaper_fmu.reproduce.{name}.paper")
        module.__dict__["reproduce"] = paper(damping)
        monkeypatch.setitem(__import__("sys").modules, module.__name__, module)
    monkeypatch.setattr(cli_reproduce, "NAMES", ("small", "faulty"))


def test_a_claim_that_does_not_hold_is_no_fault(small, tmp_path):
    done = CliRunner().invoke(app, ["reproduce", "small", "--output", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "- not reproduced: [red] it rests at 2 m" in done.output  # plain when piped, and no markup
    assert "small: 1 not reproduced" in done.output
    page = Headings()
    page.feed((tmp_path / "out" / "reproduce_small.html").read_text())
    assert page.cells[:4] == ["claim", "found", "verdict", "why"]
    assert page.cells[4] == "[red] it rests at 2 m"
    assert (tmp_path / "out" / "reproduce_small_run.png").read_bytes().startswith(PNG)


def test_a_run_that_fails_is_named_and_the_others_go_on(small, tmp_path):
    done = CliRunner().invoke(app, ["reproduce", "all", "--output", str(tmp_path)])
    assert done.exit_code == 1
    assert re.search(r"error: faulty: .*damping", done.output)
    assert (tmp_path / "reproduce_small.html").exists()
    assert not (tmp_path / "reproduce_faulty.html").exists()


def test_an_unknown_name_is_wrong_usage(tmp_path):
    done = typed("reproduce", "two-prat", cwd=tmp_path)
    assert done.returncode == 2
    assert "there is no 'two-prat'. Did you mean 'two-part'?" in " ".join(done.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_help_tells_every_name(tmp_path):
    done = typed("reproduce", "--help", cwd=tmp_path)
    for name in ("pwm", "s-curve", "two-part", "partial-modes", "unknown-parameters", "all"):
        assert name in done.stdout
