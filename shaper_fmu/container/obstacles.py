"""What stands against packing a system into one FMU, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator

from shaper_fmu.container.platforms import common_platforms, platforms_of
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.signals import Table, TypedSignal
from shaper_fmu.master.structure import SystemStructure

VERSIONS = (2, 3)
_LIBRARIES = (".so", ".dll", ".dylib")
_MOST = 4
"""Files that are named in a message."""


def obstacles(system: SystemStructure, fmi: int) -> list[str]:
    """All reasons why a system cannot be packed for this version of FMI, beside those why it cannot be run (see its `check`)."""
    problems = [] if fmi in VERSIONS else [f"a container is of FMI 2.0 or 3.0 (fmi=2 or fmi=3), not {fmi!r}"]
    for name, fmu in system.fmus.items():
        problems += [f"{name}: {fmu.name} {reason}" for reason in _of_fmu(fmu)]
    problems += _of_signals(system)
    return problems + list(_of_platforms(system))


def _of_fmu(fmu: Fmu) -> Iterator[str]:
    if fmu.version == 1:
        yield "is of FMI 1.0, which a container cannot run: export it as FMI 2.0 or 3.0"
    elif fmu.exchanges_model:
        other = "use it by co-simulation" if "co_simulation" in fmu.interfaces else "export it for co-simulation"
        yield f"is used by model exchange, which needs the master's solver: {other}"


def _of_signals(system: SystemStructure) -> Iterator[str]:
    for port, signal in system.signals.items():
        if isinstance(signal, Table):
            continue
        if isinstance(signal, TypedSignal) and isinstance(signal.signal, Table):
            what = "a table of values that are not real numbers, which only the master reads: leave it free"
        else:
            what = "a function of Python, which a container does not have: give a table, or leave it free"
        yield f"{'.'.join(port)} is driven by {what}"


def _of_platforms(system: SystemStructure) -> Iterator[str]:
    found = {name: platforms_of(fmu) for name, fmu in system.fmus.items()}
    without = [name for name, platforms in found.items() if not platforms]
    for name in without:
        fmu = system.fmus[name]
        files = (path for path in (fmu.folder / "binaries").glob("*/*") if path.suffix in _LIBRARIES)
        there = sorted(path.relative_to(fmu.folder / "binaries").as_posix() for path in files)
        has = f"it has {', '.join(there[:_MOST])}{', ...' if len(there) > _MOST else ''}" if there else "it has none at all"
        yield f"{name}: {fmu.name} has no library {fmu.capabilities.modelIdentifier} for a platform that is known here; {has}"
    if found and not without and not common_platforms(system):
        each = "; ".join(f"{name} has {', '.join(platforms)}" for name, platforms in found.items())
        yield f"there is no platform for which all FMUs have a library: {each}"
