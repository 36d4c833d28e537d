"""The first hour of a new user: a fresh environment from the wheel, then look, decide, run, sweep, tune, a notebook and what the
documentation tells to type; other versions of Python; and the sdist.

Nothing of this checkout is there but the wheel, and what the documentation takes from a clone.
"""

from __future__ import annotations

import importlib.metadata
import json
import re
import shutil
import subprocess
import tarfile
from dataclasses import dataclass
from pathlib import Path

import nbformat
import pytest
from documented_snippets import Snippet, snippets
from made_once import made_once
from test_dist import ROOT, environment, pip, run, wheel  # noqa: F401 - a fixture
from test_notebooks import CHECKS, NOTEBOOKS

from shaper_fmu.live.panel import TITLE

pytestmark = pytest.mark.thorough


@dataclass(frozen=True)
class User:
    """Who types in a folder of his; `extras` is where Python finds more packages than his environment has."""

    python: Path
    folder: Path
    extras: str = ""

    def types(self, *words: str, begins: str = "") -> str:
        """What a command prints, which must end well; what it says on stderr begins so. The compiler is there for what the wheel does not carry."""
        compiles = "my_plant.py" in words
        more = self.extras if compiles or words[-1].endswith(".parquet") else ""
        variables = {"PATH": str(self.python.parent), "HOME": str(self.folder), "PYTHONPATH": more}
        if more:  # the compiler's own C libraries, which it compiles for minutes the first time, are this machine's
            variables["ZIG_GLOBAL_CACHE_DIR"] = str(Path.home() / ".cache" / "zig")
        command = [str(self.python.parent / words[0]), *words[1:]]
        done = subprocess.run(command, capture_output=True, text=True, timeout=390, cwd=self.folder, env=variables, check=False)
        assert done.returncode == 0, f"{words}: {done.stdout}\n{done.stderr}"
        assert "Traceback" not in done.stderr
        assert done.stderr.startswith(begins), done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory) -> Path:  # noqa: F811
    """That of a fresh environment, without a compiler."""
    folder = made_once(
        tmp_path_factory, "first_hour", lambda folder: environment(folder, f"{wheel}[report,pandas]", "nbclient", "ipykernel")
    )
    return folder / "bin" / "python"


@pytest.fixture
def user(python, tmp_path) -> User:
    return User(python, tmp_path)


@pytest.fixture(scope="module")
def extras(python, tmp_path_factory) -> Path:
    """A folder with what the extras `native` and `parquet` install besides, for the same environment."""
    lines = importlib.metadata.requires("shaper-fmu") or []
    needed = [line.partition(";")[0].strip() for line in lines if line.startswith(("ziglang", "pyarrow"))]
    command = [*pip(), "--python", str(python), "install", *needed, "--target"]
    return made_once(tmp_path_factory, "first_hour_extras", lambda folder: run([*command, str(folder)]))


def test_the_first_hour(user):
    user.types("shaper-fmu", "build", "OverheadCrane", "--output", ".")  # the wheel's own
    assert "trolley_acceleration" in user.types("shaper-fmu", "info", "OverheadCrane.fmu", "--drawing", "crane.svg")
    said = user.types("shaper-fmu", "design", "zv", "zvd", "ei", "-f", "0.2", "-z", "1%", "--plot", "kinds.html")
    assert "damping ratio 0.01" in said
    given = ["--input", "trolley_acceleration=step:0.1@1", "--until", "10", "--output", "run.csv", "--report", "run.html"]
    user.types("shaper-fmu", "run", "OverheadCrane.fmu", *given)
    system = ["--plant", "OverheadCrane.fmu", "--input", "trolley_acceleration", "--output", "swing_angle"]
    user.types("shaper-fmu", "new", "system", *system, "-w", "1.4", "--output-file", "crane.ssp")
    user.types("shaper-fmu", "run", "crane.ssp")
    user.types("shaper-fmu", "new", "study", "crane.ssp")
    assert "15 of 15 runs done" in user.types("shaper-fmu", "sweep", "study.toml", "--store", "s.sqlite", "--workers", "0")
    user.types("shaper-fmu", "report", "s.sqlite", "--output", "sweep.html")
    user.types("shaper-fmu", "export", "s.sqlite", "--output", "runs.csv")
    for page in ("kinds.html", "run.html", "sweep.html"):
        assert 10_000 < (user.folder / page).stat().st_size < 1_000_000, page


