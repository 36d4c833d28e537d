"""The loop under AddressSanitizer and UndefinedBehaviorSanitizer, in runs of all kinds."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from loop_host import compile_loop
from native_host import ADDRESS
from test_native_sanitized import reports, sanitized_environment

from shaper_fmu.master.loop_library import LOOP

SUPPORT = Path(__file__).parents[1] / "support"
KINDS = (
    "clocks",
    "clocked_inputs",
    "enumeration_inputs",
    "fmi1",
    "guards",
    "linear_inputs",
    "loops",
    "master_fmi3",
    "metrics",
    "model_exchange_events",
    "model_exchange_loops",
    "step_control",
)
"""Files of tests whose systems are run, by what they are about."""


def checked(loop: Path, folder: Path, *chosen: str) -> subprocess.CompletedProcess[str]:
    """Tests in a process with the loop of these sources, which gcc has compiled with its sanitizers."""
    flags = ("-std=gnu11", "-g", "-O1", "-shared", "-fPIC", *ADDRESS)
    compile_loop(folder, f"-I{loop}", *flags, "-o", str(folder / "loop.so"))
    environment = sanitized_environment(folder)
    environment.pop("SHAPER_FMU_TEST_SANITIZED")
    environment |= {"SHAPER_FMU_TEST_LOOP": str(folder / "loop.so"), "PYTHONPATH": str(SUPPORT)}
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "sanitized_loop", "-x", *chosen]
    return subprocess.run(
        command, env={**os.environ, **environment}, cwd=SUPPORT.parents[1], capture_output=True, text=True, check=False
    )


def test_runs_of_all_kinds_are_clean(tmp_path):
    done = checked(LOOP, tmp_path, *[f"tests/master/test_{kind}.py" for kind in KINDS])
    assert done.returncode == 0, f"{done.stdout[-5000:]}\n{done.stderr[-3000:]}\n{reports(tmp_path)[:5000]}"
    assert reports(tmp_path) == ""
    assert "100%" in done.stdout


def test_the_sanitizers_see_a_fault(tmp_path):
    """Rows are one number too long."""
    broken = tmp_path / "broken"
    shutil.copytree(LOOP, broken)
    text = (LOOP / "steps.c").read_text()
    right, wrong = "< system->recorded.count; i++", "<= system->recorded.count; i++"
    assert right in text
    (broken / "steps.c").write_text(text.replace(right, wrong))
    done = checked(broken, tmp_path, "tests/master/test_metrics.py")
    assert done.returncode != 0
    assert "heap-buffer-overflow" in reports(tmp_path) + done.stderr
