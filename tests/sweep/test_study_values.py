"""Values of every key of a study that are of another type, too large, not finite or empty: refused with the key and the value."""

from __future__ import annotations

import re

import pytest

from shaper_fmu.errors import StudyError
from shaper_fmu.sweep.study import read_study

RIGHT = {
    "name": '"n"', "system": '"s.ssp"', "stop_time": "1.0", "step": "0.1", "vary.x.low": "1.0", "vary.x.high": "2.0",
    "metrics.m.kind": '"final"', "metrics.m.output": '"a.b"', "compare.first.x": "1.0",
}  # fmt: skip
TEXTS = ("name", "system", "algorithm", "interpolation", "reference", "stop_when", "plan.kind", "metrics.m.kind", "metrics.m.output",
         "metrics.m.command", "metrics.m.rate", "vary.x.spacing", "vary.x.distribution", "refine.metric")  # fmt: skip
NUMBERS = ("stop_time", "step", "stop_hold", "time_limit", "vary.x.nominal", "vary.x.low", "vary.x.high", "vary.x.mean",
           "vary.x.deviation", "refine.level", "refine.width")  # fmt: skip
WHOLE = ("vary.x.points", "plan.samples", "plan.seed")
LISTS = ("vary.x.values", "vary.x.factors")
STRUCTURES = ("[1, 2]", "{ a = { b = 1 } }", "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z")
OF_NUMBERS = ("nan", "inf", "-inf", "1" + "0" * 400, "1e400", '""', '"fast"', "true")


CASES = [
    *[(key, value) for key in TEXTS for value in (*STRUCTURES, "1", "true", '""')],
    *[(key, value) for key in NUMBERS for value in (*STRUCTURES, *OF_NUMBERS)],
    *[(key, value) for key in WHOLE for value in (*STRUCTURES, "nan", "inf", "1.5", '"3"', "true", "-1")],
    *[
        (key, value)
        for key in LISTS
        for value in ("[]", "[[1]]", "[nan]", "[{}]", "1", "nan", "true", "1979-05-27", "[1979-05-27]")
    ],
    *[("compare.first.x", value) for value in (*STRUCTURES, "nan", "-inf", "1" + "0" * 400, "[]", "{}")],
    *[(key, '"a\\u0000b"') for key in ("name", "system", "stop_when", "metrics.m.output", "metrics.m.command")],
    ("time_limit", "1e300"),
    ("vary.x.high", "1.7e308"),
]


def written(key: str, value: str) -> str:
    lines = dict(RIGHT)
    if key in ("plan.samples", "plan.seed"):
        lines |= {"plan.kind": '"random"', "plan.samples": "3"}
    if key.startswith("refine"):
        lines |= {"refine.metric": '"m"', "refine.level": "0.5", "refine.width": "0.1"}
    if key in ("metrics.m.command", "metrics.m.rate"):
        lines |= {"metrics.m.kind": '"envelope"', "metrics.m.command": '"a.c"', "metrics.m.rate": '"a.d"'}
        lines["metrics.m.natural_frequency"] = "1.0"
    if key == "vary.x.factors":
        lines["vary.x.nominal"] = "1.0"
    if key == "vary.x.high" and value == "1.7e308":
        lines["vary.x.low"] = "-1.7e308"
    lines[key] = value
    return "\n".join(f"{name} = {text}" for name, text in lines.items())


@pytest.mark.parametrize(("key", "value"), CASES)
def test_hostile_values(tmp_path, key, value):
    path = tmp_path / "study.toml"
    path.write_text(written(key, value))
    with pytest.raises(StudyError) as caught:
        _ = read_study(path).points
    words = str(caught.value)
    assert str(path) in words or "vary.x" in words
    assert re.search(rf"\b{key.split('.')[-1]}\b", words), words


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("compare.first.x", "[1, 2]", "compare.first.x = [1, 2]"),
        ("vary.x.low", '"fast"', "vary.x.low = 'fast'"),
        ("vary.x.values", "[1.0, [2.0]]", "vary.x.values[1] = [2.0]"),
        ("plan.seed", "-1", "plan.seed = -1 must not be negative"),
        ("stop_time", "true", "stop_time = True"),
    ],
)
def test_the_whole_key_and_the_value_are_told(tmp_path, key, value, told):
    (tmp_path / "study.toml").write_text(written(key, value))
    with pytest.raises(StudyError, match=re.escape(told)):
        read_study(tmp_path / "study.toml")
