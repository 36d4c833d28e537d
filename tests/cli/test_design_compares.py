"""`shaper-fmu design zv zvd ei`: two tables that fit a terminal of 80 columns, one page.

Expected: the delays of ZV and ZVD, half a damped period and a whole one; V of ZV and ZVD without damping, |cos(pi r / 2)| and its
square (Singer and Seering 1990); EI leaves its tolerance at the design frequency (Singhose, Seering and Singer 1994).
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from command_line import typed


def compared(tmp_path: Path, *words: str) -> dict[str, list[float]]:
    done = typed("design", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in done.stdout.splitlines() if line.startswith("│")]
    assert max(len(line) for line in done.stdout.splitlines()[1:]) <= 80
    found: dict[str, list[float]] = {}
    for kind, *cells in rows:  # of the first table, then of the second one
        found.setdefault(kind, []).extend(float(cell) for cell in cells)
    return found


def test_the_table(tmp_path):
    found = compared(tmp_path, "zv", "zvd", "ei", "um_zv", "three_hump_ei", "-f", "5")
    assert list(found) == ["zv", "zvd", "ei", "um_zv", "three_hump_ei"]
    for kind, power in (("zv", 1), ("zvd", 2)):
        delay, periods, impulses, _, largest, *v = found[kind]
        assert (delay, periods, impulses) == (pytest.approx(0.1 * power), 0.5 * power, power + 1)
        expected = [100.0 * abs(math.cos(0.5 * math.pi * ratio)) ** power for ratio in (0.8, 0.9, 1.0, 1.1, 1.2)]
        assert v == pytest.approx(expected, rel=5e-3, abs=1e-9)
        assert largest == 1.0
    assert found["ei"][7] == pytest.approx(5.0)
    assert found["ei"][3] > found["zvd"][3] > found["zv"][3]  # insensitivity
    assert found["um_zv"][:3] == pytest.approx([0.2 / 3.0, 1.0 / 3.0, 3], rel=1e-3)  # undamped: 0, T/6, T/3


def test_one_page_or_picture(tmp_path):
    done = typed("design", "zv", "zvd", "-f", "5", "-z", "5%", "--plot", "k.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "k.html").read_text()
    assert "zv, zvd for 31.4159 rad/s (5 Hz)" in page
    assert "Residual vibration V [%]" in page
    assert (tmp_path / "k_sensitivity.png").stat().st_size > 1000
    assert typed("design", "zv", "zvd", "-f", "5", "--plot", "k.svg", cwd=tmp_path).returncode == 0
    assert b"<svg" in (tmp_path / "k.svg").read_bytes()


def test_the_page_of_a_band_names_the_band(tmp_path):
    """It was called "fastest for 10 rad/s"."""
    limits = ["--max-velocity", "1", "--max-acceleration", "3"]
    done = typed(
        "design", "fastest", "--low", "4.5", "--high", "5.5", "--tolerance", "5%", *limits, "--plot", "b.html", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "fastest for 4.5 to 5.5 rad/s (0.7162 to 0.8754 Hz)" in (tmp_path / "b.html").read_text()


MISTAKES = {
    "zv cycloid -f 5": "'cycloid' is no shaper; only shapers are compared",
    "zv zvf -f 5": "Did you mean 'zv'?",
    "zv zvd": "--natural-frequency: give at least one",
    "zv si -f 5": "si needs --low and --high",
    "zv zvd -f 5 -z 0.1 -z 0.2": "2 damping ratios for 1 natural frequencies",
    "zv zvd -f 5 --settling": "this is for one kind",
    "zv direct_zv -f 5": "is for two modes",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes(line, tmp_path):
    done = typed("design", *line.split(), cwd=tmp_path)
    said = " ".join(done.stderr.split())
    assert (done.returncode, MISTAKES[line] in said) == (2, True), said
    assert not list(tmp_path.iterdir())
