"""The generic C layer is C99 of the standard library alone: every compiler that is here takes it without a word, as C++ too."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest
from native_host import HEADERS, LAYER

CLANG = [sys.executable, "-m", "ziglang", "cc"]
WARNINGS = ["-Wall", "-Wextra", "-pedantic", "-Werror"]
COMPILERS = {
    "gcc": ["gcc", "-std=c99", *WARNINGS],
    "gcc as C++": ["g++", "-x", "c++", "-Wall", "-Wextra", "-Werror"],
    "clang": [*CLANG, "-target", "x86_64-linux-gnu.2.17", "-std=c99", *WARNINGS],
    "clang for 32-bit Linux": [*CLANG, "-target", "x86-linux-gnu", "-std=c99", *WARNINGS],
    "clang for 32-bit Windows": [*CLANG, "-target", "x86-windows-gnu", "-std=c99", *WARNINGS],
    "clang with musl": [*CLANG, "-target", "x86_64-linux-musl", "-std=c99", *WARNINGS],
    "gcc for Cortex-M4": ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-std=c99", *WARNINGS],
}


def compiler(name: str) -> list[str]:
    """The command of a compiler. Skips where it is not installed, but not in CI."""
    command = COMPILERS[name]
    if not shutil.which(command[0]):
        words = f"{command[0]} is not installed, which compiles the layer as {name}"
        assert not os.environ.get("CI"), words
        pytest.skip(words)
    return command


@pytest.mark.representatives(name=["gcc", "gcc as C++", "clang"])
@pytest.mark.parametrize("name", COMPILERS)
def test_the_layer_compiles_without_a_warning(name, tmp_path):
    for source in sorted(LAYER.glob("*.c")):
        if source.name == "windows.c":  # no part of the layer: it stands in for a C library
            continue
        command = [
            *compiler(name),
            "-O2",
            "-c",
            f"-I{LAYER}",
            "-isystem",
            str(HEADERS),
            str(source),
            "-o",
            str(tmp_path / "layer.o"),
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, ""), source.name


def test_memory_is_asked_for_by_instances_and_saved_states_alone():
    """On a controller nothing is allocated once an instance is there, but what FMI asks for: states that are saved."""
    users = {
        function
        for source in LAYER.glob("*.c")
        for body in re.split(r"\n(?=\w[^\n;]*\) \{\n)", source.read_text())
        if re.search(r"\b(malloc|calloc|realloc|strdup)\(", body)
        for function in re.findall(r"^\w[^\n]*?(\w+)\([^\n]*\) \{", body)
    }
    assert users == {"new_instance", "save_state", "deserialize_state"}
