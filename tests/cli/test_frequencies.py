"""Frequencies in Hz or rad/s, and shares in percent, wherever the command line asks for them.

The designs compared are the same numbers: 1 Hz is 2 pi rad/s.
"""

from __future__ import annotations

import math
import re

import pytest
from command_line import typed

from shaper_fmu import load_fmu, shaper
from shaper_fmu.cli.ends import readable

W = repr(2.0 * math.pi * 0.8)
SAME = [  # two ways to ask for the same design
    (["zvd", "-f", "0.8", "-z", "5%"], ["zvd", "-w", W, "-z", "0.05"]),
    (["zvd", "--frequency", "0.8"], ["zvd", "-w", "0.8Hz"]),
    (["zvd", "-w", "0.8 hz"], ["zvd", "-w", f"{W}rad/s"]),
    (["zvd", "-f", "0.8Hz"], ["zvd", "-f", f"{W}rad/s"]),
    (["ei", "-f", "0.8", "--tolerance", "2%"], ["ei", "-w", W, "--tolerance", "0.02"]),
    (["direct_zv", "-f", "0.8", "-f", "3"], ["direct_zv", "-w", W, "-w", repr(6.0 * math.pi)]),
    (["si", "--low", "0.7Hz", "--high", "0.9Hz"], ["si", "--low", repr(1.4 * math.pi), "--high", repr(1.8 * math.pi)]),
]


@pytest.mark.parametrize(("one", "other"), SAME)
def test_the_same_design(one, other, tmp_path):
    found = [typed("design", *words, cwd=tmp_path) for words in (one, other)]
    assert [done.returncode for done in found] == [0, 0], found[0].stderr
    assert found[0].stdout == found[1].stdout
    assert "(0.8" in found[0].stdout  # Hz beside rad/s


def test_the_numbers_are_the_designs(tmp_path):
    """The last impulse of ZVD is a damped period after the first: 2 pi / (w sqrt(1 - zeta^2))."""
    said = typed("design", "zvd", "-f", "0.8", "-z", "5%", cwd=tmp_path).stdout
    assert said.startswith("for 5.02655 rad/s (0.8 Hz), damping ratio 0.05\n")
    last = float(re.findall(r"│ 3 +│ +([0-9.]+) │", said)[0])
    assert last == pytest.approx(1.0 / (0.8 * math.sqrt(1.0 - 0.05**2)), rel=1e-9)
    assert last == pytest.approx(shaper("zvd", 2.0 * math.pi * 0.8, 0.05).duration, rel=1e-9)
    said = typed("design", "zvd", "-f", "0.8", cwd=tmp_path).stdout
    assert "damping ratio 0, since none is given (-z)" in said


def test_shaped_plants(fmus, tmp_path):
    """`new system` and `wrap` take Hz and percent, too."""
    plant = fmus / "MassSpringDamper.fmu"
    names = ["--plant", plant, "--input", "force", "--output", "position", "--output-file", "a.ssp"]
    done = typed("new", "system", *names, "-f", "1.5", "-z", "5%", cwd=tmp_path)
    assert "zv for 9.42478 rad/s (1.5 Hz) and the damping ratio 0.05" in done.stdout, done.stderr
    done = typed(
        "wrap", plant, "--input", "force", "-f", "1.5", "--set", "damping_ratio=5%", "--platform", "this", "--output", "w.fmu",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    wrapped = load_fmu(tmp_path / "w.fmu")
    starts = [float(str(wrapped.variable(f"shaper.{name}[1]").start)) for name in ("natural_frequency", "damping_ratio")]
    assert starts == [pytest.approx(3.0 * math.pi, rel=1e-14), 0.05]


MISTAKES = {
    "design zvd -f 5 -w 3": "in rad/s (-w) or in Hz (-f), not both",
    "design zvd -f 0": "0 is outside its domain: a finite number above 0",
    "design zvd -w 5kHz": "'5kHz' is not a number",
    "design zvd -f 5 -z 5": "5 is outside its domain: 0 <= zeta < 1; did you mean 5%?",
    "design zvd -f 5 -z 120%": "120% is outside its domain: 0 <= zeta < 1",
    "design ei -f 5 --tolerance 5": "5 is outside its domain: between 0 and 1; did you mean 5%?",
    "design ei -f 5 --tolerance 5percent": "'5percent' is not a number",
    "wrap plant.fmu --input force -f 1 --set natural_frequency=3": "not both",
    "build InputShaper --fmi 1": "Invalid value for '--fmi': '1' is not one of '2', '3'.",
    "run plant.fmu --algorithm jakobi": "'jakobi' is not one of 'jacobi', 'parallel', 'gauss_seidel'. Did you mean 'jacobi'?",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes(line, tmp_path, fmus):
    (tmp_path / "plant.fmu").symlink_to(fmus / "MassSpringDamper.fmu")
    done = typed(*line.split(), cwd=tmp_path)
    said = " ".join(done.stderr.split())
    assert done.returncode == 2, said
    assert MISTAKES[line] in said
    assert "Value error" not in said


def test_other_messages_stay():
    assert readable("No such option: --x") == "No such option: --x"
