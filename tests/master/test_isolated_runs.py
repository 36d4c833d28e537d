"""Runs in a process of their own: the same results to the bit, and FMUs that crash, hang or leave without harm to the caller."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from harmful_fmu import HARM, build_harmful

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System

STEP, STOP = 0.1, 1.0


@pytest.fixture(scope="module")
def harmful(tmp_path_factory) -> Path:
    """The harmful FMU, unpacked once for all tests."""
    path = build_harmful(tmp_path_factory.mktemp("harmful"))
    load_fmu(path)
    return path


def harmful_system(path: Path, harm: str) -> System:
    system = System()
    system.add("x", path, harm=HARM.index(harm), command=2.0)
    return system


@pytest.fixture
def chain(fmus) -> System:
    """profile -> shaper -> plant."""
    system = System("chain")
    system.add("profile", fmus / "MotionProfile.fmu", distance=2.0, start_time=0.1, duration=0.37)
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zvd", natural_frequency=[9.0])
    system.add("plant", fmus / "MassSpringDamper.fmu", stiffness=81.0)
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force", gain=3.0)
    return system


def assert_same(one: Results, other: Results) -> None:
    """Every field is the same, and every number to the bit, NaN and zero's sign too."""
    assert one.time.dtype == other.time.dtype
    assert one.time.tobytes() == other.time.tobytes()
    assert list(one.values) == list(other.values)
    for name in one.values:
        assert one[name].tobytes() == other[name].tobytes(), name
        assert one[name].flags.writeable
    for field in fields(Results):
        if field.compare and field.name not in ("time", "values"):
            assert getattr(one, field.name) == getattr(other, field.name), field.name


def processes(of_interest: Callable[[Path, list[str]], bool]) -> list[int]:
    """Processes by number, zombies too, of /proc/<number> and the fields of its stat from the state on."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended
            if of_interest(folder, (folder / "stat").read_text().rpartition(")")[2].split()):
                found.append(int(folder.name))
    return found


def members(session: int) -> list[int]:
    """The living processes of a session."""
    return processes(lambda _, fields: int(fields[3]) == session and fields[0] != "Z")


def wait_until_none(find: Callable[[], list[int]]) -> None:
    """The system takes a moment to end what was killed."""
    deadline = time.monotonic() + 300.0
    while find() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert find() == []


@pytest.fixture
def nothing_left(harmful, tmp_path, monkeypatch) -> Iterator[None]:
    """Checks that a test leaves no temporary file, no zombie, and no process that its child has started."""
    folder, mark = tmp_path / "temporary", f"{os.getpid()}-{tmp_path}"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setenv("TEST_OF_ISOLATED_RUNS", mark)
    before = set(processes(lambda _, fields: int(fields[1]) == os.getpid()))
    yield
    assert list(folder.iterdir()) == []
    if sys.platform == "linux":
        assert set(processes(lambda _, fields: int(fields[1]) == os.getpid())) <= before
        wait_until_none(lambda: processes(lambda process, _: mark.encode() in (process / "environ").read_bytes()))


@pytest.mark.parametrize(
    "options",
    [
        {"exact": False, "algorithm": "gauss_seidel", "record": ["plant.position", "profile.next_event_time"]},
        {"everywhere": True, "start_time": 0.05, "start_values": {"plant.stiffness": 49.0}},
    ],
)
def test_an_isolated_run_gives_the_same_to_the_bit(chain, options):
    told: list[float] = []
    assert_same(chain.simulate(2.0, 0.003, isolate=True, progress=told.append, **options), chain.simulate(2.0, 0.003, **options))
    assert told == sorted(told)
    assert told[-1] == 2.0


def test_notes_tables_and_nan_come_back_as_they_are(fmus):
    system = System("tables")
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[9.0])
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.drive("shaper.command", [(0.0, 0.0), (0.1, 1.0), (0.1, -1.0), (0.5, 0.3)], interpolation="linear")
    system.connect("shaper.shaped_mean", "plant.force")
    results = system.simulate(1.0, 0.03, isolate=True)
    assert_same(results, system.simulate(1.0, 0.03))
    assert "shaped_mean is a mean" in results.notes[0]


def ramp(t: float) -> float:
    return 0.1 * t


def failing(t: float) -> float:
    return 1.0 if t < 0.45 else 1.0 / 0.0


def test_functions_of_a_module_are_called_in_the_child(harmful):
    system = System()
    system.add("x", harmful)
    system.drive("x.command", ramp)
    assert_same(system.simulate(0.5, STEP, isolate=True), system.simulate(0.5, STEP))


@pytest.mark.parametrize(
    ("function", "words"), [(lambda t: t, "<lambda>"), ((lambda: (yield)).__call__, "lambda|generator|method")]
)
def test_functions_that_cannot_be_sent_are_refused_with_the_input(harmful, function, words):
    system = System()
    system.add("x", harmful)
    system.drive("x.command", function)
    with pytest.raises(ModelError, match=rf"^input x.command: its function cannot be sent .*({words}).* or give a table$"):
        system.simulate(STOP, STEP, isolate=True)


SCRIPT = """
import sys
from shaper_fmu.errors import ModelError
from shaper_fmu.master.system import System

def command(t):
    return t

system = System()
system.add("x", sys.argv[1])
system.drive("x.command", 2.0)
print(system.simulate(0.5, 0.1, isolate=True)["x.sum"][-1])
del system.signals["x", "command"]
system.drive("x.command", command)
try:
    system.simulate(0.5, 0.1, isolate=True)
except ModelError as error:
    print(error)
