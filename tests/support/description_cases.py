"""What the tests of the model descriptions share: every component, and their descriptions as fmpy reads them."""

from __future__ import annotations

import io
import zipfile

import pytest
from fmpy import read_model_description
from fmpy.model_description import ModelDescription
from lxml import etree

from shaper_fmu.component import Component, Input, Local, Output, Parameter, State
from shaper_fmu.export.model_description import fmi2_native_description, fmi3_native_description
from shaper_fmu.registry import components

TOKEN = "{12345678-1234-1234-1234-123456789abc}"
STARTED = ("input", "parameter")


class Ring(Component):
    """Three masses in a row, of arrays alone: a component with array states, an integer input and a variable called time.

    - position and speed are continuous states.
    """

    continuous_states = ("position", "speed")

    push = Input("N", "force on each mass", size=3)
    gear = Input("", "factor of the force", start=1)
    mass = Parameter([1.0, 2.0, 4.0], "kg", "masses", size=3, min=0.0, exclusive=True)
    time = Output("s", "age of the last step", depends=())
    position = Output("m", "positions", size=3, depends=(), derivative="speed")
    speed = Local("m/s", "speeds", size=3, derivative="rate")
    rate = Local("m/s2", "accelerations", size=3)
    steps = State(0)

    def step(self, t, h):
        self.steps += 1
        for i in range(3):
            self.rate[i] = self.gear * self.push[i] / self.mass[i]
            self.position[i] += self.speed[i] * h + 0.5 * self.rate[i] * h * h
            self.speed[i] += self.rate[i] * h
        self.time = h


ALL: dict[str, type[Component]] = {**components(), "Ring": Ring}
every_component = pytest.mark.parametrize("name", ALL)
both_versions = pytest.mark.parametrize("version", ["2", "3"])


def description_of(name: str, version: str) -> bytes:
    make = fmi2_native_description if version == "2" else fmi3_native_description
    return make(ALL[name], TOKEN, "the test")


def read_back(xml: bytes) -> ModelDescription:
    """What fmpy makes of an archive with this description, with all its checks."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("modelDescription.xml", xml)
    archive.seek(0)
    return read_model_description(archive, validate=True, validate_variable_names=True, validate_model_structure=True)


def described(name: str, version: str) -> ModelDescription:
    return read_back(description_of(name, version))


def element(root: etree._Element, tag: str) -> etree._Element:
    """The one child of this name."""
    found = root.findall(tag)
    assert len(found) == 1
    return found[0]


def unknowns(description: ModelDescription, kind: str) -> list[tuple[str, list[str]]]:
    """Name and knowns of each "outputs", "derivatives" or "initialUnknowns"."""
    found = []
    for unknown in getattr(description, kind):
        assert unknown.dependencies is not None
        found.append((unknown.variable.name, [v.name for v in unknown.dependencies]))
    return found
