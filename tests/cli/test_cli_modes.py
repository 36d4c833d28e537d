"""`shaper-fmu design KIND --modes FILE`: which modes to shape, from a file."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from three_mass_loop import response
from typer.testing import CliRunner

from shaper_fmu.cli.main import app
from shaper_fmu.design.mode_file import read_modes
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError


def mode_texts() -> list[str]:
    """The three-mass loop's modes as tables of a TOML file: residues, and amplitudes with phases."""
    r, texts = response(), []
    for k, (w, zeta) in enumerate(zip(r.natural_frequency, r.damping_ratio, strict=True)):
        column = r.residues[:, k]
        if k == 1:
            values = f"amplitude = {np.abs(column).tolist()}\nphase = {np.angle(column).tolist()}"
        else:
            values = f"residue = {[[x.real, x.imag] for x in column.tolist()]}"
        texts.append(f"[[modes]]\nnatural_frequency = {float(w)!r}\ndamping_ratio = {float(zeta)!r}\n{values}\n")
    return texts


@pytest.fixture
def modes(tmp_path):
    path = tmp_path / "modes.toml"
    path.write_text("\n".join(['outputs = ["x1", "x2", "x3"]\nfinal = [1.0, 1.0, 1.0]\n', *mode_texts()]))
    return path


def run(*arguments) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["design", *map(str, arguments)])
    return done.exit_code, re.sub(r"\x1b\[[0-9;]*m", "", done.output)  # FORCE_COLOR may be set


def rows(output: str, title: str) -> list[list[str]]:
    """The cells of the table under a title."""
    lines = output.split(title + "\n", 1)[1].splitlines()
    found = []
    for line in lines[3:]:
        if not line.startswith("│"):
            break
        found.append([cell.strip() for cell in line.strip("│").split("│")])
    return found


def test_the_file_holds_the_response(modes):
    read, expected = read_modes(modes), response()
    time = np.linspace(0.0, 8.0, 50)
    sequence = shaper("zvd", 3.0, 0.1)
    assert read.values(sequence, time) == pytest.approx(expected.values(sequence, time), abs=1e-12)
    assert read.names == ("x1", "x2", "x3")


def test_it_prints_the_sets_the_choice_and_its_impulses(modes):
    code, output = run("zvd", "--modes", modes, "--tolerance", "0.05")
    assert code == 0
    sets = rows(output, "Sets of modes")
    assert [row[0] for row in sets] == ["{}", "{2}", "{1}", "{1, 2}", "{0}", "{0, 2} *", "{0, 1}", "{0, 1, 2}"]
    assert sets[5] == ["{0, 2} *", "3.37166", "0.030809", "3.1233", "3.7772"]
    assert "Chosen, shortest: 2.352, 9.6501 rad/s shaped, 3.37166 s (28.5% shorter than all modes), rho = 0.03081" in output
    r = response()
    expected = shaper("zvd", r.natural_frequency[[0, 2]].tolist(), r.damping_ratio[[0, 2]].tolist())
    found = rows(output, "Impulses")
    assert [float(row[1]) for row in found] == pytest.approx(list(expected.delays), abs=1e-9)
    assert [float(row[2]) for row in found] == pytest.approx(list(expected.amplitudes), abs=1e-9)


def test_several_kinds_and_the_earliest_settling(modes):
    code, output = run("zv", "--or", "zvd", "--or", "ei", "--modes", modes, "--tolerance", "0.1")
    assert (code, "9.6501 rad/s shaped (zv, ei), 2.01106 s" in output) == (0, True)
    code, output = run("zvd", "--modes", modes, "--tolerance", "0.1", "--settling")
    assert (code, "Chosen, earliest to settle: 2.352 rad/s shaped" in output) == (0, True)


def test_a_page_with_the_responses(modes, tmp_path):
    code, output = run("zv", "--modes", modes, "--plot", tmp_path / "modes.html")
    assert code == 0
    written = re.findall(r"wrote (.+)", output)
    assert [name.rsplit("/", 1)[-1] for name in written] == ["modes.html", *(f"modes_response_{j}.png" for j in (1, 2, 3))]
    assert "Response of x3 to a unit step" in (tmp_path / "modes.html").read_text()


def test_json_with_a_decaying_pole_and_an_infeasible_tolerance(tmp_path):
    """x = 1 - exp(-0.1 t) never settles within 5 % at once: nothing can be shaped, exit code 1."""
    path = tmp_path / "modes.json"
    mode = {"natural_frequency": 5.0, "damping_ratio": 0.1, "amplitude": [-0.1]}
    path.write_text(json.dumps({"final": [1.0], "modes": [{"decay_rate": 0.1, "amplitude": [-0.9]}, mode]}))
    code, output = run("zv", "--modes", path)
    assert code == 1
    left = 0.9 * np.exp(-0.1 * np.pi / 5.0 / np.sqrt(0.99) * np.array([0.0, 1.0]))
    k = np.exp(-0.1 * np.pi / np.sqrt(0.99))
    assert f"infeasible: even all modes shaped leave rho = {(k * left[0] + left[1]) / (1 + k):.3g}" in output


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("final = [1.0", "modes.toml: "),
        ("final = [1.0]\nmodes = []", "there is no mode"),
        ("final = [1.0]\nfinals = 2\nmodes = []", "unknown field `finals`"),
        ("final = [1.0]\n[[modes]]\namplitude = [1.0]", "mode 1: give natural_frequency and damping_ratio, or decay_rate"),
        ("final = [1.0]\n[[modes]]\nnatural_frequency = 2\ndamping_ratio = 1.0\namplitude = [1.0]", "0 < zeta < 1"),
        ("final = [1.0]\n[[modes]]\ndecay_rate = 2\namplitude = [1.0, 2.0]", "2 amplitudes or residues for 1 outputs"),
        ("final = [1.0]\n[[modes]]\ndecay_rate = 2", "give either amplitude or residue"),
        ("final = [1.0]\n[[modes]]\ndecay_rate = 2\nresidue = [[1.0, 0.5]]", "residues of a decay_rate are real"),
        ("final = [1.0]\n[[modes]]\ndecay_rate = 2\nphase = [0.1]\namplitude = [1.0]", "decay_rate goes with an amplitude alone"),
        ("final = [1.0]\n[[modes]]\ndecay_rate = -2\namplitude = [1.0]", "does not decay"),
        ("final = [0.0]\n[[modes]]\ndecay_rate = 2\namplitude = [1.0]", "x1 returns to 0"),
    ],
)
def test_what_is_wrong_in_a_file_is_told(tmp_path, text, words):
    path = tmp_path / "modes.toml"
    path.write_text(text)
    with pytest.raises(ComponentError) as caught:
        read_modes(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_file_and_options_that_do_not_fit(modes, tmp_path):
    with pytest.raises(ComponentError, match="No such file"):
        read_modes(tmp_path / "none.toml")
    for arguments, words in (
        (["zv", "--modes", modes, "-w", "5"], "takes the place of"),
        (["zv", "-w", "5", "--settling"], "needs --modes"),
        (["zv", "-w", "5", "--or", "zvd"], "needs --modes"),
    ):
        code, output = run(*arguments)
        assert (code, words in output) == (2, True)
