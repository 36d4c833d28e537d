"""Studies that the tests of sweeps share: the crane's, and one of an FMU that does harm."""

from __future__ import annotations

import contextlib
from pathlib import Path

from harmful_fmu import HARM

from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep.runs import Run
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study, read_study

SYSTEMS = Path(__file__).parents[2] / "ssp"

CRANE = """
name = "small"
system = "crane.ssp"
stop_time = 24.0
step = 0.02
reference = "unshaped"

[vary."crane.initial_rope_length"]
nominal = 8.0
low = 6.4
high = 9.6
points = 3

[compare]
unshaped = { "shaper.shaper" = "none", "profile.distance" = 0.01 }
ZV = { "shaper.shaper" = "zv", "profile.distance" = 0.01 }
ZVD = { "shaper.shaper" = "zvd", "profile.distance" = 0.01 }

[metrics.residual_swing]
kind = "residual"
output = "crane.swing_angle"
command = "shaper.shaped_mean"

[metrics.peak_swing]
kind = "peak"
output = "crane.swing_angle"
"""

_HARMFUL_SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="harmful">
  <ssd:System name="root"><ssd:Elements>
    <ssd:Component name="x" type="application/x-fmu-sharedlibrary" source="resources/harmful.fmu"/>
  </ssd:Elements></ssd:System>
</ssd:SystemStructureDescription>
"""


def crane_study(folder: Path, fmus: Path, text: str = CRANE) -> Study:
    """The crane's archive and a study of it in this folder."""
    pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp")
    (folder / "study.toml").write_text(text)
    return read_study(folder / "study.toml")


def harmful_study(folder: Path, fmu: Path, harms: list[str], more: str = "", step: float = 0.01) -> Study:
    """Runs with the commands 1, 2, ... of an FMU whose harm in each run is told; the peak is the command times 1 s."""
    system = folder / "harmful"
    (system / "resources").mkdir(parents=True, exist_ok=True)
    (system / "SystemStructure.ssd").write_text(_HARMFUL_SYSTEM)
    (system / "resources" / "harmful.fmu").write_bytes(fmu.read_bytes())
    pack_ssp(system, folder)
    (folder / "study.toml").write_text(f"""
name = "harm"
system = "harmful.ssp"
stop_time = 1.0
step = {step}
{more}
[plan]
kind = "zip"
[vary."x.command"]
values = {[1.0 + i for i in range(len(harms))]}
[vary."x.harm"]
values = {[HARM.index(harm) for harm in harms]}
[metrics.peak]
kind = "peak"
output = "x.sum"
""")
    return read_study(folder / "study.toml")


def runs_of(store: Path) -> list[Run]:
    """All runs of a store."""
    with Store(store) as opened:
        return opened.runs()


def content(runs: list[Run]) -> list[tuple]:
    """What does not depend on how the runs were done."""
    return [(r.id, r.compared, tuple(r.varied.items()), r.status, tuple(r.metrics.items()), r.reason) for r in runs]


def workers_alive(parent: int) -> list[int]:
    """Children of a process that are no zombies and have the worker's code on their command line."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            if int(fields[1]) == parent and fields[0] != "Z" and b"sweep.worker" in (folder / "cmdline").read_bytes():
                found.append(int(folder.name))
    return found
