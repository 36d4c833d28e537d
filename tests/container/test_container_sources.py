"""Compilers for all platforms have nothing to say of a container's sources."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from container_sources import sources
from native_host import HEADERS
from test_native_layer import CLANG, WARNINGS, compiler

from shaper_fmu.export.native.toolchain import PLATFORMS

MORE = ("-Wshadow", "-Wconversion", "-Wcast-align", "-Wcast-qual", "-Wwrite-strings", "-Wundef", "-Wpointer-arith")
NOT_OF_CLANG = (  # what -Weverything says against C99, the standard's own types, and plain arithmetic
    "declaration-after-statement", "padded", "unsafe-buffer-usage", "switch-default", "switch-enum", "covered-switch-default",
    "float-equal", "missing-prototypes", "cast-qual", "cast-function-type", "cast-function-type-strict", "format-nonliteral",
    "bad-function-cast", "disabled-macro-expansion", "reserved-macro-identifier", "reserved-identifier", "implicit-int-float-conversion",
    "double-promotion", "missing-field-initializers", "missing-variable-declarations", "unused-macros", "unknown-warning-option",
    "pre-c11-compat", "undef", "unused-parameter", "poison-system-directories", "c++-compat", "gnu-zero-variadic-macro-arguments",
    "implicit-void-ptr-cast", "tentative-definition-compat", "c11-extensions", "jump-misses-init", "dollar-in-identifier-extension", "comma",
)  # fmt: skip
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def said(command: list[str], fmi: int, folder: Path) -> str:
    """What a compiler says of all files."""
    files, includes = sources(folder, fmi)
    chosen = ["-isystem" + str(HEADERS) if include == f"-I{HEADERS}" else include for include in includes]
    options = ["-O1", "-shared", *([] if "windows" in str(command) else ["-fPIC", "-lm"]), "-o", "made.library"]
    done = subprocess.run([*command, *chosen, *files, *options], capture_output=True, text=True, check=False, cwd=folder)
    assert done.stderr or (folder / "made.library").exists()
    return done.stderr


@both_versions
def test_gcc_has_no_warning(fmi, tmp_path):
    assert said([*compiler("gcc"), *MORE], fmi, tmp_path) == ""


@both_versions
@pytest.mark.representatives(platform=["x86_64-linux"])  # a first one for Windows takes minutes
@pytest.mark.parametrize("platform", PLATFORMS)
def test_clang_has_no_warning_on_any_platform(platform, fmi, tmp_path):
    command = [
        *CLANG,
        "-target",
        PLATFORMS[platform].target,
        "-std=c99",
        *WARNINGS,
        *MORE,
        "-Wno-c11-extensions",
    ]  # of the C library's headers
    assert said(command, fmi, tmp_path) == ""


@both_versions
def test_clang_has_nothing_against_it_that_matters(fmi, tmp_path):
    command = [*CLANG, "-target", PLATFORMS["x86_64-linux"].target, "-std=c99", "-Weverything", "-Werror"]
    assert said([*command, *[f"-Wno-{name}" for name in NOT_OF_CLANG]], fmi, tmp_path) == ""