def test_tune(user):
    """Small swings of a pendulum: sqrt(g / l) for 5 m, and 10 % more and less. What was written is used as it is."""
    user.types("shaper-fmu", "build", "OverheadCrane", "--output", ".")
    given = ["--input", "trolley_acceleration", "--output", "swing_angle", "--vary", "initial_rope_length=10%"]
    plain = "note: there is no compiler, so the shaper's FMU is the plain one: pip install "
    user.types("shaper-fmu", "tune", "OverheadCrane.fmu", *given, "--set", "initial_rope_length=5", begins=plain)
    tuned = user.folder / "OverheadCrane_tuned"
    numbers = json.loads((tuned / "tuning.json").read_text())
    assert numbers["verdict"] == "tuned"
    mode = numbers["modes"][0]
    low, high = mode["natural_frequency_range"]
    expected = [(9.81 / length) ** 0.5 for length in (5.5, 5.0, 4.5)]
    assert [low, mode["natural_frequency"], high] == pytest.approx(expected, rel=1e-5)
    assert 10_000 < (tuned / "report.html").stat().st_size < 1_000_000
    assert TITLE in (tuned / "report.html").read_text()  # of the live panel, whose kernels came with the wheel
    user.types("shaper-fmu", "run", "OverheadCrane_tuned/shaped_plant.ssp", "--output", "shaped.csv")
    user.types("shaper-fmu", "check", "OverheadCrane_tuned/OverheadCrane_shaped.fmu")


