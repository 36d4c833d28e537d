"""Where the loop's library comes from: a wheel, ziglang, a C compiler of the machine, or an error that says what to install."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import venv
from ctypes import CDLL, addressof, c_void_p, cast, create_string_buffer
from pathlib import Path

import numpy as np
import pytest
from loop_host import layout_with

from shaper_fmu.errors import BuildError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.export.native.toolchain import platform_named
from shaper_fmu.master import layout as of
from shaper_fmu.master import loop_library
from shaper_fmu.master.loop_library import loop

ROOT = Path(__file__).parents[2]

RUN = """
from shaper_fmu.master.system import System
system = System("shaped")
system.add("shaper", files["InputShaper"], shaper="zv", natural_frequency=[10.0])
system.add("plant", files["MassSpringDamper"])
system.connect("shaper.shaped", "plant.force")
system.drive("shaper.command", ([0.0, 0.3, 0.7], [0.0, 100.0, 50.0]))
results = system.simulate(2.0, 0.01)
print(results["plant.position"].tobytes().hex()[-400:])
"""
"""A run with events; `files` is told before."""


def program(*before: str, code: str = RUN) -> str:
    files = {name: str(fmu_path(name, platforms=["this"])) for name in ("InputShaper", "MassSpringDamper")}
    return "\n".join([f"files = {files!r}", *before, code])


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )


@pytest.fixture(scope="module")
def numbers() -> str:
    """What a run gives here."""
    done = run(program())
    assert done.returncode == 0, done.stderr
    return done.stdout


WITHOUT_WHEEL = "from shaper_fmu.master import loop_library; loop_library._shipped = lambda: None"
WITHOUT_ZIGLANG = f"{WITHOUT_WHEEL}; loop_library.has_toolchain = lambda: False"


def test_a_compiler_of_the_machine_serves_and_gives_the_same_bits(tmp_path, numbers):
    done = run(program(WITHOUT_ZIGLANG), SHAPER_FMU_CACHE=str(tmp_path))
    assert (done.returncode, done.stdout) == (0, numbers), done.stderr
    assert [path.suffix for path in (tmp_path / "loop").iterdir() if path.suffix != ".lock"] == [".so"]


def test_without_any_compiler_an_error_says_what_to_install(tmp_path):
    done = run(program(WITHOUT_ZIGLANG), SHAPER_FMU_CACHE=str(tmp_path), PATH="")
    assert done.returncode == 1
    words = (
        "the master's loop, which is compiled once, is not there and cannot be compiled: install ziglang (pip install 'shaper-fmu["
    )
    assert done.stderr.splitlines()[-1].startswith(f"shaper_fmu.errors.BuildError: {words}native]')")


def test_what_a_compiler_says_is_told(tmp_path):
    (tmp_path / "cc").write_text("#!/bin/sh\necho 'no space left' >&2\nexit 1\n")
    (tmp_path / "cc").chmod(0o755)
    done = run(program(WITHOUT_ZIGLANG), SHAPER_FMU_CACHE=str(tmp_path), PATH=f"{tmp_path}:/bin")
    assert done.returncode == 1
    assert done.stderr.endswith(f"carries the loop\n{tmp_path}/cc does not compile the master's loop:\nno space left\n")


def test_processes_that_begin_together_build_it_once(tmp_path, numbers):
    """Each finds the whole file."""
    environment = {**os.environ, "SHAPER_FMU_CACHE": str(tmp_path)}
    command = [sys.executable, "-c", program(WITHOUT_WHEEL)]
    started = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) for _ in range(3)]
    assert [process.communicate()[0] for process in started] == [numbers] * 3
    assert len([path for path in (tmp_path / "loop").iterdir() if path.suffix != ".lock"]) == 1


@pytest.fixture
def shipped(tmp_path, monkeypatch) -> Path:
    """A folder as in a wheel, with the library for this machine alone."""
    folder = tmp_path / "shipped"
    monkeypatch.setattr(loop_library, "_LIBRARIES", folder)
    loop_library.ship(folder, [platform_named("this")])
    return folder


def loaded(tmp_path: Path, *before: str) -> subprocess.CompletedProcess[str]:
    """Which library a process has loaded that finds a wheel's folder."""
    lines = [
        "from shaper_fmu.master import loop_library",
        "from pathlib import Path",
        f"loop_library._LIBRARIES = Path({str(tmp_path / 'shipped')!r})",
        *before,
        "loop_library.loop()",
        f"print([line.split()[-1] for line in open('/proc/self/maps') if {str(tmp_path)!r} in line][0])",
    ]
    return run("\n".join(lines), SHAPER_FMU_CACHE=str(tmp_path / "cache"))


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_wheels_library_is_used_as_long_as_it_belongs_to_the_sources(shipped, tmp_path):
    assert Path(loaded(tmp_path).stdout.strip()).parent == shipped
    assert not (tmp_path / "cache").exists()
    (shipped / "sources.txt").write_text("of other sources\n")
    assert Path(loaded(tmp_path).stdout.strip()).parent == tmp_path / "cache" / "loop"


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_where_a_wheels_library_cannot_be_loaded_another_one_is_built(shipped, tmp_path):
    for library in shipped.glob("*.so"):
        library.write_bytes(library.read_bytes()[:100])
    assert Path(loaded(tmp_path).stdout.strip()).parent == tmp_path / "cache" / "loop"
    nobody = "loop_library.has_toolchain = lambda: False; loop_library.shutil.which = lambda name: None"
    assert "carries the loop\n" in loaded(tmp_path, nobody).stderr
    assert ".so cannot be loaded: " in loaded(tmp_path, nobody).stderr


