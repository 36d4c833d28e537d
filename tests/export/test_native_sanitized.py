"""All native tests again over libraries with AddressSanitizer and UndefinedBehaviorSanitizer, kernels included."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from native_host import ADDRESS, HOSTS, LAYER, THREAD, gcc, host_program, native_fmu, sanitized_library, token_of

from shaper_fmu.registry import components

NOT_HERE = (
    "test_native_sanitized.py",
    "test_native_platforms.py",
    "test_native_sources.py",
)  # the last two have libraries of their own


def runtime_of(name: str) -> str:
    """Where gcc keeps a sanitizer's library. Skips where there is none, but not in CI."""
    found = ""
    if shutil.which("gcc"):
        found = subprocess.run(["gcc", f"-print-file-name={name}"], capture_output=True, text=True, check=True).stdout.strip()
    if not os.path.isabs(found):
        missing = f"gcc with {name} is not installed, and only it compiles with sanitizers that a running Python can load"
        assert not os.environ.get("CI"), missing
        pytest.skip(missing)
    return found


def sanitized_environment(folder: Path) -> dict[str, str]:
    """The sanitizer is loaded before Python, which is not compiled with it, and with it the C++ library, whose exceptions it
    watches. Leaks are not looked for: Python leaves much behind when it ends, and test_memory_stays_flat finds those of a
    library. Nor are C++ objects deleted by another type: ecos does so, and our libraries have no C++."""
    options = f"detect_leaks=0:new_delete_type_mismatch=0:log_path={folder / 'report'}"
    loaded = f"{runtime_of('libasan.so')} {runtime_of('libstdc++.so')}"
    sanitizers = {"LD_PRELOAD": loaded, "ASAN_OPTIONS": options, "UBSAN_OPTIONS": "print_stacktrace=1"}
    return {**os.environ, **sanitizers, "SHAPER_FMU_TEST_SANITIZED": "1"}


def reports(folder: Path) -> str:
    return "\n".join(file.read_text() for file in sorted(folder.glob("report*")))


FILES = sorted(file.name for file in Path(__file__).parent.glob("test_native_*.py") if file.name not in NOT_HERE)


@pytest.mark.parametrize("name", FILES)
def test_all_native_tests_pass_under_the_sanitizers(name, tmp_path):
    """A run for each file: all in one would take longer than a test may, where the machine is slow."""
    file = Path(__file__).with_name(name)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-x", "-rs", str(file)]
    environment = sanitized_environment(tmp_path)
    done = subprocess.run(command, env=environment, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout[-5000:]}\n{done.stderr[-3000:]}\n{reports(tmp_path)[:5000]}"
    assert reports(tmp_path) == ""
    assert " passed" in done.stdout
    assert "test_native_sanitized.py alone" not in done.stdout  # test_the_sanitizer_is_there was not skipped


BROKEN = {
    "a record one byte too short": (
        "life.c", "calloc(model_exchange ? 4 : 2, size)", "calloc(1, size - 1)", "heap-buffer-overflow",
    ),
    "a kernel given the end of the record": (
        "life.c", "kernel_start(record, &fault)",
        "kernel_start(record + 2 * component.record_size - 8, &fault)", "heap-buffer-overflow(.|\n)*kernel_start",
    ),
    "a record freed twice": ("life.c", "free(instance->record);", "free(instance->record), free(instance->record);", "double-free"),
    "an index one too far": ("values.c", "k < component.variables; k++", "k <= component.variables; k++", "global-buffer-overflow|insufficient space"),
    "a shift out of the sign": ("states.c", "!(phase & (phase - 1))", "!(phase & (phase - 1)) && !(phase << 31)", "left shift"),
}  # fmt: skip
"""Faults put into a copy of the layer: its file, what stands there, what shall, and what the sanitizer must say."""


def broken_layer(folder: Path, file: str, old: str, new: str) -> Path:
    layer = folder / "layer"
    shutil.copytree(LAYER, layer, ignore=shutil.ignore_patterns("__pycache__"))
    text = (layer / file).read_text()
    assert old in text, f"{file} has changed: give another fault here"
    (layer / file).write_text(text.replace(old, new))
    return layer


def life_of_instances(library: Path, token: str, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Some instances are made, stepped, saved, restored and freed."""
    command = [host_program("memory.c"), library, "2", token, "100", "10"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("fault", BROKEN)
def test_the_sanitizers_see_a_fault(fault, tmp_path):
    file, old, new, words = BROKEN[fault]
    token = token_of(native_fmu("MassSpringDamper", 2))
    component = components()["MassSpringDamper"]
    environment = sanitized_environment(tmp_path)
    assert life_of_instances(sanitized_library(component, token, 2, ADDRESS), token, environment).returncode == 0
    library = sanitized_library(component, token, 2, ADDRESS, broken_layer(tmp_path, file, old, new))
    done = life_of_instances(library, token, environment)
    assert done.returncode != 0
    assert re.search(words, reports(tmp_path) + done.stderr)


def test_the_thread_sanitizer_sees_a_shared_variable(tmp_path):
    runtime_of("libtsan.so")
    token = token_of(native_fmu("MassSpringDamper", 2))
    layer = broken_layer(
        tmp_path,
        "life.c",
        "size_t size = (size_t)component.record_size;",
        "static volatile size_t size; size = component.record_size;",
    )
    library = sanitized_library(components()["MassSpringDamper"], token, 2, THREAD, layer)
    gcc([*THREAD, f"-I{HOSTS}", str(HOSTS / "threads.c"), "-o", str(tmp_path / "threads"), "-ldl", "-lm", "-lpthread"])
    command = [tmp_path / "threads", library, "2", token, "6", "1", "0", "1", "10"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "data race" in done.stderr
