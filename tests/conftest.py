"""What the tests share: the built FMUs, and a small component of a user's own."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

from shaper_fmu.component import Component
from shaper_fmu.export.build import build_fmu
from shaper_fmu.registry import components, load_components

settings.register_profile("development", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)  # the same examples in every run
signal.signal(signal.SIGINT, signal.default_int_handler)  # programs started in the background ignore it, and theirs would, too
settings.load_profile("ci" if os.environ.get("CI") else "development")


@pytest.fixture(scope="session")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the native FMUs of all components, FMI 2.0, for this machine."""
    folder = tmp_path_factory.mktemp("fmus")
    found = list(components().values())
    if os.environ.get("PYTEST_XDIST_WORKER", "gw0")[-1] in "13579":
        found.reverse()  # workers with an empty cache compile half of them each, and find the others
    for component in found:
        build_fmu(component, folder, platforms=["this"])
    return folder


@pytest.fixture(scope="session")
def python_fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same by the python backend."""
    folder = tmp_path_factory.mktemp("python_fmus")
    for component in components().values():
        build_fmu(component, folder, backend="python")
    return folder


GAIN = '''\
"""A gain, as a user would write it."""

from shaper_fmu.component import Component, Input, Output, Parameter


class Gain(Component):
    """Multiplies its input: result = {factor} factor value."""

    messages = {{7: "a load of 100% is too much for %s, value = {{value}}"}}

    value = Input("", "what comes in")
    factor = Parameter(1.0, "", "gain")
    result = Output("", "what goes out")

    def step(self, t, h):
        if self.value > 1000.0:
            return 7
        self.result = {factor} * self.factor * self.value
'''


def gain_component(folder: Path, factor: float) -> type[Component]:
    """The component of a file gain.py in this folder that multiplies by `factor`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "gain.py").write_text(GAIN.format(factor=factor))
    return load_components(folder / "gain.py")[0]
