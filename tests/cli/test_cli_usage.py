"""Wrong usage: each command tells it before its work begins, exits with 2, and leaves nothing behind.

A file's content, and what a run comes to, are not the usage: those are problems that the work finds, and exit with 1.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from command_line import typed
from test_cli_sweep import STUDY

from shaper_fmu.ssp.archive import pack_ssp

SYSTEMS = Path(__file__).parents[2] / "ssp"
MODES = """
outputs = ["x"]
final = [1.0]
[[modes]]
natural_frequency = 5.0
damping_ratio = 0.1
amplitude = [1.0]
"""
TUNE = ["tune", "plant.fmu", "--input", "force", "--output", "position"]
RUN, DESIGN = ["run", "crane.ssp"], ["design", "zvd", "-w", "5"]
NEW = ["new", "system", "--plant", "plant.fmu", "--input", "force", "--output", "position"]


@pytest.fixture(scope="module")
def workshop(fmus, tmp_path_factory) -> Path:
    """A folder with one of each that commands read, and with what gets in their way."""
    folder = tmp_path_factory.mktemp("workshop")
    pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp")
    (folder / "plant.fmu").write_bytes((fmus / "MassSpringDamper.fmu").read_bytes())
    (folder / "modes.toml").write_text(MODES)
    (folder / "study.toml").write_text(STUDY.replace("points = 5", "points = 2").replace("step = 0.05", "step = 0.5"))
    (folder / "ringing.csv").write_text("time,x\n0,1\n1,2\n2,3\n")
    (folder / "text").write_text("a file\n")
    (folder / "folder").mkdir()
    (folder / "long.ssp").write_text("no archive")
    os.mkfifo(folder / "pipe.ssp")
    for name in ("a.ssp", "a.fmu", "a.toml", "a.csv", "a.sqlite", "a.html", "a.png", "a.ssv"):
        (folder / name).mkdir()
    done = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


READ = {  # what each command reads: the arguments with the file's place, and the ending it has
    "check": (["check", "{}"], ".fmu"),
    "check second": (["check", "plant.fmu", "{}"], ".ssp"),
    "info": (["info", "{}"], ".fmu"),
    "info of a system": (["info", "{}"], ".ssp"),
    "run": (["run", "{}"], ".ssp"),
    "tune": (["tune", "{}", "--input", "force"], ".fmu"),
    "tune a system": (["tune", "{}", "--input", "force"], ".ssp"),
    "tune a table": (["tune", "{}"], ".csv"),
    "design --modes": (["design", "zvd", "--modes", "{}"], ".toml"),
    "new system": (["new", "system", "--plant", "{}", "--input", "force", "--output", "position"], ".fmu"),
    "sweep": (["sweep", "{}"], ".toml"),
    "report": (["report", "{}"], ".sqlite"),
    "export": (["export", "{}", "--output", "r.csv"], ".sqlite"),
    "build": (["build", "{}"], ".py"),
}
WRITTEN = {  # what each command writes: the arguments with the file's place, and an ending it takes
    "run --output": (["run", "crane.ssp", "--output", "{}"], ".csv"),
    "run --report": (["run", "crane.ssp", "--report", "{}"], ".html"),
    "design --plot": (["design", "zv", "-w", "5", "--plot", "{}"], ".html"),
    "design --plot picture": (["design", "zv", "-w", "5", "--plot", "{}"], ".png"),
    "design --modes --plot": (["design", "zv", "--modes", "modes.toml", "--plot", "{}"], ".html"),
    "new system": ([*NEW, "--output-file", "{}"], ".ssp"),
    "sweep": (["sweep", "study.toml", "--store", "{}"], ".sqlite"),
    "report": (["report", "s.sqlite", "--output", "{}"], ".html"),
    "export": (["export", "s.sqlite", "--output", "{}"], ".csv"),
    "export --run": (["export", "s.sqlite", "--run", "1", "--output", "{}"], ".ssv"),
}
FOLDERS = {
    "build": ["build", "InputShaper", "--output", "{}"],
    "tune": [*TUNE, "--output-folder", "{}"],
    "reproduce": ["reproduce", "pwm", "--output", "{}"],
}


def filled(arguments: list[str], name: str) -> list[str]:
    return [argument.format(name) for argument in arguments]


def contents(folder: Path) -> dict[Path, tuple[int, int]]:
    """Size and time of change of all that is in a folder."""
    found = (path for path in folder.rglob("*") if not path.name.endswith(("-wal", "-shm")))  # a database's own
    return {path: (path.lstat().st_size, path.lstat().st_mtime_ns) for path in found}


def refused(workshop: Path, arguments: list[str], *words: str) -> None:
    """The command exits with 2 and these words, prints nothing else, and changes nothing in the folder."""
    before = contents(workshop)
    done = typed(*arguments, cwd=workshop)
    assert (done.returncode, done.stdout) == (2, ""), done.stdout + done.stderr
    for word in words:
        assert word in done.stderr
    assert contents(workshop) == before


@pytest.mark.parametrize("command", READ)
def test_files_that_cannot_be_read(workshop, command):
    arguments, ending = READ[command]
    refused(workshop, filled(arguments, f"nothere{ending}"), f"nothere{ending}: No such file or directory")
    refused(workshop, filled(arguments, f"text/x{ending}"), f"text/x{ending}: Not a directory")
    refused(workshop, filled(arguments, f"{'x' * 300}{ending}"), "File name too long")
    if command not in ("build", "report", "export"):
        refused(workshop, filled(arguments, f"a{ending}"), f"a{ending}: not a file but a folder")
    if command not in ("check", "check second", "report", "export", "build"):
        refused(workshop, filled(arguments, "text"), "'text' must end with", "the ending decides the format")


@pytest.mark.parametrize("command", WRITTEN)
def test_files_that_cannot_be_written(workshop, command):
    arguments, ending = WRITTEN[command]
    refused(workshop, filled(arguments, f"text/x{ending}"), f"text/x{ending}: text is not a folder")
    refused(workshop, filled(arguments, f"text/deep/x{ending}"), "text is not a folder")
    refused(workshop, filled(arguments, f"a{ending}"), f"a{ending}: a folder, where a file shall be written")
    refused(workshop, filled(arguments, "folder"), "folder: a folder, where a file shall be written")
    refused(workshop, filled(arguments, ""), "a folder, where a file shall be written")
    refused(workshop, filled(arguments, "/dev/null"), "/dev/null: a device or pipe, where a file shall be written")
    refused(workshop, filled(arguments, f"{'x' * 300}{ending}"), "File name too long")
    refused(workshop, filled(arguments, "r.xlsx"), "'r.xlsx' must end with", ending)
    refused(workshop, filled(arguments, "r"), "'r' must end with", ending)


@pytest.mark.parametrize("command", FOLDERS)
def test_folders_that_cannot_be_written_to(workshop, command):
    refused(workshop, filled(FOLDERS[command], "text"), "text: text is not a folder")
    refused(workshop, filled(FOLDERS[command], "text/deep"), "text is not a folder")
    refused(workshop, filled(FOLDERS[command], "x" * 300), "File name too long")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may do everything")
def test_what_one_may_not_touch(workshop, tmp_path):
    shut, closed = tmp_path / "shut", tmp_path / "closed.csv"
    closed.write_text("")
    closed.chmod(0)
    shut.mkdir(mode=0o500)
    refused(workshop, ["tune", str(closed)], "closed.csv: Permission denied")
    refused(workshop, [*RUN, "--output", str(closed)], "closed.csv: this file is write-protected")
    refused(workshop, [*RUN, "--output", str(shut / "r.csv")], "nothing can be written into")
    refused(workshop, ["build", "InputShaper", "--output", str(shut / "fmus")], "nothing can be written into")


@pytest.mark.thorough
def test_missing_folders_of_outputs_are_made(workshop, tmp_path):
    for arguments, name in (
        ([*RUN, "--stop-time", "1", "--output"], "r.csv"),
        ([*DESIGN, "--plot"], "z.html"),
        (["export", "s.sqlite", "--output"], "runs.csv"),
        ([*NEW, "--output-file"], "new.ssp"),
    ):
        path = tmp_path / name.partition(".")[0] / "deep" / name
        done = typed(*arguments, path, cwd=workshop)
        assert (done.returncode, path.is_file()) == (0, True), done.stderr


def test_problems_that_the_work_finds_are_no_wrong_usage(workshop, tmp_path):
    """Of files' contents, and of runs: exit code 1."""
    (tmp_path / "text.ssp").write_text("no archive")
    (tmp_path / "text.fmu").write_text("no archive")
    (tmp_path / "text.toml").write_text("name = ")
    (tmp_path / "text.sqlite").write_text("no database")
    (tmp_path / "text.csv").write_text("time,x\n0,one\n")
    (tmp_path / "text.py").write_text("1 / 0\n")
    for arguments in (
        ["check", "text.fmu"],
        ["run", "text.ssp"],
        ["tune", "text.fmu", "--input", "force"],
        ["tune", "text.csv"],
        ["design", "zv", "--modes", "text.toml"],
        ["new", "system", "--plant", "text.fmu", "--input", "u", "--output", "y"],
        ["sweep", "text.toml"],
        ["report", "text.sqlite"],
        ["build", "text.py"],
        ["design", "um_ei", "-w", "5", "-z", "0.99"],  # there is no such shaper
        ["run", str(workshop / "crane.ssp"), "--set", "crane.damping_ratio=-1"],  # refused by the FMU
    ):
        done = typed(*arguments, cwd=tmp_path)
        assert done.returncode == 1, (arguments, done.stdout, done.stderr)
        assert "Traceback" not in done.stderr