def test_the_answer_is_kept(monkeypatch):
    def find() -> None:
        raise BuildError("asked again")

    known = loop()
    monkeypatch.setattr(loop_library, "_shipped", find)
    assert loop() is known


@pytest.mark.skipif(sys.platform == "win32", reason="sem_wait is POSIX's")
def test_pythons_other_threads_run_while_the_loop_does():
    """An instance whose function is sem_wait, which only another thread ends. In a process of its own, which may hang."""
    code = f"import sys; sys.path[:0] = {sys.path!r}; import test_loop_library; test_loop_library.wait_for_another_thread()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (0, "ended\n"), done.stderr


def wait_for_another_thread() -> None:
    here, semaphore = CDLL(None), create_string_buffer(64)
    here.sem_init(semaphore, 0, 0)
    wait = cast(here.sem_wait, c_void_p).value
    transfers = np.array([(wait, addressof(semaphore), 2, of.F8, 0, 0, 0, 0, 0, 0, 0)], of.TRANSFER)
    layout = layout_with(transfers=transfers, initial_program=np.array([(of.SET, 0)], of.OPERATION))
    system, control, begun = of.addresses_of(layout), of.Control(), threading.Event()

    def work() -> None:
        begun.set()
        assert loop().exchange(system.ctypes.data, control, 0.0)

    loop()
    thread = threading.Thread(target=work)
    thread.start()
    begun.wait()
    here.sem_post(semaphore)
    thread.join()
    print("ended")


NO_NUMBA = """
import sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("numba", "llvmlite"):
            raise ImportError(f"{name} must not be loaded")
sys.meta_path.insert(0, Finder())
"""


@pytest.fixture(scope="module")
def without_numba(tmp_path_factory) -> Path:
    """A Python that refuses to load numba, and so do the processes that it starts; it has all other packages of this one."""
    folder = tmp_path_factory.mktemp("without_numba")
    venv.create(folder, with_pip=False, symlinks=True)
    (site,) = folder.glob("lib/python*/site-packages")
    (site / "no_numba.py").write_text(NO_NUMBA)
    others = [path for path in sys.path if path.endswith("-packages")]
    (site / "paths.pth").write_text("\n".join([str(ROOT), *others, "import no_numba", ""]))
    return folder / "bin" / "python"


STUDY = """
if __name__ == "__main__":
    import sys
    from shaper_fmu.metrics.peak import Peak
    from shaper_fmu.ssp.system import System
    from shaper_fmu.sweep.in_python import sweep_system
    from shaper_fmu.tune.identify.range import identify_plant

    system = System("swept")
    system.add("plant", files["MassSpringDamper"], force=100.0)
    asked = {"vary": {"plant.stiffness": [50.0, 100.0, 200.0]}, "metrics": {"peak": Peak("plant.position")}}
    for workers in (0, 2):
        print(sweep_system(system, f"{sys.argv[1]}/{workers}.sqlite", **asked, stop_time=1.0, step=0.01, workers=workers))
    print(identify_plant(files["MassSpringDamper"], "force", ["position"]).nominal.identification.modes[0].natural_frequency)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="the environment's folders are POSIX's")
def test_runs_sweeps_and_identification_need_no_numba(without_numba, numbers, tmp_path):
    """The FMUs are in the cache."""
    done = subprocess.run([without_numba, "-c", "import numba"], capture_output=True, text=True, check=False)
    assert "numba must not be loaded" in done.stderr
    done = subprocess.run([without_numba, "-c", program()], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, numbers), done.stderr
    (tmp_path / "study.py").write_text(program(code=STUDY))
    done = subprocess.run([without_numba, tmp_path / "study.py", tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    *swept, frequency = done.stdout.splitlines()
    assert swept == ["{'done': 3}"] * 2
    assert float(frequency) == pytest.approx(10.0, rel=1e-3)
