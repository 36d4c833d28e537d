"""Looking at things: drawings, stores, systems as folders."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from command_line import typed
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from shaper_fmu import load_ssp
from shaper_fmu.drawing import Box, Diagram, Port, Wire, svg_of, write_drawing
from shaper_fmu.drawing.layout import layout

SYSTEMS = Path(__file__).parents[2] / "ssp"
NAMES = sorted(path.name for path in SYSTEMS.iterdir() if (path / "SystemStructure.ssd").is_file())


def svg(path: Path) -> etree._Element:
    return etree.fromstring(path.read_bytes())


def texts(root: etree._Element) -> list[str]:
    return ["".join(map(str, one.itertext())) for one in root.iter("{*}text")]


@pytest.mark.representatives(name=["nested_crane", "hoisting_crane"])
@pytest.mark.parametrize("name", NAMES)
def test_every_element_connector_and_connection_is_drawn(name: str, tmp_path: Path) -> None:
    done = typed("info", SYSTEMS / name, "--drawing", "out.svg", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "wrote out.svg" in done.stdout
    facts = json.loads(typed("info", SYSTEMS / name, "--json", cwd=tmp_path).stdout)
    drawn = texts(svg(tmp_path / "out.svg"))
    wires = 0
    pending = [facts["system"]]
    while pending:
        element = pending.pop()
        pending += element["elements"]
        wires += len(element["connections"])
        for one in element["elements"]:
            assert one["name"] in drawn
            for port in one["connectors"]:
                if port["kind"] in ("input", "output") and one["kind"] == "component":
                    assert (f"{port['name']} [{port['unit']}]" if port["unit"] else port["name"]) in drawn
    assert len(svg(tmp_path / "out.svg").findall(".//{*}polyline")) == wires


def test_an_fmu_is_a_box_with_its_units(fmus: Path, tmp_path: Path) -> None:
    typed("info", fmus / "MassSpringDamper.fmu", "--drawing", "spring.svg", cwd=tmp_path)
    assert {"MassSpringDamper", "force [N]", "position [m]", "velocity [m/s]"} <= set(texts(svg(tmp_path / "spring.svg")))


@st.composite
def diagrams(draw: st.DrawFn) -> Diagram:
    """Any wires between a few boxes and the outside, loops and wires to the box itself too."""
    n = draw(st.integers(1, 7))
    boxes = [Box(f"b{i}", "box", [Port("i", "N"), Port("j")], [Port("o", "m"), Port("p")]) for i in range(n)]
    names = ["", *(box.name for box in boxes)]
    ends = st.tuples(st.sampled_from(names), st.booleans(), st.sampled_from(names), st.booleans())
    wires = [
        Wire(a, ("op" if a else "xy")[k], b, ("ij" if b else "uv")[m]) for a, k, b, m in draw(st.lists(ends, max_size=20)) if a or b
    ]
    return Diagram("any", boxes, wires, [Port("x"), Port("y", "s")], [Port("u"), Port("v")])


@given(diagrams())
def test_boxes_never_overlap_and_wires_end_at_their_connectors(diagram: Diagram) -> None:
    placed = layout(diagram)
    framed = [one for one in placed.boxes if one.framed]
    for i, one in enumerate(framed):
        assert 0.0 <= one.x <= one.x + one.width <= placed.width
        assert 0.0 <= one.y <= one.y + one.height <= placed.height
        for other in framed[:i]:
            beside = one.x >= other.x + other.width or other.x >= one.x + one.width
            assert beside or one.y >= other.y + other.height or other.y >= one.y + one.height
    by_name = {one.box.name: one for one in framed}
    assert len(placed.wires) == len(diagram.wires)
    for wire, points in placed.wires:
        assert all(a[0] == b[0] or a[1] == b[1] for a, b in pairwise(points)), "only straight lines"
        assert all(-0.01 <= x <= placed.width + 0.01 and -0.01 <= y <= placed.height + 0.01 for x, y in points)
        if wire.source:
            assert points[0] == by_name[wire.source].end("out", wire.source_port)
        if wire.target:
            assert points[-1] == by_name[wire.target].end("in", wire.target_port)
        for one in framed:  # no vertical line goes through a box
            for (x, y), (_, z) in pairwise(points):
                crosses = one.x < x < one.x + one.width and min(y, z) < one.y + one.height and max(y, z) > one.y and y != z
                assert not crosses
    etree.fromstring(svg_of(diagram))


def test_names_are_text(tmp_path: Path) -> None:
    evil = '<script>&"'
    path = write_drawing(tmp_path / "evil.svg", Diagram(evil, [Box(evil, evil, [Port(evil, evil)])], remark=evil))
    assert not svg(path).findall(".//{*}script")
    assert evil in texts(svg(path))


def test_a_folder_runs_without_an_archive(fmus: Path, tmp_path: Path) -> None:
    shutil.copytree(SYSTEMS / "overhead_crane", tmp_path / "crane")
    (tmp_path / "fmus").symlink_to(fmus)
    whole = typed("run", "crane", "--stop-time", "1", cwd=tmp_path)
    assert whole.returncode == 0, whole.stderr
    typed("build", "crane", cwd=tmp_path)
    assert whole.stdout == typed("run", "crane.ssp", "--stop-time", "1", cwd=tmp_path).stdout
    assert typed("run", "fmus", cwd=tmp_path).stderr.count("no SystemStructure.ssd in this folder") == 1


def test_a_study_builds_the_archive_that_is_missing(fmus: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(SYSTEMS / "overhead_crane", tmp_path / "ssp" / "overhead_crane")
    study = (folder / "study.toml").read_text().replace("points = 13", "points = 2")
    (folder / "study.toml").write_text(study)
    (tmp_path / "fmus").symlink_to(fmus)
    done = typed("sweep", "ssp/overhead_crane", "--workers", "0", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "built ssp/overhead_crane.ssp for this machine, from its folder" in done.stdout
    shown = typed("info", "results/overhead_crane.sqlite", cwd=tmp_path).stdout
    assert "Overhead crane: wrong rope length: 9 of 9 done" in shown  # the nominal length is added to the two
    assert "crane.initial_rope_length" in shown
    facts = json.loads(typed("info", "results/overhead_crane.sqlite", "--json", cwd=tmp_path).stdout)
    assert facts["runs"] == {"done": 9}
    (tmp_path / "report.html").write_text("<title>Another study</title>")
    refused = typed("report", "results/overhead_crane.sqlite", cwd=tmp_path)
    assert refused.returncode == 2
    assert "report.html is there already, not made by this call" in " ".join(refused.stderr.replace("│", " ").split())
    assert (tmp_path / "report.html").read_text() == "<title>Another study</title>"
    assert "a store has none" in typed("info", "results/overhead_crane.sqlite", "--drawing", "x.svg", cwd=tmp_path).stderr


def test_a_folder_loads_in_python(fmus: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fmus").symlink_to(fmus)
    assert list(load_ssp(SYSTEMS / "overhead_crane").system.fmus) == ["profile", "shaper", "crane"]


def test_an_enumeration_tells_its_numbers(fmus: Path, tmp_path: Path) -> None:
    """Numbers as docs/components.md has them: they never change."""
    assert "shaper: none = 1, zv = 2, zvd = 3" in typed("info", fmus / "InputShaper.fmu", cwd=tmp_path).stdout