@pytest.mark.parametrize("book", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook(book, user):
    """By nbclient's own command, with the environment's own kernel."""
    shutil.copy(book, user.folder)
    user.types("jupyter-execute", "--inplace", "--timeout=300", book.name)
    cells = nbformat.read(user.folder / book.name, as_version=4).cells
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    CHECKS[book.stem]("".join(output["text"] for output in outputs if output.output_type == "stream"))
    assert any("image/png" in output.get("data", {}) for output in outputs)


DOCUMENTED = {
    "README.md": ("On the command line",),
    "docs/start.md": (),
    "docs/running.md": (),
    "docs/fastest_move.md": (),
    "docs/which_shaper.md": (),
    "docs/sweeps.md": (),
}
"""The pages that are played, and their sections that are no commands to type but tables of them."""


@pytest.mark.parametrize("page", DOCUMENTED)
def test_what_the_documentation_tells_to_type(page, python, extras, tmp_path):
    found = snippets(page, DOCUMENTED[page])
    assert found
    user = User(python, tmp_path, str(extras))
    _prepare(page, user)
    for snippet in found:
        said = user.types(*snippet.words) if snippet.words else _played(snippet, user)
        assert snippet.printed == "" or said == re.sub("^ {4}", "", snippet.printed, flags=re.MULTILINE)


def _prepare(page: str, user: User) -> None:
    """What a page takes for given: a clone's systems, and files of its reader."""
    shutil.copytree(ROOT / "ssp" / "overhead_crane", user.folder / "ssp" / "overhead_crane")
    if page == "docs/running.md":
        user.types("shaper-fmu", "build", "MassSpringDamper", "--output", ".")
        (user.folder / "MassSpringDamper.fmu").rename(user.folder / "plant.fmu")
        (user.folder / "measured.csv").write_text("time,F\n0,0\n1,1\n2,0\n")
    elif page == "docs/sweeps.md":
        user.types("shaper-fmu", "build", "MotionProfile", "InputShaper", "OverheadCrane")
        user.types("shaper-fmu", "build", "ssp/overhead_crane")


def _played(snippet: Snippet, user: User) -> str:
    """A component's file is built, as README says; all else runs."""
    if "(Component)" in snippet.python:
        (user.folder / "my_plant.py").write_text(snippet.python)
        return user.types("shaper-fmu", "build", "my_plant.py", "--platform", "this")
    return user.types("python", "-c", snippet.python)


@pytest.fixture(scope="module")
def sdist(tmp_path_factory) -> Path:
    def build(folder: Path) -> None:
        builder = environment(folder / "builder", "hatchling")
        run([str(builder), "-m", "hatchling", "build", "-t", "sdist", "-d", str(folder)], cwd=ROOT)

    return next(made_once(tmp_path_factory, "sdist", build).glob("shaper_fmu-*.tar.gz"))


def test_the_sdist(sdist, tmp_path):
    """It holds what building and testing need, and builds into a package that runs."""
    with tarfile.open(sdist) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert names >= {"pyproject.toml", "README.md", "LICENSE", "Makefile", "plants/overhead_crane.py", "tests/conftest.py"}
    python = environment(tmp_path / "environment", str(sdist))
    said = run([str(python.parent / "shaper-fmu"), "design", "zvd", "-f", "5"], cwd=tmp_path)
    assert "0.2" in said
    said = run([str(python), "-c", "import shaper_fmu; print(*shaper_fmu.components())"], cwd=tmp_path)
    assert "OverheadCrane" in said


def interpreter(version: str) -> str | None:
    """A Python of this version, on the search path or where pyenv keeps its own."""
    kept = sorted((Path.home() / ".pyenv" / "versions").glob(f"{version}.*/bin/python"))
    for found in (*map(str, kept), shutil.which(f"python{version}")):
        if found and subprocess.run([found, "--version"], capture_output=True, check=False).returncode == 0:
            return found
    return None


@pytest.mark.parametrize("version", ["3.12", "3.13", "3.14"])
def test_other_versions_of_python(version, wheel, sdist, tmp_path):  # noqa: F811
    """The wheel works, and then the sdist; FMUs of the python backend, too, which carry their Python's version nowhere."""
    found = interpreter(version)
    if found is None:
        pytest.skip(f"there is no Python {version} here")
    run([found, "-m", "venv", "--without-pip", str(tmp_path / "environment")])
    python = tmp_path / "environment" / "bin" / "python"
    install = [*pip(), "--python", str(python), "install"]
    run([*install, f"{wheel}[report]"])
    (tmp_path / "user").mkdir()
    user = User(python, tmp_path / "user")
    assert run([str(python), "--version"]).startswith(f"Python {version}.")
    _prepare("", user)
    user.types("shaper-fmu", "build", "MotionProfile", "InputShaper", "OverheadCrane")
    user.types("shaper-fmu", "build", "ssp/overhead_crane")
    user.types("shaper-fmu", "run", "ssp/overhead_crane.ssp", "--report", "run.html")
    assert "39 of 39 runs done" in user.types("shaper-fmu", "sweep", "ssp/overhead_crane/study.toml", "--store", "s.sqlite")
    user.types("shaper-fmu", "report", "s.sqlite", "--output", "sweep.html")
    given = ["--input", "trolley_acceleration", "--output", "swing_angle", "--vary", "initial_rope_length=10%"]
    user.types("shaper-fmu", "tune", "fmus/OverheadCrane.fmu", *given)
    user.types("shaper-fmu", "build", "MassSpringDamper", "--backend", "python", "--output", ".")
    user.types("shaper-fmu", "run", "MassSpringDamper.fmu", "--input", "force=step:1", "--until", "5")
    run([*install, "--no-deps", "--force-reinstall", str(sdist)])
    assert "0.2" in user.types("shaper-fmu", "design", "zvd", "-f", "5")