"""


def test_a_script_needs_no_guard_but_its_own_functions_are_refused(harmful, tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "script.py"), str(harmful)], capture_output=True, text=True, check=True, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    total, words = done.stdout.splitlines()
    assert float(total) == pytest.approx(1.0, abs=1e-12)  # 2.0 over 0.5 s
    assert words.startswith("input x.command: its function cannot be sent to the process of an isolated run: command is defined in")


def test_errors_come_back_as_they_are(harmful, chain):
    for system, record, kind in (
        (harmful_system(harmful, "fail"), None, SimulationError),
        (chain, ["plant.positon"], ModelError),
        (System(), None, ModelError),
    ):
        with pytest.raises(kind) as expected:
            system.simulate(STOP, STEP, record=record)
        with pytest.raises(kind) as caught:
            system.simulate(STOP, STEP, record=record, isolate=True)
        assert str(caught.value) == str(expected.value)
        if isinstance(expected.value, SimulationError):
            assert_same(caught.value.results, expected.value.results)  # pyright: ignore[reportAttributeAccessIssue]
        else:
            assert getattr(caught.value, "problems", None) == getattr(expected.value, "problems", "none")
    with pytest.raises(TypeError, match="'stepp'"):
        chain.simulate(STOP, STEP, isolate=True, stepp=1.0)


def test_a_failing_function_keeps_what_was_recorded(harmful):
    system = System()
    system.add("x", harmful)
    system.drive("x.command", failing)
    with pytest.raises(SimulationError, match=r"^x.command at t = 0.5 s: its function failed: ZeroDivisionError") as caught:
        system.simulate(STOP, STEP, isolate=True)
    assert len(caught.value.results.time) == 5


POSIX = pytest.mark.skipif(sys.platform == "win32", reason="there are no signals there")


@POSIX
@pytest.mark.parametrize(
    ("harm", "words"),
    [
        ("null", r"its process was ended by SIG(SEGV|BUS) \(.+\)"),
        ("abort", r"its process was ended by SIGABRT \(.+\)"),
        ("leave", "its process ended with exit status 3"),
        ("leave_well", "its process ended with exit status 0"),
    ],
)
def test_a_crash_is_told_with_its_kind_the_time_the_fmus_and_the_last_words(harmful, nothing_left, capfd, harm, words):
    system = harmful_system(harmful, harm)
    last = f"; last messages: first line; harm {HARM.index(harm)} now"
    with pytest.raises(SimulationError, match=rf"^the isolated run ended at t = 0.5 s: {words}; FMUs: x \(harmful.fmu\){last}$"):
        system.simulate(STOP, STEP, isolate=True)
    assert "first line\n" in capfd.readouterr().err  # passed on, too
    system.set("x.harm", 0)
    assert system.simulate(STOP, STEP)["x.sum"][-1] == pytest.approx(2.0, abs=1e-12)  # the caller goes on


@pytest.mark.representatives(harm=["hang"])
@POSIX
@pytest.mark.parametrize(("harm", "at"), [("hang", "t = 0.5 s"), ("hang_in_initialization", "initialization")])
def test_an_fmu_that_hangs_is_killed_after_the_time_limit(harmful, nothing_left, harm, at):
    told: list[float] = []
    words = rf"^the isolated run ended at {at}: its process was killed after the time_limit of 5 s; FMUs: x \(harmful.fmu\)"
    with pytest.raises(SimulationError, match=words):
        harmful_system(harmful, harm).simulate(STOP, STEP, isolate=True, time_limit=5.0, progress=told.append)
    assert told[-1:] == ([0.5] if harm == "hang" else [])


@POSIX
def test_a_crash_when_the_instances_are_freed_keeps_the_results(harmful):
    words = r"^the isolated run ended when the FMUs were freed: its process was ended by SIG(SEGV|BUS)"
    with pytest.raises(SimulationError, match=words) as caught:
        harmful_system(harmful, "crash_when_freed").simulate(STOP, STEP, isolate=True)
    assert_same(caught.value.results, harmful_system(harmful, "none").simulate(STOP, STEP))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"time_limit": 1.0}, "^time_limit = 1.0 s needs a process that can be killed: use isolate=True, too$"),
        ({"time_limit": 0.0, "isolate": True}, "^time_limit = 0.0 s must be a finite number above 0$"),
        ({"time_limit": np.nan, "isolate": True}, "^time_limit = nan s must be a finite number above 0$"),
    ],
)
def test_wrong_limits_are_refused(harmful, options, words):
    with pytest.raises(ModelError, match=words):
        harmful_system(harmful, "none").simulate(STOP, STEP, **options)


INTERRUPTED = """
import sys
from shaper_fmu.master.system import System
system = System()
system.add("x", sys.argv[1], harm=int(sys.argv[2]), command=1.0)
try:
    system.simulate(1.0, 0.1, isolate=True, progress=lambda t: print("going", t, flush=True))
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked up in /proc")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_the_child_does_not_outlive_the_caller(harmful, how):
    """Neither when the caller is interrupted, nor when it is killed and can do nothing any more."""
    command = [sys.executable, "-c", INTERRUPTED, str(harmful), str(HARM.index("hang"))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "going 0.5\n"
        (session,) = processes(lambda _, fields: int(fields[1]) == process.pid)
        assert members(session) == [session]
        os.kill(process.pid, how)
        out, errors = process.communicate(timeout=900)
    assert out == ("interrupted\n" if how == signal.SIGINT else "")
    assert "Traceback" not in errors
    wait_until_none(lambda: members(session))
