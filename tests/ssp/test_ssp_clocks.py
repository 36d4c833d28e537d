"""SSP 2.0 archives that connect clocks of FMI 3.0 run as the same system in Python does; what cannot is refused by check and run."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from clocked_fmus import KINDS, clocked_fmu, constant

from shaper_fmu.errors import ModelError
from shaper_fmu.master.system import System
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.check import check_ssp

NAMES = " ".join(
    f'xmlns:{prefix}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for prefix, name in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"))
)


def given(**values: float) -> str:
    numbers = "".join(
        f'<ssv:Parameter name="{name}"><ssv:{"Int32" if isinstance(value, int) else "Float64"} value="{value}"/></ssv:Parameter>'
        for name, value in values.items()
    )
    parameters = f'<ssv:ParameterSet version="2.0" name="p"><ssv:Parameters>{numbers}</ssv:Parameters></ssv:ParameterSet>'
    return f"<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>{parameters}</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"


def component(name: str, connectors: str, values: str = "") -> str:
    source = f'type="application/x-fmu-sharedlibrary" source="resources/{name}.fmu"'
    return f'<ssd:Component name="{name}" {source}><ssd:Connectors>{connectors}</ssd:Connectors>{values}</ssd:Component>'


def connection(start: str, end: str, inner: str = "") -> str:
    ends = [f'{side}Element="{name.split(".")[0]}" ' if "." in name else "" for side, name in (("start", start), ("end", end))]
    connectors = f'startConnector="{start.split(".")[-1]}" endConnector="{end.split(".")[-1]}"'
    return f"<ssd:Connection {ends[0]}{ends[1]}{connectors}>{inner}</ssd:Connection>"


CLOCK, REAL = "<ssc:Clock/>", "<ssc:Float64/>"
OUT = f'<ssd:Connector name="out" kind="output">{CLOCK}</ssd:Connector>'
TRIG = f'<ssd:Connector name="trig" kind="input">{CLOCK}</ssd:Connector>'
Y = f'<ssd:Connector name="y" kind="output">{REAL}<ssd:Clock name="c"/></ssd:Connector>'
U = f'<ssd:Connector name="u" kind="input">{REAL}</ssd:Connector>'
W = f'<ssd:Connector name="w" kind="input">{REAL}<ssd:Clock name="trig"/></ssd:Connector>'
C = f'<ssd:Connector name="c" kind="input">{CLOCK}</ssd:Connector>'
A = component("a", OUT + Y + U + C, given(interval=0.0371, shift=0.0123, every=3, u=2.0))
B = component("b", TRIG + W, given(kind=KINDS["countdown"]))
CLOCKS, VALUES = connection("a.out", "b.trig"), connection("a.y", "b.w")


def archive(path: Path, elements: str, connections: str) -> Path:
    """The system in SSP 2.0, of a sampler a and what it triggers, b."""
    system = f'<ssd:System name="root"><ssd:Elements>{elements}</ssd:Elements><ssd:Connections>{connections}</ssd:Connections></ssd:System>'
    with zipfile.ZipFile(path, "w") as written:
        written.writestr(
            "SystemStructure.ssd",
            f'<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription {NAMES} version="2.0" name="clocks">{system}'
            "</ssd:SystemStructureDescription>",
        )
        written.write(clocked_fmu(constant(0.0371, 0.0123)), "resources/a.fmu")
        written.write(clocked_fmu(), "resources/b.fmu")
    return path


INNER = (
    f'<ssd:System name="inner"><ssd:Connectors>{TRIG}{W}</ssd:Connectors><ssd:Elements>{B}</ssd:Elements>'
    f"<ssd:Connections>{connection('trig', 'b.trig')}{connection('w', 'b.w')}</ssd:Connections></ssd:System>"
)
NESTED = connection("a.out", "inner.trig") + connection("a.y", "inner.w")


@pytest.mark.parametrize(("elements", "connections", "b"), [(A + B, CLOCKS + VALUES, "b"), (A + INNER, NESTED + "", "inner.b")])
def test_connected_clocks_run(elements, connections, b, tmp_path):
    path = archive(tmp_path / "x.ssp", elements, connections)
    assert [str(one) for one in check_ssp(path)] == []
    found = load_ssp(path).simulate(1.0, 0.05)
    system = System()
    system.add("a", clocked_fmu(constant(0.0371, 0.0123)), interval=0.0371, shift=0.0123, every=3, u=2.0)
    system.add("b", clocked_fmu(), kind=KINDS["countdown"])
    system.connect("a.out", "b.trig")
    system.connect("a.y", "b.w")
    expected = system.simulate(1.0, 0.05)
    assert expected["b.heard"][-1] == 9.0  # of 27 ticks every third
    for name in ("heard", "z"):
        assert found[f"{b}.{name}"].tolist() == expected[f"b.{name}"].tolist()


@pytest.mark.parametrize(
    ("connections", "words"),
    [
        (VALUES, "clock b.trig ticks when another clock does, but nothing is connected to it: connect an output clock"),
        (connection("a.out", "b.w"), "a.out -> b.w: a clock cannot become a real"),
        (CLOCKS + VALUES + connection("a.out", "a.c"), "ticks at its own times"),
        (CLOCKS + VALUES + connection("a.out", "b.trig"), "b.trig is driven twice"),
        (VALUES + connection("a.out", "b.trig", '<ssc:LinearTransformation factor="2"/>'), "linear transformation .* a clock"),
    ],
)
def test_what_cannot_be_run_is_refused_by_name_in_check_and_run(connections, words, tmp_path):
    path = archive(tmp_path / "x.ssp", A + B, connections)
    with pytest.raises(ModelError, match=words):
        load_ssp(path).simulate(1.0, 0.05)
    with pytest.raises(ModelError, match=words):
        raise ModelError([str(one) for one in check_ssp(path)])
