"""All tests of containers again over libraries with AddressSanitizer and UndefinedBehaviorSanitizer, and threads under ThreadSanitizer."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from container_host import container_of, copied, library_of
from container_sources import changed_runtime, compiled_container
from native_host import ADDRESS, HOSTS, THREAD, gcc, host_program, token_of
from test_native_sanitized import reports, runtime_of, sanitized_environment

from shaper_fmu.container.interface import FIRST_REFERENCE

HERE = Path(__file__).parent
SUPPORT = HERE.parent / "support"
FILES = ("calls", "values", "states", "events", "faults", "places")
"""Of the tests of containers, those that reach all of the runtime: together they take minutes, and the others would take many."""


@pytest.mark.thorough
def test_container_tests_pass_under_the_sanitizers(tmp_path):
    files = [str(HERE / f"test_container_{name}.py") for name in FILES]
    more = {f"SHAPER_FMU_TEST_CONTAINER{fmi}": str(compiled_container(fmi, ADDRESS)) for fmi in (2, 3)} | {
        "PYTHONPATH": str(SUPPORT)
    }
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "no:cacheprovider",
        "-p",
        "sanitized_container",
        "-x",
        "-m",
        "not thorough",
        *files,
    ]
    environment = sanitized_environment(tmp_path) | more
    done = subprocess.run(command, env=environment, cwd=HERE.parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout[-5000:]}\n{done.stderr[-3000:]}\n{reports(tmp_path)[:5000]}"
    assert reports(tmp_path) == ""
    assert " passed" in done.stdout


BROKEN = {
    "an instance's memory too short": (
        "life.c", "calloc(1, sizeof *container)", "calloc(1, 64)", "heap-buffer-overflow|insufficient space",
    ),
    "a state freed twice": ("states.c", "free(state->inner);\n    free(state);", "free(state->inner);\n    free(state->inner);\n    free(state);", "double-free"),
    "a state that is used after its end": ("states.c", "*place = state->next;\n    *told = 0;\n    return destroy", "*told = 0;\n    return destroy", "heap-use-after-free"),
    "a state with room for less than it has": ("states.c", "malloc(state->size)", "malloc(state->size - 8)", "heap-buffer-overflow"),
    "an index one too far": ("file.c", "k < kind->fields; k++) {\n            const Field", "k <= kind->fields; k++) {\n            const Field", "global-buffer-overflow|heap-buffer-overflow|insufficient space"),
    "a shift out of the sign": ("life.c", "if ((int)container->phase & phases) return 1;", "if (1 << (31 + phases % 2) != 5 && (int)container->phase & phases) return 1;", "left shift|shift exponent"),
}  # fmt: skip
"""Faults put into a copy of the sources: the file, what stands there, what shall, and what the sanitizer must say."""


def life(library: Path, fmu: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Some instances of a container with this library are made, stepped, saved, restored and freed."""
    own = copied(fmu, folder / library.stem)
    library_of(own).write_bytes(library.read_bytes())
    command = [host_program("memory.c"), library_of(own), "2", token_of(fmu), "20", "5"]
    return subprocess.run(command, env=sanitized_environment(folder), capture_output=True, text=True, check=False)


@pytest.mark.representatives(fault=["an instance's memory too short"])
@pytest.mark.parametrize("fault", BROKEN)
def test_the_sanitizers_see_a_fault(fault, tmp_path):
    file, old, new, words = BROKEN[fault]
    fmu = container_of("shaped2", 2, tmp_path)
    assert life(compiled_container(2, ADDRESS), fmu, tmp_path).returncode == 0
    library = compiled_container(2, ADDRESS, changed_runtime(tmp_path, file, old, new))
    done = life(library, fmu, tmp_path)
    assert done.returncode != 0
    assert re.search(words, reports(tmp_path) + done.stderr)


# threads


def threads(library: Path, fmi: int, folder: Path) -> subprocess.CompletedProcess[str]:
    """Eight instances in threads at once, the host and the container's library under ThreadSanitizer."""
    fmu = container_of("mixed", fmi, folder)
    own = copied(fmu, folder / library.stem)
    library_of(own).write_bytes(library.read_bytes())
    gcc([*THREAD, f"-I{HOSTS}", str(HOSTS / "threads.c"), "-o", str(folder / "threads"), "-ldl", "-lm", "-lpthread"])
    quiet = folder / "loader.txt"  # its lock, which orders what it allocates and frees, is not seen
    quiet.write_text("race:ld-linux-x86-64.so.2\n")
    command = [folder / "threads", library_of(own), str(fmi), token_of(fmu), str(FIRST_REFERENCE[fmi]), "1", "-1", "0", "30"]
    environment = {**os.environ, "TSAN_OPTIONS": f"suppressions={quiet}:print_suppressions=0"}
    for _ in range(5):  # where it asks the loader about a race while another thread loads a library, both may wait without end
        with contextlib.suppress(subprocess.TimeoutExpired):
            return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=100)
    pytest.fail("the thread sanitizer waits without end, five times")


@pytest.mark.parametrize("fmi", [2, 3])
def test_instances_in_threads_share_no_memory(fmi, tmp_path):
    runtime_of("libtsan.so")
    done = threads(compiled_container(fmi, THREAD), fmi, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.split()) == 8 * 2 * 30


def test_the_thread_sanitizer_sees_a_shared_variable(tmp_path):
    runtime_of("libtsan.so")
    shared = changed_runtime(
        tmp_path,
        "stepping.c",
        "    control->warnings = 0;\n",
        "    static volatile int steps;\n    steps = steps + 1;\n    control->warnings = 0;\n",
    )
    done = threads(compiled_container(2, THREAD, shared), 2, tmp_path)
    assert done.returncode != 0
    assert "data race" in done.stderr
