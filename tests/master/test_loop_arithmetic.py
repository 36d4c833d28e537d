"""The guard of the arithmetic on both processors that have one: it sees each change, and puts the standard mode back."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from native_host import HOSTS

from shaper_fmu.master.loop_library import write_unit

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the programs are Linux's")

THIRD = 1.0 / 3.0
CHANGED = [
    ("0x1.5555555555555p-2", "0x1p-1059"), ("0x1.5555555555556p-2", "0x1p-1059"), ("0x1.5555555555555p-2", "0x1p-1059"),
]  # fmt: skip
"""One third rounded down, up and to zero, and twice a denormal number; the others are flushed."""


def printed(processor: str, optimized: str, folder: Path) -> list[list[str]]:
    """What the program prints on this processor, which qemu emulates where it is another one."""
    runner = [] if platform.machine() == processor else [shutil.which(f"qemu-{processor}") or ""]
    if runner == [""]:
        assert not os.environ.get("CI"), f"qemu-{processor} is not installed"
        pytest.skip(f"qemu-{processor} is not installed")
    _, includes = write_unit(folder)
    (folder / "program.c").write_text(f'#include "unit.c"\n#include "{HOSTS / "arithmetic.c"}"\n')
    command = [sys.executable, "-m", "ziglang", "cc", "-target", f"{processor}-linux-musl", "-static", optimized, "-std=c99"]
    headers = [f"-I{include}" for include in includes]
    subprocess.run([*command, *headers, str(folder / "program.c"), "-o", str(folder / "program")], check=True)
    done = subprocess.run([*runner, folder / "program"], capture_output=True, text=True, check=True)
    return [line.split() for line in done.stdout.splitlines()]


@pytest.mark.representatives(optimized=["-O2"], processor=["x86_64"])  # a first compilation for another takes most of a minute
@pytest.mark.parametrize("optimized", ["-O0", "-O2"])
@pytest.mark.parametrize("processor", ["x86_64", "aarch64"])
def test_the_guard_sees_each_change_and_puts_it_back(processor, optimized, tmp_path):
    rows = printed(processor, optimized, tmp_path)
    assert len(rows) == 6
    for _, _, put_back, kept, standard, still in rows:
        assert (float.fromhex(put_back), float.fromhex(kept)) == (THIRD, 2.0**-1059)
        assert (standard, still) == ("1", "0")
    assert [tuple(row[:2]) for row in rows[:3]] == CHANGED
    flushing = rows[3:6] if processor == "x86_64" else rows[3:4]
    assert {float.fromhex(row[1]) for row in flushing} == {0.0}