def test_a_file_is_what_its_ending_says(workshop, tmp_path):
    """The table's numbers are those of the CSV, to the bit; pictures are of their formats, and so are pages."""
    options = ["--stop-time", "2", "--step", "0.1"]
    for name in ("r.csv", "r.PARQUET"):
        assert typed(*RUN, *options, "--output", tmp_path / name, cwd=workshop).returncode == 0
    parquet = pytest.importorskip("pyarrow.parquet").read_table(tmp_path / "r.PARQUET")
    header, *rows = (tmp_path / "r.csv").read_text().splitlines()
    assert parquet.column_names == header.split(",")
    assert [[repr(x) for x in row.values()] for row in parquet.to_pylist()] == [row.split(",") for row in rows]
    assert parquet.schema.field("crane.swing_angle").metadata == {b"unit": b"rad"}
    for name, begin in (("p.png", b"\x89PNG\r\n\x1a\n"), ("p.svg", b"<?xml"), ("p.htm", b"<!DOCTYPE html>")):
        done = typed(*DESIGN, "--plot", tmp_path / name, cwd=workshop)
        assert (done.returncode, f"wrote {tmp_path / name}" in done.stdout) == (0, True), done.stderr
        assert (tmp_path / name).read_bytes().startswith(begin)
    assert typed("design", "zv", "--modes", "modes.toml", "--plot", tmp_path / "m.png", cwd=workshop).returncode == 0
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('kind = "peak"', 'kind = "residual"\ncommand = ""', "metrics.peak_swing.command = '' must be the name of a variable"),
        ('kind = "peak"', 'kind = "residual"\ncommand = "shaper.comand"', "Did you mean 'command'?"),
        ("step = 0.05", "step = 50.0", "step = 50.0 and stop_time = 15.0 must be positive, the step the smaller one"),
        ('reference = "unshaped"', 'reference = "unshapd"', "Did you mean 'unshaped'?"),
        ("points = 5", "pionts = 5", "Did you mean 'points'?"),
        ("crane.initial_rope_length", "crane.initial_rope_lenght", "Did you mean 'initial_rope_length'?"),
        ('"zv"', '"zvx"', "zvx"),
        ('system = "crane.ssp"', 'system = "carne.ssp"', "carne.ssp: No such file or directory"),
    ],
)
def test_a_wrong_study_is_no_wrong_usage(workshop, tmp_path, old, new, words):
    """Exit code 1, as README has it: what is wrong is in the file. No store is begun."""
    assert old in STUDY
    (tmp_path / "study.toml").write_text(STUDY.replace(old, new))
    (tmp_path / "crane.ssp").write_bytes((workshop / "crane.ssp").read_bytes())
    done = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert words in " ".join(done.stderr.split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["crane.ssp", "study.toml"]


def test_a_step_that_is_long_for_the_crane_is_noted(workshop):
    """Its move of 8 s needs ten steps, and so does a period of 2 pi / 1.10736 = 5.674 s: 3 s is too long, 0.5 s is not."""
    done = typed(*RUN, "--step", "3", cwd=workshop)
    assert done.returncode == 0
    words = " ".join(done.stderr.split())
    assert "note: a step of 3 s is long for profile.duration = 8 s: it has 2.67 steps, and needs 10 (0.8 s)" in words
    assert (
        "a step of 3 s is long for shaper.natural_frequency[1] = 1.10736 rad/s: it has 1.89 steps a period, and needs 10" in words
    )
    assert "is long for" not in typed(*RUN, "--step", "0.5", cwd=workshop).stderr


def test_a_missing_package_is_told_before_the_run(workshop, monkeypatch):
    from importlib.util import find_spec

    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name in ("pyarrow", "matplotlib") else find_spec(name))
    refused(workshop, [*RUN, "--output", "r.parquet"], "r.parquet", "pip install 'shaper-fmu[parquet]'")
    refused(
        workshop, ["design", "zv", "-w", "5", "--plot", "r.png"], "need the package matplotlib: pip install 'shaper-fmu[report]'"
    )


@pytest.mark.parametrize(
    "command",
    [
        ["run", "crane.ssp", "--set", "crane.initial_rope_length=8", "--set", "crane.initial_rope_length = 9"],
        [*TUNE, "--set", "mass=1", "--set", "mass=2"],
        [*TUNE, "--vary", "mass=10%", "--vary", "mass=20%"],
    ],
)
def test_a_value_that_is_given_twice_is_wrong_usage(workshop, command):
    done = typed(*command, cwd=workshop)
    assert done.returncode == 2, done.stdout
    assert "is given twice, as" in " ".join(done.stderr.replace("│", " ").split())


def test_a_frequency_beyond_all_numbers_is_refused(workshop):
    done = typed("design", "zv", "--natural-frequency", "1e308", cwd=workshop)
    assert done.returncode == 2
    assert "natural_frequency = 1e+308 is outside its domain <= 1e+100 rad/s" in done.stderr, done.stderr
