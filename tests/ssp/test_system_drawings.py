"""The drawings on the pages of ssp/ are those that `shaper-fmu info FOLDER --drawing` makes of the systems as they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from shaper_fmu.drawing import write_drawing
from shaper_fmu.info.diagram import system_diagram
from shaper_fmu.info.system import ssp_info

FOLDERS = sorted(path.parent for path in (Path(__file__).parents[2] / "ssp").glob("*/SystemStructure.ssd"))


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_the_drawing_is_that_of_the_system(folder, tmp_path):
    drawn = write_drawing(tmp_path / "drawing.svg", system_diagram(ssp_info(folder, fmus=tmp_path)))
    assert drawn.read_text(encoding="utf-8") == (folder / "drawing.svg").read_text(encoding="utf-8")
    assert "](drawing.svg)" in (folder / "README.md").read_text(encoding="utf-8")
