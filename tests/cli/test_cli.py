"""The command line as a user types it: what it prints, what it leaves, how it exits."""

from __future__ import annotations

import math
from html.parser import HTMLParser
from pathlib import Path

import pytest
from command_line import in_a_process, typed
from conftest import GAIN

from shaper_fmu.registry import components

SYSTEMS = Path(__file__).parents[2] / "ssp"
PNG = b"\x89PNG\r\n\x1a\n"
CRANE = ("MotionProfile", "InputShaper", "OverheadCrane")


@pytest.fixture(scope="module")
def workshop(tmp_path_factory) -> Path:
    """A folder in which the FMUs and the crane have been built by the command line."""
    folder = tmp_path_factory.mktemp("workshop")
    built = in_a_process("build", *CRANE, "--platform", "this", cwd=folder)
    assert (built.returncode, built.stdout) == (0, "".join(f"built fmus/{name}.fmu\n" for name in CRANE)), built.stderr
    (folder / "crane").symlink_to(SYSTEMS / "overhead_crane")
    packed = typed("build", "crane", cwd=folder)
    assert (packed.returncode, packed.stdout) == (0, "built crane.ssp\n")
    return folder


@pytest.mark.thorough
def test_build_without_names_builds_all_components(tmp_path):
    done = typed("build", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "".join(f"built fmus/{name}.fmu\n" for name in components())


def test_list_names_components_and_variables(tmp_path):
    assert "MassSpringDamper" in typed("list", cwd=tmp_path).stdout
    shown = typed("list", "MassSpringDamper", cwd=tmp_path).stdout
    for words in ("stiffness", "N.s/m", "viscous", "> 0"):
        assert words in shown


def test_help_names_every_command(tmp_path):
    done = in_a_process("--help", cwd=tmp_path)
    assert done.returncode == 0
    for name in ("list", "build", "check", "run", "sweep", "report", "Exit codes"):
        assert name in done.stdout


def test_run_prints_writes_and_reports(workshop):
    options = ["--stop-time", "3", "--set", "crane.initial_rope_length=5", "--output", "r.csv", "--report", "r.html"]
    done = typed("run", "crane.ssp", *options, cwd=workshop)
    assert done.returncode == 0, done.stderr
    assert "crane.load_position" in done.stdout
    header, *rows = (workshop / "r.csv").read_text().splitlines()
    assert header.startswith("time,profile.position")
    assert len(rows) == 301
    assert "crane.rope_length" in done.stdout
    assert float(rows[-1].split(",")[header.split(",").index("crane.rope_length")]) == 5.0
    assert (workshop / "r_response_deg.png").read_bytes().startswith(PNG)


class Resources(HTMLParser):
    """Collects what a page would load from elsewhere."""

    def __init__(self):
        super().__init__()
        self.found: list[str] = []
        self.tables = 0

    def handle_starttag(self, tag, attrs):
        self.tables += tag == "table"
        self.found += [value for key, value in attrs if key in ("src", "href") and value and tag in ("script", "link", "img")]


def test_sweep_resumes_and_reports(workshop):
    study = (SYSTEMS / "overhead_crane" / "study.toml").read_text()
    (workshop / "short").mkdir()
    for old, new in (("../overhead_crane.ssp", "../crane.ssp"), ("step = 0.01", "step = 0.05"), ("points = 13", "points = 2")):
        study = study.replace(old, new)
    (workshop / "short" / "study.toml").write_text(study)
    first = typed("sweep", "short/study.toml", "--store", "s.sqlite", cwd=workshop)
    assert first.returncode == 0, first.stderr
    assert "9 of 9 runs done, in s.sqlite" in first.stdout
    for words in ("5.6 m (-30 %)", "8 m (nominal)", "10.4 m (+30 %)", "unshaped", "ZVD"):
        assert words in first.stdout
    assert "0 of 9" in first.stderr
    again = typed("sweep", "short/study.toml", "--store", "s.sqlite", cwd=workshop)
    assert again.stdout == first.stdout
    assert "9 of 9" in again.stderr
    assert "0 of 9" not in again.stderr
    report = typed("report", "s.sqlite", "--output", "s.html", cwd=workshop)
    assert report.returncode == 0, report.stderr
    page = (workshop / "s.html").read_text()
    resources = Resources()
    resources.feed(page)
    assert resources.found == []  # self-contained
    assert resources.tables >= 2
    for words in ("Robustness: residual swing", "last command ends", "SHA-256", "9 of 9 runs done, 0 failed"):
        assert words in page
    pictures = sorted(path.name for path in workshop.glob("s_*.png"))
    assert len(pictures) == 5
    assert all((workshop / name).read_bytes().startswith(PNG) for name in pictures)


def test_a_users_component_is_built(tmp_path):
    (tmp_path / "gain.py").write_text(GAIN.format(factor=2.0))
    done = typed("build", "gain.py", "--output", ".", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "built Gain.fmu\n")
    checked = typed("check", "Gain.fmu", cwd=tmp_path)
    assert (checked.returncode, checked.stdout) == (0, "")


def test_check_names_problems_and_exits_with_one(workshop):
    (workshop / "text.fmu").write_text("no archive")
    done = typed("check", "crane.ssp", "fmus/InputShaper.fmu", "text.fmu", cwd=workshop)
    assert done.returncode == 1
    assert done.stdout.count("\n") == 1
    assert done.stdout.startswith("text.fmu: text.fmu: not a readable archive")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["build", "InputShapre"], 2, "there is no component 'InputShapre'. Did you mean 'InputShaper'?"),
        (["run", "none.ssp"], 2, "none.ssp: No such file or directory"),
        (["run", "crane.ssp", "--set", "crane.initial_rope_lenght=1"], 2, "Did you mean"),
        (["run", "crane.ssp", "--set", "crane.damping_ratio=-1", "--stop-time", "1"], 1, "damping_ratio = -1 must be at least 0"),
        (["run", "crane.ssp", "--set", "crane"], 2, "not of the form instance.variable=value"),
        (["sweep", "none.toml"], 2, "none.toml: No such file"),
        (["report", "none.sqlite"], 2, "none.sqlite: No such file"),
        (["runn"], 2, "No such command"),
        (["run", "crane.ssp", "--algorithm", "fast"], 2, "fast"),
    ],
)
def test_errors_are_one_line_with_an_exit_code(workshop, arguments, code, words):
    done = typed(*arguments, cwd=workshop)
    assert done.returncode == code
    assert words in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("value", "code", "words"),
    [("crane.damping_ratio=-1", 1, "must be at least 0"), ("crane", 2, "not of the form instance.variable=value")],
)
def test_a_process_exits_with_the_code(workshop, value, code, words):
    done = in_a_process("run", "crane.ssp", "--set", value, "--stop-time", "1", cwd=workshop)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)
    assert words in done.stderr


