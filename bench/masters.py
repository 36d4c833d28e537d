"""The compiled master against other masters that run the same system; see chain.py for it and peers.py for them."""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from statistics import median

from chain import STEP, STEPS, Ours, chain_archive
from harness import Measured, Row, alone, compared

NEEDED = 20.0
"""Least ratio to every master whose results come out."""

OUR_PASSES = 9
Choice = Callable[[dict[str, Measured], Measured], Measured]

CSV_ROUNDING = 0.5e-6
"""ecos writes six decimals."""


def master_vs_ecos(folder: Path) -> Row:
    """Against ecos in the faster of two ways: step by step from Python with all digits, or at once into its CSV file."""
    if reason := _absent("ecospy", "tbb"):
        return _without_peer("master_vs_ecos", folder, reason)

    def choose(answer: dict[str, Measured], ours: Measured) -> Measured:
        loop, table = answer["loop"], answer["table"]
        for a, b in zip(ours.results, table.results, strict=True):
            if not abs(a - b) <= 1.01 * CSV_ROUNDING:
                raise SystemExit(f"master_vs_ecos: ecos's table has {b}, ours is {a}")
        return Measured(min(loop.microseconds, table.microseconds), loop.results)

    return _against("master_vs_ecos", "ecos", folder, choose)


def master_vs_ecos_unrecorded(folder: Path) -> Row:
    """Against ecos that records nothing, which is less work than ours; only the last position is compared."""
    if reason := _absent("ecospy", "tbb"):
        return _without_peer("master_vs_ecos_unrecorded", folder, reason)

    def choose(answer: dict[str, Measured], ours: Measured) -> Measured:
        found = answer["unrecorded"]
        return Measured(found.microseconds, (*ours.results[:-1], *found.results))

    row = _against("master_vs_ecos_unrecorded", "ecos", folder, choose, needed=0.0)
    return Row(row.name, row.ours, row.peer, note="the peer gives no results but the last")


def master_vs_libcosim(folder: Path) -> Row:
    """Against libcosim with its observer of time series."""
    if reason := _absent("libcosimpy"):
        return _without_peer("master_vs_libcosim", folder, reason)
    return _against("master_vs_libcosim", "libcosim", folder, lambda answer, ours: answer["series"])


def master_vs_fmpy_loop(folder: Path) -> Row:
    """Against what a user would write with fmpy alone: set, step and get of each FMU, in Python."""
    return _against("master_vs_fmpy_loop", "fmpy_loop", folder, lambda answer, ours: answer["loop"])


def master_vs_fmpy_ssp(folder: Path) -> Row:
    """Against fmpy's own simulation of SSP archives."""
    return _against("master_vs_fmpy_ssp", "fmpy_ssp", folder, lambda answer, ours: answer["difference"])


def master_per_run(folder: Path) -> Row:
    """What a run of the compiled master takes whatever its length, in microseconds."""
    with Ours(chain_archive(folder)) as ours:
        return alone("master_per_run", lambda: [ours.per_run()], "a whole run of one step: reset, initialization, results")


MASTERS = (
    master_vs_ecos,
    master_vs_ecos_unrecorded,
    master_vs_libcosim,
    master_vs_fmpy_loop,
    master_vs_fmpy_ssp,
    master_per_run,
)


def _against(name: str, peer: str, folder: Path, choose: Choice, needed: float = NEEDED) -> Row:
    """Both in turn; `choose` (answer by way, ours) tells which of the peer's ways counts, and checks the others."""
    archive = chain_archive(folder)
    with Ours(archive) as simulation:

        def turns() -> list[Measured]:
            ours = _ours(simulation)
            return [ours, choose(_asked(peer, archive), ours)]

        return compared(name, turns, tolerance=1e-12, needed=needed)


def _ours(simulation: Ours) -> Measured:
    passes = [simulation.stepping() for _ in range(OUR_PASSES)]
    return Measured(median(one.microseconds for one in passes), passes[-1].results)


def _asked(peer: str, archive: Path) -> dict[str, Measured]:
    """What the peer gives in a process of its own. Ends the program with the peer's words if it fails."""
    answer = archive.with_name(f"{peer}.json")
    command = [sys.executable, str(Path(__file__).with_name("peers.py")), peer, str(archive), str(STEPS), repr(STEP), str(answer)]
    environment = dict(os.environ)
    if peer == "ecos":
        environment["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, [str(_tbb_folder()), environment.get("LD_LIBRARY_PATH", "")]))
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=archive.parent, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\nended with status {done.returncode}: {done.stdout}{done.stderr}")
    found = json.loads(answer.read_text())
    return {way: Measured(seconds * 1e6, tuple(positions)) for way, (seconds, positions) in found.items()}


def _tbb_folder() -> Path | None:
    """The folder of the library that the package tbb brings and ecos needs."""
    try:
        found = [file for file in distribution("tbb").files or [] if file.name == "libtbb.so.12"]
    except PackageNotFoundError:
        return None
    return Path(str(distribution("tbb").locate_file(found[0]))).resolve().parent if found else None


def _absent(*packages: str) -> str:
    """Why a master cannot run here, "" if it can."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return "not measured: run from the package's binaries for Linux on x86-64 only"
    missing = [name for name in packages if not (_tbb_folder() if name == "tbb" else importlib.util.find_spec(name))]
    return f"not measured: {' and '.join(missing)} not installed: pip install shaper-fmu[interop]" if missing else ""


def _without_peer(name: str, folder: Path, reason: str) -> Row:
    with Ours(chain_archive(folder)) as simulation:
        return alone(name, lambda: [_ours(simulation)], reason)
