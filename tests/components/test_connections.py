"""Connections: gain and offset, conversion of units, arrays, types; in systems of FMI 2.0 and FMI 3.0."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.master.system import System
from shaper_fmu.registry import load_components

SOURCE = '''\
"""Values to be connected."""

from shaper_fmu.component import Component, Input, Output, Parameter


class Source(Component):
    """Constant outputs of several units, types and sizes."""

    base = Parameter(2.0, "m", "what the outputs follow")
    length = Output("mm", "a length", depends=())
    angle = Output("deg", "an angle", depends=())
    lengths = Output("m", "three lengths", size=3, depends=())
    count = Output("", "a number", start=0, depends=())
    on = Output("", "a switch", start=False, depends=())

    def step(self, t, h):
        self.length = 1000.0 * self.base
        self.angle = 90.0 * self.base
        for i in range(3):
            self.lengths[i] = self.base + i
        self.count = 7
        self.on = True


class Sink(Component):
    """Passes its inputs on."""

    length = Input("m", "a length")
    angle = Input("rad", "an angle")
    lengths = Input("m", "three lengths", size=3)
    pair = Input("m", "two lengths", size=2)
    count = Input("", "a number", start=0)
    on = Input("", "a switch", start=False)
    number = Input("", "a real number")
    seen_length = Output("m", "the length")
    seen_angle = Output("rad", "the angle")
    seen_lengths = Output("m", "the lengths", size=3)
    seen_count = Output("", "the number", start=0)
    seen_on = Output("", "the switch", start=False)
    seen_number = Output("", "the real number")

    def step(self, t, h):
        self.seen_length = self.length
        self.seen_angle = self.angle
        for i in range(3):
            self.seen_lengths[i] = self.lengths[i]
        self.seen_count = self.count
        self.seen_on = self.on
        self.seen_number = self.number
'''


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> dict[tuple[str, int], Path]:
    folder = tmp_path_factory.mktemp("parts")
    (folder / "parts.py").write_text(SOURCE)
    return {
        (component.__name__, fmi): build_fmu(component, folder / str(fmi), fmi=fmi, platforms=["this"])
        for component in load_components(folder / "parts.py")
        for fmi in (2, 3)
    }


@pytest.fixture(params=[(2, 2), (2, 3), (3, 2), (3, 3)], ids=lambda versions: f"{versions[0]}to{versions[1]}")
def pair(parts, request) -> System:
    system = System("pair")
    system.add("source", parts["Source", request.param[0]])
    zeros = {"pair[1]": 0.0, "pair[2]": 0.0, "number": 0.0, "length": 0.0, "angle": 0.0, "count": 0, "on": False}
    lengths = {f"lengths[{i}]": 0.0 for i in (1, 2, 3)}
    system.add("sink", parts["Sink", request.param[1]], {**zeros, **lengths})
    return system


def last(system: System, name: str) -> float:
    return float(system.simulate(0.2, 0.1)[name][-1])


def test_units_of_one_kind_are_converted(pair):
    """2000 mm are 2 m; 180 degrees are pi."""
    pair.connect("source.length", "sink.length")
    pair.connect("source.angle", "sink.angle")
    assert last(pair, "sink.seen_length") == pytest.approx(2.0, rel=1e-15)
    assert last(pair, "sink.seen_angle") == pytest.approx(math.pi, rel=1e-15)


def test_gain_and_offset_are_in_the_sources_unit(pair):
    pair.connect("source.length", "sink.length", gain=-0.5, offset=300.0)
    assert last(pair, "sink.seen_length") == pytest.approx(-0.7, rel=1e-15)  # (-1000 + 300) mm


def test_arrays_are_connected_as_a_whole_or_by_elements(pair):
    versions = [pair.fmus[name].version for name in ("source", "sink")]
    if versions == [3, 3]:
        pair.connect("source.lengths", "sink.lengths")
        assert [last(pair, f"sink.seen_lengths[{i}]") for i in (1, 2, 3)] == [2.0, 3.0, 4.0]
        with pytest.raises(ModelError, match=r"source.lengths has 3 elements but sink.pair has 2"):
            pair.connect("source.lengths", "sink.pair")
    else:
        pair.connect("source.lengths[3]", "sink.lengths[1]", gain=2.0)
        assert [last(pair, f"sink.seen_lengths[{i}]") for i in (1, 2, 3)] == [8.0, 0.0, 0.0]


def test_elements_that_nothing_feeds_keep_their_start_values(pair):
    pair.set("sink.lengths[2]", 5.0)
    pair.connect("source.lengths[1]", "sink.lengths[3]")
    assert [last(pair, f"sink.seen_lengths[{i}]") for i in (1, 2, 3)] == [0.0, 5.0, 2.0]


def test_integers_and_booleans_arrive_and_an_integer_may_feed_a_real(pair):
    pair.connect("source.count", "sink.count")
    pair.connect("source.on", "sink.on")
    pair.connect("source.count", "sink.number", gain=0.5)
    assert [last(pair, f"sink.seen_{name}") for name in ("count", "on", "number")] == [7.0, 1.0, 3.5]


@pytest.mark.parametrize(
    ("source", "target", "options", "words"),
    [
        ("source.angle", "sink.length", {}, "source.angle is in deg but sink.length in m; they cannot be connected"),
        ("source.length", "sink.count", {}, "source.length is of type .* but sink.count of type"),
        ("source.on", "sink.number", {}, "source.on is of type Boolean but sink.number of type"),
        ("source.count", "sink.count", {"gain": 2.0}, "only real inputs can be given a gain or an offset"),
        ("source.length", "sink.length", {"offset": math.inf}, "gain 1.0 and offset inf must be finite numbers"),
        ("source.length", "sink.seen_length", {}, "sink.seen_length: .* has no input 'seen_length'"),
    ],
)
def test_what_does_not_fit_is_refused(pair, source, target, options, words):
    with pytest.raises(ModelError, match=words):
        pair.connect(source, target, **options)
    assert not pair.connections