def test_design_prints_and_plots(tmp_path):
    """Amplitudes of a ZVD at 10 % damping: K = exp(-zeta pi / sqrt(1 - zeta^2)), 1, 2K, K^2 over (1 + K)^2."""
    done = typed("design", "zvd", "--natural-frequency", "5", "--damping-ratio", "0.1", "--plot", "zvd.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for words in ("0.3344149079", "0.4877425475", "0.1778425446", "1.26296777 s", "0.34024", "wrote zvd.html"):
        assert words in done.stdout
    assert "sensitivity" in (tmp_path / "zvd.html").read_text()
    assert (tmp_path / "zvd_sensitivity.png").read_bytes().startswith(PNG)


def test_design_of_a_specified_insensitivity_lies_on_the_floor(tmp_path):
    done = typed("design", "si", "--low", "4", "--high", "6", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "0.80000 to 1.20000" in done.stdout
    assert "0.00%" in done.stdout


def test_design_proves_a_bound_of_the_residual_vibration(tmp_path):
    """An undamped ZV has V = |cos(pi w / (2 wn))| exactly, largest at the ends of a band about wn: sin(0.05 pi) for +-10 %."""
    done = typed("design", "zv", "-w", "5", "--low", "4.5", "--high", "5.5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Proven: 4.5 to 5.5 rad/s (0.7162 to 0.8754 Hz), damping ratio 0 to 0" in done.stdout
    assert f"{100.0 * math.sin(0.05 * math.pi):.6f} %" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["design", "zv", "-w", "5", "--damping-range", "0", "0.1"], 2, "give --low and --high, too"),
        (["design", "zv", "-w", "5", "--low", "6", "--high", "4"], 2, "must be (low, high) with 0 < low <= high"),
        (["design", "zvx", "-w", "5"], 2, "there is no shaper, profile or pulse train 'zvx'. Did you mean 'zv"),
        (["design", "zv"], 2, "give at least one"),
        (["design", "si", "--low", "4"], 2, "si needs --low and --high"),
        (["design", "zv", "-w", "-5"], 2, "-5 is outside its domain: a finite number above 0"),
        (["design", "direct_zv", "-w", "5"], 2, "is for two modes; 1 natural frequencies were given"),
        (["design", "constant_acceleration", "-w", "5", "--duration", "1"], 2, "only if it takes longer than 1.25663706 s"),
        (["design", "s_curve_modes", "-w", "5", "-w", "6", "--second-natural-frequency", "9"], 2, "not both"),
        (["design", "s_curve_modes", "-w", "5", "-w", "6", "-w", "7", "-w", "8", "--duration", "3"], 2, "takes 1 to 3"),
    ],
)
def test_design_tells_what_is_wrong(tmp_path, arguments, code, words):
    done = typed(*arguments, cwd=tmp_path)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)
    assert words in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        # peak speed of a 3-4-5 polynomial is 15/8 L/T, its peak acceleration 10/sqrt(3) L/T^2
        (["polynomial_345", "-w", "5", "--distance", "2", "--duration", "4"], ["0.9375 m/s", "0.721687836 m/s2"]),
        # a trapezoid at both limits: T = L/v + v/a
        (["trapezoid", "-w", "5", "--distance", "2", "--max-velocity", "0.5", "--max-acceleration", "1"], ["4.5 s", "0.5 m/s"]),
        # speeding up and slowing down begin one period apart: V = L w/(2 pi)
        (["constant_acceleration", "-w", "5", "--duration", "2"], ["0.795774715 m/s"]),
        # two modes, the shortest S-curve: docs/commands.md
        (["s_curve_modes", "-w", "20", "-w", "45", "--max-velocity", "1", "--max-acceleration", "3"], ["1.50792", "Modes"]),
        (["s_curve_modes", "-w", "5", "--second-natural-frequency", "14", "--duration", "2"], ["residual V", "none"]),
        # five switches of the minimax command on the plant of Taskin, Kilic and Kapucu 2019
        (["minimax", "-w", "22.9476", "-z", "0.0891", "--duration", "0.1374496"], ["0.02861", "0.1196", "Switches"]),
        (["zv_carrier", "-w", "22.9476", "-z", "0.0891", "--frequency-ratio", "12"], ["1.037", "Switches"]),
    ],
)
def test_design_of_profiles_and_pulses(tmp_path, arguments, words):
    done = typed("design", *arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for word in words:
        assert word in done.stdout
