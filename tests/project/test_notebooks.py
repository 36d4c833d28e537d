"""The notebooks in examples/ run as they are, and are kept without outputs."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))


def checked_shapers(said: str) -> None:
    """Undamped, V <= 5 % over 4/pi asin(0.05) and 4/pi asin(sqrt(0.05)) of the frequency (Singer and Seering 1990)."""
    widths = re.findall(r"over ([\d.]+) of the frequency", said)
    assert [float(width) for width in widths] == pytest.approx(
        [4.0 / math.pi * math.asin(x) for x in (0.05, math.sqrt(0.05))], abs=6e-4
    )


def checked_runs(said: str) -> None:
    """Swings of a rope of 5 m at 1.4 rad/s, sqrt(9.81 / 5) = 1.4007: ZV and ZVD leave a small share of the unshaped swing."""
    none, zv, zvd = (float(angle) for angle in re.findall(r"swings ([\d.]+) mrad", said))
    assert zvd <= zv < 0.02 * none


def checked_tune(said: str) -> None:
    assert "<Tuning: tuned, OverheadCrane.fmu, trolley_acceleration -> swing_angle: " in said


CHECKS = {"notebook_1_shapers": checked_shapers, "notebook_2_runs": checked_runs, "notebook_3_tune": checked_tune}


def test_every_notebook_has_a_check() -> None:
    assert {path.stem for path in NOTEBOOKS} == set(CHECKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path) -> None:
    book: Any = nbformat.read(path, as_version=4)
    assert path.stat().st_size < 20_000
    assert all(not cell.get("outputs") and not cell.get("execution_count") for cell in book.cells), "clear the outputs"
    NotebookClient(book, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in book.cells for output in cell.get("outputs", [])]
    CHECKS[path.stem]("".join(output["text"] for output in outputs if output.output_type == "stream"))
    shown = [kind for output in outputs for kind in output.get("data", {})]
    assert "text/html" in shown
    assert "image/png" in shown
