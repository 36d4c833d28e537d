"""The examples run as they are, and leave their pictures."""

from __future__ import annotations

import cmath
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("[0-9]*.py"))


def check_shaped_step(said: str) -> None:
    """An edge split over a step h leaves (wn h)^2 / 16 of the unshaped residual at most."""
    swing = dict(re.findall(r"^(\w+) +swing after 1.5 s: +([\d.]+) mm", said, re.MULTILINE))
    unshaped = float(swing["none"])
    assert unshaped > 100.0
    assert 0.0 <= float(swing["zvd"]) <= float(swing["zv"]) < unshaped * (10.0 * 0.002) ** 2 / 16 + 0.001


def check_order_of_convergence(said: str) -> None:
    """Held values: order 2."""
    orders = [float(x) for line in said.splitlines() if "observed orders" in line for x in line.split("orders")[1].split(",")]
    assert len(orders) == 15
    assert orders == pytest.approx([2.0] * 15, abs=0.02)


def check_your_own_component(said: str) -> None:
    """level = q/k (1 - exp(-t k/A)) with q = 0.05, k = 0.1, A = 0.4 at t = 10 s; the same digits from FMU and object."""
    levels = re.search(r"level at 10 s: ([\d.]+) m by the FMU, ([\d.]+) m by the object", said)
    assert levels is not None
    assert levels[1] == levels[2]
    assert float(levels[1]) == pytest.approx(0.5 * (1.0 - math.exp(-2.5)), abs=1e-14)


def check_robustness_sweep(said: str) -> None:
    """Undamped, V = |cos(pi r / 2)| for ZV and its square for ZVD (Singer and Seering 1990): 5 % over 4/pi asin(0.05) and
    4/pi asin(sqrt(0.05)) in r. The runs' peaks are between steps of 1 ms: (w h)^2 / 8 < 4e-5, relative."""
    for kind, share in (("zv", 0.05), ("zvd", math.sqrt(0.05))):
        widths = re.search(rf"^{kind} +insensitivity ([\d.]+) by \d+ runs, ([\d.]+) by the formula", said, re.MULTILINE)
        assert widths is not None
        assert [float(width) for width in widths.groups()] == pytest.approx([4.0 / math.pi * math.asin(share)] * 2, abs=2e-5)


def check_model_exchange(said: str) -> None:
    """Solved as one the error is the solver's; held inputs are of order 1."""
    largest = re.search(r"^monolithic +largest error ([\d.e-]+) m", said, re.MULTILINE)
    assert largest is not None
    assert float(largest[1]) < 1e-9
    orders = [float(x) for x in said.split("observed orders")[1].splitlines()[0].split(",")]
    assert orders == pytest.approx([1.0, 1.0], abs=0.1)


def check_tune_a_plant(said: str) -> None:
    """Small swings of a pendulum: sqrt(g / l), for a rope of 5 m and 10 % more and less; the shaper keeps its tolerances."""
    numbers = re.search(r"natural frequency ([\d.]+) rad/s, ([\d.]+) to ([\d.]+) rad/s", said)
    assert numbers is not None
    expected = [math.sqrt(9.81 / length) for length in (5.0, 5.5, 4.5)]
    assert [float(number) for number in numbers.groups()] == pytest.approx(expected, rel=2e-6)
    assert re.search(r"^tuned: .*: the tolerance of 5 % holds", said, re.MULTILINE)


def check_one_fmu(printed: str) -> None:
    """ZVD on its own frequency leaves nothing (Singer and Seering 1990); on a grid of 50 ms its impulses come late by up to a step."""
    left = [
        float(line.split("residual vibration")[1].split("%")[0]) for line in printed.splitlines() if "residual vibration" in line
    ]
    assert left[0] == 0.0
    assert left[1] > 5.0


def check_which_shaper(said: str) -> None:
    """The rows are the page's, and ZV and ZVD those of Singer and Seering (1990): [1, K] / (1 + K) half a damped period apart, and twice.

    The sweep's are half of peak to peak, between which the vibration decays by exp(-zeta pi): within 6 %.
    """
    rows = {line.split("|")[1].strip(): line for line in said.splitlines() if line.startswith("| `")}
    page = (EXAMPLES[0].parents[1] / "docs" / "which_shaper.md").read_text(encoding="utf-8")
    assert len(rows) == 10
    assert [line for line in page.splitlines() if line in rows.values()] == list(rows.values())
    zeta = 0.02
    for kind, power in (("`zv`", 1), ("`zvd`", 2)):
        printed = [float(cell.strip(" %")) for cell in rows[kind].split("|")[4:8]]
        expected = [100.0 * abs(two_impulses(r, zeta)) ** power for r in (0.95, 0.9, 0.8, 0.7)]
        assert printed == pytest.approx(expected, rel=0.06, abs=0.06)


def two_impulses(r: float, zeta: float) -> complex:
    """What ZV leaves at its last impulse, of a mode whose frequency is r times the designed one."""
    damped = math.sqrt(1.0 - zeta**2)
    k = math.exp(-zeta * math.pi / damped)
    return (cmath.exp((-zeta + 1j * damped) * r * math.pi / damped) + k) / (1.0 + k)


CHECKS = {
    "01_shaped_step": check_shaped_step,
    "02_order_of_convergence": check_order_of_convergence,
    "03_your_own_component": check_your_own_component,
    "04_robustness_sweep": check_robustness_sweep,
    "05_tune_a_plant": check_tune_a_plant,
    "06_model_exchange": check_model_exchange,
    "07_one_fmu": check_one_fmu,
    "08_which_shaper": check_which_shaper,
}


@pytest.mark.representatives(example=[EXAMPLES[0]])
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_runs_and_leaves_its_picture(example, tmp_path):
    done = subprocess.run([sys.executable, str(example)], capture_output=True, text=True, cwd=tmp_path, timeout=900)
    assert done.returncode == 0, done.stderr
    CHECKS[example.stem](done.stdout)
    picture = tmp_path / "results" / f"{example.stem}.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 10_000
