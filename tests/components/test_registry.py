"""Finding components."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from conftest import gain_component
from outside_packages import announced

from shaper_fmu.errors import ComponentError
from shaper_fmu.registry import components, find_component, load_components


def test_built_in_components_are_found():
    assert {"InputShaper", "MotionProfile", "MassSpringDamper", "OverheadCrane"} <= set(components())


def test_bases_without_a_step_are_no_components():
    assert "Integrated" not in components()


def test_an_unknown_name_suggests_the_nearest():
    with pytest.raises(ComponentError, match=r"no component 'InputShapre'. Did you mean 'InputShaper'\?"):
        find_component("InputShapre")


def test_third_parties_announce_components_by_entry_point(tmp_path, monkeypatch):
    (tmp_path / "their_plant.py").write_text(
        textwrap.dedent('''\
        from shaper_fmu.component import Component, Output


        class TheirPlant(Component):
            """A plant of somebody else's."""

            level = Output("m", "level")

            def step(self, t, h):
                self.level = t + h
        ''')
    )
    announced(tmp_path, {"shaper_fmu.components": {"theirs": "their_plant"}})
    monkeypatch.syspath_prepend(str(tmp_path))
    assert components()["TheirPlant"].__module__ == "their_plant"


def test_a_users_file_gives_its_components(tmp_path):
    assert gain_component(tmp_path, 2.0).__name__ == "Gain"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("x = 1\n", "no subclass of shaper_fmu.Component"),
        ("import nowhere_at_all\n", "ModuleNotFoundError"),
        ("def :\n", "SyntaxError"),
    ],
)
def test_a_file_without_components_is_refused(tmp_path, content, words):
    (tmp_path / "wrong.py").write_text(content)
    with pytest.raises(ComponentError, match=words):
        load_components(tmp_path / "wrong.py")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ComponentError, match="no such file"):
        load_components(tmp_path / "none.py")


@pytest.mark.parametrize("name", ["plants.py", "plants/__init__.py"])
def test_plants_of_the_users_own_do_not_hide_ours(tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("raise RuntimeError('the user has plants, too')\n")
    code = "from shaper_fmu import components; print(*components())"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert "OverheadCrane" in done.stdout.split()
